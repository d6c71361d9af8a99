"""Small pictures of scenes in notebooks: a render of what a camera sees, or the meters and media."""

from __future__ import annotations

import html
import warnings
from typing import Any, Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from . import _morgana
from ._errors import Error
from ._morgana import Scene
from ._pictures import LABELS, caption, label_colour, label_map, thumbnail
from ._render import render

SIDE = 128
"""Longest side of the picture of a scene, in pixels."""
SECONDS = 2.0
"""Maximum time of the render of a picture."""
MAX_ROWS = 12
"""Maximum number of rows of a table of media or meters."""

COEFFICIENTS = ("sigma_a", "sigma_s", "sigma_t", "albedo", "g", "ior", "tissue", "material")
"""Columns of the table of media. Each appears if a medium states it."""

Row = Tuple[str, str, Any, bool]


class Medium(NamedTuple):
    """A medium or a label, with the coefficients that the scene states."""

    name: str
    coefficients: Dict[str, str]
    label: Optional[int] = None
    """Number of the label in the picture of labels."""


def scene_html(scene: Scene) -> str:
    """Returns a picture of one sample per pixel if the scene has a camera, or the labels, meters
    and media of a scene with meters, and the representation of the scene."""
    return (_measured(scene) if scene.meters else _picture(scene)) + caption(repr(scene).strip("<>"))


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


def _measured(scene: Scene) -> str:
    """Returns a section through labels, and tables of media and meters. It traces nothing."""
    try:
        rows = _morgana.scene_parameters(scene)
    except (Error, MemoryError):
        # Large scenes have no list of parameters.
        rows = []
    return _section(rows) + _media_table(_media(rows)) + _meter_table(scene)


def _section(rows: Sequence[Row]) -> str:
    """Returns a picture of the middle section through the first volume of labels; an empty text if
    there is none."""
    volumes = _volumes(rows)
    if not volumes:
        return ""
    name, labels = next(iter(volumes.items()))
    # Cut across y, so that depth z points downwards, or across the axis that has a single voxel.
    across = next((i for i in (1, 0, 2) if labels.shape[i] == 1), 1)
    middle = labels.shape[across] // 2
    down, right = ("zyx"[i] for i in range(3) if i != across)
    note = f"labels of {name} in the voxels {'zyx'[across]} = {middle}: {down} down, {right} to the right"
    return label_map(np.take(labels, middle, axis=across)) + caption(note)


def _volumes(rows: Iterable[Row]) -> Dict[str, NDArray[Any]]:
    """Returns the voxels [z, y, x] of shapes of labels by their names."""
    values = {name: value for name, _, value, _ in rows}
    names = [name[: -len(".surface")] for name in values if name.endswith(".surface")]
    found = {name: values.get(f"{name}.data") for name in names}
    return {name: of for name, of in found.items() if isinstance(of, np.ndarray) and of.ndim == 3 and of.size}


def _media(rows: Sequence[Row]) -> List[Medium]:
    """Returns the labels with a table of properties, and all other media."""
    volumes = _volumes(rows)
    found: List[Medium] = []
    for name, _, value, _ in rows:
        shape, _, parameter = name.rpartition(".")
        if shape in volumes and parameter == "properties" and np.ndim(value) == 2:
            columns = ("sigma_a", "sigma_s", "g", "ior")
            listed = [dict(zip(columns, map(_short, row))) for row in np.asarray(value)]
            found += [Medium(f"{shape}: label {label}", of, label) for label, of in enumerate(listed) if label]
    for name in (row[0][: -len(".sigma_s")] for row in rows if row[0].endswith(".sigma_s")):
        shape, _, label = name.rpartition(".")
        of_label = shape in volumes and label.isdigit()
        found.append(Medium(f"{shape}: label {label}" if of_label else name, _coefficients(rows, name), int(label) if of_label else None))
    return sorted(found, key=lambda medium: medium.label or 0)


def _coefficients(rows: Iterable[Row], medium: str) -> Dict[str, str]:
    """Returns the coefficients that a scene states for a medium. Coefficients that vary in space
    have their own parameters, such as ``fog.sigma_t.data``."""
    found: Dict[str, str] = {}
    for name, _, value, is_default in rows:
        if is_default or not name.startswith(f"{medium}."):
            continue
        first, *more = name[len(medium) + 1 :].replace("phase.g", "g", 1).split(".")
        if first in COEFFICIENTS:
            found[first] = "varies" if more else _short(value)
    return found


def _short(value: Any) -> str:
    """Returns a number or a short text; ``varies`` for several numbers."""
    if isinstance(value, (int, float, np.number)):
        return f"{float(value):.4g}"
    return value if isinstance(value, str) and len(value) <= 40 else "varies"


def _media_table(media: Sequence[Medium]) -> str:
    columns = [name for name in COEFFICIENTS if any(name in medium.coefficients for medium in media)]
    lines = [[_name(medium), *(html.escape(medium.coefficients.get(name, "")) for name in columns)] for medium in media]
    return _table(["medium", *columns], lines)


def _name(medium: Medium) -> str:
    """Returns the name of a medium behind the colour of its label."""
    if medium.label is None:
        return html.escape(medium.name)
    red, green, blue = LABELS[int(label_colour(medium.label))]
    return f'<span style="color: rgb({red}, {green}, {blue})">■</span> {html.escape(medium.name)}'


def _meter_table(scene: Scene) -> str:
    """Returns a table of the meters, with a line for quantities of equal bins."""
    lines: Dict[Tuple[str, str], List[str]] = {}
    for reading, axes in scene._readings:
        meter, _, quantity = reading.rpartition(".")
        bins = " × ".join(f"{count} {axis}" for axis, count, _, _ in axes)
        lines.setdefault((meter or scene.meters[0], bins), []).append(quantity)
    return _table(["meter", "quantities", "bins"], [[*map(html.escape, (meter, ", ".join(of), bins))] for (meter, bins), of in lines.items()])


def _table(columns: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """Returns a table of cells, which are HTML, with at most :data:`MAX_ROWS` lines."""
    if not lines:
        return ""
    shown = [*lines[:MAX_ROWS]]
    if len(lines) > MAX_ROWS:
        shown.append([f"… and {len(lines) - MAX_ROWS} more", *[""] * (len(columns) - 1)])
    head = "".join(f"<th>{html.escape(column)}</th>" for column in columns)
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in line)}</tr>" for line in shown)
    return f"<table><tr>{head}</tr>{body}</table>"


# Scene is a compiled class.
setattr(Scene, "_repr_html_", scene_html)
