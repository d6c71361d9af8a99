"""Pages of the notebooks, from their stored cells and outputs."""

import base64
import json
import re
import tomllib
from typing import Any

from documents import ROOT

FOLDER = ROOT / "docs/notebooks"


def names() -> list[str]:
    """Returns the names of the notebooks."""
    return sorted(path.stem for path in FOLDER.glob("*.ipynb"))


def page(name: str) -> tuple[str, dict[str, bytes]]:
    """Returns a notebook as Markdown, and its figures by their address in the site."""
    notebook = json.loads((FOLDER / f"{name}.ipynb").read_text())
    parts: list[str] = []
    figures: dict[str, bytes] = {}
    for cell in notebook["cells"]:
        source = "".join(cell["source"]).strip()
        if cell["cell_type"] == "markdown":
            parts.append(source)
            continue
        parts.append(f"```python\n{source}\n```")
        for output in cell["outputs"]:
            data = output.get("data", {})
            if "image/png" in data:
                figure = f"{name}_{len(figures) + 1}.png"
                figures[f"notebooks/{figure}"] = base64.b64decode(data["image/png"])
                parts.append(f"![Figure {len(figures)}]({figure})")
            else:
                text = "".join(output.get("text") or data["text/plain"]).rstrip()
                parts.append(f"```text\n{text}\n```")
    parts.insert(1, f'<a href="{name}.ipynb" download>Download this notebook</a>. It needs the folder `scenes/` of the repository.')
    workspace = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]
    parts[2:2] = colab(name, workspace.get("repository"), workspace["version"])
    return "\n\n".join(parts) + "\n", figures


def colab(name: str, repository: str | None, version: str) -> list[str]:
    """Returns a button that opens the notebook of a release in Colab, and the commands to run there
    first; nothing before the repository is published."""
    found = re.fullmatch(r"https://github\.com/([\w.-]+/[\w.-]+?)(\.git)?/?", repository or "")
    if found is None:
        return []
    notebook = f"https://colab.research.google.com/github/{found[1]}/blob/v{version}/docs/notebooks/{name}.ipynb"
    badge = "https://colab.research.google.com/assets/colab-badge.svg"
    commands = [
        f'!pip install "morgana-render[plot]=={version}"',
        f"!git clone --quiet --depth 1 --branch v{version} {repository} morgana",
        "%cd morgana/docs/notebooks",
    ]
    return [f"[![Open in Colab]({badge})]({notebook}) In Colab, run this cell first:", "```python\n" + "\n".join(commands) + "\n```"]


def linked(markdown: str) -> str:
    """Returns a page with links to notebooks as links to their pages."""
    return re.sub(r"(\]\([\w./]*)\.ipynb\)", r"\1.md)", markdown)
