#!/usr/bin/env python3
"""Compares the efficiency, 1/(variance × processor time), of two builds of the program.

Renders the example scenes in small, and two scenes with many lights that it makes itself, by both
builds in turn with several seeds. Prints a table in Markdown: variance and time of the first build
over those of the second, and their product, the gain in efficiency. The variance is the variance of
the image's mean, which the report of a render states. All values are medians over the seeds.

Usage: scripts/variance.py OLD NEW [--seeds N] [--samples N] [SCENE ...]
"""

import argparse
import json
import math
import pathlib
import random
import resource
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Options that make the example scenes small; scenes without scattering are left out.
EXAMPLES = {
    "acoustic_waveguide": ["-D", "width=80", "-D", "height=52"],
    "aquarium_laser": ["-D", "width=96", "-D", "height=30"],
    "luneburg_fog": ["-D", "width=84", "-D", "height=50"],
    "mirage": ["-D", "width=96", "-D", "height=48"],
}
HEAD = """<scene version="3.0.0">
  <integrator type="path"><integer name="max_depth" value="{depth}"/></integrator>
  <sensor type="perspective"><float name="fov" value="{fov}"/>
    <transform name="to_world"><lookat origin="{eye}" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="48"/></film>
  </sensor>
"""
WALL = """  <shape type="rectangle"><transform name="to_world"><scale x="6" y="6" z="1"/>{turn}</transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.6"/></bsdf></shape>
"""
LIGHT = """  <shape type="rectangle"><transform name="to_world"><scale value="0.05"/><rotate x="1" angle="90"/>
    <translate x="{}" y="{}" z="{}"/></transform><bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="{}"/></emitter></shape>
"""
POINT = """  <emitter type="point"><point name="position" x="{}" y="{}" z="{}"/><rgb name="intensity" value="{}"/></emitter>
"""
FOG = """  <shape type="sphere"><bsdf type="null"/><medium name="interior" type="homogeneous">
    <float name="sigma_t" value="0.5"/><float name="albedo" value="0.9"/><phase type="hg"><float name="g" value="0.6"/></phase>
    <volume name="ior" type="luneburg"/>
  </medium></shape>
"""


def hall(rng):
    """Returns a hall with 400 small lights at several heights, seen from above them, so that none
    is in direct view."""
    turns = ['<rotate x="1" angle="-90"/><translate y="-2"/>', '<rotate x="1" angle="90"/><translate y="2"/>']
    turns += ['<translate z="-6"/>', '<rotate y="1" angle="90"/><translate x="-6"/>']
    text = HEAD.format(depth=4, fov=60, eye="0, 1.97, 5.9") + "".join(WALL.format(turn=t) for t in turns)
    place = lambda: (rng.uniform(-5.8, 5.8), rng.uniform(-1.5, 1.9), rng.uniform(-5.8, 5.8))
    return text + "".join(LIGHT.format(*place(), 10 ** rng.uniform(1, 3)) for _ in range(400)) + "</scene>"


def lanterns(rng):
    """Returns a ball of fog that bends light, among 60 point lights."""
    text = HEAD.format(depth=4, fov=35, eye="0, 0, 4") + FOG
    for _ in range(60):
        x = [rng.gauss(0, 1) for _ in range(3)]
        r = rng.uniform(1.05, 4) / math.hypot(*x)
        text += POINT.format(*(c * r for c in x), 10 ** rng.uniform(-1, 1))
    return text + "</scene>"


def render(program, scene, options):
    """Returns the mean, the variance of the image's mean, and the processor time."""
    with tempfile.TemporaryDirectory() as folder:
        stats = pathlib.Path(folder, "stats.json")
        command = [program, "render", scene, "--quiet", "--threads", "1", "--stats", stats, "-o", folder + "/image.npy"]
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        subprocess.run([*command, *options], check=True, stderr=subprocess.DEVNULL)
        seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
        report = json.loads(stats.read_text())
    return report["mean"], report["standard_error"] ** 2, seconds


def row(name, scene, options, args):
    runs = [[], []]
    for seed in range(1, args.seeds + 1):
        for program, several in zip((args.old, args.new), runs):
            several.append(render(program, scene, [*options, "--spp", str(args.samples), "--seed", str(seed)]))
    ratio = [statistics.median(r[k] for r in runs[0]) / statistics.median(r[k] for r in runs[1]) for k in (1, 2)]
    means = [statistics.mean(r[0] for r in several) for several in runs]
    error = math.sqrt(sum(r[1] for several in runs for r in several)) / args.seeds
    z = (means[0] - means[1]) / error if error > 0 else 0.0
    return f"| {name} | {ratio[0]:.2f} | {ratio[1]:.2f} | {ratio[0] * ratio[1]:.2f} | {z:+.1f} |"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("old", type=pathlib.Path)
    parser.add_argument("new", type=pathlib.Path)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--samples", type=int, default=16, help="per pixel")
    parser.add_argument("scenes", nargs="*", type=pathlib.Path, metavar="SCENE", help="others than the usual ones")
    args = parser.parse_intermixed_args()
    print("| scene | variance | time | efficiency | difference of the means over its error |")
    print("|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        scenes = [(path.stem, path, EXAMPLES.get(path.stem, [])) for path in args.scenes]
        if not scenes:
            scenes = [(name, ROOT / "scenes" / f"{name}.xml", options) for name, options in EXAMPLES.items()]
            for make in (hall, lanterns):
                path = pathlib.Path(folder, make.__name__ + ".xml")
                path.write_text(make(random.Random(1)))
                scenes.append((make.__name__, path, []))
        for scene in scenes:
            print(row(*scene, args), flush=True)


if __name__ == "__main__":
    sys.exit(main())
