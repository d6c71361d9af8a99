"""Rays and pictures as functions that PyTorch and JAX differentiate in reverse mode, by
:meth:`morgana.grad.Rays.vjp` and by ``vjp`` of screens and backgrounds."""

from __future__ import annotations

import functools
import importlib
from typing import TYPE_CHECKING, Any, Callable, Dict, NamedTuple, Optional, Protocol, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from ._extras import advice
from ._morgana import Field
from ._numbers import grid_samples
from ._system import GradError, Layout, System, check_samples, check_starts

if TYPE_CHECKING:
    from ._ray_bundle import Rays

Doubles = NDArray[np.float64]
Build = Callable[[Dict[str, Doubles]], Union[Field, System]]

ROUNDED = 1e-6
"""Largest relative difference between given and actual parameters: grids and JAX round to single
precision."""


class Function(Protocol):
    """Function of arrays with a vector–Jacobian product."""

    def follow(self, *given: Doubles) -> Tuple[Doubles, ...]:
        """Returns the results."""

    def pull_back(self, *kept: Doubles) -> Tuple[Doubles, ...]:
        """Returns derivatives by the given arrays, from these arrays, the first result, and
        derivatives by the results."""


class PictureFunction(Function, Protocol):
    """Picture as a function of ends of rays, and of their power or the image of a background."""

    def shape(self, positions: Tuple[int, ...], values: Tuple[int, ...]) -> Tuple[int, ...]:
        """Returns the shape of the picture, or raises an error for shapes that do not fit."""


class Model(NamedTuple):
    """Rays through an index that flat lists of arrays define.

    A list contains samples, or parameters from which an index is built; then origins and
    directions."""

    rays: "Rays"
    build: Optional[Build]
    names: Tuple[str, ...]
    """Names of the parameters; empty for samples."""

    @property
    def arrays(self) -> int:
        """Number of arrays before the origins and directions."""
        return len(self.names) if self.build is not None else 1

    def follow(self, *given: Doubles) -> Tuple[Doubles, ...]:
        """Returns positions, directions and optical lengths of the ends."""
        ends = self.rays.with_starts(*given[self.arrays :]).forward(self._index(given))
        return ends.positions, ends.directions, ends.optical_lengths

    def pull_back(self, *kept: Doubles) -> Tuple[Doubles, ...]:
        """Returns derivatives by the given arrays, from these arrays, the positions of the ends,
        and derivatives by the ends.

        A ray without an end is NaN. A loss that leaves out this ray has a derivative by it of zero,
        or of zero times NaN; both count as zero."""
        *given, positions, by_positions, by_directions, by_lengths = kept
        lost = ~np.isfinite(positions).all(axis=1)
        by = (np.where(lost.reshape(-1, *[1] * (values.ndim - 1)), 0.0, values) for values in (by_positions, by_directions, by_lengths))
        rays = self.rays.with_starts(*given[self.arrays :])
        found = rays.vjp(self._index(given), **dict(zip(("positions", "directions", "optical_lengths"), by)))
        index = [found.field] if self.build is None else [found.parameters[name] for name in self.names]
        return (*index, found.origins, found.directions)

    def _index(self, given: Sequence[Doubles]) -> Union[Doubles, Field, System]:
        if self.build is None:
            return given[0]
        values = dict(zip(self.names, given))
        index = self.build(dict(values))
        if not isinstance(index, (Field, System)):
            raise GradError(f"build must return a Field or a System, not {type(index).__name__}")
        own = Layout(index, has_box=True).parameters()
        for name, value in values.items():
            if name not in own:
                raise GradError(f"the result of build has no parameter {name!r}: it has {', '.join(own) or 'none'}")
            if own[name].shape != value.shape or not np.allclose(own[name], value, rtol=ROUNDED, atol=ROUNDED**2):
                raise GradError(f"{name} is {value.tolist()} but the result of build has {own[name].tolist()}: build must use the parameter unchanged")
        return index


def torch_function(rays: "Rays", build: Optional[Build]) -> Callable[..., Any]:
    """Returns the function of CPU tensors for :meth:`morgana.grad.Rays.torch`."""
    torch = library("torch")
    follow = _differentiable_by_torch(torch)

    def ends(index: Any, origins: Any = None, directions: Any = None) -> Any:
        names, values = _flat(index, build)
        dtype = _widest(torch, (*values, origins, directions))
        tensors = [_tensor(torch, value, what) for value, what in zip(values, names or ("the index",))]
        own = zip(rays.starts, (origins, directions), ("origins", "directions"))
        starts = [_tensor(torch, kept if given is None else given, what) for kept, given, what in own]
        return follow(Model(rays, build, names), dtype, *tensors, *_checked(rays, build, tensors, starts, torch.broadcast_to))

    return ends


def torch_picture(model: PictureFunction) -> Callable[..., Any]:
    """Returns the function of CPU tensors for ``torch`` of screens and backgrounds."""
    torch = library("torch")
    follow = _differentiable_by_torch(torch)

    def picture(positions: Any, values: Any) -> Any:
        tensors = [_tensor(torch, given, what) for given, what in ((positions, "positions"), (values, "values"))]
        return follow(model, _widest(torch, (positions, values)), *tensors)[0]

    return picture


def _tensor(torch: Any, given: Any, what: str) -> Any:
    """Converts to a tensor, in double precision unless it is a tensor already: the type of the
    tensors determines the type of the results."""
    if not isinstance(given, torch.Tensor):
        return torch.tensor(grid_samples(given, what))
    if given.is_complex():
        raise TypeError(f"{what} must be an array of real numbers: elements of type {given.dtype}")
    return given


def _widest(torch: Any, given: Sequence[Any]) -> Any:
    """Returns the widest floating type of the tensors among the arguments, or PyTorch's default."""
    floating = [value.dtype for value in given if isinstance(value, torch.Tensor) and value.is_floating_point()]
    return functools.reduce(torch.promote_types, floating) if floating else torch.get_default_dtype()


def _differentiable_by_torch(torch: Any) -> Callable[..., Any]:
    """Returns ``apply(function, dtype, *tensors)`` for PyTorch: the results of a
    :class:`Function`, with a type."""

    def host(tensor: Any) -> Doubles:
        # Convert to double precision: NumPy has no bfloat16.
        return np.asarray(tensor.detach().cpu().double().numpy(), dtype=float)

    def one_by_one(function: Any, batch: int, axes: Sequence[Optional[int]], given: Sequence[Any]) -> Any:
        """Applies a function to each item of a batch of tensors, for ``torch.vmap``, and returns
        the results with their axes."""
        parts = [function(*(value if axis is None else value.select(axis, i) for value, axis in zip(given, axes))) for i in range(batch)]
        found = tuple(map(torch.stack, zip(*parts)))
        return found, (0,) * len(found)

    class Follow(torch.autograd.Function):  # type: ignore[misc, unused-ignore]
        @staticmethod
        def forward(function: Function, dtype: Any, *given: Any) -> Any:
            return tuple(torch.from_numpy(end).to(given[0].device, dtype) for end in function.follow(*map(host, given)))

        @staticmethod
        def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
            ctx.function, _, *given = inputs
            ctx.save_for_backward(*given, output[0])

        @staticmethod
        def backward(ctx: Any, *by: Any) -> Any:
            return (None, None, *PullBack.apply(ctx.function, *ctx.saved_tensors, *by))

        @staticmethod
        def vmap(info: Any, axes: Any, function: Function, dtype: Any, *given: Any) -> Any:
            return one_by_one(functools.partial(Follow.apply, function, dtype), info.batch_size, axes[2:], given)

    class PullBack(torch.autograd.Function):  # type: ignore[misc, unused-ignore]
        @staticmethod
        def forward(function: Function, *kept: Any) -> Any:
            return tuple(torch.from_numpy(np.asarray(value)).to(tensor) for value, tensor in zip(function.pull_back(*map(host, kept)), kept))

        @staticmethod
        def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
            """Stores nothing, because there are no second derivatives."""

        @staticmethod
        def backward(ctx: Any, *by: Any) -> Any:
            raise GradError("rays and pictures have only first derivatives: do not differentiate them again")

        @staticmethod
        def vmap(info: Any, axes: Any, function: Function, *kept: Any) -> Any:
            return one_by_one(functools.partial(PullBack.apply, function), info.batch_size, axes[1:], kept)

    return Follow.apply  # type: ignore[no-any-return, unused-ignore]


def jax_function(rays: "Rays", build: Optional[Build]) -> Callable[..., Any]:
    """Returns the function for :meth:`morgana.grad.Rays.jax`."""
    jax = library("jax")
    numpy = importlib.import_module("jax.numpy")

    def shapes(*given: Any) -> Any:
        *_, origins, directions = given
        return _shaped(jax, origins, directions, origins[:, 0])

    @functools.lru_cache(maxsize=None)
    def differentiable(names: Tuple[str, ...]) -> Callable[..., Any]:
        return _differentiable_by_jax(jax, Model(rays, build, names), shapes)

    def with_starts(index: Any, origins: Any = None, directions: Any = None) -> Any:
        names, given = _flat(index, build)
        values = [_real(numpy, value) for value in given]
        starts = [_real(numpy, own if start is None else start) for own, start in zip(rays.starts, (origins, directions))]
        return differentiable(names)(*values, *_checked(rays, build, values, starts, numpy.broadcast_to))

    return with_starts


def jax_picture(model: PictureFunction) -> Callable[..., Any]:
    """Returns the function for ``jax`` of screens and backgrounds."""
    jax = library("jax")
    numpy = importlib.import_module("jax.numpy")

    def shapes(positions: Any, values: Any) -> Any:
        return (jax.ShapeDtypeStruct(model.shape(positions.shape, values.shape), positions.dtype),)

    follow = _differentiable_by_jax(jax, model, shapes)

    def picture(positions: Any, values: Any) -> Any:
        return follow(_real(numpy, positions), _real(numpy, values))[0]

    return picture


def _shaped(jax: Any, *arrays: Any) -> Any:
    """Returns the shapes and types of arrays."""
    return tuple(jax.ShapeDtypeStruct(array.shape, array.dtype) for array in arrays)


def _real(numpy: Any, given: Any) -> Any:
    """Converts to real numbers, also from integers: the type of the arguments determines the type
    of the results."""
    array = numpy.asarray(given)
    return array.astype(numpy.result_type(array, float))


def _differentiable_by_jax(jax: Any, function: Function, shapes: Callable[..., Any]) -> Callable[..., Any]:
    """Returns a function of arrays for JAX. ``shapes`` gives the shapes and types of its results
    from these arrays."""
    numpy = importlib.import_module("jax.numpy")

    def called(run: Callable[..., Tuple[Doubles, ...]], expected: Any, *arrays: Any) -> Any:
        def on_host(*given: Any) -> Any:
            found = run(*(np.asarray(array, dtype=float) for array in given))
            return tuple(np.asarray(value, shape.dtype) for value, shape in zip(found, expected))

        if not any(isinstance(array, jax.core.Tracer) for array in arrays):
            # Call directly: a callback would wrap errors.
            return tuple(map(numpy.asarray, on_host(*arrays)))
        return jax.pure_callback(on_host, expected, *arrays, vmap_method="sequential")

    @jax.custom_vjp  # type: ignore[untyped-decorator, unused-ignore]
    def results(*given: Any) -> Any:
        return called(function.follow, shapes(*given), *given)

    def forward(*given: Any) -> Any:
        found = results(*given)
        return found, (*given, found[0])

    def backward(kept: Any, by: Any) -> Any:
        return called(function.pull_back, _shaped(jax, *kept[:-1]), *kept, *by)

    results.defvjp(forward, backward)
    return results  # type: ignore[no-any-return, unused-ignore]


def _checked(rays: "Rays", build: Optional[Build], values: Sequence[Any], starts: Sequence[Any], broadcast_to: Callable[..., Any]) -> Tuple[Any, Any]:
    """Returns origins, and a direction for each. Raises an error for shapes that do not match."""
    origins, directions = starts
    check_starts(tuple(origins.shape), tuple(directions.shape))
    if build is None:
        check_samples(tuple(values[0].shape), "the index", rays._box is not None)
    return origins, broadcast_to(directions, tuple(origins.shape))


def _flat(index: Any, build: Optional[Build]) -> Tuple[Tuple[str, ...], Tuple[Any, ...]]:
    """Returns names and arrays of the given index."""
    if build is None:
        if isinstance(index, (dict, Field, System)):
            raise GradError(f"expected samples of n, not {type(index).__name__}: for parameters of a field or a lens, give build")
        return (), (index,)
    if not isinstance(index, dict) or not index:
        raise GradError("parameters must be a dictionary with at least one array")
    return tuple(index), tuple(index.values())


def library(name: str, extra: Optional[str] = None) -> Any:
    """Imports an optional library, or raises an error that names its extra."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise GradError(f"this needs {name}: {advice(extra or name)}") from None
