"""Pictures that rays make on a screen, and pictures of a background that rays reach.

Both are sums over a kernel around the end of each ray. A screen adds the power of a ray to the
pixels around its end; a background gives a ray the mean of the pixels around its end. With one
kernel, the two maps are transposes of each other.
"""

from __future__ import annotations

from typing import Any, Sequence, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _autodiff
from . import _checks as checks
from ._numbers import numbers
from ._raster import Picture, PictureGradient, Raster, Tap, derivatives_by
from ._system import GradError

__all__ = ["Background", "Screen"]

Doubles = NDArray[np.float64]


class Screen(Raster):
    """Screen that light falls on: the irradiance of its pixels, such as a caustic.

    Each ray carries a power, which a kernel shares among the pixels around its end. The picture is
    therefore differentiable by the ends. The whole power of a ray arrives if the ray ends at least
    half a pixel within the edges, or 1.5 pixels if ``kernel`` is ``"cubic"``. Closer to the edges, a
    part falls beside the screen.

    Parameters
    ----------
    center : array_like, (3,)
        Centre of the screen, in scene units.
    right, down : array_like, (3,)
        Vectors across the whole width, from left to right, and down the whole height, in scene
        units.
    size : two of int
        Width and height, in pixels.
    kernel : str, optional
        ``"linear"`` for triangles of one pixel on either side; the derivatives of the picture jump
        between pixels. ``"cubic"`` for B-splines of two pixels on either side, with continuous
        second derivatives.

    Raises
    ------
    GradError
        Vectors without a length or along one line, or numbers that do not fit.

    Examples
    --------
    >>> screen = morgana.grad.Screen((0, 0, 4), right=(2, 0, 0), down=(0, -2, 0), size=(64, 64))
    >>> rays = morgana.grad.Rays(origins, (0, 0, 1), box=((-1, -1, -1), (1, 1, 1)), exit=screen.plane)
    >>> caustic = screen.picture(rays.forward(index).positions, 1 / len(rays))
    """

    def __init__(self, center: ArrayLike, right: ArrayLike, down: ArrayLike, size: Sequence[int], *, kernel: str = "linear") -> None:
        super().__init__(center, right, down, size, kernel)

    def picture(self, positions: ArrayLike, power: ArrayLike = 1.0) -> Picture:
        """Irradiance of the pixels.

        The sum of all values times ``pixel_area`` is the power on the screen.

        Parameters
        ----------
        positions : array_like, (rays, 3)
            Ends of rays on ``plane``: :attr:`Ends.positions`. NaN for rays without an end.
        power : float or array_like, (rays,) or (rays, channels), optional
            Power of each ray.

        Returns
        -------
        Picture
            Power per squared scene unit, (height, width) or (height, width, channels), and the
            numbers of rays without an end and beyond the edges.

        Raises
        ------
        GradError
            Shapes that do not fit, power that is not finite, or ends beside ``plane``.

        Examples
        --------
        >>> caustic = screen.picture(ends.positions, 1 / len(rays))
        >>> caustic.values.sum() * screen.pixel_area, caustic.lost, caustic.missed
        """
        ends, given, shape = self._given(positions, power, "power")
        landing, each = self._landing(ends), _by_ray(given, len(ends))
        total = np.zeros((self._size[0] * self._size[1], each.shape[1]))
        for tap in self._taps(landing):
            total += _gathered(tap, each, len(total))
        return Picture((total / self.pixel_area).reshape(shape), *landing.counts)

    def vjp(self, positions: ArrayLike, power: ArrayLike, by: ArrayLike) -> PictureGradient:
        """Vector–Jacobian product: derivatives of a loss by the ends and the power.

        Parameters
        ----------
        positions, power
            As for :meth:`picture`.
        by : array_like, (height, width) or (height, width, channels)
            Derivatives of the loss by the irradiance.

        Returns
        -------
        PictureGradient
            Derivatives by positions, and by power.

        Raises
        ------
        GradError
            Shapes that do not fit, or derivatives that are not finite.

        Examples
        --------
        >>> by = screen.vjp(ends.positions, power, caustic.values - wanted)
        >>> rays.vjp(index, positions=by.positions).field
        """
        ends, given, shape = self._given(positions, power, "power")
        landing, each = self._landing(ends), _by_ray(given, len(ends))
        slopes = derivatives_by(by, shape).reshape(-1, each.shape[1]) / self.pixel_area
        by_power, by_pixels = np.zeros(each.shape), np.zeros((len(ends), 2))
        for tap in self._taps(landing):
            seen = slopes[tap.pixel]
            by_power += tap.weight[:, None] * seen
            pull = np.sum(each * seen, axis=1)
            by_pixels += np.column_stack([tap.by_column * pull, tap.by_row * pull])
        by_values = by_power.sum() if given.ndim == 0 else by_power.reshape(given.shape)
        return PictureGradient(by_pixels @ self._to_pixels, np.asarray(by_values))

    def _shape(self, positions: Tuple[int, ...], values: Tuple[int, ...]) -> Tuple[int, ...]:
        _check_positions(positions)
        if len(values) > 2 or (values and values[0] != positions[0]):
            raise GradError(f"power has the shape {values} but must be one number, or have a row for each of {positions[0]} rays")
        return (*self._size[::-1], *values[1:])


class Background(Raster):
    """Background with an image: values that a camera sees through an index.

    A kernel interpolates the image at the end of each ray. The values are differentiable by the
    ends, and linear in the image, so that an unknown image can be found together with the index.
    A ray that ends beyond the edges has no value: let the background be larger than the picture.

    Parameters
    ----------
    center : array_like, (3,)
        Centre of the background, in scene units.
    right, down : array_like, (3,)
        Vectors across the whole width, from left to right of the image, and down the whole height,
        in scene units.
    size : two of int
        Width and height of the image, in pixels.
    kernel : str, optional
        ``"linear"`` or ``"cubic"`` interpolation. The derivatives of cubic interpolation are
        continuous. Both reproduce the image at the centres of its pixels.
    lens : int, optional
        Number of consecutive rays whose mean value is a pixel of the picture, such as
        ``camera.rays(lens=16)``, ≥ 1. Rays that are means already, as of :meth:`Rays.averaged`,
        would give the value at the mean of the ends, without the blur by the lens.

    Raises
    ------
    GradError
        Vectors without a length or along one line, or numbers that do not fit.

    Examples
    --------
    >>> wall = morgana.grad.Background((0, 0, 4), right=(-2, 0, 0), down=(0, -2, 0), size=(128, 128), lens=16)
    >>> rays = morgana.grad.Rays(*camera.rays(lens=16), box=((-1, -1, -1), (1, 1, 1)), exit=wall.plane)
    >>> seen = wall.picture(rays.forward(index).positions, image)
    """

    _extends = True

    def __init__(
        self, center: ArrayLike, right: ArrayLike, down: ArrayLike, size: Sequence[int], *, kernel: str = "linear", lens: int = 1
    ) -> None:
        super().__init__(center, right, down, size, kernel)
        self._lens = checks.whole(lens, "lens", 1)

    def picture(self, positions: ArrayLike, image: ArrayLike) -> Picture:
        """Values of the background at the ends of rays.

        Parameters
        ----------
        positions : array_like, (rays, 3)
            Ends of rays on ``plane``: :attr:`Ends.positions`. NaN for rays without an end.
        image : array_like, (height, width) or (height, width, channels)
            Values of the background.

        Returns
        -------
        Picture
            Means over ``lens`` rays, (rays / lens,) or (rays / lens, channels), and the numbers of
            rays without an end and beyond the edges. A value is NaN if one of its rays has no end
            or ends beyond the edges.

        Raises
        ------
        GradError
            Shapes that do not fit, an image that is not finite, or ends beside ``plane``.

        Examples
        --------
        >>> seen = wall.picture(ends.positions, image)
        >>> seen.values.reshape(camera.size[::-1]), seen.lost, seen.missed
        """
        ends, given, shape = self._given(positions, image, "image")
        landing = self._landing(ends)
        flat = given.reshape(self._size[0] * self._size[1], -1)
        values = np.zeros((len(ends), flat.shape[1]))
        for tap in self._taps(landing):
            values += tap.weight[:, None] * flat[tap.pixel]
        values[~landing.inside] = np.nan
        means = values.reshape(-1, self._lens, flat.shape[1]).mean(axis=1)
        return Picture(means.reshape(shape), *landing.counts)

    def vjp(self, positions: ArrayLike, image: ArrayLike, by: ArrayLike) -> PictureGradient:
        """Vector–Jacobian product: derivatives of a loss by the ends and the image.

        Parameters
        ----------
        positions, image
            As for :meth:`picture`.
        by : array_like, (rays / lens,) or (rays / lens, channels)
            Derivatives of the loss by the values of the picture.

        Returns
        -------
        PictureGradient
            Derivatives by positions, and by the image.

        Raises
        ------
        GradError
            Shapes that do not fit, derivatives that are not finite, or nonzero derivatives by
            values that are NaN.

        Examples
        --------
        >>> by = wall.vjp(ends.positions, image, np.nan_to_num(seen.values - measured))
        >>> rays.vjp(index, positions=by.positions).field, by.values
        """
        ends, given, shape = self._given(positions, image, "image")
        landing = self._landing(ends)
        flat = given.reshape(self._size[0] * self._size[1], -1)
        slopes = np.repeat(derivatives_by(by, shape).reshape(-1, flat.shape[1]), self._lens, axis=0) / self._lens
        unknown = np.count_nonzero(slopes[~landing.inside].any(axis=1))
        if unknown:
            raise GradError(f"the loss depends on {unknown} rays that do not meet the background: set its derivatives to zero where the picture is NaN")
        by_image, by_pixels = np.zeros(flat.shape), np.zeros((len(ends), 2))
        for tap in self._taps(landing):
            by_image += _gathered(tap, slopes, len(flat))
            pull = np.sum(slopes * flat[tap.pixel], axis=1)
            by_pixels += np.column_stack([tap.by_column * pull, tap.by_row * pull])
        return PictureGradient(by_pixels @ self._to_pixels, by_image.reshape(given.shape))

    def matrix(self, positions: ArrayLike) -> Any:
        """Sparse matrix from an image to the picture.

        An unknown image is the solution of a linear least-squares problem with this matrix.

        Parameters
        ----------
        positions : array_like, (rays, 3)
            As for :meth:`picture`.

        Returns
        -------
        scipy.sparse.csr_array
            ``matrix @ image.ravel()`` is the picture, (rays / lens, height · width). Rows of pixels
            that do not see the background are zero.

        Raises
        ------
        GradError
            SciPy is missing, shapes that do not fit, or ends beside ``plane``.

        Examples
        --------
        >>> to_picture = wall.matrix(ends.positions)
        >>> image = scipy.sparse.linalg.lsqr(to_picture, measured.ravel(), damp=0.1)[0]
        """
        sparse = _autodiff.library("scipy.sparse", "reconstruct")
        width, height = self._size
        ends = numbers(positions, "positions")
        pixels, *_ = self._shape(ends.shape, (height, width))
        landing = self._landing(ends)
        is_seen = np.repeat(landing.inside.reshape(-1, self._lens).all(axis=1), self._lens) / self._lens
        rows = np.arange(len(ends)) // self._lens
        taps = [(tap.weight * is_seen, rows, tap.pixel) for tap in self._taps(landing)]
        weights, rows, columns = (np.concatenate(part) for part in zip(*taps))
        return sparse.coo_array((weights, (rows, columns)), shape=(pixels, width * height)).tocsr()

    def _shape(self, positions: Tuple[int, ...], values: Tuple[int, ...]) -> Tuple[int, ...]:
        _check_positions(positions)
        if len(values) not in (2, 3) or values[:2] != self._size[::-1]:
            raise GradError(f"the image has the shape {values} but must have {self._size[::-1]}, rows and columns, with or without channels")
        if positions[0] % self._lens:
            raise GradError(f"{positions[0]} rays do not form whole groups of lens={self._lens}: give the rays of camera.rays(lens={self._lens})")
        return (positions[0] // self._lens, *values[2:])


def _check_positions(shape: Tuple[int, ...]) -> None:
    if len(shape) != 2 or shape[1] != 3:
        raise GradError(f"positions have the shape {shape} but must have (rays, 3), as Ends.positions")


def _by_ray(power: Doubles, rays: int) -> Doubles:
    """Returns the power of each ray, (rays, channels)."""
    return np.asarray(np.broadcast_to(power if power.ndim == 2 else power.reshape(-1, 1), (rays, power.shape[1] if power.ndim == 2 else 1)))


def _gathered(tap: Tap, each: Doubles, pixels: int) -> Doubles:
    """Returns sums over the rays of each pixel of weights times the numbers of rays, (pixels,
    channels)."""
    return np.column_stack([np.bincount(tap.pixel, tap.weight * channel, pixels) for channel in each.T])
