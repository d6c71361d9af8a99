"""The notebooks: they run, their assertions hold, they draw their figures, and they are stored
without outputs.

A notebook that takes long has a cell tagged ``parameters``, and lists smaller sizes for some of
them in ``test_sizes`` of its metadata.
"""

import os

import nbformat
import pytest
from conftest import ROOT, SCENES
from nbclient import NotebookClient

NOTEBOOKS = sorted((ROOT / "docs/notebooks").glob("*.ipynb"))
INLINE = "module://matplotlib_inline.backend_inline"


def named(paths):
    return pytest.mark.parametrize("path", paths, ids=lambda path: path.stem)


def test_all_are_listed():
    text = (ROOT / "docs/python.md").read_text()
    assert len(NOTEBOOKS) >= 3
    assert [path.name for path in NOTEBOOKS if f"(notebooks/{path.name})" not in text] == []


@named(NOTEBOOKS)
def test_they_are_stored_without_outputs(path):
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(cell.outputs == [] and cell.execution_count is None for cell in cells)
    assert path.stat().st_size < 30_000


def made_small(notebook):
    """Sets the sizes for tests after the parameters of the notebook."""
    sizes = notebook.metadata.get("test_sizes", {})
    if sizes:
        at = next(i for i, cell in enumerate(notebook.cells) if "parameters" in cell.metadata.get("tags", []))
        assert all(f"{name} = " in notebook.cells[at].source for name in sizes)
        notebook.cells.insert(at + 1, nbformat.v4.new_code_cell("\n".join(f"{name} = {value}" for name, value in sizes.items())))


@named(NOTEBOOKS)
def test_they_run(path, tmp_path):
    (tmp_path / "scenes").symlink_to(SCENES)
    folder = tmp_path / "docs/notebooks"
    folder.mkdir(parents=True)
    notebook = nbformat.read(path, as_version=4)
    made_small(notebook)
    client = NotebookClient(notebook, timeout=120, kernel_name="python3", resources={"metadata": {"path": str(folder)}})
    # A cell that raises, such as by a failed assertion, raises here.
    client.execute(env={**os.environ, "MPLBACKEND": INLINE})
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert [output.text for output in outputs if output.get("name") == "stderr"] == []
    assert sum("image/png" in output.get("data", {}) for output in outputs) >= 3
