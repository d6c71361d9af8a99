"""The documents: their Python code and scenes, as they stand there, and their links."""

import re

import morgana
import pytest
from conftest import ROOT

PAGES = sorted(path.relative_to(ROOT).as_posix() for folder in ["start", "guides"] for path in (ROOT / "docs" / folder).glob("*.md"))
"""Pages of the tutorial and of the guides."""


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
    namespace = {}
    for example in examples:
        exec(compile(example, name, "exec"), namespace)
    for result in (namespace.get("result"), namespace.get("picture")):
        assert result is None or result.image.mean() > 0.01


@pytest.mark.parametrize("name", with_blocks("xml"))
@pytest.mark.filterwarnings("ignore::morgana.SceneWarning")
def test_scenes_load(name, tmp_path):
    for scene in blocks(name, "xml"):
        if scene.startswith("<scene"):
            path = tmp_path / "scene.xml"
            path.write_text(scene)
            morgana.load_file(path)


def anchors(path):
    """The anchors that GitHub gives the headings of a document."""
    text = re.sub(r"^```.*?^```", "", path.read_text(), flags=re.DOTALL | re.MULTILINE)
    headings = re.findall(r"^#+ (.*)", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("name", ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"])
def test_links_lead_somewhere(name):
    targets = re.findall(r"\]\((?!https?:)([^)]*)\)", (ROOT / name).read_text())
    broken = []
    for target in targets:
        file, _, anchor = target.partition("#")
        path = ROOT / (file or name)
        if not path.exists() or (anchor and anchor not in anchors(path)):
            broken.append(target)
    assert broken == []


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
