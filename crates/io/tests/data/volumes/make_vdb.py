"""Makes the OpenVDB files of this folder: Debian's python3-openvdb.

Samples are x + 10 y + 100 z at (x, y, z) of a grid of 2 x 3 x 4, the first of which is at index (-1, 7, 2).
"""
import math

import numpy as np
import pyopenvdb as vdb

FIRST = (-1, 7, 2)


def grid(kind, name, half=False, transform=None):
    result = kind()
    result.name = name
    result.saveFloatAsHalf = half
    result.transform = transform or vdb.createLinearTransform(voxelSize=0.25)
    accessor = result.getAccessor()
    for z in range(4):
        for y in range(3):
            for x in range(2):
                index = (FIRST[0] + x, FIRST[1] + y, FIRST[2] + z)
                accessor.setValueOn(index, float(x + 10 * y + 100 * z))
    return result


# Stretched along y and z, turned about z: x runs along -y, y along x.
matrix = [[0, -0.25, 0, 0], [0.5, 0, 0, 0], [0, 0, 2, 0], [1, 2, 3, 1]]
turned = grid(vdb.FloatGrid, "turned", transform=vdb.createLinearTransform(matrix))
half = grid(vdb.FloatGrid, "half", half=True)
vdb.write("grids.vdb", grids=[grid(vdb.FloatGrid, "density"), turned, half])
vdb.write("single.vdb", grids=[grid(vdb.FloatGrid, "density")])

# A ball of distances, with tiles inside and background of both signs; and values that compress.
ball = vdb.createLevelSetSphere(radius=3.0, center=(0, 0, 0), voxelSize=0.5, halfWidth=2.0)
ball.name = "ball"
waves = vdb.FloatGrid(0.5)
waves.name = "waves"
accessor = waves.getAccessor()
for x in range(40):
    for y in range(12):
        for z in range(9):
            accessor.setValueOn((x, y, z), 1.0 + 0.5 * math.floor(4 * math.sin(0.1 * (x + y + z))))
tiles = vdb.FloatGrid(0.0)
tiles.name = "tiles"
tiles.fill((0, 0, 0), (31, 15, 7), 3.0)
vdb.write("trees.vdb", grids=[ball, waves, tiles])

# What OpenVDB itself makes of the ball: array[x, y, z].
low, high = ball.evalActiveVoxelBoundingBox()
dense = np.zeros([h - l + 1 for l, h in zip(low, high)], dtype=np.float32)
ball.copyToArray(dense, ijk=low)
np.save("ball.npy", dense)
