//! `morgana connect`.

use crate::support::Folder;
use serde_json::Value;

fn connect(folder: &Folder, points: &str) -> Value {
    serde_json::from_str(&folder.succeed(&format!("connect scene.xml {points}"))).unwrap()
}

fn close(value: &Value, expected: f64) {
    let value = value.as_f64().unwrap();
    assert!(
        (value - expected).abs() <= 1e-6 * expected.abs().max(1.0),
        "{value} != {expected}"
    );
}

#[test]
fn straight_rays_have_the_jacobian_of_distance_squared() {
    let answer = connect(&Folder::with_fog(), "--from=-0.3,0,0 --to 0.3,0.4,0");
    assert_eq!(answer["branches"].as_array().unwrap().len(), 1);
    let (branch, d) = (&answer["branches"][0], 0.52f64.sqrt());
    close(&branch["jacobian"], 0.52);
    close(&branch["arc_length"], d);
    close(&branch["optical_length"], d);
    assert_eq!(branch["transmittance"].as_array().unwrap().len(), 3);
    close(&branch["transmittance"][0], (-0.5 * d).exp());
    for end in ["direction_out", "direction_in"] {
        close(&branch[end][0], 0.6 / d);
        close(&branch[end][1], 0.4 / d);
    }
    assert_eq!(answer["certified_unique"], true);
    assert_eq!(answer["occluded"], false);
    assert!(answer["failure"].is_null());
}

#[test]
fn rays_of_a_luneburg_lens_are_harmonic() {
    // x(σ) = x₀ cos σ + v₀ sin σ from the centre, where n = √2: x = √2 sin σ, J = n² sin² σ.
    let answer = connect(&Folder::with_lens(), "--from 0,0,0 --to 0.6,0,0");
    let branch = &answer["branches"][0];
    close(&branch["jacobian"], 0.36);
    close(&branch["arc_length"], 0.6);
    let sigma = (0.6 / 2f64.sqrt()).asin();
    close(&branch["optical_length"], sigma + 0.5 * (2.0 * sigma).sin());
    assert_eq!(answer["certified_unique"], false);
}

#[test]
fn glass_takes_what_fresnel_says() {
    let folder = Folder::with_scene(
        r#"<shape type="cube"><bsdf type="dielectric">
             <float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/>
           </bsdf></shape>"#,
    );
    let answer = connect(&folder, "--from 0,0,-3 --to 0,0,0");
    close(&answer["branches"][0]["transmittance"][1], 0.96);
    close(&answer["branches"][0]["optical_length"], 3.5);
    assert_eq!(answer["certified_unique"], false);
}

#[test]
fn obstacles_are_reported() {
    let folder = Folder::with_scene(r#"<shape type="sphere"/>"#);
    let answer = connect(&folder, "--from=-3,0,0 --to 3,0,0");
    assert_eq!(answer["occluded"], true);
    close(&answer["branches"][0]["arc_length"], 6.0);
}

#[test]
fn no_ray_is_an_answer() {
    let answer = connect(&Folder::with_fog(), "--from 1,1,1 --to 1,1,1");
    assert_eq!(answer["branches"].as_array().unwrap().len(), 0);
    assert_eq!(answer["failure"], "the two points coincide");
}
