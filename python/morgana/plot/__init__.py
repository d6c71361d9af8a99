"""Figures by Matplotlib: ``pip install ".[plot]"`` in a clone of morgana.

    >>> from morgana import plot
    >>> plot.image(result)
    >>> plot.profile(result, "column", row=24)
    >>> plot.slice(measured.meters["fluence"], "xz", y=0, unit="mm")

Every function draws in ``ax``, by default the current axes of pyplot, and returns Matplotlib's
artist. The artist's ``axes`` and ``figure`` contain it. Names of coordinates (``row``, ``x``,
``opl``) select the position of a cut. Error bars and bands show one standard error to either side.

``unit`` is the name of the scene's unit of length, such as ``"mm"``, for labels.
"""

from .._extras import advice as _advice

try:
    import matplotlib as _matplotlib  # noqa: F401
except ImportError as missing:
    raise ImportError(f"morgana.plot needs Matplotlib: {_advice('plot')}") from missing

from ._curves import histogram, profile
from ._lens import fan, lens, modulation
from ._maps import field, image, slice
from ._rays import rays, spots
from ._table import PlotError, Source

__all__ = ["PlotError", "Source", "fan", "field", "histogram", "image", "lens", "modulation", "profile", "rays", "slice", "spots"]
