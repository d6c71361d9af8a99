"""Files of readings and records, as the program writes them (docs/meters.md#what-is-read)."""

from __future__ import annotations

import importlib
import json
import os
import re
from typing import Any, Dict, List, NamedTuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _morgana
from ._errors import FileError
from ._extras import advice

MATLAB_FIRST = ("x", "y", "u", "v", "r", "z")
"""Axes that come first in MATLAB files, in this order; other axes follow in the order of the array."""


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
    """Reads an NPZ, HDF5 or MATLAB file that the program or :meth:`Result.write` wrote."""
    arrays, attributes = _morgana.read_measurement(os.fspath(path))
    archive = Archive({name: Array(unit, axes, values) for (name, unit, axes), values in arrays}, json.loads(attributes))
    return _of_matlab(path, archive.arrays) if os.fspath(path).lower().endswith(".mat") else archive


def _of_matlab(path: Union[str, "os.PathLike[str]"], stored: Dict[str, Array]) -> Archive:
    """Returns the variables of a MATLAB file with the names, units and axes that its text
    ``metadata`` lists, and the attributes in this text."""
    attributes = _matlab_metadata(path)
    arrays: Dict[str, Array] = {}
    for name, about in attributes.pop("arrays").items():
        variable = re.sub(r"[^0-9A-Za-z]", "_", name)
        if variable not in stored:
            raise FileError(f"{os.fspath(path)}: no variable '{variable}', which its metadata list")
        axes, values = about["axes"], stored[variable].values
        order = sorted(range(len(axes)), key=lambda i: MATLAB_FIRST.index(axes[i]) if axes[i] in MATLAB_FIRST else len(MATLAB_FIRST))
        # MATLAB has no arrays of one axis.
        values = values.reshape(-1) if len(axes) == 1 else values
        if values.ndim != len(axes):
            raise FileError(f"{os.fspath(path)}: '{variable}' has {values.ndim} dimensions, but its metadata list the axes {', '.join(axes)}")
        arrays[name] = Array(about["unit"], axes, np.ascontiguousarray(values.transpose(np.argsort(order))))
    return Archive(arrays, attributes)


def _matlab_metadata(path: Union[str, "os.PathLike[str]"]) -> Dict[str, Any]:
    """Returns the text ``metadata`` of a MATLAB file, decoded."""
    try:
        scipy_io = importlib.import_module("scipy.io")
    except ImportError as missing:
        raise ImportError(f"names of axes in MATLAB files need SciPy: {advice('reconstruct')}") from missing
    try:
        found: Dict[str, Any] = json.loads(str(scipy_io.loadmat(os.fspath(path), variable_names=["metadata"])["metadata"].item()))
        return {"arrays": found.pop("arrays"), **found}
    except (KeyError, ValueError, NotImplementedError) as error:
        raise FileError(f"{os.fspath(path)}: no text 'metadata' with the names of axes: read a file that morgana wrote") from error
