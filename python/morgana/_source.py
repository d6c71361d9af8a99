"""Scenes from everything that describes a scene: a loaded scene, a file, or a dictionary."""

from __future__ import annotations

import os
from typing import Any, Dict, Mapping, Union

from ._mcx import load_mcx
from ._morgana import Scene
from ._scene import load_dict, load_file

Description = Union[Scene, str, "os.PathLike[str]", Mapping[str, Any]]
"""A scene, the path of a scene file, a dictionary as for :func:`load_dict`, or a configuration of
MCX as for :func:`load_mcx`."""

OF_MCX = {"vol", "prop", "shapes"}
"""Keys of configurations of MCX. Dictionaries of scenes have a ``type`` instead."""


def is_mcx(scene: Mapping[str, Any]) -> bool:
    """Returns true for a configuration of MCX."""
    return "type" not in scene and not OF_MCX.isdisjoint(scene)


def loaded(scene: Description, parameters: Mapping[str, Any]) -> Scene:
    """Returns a scene with values of parameters.

    Parameters of files and dictionaries are their ``<default>``s, parameters of a loaded scene the
    names of :meth:`Scene.parameters`. Of a configuration of MCX, they are its keys, or such
    names, which contain a dot.
    """
    if isinstance(scene, Scene):
        return scene.parameters().update(parameters) if parameters else scene
    if isinstance(scene, Mapping):
        return _of_mcx(scene, parameters) if is_mcx(scene) else load_dict(scene, **parameters)
    if isinstance(scene, (str, os.PathLike)):
        return load_file(scene, **parameters)
    raise TypeError(f"expected a Scene, the path of a scene file or a dictionary, found {type(scene).__name__}")


def _of_mcx(scene: Mapping[str, Any], parameters: Mapping[str, Any]) -> Scene:
    keys: Dict[str, Any] = {name: value for name, value in parameters.items() if "." not in name}
    names = {name: value for name, value in parameters.items() if "." in name}
    return loaded(load_mcx({**scene, **keys}), names)
