"""Results of renders and measurements."""

from __future__ import annotations

import functools
import json
import os
from typing import Any, Callable, Dict, Iterable, Iterator, List, Mapping, Optional, Tuple, TypeVar, Union

import numpy as np
from numpy.typing import DTypeLike, NDArray

from . import _morgana
from ._archives import Array
from ._checks import optional_finite, optional_positive
from ._errors import RenderError
from ._estimate import Data, Estimate, Origin, run_with
from ._layer import UNITS, Bools, Floats, Layer, picture, undelayed
from ._morgana import Scene
from ._pictures import caption, html_of, thumbnail
from ._reading import Reading, edges_of, names_in, reading_in, reading_of
from ._records import Records, found_in
from ._values import Named, alike, unknown
from ._xarray import data_set

Doubles = NDArray[np.float64]

Value = TypeVar("Value")

SHOWN = 2
"""Maximum number of readings that a notebook shows of a result."""


class Result(Data):
    """Result of :func:`render`: a picture, or the readings of meters.

    A picture computes like a NumPy array, with its errors: ``result / 2``, or ``result - other`` of
    a run with another seed (see :class:`Estimate`). The axes are ``row``, ``column`` and
    ``channel``. Readings are in ``meters``.

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

    @property
    def _origin(self) -> Origin:
        return run_with(self.stats["seed"])

    def _estimate(self) -> Estimate:
        return picture(self.image, self.error, self.few, self.channels, self._origin)

    def __bool__(self) -> bool:
        return True

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
        ``absorbed_by_surfaces``, ``escaped``, ``cut_off``, ``lost``, ``fluorescence``, ``left_over``.
        Fluorescence is power that media emit besides the emitters.
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
        named = {name: Layer(mean, variance, flags[undelayed(name)], self.channels)._from(self._origin) for name, mean, variance, _ in layers}
        return named, json.loads(axes)

    def _quantities(self) -> Dict[str, Layer]:
        def layer(mean: Floats, variance: Floats, channels: List[str]) -> Layer:
            own = [channel.rpartition(".")[2] for channel in channels]
            return Layer(mean, variance, np.zeros(mean.shape, bool), own)._from(self._origin)

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
    def _attributes(self) -> Dict[str, Any]:
        """Attributes of a file of the readings."""
        attributes = {} if isinstance(self._run, _morgana.Rendered) else json.loads(self._run.attributes)
        return {**attributes, "seed": self.stats["seed"]}

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
                kept[name] = reading_in(self._arrays, name, self._attributes)
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
        return reading_of(Reading(mean, error, edges_of(self._arrays, name, axes), unit), self._arrays, name, self._attributes)

    @functools.cached_property
    def records(self) -> Dict[str, Records]:
        """Records of detected light, by the names of the meters that keep them.

        Empty if no meter keeps records (docs/meters.md#records)."""
        if isinstance(self._run, _morgana.Rendered):
            return {}
        return found_in(self._arrays, self._attributes)

    @property
    def emitted(self) -> Optional[Doubles]:
        """Power of all emitters, (channels,), in W; ``None`` for a picture."""
        return self._arrays["emitted"].values if self._arrays else None

    def to_xarray(self, *, name: Optional[str] = None, metres_per_unit: Optional[float] = None) -> Any:
        """Convert all quantities to an ``xarray.Dataset``.

        Parameters
        ----------
        name : str, optional
            Name of a single quantity, such as ``"fluence"``; by default all.
        metres_per_unit : float, optional
            Length of a scene unit in m, > 0. It adds the coordinate ``time`` in s beside ``opl``:
            optical path length over the speed of light in vacuum.

        Returns
        -------
        xarray.Dataset
            A variable for ``image`` and each of ``layers``, or for each of ``meters``, and one
            with the suffix ``_error``. ``attrs["units"]`` is the unit. Coordinates are the centres
            of bins with their edges (``z_lower``, ``z_upper``), and names of channels. An axis has
            the name of its meter as prefix, as in ``near.z``, if meters have different bins.

        Raises
        ------
        KeyError
            An unknown quantity.
        ImportError
            xarray is not installed: run ``pip install ".[sweep]"`` in a clone of morgana.

        Examples
        --------
        >>> measured.to_xarray()["fluence"].sum(("x", "y")).plot()
        """
        quantities = self._quantities_by_name()
        if name is not None and name not in quantities:
            raise unknown("quantity", name, quantities)
        chosen = quantities if name is None else {name: quantities[name]}
        return data_set(chosen, optional_positive(metres_per_unit, "metres_per_unit"))

    def _quantities_by_name(self) -> Dict[str, Estimate]:
        if isinstance(self._run, _morgana.Measured):
            return dict(self.meters)
        layers = {name: layer._estimate()._replace(unit=UNITS.get(name, "")) for name, layer in self.layers.items()}
        return {"image": self._estimate(), **layers}

    def write(
        self,
        path: Union[str, "os.PathLike[str]"],
        *,
        exposure: Optional[float] = None,
        dtype: Optional[DTypeLike] = None,
        meter: Optional[str] = None,
    ) -> None:
        """Write the picture or the readings to a file, completely or not at all.

        Parameters
        ----------
        path : path_like
            The file; its extension chooses the format: ``.exr``, ``.png`` or ``.npy`` for a
            picture. For readings, ``.npz``, ``.h5`` and ``.mat`` hold all arrays; ``.vti``,
            ``.nii.gz``, ``.nii``, ``.jnii``, ``.bnii`` and ``.nrrd`` hold a grid in space; ``.npy``
            holds numbers only
            (docs/meters.md#files).
        exposure : float, optional
            Stops by which a ``.png`` file is brightened, as in :func:`write`.
        dtype : dtype, optional
            Type of readings: ``float64`` (default) or ``float32``.
        meter : str, optional
            Name of the meter whose readings are written; by default all. Files of one meter need
            it if the scene has several.

        Raises
        ------
        FileError
            A file that cannot be written, or a format that does not suit the data.
        RenderError
            An ``exposure`` for readings; a ``dtype`` or ``meter`` for a picture.
        KeyError
            An unknown meter.

        Examples
        --------
        >>> result.write("fog.exr")
        >>> measured.write("tissue.nii.gz", dtype="float32", meter="tank")
        """
        exposure = optional_finite(exposure, "exposure")
        if isinstance(self._run, _morgana.Rendered):
            if dtype is not None or meter is not None:
                raise RenderError("dtype and meter are for readings, but the scene has a camera")
            self._run.write(os.fspath(path), exposure)
        elif exposure is None:
            if meter is not None and meter not in self.scene.meters:
                raise unknown("meter", meter, self.scene.meters)
            number = None if meter is None else self.scene.meters.index(meter)
            self._run.write(os.fspath(path), np.dtype(np.float64 if dtype is None else dtype).name, number)
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

    def _reading_html(self, name: str) -> str:
        reading = self.reading(name)
        return html_of(reading, f"{name}, {repr(reading).strip('<>')}")

    def _repr_html_(self) -> str:
        if isinstance(self._run, _morgana.Measured):
            return "".join(self._reading_html(name) for name in list(self.meters)[:SHOWN]) + caption(self._summary())
        return thumbnail(self.image, self.channels) + caption(self._summary())


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
