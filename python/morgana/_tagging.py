"""Tagged light: phase modulation of light by ultrasound (docs/theory.md#tagged-light)."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, Dict, List, Mapping, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _checks as checks
from . import _morgana
from ._bins import mean_and_variance
from ._correlation import Correlation, over
from ._estimate import Axes, Data, Estimate, Origin, Several, own_origin, unnamed
from ._pictures import html_of
from ._records import Records
from ._reading import Reading
from ._sums import by_channel, by_particle, error_of, positive, seconds, taken, warn_about_wavelength
from ._values import Fields

if TYPE_CHECKING:
    from ._layer import Layer

Doubles = NDArray[np.float64]
Floats = NDArray[np.float32]
MAX_ORDERS = 100
"""Largest order of a sideband."""
MAX_PHASE = 1e12
"""Largest phase, in radians: double precision resolves it to 1e-4."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Sidebands(Several, Fields):
    """Power of light by frequency shift, a multiple of the frequency of the sound.

    All errors are standard errors over particles. Sidebands compute like the NumPy array ``mean``,
    with its errors, over the axes ``order`` and ``channel``: see :class:`Estimate`.

    Examples
    --------
    >>> found.sel(order=1, channel=0)
    >>> found.to_xarray()["depth"]
    """

    mean: Doubles
    """Power I_m, (orders + 1, channels): the unshifted power, then the power of one sideband of
    order m = 1, 2, …. The sideband of order −m has the same power."""
    error: Doubles
    """Standard error of ``mean``."""
    total: Doubles
    """Power of the carrier and all sidebands, (channels,): I_0 + 2 Σ I_m over all m ≥ 1, regardless
    of ``orders``."""
    total_error: Doubles
    """Standard error of ``total``."""
    depth: Doubles
    """Modulation depth I_1/I_0, (channels,)."""
    depth_error: Doubles
    """Standard error of ``depth``. It is smaller than the error of I_1, because I_0 and I_1 come
    from the same particles."""
    unit: str = ""
    """Unit of the powers."""
    _origin: Origin = dataclasses.field(init=False, default_factory=own_origin)

    def _quantities(self) -> Dict[str, Estimate]:
        def by_channel(mean: Doubles, error: Doubles, unit: str) -> Estimate:
            made: Estimate = Estimate(mean, error, {"channel": None}, unit)._from(self._origin)
            return made

        return {
            "power": over("order", range(len(self.mean)), self.mean, self.error, self._origin, self.unit),
            "total": by_channel(self.total, self.total_error, self.unit),
            "depth": by_channel(self.depth, self.depth_error, ""),
        }

    def _from(self, origin: Origin) -> "Sidebands":
        object.__setattr__(self, "_origin", origin)
        return self

    def __repr__(self) -> str:
        return f"<morgana.correlation.Sidebands up to order {len(self.mean) - 1}>"


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ModulationDepth(Data, Fields):
    """Modulation depth I₁/I₀ of tagged light in pixels, cells or bins.

    Modulation depths compute like NumPy arrays, with their errors: see :class:`Estimate`. Their
    axes are the axes of the layers or of the reading.
    """

    mean: Doubles
    """Modulation depth I₁/I₀; NaN where there is no light."""
    error: Doubles
    """Upper bound of the standard error of ``mean``: it assumes the worst correlation of I₀ and I₁,
    which come from the same paths."""
    axes: Optional[Axes] = None
    """Edges of the bins by axis; ``None`` for axes without names."""
    names: Dict[str, List[Any]] = dataclasses.field(default_factory=dict)
    """Names of the items of axes without edges."""
    _origin: Origin = dataclasses.field(init=False, default_factory=own_origin)

    def _estimate(self) -> Estimate:
        axes = unnamed(np.ndim(self.mean)) if self.axes is None else self.axes
        made: Estimate = Estimate(self.mean, self.error, axes, names=self.names)._from(self._origin)
        return made

    def _from(self, origin: Origin) -> "ModulationDepth":
        object.__setattr__(self, "_origin", origin)
        return self

    def __repr__(self) -> str:
        shape = " × ".join(map(str, self.mean.shape))
        return f"<morgana.correlation.ModulationDepth of {shape} values>"

    def _repr_html_(self) -> str:
        return html_of(self._estimate(), repr(self).strip("<>"))


def modulation_depth(light: Union[Mapping[str, Layer], Mapping[str, Floats], Reading], prefix: str = "") -> ModulationDepth:
    """Modulation depth of a picture or of a meter's reading.

    The picture is by the integrator ``tagged``, and the reading has separate sidebands.

    Parameters
    ----------
    light : mapping of Layer or of array, or Reading
        ``layers`` of a picture, also of an EXR file that :func:`morgana.read` has read. Or a
        reading with an axis ``order``, such as ``meters["fluence_sidebands"]``, also from an NPZ
        file by :meth:`morgana.Reading.load`.
    prefix : str
        Prefix of ``carrier`` in names of layers, for a picture with a decomposition, such as
        ``"length.0012."``.

    Returns
    -------
    ModulationDepth
        Modulation depths, of the shape of the layers, or of the reading without its axis ``order``.

    Raises
    ------
    ValueError
        Light without separate sidebands up to the first.

    Examples
    --------
    >>> depth = correlation.modulation_depth(morgana.render(scene).layers)
    >>> plt.imshow(depth.mean[:, :, 0])
    """
    carrier, sideband = _first_orders(light, prefix)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(carrier[0] > 0, sideband[0] / carrier[0], np.nan)
        error = (sideband[1] + ratio * carrier[1]) / carrier[0]
    axes, names, origin = _axes_of(light, prefix)
    return ModulationDepth(ratio, error, axes, names)._from(origin)


def _axes_of(light: Union[Mapping[str, Layer], Mapping[str, Floats], Reading], prefix: str) -> Tuple[Axes, Dict[str, List[Any]], Origin]:
    """Returns the axes of the light in a sideband, the names of their items, and the origin."""
    of = light[prefix + "carrier"] if isinstance(light, Mapping) else light
    if not isinstance(of, Data):
        return dict.fromkeys(("row", "column", "channel")), {}, own_origin()
    whole = of._estimate()
    axes = {name: edges for name, edges in whole.axes.items() if name != "order"}
    return axes, {name: names for name, names in whole.names.items() if name in axes}, whole._origin


def _first_orders(light: Union[Mapping[str, Layer], Mapping[str, Floats], Reading], prefix: str) -> list[tuple[Doubles, Doubles]]:
    """Returns means and errors of the carrier and of the first sideband."""
    if isinstance(light, Mapping):
        names = [prefix + name for name in ("carrier", "sideband.1")]
        if not all(name in light for name in names):
            raise ValueError(
                f"there are no layers {' and '.join(names)}: render by the integrator 'tagged', with 'orders' ≥ 1; of files of meters give a morgana.Reading.load"
            )
        return [(mean, np.sqrt(variance)) for mean, variance in (mean_and_variance(light, name) for name in names)]
    if not isinstance(light, Reading):
        raise TypeError(f"expected layers or a reading, found {type(light).__name__}: give result.layers, or a reading of result.meters")
    if "order" not in light.axes or light.mean.shape[0] < 2:
        raise ValueError("the reading has no sidebands up to the first: use fluence_sidebands or power_sidebands of a tagged meter")
    return [(light.mean[order], light.error[order]) for order in (0, 1)]


def tagged(records: Records, *, wavelength: ArrayLike, orders: int = 1, where: Optional[ArrayLike] = None) -> Sidebands:
    """Power that sound shifts to sidebands of recorded light: I_m = E[w J_m(|Φ|)²].

    A record of weight w has the phase Re(Φ e^{iωt}): the modulation of its optical length times 2π
    over the wavelength. Static phases of different paths are assumed to be independent. This holds
    for scattered light.

    Parameters
    ----------
    records : Records
        Records of a ``tagged`` meter.
    wavelength : array_like
        Wavelength in vacuum, > 0, in scene units: one number, or one for each channel. In a scene
        in millimetres, 532 nm are 532e-6. A :class:`morgana.SceneWarning` warns if the wavelength
        exceeds the mean optical length between scatterings, which suggests a wrong unit.
    orders : int
        Largest order m, 1 to 100.
    where : array_like of bool, optional
        Mask of the records to use, (n,): for instance the records of a time gate, or of light that
        leaves, ``records.side == 0``.

    Returns
    -------
    Sidebands
        Powers and modulation depth with their errors.

    Raises
    ------
    ValueError
        Records without modulations, a number out of range, unknown modulations, phases of more than
        1e12 radians, or a ``where`` that is not one bool for each record.

    Examples
    --------
    >>> found = correlation.tagged(records, wavelength=532e-6, orders=2)
    >>> found.mean[1], found.depth
    """
    records = taken(records, where)
    orders = checks.whole(orders, "orders", 1, MAX_ORDERS)
    phase = _phases(records, wavelength)
    weight, particles = records.weight, records.particles
    sums = np.stack([_sums(records, weight * share) for share in _morgana.order_shares(phase, orders)])
    power = _sums(records, weight)
    mean = sums.sum(axis=1)
    error = np.stack([error_of(of_order, particles) for of_order in sums])
    depth = np.divide(mean[1], mean[0], out=np.full_like(mean[0], np.nan), where=mean[0] > 0)
    depth_error = error_of(sums[1] - depth * sums[0], particles) / np.where(mean[0] > 0, mean[0], np.nan)
    warn_about_wavelength(wavelength, records)
    found = Sidebands(mean, error, power.sum(axis=0), error_of(power, particles), depth, depth_error, records.unit)
    return found._from(records._origin)


def correlate_tagged(
    records: Records, delays: ArrayLike, *, wavelength: ArrayLike, frequency: float, where: Optional[ArrayLike] = None
) -> Correlation:
    """Field autocorrelation of recorded light in sound: G₁(τ) = E[w J₀(2|Φ| sin(ωτ/2))].

    Parameters
    ----------
    records : Records
        Records of a ``tagged`` meter.
    delays : array_like
        Delays τ in seconds, (n,), ≥ 0.
    wavelength : array_like
        As in :func:`tagged`.
    frequency : float
        Frequency of the sound in Hz, > 0.
    where : array_like of bool, optional
        As in :func:`tagged`.

    Returns
    -------
    Correlation
        G₁ and g₁ with their errors.

    Raises
    ------
    ValueError
        As for :func:`tagged`.

    Examples
    --------
    >>> found = correlation.correlate_tagged(records, np.linspace(0, 1e-6, 50), wavelength=532e-6, frequency=1e6)
    >>> plt.plot(found.delays, found.normalized[:, 0])
    """
    records = taken(records, where)
    times = seconds(delays, "delays", "finite numbers of seconds, not negative,")
    turn = 2 * np.pi * positive(frequency, "frequency", least=np.nextafter(0, 1)) * times
    phase = _phases(records, wavelength)
    power = _sums(records, records.weight)
    total = power.sum(axis=0)
    shape = (len(times), records.weight.shape[1])
    mean, error, ratio, ratio_error = (np.zeros(shape) for _ in range(4))
    for i, angle in enumerate(turn):
        sums = _sums(records, records.weight * _morgana.phase_correlation(phase, angle / 2))
        mean[i], error[i] = sums.sum(axis=0), error_of(sums, records.particles)
        ratio[i] = np.divide(mean[i], total, out=np.full_like(total, np.nan), where=total > 0)
        ratio_error[i] = error_of(sums - ratio[i] * power, records.particles) / np.where(total > 0, total, np.nan)
    warn_about_wavelength(wavelength, records)
    return Correlation(times, mean, error, ratio, ratio_error, records.unit)._from(records._origin)


def _phases(records: Records, wavelength: ArrayLike) -> Doubles:
    """Returns |Φ| by record and channel."""
    if records.index_modulation is None or records.displacement_modulation is None:
        raise ValueError("the records have no phase shifts from sound: set 'tagged' of their meter")
    channels = records.weight.shape[1]
    length = by_channel(wavelength, "wavelength", channels)
    modulation = records.index_modulation + records.displacement_modulation
    if not np.all(np.isfinite(modulation)):
        unknown = int(np.count_nonzero(~np.isfinite(modulation)))
        raise ValueError(f"the modulation of {unknown} records is unknown: exclude them by 'where', or use a coarser grid of sound")
    with np.errstate(over="ignore", invalid="ignore"):
        phase = np.abs(modulation)[:, None] * (2 * np.pi / np.broadcast_to(length, channels))
    if not np.all(phase <= MAX_PHASE):
        raise ValueError(f"the sound shifts phases by up to {phase.max():.3g} radians, which is too much to compute: give the wavelength in scene units")
    return phase


def _sums(records: Records, weight: Doubles) -> Doubles:
    """Returns sums of weights over the records of each particle, (particles, channels)."""
    return by_particle(records._replace(weight=weight), np.ones((len(records.particle), 1)))[:, 0]
