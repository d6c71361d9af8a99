"""Images: reading, writing, comparing."""

from __future__ import annotations

import json
import math
import os
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _morgana
from ._errors import RenderError
from ._numbers import numbers
from ._result import Floats, Result, thumbnail

Path = Union[str, "os.PathLike[str]"]


class Image(NamedTuple):
    """An image that was read from a file."""

    layers: Dict[str, Floats]
    """Values by layer, float32 of shape (height, width, channels). The main layer is ``""``; renders have the layers
    ``variance`` and ``samples``, too (docs/images.md)."""
    channels: Dict[str, List[str]]
    """Names of the channels of each layer."""
    attributes: Dict[str, str]
    """Texts about the image: ``scene_hash``, ``seed``, ``spp`` and others."""

    @property
    def image(self) -> Floats:
        """The main layer."""
        return self.layers[""]

    def __repr__(self) -> str:
        height, width = next(iter(self.layers.values())).shape[:2]
        return f"<morgana.Image of {width} × {height}, layers {', '.join(map(repr, self.layers))}>"

    def _repr_html_(self) -> str:
        main = "" if "" in self.layers else next(iter(self.layers))
        return thumbnail(self.layers[main], self.channels[main])


class Difference(NamedTuple):
    """How far apart two images are (docs/images.md)."""

    means: Tuple[float, float]
    """Means of the image and of the reference, over pixels and channels."""
    rmse: float
    """Root of the mean squared difference."""
    relative_mse: float
    """Mean squared difference by the squares of the reference's values; NaN if the reference is black all over."""
    psnr: float
    """Peak signal-to-noise ratio, dB; infinite for equal images."""
    largest: float
    """Largest absolute difference."""
    flip: float
    """Mean of ``flip_map``."""
    flip_map: Floats
    """Differences that the eye sees (FLIP), 0 to 1, (height, width)."""
    z: Optional[Dict[str, Any]]
    """Differences by their standard errors, if both images know their variances: ``count``, ``mean_square`` (1 if they
    differ by noise only), ``beyond_three`` (share of |z| > 3), ``largest`` |z| with its ``channel`` and ``pixel``, and
    the ``limit`` that it exceeds by chance in one of 1000 comparisons."""


Layers = List[Tuple[str, List[str], ArrayLike]]
Comparable = Union[Path, Result, Image, ArrayLike]


def read(path: Path, *, memory: Optional[int] = None) -> Image:
    """Read an image: ``.exr`` with all layers, ``.npy``, or ``.png``, whose values become linear.

    Args:
        path: The file.
        memory: Bytes that it may take, as for :func:`load_file`.

    Raises:
        FileError: A file that cannot be read.
    """
    layers, attributes = _morgana.read_image(os.fspath(path), memory)
    values = {name: array for name, _, array in layers}
    return Image(values, {name: channels for name, channels, _ in layers}, dict(attributes))


def write(
    path: Path,
    image: Union[Result, Image, ArrayLike],
    *,
    attributes: Optional[Mapping[str, str]] = None,
) -> None:
    """Write an image or the readings of meters, completely or not at all.

    Args:
        path: The file; its extension chooses the format: ``.exr``, ``.png`` or ``.npy`` for an image, ``.npz``, ``.h5``,
            ``.nrrd`` or ``.npy`` for the readings of meters.
        image: A :class:`Result`, an :class:`Image`, or an array of shape (height, width) or (height, width, channels).
            An EXR file of a result is that of the program, with all layers.
        attributes: Texts to keep in an EXR file of an image or array.

    Raises:
        FileError: A file that cannot be written, or a format that does not fit.
    """
    if isinstance(image, Result):
        image.write(path)
        return
    known = dict(image.attributes) if isinstance(image, Image) else {}
    known.update(attributes or {})
    _morgana.write_image(os.fspath(path), _layers(image), list(known.items()))


def compare(image: Comparable, reference: Comparable, *, block: int = 1) -> Difference:
    """Compare an image with a reference.

    Args:
        image: A file, a :class:`Result`, an :class:`Image`, or an array.
        reference: The same.
        block: z are those of means over blocks of so many by so many pixels.

    Raises:
        FileError: A file that cannot be read.
        RenderError: Images of different sizes or channels, values that are not finite.
    """
    if block < 1:
        raise RenderError(f"block is {block} but must be at least 1")
    text, flip_map = _morgana.compare_images(_layers(image), _layers(reference), block)
    found = json.loads(text)
    return Difference(
        means=tuple(found["means"]),
        rmse=found["rmse"],
        relative_mse=math.nan if found["relative_mse"] is None else found["relative_mse"],
        psnr=math.inf if found["psnr"] is None else found["psnr"],
        largest=found["largest"],
        flip=float(flip_map.mean(dtype=float)),
        flip_map=flip_map,
        z=found["z"],
    )


def _layers(image: Comparable) -> Layers:
    if isinstance(image, (str, os.PathLike)):
        image = read(image)
    if isinstance(image, Result):
        return [("", image.channels, image.image), ("variance", image.channels, image.variance)]
    if isinstance(image, Image):
        return [(name, image.channels[name], numbers(values, "the image", np.float32)) for name, values in image.layers.items()]
    values = numbers(image, "the image", np.float32)
    if values.ndim == 2:
        values = values[:, :, None]
    if values.ndim != 3 or values.size == 0:
        raise RenderError(f"expected an image of shape (height, width, channels), found {np.shape(values)}")
    return [("", _names(values.shape[2]), values)]


def _names(count: int) -> List[str]:
    known: Dict[int, Sequence[str]] = {1: "Y", 3: "RGB", 4: "RGBA"}
    return list(known.get(count, [str(i) for i in range(count)]))
