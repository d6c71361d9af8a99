"""The documents: their Python code and scenes, run verbatim, and their links."""

import os
import re
import subprocess
import sys

import morgana
import pytest
from conftest import PROGRAM, ROOT

PAGES = sorted(path.relative_to(ROOT).as_posix() for folder in ["start", "guides"] for path in (ROOT / "docs" / folder).glob("*.md"))
"""Pages of the tutorial and of the guides."""
LINKED = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"]
LINKED += sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").rglob("*.md"))
"""Pages whose links are followed."""
MADE = ("plugins/", "command-line.md")
"""Pages of docs/reference that the site alone has."""


def blocks(name, language):
    return re.findall(rf"^```{language}\n(.*?)^```", (ROOT / name).read_text(), re.DOTALL | re.MULTILINE)


def with_blocks(language):
    return [name for name in PAGES if blocks(name, language)]


@pytest.mark.parametrize("name", ["README.md", "docs/python.md", *with_blocks("python")])
def test_examples_run(name, tmp_path, monkeypatch):
    examples = blocks(name, "python")
    assert examples
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    monkeypatch.chdir(tmp_path)
    namespace = {"__name__": "__main__"}
    for example in examples:
        exec(compile(example, name, "exec"), namespace)
    for result in (namespace.get("result"), namespace.get("picture")):
        assert result is None or result.image.mean() > 0.01


@pytest.mark.filterwarnings("ignore::morgana.SceneWarning")
def test_processes_start_from_a_script(tmp_path):
    """Each process imports the script again."""
    (example,) = [block for block in blocks("docs/python.md", "python") if "ProcessPoolExecutor" in block]
    assert example.count(", result.image") == 1
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    (tmp_path / "script.py").write_text("import numpy as np\n" + example.replace(", result.image", ", same.image"))
    done = subprocess.run([sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", with_blocks("xml"))
@pytest.mark.filterwarnings("ignore::morgana.SceneWarning")
def test_scenes_load(name, tmp_path):
    for scene in blocks(name, "xml"):
        if scene.startswith("<scene"):
            path = tmp_path / "scene.xml"
            path.write_text(scene)
            morgana.load_file(path)


def commands(name):
    """Returns the commands of a page, each with its output."""
    return [tuple(part.split("\n", 1)) for block in blocks(name, "console") for part in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]]


@pytest.mark.parametrize(
    "command, printed", [each for name in PAGES for each in commands(name) if each[0].startswith("morgana info scenes/")]
)
def test_info_is_as_pages_show_it(command, printed, tmp_path):
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    path = {**os.environ, "PATH": f"{PROGRAM.parent}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(command, shell=True, cwd=tmp_path, env=path, capture_output=True, text=True, check=True)
    # Pages omit notes about Mitsuba.
    assert done.stdout.split("\n\nnote[")[0].rstrip() == printed.rstrip()


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
