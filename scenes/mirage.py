#!/usr/bin/env python3
"""Writes mirage_sky.png, the sky of mirage.xml: a gradient from haze to blue, as a latitude-longitude
map.

Usage: python3 scenes/mirage.py    (needs numpy)
"""

import struct
import zlib
from pathlib import Path

import numpy as np

HEIGHT, WIDTH = 1024, 4
# Linear colours by elevation in degrees. Nothing shines from far below the horizon, so that no samples
# are spent there.
ELEVATION = [-90, -12, -1, 0, 4, 15, 90]
COLOURS = np.array(
    [
        [0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0],
        [0.45, 0.36, 0.26],
        [0.95, 0.80, 0.62],
        [0.75, 0.76, 0.74],
        [0.50, 0.58, 0.70],
        [0.34, 0.42, 0.58],
    ]
)


def srgb(linear):
    """8-bit sRGB values of linear ones."""
    low, high = 12.92 * linear, 1.055 * np.maximum(linear, 0) ** (1 / 2.4) - 0.055
    return np.round(255 * np.clip(np.where(linear <= 0.0031308, low, high), 0, 1)).astype(np.uint8)


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


elevation = 90 - 180 * (np.arange(HEIGHT) + 0.5) / HEIGHT
column = np.stack([np.interp(elevation, ELEVATION, COLOURS[:, c]) for c in range(3)], axis=1)
sky = np.repeat(srgb(column)[:, None, :], WIDTH, axis=1)
(Path(__file__).parent / "mirage_sky.png").write_bytes(png(sky))
