//! Content of Mitsuba's scene files beside the rendered scene: folders, nested integrators,
//! references, and ignored parts.

use morgana_io::{Diagnostics, LoadOptions, Loaded, load_scene};
use std::fs;
use transport::integrator::Integrator;
use transport::renderer::Renderer;

/// A square, facing +z.
const SQUARE: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n";

/// Writes files into a temporary folder, and loads `scenes/main.xml`.
fn load_files(files: &[(&str, &str)]) -> Result<Loaded, Diagnostics> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    load_scene(
        &folder.path().join("scenes/main.xml"),
        &LoadOptions::default(),
    )
}

fn try_load(contents: &str) -> Result<Loaded, Diagnostics> {
    let text = format!("<scene version='3.0.0'>{contents}</scene>");
    load_files(&[("scenes/main.xml", &text)])
}

fn load(contents: &str) -> Loaded {
    try_load(contents).unwrap_or_else(|d| panic!("{d}"))
}

const CAMERA: &str = "<sensor type='perspective'/>";
const LIGHT: &str = "<emitter type='constant'/>";

fn path_tracer(loaded: &Loaded) -> Option<u32> {
    match loaded.renderer {
        Renderer::Light(Integrator::Path(path)) => path.max_depth,
        ref other => panic!("{}", other.name()),
    }
}

fn topics(loaded: &Loaded) -> Vec<&'static str> {
    loaded.differences.iter().map(|d| d.topic).collect()
}

/// A mesh named in a fragment is found beside the fragment, beside the main scene, or in a folder
/// that a `<path>` names.
#[test]
fn files_are_looked_for_in_three_places() {
    let main = |path: &str| {
        format!(
            "<scene version='3.0.0'>{path}<include filename='parts/shapes.xml'/>{CAMERA}{LIGHT}</scene>"
        )
    };
    let part = "<scene version='3.0.0'><shape type='obj'><string name='filename' value='square.obj'/></shape></scene>";
    let places = [
        ("scenes/parts/square.obj", ""),
        ("scenes/square.obj", ""),
        ("meshes/square.obj", "<path value='../meshes'/>"),
    ];
    for (place, path) in places {
        let main = main(path);
        let files = [
            ("scenes/main.xml", main.as_str()),
            ("scenes/parts/shapes.xml", part),
            (place, SQUARE),
        ];
        let loaded = load_files(&files).unwrap_or_else(|d| panic!("{place}: {d}"));
        assert_eq!(loaded.scene().objects().len(), 1, "{place}");
    }
    let without = main("");
    let files = [
        ("scenes/main.xml", without.as_str()),
        ("scenes/parts/shapes.xml", part),
        ("meshes/square.obj", SQUARE),
    ];
    let error = load_files(&files).unwrap_err().to_string();
    assert!(error.contains("parts/square.obj: cannot read"), "{error}");
}

/// The nearest file takes precedence, then the folder named last.
#[test]
fn the_nearest_file_is_read() {
    let main = format!(
        "<scene version='3.0.0'><path value='far'/><path value='near'/><include filename='part.xml'/>{CAMERA}{LIGHT}</scene>"
    );
    let part = |shapes: usize| {
        format!(
            "<scene version='3.0.0'>{}</scene>",
            "<shape type='rectangle'/>".repeat(shapes)
        )
    };
    let [one, two, three] = [1, 2, 3].map(part);
    let mut files = vec![
        ("scenes/main.xml", main.as_str()),
        ("scenes/far/part.xml", one.as_str()),
        ("scenes/near/part.xml", two.as_str()),
    ];
    let count = |files: &[(&str, &str)]| load_files(files).unwrap().scene().objects().len();
    assert_eq!(count(&files), 2);
    files.push(("scenes/part.xml", &three));
    assert_eq!(count(&files), 3);
}

#[test]
fn a_folder_that_is_none_is_an_error() {
    let error = try_load(&format!("<path value='nowhere'/>{CAMERA}")).unwrap_err();
    let error = error.to_string();
    assert!(error.contains("nowhere' is no folder"), "{error}");
    let many = "<path value='.'/>".repeat(200);
    let error = try_load(&many).unwrap_err().to_string();
    assert!(error.contains("too many folders"), "{error}");
}

/// Integrators that wrap others and add outputs render the first nested one.
#[test]
fn nested_integrators_render() {
    let direct =
        "<integrator type='direct'><integer name='emitter_samples' value='2'/></integrator>";
    let path = "<integrator type='path'><integer name='max_depth' value='7'/></integrator>";
    let nested = |holder: &str, nested: &str| {
        load(&format!(
            "<integrator type='{holder}'>{nested}</integrator>{CAMERA}{LIGHT}"
        ))
    };
    assert_eq!(
        path_tracer(&load(&format!("{direct}{CAMERA}{LIGHT}"))),
        Some(2)
    );
    let deeper = "<integrator type='direct'><integer name='max_depth' value='7'/></integrator>";
    let error = try_load(&format!("{deeper}{CAMERA}{LIGHT}")).unwrap_err();
    let error = error.to_string();
    assert!(error.contains("has no parameter 'max_depth'"), "{error}");
    for holder in ["moment", "stokes"] {
        let loaded = nested(holder, path);
        assert_eq!(path_tracer(&loaded), Some(7), "{holder}");
    }
    assert!(topics(&nested("moment", path)).contains(&"moment"));
    let two = format!("{path}{direct}");
    for holder in ["stokes", "moment"] {
        let topics = |nests| topics(&nested(holder, nests)).contains(&"nested integrators");
        assert!(topics(&two) && !topics(path), "{holder}");
    }
    let aovs = format!("<string name='aovs' value='dd.y:depth,nn:sh_normal'/>{path}");
    assert_eq!(path_tracer(&nested("aov", &aovs)), Some(7));
    let deep = format!("<integrator type='aov'>{aovs}</integrator>");
    assert_eq!(path_tracer(&nested("moment", &deep)), Some(7));
    // Without a nested integrator, aov renders its own quantities.
    let own = "<integrator type='aov'><string name='aovs' value='deflection'/></integrator>";
    assert!(!load(&format!("{own}{CAMERA}{LIGHT}")).renderer.is_light());
}

#[test]
fn an_integrator_that_holds_none_is_an_error() {
    let error = try_load(&format!("<integrator type='moment'/>{CAMERA}{LIGHT}")).unwrap_err();
    let error = error.to_string();
    assert!(error.contains("needs an <integrator>"), "{error}");
    let misspelt = "<integrator type='moment'><float name='x' value='1'/><integrator type='path'/></integrator>";
    let error = try_load(&format!("{misspelt}{CAMERA}{LIGHT}")).unwrap_err();
    assert!(
        error.to_string().contains("has no parameter 'x'"),
        "{error}"
    );
}

/// Objects defined at top level for references are not part of the scene by themselves.
#[test]
fn definitions_are_referred_to() {
    let loaded = load(
        "<emitter type='area' id='light'><rgb name='radiance' value='2'/></emitter>
         <sampler type='independent' id='few'><integer name='sample_count' value='3'/></sampler>
         <film type='hdrfilm' id='small'><integer name='width' value='5'/></film>
         <shape type='rectangle' id='square'><ref id='light'/></shape>
         <sensor type='perspective'><ref id='few'/><ref id='small'/></sensor>",
    );
    assert_eq!(loaded.emitter_names, ["light"]);
    assert_eq!((loaded.samples, loaded.scene().film().width), (3, 5));
    let unused = try_load(&format!("<emitter type='area' id='light'/>{CAMERA}")).unwrap_err();
    let unused = unused.to_string();
    assert!(
        unused.contains("belongs inside the shape that it covers"),
        "{unused}"
    );
}

/// Parameters without effect on the image are accepted; those that Mitsuba ignores silently cause a
/// warning.
#[test]
fn what_changes_nothing_is_accepted() {
    let loaded = load(
        "<sensor type='perspective'>
            <float name='focus_distance' value='3'/>
            <film type='hdrfilm'><boolean name='banner' value='false'/><boolean name='high_quality_edges' value='true'/></film>
         </sensor>
         <shape type='cube'>
            <bsdf type='null'/>
            <medium type='homogeneous' name='interior'>
                <boolean name='sample_emitters' value='false'/>
                <boolean name='has_spectral_extinction' value='true'/>
            </medium>
         </shape><emitter type='constant'/>",
    );
    assert!(
        loaded
            .warnings
            .to_string()
            .contains("'banner' of 'hdrfilm'")
    );
    let filtered =
        load("<sensor type='perspective'><rfilter type='box'/></sensor><emitter type='constant'/>");
    let warnings = filtered.warnings.to_string();
    assert!(warnings.contains("belongs in the film"), "{warnings}");
}

/// Heights that are not an image have no slope, which is reported.
#[test]
fn heights_without_slopes() {
    let bump = "<bsdf type='bumpmap'><texture type='checkerboard'/><float name='scale' value='2'/><bsdf type='diffuse'/></bsdf>";
    let loaded = load(&format!(
        "<shape type='rectangle'>{bump}</shape>{CAMERA}{LIGHT}"
    ));
    let warnings = loaded.warnings.to_string();
    assert!(
        warnings.contains("heights of a checkerboard have no slope"),
        "{warnings}"
    );
}

/// Glass under a normal map is still glass: the medium inside has its index.
#[test]
fn maps_of_normals_keep_indices() {
    let index = |bsdf: &str| {
        let shape = format!("<shape type='sphere'>{bsdf}</shape>");
        let camera = "<sensor type='perspective'><transform name='to_world'><translate z='-5'/></transform></sensor>";
        let loaded = load(&format!("{shape}{camera}{LIGHT}"));
        let scene = loaded.scene();
        let inside = scene.medium_at(glam::DVec3::ZERO);
        scene.media()[inside].index.n(glam::DVec3::ZERO)
    };
    let glass = "<bsdf type='dielectric'><float name='int_ior' value='1.8'/></bsdf>";
    let map = format!("<bsdf type='bumpmap'><texture type='checkerboard'/>{glass}</bsdf>");
    assert_eq!([index(glass), index(&map)], [1.8, 1.8]);
}

/// A map without a bsdf is a single mistake, reported once.
#[test]
fn a_map_of_nothing_is_one_error() {
    let map = "<bsdf type='bumpmap'><texture type='checkerboard'/></bsdf>";
    let error = try_load(&format!(
        "<shape type='rectangle'>{map}</shape>{CAMERA}{LIGHT}"
    ));
    let errors = error.unwrap_err();
    assert_eq!(errors.error_count(), 1, "{errors}");
}

/// Parameters of Mitsuba without effect on the image, in scenes of version 3.
#[test]
fn parameters_that_change_no_picture() {
    let loaded = load(
        "<integrator type='path'><float name='timeout' value='10'/><boolean name='hide_emitters' value='false'/></integrator>
         <sensor type='perspective'><float name='shutter_open' value='0'/><float name='shutter_close' value='1'/>
           <film type='hdrfilm'><boolean name='compensate' value='true'/></film></sensor>
         <emitter type='constant'/>",
    );
    assert_eq!(loaded.warnings.to_string(), "");
    for srf in [
        "<spectrum name='srf' value='400:1, 700:1'/>",
        "<spectrum name='srf' type='regular'><float name='wavelength_min' value='400'/></spectrum>",
    ] {
        let error = try_load(&format!("<sensor type='perspective'>{srf}</sensor>{LIGHT}"));
        let error = error.unwrap_err();
        assert_eq!(error.error_count(), 1, "{error}");
        assert!(
            error
                .to_string()
                .contains("does not support spectral responses"),
            "{error}"
        );
    }
}

/// Mitsuba 0.6's default camera: 45° wide, along +z, from where the larger of total width and
/// height fills the view.
#[test]
fn a_scene_without_a_sensor_is_seen() {
    let loaded = load(
        "<shape type='cube'><transform name='to_world'><scale x='2' y='1' z='3'/><translate x='5' y='6' z='7'/></transform></shape>
         <emitter type='constant'/>",
    );
    let sensor = loaded.scene().sensor();
    let middle = sensor.ray([0.5, 0.5], [0.5; 2]);
    let distance = 4.0 / (2.0 * 22.5f64.to_radians().tan());
    let expected = glam::DVec3::new(5.0, 6.0, 4.0 - distance);
    assert!(middle.origin.distance(expected) < 1e-12);
    assert!(middle.direction.distance(glam::DVec3::Z) < 1e-12);
    let edge = sensor.ray([0.0, 0.5], [0.5; 2]).direction;
    assert!(((edge.x / edge.z).abs() - 22.5f64.to_radians().tan()).abs() < 1e-12);
    let note = loaded.warnings.to_string();
    assert!(
        note.contains("note[no_sensor]: the scene has no sensor"),
        "{note}"
    );
    let empty = load(LIGHT);
    let origin = empty.scene().sensor().ray([0.5; 2], [0.5; 2]).origin;
    assert_eq!(origin, glam::DVec3::ZERO);
}

/// A beam without a radius is thin, and has the stated power.
#[test]
fn a_beam_without_a_radius_is_thin() {
    use transport::emitter::Emitter;
    let loaded = load(&format!(
        "{CAMERA}<shape type='cube'><transform name='to_world'><translate z='9'/></transform></shape>
         <emitter type='collimated'><float name='power' value='3'/></emitter>"
    ));
    let Emitter::Collimated(beam) = &loaded.scene().emitters()[0] else {
        panic!("no beam");
    };
    let radius = 1e-3 * 3f64.sqrt();
    let area = std::f64::consts::PI * radius * radius;
    let irradiance = beam.irradiance(glam::DVec3::ZERO)[0];
    assert!((irradiance * area / 3.0 - 1.0).abs() < 1e-9, "{irradiance}");
    let note = loaded.warnings.to_string();
    assert!(note.contains("a beam without a 'radius'"), "{note}");
}

/// The film of a Mitsuba meter may have pixels. They have no effect, and cause a warning if there
/// are several.
#[test]
fn films_of_meters_have_pixels() {
    let meter = |film: &str| {
        format!(
            "<integrator type='particle'/>{LIGHT}<shape type='rectangle'><sensor type='irradiancemeter'>{film}</sensor></shape>"
        )
    };
    let loaded = load(&meter(
        "<film type='hdrfilm'><integer name='width' value='16'/><integer name='height' value='8'/><rfilter type='box'/></film>",
    ));
    assert_eq!(loaded.instruments.len(), 1);
    let warnings = loaded.warnings.to_string();
    assert!(
        warnings.contains("'nu' and 'nv' of the meter"),
        "{warnings}"
    );
    let old = format!(
        "<scene version='0.6.0'>{}</scene>",
        meter("<film type='mfilm'/>")
    );
    let loaded = load_files(&[("scenes/main.xml", &old)]).unwrap_or_else(|d| panic!("{d}"));
    assert_eq!(loaded.instruments.len(), 1);
}

/// A file that is nowhere else is looked for in the current folder, which is the crate's folder in
/// tests.
#[test]
fn files_in_the_current_folder_are_found_last() {
    let include = "<include filename='tests/data/part_of_a_scene.xml'/>";
    let loaded = load(&format!("{CAMERA}{LIGHT}{include}"));
    assert_eq!(loaded.scene().objects().len(), 1);
}

/// Hair has the stated thickness times the scale of its transform: a strand along x from 0 to 1, of
/// radius 0.1.
#[test]
fn hair_is_scaled_with_its_radius() {
    let text = format!(
        "<scene version='0.6.0'><sensor type='perspective'><transform name='toWorld'><translate z='-9'/></transform></sensor>
         <shape type='hair'><string name='filename' value='h.hair'/><float name='radius' value='0.1'/>
         <float name='angleThreshold' value='2'/><transform name='toWorld'><scale value='2'/></transform></shape>{LIGHT}</scene>"
    );
    let files = [
        ("scenes/main.xml", text.as_str()),
        ("scenes/h.hair", "0 0 0\n0.5 0 0\n1 0 0\n"),
    ];
    let loaded = load_files(&files).unwrap_or_else(|d| panic!("{d}"));
    let aabb = loaded.scene().objects()[0].shape.aabb();
    let half = (aabb.max - aabb.min) / 2.0;
    assert!(
        half.distance(glam::DVec3::new(1.2, 0.2, 0.2)) < 0.01,
        "{half}"
    );
    let area = loaded.scene().objects()[0].shape.area();
    // Two balls swept along lines overlap at the joint, so that some of their surface lies inside.
    assert!(area > std::f64::consts::TAU * 0.2 * 2.0, "{area}");
}
