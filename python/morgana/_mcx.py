"""Scenes from configurations of MCX."""

from __future__ import annotations

import json
from typing import Any, Dict, Mapping

import numpy as np
from numpy.typing import NDArray

from . import _morgana
from ._checks import mapping, real, shown
from ._morgana import Scene
from ._numbers import in_order, numbers
from ._scene import _instead, _warned

SOURCE = {
    "srctype": "Type", "srcpos": "Pos", "srcdir": "Dir", "srcparam1": "Param1", "srcparam2": "Param2", "srcid": "ID", "srcnum": "SrcNum",
}
"""Keys of a configuration, and their names in ``Optode.Source`` of an input file."""

FORWARD = {"tstart": "T0", "tend": "T1", "tstep": "Dt"}

OUTPUT = ("flux", "fluence", "energy", "rf")
"""Accepted values of ``outputtype``."""

SESSION = {
    "isnormalized": "DoNormalize", "isreflect": "DoMismatch", "isspecular": "DoSpecular", "maxdetphoton": "MaxDetPhoton", "nphoton": "Photons",
    "outputtype": "OutputType",
}
"""Keys of a configuration, and their names in ``Session`` of an input file."""

QUANTILES = {"angleinvcdf": "AngleInverseCDF", "invcdf": "InverseCDF"}
"""Keys of quantiles, and their names in ``Optode.Source`` and ``Domain`` of an input file."""

ARRAYS = {"angleinvcdf", "detpos", "invcdf", "prop", "srcdir", "srcparam1", "srcparam2", "srcpattern", "srcpos", "vol"}

IGNORED = {
    "autopilot", "detphotons", "faststep", "flog", "gpuid", "isgpuinfo", "ismomentum", "issave2pt", "issavedet", "issaveexit", "issaveref", "issaveseed",
    "lang", "maxjumpdebug", "minenergy", "nblocksize", "nthread", "outputformat", "printgpu", "rootpath", "savedetflag", "session", "workload",
}
"""Keys without effect. They concern devices, files, messages and further results, or do not change
means: below ``minenergy`` photons undergo Russian roulette, and ``faststep`` is obsolete."""


def load_mcx(cfg: Mapping[str, Any], /, *, weight_windows: bool = False, pattern: int = 0) -> Scene:
    """Make a scene from a configuration of MCX: the dictionary that ``pmcx.run`` takes.

    The scene measures fluence per joule in the voxels of ``vol``, and in time gates if there are
    several. Its unit of length is a millimetre. :func:`load_file` reads input files of MCX. A
    setting that would change the result but is not supported raises an error
    (docs/guides/tissue-optics.md#input-of-mcx).

    Parameters
    ----------
    cfg : mapping
        ``vol`` (labels ``[x, y, z]``, or coefficients ``[1, 2 or 4, x, y, z]``: mua, then mus, then
        g and n), ``prop`` (rows of mua, mus, g, n), ``srcpos``, ``srcdir``.
        Optional are ``srctype``, ``srcparam1``, ``srcparam2``, ``srcpattern`` (``[column, row]``, or
        ``[pattern, column, row]`` with ``pattern``), ``angleinvcdf``, ``srcid``, ``nphoton``, ``tstart``,
        ``tend``, ``tstep``, ``unitinmm``, ``invcdf``, ``isreflect``, ``omega`` (rad/s, adds amplitude
        and phase of modulated light), ``issrcfrom0`` (0, as in MCX: the first voxel begins at 1, 1, 1), and ``bc`` with mirrors ``m``, or letters that agree with
        ``isreflect``. ``shapes`` (a JSON text, or its decoded value) are drawn into ``vol``.
        Several sources are rows of ``srcpos``, with their weight as fourth number, of ``srcdir``
        and of the parameters. Detectors ``detpos`` (rows of x, y, z, radius) are meters that keep
        at most ``maxdetphoton`` records each: ``Result.records["detector1"]``. ``outputtype`` has
        no effect; a warning says where to find the values of ``flux``, ``energy`` and ``rf``. Settings of
        devices, files and messages have no effect, nor does ``seed``, which is an argument of
        :func:`render`.
    weight_windows : bool, optional
        Divide and terminate particles so that late time gates are as accurate as early ones. A
        particle then takes several times as long (docs/meters.md#parameters).
    pattern : int, optional
        Number of the pattern, from 1, if ``srcpattern`` holds several.

    Returns
    -------
    Scene
        The scene, ready to :func:`render`.

    Raises
    ------
    SceneError
        A required key is missing, or a value is not supported.
    ValueError
        An unknown key or ``outputtype``. Values that request another result than the fluence of
        ``nphoton`` photons. ``vol`` without three or four axes. Rows of ``detpos`` without four numbers.
    TypeError
        Not a dictionary, or an array that is not of real numbers.

    Examples
    --------
    >>> cfg = {
    ...     "vol": np.ones((60, 60, 60), "uint8"), "prop": [[0, 0, 1, 1], [0.005, 1, 0.01, 1.37]],
    ...     "srcpos": [30, 30, 0], "issrcfrom0": 1, "srcdir": [0, 0, 1], "nphoton": 100_000,
    ... }
    >>> measured = morgana.render(morgana.load_mcx(cfg))
    >>> measured.meters["fluence"].mean.shape
    (60, 60, 60)
    """
    left = {key: value for key, value in mapping(cfg, "a configuration").items() if key not in IGNORED}
    kind = left.get("outputtype", "fluence")
    if kind not in OUTPUT:
        raise ValueError(f"outputtype is {kind!r} but must be one of {', '.join(OUTPUT)}: morgana returns the fluence per joule, and records of detectors")
    _check_photons(left)
    sides = _boundaries(left)
    if not isinstance(left.get("srctype", ""), str):
        raise TypeError(f"cfg['srctype'] is {left['srctype']!r} but must be a text, such as 'pencil'")
    for key in left.keys() & {"vol", "prop"}:
        _morgana.refuse_masked(left[key], f"cfg[{key!r}]")
    for key in ARRAYS & left.keys():
        if getattr(getattr(left[key], "dtype", None), "kind", "") == "c":
            raise TypeError(f"cfg[{key!r}] has complex numbers but must be an array of real ones")
    source = _taken(left, SOURCE)
    if "Dir" in source:
        source["Dir"] = _directions(source["Dir"])
    if "srcpattern" in left:
        source["Pattern"] = np.ascontiguousarray(numbers(left.pop("srcpattern"), "cfg['srcpattern']"))
    if pattern:
        source["PatternID"] = pattern
    if "omega" in left:
        source["Frequency"] = real(left.pop("omega"), "omega", "an angular frequency in rad/s") / (2 * np.pi)
    source.update(_quantiles(left, "angleinvcdf"))
    forward = _taken(left, FORWARD)
    if "tend" in cfg and "tstep" not in cfg:
        forward["Dt"] = forward["T1"] - forward.get("T0", 0.0)
    _check_gates(left.pop("maxgate", 0), forward)
    if weight_windows:
        forward["WeightWindows"] = True
    domain = {"OriginType": left.pop("issrcfrom0", 0), **_taken(left, {"unitinmm": "LengthUnit"}), **_quantiles(left, "invcdf")}
    if "vol" in left:
        domain.update(_volume(left.pop("vol")))
    if "prop" in left:
        domain["Media"] = np.asarray(left.pop("prop"))
    session = {**_taken(left, SESSION), **sides}
    optode: Dict[str, Any] = {"Source": source}
    if "detpos" in left:
        optode["Detector"] = _detectors(left.pop("detpos"))
    shapes = {"Shapes": _shapes(left.pop("shapes"))} if "shapes" in left else {}
    if left:
        raise ValueError(f"morgana does not support these keys of the configuration: {', '.join(sorted(left))}")
    tree = {"Session": session, "Forward": forward, "Optode": optode, "Domain": domain, **shapes}
    return _warned(_morgana.load_dict(tree, [], _instead(None, None, False, False, (), None)))


def _check_photons(left: Dict[str, Any]) -> None:
    """Checks that all photons are counted, and that each is a new photon whose light is
    measured."""
    if "nphoton" in left:
        photons = real(left["nphoton"], "nphoton", "a whole number")
        if not photons.is_integer():
            raise ValueError(f"nphoton is {photons:g} but must be a whole number")
        left["nphoton"] = int(photons)
    repeats = left.pop("respin", 1)
    if repeats != 1:
        raise ValueError(f"respin is {shown(repeats)} but must be 1: give the total number of photons as nphoton")
    if np.ndim(left.pop("seed", 0)) > 0:
        raise ValueError("seed is an array, but morgana does not replay photons: leave it out, and give render a number")
    if "R" in str(left.pop("debuglevel", "")).upper():
        raise ValueError("debuglevel R requests random numbers instead of the fluence: leave it out")


def _directions(srcdir: Any) -> Any:
    """Returns directions, with texts of JData for focal lengths that are infinite or NaN."""
    rows = np.asarray(srcdir)
    if rows.dtype.kind != "f" or np.isfinite(rows).all():
        return srcdir
    texts = {"nan": "_NaN_", "inf": "_Inf_", "-inf": "-_Inf_"}

    def row(values: Any) -> Any:
        return [texts.get(str(float(v)), float(v)) for v in values]

    return row(rows) if rows.ndim == 1 else [row(values) for values in rows]


def _quantiles(left: Dict[str, Any], key: str) -> Dict[str, Any]:
    """Takes quantiles from a configuration. Returns them by their name in an input file."""
    if key not in left:
        return {}
    return {QUANTILES[key]: numbers(left.pop(key), f"cfg[{key!r}]").ravel()}


def _boundaries(left: Dict[str, Any]) -> Dict[str, Any]:
    """Takes the flags of the six sides: ``m`` for mirrors, or letters that agree with ``isreflect``,
    which are ``_``, and ``r`` (Fresnel) or ``a`` (no reflection). Returns their setting."""
    flags = left.pop("bc", "")
    own = "_mr" if left.get("isreflect", True) else "_ma"
    if not isinstance(flags, str) or flags[:6].lower().strip(own) or flags[6:].strip("0"):
        raise ValueError(
            f"bc is {flags!r}, but sides other than isreflect makes them, which are periodic or detect light, are not read: give m for mirrors, leave out "
            "other letters, and measure the light that leaves by a scene of your own"
        )
    return {"BCFlags": flags[:6]} if flags else {}


def _check_gates(at_once: Any, forward: Mapping[str, Any]) -> None:
    """Raises an error if the number of simultaneous time gates, 0 for all, is below the number of
    gates: MCX measures the rest separately, without normalisation."""
    first, last = forward.get("T0", 0.0), forward.get("T1", 5e-9)
    width = forward.get("Dt", last - first)
    if 0 < at_once and (at_once + 0.5) * width < last - first:
        raise ValueError(f"maxgate is {at_once}, less than the number of time gates: leave it out, because morgana measures all gates")


def _shapes(given: Any) -> Any:
    """Returns the list of shapes, or a JData array, from a JSON text or its decoded value."""
    if isinstance(given, str):
        try:
            given = json.loads(given)
        except json.JSONDecodeError as error:
            raise ValueError(f"cfg['shapes'] is not JSON: {error}") from None
    shapes = given.get("Shapes", given) if isinstance(given, Mapping) else given
    if isinstance(shapes, Mapping) and "_ArrayType_" not in shapes:
        return [shapes]
    return shapes


FORMATS = {(2, "f2"): "muamus_half", (2, "u2"): "muamus_short", (4, "u1"): "asgn_byte"}
"""Number of coefficients of a voxel and type of the numbers, and their format in input files."""


def _volume(vol: Any) -> Dict[str, Any]:
    """Returns the labels of voxels ``[x, y, z]``, or their coefficients ``[coefficient, x, y, z]``
    with their format."""
    if np.ndim(vol) == 4:
        coefficients = np.asarray(vol)
        kind = coefficients.dtype.newbyteorder("=").str[1:]
        found = FORMATS.get((len(coefficients), kind))
        return {"Volume": coefficients.astype(np.float32), **({"MediaFormat": found} if found else {})}
    labels = np.asarray(in_order(vol, "cfg['vol']", "xyz"))
    if labels.ndim != 3:
        raise ValueError(f"cfg['vol'] has the shape {labels.shape} but must be labels [x, y, z], or coefficients [1, 2 or 4, x, y, z]")
    return {"Volume": labels}


def _detectors(detpos: Any) -> NDArray[np.float64]:
    """Returns rows of x, y, z, radius."""
    rows = numbers(detpos, "cfg['detpos']")
    if rows.size == 0:
        return rows.reshape(0, 4)
    rows = np.atleast_2d(rows)
    if rows.ndim != 2 or rows.shape[1] != 4:
        raise ValueError(f"cfg['detpos'] has the shape {rows.shape} but must be rows of four numbers: x, y, z, radius")
    return rows


def _taken(left: Dict[str, Any], keys: Mapping[str, str]) -> Dict[str, Any]:
    """Moves the values of some keys out of a dictionary, to new names."""
    return {name: left.pop(key) for key, name in keys.items() if key in left}
