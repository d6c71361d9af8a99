"""CPU time of renders of tagged light over that of the same renders without tagging, where sound bends rays and where they are straight.

    PYTHON scripts/tagging_cost.py --rounds 5

Both take turns, on one thread; the table of docs/performance.md has medians of their ratios. A ball of haze with a mean free path of a
little more than half a wavelength of the sound; all particles from its middle get to the meter on its surface.
"""

import argparse
import statistics
import time
import warnings

import morgana
import numpy as np

RADIUS, WAVELENGTH = 2.0, 0.7
N0, CONTRAST, ELASTO_OPTIC, PRESSURE = 1.33, 1e-5, 0.32, 1e5
LOOK = [{"lookat": {"origin": [0, 0, -8], "target": [0, 0, 0], "up": [0, 1, 0]}}]
FILM = {"type": "hdrfilm", "width": 40, "height": 40, "pixel_format": "luminance"}
TAGGED = {"tagged": True, "wavelength": 500e-6}


def modes():
    wave_number = 2 * np.pi / WAVELENGTH
    return {"type": "acoustic", "n0": N0, "amplitude": CONTRAST, "wave_number": wave_number, "elasto_optic": ELASTO_OPTIC}


def samples():
    """A plane wave, ten samples to a wavelength."""
    count = round(20 * RADIUS / WAVELENGTH)
    x = RADIUS * ((2 * np.arange(count) + 1) / count - 1)
    wave = np.exp(2j * np.pi * x / WAVELENGTH).astype(np.complex64)
    return {
        "type": "pressure",
        "data": np.broadcast_to(PRESSURE * wave, 3 * [count]).copy(),
        "placement": "centers",
        "to_world": [{"scale": 2 * RADIUS}, {"translate": 3 * [-RADIUS]}],
        "frequency": 1e6,
        "sound_speed": 1e6 * WAVELENGTH,
        "n0": N0,
        "dn_dp": CONTRAST / PRESSURE,
        "elasto_optic": ELASTO_OPTIC,
    }


def scene(what, sound, bending, tagged):
    haze = {"type": "homogeneous", "sigma_t": 2.5, "albedo": 0.99, "phase": {"type": "hg", "g": 0.8}, "ior": sound()}
    ball = {"type": "sphere", "radius": RADIUS, "bsdf": {"type": "null"}, "interior": haze}
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


def ratio(what, sound, bending, rounds):
    plain, tagged = (scene(what, sound, bending, tags) for tags in (False, True))
    count = {"pictures": 64, "records": 100_000, "fluence": 100_000}[what] // (4 if bending else 1)
    pairs = [(seconds(what, tagged, count, seed), seconds(what, plain, count, seed)) for seed in range(rounds)]
    return statistics.median(a / b for a, b in pairs)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    rounds = parser.parse_args().rounds
    warnings.simplefilter("ignore", morgana.SceneWarning)
    print("| | sound of modes | sampled sound |\n|---|---|---|")
    for bending in (True, False):
        for what in ("pictures", "records", "fluence"):
            name = "fluence in 8000 cells" if what == "fluence" else what
            found = [ratio(what, sound, bending, rounds) for sound in (modes, samples)]
            print(f"| {name}, {'bent' if bending else 'straight'} rays | {found[0]:.2f} | {found[1]:.2f} |", flush=True)


if __name__ == "__main__":
    main()
