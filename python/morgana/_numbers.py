"""Numbers that users hand over."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _morgana


def numbers(values: ArrayLike, what: str, kind: type = float) -> NDArray[Any]:
    """An array of numbers of a kind. Masked arrays are refused where they hide elements; ``what`` names them."""
    _morgana.refuse_masked(values, what)
    return np.asarray(values, kind)
