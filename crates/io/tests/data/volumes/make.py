"""Makes the volume files of this folder by the formats' own libraries: pip install numpy h5py vtk.

Samples say where they are: x + 10 y + 100 z at sample (x, y, z) of a grid of 2 x 3 x 4, as in the tests.
"""
import h5py
import numpy as np
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
