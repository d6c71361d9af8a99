"""Writes aovs_mitsuba.csv: what the integrator `aov` of Mitsuba 3.9.1 (PyPI, scalar_rgb) finds along single rays in aovs_mitsuba.xml.

Each ray is the only pixel of an orthographic camera of width 2e-6. Run it beside the scene.
"""
import math
import re
import mitsuba as mi
import numpy as np

TYPES = ["albedo", "depth", "position", "uv", "geo_normal", "sh_normal", "dp_du", "dp_dv", "prim_index", "shape_index"]

mi.set_variant("scalar_rgb")
mi.set_log_level(mi.LogLevel.Error)
text = open("aovs_mitsuba.xml").read()
camera = re.compile(r"<sensor.*?</sensor>", re.S)
listed = ",".join(f"{name}:{name}" for name in TYPES)


def sensor(o, d):
    target = [a + b for a, b in zip(o, d)]
    return f"""<sensor type="orthographic"><float name="near_clip" value="1e-3"/>
    <transform name="to_world"><scale value="1e-6"/>
      <lookat origin="{o[0]}, {o[1]}, {o[2]}" target="{target[0]}, {target[1]}, {target[2]}" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="1"/><integer name="height" value="1"/><rfilter type="box"/></film>
    <sampler type="independent"><integer name="sample_count" value="1"/></sampler></sensor>
    <integrator type="aov"><string name="aovs" value="{listed}"/></integrator>"""


names = None
for i in range(19):
    for x, y, (a, b) in [(0.21, 0.33, (0.01, -0.02)), (-0.37, -0.15, (0.03, 0.01))]:
        o = [4.0 * i + x, y, -10.0]
        d = [v / math.sqrt(a * a + b * b + 1) for v in (a, b, 1.0)]
        open("one.xml", "w").write(camera.sub(sensor(o, d), text))
        scene = mi.load_file("one.xml", parallel=False, optimize=False)
        values = np.array(mi.render(scene, spp=1)).ravel()
        if names is None:
            names = scene.integrator().aov_names()
            print(",".join(["o.X", "o.Y", "o.Z", "d.X", "d.Y", "d.Z", *names]))
        values = values[-len(names):]
        print(",".join(f"{v:.9g}" for v in [*o, *d, *values]))
