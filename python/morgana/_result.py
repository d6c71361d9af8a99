"""Results of renders and measurements."""

from __future__ import annotations

import base64
import functools
import html
import json
import os
from typing import Any, Callable, Dict, Iterable, Iterator, List, Mapping, NamedTuple, Optional, Tuple, TypeVar, Union

import numpy as np
from numpy.typing import DTypeLike, NDArray

from . import _morgana
from ._archives import Array, opened
from ._checks import optional_finite
from ._errors import FileError, RenderError
from ._morgana import Scene
from ._pulse import Pulse
from ._records import Records, found_in
from ._values import Named, alike, comparable, unknown

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Bools = NDArray[np.bool_]

Value = TypeVar("Value")

THUMBNAIL = 320
"""Longest side of a thumbnail, in pixels."""


@comparable
class Layer(NamedTuple):
    """Layer of a picture: a part of its light, or a quantity of its rays."""

    mean: Floats
    """Means of pixels, float32, (height, width, channels)."""
    variance: Floats
    """Variances of the means, of the same shape; infinite with fewer than two samples."""
    few: Bools
    """Mask of the variances that are unreliable, of the same shape: see ``Result.few``."""
    channels: List[str]
    """Names of the channels of the picture, or of the components of a quantity, such as ``X`` and
    ``Y``."""

    @property
    def error(self) -> Floats:
        """Standard errors of the means, of the same shape."""
        return np.sqrt(self.variance)

    def __repr__(self) -> str:
        height, width, _ = self.mean.shape
        return f"<morgana.Layer of {width} × {height}, channels {', '.join(self.channels)}, mean {self.mean.mean(dtype=float):.5g}>"


@comparable
class Reading(NamedTuple):
    """A quantity that a meter measured (docs/meters.md)."""

    mean: Doubles
    """Means of the bins; the shape follows the axes."""
    error: Doubles
    """Standard errors of the means, of the same shape."""
    axes: Dict[str, Optional[Doubles]]
    """Edges of the bins by axis, the slowest axis first: one more edge than bins. ``None`` for axes
    without edges: ``channel``, ``side``, ``part``."""
    unit: str
    """Unit, in which ``unit`` stands for the scene's unit of length: ``W/unit^2``."""
    effective: Optional[Doubles] = None
    """Effective numbers of particles, of the shape of ``mean``: numbers of equal particles that
    would give means of equal uncertainty."""
    few: Optional[Bools] = None
    """Mask of the unreliable errors, of the shape of ``mean``. Such errors come from fewer than ten
    effective particles or mostly from a single one (docs/meters.md)."""

    @classmethod
    def load(cls, path: Union[str, "os.PathLike[str]"], name: str) -> "Reading":
        """Read a meter's quantity from an NPZ or HDF5 file.

        The file is one that ``morgana render`` or :meth:`Result.write` wrote.

        Parameters
        ----------
        path : path_like
            The file.
        name : str
            The quantity, as in ``Result.meters``: ``"fluence"``, or ``"tank.fluence"`` if the file
            contains several meters.

        Returns
        -------
        Reading
            The reading, as in the result.

        Raises
        ------
        FileError
            A file without this reading, or in another format.

        Examples
        --------
        >>> depth = correlation.modulation_depth(morgana.Reading.load("tissue.npz", "fluence_sidebands"))
        """
        arrays = opened(path).arrays
        found = names_in(arrays)
        if name not in found:
            raise FileError(f"{os.fspath(path)}: no reading {name!r}: the file has {', '.join(found) or 'none'}")
        return reading_in(arrays, name)

    def convolved(self, pulse: Pulse) -> "Reading":
        """Response to a pulse of light, from the response to an impulse.

        The reading is the impulse response in bins of the optical path length. Light is spread
        evenly over its bin: take bins that are narrow compared with the pulse, and that contain all
        light. The errors are upper bounds, which correlated bins reach; :meth:`Records.gated` gives
        exact errors.

        Parameters
        ----------
        pulse : Pulse
            The shape of the pulse.

        Returns
        -------
        Reading
            This quantity with the pulse, without effective numbers of particles.

        Raises
        ------
        ValueError
            A reading without bins of the optical path length.

        Examples
        --------
        >>> gates = measured.meters["fluence"].convolved(morgana.Pulse.gaussian(fwhm=30))
        """
        edges = self.axes.get("opl")
        if edges is None:
            raise ValueError("the reading has no bins of the optical path length: give the meter min_bound, max_bound and bin_width")
        kernel, axis = pulse.kernel(edges), list(self.axes).index("opl")

        def along(values: Doubles) -> Doubles:
            return np.moveaxis(np.tensordot(kernel, values, (1, axis)), 0, axis)

        mean = along(self.mean)
        few = None if self.few is None else along(np.abs(self.mean) * self.few) > 0.1 * np.abs(mean)
        return self._replace(mean=mean, error=along(self.error), effective=None, few=few)

    def __repr__(self) -> str:
        shape = " × ".join(f"{count} {axis}" for axis, count in zip(self.axes, self.mean.shape)) or "1 value"
        most = f", at most {self.mean.max():.5g}" if self.mean.size else ""
        return f"<morgana.Reading of {shape}{most} {self.unit}>".replace(" >", ">")


class Result:
    """Result of :func:`render`: a picture, or the readings of meters.

    Arrays are made on first access, and kept. Results can be pickled, and compared with ``==``:
    equal results have equal numbers and equal scenes; run times do not count.
    """

    scene: Scene
    """The rendered scene."""

    def __init__(self, scene: Scene, run: Union[_morgana.Rendered, _morgana.Measured]) -> None:
        self.scene = scene
        self._run = run

    def __getstate__(self) -> Dict[str, Any]:
        return {"scene": self.scene, "_run": self._run}

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Result):
            return NotImplemented
        return self.scene == other.scene and alike(self._numbers(), other._numbers())

    __hash__ = None  # type: ignore[assignment]

    def _numbers(self) -> Dict[str, Any]:
        if isinstance(self._run, _morgana.Measured):
            return {name: self._run.array(name) for name in self._arrays}
        return {"image": self.image, "variance": self.variance, "samples": self.samples, **self.layers}

    @functools.cached_property
    def stats(self) -> Dict[str, Any]:
        """Statistics of the run, as from ``--stats`` of the program.

        They include counts, connections and their failures, seconds, and threads."""
        stats: Dict[str, Any] = json.loads(self._run.stats)
        return stats

    @property
    def stopped(self) -> Optional[str]:
        """Reason for an early end of the run, or ``None``.

        Reasons are ``"interrupted"``, ``"time"`` and ``"target"``."""
        return self._run.stopped

    @property
    def balance(self) -> Optional[Dict[str, Any]]:
        """Balance of the power of all emitters, in its unit.

        ``None`` if no particles were traced.

        Entries are ``emitted``, and the ``mean`` and ``standard_error`` of ``absorbed_by_media``,
        ``absorbed_by_surfaces``, ``escaped``, ``cut_off``, ``lost``, ``left_over``.
        """
        balance: Optional[Dict[str, Any]] = self.stats["balance"]
        return balance

    @property
    def channels(self) -> List[str]:
        """Names of the channels.

        They are ``R``, ``G``, ``B``, or ``Y``, or wavelengths in nm, or quantities."""
        return self.scene.channels

    @property
    def _rendered(self) -> _morgana.Rendered:
        if isinstance(self._run, _morgana.Rendered):
            return self._run
        raise RenderError("the scene has meters instead of a camera, so it has no picture: use Result.meters")

    @functools.cached_property
    def image(self) -> Floats:
        """The picture: means of pixels, float32, (height, width, channels), row 0 at the top.

        Values are radiance, in the unit of the emitters. With the integrator ``aov`` they are
        quantities of rays (see ``layers``).

        Raises
        ------
        RenderError
            The scene has meters instead of a camera. All properties of pictures raise this error.
        """
        return self._rendered.mean()

    @functools.cached_property
    def variance(self) -> Floats:
        """Variances of the means, float32, of the shape of ``image``.

        They are unbiased, and infinite with fewer than two samples."""
        return self._rendered.variance()

    @functools.cached_property
    def error(self) -> Floats:
        """Standard errors of the means, float32, of the shape of ``image``."""
        return np.sqrt(self.variance)

    @functools.cached_property
    def samples(self) -> NDArray[np.uint64]:
        """Numbers of samples, uint64, (height, width)."""
        return self._rendered.counts()

    @property
    def mean(self) -> float:
        """Mean of the image over pixels and channels.

        The mean is meaningless for the integrator ``aov``, which has channels of different
        quantities."""
        return self._rendered.summary()[0]

    @property
    def mean_error(self) -> float:
        """Standard error of ``mean``. It accounts for paths that pixels share."""
        return self._rendered.summary()[1]

    @property
    def mean_few(self) -> bool:
        """True if ``mean_error`` is unreliable.

        A few bright samples contribute most of the error, or no sample found any light. Take more
        samples; with the integrator ``path``, try ``bdpt``. If the image is black, ``morgana
        check`` lists what may block the light.
        """
        return self._rendered.mean_few()

    @property
    def _is_black(self) -> bool:
        """True if a picture of light is black although it has samples."""
        return self._rendered.is_light() and self.mean == 0.0 and bool(self.samples.any())

    @functools.cached_property
    def effective(self) -> Floats:
        """Effective numbers of samples of the pixels, float32, of the shape of ``image``.

        These are numbers of equal samples that would give means of equal uncertainty. With the
        sampler ``ldsampler``, each replicate counts as one sample.
        """
        return self._rendered.effective()

    @functools.cached_property
    def few(self) -> Bools:
        """Mask of the unreliable ``variance`` and ``error``, bool, of the shape of ``image``.

        Fewer than ten effective samples contribute light to these pixels, or a single sample
        contributes most of the variance (docs/images.md). ``False`` everywhere for the integrator
        ``aov``.
        """
        return self._rendered.few()

    @functools.cached_property
    def reweighted(self) -> Optional[Floats]:
        """The picture with reduced weight of rare bright samples; biased.

        It has the shape of ``image``, and is ``None`` unless the film requests it."""
        return self._rendered.reweighted()

    @functools.cached_property
    def layers(self) -> Dict[str, Layer]:
        """Layers of the picture by name; empty without layers, and for readings of meters.

        A film with a ``decomposition`` gives parts of the light, with names such as
        ``time.0012.bounce.1``. Their means add up to ``image``.

        The integrator ``aov`` gives quantities of rays, with their names in scene files, such as
        ``optical_length`` or ``deflection`` (docs/scene/quantities.md has
        their units). Pixels are means over all rays, in which lost rays count as zero: divide by
        ``layers["valid"].mean`` for means over the other rays. If an ``aov`` contains another
        integrator, the image shows light, and the layers are the quantities.

        The integrator ``stokes`` gives Stokes parameters of light: ``S0`` to ``S3``.

        The integrator ``tagged`` gives ``total``, ``carrier``, ``sideband.1``, … and ``delay.1``, …
        of light that sound modulates. Delays have the ``few`` of ``total``, because they use the
        samples of ``total``.

        The integrator ``moment`` gives second moments, with names such as ``m2_image``; their
        variances are unknown (infinite).
        """
        if isinstance(self._run, _morgana.Measured):
            return Named("layer", {})
        light, _ = self._decomposition
        return Named("layer", {**light, **self._quantities()})

    @property
    def axes(self) -> List[Dict[str, Any]]:
        """Axes of the film's decomposition.

        Each axis is a dictionary with a ``name``. Further keys depend on the name:

        - ``"length"`` and ``"time"``: ``min``, ``max``, ``width``, the number of ``bins``, and
          ``speed_of_light``,
        - ``"bounce"``: ``max``, the largest number of bounces,
        - ``"light"``: ``emitters``, their names,
        - ``"stokes"``: ``parameters``, the names of the Stokes parameters,
        - ``"tagged"``: ``orders``, and ``delays`` in periods of the sound."""
        return self._decomposition[1]

    @functools.cached_property
    def _decomposition(self) -> Tuple[Dict[str, Layer], List[Dict[str, Any]]]:
        if isinstance(self._run, _morgana.Measured):
            return {}, []
        layers, axes = self._run.layers()
        flags = {name: few for name, _, _, few in layers}
        named = {name: Layer(mean, variance, flags[undelayed(name)], self.channels) for name, mean, variance, _ in layers}
        return named, json.loads(axes)

    def _quantities(self) -> Dict[str, Layer]:
        def layer(mean: Floats, variance: Floats, channels: List[str]) -> Layer:
            own = [channel.rpartition(".")[2] for channel in channels]
            return Layer(mean, variance, np.zeros(mean.shape, bool), own)

        layers = {name: layer(mean, variance, channels) for name, channels, mean, variance in self._rendered.quantities()}
        for name, channels, mean in self._rendered.moments():
            layers[name] = layer(mean, np.full_like(mean, np.inf), channels)
        return layers

    @functools.cached_property
    def _arrays(self) -> Mapping[str, Array]:
        if isinstance(self._run, _morgana.Rendered):
            return {}
        run = self._run
        outlines = {name: (unit, axes) for name, unit, axes in run.outlines()}
        return Lazy("array", outlines, lambda name: Array(*outlines[name], run.array(name)))

    @functools.cached_property
    def meters(self) -> Mapping[str, Reading]:
        """Readings of meters by the names of the quantities; empty for a picture.

        Names are ``fluence``, ``absorbed``, ``power``, ``irradiance`` and others (docs/meters.md),
        with the prefix ``METER.`` if there are several meters. A reading is made on first access,
        and kept: 25 bytes per bin. :meth:`reading` takes less memory.
        """
        kept: Dict[str, Reading] = {}

        def make(name: str) -> Reading:
            if name not in kept:
                kept[name] = reading_in(self._arrays, name)
            return kept[name]

        return Lazy("reading", names_in(self._arrays), make)

    def reading(self, name: str, *, dtype: DTypeLike = np.float64, errors: bool = True) -> Reading:
        """A quantity of ``meters`` in less memory.

        The reading has no effective numbers of particles and no ``few``, and is not kept.

        Parameters
        ----------
        name : str
            The quantity, as in ``meters``.
        dtype : dtype, optional
            Type of the numbers. ``float32`` takes 8 bytes per bin for mean and error.
        errors : bool, optional
            ``False`` omits the standard errors: ``error`` is NaN everywhere, and takes no memory.

        Returns
        -------
        Reading
            The means, and the errors if requested.

        Raises
        ------
        KeyError
            A name that is not in ``meters``.

        Examples
        --------
        >>> fluence = measured.reading("fluence", dtype="float32", errors=False).mean
        """
        if name not in self.meters:
            raise unknown("reading", name, self.meters)
        unit, axes, values = self._arrays[name]
        mean = values.astype(dtype, copy=False)
        if errors:
            error = self._arrays[f"{name}_error"].values.astype(dtype, copy=False)
        else:
            error = np.broadcast_to(np.asarray(np.nan, dtype), mean.shape)
        return Reading(mean, error, _edges(self._arrays, name, axes), unit)

    @functools.cached_property
    def records(self) -> Dict[str, Records]:
        """Records of detected light, by the names of the meters that keep them.

        Empty if no meter keeps records (docs/meters.md#records)."""
        if isinstance(self._run, _morgana.Rendered):
            return {}
        return found_in(self._arrays, json.loads(self._run.attributes))

    @property
    def emitted(self) -> Optional[Doubles]:
        """Power of all emitters, (channels,), in W; ``None`` for a picture."""
        return self._arrays["emitted"].values if self._arrays else None

    def write(self, path: Union[str, "os.PathLike[str]"], *, exposure: Optional[float] = None) -> None:
        """Write the picture or the readings to a file, completely or not at all.

        Parameters
        ----------
        path : path_like
            The file; its extension chooses the format: ``.exr``, ``.png`` or ``.npy`` for a
            picture, ``.npz``, ``.h5``, ``.nrrd`` or ``.npy`` for readings.
        exposure : float, optional
            Stops by which a ``.png`` file is brightened, as in :func:`write`.

        Raises
        ------
        FileError
            A file that cannot be written, or a format that does not suit the data.
        RenderError
            An ``exposure`` for readings.

        Examples
        --------
        >>> result.write("fog.exr")
        """
        exposure = optional_finite(exposure, "exposure")
        if isinstance(self._run, _morgana.Rendered):
            self._run.write(os.fspath(path), exposure)
        elif exposure is None:
            self._run.write(os.fspath(path))
        else:
            raise RenderError("exposure is for pictures, but the scene has meters instead of a camera")

    def __repr__(self) -> str:
        return f"<morgana.Result of {self._summary()}>"

    def _summary(self) -> str:
        stopped = "" if self.stopped is None else f", stopped: {self.stopped}"
        if isinstance(self._run, _morgana.Measured):
            readings = ", ".join(self.meters)
            return f"{self.scene.name}: {readings}, {self.stats['particles']} particles{stopped}"
        height, width, channels = self.image.shape
        if not self._rendered.is_light():
            names = ", ".join(name for name, *_ in self._rendered.quantities())
            return f"{self.scene.name}: {width} × {height}, {self.stats['spp']} spp, {names}{stopped}"
        mean = f"mean {self.mean:.5g} ± {self.mean_error:.2g}"
        if self._is_black:
            mean = "no sample found any light: does light get to the sensor? morgana check says what may be in the way"
        elif self.mean_few:
            mean += " (error not to be trusted)"
        return f"{self.scene.name}: {width} × {height} × {channels}, {self.stats['spp']} spp, {mean}{stopped}"

    def _repr_html_(self) -> str:
        text = html.escape(self._summary())
        if isinstance(self._run, _morgana.Measured):
            return f"<p>{text}</p>"
        return f"{thumbnail(self.image, self.channels)}<p>{text}</p>"


def undelayed(layer: str) -> str:
    """Returns the undelayed layer for a delayed layer of tagged light, and any other layer
    itself."""
    *before, word, number = ["", *layer.split(".")]
    return ".".join([*before[1:], "total"]) if word == "delay" and number.isdigit() else layer


class Lazy(Mapping[str, Value]):
    """Mapping that makes its values on access. The error for an unknown name lists the known names."""

    def __init__(self, kind: str, names: Iterable[str], make: Callable[[str], Value]) -> None:
        self._kind = kind
        self._names = dict.fromkeys(names)
        self._make = make

    def __getitem__(self, name: str) -> Value:
        if name not in self._names:
            raise unknown(self._kind, name, self)
        return self._make(name)

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __repr__(self) -> str:
        return repr(dict(self))


def names_in(arrays: Mapping[str, Array]) -> List[str]:
    """Returns the names of the readings among the arrays of a measurement."""
    return [name for name in arrays if f"{name}_error" in arrays]


def reading_in(arrays: Mapping[str, Array], name: str) -> Reading:
    """Returns a reading from the arrays of a measurement."""
    unit, axes, mean = arrays[name]
    error, effective, few = (arrays[f"{name}_{what}"].values for what in ("error", "effective", "few"))
    return Reading(mean, error, _edges(arrays, name, axes), unit, effective, few != 0)


def _edges(arrays: Mapping[str, Array], name: str, of: List[str]) -> Dict[str, Optional[Doubles]]:
    """Returns the edges of the bins of each axis of a reading."""
    prefix, dot, _ = name.rpartition(".")
    of_axes = {axis: f"{prefix}{dot}{axis}_edges" for axis in of}
    return {axis: arrays[edges].values if edges in arrays else None for axis, edges in of_axes.items()}


def thumbnail(image: Floats, channels: List[str]) -> str:
    """Returns a small picture for notebooks, as HTML."""
    height, width = image.shape[:2]
    n = min(-(-max(height, width) // THUMBNAIL), height, width)
    small = image[: height // n * n, : width // n * n]
    small = small.reshape(height // n, n, width // n, n, -1).mean(axis=(1, 3))
    png = base64.b64encode(_morgana.encode_png([("", channels, small)])).decode()
    return f'<img src="data:image/png;base64,{png}" width="{small.shape[1]}" height="{small.shape[0]}">'
