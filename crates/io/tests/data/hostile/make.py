#!/usr/bin/env python3
"""Writes files that try to make readers of them work or take memory without bound (docs/security.md).

    python3 make.py     # needs h5py for bomb.h5
"""

import json
import struct
from pathlib import Path

HERE = Path(__file__).parent


def text(value):
    return struct.pack("<I", len(value)) + value.encode()


# OpenVDB: the head of a file up to its grids, and what is said of a grid: name, type, parent, where its parts are.
def vdb_head(grids):
    magic = b" BDV\0\0\0\0" + struct.pack("<III", 224, 9, 0) + b"\1" + b"0" * 36
    return magic + struct.pack("<I", 0) + struct.pack("<i", grids)


def descriptor(name, kind, at, end):
    return text(name) + text(kind) + text("") + struct.pack("<qqq", at, at, end)


FLOATS = "Tree_float_5_4_3"
start = len(vdb_head(0))
# A grid that ends where its description begins, two thousand million times.
(HERE / "back.vdb").write_bytes(vdb_head(2**31 - 1) + descriptor("density", FLOATS, 0, start))
# The same by way of two, of which no grid of numbers is kept.
first = descriptor("a", "Tree_bool_5_4_3", 0, 0)
first = descriptor("a", "Tree_bool_5_4_3", 0, start + len(first))
second = descriptor("loops", "Tree_bool_5_4_3", 0, start)
(HERE / "loop.vdb").write_bytes(vdb_head(2**31 - 1) + first + second)


def vdb_tree(tiles):
    """A grid of tiles of 4096 voxels along an edge."""
    head = vdb_head(1)
    at = len(head) + len(descriptor("density", FLOATS, 0, 0))
    scale = struct.pack("<15d", *[1.0] * 15)
    root = struct.pack("<IfII", 1, 0.0, len(tiles), 0)
    for place in tiles:
        root += struct.pack("<iiifB", *place, 1.0, 1)
    grid = struct.pack("<II", 0, 0) + text("UniformScaleMap") + scale + root
    return head + descriptor("density", FLOATS, at, at + len(grid)) + grid


# All of 256 GiB are stated by one tile.
(HERE / "tile.vdb").write_bytes(vdb_tree([(0, 0, 0)]))
# Tiles at one place: each would fill the whole grid once more.
(HERE / "overlap.vdb").write_bytes(vdb_tree([(0, 0, 0)] * 20))

# glTF: a list of many values, and many nodes that show one mesh.
ASSET = {"asset": {"version": "2.0"}}
SQUARE = 200
mesh = {
    **ASSET,
    "scenes": [{"nodes": list(range(1, 1001))}],
    "nodes": [{}] + [{"mesh": 0}] * 1000,
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}] * 100}],
    "accessors": [{"bufferView": 0, "componentType": 5121, "type": "VEC3", "count": 900}],
    "bufferViews": [{"buffer": 0, "byteLength": 2700}],
    "buffers": [{"byteLength": 2700, "uri": "data:application/octet-stream;base64," + "AAEC" * 900}],
}
(HERE / "nodes.gltf").write_text(json.dumps(mesh, separators=(",", ":")))

try:
    import h5py
except ImportError:
    print("bomb.h5 is left as it is: there is no h5py")
else:
    with h5py.File(HERE / "bomb.h5", "w", libver="latest") as file:
        # Half a gigabyte of which no chunk is stored.
        file.create_dataset("p", (512, 512, 512), "f4", chunks=(64, 64, 64), compression="gzip", fillvalue=1.0)
