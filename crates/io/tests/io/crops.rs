//! Crops of films, shifted images, and filters with negative lobes.
//!
//! False-alarm rate: 1e-3 for each comparison of estimators, over all pixels.

use morgana_io::{LoadOptions, Loaded, Run};
use std::fs;
use testkit::z_test::max_abs_z;

const FAMILY: f64 = 1e-3;
/// Samples per pixel, enough for normal means of particles in a pixel.
const SAMPLES: u64 = 4000;

/// A ball on a floor without mirrors under a point light, seen by a camera with these parameters
/// and this film.
fn load(integrator: &str, camera: &str, film: &str) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    let text = format!(
        r#"<scene version="3.0.0"><integrator type="{integrator}"/>
<sensor type="perspective"><float name="fov" value="50"/>{camera}
<transform name="to_world"><lookat origin="0, 1, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
<film type="hdrfilm">{film}</film></sensor>
<emitter type="point"><rgb name="intensity" value="20"/><point name="position" x="1" y="4" z="2"/></emitter>
<shape type="sphere"><bsdf type="diffuse"/></shape>
<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/><scale value="3"/><translate y="-1"/></transform>
<bsdf type="diffuse"/></shape>
</scene>"#
    );
    fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

fn film(parameters: &[(&str, i64)], filter: &str) -> String {
    let numbers = parameters
        .iter()
        .map(|(name, value)| format!("<integer name=\"{name}\" value=\"{value}\"/>"));
    numbers.collect::<String>() + filter
}

const WHOLE: [(&str, i64); 2] = [("width", 12), ("height", 8)];
const PART: [(&str, i64); 6] = [
    ("width", 12),
    ("height", 8),
    ("crop_offset_x", 4),
    ("crop_offset_y", 3),
    ("crop_width", 6),
    ("crop_height", 4),
];

/// Means and variances of the first channel, row by row.
fn rendered(loaded: &Loaded, spp: u64) -> Vec<[f64; 2]> {
    let run = Run {
        total: Some(spp),
        ..Run::new(loaded)
    };
    let rendering = run.render().unwrap();
    let film = &rendering.film;
    let pixel = |i| [film.mean_at(None, 0, i), film.variance_at(None, 0, i)].map(f64::from);
    (0..film.width() * film.height()).map(pixel).collect()
}

/// Light below this value, in pixels of up to 0.2, comes from too few samples for known errors.
const DARK: f64 = 1e-4;

fn z([mean, variance]: [f64; 2], [other, other_variance]: [f64; 2]) -> f64 {
    (mean - other) / (variance + other_variance + DARK * DARK).sqrt()
}

/// Compares `path`, from the sensor, with `particle`, from the light.
#[track_caller]
fn estimators_agree(film: &str) {
    let [path, particle] = ["path", "particle"].map(|integrator| {
        let loaded = load(integrator, "", film).unwrap();
        rendered(&loaded, SAMPLES)
    });
    let zs: Vec<f64> = path
        .into_iter()
        .zip(particle)
        .map(|(a, b)| z(a, b))
        .collect();
    max_abs_z(&zs, FAMILY).unwrap();
}

#[test]
fn a_part_of_a_film_is_that_part_of_the_picture() {
    let filter = "<rfilter type=\"tent\"/>";
    let whole = rendered(&load("path", "", &film(&WHOLE, filter)).unwrap(), SAMPLES);
    let part = rendered(&load("path", "", &film(&PART, filter)).unwrap(), SAMPLES);
    assert_eq!(part.len(), 24);
    let of_whole = (0..24).map(|i| whole[(3 + i / 6) * 12 + 4 + i % 6]);
    let zs: Vec<f64> = part
        .into_iter()
        .zip(of_whole)
        .map(|(a, b)| z(a, b))
        .collect();
    max_abs_z(&zs, FAMILY).unwrap();
    estimators_agree(&film(&PART, filter));
}

#[test]
fn filters_with_negative_lobes_are_the_same_from_either_end() {
    for filter in ["mitchell", "catmullrom", "lanczos"] {
        estimators_agree(&film(&WHOLE, &format!("<rfilter type=\"{filter}\"/>")));
    }
}

/// An offset of a quarter of the width shifts the image to the right by as many pixels.
#[test]
fn principal_points_shift_the_picture() {
    let shift = "<float name=\"principal_point_offset_x\" value=\"0.25\"/>
                 <float name=\"principal_point_offset_y\" value=\"-0.125\"/>";
    let shifted = load("path", shift, &film(&WHOLE, "")).unwrap();
    let spec = shifted.scene().film();
    for [x, y] in [[3.0, 2.0], [0.0, 8.0]] {
        let [s, t] = spec.image([x, y]);
        assert!((s - (x + 3.0) / 12.0).abs() < 1e-12 && (t - (y - 1.0) / 8.0).abs() < 1e-12);
        let [back, down] = spec.position([s, t]);
        assert!((back - x).abs() < 1e-12 && (down - y).abs() < 1e-12);
    }
}

#[test]
fn parts_beyond_the_film_are_refused() {
    for (parameters, expected) in [
        ([("width", 12), ("crop_offset_x", 12)], "crop_offset_x"),
        ([("width", 12), ("crop_width", 13)], "crop_width"),
        ([("height", 8), ("crop_height", 0)], "crop_height"),
    ] {
        let message = load("path", "", &film(&parameters, "")).unwrap_err();
        assert!(message.contains(expected), "{message}");
    }
}
