//! Spectra on films of colours, of luminance and of wavelengths: lists, files and plugins, and
//! refused spectra. References are values of `mi.traverse` of plugins loaded by Mitsuba 3.9.1
//! (`scalar_rgb`), unless a test says otherwise. Nothing here is random.

use glam::DVec3;
use morgana_io::{LoadOptions, Loaded, json};
use std::fs;
use std::path::Path;
use transport::Spectrum;
use transport::bsdf::{Bsdf, Surface};
use transport::emitter::{Emitter, Environment};

const SPECTRAL: &str = r#"<string name="pixel_format" value="spectral"/>
    <string name="wavelengths" value="350, 450, 560, 1064"/>"#;
const LUMINANCE: &str = r#"<string name="pixel_format" value="luminance"/>"#;

/// A camera on a film, a light and a ball.
fn load_in(directory: &Path, film: &str, radiance: &str, bsdf: &str) -> Result<Loaded, String> {
    let text = format!(
        r#"<scene version="3.0.0"><integrator type="path"/>
<sensor type="perspective"><film type="hdrfilm">{film}<integer name="width" value="4"/>
  <integer name="height" value="4"/></film></sensor>
<emitter type="constant">{radiance}</emitter>
<shape type="sphere"><point name="center" z="9"/>{bsdf}</shape>
</scene>"#
    );
    let path = directory.join("scene.xml");
    fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

fn load(film: &str, radiance: &str, bsdf: &str) -> Result<Loaded, String> {
    let directory = tempfile::tempdir().unwrap();
    fs::write(
        directory.path().join("red.spd"),
        "# nm, reflectance\n400 0.1\n500\t0.3 \r\n\n600 0.8 a remark\n700, 0.9\n",
    )
    .unwrap();
    load_in(directory.path(), film, radiance, bsdf)
}

fn radiance(film: &str, xml: &str) -> Spectrum {
    let loaded = load(film, xml, "").unwrap_or_else(|e| panic!("{e}"));
    match loaded.scene().emitters()[0] {
        Emitter::Environment(Environment::Constant(radiance)) => radiance,
        ref other => panic!("{other:?}"),
    }
}

fn surface(film: &str, bsdf: &str) -> Bsdf {
    let bsdf = format!("<bsdf {bsdf}</bsdf>");
    let loaded = load(film, "", &bsdf).unwrap_or_else(|e| panic!("{e}"));
    loaded.scene().objects()[0].bsdf.clone()
}

fn reflectance(film: &str, xml: &str) -> Spectrum {
    let surface = surface(film, &format!("type=\"diffuse\">{xml}"));
    let normal = Surface::plain(DVec3::Z, 1.0, 1.0);
    surface.eval(&normal, DVec3::Z, DVec3::Z) * std::f64::consts::PI
}

#[track_caller]
fn close(found: Spectrum, expected: [f64; 3], tolerance: f64) {
    for c in 0..3 {
        let error = (found[c] - expected[c]).abs();
        assert!(
            error <= tolerance * expected[c].abs().max(1e-3),
            "{found:?} against {expected:?}"
        );
    }
}

const LIST: &str = "400:0, 500:8, 600:15.6, 700:18.4";
const RED: &str = "400:0.1, 500:0.3, 600:0.8, 700:0.9";

/// Relative tolerance: six digits are printed.
const DIGITS: f64 = 1e-5;

#[test]
fn light_on_colour_films_is_that_of_mitsuba() {
    for (xml, expected) in [
        (
            format!(r#"<spectrum name="radiance" value="{LIST}"/>"#),
            [20.7108, 10.8546, 2.77115],
        ),
        (
            r#"<spectrum name="radiance" value="2"/>"#.to_owned(),
            [2.40959, 1.89658, 1.81783],
        ),
        (r#"<float name="radiance" value="2"/>"#.into(), [2.0; 3]),
        (r#"<spectrum name="radiance" type="d65"/>"#.into(), [1.0; 3]),
        (
            r#"<texture name="radiance" type="d65"><float name="scale" value="3"/></texture>"#
                .into(),
            [3.0; 3],
        ),
        (
            r#"<spectrum name="radiance" type="d65"><rgb name="color" value="1, 2, 3"/>
               <float name="scale" value="3"/></spectrum>"#
                .into(),
            [3.0, 6.0, 9.0],
        ),
        (
            r#"<spectrum name="radiance" type="uniform"><float name="value" value="3"/></spectrum>"#
                .into(),
            [3.0; 3],
        ),
        (
            r#"<texture name="radiance" type="uniform"><float name="value" value="3"/></texture>"#
                .into(),
            [3.0; 3],
        ),
        (
            r#"<texture name="radiance" type="srgb"><rgb name="color" value="0.3, 0, 1"/></texture>"#
                .into(),
            [0.3, 0.0, 1.0],
        ),
        (
            r#"<spectrum name="radiance" type="srgb"><rgb name="color" value="0.3, 0, 1"/></spectrum>"#
                .into(),
            [0.3, 0.0, 1.0],
        ),
        (
            r#"<spectrum name="radiance" type="rawconstant"><vector name="value" value="3, 2, 1"/></spectrum>"#
                .into(),
            [3.0, 2.0, 1.0],
        ),
    ] {
        close(radiance("", &xml), expected, DIGITS);
    }
}

/// Plugins that `scalar_rgb` does not evaluate. References are means of films of `scalar_spectral`,
/// 64 × 64 pixels of 1024 samples, whose standard errors are below 4e-4 of the largest channel. The
/// sum of 1000 samples is too small by 1e-3. With a probability of 1e-3, one of the 18 numbers is
/// off by more than four standard errors and 1e-3.
#[test]
fn plugins_are_what_spectral_films_of_mitsuba_show() {
    for (xml, expected) in [
        (
            format!(r#"<spectrum name="radiance" value="{LIST}"/>"#),
            [20.7326, 10.8654, 2.77474],
        ),
        (
            r#"<spectrum name="radiance" type="blackbody"><float name="temperature" value="5000"/></spectrum>"#
                .to_owned(),
            [15278.9, 12094.5, 9604.3],
        ),
        (
            r#"<spectrum name="radiance" type="blackbody"><float name="temperature" value="2000"/></spectrum>"#
                .into(),
            [16.0301, 4.11606, 0.130664],
        ),
        (
            r#"<spectrum name="radiance" type="regular"><float name="wavelength_min" value="400"/>
               <float name="wavelength_max" value="700"/><string name="values" value="1, 2, 3"/></spectrum>"#
                .into(),
            [3.08357, 1.86078, 1.13239],
        ),
        (
            r#"<spectrum name="radiance" type="irregular"><string name="wavelengths" value="400, 500, 700"/>
               <string name="values" value="1, 2, 3"/></spectrum>"#
                .into(),
            [3.19797, 2.12793, 1.28333],
        ),
        (
            r#"<spectrum name="radiance" value="2"/>"#.into(),
            [2.41227, 1.89832, 1.82074],
        ),
    ] {
        let found = radiance("", &xml);
        let largest = expected[0];
        for c in 0..3 {
            let error = (found[c] / 0.999 - expected[c]).abs();
            assert!(error < 2e-3 * largest, "{xml}: {found:?}, {expected:?}");
        }
    }
}

#[test]
fn reflectances_on_colour_films_are_those_of_mitsuba() {
    let red = [0.931798, 0.509497, 0.160588];
    for (xml, expected) in [
        (
            format!(r#"<spectrum name="reflectance" value="{RED}"/>"#),
            red,
        ),
        (
            r#"<spectrum name="reflectance" filename="red.spd"/>"#.to_owned(),
            red,
        ),
        (
            r#"<spectrum name="reflectance" type="irregular"><string name="wavelengths" value="400 500 600 700"/>
               <string name="values" value="0.1 0.3 0.8 0.9"/></spectrum>"#
                .into(),
            red,
        ),
        (
            r#"<spectrum name="reflectance" value="360:1, 830:1"/>"#.into(),
            [0.998985, 0.998874, 0.998802],
        ),
        (
            r#"<spectrum name="reflectance" value="0.3"/>"#.into(),
            [0.3; 3],
        ),
        // A clipped spectrum.
        (
            r#"<spectrum name="reflectance" value="520:1, 530:1"/>"#.into(),
            [0.0, 0.136796, 0.0],
        ),
    ] {
        close(reflectance("", &xml), expected, DIGITS);
    }
}

#[test]
fn indices_are_not_clipped() {
    let metal = surface(
        "",
        r#"type="conductor"><spectrum name="eta" value="300:1.8, 400:1.65, 500:0.9, 600:0.2, 700:0.16, 800:0.18"/>
           <spectrum name="k" value="300:1.92, 400:1.95, 500:1.95, 600:2.97, 700:3.8, 800:5.12"/>"#,
    );
    let (eta, k) = ([0.0452341, 0.585709, 1.33692], [3.38869, 2.34904, 1.87516]);
    let same = surface(
        "",
        &format!(
            r#"type="conductor"><rgb name="eta" value="{}, {}, {}"/><rgb name="k" value="{}, {}, {}"/>"#,
            eta[0], eta[1], eta[2], k[0], k[1], k[2]
        ),
    );
    // The mirror's reflectance depends on both numbers.
    let mirrored = |bsdf: &Bsdf| match bsdf {
        Bsdf::Conductor(_) => format!("{bsdf:?}"),
        other => panic!("{other:?}"),
    };
    let numbers = |text: &str| -> Vec<f64> {
        let words = text.split(|c: char| !(c.is_ascii_digit() || ".e-".contains(c)));
        words.filter_map(|word| word.parse().ok()).collect()
    };
    let [found, expected] = [&metal, &same].map(|bsdf| numbers(&mirrored(bsdf)));
    assert!(found.len() >= 6 && found.len() == expected.len());
    for (f, e) in found.iter().zip(&expected) {
        assert!((f - e).abs() <= DIGITS * e.abs(), "{found:?}, {expected:?}");
    }
}

#[test]
fn clipping_is_told() {
    let list = format!(r#"type="diffuse"><spectrum name="reflectance" value="{LIST}"/>"#);
    let loaded = load("", "", &format!("<bsdf {list}</bsdf>")).unwrap();
    let warnings = loaded.warnings.to_string();
    assert!(
        warnings.contains("are 17.7147, 11.3544, 3.30451: clipped to 0 to 1"),
        "{warnings}"
    );
    let quiet = load(
        "",
        &format!(r#"<spectrum name="radiance" value="{LIST}"/>"#),
        "",
    )
    .unwrap();
    assert!(quiet.warnings.is_empty(), "{}", quiet.warnings);
}

/// Films of luminance agree with `llvm_ad_mono`: the luminance of the colour.
#[test]
fn films_of_luminance_show_the_luminance() {
    let list = format!(r#"<spectrum name="radiance" value="{LIST}"/>"#);
    let expected = 0.2126 * 20.7108 + 0.7152 * 10.8546 + 0.0722 * 2.77115;
    close(radiance(LUMINANCE, &list), [expected, 0.0, 0.0], DIGITS);
    let even = r#"<spectrum name="radiance" value="2"/>"#;
    assert_eq!(radiance(LUMINANCE, even)[0], 2.0);
}

/// D65 is 117.008 at 450 nm and 100 at 560 nm, and has luminance 1 if divided by 98.9974. The
/// constants of Planck's law come from CODATA 2018, 2hc² = 1.191042972e-16 W m²/sr and hc/k =
/// 1.438776877e-2 m K.
#[test]
fn films_of_wavelengths_show_the_spectra_themselves() {
    let day = radiance(SPECTRAL, r#"<spectrum name="radiance" type="d65"/>"#);
    close(day, [0.0, 117.008 / 98.997418, 100.0 / 98.997418], 1e-7);
    assert_eq!(day[3], 0.0);
    let thermal = r#"<spectrum name="radiance" type="blackbody"><float name="temperature" value="5000"/>
        <float name="wavelength_max" value="2000"/></spectrum>"#;
    let thermal = radiance(SPECTRAL, thermal);
    assert_eq!(thermal[0], 0.0);
    let (second, first) = (1.438_776_877e7 / 5000.0, 1.191_042_972e20);
    for (c, nm) in [(1, 450.0_f64), (2, 560.0), (3, 1064.0)] {
        let expected = first / nm.powi(5) / ((second / nm).exp() - 1.0);
        assert!((thermal[c] / expected - 1.0).abs() < 1e-6, "{nm}");
    }
    let red = reflectance(
        SPECTRAL,
        r#"<spectrum name="reflectance" filename="red.spd"/>"#,
    );
    close(red, [0.1, 0.2, 0.6], 1e-12);
    assert!((red[3] - 0.9).abs() < 1e-12);
}

/// In Mitsuba 0.6 a spectrum of one number is the same in all channels, and three are red, green and blue.
#[test]
fn older_spectra_are_colours() {
    let scene = |value: &str| {
        format!(
            r#"<scene version="0.6.0"><integrator type="path"/><sensor type="perspective"/>
               <emitter type="constant"><spectrum name="radiance" value="{value}"/></emitter></scene>"#
        )
    };
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scene.xml");
    for (value, expected) in [("2", [2.0; 3]), ("0.5, 3.5, 7.5", [0.5, 3.5, 7.5])] {
        fs::write(&path, scene(value)).unwrap();
        let loaded = morgana_io::load_scene(&path, &LoadOptions::default()).unwrap();
        match loaded.scene().emitters()[0] {
            Emitter::Environment(Environment::Constant(found)) => close(found, expected, 0.0),
            ref other => panic!("{other:?}"),
        }
    }
}

/// Scenes in JSON have equal spectra, and are written with them.
#[test]
fn scenes_in_json_have_them_too() {
    let text = r#"{"type": "scene", "integrator": {"type": "path"}, "sensor": {"type": "perspective"},
        "a": {"type": "constant", "radiance": {"type": "blackbody", "temperature": 3000}},
        "b": {"type": "sphere", "center": [0, 0, 9], "bsdf": {"type": "diffuse",
              "reflectance": {"type": "spectrum", "filename": "red.spd"}}},
        "c": {"type": "point", "intensity": {"type": "spectrum", "value": 2}}}"#;
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("red.spd"), "400 0.1\n700 0.9\n").unwrap();
    let path = directory.path().join("scene.json");
    fs::write(&path, text).unwrap();
    let loaded =
        morgana_io::load_scene(&path, &LoadOptions::default()).unwrap_or_else(|d| panic!("{d}"));
    assert_eq!(loaded.scene().emitters().len(), 2);
    let mut diagnostics = morgana_io::Diagnostics::new();
    let scene = json::parse(text, "scene.json", &[], &mut diagnostics).unwrap();
    let again = json::write(&scene);
    let twin = json::parse(&again, "scene.json", &[], &mut diagnostics).unwrap();
    assert_eq!(json::write(&twin), again);
    for part in [
        "\"blackbody\"",
        "\"filename\": \"red.spd\"",
        "\"value\": 2}",
    ] {
        assert!(again.contains(part), "{part} in {again}");
    }
}

#[test]
fn what_is_refused() {
    let light = |xml: &str| load("", xml, "").expect_err("the scene was accepted");
    let bad = |plugin: &str, parts: &str| {
        light(&format!(
            r#"<spectrum name="radiance" type="{plugin}">{parts}</spectrum>"#
        ))
    };
    for (message, expected) in [
        (
            light(r#"<spectrum name="radiance" filename="no.spd"/>"#),
            "no.spd: cannot read",
        ),
        (
            light(r#"<spectrum name="radiance" value="500:1"/>"#),
            "a list of one wavelength has no colour",
        ),
        (
            light(r#"<spectrum name="radiance" value="1, 2"/>"#),
            "expected one number, three, or pairs",
        ),
        (
            light(r#"<spectrum name="radiance" filename="a.spd" value="1"/>"#),
            "value",
        ),
        (bad("d56", ""), "did you mean 'd65'?"),
        (bad("blackbody", ""), "needs <float name=\"temperature\">"),
        (
            bad("blackbody", r#"<float name="temperature" value="-1"/>"#),
            "must be greater than 0",
        ),
        (
            bad(
                "irregular",
                r#"<string name="wavelengths" value="400, 300"/><string name="values" value="1, 2"/>"#,
            ),
            "which increase",
        ),
        (
            bad(
                "irregular",
                r#"<string name="wavelengths" value="400, 500"/><string name="values" value="1, x"/>"#,
            ),
            "'values' is a list of numbers",
        ),
        (
            bad(
                "regular",
                r#"<float name="wavelength_min" value="700"/><float name="wavelength_max" value="400"/>
                <string name="values" value="1, 2"/>"#,
            ),
            "to a larger 'wavelength_max'",
        ),
        (
            bad("srgb", r#"<rgb name="color" value="3, 0, 1"/>"#),
            "must lie in [0, 1]",
        ),
        (
            bad("d65", r#"<texture type="checkerboard"/>"#),
            "cannot be a texture",
        ),
        (
            bad("uniform", r#"<float name="value" value="-1"/>"#),
            "light must not be negative",
        ),
    ] {
        assert!(message.contains(expected), "{expected:?} in:\n{message}");
    }
}

#[test]
fn files_that_are_no_spectra_are_refused_with_the_line() {
    let directory = tempfile::tempdir().unwrap();
    for (text, expected) in [
        (
            "400 1\n",
            "bad.spd: a spectrum needs at least two wavelengths",
        ),
        ("# a\n400 1\n500\n", "bad.spd:3: expected a wavelength"),
        ("400 1\n400 2\n", "bad.spd:2: wavelengths must increase"),
        ("400 1\n500 nan\n", "bad.spd:2: expected"),
        ("-400 1\n500 2\n", "bad.spd:1: expected"),
        ("\u{0}\u{1}", "bad.spd:1: expected"),
    ] {
        fs::write(directory.path().join("bad.spd"), text).unwrap();
        let xml = r#"<spectrum name="radiance" filename="bad.spd"/>"#;
        let message = load_in(directory.path(), "", xml, "").expect_err(text);
        assert!(message.contains(expected), "{expected:?} in:\n{message}");
    }
}
