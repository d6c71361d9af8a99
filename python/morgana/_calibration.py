"""Files of camera calibrations and of displacements from particle image velocimetry (PIV)."""

from __future__ import annotations

import json
import os
import re
from typing import Any, Dict, List, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from ._errors import FileError
from ._system import GradError

Doubles = NDArray[np.float64]

MAX_BYTES = 256 << 20
"""Largest file that is read, in bytes."""
NAMES = {
    "matrix": ("camera_matrix", "cameraMatrix", "intrinsic_matrix", "K", "M"),
    "distortion": ("distortion_coefficients", "distCoeffs", "dist_coeffs", "dist_coeff", "dist", "D"),
    "rotation": ("rotation", "rotation_matrix", "R", "rvec", "rotation_vector"),
    "translation": ("translation", "translation_vector", "T", "tvec", "t"),
    "width": ("image_width", "width"),
    "height": ("image_height", "height"),
}
"""Names of values in files, in the order in which they are looked for."""
MATRIX = re.compile(
    r"^[ \t]*(\w+):[^\n\[]*\n(?:[ \t]+\w+:[^\n\[]*\n)*?[ \t]+rows:[ \t]*(\d+)[ \t]*\n[ \t]+cols:[ \t]*(\d+)[ \t]*\n"
    r"(?:[ \t]+dt:[^\n]*\n)?[ \t]+data:[ \t]*\[([^\]]*)\]",
    re.MULTILINE,
)
"""Matrix in a YAML file of OpenCV or ROS."""
NUMBER = re.compile(r"^[ \t]*(\w+):[ \t]*([-+]?[\d.]+(?:[eE][-+]?\d+)?)[ \t]*$", re.MULTILINE)
"""Number in a YAML file."""
TSAI = ("Ncx", "Nfx", "dx", "dy", "dpx", "dpy", "Cx", "Cy", "sx", "f", "kappa1", "Tx", "Ty", "Tz", "Rx", "Ry", "Rz")
"""Numbers in a file of Tsai's program, in this order. More numbers may follow."""


class Calibration(NamedTuple):
    """Contents of a calibration file."""

    matrix: Doubles
    distortion: Doubles
    rotation: Optional[Doubles]
    translation: Doubles
    size: Optional[Tuple[int, int]]
    """Width and height of the image, in pixels; ``None`` if the file does not have them."""
    kappa: float = 0.0
    """Tsai's distortion coefficient, for coordinates relative to the focal length."""


def read_calibration(path: Union[str, "os.PathLike[str]"], view: Optional[int]) -> Calibration:
    """Reads a calibration file. ``view`` is the number of a pose in ``extrinsic_parameters``."""
    name, text = os.fspath(path), _text(path)
    ending = os.path.splitext(name)[1].lower()
    if ending not in (".yml", ".yaml", ".json"):
        if view is not None:
            raise GradError(f"view is {view}, but {name} has one pose")
        return _tsai(name, text)
    values = _json(name, text) if ending == ".json" else _yaml(name, text)
    matrix = _found(values, "matrix")
    if matrix is None:
        raise GradError(f"{name} has no camera matrix: it has {', '.join(values) or 'no numbers'}, but needs camera_matrix")
    distortion, rotation, translation = (_found(values, key) for key in ("distortion", "rotation", "translation"))
    if view is not None:
        rotation, translation = _pose(name, values, view)
    if (rotation is None) != (translation is None):
        raise GradError(f"{name} has only one half of the pose: it needs a rotation (rvec or R) and a translation (tvec or T)")
    width, height = _found(values, "width"), _found(values, "height")
    size = None if width is None or height is None else (int(width.ravel()[0]), int(height.ravel()[0]))
    return Calibration(
        matrix,
        np.zeros(0) if distortion is None else distortion.ravel(),
        rotation if rotation is None or rotation.size != 3 else rotation.ravel(),
        np.zeros(3) if translation is None else translation.ravel(),
        size,
    )


def read_vectors(path: Union[str, "os.PathLike[str]"]) -> Tuple[Doubles, Doubles, NDArray[np.bool_]]:
    """Reads a text file of OpenPIV. Returns places and displacements, (vectors, 2) each, to the
    right and downwards, and a mask of the invalid or masked vectors."""
    name = os.fspath(path)
    lines = [line for line in _text(path).replace(",", " ").splitlines() if line.strip() and not line.lstrip().startswith("#")]
    try:
        rows = np.array([[float(word) for word in line.split()] for line in lines], float)
    except ValueError as error:
        raise GradError(f"{name} is not a table of vectors x, y, u, v: {error}") from None
    if rows.ndim != 2 or rows.shape[1] < 4 or not len(rows):
        raise GradError(f"{name} has rows of {rows.shape[-1] if rows.ndim == 2 else 'different'} lengths, but needs columns x, y, u, v")
    x, y, u, v = rows[:, :4].T
    # OpenPIV writes rows from the top of the image. If y falls, it is upwards, and so is v.
    steps = np.diff(y)
    if (steps[steps != 0] < 0).sum() > (steps != 0).sum() / 2:
        y, v = y.min() + y.max() - y, -v
    masked = ~np.isfinite(rows[:, :4]).all(axis=1)
    if rows.shape[1] > 4:
        # Interpolated vectors, with the flag 2, are no measurements either.
        masked |= rows[:, 4] != 0
    if rows.shape[1] > 5:
        masked |= rows[:, 5] != 0
    return np.column_stack([x, y]), np.column_stack([u, v]), masked


def _text(path: Union[str, "os.PathLike[str]"]) -> str:
    name = os.fspath(path)
    try:
        if os.path.getsize(name) > MAX_BYTES:
            raise FileError(f"cannot read '{name}': it has more than {MAX_BYTES >> 20} MB")
        with open(name, encoding="utf-8") as file:
            return file.read()
    except OSError as error:
        raise FileError(f"cannot read '{name}': {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise FileError(f"cannot read '{name}': it is not a text") from None


def _json(name: str, text: str) -> Dict[str, Doubles]:
    try:
        given = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise GradError(f"{name} is not JSON: {error}") from None
    if not isinstance(given, dict):
        raise GradError(f"{name} must have an object with camera_matrix")
    found = {}
    for key, value in given.items():
        if isinstance(value, dict) and "data" in value:
            array = _array(value["data"])
            rows, columns = value.get("rows"), value.get("cols")
            if array is not None and isinstance(rows, int) and isinstance(columns, int) and array.size == rows * columns:
                array = array.reshape(rows, columns)
            value = array
        array = _array(value)
        if array is not None:
            found[key] = array
    return found


def _array(value: Any) -> Optional[Doubles]:
    """Returns an array, or ``None`` for anything but numbers."""
    try:
        array = np.asarray(value)
        return array.astype(float) if array.dtype.kind in "uif" else None
    except ValueError:
        return None


def _yaml(name: str, text: str) -> Dict[str, Doubles]:
    found = {key: np.array(float(value)) for key, value in NUMBER.findall(text)}
    for key, rows, columns, data in MATRIX.findall(text):
        try:
            values = np.array([float(word) for word in data.replace(",", " ").split()])
        except ValueError as error:
            raise GradError(f"{key} in {name} is not numbers: {error}") from None
        if values.size != int(rows) * int(columns):
            raise GradError(f"{key} in {name} has {values.size} numbers but must have {rows} × {columns}")
        found[key] = values.reshape(int(rows), int(columns))
    return found


def _found(values: Dict[str, Doubles], key: str) -> Optional[Doubles]:
    return next((values[name] for name in NAMES[key] if name in values), None)


def _pose(name: str, values: Dict[str, Doubles], view: int) -> Tuple[Doubles, Doubles]:
    poses = values.get("extrinsic_parameters")
    if poses is None or poses.ndim != 2 or poses.shape[1] != 6:
        raise GradError(f"{name} has no extrinsic_parameters of six numbers for each picture, which view needs")
    if not 0 <= view < len(poses):
        raise GradError(f"view is {view} but must be from 0 to {len(poses) - 1}: {name} has {len(poses)} poses")
    return poses[view, :3], poses[view, 3:]


def _tsai(name: str, text: str) -> Calibration:
    try:
        numbers: List[float] = [float(word) for word in text.split()]
    except ValueError as error:
        raise GradError(f"{name} is not a calibration by Tsai's program, which has {len(TSAI)} numbers: {error}") from None
    if len(numbers) < len(TSAI):
        raise GradError(f"{name} has {len(numbers)} numbers, but a calibration by Tsai's program has {', '.join(TSAI)}")
    value = dict(zip(TSAI, numbers))
    if not (value["dpx"] > 0 and value["dpy"] > 0 and value["f"] > 0 and value["sx"] > 0):
        raise GradError(f"dpx, dpy, sx and f in {name} must be above 0")
    matrix = np.array([[value["sx"] * value["f"] / value["dpx"], 0, value["Cx"]], [0, value["f"] / value["dpy"], value["Cy"]], [0, 0, 1]])
    (sa, sb, sg), (ca, cb, cg) = ([turn(value[axis]) for axis in ("Rx", "Ry", "Rz")] for turn in (np.sin, np.cos))
    about_x, about_y = np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]]), np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
    about_z = np.array([[cg, -sg, 0], [sg, cg, 0], [0, 0, 1]])
    translation = np.array([value["Tx"], value["Ty"], value["Tz"]])
    return Calibration(matrix, np.zeros(0), about_z @ about_y @ about_x, translation, None, value["kappa1"] * value["f"] ** 2)
