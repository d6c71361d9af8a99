"""Posterior distribution of samples, given data: see :func:`morgana.reconstruct.posterior`."""

from __future__ import annotations

from typing import Any, Dict, List, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _penalties as penalties
from ._conjugate import ConjugateDirections, Operator
from ._losses import column
from ._numbers import grid_samples
from ._preconditioner import Filter, ReconstructionError
from ._values import alike
from ._ray_bundle import Rays

Doubles = NDArray[np.float64]

RESIDUAL = 1e-5
"""Relative residual at which conjugate gradients stop."""
MAX_PRODUCTS = 2000
"""Maximum number of products with the precision for one solution."""


class Posterior:
    """Gaussian distribution of the samples of an index, given data.

    It is linearised about the samples of the reconstruction: ends of rays depend linearly on the
    samples.

    Its precision, the inverse of the covariance, is JᵀJ/σ² plus the precision of the prior. J is
    the Jacobian, and σ the noise of the data. No matrix is stored: a product with the precision
    takes one :meth:`morgana.grad.Rays.jvp` and one :meth:`morgana.grad.Rays.vjp`, and conjugate
    gradients apply the covariance. :func:`posterior` makes this object.
    """

    def __init__(
        self, rays: Rays, index: Doubles, noise: Dict[str, Tuple[Union[float, Doubles], NDArray[np.bool_]]], free: NDArray[np.bool_], prior: Tuple[float, float]
    ) -> None:
        self._rays, self._index, self._free = rays, index, free
        self._per_noise = {name: np.where(known, 1 / np.where(known, sigma, 1.0), 0.0) for name, (sigma, known) in noise.items()}
        self._smoothness, self._per_variance = prior
        self._solver: Optional[ConjugateDirections] = None

    def precision(self, change: ArrayLike) -> Doubles:
        """Product of the precision and a vector.

        Parameters
        ----------
        change : array_like, (nz, ny, nx)
            The vector: a change of the samples. Changes of known samples count as zero.

        Returns
        -------
        numpy.ndarray
            The product, (nz, ny, nx).
        """
        change = np.where(self._free, self._checked(change), 0.0)
        ends = self._rays.jvp(self._index, change)
        by = {}
        for name, per_noise in self._per_noise.items():
            values = getattr(ends, name)
            per_noise = column(per_noise, values.ndim)
            by[name] = np.where(per_noise > 0, values, 0.0) * per_noise**2
        found = self._rays.vjp(self._index, **by).field
        roughness = penalties.roughness(change, penalties.lattice_of(self._rays, change.shape))[1]
        found = found + self._smoothness * roughness + self._per_variance * change
        return np.where(self._free, found, 0.0)

    def covariance(self, vector: ArrayLike) -> Doubles:
        """Product of the covariance and a vector.

        The variance of wᵀn, a weighted sum of samples, is ``np.sum(w * posterior.covariance(w))``.

        Parameters
        ----------
        vector : array_like, (nz, ny, nx)
            The vector.

        Returns
        -------
        numpy.ndarray
            The product, (nz, ny, nx); zero for known samples.

        Raises
        ------
        ReconstructionError
            Conjugate gradients do not converge.
        """
        given = self._checked(vector)
        if self._solver is None:
            filtered = Filter(self._free.shape, self._rays.spacing(self._free.shape))
            self._solver = ConjugateDirections(self._of_free(self.precision), self._of_free(filtered), int(np.count_nonzero(self._free)))
        found = self._solver.solve(given[self._free], RESIDUAL, MAX_PRODUCTS)
        if found is None:
            raise ReconstructionError(
                f"the covariance is not found in {MAX_PRODUCTS} products: rays and noise leave directions almost open; "
                "give more smoothness, or a smaller prior_deviation"
            )
        return self._spread(found)

    def sample(self, rng: np.random.Generator) -> Doubles:
        """Draw a change of the samples from the distribution.

        Parameters
        ----------
        rng : numpy.random.Generator
            Generator of random numbers.

        Returns
        -------
        numpy.ndarray
            The change, (nz, ny, nx), of mean zero.

        Raises
        ------
        ReconstructionError
            Conjugate gradients do not converge.
        """
        # Apply the covariance to noise whose covariance is the precision.
        by = {}
        for name, per_noise in self._per_noise.items():
            size = (len(per_noise),) if name == "optical_lengths" else (len(per_noise), 3)
            by[name] = rng.normal(size=size) * column(per_noise, len(size))
        shape = self._index.shape
        pushed = self._rays.vjp(self._index, **by).field
        pushed = pushed + np.sqrt(self._smoothness) * penalties.rough_noise(shape, penalties.lattice_of(self._rays, shape), rng)
        return self.covariance(pushed + np.sqrt(self._per_variance) * rng.normal(size=shape))

    def deviation(self, draws: int = 32, seed: int = 0) -> Doubles:
        """Estimate the standard deviation of each sample.

        Parameters
        ----------
        draws : int, optional
            Number of draws from the distribution, 2 or more: the estimate has a relative standard
            error of 1/√(2 draws).
        seed : int, optional
            Seed of the draws.

        Returns
        -------
        numpy.ndarray
            Standard deviations, (nz, ny, nx); zero for known samples.

        Raises
        ------
        ReconstructionError
            Conjugate gradients do not converge.
        """
        if draws < 2:
            raise ReconstructionError(f"draws is {draws} but must be at least 2")
        rng = np.random.default_rng(seed)
        found: List[Doubles] = [self.sample(rng) for _ in range(draws)]
        # Use that the mean is zero.
        return np.asarray(np.sqrt(np.mean(np.square(found), axis=0)))

    def _of_free(self, operator: Operator) -> Operator:
        """Restricts an operator to the numbers of free samples."""
        return lambda values: np.asarray(operator(self._spread(values))[self._free])

    def _spread(self, values: Doubles) -> Doubles:
        """Returns numbers of the free samples on the whole grid, with zeros elsewhere."""
        whole = np.zeros(self._free.shape)
        whole[self._free] = values
        return whole

    def _checked(self, vector: ArrayLike) -> Doubles:
        found = grid_samples(vector, "a change of the samples")
        if found.shape != self._index.shape or not np.isfinite(found).all():
            raise ReconstructionError(f"a change of the samples has the shape {found.shape} but must be finite numbers of shape {self._index.shape}")
        return found

    def __getstate__(self) -> Dict[str, Any]:
        # Omit the solver: it only makes later solutions faster.
        return {**self.__dict__, "_solver": None}

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Posterior):
            return NotImplemented
        return alike(self.__getstate__(), other.__getstate__())

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<morgana.reconstruct.Posterior of {np.count_nonzero(self._free)} samples in {self._index.shape}, given {len(self._rays)} rays>"
