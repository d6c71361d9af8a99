#!/usr/bin/env python3
"""Bias and noise of photon maps, against bdpt for equal time, on the Luneburg lens in fog.

Renders the scene several times with independent seeds, compares it with a long render by particles,
and writes docs/photons.md and docs/images/photons.png. Time is processor time, so that the
comparison is fair on a busy machine, too: short renders measure the number of samples for it. Needs
Matplotlib, Pillow and the release binary (--binary takes another one).

Usage: scripts/compare_photons.py [--time SECONDS] [--seeds N] [--binary FILE]
"""

import argparse
import json
import pathlib
import subprocess
import tempfile

import matplotlib

matplotlib.use("Agg")
import compare
import matplotlib.pyplot as plt
import numpy as np

SCENE, SIZE = "luneburg_fog", {"width": 200, "height": 120}
# Name, integrator, parameters.
ESTIMATORS = (
    ("bdpt", "bdpt", ""),
    ("photon, radius 0.2", "photon", '<float name="radius" value="0.2"/>'),
    ("photon, radius 0.05", "photon", '<float name="radius" value="0.05"/>'),
    ("sppm, radius 0.2", "sppm", '<float name="radius" value="0.2"/>'),
)
# Number of renders whose mean is the reference.
REFERENCES = 10
# Side of the blocks of pixels over which differences are averaged, and the difference in full colour, in percent of the image's mean.
BLOCK, FULL = 2, 30


def with_integrator(folder, name, kind, parameters):
    """Returns a copy of the scene with another integrator."""
    text = (compare.ROOT / "scenes" / f"{SCENE}.xml").read_text()
    old = '<integrator type="auto">'
    assert old in text
    path = folder / f"{name}.xml"
    path.write_text(text.replace(old, f'<integrator type="{kind}">{parameters}'))
    return path


def render(binary, folder, scene, seed, spp):
    image, stats = folder / "image.npy", folder / "stats.json"
    command = [binary, "render", scene, "--quiet", "--seed", str(seed), "--spp", str(spp), "--threads", "1"]
    command += ["-o", image, "--stats", stats]
    for name, value in SIZE.items():
        command += ["-D", f"{name}={value}"]
    before = compare.processor_time()
    subprocess.run(command, check=True)
    seconds = compare.processor_time() - before
    return compare.Run(*compare.read_npy(image), json.loads(stats.read_text()), seconds)


def fitting_samples(binary, folder, scene, seconds):
    """Returns the number of samples per pixel for a given processor time."""
    spp = 1
    while (used := render(binary, folder, scene, 0, spp).seconds) < seconds / 10:
        spp *= 4
    return max(1, round(spp * seconds / used))


def errors(runs, references):
    """Returns the variance of a render and the squared bias, relative to the squared reference,
    averaged over the image. The noise of both means, from the differences between renders, is
    subtracted from the bias."""
    reference = compare.averages(references)
    noise = noise_of_mean(references, reference)
    floor = (compare.DARK * sum(reference) / len(reference)) ** 2
    variance, bias = 0.0, 0.0
    means = compare.averages(runs)
    for mean, r, own, other in zip(means, reference, noise_of_mean(runs, means), noise):
        variance += own * len(runs) / (r * r + floor)
        bias += ((mean - r) ** 2 - own - other) / (r * r + floor)
    return variance / len(reference), bias / len(reference)


def noise_of_mean(runs, means):
    """Returns the variance of the mean over runs of every value."""
    columns = zip(*(run.values for run in runs))
    scale = len(runs) * (len(runs) - 1)
    return [sum((x - m) ** 2 for x in column) / scale for m, column in zip(means, columns)]


def difference(runs, reference):
    """Returns the mean of the renders minus the reference, in percent of the mean of the reference,
    averaged over the channels and over blocks of BLOCK × BLOCK pixels."""
    shape = (SIZE["height"] // BLOCK, BLOCK, SIZE["width"] // BLOCK, BLOCK, 3)
    reference = np.asarray(reference)
    return (np.asarray(compare.averages(runs)) - reference).reshape(shape).mean((1, 3, 4)) * 100 / reference.mean()


def figure(images, differences):
    """Returns a figure: one render by each estimator, and below it the difference of its mean."""
    fig, axes = plt.subplots(2, len(images), figsize=(10.4, 3.9), layout="constrained")
    for ax, below, (name, image), values in zip(axes[0], axes[1], images, differences):
        ax.imshow(image)
        ax.set_title(name, fontsize=11)
        drawn = below.imshow(values, cmap="RdBu_r", vmin=-FULL, vmax=FULL)
        below.set_title("mean − reference", fontsize=11)
    for ax in axes.flat:
        ax.set(xticks=[], yticks=[])
    fig.colorbar(drawn, ax=axes[1], extend="both", label="difference (% of\nthe image's mean)")
    return fig


TEXT = """# Photon maps compared

This page shows the bias and noise of photon maps, with `bdpt` for comparison. Use it to choose a radius, or to decide against photon maps.
Each estimator rendered `{scene}` ({size}) {seeds} times independently, with {time:g} s of CPU time for each render.
The reference is the mean of {references} such renders by `particle`. `scripts/compare_photons.py` produces this page in {minutes:.0f} min of CPU time.

![One render of each, and below them where their means are too bright or too dark](images/photons.png)

*Above: one render of each. Below: the mean of the renders minus the reference, in blocks of {block} × {block} pixels: red where it is too bright, blue
where it is too dark. The difference contains the remaining noise of both.*

| estimator | samples per pixel | mean of the image | variance | squared bias |
|---|---|---|---|---|
{rows}
| reference | | {mean:.5f} ± {error:.5f} | | |

*Variance* and *squared bias* are per pixel, divided by the squared reference (plus {dark:g} % of the image's mean) and averaged over the image.
The noise of both means is subtracted from the squared bias. The result may therefore be negative where there is no bias.
`bdpt` has no bias: its value shows the uncertainty of the other values.
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--time", type=float, default=20.0, help="seconds of processor time per render")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--binary")
    args = parser.parse_args()
    binary = args.binary or compare.program()
    rows, images, differences = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        scene = with_integrator(folder, "reference", "particle", "")
        seeds = range(1000, 1000 + REFERENCES)
        spp = fitting_samples(binary, folder, scene, args.time)
        references = [render(binary, folder, scene, s, spp) for s in seeds]
        reference = compare.averages(references)
        for number, (name, kind, parameters) in enumerate(ESTIMATORS):
            scene = with_integrator(folder, kind, kind, parameters)
            spp = fitting_samples(binary, folder, scene, args.time)
            runs = [render(binary, folder, scene, 100 * number + i, spp) for i in range(args.seeds)]
            mean, error = compare.overall(runs)
            variance, bias = errors(runs, references)
            rows.append(f"| {name} | {spp} | {mean:.5f} ± {error:.5f} | {variance:.1e} | {bias:.1e} |")
            print(rows[-1], flush=True)
            images.append((name, compare.picture(runs[0], 0)))
            differences.append(difference(runs, reference))
    out = compare.ROOT / "docs"
    # All colours: 256 would show steps in smooth images.
    figure(images, differences).savefig(out / "images" / "photons.png", dpi=100)
    text = TEXT.format(
        scene=SCENE,
        size=" × ".join(str(v) for v in SIZE.values()),
        time=args.time,
        minutes=compare.processor_time() / 60,
        seeds=args.seeds,
        references=REFERENCES,
        rows="\n".join(rows),
        mean=compare.overall(references)[0],
        error=compare.overall(references)[1],
        dark=100 * compare.DARK,
        block=BLOCK,
    )
    (out / "photons.md").write_text(text)


if __name__ == "__main__":
    main()
