//! Messages for invalid scenes: every mistake with its line, the expected value, and a fix.

use glam::DVec3;
use morgana_io::{LoadOptions, Loaded};
use std::fs;
use std::path::Path;
use transport::emitter::Emitter;

mod sources;

const CAMERA: &str = r#"<sensor type="perspective">
  <float name="fov" value="40"/>
  <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
  <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film>
</sensor>
<emitter type="constant"/>
"#;

const POINT: &str = r#"<emitter type="point"><point name="position" value="0, 3, 0"/>
<float name="intensity" value="1"/></emitter>"#;

/// A scene with the camera from line 2 and `body` from line 8.
fn scene(body: &str) -> String {
    format!("<scene version=\"3.0.0\">\n{CAMERA}{body}\n</scene>\n")
}

fn load(body: &str) -> Result<Loaded, String> {
    load_in(tempfile::tempdir().unwrap().path(), body)
}

fn load_in(directory: &Path, body: &str) -> Result<Loaded, String> {
    load_with(directory, body, &LoadOptions::default())
}

fn load_with(directory: &Path, body: &str, options: &LoadOptions) -> Result<Loaded, String> {
    let path = directory.join("scene.xml");
    fs::write(&path, scene(body)).unwrap();
    morgana_io::load_scene(&path, options).map_err(|d| d.to_string())
}

#[track_caller]
fn refused(body: &str, expected: &[&str]) {
    let message = load(body).expect_err("the scene was accepted");
    for part in expected {
        assert!(message.contains(part), "expected {part:?} in:\n{message}");
    }
}

#[track_caller]
fn warned(body: &str, expected: &str) {
    let loaded = load(body).unwrap_or_else(|e| panic!("{e}"));
    let warnings = loaded.warnings.to_string();
    assert!(
        warnings.contains(expected),
        "expected {expected:?} in:\n{warnings}"
    );
}

fn ball(medium: &str) -> String {
    format!("<shape type=\"sphere\"><bsdf type=\"null\"/>{medium}</shape>")
}

fn graded(volume: &str) -> String {
    let medium = format!("<medium name=\"interior\" type=\"transparent\">\n{volume}\n</medium>");
    ball(&medium)
}

#[test]
fn a_plain_scene_is_accepted_without_warnings() {
    let loaded = load("<shape type=\"sphere\"/>").unwrap_or_else(|e| panic!("{e}"));
    assert!(loaded.warnings.is_empty(), "{}", loaded.warnings);
    assert_eq!(loaded.channel_names, ["R", "G", "B"]);
}

#[test]
fn misspelt_plugins_and_parameters_get_suggestions() {
    refused(
        "<shape type=\"spere\"/>",
        &["scene.xml:8:", "unknown shape type 'spere'", "sphere"],
    );
    refused(
        "<shape type=\"sphere\"><float name=\"raduis\" value=\"2\"/></shape>",
        &["scene.xml:8:", "did you mean 'radius'?"],
    );
    refused(
        &ball(
            "<medium name=\"interior\" type=\"homogeneous\"><float name=\"sigmat\" value=\"1\"/></medium>",
        ),
        &["did you mean 'sigma_t'?"],
    );
    refused(
        &graded("<volume name=\"ior\" type=\"lunberg\"/>"),
        &["luneburg"],
    );
}

#[test]
fn several_mistakes_are_reported_at_once() {
    refused(
        "<shape type=\"spere\"/>\n<shape type=\"cub\"/>\n<emitter type=\"pont\"/>",
        &[
            "scene.xml:8:",
            "scene.xml:9:",
            "scene.xml:10:",
            "sphere",
            "cube",
            "point",
        ],
    );
}

#[test]
fn missing_files_are_named() {
    refused(
        "<shape type=\"obj\"><string name=\"filename\" value=\"no_such.obj\"/></shape>",
        &["scene.xml:8:", "no_such.obj"],
    );
    refused(
        &graded(
            "<volume name=\"ior\" type=\"bspline\"><string name=\"filename\" value=\"none.npy\"/>\
             <string name=\"axis_order\" value=\"zyx\"/><string name=\"placement\" value=\"nodes\"/></volume>",
        ),
        &["none.npy"],
    );
    // Parameters that the missing file might have stated are not requested as well.
    let volume = "<volume name=\"ior\" type=\"bspline\"><string name=\"filename\" value=\"none.vti\"/></volume>";
    let message = load(&graded(volume)).unwrap_err();
    assert_eq!(message.matches("error:").count(), 1, "{message}");
}

#[test]
fn where_samples_sit_is_stated_never_guessed() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("n.npy"), npy([1.3; 8])).unwrap();
    let volume = "<volume name=\"ior\" type=\"bspline\"><string name=\"filename\" value=\"n.npy\"/></volume>";
    let message = load_in(directory.path(), &graded(volume)).unwrap_err();
    for part in ["axis_order", "placement", "centers", "nodes", "zyx"] {
        assert!(message.contains(part), "{message}");
    }
}

/// A `.npy` file of 2 × 2 × 2 doubles.
fn npy(values: [f64; 8]) -> Vec<u8> {
    let mut header = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 2, 2), }".to_owned();
    while !(10 + header.len() + 1).is_multiple_of(64) {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    bytes
}

fn grid(bytes: Vec<u8>) -> Result<Loaded, String> {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("n.npy"), bytes).unwrap();
    let volume = "<volume name=\"ior\" type=\"bspline\"><string name=\"filename\" value=\"n.npy\"/>\
        <string name=\"axis_order\" value=\"zyx\"/><string name=\"placement\" value=\"nodes\"/>\
        <transform name=\"to_world\"><scale value=\"2\"/><translate x=\"-1\" y=\"-1\" z=\"-1\"/></transform></volume>";
    load_in(directory.path(), &graded(volume))
}

#[test]
fn index_grids_are_checked() {
    grid(npy([1.3; 8])).unwrap_or_else(|e| panic!("{e}"));
    for bad in [f64::NAN, 0.0, -1.2] {
        let mut values = [1.3; 8];
        values[5] = bad;
        let message = grid(npy(values)).unwrap_err();
        // Element (z, y, x) = (1, 0, 1).
        assert!(
            message.contains("(1, 0, 1)") || message.contains("[1, 0, 1]"),
            "{message}"
        );
    }
    let mut short = npy([1.3; 8]);
    short.truncate(short.len() - 4);
    let message = grid(short).unwrap_err();
    assert!(message.contains("n.npy"), "{message}");
}

#[test]
fn zero_size_and_truncated_volumes_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let volume = |size: [i32; 3], values: usize| {
        let mut bytes = b"VOL\x03".to_vec();
        for word in [1, size[0], size[1], size[2], 1] {
            bytes.extend(word.to_le_bytes());
        }
        bytes.extend([0u8; 24]);
        bytes.extend(std::iter::repeat_n(1f32.to_le_bytes(), values).flatten());
        fs::write(directory.path().join("s.vol"), bytes).unwrap();
        let medium = "<medium name=\"interior\" type=\"heterogeneous\"><volume name=\"sigma_t\" type=\"gridvolume\">\
            <string name=\"filename\" value=\"s.vol\"/></volume></medium>";
        load_in(directory.path(), &ball(medium))
    };
    volume([2, 2, 2], 8).unwrap_or_else(|e| panic!("{e}"));
    assert!(volume([0, 2, 2], 0).unwrap_err().contains("s.vol"));
    assert!(volume([2, 2, 2], 7).unwrap_err().contains("s.vol"));
}

#[test]
fn an_index_that_is_not_positive_somewhere_is_an_error() {
    // n² = 2 − r² reaches zero at r = √2.
    refused(
        "<shape type=\"sphere\"><float name=\"radius\" value=\"1.6\"/><bsdf type=\"null\"/>\
         <medium name=\"interior\" type=\"transparent\"><volume name=\"ior\" type=\"luneburg\"/></medium></shape>",
        &["must be positive", "scene.xml:8:"],
    );
}

#[test]
fn branches_of_a_graded_ball_draw_no_warning() {
    let ball = graded("<volume name=\"ior\" type=\"luneburg\"/>");
    for body in [ball.clone(), ball + POINT] {
        let loaded = load(&body).unwrap_or_else(|e| panic!("{e}"));
        assert!(loaded.warnings.is_empty(), "{}", loaded.warnings);
    }
}

/// The mean chord of a unit ball is 4/3; its box, by which the check estimates it, has an equal
/// mean chord.
#[test]
fn paths_that_hardly_ever_end_are_a_warning() {
    let scene = |sigma_s: f64, sigma_a: f64, depth: &str| {
        let medium = format!(
            "<medium name=\"interior\" type=\"homogeneous\"><float name=\"sigma_s\" value=\"{sigma_s}\"/>\
             <float name=\"sigma_a\" value=\"{sigma_a}\"/></medium>"
        );
        format!(
            "{POINT}{}<integrator type=\"path\">{depth}</integrator>",
            ball(&medium)
        )
    };
    warned(&scene(9e6, 0.0, ""), "collides about 1e7 times");
    warned(&scene(1e30, 2.0, ""), "collides about 1e30 times");
    let short = "<integer name=\"max_depth\" value=\"1000\"/>";
    for quick in [
        scene(5e5, 0.0, ""),
        scene(1e9, 1e4, ""),
        scene(1e30, 0.0, short),
    ] {
        let warnings = load(&quick).unwrap().warnings.to_string();
        assert!(!warnings.contains("long_paths"), "{warnings}");
    }
}

#[test]
fn a_declared_match_that_is_none_is_a_warning() {
    warned(
        &ball(
            "<medium name=\"interior\" type=\"transparent\"><float name=\"ior\" value=\"1.33\"/></medium>",
        ),
        "index jumps by up to 0.33",
    );
}

/// Discs across a ball of radius 1; some extend beyond it.
#[test]
fn a_beam_starts_in_one_medium() {
    let scene = |height: f64, radius: f64| {
        let beam = format!(
            "<emitter type=\"collimated\"><float name=\"radius\" value=\"{radius}\"/><float name=\"power\" value=\"1\"/>\
             <transform name=\"to_world\"><translate z=\"{height}\"/></transform></emitter>"
        );
        let medium = "<medium name=\"interior\" type=\"homogeneous\"><float name=\"sigma_t\" value=\"1\"/></medium>";
        format!("{}{beam}", ball(medium))
    };
    // Half of the disc's area lies within a radius of √0.5.
    warned(
        &scene(0.5_f64.sqrt(), 1.0),
        "of the beam starts outside of medium 'homogeneous'",
    );
    for (height, radius) in [(0.0, 0.9), (0.7, 0.7), (-2.0, 1.0)] {
        let loaded = load(&scene(height, radius)).unwrap_or_else(|e| panic!("{e}"));
        assert!(loaded.warnings.is_empty(), "{}", loaded.warnings);
    }
}

#[test]
fn a_rough_dielectric_needs_a_jump_of_the_index() {
    let scene = |index: f64| {
        let rough = format!(
            "<bsdf type=\"roughdielectric\"><float name=\"int_ior\" value=\"{index}\"/><float name=\"ext_ior\" value=\"1\"/></bsdf>"
        );
        format!("{POINT}<shape type=\"sphere\">\n{rough}\n</shape>")
    };
    refused(&scene(1.0), &["has the same index on both sides", "'null'"]);
    warned(
        &scene(1.002),
        "nearly the same index on both sides, up to 2.0e-3 apart",
    );
    assert!(load(&scene(1.1)).unwrap().warnings.is_empty());
}

#[test]
fn singular_transforms_are_errors() {
    refused(
        "<shape type=\"cube\"><transform name=\"to_world\"><scale x=\"1\" y=\"0\" z=\"1\"/></transform></shape>",
        &["scene.xml:8:", "a scale of zero cannot be undone"],
    );
}

#[test]
fn a_camera_inside_an_opaque_shape_is_an_error() {
    refused(
        "<shape type=\"sphere\"><float name=\"radius\" value=\"9\"/><bsdf type=\"diffuse\"/></shape>",
        &["scene.xml:2:", "opaque"],
    );
}

#[test]
fn contradicting_indices_are_errors() {
    refused(
        "<shape type=\"sphere\"><bsdf type=\"dielectric\"><float name=\"int_ior\" value=\"1.5\"/></bsdf>\
         <medium name=\"interior\" type=\"transparent\"><float name=\"ior\" value=\"1.33\"/></medium></shape>",
        &["int_ior is 1.5", "index of its own"],
    );
}

#[test]
fn indices_of_dielectrics_reach_their_media() {
    let loaded = load(
        "<shape type=\"sphere\"><bsdf type=\"dielectric\"><string name=\"int_ior\" value=\"water\"/>\
         <float name=\"ext_ior\" value=\"1\"/></bsdf></shape>",
    )
    .unwrap_or_else(|e| panic!("{e}"));
    let scene = loaded.scene();
    let inside = scene.medium_at(glam::DVec3::ZERO);
    assert_eq!(scene.n(inside, glam::DVec3::ZERO), 1.333);
    assert_eq!(scene.n(0, glam::DVec3::X * 2.0), 1.0);
}

#[test]
fn a_nested_shape_is_surrounded_by_the_medium_around_it() {
    let loaded = load(
        "<shape type=\"cube\"><bsdf type=\"null\"/><medium name=\"interior\" type=\"homogeneous\"/></shape>\
         <shape type=\"sphere\"><float name=\"radius\" value=\"0.5\"/><bsdf type=\"dielectric\"/></shape>",
    )
    .unwrap_or_else(|e| panic!("{e}"));
    let scene = loaded.scene();
    let sides = scene.objects()[1].sides.unwrap();
    assert_eq!(sides.exterior, scene.medium_at(glam::DVec3::splat(0.9)));
    assert_eq!(sides.interior, scene.medium_at(glam::DVec3::ZERO));
}

#[test]
fn out_of_range_values_are_errors() {
    let medium = |parameters: &str| {
        ball(&format!(
            "<medium name=\"interior\" type=\"homogeneous\">{parameters}</medium>"
        ))
    };
    refused(
        &medium("<float name=\"albedo\" value=\"1.2\"/>"),
        &["'albedo' is 1.2"],
    );
    refused(
        &medium("<float name=\"sigma_t\" value=\"-1\"/>"),
        &["'sigma_t' is -1"],
    );
    refused(
        &medium("<phase type=\"hg\"><float name=\"g\" value=\"1\"/></phase>"),
        &["scene.xml:8:"],
    );
    refused(
        "<emitter type=\"point\"><point name=\"position\" value=\"0, 0, 1\"/><float name=\"intensity\" value=\"-1\"/></emitter>",
        &["must not be negative"],
    );
}

#[test]
fn phase_functions_are_blended_by_weight() {
    let medium = |parameters: &str| {
        ball(&format!(
            "<medium name=\"interior\" type=\"homogeneous\"><phase type=\"blendphase\">{parameters}</phase></medium>"
        ))
    };
    let two =
        "<phase type=\"rayleigh\"/><phase type=\"hg\"><float name=\"g\" value=\"0.6\"/></phase>";
    let weight = |w: f64| format!("<float name=\"weight\" value=\"{w}\"/>");
    for (w, mean) in [(0.25, 0.15), (1.0, 0.6)] {
        let loaded = load(&medium(&(weight(w) + two))).unwrap_or_else(|e| panic!("{e}"));
        let inside = loaded.scene().medium_at(glam::DVec3::ZERO);
        let phase = &loaded.scene().medium(inside).phase;
        assert!((phase.mean_cosine(glam::DVec3::ZERO).unwrap() - mean).abs() < 1e-15);
    }
    refused(&medium(&(weight(1.5) + two)), &["'weight' is 1.5"]);
    refused(&medium(two), &["needs <float name=\"weight\">"]);
    refused(
        &medium(&(weight(0.5) + "<phase type=\"rayleigh\"/>")),
        &["blendphase takes two phase functions, this has 1"],
    );
}

#[test]
fn phase_functions_are_mixed_by_shares() {
    let medium = |weights: &str, phases: &str| {
        ball(&format!(
            "<medium name=\"interior\" type=\"homogeneous\"><phase type=\"mixturephase\"><string name=\"weights\" \
             value=\"{weights}\"/>{phases}</phase></medium>"
        ))
    };
    let hg = |g: f64| format!("<phase type=\"hg\"><float name=\"g\" value=\"{g}\"/></phase>");
    let three = format!("{}{}<phase type=\"isotropic\"/>", hg(0.8), hg(-0.2));
    for (weights, mean) in [("0.5, 0.3, 0.2", 0.34), ("5 3;2", 0.34), ("0 0 1", 0.0)] {
        let loaded = load(&medium(weights, &three)).unwrap_or_else(|e| panic!("{e}"));
        let inside = loaded.scene().medium_at(glam::DVec3::ZERO);
        let phase = &loaded.scene().medium(inside).phase;
        assert!(
            (phase.mean_cosine(glam::DVec3::ZERO).unwrap() - mean).abs() < 1e-12,
            "{weights}"
        );
    }
    for weights in ["0.5, 0.5", "1, a, 0", "1, -1, 1", ""] {
        let expected = "one for each of the 3 phase functions";
        refused(&medium(weights, &three), &[expected]);
    }
    refused(
        &medium("0.2 0.2 0.2", &three),
        &["the weights must add up to 1"],
    );
    for name in ["microflake", "kkay"] {
        let phase = format!("<phase type=\"{name}\"/>");
        let medium = format!("<medium name=\"interior\" type=\"homogeneous\">{phase}</medium>");
        refused(&ball(&medium), &["use 'sggx'"]);
    }
}

#[test]
fn substances_scatter_and_absorb_as_measured() {
    let medium = |parameters: &str| {
        ball(&format!(
            "<medium name=\"interior\" type=\"homogeneous\">{parameters}</medium>"
        ))
    };
    let material = |name: &str| format!("<string name=\"material\" value=\"{name}\"/>");
    let metres = material("skin1") + "<float name=\"scale\" value=\"1000\"/>";
    let loaded = load(&medium(&metres)).unwrap_or_else(|e| panic!("{e}"));
    let inside = loaded.scene().medium_at(glam::DVec3::ZERO);
    let skin = loaded.scene().medium(inside);
    let (extinction, albedo) = (
        skin.extinction(glam::DVec3::ZERO),
        skin.albedo.at(glam::DVec3::ZERO),
    );
    let (scattering, absorption) = ([0.74, 0.88, 1.01], [0.032, 0.17, 0.48]);
    for c in 0..3 {
        let total = 1000.0 * (scattering[c] + absorption[c]);
        assert!((extinction[c] / total - 1.0).abs() < 1e-12);
        assert!((albedo[c] * extinction[c] / (1000.0 * scattering[c]) - 1.0).abs() < 1e-12);
    }
    let even = material("skin2") + "<phase type=\"isotropic\"/>";
    assert!(load(&medium(&even)).is_ok());
    let forward = material("skin2") + "<phase type=\"hg\"/>";
    refused(
        &medium(&forward),
        &["the coefficients of 'skin2' are reduced ones"],
    );
    let both = material("cream") + "<float name=\"sigma_a\" value=\"1\"/>";
    refused(
        &medium(&both),
        &["give coefficients or a material, not both"],
    );
    refused(&medium(&material("skin3")), &["'skin1'"]);
    let film = "<film type=\"hdrfilm\"><string name=\"pixel_format\" value=\"spectral\"/>\
        <string name=\"wavelengths\" value=\"500, 600\"/>";
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scene.xml");
    let text = scene(&medium(&material("skin1"))).replace("<film type=\"hdrfilm\">", film);
    fs::write(&path, text).unwrap();
    let error = morgana_io::load_scene(&path, &LoadOptions::default()).unwrap_err();
    let error = error.to_string();
    assert!(
        error.contains("materials are known in red, green and blue"),
        "{error}"
    );
}

#[test]
fn spectral_films_have_as_many_channels_as_wavelengths() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scene.xml");
    let film = "<film type=\"hdrfilm\"><string name=\"pixel_format\" value=\"spectral\"/>\
        <string name=\"wavelengths\" value=\"400, 450, 500, 550, 600, 650\"/>";
    let text = scene(
        "<shape type=\"sphere\"><bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"400:0.1, 600:0.3\"/></bsdf></shape>",
    )
    .replace("<film type=\"hdrfilm\">", film);
    fs::write(&path, text).unwrap();
    let loaded =
        morgana_io::load_scene(&path, &LoadOptions::default()).unwrap_or_else(|d| panic!("{d}"));
    assert_eq!(loaded.groups.len(), 2);
    assert_eq!(loaded.channel_names.len(), 6);
    assert_eq!(loaded.channel_names[1], "450nm");
}

/// A projector under a rotation matrix, whose linear part is given.
fn projector(matrix: &str) -> String {
    format!(
        "<emitter type=\"projector\"><float name=\"fov\" value=\"30\"/><float name=\"irradiance\" value=\"1\"/>
         <transform name=\"to_world\"><matrix value=\"{matrix}\"/></transform></emitter>"
    )
}

/// A rotation by 30 degrees rounded to three digits stretches lengths by about 4e-4; to four
/// digits, by 5e-5.
#[test]
fn what_cannot_be_deformed_takes_the_nearest_rotation() {
    let turn = |cos: &str| projector(&format!("{cos} -0.5 0 0.5 {cos} 0 0 0 1"));
    let quiet = load(&turn("0.8660")).unwrap_or_else(|e| panic!("{e}"));
    assert!(quiet.warnings.is_empty(), "{}", quiet.warnings);
    for scale in ["2 0 0 0 2 0 0 0 2", "-1 0 0 0 1 0 0 0 1"] {
        let quiet = load(&projector(scale)).unwrap_or_else(|e| panic!("{e}"));
        assert!(quiet.warnings.is_empty(), "{}", quiet.warnings);
    }
    warned(
        &turn("0.867"),
        "the transform changes lengths by up to 0.06 %, more than numbers rounded to four digits explain",
    );
    refused(
        &projector("1 0 0 0 1.1 0 0 0 1"),
        &[
            "a projector can only be rotated, mirrored and scaled evenly",
            "by up to 6.45 %",
        ],
    );
    refused(&projector("1 0.5 0 0 1 0 0 0 1"), &["can only be rotated"]);
}

/// A point or a direction replaces the transform, as in Mitsuba.
#[test]
fn a_point_or_a_direction_takes_the_place_of_a_transform() {
    let emitter = |plugin: &str, parameters: &str| {
        format!("<emitter type=\"{plugin}\">{parameters}</emitter>")
    };
    let placed = |body: &str| match load(body)
        .unwrap_or_else(|e| panic!("{e}"))
        .scene()
        .emitters()
    {
        [_, Emitter::Point { position, .. }] => *position,
        [_, Emitter::Directional { direction, .. }] => *direction,
        others => panic!("{others:?}"),
    };
    let turned = "<transform name=\"to_world\"><rotate x=\"1\" angle=\"90\"/><translate z=\"3\"/></transform>";
    let bright = "<float name=\"intensity\" value=\"1\"/>";
    let position = "<point name=\"position\" value=\"0, 3, 0\"/>";
    assert_eq!(placed(&emitter("point", bright)), DVec3::ZERO);
    assert_eq!(
        placed(&emitter("point", &format!("{bright}{position}"))),
        3.0 * DVec3::Y
    );
    assert_eq!(
        placed(&emitter("point", &format!("{bright}{turned}"))),
        3.0 * DVec3::Z
    );
    refused(
        &emitter("point", &format!("{bright}{position}{turned}")),
        &["give 'position' or 'to_world', not both"],
    );
    let bright = "<float name=\"irradiance\" value=\"1\"/>";
    let direction = "<vector name=\"direction\" value=\"0, 3, 0\"/>";
    assert_eq!(placed(&emitter("directional", bright)), DVec3::Z);
    assert_eq!(
        placed(&emitter("directional", &format!("{bright}{direction}"))),
        DVec3::Y
    );
    let along = placed(&emitter("directional", &format!("{bright}{turned}")));
    assert!(along.abs_diff_eq(-DVec3::Y, 1e-15), "{along}");
    refused(
        &emitter("directional", &format!("{bright}{direction}{turned}")),
        &["give 'direction' or 'to_world', not both"],
    );
}
