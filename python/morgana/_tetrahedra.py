"""Meshes of tetrahedra of other programs."""

from __future__ import annotations

import os
from typing import Any, Dict, Optional, Union

import numpy as np

from ._errors import FileError

TETRAHEDRON = 10
"""Number of VTK's type of linear tetrahedra."""


def load_tetrahedra(mesh: Any, /, *, regions: Optional[str] = None) -> Dict[str, Any]:
    """Read a mesh of tetrahedra into a dictionary of a shape ``tetrahedra``.

    The shape still needs its media: an array ``properties`` with the rows mua, mus, g, n of regions
    0, 1, …, or a medium for each region by its number (docs/scene/shapes.md#tetrahedra).
    :func:`flow.sample` resamples values at nodes to grids for these media.

    Parameters
    ----------
    mesh : path or pyvista.DataSet
        A mesh, or a file that :func:`flow.read` reads: ``.vtu`` and ``.vtk``, or with the package
        meshio ``.msh`` of gmsh and others. Elements of other types are left out.
    regions : str, optional
        Name of the array of cells with the region of each element, whole numbers. Without a name,
        the mesh may have one array of cells only, or one of ``region``, ``regions``, ``gmsh:physical``,
        ``medit:ref``. Without arrays, all tetrahedra are region 1.

    Returns
    -------
    dict
        ``type``, ``nodes`` (n, 3) in the mesh's unit of length, ``elements`` (m, 4) and ``regions`` (m,).

    Raises
    ------
    FileError
        If the file cannot be read, has no tetrahedra, or has several arrays that may be the regions.
    FlowError
        If PyVista is missing.

    Examples
    --------
    >>> head = morgana.load_tetrahedra("head.vtu", regions="tissue")  # doctest: +SKIP
    >>> head["properties"] = [[0, 0, 1, 1], [0.02, 8, 0.89, 1.37], [0.01, 1, 0.8, 1.33]]  # doctest: +SKIP
    """
    from . import flow

    name = "the mesh"
    if isinstance(mesh, (str, os.PathLike)):
        name, mesh = os.fspath(mesh), flow.read(mesh)
    cells = getattr(mesh, "cells_dict", {}).get(TETRAHEDRON)
    if cells is None or len(cells) == 0:
        raise FileError(f"{name}: there are no tetrahedra")
    found = _regions(name, mesh, regions)
    kept = np.unique(cells, return_inverse=True)
    return {
        "type": "tetrahedra",
        "nodes": np.asarray(mesh.points, dtype=float)[kept[0]],
        "elements": kept[1].reshape(cells.shape),
        "regions": np.ones(len(cells), dtype=int) if found is None else found,
    }


KNOWN = ("region", "regions", "gmsh:physical", "medit:ref")
"""Names of arrays of regions."""


def _regions(name: str, mesh: Any, wanted: Optional[str]) -> Any:
    """Returns the region of each tetrahedron; None if the mesh has no arrays of cells."""
    names = list(mesh.cell_data.keys())
    if wanted is None:
        likely = [known for known in KNOWN if known in names] or names
        if not likely:
            return None
        if len(likely) > 1:
            raise FileError(f"{name}: choose the array of regions by regions=...: {', '.join(likely)}")
        wanted = likely[0]
    elif wanted not in names:
        raise FileError(f"{name}: there is no array of cells {wanted!r}; there are: {', '.join(names) or 'none'}")
    return np.asarray(mesh.cell_data[wanted])[mesh.celltypes == TETRAHEDRON]
