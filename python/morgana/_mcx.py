"""Configurations of MCX."""

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
"""Keys of a configuration, and of ``Optode.Source`` of an input file."""

FORWARD = {"tstart": "T0", "tend": "T1", "tstep": "Dt"}

OUTPUT = ("flux", "fluence", "energy")
"""Values of ``outputtype``."""

SESSION = {
    "isnormalized": "DoNormalize", "isreflect": "DoMismatch", "isspecular": "DoSpecular", "maxdetphoton": "MaxDetPhoton", "nphoton": "Photons",
    "outputtype": "OutputType",
}
"""Keys of a configuration, and of ``Session``."""

ARRAYS = {"detpos", "prop", "srcdir", "srcparam1", "srcparam2", "srcpattern", "srcpos", "vol"}

IGNORED = {
    "autopilot", "detphotons", "faststep", "flog", "gpuid", "isgpuinfo", "ismomentum", "issave2pt", "issavedet", "issaveexit", "issaveref", "issaveseed",
    "lang", "maxjumpdebug", "minenergy", "nblocksize", "nthread", "outputformat", "printgpu", "rootpath", "savedetflag", "session", "workload",
}
"""What is about devices, files, messages and further results, or does not change means: below ``minenergy`` photons play Russian roulette, and
``faststep`` has become obsolete."""


def load_mcx(cfg: Mapping[str, Any], /, *, weight_windows: bool = False) -> Scene:
    """Make a scene of a configuration of MCX: the dictionary that ``pmcx.run`` takes.

    The scene measures fluence in the voxels of ``vol``, per joule, and in time gates if there are several; its unit of length is a
    millimetre. Input files of MCX are read by :func:`load_file`. What would change the result but is not read is an error
    (docs/guides/tissue-optics.md#input-of-mcx).

    Parameters
    ----------
    cfg : mapping
        ``vol`` (labels ``[x, y, z]``), ``prop`` (rows of mua, mus, g, n), ``srcpos``, ``srcdir``, and if they are given ``srctype``,
        ``srcparam1``, ``srcparam2``, ``srcpattern`` (``[column, row]``), ``srcid``, ``nphoton``, ``tstart``, ``tend``, ``tstep``, ``unitinmm``, ``isreflect``,
        ``issrcfrom0`` (0, as in MCX: the first voxel begins at 1, 1, 1), ``bc`` if it says what ``isreflect`` says. ``shapes`` (a text in JSON, or what it stands for) are drawn into ``vol``.
        Several sources are rows of ``srcpos``, whose fourth number is their weight, ``srcdir`` and parameters.
        Detectors ``detpos`` (rows of x, y, z, radius) are meters that keep at most ``maxdetphoton`` records each:
        ``Result.records["detector1"]``. ``outputtype`` changes nothing: a warning says where the values of ``flux`` and ``energy`` are. Nor does
        what is about devices, files and messages, and ``seed``, which is an argument of :func:`render`.
    weight_windows : bool, optional
        Divide and terminate particles so that late time gates are as sure as early ones. A particle then takes several times as
        long (docs/meters.md#parameters).

    Returns
    -------
    Scene
        The scene, ready to :func:`render`.

    Raises
    ------
    SceneError
        Something is missing, or not read.
    ValueError
        A key or an ``outputtype`` that is not known, values that ask for another result than the fluence of ``nphoton`` photons, ``vol`` that does
        not have three axes, or rows of ``detpos`` that do not have four numbers.
    TypeError
        No dictionary, or an array that is not of real numbers.

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
    _check_boundaries(left)
    if not isinstance(left.get("srctype", ""), str):
        raise TypeError(f"cfg['srctype'] is {left['srctype']!r} but must be a text, such as 'pencil'")
    for key in left.keys() & {"vol", "prop"}:
        _morgana.refuse_masked(left[key], f"cfg[{key!r}]")
    for key in ARRAYS & left.keys():
        if getattr(getattr(left[key], "dtype", None), "kind", "") == "c":
            raise TypeError(f"cfg[{key!r}] has complex numbers but must be an array of real ones")
    source = _taken(left, SOURCE)
    if "srcpattern" in left:
        source["Pattern"] = np.ascontiguousarray(numbers(left.pop("srcpattern"), "cfg['srcpattern']"))
    forward = _taken(left, FORWARD)
    if "tend" in cfg and "tstep" not in cfg:
        forward["Dt"] = forward["T1"] - forward.get("T0", 0.0)
    _check_gates(left.pop("maxgate", 0), forward)
    if weight_windows:
        forward["WeightWindows"] = True
    domain = {"OriginType": left.pop("issrcfrom0", 0), **_taken(left, {"unitinmm": "LengthUnit"})}
    if "vol" in left:
        domain["Volume"] = _labels(left.pop("vol"))
    if "prop" in left:
        domain["Media"] = np.asarray(left.pop("prop"))
    session = _taken(left, SESSION)
    optode: Dict[str, Any] = {"Source": source}
    if "detpos" in left:
        optode["Detector"] = _detectors(left.pop("detpos"))
    shapes = {"Shapes": _shapes(left.pop("shapes"))} if "shapes" in left else {}
    if left:
        raise ValueError(f"keys of the configuration that are not read: {', '.join(sorted(left))}")
    tree = {"Session": session, "Forward": forward, "Optode": optode, "Domain": domain, **shapes}
    return _warned(_morgana.load_dict(tree, [], _instead(None, None, False, False, (), None)))


def _check_photons(left: Dict[str, Any]) -> None:
    """Sees that all photons are counted, and that each is a new one whose light is measured."""
    if "nphoton" in left:
        photons = real(left["nphoton"], "nphoton", "a whole number")
        if not photons.is_integer():
            raise ValueError(f"nphoton is {photons:g} but must be a whole number")
        left["nphoton"] = int(photons)
    repeats = left.pop("respin", 1)
    if repeats != 1:
        raise ValueError(f"respin is {shown(repeats)} but must be 1: give the number of all photons as nphoton")
    if np.ndim(left.pop("seed", 0)) > 0:
        raise ValueError("seed is an array, but photons are not replayed: leave it out, and give render a number")
    if "R" in str(left.pop("debuglevel", "")).upper():
        raise ValueError("debuglevel R asks for random numbers in place of the fluence: leave it out")


def _check_boundaries(left: Dict[str, Any]) -> None:
    """Takes flags of the six sides that say what ``isreflect`` does: ``_``, or ``r`` (Fresnel) and ``a`` (nothing is reflected)."""
    flags = left.pop("bc", "")
    own = "_r" if left.get("isreflect", True) else "_a"
    if not isinstance(flags, str) or flags[:6].lower().strip(own) or flags[6:].strip("0"):
        raise ValueError(
            f"bc is {flags!r}, but sides other than isreflect makes them, which are periodic or mirrors, or that detect light, are not read: leave it out, "
            "and measure the light that leaves by a scene of your own"
        )


def _check_gates(at_once: Any, forward: Mapping[str, Any]) -> None:
    """Refuses a number of time gates, 0 for all, that MCX measures one after the other, not normalised."""
    first, last = forward.get("T0", 0.0), forward.get("T1", 5e-9)
    width = forward.get("Dt", last - first)
    if 0 < at_once and (at_once + 0.5) * width < last - first:
        raise ValueError(f"maxgate is {at_once}, less than there are time gates: leave it out, all of them are measured")


def _shapes(given: Any) -> Any:
    """The list of shapes, or an array of JData, of a text or of what it stands for."""
    if isinstance(given, str):
        try:
            given = json.loads(given)
        except json.JSONDecodeError as error:
            raise ValueError(f"cfg['shapes'] is not JSON: {error}") from None
    shapes = given.get("Shapes", given) if isinstance(given, Mapping) else given
    if isinstance(shapes, Mapping) and "_ArrayType_" not in shapes:
        return [shapes]
    return shapes


def _labels(vol: Any) -> NDArray[Any]:
    """Labels of voxels."""
    labels = np.asarray(in_order(vol, "cfg['vol']", "xyz"))
    if labels.ndim != 3:
        raise ValueError(f"cfg['vol'] has the shape {labels.shape} but must be labels [x, y, z]: volumes of coefficients are not read")
    return labels


def _detectors(detpos: Any) -> NDArray[np.float64]:
    """Rows of x, y, z, radius."""
    rows = numbers(detpos, "cfg['detpos']")
    if rows.size == 0:
        return rows.reshape(0, 4)
    rows = np.atleast_2d(rows)
    if rows.ndim != 2 or rows.shape[1] != 4:
        raise ValueError(f"cfg['detpos'] has the shape {rows.shape} but must be rows of four numbers: x, y, z, radius")
    return rows


def _taken(left: Dict[str, Any], keys: Mapping[str, str]) -> Dict[str, Any]:
    """Takes what there is of some keys out of a dictionary, under other names."""
    return {name: left.pop(key) for key, name in keys.items() if key in left}
