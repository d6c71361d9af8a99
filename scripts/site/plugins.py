"""The plugin reference, generated from the JSON Schema that the program prints, so that it always matches the program."""

import json
from typing import Any

import plugin_examples
import plugin_pictures
import program

PAGES = {
    "integrators": ("Integrators", ["integrator"]),
    "sensors": ("Sensors and meters", ["sensor"]),
    "film": ("Film, filters, samplers", ["film", "rfilter", "sampler"]),
    "shapes": ("Shapes", ["shape"]),
    "media": ("Media and phase functions", ["medium", "phase"]),
    "volumes": ("Indices and volumes", ["volume"]),
    "bsdfs": ("Bsdfs", ["bsdf"]),
    "textures": ("Textures", ["texture"]),
    "emitters": ("Emitters", ["emitter"]),
    "spectra": ("Spectra", ["spectrum"]),
}
"""Title and kinds of plugins of each page."""

HEADINGS = {"rfilter": "Reconstruction filters", "sampler": "Samplers", "film": "Film", "medium": "Media", "phase": "Phase functions"}
"""Headings of kinds that share a page."""

PROSE = {
    "integrator": "../../scene/integrator.md",
    "integrator.aov": "../../scene/quantities.md",
    "sensor": "../../scene/sensors.md",
    "sensor.distant": "../../scene/sensors.md#distant-sensors",
    "sensor.fluencemeter": "../../meters.md#parameters",
    "sensor.irradiancemeter": "../../meters.md#parameters",
    "film": "../../scene/film.md#layers-of-light",
    "rfilter": "../../scene/film.md",
    "sampler": "../../scene/sampler.md",
    "shape": "../../scene/shapes.md",
    "medium": "../../scene/media.md",
    "phase": "../../scene/phase-functions.md",
    "volume": "../../scene/ior.md",
    "volume.bspline": "../../scene/volumes.md",
    "volume.constvolume": "../../scene/volumes.md",
    "volume.gridvolume": "../../scene/volumes.md",
    "volume.acoustic": "../../scene/sound.md#sound-in-time",
    "volume.mode": "../../scene/sound.md#sound-in-time",
    "volume.transducer": "../../scene/sound.md#transducers",
    "volume.cauchy": "../../scene/ior.md#dispersion",
    "volume.sellmeier": "../../scene/ior.md#dispersion",
    "bsdf": "../../scene/bsdfs.md",
    "bsdf.principled": "../../scene/bsdfs.md#principled",
    "texture": "../../scene/textures.md",
    "emitter": "../../scene/emitters.md",
    "emitter.ies": "../../scene/emitters.md#photometric-files",
    "spectrum": "../../scene/spectra.md",
}
"""Address of the full description of a kind or plugin."""

TYPES = {
    "number": "float",
    "integer": "integer",
    "boolean": "boolean",
    "list": "list",
    "spectrum": "spectrum",
    "point": "point or vector",
    "transform": "transform",
}
"""Names that the manual uses for the schema's types of values."""

Schema = dict[str, Any]


def pages() -> dict[str, str]:
    """Returns the pages, by their address in the site."""
    definitions = json.loads(program.output("schema"))["$defs"]
    if orphans := plugin_pictures.orphans({name.replace(".", "-") for name in definitions}):
        raise ValueError(f"pictures of plugins and scripts/site/plugin_pictures.py differ: {', '.join(orphans)}")
    return {f"reference/plugins/{name}.md": page(*PAGES[name], definitions) for name in PAGES}


def page(title: str, kinds: list[str], definitions: Schema) -> str:
    """Returns a page on some kinds of plugins."""
    lines = [
        f"# {title}",
        "",
        "Look up what a plugin does, an example in XML and in Python, the parameters that it takes, and the kinds of plugins that it holds.",
        "The program writes this page (`morgana schema`). The links lead to the manual, which gives the details.",
    ]
    for kind in kinds:
        named = {name: schema for name, schema in definitions.items() if name.startswith(f"{kind}.")}
        if kind in HEADINGS:
            lines += ["", f"## {HEADINGS[kind]}"]
        for name, schema in named.items():
            lines += ["", *section(name, definitions, "###" if kind in HEADINGS else "##")]
    return "\n".join(lines) + "\n"


def section(name: str, definitions: Schema, mark: str) -> list[str]:
    """Returns the section on a plugin, from the schema."""
    kind, plugin = name.split(".")
    schema = definitions[name]
    prose = PROSE.get(name, PROSE[kind])
    lines = [f"{mark} {plugin}", "", f"{described(name, schema)} [Manual]({prose})"]
    required = schema["required"]
    if shown_by := plugin_pictures.caption(f"{kind}-{plugin}"):
        lines += ["", f"![{shown_by}](../../images/plugins/{kind}-{plugin}.png)", "", f"*{shown_by}.*"]
    lines += ["", *tabs(name, definitions)]
    own = {key: value for key, value in schema["properties"].items() if key not in ("type", "id")}
    if own:
        lines += ["", "| name | type | default | |", "|---|---|---|---|"]
        order = sorted(own, key=lambda key: key not in required)
        lines += [row(name, key, own[key], key in required) for key in order]
    nested = schema["additionalProperties"]
    if nested:
        lines += ["", f"Holds: {', '.join(f'`{kind}`' for kind in referred(nested).split('-or-'))}."]
    return lines


def tabs(name: str, definitions: Schema) -> list[str]:
    """Returns the example of a plugin, with a tab for each form."""
    example = plugin_examples.example(name)
    forms = {"XML": plugin_examples.xml(name, example, definitions), "Python": plugin_examples.python(example)}
    lines = []
    for form, text in forms.items():
        if text:
            lines += [f'=== "{form}"', "", *(f"    {line}" for line in [f"```{form.lower()}", *text.splitlines(), "```"]), ""]
    return lines


def row(plugin: str, key: str, schema: Schema, required: bool) -> str:
    """Returns a parameter's row of the table."""
    default = "required" if required else shown(schema)
    help = described(f"{plugin}.{key}", parameter_of(schema))
    return f"| `{key}` | {value_type(schema)} | {default} | {help} |"


def parameter_of(schema: Schema) -> Schema:
    """Returns the part of the schema that describes the parameter itself, if a plugin may replace
    its value."""
    ways = [way for way in schema.get("anyOf", []) if "description" in way]
    return ways[0] if ways else schema


def described(name: str, schema: Schema) -> str:
    """Returns a description. Fails without one, because the reference would be useless."""
    if not schema.get("description"):
        raise ValueError(f"the schema does not say what {name} is")
    return escaped(schema["description"])


def shown(schema: Schema) -> str:
    """Returns the default of a parameter, as text."""
    default = parameter_of(schema).get("default")
    if default is None or default == []:
        return ""
    return f"`{json.dumps(default)}`" if not isinstance(default, str) else f"`{default}`"


def value_type(schema: Schema) -> str:
    """Returns the type of a value in a word or two."""
    if "enum" in schema:
        return ", ".join(f"`{word}`" for word in schema["enum"])
    if "$ref" in schema:
        name = referred(schema)
        return TYPES.get(name, f"`{name}`")
    if "anyOf" in schema:
        ways = [value_type(way) for way in schema["anyOf"] if way.get("$ref") != "#/$defs/parameter"]
        return " or ".join(ways)
    return {"string": "string", "array": "array", "number": "float", "integer": "integer"}[schema["type"]]


def referred(schema: Schema) -> str:
    """Returns the name of the definition that a schema refers to."""
    return str(schema["$ref"]).removeprefix("#/$defs/")


def escaped(text: str) -> str:
    """Returns a text as a cell of a table."""
    return text.replace("|", "\\|").replace("*", "\\*").replace("_", "\\_").replace("<", "&lt;")
