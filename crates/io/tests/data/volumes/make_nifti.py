"""Small NIfTI files, by nibabel 5 (python make_nifti.py): values x + 10 y + 100 z over 2 x 3 x 4 voxels."""

import nibabel
import numpy as np

x, y, z = np.indices((2, 3, 4))
values = x + 10 * y + 100 * z
sheared = np.array([[0, 0.5, 0, 1], [-0.25, 0, 0, 2], [0, 0, 2, 3], [0, 0, 0, 1.0]])


def save(name, data, affine, kind=nibabel.Nifti1Image, change=None):
    image = kind(data, affine)
    image.header.set_xyzt_units("mm")
    if change:
        change(image)
    image.to_filename(name)


def by_quaternion(image):
    image.set_sform(None, code=0)
    image.set_qform(sheared, code=1)


def by_spacing(image):
    image.set_sform(None, code=0)
    image.set_qform(None, code=0)


save("labels.nii", values.astype(np.int16), sheared)
save("labels.nii.gz", values.astype(np.uint16), sheared)
save("second.nii", values.astype(np.float64), sheared, nibabel.Nifti2Image)
save("quaternion.nii", values.astype(np.float32), sheared, change=by_quaternion)
save("spacing.nii", values.astype(np.uint8), np.diag([0.5, 0.25, 2, 1]), change=by_spacing)
save("channels.nii", np.stack([values, -values], axis=-1).astype(np.int32), sheared)

# Big-endian, with a slope and an offset.
image = nibabel.Nifti1Image(values.astype(">i2"), sheared, nibabel.Nifti1Header(endianness=">"))
image.header.set_data_dtype(">i2")
image.header.set_slope_inter(0.5, 3)
with open("scaled.nii", "wb") as file:
    header = image.header.copy()
    header["magic"] = b"n+1"
    header["vox_offset"] = 352
    header["sform_code"] = 2
    file.write(header.binaryblock + bytes(4) + values.astype(">i2").tobytes(order="F"))
