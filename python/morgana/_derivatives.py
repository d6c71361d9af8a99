"""Derivatives of pictures and of readings by parameters of their scenes."""

from __future__ import annotations

import dataclasses
import warnings
from typing import Any, Callable, Dict, Iterable, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _checks as checks
from . import _morgana
from ._errors import RenderError, SceneWarning
from ._estimate import Axes, Data, Estimate, Origin, own_origin, run_with, unnamed
from ._limits import By
from ._morgana import Scene
from ._numbers import numbers
from ._progress import Bar
from ._regions import VOXELS, Row, added, by_medium, row_of, rows_of, unique
from ._render import Progress, limits, render
from ._result import Result
from ._values import Fields

Doubles = NDArray[np.float64]
Weights = Union[ArrayLike, Mapping[str, ArrayLike]]

NO_READING = "the meters have no reading"


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Derivative(Data, Fields):
    """Derivative of a loss by a parameter of a scene.

    Derivatives compute like NumPy arrays, with their errors: see :class:`Estimate`. Their axes are
    ``z``, ``y``, ``x`` of samples or pixels, ``label``, ``item`` of other values in a row,
    ``parameter`` of an index, and ``channel``. For a ``jacobian``, the axes of the reading come
    first; an axis of the parameter with an equal name is ``parameter.z``, for example.

    Examples
    --------
    >>> by_albedo = morgana.derivatives(scene, ["fog.albedo"], weights)["fog.albedo"]
    >>> step = 0.01 * by_albedo
    >>> step.mean, step.error
    """

    value: Doubles
    """Values, float64. The shape is (channels,) for a parameter with one number, (labels,
    channels), (z, y, x, channels), or (y, x, channels) for an image. For a ``jacobian``, the axes
    of the reading come first. For an index, which all channels share: (z, y, x) of samples,
    (parameters,) of another field, or the shape of its parameter."""
    error: Doubles
    """Standard errors, of the same shape, from at most 32 batches of samples."""
    axes: Optional[Axes] = None
    """Edges of the bins by axis; ``None`` for axes without names."""
    names: Dict[str, List[Any]] = dataclasses.field(default_factory=dict)
    """Names of the items of axes without edges."""
    _origin: Origin = dataclasses.field(init=False, default_factory=own_origin)

    def _estimate(self) -> Estimate:
        axes = unnamed(np.ndim(self.value)) if self.axes is None else self.axes
        made: Estimate = Estimate(self.value, self.error, axes, names=self.names)._from(self._origin)
        return made

    def _with(self, seed: int) -> "Derivative":
        """Sets the seed of the run, right after the construction."""
        # Random numbers of derivatives are independent of the random numbers of renders.
        object.__setattr__(self, "_origin", run_with(seed, "the run of derivatives"))
        return self

    def __repr__(self) -> str:
        shape = " × ".join(map(str, self.value.shape))
        return f"<morgana.Derivative of {shape}, norm {float(np.linalg.norm(self.value)):.5g}>"


def derivatives(
    scene: Scene,
    parameters: Iterable[str],
    weights: Union[Weights, Callable[[Result], Weights]],
    *,
    spp: Optional[int] = None,
    particles: Optional[int] = None,
    seed: int = 0,
    integrator: Optional[str] = None,
    threads: Optional[int] = None,
    progress: Progress = False,
) -> Dict[str, Derivative]:
    """Unbiased derivatives of a loss of a picture, or of readings, by parameters of the scene.

    The loss is given by its derivatives by all values of the picture, or of the readings: the
    *weights*. The integrator, ``path``, ``particle`` or ``bdpt``, samples the paths; for meters,
    they are the paths of particles. The paths are held fixed while their contributions change. The
    run time hardly depends on the number of parameters. The random numbers are independent of the
    random numbers of ``render`` with an equal seed. Nonlinear losses require this.

    Parameters are named after objects of the scene; coefficients are per unit length, and include
    the medium's ``scale``:

    * ``MEDIUM.sigma_t`` (at constant albedo), ``MEDIUM.albedo``, ``MEDIUM.sigma_a`` (at constant
      ``sigma_s``), ``MEDIUM.sigma_s`` (at constant ``sigma_a``), ``MEDIUM.g`` of the phase function
      ``hg``.
    * ``OBJECT.reflectance``, ``.diffuse_reflectance``, ``.specular_reflectance``,
      ``.specular_transmittance``, ``.transmittance`` and ``.base_color``: the colours of its bsdf.
      They are one colour, all pixels of a ``bitmap``, all vertices or faces of a coloured mesh, or
      the two colours of a ``checkerboard``.
    * ``EMITTER.emission``: a factor, 1, on all light of the emitter.
    * ``EMITTER.radiance``: the values of its light. They are one radiance, intensity or irradiance,
      or power of a beam; the pixels of an image, including its scale, which are irradiances for a
      beam or fibre; the voxels of a volume; the ``radiance`` of an emitting medium.
    * ``exposure``: a factor, 1, on all measured values.

    A label has the name of its region in records: ``head: label 2.sigma_a``. ``head: labels 1,
    2.sigma_a`` has a row for each label of a medium of several labels, which share an index.
    ``head: voxels.sigma_a`` and ``.sigma_s`` have the derivative by each voxel of a volume of
    labels, (z, y, x).

    ``MEDIUM.ior`` is the refractive index of a medium, which may scatter: all samples of n of a
    grid, or all parameters of another field in a row. ``MEDIUM.ior.delta`` is one of its
    parameters, with its name in ``morgana.grad.parameters``. These derivatives use separate paths.
    Their vertices move with the index, and they reach emitters only by random hits. The scene needs
    a camera, and extinctions and albedos that are uniform or trilinear grids. Its light must have
    no edges: a ``constant`` or ``envmap``, or a ``rectangle`` with a ``bitmap`` that is dark at its
    edge. Other scenes raise an error. Weights may be given for layers by bounces. A
    ``SceneWarning`` gives the number of lost paths.

    Parameters
    ----------
    scene : Scene
        A scene with a camera, or with meters.
    parameters : iterable of str
        Names of the parameters, such as ``["smoke.sigma_t", "wall.reflectance"]``.
    weights : array_like, mapping or callable
        Derivatives of the loss by the picture, (height, width, channels). For a film with layers,
        also a mapping from names of layers to such arrays; layers that it leaves out have weight
        zero. For meters, a mapping from names of readings, as in ``Result.meters``, to arrays of
        their shapes. Or a function that makes any of these from a ``Result``: it is called with a
        render of this number of samples or particles.
    spp : int, optional
        Samples per pixel, ≥ 2; by default the scene's number.
    particles : int, optional
        Number of particles, ≥ 2; by default the scene's number. For scenes with meters.
    seed : int, optional
        Seed of the random numbers, 0 to 2⁶⁴ − 1. The same seed gives the same numbers, bit for bit,
        for any number of threads.
    integrator : {"path", "particle", "bdpt"}, optional
        Integrator instead of the scene's, for pictures. It computes the picture for the weights,
        and all derivatives except by an index, which use separate paths.
    threads : int, optional
        Number of threads, ≥ 1; by default the number of CPU cores.
    progress : bool or callable, optional
        ``True`` for a progress bar, or a function that is called with the completed fraction, 0 to
        1.

    Returns
    -------
    dict of str to Derivative
        Derivatives by the names of the parameters.

    Raises
    ------
    RenderError
        A parameter that the scene does not have, or with a derivative that paths cannot find.
        Weights that have a wrong shape or are not finite. A scene whose picture is blurred
        (``photon``, ``sppm``, ``vcm``) or shows no light (``aov``). An index in a scene in which
        light is discontinuous as rays move.
    TypeError
        An argument of another type.
    KeyboardInterrupt
        Ctrl-C, also during the render for the weights.

    Examples
    --------
    >>> residual = lambda result: 2 * (result.image - measured) / measured.size
    >>> found = morgana.derivatives(scene, ["ball.sigma_t"], residual, spp=64)
    >>> found["ball.sigma_t"].value, found["ball.sigma_t"].error
    """
    checks.scene(scene)
    requested = by_medium(scene, _names(parameters))
    names = unique(requested.values())
    wanted = limits(scene, spp, particles, seed, integrator, threads)
    indices = [name for name in names if f"{name}.".find(".ior.") > 0]
    others = [name for name in names if name not in indices]
    by: By = {"parameters": others, "integrator": integrator}
    if indices:
        _morgana.check_index_derivatives(scene, indices, isinstance(weights, Mapping))
    if others or integrator is not None:
        # Check the integrator for derivatives by an index, too.
        _morgana.check_derivatives(scene, wanted, by)
    if callable(weights):
        rendered = render(scene, spp=spp, particles=particles, seed=seed, integrator=integrator, threads=threads)
        if rendered.stopped == "interrupted":
            raise KeyboardInterrupt
        weights = weights(rendered)
    flat, layered = _of_readings(scene, weights) if scene.meters else _of_picture(scene, weights)
    found: Dict[str, Tuple[Doubles, Doubles]] = {}
    if indices:
        with Bar(scene, wanted["samples"], None, progress) as tick:
            by_indices, (paths, lost), dominated = _morgana.differentiate_index(scene, wanted, indices, flat[0], layered, tick)
        found.update(zip(indices, by_indices))
        if lost:
            warnings.warn(f"{lost} of {paths} paths were lost, and what they would bring is missing from derivatives by an index", SceneWarning, stacklevel=2)
        if dominated:
            message = "single batches of samples make nearly all of the scatter of derivatives by an index, whose values and errors are not to be trusted"
            warnings.warn(f"{message}: rays that total reflection catches bring more the longer they go, so give paths a max_depth", SceneWarning, stacklevel=2)
    if others:
        with Bar(scene, wanted["samples"], None, progress) as tick:
            found.update(zip(others, _morgana.differentiate(scene, wanted, by, flat, layered, tick)))
    return {name: _row(scene, name, added(found, parameters), of, {})._with(seed) for name, (parameters, of) in requested.items()}


def jacobian(
    scene: Scene,
    parameters: Iterable[str],
    reading: str,
    *,
    particles: Optional[int] = None,
    seed: int = 0,
    threads: Optional[int] = None,
    progress: Progress = False,
) -> Dict[str, Derivative]:
    """Unbiased derivatives of every bin of a reading by parameters: rows of a Jacobian.

    The bins of a detector are its positions, directions and time gates; the columns are the voxels
    of the medium. All rows come from the same particles, and the run time depends on the number of
    bins only if particles pass several bins. Parameters and random numbers are as in
    ``derivatives``.

    Parameters
    ----------
    scene : Scene
        A scene with meters.
    parameters : iterable of str
        Names of the parameters, such as ``["tissue.sigma_a", "tissue.sigma_s"]``.
    reading : str
        Name of the reading in ``Result.meters``.
    particles : int, optional
        Number of particles, ≥ 2; by default the scene's number.
    seed : int, optional
        Seed of the random numbers, 0 to 2⁶⁴ − 1. The same seed gives the same numbers, bit for bit,
        for any number of threads.
    threads : int, optional
        Number of threads, ≥ 1; by default the number of CPU cores.
    progress : bool or callable, optional
        ``True`` for a progress bar, or a function that is called with the completed fraction, 0 to
        1.

    Returns
    -------
    dict of str to Derivative
        Derivatives by the names of the parameters. The axes of the reading come first, then the
        axes of the parameter, then channels. Each channel of the reading depends only on the same
        channel of the parameter.

    Raises
    ------
    RenderError
        A parameter that the scene does not have, or with a derivative that particles cannot find. A
        reading that the scene does not have.
    MemoryError
        The numbers do not fit into memory.
    TypeError
        An argument of another type.

    Examples
    --------
    >>> rows = morgana.jacobian(scene, ["tissue.sigma_a"], "binned_power", particles=1_000_000)["tissue.sigma_a"]
    >>> rows.value.shape                                   # side, gates, positions, z, y, x, channels
    (2, 20, 8, 16, 32, 32, 1)
    """
    checks.scene(scene)
    requested = by_medium(scene, _names(parameters))
    names = unique(requested.values())
    wanted = limits(scene, None, particles, seed, None, threads)
    readings = [name for name, _ in scene._readings]
    _known([reading], readings, NO_READING, "the scene has no meters")
    by: By = {"parameters": names, "integrator": None}
    with Bar(scene, wanted["samples"], None, progress) as tick:
        found = _morgana.jacobian(scene, wanted, by, readings.index(reading), tick)
    known = dict(zip(names, found))
    # The axes of the reading come first, except channels, which come last.
    own = [axis for axis in dict(scene._readings)[reading] if axis[0] != "channel"]
    first = {axis: None if edges is None else np.array(edges) for axis, _, edges, _ in own}
    items: Dict[str, List[Any]] = {axis: list(of) for axis, _, _, of in own if of is not None}
    rows = {name: _row(scene, name, added(known, parameters), of, first) for name, (parameters, of) in requested.items()}
    return {name: row._replace(names={**items, **row.names})._with(seed) for name, row in rows.items()}


def _row(scene: Scene, name: str, found: Tuple[Doubles, Doubles], of: Optional[Row], first: Axes) -> Derivative:
    """Returns the derivative by a parameter, or by a label's row of it, after the axes of a
    reading."""
    value, error = (row_of(values, of, name, len(first)) for values in found)
    return Derivative(value, error, *_axes(scene, name, value.shape, first))


def _axes(scene: Scene, name: str, shape: Tuple[int, ...], first: Axes) -> Tuple[Axes, Dict[str, List[Any]]]:
    """Returns the axes of a derivative after the axes of a reading, and the names of their
    items."""
    by_index = f"{name}.".find(".ior.") > 0
    count = len(shape) - len(first) - (not by_index)
    labels = [label for label, row in rows_of(scene).items() if VOXELS not in name and name.startswith(f"{row.medium}.")]
    alone = "parameter" if by_index else "label" if (len(labels),) == shape[len(first) : len(first) + 1] else "item"
    own = {0: [], 1: [alone], 2: ["y", "x"], 3: ["z", "y", "x"]}.get(count, [f"axis_{i}" for i in range(count)])
    axes = {**first, **{f"parameter.{axis}" if axis in first else axis: None for axis in own}}
    names: Dict[str, List[Any]] = {"label": labels} if "label" in own else {}
    if not by_index:
        axes["channel"] = None
        if shape[-1] == len(scene.channels):
            names["channel"] = list(scene.channels)
    return axes, names


def _names(parameters: Iterable[str]) -> List[str]:
    names = list(parameters) if isinstance(parameters, Iterable) and not isinstance(parameters, str) else None
    if names is None or not all(isinstance(name, str) for name in names):
        raise TypeError(f"parameters are {checks.shown(parameters if names is None else names)} but must be a list of names")
    if not names:
        raise RenderError("parameters are empty: name at least one, such as 'smoke.sigma_t'")
    return names


def _checked(values: ArrayLike, what: str, shape: Tuple[int, ...], of: str) -> Doubles:
    """Returns weights as a flat array."""
    array = numbers(values, what)
    if array.shape != shape:
        raise RenderError(f"{what} have shape {array.shape} but must have the shape of {of}, {shape}")
    if not np.isfinite(array).all():
        raise RenderError(f"{what} are not all finite: the loss must have a derivative by every value of {of}")
    return np.ascontiguousarray(array.ravel())


def _known(names: Iterable[str], known: Sequence[str], what: str, none: str) -> None:
    unknown = [name for name in names if name not in known]
    if unknown:
        there_are = f"there are {', '.join(known[:8])}{', …' * (len(known) > 8)}" if known else none
        raise RenderError(f"{what} {unknown[0]!r}: {there_are}")


def _of_picture(scene: Scene, weights: Weights) -> Tuple[List[Doubles], bool]:
    """Returns the weights as a flat array, and True if they are weights of all layers."""
    width, height = scene.size
    shape = (height, width, len(scene.channels))
    if not isinstance(weights, Mapping):
        return [_checked(weights, "weights", shape, "the picture")], False
    layers = scene._layers
    _known(weights, layers, "the picture has no layer", "its film tells no light apart")
    all_weights = np.zeros((len(layers), int(np.prod(shape))))
    for name, values in weights.items():
        all_weights[layers.index(name)] = _checked(values, f"weights of {name!r}", shape, "the picture")
    return [all_weights.ravel()], True


def _of_readings(scene: Scene, weights: Weights) -> Tuple[List[Doubles], bool]:
    """Returns the weights of each reading as a flat array, empty for readings without weights."""
    readings = [(name, tuple(size for _, size, _, _ in axes)) for name, axes in scene._readings]
    if not isinstance(weights, Mapping):
        raise TypeError(f"weights of readings must be a dictionary by names of readings: {', '.join(name for name, _ in readings)}")
    _known(weights, [name for name, _ in readings], NO_READING, "there is none")

    def of(name: str, shape: Tuple[int, ...]) -> Doubles:
        if name not in weights:
            return np.zeros(0)
        return _checked(weights[name], f"weights of {name!r}", shape, "the reading")

    return [of(name, shape) for name, shape in readings], False
