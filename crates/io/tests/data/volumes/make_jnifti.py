"""Small JNIfTI and JData files, by jdata 0.9 and bjdata 0.6 (python make_jnifti.py): values x + 10 y + 100 z over 2 x 3 x 4 voxels."""

import json

import jdata
import numpy as np

values = np.fromfunction(lambda x, y, z: x + 10 * y + 100 * z, (2, 3, 4))
header = {
    "NIIHeaderSize": 348,
    "Dim": [2, 3, 4],
    "DataType": "single",
    "VoxelSize": [0.25, 0.5, 2.0],
    "Unit": {"L": "mm", "T": "s"},
    "QForm": 0,
    "SForm": 1,
    "Affine": [[0.0, 0.5, 0.0, 1.0], [-0.25, 0.0, 0.0, 2.0], [0.0, 0.0, 2.0, 3.0]],
    "NIIFormat": "jnifti",
}
quaternion = {
    **header,
    "QForm": 1,
    "SForm": 0,
    "NIIQfac_": 1,
    "Quatern": {"b": 0.0, "c": 0.0, "d": -np.sqrt(0.5)},
    "QuaternOffset": {"x": 1.0, "y": 2.0, "z": 3.0},
}
# As MCX writes: the identity, and 5 axes in column-major order.
identity = {**header, "Affine": np.eye(4)[:3].tolist(), "VoxelSize": [0.5, 0.5, 0.5, 1e-9, 1]}


def save(name, head, data, **options):
    jdata.save({"NIFTIHeader": head, "NIFTIData": data}, name, compressarraysize=0, **options)


save("zlib.jnii", header, values.astype(np.float32))
save("gzip.jnii", header, values.astype(np.int16), compression="gzip")
save("plain.jnii", quaternion, values.astype(np.uint16), compression="base64")
save("zlib.bnii", header, values.astype(np.float32))
save("scaled.bnii", {**header, "ScaleSlope": 0.5, "ScaleOffset": 3}, values.astype(np.int32))
channels = np.stack([values, -values], axis=-1)
jdata.save({"rho": values, "both": channels.astype(np.float32)}, "arrays.jdt", compressarraysize=0)
jdata.save({"rho": values, "list": [1, 2.5, "a", None, True]}, "arrays.jdb", compressarraysize=0)
with open("columns.jnii", "w") as file:
    array = {"_ArrayType_": "single", "_ArraySize_": [2, 3, 4, 1, 1], "_ArrayOrder_": "c"}
    array["_ArrayData_"] = values.ravel(order="F").tolist()
    json.dump({"NIFTIHeader": identity, "NIFTIData": array}, file)
with open("lists.jnii", "w") as file:
    json.dump({"NIFTIHeader": {"VoxelSize": [0.5, 0.25, 2]}, "NIFTIData": {"Data": values.tolist()}}, file)
