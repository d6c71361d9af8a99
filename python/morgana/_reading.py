"""Readings of meters."""

from __future__ import annotations

import dataclasses
import json
import os
from typing import Any, Dict, List, Mapping, Optional, Union

import numpy as np
from numpy.typing import DTypeLike, NDArray

from . import _morgana
from ._archives import Array, opened
from ._errors import FileError
from ._estimate import Estimate, run_with
from ._pulse import Pulse
from ._selection import Axis
from ._values import alike

Doubles = NDArray[np.float64]

SPACE = ("x", "y", "z")
"""Axes in space, in the order of the columns of maps."""
FREQUENCIES = "modulation_frequencies"
"""Array with the frequencies of modulated light in Hz."""
UNITS = {"x": "unit", "y": "unit", "z": "unit", "r": "unit", "opl": "unit"}
"""Units of edges."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Reading(Estimate):
    """A quantity that a meter measured (docs/meters.md).

    Readings compute like NumPy arrays, with their errors: see :class:`Estimate`. Arithmetic with a
    reading, and selection of its bins, return a reading. The names of its axes are ``z``, ``y``,
    ``x``, ``r``, ``opl``, ``cosine``, ``u``, ``v``, ``side``, ``part``, ``order``, ``delay``,
    ``stokes``, ``frequency`` (in Hz) and ``channel``.

    Examples
    --------
    >>> fluence = measured.meters["fluence"]
    >>> millimetres = fluence.sel(x=0.0, y=0.0) / 100
    >>> np.log(millimetres).error, millimetres.coordinates["z"]
    """

    axes_to_world: Optional[Doubles] = None
    """Map from the coordinates of the axes x, y and z to the world, (3, 4); ``None`` for readings
    without these axes. It is the identity if the grid is neither rotated nor sheared."""
    metres_per_unit: Optional[float] = None
    """Length of a scene unit in m, if the meter states it."""
    emitted: Optional[Doubles] = None
    """Power of all emitters in the channels of the reading, (channels,), in W; ``None`` if unknown,
    as after arithmetic with two runs that emit different powers."""

    @classmethod
    def load(cls, path: Union[str, "os.PathLike[str]"], name: str) -> "Reading":
        """Read a meter's quantity from an NPZ, HDF5 or MATLAB file.

        The file is one that ``morgana render``, :meth:`Result.write` or :meth:`write` wrote.

        Parameters
        ----------
        path : path_like
            The file: ``.npz``, ``.h5``, or ``.mat``, which needs SciPy.
        name : str
            The quantity, as in ``Result.meters``: ``"fluence"``, or ``"tank.fluence"`` if the file
            contains several meters.

        Returns
        -------
        Reading
            The reading, as in the result. It has correlated noise with other readings of its run,
            as before.

        Raises
        ------
        FileError
            A file without this reading, or in another format.
        ImportError
            A MATLAB file, and SciPy is not installed: run ``pip install ".[reconstruct]"`` in a
            clone of morgana.

        Examples
        --------
        >>> depth = correlation.modulation_depth(morgana.Reading.load("tissue.npz", "fluence_sidebands"))
        """
        arrays, attributes = opened(path)
        found = names_in(arrays)
        if name not in found:
            raise FileError(f"{os.fspath(path)}: no reading {name!r}: the file has {', '.join(found) or 'none'}")
        return reading_in(arrays, name, attributes)

    def write(self, path: Union[str, "os.PathLike[str]"], *, name: str = "reading", dtype: Optional[DTypeLike] = None) -> None:
        """Write the reading to a file, completely or not at all.

        Parameters
        ----------
        path : path_like
            The file; its extension chooses the format. ``.npz``, ``.h5`` and ``.mat`` hold means,
            errors and edges of any axes. ``.vti`` holds means and errors over x, y and z.
            ``.nii.gz``, ``.nii``, ``.jnii``, ``.bnii`` and ``.nrrd`` hold the means; the errors are
            in a second file whose name ends in ``_error``. ``.npy`` holds the means only.
        name : str, optional
            Name of the array in the file.
        dtype : dtype, optional
            ``float32`` or ``float64``; by default the type of the means.

        Raises
        ------
        FileError
            A file that cannot be written, a format of grids for a reading without the axes x, y
            and z, or unequal bins in such a format.
        ValueError
            Another type.

        Examples
        --------
        >>> (1e3 * measured.meters["fluence"]).write("fluence.vti", name="fluence", dtype="float32")
        """
        element = np.dtype(self.mean.dtype if dtype is None else dtype).name
        axes = list(self.axes)
        arrays = [((name, self.unit, axes), self.mean)]
        statistics = [("error", self.unit, self.error), ("effective", "", self.effective), ("few", "", self.few)]
        arrays += [((f"{name}_{what}", unit, axes), of) for what, unit, of in statistics if of is not None and not np.isnan(of).all()]
        arrays += [((f"{axis}_edges", UNITS.get(axis, ""), [axis]), edges) for axis, edges in self.axes.items() if edges is not None]
        if "frequency" in self.names:
            arrays.append(((FREQUENCIES, "Hz", ["frequency"]), np.array(self.names["frequency"])))
        place = self._to_world()
        if place is not None:
            arrays.append((("to_world", "unit", ["row", "column"]), place))
        # All files of readings have the power of the emitters, NaN if it is unknown.
        emitted = np.full(max(1, len(self.names.get("channel", []))), np.nan) if self.emitted is None else self.emitted
        arrays.append((("emitted", "W", ["channel"]), emitted))
        attributes: Dict[str, Any] = {"channels": " ".join(self.names.get("channel", [])), "origin": sorted(self._origin)}
        if self.metres_per_unit is not None:
            attributes["metres_per_unit"] = self.metres_per_unit
        doubles = [(outline, np.ascontiguousarray(values, np.float64)) for outline, values in arrays]
        _morgana.write_arrays(os.fspath(path), doubles, json.dumps(attributes), element)

    def _at(self, where: List[Any]) -> "Reading":
        found: Reading = super()._at(where)  # type: ignore[assignment]
        if self.emitted is None or "channel" not in self.axes:
            return found
        return found._replace(emitted=np.atleast_1d(self.emitted[where[list(self.axes).index("channel")]]))

    def _over(self, axes: List[Axis], mean: Any, error: Any, effective: Any, few: Any) -> Any:
        found = super()._over(axes, mean, error, effective, few)
        if self.emitted is None or "channel" not in self.axes or "channel" in found.axes:
            return found
        return found._replace(emitted=np.array([self.emitted.sum()]))

    def _combined(self, other: Estimate) -> Dict[str, Any]:
        same = not isinstance(other, Reading) or alike(self.emitted, other.emitted)
        return {} if same else {"emitted": None}

    def _to_world(self) -> Optional[Doubles]:
        """Returns the map of the unit cube that the bins fill, (3, 4)."""
        edges = [self.axes.get(axis) for axis in SPACE]
        if self.axes_to_world is None or any(of is None for of in edges):
            return None
        low = np.array([of[0] for of in edges if of is not None])
        high = np.array([of[-1] for of in edges if of is not None])
        steps, origin = self.axes_to_world[:, :3], self.axes_to_world[:, 3]
        return np.column_stack([steps * (high - low), origin + steps @ low])

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
    error = arrays[f"{name}_error"].values
    effective, few = (arrays[of].values if of in arrays else None for of in (f"{name}_effective", f"{name}_few"))
    edges = edges_of(arrays, name, axes)
    return reading_of(Reading(mean, error, edges, unit, effective, None if few is None else few != 0), arrays, name, attributes)


def edges_of(arrays: Mapping[str, Array], name: str, of: List[str]) -> Dict[str, Optional[Doubles]]:
    """Returns the edges of the bins of each axis of a reading."""
    prefix, dot, _ = name.rpartition(".")
    of_axes = {axis: f"{prefix}{dot}{axis}_edges" for axis in of}
    return {axis: arrays[edges].values if edges in arrays else None for axis, edges in of_axes.items()}


def reading_of(reading: Reading, arrays: Mapping[str, Array], name: str, attributes: Mapping[str, Any]) -> Reading:
    """Returns a reading with the names of its channels, with its place in the world, with the power
    of the emitters, and with its origin: its run, or the runs of a reading that
    :meth:`Reading.write` wrote. Files have the channels and the origin among their attributes."""
    prefix = "".join(name.rpartition(".")[:2])
    names: Dict[str, List[Any]] = {"stokes": ["S0", "S1", "S2", "S3"], "channel": str(attributes.get("channels", "")).split()}
    if f"{prefix}{FREQUENCIES}" in arrays:
        names["frequency"] = arrays[f"{prefix}{FREQUENCIES}"].values.tolist()
    sizes = dict(zip(reading.axes, reading.mean.shape))
    known = {axis: of for axis, of in names.items() if sizes.get(axis) == len(of)}
    metres = attributes.get(f"{prefix}metres_per_unit")
    place = _axes_to_world(arrays.get(f"{prefix}to_world"), [reading.axes.get(axis) for axis in SPACE])
    emitted = arrays["emitted"].values if "emitted" in arrays else None
    named: Reading = reading._replace(
        names=known,
        axes_to_world=place,
        metres_per_unit=None if metres is None else float(metres),
        emitted=None if emitted is None or np.isnan(emitted).all() else emitted,
    )
    origin = attributes.get("origin")
    if isinstance(origin, list):
        named._from(frozenset(map(str, origin)))
    elif "seed" in attributes:
        named._from(run_with(attributes["seed"]))
    return named


def _axes_to_world(to_world: Optional[Array], edges: List[Optional[Doubles]]) -> Optional[Doubles]:
    """Returns the map from coordinates of the axes to the world, from the map of the unit cube."""
    if to_world is None or any(of is None for of in edges):
        return None
    low = np.array([of[0] for of in edges if of is not None])
    high = np.array([of[-1] for of in edges if of is not None])
    steps = to_world.values[:, :3] / (high - low)
    return np.column_stack([steps, to_world.values[:, 3] - steps @ low])
