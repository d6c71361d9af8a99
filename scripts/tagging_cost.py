"""CPU time of renders of tagged light over that of renders without tagging, for bent and for straight rays.

    PYTHON scripts/tagging_cost.py --rounds 5

Both take turns, on one thread; the table of docs/performance.md has medians of their ratios. One
ball is of tissue, where light is scattered twenty times within a wavelength of the sound. The other
is of haze, with a mean free path of more than half a wavelength; most particles from its middle
reach the meter on its surface.
"""

import argparse
import statistics
import time
import warnings
from typing import NamedTuple

import morgana
import numpy as np

RADIUS = 2.0
N0, CONTRAST, ELASTO_OPTIC, PRESSURE = 1.33, 1e-5, 0.32, 1e5
LOOK = [{"lookat": {"origin": [0, 0, -8], "target": [0, 0, 0], "up": [0, 1, 0]}}]
FILM = {"type": "hdrfilm", "width": 40, "height": 40, "pixel_format": "luminance"}
TAGGED = {"tagged": True, "wavelength": 500e-6}


class Ball(NamedTuple):
    """Content of the ball, and the numbers of samples of a pixel and of particles that measure the
    cost along bent rays; along straight rays four times as many."""

    sigma_t: float
    albedo: float
    g: float
    sound_wavelength: float
    samples: int
    particles: int


BALLS = {"tissue": Ball(14.0, 0.999, 0.9, 1.4, 3, 5_000), "haze": Ball(2.5, 0.99, 0.8, 0.7, 16, 25_000)}


def modes(wavelength):
    wave_number = 2 * np.pi / wavelength
    return {"type": "acoustic", "n0": N0, "amplitude": CONTRAST, "wave_number": wave_number, "elasto_optic": ELASTO_OPTIC}


def samples(wavelength):
    """Returns a plane wave, ten samples to a wavelength."""
    count = round(20 * RADIUS / wavelength)
    x = RADIUS * ((2 * np.arange(count) + 1) / count - 1)
    wave = np.exp(2j * np.pi * x / wavelength).astype(np.complex64)
    return {
        "type": "pressure",
        "data": np.broadcast_to(PRESSURE * wave, 3 * [count]).copy(),
        "placement": "centers",
        "to_world": [{"scale": 2 * RADIUS}, {"translate": 3 * [-RADIUS]}],
        "frequency": 1e6,
        "sound_speed": 1e6 * wavelength,
        "n0": N0,
        "dn_dp": CONTRAST / PRESSURE,
        "elasto_optic": ELASTO_OPTIC,
    }


def scene(what, ball, sound, bending, tagged):
    medium = {"type": "homogeneous", "sigma_t": ball.sigma_t, "albedo": ball.albedo, "phase": {"type": "hg", "g": ball.g}}
    interior = medium | {"ior": sound(ball.sound_wavelength)}
    ball = {"type": "sphere", "radius": RADIUS, "bsdf": {"type": "null"}, "interior": interior}
    sampler = {"type": "independent", "bending": bending}
    meter_tags = TAGGED if tagged and what == "fluence" else {}
    light = {"type": "point", "position": [0, 0, 0], "intensity": 1.0}
    if what == "pictures":
        path = {"type": "path"}
        integrator = {"type": "tagged", "wavelength": 500e-6, "orders": 2, "integrator": path} if tagged else path
        sensor = {"type": "perspective", "fov": 40, "to_world": LOOK, "film": FILM, "sampler": sampler}
        others = {"sensor": sensor, "light": {"type": "constant", "radiance": 1.0}}
    elif what == "records":
        integrator = {"type": "particle"}
        meter = {"type": "irradiancemeter", "records": True, "max_records": 2_000_000, "sampler": sampler}
        ball["meter"] = meter | ({"tagged": True} if tagged else {})
        others = {"light": light}
    else:
        integrator = {"type": "particle"}
        cells = {"nx": 20, "ny": 20, "nz": 20, "to_world": [{"scale": 2 * RADIUS}, {"translate": 3 * [-RADIUS]}]}
        others = {"light": light, "meter": {"type": "fluencemeter", "sampler": sampler} | cells | meter_tags}
    return morgana.load_dict({"type": "scene", "integrator": integrator, "ball": ball} | others)


def seconds(what, loaded, count, seed):
    begin = time.process_time()
    if what == "pictures":
        morgana.render(loaded, spp=count, seed=seed, threads=1)
    else:
        morgana.render(loaded, particles=count, seed=seed, threads=1)
    return time.process_time() - begin


def ratio(what, ball, sound, bending, rounds):
    plain, tagged = (scene(what, ball, sound, bending, tags) for tags in (False, True))
    count = (ball.samples if what == "pictures" else ball.particles) * (1 if bending else 4)
    pairs = [(seconds(what, tagged, count, seed), seconds(what, plain, count, seed)) for seed in range(rounds)]
    return statistics.median(a / b for a, b in pairs)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    rounds = parser.parse_args().rounds
    warnings.simplefilter("ignore", morgana.SceneWarning)
    columns = [(ball, sound) for ball in BALLS.values() for sound in (modes, samples)]
    titles = [f"{name}, {sound}" for name in BALLS for sound in ("modes", "samples")]
    print(f"| | {' | '.join(titles)} |\n|{'---|' * 5}")
    for bending in (True, False):
        for what in ("pictures", "records", "fluence"):
            name = "fluence in 8000 cells" if what == "fluence" else what
            found = [ratio(what, ball, sound, bending, rounds) for ball, sound in columns]
            numbers = " | ".join(f"{ratio:.2f}" for ratio in found)
            print(f"| {name}, {'bent' if bending else 'straight'} rays | {numbers} |", flush=True)


if __name__ == "__main__":
    main()
