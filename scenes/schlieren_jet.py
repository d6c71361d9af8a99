#!/usr/bin/env python3
"""Writes the data of schlieren_jet.xml and bos_jet.xml: the density of a hot jet, and a pattern of dots.

Usage: python3 scenes/schlieren_jet.py    (needs numpy)
"""

import struct
import zlib
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent

# Density of air at 20 °C, and in the core of the jet at some 600 °C, kg/m³.
AIR, HOT = 1.204, 0.404
# Samples along x, y, z, and half the box in cm; the jet blows along +y.
SIZE = (40, 96, 40)
HALF = np.array((2.4, 4.8, 2.4))


def smooth(t):
    """0 up to t = 0, 1 from t = 1, smooth in between."""
    t = np.clip(t, 0, 1)
    return t**3 * (t * (6 * t - 15) + 10)


def density():
    """The density at the samples, [z, y, x]: a column that widens, with rings at its edge that grow and
    then turn into a helix. It is that of air, exactly, near the faces of the box."""
    axes = [np.linspace(-h, h, n) for h, n in zip(HALF, SIZE)]
    z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
    up = (y + 4.2) / 8.4
    # The axis swings in a helix, the radius in rings.
    swing = 0.34 * smooth((up - 0.3) / 0.7)
    turn = 2.2 * y - 1.0
    x, z = x - swing * np.cos(turn), z - swing * np.sin(turn)
    r = np.hypot(x, z)
    ring = 0.16 * np.sin(5.2 * y) * smooth(up / 0.25) * (1 - 0.7 * smooth((up - 0.5) / 0.5))
    radius = 0.30 + 0.42 * np.clip(up, 0, 1) + ring
    width = 0.13 + 0.22 * np.clip(up, 0, 1)
    column = 0.5 * (1 - np.tanh((r - radius) / width))
    cooling = 1 - 0.5 * np.clip(up, 0, 1)
    ends = smooth((y + 4.7) / 0.6) * smooth((4.7 - y) / 0.6)
    sides = smooth((2.3 - r) / 0.6)
    rho = AIR + (HOT - AIR) * column * cooling * ends * sides
    # Eight bits of contrast: the file gets smaller, and nothing is seen of it.
    return np.round((rho - AIR) * 512) / 512 + AIR


def write_vti(path, rho):
    """A .vti file of one array, raw appended, compressed by zlib in one block."""
    spacing = 2 * HALF / (np.array(SIZE) - 1)
    numbers = lambda values: " ".join(f"{v:.9g}" for v in values)
    extent = " ".join(f"0 {n - 1}" for n in SIZE)
    data = rho.astype("<f4").tobytes()
    packed = zlib.compress(data, 9)
    header = struct.pack("<4I", 1, len(data), 0, len(packed))
    path.write_bytes(
        f"""<?xml version="1.0"?>
<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt32" compressor="vtkZLibDataCompressor">
  <ImageData WholeExtent="{extent}" Origin="{numbers(-HALF)}" Spacing="{numbers(spacing)}">
    <Piece Extent="{extent}">
      <PointData>
        <DataArray type="Float32" Name="density" format="appended" offset="0"/>
      </PointData>
    </Piece>
  </ImageData>
  <AppendedData encoding="raw">
   _""".encode()
        + header
        + packed
        + b"\n  </AppendedData>\n</VTKFile>\n"
    )


def write_dots(path, count, half, size):
    """Squares at random places of the plane z = 0, [-half, half] each way, as a binary PLY mesh."""
    centers = np.random.default_rng(1).uniform(-1, 1, (count, 2)) * half
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * size
    points = np.zeros((count, 4, 3), "<f4")
    points[:, :, :2] = centers[:, None] + corners
    faces = np.zeros(count, [("n", "u1"), ("v", "<i4", 4)])
    faces["n"], faces["v"] = 4, np.arange(4 * count).reshape(count, 4)
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment by schlieren_jet.py\n"
        f"element vertex {4 * count}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {count}\nproperty list uchar int vertex_index\nend_header\n"
    )
    path.write_bytes(header.encode() + points.tobytes() + faces.tobytes())


write_vti(HERE / "schlieren_jet.vti", density())
write_dots(HERE / "bos_jet.ply", 1800, np.array((16.0, 24.0)), 0.25)
