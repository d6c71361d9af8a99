"""Documents in the root that the site has, too, and links between them and docs/."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

PAGES = ["ARCHITECTURE.md", "CHANGELOG.md", "CONTRIBUTING.md"]
LICENCES = ["LICENSE-APACHE", "LICENSE-MIT"]


def pages() -> dict[str, str]:
    """The documents, by their address in the site."""
    return {name: (ROOT / name).read_text() for name in PAGES}


def attachments() -> list[Path]:
    """Files that pages link to."""
    return [*sorted((ROOT / "scenes").glob("*.xml")), *(ROOT / name for name in LICENCES)]


def relinked(markdown: str, uri: str) -> str:
    """A page with its links as the site needs them: docs/ and the root are one folder there."""
    if uri in PAGES:
        return markdown.replace("](docs/", "](")
    depth = uri.count("/")
    above = "../" * (depth + 1)
    return re.sub(rf"\]\({re.escape(above)}(?=[A-Zs])", "](" + "../" * depth, markdown)
