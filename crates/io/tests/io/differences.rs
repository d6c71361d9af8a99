//! Rows of `docs/mitsuba.md`: for each, one scene that it applies to, and a nearly equal scene that
//! it does not apply to.

use morgana_io::{Difference, LoadOptions, Loaded};
use std::collections::BTreeSet;

fn load_in(directory: &std::path::Path, text: &str) -> Loaded {
    let path = directory.join("scene.json");
    std::fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).unwrap_or_else(|d| panic!("{d}\n{text}"))
}

/// Control points of a curve.
const CURVES: &str = "-1.6 -0.9 0 0\n-1.4 -0.6 0 0.2\n-1.2 -0.4 0.1 0.2\n-0.5 0.8 0.4 0.3\n";

/// A scene of parts, with a camera to which no row of the table applies.
fn scene(parts: &str) -> String {
    format!(
        r#"{{"type": "scene", {parts}"sensor": {{"type": "perspective", "fov": 40, "to_world": [{{"translate": [0, 0, -5]}}],
  "sampler": {{"type": "independent", "sample_count": 4}},
  "film": {{"type": "hdrfilm", "width": 2, "height": 2, "rfilter": {{"type": "box"}}}}}},
  "sky": {{"type": "constant"}}}}"#
    )
}

fn surface(bsdf: &str) -> String {
    scene(&format!(r#""b": {{"type": "sphere", "bsdf": {bsdf}}}, "#))
}

fn camera(camera: &str) -> String {
    format!(
        r#"{{"type": "scene", "sky": {{"type": "constant"}}, "b": {{"type": "sphere"}},
  "sensor": {{"type": "perspective", "fov": 40, "to_world": [{{"translate": [0, 0, -5]}}], {camera}}}}}"#
    )
}

const SAMPLER: &str = r#""sampler": {"type": "independent", "sample_count": 4}"#;

/// A closed mesh, optionally wound inside out.
fn tetrahedron(faces: &str) -> String {
    scene(&format!(
        r#""b": {{"type": "mesh", "face_normals": true, "faces": {faces},
  "vertex_positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
  "vertex_color": [[1, 0, 0], [1, 0, 0], [1, 0, 0], [1, 0, 0]] COLOURS}}, "#
    ))
}

/// Transparent, with vertex normals.
const ROUND: &str = r#", "vertex_normals": [[-1, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1]], "g": {"type": "dielectric"}"#;

/// Vertex normals, reflecting on both sides.
const BOTH_SIDES: &str = r#", "vertex_normals": [[-1, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
  "g": {"type": "twosided", "d": {"type": "diffuse"}}"#;

/// Returns, for each row, a scene that it applies to and a nearly equal one that it does not apply
/// to.
fn examples() -> Vec<(&'static str, String, String)> {
    let fog = r#"{"type": "homogeneous", "sigma_t": 0.1}"#;
    let hull = |medium: &str| {
        format!(
            r#""hull": {{"type": "sphere", "radius": 3, "bsdf": {{"type": "null"}}, "interior": {medium}}}, "#
        )
    };
    let volpath = r#""i": {"type": "volpath"}, "#;
    let in_fog = |inner: &str| scene(&format!("{volpath}{}{inner}", hull(fog)));
    let nested = |more: &str| {
        in_fog(&format!(
            r#""n": {{"type": "sphere", "bsdf": {{"type": "null"}}, "interior": {{"type": "homogeneous"}}{more}}}, "#
        ))
    };
    let glass = |more: &str| {
        format!(
            r#""g": {{"type": "sphere", "bsdf": {{"type": "dielectric", "ext_ior": 1}}{more}}}, "#
        )
    };
    let board = r#"{"type": "checkerboard"}"#;
    let diffuse = r#""d": {"type": "diffuse"}"#;
    let film = |more: &str| {
        camera(&format!(
            r#"{SAMPLER}, "film": {{"type": "hdrfilm", "width": 2, "height": 2, "rfilter": {{"type": "box"}}{more}}}"#
        ))
    };
    let grid = |to_world: &str| {
        scene(&format!(
            "{volpath}{}",
            hull(&format!(
                r#"{{"type": "heterogeneous", "sigma_t": {{"type": "gridvolume", "data": [[[1, 1]]], "to_world": {to_world}}}}}"#
            ))
        ))
    };
    let within = |medium: &str| {
        format!(
            r#"{{"type": "scene", {volpath}{}"sky": {{"type": "constant"}}, "sensor": {{"type": "perspective", "fov": 40, {SAMPLER}{medium},
  "film": {{"type": "hdrfilm", "width": 2, "height": 2, "rfilter": {{"type": "box"}}}}}}}}"#,
            r#""fog": {"type": "homogeneous", "sigma_t": 0.1, "id": "fog"}, "hull": {"type": "sphere", "radius": 3, "bsdf": {"type": "null"}, "interior": {"type": "ref", "id": "fog"}}, "#
        )
    };
    let depth = |integrator: &str, bsdf: &str| {
        scene(&format!(
            r#""i": {{"type": "{integrator}", "max_depth": 4}}, "b": {{"type": "rectangle", "bsdf": {bsdf}}}, "#
        ))
    };
    let outside = "[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]";
    let inside = "[[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]";
    vec![
        ("aov", scene(r#""i": {"type": "aov", "aovs": "d:depth", "j": {"type": "path"}}, "#), scene(r#""i": {"type": "aov", "aovs": "steps", "j": {"type": "path"}}, "#)),
        ("beckmann", surface(r#"{"type": "roughconductor"}"#), surface(r#"{"type": "roughconductor", "distribution": "ggx"}"#)),
        ("blendbsdf",
            surface(r#"{"type": "blendbsdf", "a": {"type": "conductor"}, "b": {"type": "diffuse"}}"#),
            surface(r#"{"type": "blendbsdf", "a": {"type": "roughconductor", "distribution": "ggx"}, "b": {"type": "diffuse"}}"#)),
        ("border", film("").replace("box", "tent"), film(r#", "sample_border": true"#).replace("box", "tent")),
        ("bump and normal maps",
            surface(r#"{"type": "normalmap", "normalmap": 0.7, "b": {"type": "twosided", "c": {"type": "plastic"}}}"#),
            surface(r#"{"type": "normalmap", "normalmap": 0.7, "b": {"type": "roughplastic", "lossless": true}}"#)),
        ("checkerboard", surface(&format!(r#"{{"type": "mask", "opacity": {board}, {diffuse}}}"#)),
            surface(&format!(r#"{{"type": "diffuse", "reflectance": {board}}}"#))),
        ("clear glass", in_fog(&glass("")), scene(&glass(""))),
        ("clipping", camera(&format!(r#"{SAMPLER}, "far_clip": 5.5"#)), camera(SAMPLER)),
        ("constant extinction", scene(&format!("{volpath}{}", hull(r#"{"type": "heterogeneous"}"#))), grid("[]")),
        ("curves", scene(r#""c": {"type": "linearcurve", "filename": "curves.txt"}, "#), scene(r#""c": {"type": "cylinder"}, "#)),
        ("depth", depth("path", r#"{"type": "null"}"#), depth("volpath", r#"{"type": "null"}"#)),
        ("direct", scene(r#""i": {"type": "direct", "emitter_samples": 2}, "#), scene(r#""i": {"type": "direct", "emitter_samples": 1}, "#)),
        ("exterior", nested(""), nested(r#", "exterior": {"type": "ref", "id": "hull"}"#).replace(
            r#""interior": {"type": "homogeneous", "sigma_t": 0.1}"#,
            r#""interior": {"type": "homogeneous", "sigma_t": 0.1, "id": "outer"}"#).replace(r#""id": "hull""#, r#""id": "outer""#)),
        ("ext_ior", surface(r#"{"type": "dielectric"}"#), surface(r#"{"type": "dielectric", "ext_ior": "air"}"#)),
        ("format", film(r#", "component_format": "float16""#), film(r#", "component_format": "float32", "file_format": "openexr""#)),
        ("directionalarea", scene(r#""l": {"type": "rectangle", "e": {"type": "directionalarea"}}, "#), scene(r#""l": {"type": "rectangle", "e": {"type": "area"}}, "#)),
        ("hide_emitters", scene(r#""i": {"type": "path", "hide_emitters": true}, "#), scene(r#""i": {"type": "path", "hide_emitters": false}, "#)),
        ("mask", surface(r#"{"type": "mask", "b": {"type": "diffuse"}}"#).replace("constant", "point"), surface(r#"{"type": "mask", "b": {"type": "diffuse"}}"#)),
        ("mesh normals", tetrahedron(outside).replace("true", "false").replace("COLOURS", ROUND),
            tetrahedron(outside).replace("COLOURS", ROUND)),
        ("mesh sides", tetrahedron(inside).replace("COLOURS", ""), tetrahedron(outside).replace("COLOURS", "")),
        ("moment", scene(r#""i": {"type": "moment", "j": {"type": "path"}}, "#), scene(r#""i": {"type": "path"}, "#)),
        ("nested integrators", scene(r#""i": {"type": "stokes", "j": {"type": "path"}, "k": {"type": "direct"}}, "#), scene(r#""i": {"type": "stokes", "j": {"type": "path"}}, "#)),
        ("path in media", in_fog("").replace("volpath", "path"), in_fog("")),
        ("plastic", surface(r#"{"type": "plastic"}"#), surface(r#"{"type": "roughplastic", "lossless": true}"#)),
        ("polarization", surface(r#"{"type": "polarizer"}"#), surface(r#"{"type": "mask", "b": {"type": "diffuse"}}"#)),
        ("principledthin", surface(r#"{"type": "principledthin"}"#), surface(r#"{"type": "principled"}"#)),
        ("radiancemeter", camera(SAMPLER).replace("perspective", "radiancemeter").replace(r#""fov": 40, "#, ""), camera(SAMPLER)),
        ("rotated grid", grid(r#"[{"rotate": {"axis": [0, 0, 1], "angle": 30}}]"#), grid(r#"[{"scale": 2}]"#)),
        ("sample_count", camera(r#""sampler": {"type": "independent"}"#), camera(SAMPLER)),
        ("sdfgrid", scene(r#""c": {"type": "sdfgrid", "grid": [[[[-1], [1]], [[1], [1]]], [[[1], [1]], [[1], [1]]]]}, "#), scene(r#""c": {"type": "cube"}, "#)),
        ("sensor medium", within(""), within(r#", "medium": {"type": "ref", "id": "fog"}"#)),
        ("spectra", scene(r#""c": {"type": "constant", "radiance": {"type": "blackbody", "temperature": 5000}}, "#),
            scene(r#""c": {"type": "constant", "radiance": {"type": "d65"}}, "#)),
        ("sunsky", scene(r#""c": {"type": "sunsky"}, "#), scene(r#""c": {"type": "directional"}, "#)),
        ("textured sphere",
            scene(r#""l": {"type": "sphere", "e": {"type": "area", "radiance": {"type": "checkerboard"}}}, "#),
            scene(r#""l": {"type": "sphere", "e": {"type": "area", "radiance": 2}}, "#)),
        ("rotate",
            scene(r#""b": {"type": "cube", "to_world": [{"scale": 0.1}, {"rotate": {"axis": [0, 0, 2], "angle": 10}}]}, "#),
            scene(r#""b": {"type": "cube", "to_world": [{"scale": 0.1}, {"rotate": {"axis": [0, 0, 1], "angle": 10}}]}, "#)),
        ("twosided",
            tetrahedron(outside).replace("true", "false").replace("COLOURS", BOTH_SIDES),
            tetrahedron(outside).replace("COLOURS", BOTH_SIDES)),
        ("vertex colours",
            tetrahedron(outside).replace("COLOURS", r#", "bsdf": {"type": "diffuse", "reflectance": {"type": "mesh_attribute", "name": "vertex_color"}}"#),
            tetrahedron(outside).replace("COLOURS", "")),
        ("wrap_mode", grid(r#"[], "wrap_mode": "repeat""#), grid(r#"[], "wrap_mode": "clamp""#)),
    ]
}

#[test]
fn every_difference_is_listed_and_met() {
    let manual = include_str!("../../../../docs/mitsuba.md");
    let table = manual.split("## Compared").next().unwrap();
    let rows = table
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split('`').next());
    let listed: BTreeSet<&str> = rows.collect();
    let known: BTreeSet<&str> = Difference::ALL.iter().map(|d| d.topic).collect();
    assert_eq!(listed, known);
    let directory = tempfile::tempdir().unwrap();
    let pixels = morgana_io::image::RgbImage {
        width: 2,
        height: 1,
        pixels: vec![[0.5; 3]; 2],
    };
    let path = directory.path().join("image.png");
    let (depth, tone) = (
        morgana_io::image::png::Depth::Sixteen,
        morgana_io::image::tone::Tone::default(),
    );
    morgana_io::image::png::write(&path, &pixels, depth, tone).unwrap();
    std::fs::write(directory.path().join("curves.txt"), CURVES).unwrap();
    let examples = examples();
    assert_eq!(examples.iter().map(|e| e.0).collect::<BTreeSet<_>>(), known);
    for (topic, with, without) in examples {
        for (text, expected) in [(with, true), (without, false)] {
            let loaded = load_in(directory.path(), &text);
            let found = loaded.differences.iter().any(|d| d.topic == topic);
            assert_eq!(found, expected, "{topic}: {:?}\n{text}", loaded.differences);
        }
    }
}
