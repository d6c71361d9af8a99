"""Reading, writing and comparing images."""

from __future__ import annotations

import dataclasses
import json
import math
import os
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _morgana
from ._checks import mapping, optional_finite, optional_whole, whole
from ._errors import FileError, RenderError
from ._numbers import numbers
from ._estimate import Data, Estimate, Origin, own_origin, run_with
from ._layer import Floats, picture
from ._pictures import caption, thumbnail
from ._result import Result
from ._values import Fields, Named, comparable

Path = Union[str, "os.PathLike[str]"]

OF_METERS = (".npz", ".h5", ".hdf5", ".nrrd")
"""Extensions of files of meter readings, which are not images."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Image(Data, Fields):
    """An image with all its layers: the result of :func:`read`.

    An image computes like a NumPy array of its main layer, with errors from the layer ``variance``
    if there is one: see :class:`Estimate`. The axes are ``row``, ``column`` and ``channel``.

    Examples
    --------
    >>> difference = morgana.read("first.exr") - morgana.read("other_seed.exr")
    >>> difference.mean, difference.error
    """

    layers: Dict[str, Floats]
    """Values by layer, float32, (height, width, channels), row 0 at the top. The main layer is
    ``""``. Renders also have the layers ``variance`` and ``samples`` (docs/images.md)."""
    channels: Dict[str, List[str]]
    """Names of the channels of each layer."""
    attributes: Dict[str, str]
    """Texts about the image: ``scene_hash``, ``seed``, ``spp`` and others."""
    _origin: Origin = dataclasses.field(init=False, default_factory=own_origin)

    @property
    def image(self) -> Floats:
        """The main layer, float32, (height, width, channels).

        Raises
        ------
        KeyError
            The file has no main layer, only named layers.
        """
        return self.layers[""]

    def _estimate(self) -> Estimate:
        variance, few = self.layers.get("variance"), self.layers.get("few")
        error = np.broadcast_to(np.asarray(np.nan, self.image.dtype), self.image.shape) if variance is None else np.sqrt(variance)
        origin = run_with(self.attributes["seed"]) if "seed" in self.attributes else self._origin
        return picture(self.image, error, None if few is None else few != 0, self.channels[""], origin)

    def __repr__(self) -> str:
        height, width = next(iter(self.layers.values())).shape[:2]
        return f"<morgana.Image of {width} × {height}, layers {', '.join(map(repr, self.layers))}>"

    def _repr_html_(self) -> str:
        main = "" if "" in self.layers else next(iter(self.layers))
        return thumbnail(self.layers[main], self.channels[main]) + caption(repr(self).strip("<>"))


@comparable
class Difference(NamedTuple):
    """Differences of two images: the result of :func:`compare` (docs/images.md)."""

    means: Tuple[float, float]
    """Means of the image and of the reference, over pixels and channels."""
    rmse: float
    """Root mean square difference, ≥ 0."""
    relative_mse: float
    """Mean squared difference divided by the squares of the reference's values; NaN if the
    reference is black."""
    psnr: float
    """Peak signal-to-noise ratio, dB; infinite for equal images."""
    largest: float
    """Largest absolute difference."""
    flip: float
    """Mean of ``flip_map``, 0 to 1."""
    flip_map: Floats
    """Visible differences (FLIP), 0 to 1, float32, (height, width)."""
    z: Optional[Dict[str, Any]]
    """Differences divided by their standard errors; ``None`` unless both images have variances.
    Entries are ``count``, ``mean_square`` (1 if the images differ only by noise), ``beyond_three``
    (fraction of |z| > 3), ``largest`` |z| with its ``channel`` and ``pixel``, and the ``limit``
    that the largest |z| exceeds by chance in one of 1000 comparisons."""

    def __repr__(self) -> str:
        largest = None if self.z is None else self.z["largest"]
        z = "" if largest is None else f", largest |z| {largest:.3g}"
        return f"<morgana.Difference: RMSE {self.rmse:.4g}, PSNR {self.psnr:.4g} dB, FLIP {self.flip:.4g}{z}>"


Layers = List[Tuple[str, List[str], ArrayLike]]
Comparable = Union[Path, Result, Image, ArrayLike]


def read(path: Path, *, memory: Optional[int] = None) -> Image:
    """Read an image with all its layers.

    Parameters
    ----------
    path : path_like
        An ``.exr``, ``.npy``, ``.png`` or ``.jpg`` file. Values of ``.png`` and ``.jpg`` are
        converted to linear values. For ``.png``, these are the values before the exposure and tone
        map that the file records. For files of meters, use :meth:`Reading.load` and
        :meth:`Records.load`.
    memory : int, optional
        Maximum number of bytes of the image, as for :func:`load_file`.

    Returns
    -------
    Image
        The image: layers, channels and attributes.

    Raises
    ------
    FileError
        A file that cannot be read.

    Examples
    --------
    >>> image = morgana.read("fog.exr")
    >>> image.layers["variance"].shape, image.attributes["seed"]
    """
    name, limit = os.fspath(path), optional_whole(memory, "memory", 1)
    try:
        layers, attributes = _morgana.read_image(name, limit)
    except FileError as error:
        if not name.lower().endswith(OF_METERS):
            raise
        raise FileError(f"{error}; read results of meters, in .npz and .h5 files, by morgana.Reading.load and morgana.Records.load") from None
    values = {name: array for name, _, array in layers}
    return Image(Named("layer", values), {name: channels for name, channels, _ in layers}, dict(attributes))


def write(
    path: Path,
    image: Union[Result, Image, ArrayLike],
    *,
    attributes: Optional[Mapping[str, str]] = None,
    exposure: Optional[float] = None,
) -> None:
    """Write an image or the readings of meters to a file, completely or not at all.

    Parameters
    ----------
    path : path_like
        The file; its extension chooses the format: ``.exr``, ``.png`` or ``.npy`` for an image,
        ``.npz``, ``.h5``, ``.nrrd`` or ``.npy`` for the readings of meters.
    image : Result, Image or array_like
        The image to write. An array has shape (height, width) or (height, width, channels), row 0
        at the top. An EXR file of a result has all layers, like a file of the program.
    attributes : mapping of str to str, optional
        Texts to store in an EXR file of an image or array. A result writes its own texts.
    exposure : float, optional
        Stops by which a ``.png`` file is brightened; 0 keeps the values. The default is the result
        of :func:`exposure`. The file records the number as its text ``exposure``.

    Raises
    ------
    FileError
        A file that cannot be written, or a format that does not suit the data.
    RenderError
        An array that is not an image, or ``attributes`` for a result.

    Examples
    --------
    >>> morgana.write("fog.exr", result)
    >>> morgana.write("ramp.png", np.linspace(0, 1, 256).reshape(1, 256))
    """
    if isinstance(image, Result):
        if attributes:
            raise RenderError("attributes are for images and arrays: leave them out, because a result writes its own")
        image.write(path, exposure=exposure)
        return
    known = dict(image.attributes) if isinstance(image, Image) else {}
    known.update(mapping(attributes or {}, "attributes"))
    for name, text in known.items():
        if not (isinstance(name, str) and isinstance(text, str)):
            raise TypeError(f"attributes[{name!r}] is {text!r} but attributes must be texts: convert it by str()")
    stops = optional_finite(exposure, "exposure")
    _morgana.write_image(os.fspath(path), _layers(image), list(known.items()), stops)


def exposure(image: Comparable) -> float:
    """Default number of stops by which a picture of an image is brightened.

    The number avoids pictures that are black or overexposed. The program follows the same rule
    (docs/images.md#on-a-screen): see :func:`write`.

    Parameters
    ----------
    image : path_like, Result, Image or array_like
        The image; an array has shape (height, width) or (height, width, channels).

    Returns
    -------
    float
        A multiple of a quarter; 0 if the image needs no change, below 0 if it is too bright.

    Raises
    ------
    FileError
        A file that cannot be read.
    RenderError
        An array that is not an image.

    Examples
    --------
    >>> morgana.exposure(np.full((4, 4), 0.1))
    2.5
    """
    return _morgana.exposure(_layers(image))


def compare(image: Comparable, reference: Comparable, *, block: int = 1) -> Difference:
    """Compare an image with a reference.

    Parameters
    ----------
    image : path_like, Result, Image or array_like
        The image to compare; an array has shape (height, width) or (height, width, channels).
    reference : path_like, Result, Image or array_like
        The reference, of the same size and channels.
    block : int, optional
        Side of the blocks of pixels, ≥ 1, over which ``z`` compares means.

    Returns
    -------
    Difference
        Errors, visible differences, and differences divided by their standard errors.

    Raises
    ------
    FileError
        A file that cannot be read.
    RenderError
        Images of different sizes or channels, or values that are not finite.

    Examples
    --------
    >>> difference = morgana.compare("on.exr", "off.exr")
    >>> difference.rmse, difference.flip
    """
    block = whole(block, "block", 1)
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
    if isinstance(image, Data) and tuple(image._estimate().axes) == ("row", "column", "channel"):
        estimate = image._estimate()
        names = estimate.names.get("channel", _names(estimate.shape[2]))
        return [(name, names, np.asarray(values, np.float32)) for name, values in (("", estimate.mean), ("variance", estimate.error**2))]
    values = numbers(image, "the image", np.float32)
    if values.ndim == 2:
        values = values[:, :, None]
    if values.ndim != 3 or values.size == 0:
        raise RenderError(f"expected an image of shape (height, width, channels), found {np.shape(values)}")
    return [("", _names(values.shape[2]), values)]


def _names(count: int) -> List[str]:
    known: Dict[int, Sequence[str]] = {1: "Y", 3: "RGB", 4: "RGBA"}
    return list(known.get(count, [str(i) for i in range(count)]))
