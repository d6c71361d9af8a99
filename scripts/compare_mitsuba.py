#!/usr/bin/env python3
"""Compares efficiency with Mitsuba 3 on scenes that both can read.

Renders each scene several times with independent seeds, in turn by Morgana's release binary, which
it builds, and by variants of Mitsuba 3. Prints a table in Markdown. Efficiency is 1/(variance ×
processor time).

Mitsuba comes from PyPI into its own environment, target/mitsuba-venv. Its llvm variants need LLVM's
shared library, version 16 or newer if the processor has AVX-512: Debian's package libllvm19, or a
path in DRJIT_LIBLLVM_PATH. A variant that cannot be loaded is left out, with a note.

--sampler replaces the scenes' own samplers for both programs, and --own only for Morgana;
--adaptive distributes Morgana's samples among pixels by noise. --pgo adds the build of
scripts/build_pgo.py.

Usage: scripts/compare_mitsuba.py [--spp N] [--seeds N] [--threads N] [--variants NAMES] [--sampler NAME] [--own NAME] [--adaptive]
  [--pgo] SCENE ...
"""

import argparse
import os
import pathlib
import re
import resource
import statistics
import subprocess
import sys
import tempfile
import venv

ROOT = pathlib.Path(__file__).resolve().parent.parent
TARGET = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve()
PGO = TARGET / "pgo" / "release" / "morgana"
ENVIRONMENT = ROOT / "target" / "mitsuba-venv"
PACKAGES = ("mitsuba==3.9.1", "numpy")


def enter_environment():
    """Restarts the script in the environment that has Mitsuba, which it creates if necessary."""
    python = ENVIRONMENT / "bin" / "python"
    if pathlib.Path(sys.prefix) == ENVIRONMENT:
        return
    if not python.exists():
        venv.create(ENVIRONMENT, with_pip=True)
    subprocess.run([python, "-m", "pip", "install", "--quiet", *PACKAGES], check=True)
    os.execv(python, [python, *sys.argv])


def processor_time(who):
    usage = resource.getrusage(who)
    return usage.ru_utime + usage.ru_stime


class Morgana:
    """A release binary. Its times include start-up and the writing of files."""

    name = "morgana"

    def __init__(self, scene, args, name=name, program=TARGET / "release" / "morgana"):
        self.scene, self.args, self.name, self.program = scene, args, name, program

    @staticmethod
    def build():
        subprocess.run(["cargo", "build", "--release", "--quiet", "-p", "morgana-cli"], cwd=ROOT, check=True)

    def render(self, seed):
        import numpy

        with tempfile.TemporaryDirectory() as folder:
            image = pathlib.Path(folder) / "image.npy"
            command = [self.program, "render", self.scene, "--quiet", "-o", image]
            command += ["--spp", str(self.args.spp), "--seed", str(seed)]
            command += ["--threads", str(self.args.threads)]
            if self.args.own:
                command += ["--sampler", self.args.own]
            if self.args.adaptive:
                command += ["--adaptive"]
            before = processor_time(resource.RUSAGE_CHILDREN)
            subprocess.run(command, check=True)
            seconds = processor_time(resource.RUSAGE_CHILDREN) - before
            return numpy.load(image)[..., :3], seconds


class Mitsuba:
    """A loaded and compiled variant of Mitsuba; a first render warms it up."""

    def __init__(self, variant, scene, args):
        import drjit
        import mitsuba

        mitsuba.set_variant(variant)
        drjit.set_thread_count(args.threads)
        self.name, self.spp, self.mitsuba = variant, args.spp, mitsuba
        self.scene = mitsuba.load_file(str(scene))
        self.render(seed=0)

    def render(self, seed):
        import numpy

        self.mitsuba.set_variant(self.name)
        before = processor_time(resource.RUSAGE_SELF)
        image = numpy.array(self.mitsuba.render(self.scene, spp=self.spp, seed=seed))
        return image[..., :3], processor_time(resource.RUSAGE_SELF) - before


def renderers(scene, args):
    found = [Morgana(scene, args)]
    if args.pgo:
        found.append(Morgana(scene, args, "morgana, PGO", PGO))
    for variant in args.variants.split(","):
        try:
            found.append(Mitsuba(variant, scene, args))
        except (ImportError, RuntimeError) as problem:
            print(f"{variant} is left out: {problem}", file=sys.stderr)
    return found


class Result:
    """Results of a renderer's runs: seconds per sample, variance of a sample, and their product."""

    def __init__(self, runs, spp):
        import numpy

        images = numpy.array([image for image, _ in runs], dtype=float)
        samples = images.shape[1] * images.shape[2] * spp
        self.mean = images.mean()
        self.seconds = statistics.median(seconds for _, seconds in runs) / samples
        self.variance = images.var(axis=0, ddof=1).mean() * spp
        self.cost = self.seconds * self.variance


def with_sampler(scene, sampler, folder):
    """Returns a copy of a scene with another sampler, beside links to its data."""
    for file in scene.resolve().parent.iterdir():
        if file.name != scene.name:
            (folder / file.name).symlink_to(file)
    text, count = re.subn(r'<sampler type="\w+"', f'<sampler type="{sampler}"', scene.read_text())
    if count != 1:
        sys.exit(f"{scene}: expected one sampler, found {count}")
    copy = folder / scene.name
    copy.write_text(text)
    return copy


def compare(scene, args):
    """Returns the rows of the table."""
    runs = {renderer: [] for renderer in renderers(scene, args)}
    for seed in range(1, args.seeds + 1):
        for renderer, several in runs.items():
            several.append(renderer.render(seed))
    results = {renderer.name: Result(several, args.spp) for renderer, several in runs.items()}
    own = results[Morgana.name]
    for name, r in results.items():
        yield (
            f"| {scene.stem} | {name} | {r.mean:.5f} | {1e9 * r.seconds:.0f} | {r.variance:.3g} "
            f"| {r.cost / own.cost:.2g} |"
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--spp", type=int, default=256, help="samples per pixel of a render")
    parser.add_argument("--seeds", type=int, default=5, help="renders by each, at least 2")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--variants", default="llvm_ad_rgb,scalar_rgb")
    parser.add_argument("--sampler", help="a type of sampler that both know")
    parser.add_argument("--own", metavar="NAME", help="a type of sampler for Morgana alone")
    parser.add_argument("--adaptive", action="store_true", help="Morgana shares samples out among pixels")
    parser.add_argument("--pgo", action="store_true", help="also what scripts/build_pgo.py has built")
    parser.add_argument("scenes", nargs="+", type=pathlib.Path, metavar="SCENE")
    args = parser.parse_args()
    if args.seeds < 2:
        parser.error("variances are told from differences: at least two seeds are needed")
    if args.pgo and not PGO.exists():
        parser.error(f"there is no {PGO}: run scripts/build_pgo.py first")
    enter_environment()
    Morgana.build()
    print("| scene | renderer | mean | ns per sample | variance of a sample | morgana's efficiency by its |")
    print("|---|---|---|---|---|---|")
    for scene in args.scenes:
        with tempfile.TemporaryDirectory() as folder:
            if args.sampler:
                scene = with_sampler(scene, args.sampler, pathlib.Path(folder))
            print("\n".join(compare(scene, args)), flush=True)


if __name__ == "__main__":
    main()
