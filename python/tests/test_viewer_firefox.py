"""The viewer's page in Firefox, by Mozilla's Marionette; skipped if either is missing. The page
itself is tested in Chromium.

Firefox without a screen does not draw in three dimensions; if Xvfb is installed (Debian: apt
install xvfb libgl1-mesa-dri), Firefox gets a virtual screen.

With MORGANA_SCREENSHOTS set to a folder, images of the page are written there.
"""

import base64
import json
import os
import pathlib
import re
import shutil
import subprocess
import time

import morgana
import numpy as np
import pytest
from conftest import SCENES, load, small

driver = pytest.importorskip("marionette_driver.marionette", reason="marionette_driver is not installed")
FIREFOX = shutil.which("firefox-esr") or shutil.which("firefox")
pytestmark = [
    pytest.mark.skipif(FIREFOX is None, reason="there is no Firefox: apt install firefox-esr"),
    # The driver leaves sockets to the garbage collector.
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning", "ignore::ResourceWarning"),
]

SCREENSHOTS = os.environ.get("MORGANA_SCREENSHOTS")
PATIENCE = 60
"""Maximum duration of anything on the page, in seconds."""


@pytest.fixture(scope="module")
def screen():
    """Starts a virtual screen if possible, and puts its name into the environment."""
    if shutil.which("Xvfb") is None:
        yield None
        return
    receiver, sender = os.pipe()
    command = [
        "Xvfb",
        "-displayfd",
        str(sender),
        "-screen",
        "0",
        "1400x1000x24",
        "-nolisten",
        "tcp",
    ]
    process = subprocess.Popen(command, pass_fds=[sender], stderr=subprocess.DEVNULL)
    os.close(sender)
    with open(receiver) as answer, pytest.MonkeyPatch.context() as patch:
        name = f":{answer.readline().strip()}"
        patch.setenv("DISPLAY", name)
        # Make Mesa draw on the CPU.
        patch.setenv("LIBGL_ALWAYS_SOFTWARE", "1")
        yield name
    process.terminate()
    process.wait()


@pytest.fixture(scope="module")
def firefox(tmp_path_factory, screen):
    log = tmp_path_factory.mktemp("firefox") / "log"
    prefs = {"webgl.force-enabled": True}
    browser = driver.Marionette(bin=FIREFOX, headless=screen is None, gecko_log=str(log), prefs=prefs)
    browser.start_session()
    browser.set_window_rect(width=1280, height=900)
    yield browser
    browser.quit()
    browser.cleanup()


def evaluate(firefox, code, *arguments):
    """Returns the value of an expression on the page."""
    return firefox.execute_script(f"return ({code})(...arguments)", script_args=arguments, sandbox=None)


def until(firefox, code, *arguments):
    end = time.monotonic() + PATIENCE
    while not evaluate(firefox, code, *arguments):
        assert time.monotonic() < end, code
        time.sleep(0.1)


def open_page(firefox, address, state):
    firefox.navigate("about:blank")
    firefox.navigate(f"{address}#{state}")
    until(firefox, "() => document.body.dataset.shown")


def picture(firefox, name):
    if SCREENSHOTS:
        data = base64.b64decode(firefox.screenshot(full=False))
        (pathlib.Path(SCREENSHOTS) / f"{name}.png").write_bytes(data)


def test_firefox_shows_values(firefox, serve, tmp_path):
    result = morgana.render(load(small()), spp=4)
    morgana.write(tmp_path / "a.exr", result)
    image = morgana.read(tmp_path / "a.exr")
    channel = image.channels[""][0]
    open_page(firefox, serve("view", tmp_path / "a.exr"), f"channel={channel}&cursor=2,1")
    until(firefox, "() => document.getElementById('place')")
    assert evaluate(firefox, "() => document.getElementById('place').textContent") == "x 2, y 1"
    plane = evaluate(firefox, "() => [...window.viewer.page().canvas.pictures[0].planes[0]]")
    np.testing.assert_array_equal(np.float32(plane), image.layers[""][..., 0].ravel())
    # Keys move the cursor.
    firefox.find_element("css selector", "#stage .surface canvas").send_keys("\ue014")
    until(firefox, "() => document.getElementById('place').textContent === 'x 3, y 1'")
    picture(firefox, "firefox-image")


def test_firefox_follows_rays(firefox, serve, program, tmp_path):
    scene = SCENES / "luneburg_fog.xml"
    open_page(firefox, serve("view", scene), "from=-3,0.3,0&direction=1,0,0")
    until(firefox, "() => document.querySelector('#rays table')")
    program("trace", scene, "--from=-3,0.3,0", "--direction", "1,0,0", "-o", "ray.json")
    last = json.loads((tmp_path / "ray.json").read_text())["rays"][0]["points"][-1]
    text = evaluate(firefox, "() => document.getElementById('rays').innerText")
    assert float(re.search(r"optical length\s+([\d.]+)", text)[1]) == pytest.approx(last["opl"], rel=1e-6)
    picture(firefox, "firefox-scene")


def test_firefox_draws_scenes(firefox, serve, screen):
    if screen is None:
        pytest.skip("there is no Xvfb, without which Firefox does not draw in three dimensions: apt install xvfb")
    open_page(firefox, serve("view", SCENES / "luneburg_fog.xml"), "pixel=150,100")
    until(firefox, "() => document.querySelector('#rays table')")
    assert evaluate(firefox, "() => window.viewer.page().stage.objects.children.length") > 4
    assert evaluate(firefox, "() => window.viewer.page().stage.rays.children.length") == 1
    # Check that something differs from the background in the middle.
    code = """() => { const { stage } = window.viewer.page(); const gl = stage.renderer.getContext(); const pixel = new Uint8Array(4);
        stage.renderer.render(stage.scene, stage.camera);
        gl.readPixels(gl.drawingBufferWidth / 2, gl.drawingBufferHeight / 2, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
        return [...pixel]; }"""
    assert evaluate(firefox, code)[:3] != [0x14, 0x17, 0x1C]
    picture(firefox, "firefox-drawn")


def test_firefox_says_what_cannot_be_drawn(firefox, serve):
    firefox.set_pref("webgl.disabled", True)
    try:
        open_page(
            firefox,
            serve("view", SCENES / "luneburg_fog.xml"),
            "from=-3,0.3,0&direction=1,0,0",
        )
        until(firefox, "() => document.querySelector('#rays table')")
        said = evaluate(firefox, "() => document.querySelector('#stage .warning').textContent")
        assert "WebGL 2" in said and "Rays are followed all the same" in said
    finally:
        firefox.set_pref("webgl.disabled", False)
