"""Checks of arguments before the compiled part takes them. Messages name the argument and its valid
values."""

from __future__ import annotations

import math
import operator
import reprlib
from typing import Any, Dict, List, Mapping, Optional

import numpy as np

from ._errors import RenderError
from ._morgana import Scene

MAX_THREADS = 1024
"""Maximum number of threads: more would exhaust the machine before any work is done."""

MAX_SAMPLES = 2**63 - 1
"""Largest number of samples."""


def scene(value: object) -> None:
    """Raises an error unless the argument is a scene."""
    if not isinstance(value, Scene):
        made = "load_dict" if isinstance(value, Mapping) else "load_file"
        raise TypeError(f"expected a Scene, found {type(value).__name__}: make one by morgana.{made}")


def shown(value: Any) -> str:
    """Formats a value for a message: the shape of an array, and only the ends of long values."""
    return f"an array of shape {value.shape}" if isinstance(value, np.ndarray) and value.ndim > 0 else reprlib.repr(value)


def whole(value: Any, name: str, least: int, most: int = MAX_SAMPLES) -> int:
    """Returns a whole number in a range, or raises an error."""
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} is {shown(value)} but must be a whole number") from None
    if number < least:
        raise RenderError(f"{name} is {number} but must be at least {least}")
    if number > most:
        raise RenderError(f"{name} is {number} but must be at most {most}")
    return number


def optional_whole(value: Any, name: str, least: int, most: int = MAX_SAMPLES) -> Optional[int]:
    """Returns a whole number in a range, or ``None``."""
    return None if value is None else whole(value, name, least, most)


def real(value: Any, name: str, must: str) -> float:
    """Returns a number; ``must`` describes the valid kind in the message."""
    try:
        if isinstance(value, (str, bytes)) or np.ndim(value) > 0:
            raise TypeError
        return float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name} is {shown(value)} but must be {must}") from None


def positive(value: Any, name: str) -> float:
    """Returns a positive, finite number, or raises an error."""
    found = real(value, name, "a positive number")
    if not (found > 0 and math.isfinite(found)):
        raise RenderError(f"{name} is {value} but must be a positive number")
    return found


def optional_positive(value: Any, name: str) -> Optional[float]:
    """Returns a positive, finite number, or ``None``."""
    return None if value is None else positive(value, name)


def optional_finite(value: Any, name: str) -> Optional[float]:
    """Returns a finite number, or ``None``."""
    if value is None:
        return None
    found = real(value, name, "a finite number")
    if not math.isfinite(found):
        raise TypeError(f"{name} is {value!r} but must be a finite number")
    return found


def text(value: Any, name: str) -> Optional[str]:
    """Returns a text, or ``None``."""
    if value is not None and not isinstance(value, str):
        raise TypeError(f"{name} is {value!r} but must be a text")
    return value


def texts(value: Any, name: str) -> List[str]:
    """Returns a list of texts, from one text or several."""
    values = [value] if isinstance(value, str) else list(value)
    if not all(isinstance(item, str) for item in values):
        raise TypeError(f"{name} is {shown(value)} but must be texts")
    return values


def truth(value: Any, name: str) -> bool:
    """Returns True or False, or raises an error."""
    if value not in (True, False):
        raise TypeError(f"{name} is {value!r} but must be True or False")
    return bool(value)


def mapping(value: Any, what: str) -> Dict[str, Any]:
    """Returns a dictionary, or raises an error."""
    if not isinstance(value, Mapping):
        raise TypeError(f"expected {what} as a dictionary, found {type(value).__name__}")
    return dict(value)
