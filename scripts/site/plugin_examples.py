"""Examples of the plugin reference. Each is one dictionary, which the site shows as Python and as XML.

Most are a part of the scene of the plugin's picture (`plugin_pictures`). EXAMPLES has the others: plugins without a picture, and
plugins whose picture needs too many numbers. `python/tests/test_site.py` loads each example in both forms.
"""

import tempfile
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import plugin_pictures

Plugin = dict[str, Any]
Schema = dict[str, Any]

WIDTH = 84
"""Longest line of an example in Python, in characters."""
ONLY_PYTHON = ("data", "faces", "grid", "vertex_positions", "vertex_color")
"""Parameters that hold arrays, which XML cannot."""

BROWN = {"type": "rgb", "value": [0.45, 0.3, 0.2]}
BLUE = {"type": "rgb", "value": [0.1, 0.2, 0.5]}
VIEW = {
    "type": "perspective",
    "fov": 40,
    "to_world": [{"lookat": {"origin": [0, 0, 5], "target": [0, 0, 0], "up": [0, 1, 0]}}],
}


def cube_around(size: float) -> list[Plugin]:
    """A transform of [0, 1]³ to a cube around the origin."""
    return [{"translate": [-0.5, -0.5, -0.5]}, {"scale": size}]


EXAMPLES: dict[str, Plugin] = {
    "bsdf.bumpmap": {
        "type": "bumpmap",
        "scale": 0.1,
        "texture": {"type": "bitmap", "filename": "heights.png", "raw": True},
        "bsdf": {"type": "diffuse"},
    },
    "bsdf.circular": {"type": "circular", "left_handed": True},
    "bsdf.normalmap": {
        "type": "normalmap",
        "normalmap": {"type": "bitmap", "filename": "normals.png", "raw": True},
        "bsdf": {"type": "roughplastic", "diffuse_reflectance": BROWN},
    },
    "bsdf.polarizer": {"type": "polarizer", "theta": 45},
    "bsdf.pplastic": {"type": "pplastic", "diffuse_reflectance": BLUE, "alpha": 0.1},
    "bsdf.principledthin": {
        "type": "principledthin",
        "base_color": BROWN,
        "roughness": 0.4,
        "diff_trans": 0.8,
    },
    "bsdf.retarder": {"type": "retarder", "theta": 45, "delta": 90},
    "film.hdrfilm": {
        "type": "hdrfilm",
        "width": 320,
        "height": 240,
        "pixel_format": "spectral",
        "wavelengths": [450, 532, 633],
        "rfilter": {"type": "gaussian"},
    },
    "integrator.aov": {
        "type": "aov",
        "aovs": "path_length:optical_length, deflection",
        "integrator": {"type": "path"},
    },
    "integrator.auto": {"type": "auto", "max_depth": 16},
    "integrator.depth": {"type": "depth"},
    "integrator.direct": {"type": "direct"},
    "integrator.moment": {"type": "moment", "integrator": {"type": "path"}},
    "integrator.ptracer": {"type": "ptracer", "max_depth": 16},
    "integrator.stokes": {"type": "stokes", "integrator": {"type": "path"}},
    "integrator.tagged": {
        "type": "tagged",
        "wavelength": 532e-6,
        "orders": 2,
        "integrator": {"type": "path"},
    },
    "integrator.volpath": {"type": "volpath", "max_depth": 64},
    "integrator.volpathmis": {"type": "volpathmis", "max_depth": 64},
    "medium.heterogeneous": {
        "type": "heterogeneous",
        "sigma_t": {"type": "gridvolume", "filename": "smoke.vol"},
        "scale": 4,
        "albedo": 0.9,
        "phase": {"type": "hg", "g": 0.6},
    },
    "medium.transparent": {"type": "transparent", "ior": {"type": "luneburg"}},
    "rfilter.box": {"type": "box"},
    "rfilter.catmullrom": {"type": "catmullrom"},
    "rfilter.gaussian": {"type": "gaussian", "stddev": 0.5},
    "rfilter.lanczos": {"type": "lanczos", "lobes": 3},
    "rfilter.mitchell": {"type": "mitchell", "B": 0.3333, "C": 0.3333},
    "rfilter.tent": {"type": "tent", "radius": 1},
    "sampler.halton": {"type": "halton", "sample_count": 64},
    "sampler.hammersley": {"type": "hammersley", "sample_count": 64},
    "sampler.independent": {"type": "independent", "sample_count": 64, "seed": 1},
    "sampler.ldsampler": {"type": "ldsampler", "sample_count": 64, "adaptive": True},
    "sampler.multijitter": {"type": "multijitter", "sample_count": 64},
    "sampler.orthogonal": {"type": "orthogonal", "sample_count": 64},
    "sampler.sobol": {"type": "sobol", "sample_count": 64},
    "sampler.stratified": {"type": "stratified", "sample_count": 64},
    "sensor.batch": {
        "type": "batch",
        "film": {"type": "hdrfilm", "width": 32, "height": 16},
        "left": {
            **VIEW,
            "to_world": [
                {
                    "lookat": {
                        "origin": [-0.1, 0, 5],
                        "target": [0, 0, 0],
                        "up": [0, 1, 0],
                    }
                }
            ],
        },
        "right": {
            **VIEW,
            "to_world": [
                {
                    "lookat": {
                        "origin": [0.1, 0, 5],
                        "target": [0, 0, 0],
                        "up": [0, 1, 0],
                    }
                }
            ],
        },
    },
    "sensor.distant": {
        "type": "distant",
        "direction": [0, 0, -1],
        "target": [0, 0, 0],
        "film": {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}},
    },
    "sensor.fluencemeter": {
        "type": "fluencemeter",
        "to_world": cube_around(2),
        "nx": 20,
        "ny": 20,
        "nz": 20,
    },
    "sensor.irradiancemeter": {"type": "irradiancemeter", "nu": 16, "nv": 16},
    "sensor.radiancemeter": {
        "type": "radiancemeter",
        "origin": [0, 0, 5],
        "direction": [0, 0, -1],
        "film": {
            "type": "hdrfilm",
            "width": 1,
            "height": 1,
            "rfilter": {"type": "box"},
        },
    },
    "sensor.telecentric": {
        "type": "telecentric",
        "acceptance_angle": 0.5,
        "focus_distance": 5,
        "knife_edge": [1, 0, 0],
        "to_world": [{"scale": [2, 2, 1]}, *VIEW["to_world"]],
        "film": {"type": "hdrfilm", "width": 32, "height": 32},
    },
    "shape.bsplinecurve": {
        "type": "bsplinecurve",
        "filename": "curves.txt",
        "bsdf": {"type": "diffuse", "reflectance": BROWN},
    },
    "shape.gltf": {
        "type": "gltf",
        "filename": "model.glb",
        "bsdf": {"type": "diffuse", "reflectance": BROWN},
    },
    "shape.hair": {
        "type": "hair",
        "filename": "strands.txt",
        "radius": 0.01,
        "bsdf": {"type": "diffuse", "reflectance": BROWN},
    },
    "shape.tetrahedra": {
        "type": "tetrahedra",
        "filename": "tetrahedra.jmsh",
        "1": {
            "type": "homogeneous",
            "sigma_s": 10,
            "sigma_a": 0.02,
            "phase": {"type": "hg", "g": 0.9},
            "ior": 1.37,
        },
    },
    "shape.labels": {
        "type": "labels",
        "filename": "labels.npy",
        "axis_order": "zyx",
        "surface": "voxels",
        "1": {
            "type": "homogeneous",
            "sigma_s": 10,
            "sigma_a": 0.02,
            "phase": {"type": "hg", "g": 0.9},
            "ior": 1.37,
        },
        "2": {
            "type": "homogeneous",
            "sigma_s": 20,
            "sigma_a": 0.2,
            "phase": {"type": "hg", "g": 0.9},
            "ior": 1.4,
        },
    },
    "shape.linearcurve": {
        "type": "linearcurve",
        "filename": "curves.txt",
        "bsdf": {"type": "diffuse", "reflectance": BROWN},
    },
    "shape.merge": {
        "type": "merge",
        "ball": {"type": "sphere", "radius": 0.5},
        "stand": {
            "type": "cylinder",
            "p0": [0, -1, 0],
            "p1": [0, -0.5, 0],
            "radius": 0.1,
        },
    },
    "shape.mesh": {
        "type": "mesh",
        "vertex_positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "faces": [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
        "bsdf": {"type": "dielectric", "int_ior": "bk7"},
    },
    "shape.obj": {
        "type": "obj",
        "filename": "model.obj",
        "to_world": [{"scale": 0.5}],
        "bsdf": {"type": "diffuse", "reflectance": BROWN},
    },
    "shape.ply": {
        "type": "ply",
        "filename": "model.ply",
        "face_normals": True,
        "bsdf": {"type": "diffuse", "reflectance": BROWN},
    },
    "shape.sdfgrid": {
        "type": "sdfgrid",
        "filename": "distances.vol",
        "to_world": cube_around(2),
        "bsdf": {"type": "diffuse"},
    },
    "shape.serialized": {
        "type": "serialized",
        "filename": "model.serialized",
        "shape_index": 1,
        "bsdf": {"type": "diffuse"},
    },
    "shape.shapegroup": {
        "type": "shapegroup",
        "ball": {"type": "sphere", "radius": 0.2},
        "stem": {"type": "cylinder", "p0": [0, -1, 0], "p1": [0, 0, 0], "radius": 0.05},
    },
    "spectrum.blackbody": {"type": "blackbody", "temperature": 2700},
    "spectrum.d65": {"type": "d65", "scale": 2},
    "spectrum.irregular": {
        "type": "irregular",
        "wavelengths": "400, 550, 700",
        "values": "0.1, 0.4, 0.2",
    },
    "spectrum.rawconstant": {"type": "rawconstant", "value": [0.2, 0.4, 0.1]},
    "spectrum.regular": {
        "type": "regular",
        "wavelength_min": 400,
        "wavelength_max": 700,
        "values": "0.1, 0.2, 0.4, 0.3",
    },
    "spectrum.srgb": {"type": "srgb", "color": {"type": "rgb", "value": "#a07850"}},
    "spectrum.uniform": {"type": "uniform", "value": 0.5},
    "texture.bitmap": {
        "type": "bitmap",
        "filename": "picture.png",
        "filter_type": "nearest",
        "to_uv": [{"scale": [1, -1, 1]}],
    },
    "texture.volume": {
        "type": "volume",
        "volume": {"type": "gridvolume", "filename": "smoke.vol"},
    },
    "volume.bspline": {
        "type": "bspline",
        "filename": "index.npy",
        "axis_order": "zyx",
        "placement": "nodes",
        "to_world": cube_around(2),
    },
    "volume.cauchy": {"type": "cauchy", "a": 1.5, "b": 0.004},
    "volume.constant": {"type": "constant", "value": 1.33},
    "volume.constvolume": {"type": "constvolume", "value": 0.9},
    "volume.gladstone_dale": {
        "type": "gladstone_dale",
        "filename": "density.npy",
        "axis_order": "zyx",
        "placement": "nodes",
        "wavelength": 532,
        "to_world": cube_around(2),
    },
    "volume.gridvolume": {
        "type": "gridvolume",
        "filename": "smoke.vol",
        "to_world": cube_around(2),
    },
    "volume.pressure": {
        "type": "pressure",
        "filename": "pressure.npy",
        "axis_order": "zyx",
        "placement": "nodes",
        "n0": 1.33,
        "dn_dp": 1.46e-10,
        "to_world": cube_around(2),
    },
    "volume.sellmeier": {
        "type": "sellmeier",
        "b1": 1.03961212,
        "c1": 0.00600069867,
        "b2": 0.231792344,
        "c2": 0.0200179144,
        "b3": 1.01046945,
        "c3": 103.560653,
    },
    "volume.standard_atmosphere": {"type": "standard_atmosphere", "wavelength": 550},
    "volume.transducer": {
        "type": "transducer",
        "aperture": "bowl",
        "radius": 30,
        "diameter": 20,
        "pressure": 1e5,
        "frequency": 1e6,
        "sound_speed": 1.48e6,
        "n0": 1.33,
        "dn_dp": 1.46e-10,
        "min": [-2, -2, 26],
        "max": [2, 2, 34],
    },
}


def example(name: str) -> Plugin:
    """Returns the example of a plugin, KIND.NAME: a dictionary as for `morgana.load_dict`."""
    if name in EXAMPLES:
        return EXAMPLES[name]
    kind, plugin = name.split(".")
    with tempfile.TemporaryDirectory() as folder:
        made = plugin_pictures.pictures(Path(folder)).get(f"{kind}-{plugin}")
        found = made and _found(made[1](), plugin)
    if not found:
        raise ValueError(f"{name} has no example: add one to EXAMPLES in scripts/site/plugin_examples.py")
    return found


def _found(part: Any, plugin: str) -> Plugin | None:
    """Returns the first object of a type in a part of a scene. Reconstruction filters have names of indices."""
    if isinstance(part, dict) and part.get("type") == plugin:
        # Parameters, then nested objects. A picture's film and sampler are no part of the example.
        own = sorted(part.items(), key=lambda item: isinstance(item[1], dict) and item[1]["type"] not in ("rgb", "spectrum"))
        return {"type": plugin, **{key: _relative(key, value) for key, value in own if key not in ("type", "film", "sampler")}}
    nested = [value for key, value in part.items() if key != "rfilter"] if isinstance(part, dict) else []
    inner = part if isinstance(part, list) else nested
    return next((found for value in inner if (found := _found(value, plugin))), None)


def _relative(key: str, value: Any) -> Any:
    """Returns a parameter, with the names of files without their folder."""
    if isinstance(value, dict):
        return {name: _relative(name, item) for name, item in value.items()}
    return Path(value).name if key == "filename" else value


def python(plugin: Plugin) -> str:
    """Returns an example as Python."""
    return _literal(plugin, "")


def _literal(value: Any, indent: str) -> str:
    line = repr(value).replace("'", '"')
    if len(indent) + len(line) <= WIDTH or not isinstance(value, (dict, list)):
        return line
    inner = indent + "    "
    if isinstance(value, dict):
        rows = [f'{inner}"{key}": {_literal(item, inner)},' for key, item in value.items()]
        return "\n".join(["{", *rows, indent + "}"])
    return "\n".join(["[", *(f"{inner}{_literal(item, inner)}," for item in value), indent + "]"])


def xml(name: str, plugin: Plugin, definitions: Schema) -> str | None:
    """Returns an example as XML; `None` if it has arrays, which XML cannot hold."""
    if any(key in ONLY_PYTHON for key in plugin):
        return None
    kind = name.split(".")[0]
    return _element(kind, "", plugin, definitions, "")


def whole(scene: Plugin, definitions: Schema) -> str:
    """Returns a scene as a file in XML."""
    objects = []
    for key, value in scene.items():
        if key != "type":
            kind = _kind("scene", value["type"], definitions)
            objects.append(_element(kind, "", value if key == kind else {"id": key, **value}, definitions, "  "))
    return "\n".join(['<scene version="3.0.0">', *objects, "</scene>"]) + "\n"


def _element(kind: str, role: str, plugin: Plugin, definitions: Schema, indent: str, parent: str = "") -> str:
    """Returns an object as an element."""
    # Spectra of surfaces are textures, as in the dictionaries for Mitsuba.
    tag = "texture" if kind == "spectrum" and parent == "bsdf" else kind
    properties = definitions[f"{kind}.{plugin['type']}"]["properties"]
    attributes = _attribute("name", role) + f' type="{plugin["type"]}"' + _attribute("id", plugin.get("id", ""))
    children = [
        _child(kind, key, value, properties.get(key, {}), definitions, indent + "  ")
        for key, value in plugin.items()
        if key not in ("type", "id")
    ]
    if not children:
        return f"{indent}<{tag}{attributes}/>"
    return "\n".join([f"{indent}<{tag}{attributes}>", *children, f"{indent}</{tag}>"])


def _child(parent: str, key: str, value: Any, schema: Schema, definitions: Schema, indent: str) -> str:
    """Returns a parameter or a nested object."""
    name = _attribute("name", key)
    if isinstance(value, list) and value and isinstance(value[0], dict):
        parts = [_part(part) for part in value]
        if len(parts) == 1:
            return f"{indent}<transform{name}>{parts[0]}</transform>"
        return "\n".join([f"{indent}<transform{name}>", *(f"{indent}  {part}" for part in parts), f"{indent}</transform>"])
    if not isinstance(value, dict):
        return f"{indent}<{_tag(value, schema)}{name} value={quoteattr(_text(value))}/>"
    if value["type"] == "ref":
        return f"{indent}<ref{name} id={quoteattr(value['id'])}/>"
    if value["type"] in ("rgb", "spectrum"):
        return f"{indent}<{value['type']}{name} value={quoteattr(_text(value['value']))}/>"
    kind = _kind(parent, value["type"], definitions)
    return _element(kind, "" if key == kind else key, value, definitions, indent, parent)


def _kind(parent: str, plugin: str, definitions: Schema) -> str:
    """Returns the kind of a plugin. A volume and a plugin of another kind share the names `constant` and `gaussian`."""
    kinds = {name.split(".")[0] for name in definitions if name.endswith(f".{plugin}")}
    if len(kinds) > 1:
        kinds = kinds & {"volume"} if parent in ("medium", "volume") else kinds - {"volume"}
    (kind,) = kinds
    return kind


def _tag(value: Any, schema: Schema) -> str:
    """Returns the element of a parameter's value."""
    if isinstance(value, bool):
        return "boolean"
    if isinstance(value, (str, list)):
        return "point" if isinstance(value, list) and "#/$defs/point" in str(schema) else "string"
    return "integer" if "'type': 'integer'" in str(schema) or "#/$defs/integer" in str(schema) else "float"


def _part(part: Plugin) -> str:
    """Returns a part of a transform."""
    (name, value), *_ = part.items()
    if name == "lookat":
        inner = " ".join(f'{key}="{_text(point)}"' for key, point in value.items())
    elif name == "rotate":
        inner = f'value="{_text(value["axis"])}" angle="{_text(value["angle"])}"'
    else:
        inner = f'value="{_text(value)}"'
    return f"<{name} {inner}/>"


def _text(value: Any) -> str:
    """Returns a value as text."""
    if isinstance(value, list):
        return ", ".join(_text(item) for item in value)
    if isinstance(value, bool):
        return str(value).lower()
    return str(value).removesuffix(".0") if isinstance(value, float) else str(value)


def _attribute(name: str, value: str) -> str:
    return f" {name}={quoteattr(value)}" if value else ""
