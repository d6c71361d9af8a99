"""Meshes of tetrahedra from files of other programs."""

from __future__ import annotations

import importlib
import os
from typing import Any, Dict, Optional, Union

import numpy as np

from ._errors import FileError
from ._extras import advice

TETRAHEDRON = 10
"""Number of VTK's type of linear tetrahedra."""


def load_tetrahedra(path: Union[str, "os.PathLike[str]"], *, regions: Optional[str] = None) -> Dict[str, Any]:
    """Read a mesh of tetrahedra into a dictionary of a shape ``tetrahedra``.

    The shape still needs its media: an array ``properties`` with the rows mua, mus, g, n of regions
    0, 1, …, or a medium for each region by its number (docs/scene/shapes.md#tetrahedra).

    Parameters
    ----------
    path : path
        ``.vtu`` or ``.vtk`` file. Other files, such as ``.msh`` of gmsh, need the package meshio.
        Elements of other types are left out.
    regions : str, optional
        Name of the array of cells with the region of each element, whole numbers. Without a name,
        the file may have one array of cells only, or one of ``region``, ``regions``, ``gmsh:physical``,
        ``medit:ref``. Without arrays, all tetrahedra are region 1.

    Returns
    -------
    dict
        ``type``, ``nodes`` (n, 3) in the file's unit of length, ``elements`` (m, 4) and ``regions`` (m,).

    Raises
    ------
    FileError
        If the file cannot be read, has no tetrahedra, or has several arrays that may be the regions.
    ImportError
        If pyvista, or meshio, is missing.

    Examples
    --------
    >>> head = morgana.load_tetrahedra("head.vtu", regions="tissue")  # doctest: +SKIP
    >>> head["properties"] = [[0, 0, 1, 1], [0.02, 8, 0.89, 1.37], [0.01, 1, 0.8, 1.33]]  # doctest: +SKIP
    """
    pyvista, name = _package("pyvista"), os.fspath(path)
    is_vtk = name.lower().endswith((".vtu", ".vtk"))
    if not is_vtk:
        _package("meshio")
    try:
        with pyvista.vtk_verbosity("off"):
            mesh = pyvista.read(name) if is_vtk else pyvista.read_meshio(name)
    except (OSError, ValueError, KeyError, SystemExit) as error:
        raise FileError(f"{name}: {error}") from error
    cells = getattr(mesh, "cells_dict", {}).get(TETRAHEDRON)
    if cells is None or len(cells) == 0:
        raise FileError(f"{name}: the file has no tetrahedra")
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
    """Returns the region of each tetrahedron; None if the file has no arrays of cells."""
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


def _package(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        how = advice("flow") if name == "pyvista" else "run pip install meshio"
        raise ImportError(f"meshes of tetrahedra need the package {name}: {how}") from error
