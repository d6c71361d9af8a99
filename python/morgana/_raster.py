"""Pixels on a plane, and weights of the pixels around the ends of rays: common part of
:class:`morgana.grad.Screen` and :class:`morgana.grad.Background`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Callable, Iterator, NamedTuple, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _autodiff
from . import _checks as checks
from ._camera import image_size
from ._morgana import Field
from ._numbers import numbers, vectors
from ._system import GradError, Plane, System, finite
from ._values import alike, comparable

if TYPE_CHECKING:
    from ._ray_bundle import Rays

__all__ = ["Picture", "PictureGradient", "PictureLoss", "Raster", "Tap", "derivatives_by"]

Doubles = NDArray[np.float64]
Bools = NDArray[np.bool_]

MAX_OFFSET = 1e-3
"""Largest distance of an end from the plane of the pixels, relative to the distances of the
geometry. Single precision is 1e-7; ends that miss the plane because ``exit`` is another plane are
of the order of 1."""
KERNELS = ("linear", "cubic")
"""Names of the kernels."""


@comparable
class Picture(NamedTuple):
    """Picture by rays, and the numbers of rays that do not contribute to it."""

    values: Doubles
    """Irradiance of the pixels of a :class:`Screen`, (height, width) or (height, width, channels);
    or values of a :class:`Background`, (pixels,) or (pixels, channels)."""
    lost: int
    """Number of rays without an end."""
    missed: int
    """Number of rays that end beyond the edges of the screen or background."""

    def __repr__(self) -> str:
        return f"<morgana.grad.Picture of shape {self.values.shape}, {self.lost} rays lost, {self.missed} missed>"


@comparable
class PictureGradient(NamedTuple):
    """Derivatives of a loss of a picture."""

    positions: Doubles
    """Derivatives by the ends of the rays, (rays, 3): ``positions`` of :meth:`Rays.vjp`. Zero for
    rays without an end."""
    values: Doubles
    """Derivatives by the power of the rays, or by the image of the background, in the given
    shape."""

    def __repr__(self) -> str:
        return f"<morgana.grad.PictureGradient: by {len(self.positions)} ends and values of shape {self.values.shape}>"


@comparable
class PictureLoss(NamedTuple):
    """Sum of squares over the pixels of a picture."""

    value: float
    """½Σ ((picture − measured)/noise)²."""
    gradient: Doubles
    """Derivatives of ``value`` by the index, as :attr:`Gradient.field`."""
    values: Doubles
    """Derivatives of ``value`` by the power of the rays, or by the image of the background, in the
    given shape."""
    picture: Picture
    """The picture, with the numbers of rays that do not contribute."""

    def __repr__(self) -> str:
        return f"<morgana.grad.PictureLoss: {self.value:.6g}, {self.picture.lost} rays lost, {self.picture.missed} missed>"


class _Landing(NamedTuple):
    """Ends of rays in pixel coordinates."""

    pixels: Doubles
    """Column and row, (rays, 2); zero for rays without an end."""
    ended: Bools
    """Mask of the rays that have an end, (rays,)."""
    inside: Bools
    """Mask of the rays that end within the edges, (rays,)."""

    @property
    def counts(self) -> Tuple[int, int]:
        """Number of rays without an end, and number of rays that end beyond the edges."""
        return int(np.count_nonzero(~self.ended)), int(np.count_nonzero(self.ended & ~self.inside))


class Tap(NamedTuple):
    """Weights of one of the pixels around the end of each ray, (rays,) each."""

    pixel: NDArray[np.int64]
    """Number of the pixel, row by row."""
    weight: Doubles
    """Weight of the pixel."""
    by_column: Doubles
    """Derivative of the weight by the column of the end."""
    by_row: Doubles
    """Derivative of the weight by the row of the end."""


class Raster:
    """Rectangle of pixels on a plane: common part of :class:`Screen` and :class:`Background`."""

    _extends = False
    """True if the pixels at the edges continue beyond the edges."""

    def __init__(self, center: ArrayLike, right: ArrayLike, down: ArrayLike, size: Sequence[int], kernel: str) -> None:
        self._center, self._right, self._down = finite(center, "center"), finite(right, "right"), finite(down, "down")
        self._size = image_size(size)
        lengths = float(np.linalg.norm(self._right)), float(np.linalg.norm(self._down))
        self._area = float(np.linalg.norm(np.cross(self._right, self._down)))
        if not self._area > 1e-9 * lengths[0] * lengths[1]:
            raise GradError(f"right is {self._right.tolist()} and down is {self._down.tolist()}: both must have a length, and different directions")
        if kernel not in KERNELS:
            raise GradError(f"kernel is {checks.shown(kernel)} but must be 'linear' or 'cubic'")
        self._kernel = kernel
        # Rows are the derivatives of column and row by the position.
        self._to_pixels = np.linalg.pinv(np.column_stack([self._right, self._down])) * np.array(self._size)[:, None]

    @property
    def plane(self) -> Plane:
        """Plane of the pixels: the ``exit`` of the rays."""
        normal = np.cross(self._right, self._down)
        return Plane(tuple(self._center.tolist()), tuple((normal / np.linalg.norm(normal)).tolist()))

    @property
    def size(self) -> Tuple[int, int]:
        """Width and height, in pixels."""
        return self._size

    @property
    def pixel_area(self) -> float:
        """Area of a pixel, in squared scene units."""
        return self._area / (self._size[0] * self._size[1])

    def points(self) -> Doubles:
        """Centres of all pixels.

        Returns
        -------
        numpy.ndarray
            Positions, (height, width, 3), in scene units.

        Examples
        --------
        >>> morgana.grad.Screen((0, 0, 4), (2, 0, 0), (0, -2, 0), (2, 2)).points()[0, 0]
        array([-0.5,  0.5,  4. ])
        """
        columns, rows = (((np.arange(count) + 0.5) / count - 0.5)[:, None] for count in self._size)
        return np.asarray(self._center + columns[None] * self._right + rows[:, None] * self._down)

    def project(self, points: ArrayLike) -> Doubles:
        """Pixel coordinates of points of the plane.

        Parameters
        ----------
        points : array_like, (..., 3)
            Points, in scene units. Points beside the plane are moved to it along its normal.

        Returns
        -------
        numpy.ndarray
            (column, row), (..., 2), also beyond the edges; (0, 0) is the centre of the first pixel.
            NaN for points that are not finite.

        Examples
        --------
        >>> screen.project(ends.positions)
        """
        given = vectors(points, "points")
        with np.errstate(invalid="ignore"):
            found = (given - self._center) @ self._to_pixels.T + (np.array(self._size) - 1) / 2
        return np.asarray(np.where(np.isfinite(given).all(axis=-1, keepdims=True), found, np.nan))

    def least_squares(
        self, rays: "Rays", index: Union[Field, System, ArrayLike], measured: ArrayLike, values: ArrayLike, *, noise: ArrayLike = 1.0
    ) -> PictureLoss:
        """Half the sum of squares of (picture − measured)/noise, and its derivatives.

        For several pictures through one index, add the values and the derivatives.

        Parameters
        ----------
        rays : Rays
            Rays that end on ``plane``.
        index : array_like, (nz, ny, nx), or Field or System
            As for :meth:`Rays.forward`.
        measured : array_like
            Measured or desired picture, in the shape of :attr:`Picture.values`; for the pixels of a
            camera also (height, width) or (height, width, channels). Values that are not finite are
            ignored.
        values : array_like
            Power of the rays, or image of the background, as for ``picture``.
        noise : float or array_like, optional
            Standard deviation of ``measured``, > 0: one number, or one for each value.

        Returns
        -------
        PictureLoss
            The sum, its derivatives by the index and by ``values``, and the picture. Values of a
            background that are NaN are left out.

        Raises
        ------
        GradError
            Shapes that do not fit, noise that is not positive, rays that do not end on ``plane``,
            or a picture without any value to compare.

        Examples
        --------
        >>> loss = screen.least_squares(rays, index, wanted, 1 / len(rays), noise=0.1)
        >>> loss.value, loss.gradient, loss.picture.values
        """
        ends = rays.forward(index)
        picture = self.picture(ends.positions, values)
        target, sigma = _like(measured, picture.values, "measured"), numbers(noise, "noise")
        sigma = sigma if sigma.ndim == 0 else _like(sigma, picture.values, "noise")
        known = np.isfinite(target) & np.isfinite(picture.values)
        if not known.any():
            raise GradError(f"there is no value to compare: {picture.lost} of {len(ends.positions)} rays have no end, and {picture.missed} end beyond the edges")
        if not np.all((sigma > 0) & np.isfinite(sigma) | ~known):
            raise GradError("noise must be positive numbers")
        with np.errstate(all="ignore"):
            residual = np.where(known, (picture.values - target) / sigma, 0.0)
            by = self.vjp(ends.positions, values, np.where(known, residual / sigma, 0.0))
        return PictureLoss(0.5 * float(np.sum(residual**2)), rays.vjp(index, positions=by.positions).field, by.values, picture)

    def torch(self) -> Callable[..., Any]:
        """Picture as a function that PyTorch differentiates.

        Returns
        -------
        callable
            ``picture(positions, values)`` of CPU tensors: ends of rays, as from :meth:`Rays.torch`,
            and the power or the image. The function returns :attr:`Picture.values`, in the widest
            floating type of the tensors. Values that are NaN have no derivatives. Reverse mode and
            first derivatives only.

        Raises
        ------
        GradError
            PyTorch is missing. The returned function raises this error for arguments that do not
            fit.

        Examples
        --------
        >>> positions, _, _ = rays.torch()(index)
        >>> ((screen.torch()(positions, power) - wanted) ** 2).sum().backward()
        """
        return _autodiff.torch_picture(_Model(self))

    def jax(self) -> Callable[..., Any]:
        """Picture as a function that JAX differentiates.

        Returns
        -------
        callable
            ``picture(positions, values)`` of arrays, as for :meth:`torch`. Pictures have the type
            of ``positions``. Reverse mode only.

        Raises
        ------
        GradError
            JAX is missing. The returned function raises this error for arguments that do not fit;
            see :meth:`Rays.jax` for ``jax.jit``.

        Examples
        --------
        >>> follow, picture = rays.jax(), screen.jax()
        >>> jax.grad(lambda index: jnp.sum((picture(follow(index)[0], power) - wanted) ** 2))(index)
        """
        return _autodiff.jax_picture(_Model(self))

    def picture(self, positions: ArrayLike, values: ArrayLike) -> Picture:
        raise NotImplementedError

    def vjp(self, positions: ArrayLike, values: ArrayLike, by: ArrayLike) -> PictureGradient:
        raise NotImplementedError

    def _shape(self, positions: Tuple[int, ...], values: Tuple[int, ...]) -> Tuple[int, ...]:
        """Returns the shape of the picture. Raises an error for shapes that do not fit."""
        raise NotImplementedError

    def _given(self, positions: ArrayLike, values: ArrayLike, what: str) -> Tuple[Doubles, Doubles, Tuple[int, ...]]:
        """Returns positions and values as arrays, and the shape of the picture."""
        ends, array = numbers(positions, "positions"), numbers(values, what)
        shape = self._shape(ends.shape, array.shape)
        bad = np.count_nonzero(~np.isfinite(array))
        if bad:
            raise GradError(f"{bad} numbers of the {what} are not finite: set them to a number")
        return ends, array, shape

    def _landing(self, ends: Doubles) -> _Landing:
        """Converts ends of rays to pixel coordinates. Raises an error for ends beside the plane."""
        pixels = self.project(ends)
        ended = np.asarray(np.isfinite(pixels).all(axis=1))
        plane = self.plane
        away = np.abs((np.where(ended[:, None], ends, self._center) - self._center) @ np.asarray(plane.normal)).max(initial=0.0)
        if away > MAX_OFFSET * max(np.linalg.norm(vector) for vector in (self._center, self._right, self._down)):
            raise GradError(f"rays end up to {away:.3g} beside the plane of the pixels: give Rays exit={type(self).__name__.lower()}.plane")
        inside = np.asarray(ended & np.all((pixels >= -0.5) & (pixels <= np.array(self._size) - 0.5), axis=1))
        return _Landing(np.where(ended[:, None], pixels, 0.0), ended, inside)

    def _taps(self, landing: _Landing) -> Iterator[Tap]:
        """Yields the pixels around the ends with their weights, which add up to 1 for ends within
        the edges."""
        width, _ = self._size
        used = (landing.inside if self._extends else landing.ended).astype(float)
        axes = [self._along(landing.pixels[:, axis], count) for axis, count in enumerate(self._size)]
        for row, v, by_v in axes[1]:
            for column, u, by_u in axes[0]:
                yield Tap(row * width + column, used * u * v, used * by_u * v, used * u * by_v)

    def _along(self, at: Doubles, count: int) -> Sequence[Tuple[NDArray[np.int64], Doubles, Doubles]]:
        """Returns the numbers of the pixels around coordinates along one axis, with weights and
        derivatives of the weights."""
        # Coordinates far beyond the edges have no pixel; clipping keeps them whole numbers.
        first = np.floor(np.clip(at, -4, count + 4)).astype(np.int64)
        offset, weights = self._weights(np.clip(at, -4, count + 4) - first)
        found = []
        for number, (weight, slope) in enumerate(weights):
            pixel = first + offset + number
            here = 1.0 if self._extends else ((pixel >= 0) & (pixel < count)).astype(float)
            found.append((np.clip(pixel, 0, count - 1), here * weight, here * slope))
        return found

    def _weights(self, t: Doubles) -> Tuple[int, Sequence[Tuple[Doubles, Doubles]]]:
        """Returns the offset of the first pixel, and weights and derivatives at a fraction t
        between two pixels."""
        if self._kernel == "linear":
            return 0, [(1 - t, -np.ones_like(t)), (t, np.ones_like(t))]
        return -1, _interpolating(t) if self._extends else _smooth(t)

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return alike(self.__dict__, other.__dict__)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        place = ", ".join(f"{value:g}" for value in self._center)
        return f"<morgana.grad.{type(self).__name__} of {self._size[0]} × {self._size[1]} pixels at ({place})>"


class _Model(NamedTuple):
    """Picture as a function of flat lists of arrays, for PyTorch and JAX."""

    raster: Raster

    def follow(self, *given: Doubles) -> Tuple[Doubles, ...]:
        """Returns the picture."""
        return (self.raster.picture(*given).values,)

    def pull_back(self, *kept: Doubles) -> Tuple[Doubles, ...]:
        """Returns derivatives by positions and values, from these arrays, the picture, and
        derivatives by the picture. Values that are NaN have no derivatives."""
        positions, values, picture, by = kept
        return tuple(self.raster.vjp(positions, values, np.where(np.isfinite(picture), by, 0.0)))

    def shape(self, positions: Tuple[int, ...], values: Tuple[int, ...]) -> Tuple[int, ...]:
        """Returns the shape of the picture."""
        return self.raster._shape(positions, values)


def _interpolating(t: Doubles) -> Sequence[Tuple[Doubles, Doubles]]:
    """Returns weights and derivatives of cubic interpolation with continuous slopes (Keys 1981)."""
    return [
        (((2 - t) * t - 1) * t / 2, ((4 - 3 * t) * t - 1) / 2),
        (((3 * t - 5) * t * t + 2) / 2, (9 * t - 10) * t / 2),
        (((4 - 3 * t) * t + 1) * t / 2, ((8 - 9 * t) * t + 1) / 2),
        ((t - 1) * t * t / 2, (3 * t - 2) * t / 2),
    ]


def _smooth(t: Doubles) -> Sequence[Tuple[Doubles, Doubles]]:
    """Returns weights and derivatives of cubic B-splines."""
    s = 1 - t
    return [
        (s**3 / 6, -(s**2) / 2),
        ((4 + 3 * t * t * (t - 2)) / 6, t * (3 * t - 4) / 2),
        ((4 + 3 * s * s * (s - 2)) / 6, -s * (3 * s - 4) / 2),
        (t**3 / 6, t**2 / 2),
    ]


def derivatives_by(by: ArrayLike, shape: Tuple[int, ...]) -> Doubles:
    """Returns derivatives by a picture, or raises an error."""
    array = numbers(by, "by")
    if array.shape != shape:
        raise GradError(f"derivatives by the picture have the shape {array.shape} but must have {shape}")
    bad = np.count_nonzero(~np.isfinite(array))
    if bad:
        raise GradError(f"{bad} derivatives by the picture are not finite: set them to zero where the picture is NaN")
    return array


def _like(values: ArrayLike, picture: Doubles, what: str) -> Doubles:
    """Returns numbers in the shape of a picture. The pixels of a camera may also be rows and
    columns."""
    array = numbers(values, what)
    has_rows = array.ndim == picture.ndim + 1 and array.shape[2:] == picture.shape[1:] and array.size == picture.size
    if array.shape != picture.shape and not has_rows:
        raise GradError(f"{what} has the shape {array.shape} but must have {picture.shape}, as the picture")
    return array.reshape(picture.shape)
