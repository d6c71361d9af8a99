"""Solver of Ax = b for one symmetric positive operator A and a sequence of b."""

from __future__ import annotations

from typing import Callable, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["ConjugateDirections", "Operator"]

Doubles = NDArray[np.float64]
Operator = Callable[[Doubles], Doubles]

BYTES = 256 << 20
"""Maximum memory for stored directions and their images under the operator, bytes."""
FIRST = 64
"""Number of directions that are allocated initially."""


class ConjugateDirections:
    """Preconditioned conjugate gradients that keep all earlier directions for deflation (Saad et
    al. 2000).

    Each solution starts from the best combination of earlier directions, and continues conjugate to
    them. All solutions together therefore need at most as many directions as there are unknowns, if
    memory suffices.
    """

    def __init__(self, operator: Operator, precondition: Operator, size: int) -> None:
        self.operator, self.precondition, self.size = operator, precondition, size
        self.most = min(size, max(1, BYTES // (16 * size)))
        self.count = 0
        self.directions, self.images = (np.empty((min(FIRST, self.most), size)) for _ in range(2))

    def solve(self, b: Doubles, residual: float, products: int) -> Optional[Doubles]:
        """Returns x with \\|Ax − b\\| at most ``residual`` times \\|b\\|; ``None`` if this takes
        more than ``products`` products with A."""
        x, left = np.zeros(self.size), b
        share = self.directions[: self.count] @ left
        x, left = x + share @ self.directions[: self.count], left - share @ self.images[: self.count]
        last: Optional[Tuple[Doubles, Doubles]] = None
        goal = residual * float(np.linalg.norm(b))
        for _ in range(products):
            if np.linalg.norm(left) <= goal:
                return x
            direction = self._conjugate(self.precondition(left), last)
            image = self.operator(direction)
            curvature = float(direction @ image)
            if curvature <= 0:
                return None
            direction, image = direction / np.sqrt(curvature), image / np.sqrt(curvature)
            step = float(direction @ left)
            x, left = x + step * direction, left - step * image
            last = None if self._keep(direction, image) else (direction, image)
        return x if np.linalg.norm(left) <= goal else None

    def _conjugate(self, direction: Doubles, last: Optional[Tuple[Doubles, Doubles]]) -> Doubles:
        """Returns the part of a direction that is conjugate to the stored directions, and to the
        last."""
        # Repeat the projection, to reduce round-off.
        for _ in range(2):
            direction = direction - (self.images[: self.count] @ direction) @ self.directions[: self.count]
            if last is not None:
                direction = direction - float(last[1] @ direction) * last[0]
        return direction

    def _keep(self, direction: Doubles, image: Doubles) -> bool:
        """Stores a direction of unit curvature. Returns False if there is no memory for it."""
        if self.count == self.most:
            return False
        if self.count == len(self.directions):
            rows = min(2 * self.count, self.most)
            self.directions, self.images = (np.concatenate([kept, np.empty((rows - self.count, self.size))]) for kept in (self.directions, self.images))
        self.directions[self.count], self.images[self.count] = direction, image
        self.count += 1
        return True
