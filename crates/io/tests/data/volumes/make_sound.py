"""Makes sound.h5, sound.npy and kwave_*.h5 as h5py, NumPy and k-Wave write them: pip install numpy h5py.

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


def kwave(name, mask):
    """The output of a simulation in a grid of 4 x 5 x 7; the samples are those of points (1, 1, 2) to (2, 3, 5), from 0."""
    file = h5py.File(name, "w")
    for key, value in [("Nx", 4), ("Ny", 5), ("Nz", 7), ("Nt", TIMES), ("sensor_mask_type", mask)]:
        file[key] = np.full((1, 1, 1), value, np.uint64)
    for key, value in [("dx", 1e-4), ("dy", 2e-4), ("dz", 3e-4), ("dt", STEP)]:
        file[key] = np.full((1, 1, 1), value, np.float32)
    return file


INDEX = (1 + (X + 1) + 4 * ((Y + 1) + 5 * (Z + 2))).ravel()  # x runs fastest
with kwave("kwave_box.h5", 0) as file:
    file["sensor_mask_index"] = INDEX.reshape(1, 1, -1).astype(np.uint64)
    file.create_dataset("p", data=SERIES.reshape(1, TIMES, -1).astype(np.float32), chunks=(1, 1, INDEX.size))
    # Masks that are no box: one point is elsewhere; two have changed places.
    for key, (first, second) in {"outside": (1, None), "swapped": (INDEX[1], INDEX[0])}.items():
        other = INDEX.copy()
        other[0] = first
        other[1] = second or other[1]
        with kwave(f"kwave_{key}.h5", 0) as bad:
            bad["sensor_mask_index"] = other.reshape(1, 1, -1).astype(np.uint64)
            bad["p"] = SERIES.reshape(1, TIMES, -1)[:, :8].astype(np.float32)
with kwave("kwave_cuboids.h5", 1) as file:
    corners = [[1, 1, 1, 1, 1, 2], [2, 2, 3, 3, 4, 6], [1, 1, 1, 1, 1, 9]]
    file["sensor_mask_corners"] = np.array([corners], np.uint64)
    file["p/1"] = np.zeros((TIMES, 2, 1, 1), np.float32)
    file.create_dataset("p/2", data=SERIES.astype(np.float32), chunks=(8, 2, 3, 2), compression="gzip")
    file["p/3"] = np.zeros((TIMES, 9, 1, 1), np.float32)
    file["other/1"] = np.zeros((TIMES, 2, 2, 1), np.float32)
