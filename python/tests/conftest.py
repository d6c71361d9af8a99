"""Fixtures and helpers that the tests share."""

import os
import pathlib
import subprocess
import warnings

import morgana
import pytest

os.environ.setdefault("MPLBACKEND", "Agg")

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENES = ROOT / "scenes"
OPTIONAL = ("torch", "pyoidn", "simpa", "bjdata", "optiland")
"""Packages that ``./test`` does not install, or only with ``--long``, for their size: tests that need
them may be skipped."""
PROGRAM = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "debug/morgana"
"""The program, whose results the tests compare with."""


def refuse_skips(report):
    """Fails skipped tests under ``MORGANA_ALL_TESTS``, as in continuous integration."""
    if "MORGANA_ALL_TESTS" in os.environ and report.skipped and not any(package in str(report.longrepr) for package in OPTIONAL):
        report.outcome = "failed"
        report.longrepr = f"skipped, which MORGANA_ALL_TESTS forbids: {report.longrepr}"
    return report


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item):
    return refuse_skips((yield))


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    return refuse_skips((yield))


@pytest.fixture
def program(tmp_path):
    """Runs the program in a folder of its own."""

    def run(*arguments):
        done = subprocess.run([PROGRAM, *map(str, arguments)], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


def small(integrator="path", **medium):
    """A lit ball of fog whose index varies, 12 by 8 pixels."""
    fog = {"type": "homogeneous", "sigma_t": 0.5, "albedo": 0.9, "ior": {"type": "linear", "n0": 1.3, "slope": [0, 0.1, 0]}}
    return {
        "type": "scene",
        "integrator": {"type": integrator},
        "sensor": {
            "type": "perspective",
            "fov": 40,
            "to_world": [{"lookat": {"origin": [0, 0, -5], "target": [0, 0, 0], "up": [0, 1, 0]}}],
            "film": {"type": "hdrfilm", "width": 12, "height": 8, "rfilter": {"type": "box"}},
            "sampler": {"type": "independent", "sample_count": 4},
        },
        "ball": {"type": "sphere", "bsdf": {"type": "null"}, "interior": {**fog, **medium}},
        "sky": {"type": "constant", "radiance": 1.0},
    }


def meters():
    """The ball, lit by an emitter, with a meter in place of the camera."""
    scene = small("particle")
    del scene["sensor"], scene["sky"]
    scene["light"] = {"type": "point", "position": [0, 0, -3], "intensity": 1.0}
    scene["sensor"] = {
        "type": "fluencemeter",
        "to_world": [{"scale": 2}, {"translate": [-1, -1, -1]}],
        "nx": 4,
        "ny": 3,
        "nz": 2,
    }
    return scene


def load(scene, **options):
    """Loads a scene from a dictionary, ignoring its warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", morgana.SceneWarning)
        return morgana.load_dict(scene, **options)


@pytest.fixture
def serve():
    """Starts the program with arguments. Yields the address that it prints."""
    running = []

    def start(*arguments, cwd=None):
        command = [PROGRAM, *map(str, arguments)]
        process = subprocess.Popen(
            command,
            cwd=cwd,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        running.append(process)
        address = process.stdout.readline().split()[0]
        start.processes[address] = process
        return address

    start.processes = {}
    yield start
    for process in running:
        process.terminate()
        process.wait()
        process.stdout.close()
