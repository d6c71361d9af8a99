//! Fields of view, compared with the trigonometry of the frame.

use morgana_io::{LoadOptions, Loaded};
use transport::aov::{Aov, AovTracer};
use transport::path::Workspace;

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

/// Slopes at which the middles of the left and the upper edge are seen.
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
    // The diagonal is unchanged.
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

/// A camera that looks along +z from a point of the x axis.
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

/// Surfaces that face inwards are rooms and domes, and may contain the sensor.
#[test]
fn sensors_are_inside_surfaces_that_face_inwards() {
    let room = |shape: &str, more: &str| {
        let large = "<transform name='to_world'><scale value='20'/></transform>";
        let shape = format!("<shape type='{shape}'>{large}{more}</shape>");
        scene(&format!("{}{shape}", camera(1.0, &film(4)))).err()
    };
    let turned = "<boolean name='flip_normals' value='true'/>";
    for shape in ["sphere", "cube"] {
        let message = room(shape, "").unwrap();
        assert!(message.contains("the sensor is inside"), "{message}");
        assert!(message.contains("flip_normals"), "{message}");
        assert_eq!(room(shape, turned), None);
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

/// A sensor at (1, 2, 3) that looks along +x, with its local axes three times as long, and a plane
/// in focus at x = 7: two local units ahead.
fn focused(plugin: &str, parameters: &str) -> Result<Loaded, String> {
    scene(&format!(
        "<sensor type='{plugin}'>{parameters}<transform name='to_world'><scale value='3'/>
         <lookat origin='1, 2, 3' target='2, 2, 3' up='0, 1, 0'/></transform></sensor>"
    ))
}

#[test]
fn the_plane_in_focus_is_named_by_a_distance_or_a_point() {
    for (plugin, optics) in [
        ("thinlens", "<float name='aperture_radius' value='0.2'/>"),
        ("telecentric", "<float name='acceptance_angle' value='2'/>"),
    ] {
        for place in [
            "<float name='focus_distance' value='2'/>",
            "<point name='focus_point' value='7, -4, 30'/>",
        ] {
            let loaded = focused(plugin, &format!("{optics}{place}"));
            let loaded = loaded.unwrap_or_else(|e| panic!("{e}"));
            let at_focus = |lens| {
                let ray = loaded.scene().sensor().ray([0.2, 0.7], lens);
                ray.origin + ray.direction * ((7.0 - ray.origin.x) / ray.direction.x)
            };
            let first = at_focus([0.5; 2]);
            for lens in [[0.1, 0.3], [0.9, 0.8], [0.4, 0.05]] {
                let aside = at_focus(lens).distance(first);
                assert!(aside < 1e-12, "{plugin}, {place}: {aside}");
            }
        }
        for (place, expected) in [
            (
                "<float name='focus_distance' value='2'/><point name='focus_point' value='7, 2, 3'/>",
                "give focus_distance, or focus_point, not both",
            ),
            (
                "<point name='focus_point' value='-1, 2, 3'/>",
                "the point must be in front of the sensor",
            ),
        ] {
            let refused = focused(plugin, &format!("{optics}{place}")).unwrap_err();
            assert!(refused.contains(expected), "{refused}");
        }
    }
}

/// Focus distances are measured without refraction: a point at depth d behind a flat face at
/// distance a is in focus at a + d/n. Focused at the true distance, the disc of confusion has the
/// radius r d (n − 1)/n/(a + d) for a lens of radius r, to the square of the angles.
#[test]
fn focus_behind_a_face_is_at_the_apparent_distance() {
    let (radius, face, depth, n) = (0.01, 4.0, 3.0, 1.5);
    let confusion = |focus: f64| {
        let loaded = scene(&format!(
            "<sensor type='thinlens'><float name='aperture_radius' value='{radius}'/>
               <float name='focus_distance' value='{focus}'/>{film}</sensor>
             <shape type='cube'><transform name='to_world'><scale value='20'/><translate z='{middle}'/></transform>
               <bsdf type='dielectric'><float name='int_ior' value='{n}'/></bsdf></shape>
             <shape type='rectangle'><transform name='to_world'><scale value='5'/><translate z='{wall}'/></transform>
               <bsdf type='twosided'><bsdf type='diffuse'/></bsdf></shape>",
            film = film(5),
            middle = face + 20.0,
            wall = face + depth,
        ));
        let loaded = loaded.unwrap_or_else(|e| panic!("{e}"));
        let scene = loaded.scene();
        let tracer = AovTracer::new(&[Aov::ExitPosition]);
        let mut ws = Workspace::new(scene.tolerance());
        let arrive = |lens| {
            let ray = scene.sensor().ray([0.5; 2], lens);
            let (start, mut values) = (ray.origin, Vec::new());
            tracer.sample(scene, ray, &mut ws, &mut values);
            assert_eq!(values[0], 1.0);
            assert!((values[3] - face - depth).abs() < 1e-9, "{values:?}");
            values[1].hypot(values[2]) / start.length() * radius
        };
        let lenses = [[0.1, 0.3], [0.9, 0.8], [0.4, 0.05]];
        lenses.map(arrive).into_iter().fold(0.0, f64::max)
    };
    let apparent = face + depth / n;
    assert!(confusion(apparent) < 1e-7, "{}", confusion(apparent));
    let blurred = radius * depth * (n - 1.0) / n / (face + depth);
    assert!((confusion(face + depth) - blurred).abs() < 1e-7);
}

/// A camera on a film of three wavelengths, or of colours.
fn load_diffracting(kind: &str, parameters: &str, film: &str) -> Result<Loaded, String> {
    let text = format!(
        "<scene version='3.0.0'><sensor type='{kind}'>{parameters}<film type='hdrfilm'>
         <integer name='width' value='4'/><integer name='height' value='4'/>{film}</film></sensor>
         <emitter type='constant'/></scene>"
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    std::fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

const LINES: &str = "<string name='pixel_format' value='spectral'/><string name='wavelengths' value='450, 550, 900'/>";
const DIFFRACTION: &str =
    "<boolean name='diffraction' value='true'/><float name='metres_per_unit' value='1e-3'/>";

#[test]
fn each_wavelength_is_diffracted_as_far() {
    let offset = |loaded: &Loaded, group: usize| {
        let sensor = loaded.groups[group].sensor();
        sensor.point_spread().unwrap().offset(1.0, || [0.5, 0.0])[0]
    };
    // Half of the light lies within v = 1.680225 (Rayleigh).
    let v = 1.680_225;
    let lens = format!(
        "<float name='fov' value='2'/><float name='aperture_radius' value='0.5'/>{DIFFRACTION}"
    );
    let lens = load_diffracting("thinlens", &lens, LINES).unwrap();
    let stop = format!("<float name='acceptance_angle' value='3'/>{DIFFRACTION}");
    let stop = load_diffracting("telecentric", &stop, LINES).unwrap();
    assert_eq!([lens.groups.len(), stop.groups.len()], [3, 3]);
    for (group, nm) in [450.0, 550.0, 900.0].into_iter().enumerate() {
        // In millimetres; images are 2 tan 1° wide at unit distance, and 2.
        let slope = v * nm * 1e-6 / (2.0 * std::f64::consts::PI * 0.5);
        let expected = slope / (2.0 * 1f64.to_radians().tan());
        assert!((offset(&lens, group) / expected - 1.0).abs() < 1e-5);
        let place = v * nm * 1e-6 / (2.0 * std::f64::consts::PI * 3f64.to_radians().sin());
        assert!((offset(&stop, group) / (place / 2.0) - 1.0).abs() < 1e-5);
    }
    let without = "<float name='aperture_radius' value='0.5'/>";
    let without = load_diffracting("thinlens", without, LINES).unwrap();
    assert!(without.groups.len() == 1 && without.scene().sensor().point_spread().is_none());
}

#[test]
fn diffraction_says_what_it_needs() {
    let lens = "<float name='aperture_radius' value='0.5'/>";
    let stop = "<float name='acceptance_angle' value='3'/>";
    let sheared = "<transform name='to_world'><matrix value='1 0.5 0 0 0 1 0 0 0 0 1 0 0 0 0 1'/></transform>";
    let on = "<boolean name='diffraction' value='true'/>";
    let knife = "<vector name='knife_edge' value='1, 0, 0'/>";
    for (kind, parameters, film, expected) in [
        (
            "thinlens",
            format!("{lens}{DIFFRACTION}"),
            "",
            "the pixel_format 'spectral'",
        ),
        ("thinlens", format!("{lens}{on}"), LINES, "metres_per_unit"),
        (
            "thinlens",
            format!("{lens}{DIFFRACTION}{sheared}"),
            LINES,
            "must not shear",
        ),
        (
            "thinlens",
            format!("{lens}<float name='metres_per_unit' value='1'/>"),
            LINES,
            "matters to 'diffraction' only",
        ),
        (
            "thinlens",
            format!("{lens}<float name='obscuration' value='1'/>"),
            LINES,
            "obscuration",
        ),
        (
            "telecentric",
            format!("{stop}{DIFFRACTION}{knife}"),
            LINES,
            "a knife edge or 'diffraction', not both",
        ),
        (
            "telecentric",
            format!("{stop}{knife}<float name='obscuration' value='0.5'/>"),
            LINES,
            "a knife edge or 'obscuration', not both",
        ),
        (
            "telecentric",
            format!("{stop}{knife}<integer name='blades' value='5'/>"),
            LINES,
            "a knife edge or 'blades', not both",
        ),
        (
            "thinlens",
            format!("{lens}<integer name='blades' value='2'/>"),
            LINES,
            "blades",
        ),
        (
            "thinlens",
            format!("{lens}<integer name='vanes' value='3'/>"),
            LINES,
            "vane_width",
        ),
        (
            "thinlens",
            format!("{lens}<float name='vane_width' value='0.1'/>"),
            LINES,
            "'vane_width' needs 'vanes'",
        ),
        ("perspective", DIFFRACTION.to_owned(), LINES, "diffraction"),
        (
            "batch",
            format!("<sensor type='thinlens'>{lens}{DIFFRACTION}</sensor>"),
            LINES,
            "a camera of a batch cannot have 'diffraction'",
        ),
    ] {
        let refused = load_diffracting(kind, &parameters, film).expect_err(expected);
        assert!(refused.contains(expected), "{expected}: {refused}");
    }
}

/// Returns the fraction of ray starts on the lens, relative to the aperture's square, for which
/// `of` holds.
fn open_share(loaded: &Loaded, of: impl Fn([f64; 2]) -> bool) -> f64 {
    let starts = (0..10_000).map(|i| {
        let lens = [i % 100, i / 100].map(|k| (f64::from(k) + 0.5) / 100.0);
        let start = loaded.scene().sensor().ray([0.5; 2], lens).origin;
        [start.x / 0.5, start.y / 0.5]
    });
    starts.filter(|p| of(*p)).count() as f64 / 1e4
}

/// All wavelengths share an aperture with a triangle, whose corner points left (+x), and a bar
/// pointing up.
#[test]
fn blades_and_vanes_cover_a_lens() {
    let lens = format!(
        "<float name='aperture_radius' value='0.5'/>{DIFFRACTION}
         <integer name='blades' value='3'/><integer name='vanes' value='1'/>
         <float name='vane_width' value='0.2'/><float name='vane_angle' value='90'/>"
    );
    let loaded = load_diffracting("thinlens", &lens, LINES).unwrap();
    assert!(open_share(&loaded, |[x, _]| x < -0.51) < 1e-3);
    assert!(open_share(&loaded, |[x, _]| x > 0.9) > 0.0);
    let in_bar = |[x, y]: [f64; 2]| x.abs() < 0.09 && y > 0.0;
    assert_eq!(open_share(&loaded, in_bar), 0.0);
    assert!(open_share(&loaded, |[x, y]| in_bar([x, -y])) > 0.03);
    // Offsets are proportional to the wavelength.
    let offset = |group: usize| {
        let spread = loaded.groups[group].sensor().point_spread().unwrap();
        spread.offset(1.0, || [0.3, 0.6])
    };
    let (blue, red) = (offset(0), offset(2));
    for axis in 0..2 {
        assert!(
            (red[axis] / blue[axis] - 2.0).abs() < 1e-9,
            "{blue:?} {red:?}"
        );
    }
}

/// The left half of an aperture image transmits a third as much as the right half.
#[test]
fn a_picture_says_what_of_a_lens_is_open() {
    let scene = |data: &str, more: &str| {
        let text = format!(
            r#"{{"type": "scene", "e": {{"type": "constant"}}, "s": {{"type": "thinlens", "aperture_radius": 0.5{more},
                "aperture": {{"type": "bitmap", "data": {data}}}}}}}"#
        );
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.json");
        std::fs::write(&path, text).unwrap();
        morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
    };
    let loaded = scene("[[[0.3], [0.9]], [[0.3], [0.9]]]", "").unwrap();
    let left = open_share(&loaded, |[x, _]| x > 0.0);
    assert!((left - 0.25).abs() < 0.01, "{left}");
    let corner = open_share(&loaded, |[x, y]| x < -0.8 && y < -0.8);
    assert!(corner > 0.0, "the corners of the square are open, too");
    for (data, more, expected) in [
        (
            "[[[1], [1]]]",
            "",
            "must be as wide as high, but it has 2 x 1 pixels",
        ),
        ("[[[1.5]]]", "", "[0, 1]"),
        ("[[[0]]]", "", "the aperture is completely covered"),
        (
            "[[[1]]]",
            r#", "blades": 6"#,
            "a picture of the aperture, or 'blades', not both",
        ),
    ] {
        let refused = scene(data, more).expect_err(expected);
        assert!(refused.contains(expected), "{expected}: {refused}");
    }
}

/// Parts that depend on an invalid part cause no further messages.
#[test]
fn one_mistake_is_one_error() {
    let number = DIFFRACTION.replace(
        "boolean name='diffraction' value='true'",
        "integer name='diffraction' value='1'",
    );
    let lines = |list: &str| LINES.replace("450, 550, 900", list);
    let blades = format!("{DIFFRACTION}<integer name='blades' value='2'/>");
    for (diffraction, film, expected) in [
        (&*blades, LINES, "'blades' is 2 but must be at least 3"),
        (
            &*number,
            LINES,
            "'diffraction': expected <boolean>, found <integer>",
        ),
        (
            DIFFRACTION,
            &*lines("red"),
            "expected positive numbers in nanometres",
        ),
        (
            DIFFRACTION,
            "<string name='pixel_format' value='spectral'/>",
            "a spectral film needs 'wavelengths'",
        ),
    ] {
        let parameters = format!("<float name='aperture_radius' value='0.5'/>{diffraction}");
        let refused = load_diffracting("thinlens", &parameters, film).expect_err(expected);
        assert!(refused.contains(expected), "{expected}: {refused}");
        assert_eq!(refused.matches("error").count(), 1, "{refused}");
    }
}
