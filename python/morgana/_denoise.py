"""Denoising, by Open Image Denoise."""

from __future__ import annotations

import importlib
import os
from typing import Any, Dict, List, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike

from . import _morgana
from ._checks import optional_finite, truth
from ._errors import RenderError
from ._images import Image, Path, _layers, read
from ._numbers import numbers
from ._result import Floats, Result, thumbnail
from ._values import comparable

ALBEDOS = ("albedo",)
NORMALS = ("sh_normal", "geo_normal")
"""Names of layers that guide the denoiser."""
FAR = 3.0
"""Beyond so many standard errors noise hardly explains a difference."""


@comparable
class Denoised(NamedTuple):
    """A denoised image, as :func:`denoise` returns it. It is no estimate: nobody knows its error (docs/images.md#denoising)."""

    image: Floats
    """Denoised values, float32, (height, width, channels)."""
    difference: Optional[Floats]
    """(denoised − estimate) / standard error, of the shape of ``image``; NaN where a value was moved that has no standard
    error, as where no sample found light. ``None`` if no standard errors are known."""
    beyond_three: Optional[float]
    """Share of the values with a standard error that were moved by more than three of them. More than 0.0027 says that
    the denoiser changed more than noise."""
    unknown: Optional[float]
    """Share of the values that were moved but have no standard error."""
    channels: List[str]
    """Names of the channels."""
    attributes: Dict[str, str]
    """Texts of the image, and ``denoised``, which says by what, and with which guides."""

    def write(self, path: Path, *, exposure: Optional[float] = None) -> None:
        """Write an ``.exr`` file with the layers ``denoised`` and ``difference``, or a ``.png`` file.

        Neither has a main layer that could be taken for the estimate; both say that they are denoised.

        Parameters
        ----------
        path : path_like
            The file; its extension chooses the format.
        exposure : float, optional
            Stops by which a ``.png`` file is brightened, as for :func:`write`.

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
    """Denoise an image by Open Image Denoise, and tell where that moved it by more than noise explains.

    Needs the package pyoidn: ``pip install "morgana-render[denoise]"``.

    Parameters
    ----------
    image : path_like, Result, Image or array_like
        Linear values; an array has shape (height, width) or (height, width, channels). Red, green and blue are denoised together,
        other channels one by one.
    albedo : array_like, optional
        Albedo of first surfaces, (height, width, 3), 0 to 1. By default the layer ``albedo`` of the image, if it has one.
    normal : array_like, optional
        Normals of first surfaces, (height, width, 3). By default the layer ``sh_normal`` or ``geo_normal`` of the image. The
        denoiser takes normals only beside an albedo.
    error : array_like, optional
        Standard errors, of the shape of the image. By default those of the result, or the root of the image's layer ``variance``.
    guides : bool, optional
        Whether layers of the image may serve as albedo and normals.

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
        Arrays that do not fit, values that are not finite, normals without an albedo, an image that is denoised already, and
        quantities of rays, which are not light.

    Examples
    --------
    >>> denoised = morgana.denoise(result)
    >>> denoised.image.shape, denoised.beyond_three
    >>> denoised.write("fog_denoised.exr")
    """
    oidn = _oidn()
    if isinstance(image, (str, os.PathLike)):
        image = read(image)
    attributes = dict(image.attributes) if isinstance(image, Image) else {}
    _refuse(image, attributes)
    layers = {name: (channels, np.asarray(values)) for name, channels, values in _layers(image)}
    if "" not in layers:
        raise RenderError(f"the image has no main layer, only {', '.join(layers)}")
    channels, values = layers[""]
    if not np.isfinite(values).all():
        raise RenderError("the image has values that are not finite")
    if isinstance(image, Result):
        layers.update((name, (layer.channels, layer.mean)) for name, layer in image.layers.items())
    named = truth(guides, "guides")
    used, names = {}, []
    for what, given, usual in (("albedo", albedo, ALBEDOS), ("normal", normal, NORMALS)):
        if given is not None:
            used[what] = _fitting(given, f"the {what}", (*values.shape[:2], 3))
            names.append(what)
        elif named and (found := _guide(layers, usual)) is not None:
            name, used[what] = found
            names.append(name)
    if "albedo" not in used:
        if normal is not None:
            raise RenderError("Open Image Denoise takes normals only beside an albedo: give albedo, too")
        used, names = {}, []
    denoised = _answer(oidn, channels, values, used)
    known = _errors(error, layers, channels, values)
    difference, beyond, unknown = (None, None, None) if known is None else _moved(denoised, values, known)
    attributes.pop("trust", None)
    attributes["denoised"] = f"by Open Image Denoise (pyoidn){' with ' + ', '.join(names) if names else ' without guides'}"
    return Denoised(denoised, difference, beyond, unknown, list(channels), attributes)


def _oidn() -> Any:
    try:
        return importlib.import_module("pyoidn")
    except ImportError as missing:
        raise ImportError('morgana.denoise needs Open Image Denoise: pip install "morgana-render[denoise]"') from missing


def _refuse(image: Any, attributes: Dict[str, str]) -> None:
    if isinstance(image, Denoised) or "denoised" in attributes:
        raise RenderError("the image is denoised already: denoise the estimate")
    is_light = image._rendered.is_light() if isinstance(image, Result) else attributes.get("integrator") != "aov"
    if not is_light:
        raise RenderError("the image has quantities of rays, not light: nest an integrator of light in the aov")


def _fitting(given: ArrayLike, what: str, shape: Tuple[int, ...]) -> Floats:
    values = numbers(given, what, np.float32)
    if values.shape != shape:
        raise RenderError(f"{what} must have shape {shape}, that of the image, but has {values.shape}")
    return np.ascontiguousarray(values)


def _guide(layers: Dict[str, Tuple[List[str], Any]], usual: Tuple[str, ...]) -> Optional[Tuple[str, Floats]]:
    for name in usual:
        if name in layers:
            channels, values = layers[name]
            for wanted in ("RGB", "XYZ"):
                if set(wanted) <= set(channels):
                    order = [channels.index(c) for c in wanted]
                    return name, np.ascontiguousarray(values[:, :, order], dtype=np.float32)
    return None


def _answer(oidn: Any, channels: List[str], values: Floats, guides: Dict[str, Floats]) -> Floats:
    """Red, green and blue together, other channels one by one, as grey."""
    colours = [channels.index(c) for c in "RGB"] if set("RGB") <= set(channels) else []
    parts = [colours] if colours else []
    parts += [[c] for c in range(len(channels)) if c not in colours]
    denoised = np.empty_like(values)
    for part in parts:
        noisy = np.repeat(values[:, :, part], 3 // len(part), axis=2)
        # The denoiser takes very small radiances for black.
        gain = np.float32(2.0 ** np.clip(np.round(_morgana.exposure([("", list("RGB"), noisy)])), -126, 126))
        answer = np.asarray(oidn.denoise(np.ascontiguousarray(noisy * gain), **guides, hdr=True))
        if answer.shape != noisy.shape or not np.isfinite(answer).all():
            raise RenderError("Open Image Denoise returned no image")
        answer = answer / gain
        denoised[:, :, part] = answer if len(part) == 3 else answer.mean(axis=2, keepdims=True)
    return denoised


def _errors(
    error: Optional[ArrayLike], layers: Dict[str, Tuple[List[str], Any]], channels: List[str], values: Floats
) -> Optional[Floats]:
    if error is not None:
        shape = values.shape[:2] if values.shape[2] == 1 and np.ndim(error) == 2 else values.shape
        return _fitting(error, "the error", shape).reshape(values.shape)
    names, variance = layers.get("variance", ([], None))
    if variance is None or not set(channels) <= set(names):
        return None
    root: Floats = np.sqrt(variance[:, :, [names.index(c) for c in channels]])
    return root


def _moved(denoised: Floats, estimate: Floats, error: Floats) -> Tuple[Floats, float, float]:
    difference = denoised.astype(float) - estimate
    known = (error > 0) & np.isfinite(error)
    z = np.where(difference == 0, 0.0, np.nan)
    np.divide(difference, error, out=z, where=known & (difference != 0))
    unknown = np.isnan(z)
    beyond = np.count_nonzero(np.abs(z) > FAR) / max(int(np.count_nonzero(~unknown)), 1)
    return z.astype(np.float32), float(beyond), float(unknown.mean())
