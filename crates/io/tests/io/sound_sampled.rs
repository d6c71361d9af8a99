//! Sampled sound: complex amplitudes and time series, in scenes and in files of other programs
//! (`data/volumes/make_sound.py`), and mistakes.

use glam::DVec3;
use morgana_io::{LoadOptions, Loaded};
use serde_json::{Value, json};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::fs;
use std::path::Path;

const DN_DP: f64 = 1e-8;
/// Number of samples per period, and of instants.
const STEPS: usize = 8;

/// Loads a cube of water with a pressure field; null parameters are left out.
fn load(volume: Value, phases: usize) -> Result<Loaded, String> {
    let mut ior = json!({
        "type": "pressure", "n0": 1.33, "dn_dp": DN_DP, "placement": "nodes", "frequency": 1e6, "sound_speed": 1e6,
        "to_world": [{"translate": [-0.5, -0.5, -0.5]}]
    });
    for (key, value) in volume.as_object().unwrap() {
        ior[key] = value.clone();
    }
    if let Some(ior) = ior.as_object_mut() {
        ior.retain(|_, value| !value.is_null());
    }
    let scene = json!({
        "type": "scene",
        "sensor": {"type": "orthographic", "to_world": [{"translate": [0, 0, -5]}],
            "sampler": {"type": "independent", "sample_count": 16, "phases": phases}},
        "water": {"type": "cube", "to_world": [{"scale": 0.5}], "bsdf": {"type": "dielectric"},
            "interior": {"type": "transparent", "ior": ior}},
        "sky": {"type": "constant"}
    });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.json");
    fs::write(&path, scene.to_string()).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

fn file(name: &str) -> String {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/volumes");
    data.join(name).to_str().unwrap().to_owned()
}

/// Amplitude at sample (x, y, z) of 2 × 3 × 4, and its argument.
fn amplitude([x, y, z]: [usize; 3]) -> f64 {
    (1 + x + 10 * y + 100 * z) as f64
}

const ARGUMENT: f64 = 0.3;

/// An array [z, y, x] of values at the samples.
fn array(at: impl Fn(f64) -> Value) -> Value {
    let row = |y, z| -> Value { (0..2).map(|x| at(amplitude([x, y, z]))).collect() };
    let plane = |z| -> Value { (0..3).map(|y| row(y, z)).collect() };
    (0..4).map(plane).collect()
}

/// A time series of a sound that exists from the start, and an additional signal.
fn series(times: usize, other: impl Fn(usize) -> f64) -> Value {
    array(|a| {
        let at = |t: usize| a * (TAU * t as f64 / STEPS as f64 + ARGUMENT).cos() + other(t);
        (0..times).map(at).collect()
    })
}

/// Asserts that the indices of all instants at the samples agree with the amplitude.
#[track_caller]
fn check(loaded: &Loaded, turned: f64) {
    let scene = loaded.scene();
    assert_eq!(scene.instants(), STEPS);
    for instant in 0..STEPS {
        let phase = TAU * instant as f64 / STEPS as f64 + ARGUMENT + turned;
        for (x, y, z) in (0..24).map(|i| (i % 2, i / 2 % 3, i / 6)) {
            let place = DVec3::new(x as f64, y as f64 / 2.0, z as f64 / 3.0) - 0.5;
            let scene = scene.at(instant as u64);
            let medium = scene.medium_at(DVec3::ZERO);
            let found = (scene.n(medium, place) - 1.33) / DN_DP;
            let expected = amplitude([x, y, z]) * phase.cos();
            assert!(
                (found - expected).abs() < 1e-3,
                "{instant} {place}: {found}, {expected}"
            );
        }
    }
}

#[test]
fn complex_amplitudes_are_two_channels() {
    let complex = |a: f64| json!([a * ARGUMENT.cos(), a * ARGUMENT.sin()]);
    let loaded = load(json!({"data": array(complex)}), STEPS).unwrap();
    check(&loaded, 0.0);
    assert!(loaded.warnings.is_empty(), "{}", loaded.warnings);
    let later = json!({"data": array(complex), "time_phase": FRAC_PI_2});
    check(&load(later, STEPS).unwrap(), FRAC_PI_2);
    // Give half the amplitude, of a pressure in kPa.
    let small = |a: f64| json!([a * ARGUMENT.cos() * 1e-3, a * ARGUMENT.sin() * 1e-3]);
    check(
        &load(json!({"data": array(small), "scale": 1e3}), STEPS).unwrap(),
        0.0,
    );
}

#[test]
fn complex_numbers_of_other_programs() {
    for (name, dataset) in [("sound.npy", None), ("sound.h5", Some("amplitude"))] {
        let mut volume = json!({"filename": file(name), "axis_order": "zyx"});
        if let Some(dataset) = dataset {
            volume["dataset"] = json!(dataset);
        }
        check(&load(volume, STEPS).unwrap(), 0.0);
    }
}

/// Sensors of k-Wave that are boxes of its grid, by a mask and by corners: samples and positions
/// from the file.
#[test]
fn boxes_of_sensors() {
    for (name, dataset, order) in [
        ("kwave_box.h5", "p", "zyx"),
        ("kwave_cuboids.h5", "p/2", "zyx"),
        ("kwave_cuboids.h5", "/p/2", "czyx"),
    ] {
        let mut volume = json!({"filename": file(name), "dataset": dataset, "axis_order": order});
        let loaded = load(volume.clone(), STEPS).unwrap();
        check(&loaded, 0.0);
        assert!(loaded.warnings.is_empty(), "{}", loaded.warnings);
        volume["use_grid_bbox"] = json!(true);
        volume["to_world"] = json!([{"scale": 1e4}]);
        for placement in ["centers", "nodes"] {
            volume["placement"] = json!(placement);
            let sound = &load(volume.clone(), 1).unwrap().sounds[0];
            assert_eq!(sound.size, [2, 3, 4]);
            // Cells of 1, 2 and 3 units, from the point (1, 1, 2) on.
            assert!((sound.origin() - DVec3::new(1.5, 3.0, 7.5)).length() < 1e-5);
            assert!((sound.spacing() - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-5);
        }
    }
}

#[test]
fn sensors_that_are_no_boxes() {
    let refused = |name: &str, dataset: &str, part: &str| {
        let volume =
            json!({"filename": file(name), "dataset": dataset, "axis_order": "zyx", "periods": 1});
        let message = load(volume, 1).unwrap_err();
        assert!(message.contains(part), "{message}");
    };
    let no_box = "24 points of a mask that are not all points of a box, in their order: let the sensor record a cuboid";
    refused("kwave_outside.h5", "p", no_box);
    refused("kwave_swapped.h5", "p", no_box);
    refused(
        "kwave_cuboids.h5",
        "p/3",
        "has no cuboid 3 that is in the grid",
    );
    refused(
        "kwave_cuboids.h5",
        "other/1",
        "expected 1 x 1 x 2 points in cuboid 1 of the sensor, found 1 x 2 x 2",
    );
    refused(
        "sound.h5",
        "part",
        "'sensor_mask_index', which says where it is",
    );
}

/// The last periods are fitted with the file's time step; earlier samples do not count.
#[test]
fn the_amplitude_of_a_series() {
    let start = |t: usize| if t < 10 { 50.0 } else { 0.0 };
    let of_scene = json!({"data": series(33, start), "time_step": 1.25e-7});
    let loaded = load(of_scene, STEPS).unwrap();
    check(&loaded, 0.0);
    assert!(loaded.warnings.is_empty(), "{}", loaded.warnings);
    // Records at a sensor's points define the order of axes, whether the scene does or not.
    for (dataset, order) in [
        ("p", json!("zyx")),
        ("p", json!(null)),
        ("cuboid", json!("czyx")),
    ] {
        let of_file =
            json!({"filename": file("sound.h5"), "dataset": dataset, "axis_order": order});
        let loaded = load(of_file, STEPS).unwrap();
        check(&loaded, 0.0);
        assert!(loaded.warnings.is_empty(), "{}", loaded.warnings);
    }
    let wrong = json!({"filename": file("sound.h5"), "dataset": "p", "axis_order": "xyz"});
    let error = load(wrong, STEPS).err().unwrap();
    assert!(error.contains("the order of axes czyx"), "{error}");
    let other = json!({
        "filename": file("sound.h5"), "dataset": "p", "axis_order": "zyx", "time_step": 1.3e-7, "periods": 1
    });
    let warnings = load(other, 1).unwrap().warnings.to_string();
    assert!(
        warnings.contains("the file has a time step of 1.250e-7 s, the scene 1.300e-7 s"),
        "{warnings}"
    );
}

#[test]
fn what_is_not_of_the_frequency_is_told_once() {
    let overtone = |t: usize| 40.0 * (2.0 * TAU * t as f64 / STEPS as f64).cos();
    let loaded = load(
        json!({"data": series(32, overtone), "time_step": 1.25e-7, "periods": 2}),
        STEPS,
    )
    .unwrap();
    check(&loaded, 0.0);
    let warnings = loaded.warnings.to_string();
    // Squares of amplitudes have the mean 38649, and the overtone has 1600: √(1600/40249).
    assert!(
        warnings.contains("20 % of the pressure in its last 2.000 periods"),
        "{warnings}"
    );
    assert_eq!(warnings.matches("of the pressure").count(), 1, "{warnings}");
    let series = loaded.sounds[0].series.unwrap();
    let residual = series.residual.unwrap();
    let squares = (0..24).map(|i| amplitude([i % 2, i / 2 % 3, i / 6]).powi(2));
    let mean = squares.sum::<f64>() / 24.0;
    assert!((residual - (1600.0 / (mean + 1600.0)).sqrt()).abs() < 1e-9);
    assert_eq!([series.frames, series.first, series.used], [32, 16, 16]);
}

#[test]
fn a_frame_is_an_instant() {
    let frame = |frame: i64| {
        let of_file = json!({
            "filename": file("sound.h5"), "dataset": "p", "axis_order": "zyx", "frame": frame, "frequency": null, "sound_speed": null
        });
        load(of_file, 1)
    };
    let loaded = frame(3).unwrap();
    let scene = loaded.scene();
    let found = (scene.n(scene.medium_at(DVec3::ZERO), DVec3::splat(0.5)) - 1.33) / DN_DP;
    let expected = amplitude([1, 2, 3]) * (TAU * 3.0 / 8.0 + ARGUMENT).cos();
    assert!((found - expected).abs() < 1e-3, "{found} {expected}");
    let message = frame(28).unwrap_err();
    assert!(
        message.contains("more than 28 channels or frames"),
        "{message}"
    );
}

#[test]
fn mistakes_are_named() {
    let refused = |volume: Value, part: &str| {
        let message = load(volume, 1).unwrap_err();
        assert!(message.contains(part), "{message}");
    };
    let data = series(32, |_| 0.0);
    refused(
        json!({"data": data}),
        "of 32 channels the 'time_step' must be known",
    );
    refused(
        json!({"data": data, "time_step": 5e-7}),
        "a period of the sound has 2.00 samples in time",
    );
    refused(
        json!({"data": data, "time_step": 1.25e-7, "periods": 5}),
        "has 32 samples in time, 4.00 periods of the sound: 5",
    );
    refused(
        json!({"data": data, "time_step": 1.25e-7, "frame": 1}),
        "give a frame, or the frequency of the sound",
    );
    refused(
        json!({"data": data, "time_step": 1.25e-7, "reference": 1}),
        "no effect on sound with a 'frequency'",
    );
    refused(
        json!({"data": data, "time_step": 1.25e-7, "smoothing": "auto"}),
        "no effect on sound with a 'frequency'",
    );
    refused(
        json!({"data": data, "time_step": 1.25e-7, "sound_speed": 0}),
        "'sound_speed'",
    );
    refused(
        json!({"filename": file("sound.h5"), "dataset": "part", "axis_order": "zyx"}),
        "pressure at all 2 x 3 x 4 points of k-Wave's grid",
    );
    let loud = |a: f64| json!([1e7 * a, 0.0]);
    refused(json!({"data": array(loud)}), "least index in sound");
}

/// A wave along z through the unit cube, with twice the right length, or too coarse.
#[test]
fn samples_are_of_waves_as_long_as_frequency_and_speed_say() {
    let wave = |per_wavelength: f64, wavelength: f64| {
        let count = (4.0 * per_wavelength) as usize;
        let at = |z: usize| {
            let phase = TAU * z as f64 / per_wavelength;
            [[[phase.cos(), phase.sin()]; 2]; 2]
        };
        let data: Vec<_> = (0..count).map(at).collect();
        let volume = json!({"data": data, "placement": "centers", "frequency": 1e6, "sound_speed": 1e6 * wavelength});
        load(volume, STEPS).unwrap().warnings.to_string()
    };
    for per_wavelength in [3.0, 4.0, 12.0] {
        let text = wave(per_wavelength, 0.25);
        assert!(text.is_empty(), "{per_wavelength}: {text}");
    }
    let text = wave(12.0, 0.5);
    assert!(text.contains("of waves of a length of 2.53e-1"), "{text}");
    assert!(
        text.contains("has a wavelength of 5.00e-1 (scene units)"),
        "{text}"
    );
    assert!(text.contains("check the units of both"), "{text}");
    let text = wave(2.0, 0.25);
    assert!(text.contains("3 samples or more to a wavelength"), "{text}");
    assert!(text.contains("there are 2.00"), "{text}");
}
