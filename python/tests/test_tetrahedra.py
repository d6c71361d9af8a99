"""Meshes of tetrahedra from files of other programs."""

import morgana
import numpy as np
import pytest

pyvista = pytest.importorskip("pyvista")


def block():
    """A block of two layers along z, each divided into tetrahedra; a triangle beside them."""
    grid = pyvista.ImageData(dimensions=(2, 2, 3)).cast_to_unstructured_grid()
    mesh = grid.triangulate()
    mesh.cell_data["tissue"] = np.where(mesh.cell_centers().points[:, 2] < 1, 1, 2)
    return mesh


def measured(body):
    scene = {
        "type": "scene", "integrator": {"type": "particle"}, "body": body,
        "light": {"type": "point", "position": [0.4, 0.6, 0.5], "intensity": 1},
        "cells": {"type": "fluencemeter", "nx": 1, "ny": 1, "nz": 2, "to_world": [{"scale": [1, 1, 2]}]},
    }
    return morgana.render(scene, particles=20_000, seed=3).meters["absorbed"]


def test_vtk_meshes_are_their_regions(tmp_path):
    path = tmp_path / "block.vtu"
    block().save(path)
    properties = [[0, 0, 1, 1], [0.2, 2, 0.5, 1], [1, 1, 0, 1]]
    body = {**morgana.load_tetrahedra(path), "properties": properties}
    assert body["elements"].shape == (len(body["regions"]), 4) and set(body["regions"]) == {1, 2}
    found = measured(body)
    expected = measured({"type": "labels", "data": [[[1]], [[2]]], "to_world": [{"scale": [1, 1, 2]}], "properties": properties})
    z = (np.asarray(found) - np.asarray(expected)) / np.hypot(found.error, expected.error)
    # False alarms: 1e-4 for each of two comparisons.
    assert np.abs(z).max() < 3.9
    assert (np.asarray(found) > 20 * found.error).all()


def test_regions_are_chosen_by_name(tmp_path):
    path, mesh = tmp_path / "block.vtu", block()
    mesh.cell_data["density"] = 1.0
    mesh.save(path)
    with pytest.raises(morgana.FileError, match="choose the array of regions by regions=...: tissue, density"):
        morgana.load_tetrahedra(path)
    assert set(morgana.load_tetrahedra(path, regions="tissue")["regions"]) == {1, 2}
    with pytest.raises(morgana.FileError, match="no array of cells 'x'; there are: tissue, density"):
        morgana.load_tetrahedra(path, regions="x")


def test_files_without_tetrahedra_are_refused(tmp_path):
    path = tmp_path / "sphere.vtu"
    pyvista.Sphere().cast_to_unstructured_grid().save(path)
    with pytest.raises(morgana.FileError, match="no tetrahedra"):
        morgana.load_tetrahedra(path)
