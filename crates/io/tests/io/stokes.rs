//! Stokes parameters by scene files: layers, and refused scenes.

use morgana_io::rendered::Naming;
use morgana_io::{LoadOptions, Loaded};
use std::fs;
use transport::film::LightParts;
use transport::integrator::Integrator;
use transport::renderer::Renderer;

/// A scene with an integrator and a surface, from line 2.
fn load(integrator: &str, bsdf: &str, film: &str) -> Result<Loaded, String> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scene.xml");
    let text = format!(
        r#"<scene version="3.0.0"><integrator type="stokes"><integrator type="{integrator}"/></integrator>
<sensor type="perspective"><float name="fov" value="40"/><film type="hdrfilm"><integer name="width" value="4"/>
<integer name="height" value="4"/>{film}</film></sensor>
<emitter type="constant"/>
<shape type="sphere"><point name="center" z="5"/><bsdf type="{bsdf}"/></shape>
</scene>"#
    );
    fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

#[test]
fn films_have_four_layers_for_each_layer_of_light() {
    for integrator in ["path", "volpath", "direct", "auto"] {
        let loaded = load(integrator, "conductor", "").unwrap();
        let parts = loaded.layering.decomposition.parts;
        assert_eq!(parts, Some(LightParts::Stokes));
        let is_path = matches!(loaded.renderer, Renderer::Light(Integrator::Path(_)));
        assert!(is_path && loaded.candidates.is_empty(), "{integrator}");
        let naming = Naming::of(&loaded).unwrap();
        let names: Vec<String> = naming.names().collect();
        assert_eq!(names, ["S0", "S1", "S2", "S3"]);
    }
    let by_bounces =
        r#"<string name="decomposition" value="bounce"/><integer name="max_bounces" value="1"/>"#;
    let loaded = load("path", "conductor", by_bounces).unwrap();
    let naming = Naming::of(&loaded).unwrap();
    let names: Vec<String> = naming.names().collect();
    assert_eq!(names.len(), 12);
    assert_eq!(
        names[..5],
        [
            "bounce.0.S0",
            "bounce.0.S1",
            "bounce.0.S2",
            "bounce.0.S3",
            "bounce.1.S0"
        ]
    );
    let signed: Vec<bool> = (0..5).map(|i| naming.is_of_one_sign(i)).collect();
    assert_eq!(signed, [true, false, false, false, true]);
}

#[test]
fn what_depolarises_is_noted() {
    let notes = |bsdf: &str| {
        let loaded = load("path", bsdf, "").unwrap();
        loaded.warnings.to_string()
    };
    for bsdf in [
        "conductor",
        "dielectric",
        "roughconductor",
        "thindielectric",
    ] {
        assert!(!notes(bsdf).contains("unpolarised"), "{bsdf}");
    }
    for bsdf in ["diffuse", "roughplastic"] {
        let notes = notes(bsdf);
        let expected = "morgana treats light as unpolarised after scattering by: surface '";
        assert!(notes.contains(expected), "{notes}");
    }
}

#[test]
fn panes_alone_are_followed() {
    assert!(load("path", "thindielectric", "").is_ok());
}

#[test]
fn what_polarised_light_is_not_followed_through_is_an_error() {
    for (integrator, bsdf, expected) in [
        (
            "vcm",
            "conductor",
            "only 'path', 'direct', 'particle' and 'bdpt' follow polarisation",
        ),
        ("sppm", "conductor", "'stokes' cannot contain 'sppm'"),
        ("aov", "conductor", "'stokes' cannot contain 'aov'"),
    ] {
        let error = load(integrator, bsdf, "").map(|_| ()).unwrap_err();
        assert!(error.contains(expected), "{integrator}, {bsdf}: {error}");
        let error = load("path", bsdf, "").unwrap().renderer_named(integrator);
        let error = error.map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(expected), "{integrator} by name: {error}");
    }
    for integrator in ["particle", "bdpt"] {
        let loaded = load(integrator, "conductor", "").unwrap();
        assert_eq!(loaded.renderer.name(), integrator);
    }
    // Pilots do not choose among estimators of polarised light.
    let named = load("path", "conductor", "")
        .unwrap()
        .renderer_named("auto");
    let named = named.unwrap();
    assert!(named.candidates.is_empty());
    assert_eq!(named.renderer.name(), "path");
}
