"""Conversion of numbers that users pass."""

from typing import Any, Optional, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _morgana


def numbers(values: ArrayLike, what: str, kind: type = float) -> NDArray[Any]:
    """Converts to an array of numbers of a kind. Raises an error for masked arrays with hidden
    elements; ``what`` names them."""
    if values is None:
        raise TypeError(f"{what} is None but must be an array of real numbers")
    _morgana.refuse_masked(values, what)
    try:
        array = np.asarray(values)
        if array.dtype.kind not in "buifO":
            raise TypeError(f"elements of type {array.dtype}")
        return array.astype(kind, copy=False)
    except (TypeError, ValueError) as error:
        raise TypeError(f"{what} must be an array of real numbers: {error}") from None


def in_order(values: Any, what: str, axes: str) -> Any:
    """Puts axes with names, as in xarray, into the order of ``axes``, such as ``"zyx"``.

    Names are x, y, z, and any other for channels, which are last unless ``axes`` contains ``c``.
    Arrays without names stay as they are."""
    names = getattr(values, "dims", None)
    if not isinstance(names, tuple) or names == tuple(f"dim_{i}" for i in range(len(names))):
        return values
    space = list(axes.replace("c", ""))
    if len(names) not in (len(space), len(space) + 1):
        return values
    lower = [str(name).lower() for name in names]
    others = [i for i, name in enumerate(lower) if name not in space]
    missing = sorted(set(space) - set(lower))
    if missing:
        raise ValueError(
            f"{what} has the dimensions {', '.join(map(str, names))}, but which of them is {' and which '.join(missing)}? Rename them, as in "
            f"array.rename({names[others[0]]}={missing[0]!r}), or give array.values with the axes in the order [{', '.join(axes)}]"
        )
    letters = axes if "c" in axes else axes + "c"
    order = [i for letter in letters for i in (others if letter == "c" else [lower.index(letter)])]
    return np.transpose(np.asarray(values), order)


def pixels(image: Any, what: str, raw: bool) -> Any:
    """Returns the linear pixels of an image: an array, or an object with an array such as
    Mitsuba's ``Bitmap``.

    Integers stand for 0 to 1. Unless ``raw``, integers are decoded from sRGB, or the values of
    bitmaps that say so by ``srgb_gamma``. The opacity is left out. Other objects stay as they
    are."""
    image = in_order(image, what, "yx")
    _morgana.refuse_masked(image, what)
    array = np.asarray(image)
    if array.dtype.kind not in "uif":
        return image
    is_integer = array.dtype.kind in "ui"
    encoded = image.srgb_gamma() if callable(getattr(image, "srgb_gamma", None)) else is_integer
    if is_integer:
        array = array / np.iinfo(array.dtype).max
    if array.ndim == 3 and array.shape[2] in (2, 4):
        array = array[..., :-1]
    array = array.astype(np.float32)
    if encoded and not raw:
        array = np.where(array <= 0.04045, array / 12.92, ((np.maximum(array, 0.04045) + 0.055) / 1.055) ** 2.4)
    return array.astype(np.float32)


def grid_samples(values: ArrayLike, what: str) -> NDArray[np.float64]:
    """Returns numbers on a grid, [z, y, x]. Axes with names are put into this order."""
    return numbers(in_order(values, what, "zyx"), what)


def vectors(values: ArrayLike, what: str) -> NDArray[np.float64]:
    """Returns spatial vectors: an array of shape (..., 3)."""
    array = numbers(values, what)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ValueError(f"{what} must have shape (..., 3), three coordinates each, but have {array.shape}")
    return array


def chosen(where: Optional[ArrayLike], count: int) -> Union[slice, NDArray[np.bool_]]:
    """Returns the selection of ``count`` records as an index: the mask that the user gave, or
    all."""
    if where is None:
        return slice(None)
    mask = np.asarray(where)
    if mask.dtype != bool:
        raise ValueError(f"'where' must be an array of True and False, one for each record, not of type {mask.dtype}: compare a column, or np.isin")
    if mask.shape != (count,):
        raise ValueError(f"'where' must have a True or False for each of {count} records, but has the shape {mask.shape}")
    return mask
