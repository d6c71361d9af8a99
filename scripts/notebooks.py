"""Runs the notebooks of docs/notebooks and stores their outputs, which GitHub and the site show.

python3 scripts/notebooks.py [NAME ...]    all notebooks, or some; needs nbclient, ipykernel, Pillow and what the notebooks import

Run it after a change that alters an output. The tests run the notebooks again, and fail if a stored
text differs. The last figure of the cell with the tag `cover` also becomes docs/images/notebooks/NAME.png:
the notebook begins with this picture, and the page of notebooks shows it. The last figure of a cell with the
tag `guide-FIGURE` also becomes docs/images/guides/FIGURE.png.
"""

import base64
import io
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "docs/notebooks"
COVERS = ROOT / "docs/images/notebooks"
GUIDES = ROOT / "docs/images/guides"
COLOURS = 128
"""Colours of a stored figure. Notebooks must stay below 300 kB."""


def execute(notebook: Any, folder: Path, timeout: int | None = None) -> None:
    """Runs a notebook in an empty folder that holds a link to scenes/, and replaces its outputs.
    Raises the error of a cell."""
    (folder / "scenes").symlink_to(ROOT / "scenes")
    work = folder / "docs/notebooks"
    work.mkdir(parents=True)
    client = NotebookClient(
        notebook, timeout=timeout, kernel_name="python3", resources={"metadata": {"path": str(work)}}, record_timing=False
    )
    client.execute(env={**os.environ, "MPLBACKEND": "module://matplotlib_inline.backend_inline"})


def tidied(outputs: list[Any]) -> list[Any]:
    """Returns the texts and figures of a cell, without counters and with small figures."""
    kept: list[Any] = []
    for output in outputs:
        if output.output_type == "stream" and kept and kept[-1].get("name") == output.name:
            kept[-1].text += output.text
        elif output.output_type == "stream":
            kept.append(output)
        elif "image/png" in output.data:
            kept.append(nbformat.v4.new_output("display_data", {"image/png": small(output.data["image/png"])}))
        else:
            kept.append(nbformat.v4.new_output("display_data", {"text/plain": output.data["text/plain"]}))
    return kept


def small(png: str) -> str:
    """Returns a figure, as Base64, with few colours."""
    from PIL import Image

    image = Image.open(io.BytesIO(base64.b64decode(png))).convert("RGB")
    stored = io.BytesIO()
    # Unlike a median cut, this keeps the ends of colour bars.
    image.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, kmeans=3, dither=Image.Dither.NONE).save(stored, "PNG", optimize=True)
    return base64.b64encode(stored.getvalue()).decode()


def last_figure(cell: Any) -> bytes:
    """Returns the last figure of a cell."""
    figures = [output.data["image/png"] for output in cell.outputs if "image/png" in output.get("data", {})]
    return base64.b64decode(figures[-1])


def cover(notebook: Any) -> bytes:
    """Returns the last figure of the cell with the tag `cover`."""
    (cell,) = [cell for cell in notebook.cells if "cover" in cell.metadata.get("tags", [])]
    return last_figure(cell)


def guide_figures(notebook: Any) -> dict[Path, bytes]:
    """Returns the figures that guides show, by their files: of the cells with tags `guide-FIGURE`."""
    tagged = [(tag, cell) for cell in notebook.cells for tag in cell.metadata.get("tags", []) if tag.startswith("guide-")]
    return {GUIDES / f"{tag.removeprefix('guide-')}.png": last_figure(cell) for tag, cell in tagged}


def main() -> None:
    """Runs the notebooks that the arguments name, or all."""
    COVERS.mkdir(exist_ok=True)
    for name in sys.argv[1:] or sorted(path.stem for path in FOLDER.glob("*.ipynb")):
        path = FOLDER / f"{name}.ipynb"
        notebook = nbformat.read(path, as_version=4)
        with tempfile.TemporaryDirectory() as folder:
            execute(notebook, Path(folder))
        for cell in notebook.cells:
            if cell.cell_type == "code":
                cell.outputs, cell.execution_count = tidied(cell.outputs), None
        notebook.metadata["language_info"] = {"name": "python"}
        nbformat.write(notebook, path)
        (COVERS / f"{name}.png").write_bytes(cover(notebook))
        for picture, figure in guide_figures(notebook).items():
            picture.write_bytes(figure)
        print(f"{name}: {path.stat().st_size} bytes", flush=True)


if __name__ == "__main__":
    main()
