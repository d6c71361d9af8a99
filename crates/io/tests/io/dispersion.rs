//! Dispersion: refraction at each wavelength, compared with Snell's law, and channels with their
//! own paths. Statistical test: false-alarm rate 1e-3.

use glam::DVec3;
use morgana_io::{LoadOptions, Loaded};
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use testkit::z_test::max_abs_z;
use transport::Scene;
use transport::aov::AovTracer;
use transport::path::Workspace;
use transport::render::{RenderOptions, Rendering, render};
use transport::sensor::SensorRay;

const BK7: &str = r#"<float name="b1" value="1.03961212"/><float name="c1" value="0.00600069867"/>
    <float name="b2" value="0.231792344"/><float name="c2" value="0.0200179144"/>
    <float name="b3" value="1.01046945"/><float name="c3" value="103.560653"/>"#;

/// SCHOTT's indices of BK7 at the lines F, d and C.
const LINES: [(f64, f64); 3] = [
    (486.1327, 1.52238),
    (587.5618, 1.51680),
    (656.2725, 1.51432),
];

fn film(wavelengths: &str) -> String {
    format!(
        "<string name=\"pixel_format\" value=\"spectral\"/>\
         <string name=\"wavelengths\" value=\"{wavelengths}\"/>"
    )
}

/// A glass ball of radius 1 with this index under a sky and an emitter, seen by a film with these parameters.
fn load(film: &str, ior: &str) -> Result<Loaded, String> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scene.xml");
    let text = format!(
        r#"<scene version="3.0.0">
<sensor type="orthographic"><transform name="to_world"><translate z="-5"/></transform>
<film type="hdrfilm"><integer name="width" value="6"/><integer name="height" value="6"/>{film}</film></sensor>
<medium id="glass" type="homogeneous"><float name="sigma_t" value="0.3"/>{ior}</medium>
<shape type="sphere"><bsdf type="dielectric"/><ref name="interior" id="glass"/></shape>
<emitter type="constant"/>
<shape type="rectangle"><transform name="to_world"><scale value="0.3"/><translate x="3"/></transform>
<bsdf type="diffuse"><float name="reflectance" value="0"/></bsdf>
<emitter type="area"><float name="radiance" value="9"/></emitter></shape>
</scene>"#
    );
    fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

fn loaded(film: &str, ior: &str) -> Loaded {
    load(film, ior).unwrap_or_else(|e| panic!("{e}"))
}

#[track_caller]
fn refused(film: &str, ior: &str, expected: &[&str]) {
    let message = load(film, ior).expect_err("the scene was accepted");
    for part in expected {
        assert!(message.contains(part), "expected {part:?} in:\n{message}");
    }
}

/// Angle by which a parallel ray at distance b from the middle turns towards it.
fn deflection(scene: &Scene, b: f64) -> f64 {
    let tracer = AovTracer::default();
    let mut ws = Workspace::new(scene.tolerance());
    let mut values = Vec::new();
    let ray = SensorRay {
        origin: DVec3::new(b, 0.0, -5.0),
        direction: DVec3::Z,
    };
    tracer.sample(scene, ray, &mut ws, &mut values);
    let of = |name| values[tracer.channels().position(|n| n == name).unwrap()];
    of("exit.direction.X").atan2(of("exit.direction.Z"))
}

/// A ball of index n turns a ray at distance b by 2 (arcsin(b/n) − arcsin b).
fn snell(b: f64, n: f64) -> f64 {
    2.0 * ((b / n).asin() - b.asin())
}

fn check_ball(ior: &str, indices: &[(f64, f64)], tolerance: f64) {
    let list: Vec<String> = indices.iter().map(|(nm, _)| nm.to_string()).collect();
    let loaded = loaded(&film(&list.join(", ")), ior);
    assert!(loaded.is_dispersive());
    assert_eq!(loaded.groups.len(), indices.len());
    for (scene, (nm, n)) in loaded.groups.iter().zip(indices) {
        for b in [0.2, 0.5, 0.8] {
            let (found, expected) = (deflection(scene, b), snell(b, *n));
            assert!(
                (found - expected).abs() < tolerance,
                "{nm} nm, b = {b}: {found}, {expected}"
            );
        }
    }
}

/// Tolerance: the indices of the table have five digits; 5e-6 of n turns a ray by less than 2e-5.
#[test]
fn a_glass_ball_deflects_each_wavelength_by_snells_law() {
    let ior = format!("<volume name=\"ior\" type=\"sellmeier\">{BK7}</volume>");
    check_ball(&ior, &LINES, 2e-5);
    let ior = r#"<volume name="ior" type="cauchy"><float name="a" value="1.5"/>
        <float name="b" value="0.004"/><float name="c" value="2e-4"/></volume>"#;
    check_ball(ior, &[(500.0, 1.5192), (1000.0, 1.5042)], 1e-9);
}

/// n = n(x) n(λ)/n(λ₀): a constant index of 1.4 at 500 nm.
#[test]
fn a_nested_volume_gives_the_index_at_the_reference_wavelength() {
    let ior = r#"<volume name="ior" type="cauchy"><float name="a" value="1.5"/>
        <float name="b" value="0.01"/><float name="reference_wavelength" value="500"/>
        <volume type="constant"><float name="value" value="1.4"/></volume></volume>"#;
    let at = |nm: f64| (nm, 1.4 * (1.5 + 0.01 / (nm * nm * 1e-6)) / 1.54);
    check_ball(ior, &[at(400.0), at(500.0), at(800.0)], 1e-9);
}

/// In a graded medium the factor changes no ray, but every optical length.
#[test]
fn a_graded_index_is_scaled() {
    let ior = r#"<volume name="ior" type="sellmeier">"#.to_owned()
        + BK7
        + r#"<float name="reference_wavelength" value="587.5618"/>
        <volume type="gaussian"><float name="n0" value="1.5"/><float name="delta" value="0.02"/>
        <float name="width" value="0.4"/></volume></volume>"#;
    let loaded = loaded(&film("486.1327, 587.5618, 656.2725"), &ior);
    let x = DVec3::new(0.2, -0.1, 0.3);
    let n0 = 1.5 + 0.02 * (-x.length_squared() / (2.0 * 0.4 * 0.4)).exp();
    for (scene, (_, n)) in loaded.groups.iter().zip(LINES) {
        let medium = scene.medium_at(x);
        assert!((scene.n(medium, x) - n0 * n / LINES[1].1).abs() < 1e-5);
    }
}

fn shoot(loaded: &Loaded) -> Rendering {
    let options = RenderOptions::new(loaded.renderer, 64, 7);
    render(&loaded.groups, &options, |_| ControlFlow::Continue(()))
}

const WEAK: &str = r#"<volume name="ior" type="cauchy"><float name="a" value="1.5"/>
    <float name="b" value="0.004"/></volume>"#;

/// The first channel is bit-identical to the render of a film of that wavelength. The others have
/// their own paths, so that their errors are independent.
#[test]
fn channels_have_paths_of_their_own() {
    let both = shoot(&loaded(&film("450, 450.001"), WEAK)).film;
    let one = shoot(&loaded(&film("450"), WEAK)).film;
    let (both, one) = ((both.mean(), both.variance()), one.mean());
    let first: Vec<f32> = both.0.iter().step_by(2).copied().collect();
    assert_eq!(first, one);
    // Channels have nearly equal indices and behave as independent estimates. With shared paths the
    // variance of the difference would nearly vanish.
    let z = |i: usize| {
        let (mean, variance) = (&both.0[2 * i..2 * i + 2], &both.1[2 * i..2 * i + 2]);
        let error = f64::from(variance[0] + variance[1]).sqrt();
        (error > 0.0).then(|| f64::from(mean[0] - mean[1]) / error)
    };
    let zs: Vec<f64> = (0..36).filter_map(z).collect();
    max_abs_z(&zs, 1e-3).unwrap();
    let square = zs.iter().map(|z| z * z).sum::<f64>() / zs.len() as f64;
    assert!(square > 0.3, "channels are correlated: {square}");
}

#[test]
fn channels_share_paths_where_nothing_disperses() {
    let fixed = r#"<float name="ior" value="1.5"/>"#;
    let loaded = loaded(&film("450, 500, 550, 600, 650"), fixed);
    assert!(!loaded.is_dispersive());
    assert_eq!(loaded.groups.len(), 2);
    let mean = shoot(&loaded).film.mean();
    for pixel in mean.chunks(5) {
        assert_eq!(pixel[0], pixel[3]);
    }
}

#[test]
fn mistakes_are_named() {
    refused("", WEAK, &["scene.xml:4:", "pixel_format", "spectral"]);
    refused(
        &film("500"),
        &WEAK.replace("0.004", "4000"),
        &["the index at 500 nm is 16001", "µm"],
    );
    let nested = WEAK.replace("</volume>", "<volume type=\"luneburg\"/></volume>");
    refused(
        &film("500"),
        &nested,
        &["needs <float name=\"reference_wavelength\">"],
    );
    let alone = WEAK.replace(
        "</volume>",
        "<float name=\"reference_wavelength\" value=\"500\"/></volume>",
    );
    refused(&film("500"), &alone, &["needs a nested volume"]);
}

/// Writes 3³ densities, x fastest, to a file.
fn densities(directory: &Path, samples: &[f64; 27]) -> PathBuf {
    let file = directory.join("density.npy");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    let header = format!(
        "{:<117}\n",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (3, 3, 3), }"
    );
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend(samples.iter().flat_map(|v| v.to_le_bytes()));
    fs::write(&file, bytes).unwrap();
    file
}

/// Describes air with the densities of a file at nodes from −1.1 to 1.1. `more` holds further
/// parameters.
fn air(file: &Path, more: &str) -> String {
    format!(
        r#"<volume name="ior" type="gladstone_dale"><string name="filename" value="{}"/>
        <string name="axis_order" value="zyx"/><string name="placement" value="nodes"/>{more}
        <transform name="to_world"><translate value="-0.5"/><scale value="2.2"/></transform></volume>"#,
        file.display()
    )
}

/// K of air follows the channel: at 400 and 800 nm it has the value for the volume's own
/// 'wavelength', up to rounding.
#[test]
fn gladstone_dale_follows_the_channel() {
    let directory = tempfile::tempdir().unwrap();
    let file = densities(directory.path(), &[100.0; 27]);
    let ior = |wavelength: &str| air(&file, wavelength);
    let n = |scene: &Scene| scene.n(scene.medium_at(DVec3::ZERO), DVec3::ZERO);
    let follows = loaded(&film("400, 800"), &ior(""));
    for (scene, nm) in follows.groups.iter().zip([400, 800]) {
        let fixed = format!("<float name=\"wavelength\" value=\"{nm}\"/>");
        let fixed = loaded(&film("400, 800"), &ior(&fixed));
        assert!(!fixed.is_dispersive());
        let error = (n(scene) - n(fixed.scene())).abs();
        assert!(error < 4.0 * f64::EPSILON, "{nm}: {error:e}");
    }
    assert!(n(&follows.groups[0]) > n(&follows.groups[1]) + 1e-4);
    refused("", &ior(""), &["wavelength"]);
    refused(&film("2000"), &ior(""), &["2000 nm"]);
}

/// Wavelengths share one spline of the index of air. The index at each wavelength is the index of a
/// volume that gives this wavelength itself. At the samples, it is equal up to the rounding of
/// coefficients in single precision. Between samples, splines of n² at two wavelengths differ by
/// their errors of interpolation: by less than (1 − s) c², where c < 0.0084 is the contrast n − n₀
/// and s ≥ 0.972 the ratio of contrasts. Contrasts differ by (1 − s) c, a hundred times as much.
#[test]
fn wavelengths_share_the_spline_of_air() {
    let directory = tempfile::tempdir().unwrap();
    let samples = std::array::from_fn(|i| 60.0 + (i * 7 % 27) as f64);
    let file = densities(directory.path(), &samples);
    let more = r#"<float name="reference" value="50"/><float name="n0" value="1.01"/>"#;
    let shared = loaded(&film("400, 550, 800"), &air(&file, more));
    assert_eq!((shared.groups.len(), shared.held.len()), (3, 1));
    let field = |scene: &Scene| scene.medium(scene.medium_at(DVec3::ZERO)).index.clone();
    for (scene, nm) in shared.groups.iter().zip([400, 550, 800]) {
        let own = format!("{more}<float name=\"wavelength\" value=\"{nm}\"/>");
        let own = loaded(&film("400, 550, 800"), &air(&file, &own));
        let [own, shared] = [own.scene(), scene].map(field);
        for i in 0..125 {
            let place = [i % 5, i / 5 % 5, i / 25];
            let x = (DVec3::from_array(place.map(f64::from)) - 2.0) * 0.55;
            let error = (shared.n(x) - own.n(x)).abs();
            let limit = match place.map(|p| p % 2) {
                [0, 0, 0] => 5e-9,
                _ => 2e-6,
            };
            assert!(error < limit, "{nm}, {x}: {error:e}");
        }
    }
}

/// A density that gives an index below 0.9 at one of the wavelengths is an error: with scale −1.376,
/// the index is 0.902 at 800 nm and 0.899 at 400 nm.
#[test]
fn wrong_densities_of_air_are_refused_at_each_wavelength() {
    let directory = tempfile::tempdir().unwrap();
    let file = densities(directory.path(), &[400.0; 27]);
    let more = r#"<float name="reference" value="50"/><float name="n0" value="1.01"/>
        <float name="scale" value="-1.376"/>"#;
    loaded(&film("800"), &air(&file, more));
    let expected = ["a sample of 4e2 makes an index of 0.89"];
    refused(&film("800, 400"), &air(&file, more), &expected);
}
