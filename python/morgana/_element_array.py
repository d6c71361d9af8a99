"""Ultrasound arrays by their elements: see :class:`morgana.grad.ElementArray`."""

from __future__ import annotations

from typing import Any, Dict, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _checks as checks
from . import _morgana
from ._morgana import Field
from ._numbers import numbers
from ._system import GradError
from ._values import alike

Doubles = NDArray[np.float64]
Complexes = NDArray[np.complex128]

APERTURES = ("linear_array", "ring_array")


class ElementArray:
    """The sound of an ultrasound array as a differentiable function of its elements.

    Each element has an amplitude and a phase.

    The sound of each element is computed once, on the grid of the ``transducer``. The sound of the
    array is the sum of the sounds of the elements, each multiplied by a complex weight. The modulus
    of the weight is the element's apodization, and its angle the element's phase.

    Parameters
    ----------
    volume : dict
        A volume of type ``transducer`` as in scenes, with the aperture ``linear_array`` or
        ``ring_array``, without ``to_world``. Its focus, delays and apodization are ignored.

    Raises
    ------
    GradError
        Another type of volume.
    SceneError
        Parameters that are missing or out of range.

    Examples
    --------
    >>> array = morgana.grad.ElementArray({"type": "transducer", "aperture": "linear_array", "elements": 16, **of_water})
    >>> lens = array.field(np.exp(1j * phases))
    >>> by = rays.vjp(lens, positions=residual).parameters["amplitude"]
    >>> array.by_phases(np.exp(1j * phases), by)
    """

    def __init__(self, volume: Mapping[str, Any]) -> None:
        alone = checks.mapping(volume, "a volume")
        if alone.get("type") != "transducer" or alone.get("aperture") not in APERTURES:
            raise GradError(f"expected a volume of type 'transducer' with one of the apertures {', '.join(APERTURES)}")
        if "to_world" in alone:
            raise GradError("an ElementArray has no to_world: place origin, direction, min and max")
        for name in ("focus", "delays", "apodization"):
            alone.pop(name, None)
        count = checks.whole(alone.get("elements"), "elements", 1)
        sounds = []
        for element in range(count):
            parameters = dict(_morgana.load_field({**alone, "apodization": [float(i == element) for i in range(count)]})._parameters())
            found = parameters["amplitude"]
            sounds.append(found[..., 0] + 1j * found[..., 1])
        self._volume = alone
        self._amplitudes = np.array(sounds)

    @property
    def amplitudes(self) -> Complexes:
        """Complex amplitudes A of the index for the sound of each element.

        The shape is (elements, nz, ny, nx), and n = n₀ + Re(A e^{iωt})."""
        return self._amplitudes

    @property
    def positions(self) -> Doubles:
        """Positions of the samples, (nz, ny, nx, 3), in scene units."""
        low, high = (np.asarray(self._volume[name], float) for name in ("min", "max"))
        axes = [np.linspace(a, b, n) for a, b, n in zip(low, high, self._amplitudes.shape[:0:-1])]
        z, y, x = np.meshgrid(*axes[::-1], indexing="ij")
        return np.stack([x, y, z], axis=-1)

    def amplitude(self, weights: ArrayLike) -> Complexes:
        """Complex amplitude of the index for the sound of all elements.

        Parameters
        ----------
        weights : array_like of complex, (elements,)
            Factors on the sound of each element.

        Returns
        -------
        numpy.ndarray
            Amplitudes, (nz, ny, nx).
        """
        return np.asarray(np.tensordot(self._weights(weights), self._amplitudes, 1))

    def field(self, weights: ArrayLike) -> Field:
        """The index for the sound of all elements at the instant t = 0.

        The field is for :meth:`Rays.forward`, and for scenes as a volume.

        Parameters
        ----------
        weights : array_like of complex, (elements,)
            As for :meth:`amplitude`.

        Returns
        -------
        Field
            Field whose parameter ``amplitude`` contains the amplitudes of the samples.
        """
        return _morgana.load_field(self.volume(weights))

    def volume(self, weights: ArrayLike) -> Dict[str, Any]:
        """The index for the sound of all elements as a volume for scenes, of type ``pressure``.

        Parameters
        ----------
        weights : array_like of complex, (elements,)
            As for :meth:`amplitude`.

        Returns
        -------
        dict
            Dictionary for ``load_field`` and scenes.
        """
        given = self._volume
        low, high = (np.asarray(given[name], float) for name in ("min", "max"))
        kept: Dict[str, Any] = {name: given[name] for name in ("frequency", "sound_speed", "n0", "dn_dp", "elasto_optic") if name in given}
        cube = [{"scale": (high - low).tolist()}, {"translate": low.tolist()}]
        return {"type": "pressure", "data": self.amplitude(weights) / given["dn_dp"], "placement": "nodes", "to_world": cube, **kept}

    def by_weights(self, by_amplitude: ArrayLike) -> Complexes:
        """Derivatives of a loss by the weights, from derivatives by the amplitudes.

        Parameters
        ----------
        by_amplitude : array_like, (nz, ny, nx) of complex or (nz, ny, nx, 2)
            Derivatives by real and imaginary parts, as in :attr:`Gradient.parameters`.

        Returns
        -------
        numpy.ndarray of complex, (elements,)
            Derivatives by the real parts of the weights as real parts, and by the imaginary parts
            as imaginary parts.
        """
        by = np.asarray(by_amplitude)
        shape = self._amplitudes.shape[1:]
        if not np.iscomplexobj(by) and by.shape == (*shape, 2):
            by = by[..., 0] + 1j * by[..., 1]
        if by.shape != shape or not np.isfinite(by).all():
            raise GradError(f"derivatives by amplitudes have the shape {by.shape} but must be finite numbers of shape {(*shape, 2)}")
        return np.asarray(np.tensordot(self._amplitudes.conj(), by, 3))

    def by_phases(self, weights: ArrayLike, by_amplitude: ArrayLike) -> Doubles:
        """Derivatives of a loss by the phases of the elements, from derivatives by the amplitudes.

        Parameters
        ----------
        weights : array_like of complex, (elements,)
            As for :meth:`amplitude`.
        by_amplitude : array_like, (nz, ny, nx) of complex or (nz, ny, nx, 2)
            As for :meth:`by_weights`.

        Returns
        -------
        numpy.ndarray
            Derivatives, (elements,), per radian.
        """
        return np.asarray(np.imag(self._weights(weights).conj() * self.by_weights(by_amplitude)))

    def _weights(self, weights: ArrayLike) -> Complexes:
        given = numbers(weights, "weights", complex) if not np.iscomplexobj(weights) else np.asarray(weights)
        if given.shape != (len(self._amplitudes),) or not np.isfinite(given).all():
            raise GradError(f"weights have the shape {given.shape} but must be finite numbers of shape {(len(self._amplitudes),)}")
        return given.astype(complex)

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return alike(self.__dict__, other.__dict__)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        count, nz, ny, nx = self._amplitudes.shape
        return f"<morgana.grad.ElementArray of {count} elements on {nz} x {ny} x {nx} samples>"
