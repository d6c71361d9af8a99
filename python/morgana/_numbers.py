"""Numbers that users hand over."""

from typing import Any, Optional, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _morgana


def numbers(values: ArrayLike, what: str, kind: type = float) -> NDArray[Any]:
    """An array of numbers of a kind. Masked arrays are refused where they hide elements; ``what`` names them."""
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


def vectors(values: ArrayLike, what: str) -> NDArray[np.float64]:
    """Vectors of space: an array of shape (..., 3)."""
    array = numbers(values, what)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ValueError(f"{what} must have shape (..., 3), three coordinates each, but have {array.shape}")
    return array


def chosen(where: Optional[ArrayLike], count: int) -> Union[slice, NDArray[np.bool_]]:
    """Which of ``count`` records count: an index of them, of a mask that the user gives, or all."""
    if where is None:
        return slice(None)
    mask = np.asarray(where)
    if mask.dtype != bool:
        raise ValueError(f"'where' must be an array of True and False, one for each record, not of type {mask.dtype}: compare a column, or np.isin")
    if mask.shape != (count,):
        raise ValueError(f"'where' must say of each of {count} records whether it counts, but has the shape {mask.shape}")
    return mask
