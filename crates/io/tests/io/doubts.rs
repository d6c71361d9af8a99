//! Warnings for valid scenes that are probably mistakes: media that no light can enter, numbers
//! mistaken for an index, grids that end inside their shapes.

use morgana_io::{Diagnostics, LoadOptions, json};

/// Returns the warnings of a scene of parts, or its errors if it is invalid.
fn warnings(parts: &str) -> String {
    let text = format!(
        r#"{{"type": "scene", {parts}, "sensor": {{"type": "perspective", "fov": 40, "to_world": [{{"translate": [0, 0, -5]}}]}}}}"#
    );
    let mut diagnostics = Diagnostics::new();
    let description = json::parse(&text, "scene.json", &[], &mut diagnostics);
    let description = description.unwrap_or_else(|| panic!("{diagnostics}\n{text}"));
    match morgana_io::assemble(&description, &LoadOptions::default(), diagnostics) {
        Ok(loaded) => loaded.warnings.to_string(),
        Err(diagnostics) => diagnostics.to_string(),
    }
}

const SKY: &str = r#""sky": {"type": "constant"}"#;
const FOG: &str = r#""interior": {"type": "homogeneous", "id": "fog"}"#;

#[track_caller]
fn entered(parts: &str, expected: bool) {
    let text = warnings(parts);
    assert_eq!(
        text.contains("no light can enter"),
        !expected,
        "{parts}:\n{text}"
    );
}

#[test]
fn media_behind_opaque_hulls() {
    let ball = |bsdf: &str, more: &str| {
        format!(r#"{SKY}, "ball": {{"type": "sphere", "id": "ball", {bsdf} {FOG}}}{more}"#)
    };
    let text = warnings(&ball("", ""));
    for part in [
        "no light can enter medium 'fog'",
        "'ball'",
        "<bsdf type=\"null\"/>",
        "scene.json",
    ] {
        assert!(text.contains(part), "{part} in:\n{text}");
    }
    // Any surface that transmits some light is a way in.
    entered(&ball(r#""bsdf": {"type": "conductor"},"#, ""), false);
    entered(&ball(r#""bsdf": {"type": "null"},"#, ""), true);
    entered(&ball(r#""bsdf": {"type": "dielectric"},"#, ""), true);
    entered(&ball(r#""bsdf": {"type": "roughdielectric"},"#, ""), true);
    // Emitters inside, of any kind.
    entered(
        &ball("", r#", "p": {"type": "point", "position": [0, 0, 0.5]}"#),
        true,
    );
    entered(
        &ball("", r#", "p": {"type": "point", "position": [0, 0, 1.5]}"#),
        false,
    );
    let beam = r#", "p": {"type": "collimated", "radius": 0.1, "power": 1}"#;
    entered(&ball("", beam), true);
    let light = |z: f64| {
        format!(
            r#", "l": {{"type": "sphere", "center": [0, 0, {z}], "radius": 0.1, "bsdf": {{"type": "diffuse"}}, "emitter": {{"type": "area"}}}}"#
        )
    };
    entered(&ball("", &light(0.0)), true);
    entered(&ball("", &light(2.0)), false);
    // Hulls that shine inwards.
    let hull = |flip: bool| {
        format!(
            r#"{SKY}, "ball": {{"type": "sphere", "flip_normals": {flip}, {FOG}, "emitter": {{"type": "area"}}}}"#
        )
    };
    entered(&hull(true), true);
    entered(&hull(false), false);
    // A sensor inside is assumed to see something.
    entered(
        &format!(
            r#"{SKY}, "ball": {{"type": "sphere", "radius": 6, "flip_normals": true, {FOG}}}"#
        ),
        true,
    );
}

#[test]
fn media_within_media() {
    let shells = |outer: &str, inner: &str| {
        format!(
            r#"{SKY}, "a": {{"type": "sphere", "radius": 2, "bsdf": {{"type": "{outer}"}}, "interior": {{"type": "homogeneous"}}}},
           "b": {{"type": "sphere", "bsdf": {{"type": "{inner}"}}, {FOG}}}"#
        )
    };
    entered(&shells("null", "null"), true);
    entered(&shells("null", "diffuse"), false);
    entered(&shells("diffuse", "null"), false);
}

/// A ball of a medium with a sampled index, in a box around it.
fn graded(kind: &str, samples: &str, more: &str, half: f64) -> String {
    let grid = format!(
        r#"{{"type": "{kind}", "placement": "nodes", "data": {samples}{more}, "to_world": [{{"translate": [-0.5, -0.5, -0.5]}}, {{"scale": {}}}]}}"#,
        2.0 * half
    );
    let medium = format!(r#"{{"type": "transparent", "ior": {grid}}}"#);
    warnings(&format!(
        r#"{SKY}, "ball": {{"type": "sphere", "bsdf": {{"type": "null"}}, "interior": {medium}}}"#
    ))
}

/// Two values, alternating, on 4 × 4 × 4 nodes.
fn samples(a: f64, b: f64) -> String {
    let row = format!("[{a}, {b}, {a}, {b}]");
    let plane = format!("[{row}, {row}, {row}, {row}]");
    format!("[{plane}, {plane}, {plane}, {plane}]")
}

#[test]
fn densities_taken_for_an_index() {
    let looks = |a: f64, b: f64, more: &str| graded("bspline", &samples(a, b), more, 1.0);
    for (a, b, unit, advice) in [
        (1.15, 1.2, "the density of a gas in kg/m³", "gladstone_dale"),
        (0.3, 1.2, "the density of a gas in kg/m³", "gladstone_dale"),
        (2e-4, 3e-4, "n − 1", "'offset'"),
        (
            998.0,
            1002.0,
            "a density in kg/m³, or a temperature in K",
            "gladstone_dale",
        ),
        (1e5, 1.1e5, "a pressure in Pa", "'dn_dp'"),
        (5.0, 90.0, "per cent", "'offset'"),
    ] {
        let text = looks(a, b, "");
        assert!(
            text.contains(unit) && text.contains(advice),
            "{a} {b}:\n{text}"
        );
    }
    assert!(!looks(1.0, 1.0003, "").contains("look like"));
    assert!(!looks(1.33, 1.5, "").contains("look like"));
    // Converted to an index, contrasts are right.
    let turned = looks(2e-4, 3e-4, r#", "offset": 1"#);
    assert!(!turned.contains("look like"), "{turned}");
}

#[test]
fn densities_and_pressures_of_other_units() {
    let gas = |a: f64, b: f64| {
        graded(
            "gladstone_dale",
            &samples(a, b),
            r#", "wavelength": 532"#,
            1.0,
        )
    };
    assert!(!gas(0.3, 1.2).contains("check the units"));
    assert!(gas(300.0, 1200.0).contains("no gas is so dense"));
    let thin = gas(3e-5, 1.2e-4);
    assert!(thin.contains("nearly a vacuum"), "{thin}");
    let liquid = |a: f64, b: f64| {
        graded(
            "pressure",
            &samples(a, b),
            r#", "n0": 1.333, "dn_dp": 1.4e-10"#,
            1.0,
        )
    };
    assert!(!liquid(-1e6, 1e6).contains("check the units"));
    assert!(liquid(-1e9, 1e9).contains("give the pressure in pascals"));
}

#[test]
fn tables_that_end_inside_of_their_shapes() {
    let table = |coordinate: &str, table: &str, more: &str| {
        let index = format!(
            r#"{{"type": "profile", "coordinate": "{coordinate}", "table": "{table}"{more}}}"#
        );
        let medium = format!(r#"{{"type": "transparent", "ior": {index}}}"#);
        warnings(&format!(
            r#"{SKY}, "ball": {{"type": "sphere", "bsdf": {{"type": "null"}}, "interior": {medium}}}"#
        ))
    };
    let ends = |text: String| {
        text.contains(
            "the table of the index ends inside of 'ball': the index is continued as a parabola",
        )
    };
    for whole in ["r", "rho"] {
        assert!(!ends(table(whole, "0, 1.5, 1, 1.4", "")));
        assert!(ends(table(whole, "0, 1.5, 0.9, 1.4", "")));
        // Tests a scaled table.
        let scaled =
            r#", "to_world": [{"scale": 1.2}, {"rotate": {"axis": [1, 0, 0], "angle": 90}}]"#;
        assert!(!ends(table(whole, "0, 1.5, 0.9, 1.4", scaled)));
    }
    for along in ["x", "y", "z"] {
        assert!(!ends(table(along, "-1, 1.5, 1, 1.4", "")));
        assert!(ends(table(along, "-1, 1.5, 0.9, 1.4", "")));
        assert!(ends(table(along, "-0.9, 1.5, 1, 1.4", "")));
        assert!(!ends(table(along, "0, 1.5, 2, 1.4", r#", "shift": -1"#)));
        assert!(ends(table(along, "0, 1.5, 2, 1.4", "")));
    }
}

#[test]
fn grids_that_end_inside_of_their_shapes() {
    let index = |half: f64| graded("bspline", &samples(1.0, 1.01), "", half);
    let text = index(0.8);
    assert!(
        text.contains("the grid of the index ends inside of 'ball'"),
        "{text}"
    );
    // Rounding in a file has no effect.
    assert!(!index(1.0).contains("ends inside") && !index(1.0 - 1e-6).contains("ends inside"));
    let extinction = |half: f64| {
        warnings(&format!(
            r#"{SKY}, "b": {{"type": "sphere", "bsdf": {{"type": "null"}}, "interior": {{"type": "heterogeneous", "sigma_t":
           {{"type": "gridvolume", "data": [[[1, 1]]], "to_world": [{{"translate": [-0.5, -0.5, -0.5]}}, {{"scale": {}}}]}}}}}}"#,
            2.0 * half
        ))
    };
    let text = extinction(0.5);
    assert!(
        text.contains(
            "the grid of the extinction ends inside of 'b': the medium is clear beyond it"
        ),
        "{text}"
    );
    assert!(!extinction(1.0).contains("ends inside"));
}

#[test]
fn what_nothing_refers_to_is_not_read() {
    let ball = r#""ball": {"type": "sphere", "bsdf": {"type": "ref", "id": "used"}}"#;
    let used = r#""used": {"type": "diffuse"}"#;
    let text = warnings(&format!("{SKY}, {used}, {ball}"));
    assert!(!text.contains("unused definitions"), "{text}");
    let wrong = (0..6).map(|i| format!(r#""m{i}": {{"type": "homogeneous", "sigma_t": -3}}"#));
    let wrong: Vec<_> = wrong.collect();
    let text = warnings(&format!("{SKY}, {used}, {ball}, {}", wrong.join(", ")));
    let expected = "unused definitions, which morgana did not check: medium 'm0', medium 'm1', medium 'm2', \
                    medium 'm3', medium 'm4', 1 more";
    assert!(text.contains(expected), "{text}");
}

/// Air and vacuum around two pieces of glass count as one medium; water does not.
#[test]
fn indices_around_dielectrics_agree_to_that_of_air() {
    let glass = |x: f64, outside: &str| {
        format!(
            r#""{outside}": {{"type": "sphere", "center": [{x}, 0, 5], "bsdf": {{"type": "dielectric", "ext_ior": {outside}}}}}"#
        )
    };
    let pair = |other: &str| {
        warnings(&format!(
            "{SKY}, {}, {}",
            glass(-2.0, "1.0"),
            glass(2.0, other)
        ))
    };
    let text = pair("1.000277");
    assert!(
        text.contains("ext_ior 1.000277 is taken as 1, by ext_ior at scene.json:1:"),
        "{text}"
    );
    let text = pair("1.33");
    let expected = "ext_ior is 1.33, but the index on that side is 1, by ext_ior at scene.json:1:";
    assert!(text.contains(expected), "{text}");
}

#[test]
fn emitters_without_light() {
    let sky = |radiance: &str| warnings(&format!(r#""sky": {{"type": "constant"{radiance}}}"#));
    for black in ["0", "0.0", r#"{"type": "rgb", "value": [0, 0, 0]}"#] {
        let text = sky(&format!(r#", "radiance": {black}"#));
        let message =
            r#"warning[black_emitter]: {"type": "constant"} emits no light: 'radiance' is 0"#;
        assert!(text.contains(message), "{text}");
    }
    for bright in [
        "",
        r#", "radiance": 1e-9"#,
        r#", "radiance": {"type": "rgb", "value": [0, 0, 1]}"#,
    ] {
        let text = sky(bright);
        assert!(!text.contains("black_emitter"), "{text}");
    }
}

#[test]
fn extinctions_in_other_units() {
    let ball = |medium: &str| {
        warnings(&format!(
            r#"{SKY}, "ball": {{"type": "sphere", "bsdf": {{"type": "null"}},
               "interior": {{"type": "homogeneous", "id": "fog", {medium}}}}}"#
        ))
    };
    let text = ball(r#""sigma_t": 1e6, "albedo": 0.5"#);
    let message = "warning[extinction_units]: medium 'fog' is opaque: its optical thickness is 3e6";
    assert!(text.contains(message), "{text}");
    let text = ball(r#""sigma_t": 1e-9"#);
    let message = "medium 'fog' is invisible: across the whole scene, its optical thickness is";
    assert!(text.contains(message), "{text}");
    for plausible in ["0", "1e-4", "1", "1e4"] {
        let text = ball(&format!(r#""sigma_t": {plausible}, "albedo": 0.5"#));
        assert!(!text.contains("extinction_units"), "{plausible}: {text}");
    }
    // Without absorption, the warning about long paths names the same cause.
    let text = ball(r#""sigma_t": 1e7, "albedo": 1"#);
    assert!(
        text.contains("long_paths") && !text.contains("extinction_units"),
        "{text}"
    );
}

#[test]
fn fields_of_view_in_radians() {
    let seen = |fov: f64, distance: f64| {
        let text = format!(
            r#"{{"type": "scene", {SKY}, "ball": {{"type": "sphere"}},
               "sensor": {{"type": "perspective", "fov": {fov}, "to_world": [{{"translate": [0, 0, {}]}}]}}}}"#,
            -distance
        );
        let mut diagnostics = Diagnostics::new();
        let description = json::parse(&text, "scene.json", &[], &mut diagnostics).unwrap();
        let loaded = morgana_io::assemble(&description, &LoadOptions::default(), diagnostics);
        loaded.unwrap().warnings.to_string()
    };
    let text = seen(0.7, 5.0);
    for part in [
        "warning[narrow_view]: the camera sees 0.7° of",
        "for 0.7 radians write 40.107",
    ] {
        assert!(text.contains(part), "{text}");
    }
    // A telescope sees a distant scene, and a wide view a near one.
    for (fov, distance) in [(0.7, 200.0), (3.3, 5.0), (40.0, 5.0)] {
        let text = seen(fov, distance);
        assert!(!text.contains("narrow_view"), "{fov}, {distance}: {text}");
    }
}

/// The scenes of the project have no implausible quantities.
#[test]
fn scenes_of_the_project_are_plausible() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let files = std::fs::read_dir(folder)
        .unwrap()
        .map(|f| f.unwrap().path());
    let scenes: Vec<_> = files
        .filter(|f| f.extension().is_some_and(|e| e == "xml"))
        .collect();
    assert!(scenes.len() > 10);
    for path in scenes {
        let loaded = morgana_io::load_scene(&path, &LoadOptions::default()).unwrap();
        let text = loaded.warnings.to_string();
        for check in ["black_emitter", "extinction_units", "narrow_view"] {
            assert!(!text.contains(check), "{}: {text}", path.display());
        }
    }
}
