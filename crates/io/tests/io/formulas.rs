//! Indices by formula and by table in scene files: the resulting fields, and the positions of
//! messages.

use glam::DVec3;
use morgana_io::{Diagnostics, LoadOptions, assemble_field, json, xml};
use std::fs;

/// The field that a volume describes, in XML.
fn field(volume: &str, overrides: &[(&str, &str)]) -> Result<eikonal::Field, String> {
    let text = format!("<scene version=\"3.0.0\">\n{volume}\n</scene>");
    let mut diagnostics = Diagnostics::new();
    let overrides: Vec<_> = overrides
        .iter()
        .map(|(a, b)| ((*a).to_owned(), (*b).to_owned()))
        .collect();
    let scene = xml::parse(&text, "scene.xml", &overrides, &mut diagnostics);
    let scene = scene.ok_or_else(|| diagnostics.to_string())?;
    let made = assemble_field(&scene, diagnostics);
    made.map(|made| made.field).map_err(|d| d.to_string())
}

/// Returns the field that a volume describes, in JSON.
fn of_json(volume: &serde_json::Value) -> Result<eikonal::Field, String> {
    let text = serde_json::json!({"type": "scene", "ior": volume}).to_string();
    let mut diagnostics = Diagnostics::new();
    let scene = json::parse(&text, "scene.json", &[], &mut diagnostics);
    let scene = scene.ok_or_else(|| diagnostics.to_string())?;
    let made = assemble_field(&scene, diagnostics);
    made.map(|made| made.field).map_err(|d| d.to_string())
}

const X: DVec3 = DVec3::new(0.3, -0.2, 0.5);

fn bump(x: DVec3) -> f64 {
    1.33 + 0.02 * (-x.length_squared() / 0.18).exp()
}

#[test]
fn formulas_take_numbers_from_parameters() {
    let text = r#"<default name="width" value="0.3"/>
<volume type="expression"><string name="n" value="n0 + d*exp(-r^2/(2*w^2))"/>
<float name="n0" value="1.33"/><float name="d" value="0.02"/><float name="w" value="$width"/></volume>"#;
    assert!((field(text, &[]).unwrap().n(X) - bump(X)).abs() < 1e-15);
    let wide = field(text, &[("width", "3")]).unwrap().n(X);
    assert!((wide - 1.33 - 0.02 * (-X.length_squared() / 18.0).exp()).abs() < 1e-15);
    // Tests integers, and parameters within the formula.
    let text = r#"<default name="order" value="2"/>
<volume type="expression"><string name="n2" value="m + x^$order"/><integer name="m" value="2"/>
<transform name="to_world"><translate x="0.1"/></transform></volume>"#;
    assert!((field(text, &[]).unwrap().n2(X) - 2.04).abs() < 1e-15);
    assert!((field(text, &[("order", "3")]).unwrap().n2(X) - 2.008).abs() < 1e-15);
    let json = serde_json::json!({"type": "expression", "n": "n0 + d*exp(-r^2/0.18)", "n0": 1.33, "d": 0.02});
    assert!((of_json(&json).unwrap().n(X) - bump(X)).abs() < 1e-15);
}

#[test]
fn tables_come_from_texts_arrays_and_files() {
    let pairs = [[0.0, 1.5], [0.5, 1.4], [1.0, 1.35], [2.0, 1.3]];
    let profile = |source: (&str, serde_json::Value)| {
        let mut volume = serde_json::json!({"type": "profile", "coordinate": "z"});
        volume[source.0] = source.1;
        of_json(&volume).unwrap().n(X)
    };
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("profile.csv");
    fs::write(&path, "depth,index\n0,1.5\n0.5,1.4\n1,1.35\n2,1.3\n").unwrap();
    assert_eq!(profile(("data", serde_json::json!(pairs))), 1.4);
    assert_eq!(
        profile(("table", "0, 1.5, 0.5, 1.4, 1, 1.35, 2, 1.3".into())),
        1.4
    );
    assert_eq!(
        profile((
            "table",
            serde_json::json!([0, 1.5, 0.5, 1.4, 1, 1.35, 2, 1.3])
        )),
        1.4
    );
    assert_eq!(profile(("filename", path.to_str().unwrap().into())), 1.4);
    // Heights above a ball of radius 10, over the distance from its centre.
    let text = r#"<volume type="profile"><string name="coordinate" value="r"/><float name="shift" value="10"/>
<string name="table" value="0, 1.5, 0.5, 1.4, 1, 1.35, 2, 1.3"/></volume>"#;
    assert!((field(text, &[]).unwrap().n(DVec3::Y * 10.5) - 1.4).abs() < 1e-14);
}

/// Returns the first message of a volume, without empty lines.
#[track_caller]
fn message(volume: &str) -> String {
    let all = field(volume, &[]).unwrap_err();
    let first = all.split("\n\n").next().unwrap();
    first.to_owned()
}

fn expression(formula: &str) -> String {
    message(&format!(
        r#"<volume type="expression"><string name="n" value="{formula}"/><float name="width" value="2"/></volume>"#
    ))
}

#[test]
fn messages_point_into_the_formula() {
    insta::assert_snapshot!(expression("1.3 + 0.1*exp(-x^2/widht)"), @r#"
    error: unknown name 'widht' in the formula
     --> scene.xml:2:70
      |
    2 | <volume type="expression"><string name="n" value="1.3 + 0.1*exp(-x^2/widht)"/><float name="width" value="2"/></volume>
      |                                                                      ^^^^^
      = help: did you mean 'width'?
    "#);
    insta::assert_snapshot!(expression("1.3 + max(x, width)"), @r#"
    error: 'max' has a kink or a step, but rays need a smooth index: use a smooth transition, such as one with tanh
     --> scene.xml:2:57
      |
    2 | <volume type="expression"><string name="n" value="1.3 + max(x, width)"/><float name="width" value="2"/></volume>
      |                                                         ^^^
    "#);
    insta::assert_snapshot!(expression("1.3 + (x"), @r#"
    error: the formula ends too early: expected ')'
     --> scene.xml:2:59
      |
    2 | <volume type="expression"><string name="n" value="1.3 + (x"/><float name="width" value="2"/></volume>
      |                                                           ^
    "#);
    // The text in the file is encoded differently from its value.
    insta::assert_snapshot!(expression("1.3 &#43; q*width"), @r#"
    error: unknown name 'q' in the formula (character 7 of 'n')
     --> scene.xml:2:51
      |
    2 | <volume type="expression"><string name="n" value="1.3 &#43; q*width"/><float name="width" value="2"/></volume>
      |                                                   ^^^^^^^^^^^^^^^^^
      = help: known names: width, x, y, z, r, rho, pi, sqrt, exp, log, sin, cos, tan, asin, acos, atan, sinh, cosh, tanh, erf, pow, atan2; define other names as parameters
    "#);
}

#[test]
fn what_is_missing_or_too_much_is_said() {
    for (volume, parts) in [
        (
            r#"<volume type="expression"/>"#,
            ["needs 'n', a formula of the index", "scene.xml:2"],
        ),
        (
            r#"<volume type="expression"><string name="n" value="1"/><string name="n2" value="1"/></volume>"#,
            ["not both", "scene.xml:2:80"],
        ),
        (
            r#"<volume type="expression"><string name="n" value="1"/><float name="a" value="1"/></volume>"#,
            ["the formula does not use 'a'", "scene.xml:2:"],
        ),
        (
            r#"<volume type="expression"><string name="n" value="1 + x"/><float name="x" value="1"/></volume>"#,
            ["'x' cannot be the name of a parameter", "scene.xml:2"],
        ),
        (
            r#"<volume type="expression"><string name="n" value="1 + x"/><string name="a" value="1"/></volume>"#,
            ["has no parameter 'a'", "scene.xml:2"],
        ),
        (
            r#"<volume type="profile"><string name="table" value="0, 1, 1, 2"/></volume>"#,
            ["needs a 'coordinate'", ""],
        ),
        (
            r#"<volume type="profile"><string name="coordinate" value="rh"/><string name="table" value="0, 1, 1, 2"/></volume>"#,
            ["'coordinate' cannot be 'rh'", "did you mean 'rho'?"],
        ),
        (
            r#"<volume type="profile"><string name="coordinate" value="z"/></volume>"#,
            ["needs one of 'table'", ""],
        ),
        (
            r#"<volume type="profile"><string name="coordinate" value="z"/><string name="table" value="0, 1, 2"/></volume>"#,
            ["a list of pairs", "scene.xml:2:"],
        ),
        (
            r#"<volume type="profile"><string name="coordinate" value="z"/><string name="table" value="1, 1, 0, 2"/></volume>"#,
            ["must ascend, but 1 is followed by 0", ""],
        ),
        (
            r#"<volume type="expresion"/>"#,
            [
                "unknown volume type 'expresion'",
                "did you mean 'expression'? known types: constant,",
            ],
        ),
        (
            r#"<volume type="constvolume"/>"#,
            [
                "a volume of type 'constvolume' does not belong here",
                "use 'constant' here; known types: constant,",
            ],
        ),
        (
            r#"<volume type="gridvolume"/>"#,
            [
                "a volume of type 'gridvolume' does not belong here",
                "use 'bspline' here; known types: constant,",
            ],
        ),
    ] {
        let all = field(volume, &[]).unwrap_err();
        assert!(
            parts.iter().all(|part| all.contains(part)),
            "{volume}: {all}"
        );
    }
}

/// If n² is not positive or not finite inside a medium, the scene is refused with the position.
#[test]
fn media_need_positive_indices() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scene.xml");
    for (formula, message) in [
        (
            "0.4 + x",
            "it must be positive and finite throughout the medium",
        ),
        (
            "1.5 + log(x)",
            "it must be positive and finite throughout the medium",
        ),
        (
            "1 + 1/(2*x + y)^200",
            "it must be positive and finite throughout the medium",
        ),
    ] {
        let text = format!(
            r#"<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm"/></sensor><emitter type="constant"/>
<shape type="sphere"><bsdf type="dielectric"/><medium name="interior" type="transparent">
<volume name="ior" type="expression"><string name="n" value="{formula}"/></volume></medium></shape></scene>"#
        );
        fs::write(&path, text).unwrap();
        let refused =
            morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string());
        let refused = refused.err().unwrap_or_default();
        assert!(refused.contains(message), "{formula}: {refused}");
    }
}

/// The formulas and tables of the manual are valid fields.
#[test]
fn the_manual_is_right() {
    let manual = include_str!("../../../../docs/scene/ior.md");
    let (_, rest) = manual.split_once("## Formulas").unwrap();
    let (section, _) = rest.split_once("## Density and pressure").unwrap();
    let volumes = section.split("<volume name=\"ior\" ").skip(1);
    let volumes = volumes.map(|v| v.split_once("</volume>").unwrap().0);
    let inline = volumes.filter(|v| !v.contains("filename"));
    let made = inline.map(|v| {
        let text = format!("<default name=\"width\" value=\"0.4\"/><volume {v}</volume>");
        field(&text, &[]).unwrap_or_else(|e| panic!("{e}"))
    });
    assert_eq!(made.count(), 5);
}

/// Below the ground of a planet, the formula of an atmosphere has no finite value, which is
/// allowed; without the ground it must have one.
#[test]
fn indices_need_make_sense_only_where_light_is() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scene.xml");
    let load = |ground: &str| {
        let text = format!(
            r#"<scene version="3.0.0"><sensor type="perspective"><transform name="to_world">
<lookat origin="0, 0, 6371100" target="1000, 0, 6371110" up="0, 0, 1"/></transform><film type="hdrfilm"/></sensor>
<emitter type="constant"/>
<shape type="sphere"><float name="radius" value="6471000"/><bsdf type="null"/><medium name="interior" type="transparent">
<volume name="ior" type="expression"><string name="n" value="1 + N*exp((R - r)/H)"/>
<float name="N" value="2.8e-4"/><float name="R" value="6371000"/><float name="H" value="8000"/></volume></medium></shape>
{ground}</scene>"#
        );
        fs::write(&path, text).unwrap();
        let loaded = morgana_io::load_scene(&path, &LoadOptions::default());
        loaded.map(|_| ()).map_err(|d| d.to_string())
    };
    load(r#"<shape type="sphere"><float name="radius" value="6371000"/><bsdf type="diffuse"/></shape>"#).unwrap();
    let refused = load("").unwrap_err();
    assert!(refused.contains("must be positive and finite"), "{refused}");
}

#[test]
fn fields_have_the_first_wavelength_of_a_film() {
    let with = |wavelengths: &str| {
        let film = serde_json::json!({"type": "hdrfilm", "pixel_format": "spectral", "wavelengths": wavelengths});
        let text = serde_json::json!({
            "type": "scene",
            "sensor": {"type": "perspective", "film": film},
            "ior": {"type": "cauchy", "a": 1.5, "b": 0.004},
        });
        let mut diagnostics = Diagnostics::new();
        let scene = json::parse(&text.to_string(), "scene.json", &[], &mut diagnostics);
        let made = assemble_field(&scene.unwrap(), diagnostics).unwrap();
        made.field.n(X)
    };
    assert!((with("500, 700") - 1.516).abs() < 1e-14);
    assert!((with("400") - 1.525).abs() < 1e-14);
}
