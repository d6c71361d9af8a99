#!/usr/bin/env python3
"""Compares the efficiency of two builds of the program under environment maps and area lights.

Renders small scenes that it makes itself, and the example scene `mirage`, by both builds in turn
with several seeds. Prints a table in Markdown: variance and processor time of the first build over
those of the second, and their product, the gain in efficiency. The variance is taken over the
seeds, for each pixel relative to its squared mean plus a hundredth of the image's squared mean;
times are medians.

Usage: scripts/emitter_sampling.py OLD NEW [--integrator NAME] [--seeds N] [--samples N] [NAME ...]     (needs numpy)
"""

import argparse
import math
import os
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
HEAD = """<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="{depth}"/></integrator>
<sensor type="perspective"><float name="fov" value="{fov}"/>
<transform name="to_world"><lookat origin="{eye}" target="{at}" up="0,1,0"/></transform>
<film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="36"/><rfilter type="box"/></film>
<sampler type="independent"/></sensor>
"""
DIFFUSE = '<bsdf type="diffuse"><rgb name="reflectance" value="0.6,0.5,0.4"/></bsdf>'
BLACK = '<bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>'
NULL = '<bsdf type="null"/>'
LENS = '<volume name="ior" type="luneburg"/>'
GGX = '<string name="distribution" value="ggx"/>'
MAPS = ("sunny", "cloudy", "studio")


def write_pfm(path, image):
    height, width, _ = image.shape
    with open(path, "wb") as file:
        file.write(f"PF\n{width} {height}\n-1.0\n".encode())
        file.write(image[::-1].astype("<f4").tobytes())


def write_images(folder):
    """Writes a blue sky with clouds, the sky with a sun of 1.2°, soft boxes in the dark, and a
    panel with bright spots."""
    rng = np.random.default_rng(1)
    height, width = 256, 512
    y, x = np.mgrid[0:height, 0:width]
    theta, phi = np.pi * y / (height - 1), 2 * np.pi * (x + 0.5) / width
    directions = np.stack([np.sin(phi) * np.sin(theta), np.cos(theta), -np.cos(phi) * np.sin(theta)], -1)
    cap = lambda center, degrees: directions @ (np.array(center) / np.linalg.norm(center)) > math.cos(math.radians(degrees))
    waves = np.zeros((height, width))
    for _ in range(24):
        k, l = rng.integers(1, 9), rng.uniform(0.5, 6)
        waves += np.cos(2 * np.pi * (k * x / width + l * y / height + rng.uniform())) / math.sqrt(24) * 1.4
    blue = np.array([0.4, 0.6, 1.0]) * (0.5 + np.exp(0.8 * waves[..., None]))
    sky = np.where(np.cos(theta)[..., None] > 0, blue, np.array([0.12, 0.1, 0.08]))
    write_pfm(folder / "cloudy.pfm", sky)
    write_pfm(folder / "sunny.pfm", sky + cap([0.5, 0.6, 0.62], 1.2)[..., None] * np.array([3000, 2800, 2200]))
    boxes = [((0.3, 0.8, 0.5), 18, (20, 18, 15)), ((-0.8, 0.3, 0.4), 25, (4, 5, 8))]
    boxes += [((0.2, -0.5, -0.8), 20, (9, 9, 9)), ((0.9, 0.1, 0.3), 8, (40, 30, 20))]
    studio = np.full((height, width, 3), 0.03)
    for center, degrees, colour in boxes:
        studio += cap(center, degrees)[..., None] * np.array(colour, float)
    write_pfm(folder / "studio.pfm", studio)
    panel = np.full((128, 128, 3), 0.05)
    y, x = np.mgrid[0:128, 0:128]
    for _ in range(14):
        (u, v), r = rng.uniform(0.05, 0.95, 2) * 128, rng.uniform(3, 12)
        panel += (((x - u) ** 2 + (y - v) ** 2) < r * r)[..., None] * rng.uniform(1, 12) * rng.uniform(0.3, 1, 3)
    write_pfm(folder / "panel.pfm", panel)


def head(depth=2, fov=40, eye="0,3,6", at="0,0.5,0"):
    return HEAD.format(depth=depth, fov=fov, eye=eye, at=at)


def sky(name):
    return f'<emitter type="envmap"><string name="filename" value="{name}.pfm"/></emitter>'


def wall(placement, inside=DIFFUSE):
    return f'<shape type="rectangle"><transform name="to_world">{placement}</transform>{inside}</shape>'


def floor(bsdf):
    return wall('<scale value="20"/><rotate x="1" angle="-90"/>', bsdf)


def ball(inside, radius=1.0, y=1.0, x=0.0):
    return f'<shape type="sphere"><point name="center" x="{x}" y="{y}" z="0"/><float name="radius" value="{radius}"/>{inside}</shape>'


def metal(alpha):
    return f'<bsdf type="roughconductor">{GGX}<float name="alpha" value="{alpha}"/></bsdf>'


def plastic(alpha):
    diffuse = '<rgb name="diffuse_reflectance" value="0.5,0.2,0.1"/>'
    return f'<bsdf type="roughplastic">{GGX}<float name="alpha" value="{alpha}"/>{diffuse}</bsdf>'


def medium(sigma_t, g, index=""):
    numbers = f'<float name="sigma_t" value="{sigma_t}"/><float name="albedo" value="0.95"/>'
    phase = f'<phase type="hg"><float name="g" value="{g}"/></phase>'
    return f'{NULL}<medium name="interior" type="homogeneous">{numbers}{phase}{index}</medium>'


def light(y, radiance):
    placement = f'<scale x="1.5" y="1.5" z="1"/><rotate x="1" angle="90"/><translate y="{y}"/>'
    return wall(placement, f'{BLACK}<emitter type="area">{radiance}</emitter>')


def room():
    """Returns a room with a slit in one wall."""
    turns = ['<rotate x="1" angle="-90"/>', '<rotate x="1" angle="90"/><translate y="4"/>', '<translate z="-3"/>']
    turns.append('<rotate y="1" angle="90"/><translate x="-3"/>')
    parts = [f'<scale x="3" y="{h}" z="1"/><rotate y="1" angle="-90"/><translate x="3" y="{y}"/>' for h, y in ((1.2, 0.8), (0.6, 3.4))]
    return "".join(wall(f'<scale value="3"/>{turn}') for turn in turns) + "".join(map(wall, parts))


def scenes():
    bitmap = '<texture name="radiance" type="bitmap"><string name="filename" value="panel.pfm"/><boolean name="raw" value="true"/></texture>'
    uniform = '<rgb name="radiance" value="3"/>'
    surfaces = [("diffuse", DIFFUSE), ("plastic", plastic(0.15)), ("conductor 0.1", metal(0.1)), ("conductor 0.3", metal(0.3))]
    found = {}
    for name, bsdf in surfaces:
        for image in MAPS:
            found[f"{name}, {image}"] = head() + floor(bsdf) + ball(bsdf) + sky(image)
    for image in ("sunny", "cloudy"):
        balls = ball(DIFFUSE) + ball(DIFFUSE, 0.7, 0.7, 1.8)
        found[f"diffuse, depth 6, {image}"] = head(depth=6) + floor(DIFFUSE) + balls + sky(image)
        found[f"room, {image}"] = head(depth=5, eye="0,2,8", at="0,2,0") + room() + ball(plastic(0.2)) + sky(image)
    for g in (0, 0.5, 0.9):
        found[f"medium g = {g}, studio"] = head(depth=8) + ball(medium(2, g)) + sky("studio")
    lens = f'<shape type="sphere">{NULL}<medium name="interior" type="transparent">{LENS}</medium></shape>'
    close = head(fov=24, at="0,0,0") + lens
    for name, bsdf in (("diffuse", DIFFUSE), ("plastic", plastic(0.2))):
        for image in ("sunny", "studio"):
            found[f"{name} in a Luneburg lens, {image}"] = close + ball(bsdf, 0.3, 0) + sky(image)
    found["plastic in a Luneburg lens, panel"] = close + ball(plastic(0.2), 0.3, 0) + light(1.6, bitmap)
    for kind, radiance in (("panel", bitmap), ("plain light", uniform)):
        for name, bsdf in (("diffuse", DIFFUSE), ("plastic", plastic(0.1)), ("conductor 0.15", metal(0.15))):
            found[f"{name}, {kind}"] = head(eye="0,1.5,6") + floor(bsdf) + ball(bsdf, 0.6, 0.6) + light(2.2, radiance)
        found[f"diffuse, near {kind}"] = head(eye="0,0.6,3", at="0,0.2,0") + floor(DIFFUSE) + light(1.0, radiance)
    sun = '<emitter type="sunsky"><vector name="sun_direction" x="0.5" y="0.6" z="0.62"/></emitter>'
    for name, bsdf in (("diffuse", DIFFUSE), ("plastic", plastic(0.15))):
        found[f"{name}, sunsky"] = head(depth=4) + floor(bsdf) + ball(bsdf) + sun
    return {name: text + "</scene>" for name, text in found.items()}


def render(program, scene, samples, seed, options):
    """Returns the image and the processor time."""
    with tempfile.TemporaryDirectory() as folder:
        command = [program, "render", scene, "--quiet", "--threads", "1", "--spp", str(samples), "--seed", str(seed)]
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        subprocess.run([*command, "-o", folder + "/image.npy", *options], check=True, stderr=subprocess.DEVNULL)
        seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
        return np.load(folder + "/image.npy").astype(float), seconds


def row(name, scene, options, args):
    images, times = [[], []], [[], []]
    for seed in range(1, args.seeds + 1):
        for k, program in enumerate((args.old, args.new)):
            image, seconds = render(program, scene, args.samples, seed, [*options, "--integrator", args.integrator])
            images[k].append(image)
            times[k].append(seconds)
    images = np.array(images)
    squares = images.mean((0, 1)).mean(-1, keepdims=True) ** 2
    variances = [(several.var(0, ddof=1) / (squares + 0.01 * squares.mean())).mean() for several in images]
    variance, time = variances[0] / variances[1], statistics.median(times[0]) / statistics.median(times[1])
    print(f"| {name} | {variance:.2f} | {time:.2f} | {variance * time:.2f} |", flush=True)
    return math.log(variance * time)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("old", type=pathlib.Path)
    parser.add_argument("new", type=pathlib.Path)
    parser.add_argument("--integrator", default="path")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--samples", type=int, default=64, help="per pixel")
    parser.add_argument("names", nargs="*", metavar="NAME", help="scenes whose names begin so; all if none is given")
    args = parser.parse_intermixed_args()
    args.old, args.new = (os.path.abspath(program) for program in (args.old, args.new))
    print("| scene | variance | time | efficiency |")
    print("|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        write_images(folder)
        todo = []
        for name, text in scenes().items():
            path = folder / (name.replace(" ", "_") + ".xml")
            path.write_text(text)
            todo.append((name, path, []))
        todo.append(("mirage", ROOT / "scenes" / "mirage.xml", ["-D", "width=64", "-D", "height=32"]))
        wanted = [scene for scene in todo if not args.names or any(scene[0].startswith(n) for n in args.names)]
        gains = [row(*scene, args) for scene in wanted]
    print(f"| geometric mean | | | {math.exp(statistics.mean(gains)):.2f} |")


if __name__ == "__main__":
    sys.exit(main())
