"""Background-oriented schlieren in one step, and fringes from optical path differences.

    >>> import morgana.schlieren
    >>> pair = morgana.schlieren.bos("scenes/bos_jet.xml")
    >>> pair.write("jet")

From the command line: ``python -m morgana.schlieren scenes/bos_jet.xml -o jet``. See
docs/guides/schlieren.md.
"""

from __future__ import annotations

import argparse
import os
import sys
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike

from ._checks import mapping, whole
from ._errors import Error, FileError, RenderError, SceneError
from ._images import Image, exposure, write
from ._layer import Bools, Floats
from ._morgana import Scene
from ._numbers import numbers
from ._render import render
from ._result import Doubles, Result
from ._scene import Define, load_dict, load_file
from ._values import comparable

__all__ = ["Bos", "bos", "fringes", "main", "phase"]

Source = Union[str, "os.PathLike[str]", Mapping[str, Any]]

STRAIGHT = 1e-6
"""Upper bound of the displacement of straight rays by rounding, in pixels."""
RAYS = 16
"""Default number of rays through each pixel whose displacements are averaged."""


@comparable
class Bos(NamedTuple):
    """Result of :func:`bos`.

    Rows are from the top. Displacements are in pixels to the right and downwards, as in particle
    image velocimetry codes."""

    flow: Floats
    """The picture with the flow, (height, width, channels)."""
    still: Floats
    """The picture without the flow, from the same rays."""
    displacement: Doubles
    """Displacement of the background from ``still`` to ``flow``, at each pixel of ``flow``,
    (height, width, 2): the mean over the pixel and the lens."""
    error: Doubles
    """Standard error of ``displacement``, of the same shape."""
    spread: Doubles
    """Standard deviation of the displacement over the rays of a pixel, of the same shape: the blur
    by finite pixels and lenses."""
    valid: Bools
    """Mask of the pixels whose rays all reach the background, (height, width)."""

    def __repr__(self) -> str:
        height, width, _ = self.flow.shape
        moved = np.linalg.norm(self.displacement[self.valid], axis=-1)
        most = f", at most {moved.max():.3g} pixels" if moved.size else ""
        return f"<morgana.schlieren.Bos of {width} × {height}{most}>"

    def write(self, prefix: Union[str, "os.PathLike[str]"]) -> List[str]:
        """Write both pictures and the displacement.

        Writes ``PREFIX_flow.png`` and ``PREFIX_still.png`` with the same exposure, and
        ``PREFIX_displacement.npy``, (height, width, 2).

        Parameters
        ----------
        prefix : path_like
            Beginning of the names of the files.

        Returns
        -------
        list of str
            The files.

        Raises
        ------
        FileError
            A file that cannot be written.

        Examples
        --------
        >>> pair.write("jet")
        """
        name = os.fspath(prefix)
        stops = exposure(self.still)
        files = [f"{name}_flow.png", f"{name}_still.png", f"{name}_displacement.npy"]
        write(files[0], self.flow, exposure=stops)
        write(files[1], self.still, exposure=stops)
        np.save(files[2], self.displacement)
        return files


def bos(
    scene: Source,
    *,
    still: Optional[Mapping[str, Define]] = None,
    spp: Optional[int] = None,
    rays: int = RAYS,
    seed: int = 0,
    parameters: Optional[Mapping[str, Define]] = None,
) -> Bos:
    """Render a background with and without a flow, and its displacement by the flow.

    The flow is in front of the background. Both pictures use the same rays, so that only the flow
    changes them. The displacement is computed from rays, to their tolerance, without noise except
    from the random positions of a pixel's rays (docs/theory.md#displacement). Windows and water in
    front of the background bend rays in both pictures, and do not contribute to the displacement.
    The displacement is then of first order, for a background without steps in depth. Errors and
    spreads are upper bounds.

    Parameters
    ----------
    scene : path_like or mapping
        A scene file, or a dictionary as for :func:`morgana.load_dict`, with a pattern behind the
        flow.
    still : mapping, optional
        Parameters of the scene that remove the flow, such as ``{"strength": 0}``. Without them,
        media whose index varies get a constant index: the reference of the volume (``n0``,
        ``reference``), or else the index of the surroundings.
    spp : int, optional
        Samples per pixel of both pictures; by default the scene's number.
    rays : int
        Rays per pixel for the displacement, ≥ 2.
    seed : int
        Seed of the random numbers.
    parameters : mapping, optional
        Other parameters of the scene, for both pictures.

    Returns
    -------
    Bos
        The pictures and the displacement.

    Raises
    ------
    SceneError
        A scene that cannot be read or does not have these parameters.
    RenderError
        Too few rays, or a mapping ``still`` without parameters.
    TypeError
        A :class:`Scene`, whose parameters cannot be changed.

    Examples
    --------
    >>> pair = morgana.schlieren.bos("scenes/bos_jet.xml", spp=64)
    """
    if isinstance(scene, Scene):
        raise TypeError("a Scene has fixed parameters: give bos a file or a dictionary")
    whole(rays, "rays", 2)
    if still is not None and not mapping(still, "still"):
        raise RenderError("still is empty: give parameters of the scene that remove the flow")
    given = dict(parameters or {})

    # Read all scenes before rendering, so that mistakes are reported at once.
    each: List[Mapping[str, Any]] = [{}, {"undisturbed": True} if still is None else still]
    pictures = [_load(scene, {**given, **more}) for more in each]
    followed = [_load(scene, {**given, **more}, integrator="aov", sampler="independent") for more in each]
    moved, without = (_Moved.of(render(rayed, spp=rays, seed=seed), rays) for rayed in followed)
    displacement, error, valid = moved.against(without)
    images = [render(picture, spp=spp, seed=seed).image for picture in pictures]
    return Bos(images[0], images[1], displacement, error, error * float(np.sqrt(rays)), valid)


class _Moved(NamedTuple):
    """Displacements of the rays of one scene, relative to straight rays."""

    mean: Doubles
    error: Doubles
    valid: Bools

    @classmethod
    def of(cls, result: Result, rays: int) -> "_Moved":
        valid, layer = result.layers["valid"].mean, result.layers["displacement"]
        # Divide by the fraction of valid rays: lost rays count as zero in means.
        share = np.maximum(valid.astype(float), 1 / rays)
        return cls(np.asarray(layer.mean / share), np.asarray(layer.error / share), valid[..., 0] == 1)

    def against(self, still: "_Moved") -> Tuple[Doubles, Doubles, Bools]:
        """Returns the displacement relative to another scene, its standard error, and the mask of
        the known values (docs/theory.md#displacement)."""
        valid = self.valid & still.valid
        if np.abs(still.mean).max() < STRAIGHT:
            return self.mean, self.error, valid
        if min(valid.shape) < 2:
            raise RenderError("the scene without the flow also bends rays: render at least 2 × 2 pixels")
        # Solve with the map from pixels to the straight rays that see the same point. Differences
        # of neighbours give its derivatives.
        known = np.where(valid[..., None], still.mean, np.nan)
        (xx, xy), (yx, yy) = (-np.asarray(np.gradient(known[..., i], axis=(1, 0))) for i in (0, 1))
        xx, yy = 1 + xx, 1 + yy
        x, y = np.moveaxis(self.mean - known, -1, 0)
        with np.errstate(all="ignore"):
            solved = np.stack([yy * x - xy * y, xx * y - yx * x], axis=-1) / (xx * yy - xy * yx)[..., None]
        valid = np.isfinite(solved).all(axis=-1)
        return np.where(valid[..., None], solved, 0.0), self.error + still.error, valid


def fringes(
    waves: Union[Result, Image, ArrayLike], *, carrier: Tuple[float, float] = (0.0, 0.0), steps: int = 1, visibility: float = 1.0
) -> Doubles:
    """Fringes of two-beam interference from optical path differences.

    The intensity of image k is ½ + ½ V cos 2π(w + c·x + k/N), with k from 0 to N − 1. Here w is the
    optical path difference in wavelengths. c is the ``carrier``, and x the position in the image,
    as fractions of its width and height.

    Parameters
    ----------
    waves : Result, Image or array_like
        Optical path differences in wavelengths, (height, width): a render by the integrator ``aov``
        with a ``wavelength``, its ``.exr`` file as :func:`morgana.read` returns it, or an array.
        Lost rays of renders do not count.
    carrier : two floats
        Numbers of fringes that a tilt of the reference adds across the width and down the height of
        the image; 0 for infinite-fringe interferograms.
    steps : int
        Number N of images, ≥ 1. The reference moves by 1/N of a wavelength between them.
    visibility : float
        Contrast V of the fringes, 0 to 1.

    Returns
    -------
    numpy.ndarray
        Intensities from 0 to 1, (steps, height, width); NaN where all rays of a pixel are lost.

    Raises
    ------
    RenderError
        A render without waves, or parameters out of range.

    Examples
    --------
    >>> series = morgana.schlieren.fringes(result, carrier=(20, 0), steps=4)
    """
    found = _waves(waves)
    whole(steps, "steps", 1)
    if not 0 <= visibility <= 1:
        raise RenderError(f"visibility is {visibility} but must be between 0 and 1")
    height, width = found.shape
    y, x = np.mgrid[:height, :width] + 0.5
    tilt = carrier[0] * x / width + carrier[1] * y / height
    shift = (np.arange(steps) / steps)[:, None, None]
    return np.asarray(0.5 + 0.5 * visibility * np.cos(2 * np.pi * (found + tilt + shift)))


def phase(series: ArrayLike) -> Doubles:
    """Phase of fringes by the N-bucket formula.

    Parameters
    ----------
    series : array_like
        Intensities, (steps, height, width), of at least three steps, as :func:`fringes` returns
        them.

    Returns
    -------
    numpy.ndarray
        Phase in wavelengths, wrapped to −½ to ½, (height, width). It is the optical path difference
        plus the tilt by the carrier: w + c·x of :func:`fringes`.

    Raises
    ------
    RenderError
        Fewer than three steps.

    Examples
    --------
    >>> wrapped = morgana.schlieren.phase(series)
    """
    images = numbers(series, "series")
    if images.ndim != 3 or len(images) < 3:
        raise RenderError("a phase needs a series of at least three images, (steps, height, width)")
    shift = (2 * np.pi * np.arange(len(images)) / len(images))[:, None, None]
    sine, cosine = (images * np.sin(shift)).sum(axis=0), (images * np.cos(shift)).sum(axis=0)
    return np.asarray(np.arctan2(-sine, cosine) / (2 * np.pi))


def _load(scene: Source, parameters: Mapping[str, Define], **instead: Any) -> Any:
    everything: Dict[str, Any] = {**instead, **parameters}
    return load_dict(scene, **everything) if isinstance(scene, Mapping) else load_file(scene, **everything)


def _waves(waves: Union[Result, Image, ArrayLike]) -> Doubles:
    if isinstance(waves, (Result, Image)):
        path, valid = _quantity(waves, "waves"), _quantity(waves, "valid")
        # Divide by the fraction of valid rays: lost rays count as zero in means.
        return np.asarray(np.divide(path, valid, out=np.full(path.shape, np.nan), where=valid > 0))
    found: Doubles = numbers(waves, "optical path differences")
    if found.ndim != 2:
        raise RenderError(f"optical path differences have the shape (height, width), not {found.shape}")
    return found


def _quantity(render: Union[Result, Image], name: str) -> Doubles:
    """Returns a quantity of one channel, (height, width)."""
    if isinstance(render, Result) and name in render.layers:
        return np.asarray(render.layers[name].mean[..., 0], float)
    if isinstance(render, Image):
        # Look for the quantity in the main layer, too: files without an image of light have it
        # there.
        for layer, channel in [(name, "V"), ("", name)]:
            if channel in render.channels.get(layer, []):
                return np.asarray(render.layers[layer][..., render.channels[layer].index(channel)], float)
    raise RenderError(f"the render has no {name!r}: use the integrator aov with a wavelength, and write .exr files")


def _defined(text: str) -> Tuple[str, str]:
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise argparse.ArgumentTypeError(f"'{text}' is not NAME=VALUE")
    return name, value


def _check_folder(prefix: str) -> None:
    """Raises an error, before anything is rendered, if files with this prefix cannot be written."""
    folder = os.path.dirname(prefix) or os.curdir
    if not os.path.isdir(folder):
        raise FileError(f"cannot write '{prefix}_flow.png': there is no folder '{folder}'")
    if not os.access(folder, os.W_OK):
        raise FileError(f"cannot write '{prefix}_flow.png': the folder '{folder}' is not writable")


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run ``python -m morgana.schlieren``: write two pictures, and the displacement between them.

    Parameters
    ----------
    arguments : sequence of str, optional
        Arguments; by default the command-line arguments.

    Returns
    -------
    int
        0, or 1 after an error.
    """
    parser = argparse.ArgumentParser(
        prog="python -m morgana.schlieren", description="Render a background with and without a flow, and the displacement in pixels."
    )
    parser.add_argument("scene", help="the scene file")
    parser.add_argument("--still", metavar="NAME=VALUE", type=_defined, action="append", help="parameter that takes the flow away; repeatable; without any, varying indices become constant")
    parser.add_argument("-D", dest="defines", metavar="NAME=VALUE", type=_defined, action="append", default=[], help="parameter of the scene; repeatable")
    parser.add_argument("--spp", type=int, help="samples per pixel of the pictures")
    parser.add_argument("--rays", type=int, default=RAYS, help=f"rays per pixel for the displacement ({RAYS})")
    parser.add_argument("--seed", type=int, default=0, help="seed of the random numbers (0)")
    parser.add_argument("-o", "--output", required=True, metavar="PREFIX", help="how the names of the files begin")
    given = parser.parse_args(arguments)
    defines: Dict[str, Define] = dict(given.defines)
    try:
        _check_folder(given.output)
        pair = bos(given.scene, still=dict(given.still) if given.still else None, spp=given.spp, rays=given.rays, seed=given.seed, parameters=defines)
        files = pair.write(given.output)
    except Error as error:
        # Print scene errors as they are: they have several lines, which begin with their severity.
        print(error if isinstance(error, SceneError) else f"error: {error}", file=sys.stderr)
        return 1
    moved = np.linalg.norm(pair.displacement[pair.valid], axis=-1)
    print(f"displacement: at most {moved.max(initial=0):.3g} pixels, standard error at most {pair.error.max():.2g}")
    print("\n".join(files))
    return 0


if __name__ == "__main__":
    sys.exit(main())
