"""Flow fields of other programs, resampled to the grids that scenes read.

Reads VTK's formats, OpenFOAM, CGNS and others.

    >>> import morgana.flow
    >>> mesh = morgana.flow.read("case.vtu")
    >>> jet = morgana.flow.sample(mesh, "rho", spacing=0.001)
    >>> print(jet.error)
    >>> jet.write("jet.vti")

From the command line: ``python -m morgana.flow case.vtu --array rho --spacing 0.001 -o jet.vti``.
Reading meshes needs ``pip install ".[flow]"`` in a clone of morgana, which installs PyVista. Files that
PyVista cannot read are read by meshio if it is installed. See
docs/guides/schlieren.md#flow-from-a-simulation.
"""

from __future__ import annotations

import argparse
import contextlib
import difflib
import importlib
import os
import sys
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union
from urllib.parse import unquote

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _morgana
from ._errors import Error, FileError
from ._extras import advice
from ._flow_cases import is_decomposed
from ._flow_cells import dimension, visible, without
from ._flow_frame import FlowError, Frame, frame_of
from ._morgana import load_field
from ._numbers import numbers
from ._values import comparable

__all__ = ["FlowError", "ResamplingError", "Sampled", "density", "main", "read", "sample"]

Doubles = NDArray[np.float64]
Path = Union[str, "os.PathLike[str]"]

MAX_SAMPLES = 1 << 28
"""Maximum number of samples of a grid: more would take gigabytes for each copy."""
OPENFOAM = (".foam", ".openfoam")
"""Extensions of files that stand for an OpenFOAM case."""
CONTROL = os.path.join("system", "controlDict")
"""File that every OpenFOAM case has."""
GAS_CONSTANT = 8.314462618
"""Molar gas constant, J/(mol K)."""
MAX_DEFAULT_SAMPLES = 4_000_000
"""Maximum number of samples of a grid without a given spacing: beyond it, the grid is coarser than
the mesh."""
MAX_COMPARED = 200_000
"""Maximum number of mesh values that a grid is compared with."""
BOUNDARY_MARGIN = 1e-7
"""Fraction of the extent of a mesh by which samples on its bounds are moved inside."""
CONTRAST = 1e-4
"""Range of the index that represents the samples when their interpolation error is computed."""
DRY_AIR = 28.9647e-3
"""Molar mass of dry air, kg/mol."""
MAX_MOLAR_MASS = 1.0
"""Upper bound of molar masses of gases, kg/mol. In g/mol, every gas has more."""


@comparable
class ResamplingError(NamedTuple):
    """Difference between the index field of a scene and the mesh.

    The grid is interpolated by B-splines, as in scenes. It is compared with the values at the
    points of the mesh, or at the centres of its cells for an array of cells."""

    rms: float
    """Root mean square difference, in the unit of the array."""
    largest: float
    """Largest difference, in the unit of the array."""
    of_range: float
    """Root mean square difference, relative to the range of the array."""
    points: int
    """Number of compared points: all points in the grid, but at most 200 000."""

    @property
    def largest_of_range(self) -> float:
        """Largest difference, relative to the range of the array."""
        return self.largest * self.of_range / self.rms if self.rms > 0 else 0.0

    def __str__(self) -> str:
        return (
            f"rms {self.rms:.3g} ({100 * self.of_range:.2g} % of the range), "
            f"largest {self.largest:.3g} ({100 * self.largest_of_range:.2g} %), at {self.points} points"
        )


@comparable
class Sampled(NamedTuple):
    """Samples of a mesh on a regular grid: the result of :func:`sample`."""

    values: Doubles
    """Samples, [z, y, x]."""
    spacing: Tuple[float, float, float]
    """Distances of samples along x, y, z, in the unit of the mesh."""
    origin: Tuple[float, float, float]
    """Position of the first sample, in the unit of the mesh."""
    name: str
    """Name of the array."""
    error: ResamplingError
    """Difference between the samples and the mesh."""
    outside: float
    """Fraction of the samples that lie outside the mesh, in hidden cells or in cells without a
    value, and have been filled."""

    def __repr__(self) -> str:
        depth, height, width = self.values.shape
        filled = f", {100 * self.outside:.2g} % outside" if self.outside > 0 else ""
        return f"<morgana.flow.Sampled of {self.name}, {width} × {height} × {depth}{filled}, error {self.error}>"

    def volume(self, plugin: str = "gladstone_dale", **parameters: Any) -> Dict[str, Any]:
        """The dictionary of a volume for :func:`morgana.load_dict`, at the position of the mesh.

        Parameters
        ----------
        plugin : str
            Type of the volume: ``gladstone_dale`` for densities in kg/m³, ``bspline`` for indices,
            ``pressure``.
        **parameters
            Further parameters of the volume, such as ``wavelength=532, reference=1.2``.

        Returns
        -------
        dict
            The volume.

        Examples
        --------
        >>> medium = {"type": "transparent", "ior": jet.volume(wavelength=532, reference=1.2)}
        """
        size = [(n - 1) * step for n, step in zip(self.values.shape[::-1], self.spacing)]
        place = [{"scale": size}, {"translate": list(self.origin)}]
        return {"type": plugin, "data": self.values, "placement": "nodes", "to_world": place, **parameters}

    def box(self, interior: Mapping[str, Any]) -> Dict[str, Any]:
        """The dictionary of the samples' box for :func:`morgana.load_dict`, with a null surface.

        Parameters
        ----------
        interior : mapping
            The medium inside the box.

        Returns
        -------
        dict
            The shape.

        Examples
        --------
        >>> scene["jet"] = jet.box({"type": "transparent", "ior": jet.volume(wavelength=532, reference=1.2)})
        """
        half = [0.5 * (n - 1) * step for n, step in zip(self.values.shape[::-1], self.spacing)]
        middle = [start + h for start, h in zip(self.origin, half)]
        place = [{"scale": half}, {"translate": middle}]
        return {"type": "cube", "to_world": place, "bsdf": {"type": "null"}, "interior": dict(interior)}

    def write(self, path: Path) -> None:
        """Write the samples to a volume file, completely or not at all.

        Parameters
        ----------
        path : path_like
            The file: any volume that ``morgana convert`` writes
            (docs/scene/volumes.md), in double precision except ``.vol``. ``.vti`` and
            ``.nrrd`` store the position, so that scenes need not give it. For ``.npy``, ``.npz``
            and ``.h5``, a scene gives the ``axis_order`` ``zyx``, the ``placement`` ``nodes``, and
            the position.

        Raises
        ------
        FileError
            Another extension, or a file that cannot be written.

        Examples
        --------
        >>> jet.write("jet.vti")
        """
        _morgana.write_volume(os.fspath(path), self.values, self.origin, self.spacing, self.name)


def read(path: Path, *, time: Optional[float] = None) -> Any:
    """Read a mesh by PyVista or meshio.

    Formats are ``.vti``, ``.vtr``, ``.vts``, ``.vtu``, ``.vtp``, ``.vtm``, ``.vtk``, ``.foam``,
    ``.cgns``, and all others that PyVista or meshio read. If a mesh has several blocks, the blocks
    that fill space are merged, without the surfaces around them and without hidden cells. The
    merged mesh keeps the arrays that all its blocks have. Values of OpenFOAM cells are not averaged
    at points. For a decomposed OpenFOAM case, the parts (``processor0``, …) are read if the case
    itself does not have the time.

    Parameters
    ----------
    path : path_like
        The file. For OpenFOAM, the folder of the case, or an empty file ``case.foam`` in it.
    time : float, optional
        Instant of a time series, as of OpenFOAM; by default the last.

    Returns
    -------
    pyvista.DataSet
        The mesh.

    Raises
    ------
    FileError
        A file that cannot be read.
    FlowError
        A time that the file does not have.

    Examples
    --------
    >>> mesh = morgana.flow.read("case.foam", time=0.5)
    """
    pyvista, name = _pyvista(), os.fspath(path)
    if not os.path.exists(name):
        raise FileError(f"{name}: no such file")
    if os.path.isdir(name):
        name = os.path.join(name, CONTROL)
        if not os.path.exists(name):
            raise FileError(f"{os.fspath(path)}: the folder is not a case of OpenFOAM, because it has no {CONTROL}")
    try:
        # Silence VTK's warnings, because most of them do not concern the mesh; show its errors.
        with pyvista.vtk_verbosity("error"):
            found = _read(pyvista, name, time)
    except FlowError:
        raise
    except (Exception, SystemExit) as error:  # Readers raise any exception; meshio's may exit.
        raise FileError(f"{name}: cannot be read: {error}") from None
    mesh = _merged(pyvista, found)
    if mesh is None:
        raise FileError(f"{name}: the file has no mesh")
    return mesh


def sample(
    mesh: Any,
    array: str,
    *,
    spacing: Union[None, float, Sequence[float]] = None,
    shape: Optional[Sequence[int]] = None,
    bounds: Optional[Sequence[float]] = None,
    outside: Optional[float] = None,
    revolve: Optional[str] = None,
    thickness: Optional[float] = None,
) -> Sampled:
    """Sample an array of a mesh on a regular grid.

    Parameters
    ----------
    mesh : pyvista.DataSet
        The mesh. Arrays of cells are averaged to its points first.
    array : str
        Name of the array, of one number at each point or cell. Cells that are hidden
        (``vtkGhostType``), or that have a hidden point, count as outside the mesh. With
        ``outside``, so do cells that are NaN or have a point that is NaN.
    spacing : float or three floats, optional
        Distance of samples, along all axes or along x, y, z. By default the spacing of a regular
        mesh, or the median size of the cells of other meshes; more if the grid would exceed 4
        million samples.
    shape : three ints, optional
        Numbers of samples along x, y, z, ≥ 2, instead of ``spacing``.
    bounds : six floats, optional
        xmin, xmax, ymin, ymax, zmin, zmax of the grid; by default the bounds of the mesh.
    outside : float, optional
        The value outside the mesh; by default the value of the nearest point of the mesh.
    revolve : str, optional
        ``"x"``, ``"y"`` or ``"z"``: the mesh is one half of an axisymmetric flow, and is revolved
        about this axis. It is planar, with the radius as its other extent, or it is a wedge of at
        most 20°. Values belong to the distances of their points, or of the centres of their cells,
        from the axis. Of a planar mesh on both sides of the axis, the side that reaches further is
        revolved, and the error compares it with both.
    thickness : float, optional
        The mesh is planar, and its field extends across it, by half of this thickness to each side.

    Returns
    -------
    Sampled
        The samples, with the error of the resampling.

    Raises
    ------
    FlowError
        An array that is missing from the mesh (the message lists its arrays), has several
        components, or is NaN without ``outside``. A grid that is too fine; empty bounds. A planar
        mesh without thickness, a surface that is not planar, or points without cells.

    Examples
    --------
    >>> jet = morgana.flow.sample(mesh, "rho", spacing=(0.5, 0.5, 1), outside=1.2)
    """
    if outside is not None and not np.isfinite(outside):
        raise FlowError(f"outside is {outside} but must be finite")
    whole = mesh
    name, mesh, known = _with_points(mesh, array, outside)
    frame = frame_of(whole, revolve, thickness, known.of_cells)
    if revolve is None and thickness is None and dimension(whole) < 3:
        raise FlowError("the mesh is a surface, or lines or points: give the mesh of the volume")
    low, high = _bounds(bounds, frame)
    counts = _counts(spacing, shape, whole, high - low)
    steps = (high - low) / (counts - 1)
    axes = [start + step * np.arange(count) for start, step, count in zip(low, steps, counts)]
    places = np.stack(np.meshgrid(*axes[::-1], indexing="ij")[::-1], axis=-1).reshape(-1, 3)
    places = frame.of(places)
    values, inside = _probe(mesh, name, places)
    if not inside.any():
        raise FlowError("no sample lies in the mesh: check bounds and the unit of length")
    if not inside.all():
        values[~inside] = outside if outside is not None else _nearest(mesh, name, places[~inside])
    values = values.reshape(counts[::-1])
    sampled = Sampled(values, _three(steps), _three(low), name, ResamplingError(0, 0, 0, 0), float(1 - inside.mean()))
    return sampled._replace(error=_error(sampled, frame.points(known.places), known.values))


def density(pressure: ArrayLike, temperature: ArrayLike, molar_mass: ArrayLike = DRY_AIR) -> Doubles:
    """Density of an ideal gas, p M/(R T).

    Parameters
    ----------
    pressure : array_like
        Absolute pressure, Pa, > 0.
    temperature : array_like
        Temperature, K, > 0.
    molar_mass : array_like
        Molar mass, kg/mol, > 0 and < 1: a number, or one for each point of a mixture. By default
        the molar mass of dry air.

    Returns
    -------
    numpy.ndarray
        Density, kg/m³.

    Raises
    ------
    ValueError
        A temperature, a pressure or a molar mass that is not positive, or a molar mass in g/mol.

    Examples
    --------
    >>> mesh["rho"] = morgana.flow.density(mesh["p"], mesh["T"])
    """
    temperature, pressure = numbers(temperature, "temperature"), numbers(pressure, "pressure")
    mass = numbers(molar_mass, "molar_mass")
    if not np.all(temperature > 0):
        raise ValueError("temperatures must be positive: give them in kelvins")
    if not np.all(pressure > 0):
        raise ValueError("pressures must be positive: give absolute pressures in pascals, not relative to a reference or divided by the density")
    if not np.all((mass > 0) & np.isfinite(mass)):
        raise ValueError("molar masses must be positive and finite")
    if np.any(mass >= MAX_MOLAR_MASS):
        raise ValueError(f"the molar mass {mass.max():g} kg/mol is too large for a gas: convert g/mol to kg/mol")
    return np.asarray(pressure * mass / (GAS_CONSTANT * temperature))


def _pyvista() -> Any:
    try:
        return importlib.import_module("pyvista")
    except ImportError:
        raise FlowError(f"PyVista reads meshes, and is not installed: {advice('flow')}") from None


def _case(name: str) -> Optional[str]:
    """Returns the folder of the OpenFOAM case that a file represents."""
    if name.endswith(CONTROL):
        return os.path.dirname(os.path.dirname(name))
    return os.path.dirname(name) if name.lower().endswith(OPENFOAM) else None


def _read(pyvista: Any, name: str, time: Optional[float]) -> Any:
    case = _case(name)
    if case is not None and is_decomposed(case, time):
        return _read_parts(pyvista, name, time)
    try:
        return _read_by(pyvista.get_reader(name) if case is None else pyvista.OpenFOAMReader(name), name, time)
    except FlowError:
        raise
    except Exception:
        # Try meshio: PyVista has no reader, or one for another format with this extension, such as
        # Fluent's .msh for Gmsh's.
        with contextlib.suppress(Exception, SystemExit):
            return pyvista.read_meshio(name)
        raise


def _read_parts(pyvista: Any, name: str, time: Optional[float]) -> Any:
    """Returns the mesh of a decomposed OpenFOAM case, with its parts joined at their common
    points."""
    reader: Any = importlib.import_module("vtkmodules.vtkIOParallel").vtkPOpenFOAMReader()
    reader.SetFileName(name)
    reader.SetCaseType(reader.DECOMPOSED_CASE)
    reader.CreateCellToPointOff()
    reader.UpdateInformation()
    times = [float(t) for t in pyvista.convert_array(reader.GetTimeValues())]
    reader.UpdateTimeStep(_nearest_time(times, time, name))
    mesh = _merged(pyvista, reader.GetOutputDataObject(0))
    return None if mesh is None else mesh.clean()


def _read_by(reader: Any, name: str, time: Optional[float]) -> Any:
    if _case(name) is not None:
        # Turn off VTK's averages at points: the solver computed values of cells.
        reader.cell_to_point_creation = False
    times = [float(t) for t in getattr(reader, "time_values", None) or []]
    if times:
        reader.set_active_time_value(_nearest_time(times, time, name))
    elif time is not None:
        raise FlowError(f"{name} has no times to choose from")
    reader.reader.Update()
    return reader.reader.GetOutputDataObject(0)


def _nearest_time(times: List[float], time: Optional[float], name: str) -> float:
    if time is None:
        return times[-1]
    nearest = min(times, key=lambda t: abs(t - time))
    # Accept rounded decimals of files and command lines.
    if not abs(nearest - time) <= 1e-6 * max(abs(time), abs(nearest)):
        raise FlowError(f"{name} has no time {time:g}; it has {', '.join(f'{t:g}' for t in times)}")
    return nearest


def _merged(pyvista: Any, source: Any) -> Any:
    """Merges the blocks that have the most dimensions into one mesh; ``None`` if there are no
    cells."""
    leaves = [leaf for leaf in map(pyvista.wrap, _leaves(source)) if getattr(leaf, "n_cells", 0)]
    most = max(map(dimension, leaves), default=0)
    blocks = [leaf for leaf in leaves if dimension(leaf) == most]
    if len(blocks) < 2:
        return blocks[0] if blocks else None
    # Show only visible cells: merged blocks keep only the arrays that all of them have, which may
    # omit the mark of hidden cells and walls.
    return pyvista.MultiBlock([visible(block) for block in blocks]).combine()


def _leaves(source: Any) -> Iterator[Any]:
    """Yields the data sets of nested blocks, or the only data set."""
    if not hasattr(source, "NewIterator"):
        yield source
        return
    # Use VTK's iterator, which enters kinds of blocks that PyVista does not know.
    each = source.NewIterator()
    each.InitTraversal()
    while not each.IsDoneWithTraversal():
        yield each.GetCurrentDataObject()
        each.GoToNextItem()


class _MeshValues(NamedTuple):
    """Values of an array at the original points or cells of the mesh."""

    places: Doubles
    """Positions of the points, or of the centres of cells."""
    values: Doubles
    of_cells: bool


def _with_points(mesh: Any, array: str, outside: Optional[float]) -> Tuple[str, Any, _MeshValues]:
    """Returns the name of the array, the mesh with only this array, at its points, and the original
    values. Only visible parts of the mesh that have values remain."""
    name = _known(mesh, array)
    mesh = visible(mesh).copy(deep=False)
    of_points = name in mesh.point_data.keys()
    # Copy to a plain array: VTK does not interpolate arrays of special roles, such as node numbers.
    found = np.array((mesh.point_data if of_points else mesh.cell_data)[name])
    if found.ndim != 1:
        raise FlowError(f"the array {array!r} has {found.shape[-1]} components, but must have one")
    if found.dtype.kind not in "fiub":
        raise FlowError(f"the array {array!r} has values of type {found.dtype}, but must have numbers")
    mesh.clear_data()
    (mesh.point_data if of_points else mesh.cell_data)[name] = found.astype(float)
    mesh = _with_values(mesh, name, of_points, outside)
    if of_points:
        return name, mesh, _MeshValues(np.asarray(mesh.points, float), np.asarray(mesh.point_data[name]), False)
    values = np.asarray(mesh.cell_data[name])
    return name, mesh.cell_data_to_point_data(), _MeshValues(np.asarray(mesh.cell_centers().points, float), values, True)


def _with_values(mesh: Any, name: str, of_points: bool, outside: Optional[float]) -> Any:
    """Removes cells of NaN, which solvers leave in solids, if ``outside`` gives a value for
    them."""
    values = np.asarray((mesh.point_data if of_points else mesh.cell_data)[name])
    if np.isinf(values).any():
        raise FlowError(f"the array {name!r} has infinite values")
    missing = np.isnan(values)
    if not missing.any():
        return mesh
    if outside is None:
        raise FlowError(f"the array {name!r} is NaN at {np.count_nonzero(missing)} points: give outside, the value for solids and other gaps")
    mesh = without(mesh, points=missing) if of_points else without(mesh, cells=missing)
    if mesh.n_cells == 0:
        raise FlowError(f"no cell has a value of the array {name!r}: all are NaN")
    return mesh


def _arrays(mesh: Any) -> List[str]:
    return [*mesh.point_data.keys(), *mesh.cell_data.keys()]


def _known(mesh: Any, array: str) -> str:
    """Returns the name of the array in the mesh; ``array`` may be URL-encoded, as with ``%20``."""
    names = _arrays(mesh)
    if array in names:
        return array
    same = [name for name in names if unquote(name) == unquote(array)]
    if same:
        return same[0]
    near = difflib.get_close_matches(array, names, n=1)
    guess = f": did you mean {near[0]!r}?" if near else ""
    raise FlowError(f"the mesh has no array {array!r}; it has {', '.join(map(repr, names)) or 'none'}{guess}")


def _bounds(bounds: Optional[Sequence[float]], frame: Frame) -> Tuple[Doubles, Doubles]:
    if bounds is None:
        return frame.low, frame.high
    given = np.asarray(bounds, float)
    if given.shape != (6,) or not np.isfinite(given).all() or np.any(given[1::2] <= given[::2]):
        raise FlowError("bounds must be xmin, xmax, ymin, ymax, zmin, zmax, with each maximum above its minimum")
    return given[::2], given[1::2]


def _counts(
    spacing: Union[None, float, Sequence[float]], shape: Optional[Sequence[int]], mesh: Any, extent: Doubles
) -> NDArray[np.int64]:
    """Returns the numbers of samples along x, y, z."""
    if shape is None:
        counts = np.maximum(np.rint(extent / _steps(spacing, mesh, extent)), 1) + 1
    elif spacing is not None:
        raise FlowError("give spacing or shape, not both")
    else:
        counts = np.asarray(shape)
        if counts.shape != (3,) or counts.dtype.kind not in "iu" or counts.min() < 2:
            raise FlowError(f"shape is {shape!r} but must be three whole numbers of at least 2")
    if counts.astype(float).prod() > MAX_SAMPLES:
        shown = " x ".join(f"{count:.0f}" for count in counts)
        raise FlowError(f"{shown} samples are too many: use a larger spacing, or smaller bounds")
    return counts.astype(np.int64)


def _steps(spacing: Union[None, float, Sequence[float]], mesh: Any, extent: Doubles) -> Doubles:
    """Returns the distances of samples: the given spacing, or the size of cells."""
    if spacing is None:
        steps = _size_of_cells(mesh)
        return np.asarray(steps * max(1.0, np.cbrt(np.prod(extent / steps + 1) / MAX_DEFAULT_SAMPLES)))
    given = np.asarray(spacing, float)
    if given.shape not in ((), (3,)) or not np.all(np.isfinite(given) & (given > 0)):
        raise FlowError(f"spacing is {spacing!r} but must be positive: one number, or three")
    return np.broadcast_to(given, 3)


def _size_of_cells(mesh: Any) -> Doubles:
    if isinstance(mesh, _pyvista().ImageData):
        # Replace the missing spacing across a plane by the smallest of the others.
        regular = np.array(mesh.spacing) * (np.array(mesh.dimensions) > 1)
        return np.where(regular > 0, regular, regular[regular > 0].min())
    cells = mesh.compute_cell_sizes(length=False)
    volume, area = np.abs(cells.cell_data["Volume"]), np.abs(cells.cell_data["Area"])
    sizes = np.cbrt(volume[volume > 0]) if np.any(volume > 0) else np.sqrt(area[area > 0])
    if len(sizes) == 0:
        raise FlowError("the cells of the mesh have no size: give spacing or shape")
    return np.full(3, np.median(sizes))


def _three(values: Doubles) -> Tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _probe(mesh: Any, array: str, places: Doubles) -> Tuple[Doubles, NDArray[np.bool_]]:
    """Returns values at places, and a mask of the places in the mesh. Places on the bounds of the
    mesh count as inside, regardless of rounding."""
    low, high = np.array(mesh.bounds).reshape(3, 2).T
    hair = BOUNDARY_MARGIN * (high - low)
    places = np.where(np.abs(places - low) < hair, low + hair, places)
    places = np.where(np.abs(places - high) < hair, high - hair, places)
    found = _pyvista().PolyData(places).sample(mesh)
    values = np.array(found.point_data[array], float)
    return values, np.asarray(found.point_data["vtkValidPointMask"]) > 0


def _nearest(mesh: Any, array: str, places: Doubles) -> Doubles:
    """Returns the values of the nearest points of the mesh."""
    pyvista, filters = _pyvista(), importlib.import_module("vtkmodules.vtkFiltersPoints")
    known = pyvista.PolyData(np.asarray(mesh.points, float))
    known.point_data[array] = mesh.point_data[array]
    interpolator: Any = filters.vtkPointInterpolator()
    interpolator.SetKernel(filters.vtkVoronoiKernel())
    interpolator.SetInputData(pyvista.PolyData(places))
    interpolator.SetSourceData(known)
    interpolator.Update()
    return np.array(pyvista.wrap(interpolator.GetOutput()).point_data[array], float)


def _error(sampled: Sampled, points: Doubles, values: Doubles) -> ResamplingError:
    """Compares the samples as a spline, as scenes interpolate them, with the known values."""
    low = np.array(sampled.origin)
    high = low + (np.array(sampled.values.shape[::-1]) - 1) * sampled.spacing
    hair = 1e-9 * (high - low)
    near = np.all((points >= low - hair) & (points <= high + hair), axis=1)
    points, values = points[near], values[near]
    if len(points) > MAX_COMPARED:
        some = np.random.default_rng(0).choice(len(points), MAX_COMPARED, replace=False)
        points, values = points[some], values[some]
    span = float(np.ptp(sampled.values))
    if len(points) == 0:
        return ResamplingError(0.0, 0.0, 0.0, 0)
    if span == 0.0:
        found = np.full(len(points), sampled.values.flat[0])
    else:
        # Scale the values to an index about 1.5, whose square is almost linear in it.
        least = sampled.values.min()
        scaled = sampled._replace(values=1.5 + CONTRAST * (sampled.values - least) / span)
        found = least + span * (load_field(scaled.volume("bspline")).n(points) - 1.5) / CONTRAST
    difference = np.abs(found - values)
    rms = float(np.sqrt(np.mean(difference**2)))
    whole = float(np.ptp(values))
    return ResamplingError(rms, float(difference.max()), rms / whole if whole > 0 else 0.0, len(points))


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run ``python -m morgana.flow``: resample a mesh to a volume file, and print the error.

    Parameters
    ----------
    arguments : sequence of str, optional
        Arguments; by default the command-line arguments.

    Returns
    -------
    int
        0, or 1 after an error.
    """
    parser = argparse.ArgumentParser(prog="python -m morgana.flow", description="Resample an array of a mesh to a file that scenes read.")
    parser.add_argument("mesh", help="VTK, OpenFOAM (.foam), CGNS, or what else PyVista reads")
    parser.add_argument("--array", help="name of the array; without it, the names of all are listed")
    parser.add_argument("--spacing", type=float, nargs="+", help="distance of samples, one or three (x y z)")
    parser.add_argument("--shape", type=int, nargs=3, help="numbers of samples along x y z, in place of --spacing")
    parser.add_argument("--bounds", type=float, nargs=6, help="xmin xmax ymin ymax zmin zmax")
    parser.add_argument("--outside", type=float, help="value outside of the mesh, in hidden cells and where the array is NaN; the nearest if not given")
    parser.add_argument("--revolve", choices=["x", "y", "z"], help="axis about which a planar mesh, or a wedge, is revolved")
    parser.add_argument("--thickness", type=float, help="how far the field of a planar mesh goes on across it")
    parser.add_argument("--time", type=float, help="instant of a series in time; the last if not given")
    parser.add_argument("-o", "--output", help="the .vti, .nrrd, .npy or other volume file; without it, only the error is printed")
    given = parser.parse_args(arguments)
    try:
        mesh = read(given.mesh, time=given.time)
        if given.array is None:
            print("\n".join(_arrays(mesh)))
            return 0
        sampled = sample(
            mesh,
            given.array,
            spacing=given.spacing[0] if given.spacing and len(given.spacing) == 1 else given.spacing,
            shape=given.shape,
            bounds=given.bounds,
            outside=given.outside,
            revolve=given.revolve,
            thickness=given.thickness,
        )
        if given.output is not None:
            sampled.write(given.output)
    except (Error, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    depth, height, width = sampled.values.shape
    target = f"{given.output}: " if given.output else ""
    print(f"{target}{width} x {height} x {depth} samples of {sampled.name}, {100 * sampled.outside:.1f} % outside of the mesh")
    print(f"resampling error: {sampled.error}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
