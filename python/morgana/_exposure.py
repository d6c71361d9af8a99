"""Quadrature over the exposure of a camera, where light may fluctuate much faster than the exposure lasts."""

from __future__ import annotations

from typing import Callable, Iterator, Tuple

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

NODES = 8
"""Gauss's nodes of a panel: exponentials and Gaussians over an octave of delays are then right to 1e-9."""
OCTAVES = 64
"""Halvings of the exposure at most: an exposure of 1e19 correlation times has no contrast left."""
STILL = 0.1
"""Below this decay or phase, panels need not be shorter."""
TURN = 3 * np.pi
"""Phase that a panel of `NODES` nodes resolves to 1e-4 of the amplitude."""


def panels(exposure: float, fastest: Callable[[Doubles], Doubles], spread: float, most: int) -> Iterator[Tuple[Doubles, Doubles]]:
    """Delays in (0, exposure) and their weights in ∫ f dτ, panel by panel.

    Panels double in length, from delays on at which nothing has changed yet: ``fastest`` says by delay how much has, the largest decay or
    phase. Where phases turn apart by ``spread`` per second, octaves are divided so that panels resolve it, into ``most`` panels at most.
    """
    octaves = exposure * 0.5 ** np.arange(OCTAVES, -1, -1.0)
    changed = np.append(fastest(octaves) > STILL, True)
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    edges = np.append(0.0, octaves[max(int(np.argmax(changed)) - 1, 0) :])
    for begin, end in zip(edges[:-1], edges[1:]):
        parts = int(np.clip(np.ceil(spread * (end - begin) / TURN), 1, most))
        # τ = u²: g₁ of diffusing scatterers is smooth in the root of the delay.
        roots = np.sqrt(np.linspace(begin, end, parts + 1))
        for low, high in zip(roots[:-1], roots[1:]):
            root = low + (high - low) * (nodes + 1) / 2
            yield root**2, (high - low) * weights * root
