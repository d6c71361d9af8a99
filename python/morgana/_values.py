"""Whether values that hold arrays are equal."""

from __future__ import annotations

from typing import Any, Mapping, Tuple, Type, TypeVar

import numpy as np

Tuple_ = TypeVar("Tuple_", bound=Tuple[Any, ...])


def alike(a: Any, b: Any) -> bool:
    """Whether two values are equal, bit for bit in arrays, where NaN equals NaN. Looks into tuples, lists and mappings."""
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        a, b = np.asarray(a), np.asarray(b)
        return bool(np.array_equal(a, b, equal_nan=a.dtype.kind in "fc" and b.dtype.kind in "fc"))
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        return a.keys() == b.keys() and all(alike(a[key], b[key]) for key in a)
    if isinstance(a, (tuple, list)) and isinstance(b, (tuple, list)):
        return type(a) is type(b) and len(a) == len(b) and all(map(alike, a, b))
    return bool(a == b) or (a != a and b != b)


def comparable(cls: Type[Tuple_]) -> Type[Tuple_]:
    """Lets ``==`` compare the arrays in a named tuple, of which plain tuples can make no sense."""

    def equal(self: Any, other: object) -> Any:
        return alike(tuple(self), tuple(other)) if isinstance(other, cls) else NotImplemented

    def unequal(self: Any, other: object) -> Any:
        return not alike(tuple(self), tuple(other)) if isinstance(other, cls) else NotImplemented

    for name, method in [("__eq__", equal), ("__ne__", unequal), ("__hash__", None)]:
        setattr(cls, name, method)
    return cls
