"""Dispersion of optical glasses: see :class:`morgana.lens.Glass`."""

from __future__ import annotations

import difflib
from typing import Dict, NamedTuple, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _checks as checks
from ._numbers import numbers
from ._system import GradError

Doubles = NDArray[np.float64]

LINES = {"C": 656.2725, "d": 587.5618, "F": 486.1327}
"""Wavelengths of the Fraunhofer lines C, d and F in air, in nanometres."""


class Glass(NamedTuple):
    """Glass with the dispersion n² = 1 + Σ b λ²/(λ² − c), by Sellmeier.

    Indices of the built-in glasses are relative to air at 20 °C, as in catalogues. Use them in
    media around which the index of air is 1.

    Examples
    --------
    >>> bk7 = morgana.lens.glass("N-BK7")
    >>> bk7.n(587.5618)
    array(1.51680004)
    >>> mine = morgana.lens.Glass("mine", b=(1.04, 0.23, 1.01), c=(0.006, 0.02, 103.6))
    """

    name: str
    """Name, for messages."""
    b: Tuple[float, ...]
    """Strengths of the resonances, without a unit."""
    c: Tuple[float, ...]
    """Squares of the wavelengths of the resonances, as many as ``b``, in square micrometres."""
    source: str = ""
    """Origin of the coefficients."""

    def n(self, wavelength: ArrayLike) -> Doubles:
        """Refractive index.

        Parameters
        ----------
        wavelength : array_like
            Wavelengths in nanometres, > 0.

        Returns
        -------
        numpy.ndarray
            Indices, in the shape of ``wavelength``.

        Raises
        ------
        GradError
            Wavelengths that are not positive, or at which the formula has no positive index.

        Examples
        --------
        >>> morgana.lens.glass("F2").n([486.1, 587.6, 656.3])
        """
        micrometres = numbers(wavelength, "wavelength") / 1e3
        square = micrometres**2
        if len(self.b) != len(self.c):
            raise GradError(f"glass {self.name!r} has {len(self.b)} strengths b and {len(self.c)} squares c: give as many of each")
        if not (micrometres > 0).all():
            raise GradError(f"wavelength is {np.asarray(wavelength).tolist()!r:.80} but must be positive, in nanometres")
        with np.errstate(divide="ignore", invalid="ignore"):
            n2 = 1 + sum((b * square / (square - c) for b, c in zip(self.b, self.c)), np.zeros_like(square))
        if not (np.isfinite(n2) & (n2 > 0)).all():
            raise GradError(f"glass {self.name!r} has no index at {np.asarray(wavelength).tolist()!r:.80} nm: the formula has a resonance there")
        return np.asarray(np.sqrt(n2))

    @property
    def abbe_number(self) -> float:
        """Abbe number (n_d − 1)/(n_F − n_C)."""
        c, d, f = self.n(list(LINES.values()))
        return float((d - 1) / (f - c))

    @staticmethod
    def model(n_d: float, abbe_number: float) -> "Glass":
        """Glass with a given index and Abbe number, and one resonance.

        Parameters
        ----------
        n_d : float
            Index at 587.5618 nm, > 1.
        abbe_number : float
            Abbe number (n_d − 1)/(n_F − n_C), > 2.

        Returns
        -------
        Glass
            The glass. Between the lines C and F its index is that of common glasses to about 1e-4.

        Raises
        ------
        GradError
            Numbers outside their ranges.

        Examples
        --------
        >>> morgana.lens.Glass.model(1.5168, 64.17)
        """
        index, abbe = checks.positive(n_d, "n_d"), checks.positive(abbe_number, "abbe_number")
        if index <= 1 or abbe <= 2:
            raise GradError(f"a model glass needs n_d > 1 and an Abbe number > 2, but has {n_d} and {abbe_number}")
        square = (LINES["d"] / 1e3) ** 2

        def made(c: float) -> "Glass":
            return Glass(f"{n_d:g}/{abbe_number:g}", ((index**2 - 1) * (1 - c / square),), (c,), "model of n_d and the Abbe number")

        low, high = 0.0, (LINES["F"] / 1e3) ** 2 * (1 - 1e-9)
        for _ in range(100):
            c = (low + high) / 2
            low, high = (c, high) if made(c).abbe_number > abbe else (low, c)
        return made((low + high) / 2)


SCHOTT = "SCHOTT, Optical Glass data sheets"
MALITSON = "I. H. Malitson, J. Opt. Soc. Am. 55, 1205 (1965)"
SULTANOVA = "N. Sultanova et al., Acta Physica Polonica A 116, 585 (2009)"

_TABLE = [
    Glass("N-BK7", (1.03961212, 0.231792344, 1.01046945), (0.00600069867, 0.0200179144, 103.560653), SCHOTT),
    Glass("N-BAK4", (1.28834642, 0.132817724, 0.945395373), (0.00779980626, 0.0315631177, 105.965875), SCHOTT),
    Glass("N-SK16", (1.34317774, 0.241144399, 0.994317969), (0.00704687339, 0.0229005, 92.7508526), SCHOTT),
    Glass("N-BAF10", (1.5851495, 0.143559385, 1.08521269), (0.00926681282, 0.0424489805, 105.613573), SCHOTT),
    Glass("N-LAK22", (1.14229781, 0.535138441, 1.04088385), (0.00585778594, 0.0198546147, 100.834017), SCHOTT),
    Glass("F2", (1.34533359, 0.209073176, 0.937357162), (0.00997743871, 0.0470450767, 111.886764), SCHOTT),
    Glass("N-F2", (1.39757037, 0.159201403, 1.2686543), (0.00995906143, 0.0546931752, 119.248346), SCHOTT),
    Glass("SF2", (1.40301821, 0.231767504, 0.939056586), (0.0105795466, 0.0493226978, 112.405955), SCHOTT),
    Glass("SF5", (1.46141885, 0.247713019, 0.949995832), (0.0111826126, 0.0508594669, 112.041888), SCHOTT),
    Glass("N-SF5", (1.52481889, 0.187085527, 1.42729015), (0.011254756, 0.0588995392, 129.141675), SCHOTT),
    Glass("N-SF6", (1.77931763, 0.338149866, 2.08734474), (0.0133714182, 0.0617533621, 174.01759), SCHOTT),
    Glass("N-SF10", (1.62153902, 0.256287842, 1.64447552), (0.0122241457, 0.0595736775, 147.468793), SCHOTT),
    Glass("SF11", (1.73848403, 0.311168974, 1.17490871), (0.0136068604, 0.0615960463, 121.922711), SCHOTT),
    Glass("N-SF11", (1.73759695, 0.313747346, 1.89878101), (0.013188707, 0.0623068142, 155.23629), SCHOTT),
    Glass("N-LASF9", (2.00029547, 0.298926886, 1.80691843), (0.0121426017, 0.0538736236, 156.530829), SCHOTT),
    Glass("SILICA", (0.6961663, 0.4079426, 0.8974794), (0.0684043**2, 0.1162414**2, 9.896161**2), MALITSON),
    Glass("CAF2", (0.5675888, 0.4710914, 3.8484723), (0.050263605**2, 0.1003909**2, 34.649040**2), "I. H. Malitson, Appl. Opt. 2, 1103 (1963)"),
    Glass("PMMA", (1.1819,), (0.011313,), SULTANOVA),
    Glass("POLYCARB", (1.4182,), (0.021304,), SULTANOVA),
    Glass("POLYSTYR", (1.4435,), (0.020216,), SULTANOVA),
]
GLASSES: Dict[str, Glass] = {glass.name: glass for glass in _TABLE}
"""Built-in glasses by their names."""

OTHER_NAMES = {"BK7": "N-BK7", "F_SILICA": "SILICA", "FUSED SILICA": "SILICA", "FUSED_SILICA": "SILICA", "ACRYLIC": "PMMA"}
"""Common names of built-in glasses. BK7 has the coefficients of N-BK7."""


def glass(name: str) -> Glass:
    """Built-in glass.

    The names are N-BK7, N-BAK4, N-SK16, N-BAF10, N-LAK22, F2, N-F2, SF2, SF5, N-SF5, N-SF6, N-SF10,
    SF11, N-SF11, N-LASF9, SILICA, CAF2, PMMA, POLYCARB and POLYSTYR.

    Parameters
    ----------
    name : str
        Name of the glass, in any case.

    Returns
    -------
    Glass
        The glass, with the source of its coefficients.

    Raises
    ------
    GradError
        Unknown name.

    Examples
    --------
    >>> morgana.lens.glass("N-BK7").abbe_number
    """
    key = str(name).strip().upper()
    found = GLASSES.get(OTHER_NAMES.get(key, key))
    if found is None:
        close = difflib.get_close_matches(key, [*GLASSES, *OTHER_NAMES], n=3, cutoff=0.4)
        hint = f"close names are {', '.join(close)}" if close else f"known are {', '.join(GLASSES)}"
        raise GradError(f"no glass {name!r}: {hint}. For another glass, give an index or a morgana.lens.Glass with its coefficients")
    return found
