"""Data of background-oriented schlieren for reconstructions."""

from __future__ import annotations

import os
from typing import Any, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _checks as checks
from ._calibration import read_vectors
from ._camera import Camera
from ._morgana import Scene
from ._numbers import numbers
from ._ray_bundle import Rays
from ._system import GradError, Plane, finite, unit
from ._values import comparable

__all__ = ["BosData"]

Doubles = NDArray[np.float64]

PLACES = {"still": 0.0, "middle": 0.5, "flow": 1.0}
"""Position of a vector between the pixel of the still picture and the pixel with the flow."""


@comparable
class BosData(NamedTuple):
    """Rays of cameras, and the positions on their backgrounds that measured displacements imply.

    Data for :func:`morgana.reconstruct.fit`: the arguments ``rays``, ``positions`` and
    ``position_noise``.
    """

    rays: Rays
    """:class:`morgana.grad.Rays` of the pixels with a displacement. They end on the background."""
    positions: Doubles
    """Measured positions of the ends, (rays, 3), in scene units."""
    position_noise: Doubles
    """Standard deviations of the components of ``positions``, (rays,), in scene units."""
    pixels: Doubles
    """Pixels of the rays in the picture with the flow, (column, row), (rays, 2)."""

    @classmethod
    def of_camera(
        cls,
        sensor: Union[Camera, Scene],
        displacement: ArrayLike,
        *,
        background: Plane,
        noise: ArrayLike,
        box: Tuple[ArrayLike, ArrayLike],
        pixels: Optional[ArrayLike] = None,
        mask: Optional[ArrayLike] = None,
        at: str = "flow",
        lens: int = 1,
        ambient: float = 1.0,
        placement: str = "nodes",
        tolerance: float = 1e-6,
    ) -> "BosData":
        """Data of one camera.

        A pixel p with the displacement d shows the point of the background that the pixel p − d
        shows without the flow. The straight ray of p − d therefore gives the measured end of the
        ray of p.

        Parameters
        ----------
        sensor : Camera or Scene
            The camera, or a scene with one.
        displacement : array_like, (height, width, 2) or (..., 2)
            Displacements of the background by the flow, in pixels to the right and downwards, as
            :attr:`morgana.schlieren.Bos.displacement`. NaN if unknown.
        background : Plane
            Plane of the pattern.
        noise : float or array_like, (...)
            Standard deviation of the components of ``displacement``, in pixels, > 0.
        box : two of array_like, (3,)
            The lower and the upper corner of the box that the index fills.
        pixels : array_like, (..., 2), optional
            Places of the displacements, (column, row), such as centres of windows; (0, 0) is the
            centre of the first pixel. All pixels of the camera by default.
        mask : array_like of bool, (...), optional
            True for displacements that do not count, as in NumPy and OpenPIV.
        at : str, optional
            Meaning of ``pixels``: places in the picture with the ``"flow"``, in the ``"still"``
            picture, or in the ``"middle"`` between both. PIV codes that shift both windows use the
            middle; codes that search for a fixed window of the first picture use this picture.
        lens : int, optional
            Number of rays through the lens for each pixel: see :meth:`Rays.from_sensor`.
        ambient, placement, tolerance
            As for :class:`Rays`.

        Returns
        -------
        BosData
            The data of all valid displacements.

        Raises
        ------
        GradError
            Shapes that do not match, displacements larger than the image, noise that is not
            positive, no valid displacement, or pixels that do not see the background.

        Examples
        --------
        >>> camera = morgana.grad.Camera.look_at((0, 0, -5), (0, 0, 0), fov=20, size=(64, 48))
        >>> wall = morgana.grad.Plane((0, 0, 3), (0, 0, 1))
        >>> data = morgana.grad.BosData.of_camera(camera, moved, background=wall, noise=0.05, box=((-1, -1, -1), (1, 1, 1)))
        """
        camera = sensor if isinstance(sensor, Camera) else Camera.of_scene(sensor)
        moved = numbers(displacement, "displacement")
        places = camera.pixels() if pixels is None else numbers(pixels, "pixels")
        if moved.shape != places.shape or moved.ndim < 2 or moved.shape[-1] != 2:
            where = f"{places.shape}, as pixels have" if pixels is not None else f"{places.shape} for this camera"
            raise GradError(f"displacement has the shape {moved.shape} but must have {where}")
        shape = moved.shape[:-1]
        sigma = numbers(noise, "noise")
        if sigma.ndim and sigma.shape != shape:
            raise GradError(f"noise has the shape {sigma.shape} but must be one number, or have the shape {shape}")
        if at not in PLACES:
            raise GradError(f"at is {checks.shown(at)} but must be 'flow', 'still' or 'middle'")
        known = np.isfinite(moved).all(axis=-1) & ~_mask(mask, shape)
        if not known.any():
            raise GradError("no displacement is valid: all are NaN or masked")
        moved, places, sigma = moved[known], places[known], np.broadcast_to(sigma, shape)[known]
        if not (np.isfinite(sigma) & (sigma > 0)).all():
            raise GradError("noise must be positive numbers, in pixels")
        if np.abs(moved).max() > max(camera.size):
            raise GradError(f"displacements reach {np.abs(moved).max():.3g} pixels, more than the image: give them in pixels")
        seen = places + (1 - PLACES[at]) * moved
        options: Any = {"box": box, "exit": background, "ambient": ambient, "placement": placement, "tolerance": tolerance}
        rays = Rays.from_sensor(camera, seen, lens=lens, **options)
        positions = _straight(camera, seen - moved, background, lens)
        sides = [_straight(camera, seen - moved + step, background, 1) - _straight(camera, seen - moved, background, 1) for step in np.eye(2)]
        # Take the root mean square over the two directions on the background.
        footprint = np.sqrt(sum(np.sum(side**2, axis=1) for side in sides) / 2)
        return cls(rays, positions, sigma * footprint, seen)

    @classmethod
    def join(cls, data: Sequence["BosData"]) -> "BosData":
        """Data of several cameras.

        Parameters
        ----------
        data : sequence of BosData
            Data of the cameras, with one box.

        Returns
        -------
        BosData
            All rays and positions, in the order of the cameras.

        Raises
        ------
        GradError
            No data, or rays that do not match: see :meth:`Rays.join`.

        Examples
        --------
        >>> both = morgana.grad.BosData.join([data, data])
        """
        rays = Rays.join([one.rays for one in data])
        return cls(rays, *(np.concatenate([one[part] for one in data]) for part in (1, 2, 3)))

    @staticmethod
    def read_piv(path: Union[str, "os.PathLike[str]"]) -> Tuple[Doubles, Doubles, NDArray[np.bool_]]:
        """Read displacements that OpenPIV has saved.

        Parameters
        ----------
        path : path_like
            A text file with the columns x, y, u, v and optionally flags and mask, in pixels. If y
            falls from row to row, y and v are upwards (``transform_coordinates`` of OpenPIV), and
            are turned downwards.

        Returns
        -------
        tuple of numpy.ndarray
            Pixels (vectors, 2), displacements (vectors, 2), and a mask (vectors,): True for vectors
            with a flag or a mask other than 0, and for NaN.

        Raises
        ------
        FileError
            A file that cannot be read.
        GradError
            A file without these columns.

        Examples
        --------
        >>> pixels, displacement, mask = morgana.grad.BosData.read_piv("field_001.txt")
        """
        return read_vectors(path)

    def __repr__(self) -> str:
        return f"<morgana.grad.BosData of {len(self.positions)} rays>"


def _straight(camera: Camera, pixels: Doubles, background: Plane, lens: int) -> Doubles:
    """Returns means over the lens of the places where straight rays of pixels meet the
    background."""
    origins, directions = camera.rays(pixels, lens=lens)
    point, normal = finite(background[0], "the point of the background"), unit(background[1], "the normal of the background")[0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = ((point - origins) @ normal) / (directions @ normal)
    missed = ~(np.isfinite(distance) & (distance > 0))
    if missed.any():
        raise GradError(f"{np.count_nonzero(missed)} of {len(missed)} rays do not meet the background: check that it is in front of the camera")
    ends = origins + distance[:, None] * directions
    return np.asarray(ends.reshape(-1, lens, 3).mean(axis=1))


def _mask(mask: Optional[ArrayLike], shape: Tuple[int, ...]) -> NDArray[np.bool_]:
    if mask is None:
        return np.zeros(shape, bool)
    found = np.asarray(mask)
    if found.dtype != bool or found.shape != shape:
        raise GradError(f"mask has the shape {found.shape} and type {found.dtype} but must be {shape} of bool, True for displacements that do not count")
    return found
