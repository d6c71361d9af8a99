//! Scenes with rounded, mirrored and scaled transforms, compared with exact transforms.
//!
//! Rounding moves objects by the lost digits. With common random numbers, images then agree to this
//! accuracy, except for the few samples that pass an edge on its other side: [`TOLERANCES`].
//!
//! A scene that is rotated, mirrored or scaled as a whole looks the same, for two estimators. Means
//! of images are compared by z-test, at a false-alarm rate of 1e-4 for each of the two families.

mod cases;
mod map;

use cases::Case;
use map::{IDENTITY, Map, maps};
use morgana_io::{Diagnostics, LoadOptions, Loaded, PluginKind, json, schema};
use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::path::Path;
use testkit::z_test::{max_abs_z, two_sample_z};
use transport::meter::Meter;
use transport::render::{Handle, MeasureOptions, RenderOptions, measure, render};

const FAMILY: f64 = 1e-4;
/// Samples per pixel; images have 16 pixels.
const SAMPLES: u64 = 16;
/// Digits, and the allowed change of an image's mean. A displacement of 1e-4 of the size changes
/// means by as much, or by a few of 256 samples. At six and eight digits edges are too narrow for
/// samples to change sides.
const TOLERANCES: [(i32, f64); 3] = [(4, 3e-2), (6, 1e-4), (8, 1e-6)];

fn load(case: &Case, map: &Map, folder: &Path, integrator: &str) -> Loaded {
    let text = (case.scene)(map).to_string();
    let mut diagnostics = Diagnostics::new();
    let options = LoadOptions {
        integrator: Some(integrator.into()),
        ..LoadOptions::default()
    };
    let scene = json::parse(&text, folder.join("scene.json"), &[], &mut diagnostics);
    let scene = scene.unwrap_or_else(|| panic!("{}: {diagnostics}", case.plugin));
    morgana_io::assemble(&scene, &options, diagnostics)
        .unwrap_or_else(|d| panic!("{}: {d}", case.plugin))
}

/// Mean of an image, and its standard error.
fn mean(case: &Case, map: &Map, folder: &Path, (integrator, seed): (&str, u64)) -> (f64, f64) {
    let loaded = load(case, map, folder, integrator);
    let options = RenderOptions::new(loaded.renderer, SAMPLES, seed);
    let rendering = render(&loaded.groups, &options, |_| ControlFlow::Continue(()));
    assert_eq!(rendering.stats.not_finite, 0);
    let (mean, error) = rendering.film.summary();
    assert!(mean > 0.0, "{} {} is black", case.kind, case.plugin);
    (mean, error)
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    cases::write_files(folder.path());
    folder
}

/// z of two means with their errors; 0 if they are equal.
fn z((a, da): (f64, f64), (b, db): (f64, f64)) -> f64 {
    if (a - b).abs() < 1e-12 * a {
        0.0
    } else {
        two_sample_z(a, da, b, db)
    }
}

#[test]
fn every_plugin_with_a_transform_is_here() {
    let mut missing = BTreeSet::new();
    for kind in [
        PluginKind::Emitter,
        PluginKind::Sensor,
        PluginKind::Shape,
        PluginKind::Volume,
    ] {
        let placed = schema::plugins(kind).iter().filter(|p| p.has("to_world"));
        missing.extend(placed.map(|p| (kind, p.name)));
    }
    for case in cases::all() {
        assert!(
            missing.remove(&(case.kind, case.plugin)),
            "{} is there twice",
            case.plugin
        );
    }
    // Transforms do not change the radii of curves, and scale the radii of hair; hair, curves,
    // radiance meters and distant sensors have their own tests. Constants do not depend on
    // transforms.
    assert_eq!(
        missing,
        BTreeSet::from([
            (PluginKind::Sensor, "distant"),
            (PluginKind::Sensor, "fluencemeter"),
            (PluginKind::Sensor, "radiancemeter"),
            (PluginKind::Shape, "bsplinecurve"),
            (PluginKind::Shape, "hair"),
            (PluginKind::Shape, "linearcurve"),
            (PluginKind::Volume, "constvolume"),
        ])
    );
}

#[test]
fn rounded_transforms_show_what_exact_ones_do() {
    let folder = folder();
    // Bins of the adjoint estimate of a pilot are edges, too; with this seed no path crosses one.
    let by = ("path", 5);
    for case in cases::all().iter().chain(&cases::shining()) {
        for (name, map) in maps() {
            let (exact, _) = mean(case, &map, folder.path(), by);
            for (digits, tolerance) in TOLERANCES {
                let (rounded, _) = mean(case, &map.rounded(digits), folder.path(), by);
                let change = rounded / exact - 1.0;
                let (kind, plugin) = (case.kind, case.plugin);
                assert!(
                    change.abs() < tolerance,
                    "{kind} {plugin}, {name}, {digits} digits: {change}"
                );
            }
        }
    }
}

#[test]
fn scenes_moved_as_a_whole_look_the_same() {
    let folder = folder();
    let mut zs = Vec::new();
    for case in cases::all().iter().chain(&cases::shining()) {
        let still = mean(case, &IDENTITY, folder.path(), ("path", 1));
        for (seed, (name, map)) in (2..).zip(maps()) {
            let moved = mean(case, &map, folder.path(), ("path", seed));
            zs.push(z(still, moved));
            println!("{} {}, {name}: {still:?} {moved:?}", case.kind, case.plugin);
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

#[test]
fn two_estimators_agree_under_rounded_transforms() {
    let folder = folder();
    let mut zs = Vec::new();
    for case in cases::all()
        .iter()
        .filter(|c| c.kind == PluginKind::Emitter)
    {
        for (_, map) in maps() {
            let map = map.rounded(6);
            let by = |integrator, seed| mean(case, &map, folder.path(), (integrator, seed));
            zs.push(z(by("path", 1), by("bdpt", 2)));
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

#[test]
fn meters_read_the_same_under_rounded_transforms() {
    let folder = folder();
    let case = Case {
        kind: PluginKind::Sensor,
        plugin: "fluencemeter",
        scene: cases::metered,
    };
    let read = |map: &Map| {
        let loaded = load(&case, map, folder.path(), "particle");
        let meters: Vec<Meter> = loaded.instruments.iter().map(|i| i.meter.clone()).collect();
        let options = MeasureOptions {
            first: 0,
            particles: 2000,
            seed: 1,
            max_depth: None,
            rr_depth: 5,
        };
        let go_on = |_| ControlFlow::Continue(());
        let read = measure(&loaded.groups, &meters, &options, &Handle::default(), go_on).unwrap();
        read.readings[0][0].mean.iter().sum::<f64>()
    };
    for (name, map) in maps() {
        let exact = read(&map);
        for (digits, tolerance) in TOLERANCES {
            let change = read(&map.rounded(digits)) / exact - 1.0;
            assert!(
                change.abs() < tolerance,
                "{name}, {digits} digits: {change}"
            );
        }
    }
}
