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
    // From the centre, where n = √2, x(σ) = x₀ cos σ + v₀ sin σ: x = √2 sin σ, J = n² sin² σ.
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
fn a_search_without_a_result_fails() {
    for all in ["", " --all"] {
        let command = format!("connect scene.xml --from 1,1,1 --to 1,1,1{all}");
        let outcome = Folder::with_fog().run(&command);
        assert_eq!(outcome.status, Some(1));
        let answer: Value = serde_json::from_str(&outcome.stdout).unwrap();
        assert_eq!(branches(&answer).len(), 0);
        assert_eq!(answer["failure"], "the two points coincide");
        let error = "error: found no ray between the two points: the two points coincide";
        assert_eq!(outcome.stderr.trim(), error);
    }
}

/// A unit ball of glass around the origin.
const BALL: &str = r#"<shape type="sphere"><bsdf type="dielectric">
    <float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/>
  </bsdf></shape>"#;

fn branches(answer: &Value) -> &Vec<Value> {
    answer["branches"].as_array().unwrap()
}

#[test]
fn all_branches_behind_a_ball_of_glass_are_listed() {
    let folder = Folder::with_scene(BALL);
    // Rays at the rim meet the axis at 1.35, rays close to it at 2.4. Between these distances both
    // arrive, from either side.
    let points = "--from=0,0,-4 --to 0.02,0,1.9";
    let only = connect(&folder, points);
    let all = connect(&folder, &format!("{points} --all"));
    assert_eq!(branches(&only).len(), 1);
    assert_eq!(branches(&all).len(), 3);
    let primary: Vec<&Value> = branches(&all)
        .iter()
        .filter(|b| b["primary"] == true)
        .collect();
    assert_eq!(primary, [&branches(&only)[0]]);
    for key in ["failure", "occluded", "certified_unique"] {
        assert_eq!(all[key], only[key]);
    }
    let lengths: Vec<f64> = branches(&all)
        .iter()
        .map(|b| b["optical_length"].as_f64().unwrap())
        .collect();
    assert!(lengths.is_sorted());
    for branch in branches(&all) {
        assert_eq!(branch["reflections"], 0);
        assert_eq!(branch["occluded"], false);
        assert!(branch["direction_out"][1].as_f64().unwrap().abs() < 1e-6);
    }
}

#[test]
fn reflections_are_followed_on_request_and_weighted_by_fresnel() {
    let folder = Folder::with_scene(BALL);
    // Straight back off the near side (0.04), and off the far side (0.96² × 0.04).
    let points = "--from=0.001,0,-4 --to 0,0,-3";
    let none = connect(&folder, &format!("{points} --all"));
    assert_eq!(branches(&none).len(), 1);
    let one = connect(&folder, &format!("{points} --all --reflections 1"));
    let transmittances: Vec<f64> = branches(&one)
        .iter()
        .filter(|b| b["reflections"] == 1 && b["arc_length"].as_f64().unwrap() < 9.01)
        .map(|b| b["transmittance"][0].as_f64().unwrap())
        .collect();
    assert_eq!(transmittances.len(), 2, "{one:#}");
    for (found, expected) in transmittances.iter().zip([0.04, 0.96 * 0.04 * 0.96]) {
        assert!((found - expected).abs() < 1e-5, "{found} {expected}");
    }
}

#[test]
fn each_branch_has_its_own_occlusion() {
    // A small screen blocks only rays close to the axis.
    let folder = Folder::with_scene(&format!(
        r#"{BALL}<shape type="disk">
          <transform name="to_world"><scale value="0.05"/><translate x="0.02" z="1.7"/></transform>
        </shape>"#
    ));
    let answer = connect(&folder, "--from=0,0,-4 --to 0.02,0,1.9 --all");
    let blocked: Vec<bool> = branches(&answer)
        .iter()
        .map(|b| b["occluded"].as_bool().unwrap())
        .collect();
    assert_eq!(blocked.iter().filter(|b| **b).count(), 1, "{answer:#}");
}

#[test]
fn a_certified_pair_has_one_branch() {
    let answer = connect(&Folder::with_fog(), "--from=-0.3,0,0 --to 0.3,0.4,0 --all");
    assert_eq!(answer["certified_unique"], true);
    assert_eq!(branches(&answer).len(), 1);
    assert_eq!(branches(&answer)[0]["primary"], true);
}

/// No ray from a point near the centre of a glass ball is totally reflected. Without other
/// reflections, one ray leads to any other point.
#[test]
fn pairs_within_a_ball_are_certified_but_for_reflections() {
    let folder = Folder::with_scene(BALL);
    let ends = "--from 0,0,0.1 --to 0.5,0,0.2 --all";
    let refracted = connect(&folder, ends);
    assert_eq!(refracted["certified_unique"], true);
    assert_eq!(branches(&refracted).len(), 1);
    let reflected = connect(&folder, &format!("{ends} --reflections 1"));
    assert_eq!(reflected["certified_unique"], false);
    assert!(branches(&reflected).len() > 1);
}

#[test]
fn reflections_are_part_of_the_search_for_all() {
    let folder = Folder::with_fog();
    let points = "connect scene.xml --from 0,0,0 --to 0.3,0,0";
    for bad in [
        "--reflections 1",
        "--all --reflections 9",
        "--all --reflections -1",
    ] {
        folder.refuse(&format!("{points} {bad}"));
    }
}
