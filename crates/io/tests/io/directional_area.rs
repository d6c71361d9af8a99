//! Parallel light from flat shapes: irradiance and power in closed form, by every kind of estimator.
//!
//! Connections find the light of parallel rays without noise, so `path` must agree to rounding. So
//! must powers, because every particle carries an equal share to the floor. Estimators with noise
//! share a false-alarm rate of 1e-3.

use morgana_io::{LoadOptions, Loaded, Run};
use std::f64::consts::PI;
use std::fs;
use std::ops::ControlFlow;
use testkit::z_test::max_abs_z;
use transport::meter::Meter;
use transport::render::{Handle, MeasureOptions, measure};

const FAMILY: f64 = 1e-3;
const ROUNDING: f64 = 1e-9;
/// Reflectance of the floor.
const ALBEDO: f64 = 0.6;
/// Irradiance of the light.
const IRRADIANCE: f64 = 2.0;

fn load(text: &str) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.json");
    fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| format!("{d}\n{text}"))
}

/// A light at z = 2 above a floor at z = 0.
fn lit(shape: &str, rest: &str) -> String {
    format!(
        r#"{{"type": "scene", {rest},
        "light": {{{shape}, "emitter": {{"type": "directionalarea", "radiance": {IRRADIANCE}}}}},
        "floor": {{"type": "rectangle", "to_world": [{{"scale": [4, 4, 1]}}],
          "bsdf": {{"type": "diffuse", "reflectance": {ALBEDO}}}, "sensor": {{"type": "irradiancemeter"}}}}}}"#
    )
}

/// Lights of which the second faces down by its normals, with their areas.
fn lights() -> [(&'static str, f64); 3] {
    [
        (
            r#""type": "rectangle", "to_world": [{"scale": [0.5, 0.3, 1]}, {"rotate": {"axis": [1, 0, 0], "angle": 180}},
               {"rotate": {"axis": [0, 0, 1], "angle": 25}}, {"translate": [0, 0, 2]}]"#,
            0.6,
        ),
        (
            r#""type": "rectangle", "flip_normals": true, "to_world": [{"scale": [-0.5, 0.3, 2]}, {"translate": [0, 0, 2]}]"#,
            0.6,
        ),
        (
            r#""type": "disk", "to_world": [{"scale": 0.4}, {"rotate": {"axis": [0, 1, 0], "angle": 180}}, {"translate": [0, 0, 2]}]"#,
            PI * 0.16,
        ),
    ]
}

/// A camera that sees the floor within 0.07 of a point, from the side.
fn camera(x: f64) -> String {
    format!(
        r#""sensor": {{"type": "orthographic",
        "to_world": [{{"scale": 0.02}}, {{"lookat": {{"origin": [{x}, -3, 1], "target": [{x}, 0, 0], "up": [0, 0, 1]}}}}],
        "film": {{"type": "hdrfilm", "width": 2, "height": 2, "rfilter": {{"type": "box"}}}}}}"#
    )
}

#[test]
fn the_floor_below_the_light_reflects_its_irradiance() {
    let expected = ALBEDO * IRRADIANCE / PI;
    let mut zs = Vec::new();
    for (shape, _) in lights() {
        for (integrator, samples) in [("path", 16), ("bdpt", 4000), ("particle", 20_000)] {
            for (x, expected) in [(0.0, expected), (1.0, 0.0)] {
                let integrator =
                    format!(r#""integrator": {{"type": "{integrator}", "max_depth": 2}}"#);
                let rest = format!("{integrator}, {}", camera(x));
                let text =
                    lit(shape, &rest).replace(r#", "sensor": {"type": "irradiancemeter"}"#, "");
                let loaded = load(&text).unwrap_or_else(|e| panic!("{e}"));
                let run = Run {
                    total: Some(samples),
                    ..Run::new(&loaded)
                };
                let (mean, error) = run.render().unwrap().film.summary();
                if samples == 16 || expected == 0.0 {
                    assert!(
                        (mean - expected).abs() <= ROUNDING,
                        "{mean} in place of {expected}: {text}"
                    );
                } else {
                    zs.push((mean - expected) / error);
                }
            }
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

#[test]
fn all_light_arrives_on_the_floor() {
    for (shape, area) in lights() {
        let text = lit(shape, r#""integrator": {"type": "particle"}"#);
        let text = text.replace(&format!("\"reflectance\": {ALBEDO}"), "\"reflectance\": 0");
        let loaded = load(&text).unwrap_or_else(|e| panic!("{e}"));
        let meters: Vec<Meter> = loaded.instruments.iter().map(|i| i.meter.clone()).collect();
        let options = MeasureOptions {
            first: 0,
            particles: 1000,
            seed: 1,
            max_depth: None,
            rr_depth: 5,
        };
        let go_on = |_| ControlFlow::Continue(());
        let found = measure(&loaded.groups, &meters, &options, &Handle::default(), go_on).unwrap();
        let power = IRRADIANCE * area;
        for found in [found.emitted[0], found.balance.surfaces.mean] {
            assert!(
                (found / power - 1.0).abs() < ROUNDING,
                "{found} in place of {power}: {text}"
            );
        }
    }
}

/// The shape of a light without a bsdf is black, and only its front shines: an observer between the
/// light and the floor sees nothing above.
#[test]
fn no_ray_sees_the_light() {
    let (shape, _) = lights()[0];
    let upwards = r#""integrator": {"type": "path"}, "sensor": {"type": "orthographic",
        "to_world": [{"scale": 0.1}, {"translate": [0, 0, 1]}],
        "film": {"type": "hdrfilm", "width": 2, "height": 2, "rfilter": {"type": "box"}}}"#;
    let text = lit(shape, upwards).replace(r#", "sensor": {"type": "irradiancemeter"}"#, "");
    let loaded = load(&text).unwrap_or_else(|e| panic!("{e}"));
    let run = Run {
        total: Some(16),
        ..Run::new(&loaded)
    };
    assert_eq!(run.render().unwrap().film.summary().0, 0.0);
}

#[test]
fn shapes_without_one_direction_are_refused() {
    let sheared =
        r#""type": "rectangle", "to_world": [{"matrix": [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]}]"#;
    let ellipse = r#""type": "disk", "to_world": [{"scale": [1, 2, 1]}]"#;
    for shape in [r#""type": "sphere""#, sheared, ellipse] {
        let message = load(&lit(shape, r#""integrator": {"type": "path"}"#)).unwrap_err();
        assert!(
            message.contains("a 'rectangle' with right angles or a round 'disk'"),
            "{message}"
        );
    }
    let alone = r#"{"type": "scene", "e": {"type": "directionalarea"}}"#;
    let message = load(alone).unwrap_err();
    assert!(
        message.contains("'directionalarea' belongs inside the shape"),
        "{message}"
    );
}
