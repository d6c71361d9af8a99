"""Rays as functions that PyTorch and JAX differentiate: their reverse mode is :meth:`morgana.grad.Rays.vjp`."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Callable, Tuple, Type

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .grad import Rays

Doubles = NDArray[np.float64]


def torch_function(rays: "Rays", error: Type[Exception]) -> Callable[..., Any]:
    """Of tensors on the processor; see :meth:`morgana.grad.Rays.torch`."""
    torch = _library("torch", "torch", error)

    def host(tensor: Any) -> Doubles:
        return np.asarray(tensor.detach().cpu().numpy(), dtype=float)

    class Follow(torch.autograd.Function):  # type: ignore[misc, name-defined]
        @staticmethod
        def forward(ctx: Any, *given: Any) -> Any:
            ends = tuple(torch.from_numpy(end).to(given[0]) for end in follow(rays, *map(host, given)))
            ctx.save_for_backward(*given, ends[0])
            return ends

        @staticmethod
        @torch.autograd.function.once_differentiable  # type: ignore[untyped-decorator, unused-ignore]
        def backward(ctx: Any, *by: Any) -> Any:
            *given, positions = ctx.saved_tensors
            found = pull_back(rays, *map(host, (*given, positions, *by)))
            return tuple(torch.from_numpy(value).to(tensor) for value, tensor in zip(found, given))

    def ends(index: Any, origins: Any = None, directions: Any = None) -> Any:
        starts = [torch.tensor(own).to(index) if given is None else given for own, given in zip(rays.starts, (origins, directions))]
        return Follow.apply(index, *starts)

    return ends


def jax_function(rays: "Rays", error: Type[Exception]) -> Callable[..., Any]:
    """See :meth:`morgana.grad.Rays.jax`."""
    jax = _library("jax", "jax", error)
    numpy = importlib.import_module("jax.numpy")

    def shaped(*arrays: Any) -> Any:
        return tuple(jax.ShapeDtypeStruct(array.shape, array.dtype) for array in arrays)

    def called(function: Callable[..., Tuple[Doubles, ...]], shapes: Any, *arrays: Any) -> Any:
        def on_host(*given: Any) -> Any:
            found = function(rays, *map(_doubles, given))
            return tuple(np.asarray(value, shape.dtype) for value, shape in zip(found, shapes))

        return jax.pure_callback(on_host, shapes, *arrays, vmap_method="sequential")

    @jax.custom_vjp  # type: ignore[untyped-decorator, unused-ignore]
    def ends(index: Any, origins: Any, directions: Any) -> Any:
        return called(follow, shaped(origins, directions, origins[:, 0]), index, origins, directions)

    def forward(*given: Any) -> Any:
        found = ends(*given)
        return found, (*given, found[0])

    def backward(kept: Any, by: Any) -> Any:
        return called(pull_back, shaped(*kept[:3]), *kept, *by)

    ends.defvjp(forward, backward)

    def with_starts(index: Any, origins: Any = None, directions: Any = None) -> Any:
        starts = [numpy.asarray(own if given is None else given) for own, given in zip(rays.starts, (origins, directions))]
        return ends(numpy.asarray(index), *starts)

    return with_starts


def follow(rays: "Rays", index: Doubles, origins: Doubles, directions: Doubles) -> Tuple[Doubles, ...]:
    """Positions, directions and optical lengths of the ends."""
    ends = rays.with_starts(origins, directions).forward(index)
    return ends.positions, ends.directions, ends.optical_lengths


def pull_back(rays: "Rays", index: Doubles, origins: Doubles, directions: Doubles, positions: Doubles, *by: Doubles) -> Tuple[Doubles, ...]:
    """Derivatives by the index and the starts, given the positions of the ends. Where a ray has none, its ends are NaN: a loss that selects other rays
    has derivatives there that are zero, or zero times NaN."""
    lost = ~np.isfinite(positions).all(axis=1)
    by = tuple(np.where(lost.reshape(-1, *[1] * (values.ndim - 1)), 0.0, values) for values in by)
    found = rays.with_starts(origins, directions).vjp(index, positions=by[0], directions=by[1], optical_lengths=by[2])
    return found.field, found.origins, found.directions


def _doubles(array: Any) -> Doubles:
    return np.asarray(array, dtype=float)


def _library(module: str, extra: str, error: Type[Exception]) -> Any:
    try:
        return importlib.import_module(module)
    except ImportError:
        raise error(f'this needs {module}: pip install "morgana-render[{extra}]"') from None
