#!/usr/bin/env python3
"""Writes grin_glass.png, the poster of grin_glass.xml: letters of a few pixels each.

Usage: python3 scenes/grin_glass.py    (needs numpy)
"""

import struct
import zlib
from pathlib import Path

import numpy as np

LETTERS = {
    "M": "#...# ##.## #.#.# #.#.# #...# #...# #...#",
    "O": ".###. #...# #...# #...# #...# #...# .###.",
    "R": "####. #...# #...# ####. #.#.. #..#. #...#",
    "G": ".###. #...# #.... #.### #...# #...# .###.",
    "A": ".###. #...# #...# ##### #...# #...# #...#",
    "N": "#...# ##..# #.#.# #.#.# #..## #...# #...#",
}
WORD = "MORGANA"
PAPER, RED, BLUE, GREEN = (238, 228, 206), (186, 44, 32), (38, 78, 122), (42, 110, 84)


def poster():
    """The pixels, [row, column, 3]: the word three times, each time shifted and in another colour."""
    rows, columns = 35, 63
    pixels = np.empty((rows, columns, 3), np.uint8)
    pixels[:] = PAPER
    for line, colour in enumerate((RED, BLUE, GREEN)):
        for i in range(11):
            glyph = LETTERS[WORD[(i + 4 * line) % len(WORD)]].split()
            for y, row in enumerate(glyph):
                for x, mark in enumerate(row):
                    column = 6 * i + x - 1
                    if mark == "#" and 0 <= column < columns:
                        pixels[3 + 11 * line + y, column] = colour
    return pixels[::-1]  # a rectangle's v runs upwards, that of a bitmap downwards


def png(pixels):
    """A PNG file of an array [row, column, 3] of 8-bit values."""
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", pixels.shape[1], pixels.shape[0], 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"IDAT", zlib.compress(rows, 9))
        + chunk(b"IEND", b"")
    )


(Path(__file__).parent / "grin_glass.png").write_bytes(png(poster()))
