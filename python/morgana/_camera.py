"""Cameras: rays of pixels, and pixels of points."""

from __future__ import annotations

import os
from typing import Any, Dict, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _checks as checks
from ._calibration import read_calibration
from ._morgana import Scene
from ._numbers import numbers, vectors
from ._system import GradError, finite, unit
from ._values import alike

__all__ = ["Camera"]

Doubles = NDArray[np.float64]

COEFFICIENTS = (0, 4, 5, 8, 12)
"""Valid numbers of distortion coefficients."""
MAX_STEPS = 50
"""Maximum number of Newton steps that invert the distortion."""
MAX_ERROR = 1e-9
"""Largest error of an inverted distortion, in pixels."""
GOLDEN_ANGLE = float(np.pi * (3 - np.sqrt(5)))
"""Turn between points of the spiral that covers a lens, in radians."""


class Camera:
    """Calibrated camera: a pinhole or a thin lens with distortion, or parallel rays.

    Camera coordinates are those of OpenCV: x to the right of the image, y downwards, z along the
    view. Pixel coordinates are (column, row); (0, 0) is the centre of the first pixel. A point X of
    the scene has the camera coordinates RX + t, and the pixel matrix · (x/z, y/z, 1), with the
    distortion of (x/z, y/z) in between. For parallel rays, the pixel is matrix · (x, y, 1).

    Parameters
    ----------
    matrix : array_like, (3, 3)
        Focal lengths and principal point, in pixels: [[fx, skew, cx], [0, fy, cy], [0, 0, 1]]. For
        parallel rays, fx and fy are in pixels per scene unit.
    size : two of int
        Width and height of the image, in pixels.
    rotation : array_like, (3, 3) or (3,), optional
        The rotation R from scene to camera, as a matrix, or as the axis times the angle in radians
        (Rodrigues). The identity by default.
    translation : array_like, (3,), optional
        The translation t, in scene units: the scene's origin in camera coordinates. Zero by
        default.
    distortion : array_like, optional
        OpenCV's coefficients k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4: the first 0, 4, 5, 8
        or 12. Not for parallel rays.
    parallel : bool, optional
        True for parallel rays, as of a telecentric lens.
    aperture_radius : float, optional
        Radius of the lens, in scene units, ≥ 0. Zero for a pinhole, and for parallel rays.
    focus_distance : float, optional
        Distance of the plane in focus from the lens along the axis, in scene units, > 0. A lens
        needs it.

    Raises
    ------
    GradError
        Shapes or numbers that do not fit, or a rotation that is none.

    Examples
    --------
    >>> matrix = [[800, 0, 319.5], [0, 800, 239.5], [0, 0, 1]]
    >>> camera = morgana.grad.Camera(matrix, (640, 480), translation=(0, 0, 5), distortion=(-0.2, 0.05, 0, 0))
    >>> camera.project([0, 0, 0])
    array([319.5, 239.5])
    """

    def __init__(
        self,
        matrix: ArrayLike,
        size: Sequence[int],
        *,
        rotation: Optional[ArrayLike] = None,
        translation: ArrayLike = (0.0, 0.0, 0.0),
        distortion: ArrayLike = (),
        parallel: bool = False,
        aperture_radius: float = 0.0,
        focus_distance: Optional[float] = None,
    ) -> None:
        self._matrix = _intrinsic(matrix)
        self._size = image_size(size)
        self._rotation = np.eye(3) if rotation is None else _rotation(rotation)
        self._translation = finite(translation, "translation")
        self._distortion = numbers(distortion, "distortion").ravel()
        self._kappa = 0.0
        self._parallel = checks.truth(parallel, "parallel")
        self._radius = checks.real(aperture_radius, "aperture_radius", "a number of at least 0")
        self._focus = checks.optional_positive(focus_distance, "focus_distance")
        if self._distortion.size not in COEFFICIENTS or not np.isfinite(self._distortion).all():
            raise GradError(f"distortion has {self._distortion.size} coefficients but must have 0, 4, 5, 8 or 12 finite numbers")
        if not (self._radius >= 0 and np.isfinite(self._radius)):
            raise GradError(f"aperture_radius is {aperture_radius} but must be at least 0")
        if self._parallel and (self._radius > 0 or self._distortion.any()):
            raise GradError("a camera with parallel rays has neither an aperture nor a distortion")
        if self._radius > 0 and self._focus is None:
            raise GradError("a lens needs focus_distance: give the distance of the plane in focus")

    @classmethod
    def look_at(
        cls,
        origin: ArrayLike,
        target: ArrayLike,
        *,
        size: Sequence[int],
        up: ArrayLike = (0.0, 1.0, 0.0),
        fov: Optional[float] = None,
        width: Optional[float] = None,
        aperture_radius: float = 0.0,
        focus_distance: Optional[float] = None,
    ) -> "Camera":
        """Camera at a point that looks at another point in the centre of its image.

        Parameters
        ----------
        origin : array_like, (3,)
            Position of the camera. For parallel rays, they start on the plane through it.
        target : array_like, (3,)
            Point in the centre of the image.
        size : two of int
            Width and height of the image, in pixels.
        up : array_like, (3,), optional
            Direction that is upwards in the image, not along the view.
        fov : float, optional
            Angle across the width of the image, in degrees, 0 to 179, as of a ``perspective``
            sensor. Give either this or ``width``.
        width : float, optional
            Width of the image for parallel rays, in scene units, > 0.
        aperture_radius, focus_distance
            As for :class:`Camera`.

        Returns
        -------
        Camera
            The camera, with square pixels.

        Raises
        ------
        GradError
            Both or neither of ``fov`` and ``width``, or numbers that do not fit.

        Examples
        --------
        >>> camera = morgana.grad.Camera.look_at((0, 0, -5), (0, 0, 0), fov=20, size=(64, 48))
        """
        start = finite(origin, "origin")
        forward = unit(finite(target, "target") - start, "the direction from origin to target")[0]
        right = np.cross(forward, finite(up, "up"))
        if np.linalg.norm(right) < 1e-9 * np.linalg.norm(np.asarray(up, float)):
            raise GradError(f"up is {np.asarray(up).tolist()} but must not be along the view")
        right = right / np.linalg.norm(right)
        rotation = np.stack([right, np.cross(forward, right), forward])
        columns, rows = image_size(size)
        if (fov is None) == (width is None):
            raise GradError("give either fov for a perspective camera, or width for parallel rays")
        if fov is not None and not 0 < checks.positive(fov, "fov") <= 179:
            raise GradError(f"fov is {fov} but must be between 0 and 179 degrees")
        scale = columns / checks.positive(width, "width") if fov is None else columns / (2 * np.tan(np.radians(fov) / 2))
        matrix = np.array([[scale, 0, (columns - 1) / 2], [0, scale, (rows - 1) / 2], [0, 0, 1]])
        pose: Dict[str, Any] = {"rotation": rotation, "translation": -rotation @ start}
        return cls(matrix, size, parallel=fov is None, aperture_radius=aperture_radius, focus_distance=focus_distance, **pose)

    @classmethod
    def of_scene(cls, scene: Scene) -> "Camera":
        """Camera of a scene.

        Parameters
        ----------
        scene : Scene
            A scene with a sensor ``perspective`` or ``thinlens`` with a ``fov``, or
            ``orthographic``.

        Returns
        -------
        Camera
            The camera with the pixels of the scene's film.

        Raises
        ------
        GradError
            A scene without such a sensor.

        Examples
        --------
        >>> camera = morgana.grad.Camera.of_scene(morgana.load_file("scenes/bos_jet.xml"))
        """
        checks.scene(scene)
        values = scene.parameters()
        films = [name[: -len(".film.width")] for name in values if name.endswith(".film.width")]
        own = {name.rpartition(".")[2]: values[name] for name in values if films and name.rpartition(".")[0] == films[0]}
        if len(films) != 1 or not {"to_world"} <= own.keys() or "aperture" in own:
            raise GradError("the scene must have one sensor: perspective, thinlens or orthographic")
        crop = [values.get(f"{films[0]}.film.crop_{name}") for name in ("offset_x", "offset_y", "width", "height")]
        if any(crop):
            raise GradError("the film of the scene is cropped: load the scene without crop_offset_x, crop_offset_y, crop_width and crop_height")
        columns, rows = scene.size
        to_world = np.asarray(own["to_world"], float)
        scales = np.linalg.norm(to_world[:3, :3], axis=0)
        axes = to_world[:3, :3] / scales
        # Local x is to the left of the image, and local y upwards.
        rotation = (axes * [-1, -1, 1]).T
        lens: Dict[str, Any] = {}
        if {"fov", "fov_axis"} <= own.keys():
            width = {"x": columns, "y": rows, "smaller": min(columns, rows), "larger": max(columns, rows), "diagonal": np.hypot(columns, rows)}
            focal = width[own["fov_axis"]] / (2 * np.tan(np.radians(own["fov"]) / 2))
            fx = fy = focal
            if "aperture_radius" in own:
                if "focus_point" in own:
                    focus = float(axes[:, 2] @ (np.asarray(own["focus_point"], float) - to_world[:3, 3]))
                else:
                    focus = float(own["focus_distance"]) * scales[2]
                lens = {"aperture_radius": float(own["aperture_radius"]) * scales[0], "focus_distance": focus}
            if not np.allclose(scales, scales[0]):
                raise GradError(f"to_world of the sensor scales the axes by {scales.tolist()}: a camera needs equal scales")
        elif own.keys() <= {"to_world", "near_clip", "far_clip", "shutter_open", "shutter_close"}:
            fx = columns / (2 * scales[0])
            fy = columns / (2 * scales[1])
        else:
            raise GradError("the sensor of the scene must be perspective or thinlens with a fov, or orthographic")
        center = ((columns - 1) / 2, (rows - 1) / 2)
        offset = (own.get("principal_point_offset_x", 0.0) * columns, own.get("principal_point_offset_y", 0.0) * rows)
        matrix = [[fx, 0, center[0] - offset[0]], [0, fy, center[1] - offset[1]], [0, 0, 1]]
        return cls(matrix, (columns, rows), rotation=rotation, translation=-rotation @ to_world[:3, 3], parallel="fov" not in own, **lens)

    @classmethod
    def read(
        cls,
        path: Union[str, "os.PathLike[str]"],
        *,
        size: Optional[Sequence[int]] = None,
        rotation: Optional[ArrayLike] = None,
        translation: Optional[ArrayLike] = None,
        view: Optional[int] = None,
    ) -> "Camera":
        """Read a camera from a calibration file.

        Parameters
        ----------
        path : path_like
            A file of OpenCV (``.yml``, ``.yaml``, ``.json``), of ROS (``.yaml``), or of Tsai's
            program (other endings: Ncx, Nfx, dx, dy, dpx, dpy, Cx, Cy, sx, f, κ1, Tx, Ty, Tz, Rx,
            Ry, Rz). OpenCV's files have ``camera_matrix``, and may have
            ``distortion_coefficients``, ``image_width``, ``image_height`` and a pose: ``rvec`` or
            ``R``, and ``tvec`` or ``T``.
        size : two of int, optional
            Width and height of the image, in pixels, if the file does not have them.
        rotation, translation : array_like, optional
            Pose of the camera as for :class:`Camera`, instead of the pose in the file.
        view : int, optional
            Number of the picture, from 0, for poses from ``extrinsic_parameters`` of OpenCV's
            calibration program.

        Returns
        -------
        Camera
            The camera, in the unit of length of the file's pose.

        Raises
        ------
        FileError
            A file that cannot be read.
        GradError
            A file without a camera, or numbers that do not fit.

        Examples
        --------
        >>> camera = morgana.grad.Camera.read("left.yml")
        """
        found = read_calibration(path, view)
        if size is None and found.size is None:
            raise GradError(f"{os.fspath(path)} has no size of the image: give size=(width, height)")
        pose: Dict[str, Any] = {"rotation": found.rotation if rotation is None else rotation}
        pose["translation"] = found.translation if translation is None else translation
        camera = cls(found.matrix, size if size is not None else found.size or (), distortion=found.distortion, **pose)
        camera._kappa = found.kappa
        return camera

    @property
    def size(self) -> Tuple[int, int]:
        """Width and height of the image, in pixels."""
        return self._size

    @property
    def origin(self) -> Doubles:
        """Position of the camera, (3,), in scene units."""
        return np.asarray(-self._rotation.T @ self._translation)

    def pixels(self) -> Doubles:
        """Coordinates of the centres of all pixels.

        Returns
        -------
        numpy.ndarray
            (column, row) of each pixel, (height, width, 2).
        """
        columns, rows = self._size
        return np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).astype(float)

    def rays(self, pixels: Optional[ArrayLike] = None, *, lens: int = 1) -> Tuple[Doubles, Doubles]:
        """Starts of the rays of pixels.

        Parameters
        ----------
        pixels : array_like, (..., 2), optional
            Pixel coordinates (column, row), also between pixels and outside the image. All pixels
            by default, row by row.
        lens : int, optional
            Number of rays for each pixel, ≥ 1. With 1, the ray goes through the centre of the lens.
            Otherwise rays go through points of a spiral that covers the lens evenly.

        Returns
        -------
        tuple of numpy.ndarray
            Origins and unit directions, (pixels · lens, 3) each. The rays of a pixel are
            consecutive.

        Raises
        ------
        GradError
            Pixels that are not finite, or where the distortion has no inverse. Several rays for a
            camera without an aperture.

        Examples
        --------
        >>> origins, directions = camera.rays([[0, 0], [63, 47]])
        """
        checks.whole(lens, "lens", 1)
        if lens > 1 and self._radius == 0:
            raise GradError(f"lens is {lens}, but the camera has no aperture: give aperture_radius and focus_distance, or lens=1")
        plane = self._undistorted(self.pixels() if pixels is None else pixels)
        flat, ones = np.zeros(len(plane)), np.ones(len(plane))
        if self._parallel:
            starts, along = np.column_stack([plane, flat]), np.column_stack([flat, flat, ones])
        elif lens == 1:
            starts, along = np.zeros((len(plane), 3)), np.column_stack([plane, ones])
        else:
            number = np.arange(lens)
            radius, turn = self._radius * np.sqrt((number + 0.5) / lens), GOLDEN_ANGLE * number
            spots = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), 0 * turn])
            # Rays of a pixel meet in one point of the plane in focus.
            focus = float(self._focus or 0) * np.column_stack([plane, ones])
            starts = np.tile(spots, (len(plane), 1))
            along = np.repeat(focus, lens, axis=0) - starts
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        return (starts - self._translation) @ self._rotation, along @ self._rotation

    def project(self, points: ArrayLike) -> Doubles:
        """Pixels at which points of the scene appear, seen along straight rays.

        Parameters
        ----------
        points : array_like, (..., 3)
            Points, in scene units.

        Returns
        -------
        numpy.ndarray
            Pixel coordinates (column, row), (..., 2); NaN for points behind the camera.

        Raises
        ------
        GradError
            A distortion by Tsai's program without an inverse.

        Examples
        --------
        >>> camera.project([[0, 0, 0], [0.1, 0, 0]])
        """
        given = vectors(points, "points")
        x = given.reshape(-1, 3) @ self._rotation.T + self._translation
        if self._parallel:
            plane = x[:, :2]
        else:
            plane = np.where(x[:, 2:] > 0, x[:, :2], np.nan) / np.where(x[:, 2:] > 0, x[:, 2:], 1.0)
        found = self._distorted(plane)
        return np.asarray((found @ self._matrix[:2, :2].T + self._matrix[:2, 2]).reshape(*given.shape[:-1], 2))

    def _distorted(self, plane: Doubles) -> Doubles:
        """Returns distorted coordinates, (points, 2), from ideal coordinates."""
        if self._kappa:
            known = np.isfinite(plane).all(axis=1)
            found = np.full(plane.shape, np.nan)
            found[known] = self._solved(lambda x: _tsai(x, self._kappa), plane[known])
            return found
        return _opencv(plane, self._distortion) if self._distortion.any() else plane

    def _undistorted(self, pixels: ArrayLike) -> Doubles:
        """Returns ideal coordinates, (pixels, 2)."""
        given = numbers(pixels, "pixels")
        if given.ndim == 0 or given.shape[-1] != 2:
            raise GradError(f"pixels have the shape {given.shape} but must have (..., 2): column and row")
        given = given.reshape(-1, 2)
        bad = ~np.isfinite(given).all(axis=1)
        if bad.any():
            raise GradError(f"{np.count_nonzero(bad)} pixels are not finite: the first is number {int(np.argmax(bad))}")
        seen: Any = np.linalg.solve(self._matrix[:2, :2], (given - self._matrix[:2, 2]).T).T
        if self._kappa:
            return _tsai(seen, self._kappa)
        if not self._distortion.any():
            return np.asarray(seen)
        return self._solved(lambda x: _opencv(x, self._distortion), seen)

    def _solved(self, function: Any, values: Doubles) -> Doubles:
        """Returns x with ``function`` (x) = ``values``, by Newton's method from ``values``. The
        function must be analytic: complex steps give its derivatives."""
        x, step = values.copy(), 1e-30
        scale = np.abs(self._matrix[:2, :2]).max()
        for _ in range(MAX_STEPS):
            left = function(x) - values
            if np.all(np.abs(left) * scale <= MAX_ERROR):
                break
            slopes = np.stack([function(x + 1j * step * axis).imag / step for axis in np.eye(2)], axis=-1)
            with np.errstate(all="ignore"):
                determinant = slopes[:, 0, 0] * slopes[:, 1, 1] - slopes[:, 0, 1] * slopes[:, 1, 0]
                dx = (slopes[:, 1, 1] * left[:, 0] - slopes[:, 0, 1] * left[:, 1]) / determinant
                dy = (slopes[:, 0, 0] * left[:, 1] - slopes[:, 1, 0] * left[:, 0]) / determinant
                x = x - np.column_stack([dx, dy])
        with np.errstate(all="ignore"):
            bad = ~(np.abs(function(x) - values).max(axis=1) * scale <= 10 * MAX_ERROR)
        if bad.any():
            raise GradError(f"the distortion has no inverse at {np.count_nonzero(bad)} pixels: check the coefficients, or leave out pixels far from the centre")
        return x

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return alike(self.__dict__, other.__dict__)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        kind = "parallel rays" if self._parallel else "a pinhole" if self._radius == 0 else f"a lens of radius {self._radius:g}"
        place = ", ".join(f"{value:g}" for value in self.origin)
        return f"<morgana.grad.Camera of {self._size[0]} × {self._size[1]} pixels at ({place}): {kind}>"


def _opencv(plane: NDArray[Any], coefficients: Doubles) -> NDArray[Any]:
    """Returns coordinates with OpenCV's radial, tangential and thin-prism distortion."""
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 = np.concatenate([coefficients, np.zeros(12 - coefficients.size)])
    x, y = plane[:, 0], plane[:, 1]
    r2 = x * x + y * y
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    return np.stack(
        [
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) + r2 * (s1 + r2 * s2),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y + r2 * (s3 + r2 * s4),
        ],
        axis=-1,
    )


def _tsai(plane: NDArray[Any], kappa: float) -> NDArray[Any]:
    """Returns ideal coordinates from coordinates with Tsai's radial distortion."""
    return np.asarray(plane * (1 + kappa * np.sum(plane * plane, axis=1, keepdims=True)))


def _intrinsic(matrix: ArrayLike) -> Doubles:
    found = numbers(matrix, "matrix")
    if found.shape != (3, 3) or not np.isfinite(found).all() or not np.allclose(found[2], [0, 0, 1]) or found[1, 0] != 0:
        raise GradError("matrix must be finite numbers [[fx, skew, cx], [0, fy, cy], [0, 0, 1]]")
    if not (found[0, 0] > 0 and found[1, 1] > 0):
        raise GradError(f"the focal lengths in matrix are {found[0, 0]:g} and {found[1, 1]:g} pixels but must be above 0")
    return found


def image_size(size: Sequence[int]) -> Tuple[int, int]:
    """Returns the width and height of an image in pixels, or raises an error."""
    try:
        width, height = size
    except (TypeError, ValueError):
        raise GradError(f"size is {checks.shown(size)} but must be (width, height) in pixels") from None
    return checks.whole(width, "the width in size", 1), checks.whole(height, "the height in size", 1)


def _rotation(rotation: ArrayLike) -> Doubles:
    found = numbers(rotation, "rotation")
    if found.size == 3 and np.isfinite(found).all():
        return rodrigues(found.ravel())
    if found.shape != (3, 3) or not np.isfinite(found).all():
        raise GradError(f"rotation has the shape {found.shape} but must be finite numbers: a matrix (3, 3), or an axis times an angle (3,)")
    # Calibrations are written with few digits.
    if np.abs(found @ found.T - np.eye(3)).max() > 1e-3 or np.linalg.det(found) < 0:
        raise GradError("rotation is not the matrix of a rotation: its rows must be perpendicular unit vectors, with determinant 1")
    left, _, right = np.linalg.svd(found)
    return np.asarray(left @ right)


def rodrigues(vector: Doubles) -> Doubles:
    """Returns the matrix of a rotation about an axis by the length of ``vector`` in radians."""
    angle = float(np.linalg.norm(vector))
    if angle == 0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)
