#!/usr/bin/env python3
"""Compares Stokes parameters with Mitsuba 3.

The first scene has a tilted glass cube and a metal ball above a tilted metal plate, lit by an area
light. The second has a rough metal ball and plate below a polariser through which an area light
shines. Retarders at oblique incidence differ from Mitsuba's
(docs/scene/polarization.md#filters-of-polarised-light).

Both programs render 32 × 32 pixels in 16 batches. Blocks of 4 × 4 pixels are compared, after one
common factor for brightness (Mitsuba's spectral variant has its own colours). For each parameter,
the script prints its root mean square over the image. It also prints the root mean square and the
largest deviation in standard errors: about 1 and 3 if the renders agree.

Mitsuba comes from PyPI into target/mitsuba-venv, as for compare_mitsuba.py.

Usage: scripts/compare_stokes.py [PROGRAM]
"""

import pathlib
import subprocess
import sys
import tempfile

from compare_mitsuba import TARGET, Morgana, enter_environment

BATCHES, SAMPLES, SIZE, BLOCK = 16, 256, 32, 4
VIEW = """<scene version="3.0.0">
<integrator type="stokes"><integrator type="path"><integer name="max_depth" value="8"/></integrator></integrator>
<sensor type="perspective"><float name="fov" value="38"/>
<transform name="to_world"><lookat origin="0.4,1.5,6" target="0,0.2,0" up="0.1,1,0"/></transform>
<sampler type="independent"/><film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/>
<string name="pixel_format" value="luminance"/><rfilter type="box"/></film></sensor>
"""
LIGHT = """<shape type="rectangle"><transform name="to_world"><scale value="3"/><rotate x="1" angle="90"/>
<translate x="-1" y="4" z="1"/></transform>
<emitter type="area"><spectrum name="radiance" value="1"/></emitter></shape>
"""
GLASS_AND_METAL = """<shape type="cube"><transform name="to_world"><scale value="0.7"/>
<rotate x="0.6" y="0.64" z="0.48" angle="38"/><translate x="-1.2" y="0.3" z="0.3"/></transform>
<bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1.0"/></bsdf></shape>
<shape type="sphere"><point name="center" x="1.2" y="0" z="0"/><float name="radius" value="0.9"/>
<bsdf type="conductor"><spectrum name="eta" value="0.9"/><spectrum name="k" value="1.7"/></bsdf></shape>
<shape type="rectangle"><transform name="to_world"><scale value="3"/><rotate x="1" angle="-75"/><rotate y="1" angle="20"/>
<translate y="-1.3"/></transform>
<bsdf type="conductor"><spectrum name="eta" value="0.5"/><spectrum name="k" value="2.7"/></bsdf></shape>
"""
BELOW_A_FILTER = """<shape type="rectangle"><transform name="to_world"><scale value="3.4"/><rotate x="1" angle="90"/><translate x="-1" y="3.7" z="1"/></transform>
<bsdf type="polarizer"><spectrum name="theta" value="25"/></bsdf></shape>
<shape type="sphere"><point name="center" x="0.3" y="0.2" z="0"/><float name="radius" value="1.2"/>
<bsdf type="roughconductor"><float name="alpha" value="0.2"/><string name="distribution" value="ggx"/><spectrum name="eta" value="0.9"/>
<spectrum name="k" value="1.7"/></bsdf></shape>
<shape type="rectangle"><transform name="to_world"><scale value="3"/><rotate x="1" angle="-75"/><rotate y="1" angle="20"/>
<translate y="-1.3"/></transform>
<bsdf type="roughconductor"><float name="alpha" value="0.3"/><string name="distribution" value="beckmann"/><spectrum name="eta" value="0.5"/>
<spectrum name="k" value="2.7"/></bsdf></shape>
"""
SCENES = {"glass and metal": GLASS_AND_METAL, "rough metal below a polariser": BELOW_A_FILTER}


def of_morgana(program, scene, folder, seed):
    """Returns Stokes parameters, (4, height, width)."""
    import numpy

    image = folder / "image.npy"
    command = [program, "render", scene, "--quiet", "-o", image, "--spp", str(SAMPLES), "--seed", str(seed)]
    subprocess.run(command, check=True)
    return numpy.moveaxis(numpy.load(image)[..., 0], -1, 0)


def of_mitsuba(scene, seed):
    """Returns Stokes parameters of the green channel, (4, height, width)."""
    import mitsuba
    import numpy

    image = numpy.array(mitsuba.render(scene, seed=seed, spp=SAMPLES))
    return numpy.moveaxis(image[..., -12:][..., 1::3], -1, 0)


def blocks(images):
    """Returns means of blocks of pixels, and their standard errors."""
    import numpy

    count = SIZE // BLOCK
    means = numpy.stack(images).reshape(BATCHES, 4, count, BLOCK, count, BLOCK).mean((3, 5))
    return means.mean(0), means.std(0, ddof=1) / BATCHES**0.5


def main():
    enter_environment()
    import mitsuba

    program = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else TARGET / "release" / "morgana"
    if len(sys.argv) < 2:
        Morgana.build()
    mitsuba.set_variant("scalar_spectral_polarized")
    for name, objects in SCENES.items():
        print(f"| {name} | root mean square | deviations, root mean square | largest |\n|---|---|---|---|")
        compare(program, VIEW + objects + LIGHT + "</scene>")


def compare(program, text):
    """Prints a row for each parameter of a scene."""
    import mitsuba
    import numpy

    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        path = folder / "scene.xml"
        path.write_text(text)
        ours, our_errors = blocks([of_morgana(program, path, folder, seed) for seed in range(BATCHES)])
        scene = mitsuba.load_string(text)
        theirs, their_errors = blocks([of_mitsuba(scene, seed) for seed in range(BATCHES)])
    factor = ours[0].mean() / theirs[0].mean()
    for k in range(4):
        errors = numpy.hypot(our_errors[k], factor * their_errors[k])
        lit = errors > 1e-7
        z = (ours[k] - factor * theirs[k])[lit] / errors[lit]
        print(f"| S{k} | {(ours[k] ** 2).mean() ** 0.5:.4f} | {(z**2).mean() ** 0.5:.2f} | {abs(z).max():.1f} |")


if __name__ == "__main__":
    main()
