"""Files of readings and records, as the program writes them (docs/meters.md#what-is-read)."""

from __future__ import annotations

import json
import os
import zipfile
from typing import Any, Dict, List, NamedTuple, Union

import numpy as np
from numpy.typing import NDArray

from ._errors import FileError

HDF5 = b"\x89HDF\r\n\x1a\n"
"""How files of this format begin."""


class Array(NamedTuple):
    """An array of a measurement."""

    unit: str
    axes: List[str]
    values: NDArray[np.float64]


class Archive(NamedTuple):
    """What an NPZ file of the program holds."""

    arrays: Dict[str, Array]
    attributes: Dict[str, Any]


def opened(path: Union[str, "os.PathLike[str]"]) -> Archive:
    """The content of an NPZ file that the program or :meth:`Result.write` has written."""
    name = os.fspath(path)
    try:
        with open(name, "rb") as file:
            is_hdf5 = file.read(len(HDF5)) == HDF5
        if not is_hdf5:
            return _read(name)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, zipfile.BadZipFile) as error:
        raise FileError(f"{name}: not a file of readings: {error}") from None
    beside = f"{os.path.splitext(os.path.basename(name))[0]}.npz"
    raise FileError(f"{name}: HDF5 is not read here: write an NPZ file ('-o {beside}', or Result.write), or use h5py")


def _read(name: str) -> Archive:
    if not zipfile.is_zipfile(name):
        raise ValueError("no archive of arrays (.npz)")
    with np.load(name) as archive:
        attributes = json.loads(str(archive["metadata"]))
        return Archive({of: Array(about["unit"], about["axes"], archive[of]) for of, about in attributes["arrays"].items()}, attributes)
