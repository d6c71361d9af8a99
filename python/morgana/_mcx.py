"""Configurations of MCX."""

from __future__ import annotations

from typing import Any, Dict, Mapping

import numpy as np

from ._morgana import Scene
from ._scene import load_dict

SOURCE = {
    "srctype": "Type", "srcpos": "Pos", "srcdir": "Dir", "srcparam1": "Param1", "srcparam2": "Param2", "srcid": "ID", "srcnum": "SrcNum",
}
"""Keys of a configuration, and of ``Optode.Source`` of an input file."""

FORWARD = {"tstart": "T0", "tend": "T1", "tstep": "Dt"}

IGNORED = {"autopilot", "detphotons", "gpuid", "issaveexit", "issavedet", "nblocksize", "nthread", "savedetflag", "seed"}
"""What does not change the result, or is given to :func:`morgana.render`."""


def load_mcx(cfg: Mapping[str, Any], /) -> Scene:
    """Make a scene of a configuration of MCX: the dictionary that ``pmcx.run`` takes.

    The scene measures fluence in the voxels of ``vol``, per joule, and in time gates if there are several; its unit of length is a
    millimetre. Input files of MCX are read by :func:`load_file`. What would change the result but is not read is an error
    (docs/guides/tissue-optics.md#input-of-mcx).

    Parameters
    ----------
    cfg : mapping
        ``vol`` (labels ``[x, y, z]``), ``prop`` (rows of mua, mus, g, n), ``srcpos``, ``srcdir``, and if they are given ``srctype``,
        ``srcparam1``, ``srcparam2``, ``srcpattern`` (``[column, row]``), ``srcid``, ``nphoton``, ``tstart``, ``tend``, ``tstep``, ``unitinmm``, ``isreflect``,
        ``issrcfrom0`` (0, as in MCX: the first voxel begins at 1, 1, 1).
        Several sources are rows of ``srcpos``, whose fourth number is their weight, ``srcdir`` and parameters.
        Detectors ``detpos`` (rows of x, y, z, radius) are meters that keep at most ``maxdetphoton`` records each:
        ``Result.records["detector1"]``.

    Returns
    -------
    Scene
        The scene, ready to :func:`render`.

    Raises
    ------
    SceneError
        Something is missing, or not read.
    ValueError
        A key that is not known.

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
    if cfg.get("isnormalized", 1) != 1:
        raise ValueError("isnormalized is 1: values are fluence per joule")
    left: Dict[str, Any] = {key: value for key, value in cfg.items() if key not in IGNORED | {"isnormalized"}}
    source = _taken(left, SOURCE)
    if "srcpattern" in left:
        source["Pattern"] = np.ascontiguousarray(left.pop("srcpattern"), float)
    forward = _taken(left, FORWARD)
    if "tend" in cfg and "tstep" not in cfg:
        forward["Dt"] = forward["T1"] - forward.get("T0", 0.0)
    domain = {"OriginType": left.pop("issrcfrom0", 0), **_taken(left, {"unitinmm": "LengthUnit"})}
    for key, name in [("vol", "Volume"), ("prop", "Media")]:
        if key in left:
            domain[name] = np.asarray(left.pop(key))
    session = _taken(left, {"nphoton": "Photons", "isreflect": "DoMismatch", "maxdetphoton": "MaxDetPhoton"})
    optode: Dict[str, Any] = {"Source": source}
    if "detpos" in left:
        optode["Detector"] = np.asarray(left.pop("detpos"), float).reshape(-1, 4)
    if left:
        raise ValueError(f"keys of the configuration that are not read: {', '.join(sorted(left))}")
    return load_dict({"Session": session, "Forward": forward, "Optode": optode, "Domain": domain})


def _taken(left: Dict[str, Any], keys: Mapping[str, str]) -> Dict[str, Any]:
    """Takes what there is of some keys out of a dictionary, under other names."""
    return {name: left.pop(key) for key, name in keys.items() if key in left}
