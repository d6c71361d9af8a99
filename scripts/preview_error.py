#!/usr/bin/env python3
"""Compares the first seconds of the integrators preview and auto in media that scatter often.

Prints the median relative error of blocks of 8 x 8 pixels after several run times: the medians over
three seeds. References are renders by particle. Needs the Python package of morgana.

Usage: scripts/preview_error.py [--program target/release/morgana] [--reference 75s]
"""

import argparse
import pathlib
import subprocess
import tempfile

import morgana
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
TIMES = ("0.25s", "0.5s", "1s", "2s", "4s")
SIDE = 8

TISSUE = """
  <medium id="tissue" type="homogeneous"><float name="sigma_s" value="5"/><float name="sigma_a" value="0.02"/>
    <phase type="hg"><float name="g" value="0.8"/></phase>
    <volume name="ior" type="selfoc"><float name="n0" value="1.37"/><float name="alpha" value="0.05"/></volume></medium>
  <shape type="cube"><transform name="to_world"><scale x="6" y="5" z="5"/><translate z="-5"/></transform>
    <bsdf type="null"/><ref name="interior" id="tissue"/></shape>
  <emitter type="collimated"><transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
    <float name="radius" value="2"/><float name="power" value="100"/></emitter>"""
MILK = """
  <medium id="milk" type="homogeneous"><float name="sigma_s" value="20"/><rgb name="sigma_a" value="0.02,0.05,0.1"/>
    <phase type="hg"><float name="g" value="0.7"/></phase></medium>
  <shape type="sphere"><bsdf type="null"/><ref name="interior" id="milk"/></shape>
  <shape type="rectangle"><transform name="to_world"><scale value="6"/><translate z="-1"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.4,0.4,0.4"/></bsdf></shape>
  <emitter type="spot"><transform name="to_world"><lookat origin="3,-2,4" target="0,0,0" up="0,0,1"/></transform>
    <float name="cutoff_angle" value="25"/><rgb name="intensity" value="60,60,60"/></emitter>"""
SCENES = {
    "tissue in a beam": (TISSUE, 40, "0,-30,18", "0,0,-2"),
    "ball of milk": (MILK, 30, "0,-5,2.2", "0,0,0"),
}
"""Content of each scene, with field of view, place and target of the camera."""


def scene(content, fov, origin, target):
    return f"""<scene version="3.0.0"><integrator type="auto"/>
  <sensor type="perspective"><float name="fov" value="{fov}"/>
    <transform name="to_world"><lookat origin="{origin}" target="{target}" up="0,0,1"/></transform>
    <film type="hdrfilm"><integer name="width" value="240"/><integer name="height" value="160"/></film></sensor>{content}
</scene>"""


def render(program, file, integrator, time, seed):
    """Returns the means of blocks of a picture, or None if the time was too short for a sample."""
    output = file.with_suffix(".exr")
    output.unlink(missing_ok=True)
    command = [program, "render", file, "--integrator", integrator, "--time", time, "--seed", str(seed), "-o", output, "-q"]
    subprocess.run(command, check=False, capture_output=True)
    picture = np.asarray(morgana.read(output), dtype=float).mean(axis=-1)
    height, width = (n // SIDE for n in picture.shape)
    blocks = picture[: height * SIDE, : width * SIDE].reshape(height, SIDE, width, SIDE).mean(axis=(1, 3))
    return blocks if blocks.any() else None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "target/release/morgana")
    parser.add_argument("--reference", default="75s", help="run time of each reference")
    arguments = parser.parse_args()
    program = arguments.program.resolve()
    with tempfile.TemporaryDirectory() as folder:
        for name, content in SCENES.items():
            file = pathlib.Path(folder) / "scene.xml"
            file.write_text(scene(*content))
            reference = render(program, file, "particle", arguments.reference, 99)
            is_lit = reference > 0.1 * reference.mean()
            for integrator in ("auto", "preview"):
                errors = []
                for time in TIMES:
                    found = [render(program, file, integrator, time, seed) for seed in (1, 2, 3)]
                    relative = [np.inf if blocks is None else np.median(np.abs(blocks[is_lit] / reference[is_lit] - 1)) for blocks in found]
                    errors.append(f"{time} {np.median(relative):.2f}")
                print(f"{name}, {integrator}: {', '.join(errors)}", flush=True)


if __name__ == "__main__":
    main()
