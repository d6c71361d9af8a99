"""The notebooks: they run, their assertions hold, they draw their figures, and their stored outputs
are up to date.

A notebook that takes long has a cell tagged ``parameters``, and lists smaller sizes for some of
them in ``test_sizes`` of its metadata. Its stored texts are then not compared.
"""

import sys

import nbformat
import pytest
from conftest import ROOT

sys.path.insert(0, str(ROOT / "scripts"))

import notebooks  # noqa: E402

NOTEBOOKS = sorted(notebooks.FOLDER.glob("*.ipynb"))
LARGEST = 300_000
"""Largest size of a stored notebook, in bytes."""


def named(paths):
    return pytest.mark.parametrize("path", paths, ids=lambda path: path.stem)


def test_all_are_listed():
    text = (ROOT / "docs/notebooks/index.md").read_text()
    assert len(NOTEBOOKS) >= 3
    assert [path.name for path in NOTEBOOKS if f"]({path.name})" not in text] == []
    assert {path.stem for path in NOTEBOOKS} == {path.stem for path in notebooks.COVERS.glob("*.png")}


def outputs(notebook):
    return [output for cell in notebook.cells for output in cell.get("outputs", [])]


def texts(notebook):
    return [output.get("text") or output.data["text/plain"] for output in outputs(notebook) if "image/png" not in output.get("data", {})]


@named(NOTEBOOKS)
def test_they_are_stored_with_outputs(path):
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    assert all(cell.execution_count is None for cell in notebook.cells if cell.cell_type == "code")
    assert {(output.output_type, output.get("name")) for output in outputs(notebook)} <= {("stream", "stdout"), ("display_data", None)}
    assert sum("image/png" in output.get("data", {}) for output in outputs(notebook)) >= 3
    assert path.stat().st_size < LARGEST
    assert notebooks.cover(notebook) == (notebooks.COVERS / f"{path.stem}.png").read_bytes()
    assert {name: name.read_bytes() for name in notebooks.guide_figures(notebook)} == notebooks.guide_figures(notebook)
    assert f"](../images/notebooks/{path.stem}.png)" in notebook.cells[0].source


def made_small(notebook, sizes):
    """Sets the sizes for tests after the parameters of the notebook."""
    at = next(i for i, cell in enumerate(notebook.cells) if "parameters" in cell.metadata.get("tags", []))
    assert all(f"{name} = " in notebook.cells[at].source for name in sizes)
    notebook.cells.insert(at + 1, nbformat.v4.new_code_cell("\n".join(f"{name} = {value}" for name, value in sizes.items())))


@named(NOTEBOOKS)
def test_they_run(path, tmp_path):
    notebook = nbformat.read(path, as_version=4)
    stored = texts(notebook)
    sizes = notebook.metadata.get("test_sizes", {})
    if sizes:
        made_small(notebook, sizes)
    # A cell that raises, such as by a failed assertion, raises here.
    notebooks.execute(notebook, tmp_path, timeout=120)
    for cell in notebook.cells:
        if cell.cell_type == "code":
            cell.outputs = notebooks.tidied(cell.outputs)
    assert [output.text for output in outputs(notebook) if output.get("name") == "stderr"] == []
    assert sum("image/png" in output.get("data", {}) for output in outputs(notebook)) >= 3
    # scripts/notebooks.py stores them anew.
    assert sizes or texts(notebook) == stored
