"""The viewer's page, driven like a person would: the test clicks, types and reads, and compares
with files.

Needs Chromium (Debian: apt install chromium) and Playwright; without them these tests are skipped.
With MORGANA_SCREENSHOTS set to a folder, images of the page are written there.
"""

import base64
import importlib.util
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

import morgana
import numpy as np
import pytest
from conftest import PROGRAM, SCENES, load, meters, small

playwright = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium: apt install chromium")

OPTIONS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
]
OPTIONS += [
    "--disable-component-update",
    "--disable-sync",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
]
SCREENSHOTS = os.environ.get("MORGANA_SCREENSHOTS")
SIZE = {"width": 1280, "height": 800}
PATIENCE = 30
"""Maximum duration of anything on the page, in seconds."""


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM, args=OPTIONS)
        yield browser
        browser.close()


@pytest.fixture
def page(browser):
    """Opens a page, and asserts that it logs no error and sends no request to other hosts."""
    page = browser.new_page(viewport=SIZE)
    page.set_default_timeout(1000 * PATIENCE)
    problems = page.problems = []
    page.on(
        "console",
        lambda message: problems.append(message.text) if message.type == "error" else None,
    )
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.on(
        "request",
        lambda request: None if re.match(r"(http://127\.0\.0\.1:|blob:|data:)", request.url) else problems.append(request.url),
    )
    yield page
    assert problems == []
    page.close()


def fog():
    """A lit ball of fog whose index varies, 96 by 72 pixels."""
    scene = small()
    film = {**scene["sensor"]["film"], "width": 96, "height": 72}
    return load({**scene, "sensor": {**scene["sensor"], "film": film}})


@pytest.fixture(scope="module")
def images(tmp_path_factory):
    """Two renders of one scene with different seeds."""
    folder = tmp_path_factory.mktemp("images")
    for seed in (1, 2):
        morgana.write(folder / f"seed{seed}.exr", morgana.render(fog(), spp=8, seed=seed))
    return folder


def until(page, condition, argument=None):
    """Waits for a condition on the page, whose own policy forbids the evaluation of texts later."""
    end = time.monotonic() + PATIENCE
    while not page.evaluate(condition, argument):
        assert time.monotonic() < end, condition
        time.sleep(0.03)


def shown(page, action=lambda: None):
    """Waits until the page shows the result of an action."""
    before = page.evaluate("document.body.dataset.shown")
    action()
    until(
        page,
        "before => document.body.dataset.shown !== before && document.body.dataset.shown",
        before,
    )


def open_page(page, address, state=""):
    page.goto("about:blank")
    page.goto(f"{address}#{state}")
    until(page, "document.body.dataset.shown")


def control(page, name):
    return page.locator(f'[data-name="{name}"]')


def picture(page, name):
    if SCREENSHOTS:
        pathlib.Path(SCREENSHOTS).mkdir(parents=True, exist_ok=True)
        page.screenshot(path=f"{SCREENSHOTS}/{name}.png")


def numbers(text):
    """Returns the numbers in a text as the page formats them."""
    return [float(n) for n in re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", text.replace("−", "-"))]


def readings(page):
    """Returns values and errors under the cursor, by channel."""
    rows = page.locator("#values table").first.locator("tbody tr").all()
    cells = [row.locator("td").all_inner_texts() for row in rows]
    return {name: numbers(value) for name, value in cells}


def test_values_under_the_cursor_are_those_of_the_file(page, serve, images):
    image = morgana.read(images / "seed1.exr")
    address = serve("view", images / "seed1.exr")
    open_page(page, address)
    picture(page, "image")
    canvas = page.locator("#stage .surface canvas")
    box = canvas.bounding_box()
    canvas.click(position={"x": box["width"] / 2, "y": box["height"] / 2})
    page.wait_for_selector("#place")
    x, y = map(int, numbers(page.inner_text("#place")))
    assert abs(x - 48) <= 1 and abs(y - 36) <= 1
    for key in ["ArrowRight", "ArrowRight", "Shift+ArrowDown", "ArrowLeft"]:
        page.keyboard.press(key)
    x, y = x + 1, y + 10
    until(page, f"document.getElementById('place')?.textContent === 'x {x}, y {y}'")
    read = readings(page)
    for i, name in enumerate("RGB"):
        value, error = read[name]
        assert value == pytest.approx(float(image.layers[""][y, x, i]), rel=0.05, abs=2e-4)
        assert error == pytest.approx(float(np.sqrt(image.layers["variance"][y, x, i])), rel=0.06)
    assert read["samples"] == [8.0]
    # The address alone restores this state.
    until(page, "place => location.hash.includes(`cursor=${place}`)", f"{x}%2C{y}")
    state = page.evaluate("location.hash").lstrip("#")
    open_page(page, address, state)
    page.wait_for_selector("#place")
    assert page.inner_text("#place") == f"x {x}, y {y}"


def test_pixels_are_those_of_tonemap(page, serve, images, tmp_path):
    subprocess.run(
        [
            PROGRAM,
            "tonemap",
            images / "seed1.exr",
            "--exposure",
            "1.5",
            "--tone-map",
            "filmic",
            "-o",
            tmp_path / "a.png",
        ],
        check=True,
    )
    from matplotlib.image import imread

    expected = np.round(imread(tmp_path / "a.png")[..., :3] * 255).astype(int)
    address = serve("view", images / "seed1.exr")
    open_page(page, address)
    shown(
        page,
        lambda: control(page, "exposure").fill("1.5") or control(page, "exposure").press("Enter"),
    )
    shown(page, lambda: control(page, "curve").select_option("filmic"))
    page.get_by_role("button", name="1:1").click()
    page.wait_for_timeout(300)
    with page.expect_download() as saved:
        page.get_by_role("button", name="Save PNG").click()
    saved.value.save_as(tmp_path / "b.png")
    found = np.round(imread(tmp_path / "b.png")[..., :3] * 255).astype(int)
    # The page's tables round a second time.
    assert np.abs(found - expected).max() <= 1
    assert (found != expected).mean() < 0.02
    # The canvas shows them, pixel by pixel.
    code = """([w, h]) => { const c = document.querySelector('#stage .surface canvas');
        const d = c.getContext('2d').getImageData(Math.floor(c.width / 2) - w / 2, Math.floor(c.height / 2) - h / 2, w, h).data; return [...d]; }"""
    data = np.array(page.evaluate(code, [96, 72])).reshape(72, 96, 4)[..., :3]
    assert (np.abs(data - found).max(axis=-1) == 0).mean() > 0.99


def test_errors_and_false_colours(page, serve, images):
    image = morgana.read(images / "seed1.exr")
    open_page(page, serve("view", images / "seed1.exr"))
    shown(page, lambda: control(page, "channel").select_option("G"))
    shown(page, lambda: control(page, "quantity").select_option("error"))
    plane = page.evaluate("[...window.viewer.page().canvas.pictures[0].planes[0]]")
    expected = np.sqrt(image.layers["variance"][..., 1]).ravel()
    np.testing.assert_allclose(plane, expected, rtol=1e-6)
    low, middle, high = (numbers(text)[0] for text in page.locator(".scale span").all_inner_texts())
    assert low < middle < high and middle == pytest.approx((low + high) / 2, rel=0.02)
    assert high == pytest.approx(np.quantile(expected[expected > 0], 0.995), rel=0.05)
    page.locator("#stage .surface canvas").focus()
    page.keyboard.press("ArrowUp")
    picture(page, "error")


def test_images_are_compared(page, serve, images):
    compared = json.loads(
        subprocess.run(
            [PROGRAM, "compare", "seed1.exr", "seed2.exr", "--json"],
            cwd=images,
            capture_output=True,
            check=True,
        ).stdout
    )
    address = serve(
        "view",
        images / "seed1.exr",
        images / "seed2.exr",
        SCENES / "luneburg_fog.xml",
        "-D",
        "width=96",
        "-D",
        "height=72",
    )
    open_page(page, address)
    shown(page, lambda: control(page, "compare").select_option("z"))
    z = np.array(page.evaluate("[...window.viewer.page().canvas.pictures[0].planes[0]].map(v => Number.isFinite(v) ? v : 0)"))
    a, b = (morgana.read(images / f"seed{seed}.exr").layers for seed in (1, 2))
    difference = (a[""] - b[""])[..., 0]
    with np.errstate(invalid="ignore", divide="ignore"):
        expected = difference / np.sqrt(a["variance"] + b["variance"])[..., 0]
    known = np.isfinite(expected) & (np.abs(difference) > 1e-6)
    np.testing.assert_allclose(z[known.ravel()], expected[known], rtol=1e-3)
    shown(page, lambda: control(page, "compare").select_option("flip"))
    flip = page.evaluate("(p => p.reduce((a, b) => a + b) / p.length)(window.viewer.page().canvas.pictures[0].planes[0])")
    # `compare` uses no exposure; the page uses the exposure that it shows.
    shown(
        page,
        lambda: control(page, "exposure").fill("0") or control(page, "exposure").press("Enter"),
    )
    unexposed = page.evaluate("(p => p.reduce((a, b) => a + b) / p.length)(window.viewer.page().canvas.pictures[0].planes[0])")
    assert unexposed == pytest.approx(compared["flip"], rel=1e-5) and 0 < flip < 1
    shown(
        page,
        lambda: control(page, "exposure").fill("2") or control(page, "exposure").press("Enter"),
    )
    shown(page, lambda: control(page, "compare").select_option("slider"))
    canvas = page.locator("#stage .surface canvas")
    box = canvas.bounding_box()
    y = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] / 2, y)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 4, y, steps=4)
    page.mouse.up()
    page.wait_for_timeout(300)
    assert numbers(page.url.split("split=")[1])[0] == pytest.approx(0.25, abs=0.01)
    picture(page, "slider")
    shown(page, lambda: control(page, "compare").select_option("beside"))
    assert page.evaluate("window.viewer.page().canvas.pictures.length") == 2


def test_images_of_other_sizes_are_compared_where_they_overlap(page, serve, tmp_path):
    wide, tall = np.random.default_rng(1).random((2, 6, 9))
    tall = tall.T.copy()
    np.save(tmp_path / "wide.npy", wide)
    np.save(tmp_path / "tall.npy", tall)
    address = serve("view", tmp_path / "wide.npy", tmp_path / "tall.npy")
    open_page(page, address, "compare=flip&cursor=2,3")
    assert "9 × 6 and 6 × 9 pixels" in page.inner_text("#overlap")
    assert page.evaluate("(({ width, height }) => [width, height])(window.viewer.page().canvas.pictures[0])") == [6, 6]
    shown(page, lambda: control(page, "compare").select_option("beside"))
    values = page.locator("#values table tbody tr td:nth-child(2)").all_inner_texts()
    assert [numbers(v)[0] for v in values[:2]] == pytest.approx([wide[3, 2], tall[3, 2]], rel=1e-6)
    page.evaluate("window.viewer.state.set({ cursor: '8,3' })")
    until(page, "document.getElementById('values').textContent.includes('outside of this image')")


def test_keys_and_white(page, serve, images):
    """Keys change the exposure and the item; a neutral pixel becomes grey, as in `morgana tonemap`."""
    address = serve("view", images / "seed1.exr", images / "seed2.exr")
    open_page(page, address, "cursor=40,30")
    exposure = page.evaluate("window.viewer.page().exposure()")
    shown(page, lambda: page.keyboard.press("e"))
    assert page.evaluate("window.viewer.page().exposure()") == exposure + 0.5
    shown(page, lambda: page.keyboard.press("Shift+E"))
    assert page.evaluate("window.viewer.page().exposure()") == exposure
    shown(page, lambda: page.get_by_role("button", name="Pixel is neutral").click())
    colours = "window.viewer.page().canvas.pictures[0]"
    at = 30 * 96 + 40
    grey = page.evaluate(f"(({{ planes, encode }}) => {{ const out = []; encode(planes.map(p => p[{at}]), out, 0); return out; }})({colours})")
    assert max(grey) - min(grey) <= 1, grey
    shown(page, lambda: control(page, "white").fill("3200") or control(page, "white").press("Enter"))
    red, green, blue = page.evaluate("window.viewer.page().gains()")
    assert red < green < blue
    control(page, "white").fill("warm")
    control(page, "white").press("Enter")
    until(page, "document.getElementById('status').textContent.includes('such as 3200')")
    shown(page, lambda: control(page, "white").fill("") or control(page, "white").press("Enter"))
    page.problems.clear()
    page.locator("#stage .surface canvas").focus()
    page.keyboard.press("n")
    until(page, "document.title.startsWith('seed2')")
    page.keyboard.press("p")
    until(page, "document.title.startsWith('seed1')")


def colours(page, selector):
    """Returns the number of different colours of a canvas."""
    code = """selector => {
        const canvas = document.querySelector(selector);
        const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
        return new Set(Array.from({ length: data.length / 4 }, (_, i) => data.slice(4 * i, 4 * i + 3).join())).size;
    }"""
    return page.evaluate(code, selector)


def test_scenes_are_seen_at_once_and_from_everywhere(page, serve):
    """The film shows a preview, coarse and then finer; so does the view that one turns."""
    open_page(page, serve("view", SCENES / "luneburg_fog.xml"))
    until(page, "document.body.dataset.picture")
    until(page, "JSON.parse(document.body.dataset.picture).scale < 8")
    assert colours(page, "canvas.film") > 50
    control(page, "picture").check()
    of_view = "JSON.parse(document.body.dataset.picture).isOfView"
    until(page, of_view)
    assert colours(page, "canvas.picture") > 50
    # Another view gives another picture.
    copy = "document.querySelector('canvas.picture').toDataURL()"
    before = page.evaluate(copy)
    page.mouse.move(450, 400)
    page.mouse.down()
    page.mouse.move(550, 420, steps=4)
    page.mouse.up()
    until(page, f"before => {copy} !== before", before)
    picture(page, "preview")
    control(page, "picture").uncheck()
    until(page, "document.querySelector('canvas.picture').hidden")


def test_dropped_files_do_not_replace_the_page(page, serve):
    open_page(page, serve("view", SCENES / "luneburg_fog.xml"))
    page.evaluate("""() => {
        const dataTransfer = new DataTransfer();
        dataTransfer.items.add(new File(['x'], 'fog.exr'));
        document.body.dispatchEvent(new DragEvent('drop', { dataTransfer, bubbles: true, cancelable: true }));
    }""")
    said = page.locator("#status").text_content()
    assert "morgana view luneburg_fog.xml fog.exr" in said


def test_pictures_follow_parameters(page, serve):
    open_page(page, serve("view", SCENES / "luneburg_fog.xml"))
    until(page, "document.body.dataset.picture")
    names = page.evaluate("window.viewer.page().about.parameters.map(({ name }) => name)")
    fog = next(name for name in names if name.endswith("sigma_t"))
    page.locator("#parameters summary").click()
    copy = "document.querySelector('canvas.film').toDataURL()"
    before = page.evaluate(copy)
    control(page, f"set {fog}").fill("0")
    control(page, f"set {fog}").press("Enter")
    until(page, f"before => {copy} !== before", before)
    control(page, "estimator").select_option("path")
    until(page, "JSON.parse(document.body.dataset.picture).scale < 8")
    control(page, f"set {fog}").fill("much")
    control(page, f"set {fog}").press("Enter")
    until(page, "document.querySelector('#rays').textContent.includes('type a value')")
    picture(page, "parameters")
    page.get_by_role("button", name="As in the file").click()
    until(page, "Object.keys(window.viewer.page().changes()).length === 0")


def test_objects_have_names_and_the_scene_a_scale(page, serve):
    open_page(page, serve("view", SCENES / "luneburg_fog.xml"))
    names = page.evaluate("window.viewer.page().about.objects.map(({ name }, i) => name || `object ${i}`)")
    label = page.locator("#stage .name")
    assert label.is_hidden()
    page.locator("#stage .surface canvas").first.focus()
    seen = set()
    for _ in range(12):
        page.keyboard.press("o")
        seen.add(label.inner_text().split(",")[0])
    assert set(names) <= seen | {""}, (names, seen)
    # The pointer in the middle of the picture is on one of the objects.
    page.mouse.move(450, 400)
    page.mouse.move(452, 402)
    until(page, "document.querySelector('#stage .name').textContent !== ''")
    lit = page.evaluate("(c => { const d = c.getContext('2d').getImageData(0, c.height - 60, 300, 60).data; return d.filter((v, i) => i % 4 === 3 && v > 0).length; })(document.querySelector('canvas.overlay'))")
    assert lit > 100


def test_profiles_have_bands(page, serve, images):
    image = morgana.read(images / "seed1.exr")
    open_page(page, serve("view", images / "seed1.exr"), "channel=R&line=10,36,80,36")
    page.wait_for_selector(".below .uplot")
    values = image.layers[""][36, 10:81, 0]
    code = "(async () => { const p = window.viewer.page(); return [...(await p.plane(0, '', 'R'))].slice(36 * 96 + 10, 36 * 96 + 81); })()"
    np.testing.assert_array_equal(np.float32(page.evaluate(code)), values)
    # Draw a line by dragging with the shift key.
    canvas = page.locator("#stage .surface canvas")
    box = canvas.bounding_box()
    page.mouse.move(box["x"] + box["width"] * 0.3, box["y"] + box["height"] * 0.3)
    page.keyboard.down("Shift")
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.7, box["y"] + box["height"] * 0.6, steps=5)
    page.mouse.up()
    page.keyboard.up("Shift")
    until(page, "!window.viewer.state.get('line').startsWith('10,36')")
    shown(page, lambda: control(page, "channel").select_option("colours"))
    picture(page, "profile")


def test_rays_of_pixels_are_those_of_trace(page, serve, program, tmp_path):
    scene = SCENES / "luneburg_fog.xml"
    address = serve("view", scene)
    open_page(page, address, "from=-3,0.3,0&direction=1,0,0")
    page.wait_for_selector("#rays table")
    program("trace", scene, "--from=-3,0.3,0", "--direction", "1,0,0", "-o", "ray.json")
    ray = json.loads((tmp_path / "ray.json").read_text())["rays"][0]
    rows = dict(row.locator("td").all_inner_texts() for row in page.locator("#rays table tbody tr").all())
    last = ray["points"][-1]
    assert numbers(rows["arc length"])[0] == pytest.approx(last["arc_length"], rel=1e-6)
    assert numbers(rows["optical length"])[0] == pytest.approx(last["opl"], rel=1e-6)
    assert numbers(rows["points"]) == [len(ray["points"])]
    # A click on the film selects a pixel, whose ray ends on an object.
    film = page.locator("canvas.film")
    film.scroll_into_view_if_needed()
    box = film.bounding_box()
    before = page.evaluate("document.body.dataset.rays")
    film.click(position={"x": box["width"] * 0.5, "y": box["height"] * 0.5})
    until(page, "before => document.body.dataset.rays !== before", before)
    assert page.evaluate("window.viewer.state.get('pixel')") != ""
    picture(page, "scene")


def test_what_is_typed_is_checked(page, serve):
    open_page(
        page,
        serve("view", SCENES / "luneburg_fog.xml"),
        "pixel=middle&from=1,2&emitter=point",
    )
    page.wait_for_selector("#rays .warning")
    said = page.locator("#rays .warning").all_inner_texts()
    assert [text.split(":")[0] for text in said] == ["Pixel", "From", "Point"]
    assert "2 numbers" in said[0] and "3 numbers" in said[1]


def test_ten_thousand_segments_are_drawn_like_a_hundred(page, serve):
    """Segments are drawn as one object, not much more slowly, and only after changes. Frame rates
    are compared, because machines differ."""
    open_page(page, serve("view", SCENES / "luneburg_fog.xml"))
    code = """count => { const { stage } = window.viewer.page();
        const rays = Array.from({ length: 100 }, (_, r) => ({ colour: 0xffd166, points: Array.from({ length: count / 100 + 1 }, (_, i) =>
            [Math.cos(i / 16 + r), Math.sin(i / 16 + r), i / 50 - 1]) }));
        stage.setRays(rays); stage.frameRate(2); return [stage.frameRate(10), stage.renderer.info.render.calls]; }"""
    (few, calls), (many, more_calls) = (page.evaluate(code, count) for count in (100, 10000))
    print(f"{many:.0f} frames per second with 10,000 segments, {few:.0f} with 100")
    assert calls == more_calls and many > few / 4
    code = """() => { const { renderer } = window.viewer.page().stage; const before = renderer.info.render.frame;
        return new Promise(done => setTimeout(() => done(renderer.info.render.frame - before), 500)); }"""
    page.wait_for_timeout(300)
    assert page.evaluate(code) == 0


def test_a_render_is_watched(page, serve, tmp_path):
    address = serve(
        "render",
        SCENES / "luneburg_fog.xml",
        "-D",
        "width=96",
        "-D",
        "height=72",
        "--time",
        "60s",
        "--integrator",
        "path",
        "--view",
        "-o",
        "a.exr",
        cwd=tmp_path,
    )
    open_page(page, address)
    until(page, "window.viewer.page()?.version >= 2")
    page.get_by_role("button", name="Pause", exact=True).click()
    page.get_by_role("button", name="Go on").wait_for()
    page.get_by_role("button", name="Go on").click()
    version = page.evaluate("window.viewer.page().version")
    until(page, "version => window.viewer.page().version > version + 2", version)
    picture(page, "live")
    page.get_by_role("button", name="Stop").click()
    until(page, "document.getElementById('progress').textContent.startsWith('done')")
    until(page, "!window.viewer.page().isBusy")
    image = morgana.read(tmp_path / "a.exr")
    plane = page.evaluate("(async () => [...(await window.viewer.page().plane(0, '', 'G'))])()")
    np.testing.assert_array_equal(np.float32(plane), image.layers[""][..., 1].ravel())


def test_films_have_a_time_cursor(page, serve, tmp_path):
    options = [
        "-D",
        "width=48",
        "-D",
        "height=36",
        "--spp",
        "4",
        "-q",
        "-o",
        tmp_path / "film.exr",
    ]
    subprocess.run([PROGRAM, "render", SCENES / "light_in_flight.xml", *options], check=True)
    image = morgana.read(tmp_path / "film.exr")
    names = [name for name in image.layers if re.match(r"(length|time)\.\d+$", name)]
    open_page(page, serve("view", tmp_path / "film.exr"), f"layer={names[len(names) // 2]}")
    slider = control(page, "bin")
    assert int(slider.get_attribute("max")) == len(names) - 1
    slider.focus()
    shown(page, lambda: page.keyboard.press("ArrowRight"))
    name = names[len(names) // 2 + 1]
    assert page.evaluate("window.viewer.page().layer()") == name
    channel = image.channels[name][0]
    plane = page.evaluate(
        "name => window.viewer.page().plane(0, name[0], name[1]).then(p => [...p])",
        [name, channel],
    )
    np.testing.assert_array_equal(np.float32(plane), image.layers[name][..., 0].ravel())
    shown(page, lambda: page.get_by_role("button", name="Play film").click())
    until(page, "name => window.viewer.page().layer() !== name", name)
    page.get_by_role("button", name="Pause film").click()
    picture(page, "film")


def current(page):
    """Returns the values of the first visible plane, as the file orders its two axes."""
    page_of = "window.viewer.page()"
    canvas = page.evaluate(f"(({{ pictures, picture, shownAxes }}) => [picture.height, picture.width, picture.isUp, shownAxes])({page_of}.canvases[0])")
    height, width, is_up, (up, across) = canvas
    values = np.array(page.evaluate(f"[...{page_of}.current.values]"), np.float32).reshape(height, width)
    values = values[::-1] if is_up else values
    return values.T if up > across else values


def profile(page):
    return np.array(page.evaluate("[...window.viewer.page().current.values]"), np.float32)


def place(page):
    """Returns the lines that say which cell is looked at."""
    return page.locator("#place p").all_inner_texts()


GRID = {"nx": 4, "ny": 6, "nz": 5}


def lit_block(**meter):
    """A point source at the bottom of a block of tissue, 8 by 6 by 20 mm, with a fluencemeter."""
    scene = {
        "type": "scene",
        "integrator": {"type": "particle"},
        "source": {"type": "point", "position": [3.1, 0.5, 2.2]},
        "tissue": {
            "type": "cube",
            "to_world": [{"scale": [4, 3, 10]}, {"translate": [4, 3, 10]}],
            "interior": {"type": "homogeneous", "sigma_s": 1.0, "sigma_a": 0.05},
        },
        "cells": {
            "type": "fluencemeter",
            **GRID,
            "metres_per_unit": 1e-3,
            "to_world": [{"scale": [8, 6, 20]}],
            **meter,
        },
    }
    return load(scene)


@pytest.fixture(scope="module")
def fluence(tmp_path_factory):
    """Readings of the block, as arrays and as a file."""
    file = tmp_path_factory.mktemp("fluence") / "fluence.npz"
    morgana.render(lit_block(), particles=6400).write(str(file))
    return dict(np.load(file)), file


def test_a_fluence_opens_in_its_largest_plane_through_the_maximum(page, serve, fluence):
    arrays, file = fluence
    values = arrays["fluence"]
    open_page(page, serve("view", file))
    assert page.inner_text("#status") == "fluence in W/mm²"
    # Errors, flags and edges belong to their quantity.
    quantities = control(page, "array").locator("option").all_inner_texts()
    assert quantities == ["fluence (5 × 6 × 4)", "absorbed (5 × 6 × 4)", "to_world (3 × 4)", "emitted (1)"]
    z, y, x = np.unravel_index(values.argmax(), values.shape)
    # The largest sides are along z and x.
    assert control(page, "axes").locator("option:checked").inner_text() == "z up, x across"
    np.testing.assert_array_equal(current(page), np.float32(values[:, y, :]))
    assert place(page) == [f"z {4 * z} to {4 * z + 4} mm", f"y {y} to {y + 1} mm", f"x {2 * x} to {2 * x + 2} mm"]
    value, error = numbers(page.inner_text("#reading"))[:2]
    assert value == pytest.approx(values.max(), rel=1e-3)
    assert error == pytest.approx(arrays["fluence_error"][z, y, x], rel=0.05)
    # Cells have their true shape, 4 mm high and 2 mm wide, and stand upright.
    box = page.evaluate("(({ view, pictures: [{ axes }] }) => axes.map(({ places }) => (places[1] - places[0]) * view.zoom))(window.viewer.page().canvases[0])")
    assert box[1] == pytest.approx(2 * box[0])
    picture(page, "fluence")
    # The arrow up leads to the next cell along z.
    page.locator("#stage .surface canvas").focus()
    page.keyboard.press("ArrowUp")
    until(page, "text => document.getElementById('place')?.textContent.startsWith(text)", f"z {4 * z + 4} to")
    shown(page, lambda: control(page, "quantity").select_option("_error"))
    np.testing.assert_array_equal(current(page), np.float32(arrays["fluence_error"][:, y, :]))
    shown(page, lambda: control(page, "quantity").select_option(""))
    shown(page, lambda: control(page, f"sum{1}").check())
    np.testing.assert_allclose(current(page), values.sum(axis=1), rtol=1e-6)


def test_three_planes_cross_where_one_looks(page, serve, fluence):
    arrays, file = fluence
    values = arrays["fluence"]
    open_page(page, serve("view", file), "layout=planes&at0=1&at1=2&at2=3")
    planes = page.evaluate("window.viewer.page().canvases.map(({ pictures: [{ planes: [p], height }] }) => [height, ...p])")
    for (height, *plane), expected in zip(planes, [values[:, 2, :], values[:, :, 3], values[1]]):
        np.testing.assert_array_equal(np.reshape(plane, (int(height), -1))[::-1], np.float32(expected))
    # A click in the plane of y and z moves both.
    canvas = page.locator("#stage .surface canvas").nth(1)
    shown(page, lambda: canvas.focus() or page.keyboard.press("ArrowRight"))
    assert place(page) == ["z 4 to 8 mm", "y 3 to 4 mm", "x 6 to 8 mm"]
    picture(page, "planes")
    np.testing.assert_array_equal(page.evaluate("window.viewer.page().canvases[0].pictures[0].planes[0][0]"), np.float32(values[4, 3, 0]))


def test_limits_are_dragged_on_the_colour_bar(page, serve, fluence):
    arrays, file = fluence
    open_page(page, serve("view", file), "log=0")
    [low, high] = page.evaluate("window.viewer.page().bar.range")
    box = page.locator(".scale canvas").bounding_box()
    page.mouse.move(box["x"] + 0.9 * box["width"], box["y"] + 5)
    page.mouse.down()
    shown(page, lambda: page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 5))
    page.mouse.up()
    assert numbers(control(page, "high").input_value()) == [pytest.approx(low + 0.6 * (high - low), rel=0.02)]
    shown(page, lambda: page.mouse.dblclick(box["x"] + 0.9 * box["width"], box["y"] + 5))
    assert page.evaluate("window.viewer.page().bar.range") == [low, high]


def test_gates_are_a_film(page, serve, tmp_path):
    morgana.render(lit_block(bin_width=8.0, max_bound=32.0), particles=3200).write(str(tmp_path / "gates.npz"))
    open_page(page, serve("view", tmp_path / "gates.npz"), "at0=0")
    stored = np.load(tmp_path / "gates.npz")["fluence"]
    page.get_by_role("button", name="Play film").click()
    until(page, "window.viewer.page().current.place[0] === 2")
    page.get_by_role("button", name="Pause film").click()
    gate = page.evaluate("window.viewer.page().current.place[0]")
    assert page.locator("[data-where='0']").inner_text() == f"opl {8 * gate} to {8 * gate + 8} mm"
    y = page.evaluate("window.viewer.page().current.place[2]")
    np.testing.assert_array_equal(current(page), np.float32(stored[gate, :, y, :]))


@pytest.mark.parametrize("layout", ["volume", "surface"])
def test_volumes_are_drawn(page, serve, fluence, layout):
    """The volume is brightest, and its surface is, where the fluence is largest: low and in front."""
    _, file = fluence
    open_page(page, serve("view", file), f"layout={layout}")
    time.sleep(0.5)
    picture(page, layout)
    count = """() => {
        const space = window.viewer.page().space;
        space.renderer.render(space.scene, space.camera);
        const gl = space.renderer.getContext();
        const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
        const pixels = new Uint8Array(4 * width * height);
        gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
        const lit = [0, 0];
        for (let i = 0; i < width * height; i += 1) if (pixels[4 * i + 1] > 60) lit[Number(i >= width * height / 2)] += 1;
        return [...lit, gl.getError()];
    }"""
    bottom, top, error = page.evaluate(count)
    assert error == 0 and bottom > 1000 and bottom > 2 * top, (bottom, top, error)


@pytest.mark.parametrize(("kind", "array"), [("h5", "fluence"), ("nrrd", "volume")])
def test_arrays_of_other_formats_are_shown(page, serve, tmp_path, kind, array):
    result = morgana.render(load(meters()), particles=640)
    result.write(str(tmp_path / f"meters.{kind}"))
    open_page(page, serve("view", tmp_path / f"meters.{kind}"), f"array={array}&at0=1&axes=1,2")
    np.testing.assert_array_equal(current(page), np.float32(result.meters["fluence"].mean[1]))
    assert page.evaluate("window.viewer.page().current.array.axes")[:3] == [
        "z",
        "y",
        "x",
    ]


def test_one_of_several_arrays_is_chosen(page, serve, tmp_path):
    """Arrays of an archive without information on axes are selected, transposed and named on the
    page, and by its address."""
    density = np.arange(24.0).reshape(2, 3, 4)
    np.savez_compressed(tmp_path / "a.npz", density=density, line=np.arange(1, 6), text="water")
    address = serve("view", tmp_path / "a.npz")
    open_page(page, address)
    assert control(page, "array").locator("option").all_inner_texts() == [
        "density (2 × 3 × 4)",
        "line (5)",
    ]
    np.testing.assert_array_equal(current(page), density[1])
    assert page.locator("#side .warning").inner_text().startswith("Left out: text")
    shown(
        page,
        lambda: control(page, "names").fill("z y x") or control(page, "names").press("Enter"),
    )
    shown(page, lambda: control(page, "axes").select_option(label="x down, z across"))
    np.testing.assert_array_equal(current(page), density[:, 2, :])
    page.locator("#stage .surface canvas").focus()
    page.keyboard.press("ArrowUp")
    until(page, "document.getElementById('place')?.textContent === 'z 1y 2x 2'")
    assert numbers(page.inner_text("#reading")) == [density[1, 2, 2]]
    until(page, "location.hash.includes('axes=2%2C0')")
    open_page(page, address, page.evaluate("location.hash").lstrip("#"))
    np.testing.assert_array_equal(current(page), density[:, 2, :])
    shown(page, lambda: control(page, "array").select_option("line"))
    np.testing.assert_array_equal(profile(page), [1, 2, 3, 4, 5])


def test_names_in_files_are_text(page, serve, tmp_path):
    """A name with markup is shown verbatim: it creates no element (and no request or error, which
    fail every test here)."""
    name = "<img src=x onerror=alert(1)><b>bold</b>"
    np.savez(tmp_path / "a.npz", **{name: np.zeros((2, 3))}, other=np.zeros(4))
    open_page(page, serve("view", tmp_path / "a.npz"))
    options = control(page, "array").locator("option").all_inner_texts()
    assert any(option.startswith(name) for option in options), options
    assert page.locator("img[src=x], b:text-is('bold')").count() == 0


def test_arrays_are_pictures_or_slices(page, serve, tmp_path):
    """A last axis of length three counts as colours, any other as part of a volume; each can be
    shown as the other."""
    colours = np.arange(60.0).reshape(4, 5, 3) / 60
    volume = np.arange(120.0).reshape(4, 5, 6)
    np.save(tmp_path / "colours.npy", colours)
    np.save(tmp_path / "volume.npy", volume)
    address = serve("view", tmp_path / "colours.npy", tmp_path / "volume.npy")
    open_page(page, address)
    assert page.evaluate("window.viewer.page().canvas.pictures[0].planes.map(p => p[7])") == pytest.approx(colours[1, 2])
    shown(page, lambda: control(page, "as").select_option("arrays"))
    np.testing.assert_array_equal(current(page), np.float32(colours[3]))
    open_page(page, address, "item=1&at0=3")
    np.testing.assert_array_equal(current(page), volume[3])
    shown(page, lambda: control(page, "as").select_option("image"))
    # Six channels have the brightness of their mean.
    assert page.evaluate("window.viewer.page().canvas.pictures[0].planes[0][7]") == volume[1, 2].mean()


def test_files_that_change_and_programs_that_end(page, serve, tmp_path):
    file = tmp_path / "a.npy"
    np.save(file, np.zeros((4, 5)))
    address = serve("view", file)
    open_page(page, address)
    np.save(file, np.ones((6, 7)))
    open_page(page, address)
    assert page.inner_text("#status") == "7 × 6"
    file.write_bytes(b"nothing")
    open_page(page, address)
    assert page.inner_text("#status") == "7 × 6" and "has changed" in page.inner_text("#side .warning")
    serve.processes[address].kill()
    serve.processes[address].wait()
    control(page, "as").select_option("arrays")
    until(page, "document.getElementById('status').textContent.includes('has ended')")
    # The browser itself reports that the server does not respond.
    page.problems.clear()


def first_plane(page):
    """Returns the values of the first channel of the first item."""
    code = "(async () => { const p = window.viewer.page(); return [...(await p.plane(0, '', p.channels()[0]))]; })()"
    return np.float32(page.evaluate(code)).reshape(-1)


def test_python_serves_results(page, monkeypatch):
    result = morgana.render(load(small()), spp=4)
    view = morgana.view(result)
    open_page(page, view.address)
    np.testing.assert_array_equal(first_plane(page), result.image[..., 0].ravel())
    assert view.address in repr(view)
    # Without anywidget, a notebook shows the page in a frame.
    monkeypatch.setitem(sys.modules, "anywidget", None)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert f'<iframe src="{view.address}"' in view._repr_mimebundle_()["text/html"]
    monkeypatch.setitem(sys.modules, "morgana._widget", None)
    with pytest.raises(morgana.RenderError, match="pip install anywidget"):
        view.widget
    view.close()
    page.goto("about:blank")


HOST = """<!DOCTYPE html><title>a notebook</title><link rel="icon" href="data:,"><div id="cell"></div>
<script type="module">
import widget from './widget.js';

// The model of a widget, as notebooks give it to anywidget.
const heard = [];
const model = {
    get: (name) => ({ height: 500 })[name],
    on: (_, listener) => heard.push(listener),
    off: (_, listener) => heard.splice(heard.indexOf(listener), 1),
    send: async (message) => {
        const [answer, content] = await window.kernel(message);
        // Notebooks give the part of a larger buffer.
        const bytes = Uint8Array.from(`....${atob(content)}....`, (letter) => letter.charCodeAt(0));
        for (const listener of heard) listener(answer, [new DataView(bytes.buffer, 4, bytes.length - 8)]);
    },
};
await widget.render({ model, el: document.getElementById('cell') });
</script>"""
"""A page that shows a widget as notebooks do."""


def test_notebooks_show_the_page_without_a_server(page, fluence):
    pytest.importorskip("anywidget", reason="anywidget is not installed")
    result = morgana.render(load(small()), spp=4)
    view = morgana.view(result, fluence[1])
    assert "application/vnd.jupyter.widget-view+json" in view._repr_mimebundle_()[0]
    asked = []

    def kernel(message):
        sent = []
        view.widget.send = lambda *answer: sent.append(answer)
        view.widget._handle_custom_msg(message, [])
        [(answer, [content])] = sent
        asked.append((message["path"], answer["status"]))
        return [answer, base64.b64encode(content).decode()]

    page.expose_function("kernel", kernel)
    html, script = {"body": HOST, "content_type": "text/html"}, {"body": view.widget._esm, "content_type": "text/javascript"}
    page.route("http://127.0.0.1:9/**", lambda route: route.fulfill(**(script if route.request.url.endswith("widget.js") else html)))
    page.goto("http://127.0.0.1:9/")
    # The frame is empty before the document is complete.
    page.frame_locator("iframe").locator("body[data-shown]").wait_for()
    frame = page.frames[-1]
    np.testing.assert_array_equal(first_plane(frame), result.image[..., 0].ravel())
    shown(frame, lambda: control(frame, "item").select_option("1"))
    picture(page, "notebook")
    assert {status for _, status in asked} == {200}
    assert {"index.html", "viewer.css", "api/items"} <= {path for path, _ in asked}


def test_pages_are_accessible(page, serve, images, fluence):
    """Pages pass the rules of axe, at levels A and AA of WCAG 2."""
    axe = pytest.importorskip("axe_playwright_python", reason="axe-playwright-python is not installed")
    rules = next(pathlib.Path(axe.__file__).parent.rglob("axe.min.js")).read_text()
    address = serve("view", images / "seed1.exr", images / "seed2.exr", SCENES / "luneburg_fog.xml", fluence[1])
    for state in [
        "cursor=40,30&line=10,30,80,30",
        "channel=G&quantity=error&compare=slider&cursor=3,3",
        "item=2&from=-3,0.3,0&direction=1,0,0",
        "item=3&layout=planes",
        "item=3&layout=volume",
    ]:
        open_page(page, address, state)
        page.wait_for_timeout(500)
        page.evaluate(rules)
        found = page.evaluate("axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21aa', 'best-practice'] })")
        problems = [(v["id"], [n["html"][:120] for n in v["nodes"]]) for v in found["violations"]]
        assert problems == [], state
        assert len(found["passes"]) > 10
