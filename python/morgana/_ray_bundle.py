"""Rays through a refractive index, with derivatives of their ends."""

from __future__ import annotations

import copy
from typing import Any, Callable, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _autodiff
from . import _checks as checks
from . import _exits as exits
from ._camera import Camera
from ._ends import Change, Ends, Gradient, LeastSquares
from ._losses import Kind, Squares, sum_of_losses
from ._morgana import Field, Scene
from ._numbers import numbers
from ._ray_arguments import Box, box_corners, exit_plane, ray_starts
from ._system import GradError, Layout, Plane, System, finite, triple, unit
from ._values import alike

Doubles = NDArray[np.float64]
Index = Union[Field, System, ArrayLike]
Build = _autodiff.Build


class Rays:
    """Rays with given starts through an index field.

    The rays are straight before and behind the field.

    :meth:`forward`, :meth:`vjp` and :meth:`jvp` take the index: samples of n on a grid, a
    :class:`morgana.Field`, or a :class:`System` of media and surfaces. Results do not depend on the
    number of threads. In addition to the arrays, large grids need at most 160 MB of memory for
    sums.

    Parameters
    ----------
    origins : array_like, (rays, 3)
        Starts, in scene units.
    directions : array_like, (rays, 3) or (3,)
        Directions, of any nonzero length.
    box : two of array_like, (3,), optional
        The lower and the upper corner of the box that the index fills. Samples need it. A field
        without a box is everywhere. In a :class:`System`, the box only places samples.
    exit : Plane, optional
        Plane on which rays end. Without it, they end where they leave the box. A :class:`System`
        needs it, behind its last surface.
    ambient : float, optional
        The index around the box, > 0. Rays keep their direction at the faces of the box, as at a
        ``null`` boundary.
    placement : str, optional
        ``"nodes"`` if the outermost samples lie on the faces of the box, ``"centers"`` if they lie
        half a spacing inside.
    tolerance : float, optional
        Relative error of positions per length, 1e-12 to 1e-2. Steps are never longer than three
        cells of a grid.
    max_length : float, optional
        Length at which tracing of a ray stops, in scene units. By default four times the extent of
        starts, box and exit.

    Raises
    ------
    GradError
        Shapes, corners or numbers that do not fit.

    Examples
    --------
    >>> rays = morgana.grad.Rays([[0, 0.2, -2]], [0, 0, 1], box=((-1, -1, -1), (1, 1, 1)))
    >>> rays.forward(np.full((16, 16, 16), 1.3)).optical_lengths
    array([3.6])
    """

    def __init__(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        box: Optional[Box] = None,
        exit: Optional[Plane] = None,
        ambient: float = 1.0,
        placement: str = "nodes",
        tolerance: float = 1e-6,
        max_length: Optional[float] = None,
    ) -> None:
        self._origins, self._directions = ray_starts(origins, directions)
        self._box = None if box is None else box_corners(box)
        self._exit = None if exit is None else Plane(*exit)
        plane = None if exit is None else exit_plane(exit)
        if plane is None and self._box is None:
            raise GradError("rays need an end: give an exit plane, or a box that they leave")
        if placement not in ("nodes", "centers"):
            raise GradError(f"placement is {placement!r} but must be 'nodes' or 'centers'")
        if not 1e-12 <= checks.positive(tolerance, "tolerance") <= 1e-2:
            raise GradError(f"tolerance is {tolerance} but must be between 1e-12 and 1e-2")
        points = [*(self._box or ()), *(plane or ())[:1]]
        far = np.max([np.abs(self._origins).max(initial=0.0), *(np.abs(point).max() for point in points)])
        self._exits = exits.Exits(
            {
                "region": None if self._box is None else (triple(self._box[0]), triple(self._box[1])),
                "ambient": checks.positive(ambient, "ambient"),
                "nodes": placement == "nodes",
                "plane": None if plane is None else (triple(plane[0]), triple(plane[1])),
                "tolerance": float(tolerance),
                "max_length": checks.optional_positive(max_length, "max_length") or 4 * 2 * float(np.sqrt(3)) * float(far),
            }
        )

    @property
    def ambient(self) -> float:
        """The index around the box."""
        return self._exits.options["ambient"]

    @property
    def placement(self) -> str:
        """Outermost samples of a grid: ``"nodes"`` on the faces of the box, ``"centers"`` inside."""
        return "nodes" if self._exits.options["nodes"] else "centers"

    def spacing(self, shape: Tuple[int, ...]) -> Doubles:
        """Distances of neighbouring samples along x, y and z.

        Parameters
        ----------
        shape : three of int
            Shape of the samples, (nz, ny, nx).

        Returns
        -------
        numpy.ndarray
            Distances, (3,), in scene units.

        Raises
        ------
        GradError
            The rays have no box.
        """
        if self._box is None:
            raise GradError("samples need a box: give Rays the box that they fill")
        counts = np.array(shape[::-1], float) - (1 if self._exits.options["nodes"] else 0)
        return np.asarray((self._box[1] - self._box[0]) / np.maximum(counts, 1))

    def select(self, rows: ArrayLike) -> "Rays":
        """Some of the rays.

        Parameters
        ----------
        rows : array_like
            Numbers of the ends, or a mask, (rays,).

        Returns
        -------
        Rays
            The selected rays, with this box and exit.

        Examples
        --------
        >>> every_fourth = rays.select(np.arange(0, len(rays), 4))
        """
        some, chosen = copy.copy(self), np.asarray(rows)
        each = chosen if self._exits.per_end == 1 else self._exits.rays_of(chosen, len(self))
        some._origins, some._directions, some._exits = self._origins[each], self._directions[each], self._exits.select(chosen)
        return some

    @staticmethod
    def join(bundles: Sequence["Rays"]) -> "Rays":
        """Rays of several bundles, such as cameras with different backgrounds.

        Parameters
        ----------
        bundles : sequence of Rays
            Rays through one box, each with its own exit, or all without an exit.

        Returns
        -------
        Rays
            All rays, in the order of the bundles. Each ray keeps its exit. With several exits,
            :attr:`Gradient.exit` is ``None``.

        Raises
        ------
        GradError
            No bundles. Bundles with different boxes, ambient indices, placements, tolerances, or
            numbers of rays in a mean.

        Examples
        --------
        >>> both = morgana.grad.Rays.join([rays, rays.select([0])])
        """
        if not bundles:
            raise GradError("there are no bundles of rays to join")
        whole = copy.copy(bundles[0])
        whole._exits = exits.joined([bundle._exits for bundle in bundles], [len(bundle) for bundle in bundles])
        whole._origins = np.concatenate([bundle._origins for bundle in bundles])
        whole._directions = np.concatenate([bundle._directions for bundle in bundles])
        if whole._exits.planes:
            whole._exit = None
        return whole

    def averaged(self, count: int) -> "Rays":
        """Means over groups of rays, such as the rays of a pixel through a lens.

        Parameters
        ----------
        count : int
            Number of consecutive rays in each group, ≥ 1.

        Returns
        -------
        Rays
            Rays with one end for each group: the means of positions, directions and optical
            lengths. A mean has no end if one of its rays has none. Means of directions are not unit
            vectors.

        Raises
        ------
        GradError
            Rays that do not form whole groups, or that are means already.

        Examples
        --------
        >>> pairs = rays.with_starts([[0, 0, -2], [0, 0.1, -2]], [0, 0, 1]).averaged(2)
        """
        checks.whole(count, "count", 1)
        if self._exits.per_end != 1:
            raise GradError(f"the ends are means over {self._exits.per_end} rays already")
        if len(self) % count:
            raise GradError(f"{len(self)} rays do not form whole groups of {count}")
        means = copy.copy(self)
        means._exits = self._exits.select(np.arange(0, len(self), count))._replace(per_end=count)
        return means

    @classmethod
    def from_sensor(
        cls,
        sensor: Union[Camera, Scene],
        pixels: Optional[ArrayLike] = None,
        *,
        lens: int = 1,
        box: Optional[Box] = None,
        exit: Optional[Plane] = None,
        ambient: float = 1.0,
        placement: str = "nodes",
        tolerance: float = 1e-6,
        max_length: Optional[float] = None,
    ) -> "Rays":
        """Rays of the pixels of a camera.

        Parameters
        ----------
        sensor : Camera or Scene
            A camera, or a scene with one.
        pixels : array_like, (..., 2), optional
            Pixel coordinates (column, row); (0, 0) is the centre of the first pixel. All pixels by
            default, row by row.
        lens : int, optional
            Number of rays through the lens for each pixel, ≥ 1. Ends are means over these rays
            (:meth:`averaged`). With 1, rays go through the centre of the lens.
        box, exit, ambient, placement, tolerance, max_length
            As for :class:`Rays`.

        Returns
        -------
        Rays
            An end for each pixel.

        Raises
        ------
        GradError
            Pixels without a direction, a scene without a supported camera, or several rays for a
            camera without an aperture.

        Examples
        --------
        >>> camera = morgana.grad.Camera.look_at((0, 0, -5), (0, 0, 0), fov=20, size=(64, 48))
        >>> rays = morgana.grad.Rays.from_sensor(camera, box=((-1, -1, -1), (1, 1, 1)))
        """
        camera = sensor if isinstance(sensor, Camera) else Camera.of_scene(sensor)
        origins, directions = camera.rays(pixels, lens=lens)
        rays = cls(origins, directions, box=box, exit=exit, ambient=ambient, placement=placement, tolerance=tolerance, max_length=max_length)
        return rays.averaged(lens)

    @property
    def starts(self) -> Tuple[Doubles, Doubles]:
        """Origins and directions, (rays, 3) each, as they were given."""
        return self._origins, self._directions

    def with_starts(self, origins: ArrayLike, directions: ArrayLike) -> "Rays":
        """Other rays through this box to this exit, for instance of a sensor or source that moved.

        Parameters
        ----------
        origins : array_like, (rays, 3)
            As for :class:`Rays`.
        directions : array_like, (rays, 3) or (3,)
            As for :class:`Rays`.

        Returns
        -------
        Rays
            The new rays, with this box, exit, tolerance and ``max_length``.

        Raises
        ------
        GradError
            Shapes or numbers that do not fit.

        Examples
        --------
        >>> moved = rays.with_starts(origins + [0, 0, 0.1], directions)
        """
        others = copy.copy(self)
        others._origins, others._directions = ray_starts(origins, directions)
        if (self._exits.which is not None or self._exits.per_end > 1) and len(others._origins) != len(self._origins):
            raise GradError(f"rays with several exits or means keep their number, {len(self._origins)}, but {len(others._origins)} origins are given")
        return others

    def torch(self, build: Optional[Build] = None) -> Callable[..., Any]:
        """Ends of the rays as a function that PyTorch differentiates.

        Parameters
        ----------
        build : callable, optional
            ``build(values)`` makes a :class:`morgana.Field` or a :class:`System`, such as a lens.
            ``values`` are NumPy arrays by the names of :func:`parameters`. PyTorch's function calls
            it for each evaluation. Without it, samples give the index.

        Returns
        -------
        callable
            ``ends(index, origins=None, directions=None)`` of CPU tensors. ``index`` holds samples
            [z, y, x] of n; with ``build``, a dictionary of its parameters. Only parameters in the
            dictionary have derivatives. ``origins`` (rays, 3) and ``directions`` (rays, 3) or (3,)
            replace starts of the rays, as for a moving sensor. Numbers and arrays also work.

            The function returns three tensors: positions, directions and optical lengths, as in
            :class:`Ends`. Rays without an end are NaN, and have no derivatives. Rays are traced in
            double precision; their ends have the widest floating type of the tensors, or PyTorch's
            default if none has one.

            The function supports reverse mode, also by ``torch.func`` and in batches of
            ``torch.vmap``, which are traced one by one. First derivatives only.

        Raises
        ------
        GradError
            PyTorch is missing. The returned function raises this error for shapes that do not fit,
            and for samples that are not finite and > 0. It also raises this error if the result of
            ``build`` does not have the given parameters.

        Examples
        --------
        >>> index = torch.full((32, 32, 32), 1.0, dtype=torch.float64, requires_grad=True)
        >>> positions, directions, optical_lengths = rays.torch()(index)
        >>> ((directions - measured) ** 2).sum().backward()

        >>> def lens(values):
        ...     return grad.System([1.0, 1.5], [grad.Conic((0, 0, 0), (0, 0, 1), float(values["surfaces[0].curvature"]))])
        >>> curvature = torch.tensor(0.2, dtype=torch.float64, requires_grad=True)
        >>> rays.torch(lens)({"surfaces[0].curvature": curvature})[0].square().sum().backward()
        """
        self._refuse_means("torch")
        return _autodiff.torch_function(self, build)

    def jax(self, build: Optional[Build] = None) -> Callable[..., Any]:
        """Ends of the rays as a function that JAX differentiates.

        Parameters
        ----------
        build : callable, optional
            As for :meth:`torch`.

        Returns
        -------
        callable
            ``ends(index, origins=None, directions=None)`` of arrays, as for :meth:`torch`. Ends
            have the type of their starts: single precision, unless ``jax_enable_x64`` is set.
            Reverse mode only.

        Raises
        ------
        GradError
            JAX is missing. The returned function raises this error for shapes that do not fit, and
            for samples that are not finite and > 0. It also raises this error if the result of
            ``build`` does not have the given parameters. Under ``jax.jit`` and ``jax.vmap``, only
            shapes are known in advance: JAX wraps other errors in ``jax.errors.JaxRuntimeError``,
            whose text ends with the text of the error.

        Examples
        --------
        >>> ends = rays.jax()
        >>> jax.grad(lambda index: jnp.sum((ends(index)[1] - measured) ** 2))(index)
        """
        self._refuse_means("jax")
        return _autodiff.jax_function(self, build)

    def forward(self, index: Index) -> Ends:
        """Trace the rays to their ends.

        Parameters
        ----------
        index : array_like, (nz, ny, nx), or Field or System
            Samples of n, [z, y, x], a field, or media and surfaces.

        Returns
        -------
        Ends
            Ends of the rays, and the numbers of rays without an end.

        Raises
        ------
        GradError
            Samples that are not finite and > 0, or samples without a box.

        Examples
        --------
        >>> ends = rays.forward(index)
        >>> ends.positions[ends.valid]
        """
        return Ends(*self._exits.follow(self._layout(index).through, self._origins, self._directions))

    def vjp(
        self,
        index: Index,
        *,
        positions: Optional[ArrayLike] = None,
        directions: Optional[ArrayLike] = None,
        optical_lengths: Optional[ArrayLike] = None,
    ) -> Gradient:
        """Vector–Jacobian product: derivatives of a loss by the index and the starts.

        Parameters
        ----------
        index : array_like, (nz, ny, nx), or Field or System
            As for :meth:`forward`.
        positions : array_like, (rays, 3), optional
            Derivatives of the loss by the positions of :class:`Ends`; zero if left out.
        directions : array_like, (rays, 3), optional
            Derivatives of the loss by the directions; zero if left out.
        optical_lengths : array_like, (rays,), optional
            Derivatives of the loss by the optical lengths; zero if left out.

        Returns
        -------
        Gradient
            Derivatives by the samples or the parameters (named by :func:`parameters`), by the
            starts and by the exit.

        Raises
        ------
        GradError
            Shapes that do not fit, derivatives that are not finite, or nonzero derivatives of rays
            without an end.

        Examples
        --------
        >>> ends = rays.forward(index)
        >>> rays.vjp(index, directions=ends.directions - measured).field
        """
        by = (
            self._loss(positions, "positions", (len(self), 3)),
            self._loss(directions, "directions", (len(self), 3)),
            self._loss(optical_lengths, "optical_lengths", (len(self),)),
        )
        layout = self._layout(index)
        found, origins, directions, failed = self._exits.pull(layout.through, self._origins, self._directions, by)
        if failed:
            raise GradError(f"the loss depends on {failed} rays that have no end: set its derivatives to zero where Ends.valid is False")
        media, surfaces, exit = found
        field = layout.gathered(media, surfaces)
        return Gradient(field, origins, directions, layout.named(field), self._by_exit(np.array(exit)))

    def jvp(
        self,
        index: Index,
        field: Union[None, ArrayLike, Mapping[str, ArrayLike]] = None,
        *,
        origins: Optional[ArrayLike] = None,
        directions: Optional[ArrayLike] = None,
        exit: Optional[Plane] = None,
    ) -> Change:
        """Jacobian–vector product: changes of the ends with the index, the starts and the exit.

        This product is the transpose of :meth:`vjp`.

        Parameters
        ----------
        index : array_like, (nz, ny, nx), or Field or System
            As for :meth:`forward`.
        field : array_like or mapping, optional
            The change of the index, in the shape of :attr:`Gradient.field`; or changes of some
            parameters by their names. Zero if left out.
        origins : array_like, (rays, 3), optional
            The change of the origins; zero if left out.
        directions : array_like, (rays, 3), optional
            The change of the directions, as they were given; zero if left out.
        exit : Plane, optional
            The change of the point and of the normal of the exit; zero if left out.

        Returns
        -------
        Change
            Changes of positions, directions and optical lengths.

        Raises
        ------
        GradError
            Shapes that do not fit, numbers that are not finite, or parameters that do not exist.

        Examples
        --------
        >>> rays.jvp(lens, {"surfaces[0].curvature": 1.0}).positions
        """
        layout = self._layout(index)
        media, surfaces = layout.change(field)
        starts = [
            np.zeros(self._origins.shape) if of is None else self._finite(of, f"a change of the {name}")
            for name, of in (("origins", origins), ("directions", directions))
        ]
        change = (media, surfaces, self._of_exit(exit))
        return Change(*self._exits.push(layout.through, self._origins, self._directions, change, starts))

    def least_squares(
        self,
        index: Index,
        *,
        positions: Optional[ArrayLike] = None,
        position_noise: float = 1.0,
        directions: Optional[ArrayLike] = None,
        direction_noise: float = 1.0,
        optical_lengths: Optional[ArrayLike] = None,
        optical_length_noise: float = 1.0,
    ) -> "LeastSquares":
        """Half the sum of squares of (end − measured)/noise, and its derivatives by the index.

        One pass over the rays computes both, as minimisers need.

        Parameters
        ----------
        index : array_like, (nz, ny, nx), or Field or System
            As for :meth:`forward`.
        positions : array_like, (rays, 3), optional
            Measured positions of :class:`Ends`. Rows that are not finite are ignored.
        position_noise : float, optional
            Standard deviation of the components of ``positions``, in scene units, > 0.
        directions : array_like, (rays, 3), optional
            Measured unit directions. Rows that are not finite are ignored.
        direction_noise : float, optional
            Standard deviation of the components of ``directions``, in radians, > 0.
        optical_lengths : array_like, (rays,), optional
            Measured ∫ n ds, in scene units. Values that are not finite are ignored.
        optical_length_noise : float, optional
            Standard deviation of ``optical_lengths``, in scene units, > 0.

        Returns
        -------
        LeastSquares
            The sum, its derivatives, and the number of measured rays that have no end. They are
            left out.

        Raises
        ------
        GradError
            Shapes that do not fit, or noise that is not positive.

        Examples
        --------
        >>> loss = rays.least_squares(index, directions=measured, direction_noise=1e-4)
        >>> loss.value, loss.gradient
        """
        measured = (
            self._ends(positions, "positions", (len(self), 3)),
            self._ends(directions, "directions", (len(self), 3)),
            self._ends(optical_lengths, "optical_lengths", (len(self),)),
        )
        noise: Tuple[float, float, float] = (
            checks.positive(position_noise, "position_noise"),
            checks.positive(direction_noise, "direction_noise"),
            checks.positive(optical_length_noise, "optical_length_noise"),
        )
        if self._exits.per_end > 1:
            names = ("positions", "directions", "optical_lengths")
            kinds = [Kind.of(name, values, sigma) for name, values, sigma in zip(names, measured, noise) if values is not None]
            return sum_of_losses(self, index, kinds, Squares()).least_squares
        layout = self._layout(index)
        squares, (media, surfaces, _), lost = self._exits.squares(layout.through, self._origins, self._directions, measured, noise)
        return LeastSquares(0.5 * squares, layout.gathered(media, surfaces), lost)

    def _refuse_means(self, library: str) -> None:
        if self._exits.per_end > 1:
            raise GradError(f"{library} does not support means over rays: follow the rays of a lens one by one, and average in {library}")

    def _layout(self, index: Index) -> Layout:
        layout = Layout(index, self._box is not None)
        if layout.of_system and self._exit is None:
            raise GradError("rays through a System need an end: give Rays an exit behind its last surface")
        return layout

    def _by_exit(self, by: Doubles) -> Optional[Plane]:
        """Converts derivatives by the point and unit normal of the exit to derivatives by the exit
        as given."""
        if self._exit is None:
            return None
        return Plane(by[:3], unit(self._exit.normal, "the normal of the exit")[1].T @ by[3:])

    def _of_exit(self, change: Optional[Plane]) -> Tuple[float, ...]:
        """Converts a change of the exit as given to a change of its point and unit normal."""
        if change is None:
            return 6 * (0.0,)
        if self._exit is None:
            raise GradError("these rays have no exit plane that could change")
        point, normal = (finite(of, f"a change of the {name} of the exit") for of, name in zip(change, ("point", "normal")))
        turned = unit(self._exit.normal, "the normal of the exit")[1] @ normal
        return (*triple(point), *triple(turned))

    def _finite(self, values: ArrayLike, what: str) -> Doubles:
        array = np.ascontiguousarray(numbers(values, what))
        if array.shape != self._origins.shape or not np.isfinite(array).all():
            raise GradError(f"{what} has the shape {array.shape} but must be finite numbers of shape {self._origins.shape}")
        return array

    @staticmethod
    def _ends(values: Optional[ArrayLike], name: str, shape: Tuple[int, ...]) -> Optional[Doubles]:
        if values is None:
            return None
        array = np.ascontiguousarray(numbers(values, name))
        if array.shape != shape:
            raise GradError(f"{name} have the shape {array.shape} but must have {shape}")
        return array

    def _loss(self, values: Optional[ArrayLike], name: str, shape: Tuple[int, ...]) -> Optional[Doubles]:
        by = self._ends(values, f"derivatives by {name}", shape)
        lost = 0 if by is None else np.count_nonzero(~np.isfinite(by))
        if lost:
            raise GradError(f"{lost} derivatives by {name} are not finite: set derivatives of rays without an end to zero, as by Ends.valid")
        return by

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return alike(self.__dict__, other.__dict__)

    __hash__ = None  # type: ignore[assignment]

    def __len__(self) -> int:
        return len(self._origins) // self._exits.per_end

    def __repr__(self) -> str:
        where = "" if self._box is None else f" through a box from {self._box[0].tolist()} to {self._box[1].tolist()}"
        return f"<morgana.grad.Rays: {len(self)} rays{where}>"
