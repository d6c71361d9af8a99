"""Small pictures of results for notebooks, as HTML."""

from __future__ import annotations

import base64
import html
import struct
import zlib
from typing import TYPE_CHECKING, Any, List, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _morgana

if TYPE_CHECKING:
    from ._estimate import Estimate
    from ._selection import Axis

Doubles = NDArray[np.float64]

SIDE = 320
"""Longest side of a picture, in pixels."""

SMALL = 96
"""Side below which pixels are enlarged, in pixels of the screen."""

HEIGHT = 160
"""Height of a curve, in pixels."""

DECADES = 4.0
"""Decades below the largest value that a map shows, if its values span more than one."""

COLOURS = np.array([[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]], float)
"""Colours of a map, from the smallest value to the largest: every fourth of Matplotlib's
``viridis``."""

LABELS = [
    (240, 240, 240), (76, 114, 176), (221, 132, 82), (85, 168, 104), (196, 78, 82), (129, 114, 179), (147, 120, 96), (218, 139, 195), (100, 181, 205),
    (204, 185, 116), (60, 60, 60),
]  # fmt: skip
"""Colours of labels: light grey for label 0, and ten colours that repeat."""

MAX_LINES = 200
"""Maximum number of rays in a picture."""


def caption(text: str) -> str:
    """Returns a line of text below a picture."""
    return f"<p>{html.escape(text)}</p>"


def thumbnail(image: NDArray[Any], channels: List[str]) -> str:
    """Returns a small picture of light."""
    small = _shrunk(image)
    png = _morgana.encode_png([("", channels, small)])
    n = max(1, SMALL // max(small.shape))
    return _image(png, small.shape[1] * n, small.shape[0] * n)


def html_of(estimate: "Estimate", text: Optional[str] = None) -> str:
    """Returns a picture of an estimate with a caption: a map over its two longest axes, averaged
    over the others, or a curve over its only long axis, or the values themselves."""
    text = (repr(estimate) if text is None else text).strip("<>")
    axes = estimate._axes()
    long = [i for i, axis in enumerate(axes) if axis.size > 2 and (axis.names is None or axis.has_points)]
    if not estimate.size or not np.isrealobj(estimate.mean):
        return caption(text)
    if not long:
        return _values(estimate) + caption(text)
    # Prefer the plane of z and x among axes of equal length.
    shown = sorted(sorted(long, key=lambda i: (-axes[i].size, axes[i].name in ("y", "opl")))[:2])
    others = tuple(i for i in range(len(axes)) if i not in shown)
    mean = np.asarray(estimate.mean, float).mean(axis=others)
    averaged = [axes[i].name for i in others if axes[i].size > 1]
    note = f", averaged over {', '.join(averaged)}" if averaged else ""
    if len(shown) == 2:
        down, right = (axes[i].name for i in shown)
        return heat_map(mean) + caption(f"{text}: {down} down, {right} to the right{note}")
    axis = axes[shown[0]]
    error = np.asarray(estimate.error, float).mean(axis=others)
    return curve(_numbers(axis), mean, error) + caption(f"{text}: over {axis.name}{note}")


def heat_map(values: ArrayLike) -> str:
    """Returns a map of values, (rows, columns), in colours. The scale is logarithmic if positive
    values span more than a decade."""
    small = _shrunk(np.asarray(values, float)[:, :, None])[:, :, 0]
    finite = small[np.isfinite(small)]
    if finite.size and finite.min() >= 0 and finite.max() > 0:
        positive = finite[finite > 0]
        if positive.max() > 10 * positive.min():
            with np.errstate(divide="ignore"):
                small = np.maximum(np.log10(small / positive.max()), -DECADES)
            finite = small[np.isfinite(small)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    share = np.nan_to_num((small - low) / ((high - low) or 1.0)).clip(0, 1) * (len(COLOURS) - 1)
    colours = np.stack([np.interp(share, np.arange(len(COLOURS)), column) for column in COLOURS.T], axis=-1)
    colours[~np.isfinite(small)] = 217
    n = max(1, SIDE // 2 // max(small.shape))
    return _image(_png(np.round(colours).astype(np.uint8)), small.shape[1] * n, small.shape[0] * n)


def label_map(labels: NDArray[Any]) -> str:
    """Returns a map of labels, (rows, columns), in the colours :data:`LABELS`. Larger maps than
    :data:`SIDE` show every second label, every third, and so on."""
    step = -(-max(labels.shape) // SIDE)
    small = np.nan_to_num(labels[::step, ::step]).astype(np.int64)
    colours = np.asarray(LABELS, np.uint8)[label_colour(small)]
    n = max(1, SIDE // 2 // max(small.shape))
    return _image(_png(colours), small.shape[1] * n, small.shape[0] * n)


def label_colour(label: Any) -> Any:
    """Returns the row of :data:`LABELS` for a label, or for an array of labels."""
    return np.where(np.asarray(label) > 0, (np.asarray(label) - 1) % (len(LABELS) - 1) + 1, 0)


def curve(x: Doubles, y: Doubles, error: Optional[Doubles] = None) -> str:
    """Returns a curve with a band of one standard error."""
    x, y = np.asarray(x, float), np.asarray(y, float)
    width = np.zeros_like(y) if error is None else np.nan_to_num(np.asarray(error, float), posinf=0.0)
    known = np.isfinite(x) & np.isfinite(y)
    x, y, width = x[known], y[known], width[known]
    if not x.size:
        return ""
    low, high = min(float((y - width).min()), 0.0), max(float((y + width).max()), 0.0)
    right, up = _scale(x, float(x.min()), float(x.max()), SIDE), _scale(y, low, high, HEIGHT)
    below, above = _scale(y - width, low, high, HEIGHT), _scale(y + width, low, high, HEIGHT)
    band = _points(np.append(right, right[::-1]), HEIGHT - np.append(below, above[::-1]))
    line = _points(right, HEIGHT - up)
    zero = HEIGHT - float(_scale(np.zeros(1), low, high, HEIGHT)[0])
    parts = [
        f'<line x1="0" y1="{zero:.1f}" x2="{SIDE}" y2="{zero:.1f}" stroke="#888888" stroke-width="1"/>',
        f'<polygon points="{band}" fill="#3b528b" fill-opacity="0.25"/>',
        f'<polyline points="{line}" fill="none" stroke="#3b528b" stroke-width="1.5"/>',
    ]
    return _svg(parts, SIDE, HEIGHT)


def histogram(lengths: Doubles, weights: Doubles, title: str) -> str:
    """Returns a histogram, with a title that names its axes."""
    if not lengths.size or not np.isfinite(lengths).all():
        return ""
    counts, edges = np.histogram(lengths, bins=40, range=(0.0, float(lengths.max()) or 1.0), weights=weights)
    return curve(np.repeat(edges, 2)[1:-1], np.repeat(counts, 2)) + caption(title)


def polylines(lines: Sequence[Doubles]) -> Tuple[str, str]:
    """Returns a picture of lines of points (points, 3), projected on the two axes of their largest
    extent, and the names of these axes."""
    points = np.concatenate([*lines]) if lines else np.zeros((0, 3))
    points = points[np.isfinite(points).all(axis=1)]
    if not points.size:
        return "", ""
    extent = np.ptp(points, axis=0)
    right, up = np.argsort(-extent, kind="stable")[:2]
    low, most = points.min(axis=0), float(extent[right]) or 1.0
    height = int(np.clip(SIDE * extent[up] / most, 40, SIDE))
    parts = []
    for line in lines:
        across = _scale(line[:, right], low[right], low[right] + most, SIDE)
        upwards = _scale(line[:, up], low[up], low[up] + (float(extent[up]) or 1.0), height)
        parts.append(f'<polyline points="{_points(across, height - upwards)}" fill="none" stroke="#3b528b" stroke-width="1"/>')
    return _svg(parts, SIDE, height), f"{'xyz'[right]} to the right, {'xyz'[up]} upwards"


def _values(estimate: "Estimate") -> str:
    """Returns the values of a few bins."""
    flat, errors = np.ravel(estimate.mean)[:12], np.ravel(estimate.error)[:12]
    listed = ", ".join(f"{mean:.4g} ± {error:.2g}" for mean, error in zip(flat, errors))
    return caption(listed + (", …" if estimate.size > 12 else "") + f" {estimate.unit}")


def _numbers(axis: "Axis") -> Doubles:
    return np.asarray(axis.coordinates, float)


def _shrunk(image: NDArray[Any]) -> NDArray[Any]:
    """Returns an image, (rows, columns, channels), with at most :data:`SIDE` pixels per side, each
    the mean of a block."""
    height, width = image.shape[:2]
    n = min(-(-max(height, width) // SIDE), height, width)
    small = image[: height // n * n, : width // n * n]
    return np.asarray(small.reshape(height // n, n, width // n, n, -1).mean(axis=(1, 3)))


def _scale(values: Doubles, low: float, high: float, length: int) -> Doubles:
    return np.asarray((values - low) / ((high - low) or 1.0) * length)


def _points(x: Doubles, y: Doubles) -> str:
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y))


def _svg(parts: List[str], width: int, height: int) -> str:
    return f'<svg width="{width}" height="{height}" viewBox="-2 -2 {width + 4} {height + 4}" role="img" style="background: white">{"".join(parts)}</svg>'


def _image(png: bytes, width: int, height: int) -> str:
    return f'<img src="data:image/png;base64,{base64.b64encode(png).decode()}" width="{width}" height="{height}" style="image-rendering: pixelated">'


def _png(colours: NDArray[np.uint8]) -> bytes:
    """Returns a PNG file of colours as they are on the screen, (rows, columns, 3)."""
    height, width = colours.shape[:2]

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    rows = b"".join(b"\0" + row.tobytes() for row in colours)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
