"""Arguments of users, checked before the compiled part sees them: messages name the argument and what it must be."""

from __future__ import annotations

import math
import operator
import reprlib
from typing import Any, Dict, List, Mapping, Optional

import numpy as np

from ._errors import RenderError
from ._morgana import Scene

MOST_THREADS = 1024
"""More of them would use up the machine before any work is done."""

MOST = 2**63 - 1
"""The largest number of samples."""


def scene(value: object) -> None:
    """Refuses what is no scene."""
    if not isinstance(value, Scene):
        made = "load_dict" if isinstance(value, Mapping) else "load_file"
        raise TypeError(f"expected a Scene, found {type(value).__name__}: make one by morgana.{made}")


def shown(value: Any) -> str:
    """A value in a message: of arrays their shapes, of what is long its ends."""
    return f"an array of shape {value.shape}" if isinstance(value, np.ndarray) and value.ndim > 0 else reprlib.repr(value)


def whole(value: Any, name: str, least: int, most: int = MOST) -> int:
    """A whole number in a range."""
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} is {shown(value)} but must be a whole number") from None
    if number < least:
        raise RenderError(f"{name} is {number} but must be at least {least}")
    if number > most:
        raise RenderError(f"{name} is {number} but must be at most {most}")
    return number


def optional_whole(value: Any, name: str, least: int, most: int = MOST) -> Optional[int]:
    """The same, or none."""
    return None if value is None else whole(value, name, least, most)


def real(value: Any, name: str, must: str) -> float:
    """A number; ``must`` says of which kind it must be."""
    try:
        if isinstance(value, (str, bytes)) or np.ndim(value) > 0:
            raise TypeError
        return float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name} is {shown(value)} but must be {must}") from None


def positive(value: Any, name: str) -> float:
    """A positive, finite number."""
    found = real(value, name, "a positive number")
    if not (found > 0 and math.isfinite(found)):
        raise RenderError(f"{name} is {value} but must be a positive number")
    return found


def optional_positive(value: Any, name: str) -> Optional[float]:
    """The same, or none."""
    return None if value is None else positive(value, name)


def optional_finite(value: Any, name: str) -> Optional[float]:
    """A finite number, or none."""
    if value is None:
        return None
    found = real(value, name, "a finite number")
    if not math.isfinite(found):
        raise TypeError(f"{name} is {value!r} but must be a finite number")
    return found


def text(value: Any, name: str) -> Optional[str]:
    """A text, or none."""
    if value is not None and not isinstance(value, str):
        raise TypeError(f"{name} is {value!r} but must be a text")
    return value


def texts(value: Any, name: str) -> List[str]:
    """A text, or several."""
    values = [value] if isinstance(value, str) else list(value)
    if not all(isinstance(item, str) for item in values):
        raise TypeError(f"{name} is {shown(value)} but must be texts")
    return values


def truth(value: Any, name: str) -> bool:
    """True or false."""
    if value not in (True, False):
        raise TypeError(f"{name} is {value!r} but must be True or False")
    return bool(value)


def mapping(value: Any, what: str) -> Dict[str, Any]:
    """A dictionary."""
    if not isinstance(value, Mapping):
        raise TypeError(f"expected {what} as a dictionary, found {type(value).__name__}")
    return dict(value)
