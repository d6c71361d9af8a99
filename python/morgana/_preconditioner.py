"""Preconditioner of reconstructions, and imports of SciPy."""

from __future__ import annotations

import importlib
from typing import Any, Tuple

import numpy as np
from numpy.typing import NDArray

from ._errors import Error
from ._extras import advice

Doubles = NDArray[np.float64]


class ReconstructionError(Error, ValueError):
    """A reconstruction that cannot be done as requested."""


class Filter:
    """Symmetric filter of samples that makes the Hessian of χ² and of penalties on slopes closer to
    the identity.

    For deflections, the Hessian of waves grows in proportion to their wave number."""

    def __init__(self, shape: Tuple[int, ...], spacing: Doubles) -> None:
        self.fft = scipy("scipy.fft")
        lengths = [step * n for step, n in zip(spacing[::-1], shape)]
        numbers = [max(lengths) / length * np.arange(n) for n, length in zip(shape, lengths)]
        waves = np.meshgrid(*numbers, indexing="ij", sparse=True)
        self.weights = 1 / (1 + np.sqrt(sum(np.square(wave) for wave in waves)))

    def __call__(self, values: Doubles) -> Doubles:
        return np.asarray(self.fft.idctn(self.weights * self.fft.dctn(values, norm="ortho"), norm="ortho"))


def scipy(module: str) -> Any:
    """Imports a module of SciPy."""
    try:
        return importlib.import_module(module)
    except ImportError:
        raise ReconstructionError(f"reconstructions need SciPy: {advice('reconstruct')}") from None
