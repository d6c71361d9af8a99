"""Pages generated when the site is built: the plugins, the command line, and documents of the root."""

from pathlib import Path

import command_line
import documents
import equations
import plugins
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Adds the pages that are not in docs/."""
    made = {**plugins.pages(), "reference/command-line.md": command_line.page(), **documents.pages()}
    for uri, text in made.items():
        files.append(File.generated(config, uri, content=text))
    for path in documents.attachments():
        files.append(File.generated(config, path.relative_to(documents.ROOT).as_posix(), abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Adapts links between docs/ and the root to the site's addresses."""
    return documents.relinked(markdown, page.file.src_uri)


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Typesets equations."""
    return equations.typeset(html, page.file.src_uri)


def on_post_build(config: MkDocsConfig) -> None:
    """Writes the font of equations."""
    equations.write_font(Path(config.site_dir))
