"""Names of labels: ``head: label 2`` in records, derivatives and Jacobians.

Labels of equal index form one medium, with a name such as ``head: labels 1, 2``."""

from __future__ import annotations

from typing import Any, Dict, Iterable, List, NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from ._errors import RenderError
from ._morgana import Scene

OF_LABELS = ": labels "


class Row(NamedTuple):
    """Label in a medium of several labels."""

    medium: str
    """Name of the medium."""
    row: int
    """Row of the label in the values of the medium's parameters."""
    labels: int
    """Number of the medium's labels."""


def rows_of(scene: Scene) -> Dict[str, Row]:
    """Returns the labels of all media of several labels by their names."""
    found = {}
    for medium in scene.fields:
        name, several, listed = medium.rpartition(OF_LABELS)
        labels = listed.split(", ")
        if several and all(label.isdigit() for label in labels):
            found.update({f"{name}: label {label}": Row(medium, row, len(labels)) for row, label in enumerate(labels)})
    return found


def by_medium(scene: Scene, names: Iterable[str]) -> Dict[str, Tuple[str, Any]]:
    """Returns the parameter of a medium for each name of a parameter, and the :class:`Row` of a
    label's parameter, else ``None``."""
    rows = rows_of(scene)
    found: Dict[str, Tuple[str, Any]] = {}
    for name in names:
        if name in found:
            raise RenderError(f"{name!r} is listed twice")
        region, _, parameter = name.rpartition(".")
        of = rows.get(region)
        found[name] = (name, None) if of is None else (f"{of.medium}.{parameter}", of)
    return found


def unique(names: Iterable[Tuple[str, Any]]) -> List[str]:
    """Returns the parameters, each once."""
    return list(dict.fromkeys(parameter for parameter, _ in names))


def row_of(values: NDArray[Any], of: Any, name: str, axis: int) -> NDArray[Any]:
    """Returns the values of a label, whose medium has one row for each label along an axis."""
    if of is None:
        return values
    if values.ndim <= axis + 1 or values.shape[axis] != of.labels:
        raise RenderError(f"all labels of the medium share the value of {name}: take the derivative by the medium, {of.medium!r}")
    return np.asarray(np.take(values, of.row, axis=axis))
