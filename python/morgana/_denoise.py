"""Denoising by Open Image Denoise."""

from __future__ import annotations

import importlib
import os
from typing import Any, Dict, List, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike

from . import _morgana
from ._checks import optional_finite, truth
from ._errors import RenderError
from ._extras import advice
from ._images import Image, Path, _layers, read
from ._numbers import numbers
from ._layer import Floats
from ._pictures import thumbnail
from ._result import Result
from ._values import comparable


@comparable
class Denoised(NamedTuple):
    """A denoised image: the result of :func:`denoise`.

    Denoising adds an unknown bias: do not measure on a denoised image
    (docs/images.md#denoising)."""

    image: Floats
    """Denoised values, float32, (height, width, channels)."""
    difference: Optional[Floats]
    """Differences (denoised − estimate) / standard error, of the shape of ``image``. NaN where a
    changed value has no standard error, for instance if no sample found light. ``None`` if no
    standard errors are known."""
    beyond_three: Optional[float]
    """Fraction of the values with a standard error that changed by more than three standard errors.
    More than 0.0027 means that the denoiser changed more than noise."""
    unknown: Optional[float]
    """Fraction of the values that changed but have no standard error."""
    channels: List[str]
    """Names of the channels."""
    attributes: Dict[str, str]
    """Texts of the image, and ``denoised``, which names the denoiser and its guides."""

    def write(self, path: Path, *, exposure: Optional[float] = None) -> None:
        """Write an ``.exr`` or ``.png`` file.

        An ``.exr`` file has the layers ``denoised`` and ``difference``.

        Neither has a main layer that could be mistaken for the estimate. Both state that they are
        denoised.

        Parameters
        ----------
        path : path_like
            The file; its extension chooses the format.
        exposure : float, optional
            Stops by which a ``.png`` file is brightened, as in :func:`write`.

        Raises
        ------
        FileError
            A file that cannot be written.
        RenderError
            Another format.

        Examples
        --------
        >>> morgana.denoise(result).write("fog_denoised.exr")
        """
        stops = optional_finite(exposure, "exposure")
        path = os.fspath(path)
        if path.lower().endswith(".exr"):
            layers: List[Tuple[str, List[str], ArrayLike]] = [("denoised", self.channels, self.image)]
            if self.difference is not None:
                layers.append(("difference", self.channels, self.difference))
        elif path.lower().endswith(".png"):
            layers = [("", self.channels, self.image)]
        else:
            raise RenderError(f"denoised images are written to .exr and .png, which say that they are denoised, not to {path!r}")
        _morgana.write_image(path, layers, list(self.attributes.items()), stops)

    def __repr__(self) -> str:
        height, width = self.image.shape[:2]
        moved = "" if self.beyond_three is None else f", {self.beyond_three:.2%} moved by more than 3 standard errors"
        return f"<morgana.Denoised of {width} × {height}{moved}>"

    def _repr_html_(self) -> str:
        return thumbnail(self.image, self.channels)


def denoise(
    image: Union[Path, Result, Image, ArrayLike],
    *,
    albedo: Optional[ArrayLike] = None,
    normal: Optional[ArrayLike] = None,
    error: Optional[ArrayLike] = None,
    guides: bool = True,
) -> Denoised:
    """Denoise an image by Open Image Denoise, and find changes that noise does not explain.

    Needs the package pyoidn: ``pip install ".[denoise]"`` in a clone of morgana.

    Parameters
    ----------
    image : path_like, Result, Image or array_like
        Linear values; an array has shape (height, width) or (height, width, channels). Red, green
        and blue are denoised together, other channels one by one.
    albedo : array_like, optional
        Albedo of first surfaces, (height, width, 3), 0 to 1. By default the layer ``albedo`` of the
        image, if it has one.
    normal : array_like, optional
        Normals of first surfaces, (height, width, 3). By default the layer ``sh_normal`` or
        ``geo_normal`` of the image. The denoiser takes normals only together with an albedo.
    error : array_like, optional
        Standard errors, of the shape of the image. By default the errors of the result, or the root
        of the image's layer ``variance``.
    guides : bool, optional
        Use layers of the image as albedo and normals.

    Returns
    -------
    Denoised
        Denoised values, and their differences from the estimate in standard errors.

    Raises
    ------
    FileError
        A file that cannot be read.
    ImportError
        pyoidn is not installed.
    RenderError
        Arrays of a wrong shape, values that are not finite, normals without an albedo, an image
        that is already denoised, or quantities of rays, which are not light.

    Examples
    --------
    >>> denoised = morgana.denoise(result)
    >>> denoised.image.shape, denoised.beyond_three
    >>> denoised.write("fog_denoised.exr")
    """
    oidn = _oidn()
    if isinstance(image, (str, os.PathLike)):
        image = read(image)
    if isinstance(image, Denoised):
        image = Image({"": image.image}, {"": image.channels}, image.attributes)
    attributes = dict(image.attributes) if isinstance(image, Image) else {}
    layers = {name: (channels, np.asarray(values)) for name, channels, values in _layers(image)}
    if isinstance(image, Result):
        attributes = {} if image._rendered.is_light() else {"integrator": "aov"}
        layers.update((name, (layer.channels, layer.mean)) for name, layer in image.layers.items())
    channels, values = layers.get("", next(iter(layers.values())))
    given = {
        what: (list("RGB"), _fitting(guide, f"the {what}", (*values.shape[:2], 3)))
        for what, guide in (("albedo", albedo), ("normal", normal))
        if guide is not None
    }
    if error is not None:
        shape = values.shape[:2] if values.shape[2] == 1 and np.ndim(error) == 2 else values.shape
        given["error"] = channels, _fitting(error, "the error", shape).reshape(values.shape)
    layers.update(given)
    denoised, difference, moved, told = _morgana.denoise(
        [(name, *layer) for name, layer in layers.items()],
        list(attributes.items()),
        list(given),
        truth(guides, "guides"),
        lambda colours, guided: oidn.denoise(colours, **guided, hdr=True),
    )
    beyond, unknown = moved or (None, None)
    return Denoised(denoised, difference, beyond, unknown, list(channels), dict(told))


def _oidn() -> Any:
    try:
        return importlib.import_module("pyoidn")
    except ImportError as missing:
        raise ImportError(f"morgana.denoise needs Open Image Denoise: {advice('denoise')}") from missing


def _fitting(given: ArrayLike, what: str, shape: Tuple[int, ...]) -> Floats:
    values = numbers(given, what, np.float32)
    if values.shape != shape:
        raise RenderError(f"{what} must have shape {shape}, that of the image, but has {values.shape}")
    return np.ascontiguousarray(values)
