#!/usr/bin/env python3
"""Arranges pictures in rows, each under its title. Needs Pillow.

Usage: scripts/panels.py OUT.png --columns N TITLE=PICTURE ...
"""

import argparse
import io
import pathlib
from typing import Any

from PIL import Image, ImageDraw, ImageFont

# Distance between pictures, and size of the titles, in pixels.
GAP = 4
SIZE = 14


def arrange(panels: list[tuple[str, Image.Image]], columns: int) -> Image.Image:
    """Returns one picture of all pictures, row by row."""
    rows = [panels[i : i + columns] for i in range(0, len(panels), columns)]
    heights = [max(picture.height for _, picture in row) for row in rows]
    head = SIZE + 2 * GAP
    width = max(sum(picture.width for _, picture in row) + GAP * (len(row) - 1) for row in rows)
    sheet = Image.new("RGB", (width, sum(heights) + head * len(rows)), "white")
    draw, font, y = ImageDraw.Draw(sheet), ImageFont.load_default(SIZE), 0
    for row, height in zip(rows, heights):
        x = 0
        for title, picture in row:
            draw.text((x + picture.width / 2, y + head / 2), title, "black", font, anchor="mm")
            sheet.paste(picture, (x, y + head))
            x += picture.width + GAP
        y += head + height
    return sheet


def save(sheet: Image.Image, path: pathlib.Path) -> None:
    """Writes a picture with 256 colours, because noise makes files of all colours large."""
    sheet.quantize(256, Image.Quantize.MAXCOVERAGE, kmeans=3, dither=Image.Dither.NONE).save(path, optimize=True)


def save_figure(figure: Any, path: pathlib.Path) -> None:
    """Writes a figure of Matplotlib with 256 colours."""
    written = io.BytesIO()
    figure.savefig(written, dpi=100)
    save(Image.open(written).convert("RGB"), path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=pathlib.Path, metavar="OUT.png")
    parser.add_argument("--columns", type=int, default=3)
    parser.add_argument("panels", nargs="+", metavar="TITLE=PICTURE")
    args = parser.parse_args()
    named = [panel.rpartition("=") for panel in args.panels]
    panels = [(title, Image.open(file).convert("RGB")) for title, _, file in named]
    save(arrange(panels, args.columns), args.out)


if __name__ == "__main__":
    main()
