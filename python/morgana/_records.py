"""Records of detected light."""

from __future__ import annotations

import dataclasses
import os
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._archives import Array, opened
from ._errors import FileError
from ._estimate import Estimate, Origin, own_origin, run_with, unnamed
from ._modulated import Modulated, ModulatedJacobian, modulated
from ._modulated import jacobian as modulated_jacobian
from ._numbers import chosen, numbers
from ._pictures import caption, histogram
from ._power import Jacobian, Power
from ._pulse import Pulse
from ._values import Fields, unknown
from ._xarray import record_set

Doubles = NDArray[np.float64]
Phasors = NDArray[np.complex128]


WHOLE = ("regions", "mu_a", "particles", "unit", "velocity_change")
"""Fields that all records share."""


class Column(NamedTuple):
    """Axes and unit of a column besides the records."""

    axes: Tuple[str, ...] = ()
    unit: str = ""


AVERAGED = {
    "optical_length": Column(unit="unit"),
    "path_length": Column(("region",), "unit"),
    "scatterings": Column(("region",)),
    "momentum_transfer": Column(("region",)),
    "position": Column(("xyz",), "unit"),
    "direction": Column(("xyz",)),
}
"""Columns that :meth:`Records.average` knows by name."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Records(Fields):
    """Records of the light that a meter accepted (docs/meters.md#records).

    There is one record per passage of a particle. Lengths are in scene units. Regions are the media
    of the scene, or the labels within a medium. ``len(records)`` is the number of records.
    ``records[mask]`` and ``records[:1000]`` select records; powers of the selection are the parts
    of the power that these records carry.

    Examples
    --------
    >>> late = records[records.optical_length > 300]
    >>> len(late), late.power().mean
    """

    particle: NDArray[np.int64]
    """Number of the particle, (n,), ascending."""
    weight: Doubles
    """Power by record and channel, (n, channels). Its sum is the power that the meter accepts."""
    position: Doubles
    """Position of the passage, (n, 3)."""
    direction: Doubles
    """Unit direction after the passage, (n, 3); at an opaque surface, the direction of arrival."""
    optical_length: Doubles
    """Optical path length from the emitter, (n,)."""
    side: NDArray[np.int64]
    """0 if the light travels to the side to which the surface normal points, else 1, (n,)."""
    path_length: Doubles
    """Geometric path length in each region, (n, regions)."""
    scatterings: NDArray[np.int64]
    """Number of scattering events in each region, (n, regions)."""
    momentum_transfer: Doubles
    """Sum of 1 − cos ϑ over the scattering events, where ϑ is the scattering angle, (n,
    regions)."""
    regions: List[str]
    """Names of the regions."""
    mu_a: Doubles
    """Absorption coefficients of the regions, (regions, channels); NaN if a coefficient varies in
    space."""
    particles: int
    """Number of particles whose records are kept, including particles without records. This is the
    number of traced particles, unless there were more than ``max_records`` records."""
    unit: str
    """Unit of the weights."""
    index_modulation: Optional[Phasors] = None
    """Modulation of the optical length by the change of the index in sound, (n,), in scene units.
    The values are complex amplitudes A of the change Re(A e^{iωt}). ``None`` unless the meter is
    ``tagged``."""
    displacement_modulation: Optional[Phasors] = None
    """Modulation of the optical length by the displacement of scatterers in sound, (n,), in scene
    units. The values are complex amplitudes A of the change Re(A e^{iωt}). ``None`` unless the
    meter is ``tagged``."""
    optical_length_rate: Optional[Doubles] = None
    """Rate of change of the optical length due to the flow of the scatterers, (n,), in scene units
    per second. ``None`` unless a medium has a ``velocity``."""
    velocity_change: Optional[Doubles] = None
    """Largest rate at which the velocity changes along the flow of each region, |(v·∇)v|/|v|, per
    second, (regions,). Flows along the axes of their grid have none. A wall that cuts voxels
    obliquely counts, because the flow ends there. ``None`` unless a medium has a ``velocity``."""
    stokes: Optional[Doubles] = None
    """Stokes parameters S0 to S3 of the power, (n, 4, channels), in the frame of the meter.
    ``None`` unless the meter has ``stokes``."""

    _origin: Origin = dataclasses.field(init=False, default_factory=own_origin)

    def __len__(self) -> int:
        return len(self.particle)

    def __getitem__(self, which: Any) -> "Records":
        """Returns some records: a mask, a slice, or numbers of records."""
        if not isinstance(which, slice):
            which = np.atleast_1d(np.asarray(which))
            if which.dtype.kind not in "biu" or which.ndim != 1:
                raise TypeError("records are selected by a mask, a slice or numbers of records: columns are attributes, such as .weight")
            if which.dtype == bool:
                which = chosen(which, len(self))
        columns = {name: of[which] for name, of in self._asdict().items() if name not in WHOLE and of is not None}
        return self._replace(**columns)

    def __array__(self, dtype: Any = None, copy: Optional[bool] = None) -> Any:
        raise TypeError("records are a table of columns: take one, such as records.weight, or records.power() for the power with its error")

    @classmethod
    def load(cls, path: Union[str, "os.PathLike[str]"], meter: Optional[str] = None) -> "Records":
        """Read the records in an NPZ, HDF5 or MATLAB file.

        The file is one that ``morgana render`` or :meth:`Result.write` wrote.

        Parameters
        ----------
        path : path_like
            The file: ``.npz``, ``.h5``, or ``.mat``, which needs SciPy.
        meter : str, optional
            Name of the meter; needed if the file contains several meters.

        Returns
        -------
        Records
            The records.

        Raises
        ------
        FileError
            A file without records of this meter, or in another format.
        ImportError
            A MATLAB file, and SciPy is not installed: run ``pip install ".[reconstruct]"`` in a
            clone of morgana.

        Examples
        --------
        >>> records = morgana.Records.load("tissue.npz")
        """
        found = found_in(*opened(path))
        if meter is None and len(found) == 1:
            return next(iter(found.values()))
        if not found:
            raise FileError(f"{os.fspath(path)}: the file has no records: set 'records' of an irradiancemeter")
        if meter not in found:
            raise FileError(f"{os.fspath(path)}: no records of {meter!r}: the file has records of {sorted(found)}")
        return found[meter]

    def rescaled(self, mu_a: Mapping[str, ArrayLike]) -> "Records":
        """The light with other absorption coefficients.

        Weights change by exp(−Δμ_a ℓ), with the length ℓ in each region. This is exact, but the
        error grows with the change: see ``effective`` of :meth:`power`.

        Parameters
        ----------
        mu_a : mapping
            New absorption coefficients of regions by name, one number or one for each channel, ≥ 0,
            per scene unit. Other regions keep their coefficients.

        Returns
        -------
        Records
            Records with the new weights.

        Raises
        ------
        ValueError
            An unknown region, a region whose absorption varies in space, or a negative coefficient.

        Examples
        --------
        >>> records.rescaled({"tissue: label 1": 0.02}).power().mean
        """
        new = self.mu_a.copy()
        for name, value in mu_a.items():
            row = self._region(name)
            new[row] = numbers(value, f"the absorption of {name!r}")
            if not np.all(np.isfinite(new[row]) & (new[row] >= 0)):
                raise ValueError(f"the absorption of {name!r} must be finite and not negative")
            if np.isnan(self.mu_a[row]).any():
                raise ValueError(f"the absorption of {name!r} varies in space: change weights by path_length yourself")
        change = np.where(np.isnan(self.mu_a), 0.0, new - self.mu_a)
        factor = np.exp(-self.path_length @ change)
        stokes = None if self.stokes is None else self.stokes * factor[:, None, :]
        return self._replace(weight=self.weight * factor, mu_a=new, stokes=stokes)

    def jacobian(self, mu_s: Optional[Mapping[str, ArrayLike]] = None, where: Optional[ArrayLike] = None) -> Jacobian:
        """Derivatives of the power of all or some records by the coefficients of the regions.

        The derivative by μ_a is −Σ weight · ℓ, with the length ℓ in the region. The derivative by
        μ_s is Σ weight · (k/μ_s − ℓ), with the number of scattering events k. Both are unbiased.
        Divide by the power for derivatives of its logarithm: by μ_a, this is minus the mean partial
        path length.

        Parameters
        ----------
        mu_s : mapping, optional
            Scattering coefficients of regions by name, with which the records were made, one number
            or one for each channel, > 0.
        where : array_like of bool, optional
            Mask of the records to use, (n,): for instance the records of a detector or a time gate.

        Returns
        -------
        Jacobian
            Derivatives by region and channel.

        Raises
        ------
        ValueError
            An unknown region, a coefficient that is not positive, or a ``where`` that is not one
            bool for each record.

        Examples
        --------
        >>> late = records.jacobian({"tissue": 10.0}, where=records.optical_length > 300)
        >>> late.mu_a, late.mu_s
        """
        which = chosen(where, len(self.particle))
        particle, weight = self.particle[which], self.weight[which][:, None, :]
        length, scatterings = (of[which][:, :, None] for of in (self.path_length, self.scatterings))
        known = self._scattering(mu_s)
        by_mu_a = self._power(particle, -length * weight)
        by_mu_s = self._power(particle, (scatterings / known - length) * weight)
        unit = f"{self.unit}*unit" if self.unit else ""
        return Jacobian(by_mu_a.mean, by_mu_a.error, by_mu_s.mean, by_mu_s.error, list(self.regions), unit)._from(self._origin)

    def _scattering(self, mu_s: Optional[Mapping[str, ArrayLike]]) -> Doubles:
        """Returns scattering coefficients by region and channel; NaN where they are not given."""
        known = np.full(self.mu_a.shape, np.nan)
        for name, value in (mu_s or {}).items():
            row = self._region(name)
            known[row] = numbers(value, f"the scattering of {name!r}")
            if not np.all(np.isfinite(known[row]) & (known[row] > 0)):
                raise ValueError(f"the scattering of {name!r} must be finite and positive")
        return known

    def modulated(self, frequencies: ArrayLike, *, metres_per_unit: float, where: Optional[ArrayLike] = None) -> Modulated:
        """Amplitude and phase of the light of emitters whose power is modulated.

        Light that has travelled the optical path length L lags by 2πf L/c behind the emitter. Its
        sum over the records has an amplitude and a phase, for each frequency f. The amplitude
        belongs to emitters whose power is modulated completely; divide it by the power for the
        depth of modulation.

        Parameters
        ----------
        frequencies : array_like
            Frequencies of the modulation in Hz, > 0, one or more.
        metres_per_unit : float
            Length of a scene unit in m: 1e-3 for mm.
        where : array_like of bool, optional
            Mask of the records to use, (n,): for instance the records of a detector.

        Returns
        -------
        Modulated
            Amplitude and phase by frequency and channel, with their errors.

        Raises
        ------
        ValueError
            Frequencies or a length that are not positive.

        Examples
        --------
        >>> light = records.modulated([100e6, 200e6], metres_per_unit=1e-3)
        >>> np.degrees(light.phase.mean[:, 0]), np.degrees(light.phase.error[:, 0])
        """
        return modulated(self, frequencies, metres_per_unit, chosen(where, len(self.particle)))

    def modulated_jacobian(
        self,
        frequencies: ArrayLike,
        *,
        metres_per_unit: float,
        mu_s: Optional[Mapping[str, ArrayLike]] = None,
        where: Optional[ArrayLike] = None,
    ) -> ModulatedJacobian:
        """Derivatives of amplitude and phase of modulated light by the coefficients of the regions.

        They are ratios of sums over the records; the errors take the correlation of the sums into
        account.

        Parameters
        ----------
        frequencies : array_like
            Frequencies of the modulation in Hz, > 0, one or more.
        metres_per_unit : float
            Length of a scene unit in m: 1e-3 for mm.
        mu_s : mapping, optional
            Scattering coefficients of regions by name, as in :meth:`jacobian`. Without them,
            derivatives by μ_s are NaN.
        where : array_like of bool, optional
            Mask of the records to use, (n,).

        Returns
        -------
        ModulatedJacobian
            Derivatives of ln A and of the phase by coefficient, region, frequency and channel.

        Raises
        ------
        ValueError
            An unknown region, or a number that is not positive.

        Examples
        --------
        >>> rows = records.modulated_jacobian([100e6], metres_per_unit=1e-3)
        >>> rows.log_amplitude.sel(coefficient="mu_a").mean
        """
        which = chosen(where, len(self.particle))
        return modulated_jacobian(self, frequencies, metres_per_unit, self._scattering(mu_s), which)

    def _region(self, name: str) -> int:
        """Returns the row of a region."""
        if name not in self.regions:
            raise ValueError(f"no region {name!r}: the records have {', '.join(map(repr, self.regions))}")
        return self.regions.index(name)

    def power(self, where: Optional[ArrayLike] = None) -> Power:
        """Power of all or some records.

        Parameters
        ----------
        where : array_like of bool, optional
            Mask of the records to use, (n,).

        Returns
        -------
        Power
            Mean and standard error by channel.

        Raises
        ------
        ValueError
            A ``where`` that is not one bool for each record.

        Examples
        --------
        >>> early = records.power(records.optical_length < 300)
        >>> print(early.mean, early.error)
        """
        which = chosen(where, len(self.particle))
        return self._power(self.particle[which], self.weight[which])

    def average(self, of: Union[str, ArrayLike], where: Optional[ArrayLike] = None) -> Estimate:
        """Mean of a quantity over the light of all or some records, weighted by their power.

        The mean optical path length over the speed of light is the mean time of flight. Means of
        ``path_length`` are partial path lengths. The mean of exp(−Δμa ℓ) is the factor by which the
        power changes with the absorption of a region, with a much smaller error than two runs have.

        Parameters
        ----------
        of : str or array_like
            Name of a column, such as ``"optical_length"``, ``"path_length"`` or ``"scatterings"``,
            or values of each record, (n, ...).
        where : array_like of bool, optional
            Mask of the records to use, (n,).

        Returns
        -------
        Estimate
            Means, (..., channels), with standard errors to first order. An axis over regions has
            their names. NaN without light.

        Raises
        ------
        KeyError
            An unknown column.
        ValueError
            Values that are not one or more for each record, or a ``where`` that is not one bool for
            each record.
        TypeError
            Values that are not real numbers.

        Examples
        --------
        >>> time = records.average("optical_length") * 1e-3 / 299_792_458        # of a scene in mm
        >>> records.average("path_length").sel(region="tissue: label 2", channel=0)
        >>> change = records.average(np.exp(-0.01 * records.path_length[:, 2]))
        """
        if isinstance(of, str):
            if of not in AVERAGED:
                raise unknown("column", of, AVERAGED)
            values, axes, unit = numbers(getattr(self, of), of), [*AVERAGED[of].axes], AVERAGED[of].unit
        else:
            values, unit = numbers(of, "the values"), ""
            if values.ndim == 0 or len(values) != len(self):
                raise ValueError(f"the values have the shape {values.shape} but must be one or more for each of the {len(self)} records")
            axes = [*unnamed(values.ndim - 1)]
        which = chosen(where, len(self))
        total, particle = self.power(where), self.particle[which]
        scale = np.divide(1.0, total.mean, out=np.full_like(total.mean, np.nan), where=total.mean > 0)
        share = (self.weight[which] * scale).reshape(len(particle), *[1] * (values.ndim - 1), len(scale))
        each = values[which][..., None]
        mean = np.where(np.isnan(scale), np.nan, (share * each).sum(axis=0))
        error = self._power(particle, share * (each - mean)).error
        effective, few = np.broadcast_to(total.effective, mean.shape), np.broadcast_to(total.few, mean.shape)
        names = {axis: known for axis, known in [("region", list(self.regions)), ("xyz", ["x", "y", "z"])] if axis in axes}
        made: Estimate = Estimate(mean, error, dict.fromkeys([*axes, "channel"]), unit, effective, few, names)._from(self._origin)
        return made

    def gated(self, edges: ArrayLike, pulse: Optional[Pulse] = None) -> Power:
        """Energy in time gates, of light from an impulse or a pulse.

        The energy of a record is divided among gates according to the pulse. No binning takes place
        before, and errors are exact.

        Parameters
        ----------
        edges : array_like
            Optical path lengths at the edges of the gates, ascending, (gates + 1,).
        pulse : Pulse, optional
            The shape of the emitted pulse; without it, all light starts at 0.

        Returns
        -------
        Power
            Means and errors, (gates, channels).

        Raises
        ------
        ValueError
            Edges that do not ascend.

        Examples
        --------
        >>> gates = records.gated(np.linspace(0, 300, 31), morgana.Pulse.gaussian(fwhm=30))
        >>> print(gates.mean[:, 0], gates.error[:, 0])
        """
        limits = numbers(edges, "edges")
        if limits.ndim != 1 or len(limits) < 2 or not np.all(np.diff(limits) > 0):
            raise ValueError("edges of gates must be at least two ascending numbers")
        since = limits - self.optical_length[:, None]
        share = np.diff((since > 0).astype(float) if pulse is None else pulse.emitted(since), axis=1)
        return self._power(self.particle, share[:, :, None] * self.weight[:, None, :], limits)

    def _power(self, particle: NDArray[np.int64], weight: Doubles, gates: Optional[Doubles] = None) -> Power:
        """Returns the sum of weights, (n, ...), with its error over particles."""
        _, rows = np.unique(particle, return_inverse=True)
        totals = np.zeros((int(rows.max(initial=-1)) + 1, *weight.shape[1:]))
        np.add.at(totals, rows, weight)
        mean, squares, largest = totals.sum(axis=0), (totals**2).sum(axis=0), totals.max(axis=0, initial=0.0)
        effective = np.divide(mean**2, squares, out=np.zeros_like(mean), where=squares > 0)
        if self.particles < 2:
            return Power(mean, np.full_like(mean, np.inf), effective, np.ones(mean.shape, bool), gates, self.unit)._from(self._origin)
        variance = np.maximum(squares - mean**2 / self.particles, 0.0) * self.particles / (self.particles - 1)
        return Power(mean, np.sqrt(variance), effective, largest > 0.1 * mean, gates, self.unit)._from(self._origin)

    def __repr__(self) -> str:
        return f"<morgana.Records of {len(self.particle)} passages of {self.particles} particles, in {len(self.regions)} regions>"

    def to_xarray(self) -> Any:
        """Convert to an ``xarray.Dataset``.

        Returns
        -------
        xarray.Dataset
            A variable for each column over ``record``, and ``mu_a`` over ``region``. Coordinates
            are the names of the regions. The real and imaginary parts of the modulations have the
            suffixes ``_real`` and ``_imag``.

        Raises
        ------
        ImportError
            xarray is not installed: run ``pip install ".[sweep]"`` in a clone of morgana.

        Examples
        --------
        >>> table = records.to_xarray()
        >>> table["path_length"].sel(region="tissue").mean()
        """
        return record_set(self)

    def _repr_html_(self) -> str:
        power = self.weight.sum(axis=1) if len(self) else np.zeros(0)
        return histogram(self.optical_length, power, f"power ({self.unit}) over the optical path length (scene units)") + caption(repr(self).strip("<>"))


def found_in(arrays: Mapping[str, Array], attributes: Mapping[str, Any]) -> Dict[str, Records]:
    """Returns the records among the arrays of a measurement, by the names of meters."""
    tables = {}
    for name in arrays:
        prefix, found, _ = name.rpartition("record_weight")
        if found:
            table = _table(prefix, arrays, attributes)
            if "seed" in attributes:
                object.__setattr__(table, "_origin", run_with(attributes["seed"]))
            tables[attributes[f"{prefix}meter"]] = table
    return tables


def _table(prefix: str, arrays: Mapping[str, Array], attributes: Mapping[str, Any]) -> Records:
    def column(name: str) -> Doubles:
        return np.asarray(arrays[f"{prefix}record_{name}"].values, float)

    def phasors(name: str) -> Optional[Phasors]:
        if f"{prefix}record_{name}" not in arrays:
            return None
        parts = column(name)
        return np.asarray(parts[:, 0] + 1j * parts[:, 1])

    change = f"{prefix}region_velocity_change"
    return Records(
        particle=column("particle").astype(np.int64),
        weight=_matrix(column("weight")),
        position=column("position"),
        direction=column("direction"),
        optical_length=column("optical_length"),
        side=column("side").astype(np.int64),
        path_length=column("path_length"),
        scatterings=column("scatterings").astype(np.int64),
        momentum_transfer=column("momentum_transfer"),
        regions=list(attributes[f"{prefix}regions"]),
        mu_a=_matrix(np.asarray(arrays[f"{prefix}region_mu_a"].values, float)),
        particles=int(attributes[f"{prefix}record_particles"]),
        unit=arrays[f"{prefix}record_weight"].unit,
        index_modulation=phasors("index_modulation"),
        displacement_modulation=phasors("displacement_modulation"),
        optical_length_rate=column("optical_length_rate") if f"{prefix}record_optical_length_rate" in arrays else None,
        velocity_change=np.asarray(arrays[change].values, float) if change in arrays else None,
        stokes=column("stokes").reshape(len(column("weight")), 4, -1) if f"{prefix}record_stokes" in arrays else None,
    )


def _matrix(array: Doubles) -> Doubles:
    """Adds a last axis for a single channel, which arrays omit."""
    return array[:, None] if array.ndim == 1 else array
