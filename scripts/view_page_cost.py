#!/usr/bin/env python3
"""Measures the cost of the viewer's page (docs/guides/viewer.md#limits).

Measures memory for an image of 3840 × 2160 pixels and for a volume of 256³ cells, slices of this
volume per second, frames per second of the view in three dimensions with 10,000 segments of rays,
and the time to the first preview of scenes, after the view turns and after a parameter changes.

Memory is the memory of the page's process in Chromium (resident, without shared pages) and of the
program. Chromium draws in software (SwiftShader), far slower than a GPU. Needs Playwright, Chromium
and the Python package.

Usage: scripts/view_page_cost.py [--program target/release/morgana]
"""

import argparse
import pathlib
import re
import shutil
import subprocess
import tempfile
import time

import numpy as np
from viewer_pictures import PATIENCE, ROOT, SCENES, SIZE, options, settle, until
from playwright.sync_api import sync_playwright

SEGMENTS = """count => { const stage = window.viewer.page().stage;
    const rays = Array.from({ length: 100 }, (_, r) => ({ colour: 0xffd166, points: Array.from({ length: count / 100 + 1 }, (_, i) =>
        [Math.cos(i / 16 + r), Math.sin(i / 16 + r), i / 50 - 1]) }));
    stage.setRays(rays); stage.frameRate(2);
    return [stage.frameRate(20), stage.renderer.info.render.calls]; }"""


SLICES = """async () => { const start = performance.now();
    for (let i = 0; i < 60; i += 1) {
        const before = document.body.dataset.shown;
        window.viewer.state.set({ at0: String(100 + i) });
        while (document.body.dataset.shown === before) await new Promise(requestAnimationFrame);
    }
    return 60000 / (performance.now() - start); }"""
PREVIEW = "JSON.parse(document.body.dataset.picture ?? '{}')"
CHANGE = """() => { const { parameters } = window.viewer.page().about;
    const { name, value } = parameters.find(({ name }) => name.endsWith('sigma_t')) ?? parameters.find(({ value }) => typeof value === 'number');
    delete document.body.dataset.picture;
    window.viewer.state.set({ [`set ${name}`]: [value].flat().map((v) => 1.1 * v).join(',') });
    return name; }"""
VIEWED = ("luneburg_fog", "grin_glass", "aquarium_laser", "laser_tank", "acousto_optic_tissue")


def resident(pid):
    """Returns the unshared memory of a process, in MB."""
    text = pathlib.Path(f"/proc/{pid}/smaps_rollup").read_text()
    return sum(int(n) for n in re.findall(r"^Private_\w+:\s+(\d+)", text, re.M)) / 1000


def page_process():
    """Returns the process of the page: the largest renderer of Chromium that this process has
    started."""
    found = []
    for folder in pathlib.Path("/proc").iterdir():
        try:
            command = (folder / "cmdline").read_bytes()
            if b"--type=renderer" in command and descends(int(folder.name)):
                found.append((resident(folder.name), int(folder.name)))
        except (OSError, ValueError):
            continue
    return max(found)[1]


def descends(pid):
    import os

    while pid > 1:
        if pid == os.getpid():
            return True
        pid = int(pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[1])
    return False


class Desk:
    def __init__(self, program, page, work):
        self.program, self.page, self.work = program, page, work
        self.empty = resident(page_process())

    def show(self, *files, state=""):
        command = [self.program, "view", *map(str, files)]
        self.process = subprocess.Popen(command, cwd=self.work, stdout=subprocess.PIPE, text=True)
        self.page.goto("about:blank")
        start = time.monotonic()
        self.page.goto(f"{self.process.stdout.readline().split()[0]}#{state}")
        settle(self.page)
        return time.monotonic() - start - 1.5

    def tell(self, what, seconds=None):
        text = f"page {resident(page_process()) - self.empty:.0f} MB beyond {self.empty:.0f}, program {resident(self.process.pid):.0f} MB"
        print(
            f"{what}: {text}" + ("" if seconds is None else f"; shown after {seconds:.1f} s"),
            flush=True,
        )

    def close(self):
        self.page.goto("about:blank")
        self.process.terminate()
        self.process.wait()
        self.process.stdout.close()


def images(desk):
    import morgana

    values = np.random.default_rng(1).random((2160, 3840, 3), np.float32)
    names = ["R", "G", "B"]
    image = morgana.Image({"": values, "variance": values / 100}, {"": names, "variance": names}, {})
    morgana.write(desk.work / "a.exr", image)
    desk.tell("image of 3840 x 2160 pixels", desk.show("a.exr"))
    desk.page.evaluate("window.viewer.state.set({ channel: 'G', quantity: 'error', cursor: '9,9' })")
    settle(desk.page)
    desk.tell("the same, with the standard error of a channel and values under the cursor")
    desk.close()


def volumes(desk):
    np.save(
        desk.work / "a.npy",
        np.random.default_rng(1).random((256, 256, 256), np.float32),
    )
    desk.tell("volume of 256 x 256 x 256 cells", desk.show("a.npy"))
    print(f"slices one after the other: {desk.page.evaluate(SLICES):.0f} per second", flush=True)
    desk.page.evaluate("window.viewer.state.set({ sum0: 1 })")
    settle(desk.page)
    desk.tell("the same, as a projection")
    desk.close()


def frames(desk):
    desk.show(SCENES / "luneburg_fog.xml")
    # Wait until the film is complete.
    until(desk.page, f"{PREVIEW}.number === 64")
    for count in (100, 10000):
        rate, calls = desk.page.evaluate(SEGMENTS, count)
        print(
            f"{count} segments: {rate:.0f} frames per second, {calls} calls to draw",
            flush=True,
        )
    code = """() => { const { renderer } = window.viewer.page().stage; const before = renderer.info.render.frame;
        return new Promise((done) => setTimeout(() => done(renderer.info.render.frame - before), 2000)); }"""
    print(f"frames drawn in two seconds in which nothing changes: {desk.page.evaluate(code)}")
    desk.close()


def previews(desk):
    for name in VIEWED:
        desk.show(SCENES / f"{name}.xml", state="picture=1")
        # Turn the view, and wait for its first picture, and for one of all pixels.
        desk.page.evaluate("delete document.body.dataset.picture; window.viewer.page().stage.look('x')")
        until(desk.page, f"{PREVIEW}.scale === 1")
        first, whole = desk.page.evaluate(f"[{PREVIEW}.first, {PREVIEW}.milliseconds]")
        parameter = desk.page.evaluate(CHANGE)
        until(desk.page, f"{PREVIEW}.first")
        changed = desk.page.evaluate(f"{PREVIEW}.first")
        print(f"preview of {name}: {first:.0f} ms, of all pixels {whole:.0f} ms; with another {parameter} {changed:.0f} ms", flush=True)
        desk.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "target/release/morgana")
    program = parser.parse_args().program.resolve()
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as play:
        browser = play.chromium.launch(executable_path=chromium, args=options())
        page = browser.new_page(viewport=SIZE)
        page.set_default_timeout(1000 * PATIENCE)
        desk = Desk(program, page, pathlib.Path(folder))
        for measure in (images, volumes, frames, previews):
            measure(desk)
        browser.close()


if __name__ == "__main__":
    main()
