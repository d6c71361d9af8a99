#!/usr/bin/env python3
"""Writes ultrasound_wall.h5: a beam of ultrasound that a wall reflects, simulated by k-Wave, in the layout of k-Wave's output files.

The last period of the pressure is kept, at the points of a box of the grid, by a binary mask. The solver is that of k-wave-python in
Python; its other solvers, which the package downloads when it is imported, are not needed.

Usage: python3 scenes/ultrasound_wall.py    (needs k-wave-python 0.6.2; half a minute)
"""

import urllib.request
from pathlib import Path

import numpy as np

urllib.request.urlretrieve = lambda url, path: Path(path).touch()

from kwave.kgrid import kWaveGrid
from kwave.kmedium import kWaveMedium
from kwave.ksensor import kSensor
from kwave.ksource import kSource
from kwave.kspaceFirstOrder import kspaceFirstOrder
from kwave.utils.io import write_matrix

FILE = Path(__file__).with_suffix(".h5")

# SI units. The grid has its absorbing layer inside; the wall fills it up to the row WALL.
GRID, LAYER, SPACING = (176, 136), 16, 0.25e-3
FREQUENCY, PER_PERIOD, PERIODS = 1e6, 24, 50
WALL = 30
# First point of the box that is recorded, and its size: it begins at the wall.
FIRST, SIZE = (36, WALL), (112, 80)
# The transducer: a column of points whose phases steer the beam towards the wall, and whose ends are weak.
COLUMN, ROWS, ANGLE, PRESSURE = 20, slice(64, 116), np.radians(-40), 40e3
WATER_SPEED = 1480.0


def simulated():
    """Pressure [x, y, t] in the box, over the last period."""
    grid = kWaveGrid(GRID, (SPACING, SPACING))
    grid.setTime(PERIODS * PER_PERIOD, 1 / (FREQUENCY * PER_PERIOD))
    speed, density = np.full(GRID, WATER_SPEED), np.full(GRID, 998.0)
    # A heavy, fast liquid: at this angle it reflects all sound, as steel does.
    speed[:, :WALL], density[:, :WALL] = 2500.0, 7800.0
    mask = np.zeros(GRID, bool)
    mask[COLUMN, ROWS] = True
    y = np.arange(ROWS.start, ROWS.stop) * SPACING
    phase = 2 * np.pi * FREQUENCY / WATER_SPEED * np.sin(ANGLE) * y
    weight = np.sin(np.pi * (np.arange(len(y)) + 0.5) / len(y)) ** 2
    t = np.arange(PERIODS * PER_PERIOD) / (FREQUENCY * PER_PERIOD)
    start = np.sin(np.pi / 2 * np.clip(t * FREQUENCY / 4, 0, 1)) ** 2
    source = kSource()
    source.p_mask = mask
    source.p = PRESSURE * weight[:, None] * start * np.sin(2 * np.pi * FREQUENCY * t - phase[:, None])
    box = np.zeros(GRID, bool)
    box[FIRST[0] : FIRST[0] + SIZE[0], FIRST[1] : FIRST[1] + SIZE[1]] = True
    sensor = kSensor(mask=box, record=["p"])
    medium = kWaveMedium(sound_speed=speed, density=density)
    result = kspaceFirstOrder(grid, medium, source, sensor, pml_size=LAYER, pml_inside=True, backend="python", quiet=True)
    return np.asarray(result["p"])[:, -PER_PERIOD:].reshape(*SIZE, PER_PERIOD), box


def main():
    """Writes the file, by k-Wave's own function."""
    pressure, box = simulated()
    FILE.unlink(missing_ok=True)
    numbers = {"Nx": GRID[0], "Ny": GRID[1], "Nz": 1, "Nt": PER_PERIOD, "sensor_mask_type": 0}
    for name, number in numbers.items():
        write_matrix(str(FILE), np.full((1, 1, 1), number, np.uint64), name)
    for name, number in {"dx": SPACING, "dy": SPACING, "dt": 1 / (FREQUENCY * PER_PERIOD)}.items():
        write_matrix(str(FILE), np.full((1, 1, 1), number, np.float32), name)
    # Points count from 1, with x fastest.
    index = np.flatnonzero(box.ravel(order="F")) + 1
    write_matrix(str(FILE), index.astype(np.uint64).reshape(-1, 1, 1), "sensor_mask_index", 9)
    points = pressure.reshape(-1, PER_PERIOD, order="F").astype(np.float32)
    write_matrix(str(FILE), points.reshape(*points.shape, 1), "p", 9)


if __name__ == "__main__":
    main()
