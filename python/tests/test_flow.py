"""Meshes of other programs, resampled: values of a known field, the reported error, and refused
meshes."""

import importlib
import re
import subprocess
import sys

import morgana
import numpy as np
import pytest
from conftest import load

pyvista = pytest.importorskip("pyvista", reason="PyVista is an optional extra")
flow = importlib.import_module("morgana.flow")


def jet(p):
    """A density in a box, smooth on the scale of its cells."""
    return 1.2 - 0.4 * np.exp(-(p[..., 0] ** 2 + p[..., 1] ** 2) / (0.1 + 0.1 * p[..., 2]))


@pytest.fixture(scope="module")
def box():
    grid = pyvista.ImageData(dimensions=(21, 25, 31), spacing=(0.1, 0.08, 0.05), origin=(-1, -0.96, 0))
    grid["rho/rho0 (%)"] = jet(grid.points)
    return grid


def error(sampled):
    """Returns the errors of all samples against the field."""
    axes = [o + d * np.arange(n) for o, d, n in zip(sampled.origin, sampled.spacing, sampled.values.shape[::-1])]
    places = np.stack(np.meshgrid(*axes[::-1], indexing="ij")[::-1], axis=-1)
    return np.abs(sampled.values - jet(places)).max()


def test_every_kind_of_mesh_has_the_same_values(box, tmp_path):
    kinds = {
        ".vti": box,
        ".vtk": box,
        ".vtr": box.cast_to_rectilinear_grid(),
        ".vts": box.cast_to_structured_grid(),
        ".vtu": box.cast_to_unstructured_grid(),
        ".vtm": pyvista.MultiBlock([box.extract_subset([0, 20, 0, 24, 0, 15]), box.extract_subset([0, 20, 0, 24, 15, 30])]),
    }
    for extension, mesh in kinds.items():
        mesh.save(tmp_path / f"jet{extension}")
        read = flow.read(tmp_path / f"jet{extension}")
        sampled = flow.sample(read, "rho/rho0 (%)", spacing=(0.1, 0.08, 0.05))
        assert sampled.values.shape == (31, 25, 21), extension
        np.testing.assert_allclose(sampled.spacing, (0.1, 0.08, 0.05))
        np.testing.assert_allclose(sampled.origin, (-1, -0.96, 0), atol=1e-12)
        assert error(sampled) < 1e-6, extension
        assert sampled.error.points >= 31 * 25 * 21
        assert sampled.error.largest < 1e-6
        assert sampled.outside == 0


def test_the_stated_error_is_that_of_the_spline(box):
    coarse = flow.sample(box, "rho/rho0 (%)", spacing=0.2)
    volume = coarse.volume("bspline")
    # The contrast is so small that n² is practically linear in n.
    field = morgana.load_field({**volume, "data": 1 + 1e-4 * volume["data"]})
    difference = (field.n(np.asarray(box.points, float)) - 1) / 1e-4 - box["rho/rho0 (%)"]
    assert coarse.error.rms == pytest.approx(np.sqrt(np.mean(difference**2)), rel=1e-3)
    assert coarse.error.largest == pytest.approx(np.abs(difference).max(), rel=1e-3)
    assert 1e-3 < coarse.error.largest < 0.05
    assert "% of the range" in str(coarse.error)
    assert coarse.error.largest_of_range == pytest.approx(coarse.error.largest / np.ptp(box["rho/rho0 (%)"]))


def test_the_spacing_is_that_of_the_cells_by_default(box):
    np.testing.assert_allclose(flow.sample(box, "rho/rho0 (%)").spacing, (0.1, 0.08, 0.05))
    # A quarter of a shell fills little of its box: cells of 0.05 by 0.05 by 0.1.
    r, turn, z = np.meshgrid(np.arange(1, 1.21, 0.05), np.linspace(0, np.pi / 2, 33), np.arange(0, 1.01, 0.1), indexing="ij")
    shell = pyvista.StructuredGrid(r * np.cos(turn), r * np.sin(turn), z)
    shell["rho"] = shell.points[:, 0]
    assert flow.sample(shell, "rho").spacing[0] == pytest.approx(0.063, rel=0.05)
    with pytest.raises(flow.FlowError, match="spacing or shape"):
        flow.sample(box, "rho/rho0 (%)", spacing=0.1, shape=(3, 3, 3))
    assert flow.sample(box, "rho/rho0 (%)", shape=(5, 4, 3)).values.shape == (3, 4, 5)


def test_arrays_of_cells(box):
    cells = box.point_data_to_cell_data()
    sampled = flow.sample(cells, "rho/rho0 (%)", spacing=0.1)
    assert error(sampled) < 0.05
    assert sampled.error.points == cells.n_cells
    assert sampled.error.rms < 0.01


def test_arrays_of_numbers_of_points_are_arrays(box):
    # VTK would not interpolate them.
    box = box.copy()
    box.point_data.active_scalars_name = None
    box.point_data["ids"] = np.arange(box.n_points)
    box.GetPointData().SetActiveAttribute("ids", box.GetPointData().GLOBALIDS)
    assert flow.sample(box, "ids").error.largest < 0.1


def test_what_is_outside(box):
    bounds = (-2, 1, -0.96, 0.96, 0, 1.5)
    filled = flow.sample(box, "rho/rho0 (%)", spacing=0.1, bounds=bounds, outside=7.0)
    assert np.all(filled.values[:, :, :10] == 7.0)
    assert filled.outside == pytest.approx(10 / 31)
    continued = flow.sample(box, "rho/rho0 (%)", spacing=0.1, bounds=bounds)
    np.testing.assert_allclose(continued.values[:, 5, 0], continued.values[:, 5, 10], atol=0.02)
    # Beyond the mesh, a constant stays constant.
    box["one"] = np.ones(box.n_points)
    one = flow.sample(box, "one", spacing=0.1, bounds=bounds)
    np.testing.assert_allclose(one.values, 1)
    assert one.error.largest < 1e-9


def test_half_planes_are_revolved():
    plane = pyvista.ImageData(dimensions=(41, 61, 1), spacing=(0.025, 0.05, 1))
    plane["rho"] = 1.2 - 0.4 * np.exp(-(plane.points[:, 0] ** 2) / 0.1)
    whole = flow.sample(plane, "rho", revolve="y", spacing=0.05)
    assert whole.values.shape == (41, 61, 41)
    z, y, x = np.meshgrid(*[np.arange(n) * 0.05 for n in (41, 61, 41)], indexing="ij")
    radius = np.hypot(x - 1, z - 1)
    inside = radius < 0.99
    # Linear interpolation of the plane has an error of h²/8 of the second derivative, 8.
    assert np.abs(whole.values - 1.2 + 0.4 * np.exp(-(radius**2) / 0.1))[inside].max() < 8e-4
    assert whole.outside == pytest.approx(1 - np.pi / 4, abs=0.05)
    with pytest.raises(flow.FlowError, match="revolve needs a planar mesh"):
        flow.sample(_with(pyvista.ImageData(dimensions=(3, 3, 3))), "rho", revolve="x")


@pytest.mark.parametrize("of_cells", [False, True])
@pytest.mark.parametrize(("low", "high"), [(-1, 0), (-1, 1), (-1, 0.5), (-0.5, 1)])
def test_planes_on_either_side_of_the_axis_are_revolved(low, high, of_cells):
    def rho(p):
        return 1.2 - 0.4 * np.exp(-(p[..., 1] ** 2) / 0.1)

    z, r = np.meshgrid(np.linspace(0, 1, 5), np.linspace(low, high, 1 + round((high - low) * 80)), indexing="ij")
    plane = pyvista.StructuredGrid(z[..., None], r[..., None], 0 * r[..., None])
    if of_cells:
        plane.cell_data["rho"] = rho(plane.cell_centers().points)
    else:
        plane["rho"] = rho(plane.points)
    whole = flow.sample(plane, "rho", revolve="x", spacing=(0.25, 0.05, 0.05), outside=1.2)
    radius = np.hypot(*np.meshgrid(*2 * [whole.origin[1] + 0.05 * np.arange(41)]))
    expected = 1.2 - 0.4 * np.exp(-(radius**2) / 0.1)
    # Linear interpolation between points, or means of cells.
    assert np.abs(whole.values - expected[..., None])[radius < 0.95].max() < 1e-3
    assert whole.values.shape == (41, 41, 5)
    assert whole.error.points == (plane.n_cells if of_cells else plane.n_points)
    # The other half-plane, if it exists, is compared.
    wrong = plane.copy()
    data = wrong.cell_data if of_cells else wrong.point_data
    places = wrong.cell_centers().points if of_cells else wrong.points
    shorter = places[:, 1] > 0 if high < -low else places[:, 1] < 0
    data["rho"] = data["rho"] + 0.1 * shorter
    if shorter.any():
        assert flow.sample(wrong, "rho", revolve="x", spacing=(0.25, 0.05, 0.05), outside=1.2).error.largest > 0.05


def solids(kind, of_points):
    """Returns a box with a cylinder inside that is hidden, or has no value, and the cells of the
    cylinder."""
    grid = pyvista.ImageData(dimensions=(21, 21, 21), spacing=(0.1,) * 3)
    grid["rho"] = np.where(np.hypot(grid.points[:, 0] - 1, grid.points[:, 2] - 1) < 0.35, 0.0, 1.2)
    inside = np.hypot(grid.cell_centers().points[:, 0] - 1, grid.cell_centers().points[:, 2] - 1) < 0.45
    if kind == "nan":
        if of_points:
            grid["rho"] = np.where(grid["rho"] == 0, np.nan, grid["rho"])
        else:
            grid = grid.point_data_to_cell_data()
            grid["rho"] = np.where(inside, np.nan, 1.2)
        return grid
    if of_points:
        grid.point_data["vtkGhostType"] = np.where(grid["rho"] == 0, 2, 0).astype(np.uint8)
    else:
        grid.cell_data["vtkGhostType"] = np.where(inside, 32, 0).astype(np.uint8)
    return grid


@pytest.mark.parametrize("of_points", [False, True])
@pytest.mark.parametrize("extension", [".vti", ".vts", ".vtu", ".vtm", ""])
def test_hidden_cells_are_outside(extension, of_points, tmp_path):
    grid = solids("hidden", of_points)
    mesh = {".vts": grid.cast_to_structured_grid, ".vtu": grid.cast_to_unstructured_grid}.get(extension, lambda: grid)()
    if extension == ".vtm":
        beside = pyvista.ImageData(dimensions=(21, 21, 21), spacing=(0.1,) * 3, origin=(2, 0, 0))
        beside["rho"] = np.full(beside.n_points, 1.2)
        mesh = pyvista.MultiBlock([grid, beside])
    if extension:
        mesh.save(tmp_path / f"solid{extension}")
        mesh = flow.read(tmp_path / f"solid{extension}")
    sampled = flow.sample(mesh, "rho", spacing=0.1, outside=7.0)
    values = sampled.values[..., :21]
    # On the axis of the cylinder, VTK's own probe gives this value.
    assert np.all(values[10, :, 10] == 7)
    assert np.all(np.isclose(values, 1.2) | (values == 7))
    assert sampled.outside == pytest.approx(np.mean(sampled.values == 7))
    assert sampled.outside > 0.005
    assert f"{100 * sampled.outside:.2g} % outside" in repr(sampled)
    # A spline through filled samples differs from the adjacent mesh.
    assert sampled.error.largest < 1e-6
    assert flow.sample(mesh, "rho", spacing=0.07, outside=7.0).error.largest > 0.5
    # Cells without a value get the value of visible ones.
    np.testing.assert_allclose(flow.sample(mesh, "rho", spacing=0.1).values, 1.2)


@pytest.mark.parametrize("of_points", [False, True])
def test_places_without_a_value_are_filled(of_points):
    grid = solids("nan", of_points)
    sampled = flow.sample(grid, "rho", outside=7.0)
    assert np.all(sampled.values[10, :, 10] == 7)
    assert np.all(np.isclose(sampled.values, 1.2) | (sampled.values == 7))
    assert (sampled.values.shape, sampled.spacing) == ((21, 21, 21), (0.1, 0.1, 0.1))
    with pytest.raises(flow.FlowError, match="is NaN at [0-9]+ points: give outside"):
        flow.sample(grid, "rho")
    grid["rho"] = np.full_like(grid["rho"], np.nan)
    with pytest.raises(flow.FlowError, match="all are NaN"):
        flow.sample(grid, "rho", outside=7.0)
    grid["rho"] = np.full_like(grid["rho"], np.inf)
    with pytest.raises(flow.FlowError, match="infinite"):
        flow.sample(grid, "rho", outside=7.0)


def test_all_hidden_is_an_error():
    grid = _with(pyvista.ImageData(dimensions=(3, 3, 3)))
    grid.cell_data["vtkGhostType"] = np.full(8, 32, np.uint8)
    with pytest.raises(flow.FlowError, match="all cells of the mesh are hidden"):
        flow.sample(grid, "rho")


def test_wedges_are_revolved():
    # Five degrees about z, like axisymmetric flows of OpenFOAM, with values at cells.
    turn = np.radians([-2.5, 2.5])
    z, r, turn = np.meshgrid(np.linspace(0, 3, 61), np.linspace(0, 1, 41), turn, indexing="ij")
    wedge = pyvista.StructuredGrid(r * np.cos(turn), r * np.sin(turn), z).cast_to_unstructured_grid()
    centers = wedge.cell_centers().points
    wedge.cell_data["rho"] = 1.2 - 0.4 * np.exp(-(np.hypot(centers[:, 0], centers[:, 1]) ** 2) / 0.1)
    whole = flow.sample(wedge, "rho", revolve="z", spacing=0.05, outside=1.2)
    axes = [o + d * np.arange(n) for o, d, n in zip(whole.origin, whole.spacing, whole.values.shape[::-1])]
    radius = np.hypot(*np.meshgrid(*axes[:2]))
    inside = radius < 0.95
    differences = np.abs(whole.values - 1.2 + 0.4 * np.exp(-(radius**2) / 0.1))[:, inside]
    # Errors of means over cells of 0.025 about the axis, where the second derivative is 8.
    assert differences.max() < 4e-3
    assert 0 < whole.error.rms < whole.error.largest < 4e-3
    # The grid is coarse along y only: the error refers to all directions, not only to the wedge's.
    coarse = flow.sample(wedge, "rho", revolve="z", spacing=(0.05, 0.5, 0.05), outside=1.2)
    assert coarse.error.largest > 0.03
    with pytest.raises(flow.FlowError, match="a wedge of at most 20°"):
        flow.sample(wedge.rotate_z(180).merge(wedge), "rho", revolve="z")


@pytest.mark.parametrize("of_cells", [False, True])
@pytest.mark.parametrize("layers", [1, 2, 3])
def test_radii_of_wedges_are_those_of_points_and_of_centres_of_cells(layers, of_cells):
    def rho(p):
        return 1.2 - 0.4 * np.exp(-(p[..., 1] ** 2 + p[..., 2] ** 2) / 0.1)

    turn = np.radians(np.linspace(40, 59.8, layers + 1))
    x, r, turn = np.meshgrid(np.linspace(0, 1, 11), np.linspace(0, 1, 81), turn, indexing="ij")
    wedge = pyvista.StructuredGrid(x, r * np.cos(turn), r * np.sin(turn))
    if of_cells:
        wedge.cell_data["rho"] = rho(wedge.cell_centers().points)
    else:
        wedge["rho"] = rho(wedge.points)
    whole = flow.sample(wedge, "rho", revolve="x", spacing=(0.5, 0.05, 0.05), outside=1.2)
    axes = [o + d * np.arange(n) for o, d, n in zip(whole.origin, whole.spacing, whole.values.shape[::-1])]
    places = np.stack(np.meshgrid(*axes[::-1], indexing="ij")[::-1], axis=-1)
    radius = np.hypot(places[..., 1], places[..., 2])
    differences = np.abs(whole.values - rho(places))[(radius > 0.05) & (radius < 0.95)]
    # Linear interpolation has an error of h²/8 of the second derivative, 8, and means of cells as
    # much. The centres of two cells are nearer to the axis than the points between them, by 0.4 %.
    # A single wedge with the radii of its middle would be off by 4e-3.
    assert differences.max() < (1.5e-3 if of_cells and layers == 2 else 5e-4)
    assert whole.error.rms < 1e-3
    # Cells end where their middle does.
    reach = np.cos(np.radians(9.9 / layers)) if of_cells and layers != 2 else 1
    np.testing.assert_allclose([-whole.origin[1], axes[1][-1]], reach, rtol=1e-6)


def test_planes_continue_across_their_thickness():
    plane = _with(pyvista.ImageData(dimensions=(9, 1, 5), origin=(0, 2, 0)))
    slab = flow.sample(plane, "rho", thickness=3)
    assert slab.values.shape == (5, 4, 9)
    assert (slab.origin[1], slab.spacing[1]) == (0.5, 1)
    np.testing.assert_allclose(slab.values, np.arange(45.0).reshape(5, 1, 9).repeat(4, axis=1), atol=1e-4)
    assert slab.error.points == 45 and slab.error.largest < 1e-4
    with pytest.raises(flow.FlowError, match="the mesh is planar: give the thickness along y"):
        flow.sample(plane, "rho")
    with pytest.raises(flow.FlowError, match="thickness is for planar meshes"):
        flow.sample(_with(pyvista.ImageData(dimensions=(3, 3, 3))), "rho", thickness=1)


def foam(folder, times):
    """An OpenFOAM case: two cubes on top of one another, with a temperature in each."""

    def write(name, kind, text):
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"FoamFile {{ version 2.0; format ascii; class {kind}; object {path.name}; }}\n{text}")

    listed = lambda items: f"{len(items)}\n(\n" + "\n".join(items) + "\n)\n"  # noqa: E731
    write("constant/polyMesh/points", "vectorField", listed([f"({x} {y} {z})" for z in range(3) for y in (0, 1) for x in (0, 1)]))
    sides = [[i, i + 4, i + 6, i + 2] for i in (0, 4)] + [[i + 1, i + 3, i + 7, i + 5] for i in (0, 4)]
    sides += [[i, i + 1, i + 5, i + 4] for i in (0, 4)] + [[i + 2, i + 6, i + 7, i + 3] for i in (0, 4)]
    faces = [[4, 5, 7, 6], *sides, [0, 2, 3, 1], [8, 9, 11, 10]]
    write("constant/polyMesh/faces", "faceList", listed([f"4({' '.join(map(str, face))})" for face in faces]))
    write("constant/polyMesh/owner", "labelList", listed(list("0" + "01" * 4 + "01")))
    write("constant/polyMesh/neighbour", "labelList", listed(["1"]))
    write("constant/polyMesh/boundary", "polyBoundaryMesh", listed(["walls { type wall; nFaces 10; startFace 1; }"]))
    write("system/controlDict", "dictionary", "application none;\n")
    for time in times:
        values = f"dimensions [0 0 0 1 0 0 0]; internalField nonuniform List<scalar> 2 ({time} {time + 100});"
        write(f"{time}/T", "volScalarField", values + " boundaryField { walls { type fixedValue; value uniform 7; } }\n")
    (folder / "case.foam").write_text("")
    return folder / "case.foam"


def test_cases_of_openfoam_keep_their_cells(tmp_path):
    case = foam(tmp_path, [300, 400])
    mesh = flow.read(case)
    # Walls are left out, and values that VTK makes at points.
    assert (mesh.n_cells, mesh.point_data.keys()) == (2, [])
    np.testing.assert_array_equal(mesh.cell_data["T"], [400, 500])
    np.testing.assert_array_equal(flow.read(case, time=300).cell_data["T"], [300, 400])
    # The folder may stand for the case, too.
    (case.parent / "case.foam").unlink()
    folder = flow.read(case.parent)
    assert (folder.n_cells, folder.point_data.keys()) == (2, [])
    np.testing.assert_array_equal(flow.read(str(case.parent) + "/", time=300).cell_data["T"], [300, 400])
    with pytest.raises(morgana.FileError, match="the folder is not a case of OpenFOAM, because it has no system.controlDict"):
        flow.read(case.parent / "system")
    case.write_text("")
    with pytest.raises(flow.FlowError, match="has no time 350; it has 300, 400"):
        flow.read(case, time=350)
    sampled = flow.sample(mesh, "T", shape=(2, 2, 3))
    # Points have the means of their cells, and the error states how far these are from the cells'
    # values.
    np.testing.assert_allclose(sampled.values[:, 0, 0], [400, 450, 500])
    assert sampled.error.points == 2
    assert sampled.error.rms == pytest.approx(25, rel=1e-3)


def test_blocks_and_pieces(box, tmp_path):
    volume = box.cast_to_unstructured_grid()
    volume.save(tmp_path / "volume.vtu")
    box.extract_surface(algorithm="dataset_surface").save(tmp_path / "surface.vtp")
    block = '<Block index="0"><Piece index="0"><DataSet index="0" file="volume.vtu"/></Piece></Block>'
    block += '<DataSet index="1" name="wall" file="surface.vtp"/>'
    head = '<VTKFile type="vtkMultiBlockDataSet" version="1.0" byte_order="LittleEndian">'
    (tmp_path / "all.vtm").write_text(f"{head}<vtkMultiBlockDataSet>{block}</vtkMultiBlockDataSet></VTKFile>")
    assert flow.read(tmp_path / "all.vtm").n_cells == box.n_cells


def test_blocks_of_volume_and_surface_cells_are_volumes(tmp_path):
    left = pyvista.ImageData(dimensions=(6, 6, 6), spacing=(0.2,) * 3).triangulate()
    skin = left.extract_surface(algorithm="dataset_surface").triangulate().cast_to_unstructured_grid()
    # Meshers write walls first.
    left = pyvista.MultiBlock([skin, left]).combine(merge_points=True)
    right = pyvista.ImageData(dimensions=(6, 6, 6), spacing=(0.2,) * 3, origin=(1, 0, 0)).triangulate()
    for mesh in (left, right):
        mesh.clear_data()
        # Give walls another value, to see that it is not used.
        centers = mesh.cell_centers().points[:, 0]
        mesh.cell_data["rho"] = np.where([mesh.get_cell(i).dimension == 2 for i in range(mesh.n_cells)], 99, 1.2 - 0.3 * centers)
        mesh["T"] = 300 + mesh.points[:, 0]
    assert (left.get_cell(0).dimension, right.get_cell(0).dimension) == (2, 3)
    pyvista.MultiBlock([left, right]).save(tmp_path / "mixed.vtm")
    for mesh, width in ((flow.read(tmp_path / "mixed.vtm"), 2), (left, 1)):
        np.testing.assert_allclose(mesh.bounds[:2], (0, width))
        found = flow.sample(mesh, "T", spacing=0.1)
        np.testing.assert_allclose(found.values, 300 + np.linspace(0, width, 10 * width + 1) + 0 * found.values, atol=1e-4)
        assert flow.sample(mesh, "rho", spacing=0.1).values.max() < 1.2


def test_surfaces_and_points_are_not_volumes():
    """Values between them are unknown; VTK would count points near a surface as inside."""
    surface = _with(pyvista.Sphere())
    for mesh in (surface, surface.extract_all_edges(), pyvista.PolyData(surface.points, verts=np.c_[np.ones(surface.n_points, int), np.arange(surface.n_points)])):
        with pytest.raises(flow.FlowError, match="give the mesh of the volume"):
            flow.sample(_with(mesh), "rho", outside=1.2)


@pytest.mark.parametrize("reconstructed", [None, [300]])
def test_decomposed_cases_of_openfoam(reconstructed, tmp_path, capfd):
    # The case as a whole lacks a mesh, or some times.
    case = foam(tmp_path, reconstructed) if reconstructed else tmp_path / "case.foam"
    for part in (0, 1):
        foam(tmp_path / f"processor{part}", [300, 400])
    points = tmp_path / "processor1/constant/polyMesh/points"
    points.write_text(re.sub(r"\((\d) ", lambda x: f"({int(x[1]) + 1} ", points.read_text()))
    (tmp_path / "system").mkdir(exist_ok=True)
    (tmp_path / "system/controlDict").write_text((tmp_path / "processor0/system/controlDict").read_text())
    case.write_text("")
    mesh = flow.read(case)
    assert flow.read(tmp_path).n_cells == mesh.n_cells
    # Each has twelve points, six of them common.
    assert (mesh.n_cells, mesh.n_points) == (4, 18)
    assert sorted(mesh.cell_data["T"]) == [400, 400, 500, 500]
    np.testing.assert_allclose(mesh.bounds, (0, 2, 0, 1, 0, 2))
    assert flow.read(case, time=300).n_cells == (2 if reconstructed else 4)
    with pytest.raises(flow.FlowError, match="has no time 350; it has 300"):
        flow.read(case, time=350)
    assert "ERR" not in capfd.readouterr().err


def _with(mesh):
    mesh["rho"] = np.arange(mesh.n_points, dtype=float)
    return mesh


def test_scenes_take_samples_in_their_place(box, tmp_path):
    sampled = flow.sample(box, "rho/rho0 (%)", spacing=(0.1, 0.08, 0.05))
    sampled.write(tmp_path / "jet.vti")
    law = {"constant": 2.27e-4, "reference": 1.2}
    by_file = morgana.load_field({"type": "gladstone_dale", "filename": str(tmp_path / "jet.vti"), **law})
    by_array = morgana.load_field(sampled.volume(**law))
    points = np.array([[0, 0, 0.7], [0.33, -0.2, 1.1]])
    expected = 1 + 2.27e-4 * (jet(points) - 1.2)
    np.testing.assert_allclose(by_array.n(points), expected, atol=2e-8)
    np.testing.assert_allclose(by_file.n(points), by_array.n(points), atol=1e-12)


def test_files_keep_samples_and_place(box, tmp_path, program):
    sampled = flow.sample(box, "rho/rho0 (%)", spacing=(0.1, 0.08, 0.05))
    for extension in ("vti", "nrrd", "npy"):
        sampled.write(tmp_path / f"jet.{extension}")
    np.testing.assert_array_equal(np.load(tmp_path / "jet.npy"), sampled.values)
    for extension in ("vti", "nrrd"):
        told = program("convert", f"jet.{extension}", "-o", f"{extension}.npy")
        assert "21 x 25 x 31 voxels, float64" in told
        assert "spacing   0.1 x 0.08 x 0.05\n  first     (-1, -0.96, 0); samples at nodes" in told
        np.testing.assert_array_equal(np.load(tmp_path / f"{extension}.npy"), sampled.values)
    with pytest.raises(morgana.FileError, match="cannot write"):
        sampled.write(tmp_path / "none" / "jet.vti")
    assert not (tmp_path / "none").exists()


def test_boxes_hold_the_samples(box):
    sampled = flow.sample(box, "rho/rho0 (%)", spacing=0.1)
    clear = {"type": "transparent", "ior": sampled.volume(constant=2.27e-4, reference=1.2)}
    sensor = {"type": "perspective", "to_world": [{"lookat": {"origin": [0, 0, 5], "target": [0, 0, 0], "up": [0, 1, 0]}}]}
    scene = load({"type": "scene", "sensor": sensor, "sky": {"type": "constant"}, "jet": sampled.box(clear)})
    # Trace rays through the jet, through a corner, and beside it.
    rays = morgana.trace(scene, [[0, 0, 5], [0.99, 0.95, 5], [1.01, 0, 5]], [0, 0, -1])
    for ray in (rays[0], rays[1]):
        np.testing.assert_allclose(ray.points[[1, -2], 2], [1.5, 0], atol=1e-9)
    assert len(rays[2].points) == 2


def test_densities_of_gases():
    # Dry air of 15 °C at sea level: 1.225 kg/m³ (US Standard Atmosphere 1976).
    assert flow.density(101325, 288.15) == pytest.approx(1.225, abs=2e-4)
    with pytest.raises(ValueError, match="kelvins"):
        flow.density(101325, [300, -3])
    with pytest.raises(ValueError, match="absolute"):
        flow.density([0, 101325], 300)
    # Test a mixture with helium.
    np.testing.assert_allclose(flow.density(1e5, 300, [28.9647e-3, 4.0026e-3]), [1.1612, 0.16047], rtol=1e-4)
    for mass in (0, -0.029, float("nan"), float("inf"), [0.029, 0.0]):
        with pytest.raises(ValueError, match="molar masses must be positive and finite"):
            flow.density(101325, 300, mass)
    for mass in (28.97, [0.029, 1.008]):
        with pytest.raises(ValueError, match="kg/mol is too large for a gas: convert g/mol to kg/mol"):
            flow.density(101325, 300, mass)
    with pytest.raises(TypeError, match="molar_mass must be an array of real numbers"):
        flow.density(101325, 300, "air")


def test_mistakes_are_named(box, tmp_path):
    for arguments, message in [
        ({"array": "rho"}, r"no array 'rho'; it has 'rho/rho0 \(%\)'"),
        ({"array": "rho/rho0"}, r"did you mean 'rho/rho0 \(%\)'\?"),
        ({"array": "rho/rho0 (%)", "outside": float("nan")}, "must be finite"),
        ({"array": "rho/rho0 (%)", "spacing": 1e-5}, "samples are too many"),
        ({"array": "rho/rho0 (%)", "spacing": 0}, "must be positive"),
        ({"array": "rho/rho0 (%)", "bounds": (1, 0, 0, 1, 0, 1)}, "with each maximum above its minimum"),
        ({"array": "rho/rho0 (%)", "bounds": (5, 6, 5, 6, 5, 6)}, "no sample lies in the mesh"),
        ({"array": "rho/rho0 (%)", "revolve": "r"}, "must be 'x', 'y' or 'z'"),
    ]:
        with pytest.raises(flow.FlowError, match=message):
            flow.sample(box, **arguments)
    box["velocity"] = np.zeros((box.n_points, 3))
    with pytest.raises(flow.FlowError, match="has 3 components"):
        flow.sample(box, "velocity")
    with pytest.raises(morgana.FileError, match="no such file"):
        flow.read(tmp_path / "missing.vtu")
    (tmp_path / "text.vtu").write_text("no mesh")
    with pytest.raises(morgana.FileError, match="text.vtu"):
        flow.read(tmp_path / "text.vtu")
    assert flow.sample(box, "rho/rho0%20%28%25%29", spacing=0.2).name == "rho/rho0 (%)"
    with pytest.raises(morgana.FileError, match="volumes are .vol, .npy, .npz"):
        flow.sample(box, "rho/rho0 (%)", spacing=0.2).write(tmp_path / "jet.txt")


def test_the_command(box, tmp_path, capsys):
    box.save(tmp_path / "jet.vti")
    arguments = [str(tmp_path / "jet.vti"), "--array", "rho/rho0 (%)", "--spacing", "0.2", "-o", str(tmp_path / "out.vti")]
    done = subprocess.run([sys.executable, "-m", "morgana.flow", *arguments], capture_output=True, text=True, check=True)
    assert "11 x 11 x 9 samples of rho/rho0 (%), 0.0 % outside of the mesh\nresampling error: rms" in done.stdout
    assert (tmp_path / "out.vti").exists()
    assert flow.main(arguments[:1]) == 0
    assert capsys.readouterr().out.splitlines()[0] == "rho/rho0 (%)"
    arguments[2] = "rho"
    assert flow.main(arguments) == 1
    assert capsys.readouterr().err.startswith("error: the mesh has no array 'rho'")
