"""The documents: what their commands and code print, and their links."""

import os
import pathlib
import re
import subprocess
import sys
import tempfile

import morgana
import pytest
from conftest import ROOT

sys.path.insert(0, str(ROOT / "scripts"))
import documents  # noqa: E402

LINKED = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"]
LINKED += sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").rglob("*.md"))
"""Pages whose links are followed."""
MADE = ("plugins/", "command-line.md")
"""Pages of docs/reference that the site alone has."""


LONG = "MORGANA_LONG_TESTS" in os.environ


def blocks(name, language):
    return re.findall(rf"^```{language}\n(.*?)^```", (ROOT / name).read_text(), re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize("name", documents.PAGES)
@pytest.mark.filterwarnings("ignore::morgana.SceneWarning")
def test_pages_show_what_they_print(name, tmp_path):
    text = documents.Page(name, tmp_path, LONG).run()
    assert documents.difference(name, text) == "", f"scripts/documents.py --write {name} updates the page"


def test_changed_numbers_are_found(tmp_path, monkeypatch):
    """A page that shows another number than its commands, its code or a changed scene print."""
    film = '<film type="hdrfilm"><integer name="width" value="96"/><integer name="height" value="72"/></film>'
    camera = f'<sensor type="perspective">{film}</sensor>'
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes/sky.xml").write_text(f'<scene version="3.0.0">{camera}<emitter type="constant"/></scene>')
    monkeypatch.setattr(documents, "ROOT", tmp_path)
    page = tmp_path / "page.md"

    def changed(text):
        page.write_text(text)
        with tempfile.TemporaryDirectory() as folder:
            ran = documents.Page("page.md", pathlib.Path(folder)).run()
        return [line for line in documents.difference("page.md", ran).splitlines()[2:] if line[0] in "+-"]

    command = "```console\n$ morgana render scenes/sky.xml -o sky.png --spp 4\n{}\nwrote sky.png\n```\n"
    report = "… · 4 spp · … · mean 1 ± 0 · no connections · integrator path: a pilot finds no noise"
    assert changed(command.format(report)) == []
    wrong = report.replace("mean 1", "mean 2")
    assert changed(command.format(wrong)) == [f"-{wrong}", f"+{report}"]

    code = "```python\nprint(6 * 7)\n```\n\n```text\n{}\n```\n"
    assert changed(code.format(42)) == []
    assert changed(code.format(41)) == ["-41", "+42"]

    file = f'```xml title="sky.xml"\n<scene version="3.0.0">{camera}</scene>\n```\n\n```xml title="sky.xml"\n<emitter type="constant"/>\n```\n'
    assert changed(file + command.replace("scenes/", "").format(report)) == []
    (tmp_path / "scenes/sky.xml").write_text(f'<scene version="3.0.0">{camera}<emitter type="constant"><float name="radiance" value="0.75"/></emitter></scene>')
    assert changed(command.format(report)) == [f"-{report}", "+" + report.replace("mean 1", "mean 0.75")]


@pytest.mark.filterwarnings("ignore::morgana.SceneWarning")
def test_processes_start_from_a_script(tmp_path):
    """Each process imports the script again."""
    (example,) = [block for block in blocks("docs/python.md", "python") if "ProcessPoolExecutor" in block]
    assert example.count(", result.image") == 1
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    (tmp_path / "script.py").write_text("import numpy as np\n" + example.replace(", result.image", ", same.image"))
    done = subprocess.run([sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def prose(path):
    """Returns a document without its code."""
    return re.sub(r"^```.*?^```", "", path.read_text(), flags=re.DOTALL | re.MULTILINE)


def anchors(path):
    """Returns the anchors that GitHub gives the headings of a document."""
    headings = re.findall(r"^#+ (.*)", prose(path), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("name", LINKED)
def test_links_lead_somewhere(name):
    page = ROOT / name
    targets = re.findall(r"\]\((?!https?:)([^)]*)\)", prose(page))
    broken = []
    for target in targets:
        file, _, anchor = target.partition("#")
        path = page.parent / file if file else page
        if name.startswith("docs/reference/") and file.startswith(MADE):
            continue
        if not path.exists() or (anchor and anchor not in anchors(path)):
            broken.append(target)
    assert broken == []


def test_crates_are_called_as_the_reference_says():
    page = (ROOT / "docs/reference/rust.md").read_text()
    listed = dict(re.findall(r"^\| `(morgana-\w+)` \|(?: `(\w+)`)? \|", page, re.MULTILINE))
    named = dict(re.findall(r'^(morgana-\w+) = \{ path = "../morgana/([^"]+)" \}', "".join(blocks("docs/reference/rust.md", "toml")), re.MULTILINE))
    assert named and named.keys() <= listed.keys()
    found = {}
    for folder in sorted((ROOT / "crates").iterdir()):
        manifest = (folder / "Cargo.toml").read_text()
        package = re.search(r'^name = "(.*)"', manifest, re.MULTILINE)[1]
        library = re.search(r'^\[lib\]\nname = "(.*)"', manifest, re.MULTILINE)
        has_library = (folder / "src/lib.rs").exists()
        if "publish = false" not in manifest:
            found[package] = library[1] if library else package.replace("-", "_") if has_library else ""
        assert package not in named or ROOT / named[package] == folder
    assert listed == found


def test_sources_cite_documents_that_exist():
    cited = set()
    for room in ["crates", "fuzz", "python", "scripts"]:
        for path in (ROOT / room).rglob("*"):
            if path.suffix in {".rs", ".py", ".pyi", ".toml"}:
                cited.update(re.findall(r"\bdocs/[a-z/-]+\.md(?:#[a-z0-9-]+)?", path.read_text()))
    assert len(cited) > 20
    parts = [citation.partition("#") for citation in cited]
    assert [file for file, _, _ in parts if not (ROOT / file).exists()] == []
    assert [(file, anchor) for file, _, anchor in parts if anchor and anchor not in anchors(ROOT / file)] == []
