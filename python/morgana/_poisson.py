"""Integration of deflections: the path-integrated index from the deflections of one view."""

from __future__ import annotations

from typing import Any, List, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _checks as checks
from ._numbers import numbers
from ._preconditioner import ReconstructionError, scipy
from ._values import comparable

__all__ = ["PathDifference", "integrate"]

Doubles = NDArray[np.float64]
Bools = NDArray[np.bool_]


@comparable
class PathDifference(NamedTuple):
    """Path-integrated index of one view: result of :func:`integrate`."""

    values: Doubles
    """∫(n − n₀) ds, (height, width), in scene units. NaN where no deflection connects a pixel to a
    reference."""
    deviation: Doubles
    """Standard deviation of ``values`` due to noise, (height, width). Errors of neighbours are
    correlated."""

    def __repr__(self) -> str:
        height, width = self.values.shape
        return f"<morgana.reconstruct.PathDifference of {width} × {height}: {np.nanmin(self.values):.4g} to {np.nanmax(self.values):.4g}>"


def integrate(
    deflections: ArrayLike,
    *,
    spacing: Union[float, Tuple[float, float]],
    noise: ArrayLike,
    reference: Optional[ArrayLike] = None,
    ambient: float = 1.0,
    draws: int = 64,
    seed: int = 0,
) -> PathDifference:
    """Path-integrated index from deflections, by least squares (Poisson's equation).

    For straight rays, n₀ ε is the gradient of ∫(n − n₀) ds across the rays. Differences of
    neighbouring pixels are fitted to the mean deflection of both. Use it to see a flow at once, and
    as optical lengths for tomography with weak flows.

    Parameters
    ----------
    deflections : array_like, (height, width, 2)
        Deflections ε in radians, to the right and downwards. NaN if unknown.
    spacing : float or two of float
        Distance of neighbouring pixels in the plane of the flow, in scene units, > 0: one, or one
        to the right and one downwards.
    noise : float or array_like, (height, width)
        Standard deviation of each component of the deflections, in radians, > 0.
    reference : array_like of bool, (height, width), optional
        Mask of the pixels that see no flow: their mean is 0. Gradients do not determine a constant.
        By default, the pixels at the edge of the image.
    ambient : float, optional
        Index n₀ around the flow, > 0.
    draws : int, optional
        Number of simulated noises, 2 or more, from which ``deviation`` is estimated. It has a
        relative standard error of 1/√(2 draws).
    seed : int, optional
        Seed of the simulated noises.

    Returns
    -------
    PathDifference
        The integral with its standard deviation.

    Raises
    ------
    ReconstructionError
        Shapes that do not match, numbers out of range, or no known deflections. SciPy is missing.

    Examples
    --------
    >>> found = morgana.reconstruct.integrate(np.zeros((6, 8, 2)), spacing=0.1, noise=1e-6)
    >>> found.values, found.deviation
    """
    moved, sigma = numbers(deflections, "deflections"), numbers(noise, "noise")
    if moved.ndim != 3 or moved.shape[2] != 2 or min(moved.shape) < 2:
        raise ReconstructionError(f"deflections have the shape {moved.shape} but must have (height, width, 2), of at least 2 × 2 pixels")
    shape = moved.shape[:2]
    if sigma.shape not in ((), shape):
        raise ReconstructionError(f"noise has the shape {sigma.shape} but must be one number, or have the shape {shape}")
    known = np.isfinite(moved).all(axis=2)
    sigma = np.where(known, sigma, 1.0)
    if not (np.isfinite(sigma) & (sigma > 0)).all():
        raise ReconstructionError("noise must be positive numbers, in radians")
    checks.whole(draws, "draws", 2)
    steps = [checks.positive(step, "spacing") for step in np.broadcast_to(numbers(spacing, "spacing"), (2,))]
    n0 = checks.positive(ambient, "ambient")
    solver = _Solver(known, _reference(reference, known), [n0 * step for step in steps])
    values = solver(moved)
    rng = np.random.default_rng(seed)
    squares = sum(np.square(solver(sigma[..., None] * rng.normal(size=moved.shape))) for _ in range(draws))
    return PathDifference(values, np.sqrt(squares / draws))


def _reference(reference: Optional[ArrayLike], known: Bools) -> Bools:
    if reference is None:
        found = np.ones(known.shape, bool)
        found[1:-1, 1:-1] = False
    else:
        found = np.asarray(reference)
        if found.dtype != bool or found.shape != known.shape:
            raise ReconstructionError(f"reference has the shape {found.shape} and type {found.dtype} but must be {known.shape} of bool")
    if not (found & known).any():
        raise ReconstructionError("no pixel with a known deflection is a reference: mark pixels that see no flow")
    return found & known


class _Solver:
    """Least-squares integration on the known pixels that are connected to a reference."""

    def __init__(self, known: Bools, reference: Bools, steps: List[float]) -> None:
        sparse, label = scipy("scipy.sparse"), scipy("scipy.ndimage").label
        parts, _ = label(known)
        self.used = np.isin(parts, np.unique(parts[reference]))
        self.parts, self.reference, self.steps = np.where(self.used, parts, 0), reference, steps
        number = np.cumsum(self.used.ravel()).reshape(known.shape) - 1
        ends = [(number[:, :-1], number[:, 1:], self.used[:, :-1] & self.used[:, 1:]), (number[:-1], number[1:], self.used[:-1] & self.used[1:])]
        differences: List[Any] = []
        for first, second, both in ends:
            count = int(both.sum())
            rows = np.tile(np.arange(count), 2)
            entries = np.repeat([-1.0, 1.0], count)
            differences.append(sparse.csr_matrix((entries, (rows, np.r_[first[both], second[both]])), shape=(count, int(self.used.sum()))))
        self.both = [both for _, _, both in ends]
        self.scaled = [difference / step for difference, step in zip(differences, steps)]
        # Fix the constant of each connected part; its mean over the reference is subtracted later.
        anchors = np.array([np.flatnonzero(self.parts[self.used] == part)[0] for part in np.unique(self.parts[self.used])])
        normal = sum(scaled.T @ scaled for scaled in self.scaled)
        fixed = sparse.csr_matrix((np.ones(len(anchors)), (anchors, anchors)), shape=normal.shape)
        scale = 1 / min(steps) ** 2
        self.solve = scipy("scipy.sparse.linalg").splu((normal + scale * fixed).tocsc()).solve

    def __call__(self, moved: Doubles) -> Doubles:
        """Returns ∫(n − n₀) ds; NaN for pixels that are not used."""
        means = ((moved[:, :-1, 0] + moved[:, 1:, 0]) / 2, (moved[:-1, :, 1] + moved[1:, :, 1]) / 2)
        right = sum(scaled.T @ mean[both] for scaled, mean, both in zip(self.scaled, means, self.both))
        found = np.full(moved.shape[:2], np.nan)
        found[self.used] = self.solve(right)
        for part in np.unique(self.parts[self.used]):
            inside = self.parts == part
            found[inside] -= found[inside & self.reference].mean()
        return found
