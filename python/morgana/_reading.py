"""Readings of meters."""

from __future__ import annotations

import dataclasses
import os
from typing import Any, Dict, List, Mapping, Optional, Union

import numpy as np
from numpy.typing import NDArray

from ._archives import Array, opened
from ._errors import FileError
from ._estimate import Estimate, run_with
from ._pulse import Pulse

Doubles = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Reading(Estimate):
    """A quantity that a meter measured (docs/meters.md).

    Readings compute like NumPy arrays, with their errors: see :class:`Estimate`. Arithmetic with a
    reading, and selection of its bins, return a reading. The names of its axes are ``z``, ``y``,
    ``x``, ``r``, ``opl``, ``cosine``, ``u``, ``v``, ``side``, ``part``, ``order``, ``delay``,
    ``stokes`` and ``channel``.

    Examples
    --------
    >>> fluence = measured.meters["fluence"]
    >>> millimetres = fluence.sel(x=0.0, y=0.0) / 100
    >>> np.log(millimetres).error, millimetres.coordinates["z"]
    """

    @classmethod
    def load(cls, path: Union[str, "os.PathLike[str]"], name: str) -> "Reading":
        """Read a meter's quantity from an NPZ or HDF5 file.

        The file is one that ``morgana render`` or :meth:`Result.write` wrote.

        Parameters
        ----------
        path : path_like
            The file.
        name : str
            The quantity, as in ``Result.meters``: ``"fluence"``, or ``"tank.fluence"`` if the file
            contains several meters.

        Returns
        -------
        Reading
            The reading, as in the result.

        Raises
        ------
        FileError
            A file without this reading, or in another format.

        Examples
        --------
        >>> depth = correlation.modulation_depth(morgana.Reading.load("tissue.npz", "fluence_sidebands"))
        """
        arrays, attributes = opened(path)
        found = names_in(arrays)
        if name not in found:
            raise FileError(f"{os.fspath(path)}: no reading {name!r}: the file has {', '.join(found) or 'none'}")
        return reading_in(arrays, name, attributes)

    def convolved(self, pulse: Pulse) -> "Reading":
        """Response to a pulse of light, from the response to an impulse.

        The reading is the impulse response in bins of the optical path length. Light is spread
        evenly over its bin: take bins that are narrow compared with the pulse, and that contain all
        light. The errors are upper bounds, which correlated bins reach; :meth:`Records.gated` gives
        exact errors.

        Parameters
        ----------
        pulse : Pulse
            The shape of the pulse.

        Returns
        -------
        Reading
            This quantity with the pulse, without effective numbers of particles.

        Raises
        ------
        ValueError
            A reading without bins of the optical path length.

        Examples
        --------
        >>> gates = measured.meters["fluence"].convolved(morgana.Pulse.gaussian(fwhm=30))
        """
        edges = self.axes.get("opl")
        if edges is None:
            raise ValueError("the reading has no bins of the optical path length: give the meter min_bound, max_bound and bin_width")
        kernel, axis = pulse.kernel(edges), list(self.axes).index("opl")

        def along(values: Doubles) -> Doubles:
            return np.moveaxis(np.tensordot(kernel, values, (1, axis)), 0, axis)

        mean = along(self.mean)
        few = None if self.few is None else along(np.abs(self.mean) * self.few) > 0.1 * np.abs(mean)
        return self._replace(mean=mean, error=along(self.error), effective=None, few=few)


def names_in(arrays: Mapping[str, Array]) -> List[str]:
    """Returns the names of the readings among the arrays of a measurement."""
    return [name for name in arrays if f"{name}_error" in arrays]


def reading_in(arrays: Mapping[str, Array], name: str, attributes: Mapping[str, Any]) -> Reading:
    """Returns a reading from the arrays and attributes of a measurement."""
    unit, axes, mean = arrays[name]
    error, effective, few = (arrays[f"{name}_{what}"].values for what in ("error", "effective", "few"))
    return reading_of(Reading(mean, error, edges_of(arrays, name, axes), unit, effective, few != 0), attributes)


def edges_of(arrays: Mapping[str, Array], name: str, of: List[str]) -> Dict[str, Optional[Doubles]]:
    """Returns the edges of the bins of each axis of a reading."""
    prefix, dot, _ = name.rpartition(".")
    of_axes = {axis: f"{prefix}{dot}{axis}_edges" for axis in of}
    return {axis: arrays[edges].values if edges in arrays else None for axis, edges in of_axes.items()}


def reading_of(reading: Reading, attributes: Mapping[str, Any]) -> Reading:
    """Returns a reading with the names of its channels, and with its run as the origin. Files
    have the channels and the seed among their attributes."""
    names = {"stokes": ["S0", "S1", "S2", "S3"], "channel": str(attributes.get("channels", "")).split()}
    sizes = dict(zip(reading.axes, reading.mean.shape))
    known = {axis: of for axis, of in names.items() if sizes.get(axis) == len(of)}
    named: Reading = reading._replace(names=known)
    if "seed" in attributes:
        named._from(run_with(attributes["seed"]))
    return named
