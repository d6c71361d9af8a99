//! Unscattered rays meet equal objects in `trace`, in `aov` and in renders, at each kind of surface
//! and on both of its sides.

use glam::DVec3;
use morgana_io::{Diagnostics, LoadOptions, Loaded, json};
use std::ops::ControlFlow;
use transport::render::{RenderOptions, render};
use transport::trace::{TraceEnding, Tracer};

/// Objects that a ray may end on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Met {
    /// The surface itself.
    Surface,
    /// The red ball behind the surface.
    Behind,
    /// The blue ball that a mirror reflects the ray to.
    Mirrored,
}
use Met::{Behind, Mirrored, Surface};

/// Surfaces, and the objects that rays meet after arriving at the front and at the back.
const SURFACES: [(&str, [Met; 2]); 10] = [
    (r#""type": "null""#, [Behind; 2]),
    (r#""type": "diffuse""#, [Surface; 2]),
    (
        r#""type": "conductor", "material": "none""#,
        [Mirrored, Surface],
    ),
    (
        r#""type": "twosided", "b": {"type": "conductor", "material": "none"}"#,
        [Mirrored; 2],
    ),
    (
        r#""type": "twosided", "a": {"type": "diffuse"}, "b": {"type": "conductor", "material": "none"}"#,
        [Surface, Mirrored],
    ),
    (
        r#""type": "mask", "opacity": 0.2, "b": {"type": "diffuse"}"#,
        [Behind; 2],
    ),
    (
        r#""type": "mask", "opacity": 0.9, "b": {"type": "diffuse"}"#,
        [Surface; 2],
    ),
    (r#""type": "thindielectric""#, [Behind; 2]),
    (
        r#""type": "roughconductor", "material": "none", "alpha": 0.3"#,
        [Surface; 2],
    ),
    (
        r#""type": "normalmap", "normalmap": {"type": "bitmap", "raw": true, "data": [[[0.5, 0.5, 1]]]}, "b": {"type": "diffuse"}"#,
        [Surface; 2],
    ),
];

const START: DVec3 = DVec3::new(0.0, 0.0, 3.0);

/// The surface at 45° to rays along z, with a red ball on either side along z and a blue one along x.
fn load(bsdf: &str, start: DVec3, integrator: &str) -> Loaded {
    let ball = |x: f64, z: f64, radiance: &str| {
        format!(
            r#"{{"type": "sphere", "center": [{x}, 0, {z}], "radius": 0.5, "emitter": {{"type": "area", "radiance": {{"type": "rgb", "value": {radiance}}}}}}}"#
        )
    };
    let text = format!(
        r#"{{"type": "scene", "integrator": {{{integrator}}},
          "surface": {{"type": "rectangle", "to_world": [{{"rotate": {{"axis": [0, 1, 0], "angle": 45}}}}], "bsdf": {{{bsdf}}}}},
          "a": {}, "b": {}, "c": {}, "d": {},
          "sensor": {{"type": "radiancemeter", "origin": [0, 0, {}], "direction": [0, 0, {}],
            "film": {{"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {{"type": "box"}}}}}}}}"#,
        ball(0.0, 5.0, "[1, 0, 0]"),
        ball(0.0, -5.0, "[1, 0, 0]"),
        ball(5.0, 0.0, "[0, 0, 1]"),
        ball(-5.0, 0.0, "[0, 0, 1]"),
        start.z,
        -start.z,
    );
    let mut diagnostics = Diagnostics::new();
    let scene = json::parse(&text, "scene.json", &[], &mut diagnostics);
    let scene = scene.unwrap_or_else(|| panic!("{diagnostics}\n{text}"));
    let loaded = morgana_io::assemble(&scene, &LoadOptions::default(), diagnostics);
    loaded.unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// Means of all channels of the only pixel.
fn pixel(loaded: &Loaded, samples: u64) -> Vec<f64> {
    let options = RenderOptions::new(loaded.renderer, samples, 7);
    let film = render(&loaded.groups, &options, |_| ControlFlow::Continue(())).film;
    film.mean().into_iter().map(f64::from).collect()
}

/// Returns the object at a point.
fn at(x: DVec3) -> Met {
    match x.abs() {
        x if x.length() < 1.0 => Surface,
        x if x.z > x.x => Behind,
        _ => Mirrored,
    }
}

fn traced(bsdf: &str, start: DVec3) -> Met {
    let loaded = load(bsdf, start, r#""type": "path""#);
    let path = Tracer::new(&loaded.groups[0], None).follow(start, -start);
    let end = at(path.points.last().unwrap().x);
    assert!(
        matches!(path.ending, TraceEnding::Surface(_)),
        "{bsdf}: {:?}",
        path.ending
    );
    end
}

fn followed(bsdf: &str, start: DVec3) -> Met {
    let loaded = load(bsdf, start, r#""type": "aov", "aovs": "exit_position""#);
    let values = pixel(&loaded, 1);
    let names = &loaded.channel_names;
    let value = |name: &str| values[names.iter().position(|n| n.ends_with(name)).unwrap()];
    at(DVec3::new(
        value("position.X"),
        value("position.Y"),
        value("position.Z"),
    ))
}

/// Returns the object that contributes most of the light.
fn rendered(bsdf: &str, start: DVec3) -> Met {
    let loaded = load(bsdf, start, r#""type": "path", "max_depth": 2"#);
    let light = pixel(&loaded, 400);
    match (light[0] > 0.5, light[2] > 0.5) {
        (true, _) => Behind,
        (_, true) => Mirrored,
        _ => Surface,
    }
}

#[test]
fn trace_aov_and_render_meet_the_same() {
    for (bsdf, expected) in SURFACES {
        for (expected, start) in expected.into_iter().zip([START, -START]) {
            let found = [
                traced(bsdf, start),
                followed(bsdf, start),
                rendered(bsdf, start),
            ];
            assert_eq!(found, [expected; 3], "{bsdf} from {start}");
        }
    }
}

/// A glass cube, with rays that start exactly on its front, and a ball of denser glass that extends
/// beyond it.
const GLASS: &str = r#"
  "cube": {"type": "cube", "bsdf": {"type": "dielectric", "int_ior": 1.3}},
  "ball": {"type": "sphere", "center": [0, 0, 1], "radius": 0.5, "bsdf": {"type": "dielectric", "int_ior": 1.6}}"#;

/// Last boundary on a ray through glass, by `trace` and by `aov`.
fn exits(start: DVec3, direction: DVec3) -> [DVec3; 2] {
    let text = format!(
        r#"{{"type": "scene", "integrator": {{"type": "aov", "aovs": "exit_position"}}, {GLASS}, "sky": {{"type": "constant"}},
          "sensor": {{"type": "radiancemeter", "origin": [{}, {}, {}], "direction": [{}, {}, {}],
            "film": {{"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {{"type": "box"}}}}}}}}"#,
        start.x, start.y, start.z, direction.x, direction.y, direction.z
    );
    let mut diagnostics = Diagnostics::new();
    let scene = json::parse(&text, "scene.json", &[], &mut diagnostics);
    let scene = scene.unwrap_or_else(|| panic!("{diagnostics}\n{text}"));
    let loaded = morgana_io::assemble(&scene, &LoadOptions::default(), diagnostics);
    let loaded = loaded.unwrap_or_else(|e| panic!("{e}\n{text}"));
    let path = Tracer::new(&loaded.groups[0], None).follow(start, direction);
    assert_eq!(path.ending, TraceEnding::Left);
    let [.., exit, _] = path.points[..] else {
        panic!("{path:?}");
    };
    let values = pixel(&loaded, 1);
    let names = &loaded.channel_names;
    let value = |name: &str| values[names.iter().position(|n| n.ends_with(name)).unwrap()];
    let followed = ["position.X", "position.Y", "position.Z"].map(value);
    [exit.x, DVec3::from(followed)]
}

/// On a face, and in overlapping media, a ray of `trace` starts in the medium of a camera.
#[test]
fn a_trace_starts_in_the_medium_of_a_camera() {
    for start in [
        // Start on the face of the cube, on the ball, and where one lies in the other.
        DVec3::new(0.7, 0.6, 1.0),
        DVec3::new(0.0, 0.0, 1.5),
        DVec3::new(0.0, 0.0, 0.5),
        DVec3::new(0.1, 0.2, 1.0),
        DVec3::new(0.1, 0.2, 0.8),
        // Start on an edge.
        DVec3::new(1.0, 0.3, 1.0),
    ] {
        for direction in [
            DVec3::new(-0.3, 0.2, -1.0),
            DVec3::new(0.1, -0.3, -0.9),
            DVec3::new(0.3, 0.2, 1.0),
        ] {
            let [traced, followed] = exits(start, direction);
            let off = traced.distance(followed);
            // The radiance meter sees a narrow cone.
            assert!(off < 1e-4, "{start} {direction}: {traced} {followed}");
        }
    }
}
