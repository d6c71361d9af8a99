//! Indices derived from densities and pressures.

use glam::DVec3;
use morgana_io::{LoadOptions, Loaded};
use std::path::Path;

const SENSOR: &str = r#"<sensor type="perspective"><float name="fov" value="40"/>
  <transform name="to_world"><lookat origin="0, 0, 40" target="0, 0, 0" up="0, 1, 0"/></transform>
</sensor><emitter type="constant"/>"#;

/// A scene of one medium with the given `ior`, among the volumes of `data/volumes`.
fn load(ior: &str) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().unwrap();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/volumes");
    for name in ["kwave.h5", "ascii.vti", "cells.vti", "two.vti"] {
        std::fs::copy(data.join(name), folder.path().join(name)).unwrap();
    }
    let path = folder.path().join("scene.xml");
    let text = format!(
        r#"<scene version="3.0.0">{SENSOR}<shape type="sphere"><float name="radius" value="3"/>
           <bsdf type="null"/><medium type="transparent" name="interior">{ior}</medium></shape></scene>"#
    );
    std::fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

/// A volume as `ior`, with parameters `name=value` in the given tags.
fn ior(plugin: &str, parameters: &[(&str, &str, &str)]) -> String {
    let parameter = |(tag, name, value): &(&str, &str, &str)| {
        format!(r#"<{tag} name="{name}" value="{value}"/>"#)
    };
    let parameters: String = parameters.iter().map(parameter).collect();
    format!(r#"<volume name="ior" type="{plugin}">{parameters}</volume>"#)
}

#[track_caller]
fn n(loaded: &Loaded, x: [f64; 3]) -> f64 {
    loaded.scene().medium(1).index.n(DVec3::from_array(x))
}

#[track_caller]
fn refused(ior: &str, expected: &str) {
    let message = load(ior).expect_err("the scene was accepted");
    assert!(
        message.contains(expected),
        "expected {expected:?} in:\n{message}"
    );
}

const KWAVE: [(&str, &str, &str); 4] = [
    ("string", "filename", "kwave.h5"),
    ("string", "dataset", "p_final"),
    ("string", "axis_order", "zyx"),
    ("string", "placement", "nodes"),
];

fn with<'a>(
    base: &[(&'a str, &'a str, &'a str)],
    more: &[(&'a str, &'a str, &'a str)],
) -> Vec<(&'a str, &'a str, &'a str)> {
    [base, more].concat()
}

#[test]
fn pressures_of_k_wave_become_indices() {
    let law = [
        ("float", "n0", "1.33"),
        ("float", "dn_dp", "1.4e-10"),
        ("float", "scale", "1e5"),
    ];
    let loaded = load(&ior("pressure", &with(&KWAVE, &law))).unwrap();
    // Samples of x + 10 y + 100 z lie on the unit cube's corners; n² − n_ref² has single precision.
    let expected = |p: f64| 1.33 + 1.4e-5 * p;
    assert!((n(&loaded, [0.0, 0.0, 0.0]) - expected(0.0)).abs() < 1e-8);
    assert!((n(&loaded, [1.0, 0.0, 0.0]) - expected(1.0)).abs() < 1e-8);
    assert!((n(&loaded, [0.0, 0.5, 1.0 / 3.0]) - expected(110.0)).abs() < 1e-8);
    assert!((n(&loaded, [1.0, 1.0, 1.0]) - expected(321.0)).abs() < 1e-8);
    // Turn off the sound.
    let silent = [law[0], law[1], ("float", "scale", "0")];
    let loaded = load(&ior("pressure", &with(&KWAVE, &silent))).unwrap();
    assert!(loaded.scene().is_straight());
}

#[test]
fn densities_of_vtk_become_indices_where_the_file_says() {
    let vti = ("string", "filename", "ascii.vti");
    let constant = [
        vti,
        ("float", "constant", "2.3e-4"),
        ("float", "reference", "100"),
    ];
    let loaded = load(&ior("gladstone_dale", &constant)).unwrap();
    let expected = |rho: f64| 1.0 + 2.3e-4 * (rho - 100.0);
    // The first and the last sample: see volumes_of_others.rs.
    assert!((n(&loaded, [0.8, -1.0, 1.6]) - expected(0.0)).abs() < 1e-8);
    assert!((n(&loaded, [0.9, -0.6, 2.8]) - expected(321.0)).abs() < 1e-8);
    // With a wavelength: K of air at 567.7 nm is 2.264e-4, to 1e-3.
    let air = [
        vti,
        ("float", "wavelength", "567.7"),
        ("float", "scale", "0.1"),
    ];
    let loaded = load(&ior("gladstone_dale", &air)).unwrap();
    let k = (n(&loaded, [0.9, -0.6, 2.8]) - 1.0) / 32.1;
    assert!((k / 2.264e-4 - 1.0).abs() < 1e-3, "{k}");
}

#[test]
fn sound_by_its_pressure() {
    let mode = |amplitude: &[(&'static str, &'static str, &'static str)]| {
        let base = [("float", "n0", "1.33"), ("float", "wave_number", "2")];
        load(&ior("acoustic", &with(&base, amplitude)))
    };
    let by_pressure = [("float", "pressure", "1e6"), ("float", "dn_dp", "1.4e-10")];
    let a = mode(&by_pressure).unwrap();
    let b = mode(&[("float", "amplitude", "1.4e-4")]).unwrap();
    for x in [[0.0; 3], [0.4, -0.2, 0.3]] {
        assert!((n(&a, x) - n(&b, x)).abs() < 1e-15);
    }
    let both = with(&by_pressure, &[("float", "amplitude", "1e-4")]);
    let message = mode(&both).unwrap_err();
    assert!(message.contains("not both"), "{message}");
}

#[test]
fn mistakes_are_named() {
    let law = [("float", "n0", "1.33"), ("float", "dn_dp", "1.4e-10")];
    let pressure = |base: &[_], more: &[_]| ior("pressure", &with(&with(base, &law), more));
    let without = |i: usize| {
        let mut base = KWAVE.to_vec();
        base.remove(i);
        pressure(&base, &[])
    };
    refused(
        &without(1),
        "(--dataset, or 'dataset' in a scene); datasets of '/': Nt, hole, p_final, p_max",
    );
    refused(&without(2), "give the order of its axes");
    refused(&without(3), "needs 'placement'");
    let hole = [KWAVE[0], ("string", "dataset", "hole"), KWAVE[2], KWAVE[3]];
    refused(
        &pressure(&hole, &[]),
        "value NaN at voxel (0, 1, 2) is not finite",
    );
    // Wrong units: megapascal for pascal in dn/dp, and a file in unexpected units.
    let units = [law[0], ("float", "dn_dp", "1.4e-4")];
    refused(
        &ior("pressure", &with(&KWAVE, &units)),
        "'dn_dp' is 0.00014 but must be",
    );
    let scale = [("float", "scale", "-1e9")];
    refused(&pressure(&KWAVE, &scale), "check the units of the file");
    let vti = [("string", "filename", "ascii.vti")];
    refused(&ior("gladstone_dale", &vti), "needs a 'wavelength' in nm");
    let twice = [
        vti[0],
        ("string", "placement", "centers"),
        ("float", "constant", "1e-4"),
    ];
    refused(&ior("gladstone_dale", &twice), "leave 'placement' out");
    let order = [vti[0], KWAVE[2], ("float", "constant", "1e-4")];
    refused(&ior("gladstone_dale", &order), "has its own");
    let two = [
        ("string", "filename", "two.vti"),
        ("float", "constant", "1e-4"),
    ];
    refused(&ior("gladstone_dale", &two), "the arrays: density, other");
}

fn example(name: &str, strength: &str) -> Loaded {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let options = LoadOptions {
        defines: vec![("strength".into(), strength.into())],
        ..LoadOptions::default()
    };
    morgana_io::load_scene(&path.join(name), &options).unwrap_or_else(|d| panic!("{d}"))
}

/// The jet can be turned off, and its index matches the surrounding air: no scene has a warning.
#[test]
fn jets_on_and_off() {
    for name in ["schlieren_jet.xml", "bos_jet.xml"] {
        let on = example(name, "1");
        assert!(on.warnings.is_empty(), "{}", on.warnings);
        assert!(!on.scene().is_straight());
        assert!(example(name, "0").scene().is_straight());
    }
}

#[test]
fn knife_edges_that_are_refused() {
    let load = |parameters: &str| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.xml");
        let text = format!(
            r#"<scene version="3.0.0"><sensor type="telecentric">{parameters}</sensor>
               <emitter type="constant"/></scene>"#
        );
        std::fs::write(&path, text).unwrap();
        morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
    };
    let angle = r#"<float name="acceptance_angle" value="1"/>"#;
    assert!(load(angle).is_ok());
    let refused = |more: &str, expected: &str| {
        let message = load(&format!("{angle}{more}")).unwrap_err();
        assert!(message.contains(expected), "{message}");
    };
    let knife = r#"<float name="knife_angle" value="-1"/>"#;
    refused(knife, "a knife needs a vector 'knife_edge'");
    let edge = r#"<vector name="knife_edge" x="1"/>"#;
    refused(&format!("{edge}{knife}"), "greater than -1 and at most 1");
    refused(r#"<vector name="knife_edge" z="1"/>"#, "across the axis");
}
