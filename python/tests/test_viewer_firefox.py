"""The viewer's page in Firefox, by Mozilla's Marionette; skipped where either is missing. The page itself is tested in Chromium.

With MORGANA_SCREENSHOTS set to a folder, pictures of the page are written there.
"""

import base64
import json
import os
import pathlib
import re
import shutil
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
"""Seconds that anything on the page may take."""


@pytest.fixture(scope="module")
def firefox(tmp_path_factory):
    log = tmp_path_factory.mktemp("firefox") / "log"
    browser = driver.Marionette(bin=FIREFOX, headless=True, gecko_log=str(log), prefs={"webgl.force-enabled": True})
    browser.start_session()
    browser.set_window_rect(width=1280, height=900)
    yield browser
    browser.quit()
    browser.cleanup()


def evaluate(firefox, code, *arguments):
    """The value of an expression on the page."""
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
    # Where there is WebGL the scene is drawn, elsewhere the page says that it cannot be.
    if evaluate(firefox, "() => Boolean(document.createElement('canvas').getContext('webgl2'))"):
        assert evaluate(firefox, "() => window.viewer.page().stage.objects.children.length") > 0
    else:
        assert "cannot be drawn" in evaluate(firefox, "() => document.getElementById('stage').innerText")
    picture(firefox, "firefox-scene")
