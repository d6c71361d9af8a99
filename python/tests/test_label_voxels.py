"""Derivatives by the voxels of labels (docs/scene/shapes.md#labels)."""

import numpy as np
import pytest

import morgana

LABELS = np.array([[[1, 1, 2], [1, 3, 2]], [[3, 1, 2], [2, 2, 1]]], "uint8")
"""z, y, x; labels 1 and 2 share an index, 3 has its own."""
PROPERTIES = np.array([[0, 0, 1, 1], [0.02, 1.0, 0.5, 1.37], [0.05, 2.0, 0.5, 1.37], [0.1, 0.5, 0.5, 1.5]])
PLACE = [{"scale": [6, 4, 4]}]


def scene(tissue):
    return morgana.load_dict({
        "type": "scene",
        "integrator": {"type": "particle"},
        "tissue": tissue,
        "source": {"type": "collimated", "radius": 1.0, "power": 1.0, "to_world": [{"translate": [3, 2, -1]}]},
    })


def labels(properties=PROPERTIES, **more):
    detector = {"type": "irradiancemeter", "id": "skin", "records": True}
    return scene({"type": "labels", "data": LABELS, "to_world": PLACE, "properties": properties, "skin": {**detector, **more}})


def test_voxels_add_up_to_labels():
    """The particles are the same."""
    by_label = {f"tissue: label {label}": label for label in (1, 2, 3)}
    for coefficient in ("sigma_a", "sigma_s"):
        voxels = morgana.jacobian(labels(), [f"tissue: voxels.{coefficient}"], "power", particles=2_000, seed=4)[f"tissue: voxels.{coefficient}"]
        assert voxels.value.shape == (2, 2, 2, 3, 1) and list(voxels.axes) == ["side", "z", "y", "x", "channel"]
        for name, label in by_label.items():
            found = morgana.jacobian(labels(), [f"{name}.{coefficient}"], "power", particles=2_000, seed=4)[f"{name}.{coefficient}"]
            total = voxels.value[:, LABELS == label].sum(axis=1)
            assert np.allclose(total, found.value.reshape(total.shape), rtol=1e-9), name


def test_voxels_are_minus_the_mean_partial_path():
    """Records of other particles: |z| of 3 values exceeds 3.9 once in 3000."""
    scene = labels()
    records = morgana.render(scene, particles=20_000, seed=1).records["skin"]
    rows = records.jacobian(where=records.side == 0)
    found = morgana.jacobian(scene, ["tissue: voxels.sigma_a"], "power", particles=20_000, seed=2)["tissue: voxels.sigma_a"]
    for label in (1, 2, 3):
        of = rows.sel(coefficient="mu_a", region=f"tissue: label {label}", channel=0)
        voxels = found.value[0][LABELS == label].sum()
        # Errors of voxels add up at most.
        error = np.hypot(of.error, found.error[0][LABELS == label].sum())
        assert abs(voxels - of.mean) < 3.9 * error, label


def test_voxels_of_labels_are_voxels_of_volumes():
    """A volume of coefficients of the same numbers, by other particles. Of 24 values, |z| exceeds 4.3 once in 2000 runs."""
    flat = PROPERTIES.copy()
    flat[:, 3] = 1.37
    flat[0, 3] = 1.0
    by_labels = labels(flat, records=False)
    mu_a, mu_s = (flat[LABELS, column].astype("float32") for column in (0, 1))
    grid = {"filter_type": "nearest", "to_world": PLACE, "raw": True}
    medium = {
        "type": "heterogeneous", "ior": 1.37, "phase": {"type": "hg", "g": 0.5},
        "sigma_t": {"type": "gridvolume", "data": mu_a + mu_s, **grid}, "albedo": {"type": "gridvolume", "data": mu_s / (mu_a + mu_s), **grid},
    }
    cube = {"type": "cube", "to_world": [{"scale": [3, 2, 2]}, {"translate": [3, 2, 2]}], "bsdf": {"type": "dielectric"}, "interior": medium}
    by_grid = scene({**cube, "skin": {"type": "irradiancemeter", "id": "skin"}})
    name = "heterogeneous"
    for coefficient in ("sigma_a", "sigma_s"):
        found = morgana.jacobian(by_labels, [f"tissue: voxels.{coefficient}"], "power", particles=20_000, seed=7)[f"tissue: voxels.{coefficient}"]
        expected = morgana.jacobian(by_grid, [f"{name}.{coefficient}"], "power", particles=20_000, seed=8)[f"{name}.{coefficient}"]
        z = (found.value - expected.value)[0] / np.hypot(found.error, expected.error)[0]
        assert np.abs(z).max() < 4.3, z.ravel()


def test_mistakes():
    with pytest.raises(morgana.RenderError, match="no volume of labels 'tissu'"):
        morgana.jacobian(labels(), ["tissu: voxels.sigma_a"], "power", particles=64)
    with pytest.raises(morgana.RenderError, match="voxels have sigma_a and sigma_s"):
        morgana.jacobian(labels(), ["tissue: voxels.g"], "power", particles=64)
    with pytest.raises(morgana.RenderError, match="by voxel and by label"):
        morgana.jacobian(labels(), ["tissue: voxels.sigma_a", "tissue: label 3.sigma_a"], "power", particles=64)
