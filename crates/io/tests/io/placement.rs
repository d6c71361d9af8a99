//! Emitters, cameras and meters exactly on faces, and coincident surfaces.
//!
//! An object that acts in some directions only behaves on a face as just outside it: with common
//! random numbers, readings must agree to the effect of the distance. A point that radiates in all
//! directions sends each half of its light into the medium on its own side. Statistical comparisons
//! share a false-alarm rate of 1e-3.

use morgana_io::{LoadOptions, Loaded, Run};
use std::fs;
use std::ops::ControlFlow;
use testkit::z_test::max_abs_z;
use transport::meter::Meter;
use transport::render::{Handle, MeasureOptions, Measurement, measure};

/// Small relative distance from a face, for the limit of zero distance.
const TOLERANCE: f64 = 1e-9;
/// Relative distances that count as zero.
const ON_FACE: [f64; 3] = [0.0, 1e-12, -1e-12];
const FAMILY: f64 = 1e-3;

fn load(text: &str) -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.json");
    fs::write(&path, text).unwrap();
    let loaded = morgana_io::load_scene(&path, &LoadOptions::default());
    loaded.unwrap_or_else(|d| panic!("{d}\n{text}"))
}

fn run(text: &str, particles: u64) -> Measurement {
    let loaded = load(text);
    let meters: Vec<Meter> = loaded.instruments.iter().map(|i| i.meter.clone()).collect();
    let options = MeasureOptions {
        first: 0,
        particles,
        seed: 1,
        max_depth: None,
        rr_depth: 5,
    };
    let go_on = |_| ControlFlow::Continue(());
    measure(&loaded.groups, &meters, &options, &Handle::default(), go_on).unwrap()
}

/// Power that media absorb, that escapes, and that is lost.
fn balance(measurement: &Measurement) -> [f64; 3] {
    let balance = &measurement.balance;
    [&balance.media, &balance.escaped, &balance.lost].map(|entry| entry.mean)
}

#[track_caller]
fn assert_same(found: &[f64], expected: &[f64], what: &str) {
    let same = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-6 * (1.0 + b.abs());
    assert!(
        found.iter().zip(expected).all(same),
        "{what}: {found:?} in place of {expected:?}"
    );
}

/// Bodies of size about 10 whose face at z = 0 meets the axis x = y = 0.3, with the medium inside.
fn bodies(n: f64) -> Vec<(&'static str, String)> {
    let medium = format!(
        r#""interior": {{"type": "homogeneous", "sigma_a": 0.3, "sigma_s": 2.0, "ior": {n}, "phase": {{"type": "hg", "g": 0.5}}}}"#
    );
    let bsdf = r#""bsdf": {"type": "dielectric"}"#;
    let of = |shape: &str| format!("{{{shape}, {bsdf}, {medium}}}");
    let at = r#""to_world": [{"scale": [10, 10, 5]}, {"translate": [0, 0, 5]}]"#;
    let corners = "[[-9,-8,0],[9,-8,0],[9,8,0],[-9,8,0],[-7,-8,9],[9,-8,8],[9,8,9],[-9,8,9]]";
    let faces = "[[0,2,1],[0,3,2],[4,5,6],[4,6,7],[0,1,5],[0,5,4],[1,2,6],[1,6,5],[2,3,7],[2,7,6],[3,0,4],[3,4,7]]";
    let labels = |smooth: &str| {
        let layer = format!("[{}]", ["[1,1,1]"; 3].join(","));
        let data = [layer.as_str(); 3].join(",");
        format!(
            r#"{{"type": "labels", "id": "t", "data": [{data}], {smooth} "to_world": [{{"scale": [18, 18, 9]}}, {{"translate": [-9, -9, 0]}}],
            "properties": [[0, 0, 1, 1], [0.3, 2.0, 0.5, {n}]]}}"#
        )
    };
    vec![
        ("cube", of(&format!(r#""type": "cube", {at}"#))),
        (
            "cylinder",
            of(
                r#""type": "cylinder", "capped": true, "p0": [0, 0, 0], "p1": [0, 0, 9], "radius": 8"#,
            ),
        ),
        (
            "mesh",
            of(&format!(
                r#""type": "mesh", "vertex_positions": {corners}, "faces": {faces}"#
            )),
        ),
        ("labels", labels("")),
        // Its pole is at (0.3, 0.3, 0).
        (
            "sphere",
            of(r#""type": "sphere", "center": [0.3, 0.3, 6], "radius": 6"#),
        ),
    ]
}

/// Emitters at (0.3, 0.3, z) that shine along z.
fn directed(z: f64) -> Vec<(&'static str, String)> {
    let at = format!(r#""to_world": [{{"translate": [0.3, 0.3, {z:e}]}}]"#);
    let of = |rest: &str| format!("{{{rest}, {at}}}");
    vec![
        (
            "beam",
            of(r#""type": "collimated", "radius": 0.001, "power": 1.0"#),
        ),
        (
            "gaussian",
            of(r#""type": "collimated", "profile": "gaussian", "radius": 0.0005, "power": 1.0"#),
        ),
        (
            "fiber",
            of(
                r#""type": "fiber", "radius": 0.0005, "power": 1.0, "cutoff_angle": 30, "angular_profile": "lambertian""#,
            ),
        ),
        (
            "spot",
            of(r#""type": "spot", "intensity": 1.0, "cutoff_angle": 40"#),
        ),
    ]
}

#[test]
fn directed_emitters_on_faces_act_as_from_outside() {
    for n in [1.0, 1.37] {
        for (body, shape) in bodies(n) {
            let run = |z: f64| {
                let found = directed(z).into_iter().map(|(kind, emitter)| {
                    let scene = format!(
                        r#"{{"type": "scene", "integrator": {{"type": "particle"}}, "body": {shape}, "light": {emitter},
                        "m": {{"type": "fluencemeter", "nx": 1, "ny": 1, "nz": 1}}}}"#
                    );
                    (kind, balance(&run(&scene, 40)))
                });
                found.collect::<Vec<_>>()
            };
            let limit = run(-10.0 * TOLERANCE);
            for offset in ON_FACE {
                for ((kind, found), (_, expected)) in run(10.0 * offset).iter().zip(&limit) {
                    assert!(expected[0] > 0.05, "{kind} {body}: {expected:?}");
                    let what = format!("{kind} at {offset} from the face of a {body} of index {n}");
                    assert_same(found, expected, &what);
                }
            }
        }
    }
}

#[test]
fn a_point_on_a_face_sends_half_of_its_light_to_either_side() {
    let mut zs = Vec::new();
    for (body, shape) in bodies(1.5) {
        // Make the medium so dark that nothing leaves it.
        let dark = shape.replace(
            "\"sigma_a\": 0.3, \"sigma_s\": 2.0",
            "\"sigma_a\": 1e9, \"sigma_s\": 0.0",
        );
        let dark = dark.replace("[0.3, 2.0, 0.5", "[1e9, 0.0, 0.5");
        let mut places: Vec<([f64; 3], f64)> = match body {
            "sphere" => Vec::new(), // The inside of a ball is not on one side of a plane.
            _ => ON_FACE
                .map(|offset| ([0.3, 0.3, 10.0 * offset], 0.5))
                .into(),
        };
        // An edge and a corner.
        if body == "cube" {
            places.extend([([10.0, 0.3, 0.0], 0.25), ([10.0, 10.0, 0.0], 0.125)]);
        }
        if body == "labels" {
            places.extend([([0.3, -9.0, 0.0], 0.25), ([-9.0, 9.0, 9.0], 0.125)]);
        }
        for (position, share) in places {
            let scene = format!(
                r#"{{"type": "scene", "integrator": {{"type": "particle"}}, "body": {dark},
                "light": {{"type": "point", "position": {position:?}, "intensity": 1.0}},
                "m": {{"type": "fluencemeter", "nx": 1, "ny": 1, "nz": 1}}}}"#
            );
            let found = run(&scene, 2000);
            let media = &found.balance.media;
            assert_eq!(found.balance.lost.mean, 0.0, "{body} at {position:?}");
            let z = (media.mean - share * found.emitted[0]) / media.error.max(1e-9);
            assert!(z.abs() < 6.0, "{body} at {position:?}: {media:?}");
            zs.push(z);
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// Returns the mean of a small image, and its standard error.
fn picture(text: &str, samples: u64) -> (f64, f64) {
    let loaded = load(text);
    let run = Run {
        total: Some(samples),
        ..Run::new(&loaded)
    };
    run.render().unwrap().film.summary()
}

/// Cameras on a face that look through an absorber of optical depth 2 at a white sky see e⁻² in
/// every pixel.
#[test]
fn cameras_on_faces_see_the_medium() {
    let film =
        r#""film": {"type": "hdrfilm", "width": 3, "height": 3, "pixel_format": "luminance"}"#;
    let at = |z: f64| {
        format!(
            r#""to_world": [{{"lookat": {{"origin": [0.3, 0.3, {z:e}], "target": [0.3, 0.3, 5], "up": [0, 1, 0]}}}}]"#
        )
    };
    let cameras = |z: f64| {
        let [pinhole, lens] = ["perspective", "thinlens"].map(|kind| {
            let lens = if kind == "thinlens" {
                r#""aperture_radius": 0.01, "focus_distance": 5,"#
            } else {
                ""
            };
            format!(
                r#"{{"type": "{kind}", "fov": 0.5, {lens} {}, {film}}}"#,
                at(z)
            )
        });
        let orthographic = format!(
            r#"{{"type": "orthographic", {}, {film}}}"#,
            at(z).replace("[{", r#"[{"scale": 0.01}, {"#)
        );
        [pinhole, lens, orthographic]
    };
    let block = r#"{"type": "cube", "to_world": [{"scale": [5, 5, 5]}, {"translate": [0, 0, 5]}], "bsdf": {"type": "null"},
        "interior": {"type": "homogeneous", "sigma_a": 0.2, "sigma_s": 0}}"#;
    let mut zs = Vec::new();
    for integrator in ["path", "bdpt"] {
        for offset in ON_FACE {
            for camera in cameras(10.0 * offset) {
                let scene = format!(
                    r#"{{"type": "scene", "integrator": {{"type": "{integrator}"}}, "camera": {camera}, "block": {block},
                    "sky": {{"type": "constant"}}}}"#
                );
                let (mean, error) = picture(&scene, 400);
                zs.push((mean - (-2.0f64).exp()) / error);
            }
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// Single scattering of a point light on a face of haze, matched and refracting, seen from inside
/// by three estimators.
#[test]
fn estimators_agree_on_a_point_on_a_face() {
    let mut zs = Vec::new();
    for n in [1.0, 1.4] {
        let means = ["path", "bdpt", "particle"].map(|integrator| {
            let bsdf = if n > 1.0 { "dielectric" } else { "null" };
            let scene = format!(
                r#"{{"type": "scene", "integrator": {{"type": "{integrator}", "max_depth": 2}},
                "camera": {{"type": "perspective", "fov": 40,
                    "to_world": [{{"lookat": {{"origin": [0.1, -2, 8], "target": [0, 0, 3], "up": [0, 1, 0]}}}}],
                    "film": {{"type": "hdrfilm", "width": 2, "height": 2, "pixel_format": "luminance", "rfilter": {{"type": "box"}}}}}},
                "haze": {{"type": "cube", "to_world": [{{"scale": 5}}, {{"translate": [0, 0, 5]}}], "bsdf": {{"type": "{bsdf}"}},
                    "interior": {{"type": "homogeneous", "sigma_t": 0.3, "albedo": 0.9, "ior": {n}}}}},
                "light": {{"type": "point", "position": [0.3, 0.2, 0], "intensity": 1.0}}}}"#
            );
            picture(&scene, 8000)
        });
        for (mean, error) in &means[..2] {
            let (other, deviation) = means[2];
            assert!(*mean > 0.0 && other > 0.0);
            zs.push((mean - other) / error.hypot(deviation));
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// Coincident objects: a block, a null box of equal size, a null inclusion that shares its top, a
/// second block that shares its right face, a disk under the beam and a meter on the top.
///
/// `moved` is a list of transforms, each after a comma, that all of them share.
fn coincident(moved: &str) -> Vec<(&'static str, String)> {
    let tissue = |a: f64, n: f64| {
        format!(
            r#""interior": {{"type": "homogeneous", "sigma_a": {a}, "sigma_s": 2.0, "ior": {n}}}"#
        )
    };
    let cube = |scale: &str, at: &str| {
        format!(
            r#""type": "cube", "to_world": [{{"scale": {scale}}}, {{"translate": {at}}}{moved}]"#
        )
    };
    let glass = r#""bsdf": {"type": "dielectric"}"#;
    let null = r#""bsdf": {"type": "null"}"#;
    vec![
        (
            "block",
            format!(
                "{{{}, {glass}, {}}}",
                cube("[4,4,2]", "[0,0,2]"),
                tissue(0.2, 1.37)
            ),
        ),
        (
            "shell",
            format!("{{{}, {null}}}", cube("[4,4,2]", "[0,0,2]")),
        ),
        (
            "inclusion",
            format!(
                "{{{}, {null}, {}}}",
                cube("[1,1,1]", "[0,0,1]"),
                tissue(0.6, 1.37)
            ),
        ),
        (
            "neighbour",
            format!(
                "{{{}, {glass}, {}}}",
                cube("[1,4,2]", "[5,0,2]"),
                tissue(0.3, 1.45)
            ),
        ),
        (
            "disk",
            format!(r#"{{"type": "disk", {null}, "to_world": [{{"scale": 0.7}}{moved}]}}"#),
        ),
        (
            "top",
            format!(
                r#"{{"type": "rectangle", {null}, "to_world": [{{"scale": 4}}{moved}], "out": {{"type": "irradiancemeter", "id": "out"}}}}"#
            ),
        ),
        (
            "beam",
            format!(
                r#"{{"type": "collimated", "radius": 0.5, "power": 1.0, "to_world": [{{"translate": [0.1, 0.2, 0]}}{moved}]}}"#
            ),
        ),
        (
            "room",
            format!(
                r#"{{"type": "fluencemeter", "id": "room", "nx": 3, "ny": 1, "nz": 3,
                "to_world": [{{"scale": [10, 8, 4]}}, {{"translate": [-4, -4, 0]}}{moved}]}}"#
            ),
        ),
    ]
}

/// A scene of parts in a given order.
fn scene_of(parts: &[(&str, String)]) -> String {
    let part = |(name, part): &(&str, String)| format!("\"{name}\": {part}");
    let parts = parts.iter().map(part).collect::<Vec<_>>().join(",\n");
    format!(r#"{{"type": "scene", "integrator": {{"type": "particle"}}, {parts}}}"#)
}

/// All readings of a scene of parts in a given order.
fn readings(parts: &[(&str, String)], particles: u64) -> Vec<(String, Vec<f64>)> {
    let text = scene_of(parts);
    let loaded = load(&text);
    let found = run(&text, particles);
    let mut all: Vec<(String, Vec<f64>)> = Vec::new();
    for (instrument, readings) in loaded.instruments.iter().zip(&found.readings) {
        for reading in readings {
            all.push((
                format!("{} {}", instrument.name, reading.name),
                reading.mean.iter().copied().collect(),
            ));
        }
    }
    all.push(("balance".into(), balance(&found).to_vec()));
    all.sort_by(|a, b| a.0.cmp(&b.0));
    all
}

/// Returns a permutation of the things; `k` selects it.
fn permuted<T: Clone>(things: &[T], k: usize) -> Vec<T> {
    let mut left: Vec<T> = things.to_vec();
    let mut number = k.wrapping_mul(7919);
    let mut all = Vec::new();
    while !left.is_empty() {
        all.push(left.remove(number % left.len()));
        number = number / 3 + 5 * number % 1009;
    }
    all
}

#[test]
fn the_order_of_coincident_objects_does_not_matter() {
    let count = if std::env::var_os("MORGANA_LONG_TESTS").is_some() {
        400
    } else {
        24
    };
    let parts = coincident("");
    let expected = readings(&parts, 60);
    for k in 1..count {
        let found = readings(&permuted(&parts, k), 60);
        assert_eq!(found, expected, "permutation {k}");
    }
}

/// Readings do not depend on rotation, translation and order, within errors, because directions are
/// sampled about other axes.
#[test]
fn coincident_objects_may_be_turned_and_shifted() {
    let power = |parts: &[(&str, String)]| {
        let found = run(&scene_of(parts), 3000);
        let balance = &found.balance;
        assert_eq!(balance.lost.mean, 0.0);
        let powers = found
            .readings
            .iter()
            .flatten()
            .filter(|r| r.name == "power");
        let powers = powers.flat_map(|r| r.mean.iter().copied().zip(r.error.iter().copied()));
        let media = (balance.media.mean, balance.media.error);
        powers.chain([media]).collect::<Vec<_>>()
    };
    let expected = power(&coincident(""));
    assert_eq!(expected.len(), 3);
    let mut zs = Vec::new();
    for (k, axis) in ["[1, 2, -1]", "[0, 0, 1]", "[0.3, -1, 0.2]"]
        .iter()
        .enumerate()
    {
        let angle = 37 * (k + 1);
        let moved = format!(
            r#", {{"rotate": {{"axis": {axis}, "angle": {angle}}}}}, {{"translate": [3, -7, 11]}}"#
        );
        let found = power(&permuted(&coincident(&moved), k));
        for ((mean, error), (other, deviation)) in found.iter().zip(&expected) {
            // All light passes the disk and the top when it enters.
            let error = error.hypot(*deviation).max(1e-6);
            zs.push((mean - other) / error);
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// Light meets transmitting sheets exactly on a wall or on one another as if they were apart.
#[test]
fn sheets_that_let_light_through_do_not_hide_what_they_lie_on() {
    let rectangle = |y: f64, size: f64, bsdf: &str| {
        format!(
            r#"{{"type": "rectangle", "to_world": [{{"scale": {size}}}, {{"rotate": {{"axis": [1, 0, 0], "angle": -90}}}}, {{"translate": [0, {y:e}, 0]}}], "bsdf": {bsdf}}}"#
        )
    };
    let white = r#"{"type": "twosided", "n": {"type": "diffuse", "reflectance": 1.0}}"#;
    let mask = format!(r#"{{"type": "mask", "opacity": 0.5, "n": {white}}}"#);
    let black = r#"{"type": "diffuse", "reflectance": 0.0}"#;
    let pane = r#"{"type": "thindielectric"}"#;
    let polarizer = r#"{"type": "polarizer"}"#;
    let cases = [
        (black, 4.0, mask.as_str()),
        (black, 4.0, pane),
        (black, 4.0, polarizer),
        (&mask, 1.0, &mask),
        (pane, 1.0, pane),
    ];
    for (below, size, above) in cases {
        let seen = |y: f64, swapped: bool| {
            let [a, b] = if swapped { ["z", "a"] } else { ["a", "z"] };
            let text = format!(
                r#"{{"type": "scene", "integrator": {{"type": "path"}}, "sky": {{"type": "constant", "radiance": 1}},
                "sensor": {{"type": "perspective", "fov": 40,
                  "to_world": [{{"lookat": {{"origin": [0.3, 2.5, 5], "target": [0, -0.5, 0], "up": [0, 1, 0]}}}}],
                  "film": {{"type": "hdrfilm", "width": 8, "height": 8, "pixel_format": "luminance", "rfilter": {{"type": "box"}}}}}},
                "{a}": {}, "{b}": {}}}"#,
                rectangle(-1.0, size, below),
                rectangle(y, 1.0, above)
            );
            picture(&text, 64).0
        };
        let expected = seen(-1.0 + 1e3 * TOLERANCE, false);
        for swapped in [false, true] {
            let found = seen(-1.0, swapped);
            let what = format!("{above} on {below}");
            assert!(
                (found - expected).abs() < 1e-4,
                "{what}: {found} in place of {expected}"
            );
        }
    }
}

#[test]
fn a_meter_on_a_face_reads_what_passes_it() {
    for (body, shape) in bodies(1.37) {
        if body == "sphere" {
            continue;
        }
        let with = |z: f64, first: bool| {
            let meter = format!(
                r#"{{"type": "rectangle", "bsdf": {{"type": "null"}}, "to_world": [{{"scale": 20}}, {{"translate": [0, 0, {z:e}]}}],
                "out": {{"type": "irradiancemeter", "id": "out"}}}}"#
            );
            let beam = directed(-1.0).swap_remove(0);
            let mut parts = vec![("body", shape.clone()), ("sheet", meter), beam];
            if first {
                parts.swap(0, 1);
            }
            readings(&parts, 60)
        };
        let limit = with(-10.0 * TOLERANCE, false);
        for first in [false, true] {
            for ((name, found), (_, expected)) in with(0.0, first).iter().zip(&limit) {
                assert_same(
                    found,
                    expected,
                    &format!("{name}, {body}, meter first: {first}"),
                );
            }
        }
    }
}
