"""Power of recorded light, and its derivatives."""

from __future__ import annotations

import dataclasses
from typing import Dict, List, Optional

import numpy as np
from numpy.typing import NDArray

from ._estimate import Data, Estimate, Origin, own_origin
from ._pictures import html_of
from ._values import Fields

Doubles = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Power(Data, Fields):
    """Power of recorded light by channel, or energy by gate and channel.

    Powers compute like NumPy arrays, with their errors: see :class:`Estimate`. Their axes are
    ``opl`` for gates, and ``channel``.

    Examples
    --------
    >>> gates = records.gated(np.linspace(0, 300, 31))
    >>> gates.sel(opl=150.0, channel=0) / 1e-3
    """

    mean: Doubles
    """Power, (channels,) or (gates, channels), in the unit of the weights."""
    error: Doubles
    """Standard error, of the same shape. All records of a particle are one sample. Infinite with
    fewer than two particles."""
    effective: Doubles
    """Effective number of particles: the number of equal particles that would give a power of equal
    uncertainty."""
    few: NDArray[np.bool_]
    """Mask of the unreliable errors: the largest particle contributes more than a tenth of the
    power, or there are fewer than two particles."""
    gates: Optional[Doubles] = None
    """Edges of the gates, in optical path length, (gates + 1,); ``None`` without gates."""
    unit: str = ""
    """Unit of the power."""
    _origin: Origin = dataclasses.field(init=False, default_factory=own_origin)

    def _estimate(self) -> Estimate:
        axes: Dict[str, Optional[Doubles]] = {"channel": None}
        if np.ndim(self.mean) == 2:
            axes = {"opl" if self.gates is not None else "gate": self.gates, **axes}
        made: Estimate = Estimate(self.mean, self.error, axes, self.unit, self.effective, self.few)._from(self._origin)
        return made

    def _from(self, origin: Origin) -> "Power":
        object.__setattr__(self, "_origin", origin)
        return self

    def __repr__(self) -> str:
        return repr(self._estimate()).replace("Estimate", "Power", 1)

    def _repr_html_(self) -> str:
        return html_of(self._estimate(), repr(self))


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Jacobian(Data, Fields):
    """Derivatives of the recorded power by the coefficients of the regions.

    Derivatives compute like a NumPy array of the axes ``coefficient`` (``"mu_a"``, ``"mu_s"``),
    ``region`` and ``channel``, with their errors: see :class:`Estimate`.

    Examples
    --------
    >>> rows = records.jacobian({"tissue": 10.0})
    >>> rows.sel(coefficient="mu_a", region="tissue") / 100
    """

    mu_a: Doubles
    """Derivatives by absorption coefficients at constant scattering, (regions, channels): minus the
    mean of power times path length."""
    mu_a_error: Doubles
    """Standard errors of ``mu_a``, of the same shape."""
    mu_s: Doubles
    """Derivatives by scattering coefficients at constant absorption, (regions, channels); NaN if
    μ_s is not given."""
    mu_s_error: Doubles
    """Standard errors of ``mu_s``, of the same shape."""
    regions: List[str] = dataclasses.field(default_factory=list)
    """Names of the regions, as in :class:`Records`."""
    unit: str = ""
    """Unit of the derivatives."""
    _origin: Origin = dataclasses.field(init=False, default_factory=own_origin)

    def _estimate(self) -> Estimate:
        mean, error = np.stack([self.mu_a, self.mu_s]), np.stack([self.mu_a_error, self.mu_s_error])
        names = {"coefficient": ["mu_a", "mu_s"], **({"region": self.regions} if self.regions else {})}
        made: Estimate = Estimate(mean, error, {"coefficient": None, "region": None, "channel": None}, self.unit, names=names)._from(self._origin)
        return made

    def _from(self, origin: Origin) -> "Jacobian":
        object.__setattr__(self, "_origin", origin)
        return self

    def __repr__(self) -> str:
        return f"<morgana.Jacobian of {len(self.mu_a)} regions>"
