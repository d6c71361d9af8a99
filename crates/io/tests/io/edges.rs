//! Scenes at the limits of what plugins accept.

use morgana_io::{LoadOptions, Loaded, Run};

/// A scene of 4 × 4 pixels under a sky of radiance 1, with given contents.
fn load(version: &str, film: &str, contents: &str) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    let [to_world, count] = if version.starts_with('0') {
        ["toWorld", "sampleCount"]
    } else {
        ["to_world", "sample_count"]
    };
    let text = format!(
        r#"<scene version="{version}"><sensor type="perspective"><transform name="{to_world}"><translate z="-4"/></transform>
<sampler type="independent"><integer name="{count}" value="4"/></sampler>
<film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/>{film}</film></sensor>
<emitter type="constant"/>{contents}</scene>"#
    );
    std::fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

#[track_caller]
fn refused(contents: &str, expected: &str) {
    let message = load("3.0.0", "", contents).expect_err("the scene was accepted");
    assert!(message.contains(expected), "{message}");
}

fn fog(medium: &str, extinction: &str) -> Vec<f32> {
    let ball = format!(
        r#"<shape type="sphere"><bsdf type="null"/><medium type="{medium}" name="interior">{extinction}
<float name="albedo" value="0"/></medium></shape>"#
    );
    let loaded = load("3.0.0", "", &ball).unwrap_or_else(|e| panic!("{e}"));
    Run::new(&loaded).render().unwrap().film.mean()
}

/// Constant volumes fill homogeneous media. Only in `heterogeneous` media do they end at the cube
/// of the volume, here from 0 to 1 along each axis, as in Mitsuba.
#[test]
fn constant_volumes_fill_homogeneous_media() {
    let number = r#"<float name="sigma_t" value="1"/>"#;
    let volume =
        r#"<volume type="constvolume" name="sigma_t"><float name="value" value="1"/></volume>"#;
    let filled = fog("homogeneous", number);
    assert_eq!(fog("homogeneous", volume), filled);
    let bounded = fog("heterogeneous", volume);
    let light = |image: &[f32]| image.iter().sum::<f32>();
    assert!(light(&bounded) > light(&filled) + 1.0);
}

#[test]
fn integrators_that_speed_others_up_are_those() {
    let frame = |inner: &str| format!(r#"<integrator type="adaptive">{inner}</integrator>"#);
    let inner = r#"<sampler type="independent"/><integrator type="direct"/>"#;
    let loaded = load("0.6.0", "", &frame(inner)).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(loaded.renderer.depths().0, Some(2));
    let message = load("0.6.0", "", &frame("")).unwrap_err();
    assert!(
        message.contains("unknown integrator type 'adaptive'"),
        "{message}"
    );
}

/// Plugins that only Mitsuba has are reported with a replacement.
#[test]
fn missing_plugins_name_a_substitute() {
    let message = load("3.0.0", "", r#"<integrator type="prb"/>"#).unwrap_err();
    let said = ["unknown integrator type 'prb'", "render with 'path'"];
    assert!(said.iter().all(|s| message.contains(s)), "{message}");
}

#[test]
fn mixtures_of_phase_functions_are_bounded() {
    let mixture = |weights: &str, count: usize| {
        let phases = "<phase type=\"isotropic\"/>".repeat(count);
        format!(
            r#"<shape type="sphere"><bsdf type="null"/><medium type="homogeneous" name="interior"><float name="albedo" value="0.5"/>
<phase type="mixturephase"><string name="weights" value="{weights}"/>{phases}</phase></medium></shape>"#
        )
    };
    load("3.0.0", "", &mixture("0.5, 0.5", 2)).unwrap_or_else(|e| panic!("{e}"));
    refused(
        &mixture(&vec!["1"; 101].join(","), 101),
        "at most 100 phase functions",
    );
    for weights in ["inf, 1", "1e308, 1e308", "-1, 2"] {
        refused(&mixture(weights, 2), "'weights' are numbers from 0");
    }
}

#[test]
fn names_of_quantities_differ() {
    let aov = |list: &str| {
        format!(
            r#"<integrator type="moment"><integrator type="aov"><string name="aovs" value="{list}"/>
<integrator type="path" name="img"/></integrator></integrator>"#
        )
    };
    load("3.0.0", "", &aov("a:albedo, b:depth")).unwrap_or_else(|e| panic!("{e}"));
    refused(
        &aov("a:albedo, a:depth"),
        "two quantities have the name 'a'",
    );
    refused(&aov("img:albedo"), "both have the name 'img'");
}

#[test]
fn factors_of_textures_count_channel_by_channel() {
    let ball = |texture: &str| {
        format!(r#"<shape type="sphere"><bsdf type="diffuse">{texture}</bsdf></shape>"#)
    };
    let scaled = |scale: &str, value: &str| {
        format!(
            r#"<texture type="scale" name="reflectance"><rgb name="scale" value="{scale}"/><rgb name="value" value="{value}"/></texture>"#
        )
    };
    load("3.0.0", "", &ball(&scaled("1, 2, 1", "0.9, 0.3, 0.9"))).unwrap_or_else(|e| panic!("{e}"));
    refused(&ball(&scaled("1, 2, 1", "0.9, 0.6, 0.9")), "reflectance");
    let luminance = r#"<string name="pixel_format" value="luminance"/>"#;
    let message = load("3.0.0", luminance, &ball(&scaled("1, 0, 0", "1, 0, 0"))).unwrap_err();
    assert!(message.contains("a colour cannot scale"), "{message}");
    // The number of evaluations is the number of textures.
    let mut texture = String::from(r#"<rgb name="value" value="0.5"/>"#);
    for k in 0..30 {
        let role = if k == 29 { "name=\"reflectance\"" } else { "" };
        texture = format!(r#"<texture type="scale" {role}>{texture}</texture>"#);
    }
    load("3.0.0", "", &ball(&texture)).unwrap_or_else(|e| panic!("{e}"));
}
