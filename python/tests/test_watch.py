"""Threads, signals and progress."""

import pickle
import signal
import subprocess
import sys
import threading
import time

import morgana
import pytest
from conftest import load, small


def test_other_threads_run_meanwhile():
    turns, over = 0, threading.Event()

    def turn():
        nonlocal turns
        while not over.is_set():
            turns += 1
            time.sleep(0.001)

    thread = threading.Thread(target=turn)
    thread.start()
    before = turns
    morgana.render(load(small()), time=0.5, spp=10**9, threads=1)
    during = turns - before
    over.set()
    thread.join()
    # A render that held the interpreter lock would let the loop run a few times at most.
    assert during > 50


# Programs that a shell starts in the background ignore SIGINT, and their children would ignore it,
# too.
HEARS = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"

LONG = """
import warnings, morgana
from conftest import load, meters, small
scene = load({scene})
print("ready", flush=True)
result = morgana.render(scene, {samples}=10**12)
print(result.stopped, {done})
"""


@pytest.mark.parametrize(
    ("scene", "samples", "done"),
    [("small()", "spp", "result.image.mean() > 0.1"), ("meters()", "particles", "result.meters['fluence'].mean.max() > 0")],
)
def test_ctrl_c_returns_what_there_is(scene, samples, done):
    code = HEARS + LONG.format(scene=scene, samples=samples, done=done)
    here = __file__.rsplit("/", 1)[0]
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, cwd=here) as script:
        ready = script.stdout.readline()
        time.sleep(1)
        script.send_signal(signal.SIGINT)
        out, _ = script.communicate(timeout=60)
    assert ready == "ready\n"
    assert out == "interrupted True\n" and script.returncode == 0


def test_ctrl_c_ends_tracing():
    code = """
import morgana, numpy as np
field = morgana.load_field({"type": "selfoc", "n0": 1.5, "alpha": 1.0})
print("ready", flush=True)
rays = morgana.trace(field, [0.1, 0, 0], np.broadcast_to([0.1, 0.0, 1.0], (10_000_000, 3)), max_length=100, paths=False)
print(rays.stopped, np.isfinite(rays.end_points[0]).all())
"""
    with subprocess.Popen([sys.executable, "-c", HEARS + code], stdout=subprocess.PIPE, text=True) as script:
        ready = script.stdout.readline()
        time.sleep(1)
        script.send_signal(signal.SIGINT)
        out, _ = script.communicate(timeout=60)
    assert ready == "ready\n"
    assert out == "interrupted True\n" and script.returncode == 0


def test_ctrl_c_ends_loading():
    code = """
import morgana
coat = lambda i: {"type": "rectangle", "bsdf": {"type": "roughplastic", "alpha": 0.05 + 1e-4 * i, "nonlinear": True}}
scene = {"type": "scene", **{f"s{i}": coat(i) for i in range(5000)}}
print("ready", flush=True)
try:
    morgana.load_dict(scene)
except KeyboardInterrupt:
    print("interrupted")
"""
    with subprocess.Popen([sys.executable, "-c", HEARS + code], stdout=subprocess.PIPE, text=True) as script:
        ready = script.stdout.readline()
        time.sleep(1)
        script.send_signal(signal.SIGINT)
        out, _ = script.communicate(timeout=20)
    assert ready == "ready\n"
    assert out == "interrupted\n" and script.returncode == 0


def test_progress_is_told():
    shares = []
    morgana.render(load(small()), time=0.4, spp=10**9, progress=shares.append)
    assert shares == sorted(shares) and shares[-1] == 1.0 and 0 <= shares[0] < 0.9 and len(shares) > 2


def test_what_progress_raises_ends_the_render():
    def refuse(share):
        raise LookupError("enough")

    started = time.monotonic()
    with pytest.raises(LookupError, match="enough"):
        morgana.render(load(small()), spp=10**12, progress=refuse)
    assert time.monotonic() - started < 30


@pytest.mark.parametrize("with_tqdm", [True, False])
def test_bars_are_drawn(capfd, monkeypatch, with_tqdm):
    if not with_tqdm:
        monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    elif sys.modules.get("tqdm") is None:
        pytest.importorskip("tqdm")
    morgana.render(load(small()), time=0.3, spp=10**9, progress=True)
    assert "100%" in capfd.readouterr().err


def test_errors_can_be_sent_to_other_processes():
    with pytest.raises(morgana.SceneError) as caught:
        load({"type": "scene", "ball": {"type": "sphere", "radius": -1}})
    copy = pickle.loads(pickle.dumps(caught.value))
    assert copy.diagnostics == caught.value.diagnostics and str(copy) == str(caught.value)
