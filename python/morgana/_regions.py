"""Names of labels: ``head: label 2`` in records, derivatives and Jacobians.

Labels of equal index form one medium, with a name such as ``head: labels 1, 2``."""

from __future__ import annotations

from typing import Any, Dict, Iterable, List, Mapping, NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from ._errors import RenderError
from ._morgana import Scene

OF_LABELS = ": labels "
VOXELS = ": voxels"


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


def by_medium(scene: Scene, names: Iterable[str]) -> Dict[str, Tuple[List[str], Any]]:
    """Returns the parameters of media for each name of a parameter, whose derivatives add up to that
    of the name, and the :class:`Row` of a label's parameter, else ``None``."""
    rows = rows_of(scene)
    found: Dict[str, Tuple[List[str], Any]] = {}
    for name in names:
        if name in found:
            raise RenderError(f"{name!r} is listed twice")
        region, _, parameter = name.rpartition(".")
        of = rows.get(region)
        if of is not None:
            found[name] = ([f"{of.medium}.{parameter}"], of)
        elif region.endswith(VOXELS):
            found[name] = ([f"{medium}.voxels.{parameter}" for medium in _media_of_labels(scene, region[: -len(VOXELS)])], None)
        else:
            found[name] = ([name], None)
    return found


def _media_of_labels(scene: Scene, volume: str) -> List[str]:
    """Returns the names of the media of a volume of labels."""
    found = [medium for medium in scene.fields if medium.startswith(f"{volume}: label")]
    if not found:
        volumes = sorted({medium.rpartition(": label")[0] for medium in scene.fields if ": label" in medium})
        raise RenderError(f"no volume of labels {volume!r}: there {f'are {volumes}' if volumes else 'is none'}")
    return found


def unique(names: Iterable[Tuple[List[str], Any]]) -> List[str]:
    """Returns the parameters, each once."""
    return list(dict.fromkeys(parameter for parameters, _ in names for parameter in parameters))


def added(known: Mapping[str, Tuple[NDArray[Any], NDArray[Any]]], parameters: List[str]) -> Tuple[NDArray[Any], NDArray[Any]]:
    """Returns sums of derivatives and errors by parameters. Where one is not zero, the others are."""
    values, errors = zip(*(known[parameter] for parameter in parameters))
    return np.sum(values, axis=0), np.sum(errors, axis=0)


def row_of(values: NDArray[Any], of: Any, name: str, axis: int) -> NDArray[Any]:
    """Returns the values of a label, whose medium has one row for each label along an axis."""
    if of is None:
        return values
    if values.ndim <= axis + 1 or values.shape[axis] != of.labels:
        raise RenderError(f"all labels of the medium share the value of {name}: take the derivative by the medium, {of.medium!r}")
    return np.asarray(np.take(values, of.row, axis=axis))
