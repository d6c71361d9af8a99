"""Selection of the cells of meshes: visible, and of the dimension of the mesh."""

from __future__ import annotations

import importlib
from typing import Any, List, Optional

import numpy as np
from numpy.typing import NDArray

from ._flow_frame import FlowError

GHOSTS = "vtkGhostType"
"""VTK array that marks points and cells as hidden, or as parts of other pieces."""
HIDDEN_CELL = 8 | 32
"""Bits of ``vtkGhostType`` for cells that finer cells replace, and for blanked cells
(vtkDataSetAttributes::CellGhostTypes)."""
HIDDEN_POINT = 2
"""Bit of ``vtkGhostType`` for blanked points."""

Mask = NDArray[np.bool_]


def dimension(mesh: Any) -> int:
    """Returns the largest dimension of the cells."""
    return max(map(_dimension, _kinds(mesh)), default=0)


def visible(mesh: Any) -> Any:
    """Removes hidden cells, cells with hidden points, and cells of lower dimension than others,
    such as walls of a volume."""
    cells, points = _flagged(mesh.cell_data, HIDDEN_CELL, mesh.n_cells), _flagged(mesh.point_data, HIDDEN_POINT, mesh.n_points)
    dimensions = {kind: _dimension(kind) for kind in _kinds(mesh)}
    if len(set(dimensions.values())) > 1:
        mesh = mesh.cast_to_unstructured_grid()
        walls = [kind for kind, own in dimensions.items() if own < max(dimensions.values())]
        cells = cells | np.isin(mesh.celltypes, walls)
    found = without(mesh, cells, points)
    if found.n_cells == 0:
        raise FlowError("all cells of the mesh are hidden (vtkGhostType): remove this array, or read another file")
    return found


def without(mesh: Any, cells: Optional[Mask] = None, points: Optional[Mask] = None) -> Any:
    """Removes some cells, and all cells that have one of some points."""
    left_out = np.zeros(mesh.n_cells, bool) if cells is None else cells.copy()
    if points is not None and points.any():
        share = mesh.copy(deep=False)
        share.clear_data()
        share.point_data["left out"] = points.astype(float)
        left_out |= np.asarray(share.point_data_to_cell_data().cell_data["left out"]) > 0
    return mesh.extract_cells(np.flatnonzero(~left_out)) if left_out.any() else mesh


def _flagged(data: Any, bits: int, count: int) -> Mask:
    return (np.asarray(data[GHOSTS]) & bits) > 0 if GHOSTS in data.keys() else np.zeros(count, bool)


def _kinds(mesh: Any) -> List[int]:
    """Returns the types of the cells. Hidden cells of structured grids have the type of empty
    cells."""
    types: Any = importlib.import_module("vtkmodules.vtkCommonDataModel").vtkCellTypes()
    # Use the new name of the method in VTK 9.6, or its earlier name.
    getattr(mesh, "GetDistinctCellTypes", mesh.GetCellTypes)(types)
    return [types.GetCellType(i) for i in range(types.GetNumberOfTypes())]


def _dimension(kind: int) -> int:
    cell: Any = importlib.import_module("vtkmodules.vtkCommonDataModel").vtkGenericCell()
    cell.SetCellType(kind)
    return int(cell.GetCellDimension())
