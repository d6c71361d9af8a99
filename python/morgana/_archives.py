"""Files of readings and records, as the program writes them (docs/meters.md#what-is-read)."""

from __future__ import annotations

import json
import os
from typing import Any, Dict, List, NamedTuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _morgana


class Array(NamedTuple):
    """Array of a file of readings, with its unit and the names of its axes."""

    unit: str
    axes: List[str]
    values: NDArray[np.float64]


class Archive(NamedTuple):
    """Content of a file of readings: arrays by their names, and attributes."""

    arrays: Dict[str, Array]
    attributes: Dict[str, Any]


def opened(path: Union[str, "os.PathLike[str]"]) -> Archive:
    """Reads an NPZ or HDF5 file that the program or :meth:`Result.write` wrote."""
    arrays, attributes = _morgana.read_measurement(os.fspath(path))
    return Archive({name: Array(unit, axes, values) for (name, unit, axes), values in arrays}, json.loads(attributes))
