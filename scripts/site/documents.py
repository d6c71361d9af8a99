"""Documents of the root that the site includes, and links between them and docs/."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

PAGES = ["ARCHITECTURE.md", "CHANGELOG.md", "CONTRIBUTING.md"]
LICENCES = ["LICENSE-APACHE", "LICENSE-MIT"]


def pages() -> dict[str, str]:
    """Returns the documents, by their address in the site."""
    return {name: (ROOT / name).read_text() for name in PAGES}


def attachments() -> list[Path]:
    """Returns the files that pages link to."""
    return [*sorted((ROOT / "scenes").glob("*.xml")), *(ROOT / name for name in LICENCES)]


def relinked(markdown: str, uri: str) -> str:
    """Returns a page with its links adapted to the site, in which docs/ and the root are one
    folder."""
    if uri in PAGES:
        return markdown.replace("](docs/", "](")
    depth = uri.count("/")
    above = "../" * (depth + 1)
    return re.sub(rf"\]\({re.escape(above)}(?=[A-Zs])", "](" + "../" * depth, markdown)
