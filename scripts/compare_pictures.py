#!/usr/bin/env python3
"""Compares the noise of pictures of Mitsuba scenes with Mitsuba 3 at equal processor time, with the defaults of both programs.

Each scene is rendered with several seeds by the program morgana and by Mitsuba on one thread. Their integrators and films are replaced
by `path` (`volpath` in Mitsuba if the scene has media) and by `hdrfilm` of equal size, filters and samplers are left out. The first
number of a row is the relative mean square error at equal processor time, morgana's over Mitsuba's: below one, morgana's picture has less
noise. The second is the same of means over blocks of 4 × 4 pixels, which do not see that neighbouring pixels share samples. The third
is the efficiency of the median pixel, morgana's over Mitsuba's: above one, morgana is better.

Scenes may be of old versions: tags are turned into the present ones for Mitsuba. Edited copies lie beside the scenes while they are
rendered. Usage of data: keep figures, not the scenes of others.

Usage: scripts/compare_pictures.py SCENE ... [--exe PATH] [--spp N] [--seeds N] [--variant NAME]
(with any Python that has mitsuba and numpy)
"""

import argparse
import pathlib
import re
import resource
import statistics
import subprocess
import tempfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
WIDTH, HEIGHT, BLOCK = 96, 72, 4
FILM = f'<film type="hdrfilm"><integer name="width" value="{WIDTH}"/><integer name="height" value="{HEIGHT}"/></film>'
COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
# An integrator, with all integrators in it.
INTEGRATOR = re.compile(r"<integrator\b[^>]*/>|<integrator\b.*</integrator>", re.DOTALL)
# Part of the mean that is added to the brightness of a pixel, so that black pixels do not count infinitely.
DARK = 0.01


def element(tag: str) -> re.Pattern[str]:
    """Returns a pattern for an element without children of the same tag."""
    return re.compile(rf"<{tag}\b[^>]*/>|<{tag}\b.*?</{tag}>", re.DOTALL)


def edited(scene: pathlib.Path) -> str:
    """Returns the text of a scene with the film, integrator and sampler of the comparison."""
    text = COMMENT.sub("", scene.read_text())
    integrator = f'<integrator type="{"volpath" if "<medium" in text else "path"}"/>'
    text, found = INTEGRATOR.subn(integrator, text, count=1)
    if not found:
        text = text.replace("</scene>", integrator + "</scene>")
    text = element("sampler").sub("", text)
    text = element("film").sub(FILM, text)
    text = re.sub(r'<float name="maxSmoothAngle"[^>]*/>', "", text)
    return text.replace("lookAt", "lookat")


def processor_time(who: int) -> float:
    usage = resource.getrusage(who)
    return usage.ru_utime + usage.ru_stime


def by_morgana(scene: pathlib.Path, seed: int, args: argparse.Namespace) -> tuple[np.ndarray, float]:
    """Returns a picture and the processor time of the program, with the time to load the scene."""
    with tempfile.TemporaryDirectory() as folder:
        image = pathlib.Path(folder) / "image.npy"
        command = [args.exe, "render", scene, "--quiet", "-o", image, "--spp", str(args.spp), "--seed", str(seed), "--threads", "1"]
        before = processor_time(resource.RUSAGE_CHILDREN)
        subprocess.run(command, check=True, capture_output=True)
        return np.load(image)[..., :3].astype(float), processor_time(resource.RUSAGE_CHILDREN) - before


def by_mitsuba(scene, seed: int, args: argparse.Namespace) -> tuple[np.ndarray, float]:
    """Returns a picture and the processor time of its render alone."""
    import mitsuba

    before = processor_time(resource.RUSAGE_SELF)
    image = np.array(mitsuba.render(scene, spp=args.spp, seed=seed))[..., :3]
    return image.astype(float), processor_time(resource.RUSAGE_SELF) - before


def blocks(images: np.ndarray) -> np.ndarray:
    """Returns the means over blocks of pixels."""
    shape = (len(images), HEIGHT // BLOCK, BLOCK, WIDTH // BLOCK, BLOCK, 3)
    return images.reshape(shape).mean((2, 4))


def relative_error(images: np.ndarray, mean: np.ndarray) -> float:
    """Returns the variance among pictures relative to the square of the mean, averaged over pixels."""
    return float((images.var(axis=0, ddof=1) / (mean**2 + (DARK * mean.mean()) ** 2)).mean())


def row(scene: pathlib.Path, args: argparse.Namespace) -> str:
    import mitsuba

    copy = scene.with_name(f"compared-{scene.name}")
    copy.write_text(edited(scene))
    try:
        loaded = mitsuba.load_file(str(copy))
        by_mitsuba(loaded, 0, args)
        runs = [(by_morgana(copy, seed, args), by_mitsuba(loaded, seed, args)) for seed in range(1, args.seeds + 1)]
    finally:
        copy.unlink()
    ours, theirs = (np.array([run[k][0] for run in runs]) for k in (0, 1))
    times = [statistics.median(run[k][1] for run in runs) for k in (0, 1)]
    cost = times[0] / times[1]
    found = []
    for part in (lambda images: images, blocks):
        mean = (part(ours).mean(axis=0) + part(theirs).mean(axis=0)) / 2
        found.append(cost * relative_error(part(ours), mean) / relative_error(part(theirs), mean))
    variances = [images.var(axis=0, ddof=1) for images in (ours, theirs)]
    lit = (variances[0] > 0) & (variances[1] > 0)
    efficiency = np.median(variances[1][lit] / variances[0][lit]) / cost
    return (
        f"| {scene.stem} | {found[0]:.2f} | {found[1]:.2f} | {efficiency:.2f} | {cost:.2f} | {ours.mean() / theirs.mean():.3f} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="+", type=pathlib.Path, metavar="SCENE")
    parser.add_argument("--exe", type=pathlib.Path, default=ROOT / "target" / "release" / "morgana", help="the program morgana")
    parser.add_argument("--spp", type=int, default=64, help="samples per pixel of a picture")
    parser.add_argument("--seeds", type=int, default=8, help="pictures by each program, at least 2")
    parser.add_argument("--variant", default="scalar_rgb", help="variant of Mitsuba")
    args = parser.parse_args()
    if args.seeds < 2:
        parser.error("variances need two seeds")
    import drjit
    import mitsuba

    mitsuba.set_variant(args.variant)
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    drjit.set_thread_count(1)
    print("| scene | error at equal time | of blocks | efficiency, median pixel | time | mean |\n|---|---|---|---|---|---|")
    for scene in args.scenes:
        print(row(scene, args), flush=True)


if __name__ == "__main__":
    main()
