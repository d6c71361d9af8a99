//! Suspensions of spheres by scene files: coefficients, and refused parameters.

use glam::DVec3;
use morgana_io::{LoadOptions, Loaded};
use std::fs;
use transport::phase::{Mie, Spheres};

const SPHERES: &str = r#"<float name="radius" value="0.5"/><spectrum name="eta" value="500:1.6, 700:1.58"/>
<spectrum name="ext_eta" value="1.333"/>"#;
const SPECTRAL: &str = r#"<string name="pixel_format" value="spectral"/><string name="wavelengths" value="500, 600"/>"#;

/// A ball with parameters of a medium and of its spheres.
fn load(film: &str, medium: &str, spheres: &str) -> Result<Loaded, String> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scene.xml");
    let text = format!(
        r#"<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="40"/><film type="hdrfilm">
<integer name="width" value="4"/><integer name="height" value="4"/>{film}</film></sensor>
<emitter type="constant"/>
<shape type="sphere"><point name="center" z="5"/><bsdf type="null"/><medium name="interior" type="homogeneous">{medium}
<phase type="mie">{spheres}</phase></medium></shape></scene>"#
    );
    fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

fn float(name: &str, value: f64) -> String {
    format!(r#"<float name="{name}" value="{value}"/>"#)
}

fn mie(n: f64, nm: f64) -> Mie {
    Mie::new(&Spheres {
        radius: 0.5,
        geometric_deviation: 1.0,
        n,
        k: 0.0,
        exterior: 1.333,
        wavelength: 1e-3 * nm,
    })
    .unwrap()
}

/// σ_s, σ_a and g of each group of channels.
fn medium(loaded: &Loaded) -> Vec<[f64; 3]> {
    let center = DVec3::Z * 5.0;
    let of = |scene: &transport::Scene| {
        let medium = scene.medium(scene.medium_at(center));
        let [t, s] = [medium.extinction(center)[0], medium.scattering(center)[0]];
        [s, t - s, medium.phase.mean_cosine(center).unwrap()]
    };
    loaded.groups.iter().map(of).collect()
}

fn assert_close(found: f64, expected: f64) {
    assert!(
        (found - expected).abs() <= 1e-12 * expected.abs().max(1.0),
        "{found} {expected}"
    );
}

#[test]
fn coefficients_are_those_of_spheres_at_each_wavelength() {
    let share = float("volume_fraction", 0.01);
    let water = r#"<spectrum name="sigma_a" value="0.25"/>"#;
    let loaded = load(SPECTRAL, &format!("{share}{water}"), SPHERES).unwrap();
    let found = medium(&loaded);
    assert_eq!(found.len(), 2);
    for ([s, a, g], (n, nm)) in found.into_iter().zip([(1.6, 500.0), (1.59, 600.0)]) {
        let mie = mie(n, nm);
        // µm⁻¹ to mm⁻¹.
        assert_close(
            s,
            1e3 * 0.01 * mie.scattering_cross_section() / mie.volume(),
        );
        assert_close(a, 0.25);
        assert_close(g, mie.mean_cosine());
    }
}

#[test]
fn spheres_are_counted_and_scaled() {
    let count = float("number_density", 1e7);
    let metres = float("scale", 1e3);
    let spheres = format!("{SPHERES}{}", float("wavelength", 600.0));
    for (scale, factor) in [("", 1.0), (metres.as_str(), 1e3)] {
        let loaded = load("", &format!("{count}{scale}"), &spheres).unwrap();
        let [[s, ..]] = medium(&loaded)[..] else {
            panic!("colours share their paths")
        };
        assert_close(
            s / factor,
            1e7 * 1e-6 * mie(1.59, 600.0).scattering_cross_section(),
        );
    }
}

/// A million spheres of 1 µm³ in a cubic millimetre fill 1e-3 of it; E[r³] = r³ exp(4.5 ln² σ).
#[test]
fn distributions_have_the_volume_of_their_sizes() {
    let spheres = format!("{SPHERES}{}", float("geometric_deviation", 1.5));
    let by = |name, value| {
        let loaded = load(SPECTRAL, &float(name, value), &spheres).unwrap();
        medium(&loaded)[0][0]
    };
    let volume = 4.0 / 3.0 * std::f64::consts::PI * 0.125 * (4.5 * 1.5f64.ln().powi(2)).exp();
    let [number, fraction] = [by("number_density", 1e6), by("volume_fraction", 1e-3)];
    assert_close(number / (volume * fraction), 1.0);
}

#[test]
fn coefficients_may_be_those_of_the_medium() {
    let loaded = load(SPECTRAL, &float("sigma_t", 2.0), SPHERES).unwrap();
    for [s, a, _] in medium(&loaded) {
        assert_close(s + a, 2.0);
    }
}

#[test]
fn mistakes_are_told() {
    let share = float("volume_fraction", 0.01);
    let radius = SPHERES.replace("0.5", "500");
    let matched = SPHERES.replace("500:1.6, 700:1.58", "1.333");
    let colour = SPHERES.replace(
        r#"<spectrum name="eta" value="500:1.6, 700:1.58"/>"#,
        r#"<rgb name="eta" value="1.6, 1.59, 1.58"/>"#,
    );
    for (film, medium, spheres, expected) in [
        ("", share.clone(), SPHERES, "give a 'wavelength' here"),
        (SPECTRAL, float("volume_fraction", 0.8), SPHERES, "0.741"),
        (
            SPECTRAL,
            share.clone() + &float("sigma_t", 1.0),
            SPHERES,
            "spheres give scattering",
        ),
        (
            SPECTRAL,
            share.clone() + &float("number_density", 1.0),
            SPHERES,
            "not both",
        ),
        (
            SPECTRAL,
            share.clone(),
            &radius,
            "check that 'radius' is in µm",
        ),
        (
            SPECTRAL,
            share.clone(),
            &matched,
            "'eta' and 'ext_eta' must differ",
        ),
        (SPECTRAL, share.clone(), &colour, "pairs of wavelengths"),
        (SPECTRAL, share.clone(), "", "radius"),
    ] {
        let error = load(film, &medium, spheres).map(|_| ()).unwrap_err();
        assert!(error.contains(expected), "{expected}: {error}");
    }
    let loaded = load(SPECTRAL, &float("volume_fraction", 0.3), SPHERES).unwrap();
    assert!(
        loaded
            .warnings
            .to_string()
            .contains("assumes independent scattering"),
        "{}",
        loaded.warnings
    );
}

#[test]
fn concentrations_need_spheres() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scene.xml");
    let text = format!(
        r#"<scene version="3.0.0"><emitter type="constant"/><sensor type="perspective"/><shape type="sphere"><bsdf type="null"/>
<medium name="interior" type="homogeneous">{}</medium></shape></scene>"#,
        float("volume_fraction", 0.01)
    );
    fs::write(&path, text).unwrap();
    let error = morgana_io::load_scene(&path, &LoadOptions::default()).map(|_| ());
    let error = error.map_err(|d| d.to_string()).unwrap_err();
    assert!(error.contains("a phase function 'mie'"), "{error}");
}
