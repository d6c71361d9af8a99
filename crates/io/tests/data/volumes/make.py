"""Makes the volume files of this folder by the formats' own libraries: pip install numpy h5py vtk pynrrd scipy.

Samples say where they are: x + 10 y + 100 z at sample (x, y, z) of a grid of 2 x 3 x 4, as in the tests.
"""
import h5py
import nrrd
import numpy as np
import scipy.io
import vtk
from vtk.util.numpy_support import numpy_to_vtk

Z, Y, X = np.meshgrid(np.arange(4), np.arange(3), np.arange(2), indexing="ij")
VALUES = X + 10 * Y + 100 * Z  # [z, y, x]


def image(values, on_points, dtype):
    data = vtk.vtkImageData()
    size = values.shape[::-1]
    # An extent that does not begin at zero moves the grid.
    first = (3, 0, -1)
    last = [f + n - (1 if on_points else 0) for f, n in zip(first, size)]
    data.SetExtent(first[0], last[0], first[1], last[1], first[2], last[2])
    data.SetOrigin(0.5, -1.0, 2.0)
    data.SetSpacing(0.1, 0.2, 0.4)
    array = numpy_to_vtk(values.astype(dtype).ravel(), deep=True)
    array.SetName("density")
    (data.GetPointData() if on_points else data.GetCellData()).AddArray(array)
    return data


def write(name, data, mode, zlib, raw=False):
    writer = vtk.vtkXMLImageDataWriter()
    writer.SetFileName(name)
    writer.SetInputData(data)
    writer.SetDataMode(mode)
    writer.SetCompressor(vtk.vtkZLibDataCompressor() if zlib else None)
    # Several blocks, the last of which is shorter.
    writer.SetBlockSize(64)
    writer.SetEncodeAppendedData(not raw)
    writer.Write()


points = image(VALUES, True, np.float32)

def write_lz(name, data, kind):
    """Compressed by LZ4 or LZMA, in several blocks."""
    writer = vtk.vtkXMLImageDataWriter()
    writer.SetFileName(name)
    writer.SetInputData(data)
    getattr(writer, f"SetCompressorTypeTo{kind}")()
    writer.SetBlockSize(64)
    writer.Write()


write_lz("lz4.vti", image(VALUES, True, np.float64), "LZ4")
write_lz("lzma.vti", image(VALUES, True, np.float64), "LZMA")
write("ascii.vti", points, vtk.vtkXMLWriter.Ascii, False)
write("inline.vti", points, vtk.vtkXMLWriter.Binary, False)
write("inline_zlib.vti", image(VALUES, True, np.float64), vtk.vtkXMLWriter.Binary, True)
write("appended_raw.vti", points, vtk.vtkXMLWriter.Appended, False, raw=True)
write("appended_raw_zlib.vti", image(VALUES, True, np.int16), vtk.vtkXMLWriter.Appended, True, raw=True)
write("appended_base64.vti", image(VALUES, True, np.uint64), vtk.vtkXMLWriter.Appended, False)
write("appended_base64_zlib.vti", points, vtk.vtkXMLWriter.Appended, True)
write("cells.vti", image(VALUES, False, np.float32), vtk.vtkXMLWriter.Binary, False)
two = image(VALUES, True, np.float32)
other = numpy_to_vtk(2.0 * VALUES.ravel(), deep=True)
other.SetName("other")
two.GetPointData().AddArray(other)
write("two.vti", two, vtk.vtkXMLWriter.Appended, True, raw=True)

# As k-Wave writes its fields: HDF5 dimensions (z, y, x), x fastest, single precision.
with h5py.File("kwave.h5", "w") as file:
    file.attrs["file_type"] = "output"
    file.create_dataset("p_final", data=VALUES.astype("<f4"))
    file.create_dataset("p_max", data=VALUES.astype("<f4"), chunks=(2, 2, 2), compression="gzip", shuffle=True)
    file.create_dataset("Nt", data=np.array([[[10]]], dtype="<u8"))
    group = file.create_group("results")
    group.create_dataset("rho", data=VALUES.T.astype(">f8"))  # [x, y, z]
    group.create_dataset("name", data="water")
    hole = VALUES.astype("<f4")
    hole[2, 1, 0] = np.nan
    file.create_dataset("hole", data=hole)

# Other numbers, and the grid of k-Wave.
with h5py.File("numbers.h5", "w") as file:
    for dtype in ["<f2", "|i1", ">i2", "<i4", "<i8", "|u1", "<u2", ">u4", "<u8"]:
        file.create_dataset(dtype[1:], data=(VALUES % 100).astype(dtype))
    channels = np.stack([VALUES, 1000 + VALUES])
    file.create_dataset("czyx", data=channels.astype("<f4"))
    for name, step in zip(["dx", "dy", "dz"], [1e-4, 2e-4, 4e-4]):
        file.create_dataset(name, data=np.array([[[step]]], dtype="<f4"))

np.save("half.npy", VALUES.astype("<f2"))
np.save("big.npy", np.asfortranarray(VALUES.T.astype(">i4")))  # [x, y, z]
np.savez("stored.npz", density=VALUES.astype("<f4"), other=np.arange(3))
np.savez_compressed("compressed.npz", density=VALUES.astype("<u2"))

# Axes of NRRD are listed from the fastest on.
place = {
    "space": "left-posterior-superior",
    "space directions": np.diag([0.1, 0.2, 0.4]),
    "space origin": [0.8, -1.0, 1.6],
    "space units": ["mm", "mm", "mm"],
}
node = place | {"centerings": ["node", "node", "node"]}
cell = place | {"centerings": ["cell", "cell", "cell"]}
nrrd.write("raw.nrrd", VALUES.T.astype("<f4"), node | {"encoding": "raw"})
nrrd.write("gzip.nrrd", VALUES.T.astype(">i2"), cell | {"encoding": "gzip"})
nrrd.write("ascii.nrrd", VALUES.T.astype("<f8"), node | {"encoding": "ascii"})
nrrd.write("detached.nhdr", VALUES.T.astype("<u2"), cell | {"encoding": "raw"}, detached_header=True)
nrrd.write("spacings.nrrd", VALUES.T.astype("<f4"), {"spacings": [0.1, 0.2, 0.4], "encoding": "raw"})
nrrd.write("z_first.nrrd", VALUES.astype("<f4"), {"encoding": "raw"})
vectors = {"space directions": np.array([[np.nan] * 3, [0, 0.1, 0], [-0.2, 0, 0], [0, 0, 0.4]])}
nrrd.write("turned.nrrd", np.stack([VALUES.T, 1000 + VALUES.T]).astype("<f4"), place | vectors | {"encoding": "raw"})

arrays = {"density": VALUES.T.astype("<f4"), "label": "water", "flat": VALUES[0].T.astype("u1"), "wave": 1j * VALUES.T}
scipy.io.savemat("plain.mat", arrays)
scipy.io.savemat("compressed.mat", {"density": VALUES.T.astype("<f8"), "label": "water"}, do_compression=True)
# Many equal numbers, so that there is something to compress: x + 10 y + 100 z, each 50 times along x.
with h5py.File("lzf.h5", "w") as file:
    file.create_dataset("n", data=np.repeat(VALUES, 50, axis=2).astype(np.float64), compression="lzf")
    layout = h5py.VirtualLayout(VALUES.shape, np.float64)
    layout[:] = h5py.VirtualSource("other.h5", "n", VALUES.shape)
    file.create_virtual_dataset("virtual", layout)

with h5py.File("v73.mat", "w", userblock_size=512) as file:
    file.create_dataset("density", data=VALUES.astype("<f4"))
with open("v73.mat", "r+b") as file:
    file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\0\2IM")


def legacy(name, data, binary):
    writer = vtk.vtkDataSetWriter()
    writer.SetFileName(name)
    writer.SetInputData(data)
    writer.SetFileType(vtk.VTK_BINARY if binary else vtk.VTK_ASCII)
    writer.Write()


legacy("ascii.vtk", points, False)
legacy("cells.vtk", image(VALUES, False, np.int16), True)
vectors = numpy_to_vtk(np.stack([VALUES.ravel(), 1000.0 + VALUES.ravel()], axis=1), deep=True)
vectors.SetName("pair")
two.GetPointData().AddArray(vectors)
two.GetPointData().SetActiveScalars("other")
legacy("three.vtk", two, True)
