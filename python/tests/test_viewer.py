"""The viewer's page, driven like a person would: the test clicks, types and reads, and compares
with files.

Needs Chromium (Debian: apt install chromium) and Playwright; without them these tests are skipped.
With MORGANA_SCREENSHOTS set to a folder, images of the page are written there.
"""

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


def test_readings_are_sliced_and_plotted(page, serve, tmp_path):
    result = morgana.render(load(meters()), particles=6400)
    result.write(str(tmp_path / "meters.npz"))
    fluence = result.meters["fluence"]
    open_page(page, serve("view", tmp_path / "meters.npz"), "array=fluence")
    stored = np.load(tmp_path / "meters.npz")["fluence"]
    shape = page.evaluate("window.viewer.page().current.array.shape")
    assert shape == list(stored.shape) == list(fluence.mean.shape)
    part = page.evaluate("window.viewer.page().current.part")
    index = tuple(slice(None) if p == "*" else int(p) for p in part)
    values = page.evaluate("[...window.viewer.page().current.values]")
    np.testing.assert_array_equal(np.float32(values), np.float32(stored[index].ravel()))
    picture(page, "fluence")
    # Sum over the first long axis.
    axis = next(i for i, p in enumerate(part) if p != "*" and stored.shape[i] > 1)
    shown(page, lambda: control(page, f"sum{axis}").check())
    values = page.evaluate("[...window.viewer.page().current.values]")
    expected = stored.sum(axis=axis)
    rest = tuple(slice(None) if p == "*" else int(p) for i, p in enumerate(part) if i != axis)
    np.testing.assert_allclose(values, expected[rest].ravel(), rtol=1e-6)


@pytest.mark.parametrize(("kind", "array"), [("h5", "fluence"), ("nrrd", "volume")])
def test_arrays_of_other_formats_are_shown(page, serve, tmp_path, kind, array):
    result = morgana.render(load(meters()), particles=640)
    result.write(str(tmp_path / f"meters.{kind}"))
    open_page(page, serve("view", tmp_path / f"meters.{kind}"), f"array={array}&at0=1")
    values = page.evaluate("[...window.viewer.page().current.values]")
    np.testing.assert_array_equal(np.float32(values), np.float32(result.meters["fluence"].mean[1].ravel()))
    assert page.evaluate("window.viewer.page().current.array.axes")[:3] == [
        "z",
        "y",
        "x",
    ]


def current(page):
    """Returns the visible slice, row by row."""
    page_of = "window.viewer.page()"
    shape = page.evaluate(f"(p => p.shown(p.current.array).map(i => p.current.array.shape[i]))({page_of})")
    return np.array(page.evaluate(f"[...{page_of}.current.values]"), np.float32).reshape(shape)


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
    np.testing.assert_array_equal(current(page), density[:, 1, :].T)
    page.locator("#stage .surface canvas").focus()
    page.keyboard.press("ArrowUp")
    until(page, "document.getElementById('place')?.textContent === 'x 2, z 1'")
    assert numbers(page.inner_text("#reading")) == [density[1, 1, 2]]
    until(page, "location.hash.includes('axes=2%2C0')")
    open_page(page, address, page.evaluate("location.hash").lstrip("#"))
    np.testing.assert_array_equal(current(page), density[:, 1, :].T)
    shown(page, lambda: control(page, "array").select_option("line"))
    assert page.evaluate("[...window.viewer.page().current.values]") == [1, 2, 3, 4, 5]


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
    np.testing.assert_array_equal(current(page), np.float32(colours[2]))
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


def test_python_serves_results(page):
    result = morgana.render(load(small()), spp=4)
    view = morgana.view(result)
    open_page(page, view.address)
    plane = page.evaluate(
        "(async () => { const p = window.viewer.page(); return [...(await p.plane(0, '', p.channels()[0]))]; })()"
    )
    np.testing.assert_array_equal(np.float32(plane), result.image[..., 0].ravel())
    assert view.address in view._repr_html_()
    view.close()
    page.goto("about:blank")


def test_pages_are_accessible(page, serve, images):
    """Pages pass the rules of axe, at levels A and AA of WCAG 2."""
    axe = pytest.importorskip("axe_playwright_python", reason="axe-playwright-python is not installed")
    rules = next(pathlib.Path(axe.__file__).parent.rglob("axe.min.js")).read_text()
    address = serve("view", images / "seed1.exr", images / "seed2.exr", SCENES / "luneburg_fog.xml")
    for state in [
        "cursor=40,30&line=10,30,80,30",
        "channel=G&quantity=error&compare=slider&cursor=3,3",
        "item=2&from=-3,0.3,0&direction=1,0,0",
    ]:
        open_page(page, address, state)
        page.wait_for_timeout(500)
        page.evaluate(rules)
        found = page.evaluate("axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21aa', 'best-practice'] })")
        problems = [(v["id"], [n["html"][:120] for n in v["nodes"]]) for v in found["violations"]]
        assert problems == [], state
        assert len(found["passes"]) > 10
