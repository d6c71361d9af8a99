"""Propagation of standard errors and units through functions of NumPy, to first order."""

from __future__ import annotations

from typing import Any, Callable, Dict, Tuple

import numpy as np
from numpy.typing import NDArray

Values = NDArray[Any]
Slope = Callable[[Any, Any], Any]
Slopes = Callable[[Any, Any, Any], Tuple[Any, Any]]

UNARY: Dict[np.ufunc, Slope] = {
    np.positive: lambda x, y: 1,
    np.negative: lambda x, y: -1,
    np.absolute: lambda x, y: 1,
    np.square: lambda x, y: 2 * x,
    np.sqrt: lambda x, y: 0.5 / y,
    np.reciprocal: lambda x, y: y * y,
    np.exp: lambda x, y: y,
    np.exp2: lambda x, y: y * np.log(2),
    np.expm1: lambda x, y: y + 1,
    np.log: lambda x, y: 1 / x,
    np.log2: lambda x, y: 1 / (x * np.log(2)),
    np.log10: lambda x, y: 1 / (x * np.log(10)),
    np.log1p: lambda x, y: 1 / (1 + x),
}
"""Derivatives of functions y(x) that carry errors; their signs do not matter."""

BINARY: Dict[np.ufunc, Slopes] = {
    np.add: lambda a, b, y: (1, 1),
    np.subtract: lambda a, b, y: (1, -1),
    np.multiply: lambda a, b, y: (b, a),
    np.true_divide: lambda a, b, y: (1 / b, y / b),
    np.power: lambda a, b, y: (b * (1.0 * a) ** (b - 1), y * np.log(a)),
}
"""Partial derivatives of functions y(a, b) that carry errors."""

LINEAR = {np.positive, np.negative, np.absolute, np.multiply, np.true_divide}
"""Functions that keep effective numbers of particles if their other argument has no error."""

SAME_UNIT = {np.positive, np.negative, np.absolute}


def error_of_one(ufunc: np.ufunc, x: Values, y: Values, error: Values) -> Values:
    """Returns the standard error of y(x)."""
    with np.errstate(all="ignore"):
        return np.asarray(np.abs(UNARY[ufunc](x, y)) * error)


def error_of_two(ufunc: np.ufunc, values: Tuple[Any, Any], y: Values, errors: Tuple[Any, Any]) -> Values:
    """Returns the standard error of y(a, b) for independent a and b. The error of an argument
    without an error is ``None``."""
    with np.errstate(all="ignore"):
        slopes = BINARY[ufunc](*values, y)
        parts = [np.abs(slope) * error for slope, error in zip(slopes, errors) if error is not None]
        return np.asarray(np.hypot(*parts) if len(parts) == 2 else parts[0])


def unit_of_one(ufunc: np.ufunc, unit: str) -> str:
    """Returns the unit of a function of a quantity."""
    if ufunc in SAME_UNIT or not unit:
        return unit
    return f"{ufunc.__name__}({unit})"


def unit_of_two(ufunc: np.ufunc, a: str, b: str, exponent: Any = None) -> str:
    """Returns the unit of a function of two quantities; numbers have the unit ``""``."""
    if ufunc in (np.add, np.subtract):
        return a or b
    if ufunc is np.multiply:
        return f"{a}*{b}" if a and b else a or b
    if ufunc is np.true_divide:
        if a == b:
            return ""
        return f"{a or 1}/{_in_brackets(b)}" if b else a
    if a and np.ndim(exponent) == 0 and exponent is not None:
        return a if exponent == 1 else f"{_in_brackets(a)}^{exponent:g}"
    return f"power({a})" if a else ""


def _in_brackets(unit: str) -> str:
    """Returns a unit in parentheses unless it is a single word."""
    return unit if unit.isalpha() else f"({unit})"
