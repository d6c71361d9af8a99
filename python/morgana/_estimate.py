"""Estimates: means with standard errors over named axes, which compute like arrays."""

from __future__ import annotations

import abc
import dataclasses
import uuid
from typing import Any, Callable, Dict, FrozenSet, Iterable, Iterator, List, Mapping, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from ._checks import optional_positive
from ._pictures import html_of
from ._propagation import BINARY, LINEAR, UNARY, error_of_one, error_of_two, unit_of_one, unit_of_two
from ._selection import Axis, by_name, positions
from ._values import Fields, unknown
from ._xarray import data_array, data_set

Doubles = NDArray[np.float64]
Axes = Dict[str, Optional[Doubles]]
"""Edges of the bins by axis; ``None`` for axes without edges."""
Origin = FrozenSet[str]
"""Names of the runs, with independent random numbers, from which an estimate comes."""


def run_with(seed: Any, kind: str = "the run") -> Origin:
    """Returns the origin of the results of a run. Runs with equal seeds have correlated noise, even
    of different scenes."""
    return frozenset([f"{kind} with the seed {seed}"])


def unnamed(count: int) -> Axes:
    """Returns a number of axes without names."""
    return {f"dim_{i}": None for i in range(count)}


def own_origin() -> Origin:
    """Returns an origin that no other estimate has."""
    return frozenset([f"data {uuid.uuid4().hex}"])


def _operator(ufunc: np.ufunc, swapped: bool = False) -> Callable[[Any, Any], Any]:
    def compute(self: Any, other: Any) -> Any:
        # Leave arithmetic to types that know it themselves, such as arrays of xarray.
        known = isinstance(other, (Data, np.ndarray, np.generic)) or not hasattr(other, "__array_ufunc__")
        if not known:
            return NotImplemented
        return ufunc(other, self) if swapped else ufunc(self, other)

    return compute


def _function(ufunc: np.ufunc) -> Callable[[Any], Any]:
    def compute(self: Any) -> Any:
        return ufunc(self)

    return compute


class Data(abc.ABC):
    """Base of results that compute like NumPy arrays: of the means, with their errors.

    ``np.asarray(result)`` is the array of means. Arithmetic (``+``, ``-``, ``*``, ``/``, ``**``)
    and ``np.square``, ``sqrt``, ``exp``, ``log`` and their kin return an :class:`Estimate` with
    errors. All other functions of NumPy, and comparisons by ``<`` and ``>``, compute with the means
    and return plain arrays. ``==`` compares whole results.
    """

    @abc.abstractmethod
    def _estimate(self) -> "Estimate":
        """Returns the means and errors with which this object computes."""

    @property
    def shape(self) -> Tuple[int, ...]:
        """Number of bins along each axis."""
        return self._estimate().mean.shape

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return self._estimate().mean.ndim

    @property
    def size(self) -> int:
        """Number of bins."""
        return self._estimate().mean.size

    @property
    def dtype(self) -> "np.dtype[Any]":
        """Type of the means."""
        return self._estimate().mean.dtype

    @property
    def coordinates(self) -> Dict[str, NDArray[Any]]:
        """Coordinates by axis: centres of bins, names of channels, or numbers of items."""
        return {axis.name: axis.coordinates for axis in self._estimate()._axes()}

    def sel(self, **at: Any) -> "Estimate":
        """Select bins by coordinates.

        A number selects the bin that contains it, and removes the axis. Bins contain their lower
        edge; the last bin contains both edges. A ``slice(first, last)`` selects the bins whose
        centres lie from ``first`` to ``last``, both included, as in xarray. Channels and regions
        are selected by name; axes without edges and names by number.

        Parameters
        ----------
        **at : float, str or slice
            Coordinate on any axis, in the unit of its edges: ``z=12.5``, ``opl=slice(0, 300)``,
            ``channel="R"``.

        Returns
        -------
        Estimate
            Means and errors of these bins; a ``Reading`` of a ``Reading``.

        Raises
        ------
        KeyError
            An unknown axis or name.
        IndexError
            A coordinate outside all bins.

        Examples
        --------
        >>> depth = measured.meters["fluence"].sel(x=0.0, y=0.0)
        >>> early = measured.meters["binned_power"].sel(side=0, opl=slice(0, 300))
        """
        estimate = self._estimate()
        return estimate._at([axis.place(value) if axis.name in at else value for axis, value in by_name(estimate._axes(), at)])

    def isel(self, **at: Any) -> "Estimate":
        """Select bins by position.

        Parameters
        ----------
        **at : int or slice
            Position on any axis, from 0: ``z=3``, ``opl=slice(0, 10)``. Negative numbers count from
            the end.

        Returns
        -------
        Estimate
            Means and errors of these bins; a ``Reading`` of a ``Reading``.

        Raises
        ------
        KeyError
            An unknown axis.
        IndexError
            A position out of range.

        Examples
        --------
        >>> surface = measured.meters["fluence"].isel(z=0)
        """
        estimate = self._estimate()
        axes = estimate._axes()
        return estimate._at(positions(axes, tuple(value for _, value in by_name(axes, at))))

    def to_xarray(self, *, name: Optional[str] = None, metres_per_unit: Optional[float] = None) -> Any:
        """Convert to an ``xarray.DataArray``.

        Parameters
        ----------
        name : str, optional
            Name of the array.
        metres_per_unit : float, optional
            Length of a scene unit in m, > 0. It adds the coordinate ``time`` in s beside ``opl``:
            optical path length over the speed of light in vacuum.

        Returns
        -------
        xarray.DataArray
            The means, with the unit as ``attrs["units"]``. Coordinates are the centres of bins
            (``z``) with their edges (``z_lower``, ``z_upper``), names of channels, and of the shape
            of the means ``error``, ``few`` and ``effective`` if they are known.

        Raises
        ------
        ImportError
            xarray is not installed: run ``pip install ".[sweep]"`` in a clone of morgana.

        Examples
        --------
        >>> measured.meters["fluence"].to_xarray().sel(x=0, y=0, method="nearest").plot()
        """
        return data_array(self._estimate(), name, optional_positive(metres_per_unit, "metres_per_unit"))

    def __array__(self, dtype: Any = None, copy: Optional[bool] = None) -> NDArray[Any]:
        values = np.asarray(self._estimate().mean)
        if dtype is not None and np.dtype(dtype) != values.dtype:
            if copy is False:
                raise ValueError(f"the means are {values.dtype}: converting them to {np.dtype(dtype)} needs a copy")
            return values.astype(dtype)
        return values.copy() if copy else values

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        if any(isinstance(out, Data) for out in options.get("out", ())):
            raise TypeError(f"out of {ufunc.__name__} must be an array, because results do not change: assign the value of {ufunc.__name__}")
        if method == "__call__" and not options and (ufunc in UNARY or ufunc in BINARY):
            return _propagated(ufunc, inputs)
        return getattr(ufunc, method)(*map(_plain, inputs), **options)

    def __array_function__(self, function: Callable[..., Any], types: Iterable[type], args: Tuple[Any, ...], kwargs: Mapping[str, Any]) -> Any:
        if not all(issubclass(kind, (Data, np.ndarray)) for kind in types):
            return NotImplemented
        return function(*map(_plain, args), **{key: _plain(value) for key, value in kwargs.items()})

    def __len__(self) -> int:
        if not self.ndim:
            raise TypeError("a single value has no length")
        return self.shape[0]

    def __iter__(self) -> Iterator["Estimate"]:
        return (self[i] for i in range(len(self)))

    def __getitem__(self, index: Any) -> Any:
        return self._estimate()[index]

    def __bool__(self) -> bool:
        if self.size != 1:
            raise ValueError(f"the truth of {self.size} values is ambiguous: compare the means, as in (reading.mean > 0).any()")
        return bool(np.asarray(self).item())

    def __float__(self) -> float:
        if self.ndim:
            raise TypeError(f"only a single value converts to a number, not values of shape {self.shape}: select a bin")
        return float(self._estimate().mean)

    __add__, __radd__ = _operator(np.add), _operator(np.add, True)
    __sub__, __rsub__ = _operator(np.subtract), _operator(np.subtract, True)
    __mul__, __rmul__ = _operator(np.multiply), _operator(np.multiply, True)
    __truediv__, __rtruediv__ = _operator(np.true_divide), _operator(np.true_divide, True)
    __pow__, __rpow__ = _operator(np.power), _operator(np.power, True)
    __lt__, __le__ = _operator(np.less), _operator(np.less_equal)
    __gt__, __ge__ = _operator(np.greater), _operator(np.greater_equal)
    __neg__, __pos__, __abs__ = _function(np.negative), _function(np.positive), _function(np.absolute)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Estimate(Data, Fields):
    """Means with standard errors over named axes, which compute like a NumPy array.

    Readings of meters are estimates. Arithmetic with layers, powers, derivatives and pictures
    returns estimates. ``np.asarray(estimate)`` is the array of means.

    **Errors.** ``2 * a`` has twice the error of ``a``. Functions such as ``np.log(a)`` propagate
    errors to first order: relative errors must be small. If ``a`` and ``b`` come from runs with
    different seeds, ``a + b`` adds their errors in quadrature, as for independent values. Values of
    the same seed share paths or random numbers, and the error of their sum depends on a correlation
    that the run does not keep. ``a + b`` therefore raises ``ValueError`` for them. Compute with
    ``a.mean`` and ``b.mean`` if you need no error, or render one of them with another seed. An
    estimate that you make from your own numbers counts as independent of all others.
    """

    mean: NDArray[Any]
    """Means of the bins; the shape follows the axes."""
    error: NDArray[Any]
    """Standard errors of the means, of the same shape; NaN if unknown."""
    axes: Axes
    """Edges of the bins by axis, the slowest axis first: one more edge than bins. ``None`` for axes
    without edges."""
    unit: str = ""
    """Unit, in which ``unit`` stands for the scene's unit of length: ``W/unit^2``."""
    effective: Optional[NDArray[Any]] = None
    """Effective numbers of particles, of the shape of ``mean``; ``None`` if unknown."""
    few: Optional[NDArray[np.bool_]] = None
    """Mask of the unreliable errors, of the shape of ``mean``; ``None`` if unknown."""
    names: Dict[str, List[Any]] = dataclasses.field(default_factory=dict)
    """Names of the items of axes without edges, ``{"channel": ["R", "G", "B"]}``, or their
    coordinates, ``{"delay": [0.0, 1e-5]}``."""
    _origin: Origin = dataclasses.field(init=False, default_factory=own_origin)

    def _estimate(self) -> "Estimate":
        return self

    def _from(self, origin: Origin) -> Any:
        """Sets the origin, right after the construction, and returns the estimate."""
        object.__setattr__(self, "_origin", origin)
        return self

    def _axes(self) -> List[Axis]:
        if len(self.axes) != np.ndim(self.mean):
            raise ValueError(f"the means have {np.ndim(self.mean)} axes, but the names of axes are {', '.join(self.axes) or 'none'}")
        return [Axis(name, size, edges, self.names.get(name)) for (name, edges), size in zip(self.axes.items(), self.mean.shape)]

    def _over(self, axes: List[Axis], mean: Any, error: Any, effective: Any, few: Any) -> Any:
        """Returns an estimate over other axes, of the same kind, unit and origin."""
        edges, names = {axis.name: axis.edges for axis in axes}, {axis.name: axis.names for axis in axes if axis.names is not None}
        return self._replace(mean=np.asarray(mean), error=np.asarray(error), axes=edges, names=names, effective=effective, few=few)

    def _at(self, where: List[Any]) -> "Estimate":
        """Returns the bins at a position on each axis."""
        index = tuple(where)
        axes = [new for new in (axis.taken(which) for axis, which in zip(self._axes(), where)) if new is not None]
        effective, few = (None if of is None else np.asarray(of[index]) for of in (self.effective, self.few))
        return self._over(axes, self.mean[index], self.error[index], effective, few)  # type: ignore[no-any-return]

    def _combined(self, other: "Estimate") -> Dict[str, Any]:
        """Returns the fields that change in arithmetic with another estimate, besides the means and
        their statistics."""
        return {}

    def __getitem__(self, index: Any) -> Any:
        """Returns bins by position: ``estimate[3]``, ``estimate[..., 0]``, ``estimate[2:5]``, or
        the bins of a mask of the shape of the means, in a row. An index with ``np.newaxis``, which
        Matplotlib uses, gives a plain array of the means."""
        if any(each is None for each in (index if isinstance(index, tuple) else (index,))):
            return self.mean[index]
        mask = np.asarray(index) if isinstance(index, (np.ndarray, Data)) else None
        if mask is None or mask.dtype != bool:
            return self._at(positions(self._axes(), index))
        if mask.shape != self.shape:
            raise IndexError(f"the mask has the shape {mask.shape} but must have the shape of the means, {self.shape}")
        effective, few = (None if of is None else of[mask] for of in (self.effective, self.few))
        return self._over([Axis("bin", int(mask.sum()))], self.mean[mask], self.error[mask], effective, few)

    def sum(self, *axes: str) -> "Estimate":
        """Sum over axes, with an upper bound of its standard error.

        A particle contributes to several bins, and a run keeps no correlations of bins. ``error``
        of the sum is the sum of the errors: the bound that fully correlated bins reach. It is too
        large for bins that light reaches independently. Larger bins, or records, give the standard
        error itself. ``np.sum(estimate)`` returns the sums of the means without errors.

        Parameters
        ----------
        *axes : str
            Names of the axes; by default all.

        Returns
        -------
        Estimate
            Sums over the remaining axes, with bounds in place of errors.

        Raises
        ------
        KeyError
            An unknown axis.

        Examples
        --------
        >>> plane = measured.meters["absorbed"].sum("x", "y")
        """
        known = self._axes()
        where = tuple(i for i, (axis, _) in enumerate(by_name(known, dict.fromkeys(axes))) if axis.name in axes or not axes)
        kept = [axis for i, axis in enumerate(known) if i not in where]
        few = None
        if self.few is not None:
            few = np.asarray(np.sum(np.abs(self.mean) * self.few, axis=where) > 0.1 * np.abs(np.sum(self.mean, axis=where)))
        return self._over(kept, np.sum(self.mean, axis=where), np.sum(self.error, axis=where), None, few)  # type: ignore[no-any-return]

    def average(self, *axes: str) -> "Estimate":
        """Mean over axes, with an upper bound of its standard error.

        Parameters
        ----------
        *axes : str
            Names of the axes; by default all.

        Returns
        -------
        Estimate
            Means over the remaining axes. ``error`` is the mean of the errors: the bound that fully
            correlated bins reach, as for :meth:`sum`.

        Raises
        ------
        KeyError
            An unknown axis.

        Examples
        --------
        >>> profile = measured.meters["fluence"].average("x", "y")
        """
        total = self.sum(*axes)
        return total / (self.size / max(total.size, 1))  # type: ignore[no-any-return]

    def __repr__(self) -> str:
        kind = type(self).__name__
        if not np.ndim(self.mean):
            return f"<morgana.{kind} {self} {self.unit}>".replace(" >", ">")
        shape = " × ".join(f"{count} {axis}" for axis, count in zip(self.axes, self.mean.shape))
        most = f", at most {self.mean.max():.5g}" if self.mean.size else ""
        return f"<morgana.{kind} of {shape}{most} {self.unit}>".replace(" >", ">")

    def __str__(self) -> str:
        return repr(self) if np.ndim(self.mean) else f"{float(self.mean):.5g} ± {float(self.error):.2g}"

    def _repr_html_(self) -> str:
        return html_of(self)


class Several(Data):
    """Base of results of several quantities, which compute with the first of them."""

    @abc.abstractmethod
    def _quantities(self) -> Dict[str, Estimate]:
        """Returns the quantities by name, the first one first."""

    def _estimate(self) -> Estimate:
        return next(iter(self._quantities().values()))

    def to_xarray(self, *, name: Optional[str] = None, metres_per_unit: Optional[float] = None) -> Any:
        """Convert to an ``xarray.Dataset``.

        Parameters
        ----------
        name : str, optional
            Name of a single quantity; by default all.
        metres_per_unit : float, optional
            Has no effect: the axes have no optical path lengths.

        Returns
        -------
        xarray.Dataset
            A variable for each quantity, and one with the suffix ``_error``; ``attrs["units"]`` is
            the unit.

        Raises
        ------
        KeyError
            An unknown quantity.
        ImportError
            xarray is not installed: run ``pip install ".[sweep]"`` in a clone of morgana.
        """
        quantities = self._quantities()
        if name is not None and name not in quantities:
            raise unknown("quantity", name, quantities)
        chosen = quantities if name is None else {name: quantities[name]}
        return data_set(chosen, optional_positive(metres_per_unit, "metres_per_unit"))

    def _repr_html_(self) -> str:
        return html_of(self._estimate(), repr(self).strip("<>"))


def _plain(value: Any) -> Any:
    """Returns means in place of results, also in lists and tuples."""
    if isinstance(value, Data):
        return np.asarray(value)
    if type(value) in (list, tuple):
        return type(value)(map(_plain, value))
    return value


def _propagated(ufunc: np.ufunc, inputs: Tuple[Any, ...]) -> Any:
    """Returns a function of estimates, with its errors."""
    of = [value._estimate() if isinstance(value, Data) else None for value in inputs]
    values: Tuple[Any, ...] = tuple(given if estimate is None else estimate.mean for given, estimate in zip(inputs, of))
    estimates = [estimate for estimate in of if estimate is not None]
    # Estimates without axes combine with estimates of any shape.
    whole = max(estimates, key=lambda estimate: estimate.mean.ndim)
    if len(estimates) == 2:
        _check_pair(ufunc, *estimates)
    mean = np.asarray(ufunc(*values))
    if mean.shape != whole.mean.shape:
        raise ValueError(
            f"the result of {ufunc.__name__} would have the shape {mean.shape}, which is not the shape {whole.mean.shape} of the axes: compute with .mean and .error"
        )
    if len(inputs) == 1:
        error, unit = error_of_one(ufunc, values[0], mean, whole.error), unit_of_one(ufunc, whole.unit)
    else:
        units = [("" if estimate is None else estimate.unit) for estimate in of]
        error = error_of_two(ufunc, (values[0], values[1]), mean, (*(None if estimate is None else estimate.error for estimate in of),))  # type: ignore[arg-type]
        unit = unit_of_two(ufunc, units[0], units[1], None if of[1] is not None else inputs[1])
    effective = whole.effective if len(estimates) == 1 and ufunc in LINEAR and (ufunc is np.multiply or of[0] is not None) else None
    flags = [np.broadcast_to(estimate.few, mean.shape) for estimate in estimates if estimate.few is not None]
    few = np.asarray(np.any(flags, axis=0)) if flags else None
    origin = frozenset[str]().union(*(estimate._origin for estimate in estimates))
    changes = whole._combined(estimates[0] if estimates[-1] is whole else estimates[-1])
    return whole._replace(mean=mean, error=error, unit=unit, effective=effective, few=few, **changes)._from(origin)


def _check_pair(ufunc: np.ufunc, a: Estimate, b: Estimate) -> None:
    """Raises an error for estimates that do not combine."""
    common = a._origin & b._origin
    if common:
        runs = " and ".join(sorted(name if " seed " in name else "one estimate" for name in common))
        raise ValueError(
            f"both arguments of {ufunc.__name__} come from {runs}, so their noise is correlated and the error of the result is unknown: "
            "compute with their .mean, or render one of them with another seed"
        )
    if ufunc in (np.add, np.subtract) and a.unit and b.unit and a.unit != b.unit:
        raise ValueError(f"{ufunc.__name__} of values in {a.unit} and in {b.unit}: convert one of them, or compute with .mean")
    if a.mean.ndim and b.mean.ndim:
        pairs = list(zip(a._axes(), b._axes()))
        if a.mean.shape != b.mean.shape or not all(_agree(one, other) for one, other in pairs):
            raise ValueError(
                f"the axes differ: {_listed(a)} and {_listed(b)}, or the edges of their bins. Select equal bins first, or compute with .mean"
            )


def _agree(a: Axis, b: Axis) -> bool:
    if a.name != b.name or a.names != b.names or (a.edges is None) != (b.edges is None):
        return False
    return a.edges is None or b.edges is None or bool(np.allclose(a.edges, b.edges, rtol=1e-9, atol=0))


def _listed(estimate: Estimate) -> str:
    return " × ".join(f"{axis.size} {axis.name}" for axis in estimate._axes())
