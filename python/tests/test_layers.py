"""Layers as labels of voxels, compared with the tables of MCML and with a slab that is a cube.

MCML: L. Wang, S. L. Jacques and L. Zheng, Comput. Methods Programs Biomed. 47, 1995. Each
comparison is at 4 standard errors (6e-5); there are 24.
"""

import morgana
import numpy as np
import pytest

WIDE = 200.0


def layers(heights, properties, particles, seed):
    """Returns the light that leaves layers of voxels, of which the light meets the first one first."""
    labels = np.repeat(np.arange(1, len(heights) + 1), heights).reshape(-1, 1, 1)
    depth = 0.1 * len(labels)
    tissue = {
        "type": "labels", "data": labels, "to_world": [{"scale": [WIDE, WIDE, depth]}, {"translate": [-WIDE / 2, -WIDE / 2, 0]}],
        "properties": np.array([[0, 0, 1, 1], *properties]),
        "faces": {"type": "irradiancemeter", "id": "faces", "records": True},
    }
    return leaving(tissue, depth, particles, seed)


def leaving(tissue, depth, particles, seed):
    beam = {"type": "collimated", "radius": 1e-3, "power": 1.0, "to_world": [{"translate": [0.01, 0.02, -1]}]}
    scene = morgana.load_dict({"type": "scene", "integrator": {"type": "particle"}, "tissue": tissue, "beam": beam})
    records = morgana.render(scene, particles=particles, seed=seed).records["faces"]
    records = records._replace(weight=records.weight * (records.side == 0)[:, None])
    return records, [records.position[:, 2] < 0.5 * depth, records.position[:, 2] > 0.5 * depth]


def agrees(power, exact, tolerance=0.0):
    print(power.mean[0], power.error[0], exact)
    return abs(power.mean[0] - exact) < 4 * power.error[0] + tolerance


def test_a_slab_of_matched_index():
    """MCML's table 1: van de Hulst's slab of μ_a = 1, μ_s = 9, g = 0.75, 0.2 thick; six digits from
    adding and doubling."""
    records, (back, through) = layers([1, 1], [[1, 9, 0.75, 1]] * 2, 200_000, 1)
    assert agrees(records.power(back), 0.097395)
    assert agrees(records.power(through), 0.660958)
    cube = {
        "type": "cube", "to_world": [{"scale": [WIDE / 2, WIDE / 2, 0.1]}, {"translate": [0, 0, 0.1]}], "bsdf": {"type": "null"},
        "interior": {"type": "homogeneous", "sigma_a": 1, "sigma_s": 9, "phase": {"type": "hg", "g": 0.75}},
        "faces": {"type": "irradiancemeter", "id": "faces", "records": True},
    }
    other, (other_back, other_through) = leaving(cube, 0.2, 200_000, 2)
    # By angle: the last bin contains the unscattered light.
    edges = np.linspace(0, 1, 11)
    for chosen, others in [(back, other_back), (through, other_through)]:
        for low, high in zip(edges, edges[1:]):
            found, expected = (
                r.power(where & (np.abs(r.direction[:, 2]) > low) & (np.abs(r.direction[:, 2]) <= high))
                for r, where in [(records, chosen), (other, others)]
            )
            assert agrees(found, expected.mean[0], 4 * (np.hypot(found.error[0], expected.error[0]) - found.error[0])), (low, high)


def test_three_layers():
    """Layers of C. M. Gardner and A. J. Welch, for which MCML has a diffuse reflectance of 0.2375
    and a transmittance of 0.0965, in units of cm. Their own values are 0.2381 and 0.0974, so that
    neither is known to better than 1e-3. The table counts no light that is reflected before it
    enters."""
    properties = [[1, 100, 0.9, 1.37], [1, 10, 0.0, 1.37], [2, 10, 0.7, 1.37]]
    records, (back, through) = layers([1, 1, 2], properties, 100_000, 3)
    assert agrees(records.power(back), 0.2375, 1e-3)
    assert agrees(records.power(through), 0.0965, 1e-3)
    assert records.power(back).error[0] < 1.5e-3


@pytest.mark.parametrize("first", [0, 1])
def test_the_order_of_layers_counts(first):
    """Check the power of the test above: with the last layer in another place the reflectance
    differs."""
    properties = [[1, 100, 0.9, 1.37], [1, 10, 0.0, 1.37], [2, 10, 0.7, 1.37]]
    properties[first], properties[2] = properties[2], properties[first]
    records, (back, _) = layers([1, 1, 2], properties, 100_000, 3)
    assert abs(records.power(back).mean[0] - 0.2375) > 8 * records.power(back).error[0]
