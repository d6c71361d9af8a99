"""Quadrature over the exposure of a camera, for light with fluctuations that may be much faster
than the exposure."""

from __future__ import annotations

from typing import Callable, Iterator, Tuple

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

NODES = 8
"""Number of Gauss nodes of a panel, which integrate exponentials and Gaussians over an octave of
delays to 1e-9."""
OCTAVES = 64
"""Maximum number of halvings of the exposure: an exposure of 1e19 correlation times has no contrast
left."""
STILL = 0.1
"""Decay or phase below which panels need not be shorter."""
TURN = 3 * np.pi
"""Phase that a panel of `NODES` nodes resolves to 1e-4 of the amplitude."""


def panels(exposure: float, fastest: Callable[[Doubles], Doubles], spread: float, most: int) -> Iterator[Tuple[Doubles, Doubles]]:
    """Yields delays in (0, exposure) and their weights in ∫ f dτ, panel by panel.

    The first interval goes from 0 to a delay at which light has hardly changed: ``fastest`` returns
    the largest decay or phase at given delays. Each further interval is an octave, from a delay to
    twice this delay. An interval is one panel, or is divided into up to ``most`` panels of equal
    length, each short enough for phases that diverge by ``spread`` per second.
    """
    octaves = exposure * 0.5 ** np.arange(OCTAVES, -1, -1.0)
    changed = np.append(fastest(octaves) > STILL, True)
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    edges = np.append(0.0, octaves[max(int(np.argmax(changed)) - 1, 0) :])
    for begin, end in zip(edges[:-1], edges[1:]):
        parts = int(np.clip(np.ceil(spread * (end - begin) / TURN), 1, most))
        # Substitute τ = u²: g₁ of diffusing scatterers is smooth in the root of the delay.
        roots = np.sqrt(np.linspace(begin, end, parts + 1))
        for low, high in zip(roots[:-1], roots[1:]):
            root = low + (high - low) * (nodes + 1) / 2
            yield root**2, (high - low) * weights * root
