//! Distant sensors: means of radiance over targets in closed form, by every kind of estimator.
//!
//! Statistical comparisons share a false-alarm rate of 1e-3.

use morgana_io::{LoadOptions, Loaded, Run};
use std::f64::consts::PI;
use std::fs;
use testkit::z_test::max_abs_z;

const FAMILY: f64 = 1e-3;
const ROUNDING: f64 = 1e-9;

fn load(text: &str) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.json");
    fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| format!("{d}\n{text}"))
}

/// A scene with a distant sensor, whose film has the default filter. Its samples are independent,
/// because evenly distributed ones find some of the areas without an error.
fn scene(integrator: &str, sensor: &str, rest: &str) -> String {
    format!(
        r#"{{"type": "scene", "integrator": {{"type": "{integrator}"}}, {rest},
        "sensor": {{"type": "distant", {sensor}, "film": {{"type": "hdrfilm", "width": 1, "height": 1}}, "sampler": {{"type": "independent"}}}}}}"#
    )
}

/// Returns the measured mean, and its standard error.
fn measured(text: &str, samples: u64) -> (f64, f64) {
    let loaded = load(text).unwrap_or_else(|e| panic!("{e}"));
    let run = Run {
        total: Some(samples),
        ..Run::new(&loaded)
    };
    run.render().unwrap().film.summary()
}

const ESTIMATORS: [&str; 3] = ["path", "particle", "bdpt"];

/// A ball of radiance 1 covers a third of the cross section of the sphere around its box.
#[test]
fn without_a_target_the_mean_is_over_the_sphere_around_the_scene() {
    let ball = r#""s": {"type": "sphere", "radius": 0.7, "center": [5, 6, 7], "emitter": {"type": "area", "radiance": 1}}"#;
    let mut zs = Vec::new();
    for integrator in ESTIMATORS {
        let text = scene(integrator, r#""direction": [1, -2, 0.5]"#, ball);
        let (mean, error) = measured(&text, 20_000);
        zs.push((mean - 1.0 / 3.0) / error);
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// A tilted target and an emitting disk of a quarter of its area, of any direction of view.
#[test]
fn a_flat_target_counts_by_its_area() {
    let place = r#"{"rotate": {"axis": [1, 2, 0.5], "angle": 20}}, {"translate": [1, 2, 3]}"#;
    let light = format!(
        r#""s": {{"type": "disk", "to_world": [{{"scale": [1, 0.5, 1]}}, {place}], "emitter": {{"type": "area", "radiance": 1}}}}"#
    );
    let mut zs = Vec::new();
    for (shape, size, expected) in [
        ("disk", "[2, 1, 1]", 0.25),
        ("rectangle", "[1, 1, 1]", PI / 8.0),
    ] {
        for direction in ["[0, 0, -1]", "[1, 1, -2]"] {
            for integrator in ESTIMATORS {
                let target = format!(
                    r#""direction": {direction}, "target": {{"type": "{shape}", "to_world": [{{"scale": {size}}}, {place}]}}"#
                );
                let (mean, error) = measured(&scene(integrator, &target, &light), 20_000);
                zs.push((mean - expected) / error);
            }
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// The light of the sun on a diffuse floor, with no noise by `path`.
#[test]
fn a_floor_in_the_sun_reflects_its_irradiance() {
    let sunny = r#""floor": {"type": "rectangle", "to_world": [{"scale": 10}], "bsdf": {"type": "diffuse", "reflectance": 0.4}},
        "sun": {"type": "directional", "direction": [0, 0.6, -0.8], "irradiance": 3}"#;
    let expected = 0.4 * 3.0 * 0.8 / PI;
    let rectangle = r#""direction": [-1, 0.3, -1], "target": {"type": "rectangle", "to_world": [{"scale": [3, 1, 1]}]}"#;
    let point =
        r#""target": [1, 2, 0], "to_world": [{"rotate": {"axis": [1, 0, 0], "angle": 150}}]"#;
    for sensor in [rectangle, point] {
        let (mean, _) = measured(&scene("path", sensor, sunny), 64);
        assert!((mean - expected).abs() < ROUNDING, "{mean}, not {expected}");
    }
    let (mean, error) = measured(&scene("particle", rectangle, sunny), 50_000);
    max_abs_z(&[(mean - expected) / error], FAMILY).unwrap();
}

/// The rays travel in the given direction: they see an area light that faces them.
#[test]
fn the_direction_is_that_of_the_rays() {
    let light = r#""s": {"type": "rectangle", "emitter": {"type": "area", "radiance": 1}}"#;
    let target = r#""target": {"type": "rectangle"}"#;
    for (sensor, expected) in [
        (r#""direction": [0, 0, -1]"#, 1.0),
        (r#""direction": [0, 0, 1]"#, 0.0),
        (r#""to_world": []"#, 0.0),
        (
            r#""to_world": [{"rotate": {"axis": [1, 0, 0], "angle": 180}}]"#,
            1.0,
        ),
    ] {
        let text = scene("path", &format!("{sensor}, {target}"), light);
        let (mean, _) = measured(&text, 16);
        assert!((mean - expected).abs() < ROUNDING, "{mean}: {text}");
    }
}

#[test]
fn contradictions_are_refused() {
    let light = r#""sky": {"type": "constant"}"#;
    let text = |sensor: &str| scene("path", sensor, light);
    let down = r#""direction": [0, 0, -1]"#;
    let wide = text(down).replace(r#""width": 1"#, r#""width": 2"#);
    let batch = format!(
        r#"{{"type": "scene", {light}, "sensor": {{"type": "batch", "a": {{"type": "distant", {down}}}}}}}"#
    );
    for (text, expected) in [
        (
            wide,
            "its film has 2 x 1 pixels: give the film width 1 and height 1",
        ),
        (batch, "cannot be in a batch"),
        (
            text(r#""direction": [0, 0, 0]"#),
            "the direction must not be zero",
        ),
        (
            text(&format!(r#"{down}, "to_world": [{{"scale": 2}}]"#)),
            "give 'direction' or 'to_world', not both",
        ),
        (
            text(r#""direction": [1, 0, 0], "target": {"type": "disk"}"#),
            "the rays of the sensor lie in the target's plane",
        ),
        (
            text(&format!(r#"{down}, "target": {{"type": "sphere"}}"#)),
            "a shape of type 'sphere' does not belong here",
        ),
    ] {
        let message = load(&text).expect_err("the scene was accepted");
        assert!(
            message.contains(expected),
            "expected {expected:?} in:\n{message}"
        );
    }
}
