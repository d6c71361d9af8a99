#!/usr/bin/env python3
"""Writes the data of grid_lens.xml: an index on a grid, and a checkerboard as a mesh.

Usage: python3 scenes/grid_lens.py    (needs numpy)
"""

from pathlib import Path

import numpy as np

HERE = Path(__file__).parent

# Samples per side, at the nodes of the cube [-1, 1]³.
NODES = 40
# Peak of n − 1 on the circle in the middle of the ring, and at the centre of the blob inside it.
RING, BLOB = 0.22, -0.10
# Radius of the ring, standard deviations of both.
RADIUS, RING_WIDTH, BLOB_WIDTH = 0.52, 0.115, 0.17
# Distance from the axis or the centre from which n − 1 is pulled to zero, where it is zero.
FADE = (0.60, 0.80)


def fade(t):
    """1 before FADE[0], 0 after FADE[1], smooth in between."""
    t = np.clip((t - FADE[0]) / (FADE[1] - FADE[0]), 0, 1)
    return 1 - t**3 * (t * (6 * t - 15) + 10)


def index():
    """n at the nodes, indexed [z, y, x]. It is exactly 1 near the faces of the cube, so that splines
    are, too, and nothing jumps there."""
    axis = np.linspace(-1, 1, NODES)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    r = np.hypot(x, y)
    ring = np.exp(-((r - RADIUS) ** 2 + z**2) / (2 * RING_WIDTH**2))
    blob = np.exp(-(r**2 + z**2) / (2 * BLOB_WIDTH**2))
    window = fade(np.abs(z)) * fade(r - 0.1)
    return (1 + (RING * ring + BLOB * blob) * window).astype(np.float32)


def checker(columns, rows, parity):
    """The squares of one colour of a board that fills [-1, 1]² in the plane z = 0, as an OBJ mesh."""
    lines, n = [f"# checkerboard, {columns} x {rows}, colour {parity}; by grid_lens.py"], 0
    for j in range(rows):
        for i in range(columns):
            if (i + j) % 2 != parity:
                continue
            for a, b in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)):
                lines.append(f"v {2 * a / columns - 1:.6g} {2 * b / rows - 1:.6g} 0")
            lines.append(f"f {n + 1} {n + 2} {n + 3} {n + 4}")
            n += 4
    return "\n".join(lines) + "\n"


np.save(HERE / "grid_lens.npy", index())
for parity in (0, 1):
    (HERE / f"grid_lens_{parity}.obj").write_text(checker(16, 12, parity))
