"""Pages generated when the site is built: the plugins, the command line, the notebooks, and documents of the root."""

import importlib.util
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

import program

FIRST = """

Build the program and the Python package, and install the packages of the site:
    cargo build
    python3 -m pip install . -r scripts/site/requirements.txt
CONTRIBUTING.md tells you more."""

try:
    import command_line
    import documents
    import equations
    import notebook_pages
    import plugins
except ImportError as missing:
    raise PluginError(f"{missing}{FIRST}") from None

DEVELOPMENT = ("ARCHITECTURE.md", "CHANGELOG.md", "CONTRIBUTING.md", "agreement.md", "development/")
"""Pages that the search leaves out."""
GUIDES = ("guides/", "index.md", "start/")
"""Pages that the search lists first."""


def on_startup(command: str, dirty: bool) -> None:
    """Says what to do first if the program or the Python package is missing."""
    if not program.path().exists():
        raise PluginError(f"the site shows the output of the program, but there is no {program.path()}{FIRST}")
    if importlib.util.find_spec("morgana") is None:
        raise PluginError(f"the site documents the Python package morgana, which is not installed{FIRST}")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Adds the pages that are not in docs/."""
    made = {**plugins.pages(), "reference/command-line.md": command_line.page(), **documents.pages()}
    for name in notebook_pages.names():
        made[f"notebooks/{name}.md"], figures = notebook_pages.page(name)
        for uri, figure in figures.items():
            files.append(File.generated(config, uri, content=figure))
    for uri, text in made.items():
        files.append(File.generated(config, uri, content=text))
    for path in documents.attachments():
        files.append(File.generated(config, path.relative_to(documents.ROOT).as_posix(), abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Ranks the page for the search, and adapts links between docs/ and the root to the site's addresses."""
    uri = page.file.src_uri
    page.meta["search"] = {"exclude": uri.startswith(DEVELOPMENT), "boost": 4 if uri.startswith(GUIDES) else 1}
    return notebook_pages.linked(documents.relinked(markdown, uri))


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Typesets equations."""
    return equations.typeset(html, page.file.src_uri)


def on_post_build(config: MkDocsConfig) -> None:
    """Writes the font of equations."""
    equations.write_font(Path(config.site_dir))
