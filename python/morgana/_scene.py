"""Loading scenes."""

from __future__ import annotations

import os
import warnings
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, TypeVar, Union

import numpy as np

from . import _checks as checks
from . import _morgana
from ._errors import Diagnostic, RenderError, SceneWarning
from ._limits import Overrides
from ._morgana import Field, Scene

Define = Union[str, float, bool]
Made = TypeVar("Made", Scene, Field)


def load_file(
    path: Union[str, "os.PathLike[str]"],
    /,
    *,
    integrator: Optional[str] = None,
    sampler: Optional[str] = None,
    adaptive: bool = False,
    undisturbed: bool = False,
    silence: Union[str, Sequence[str]] = (),
    memory: Optional[int] = None,
    **parameters: Define,
) -> Scene:
    """Read a scene file (docs/scene-format.md).

    The file is JSON if its name ends in ``.json``, else XML. A :class:`SceneWarning` reports each
    doubtful property of the scene. A scene is pickled as its absolute path, and unpickling reads
    the file again.

    Parameters
    ----------
    path : path_like
        The file.
    integrator : str, optional
        Integrator instead of the scene's: ``auto``, ``path``, ``particle``, ``bdpt``, ``vcm``,
        ``photon``, ``sppm`` or ``aov``. Parameters that all integrators have keep the scene's
        values.
    sampler : str, optional
        Sampler instead of the scene's: ``independent``, ``ldsampler``, or ``ldsampler:64`` with
        replicates of 64 samples (a power of two up to 1024).
    adaptive : bool, optional
        Give noisy pixels more samples, even if the scene's sampler does not request it.
    undisturbed : bool, optional
        Give media with a varying index a constant index: the scene without its flow. The constant
        is the reference of the volume (``n0``, ``reference``), if it has one. Otherwise it is the
        index of the surroundings if the boundary does not refract, else the mean of the index over
        the boundary.
    silence : str or sequence of str, optional
        Names of checks whose warnings are omitted, as they stand in brackets in the warnings, such
        as ``"thin_beam"``.
    memory : int, optional
        Maximum number of bytes of each data file in memory, regardless of its size on disk. By
        default 2 GiB, or ten times the size of the file plus 64 MiB if that is more
        (docs/security.md).
    **parameters : str, float or bool
        Values of the scene's parameters (``<default>``), as with ``-D name=value`` of the program.

    Returns
    -------
    Scene
        The scene, ready to render.

    Raises
    ------
    SceneError
        The scene cannot be read or used; its ``diagnostics`` give reasons and places.

    Examples
    --------
    >>> scene = morgana.load_file("scenes/grid_lens.xml", width=96, height=72)
    """
    instead = _instead(integrator, sampler, adaptive, undisturbed, silence, memory)
    scene = _morgana.load_file(os.fspath(path), _defines(parameters), instead)
    return _warned(scene)


def load_dict(
    scene: Mapping[str, Any],
    /,
    *,
    integrator: Optional[str] = None,
    sampler: Optional[str] = None,
    adaptive: bool = False,
    undisturbed: bool = False,
    silence: Union[str, Sequence[str]] = (),
    memory: Optional[int] = None,
    **parameters: Define,
) -> Scene:
    """Make a scene from a dictionary, as Mitsuba's ``load_dict`` does.

    Arrays may have any strides and any real type of numbers. Reading the scene copies each array,
    and converts the copy to the form that rays need, in single precision. The first copy is freed
    when this function returns. Later changes of the arrays do not affect the scene. The dictionary
    is kept for pickling.

    Parameters
    ----------
    scene : mapping
        Dictionary ``{"type": "scene", ...}`` with the content of a JSON scene
        (docs/scene-format.md#json-scenes). Volumes (``data``), meshes (``type`` ``mesh``), matrices
        and points may be arrays. Relative file names start from the current folder.
    integrator : str, optional
        As for :func:`load_file`.
    sampler : str, optional
        As for :func:`load_file`.
    adaptive : bool, optional
        As for :func:`load_file`.
    undisturbed : bool, optional
        As for :func:`load_file`.
    silence : str or sequence of str, optional
        As for :func:`load_file`.
    memory : int, optional
        As for :func:`load_file`.
    **parameters : str, float or bool
        Values of the scene's ``"parameters"``.

    Returns
    -------
    Scene
        The scene, ready to render.

    Raises
    ------
    SceneError
        The scene cannot be used. Places in it are written as ``scene["ball"]["radius"]``.
    TypeError
        A value of a type that scenes cannot contain.
    ValueError
        A masked array that hides elements.

    Examples
    --------
    >>> scene = morgana.load_dict({
    ...     "type": "scene",
    ...     "sensor": {"type": "perspective", "fov": 40, "film": {"type": "hdrfilm", "width": 64, "height": 48}},
    ...     "sky": {"type": "constant"},
    ... })
    """
    instead = _instead(integrator, sampler, adaptive, undisturbed, silence, memory)
    return _warned(_morgana.load_dict(checks.mapping(scene, "a scene"), _defines(parameters), instead))


def export(
    scene: Union[str, "os.PathLike[str]", Mapping[str, Any]],
    path: Union[str, "os.PathLike[str]"],
    /,
    **parameters: Define,
) -> List[str]:
    """Write a scene in the format of Mitsuba 3: XML, or JSON if the name ends in ``.json``.

    Scenes of Mitsuba 0.5 and 0.6 and dictionaries become one file that ``mitsuba.load_file`` reads,
    unless they use features that only morgana has. Paths of data files become relative to the new
    file.

    Parameters
    ----------
    scene : path_like or mapping
        A scene file, or a dictionary as for :func:`load_dict`.
    path : path_like
        The file to write, ``.xml`` or ``.json``.
    **parameters : str, float or bool
        Values of the scene's parameters.

    Returns
    -------
    list of str
        Features of the scene that Mitsuba 3 does not have, such as ``'ior' of medium
        'homogeneous'``.

    Raises
    ------
    SceneError
        The scene cannot be read.
    ValueError
        An array, which XML cannot contain, or another extension.
    FileError
        The file cannot be written.

    Examples
    --------
    >>> morgana.export("scenes/luneburg_fog.xml", "copy.xml")
    ["'ior' of medium 'homogeneous'", "emitter 'collimated'", "volume 'luneburg'"]
    """
    output = os.fspath(path)
    if not output.lower().endswith((".xml", ".json")):
        raise ValueError(f"path must end in .xml or .json, but it is {output!r}")
    defines = _defines(parameters)
    if isinstance(scene, Mapping):
        return _morgana.export_dict(checks.mapping(scene, "a scene"), defines, output)
    return _morgana.export_file(os.fspath(scene), defines, output)


def load_field(volume: Mapping[str, Any], *, wavelength: Optional[float] = None) -> Field:
    """Make a refractive-index field from a dictionary that describes a volume.

    Parameters
    ----------
    volume : mapping
        A volume for the ``ior`` of a scene (docs/scene/ior.md).
    wavelength : float, optional
        Wavelength in nm, > 0, for an index that depends on it, such as ``cauchy``, ``sellmeier``,
        or the index of air.

    Returns
    -------
    Field
        The field, in the coordinates that its ``to_world`` gives.

    Raises
    ------
    SceneError
        A volume that is not a refractive index, or that depends on the wavelength if none is given.
    ValueError
        A wavelength that is not positive.

    Examples
    --------
    >>> morgana.load_field({"type": "luneburg", "radius": 2}).n([0, 0, 0])
    array(1.41421356)
    >>> morgana.load_field({"type": "cauchy", "a": 1.5, "b": 0.004}, wavelength=500).n([0, 0, 0])
    array(1.516)
    >>> morgana.load_field({"type": "bspline", "data": 1 + 0.01 * np.random.rand(8, 8, 8), "placement": "nodes"})
    <morgana.Field, varying>
    """
    if wavelength is not None and not 0 < wavelength < float("inf"):
        raise ValueError(f"a wavelength must be positive, in nm, not {wavelength}")
    field = _morgana.load_field(checks.mapping(volume, "a volume"), wavelength)
    _warn(field._warnings)
    return field


def remake(recipe: Tuple[str, Any, Any, Overrides], expected: str) -> Scene:
    """Recreate a pickled scene.

    Raises:
        The files, or the arrays of the dictionary, have changed since pickling.
        The files cannot be read.
    """
    scene = _made(recipe)
    return _unchanged(scene, scene.hash, expected)


def _made(recipe: Tuple[str, Any, Any, Overrides]) -> Scene:
    """Loads a scene by its recipe. The recipe of a scene with other values of parameters contains
    the recipe of the scene before, and the values."""
    kind, source, given, instead = recipe
    if kind == "changed":
        return _morgana.scene_with_values(_made(source), given)
    if kind == "file":
        return _morgana.load_file(os.fspath(source), given, instead)
    return _morgana.load_dict(source, given, instead)


def remake_field(volume: Dict[str, Any], expected: str, wavelength: Optional[float] = None) -> Field:
    """Recreate a pickled field. Raises the errors of :func:`remake`."""
    field = _morgana.load_field(volume, wavelength)
    return _unchanged(field, field._hash, expected)


def field_of(scene: Scene, name: str) -> Field:
    """Return the field of a medium, for unpickling."""
    return scene.fields[name]


def _unchanged(made: Made, found: str, expected: str) -> Made:
    if found != expected:
        raise RenderError(f"{made!r} differs from the pickled one: its files or arrays have changed")
    return made


def _defines(parameters: Dict[str, Define]) -> List[Tuple[str, str]]:
    return [(name, _text(name, value)) for name, value in parameters.items()]


def _instead(
    integrator: Optional[str],
    sampler: Optional[str],
    adaptive: bool,
    undisturbed: bool,
    silence: Union[str, Sequence[str]],
    memory: Optional[int],
) -> Overrides:
    return {
        "integrator": checks.text(integrator, "integrator"),
        "sampler": checks.text(sampler, "sampler"),
        "adaptive": checks.truth(adaptive, "adaptive"),
        "undisturbed": checks.truth(undisturbed, "undisturbed"),
        "silence": checks.texts(silence, "silence"),
        "memory": checks.optional_whole(memory, "memory", 1),
    }


def _text(name: str, value: Define) -> str:
    if isinstance(value, (bool, np.bool_)):
        return str(value).lower()
    if isinstance(value, (str, int, float, np.integer, np.floating)):
        return str(value)
    raise TypeError(f"the parameter {name!r} is {value!r} but must be a text, a number or a boolean")


def _warned(scene: Scene) -> Scene:
    _warn(scene.warnings, deeper=1)
    return scene


def _warn(doubts: List[Diagnostic], deeper: int = 0) -> None:
    for doubt in doubts:
        warnings.warn(str(doubt), SceneWarning, stacklevel=3 + deeper)
