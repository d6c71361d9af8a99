//! Irradiance meters with bins of position on the faces of labels.
//!
//! False alarms: 1e-3 for each test. Seeds are fixed.

use crate::common::{load_json, measure_json};
use serde_json::{Value, json};
use testkit::z_test::{max_abs_z, two_sample_z};
use transport::meter::Reading;
use transport::render::Measurement;

const FAMILY: f64 = 1e-3;

fn reading<'a>(found: &'a Measurement, name: &str) -> &'a Reading {
    let mut all = found.readings[0].iter();
    all.find(|r| r.name == name)
        .expect("the meter has this reading")
}

/// A block of one label measures what a cube with the same meter measures, on all sides.
#[test]
fn faces_of_a_block_are_the_sides_of_a_cube() {
    let tissue = json!({"type": "homogeneous", "sigma_s": 1.5, "sigma_a": 0.2, "ior": 1.4});
    let meter = json!({"type": "irradiancemeter", "nu": 3, "nv": 2, "parts": true});
    let place = json!([
        {"scale": [3, 2.5, 4]}, {"rotate": {"axis": [1, 2, 3], "angle": 40}}, {"translate": [0.5, -0.2, 0.1]},
    ]);
    let mut placed_cube = vec![json!({"translate": [1, 1, 1]}), json!({"scale": 0.5})];
    placed_cube.extend(place.as_array().unwrap().iter().cloned());
    let scene = |body: Value| {
        json!({
            "type": "scene", "integrator": {"type": "particle"}, "body": body,
            "light": {"type": "point", "position": [1.0, 0.5, 2.0], "intensity": 1.0},
        })
    };
    let labels = scene(json!({
        "type": "labels", "data": vec![vec![vec![1; 4]; 3]; 5], "to_world": place, "1": tissue, "meter": meter,
    }));
    let cube = scene(json!({
        "type": "cube", "to_world": placed_cube, "interior": tissue,
        "bsdf": {"type": "dielectric", "int_ior": 1.4, "ext_ior": 1.0}, "meter": meter,
    }));
    let [found, expected] = [
        measure_json(&labels, 20_000, 1),
        measure_json(&cube, 20_000, 2),
    ];
    let mut zs = Vec::new();
    for name in ["binned_power", "irradiance"] {
        let [a, b] = [reading(&found, name), reading(&expected, name)];
        assert_eq!((a.mean.len(), b.mean.len()), (2 * 6 * 3 * 2, 2 * 6 * 3 * 2));
        let bins = 0..a.mean.len();
        let lit = bins.filter(|i| !(a.few[*i] || b.few[*i]));
        zs.extend(lit.map(|i| two_sample_z(a.mean[i], a.error[i], b.mean[i], b.error[i])));
    }
    assert!(zs.len() > 60, "{}", zs.len());
    max_abs_z(&zs, FAMILY).unwrap();
}

/// Parallel light of irradiance 1 along z passes a clear body with steps. It has the irradiance 1
/// on all faces across z, for bins that cut voxels, and 0 on all others.
#[test]
fn areas_are_those_of_the_faces_in_each_bin() {
    // A stair with a hole of label 0 inside.
    let plane = |rows: [[u32; 3]; 3]| rows.map(Vec::from).to_vec();
    let data = vec![
        plane([[0, 0, 1], [0, 0, 1], [0, 1, 1]]),
        plane([[0, 1, 1], [0, 0, 2], [0, 2, 2]]),
        plane([[1, 1, 1], [1, 1, 2], [1, 2, 2]]),
    ];
    let scene = json!({
        "type": "scene", "integrator": {"type": "particle"},
        "sun": {
            "type": "collimated", "radius": 5, "irradiance": 1.0,
            "to_world": [{"translate": [1.5, 1.5, -4]}],
        },
        "stair": {
            "type": "labels", "data": data, "to_world": [{"scale": [3, 3, 6]}],
            "1": {"type": "transparent", "ior": 1.0}, "2": {"type": "transparent", "ior": 1.0},
            "meter": {"type": "irradiancemeter", "nu": 2, "nv": 4, "parts": true},
        },
    });
    let found = measure_json(&scene, 20_000, 4);
    let irradiance = reading(&found, "irradiance");
    let bins = 2 * 4;
    let mut zs = Vec::new();
    for side in 0..2 {
        for part in 0..6 {
            for bin in 0..bins {
                let i = (side * 6 + part) * bins + bin;
                // Light enters (side 1) faces that point to −z, and leaves faces that point to +z.
                let is_lit = [(1, 4), (0, 5)].contains(&(side, part));
                if is_lit {
                    zs.push((irradiance.mean[i] - 1.0) / irradiance.error[i]);
                } else {
                    assert_eq!(irradiance.mean[i], 0.0, "side {side} part {part} bin {bin}");
                }
            }
        }
    }
    assert_eq!(zs.len(), 2 * bins);
    max_abs_z(&zs, FAMILY).unwrap();
}

#[test]
fn smooth_surfaces_have_no_coordinates() {
    let scene = json!({
        "type": "scene", "integrator": {"type": "particle"},
        "light": {"type": "point", "position": [0, 0, -4], "intensity": 1.0},
        "body": {
            "type": "labels", "data": vec![vec![vec![1; 4]; 4]; 4], "surface": "smooth",
            "1": {"type": "homogeneous", "sigma_s": 1.0, "sigma_a": 0.1, "ior": 1.4},
            "meter": {"type": "irradiancemeter", "nu": 2},
        },
    });
    let refused = load_json(&scene).expect_err("an error").to_string();
    assert!(
        refused.contains("set 'surface' of the labels to 'voxels'"),
        "{refused}"
    );
}
