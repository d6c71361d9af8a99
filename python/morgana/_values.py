"""Comparison of values that contain arrays, tuples without arithmetic, and dictionaries with
helpful errors."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar, Dict, Iterable, Mapping, NoReturn, Tuple, Type, TypeVar

import numpy as np

Tuple_ = TypeVar("Tuple_", bound=Tuple[Any, ...])
Value = TypeVar("Value")
Same = TypeVar("Same", bound="Fields")


def unknown(kind: str, name: object, known: Iterable[str]) -> KeyError:
    """Returns the error for an unknown name, which lists the known names."""
    names = ", ".join(map(repr, known))
    return KeyError(f"no {kind} {name!r}: " + (f"there are {names}" if names else f"the result has no {kind}"))


class Named(Dict[str, Value]):
    """Dictionary with an error for unknown names that lists the known names."""

    def __init__(self, kind: str, values: Mapping[str, Value]) -> None:
        super().__init__(values)
        self._kind = kind

    def __missing__(self, name: object) -> NoReturn:
        raise unknown(self._kind, name, self)


def alike(a: Any, b: Any) -> bool:
    """True if two values are equal. Arrays are compared bit for bit, but NaN equals NaN. Compares
    tuples, lists and mappings by their items."""
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        a, b = np.asarray(a), np.asarray(b)
        return bool(np.array_equal(a, b, equal_nan=a.dtype.kind in "fc" and b.dtype.kind in "fc"))
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        return a.keys() == b.keys() and all(alike(a[key], b[key]) for key in a)
    if isinstance(a, (tuple, list)) and isinstance(b, (tuple, list)):
        return type(a) is type(b) and len(a) == len(b) and all(map(alike, a, b))
    return bool(a == b) or (a != a and b != b)


class Fields:
    """Base of frozen dataclasses with arrays: ``==`` compares the fields, and ``_replace`` copies
    the object with other values, as for named tuples."""

    __dataclass_fields__: ClassVar[Dict[str, Any]]

    @property
    def _fields(self) -> Tuple[str, ...]:
        return tuple(field.name for field in dataclasses.fields(self) if field.init)

    def _asdict(self) -> Dict[str, Any]:
        return {name: getattr(self, name) for name in self._fields}

    def _replace(self: Same, **changes: Any) -> Same:
        """Returns a copy with other values of some fields."""
        new: Same = dataclasses.replace(self, **changes)
        # Copy the fields that the constructor does not take.
        for field in dataclasses.fields(self):
            if not field.init:
                object.__setattr__(new, field.name, getattr(self, field.name))
        return new

    __replace__ = _replace

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return alike(self._asdict(), other._asdict())

    __hash__ = None  # type: ignore[assignment]


def comparable(cls: Type[Tuple_]) -> Type[Tuple_]:
    """Makes ``==`` compare the arrays in a named tuple, and makes ``*`` and ``+`` raise an error.

    Plain tuples cannot compare arrays, and would repeat or join their fields instead of computing
    with the arrays.
    """

    def equal(self: Any, other: object) -> Any:
        return alike(tuple(self), tuple(other)) if isinstance(other, cls) else NotImplemented

    def unequal(self: Any, other: object) -> Any:
        return not alike(tuple(self), tuple(other)) if isinstance(other, cls) else NotImplemented

    def refuse(self: Any, other: object) -> Any:
        fields = ", ".join(self._fields)
        raise TypeError(f"a {cls.__name__} is several values: compute with its fields ({fields}), such as .{self._fields[0]}")

    methods: Dict[str, Any] = {"__eq__": equal, "__ne__": unequal, "__hash__": None}
    methods.update(dict.fromkeys(["__add__", "__radd__", "__mul__", "__rmul__"], refuse))
    # Make NumPy arrays leave arithmetic to these methods.
    methods["__array_ufunc__"] = None
    for name, method in methods.items():
        setattr(cls, name, method)
    return cls
