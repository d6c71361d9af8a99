"""Conversion to arrays and data sets of xarray."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict, List, Mapping, NamedTuple, Optional, Set, Tuple

import numpy as np
from numpy.typing import NDArray

from ._extras import advice

if TYPE_CHECKING:
    from ._estimate import Estimate
    from ._records import Records
    from ._selection import Axis

SPEED_OF_LIGHT = 299_792_458.0
"""Speed of light in vacuum, m/s."""

LENGTHS = ("x", "y", "z", "r", "opl")
"""Axes in scene units."""

TIMES = ("delay", "exposure")
"""Axes in seconds, if they have coordinates."""

Variable = Tuple[List[str], Any, Dict[str, str]]


def module() -> Any:
    """Returns the module xarray."""
    try:
        import xarray
    except ImportError as missing:
        raise ImportError(f"data sets need xarray: {advice('sweep')}") from missing
    return xarray


def data_array(estimate: "Estimate", name: Optional[str], metres_per_unit: Optional[float]) -> Any:
    """Returns an estimate as an array with its errors as a coordinate."""
    axes = estimate._axes()
    dimensions = [axis.name for axis in axes]
    coordinates = coordinates_of({axis.name: axis for axis in axes}, metres_per_unit)
    attributes = {"units": estimate.unit}
    for key, values in [("error", estimate.error), ("few", estimate.few), ("effective", estimate.effective)]:
        if values is not None:
            coordinates[key] = (dimensions, np.asarray(values), attributes if key == "error" else {})
    return module().DataArray(np.asarray(estimate.mean), coordinates, dimensions, name, attributes)


def data_set(quantities: Mapping[str, "Estimate"], metres_per_unit: Optional[float]) -> Any:
    """Returns estimates by name, with their errors, as a data set."""
    taken = {name for of in quantities for name in (of, f"{of}_error")}
    axes = {name: estimate._axes() for name, estimate in quantities.items()}
    dimensions, known = shared_dimensions(axes, taken)
    variables: Dict[str, Variable] = {}
    for name, estimate in quantities.items():
        attributes = {"units": estimate.unit} if estimate.unit else {}
        variables[name] = (dimensions[name], np.asarray(estimate.mean), attributes)
        variables[f"{name}_error"] = (dimensions[name], np.asarray(estimate.error), attributes)
    return module().Dataset(variables, coordinates_of(known, metres_per_unit))


def record_set(records: "Records") -> Any:
    """Returns the columns of records as a data set."""
    over = {
        "weight": ["channel"], "position": ["xyz"], "direction": ["xyz"], "path_length": ["region"], "scatterings": ["region"],
        "momentum_transfer": ["region"], "stokes": ["stokes_parameter", "channel"],
    }  # fmt: skip
    units = {"weight": records.unit, "stokes": records.unit, **dict.fromkeys(("position", "optical_length", "path_length"), "unit")}
    variables: Dict[str, Variable] = {}
    for name, values in records._asdict().items():
        if not isinstance(values, np.ndarray):
            continue
        if name == "mu_a":
            variables[name] = (["region", "channel"], values, {"units": "1/unit"})
        elif name == "velocity_change":
            variables[name] = (["region"], values, {"units": "1/s"})
        else:
            # Files of xarray have no complex numbers.
            parts = {f"{name}_real": values.real, f"{name}_imag": values.imag} if np.iscomplexobj(values) else {name: values}
            attributes = {"units": units[name]} if name in units else {}
            variables.update({part: (["record", *over.get(name, [])], of, attributes) for part, of in parts.items()})
    return module().Dataset(variables, {"region": records.regions, "xyz": ["x", "y", "z"]}, {"particles": records.particles})


def coordinates_of(axes: Mapping[str, "Axis"], metres_per_unit: Optional[float] = None) -> Dict[str, Variable]:
    """Returns the coordinates of dimensions: centres of bins with their edges, names, and times
    beside optical path lengths."""
    found: Dict[str, Variable] = {}
    for dimension, axis in axes.items():
        if axis.edges is None:
            if axis.names is not None:
                found[dimension] = ([dimension], axis.coordinates, {"units": "s"} if axis.has_points and axis.name in TIMES else {})
            continue
        attributes = {"units": "unit"} if axis.name in LENGTHS else {}
        if axis.name == "opl":
            attributes["long_name"] = "optical path length"
        found[dimension] = ([dimension], axis.coordinates, attributes)
        found[f"{dimension}_lower"] = ([dimension], np.asarray(axis.edges[:-1]), attributes)
        found[f"{dimension}_upper"] = ([dimension], np.asarray(axis.edges[1:]), attributes)
        if axis.name == "opl" and metres_per_unit is not None:
            time = dimension[: -len("opl")] + "time"
            found[time] = ([dimension], axis.coordinates * metres_per_unit / SPEED_OF_LIGHT, {"units": "s", "long_name": "time of flight"})
    return found


class _Bins(NamedTuple):
    """Bins of an axis. Axes with equal bins share a dimension."""

    size: int
    names: Tuple[str, ...] = ()
    edges: Tuple[float, ...] = ()


def shared_dimensions(axes: Mapping[str, List["Axis"]], taken: Set[str]) -> Tuple[Dict[str, List[str]], Dict[str, "Axis"]]:
    """Returns the names of the dimensions of each quantity, none of them in ``taken``, and the axis
    of each dimension. Axes have the name of their quantity or meter as prefix if their bins differ
    between quantities."""
    kinds: Dict[str, Dict[_Bins, List[Tuple[str, Axis]]]] = {}
    for name, of in axes.items():
        for axis in of:
            edges = () if axis.edges is None else tuple(axis.edges)
            bins = _Bins(axis.size, () if axis.names is None else tuple(axis.names), edges)
            kinds.setdefault(axis.name, {}).setdefault(bins, []).append((name, axis))
    found: Dict[Tuple[str, str], str] = {}
    known: Dict[str, Axis] = {}
    for kind, by_bins in kinds.items():
        alone = len(by_bins) == 1 and kind not in taken
        for users in by_bins.values():
            dimension = kind if alone else _own(kind, users[0][0], taken)
            taken = {*taken, dimension}
            found.update({(name, kind): dimension for name, _ in users})
            known[dimension] = users[0][1]
    return {name: [found[name, axis.name] for axis in of] for name, of in axes.items()}, known


def _own(axis: str, quantity: str, taken: Set[str]) -> str:
    """Returns a name for the axis of a quantity, with the prefix of its meter if that name is free,
    else of the quantity."""
    meter = quantity.rpartition(".")[0]
    name = f"{meter}.{axis}"
    return name if meter and name not in taken else f"{quantity}.{axis}"
