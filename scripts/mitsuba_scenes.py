#!/usr/bin/env python3
"""Tries every Mitsuba scene of a folder: what loads, what is missing, and how the images agree with Mitsuba's.

The first table counts scenes by whether Mitsuba 3 and morgana load them. The second lists the
reasons why morgana refuses scenes, by the number of scenes that Mitsuba loads. With --render,
scenes that both load are rendered by both, several times with other seeds. A third table has a row
for each scene: the fraction by which the means differ, and this difference in standard errors (z).
The root mean square of z over blocks of the image follows (about 1.1 if all is well), and the rows
of docs/mitsuba.md that apply. Films are made smaller for this (--largest).

Files without a <scene>, and scenes without a <sensor> of their own or of included files, are left
out: they are parts of other scenes.

Usage: scripts/mitsuba_scenes.py FOLDER [--exe PATH] [--render] [-D NAME=VALUE ...]
(with any Python that has mitsuba and numpy)
"""

import argparse
import collections
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

import numpy as np
from random_mitsuba_scenes import ROOT, compared

VARIANT = "scalar_rgb"
# A position or name in a message, which differs between scenes with one cause.
PLACE = re.compile(r"^error: (\S*[/.]\S*: )?")
TOPIC = re.compile(r"not as in Mitsuba 3 \(([^)]*)\)")
# Seconds for one scene in one program.
PATIENCE = 600


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path, help="searched for .xml files, folders in it included")
    parser.add_argument("--exe", type=pathlib.Path, default=ROOT / "target" / "release" / "morgana", help="the program morgana")
    parser.add_argument("-D", dest="defines", metavar="NAME=VALUE", action="append", default=[], help="a parameter of all scenes that have it")
    parser.add_argument("--render", action="store_true", help="compare pictures, too")
    parser.add_argument("--spp", type=int, default=4, help="samples per pixel of a run")
    parser.add_argument("--runs", type=int, default=8, help="seeds")
    parser.add_argument("--largest", type=int, default=64, help="pixels along the longer side of pictures that are compared")
    args = parser.parse_args()
    if args.runs < 2:
        parser.error("errors need two runs")
    scenes = [Scene(path, args) for path in sorted(args.folder.rglob("*.xml")) if is_scene(path)]
    if not scenes:
        sys.exit(f"{args.folder}: no scenes")
    print_loads(scenes)
    print_missing(scenes)
    if args.render:
        print_agreement([scene for scene in scenes if scene.theirs and scene.ours])


def is_scene(path: pathlib.Path, included: tuple[pathlib.Path, ...] = ()) -> bool:
    """Returns true if a file has a <scene> with a <sensor>, of its own or of an included file."""
    try:
        root = ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, OSError):
        return False
    if (root.tag != "scene" and not included) or path in included:
        return False
    if root.tag == "sensor" or root.find(".//sensor") is not None:
        return True
    names = [element.get("filename", "") for element in root.iter("include")]
    return any(is_scene(path.parent / name, (*included, path)) for name in names)


class Scene:
    """A scene file, with the result of loading it in each program, and their messages."""

    def __init__(self, path: pathlib.Path, args: argparse.Namespace) -> None:
        self.path, self.args = path, args
        self.name = path.relative_to(args.folder)
        text = path.read_text(errors="replace")
        self.defines = [define for define in args.defines if "$" + define.split("=")[0] in text]
        told = self.morgana("check")
        messages = told.stderr.splitlines()
        self.ours = told.returncode == 0
        self.errors = sorted({PLACE.sub("", line) for line in messages if line.startswith("error")})
        self.topics = TOPIC.findall(told.stderr)
        self.theirs = in_child(lambda: load(self) is None)

    def morgana(self, command: str, *more: object) -> subprocess.CompletedProcess[str]:
        options = [item for define in self.defines for item in ("-D", define)]
        line = [self.args.exe, command, self.path, *options, *map(str, more)]
        try:
            return subprocess.run(line, capture_output=True, text=True, timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            return subprocess.CompletedProcess(line, 1, "", "error: out of time\n")


def load(scene: Scene):
    """Loads Mitsuba's scene."""
    import mitsuba

    mitsuba.set_variant(VARIANT)
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    return mitsuba.load_file(str(scene.path), **dict(define.split("=", 1) for define in scene.defines))


def in_child(act) -> bool:
    """Returns true if a function succeeds in a process of its own: some scenes crash Mitsuba, and
    some never end."""
    child = os.fork()
    if child == 0:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        os.dup2(2, 1)
        signal.alarm(PATIENCE)
        try:
            act()
        except BaseException:
            os._exit(1)
        os._exit(0)
    return os.waitpid(child, 0)[1] == 0


def print_loads(scenes: list[Scene]) -> None:
    print("| | morgana loads | morgana does not |\n|---|---|---|")
    for theirs, label in ((True, "Mitsuba loads"), (False, "Mitsuba does not")):
        counts = [sum(scene.theirs == theirs and scene.ours == ours for scene in scenes) for ours in (True, False)]
        print(f"| {label} | {counts[0]} | {counts[1]} |")


def print_missing(scenes: list[Scene]) -> None:
    count = collections.Counter(error for scene in scenes if scene.theirs for error in scene.errors)
    if count:
        print("\n| scenes | what stops morgana |\n|---|---|")
    for error, number in count.most_common():
        print(f"| {number} | {error} |")


def print_agreement(scenes: list[Scene]) -> None:
    print("\n| scene | morgana/Mitsuba − 1 | z | block rms | rows of docs/mitsuba.md |\n|---|---|---|---|---|", flush=True)
    for scene in scenes:
        print(f"| {scene.name} | {agreement(scene)} | {', '.join(scene.topics)} |", flush=True)


def agreement(scene: Scene) -> str:
    """Returns the middle of a row."""
    with tempfile.TemporaryDirectory() as folder:
        theirs, ours = pathlib.Path(folder) / "theirs.npy", pathlib.Path(folder) / "ours.npy"
        scene.path = shrunk(scene, pathlib.Path(folder))
        if not in_child(lambda: np.save(theirs, render_theirs(scene))):
            return "Mitsuba fails | |"
        images = np.load(theirs)
        pictures = []
        for seed in range(1, len(images) + 1):
            told = scene.morgana("render", "--quiet", "-o", ours, "--spp", scene.args.spp, "--seed", seed)
            if told.returncode != 0:
                return f"morgana fails: {' '.join(told.stderr.split())[:200]} | |"
            pictures.append(np.load(ours)[..., :3])
        share, z, rms = compared(images, np.array(pictures, float), 0.0)
        return f"{100 * share:+.2f} % | {z:.1f} | {rms:.2f}"


def shrunk(scene: Scene, folder: pathlib.Path) -> pathlib.Path:
    """Returns a copy of a scene, which finds its files, with films of a largest number of pixels
    along a side."""
    root = ElementTree.parse(scene.path).getroot()
    folders = [scene.path.resolve().parent]
    include(root, folders)
    values = {element.get("name"): element.get("value") for element in root.iter("default")}
    values |= dict(define.split("=", 1) for define in scene.defines)
    for film in root.iter("film"):
        sides = {element.get("name"): element for element in film.iter("integer")}
        pairs = [sides[name] for name in ("width", "height") if name in sides]
        if len(pairs) < 2:
            continue
        pixels = [int(values.get(side.get("value", "").strip("${}"), side.get("value"))) for side in pairs]
        share = min(1, scene.args.largest / max(pixels))
        for side, count in zip(pairs, pixels, strict=True):
            side.set("value", str(max(1, round(share * count))))
        for element in [element for name, element in sides.items() if name and name.startswith("crop_")]:
            film.remove(element)
    for found in reversed(folders):
        root.insert(0, ElementTree.Element("path", value=str(found)))
    path = folder / scene.path.name
    ElementTree.ElementTree(root).write(path)
    return path


def include(root: ElementTree.Element, folders: list[pathlib.Path]) -> None:
    """Replaces the names of included files by their contents; adds the folders of paths to
    `folders`."""
    for element in list(root):
        if element.tag == "path":
            folders.append((folders[0] / element.get("value", "")).resolve())
            root.remove(element)
        elif element.tag == "include":
            names = (folder / element.get("filename", "") for folder in folders)
            included = ElementTree.parse(next(name for name in names if name.exists())).getroot()
            include(included, folders)
            place = list(root).index(element)
            root.remove(element)
            for i, item in enumerate(included):
                root.insert(place + i, item)


def render_theirs(scene: Scene) -> np.ndarray:
    """Renders images by Mitsuba, one for each seed."""
    import mitsuba

    loaded = load(scene)
    seeds = range(1, scene.args.runs + 1)
    images = [np.array(mitsuba.render(loaded, spp=scene.args.spp, seed=seed)) for seed in seeds]
    return np.array(images, float)[..., :3]


if __name__ == "__main__":
    main()
