//! Fields of view, against the trigonometry of the frame.

use morgana_io::{LoadOptions, Loaded};

fn load(parameters: &str, size: [usize; 2]) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    let [width, height] = size;
    let text = format!(
        "<scene version='3.0.0'><sensor type='perspective'>{parameters}<film type='hdrfilm'>
         <integer name='width' value='{width}'/><integer name='height' value='{height}'/></film></sensor>
         <emitter type='constant'/></scene>"
    );
    std::fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

/// Slopes at which the left edge's and the upper edge's middles are seen.
fn edges(parameters: &str, size: [usize; 2]) -> [f64; 2] {
    let loaded = load(parameters, size).unwrap_or_else(|e| panic!("{e}"));
    let slope = |image| {
        let d = loaded.scene().sensor().ray(image, [0.5; 2]).direction;
        [d.x / d.z, d.y / d.z]
    };
    [slope([0.0, 0.5])[0], slope([0.5, 0.0])[1]]
}

#[track_caller]
fn close(found: [f64; 2], expected: [f64; 2]) {
    for (a, b) in found.into_iter().zip(expected) {
        assert!((a - b).abs() < 1e-12, "{found:?}, not {expected:?}");
    }
}

#[test]
fn a_focal_length_is_that_of_a_lens_for_36_by_24_mm() {
    let focal = |f: &str| format!("<string name='focal_length' value='{f}'/>");
    close(edges("", [36, 24]), [18.0 / 50.0, 12.0 / 50.0]);
    close(edges(&focal("35mm"), [36, 24]), [18.0 / 35.0, 12.0 / 35.0]);
    close(edges(&focal("100"), [24, 36]), [12.0 / 100.0, 18.0 / 100.0]);
    // The diagonal stays the same.
    let half = 12f64.hypot(18.0) / 50.0 / 2f64.sqrt();
    close(edges(&focal("50 mm"), [10, 10]), [half, half]);
}

#[test]
fn an_angle_is_along_the_axis_that_is_named() {
    let fov = |axis: &str| {
        format!("<float name='fov' value='60'/><string name='fov_axis' value='{axis}'/>")
    };
    let t = 30f64.to_radians().tan();
    close(edges(&fov("x"), [20, 10]), [t, t / 2.0]);
    close(edges(&fov("y"), [20, 10]), [2.0 * t, t]);
    close(edges(&fov("smaller"), [20, 10]), [2.0 * t, t]);
    close(edges(&fov("larger"), [20, 10]), [t, t / 2.0]);
    let d = 5f64.sqrt();
    close(edges(&fov("diagonal"), [20, 10]), [2.0 * t / d, t / d]);
}

#[test]
fn contradictions_are_refused() {
    for (parameters, expected) in [
        (
            "<float name='fov' value='60'/><string name='focal_length' value='50mm'/>",
            "give fov, or focal_length, not both",
        ),
        (
            "<string name='fov_axis' value='y'/>",
            "'fov_axis' needs 'fov'",
        ),
        (
            "<string name='focal_length' value='5cm'/>",
            "a number of millimetres such as \"50mm\", not '5cm'",
        ),
    ] {
        let refused = load(parameters, [4, 4]).unwrap_err();
        assert!(refused.contains(expected), "{refused}");
    }
}

fn scene(sensors: &str) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    let text = format!("<scene version='3.0.0'>{sensors}<emitter type='constant'/></scene>");
    std::fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

/// A camera that looks along +z from a place on the x axis.
fn camera(x: f64, contents: &str) -> String {
    format!(
        "<sensor type='perspective'><float name='fov' value='60'/>
         <transform name='to_world'><translate x='{x}'/></transform>{contents}</sensor>"
    )
}

fn film(width: usize) -> String {
    format!(
        "<film type='hdrfilm'><integer name='width' value='{width}'/><integer name='height' value='5'/></film>"
    )
}

#[test]
fn cameras_of_a_batch_share_the_film() {
    let batch = |contents: &str| format!("<sensor type='batch'>{contents}</sensor>");
    let pair = format!("{}{}", camera(1.0, &film(3)), camera(7.0, ""));
    let loaded = scene(&batch(&format!("{pair}{}", film(20)))).unwrap();
    let alone = scene(&camera(7.0, &film(10))).unwrap();
    for image in [[0.0, 0.5], [0.3, 0.1], [0.9, 0.8]] {
        let halved = [0.5 + 0.5 * image[0], image[1]];
        let ours = loaded.scene().sensor().ray(halved, [0.5; 2]);
        let expected = alone.scene().sensor().ray(image, [0.5; 2]);
        assert!(ours.origin.distance(expected.origin) < 1e-12);
        assert!(ours.direction.distance(expected.direction) < 1e-12);
    }
    for (text, expected) in [
        (
            batch(&format!("{pair}{}", film(21))),
            "21 pixels cannot be divided among 2",
        ),
        (batch(&film(20)), "one or several cameras"),
        (
            format!(
                "<integrator type='bdpt'/>{}",
                batch(&format!("{pair}{}", film(20)))
            ),
            "needs the integrator 'path'",
        ),
        (batch(&batch(&pair)), "not other batches"),
        (
            format!(
                "{}<shape type='sphere'><point name='center' x='7'/></shape>",
                batch(&format!("{pair}{}", film(20)))
            ),
            "the sensor is inside 'sphere', which is opaque",
        ),
    ] {
        let message = scene(&text).err().unwrap_or_default();
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn of_several_cameras_the_first_is_rendered() {
    let loaded = scene(&format!(
        "{}{}",
        camera(1.0, &film(4)),
        camera(7.0, &film(8))
    ))
    .unwrap();
    assert_eq!(loaded.scene().sensor().position().x, 1.0);
    assert_eq!(loaded.scene().film().width, 4);
    assert!(
        loaded
            .warnings
            .to_string()
            .contains("2 cameras: the first one is rendered")
    );
}

#[test]
fn a_radiance_meter_sees_along_a_ray() {
    let meter = |place: &str| {
        let film = film(1).replace("height' value='5'", "height' value='1'");
        scene(&format!(
            "<sensor type='radiancemeter'>{place}{film}</sensor>"
        ))
    };
    let by_ray = "<point name='origin' value='1, 2, 3'/><vector name='direction' value='0, 3, 4'/>";
    let by_map = "<transform name='to_world'><lookat origin='1, 2, 3' target='1, 5, 7' up='1, 0, 0'/></transform>";
    for place in [by_ray, by_map] {
        let loaded = meter(place).unwrap_or_else(|e| panic!("{e}"));
        for image in [[0.5, 0.5], [0.0, 1.0], [1.0, 0.3]] {
            let ray = loaded.scene().sensor().ray(image, [0.5; 2]);
            assert!(ray.origin.distance(glam::DVec3::new(1.0, 2.0, 3.0)) < 1e-12);
            let aside = ray.direction.distance(glam::DVec3::new(0.0, 0.6, 0.8));
            assert!(aside < 1.3e-5, "{aside}");
        }
    }
    for (place, expected) in [
        (format!("{by_ray}{by_map}"), "not both"),
        (by_ray.replace("0, 3, 4", "0, 0, 0"), "must not be zero"),
        (
            "<point name='origin' value='1, 2, 3'/>".to_owned(),
            "needs <vector name=\"direction\">",
        ),
    ] {
        let error = meter(&place).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
}
