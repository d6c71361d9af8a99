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


def ball_in_cube(radius, spacing):
    """A cube from 0 to 1 with a ball in the middle: tetrahedra with nodes on the sphere."""
    random = np.random.default_rng(1)
    axis = np.linspace(0, 1, round(1 / spacing) + 1)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    inner = ((points > 0) & (points < 1)).all(axis=1, keepdims=True)
    points = points + inner * random.uniform(-0.25, 0.25, points.shape) * spacing
    points = points[np.abs(np.linalg.norm(points - 0.5, axis=1) - radius) > 0.45 * spacing]
    count = round(11 * radius**2 / spacing**2) * 3
    k = np.arange(count) + 0.5
    height, turn = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    ring = np.sqrt(1 - height**2)
    sphere = 0.5 + radius * np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)
    mesh = pyvista.PolyData(np.concatenate([points, sphere])).delaunay_3d()
    mesh = mesh.extract_cells(np.abs(mesh.compute_cell_sizes()["Volume"]) > 1e-9)
    mesh.cell_data["region"] = np.where(np.linalg.norm(mesh.cell_centers().points - 0.5, axis=1) < radius, 2, 1)
    return mesh


def test_a_ball_is_its_polyhedron():
    """Tetrahedra with a jump of the index between a ball and a cube measure the same as the ball's
    surface in a cube, and nearly the same as a sphere of equal volume."""
    mesh = ball_in_cube(radius=0.3, spacing=0.14)
    outside, inside = [1, 4, 0.8, 1.37], [2, 8, 0.5, 1.5]
    ball = mesh.extract_cells(mesh.cell_data["region"] == 2)
    surface = ball.extract_surface(algorithm="dataset_surface").triangulate()
    volume = np.abs(ball.compute_cell_sizes()["Volume"]).sum()

    def medium(row):
        mua, mus, g, n = row
        return {"type": "homogeneous", "sigma_s": mus, "sigma_a": mua, "ior": n, "phase": {"type": "hg", "g": g}}

    def found(shapes, seed):
        glass = {"type": "dielectric"}
        cells = {"type": "fluencemeter", "nx": 3, "ny": 3, "nz": 3}
        beam = {"type": "collimated", "radius": 0.2, "power": 1, "to_world": [{"translate": [0.55, 0.5, -0.2]}]}
        scene = {"type": "scene", "integrator": {"type": "particle"}, "cells": cells, "beam": beam}
        for name, shape in shapes.items():
            scene[name] = shape if shape["type"] == "tetrahedra" else {**shape, "bsdf": glass}
        return morgana.render(scene, particles=40_000, seed=seed).meters["absorbed"]

    cube = {"type": "cube", "to_world": [{"scale": 0.5}, {"translate": [0.5, 0.5, 0.5]}], "interior": medium(outside)}
    polyhedron = {
        "type": "mesh", "vertex_positions": np.asarray(surface.points), "faces": surface.faces.reshape(-1, 4)[:, 1:], "face_normals": True,
        "interior": medium(inside),
    }
    sphere = {"type": "sphere", "center": [0.5, 0.5, 0.5], "radius": (volume * 3 / (4 * np.pi)) ** (1 / 3), "interior": medium(inside)}
    by_tetrahedra = found({"body": {**morgana.load_tetrahedra(mesh), "properties": [[0, 0, 1, 1], outside, inside]}}, 1)
    by_surface = found({"cube": cube, "ball": polyhedron}, 2)
    z = (np.asarray(by_tetrahedra) - np.asarray(by_surface)) / np.hypot(by_tetrahedra.error, by_surface.error)
    # False alarms: 1e-3 for 27 comparisons together.
    assert np.abs(z).max() < 4.1
    by_sphere = found({"cube": cube, "ball": sphere}, 3)
    middle = (1, 1, 1)
    assert by_tetrahedra[middle].mean == pytest.approx(by_sphere[middle].mean, rel=0.04)


def test_values_at_nodes_are_resampled():
    """Light along z has the optical length of an index that increases along z: 2 × 1.45."""
    mesh = block()
    mesh.point_data["n"] = 1.4 + 0.05 * mesh.points[:, 2]
    index = morgana.flow.sample(mesh, "n", shape=(3, 3, 5))
    assert index.error.largest < 1e-6
    medium = {"type": "homogeneous", "sigma_t": 0, "ior": index.volume("bspline")}
    scene = {
        "type": "scene", "integrator": {"type": "particle"}, "body": {**morgana.load_tetrahedra(mesh), "1": medium, "2": medium},
        "beam": {"type": "collimated", "radius": 0.01, "power": 1, "to_world": [{"translate": [0.4, 0.6, 0]}]},
        "behind": {
            "type": "rectangle", "bsdf": {"type": "null"}, "to_world": [{"translate": [0, 0, 2.5]}],
            "screen": {"type": "irradiancemeter", "id": "screen", "normalization": "per_watt", "records": True},
        },
    }
    records = morgana.render(scene, particles=100, seed=1).records["screen"]
    # A few particles are reflected to and fro.
    assert np.median(records.optical_length) == pytest.approx(2 * 1.45 + 0.5, rel=1e-5)


def test_files_of_gmsh_are_read(tmp_path):
    meshio = pytest.importorskip("meshio")
    path, mesh = tmp_path / "block.msh", block()
    cells = [("tetra", mesh.cells_dict[10])]
    tags = mesh.cell_data["tissue"].astype(np.int32)
    meshio.write(path, meshio.Mesh(mesh.points, cells, cell_data={"gmsh:physical": [tags], "gmsh:geometrical": [tags]}), "gmsh22", binary=False)
    read = morgana.load_tetrahedra(path)
    assert sorted(map(tuple, read["nodes"])) == sorted(map(tuple, mesh.points))
    assert (read["regions"] == tags).all()


def test_files_without_tetrahedra_are_refused(tmp_path):
    path = tmp_path / "sphere.vtu"
    pyvista.Sphere().cast_to_unstructured_grid().save(path)
    with pytest.raises(morgana.FileError, match="there are no tetrahedra"):
        morgana.load_tetrahedra(path)
