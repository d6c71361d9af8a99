"""Small pictures of scenes in notebooks."""

from __future__ import annotations

import warnings

from ._errors import Error
from ._morgana import Scene
from ._pictures import caption, thumbnail
from ._render import render

SIDE = 128
"""Longest side of the picture of a scene, in pixels."""
SECONDS = 2.0
"""Maximum time of the render of a picture."""


def scene_html(scene: Scene) -> str:
    """Returns a picture of one sample per pixel, if the scene has a camera, and the
    representation of the scene."""
    return ("" if scene.meters else _picture(scene)) + caption(repr(scene).strip("<>"))


def _picture(scene: Scene) -> str:
    """Returns a small picture of the scene; an empty text if it cannot be rendered smaller, or in
    time."""
    shrink = max(max(scene.size) / SIDE, 1.0)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            parameters = scene.parameters()
            for name, length in zip(("width", "height"), scene.size):
                for known in parameters:
                    if known.endswith(f"film.{name}"):
                        parameters[known] = max(1, round(length / shrink))
            result = render(parameters.update(), spp=1, time=SECONDS)
        return thumbnail(result.image, result.channels) if result.samples.any() else ""
    except (Error, MemoryError):
        return ""


# Scene is a compiled class.
setattr(Scene, "_repr_html_", scene_html)
