#!/usr/bin/env python3
"""Makes the images of docs/guides/viewer.md: pages of the viewer in Chromium (docs/images/viewer).

Needs Playwright and Chromium, like python/tests/test_viewer.py. Look at each image before keeping
it.

Usage: scripts/viewer_pictures.py [--program target/release/morgana] [--folder docs/images/viewer] [NAME ...]
"""

import argparse
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

from playwright.sync_api import sync_playwright

ROOT = pathlib.Path(__file__).resolve().parent.parent
SCENES = ROOT / "scenes"
SIZE = {"width": 1280, "height": 800}
PATIENCE = 120
"""Seconds that anything on a page may take."""
FOG = ["-D", "width=336", "-D", "height=200"]
SMALL = ["-D", "width=168", "-D", "height=100"]

GATES = [
    ('<integer name="ny" value="5"/>', '<integer name="ny" value="20"/>'),
    ('<float name="gruneisen" value="0.2"/>', '<float name="bin_width" value="15"/><float name="max_bound" value="300"/>'),
    ('<float name="pulse_energy" value="0.01"/>', ""),
]
"""Changes of a scene, so that its meter separates light by its optical length."""

PICTURES = {
    "image": (["fog.exr"], "cursor=213,93&view=213,93,6"),
    "error": (["fog.exr"], "channel=G&quantity=error&log=1&cursor=213,93"),
    "profile": (["fog.exr"], "channel=G&log=1&line=150,60,300,150"),
    "slider": (
        ["path.exr", "bdpt.exr"],
        "compare=slider&split=0.5&channel=G&log=1&line=20,100,316,100",
    ),
    "difference": (["path.exr", "bdpt.exr"], "compare=z&channel=G&cursor=213,93"),
    "film": (["film.exr"], "layer=length.0030"),
    "fluence": (["fluence.npz"], ""),
    "planes": (["gates.npz"], "layout=planes&at0=0&at1=28&at2=10&at3=22"),
    "volume": (["gates.npz"], "layout=volume&at0=0"),
    "arrays": (["sound.npz"], "array=pressure&axes=1,2&names=z y x&scale=diverging&low=-1&high=1"),
    "check": ([SCENES / "luneburg_fog.xml"], ""),
    "rays": (
        ["fog.exr", SCENES / "luneburg_fog.xml", *FOG],
        "item=1&from=-1.8,0.15,0&direction=1,0,0&emitter=point&to=1.3,0,0.05",
    ),
}
"""Opened files, and the state of the page."""


def options():
    """Options of Chromium: no GPU, and no requests to other hosts."""
    off = ["gpu", "quic", "background-networking", "component-update", "sync"]
    return [
        "--no-sandbox",
        "--no-first-run",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
        *(f"--disable-{x}" for x in off),
    ]


class Studio:
    def __init__(self, program, folder, work):
        self.program, self.folder, self.work = program, folder, work
        self.running = []

    def run(self, *arguments):
        subprocess.run([self.program, *map(str, arguments), "-q"], cwd=self.work, check=True)

    def make(self, name):
        """Makes a file that images show, once."""
        if (self.work / name).exists():
            return
        fog = ["render", SCENES / "luneburg_fog.xml", *FOG, "--seed", "1"]
        if name == "fog.exr":
            self.run(*fog, "--spp", "64", "-o", name)
        elif name in ("path.exr", "bdpt.exr"):
            self.run(*fog, "--spp", "8", "--integrator", name.split(".")[0], "-o", name)
        elif name == "film.exr":
            self.run(
                "render",
                SCENES / "light_in_flight.xml",
                "-D",
                "width=192",
                "-D",
                "height=128",
                "--spp",
                "128",
                "-o",
                name,
            )
        elif name == "fluence.npz":
            self.run(
                "render",
                SCENES / "photoacoustic_fluence.xml",
                "--particles",
                "100000",
                "-o",
                name,
            )
        elif name == "gates.npz":
            scene = (SCENES / "photoacoustic_fluence.xml").read_text()
            for before, after in GATES:
                assert before in scene, before
                scene = scene.replace(before, after)
            (self.work / "gates.xml").write_text(scene)
            self.run("render", "gates.xml", "--particles", "400000", "-o", name)
        else:
            self.sound(name)

    def sound(self, name):
        """Writes a standing wave as another program might compute it: arrays without names of axes."""
        import numpy as np

        z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in (40, 60, 80)), indexing="ij")
        pressure = np.cos(9 * np.sqrt((x + 0.3) ** 2 + y**2 + (z - 0.2) ** 2)) * np.exp(-2 * (x**2 + y**2 + z**2))
        np.savez_compressed(
            self.work / name,
            pressure=pressure.astype("f4"),
            density=(1 + 0.1 * pressure).astype("f4"),
            time_step=1e-8,
        )

    def serve(self, *arguments):
        process = subprocess.Popen(
            [self.program, *map(str, arguments)],
            cwd=self.work,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.running.append(process)
        return process.stdout.readline().split()[0]

    def close(self):
        for process in self.running:
            process.terminate()
            process.wait()
        self.running = []


def until(page, condition):
    end = time.monotonic() + PATIENCE
    while not page.evaluate(condition):
        if time.monotonic() > end:
            sys.exit(f"the page does not get there: {condition}")
        time.sleep(0.05)


def settle(page):
    until(page, "document.body.dataset.shown && !window.viewer.page().isBusy")
    page.wait_for_timeout(1500)


def take(studio, page, name):
    if name == "live":
        arguments = [
            SCENES / "luneburg_fog.xml",
            *SMALL,
            "--time",
            "60s",
            "--integrator",
            "path",
            "--view",
            "-q",
        ]
        page.goto(studio.serve("render", *arguments, "-o", "live.exr"))
        until(page, "window.viewer.page()?.version >= 6")
        page.locator("#stage canvas").click(position={"x": 440, "y": 360})
        page.wait_for_timeout(1500)
    else:
        shown, state = PICTURES[name]
        for file in shown:
            if isinstance(file, str) and "." in file:
                studio.make(file)
        page.goto(f"{studio.serve('view', *shown)}#{state}")
        settle(page)
    page.screenshot(path=studio.folder / f"{name}.png")
    print(name, flush=True)
    page.goto("about:blank")
    studio.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "target/release/morgana")
    parser.add_argument("--folder", type=pathlib.Path, default=ROOT / "docs/images/viewer")
    parser.add_argument(
        "--work",
        type=pathlib.Path,
        help="folder of the files that are shown, which are kept there",
    )
    parser.add_argument(
        "names",
        nargs="*",
        metavar="NAME",
        help=f"of {', '.join([*PICTURES, 'live'])}; all if none is given",
    )
    arguments = parser.parse_args()
    browser_program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as play:
        work = (arguments.work or pathlib.Path(folder)).resolve()
        work.mkdir(parents=True, exist_ok=True)
        studio = Studio(arguments.program.resolve(), arguments.folder.resolve(), work)
        browser = play.chromium.launch(executable_path=browser_program, args=options())
        page = browser.new_page(viewport=SIZE)
        page.set_default_timeout(1000 * PATIENCE)
        try:
            for name in arguments.names or [*PICTURES, "live"]:
                take(studio, page, name)
        finally:
            studio.close()
            browser.close()


if __name__ == "__main__":
    main()
