"""Makes sound.h5 and sound.npy as h5py, NumPy and k-Wave write them: pip install numpy h5py.

The amplitude at sample (x, y, z) of a grid of 2 x 3 x 4 is (1 + x + 10 y + 100 z) e^(0.3 i).
"""
import h5py
import numpy as np

Z, Y, X = np.meshgrid(np.arange(4), np.arange(3), np.arange(2), indexing="ij")
AMPLITUDE = (1 + X + 10 * Y + 100 * Z) * np.exp(0.3j)  # [z, y, x]
FREQUENCY, STEP, TIMES = 1e6, 1.25e-7, 28  # 8 samples to a period
SERIES = (AMPLITUDE[None] * np.exp(2j * np.pi * FREQUENCY * STEP * np.arange(TIMES))[:, None, None, None]).real

np.save("sound.npy", AMPLITUDE)
with h5py.File("sound.h5", "w") as file:
    file["amplitude"] = AMPLITUDE.astype(np.complex64)
    # k-Wave: scalars as arrays of one element, the pressure at all points of a mask [1, t, point], x fastest.
    for name, value in [("Nx", 2), ("Ny", 3), ("Nz", 4)]:
        file[name] = np.full((1, 1, 1), value, np.uint64)
    for name, value in [("dx", 1e-4), ("dy", 2e-4), ("dz", 3e-4), ("dt", STEP)]:
        file[name] = np.full((1, 1, 1), value, np.float32)
    file["p"] = SERIES.reshape(1, TIMES, -1).astype(np.float32)
    file["part"] = SERIES.reshape(1, TIMES, -1)[:, :, :5].astype(np.float32)
    file["cuboid"] = SERIES.astype(np.float32)
