"""Loading scenes."""

from __future__ import annotations

import os
import warnings
from typing import Any, Dict, List, Mapping, Optional, Tuple, TypeVar, Union

from . import _morgana
from ._errors import RenderError, SceneWarning
from ._limits import Instead
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
    memory: Optional[int] = None,
    **parameters: Define,
) -> Scene:
    """Read a scene file: JSON if its name ends in ``.json``, else XML (docs/scene-format.md).

    Args:
        path: The file.
        integrator: Estimator in place of the scene's: ``path``, ``particle``, ``bdpt``, ``photon``, ``sppm`` or ``aov``.
            What all have in common stays as the scene has it.
        sampler: Sampler in place of the scene's: ``independent``, ``ldsampler``, or ``ldsampler:64`` with larger replicates.
        adaptive: Give noisy pixels more of the samples, even if the scene's sampler does not ask for it.
        memory: Bytes that each data file may take once it is read, however small it is: 2 GiB by default, or ten times
            the file and 64 MiB if that is more (docs/security.md).
        **parameters: Values for the scene's parameters (``<default>``), as ``-D name=value`` of the program.

    Raises:
        SceneError: The scene cannot be used; its ``diagnostics`` say why and where.

    What is doubtful about the scene is told as :class:`SceneWarning`. A scene is pickled as its absolute path, and read again.
    """
    instead = _instead(integrator, sampler, adaptive, memory)
    scene = _morgana.load_file(os.fspath(path), _defines(parameters), instead)
    return _warned(scene)


def load_dict(
    scene: Mapping[str, Any],
    /,
    *,
    integrator: Optional[str] = None,
    sampler: Optional[str] = None,
    adaptive: bool = False,
    memory: Optional[int] = None,
    **parameters: Define,
) -> Scene:
    """Make a scene of a dictionary, as Mitsuba's ``load_dict`` does.

    Args:
        scene: ``{"type": "scene", ...}``: what a JSON scene says (docs/scene-format.md#json-scenes), with arrays for
            volumes (``data``), meshes (``type`` ``mesh``), matrices and points. Arrays may have any strides and any
            type of numbers. Each is copied once while the scene is read, and again into the form in which rays need it,
            in single precision; the first copy is freed when this function returns. Later changes of the arrays do not
            change the scene. Relative names of files start from the current folder. The dictionary is kept for pickling.
        integrator, sampler, adaptive, memory: As for :func:`load_file`.
        **parameters: As for :func:`load_file`, for the scene's ``"parameters"``.

    Raises:
        SceneError: The scene cannot be used; places are such as ``scene["ball"]["radius"]``.
        TypeError: A value of a type that no scene can have.
    """
    instead = _instead(integrator, sampler, adaptive, memory)
    return _warned(_morgana.load_dict(dict(scene), _defines(parameters), instead))


def load_field(volume: Mapping[str, Any]) -> Field:
    """Make a refractive-index field of a dictionary that describes a volume, such as
    ``{"type": "luneburg", "radius": 2}`` or ``{"type": "bspline", "data": array, "placement": "nodes"}``.

    Raises:
        SceneError: A volume that is no refractive index.
    """
    return _morgana.load_field(dict(volume))


def remake(recipe: Tuple[str, Any, List[Tuple[str, str]], Instead], expected: str) -> Scene:
    """Make a scene again that was pickled.

    Raises:
        RenderError: Its files, or the arrays of its dictionary, have changed since it was made.
        SceneError: They cannot be read.
    """
    kind, source, defines, instead = recipe
    if kind == "file":
        scene = _morgana.load_file(os.fspath(source), defines, instead)
    else:
        scene = _morgana.load_dict(source, defines, instead)
    return _unchanged(scene, scene.hash, expected)


def remake_field(volume: Dict[str, Any], expected: str) -> Field:
    """Make a field again that was pickled. It raises what :func:`remake` does."""
    field = load_field(volume)
    return _unchanged(field, field._hash, expected)


def field_of(scene: Scene, name: str) -> Field:
    """The field of a medium, when that is unpickled."""
    return scene.fields[name]


def _unchanged(made: Made, found: str, expected: str) -> Made:
    if found != expected:
        raise RenderError(f"{made!r} is not what was pickled: its files or arrays have changed since it was made")
    return made


def _defines(parameters: Dict[str, Define]) -> List[Tuple[str, str]]:
    return [(name, _text(value)) for name, value in parameters.items()]


def _instead(
    integrator: Optional[str], sampler: Optional[str], adaptive: bool, memory: Optional[int]
) -> Instead:
    return {"integrator": integrator, "sampler": sampler, "adaptive": adaptive, "memory": memory}


def _text(value: Define) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _warned(scene: Scene) -> Scene:
    for doubt in scene.warnings:
        warnings.warn(str(doubt), SceneWarning, stacklevel=3)
    return scene
