//! Scenes without their flow: the undisturbed index of media with a varying index.

use glam::DVec3;
use morgana_io::{Diagnostics, LoadOptions, Loaded, json};

/// A scene of parts, with light of 450 and 650 nm.
fn load(parts: &str, undisturbed: bool) -> Loaded {
    let text = format!(
        r#"{{"type": "scene", {parts}, "sky": {{"type": "constant"}}, "sensor": {{
            "type": "perspective", "fov": 40, "to_world": [{{"translate": [0, 0, -9]}}],
            "film": {{"type": "hdrfilm", "pixel_format": "spectral", "wavelengths": "450, 650"}}
        }}}}"#
    );
    let mut diagnostics = Diagnostics::new();
    let description = json::parse(&text, "scene.json", &[], &mut diagnostics);
    let description = description.unwrap_or_else(|| panic!("{diagnostics}\n{text}"));
    let options = LoadOptions {
        undisturbed,
        ..LoadOptions::default()
    };
    morgana_io::assemble(&description, &options, diagnostics).unwrap()
}

/// Index of a medium at two positions, at the first and the second wavelength.
fn indices(loaded: &Loaded, name: &str) -> [[f64; 2]; 2] {
    let scenes = &loaded.groups;
    [0, 1].map(|group| {
        let media = scenes[group.min(scenes.len() - 1)].media();
        let medium = media.iter().find(|medium| medium.name == name).unwrap();
        [DVec3::ZERO, DVec3::new(0.3, 0.1, -0.2)].map(|x| medium.index.n(x))
    })
}

/// A box of a medium with this index.
fn tank(bsdf: &str, ior: &str) -> String {
    format!(
        r#""tank": {{"type": "cube", "bsdf": {{"type": "{bsdf}"}}, "interior": {{"type": "transparent", "id": "flow", "ior": {ior}}}}}"#
    )
}

const PLUME: &str = r#"{"type": "expression", "n": "1.33 + 0.002*exp(-r^2/0.02)"}"#;

#[track_caller]
fn still(parts: &str, expected: [f64; 2], tolerance: f64) {
    let [disturbed, loaded] = [false, true].map(|undisturbed| load(parts, undisturbed));
    assert!(disturbed.hash != loaded.hash);
    for (found, expected) in indices(&loaded, "flow").into_iter().zip(expected) {
        assert_eq!(found[0], found[1]);
        assert!((found[0] - expected).abs() < tolerance, "{found:?}");
    }
}

/// Formulas and samples do not define the undisturbed index. It is the mean over the surface, if
/// the surface refracts.
#[test]
fn tanks_keep_the_index_at_their_walls() {
    still(&tank("dielectric", PLUME), [1.33; 2], 1e-9);
    let slope = r#"{"type": "linear", "n0": 1.4, "slope": [0.01, 0, 0]}"#;
    still(&tank("dielectric", slope), [1.4; 2], 1e-3);
}

/// It is the surrounding index, if the surface does not refract.
#[test]
fn flows_keep_the_index_around() {
    for bsdf in ["null", "thindielectric"] {
        let flow = tank(bsdf, &PLUME.replace("1.33", "1.331"));
        let water = format!(
            r#"{flow}, "water": {{"type": "sphere", "radius": 4, "bsdf": {{"type": "dielectric"}},
            "interior": {{"type": "transparent", "id": "outer", "ior": 1.33}}}}"#
        );
        still(&water, [1.33; 2], 1e-12);
    }
    still(
        &tank("null", &PLUME.replace("1.33", "1.0")),
        [1.0; 2],
        1e-12,
    );
}

/// Flows within a law of dispersion are removed; the law stays.
#[test]
fn dispersion_stays() {
    let law = |nm: f64| 1.33 + 0.01 / (nm * 1e-3_f64).powi(2);
    let expected = [450.0, 650.0].map(|nm| law(nm) / law(550.0) * 1.4);
    let cauchy = |nested: &str| {
        format!(
            r#"{{"type": "cauchy", "a": 1.33, "b": 0.01, "reference_wavelength": 550, "flow": {nested}}}"#
        )
    };
    let told = r#"{"type": "gaussian", "n0": 1.4, "delta": 0.002, "width": 0.3}"#;
    still(&tank("dielectric", &cauchy(told)), expected, 1e-12);
    let formula = PLUME.replace("1.33", "1.4");
    still(&tank("dielectric", &cauchy(&formula)), expected, 1e-9);
}
