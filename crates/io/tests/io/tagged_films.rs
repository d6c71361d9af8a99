//! Images and meters of tagged light by scene files: layers, readings, and refused scenes.

use morgana_io::rendered::Naming;
use morgana_io::{LoadOptions, Loaded};
use std::fs;
use transport::integrator::Integrator;
use transport::renderer::Renderer;

const WAVE: &str = r#"<float name="wavelength" value="1e-4"/>"#;
const SOUND: &str =
    r#"<float name="wave_number" value="9"/><float name="elasto_optic" value="0.32"/>"#;
const CAMERA: &str = r#"<sensor type="perspective"><float name="fov" value="40"/><film type="hdrfilm"><integer name="width" value="4"/>
<integer name="height" value="4"/><string name="pixel_format" value="luminance"/></film></sensor>"#;

fn read(sound: &str, rest: &str) -> Result<Loaded, String> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scene.xml");
    let text = format!(
        r#"<scene version="3.0.0"><emitter type="constant"/>{rest}
<medium type="homogeneous" id="fog"><float name="sigma_t" value="1"/>
<volume name="ior" type="acoustic"><float name="n0" value="1.33"/><float name="amplitude" value="1e-5"/>{sound}</volume></medium>
<shape type="sphere"><point name="center" z="5"/><bsdf type="null"/><ref name="interior" id="fog"/></shape></scene>"#
    );
    fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

/// An image by an integrator inside one that tags light.
fn pictured(inner: &str, parameters: &str) -> Result<Loaded, String> {
    let integrator = format!(
        r#"<integrator type="tagged">{parameters}<integrator type="{inner}"/></integrator>"#
    );
    read(SOUND, &format!("{integrator}{CAMERA}"))
}

#[test]
fn films_have_a_layer_for_each_order_and_delay() {
    let more = r#"<integer name="orders" value="2"/><integer name="delays" value="2"/>"#;
    for inner in ["path", "volpath", "direct", "auto"] {
        let loaded = pictured(inner, &format!("{WAVE}{more}")).unwrap();
        let is_path = matches!(loaded.renderer, Renderer::Light(Integrator::Path(_)));
        assert!(is_path && loaded.candidates.is_empty(), "{inner}");
        let naming = Naming::of(&loaded).unwrap();
        let names: Vec<String> = naming.names().collect();
        let expected = [
            "total",
            "carrier",
            "sideband.1",
            "sideband.2",
            "delay.1",
            "delay.2",
        ];
        assert_eq!(names, expected);
        let of_one_sign: Vec<bool> = (0..6).map(|i| naming.is_of_one_sign(i)).collect();
        assert_eq!(of_one_sign, [true, true, true, true, false, false]);
        let axis = &naming.axes()[0];
        assert_eq!(axis["delays"], serde_json::json!([0.25, 0.5]));
    }
    let naming = pictured("path", WAVE).unwrap();
    let naming = Naming::of(&naming).unwrap();
    assert_eq!(naming.names().count(), 3);
}

/// Light of 532 nm in metres, where the scene is in millimetres.
#[test]
fn wavelengths_in_other_units_are_doubted() {
    let warned = |wavelength: &str| {
        let wavelength = format!(r#"<float name="wavelength" value="{wavelength}"/>"#);
        let loaded = pictured("path", &wavelength).unwrap();
        loaded
            .warnings
            .to_string()
            .contains("times shorter than the sound")
    };
    assert!(warned("532e-10") && !warned("532e-6"));
}

#[test]
fn what_films_cannot_tag_is_an_error() {
    let errors = [
        (
            pictured("sppm", WAVE),
            "only 'path', 'direct', 'particle' and 'bdpt' follow phases",
        ),
        (pictured("vcm", WAVE), "'tagged' cannot contain 'vcm'"),
        (pictured("path", ""), "wavelength"),
        (
            pictured("path", r#"<float name="wavelength" value="-1"/>"#),
            "wavelength",
        ),
        (
            pictured("path", r#"<float name="wavelength" value="532"/>"#),
            "is not shorter than the sound in medium 'fog'",
        ),
        (
            pictured(
                "stokes\"><integrator type=\"path\"/></integrator><integrator type=\"path",
                WAVE,
            ),
            "not both",
        ),
    ];
    for (found, expected) in errors {
        let error = found.map(|_| ()).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
    let integrator = format!(
        r#"<integrator type="tagged">{WAVE}<integrator type="path"/></integrator>{CAMERA}"#
    );
    let unknown = read(r#"<float name="wave_number" value="9"/>"#, &integrator);
    assert!(unknown.map(|_| ()).unwrap_err().contains("'elasto_optic'"));
    let several = integrator.replace(
        "\"luminance\"/>",
        "\"spectral\"/><string name=\"wavelengths\" value=\"500, 600\"/>",
    );
    let several = read(SOUND, &several);
    assert!(several.map(|_| ()).unwrap_err().contains("one wavelength"));
    let emits = r#"<medium type="homogeneous" id="glow"><float name="sigma_t" value="1"/><rgb name="emission" value="1"/></medium>
<shape type="sphere"><point name="center" z="9"/><bsdf type="null"/><ref name="interior" id="glow"/></shape>"#;
    assert!(read(SOUND, &format!("{integrator}{emits}")).is_ok());
    for name in ["particle", "bdpt"] {
        assert!(pictured(name, WAVE).is_ok(), "{name}");
    }
}

#[test]
fn sounds_of_unknown_frequency_are_taken_to_have_one() {
    let other = |sound: &str| {
        format!(
            r#"<medium type="homogeneous" id="fat"><float name="sigma_t" value="1"/><volume name="ior" type="acoustic">
<float name="n0" value="1.33"/><float name="amplitude" value="1e-5"/><float name="elasto_optic" value="0.3"/>{sound}</volume></medium>
<shape type="sphere"><point name="center" z="9"/><bsdf type="null"/><ref name="interior" id="fat"/></shape>"#
        )
    };
    let integrator =
        format!(r#"<integrator type="tagged">{WAVE}<integrator type="path"/></integrator>"#);
    let noted = |sound: &str| {
        let loaded = read(SOUND, &format!("{integrator}{CAMERA}{}", other(sound)));
        loaded.unwrap().warnings.to_string()
    };
    let note = "the sounds in media 'fat' and 'fog', of the wavelengths";
    let differs = noted(r#"<float name="wave_number" value="8"/>"#);
    assert!(differs.contains(note), "{differs}");
    let same = noted(r#"<float name="wave_number" value="9"/>"#);
    assert!(!same.contains("assumed to have one frequency"), "{same}");
}

#[test]
fn meters_tell_sidebands_apart() {
    let meter = |parameters: &str| {
        let cells = r#"<integer name="nx" value="2"/><integer name="ny" value="2"/><integer name="nz" value="2"/>"#;
        let meter = format!(r#"<sensor type="fluencemeter">{cells}{parameters}</sensor>"#);
        read(SOUND, &format!(r#"<integrator type="particle"/>{meter}"#))
    };
    let tagged = r#"<boolean name="tagged" value="true"/>"#;
    let loaded = meter(&format!("{tagged}{WAVE}")).unwrap();
    let meter_of = |loaded: &Loaded| loaded.instruments[0].meter.clone();
    let sidebands = *meter_of(&loaded).sidebands().unwrap();
    assert_eq!((sidebands.orders(), sidebands.delays()), (1, 0));
    // Fluence, its absorbed part, and two sidebands.
    assert_eq!(meter_of(&loaded).cells(), 4 * 8);
    assert!(meter_of(&meter("").unwrap()).sidebands().is_none());
    assert!(
        meter(tagged)
            .map(|_| ())
            .unwrap_err()
            .contains("wavelength")
    );
    // A meter does not tag light unless it is asked to.
    assert!(meter(WAVE).is_err());
}

/// With tagged light, sampled sound has a spline of both parts of its amplitude: eight bytes per
/// sample, and some at the faces.
#[test]
fn memory_counts_what_phases_are_found_with() {
    let cube = |coordinates: &str| {
        format!(r#"<point name="min" {coordinates}/><point name="max" x="1" y="1" z="1"/>"#)
    };
    let sound = format!(
        r#"<volume name="ior" type="transducer"><string name="aperture" value="piston"/><float name="diameter" value="1"/><point name="origin" z="-3"/>
<float name="pressure" value="1e4"/><float name="frequency" value="1e6"/><float name="sound_speed" value="1.5e6"/><float name="n0" value="1.33"/>
<float name="dn_dp" value="1.4e-10"/><float name="elasto_optic" value="0.32"/>{}</volume>"#,
        cube(r#"x="-1" y="-1" z="-1""#)
    );
    let scene = |integrator: &str| {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("scene.xml");
        let text = format!(
            r#"<scene version="3.0.0">{integrator}{CAMERA}<emitter type="constant"/><medium type="homogeneous" id="fog">
<float name="sigma_t" value="1"/>{sound}</medium><shape type="cube"><transform name="to_world"><scale value="0.9"/></transform>
<bsdf type="null"/><ref name="interior" id="fog"/></shape></scene>"#
        );
        fs::write(&path, text).unwrap();
        morgana_io::load_scene(&path, &LoadOptions::default()).unwrap()
    };
    let memory = |integrator: &str| {
        let loaded = scene(integrator);
        let media = loaded.scene().media().iter();
        media.map(|medium| medium.memory()).sum::<usize>()
    };
    let plain = memory(r#"<integrator type="path"/>"#);
    let tagged = memory(&format!(
        r#"<integrator type="tagged">{WAVE}<integrator type="path"/></integrator>"#
    ));
    // The memory is a cube of samples a tenth of the wavelength apart, with two coefficients beyond
    // each face.
    let more = tagged - plain;
    let side = (more as f64 / 8.0).cbrt();
    assert!((side - side.round()).abs() < 1e-9, "{plain} {tagged}");
    assert!((15.0..25.0).contains(&side), "{side}");
}
