"""Derivatives of images and Jacobians of records, compared with closed forms, differences and one
another; and refused arguments.

Statistical comparisons are at 4.5 standard errors, a false-alarm rate of 7e-6 each, 2e-4 for the
whole file; seeds are fixed.
"""

import copy
import math
from types import SimpleNamespace

import morgana
import numpy as np
import pytest
from conftest import load, meters, small

Z = 4.5


def lit(**medium):
    """A lit ball in front of a wall, in one channel, 6 by 4 pixels."""
    scene = small(**medium)
    scene["sensor"]["film"].update(width=6, height=4, pixel_format="luminance")
    scene["wall"] = {
        "type": "rectangle",
        "to_world": [{"scale": 2}, {"rotate": {"axis": [0, 1, 0], "angle": 180}}, {"translate": [0, 0, 1.5]}],
        "bsdf": {"type": "diffuse", "reflectance": 0.6},
    }
    scene["light"] = {"type": "point", "position": [1, 1, -1.5], "intensity": 20.0}
    scene["ball"]["interior"]["id"] = "fog"
    return scene


def near(a, b, *errors):
    assert abs(a - b) < Z * math.hypot(*errors) + 1e-12, (a, b, errors)


def test_derivatives_have_the_shapes_of_their_parameters():
    grid = {"type": "gridvolume", "data": np.full((2, 3, 4), 0.5, np.float32), "to_world": [{"scale": 2}, {"translate": [-1, -1, -1]}]}
    scene = load(lit(type="heterogeneous", sigma_t=grid))
    names = ["fog.sigma_t", "fog.sigma_a", "fog.albedo", "wall.reflectance", "light.emission"]
    found = morgana.derivatives(scene, names, np.ones((4, 6, 1)), spp=4)
    assert list(found) == names
    assert [d.value.shape for d in found.values()] == [(2, 3, 4, 1), (2, 3, 4, 1), (1,), (1,), (1,)]
    assert all(d.error.shape == d.value.shape and (d.error >= 0).all() for d in found.values())
    assert [list(d.coordinates) for d in found.values()] == [["z", "y", "x", "channel"], ["z", "y", "x", "channel"], *[["channel"]] * 3]
    assert found["fog.albedo"].sel(channel="Y").mean == found["fog.albedo"].value[0]
    again = morgana.derivatives(scene, names, np.ones((4, 6, 1)), spp=4, threads=1)
    assert again == found
    other = morgana.derivatives(scene, names, np.ones((4, 6, 1)), spp=4, seed=1)
    assert other != found


def test_absorption_attenuates_exponentially():
    scene = small(sigma_t=0.7, albedo=0.0, ior=1.0)
    scene["sensor"]["to_world"] = [{"lookat": {"origin": [0, 0, 0], "target": [0, 0, 1], "up": [0, 1, 0]}}]
    scene["ball"]["interior"]["id"] = "ink"
    scene = load(scene)
    white = np.full((8, 12, len(scene.channels)), 1 / 96)
    found = morgana.derivatives(scene, ["ink.sigma_a"], white, spp=1024)["ink.sigma_a"]
    for value, error in zip(found.value, found.error):
        near(value, -math.exp(-0.7), error)


def test_each_wavelength_has_derivatives_of_its_own():
    scene = small(sigma_t={"type": "spectrum", "value": [[400, 0.2], [700, 1.4]]}, albedo=0.0, ior=1.0)
    scene["sensor"]["to_world"] = [{"lookat": {"origin": [0, 0, 0], "target": [0, 0, 1], "up": [0, 1, 0]}}]
    scene["sensor"]["film"].update(pixel_format="spectral", wavelengths="400, 460, 520, 580, 640, 700")
    scene["ball"]["interior"]["id"] = "ink"
    white = np.full((8, 12, 6), 1 / 96)
    found = morgana.derivatives(load(scene), ["ink.sigma_a"], white, spp=128)["ink.sigma_a"]
    for value, error, sigma in zip(found.value, found.error, np.linspace(0.2, 1.4, 6)):
        near(value, -math.exp(-sigma), error)


def test_a_loss_that_is_not_linear_has_a_gradient_without_bias():
    """The derivative of a mean square by emission is twice the mean square; a primal of the same
    samples would make it too large by their variance."""
    scene = load(lit(), integrator="path")
    truth = morgana.render(scene, spp=4096, seed=9)
    exact = (truth.image.astype(float) ** 2 - truth.variance).sum()
    emitters = [f"{name}.emission" for name in scene.emitters]
    values = []
    for seed in range(24):
        found = morgana.derivatives(scene, emitters, lambda result: result.image, spp=8, seed=seed)
        values.append(sum(d.value[0] for d in found.values()))
    near(np.mean(values), exact, np.std(values, ddof=1) / math.sqrt(len(values)), 0.01 * exact / Z)


def shining(tmp_path):
    """Returns a scene for each kind of emitting image and volume, the name of its emitter, and its
    values with a channel."""
    rng = np.random.default_rng(3)
    cube = [{"scale": 2}, {"translate": [-1, -1, -1]}]
    dark = lit()
    del dark["light"], dark["sky"]
    sky = rng.random((3, 4), np.float32) + 0.2
    (tmp_path / "sky.pfm").write_bytes(b"Pf\n4 3\n-1\n" + sky[::-1].tobytes())
    yield {**dark, "sky": {"type": "envmap", "filename": str(tmp_path / "sky.pfm")}}, "sky", sky
    glow = rng.random((2, 1, 3), np.float32) + 0.2
    grid = {"type": "gridvolume", "data": glow, "to_world": cube}
    yield {**dark, "glow": {"type": "volumelight", "radiance": grid}}, "glow", glow
    rows = rng.random((2, 3)).astype(np.float32) / 2 + 0.2
    morgana.write(tmp_path / "rows.exr", rows)
    image = {"type": "bitmap", "filename": str(tmp_path / "rows.exr"), "raw": True}
    beam = {"type": "collimated", "profile": "rectangle", "width": 2, "height": 1, "texture": image, "irradiance": 3.0}
    yield {**dark, "beam": {**beam, "to_world": [{"translate": [0, 0, -1.5]}]}}, "beam", 3 * rows
    board = {"type": "checkerboard", "color0": 0.5, "color1": 2.0}
    place = [{"rotate": {"axis": [1, 0, 0], "angle": 90}}, {"translate": [0, 1.6, 0]}]
    panel = {"type": "rectangle", "to_world": place, "light": {"type": "area", "id": "ceiling", "radiance": board}}
    yield {**dark, "panel": panel}, "ceiling", np.array([0.5, 2.0])
    flame = copy.deepcopy(dark)
    flame["ball"]["interior"].update(type="heterogeneous", emission=grid)
    yield flame, "fog", glow


def test_emitters_are_linear_in_their_values(tmp_path):
    for description, emitter, values in shining(tmp_path):
        scene = load(description)
        weights = np.linspace(-1, 2, 24).reshape(4, 6, 1)
        names = [f"{emitter}.radiance", f"{emitter}.emission", "exposure"]
        for integrator in ("path", "particle", "bdpt"):
            each, factor, exposure = morgana.derivatives(scene, names, weights, spp=16, integrator=integrator).values()
            assert each.value.shape == (*values.shape, 1), emitter
            assert (each.value[..., 0] * values).sum() == pytest.approx(factor.value[0], rel=1e-5), (emitter, integrator)
            assert factor.value == pytest.approx(exposure.value, rel=1e-9) and factor.value != 0


def test_colours_of_metals_have_derivatives_by_pixels(tmp_path):
    """Derivatives by equal pixels add up to the derivative by one colour, for identical paths."""
    morgana.write(tmp_path / "pixels.exr", np.full((2, 3), 0.75, np.float32))
    image = {"type": "bitmap", "filename": str(tmp_path / "pixels.exr"), "raw": True}
    sums = []
    for colour, shape in [(0.75, (1,)), (image, (2, 3, 1))]:
        scene = lit()
        scene["wall"]["bsdf"] = {"type": "roughconductor", "alpha": 0.4, "specular_reflectance": colour}
        found = morgana.derivatives(load(scene), ["wall.specular_reflectance"], np.ones((4, 6, 1)), spp=16)
        assert found["wall.specular_reflectance"].value.shape == shape
        sums.append(found["wall.specular_reflectance"].value.sum())
    assert sums[0] > 0 and sums[1] == pytest.approx(sums[0], rel=1e-6)


def test_colours_of_mixtures_have_derivatives():
    """Derivatives equal those of the two parts blended, for identical paths."""
    matt, metal = {"type": "diffuse", "reflectance": 0.6}, {"type": "roughconductor", "alpha": 0.4}
    found = []
    for bsdf in ({"type": "blendbsdf", "weight": 0.75}, {"type": "mixturebsdf", "weights": "0.25, 0.75"}, {"type": "mixturebsdf", "weights": "0.25, 0.5"}):
        scene = lit()
        scene["wall"]["bsdf"] = {**bsdf, "a": matt, "b": metal}
        found.append(load(scene))
    names = ["wall.reflectance", "wall.specular_reflectance"]
    blend, mixture = (morgana.derivatives(scene, names, np.ones((4, 6, 1)), spp=16) for scene in found[:2])
    for name in names:
        assert blend[name].value[0] > 0
        np.testing.assert_allclose(mixture[name].value, blend[name].value, rtol=1e-6)
    # The remainder to 1 is black, and has no colour of its own.
    rest = morgana.derivatives(found[2], names, np.ones((4, 6, 1)), spp=16)
    assert all(rest[name].value[0] > 0 for name in names)


@pytest.mark.parametrize("integrator", ["path", "bdpt"])
def test_light_is_in_proportion_to_a_colour_that_it_met_once(integrator):
    """Light of a sky by way of a mirror or a pane, which forms a wall, is proportional to its
    colour, path by path."""
    mirror = {"type": "conductor", "material": "Al", "specular_reflectance": 0.7}
    pane = {"type": "thindielectric", "specular_reflectance": 0.4, "specular_transmittance": 0.9}
    glass = {**pane, "type": "dielectric", "int_ior": 1.0, "ext_ior": 1.0}
    for bsdf in (mirror, pane, glass):
        scene = lit()
        del scene["ball"], scene["light"]
        scene["wall"].update(to_world=[{"scale": 20}, *scene["wall"]["to_world"][1:]], bsdf=bsdf)
        tints = [name for name in ("specular_reflectance", "specular_transmittance") if name in bsdf]
        names = [f"wall.{tint}" for tint in tints]
        image, *each = morgana.derivatives(load(scene), ["exposure", *names], np.ones((4, 6, 1)), spp=8, integrator=integrator).values()
        found = sum(bsdf[tint] * derivative.value[0] for tint, derivative in zip(tints, each))
        assert image.value[0] > 0 and found == pytest.approx(image.value[0], rel=1e-9), bsdf


def test_integrators_find_the_same_derivatives():
    scene, weights = load(lit()), np.linspace(-1, 2, 24).reshape(4, 6, 1)
    names = ["fog.sigma_t", "fog.albedo", "wall.reflectance", "light.radiance"]
    by_path = morgana.derivatives(scene, names, weights, spp=256)
    assert morgana.derivatives(scene, names, weights, spp=256, integrator="path") == by_path
    for integrator in ("particle", "bdpt"):
        found = morgana.derivatives(scene, names, weights, spp=256, integrator=integrator)
        assert found == morgana.derivatives(load({**lit(), "integrator": {"type": integrator}}), names, weights, spp=256)
        for name in names:
            near(found[name].value[0], by_path[name].value[0], found[name].error[0], by_path[name].error[0])


def test_time_gates_add_up():
    scene = lit()
    scene["sensor"]["film"] = {**scene["sensor"]["film"], "decomposition": "transient", "min_bound": 4, "max_bound": 12, "bin_width": 2}
    scene = load(scene)
    layers = list(morgana.render(scene, spp=1).layers)
    weights = np.linspace(-1, 1, 24).reshape(4, 6, 1)
    whole = morgana.derivatives(scene, ["fog.sigma_t"], weights, spp=32)["fog.sigma_t"]
    parts = [morgana.derivatives(scene, ["fog.sigma_t"], {name: weights}, spp=32)["fog.sigma_t"] for name in layers]
    assert sum(p.value[0] for p in parts) == pytest.approx(whole.value[0], rel=1e-9)
    assert sum(abs(p.value[0]) > 0 for p in parts) > 2
    with pytest.raises(morgana.RenderError, match="no layer 'noon'"):
        morgana.derivatives(scene, ["fog.sigma_t"], {"noon": weights})


def test_what_has_no_derivative_is_refused():
    scene, weights = load(lit()), np.ones((4, 6, 1))

    def never(result):
        raise AssertionError("a render before the check")

    def refused(names, match, of=scene, by=weights, error=morgana.RenderError, **options):
        with pytest.raises(error, match=match):
            morgana.derivatives(of, names, by, **options)

    refused(["fog.sigma"], r"no parameter 'fog.sigma': parameters are MEDIUM.sigma_t")
    refused(["smoke.sigma_t"], r"no medium 'smoke': there are 'ambient', 'fog'")
    refused(["lights.emission"], "no emitter 'lights': there are")
    refused(["fog.g"], "only hg")
    refused(["ball.reflectance"], "'ball' has no reflectance")
    refused("fog.sigma_t", "a list of names", error=TypeError)
    refused([], "name at least one")
    metal = load({**lit(), "wall": {**lit()["wall"], "bsdf": {"type": "roughconductor", "alpha": 0.3}}})
    refused(["wall.reflectance"], "ask for wall.specular_reflectance", of=metal)
    refused(["wall.specular_reflectance"], "ask for wall.reflectance")
    plastic = load({**lit(), "wall": {**lit()["wall"], "bsdf": {"type": "plastic"}}})
    refused(["wall.reflectance"], "ask for wall.diffuse_reflectance or wall.specular_reflectance", of=plastic)
    tinted = load({**lit(), "wall": {**lit()["wall"], "bsdf": {"type": "principled", "spec_tint": 0.2}}})
    refused(["wall.base_color"], "its bsdf is null, or principled with tints", of=tinted)
    principled = load({**lit(), "wall": {**lit()["wall"], "bsdf": {"type": "principled"}}})
    refused(["wall.reflectance"], "ask for wall.base_color", of=principled)
    dark = load({**lit(), "wall": {**lit()["wall"], "bsdf": {"type": "conductor", "specular_reflectance": 0}}})
    refused(["wall.specular_reflectance"], "specular_reflectance of 'wall' is zero somewhere.*start from a small value", of=dark)
    refused(["fog.sigma_t"] * 2, "listed twice")
    refused(["fog.sigma_t"], r"must have the shape of the picture, \(4, 6, 1\)", by=np.ones((4, 6)))
    refused(["fog.sigma_t"], "not all finite", by=np.full((4, 6, 1), np.inf))
    refused(["fog.sigma_t"], "at least two samples", spp=1)
    measured = load(meters())
    refused(["ambient.sigma_a"], "must be a dictionary by names of readings: fluence", of=measured, error=TypeError)
    refused(["ambient.sigma_a"], "no reading 'power': there are fluence", of=measured, by={"power": [1]})
    refused(["ambient.sigma_a"], r"must have the shape of the reading, \(2, 3, 4\)", of=measured, by={"fluence": [1]})
    for blurs in ("photon", "sppm", "vcm"):
        photons = load({**lit(), "integrator": {"type": blurs}})
        refused(["fog.sigma_t"], f"the integrator {blurs} blurs light, which then has no derivatives: use path, particle or bdpt", of=photons)
        # The error comes before any rendering, also for integrators by name.
        refused(["fog.sigma_t"], f"integrator {blurs} blurs", by=never, integrator=blurs)
        assert morgana.derivatives(photons, ["fog.sigma_t"], weights, spp=2, integrator="path")["fog.sigma_t"].value.shape == (1,)
    refused(["fog.sigma_t"], "not for aov", of=load({**lit(), "integrator": {"type": "aov", "aovs": "d:depth"}}))
    refused(["smoke.sigma_t"], "no medium 'smoke'", by=never)
    refused(["fog.sigma_t"], "not all finite", by=lambda result: np.full_like(result.image, np.nan))
    refused(["fog.sigma_t"], r"must have the shape of the picture, \(4, 6, 1\)", by=lambda result: result.image[0])
    refused(["fog.exposure"], "no parameter 'fog.exposure'")
    black = lit()
    black["light"]["intensity"] = 0.0
    refused(["light.radiance"], "'light': the light of emitter number .* is zero", of=load(black))
    refused(["ambient.sigma_a"], "integrator is for pictures", of=load(meters()), integrator="path")
    clear = load(lit(sigma_t=0.0))
    refused(["fog.sigma_s"], "is zero somewhere.*sigma_a", of=clear)
    assert morgana.derivatives(clear, ["fog.sigma_a"], weights, spp=2)["fog.sigma_a"].value[0] < 0


def test_names_may_come_one_by_one():
    scene, weights = load(lit()), np.ones((4, 6, 1))
    names = ["fog.sigma_t", "exposure"]
    found = morgana.derivatives(scene, names, weights, spp=2)
    assert morgana.derivatives(scene, (name for name in names), weights, spp=2) == found
    assert morgana.derivatives(scene, dict.fromkeys(names), weights, spp=2) == found
    for wrong, said in [(iter([]), "name at least one"), (iter([1]), r"parameters are \[1\] but must be a list"), (7, "parameters are 7 but must be a list")]:
        with pytest.raises((TypeError, morgana.RenderError), match=said):
            morgana.derivatives(scene, wrong, weights)


def test_media_of_labels_are_named_after_them():
    labels = np.repeat([1, 2, 3], 2).reshape(6, 1, 1).astype(np.uint8)
    scene = meters()
    del scene["ball"]
    scene["head"] = {"type": "labels", "data": labels, "properties": [[0, 0, 1, 1], [0.1, 1, 0, 1], [0.2, 1, 0, 1], [0.1, 1, 0, 1.3]]}
    weights = {"fluence": np.ones((2, 3, 4))}
    found = morgana.derivatives(load(scene), ["head: labels 1, 2.sigma_a", "head: label 3.sigma_a"], weights, particles=5000)
    assert [one.value.shape for one in found.values()] == [(2, 1), (1,)]
    # A label has the name of its region in records, also if it shares an index with others.
    alone = [f"head: label {label}.sigma_a" for label in (2, 1, 3)]
    each = morgana.derivatives(load(scene), alone, weights, particles=5000)
    assert list(each) == alone
    both, third = found.values()
    for name, value, error in [(alone[0], both.value[1], both.error[1]), (alone[1], both.value[0], both.error[0]), (alone[2], third.value, third.error)]:
        assert np.array_equal(each[name].value, value) and np.array_equal(each[name].error, error)
    assert not np.array_equal(both.value[0], both.value[1])
    for film, channels in [("luminance", 1), ("rgb", 3)]:
        scene["sensor"]["film"] = {"type": "hdrfilm", "pixel_format": film}
        rows = morgana.jacobian(load(scene), ["head: labels 1, 2.sigma_a", *alone], "fluence", particles=5000)
        both = rows["head: labels 1, 2.sigma_a"]
        assert both.value.shape == (2, 3, 4, 2, channels)
        assert np.array_equal(rows[alone[0]].value, both.value[..., 1, :]) and np.array_equal(rows[alone[1]].error, both.error[..., 0, :])
        assert rows[alone[2]].value.shape == (2, 3, 4, channels)
        assert list(both.coordinates) == ["z", "y", "x", "label", "channel"]
        second = both.sel(label="head: label 2")
        assert np.array_equal(second.mean, rows[alone[0]].value) and np.array_equal(second.coordinates["x"], rows[alone[2]].coordinates["x"])


def test_ctrl_c_in_the_render_of_weights_ends_all(monkeypatch):
    monkeypatch.setattr("morgana._derivatives.render", lambda *args, **options: SimpleNamespace(stopped="interrupted"))
    with pytest.raises(KeyboardInterrupt):
        morgana.derivatives(load(lit()), ["fog.sigma_t"], lambda result: np.ones((4, 6, 1)), spp=2)


def detecting(sigma_s, sigma_a):
    """A scattering ball, lit from its centre, whose surface keeps records."""
    scene = copy.deepcopy(meters())
    del scene["sensor"]
    scene["light"]["position"] = [0, 0, 0]
    interior = {"type": "homogeneous", "id": "tissue", "sigma_s": sigma_s, "sigma_a": sigma_a}
    skin = {"type": "irradiancemeter", "records": True}
    scene["ball"] = {"type": "sphere", "bsdf": {"type": "null"}, "interior": interior, "skin": skin}
    scene["integrator"] = {"type": "particle"}
    return load(scene)


def test_derivatives_of_readings_are_those_of_records():
    """Both use the same particles; records contain the lengths and scatterings of each path."""
    scene = detecting(3.0, 0.4)
    names = ["tissue.sigma_a", "tissue.sigma_s", "tissue.albedo", "light.emission"]
    weights = {"power": np.array([1.0, 0.0])}
    found = morgana.derivatives(scene, names, weights, particles=100_000)
    measured = morgana.render(scene, particles=100_000)
    records = measured.records["irradiancemeter"]
    exact, row = records.jacobian({"tissue": 3.0}), records.regions.index("tissue")
    by_a, by_s, by_albedo, by_emission = found.values()
    near(by_a.value[0], exact.mu_a[row, 0], by_a.error[0], exact.mu_a_error[row, 0])
    near(by_s.value[0], exact.mu_s[row, 0], by_s.error[0], exact.mu_s_error[row, 0])
    assert by_albedo.value[0] == pytest.approx(3.4 * (by_s.value[0] - by_a.value[0]), rel=1e-9)
    near(by_emission.value[0], measured.meters["power"].mean[0], by_emission.error[0], measured.meters["power"].error[0])


def test_jacobians_of_records_are_differences():
    def records(sigma_s, sigma_a):
        return morgana.render(detecting(sigma_s, sigma_a), particles=200_000).records["irradiancemeter"]

    here = records(3.0, 0.4)
    found = here.jacobian({"tissue": 3.0})
    row = here.regions.index("tissue")
    for column, error, up, down, step in [
        (found.mu_a, found.mu_a_error, (3.0, 0.5), (3.0, 0.3), 0.2),
        (found.mu_s, found.mu_s_error, (3.6, 0.4), (2.4, 0.4), 1.2),
    ]:
        powers = [records(*of).power() for of in (up, down)]
        difference = (powers[0].mean - powers[1].mean) / step
        spread = np.hypot(powers[0].error, powers[1].error) / step
        # The difference quotient itself has an error below 1 % of the derivative.
        near(column[row, 0], difference[0], error[row, 0], spread[0], 0.01 * column[row, 0] / Z)
    assert np.isnan(here.jacobian().mu_s).all()
    with pytest.raises(ValueError, match="no region 'bone'"):
        here.jacobian({"bone": 1.0})


def test_jacobians_of_readings_have_a_row_for_each_bin():
    scene = detecting(3.0, 0.4)
    names = ["tissue.sigma_a", "tissue.sigma_s"]
    rows = morgana.jacobian(scene, names, "power", particles=2000)
    assert list(rows) == names and rows["tissue.sigma_a"].value.shape == (2, 1)
    one = morgana.derivatives(scene, names, {"power": np.array([1.0, 0.0])}, particles=2000)
    for name in names:
        np.testing.assert_allclose(rows[name].value[0], one[name].value, rtol=1e-9)
        np.testing.assert_allclose(rows[name].error[0], one[name].error, rtol=1e-6)
    assert morgana.jacobian(scene, names, "power", particles=2000, threads=1) == rows


def test_jacobians_of_absorbed_power_are_per_watt_if_the_meter_is():
    scene = meters()
    scene["light"]["intensity"] = 3.0
    scene["integrator"] = {"type": "particle"}
    interior = {"type": "homogeneous", "id": "ink", "sigma_s": 1.0, "sigma_a": 0.5}
    scene["ball"] = {"type": "sphere", "radius": 2.0, "bsdf": {"type": "null"}, "interior": interior}
    rows = []
    for normalization in ("absolute", "per_watt"):
        scene["sensor"]["normalization"] = normalization
        rows.append(morgana.jacobian(load(scene), ["ink.sigma_a"], "absorbed", particles=2000)["ink.sigma_a"])
    assert rows[0].value.shape == (2, 3, 4, 1) and (rows[0].value != 0).any()
    np.testing.assert_allclose(rows[0].value, rows[1].value * 3.0 * 4 * math.pi, rtol=1e-9)
    np.testing.assert_allclose(rows[0].error, rows[1].error * 3.0 * 4 * math.pi, rtol=1e-9)
    with pytest.raises(morgana.RenderError, match="per watt have no derivatives by emission"):
        morgana.jacobian(load(scene), ["light.emission"], "absorbed", particles=2000)
    with pytest.raises(morgana.RenderError, match="no reading 'power': there are fluence, absorbed"):
        morgana.jacobian(load(scene), ["ink.sigma_a"], "power")
    with pytest.raises(morgana.RenderError, match="the scene has no meters"):
        morgana.jacobian(load(lit()), ["fog.sigma_a"], "power")


@pytest.mark.parametrize("normalization", ["absolute", "per_watt"])
@pytest.mark.parametrize("several", [False, True])
def test_derivatives_of_initial_pressure_are_those_of_absorbed_power(normalization, several):
    scene = meters()
    scene["light"]["intensity"] = 3.0
    interior = {"type": "homogeneous", "id": "ink", "sigma_s": 1.0, "sigma_a": 0.5}
    scene["ball"] = {"type": "sphere", "radius": 2.0, "bsdf": {"type": "null"}, "interior": interior}
    gauge = {"gruneisen": 0.2, "pulse_energy": 3.0, "metres_per_unit": 0.01}
    scene["sensor"] = {**scene["sensor"], "normalization": normalization, "id": "tank", **gauge}
    if several:
        scene["other"] = {key: value for key, value in scene["sensor"].items() if key not in gauge} | {"id": "other"}
    prefix = "tank." if several else ""
    # A few particles are enough, because the compared results agree to a factor.
    loaded, by, few = load(scene), "ink.sigma_a", {"particles": 4000}
    measured = morgana.render(loaded, **few)
    absorbed, p0 = (measured.meters[f"{prefix}{name}"].mean for name in ("absorbed", "p0"))
    factor = 0.2 * 3.0 / 0.01**3 / (1.0 if normalization == "per_watt" else 3.0 * 4 * math.pi)
    np.testing.assert_allclose(p0, factor * absorbed, rtol=1e-12)
    rows, scaled = (morgana.jacobian(loaded, [by], f"{prefix}{name}", **few)[by] for name in ("p0", "absorbed"))
    assert (rows.value != 0).any()
    np.testing.assert_allclose(rows.value, factor * scaled.value, rtol=1e-12)
    np.testing.assert_allclose(rows.error, factor * scaled.error, rtol=1e-12)
    weights = np.random.default_rng(3).normal(size=p0.shape)
    both = morgana.derivatives(loaded, [by], {f"{prefix}p0": weights, f"{prefix}absorbed": factor * weights}, **few)[by]
    one = morgana.derivatives(loaded, [by], {f"{prefix}p0": weights}, **few)[by]
    np.testing.assert_allclose(both.value, 2 * one.value, rtol=1e-9)
    np.testing.assert_allclose(np.tensordot(weights, rows.value, 3), one.value, rtol=1e-9)
    refused = "the pressure p0, which a pulse of given energy causes, has no derivatives by emission"
    with pytest.raises(morgana.RenderError, match=refused):
        morgana.jacobian(loaded, ["light.emission"], f"{prefix}p0")
    with pytest.raises(morgana.RenderError, match=refused):
        morgana.derivatives(loaded, ["light.emission"], {f"{prefix}p0": weights})
