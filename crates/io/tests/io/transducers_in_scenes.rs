//! Indices in the sound of transducers: scenes compared with the sound at single positions, and
//! mistakes.

use eikonal::Field;
use glam::DVec3;
use morgana_io::transducer::{SoundAperture, Transducer};
use morgana_io::{Diagnostics, assemble_field, json};
use serde_json::{Value, json};
use std::f64::consts::FRAC_PI_2;

const N0: f64 = 1.33;
const DN_DP: f64 = 1e-10;
/// Step of differences, in mm.
const STEP: f64 = 1e-2;
/// Wavelength of 1 MHz in water, in mm.
const WAVELENGTH: f64 = 1.5;

/// A bowl of 30 mm and f-number 1 focused at the middle of the box, with further or replaced
/// parameters.
fn volume(more: Value) -> Value {
    let mut volume = json!({
        "type": "transducer", "aperture": "bowl", "radius": 30, "diameter": 30, "pressure": 1e5,
        "frequency": 1e6, "sound_speed": 1.5e6, "n0": N0, "dn_dp": DN_DP, "min": [-3, -3, 24], "max": [3, 3, 36],
    });
    for (key, value) in more.as_object().unwrap() {
        volume[key] = value.clone();
    }
    volume
}

fn made(volume: &Value) -> Result<Field, String> {
    let mut diagnostics = Diagnostics::new();
    let text = json!({"type": "scene", "index": volume}).to_string();
    let scene = json::parse(&text, "scene.json", &[], &mut diagnostics);
    let made = assemble_field(&scene.unwrap(), diagnostics);
    made.map(|made| made.field).map_err(|d| d.to_string())
}

/// Positions in the box, 5 % from its faces.
fn places() -> impl Iterator<Item = DVec3> {
    let golden = DVec3::new(0.819_172_5, 0.671_043_6, 0.549_700_4);
    (0..200).map(move |i| {
        let unit = (golden * f64::from(i)).fract() * 0.9 + 0.05;
        DVec3::new(-3.0, -3.0, 24.0) + unit * DVec3::new(6.0, 6.0, 12.0)
    })
}

/// Tests the largest errors of the index, its gradient and its Laplacian in the focus of a bowl,
/// relative to their largest values. With the default of ten samples per wavelength they are
/// 2.5e-4, 1.9e-3 and 1.2e-2. With a `spacing` of a sixteenth they are 4e-5, 6e-4 and 7e-3.
#[test]
fn errors_of_splines() {
    let bowl = Transducer {
        aperture: SoundAperture::Bowl {
            radius: 30.0,
            diameter: 30.0,
        },
        wavelength: WAVELENGTH,
        pressure: 1e5,
    };
    let p = |x: DVec3| bowl.amplitude(x).unwrap()[0] * DN_DP;
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * STEP);
    let default = made(&volume(json!({}))).unwrap();
    let fine = made(&volume(json!({"spacing": WAVELENGTH / 16.0}))).unwrap();
    for (field, limits) in [(default, [4e-4, 3e-3, 2e-2]), (fine, [6e-5, 8e-4, 1e-2])] {
        let (mut errors, mut sizes) = ([0.0_f64; 3], [0.0_f64; 3]);
        for x in places() {
            let jet = field.jet(x);
            let n = jet.n2.sqrt();
            let grad = axes.map(|a| (p(x + a) - p(x - a)) / (2.0 * STEP));
            let grad = DVec3::from_array(grad);
            let second = axes.iter().map(|a| p(x + *a) - 2.0 * p(x) + p(x - *a));
            let second = second.sum::<f64>() / (STEP * STEP);
            let hess = jet.hess.x_axis.x + jet.hess.y_axis.y + jet.hess.z_axis.z;
            // Hess n² = 2n Hess n + 2 ∇n ∇n; the second term is negligible here.
            let found = [
                n - N0 - p(x),
                (jet.grad / (2.0 * n) - grad).length(),
                hess / (2.0 * n) - second,
            ];
            let exact = [p(x), grad.length(), second];
            for i in 0..3 {
                errors[i] = errors[i].max(found[i].abs());
                sizes[i] = sizes[i].max(exact[i].abs());
            }
        }
        for i in 0..3 {
            let share = errors[i] / sizes[i];
            println!("{share:.1e}");
            assert!(share < limits[i], "{i}: {share}");
        }
    }
}

/// In water the field has the amplitude P: n₀ + dn/dp Re(P e^{i(ωt + τ)}).
#[test]
fn instants_and_phases() {
    let x = DVec3::new(0.4, -0.3, 29.0);
    let at = |phase: f64, time_phase: f64| {
        let field = made(&volume(json!({"time_phase": time_phase}))).unwrap();
        field.at_phase(phase).n(x) - N0
    };
    let (re, im) = (at(0.0, 0.0), -at(FRAC_PI_2, 0.0));
    for (phase, tau) in [(0.7, 0.0), (0.0, 0.7), (1.1, -2.0)] {
        let (sin, cos) = f64::sin_cos(phase + tau);
        let expected = re * cos - im * sin;
        assert!((at(phase, tau) - expected).abs() < 1e-4 * re.hypot(im));
    }
}

/// The sound does not change if the transducer is placed by a transform, or if everything is moved,
/// rotated and scaled with the wavelength.
#[test]
fn transducers_are_placed() {
    let x = DVec3::new(0.4, -0.3, 29.0);
    let straight = made(&array(json!({}))).unwrap();
    // From +z to +x and from +x to +y: lengths along the axes are exchanged.
    let turned = made(&array(
        json!({"origin": [1, 2, 3], "direction": [1, 0, 0], "reference": [0.5, 1, 0],
        "focus": [29, 4, 3], "min": [25, -1, 0], "max": [37, 5, 6]}),
    ));
    let turned = turned.unwrap();
    let there = DVec3::new(x.z, x.x, x.y) + DVec3::new(1.0, 2.0, 3.0);
    let (here, there) = (straight.n(x) - N0, turned.n(there) - N0);
    assert!((here - there).abs() < 1e-3 * here.abs(), "{here} {there}");
    let moved = made(&array(
        json!({"to_world": [{"scale": 2}, {"translate": [0, 0, 5]}]}),
    ))
    .unwrap();
    let found = moved.n(2.0 * x + DVec3::Z * 5.0) - N0;
    assert!(
        (found - here).abs() < 1e-9 * here.abs() + 1e-15,
        "{found} {here}"
    );
    let [shortest, longest] = moved.sound_wavelengths().unwrap();
    assert!((shortest - 2.0 * WAVELENGTH).abs() < 1e-12 && shortest == longest);
}

/// An array of 16 elements of 0.75 mm, focused to 30 mm.
fn array(more: Value) -> Value {
    let mut array = volume(
        json!({"aperture": "linear_array", "elements": 16, "pitch": 0.75, "height": 5, "focus": [2, 0, 28]}),
    );
    let parameters = array.as_object_mut().unwrap();
    parameters.retain(|key, _| !["radius", "diameter"].contains(&key.as_str()));
    parameters.extend(more.as_object().unwrap().clone());
    array
}

/// Delays that bring elements into phase at a point reproduce its `focus`, except for a common
/// time.
#[test]
fn delays_and_weights() {
    let x = DVec3::new(1.5, 0.2, 28.5);
    let middles = (0..16).map(|i| DVec3::X * 0.75 * (f64::from(i) - 7.5));
    let distances: Vec<f64> = middles
        .map(|m| m.distance(DVec3::new(2.0, 0.0, 28.0)))
        .collect();
    let farthest = distances.iter().copied().fold(0.0, f64::max);
    let text = |numbers: Vec<f64>| {
        numbers
            .iter()
            .map(f64::to_string)
            .collect::<Vec<_>>()
            .join(", ")
    };
    let delays = text(distances.iter().map(|d| (farthest - d) / 1.5e6).collect());
    let mut delayed = array(json!({"delays": delays}));
    delayed.as_object_mut().unwrap().remove("focus");
    let focused = made(&array(json!({}))).unwrap().n(x) - N0;
    let found = made(&delayed).unwrap().n(x) - N0;
    assert!(
        (found - focused).abs() < 1e-9 * focused.abs() + 1e-15,
        "{found} {focused}"
    );
    let louder = made(&array(json!({"apodization": text(vec![3.0; 16])}))).unwrap();
    assert!((louder.n(x) - N0 - 3.0 * focused).abs() < 1e-6 * focused.abs());
    let other = made(&array(
        json!({"apodization": text((0..16).map(|i| f64::from(i % 2)).collect())}),
    ))
    .unwrap();
    assert!((other.n(x) - N0 - focused).abs() > 0.1 * focused.abs());
}

/// A ring around the box has its focus where all elements are in phase.
#[test]
fn rings_are_read() {
    let mut ring = array(
        json!({"aperture": "ring_array", "elements": 64, "radius": 20, "height": 5, "focus": [1, 0, 0],
        "min": [-3, -3, -1], "max": [3, 3, 1]}),
    );
    ring.as_object_mut().unwrap().remove("pitch");
    let ring = made(&ring).unwrap();
    let loudness = |x: DVec3| (ring.n(x) - N0).hypot(ring.at_phase(FRAC_PI_2).n(x) - N0);
    let focus = loudness(DVec3::X);
    for x in [
        DVec3::ZERO,
        DVec3::new(2.0, 0.0, 0.0),
        DVec3::new(1.0, 1.0, 0.0),
    ] {
        assert!(loudness(x) < 0.6 * focus, "{} {focus}", loudness(x));
    }
}

#[test]
fn mistakes_are_named() {
    let cases = [
        (
            volume(json!({"aperture": "dish"})),
            "'aperture' cannot be 'dish'",
        ),
        (
            volume(json!({"aperture": "piston"})),
            "does not use 'radius'",
        ),
        (
            volume(json!({"diameter": 61})),
            "at most twice its radius of curvature, 60, but is 61",
        ),
        (
            volume(json!({"min": [-3, -3, 36]})),
            "the box of the sound is empty",
        ),
        (
            volume(json!({"min": [-3, -3, 0.5]})),
            "keep it at least half a wavelength, 0.75, away",
        ),
        (volume(json!({"spacing": 1e-3})), "it needs"),
        (volume(json!({"spacing": 0})), "'spacing'"),
        (
            volume(json!({"spacing": 0.51 * WAVELENGTH})),
            "is too large for the wavelength",
        ),
        (volume(json!({"frequency": 1e8})), "it needs"),
        (
            volume(json!({"direction": [0, 0, 0]})),
            "'direction' must not be zero",
        ),
        (
            volume(json!({"reference": [0, 0, 2]})),
            "parallel to 'direction'",
        ),
        (volume(json!({"dn_dp": 1e-5})), "'dn_dp'"),
        (
            array(json!({"apodization": "1, 2"})),
            "2 weights are given for 16 elements",
        ),
        (
            array(json!({"apodization": "1, x"})),
            "'apodization' is a list of numbers",
        ),
        (array(json!({"delays": "0, 0"})), "not both"),
        (array(json!({"width": 0.8})), "overlap"),
        (array(json!({"elements": 0})), "'elements'"),
        (
            array(json!({"elements": 1000000})),
            "too large for its wavelength",
        ),
    ];
    for (volume, message) in cases {
        let error = made(&volume).unwrap_err();
        assert!(error.contains(message), "{message}: {error}");
        assert!(error.contains("scene.json:1"), "{error}");
    }
    let mut nothing = volume(json!({}));
    nothing.as_object_mut().unwrap().remove("aperture");
    assert!(
        made(&nothing)
            .unwrap_err()
            .contains("a transducer needs an 'aperture'")
    );
}
