//! Power emitted by media, compared with closed forms: 4π·emission·σ_a·V where the index is 1.

use morgana_io::LoadOptions;
use std::f64::consts::PI;
use std::fs;
use transport::Spectrum;

/// Absorption coefficient of the media.
const SIGMA_A: f64 = 0.7;
const MEDIUM: &str = r#""type": "homogeneous", "sigma_a": 0.7, "sigma_s": 0.1, "emission": 2.0"#;
const NULL: &str = r#""bsdf": {"type": "null"}"#;

/// Returns the volume of a medium of [`SIGMA_A`] and emission 2 that would emit as much as a scene
/// of these parts, and its standard error.
fn volume(parts: &str) -> [f64; 2] {
    let text = format!(
        r#"{{"type": "scene", "integrator": {{"type": "particle"}}, {parts},
        "m": {{"type": "fluencemeter", "nx": 1, "ny": 1, "nz": 1}}}}"#
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.json");
    fs::write(&path, &text).unwrap();
    let loaded = morgana_io::load_scene(&path, &LoadOptions::default());
    let loaded = loaded.unwrap_or_else(|d| panic!("{d}\n{text}"));
    let scene = loaded.scene();
    let emitters = scene.emitters().iter();
    let shape = |object: usize| &scene.objects()[object].shape;
    let power = emitters.fold(Spectrum::ZERO, |sum, e| {
        sum + e.power(scene.around(), shape)
    });
    [power, scene.power_error(1)].map(|p| p[0] / (4.0 * PI * 2.0 * SIGMA_A))
}

fn ball(center: [f64; 3], radius: f64, interior: &str) -> String {
    format!(
        r#"{{"type": "sphere", "center": {center:?}, "radius": {radius}, {NULL}, "interior": {interior}}}"#
    )
}

#[test]
fn simple_regions_emit_exactly() {
    let medium = format!("{{{MEDIUM}}}");
    let clear = r#"{"type": "transparent", "ior": 1}"#;
    let turned = r#"{"rotate": {"axis": [1, 2, 3], "angle": 40}}, {"translate": [3, 1, -2]}"#;
    let body = |shape: &str| format!(r#""b": {{{shape}, {NULL}, "interior": {medium}}}"#);
    let tetrahedron = r#""type": "mesh", "vertex_positions": [[0,0,0],[3,0,0],[0,2,0],[0,0,1]], "faces": [[0,2,1],[0,1,3],[0,3,2],[1,2,3]]"#;
    let unit = 4.0 / 3.0 * PI;
    let shared = format!(
        r#""a": {}, "c": {}"#,
        ball(
            [0.0, 0.0, 0.0],
            0.05,
            &format!(r#"{{{MEDIUM}, "id": "hot"}}"#)
        ),
        ball([9.0, 8.0, 7.0], 0.02, r#"{"type": "ref", "id": "hot"}"#)
    );
    let cases = [
        (
            "ball",
            format!(r#""b": {}"#, ball([1.0, 2.0, 3.0], 1.0, &medium)),
            unit,
        ),
        (
            "box",
            body(&format!(
                r#""type": "cube", "to_world": [{{"scale": [1, 2, 0.3]}}, {turned}]"#
            )),
            4.8,
        ),
        (
            "cylinder",
            body(
                r#""type": "cylinder", "capped": true, "p0": [0, 0, 0], "p1": [1, 2, 2], "radius": 0.5"#,
            ),
            0.75 * PI,
        ),
        ("tetrahedron", body(tetrahedron), 1.0),
        (
            "hollow ball",
            format!(
                r#""b": {}, "h": {}"#,
                ball([0.0; 3], 1.0, &medium),
                ball([0.3, 0.0, 0.0], 0.5, clear)
            ),
            0.875 * unit,
        ),
        ("specks", shared, (0.05f64.powi(3) + 0.02f64.powi(3)) * unit),
    ];
    for (name, parts, exact) in cases {
        let [volume, error] = volume(&parts);
        let off = volume / exact - 1.0;
        assert!(
            off.abs() < 1e-12 && error == 0.0,
            "{name}: off by {off:e}, error {error}"
        );
    }
}

/// Two overlapping balls: their common lens counts once.
#[test]
fn overlapping_regions_are_estimated_within_their_error() {
    let medium = format!(r#"{{{MEDIUM}, "id": "hot"}}"#);
    let parts = format!(
        r#""a": {}, "b": {}"#,
        ball([0.0; 3], 1.0, &medium),
        ball([1.0, 0.0, 0.0], 1.0, r#"{"type": "ref", "id": "hot"}"#)
    );
    let exact = 8.0 / 3.0 * PI - 5.0 / 12.0 * PI;
    let [volume, error] = volume(&parts);
    assert!(error > 0.0 && error < 1e-2 * exact, "{error}");
    let z = (volume - exact) / error;
    assert!(z.abs() < 4.0, "{volume} ± {error} in place of {exact}");
}
