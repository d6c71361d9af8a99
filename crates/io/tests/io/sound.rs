//! Sound in scene files: phases in time, means over a period, and mistaken units.

use glam::DVec3;
use morgana_io::{LoadOptions, Loaded};
use std::f64::consts::PI;
use std::fs;

fn load(sampler: &str, mode: &str, samples: Option<u64>) -> Result<Loaded, String> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scene.xml");
    let text = format!(
        r#"<scene version="3.0.0">
<sensor type="orthographic"><transform name="to_world"><translate z="-5"/></transform>
<sampler type="independent"><integer name="sample_count" value="30"/>{sampler}</sampler></sensor>
<medium id="water" type="transparent"><volume name="ior" type="acoustic">
<float name="n0" value="1.33"/>{mode}</volume></medium>
<shape type="sphere"><bsdf type="dielectric"/><ref name="interior" id="water"/></shape>
<emitter type="constant"/>
</scene>"#
    );
    fs::write(&path, text).unwrap();
    let options = LoadOptions {
        samples,
        ..LoadOptions::default()
    };
    morgana_io::load_scene(&path, &options).map_err(|d| d.to_string())
}

fn mode(time_phase: f64) -> String {
    format!(
        "<float name=\"amplitude\" value=\"0.01\"/><float name=\"wave_number\" value=\"5\"/>\
         <float name=\"time_phase\" value=\"{time_phase}\"/>"
    )
}

const PHASES: &str = "<integer name=\"phases\" value=\"8\"/>";

fn index(scene: &transport::Scene) -> f64 {
    scene.n(scene.medium_at(DVec3::ZERO), DVec3::ZERO)
}

#[test]
fn phases_are_instants_of_the_period() {
    let loaded = load(PHASES, &mode(0.3), None).unwrap();
    let scene = loaded.scene();
    assert_eq!(scene.instants(), 8);
    for i in 0..20 {
        let phase = 0.3 + PI * (i % 8) as f64 / 4.0;
        let still = load("", &mode(phase), None).unwrap();
        assert!((index(scene.at(i)) - index(still.scene())).abs() < 1e-14);
        assert!((index(scene.at(i)) - 1.33 - 0.01 * phase.cos()).abs() < 1e-14);
    }
}

#[test]
fn samples_are_a_multiple_of_the_phases() {
    let loaded = load(PHASES, &mode(0.0), None).unwrap();
    assert_eq!(loaded.samples, 32);
    let message = loaded.warnings.to_string();
    assert!(
        message.contains("32 samples are taken instead of 30"),
        "{message}"
    );
    let given = load(PHASES, &mode(0.0), Some(16)).unwrap();
    assert_eq!(given.samples, 16);
    assert!(given.warnings.is_empty(), "{}", given.warnings);
    assert_eq!(load("", &mode(0.0), None).unwrap().samples, 30);
}

#[test]
fn mistakes_are_named() {
    let none = "<float name=\"amplitude\" value=\"0\"/><float name=\"wave_number\" value=\"5\"/>";
    assert!(load(PHASES, none, None).is_ok());
    let two = "<volume type=\"mode\"><float name=\"amplitude\" value=\"0.01\"/>\
         <float name=\"wave_number\" value=\"5\"/></volume><volume type=\"mode\">\
         <float name=\"amplitude\" value=\"0.01\"/><float name=\"wave_number\" value=\"6\"/></volume>";
    let message = load(PHASES, two, None).unwrap_err();
    assert!(message.contains("several wavelengths"), "{message}");
    let zero = PHASES.replace('8', "0");
    assert!(
        load(&zero, &mode(0.0), None)
            .unwrap_err()
            .contains("'phases'")
    );
}

/// In water (1480 m/s) and a ball of 2 units, kHz mistaken for Hz makes waves too long, and metres
/// mistaken for micrometres too short.
#[test]
fn waves_that_do_not_fit_draw_a_warning() {
    let warnings = |frequency: f64, speed: f64| {
        let mode = format!(
            "<float name=\"amplitude\" value=\"0.01\"/><float name=\"frequency\" value=\"{frequency}\"/>\
             <float name=\"sound_speed\" value=\"{speed}\"/>"
        );
        load("", &mode, None).unwrap().warnings.to_string()
    };
    assert_eq!(warnings(1e6, 1.48e6), "");
    for (frequency, speed) in [(1e2, 1.48e6), (1e6, 1.48e3 * 1e-1)] {
        let message = warnings(frequency, speed);
        for part in ["wavelength", "Hz", "scene units per second"] {
            assert!(message.contains(part), "{message}");
        }
    }
}

/// A sound that is weak at ωt = 0 bends rays more strongly at later instants. The warning about
/// very many steps appears once.
#[test]
fn doubts_of_later_instants_are_told() {
    let costly = |time_phase: f64, sampler: &str| {
        let fine = mode(time_phase)
            .replace("\"0.01\"", "\"0.3\"")
            .replace("\"5\"", "\"800\"");
        let warnings = load(sampler, &fine, None).unwrap().warnings.to_string();
        warnings.matches("across medium 'water'").count()
    };
    assert_eq!([0.0, PI / 2.0].map(|phase| costly(phase, "")), [1, 0]);
    assert_eq!([0.0, PI / 2.0].map(|phase| costly(phase, PHASES)), [1, 1]);
}

/// Two media with sounds that have no common period.
#[test]
fn media_have_one_frequency() {
    let of = |hz: &str| {
        format!(
            "<float name=\"amplitude\" value=\"0.01\"/><float name=\"frequency\" value=\"{hz}\"/>\
             <float name=\"sound_speed\" value=\"1.5e6\"/>"
        )
    };
    let both = |other: &str, sampler: &str| {
        let end = format!(
            "{}</volume></medium><shape type=\"sphere\"><point name=\"center\" x=\"3\"/><bsdf type=\"dielectric\"/>\
             <medium name=\"interior\" id=\"oil\" type=\"transparent\"><volume name=\"ior\" type=\"acoustic\">\
             <float name=\"n0\" value=\"1.5\"/>{}</volume></medium></shape>\
             <medium id=\"unused\" type=\"transparent\"><volume name=\"ior\" type=\"acoustic\">\
             <float name=\"n0\" value=\"1.33\"/>{}",
            of("1e6"),
            of(other),
            of("1e6")
        );
        load(sampler, &end, None)
    };
    assert!(both("1e6", PHASES).is_ok());
    assert!(both("1.1e6", "").is_ok());
    let message = both("1.1e6", PHASES).err().unwrap();
    let expected =
        "the sound in medium 'oil' has 1100000 Hz, that in medium 'water' has 1000000 Hz";
    assert!(message.contains(expected), "{message}");
}
