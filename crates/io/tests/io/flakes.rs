//! Phase functions of flakes in scene files: numbers and grids, and mistakes.

use glam::DVec3;
use morgana_io::{LoadOptions, Loaded, load_scene, npy};
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use transport::render::{RenderOptions, render};

/// Loads a ball of flakes with the contents of a phase function and of its medium.
fn load(folder: &Path, phase: &str, medium: &str) -> Result<Loaded, String> {
    let text = format!(
        "<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/><shape type='sphere'><bsdf type='null'/>\
         <medium name='interior' type='homogeneous'>{medium}<phase type='sggx'>{phase}</phase></medium></shape></scene>"
    );
    let path = folder.join("scene.xml");
    fs::write(&path, text).unwrap();
    load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

/// Returns σ_t at a position of the ball along the axes.
fn extinctions(loaded: &Loaded, x: DVec3) -> [f64; 3] {
    let scene = loaded.scene();
    let medium = scene.medium(scene.medium_at(DVec3::ZERO));
    DVec3::AXES.map(|axis| medium.extinction_along(x, axis)[0])
}

#[test]
fn numbers_and_grids_give_the_matrix() {
    let folder = tempfile::tempdir().unwrap();
    let numbers = "<string name='S' value='1, 0.25, 0.16, 0.1, 0, 0'/>";
    let loaded = load(folder.path(), numbers, "<float name='sigma_t' value='2'/>").unwrap();
    let found = extinctions(&loaded, DVec3::ZERO);
    for (found, expected) in found.into_iter().zip([2.0, 1.0, 0.8]) {
        assert!((found - expected).abs() < 1e-14, "{found}");
    }
    // Two voxels along x, [z, y, x, channel], over the unit cube; the matrix varies between their
    // centres.
    let values = [
        [1.0, 0.25, 0.16, 0.1, 0.0, 0.0],
        [0.25, 1.0, 0.36, 0.0, 0.0, 0.0],
    ];
    let values: Vec<f32> = values.into_iter().flatten().collect();
    npy::write(&folder.path().join("s.npy"), &[1, 1, 2, 6], &values).unwrap();
    let grid = "<volume type='gridvolume' name='S'><string name='filename' value='s.npy'/><string name='axis_order' value='zyx'/>\
                <string name='placement' value='centers'/></volume>";
    let loaded = load(folder.path(), grid, "").unwrap();
    let at = |x: f64| extinctions(&loaded, DVec3::new(x, 0.5, 0.5));
    let close = |found: [f64; 3], squares: [f64; 3]| {
        for (found, square) in found.into_iter().zip(squares) {
            assert!((found - square.sqrt()).abs() < 1e-6, "{found} for {square}");
        }
    };
    close(at(0.1), [1.0, 0.25, 0.16]);
    close(at(0.5), [0.625, 0.625, 0.26]);
    close(at(0.9), [0.25, 1.0, 0.36]);
}

/// Brightness of a cube of fibres under a sky of radiance 1, seen through the middle of a face. The
/// expected values and errors are of 480,000 paths of a plain walk from the face, by another
/// program: exponential distances, and normals by rejection from ⟨ω, m⟩ D(m). False-alarm rate:
/// 1e-3.
#[test]
fn fibres_scatter_as_a_plain_walk_says() {
    let mut zs = Vec::new();
    for (origin, expected, error) in [("-5,0,0", 0.68080, 2.2e-4), ("0,0,-5", 0.95444, 1.2e-4)] {
        for integrator in ["path", "bdpt"] {
            let text = format!(
                "<scene version='3.0.0'><integrator type='{integrator}'/><emitter type='constant'><float name='radiance' value='1'/></emitter>\
                 <shape type='cube'><transform name='to_world'><scale value='0.5'/></transform><bsdf type='null'/>\
                 <medium name='interior' type='homogeneous'><float name='sigma_t' value='2'/><float name='albedo' value='0.8'/>\
                 <phase type='sggx'><string name='S' value='1, 1, 0.01, 0, 0, 0'/></phase></medium></shape>\
                 <sensor type='perspective'><float name='fov' value='0.1'/>\
                 <transform name='to_world'><lookat origin='{origin}' target='0,0,0' up='0,1,0'/></transform>\
                 <film type='hdrfilm'><integer name='width' value='8'/><integer name='height' value='8'/><rfilter type='box'/></film></sensor></scene>"
            );
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("scene.xml");
            fs::write(&path, text).unwrap();
            let loaded = load_scene(&path, &LoadOptions::default()).unwrap();
            let options = RenderOptions::new(loaded.renderer, 4096, 1);
            let rendering = render(&loaded.groups, &options, |_| ControlFlow::Continue(()));
            let first =
                |values: Vec<f32>| values.into_iter().step_by(3).map(f64::from).sum::<f64>() / 64.0;
            let film = &rendering.film;
            let (ours, own) = (first(film.mean()), (first(film.variance()) / 64.0).sqrt());
            println!("{integrator} from {origin}: {ours:.5} ± {own:.5}, expected {expected:.5}");
            assert!(own < 1e-3, "{integrator}: no power");
            zs.push((ours - expected) / own.hypot(error));
        }
    }
    testkit::z_test::max_abs_z(&zs, 1e-3).unwrap();
}

#[test]
fn wrong_flakes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let of = |list: &str| format!("<string name='S' value='{list}'/>");
    let cases = [
        (of("1, 1, 1"), "", "expected six numbers"),
        (of("1, 1, 1, 0, 0, x"), "", "expected six numbers"),
        (String::new(), "", "expected six numbers"),
        (of("1, 1, 0, 0, 0, 0"), "", "must be positive definite"),
        (of("1, 1, 1, 2, 0, 0"), "", "must be positive definite"),
        (
            of("1, 1, 1, 0, 0, 0"),
            "<float name='emission' value='1'/>",
            "cannot emit",
        ),
    ];
    for (phase, medium, expected) in cases {
        let message = load(folder.path(), &phase, medium).unwrap_err();
        assert!(message.contains(expected), "{expected:?} in:\n{message}");
    }
    npy::write(&folder.path().join("s.npy"), &[1, 1, 1, 3], &[1.0; 3]).unwrap();
    let grid =
        "<volume type='gridvolume' name='S'><string name='filename' value='s.npy'/></volume>";
    let message = load(folder.path(), grid, "").unwrap_err();
    assert!(message.contains("but the grid has 3"), "{message}");
    let mixed = "<string name='S' value='1 1 1 0 0 0'/></phase></medium></shape><shape type='sphere'><medium name='interior' \
                 type='homogeneous'><phase type='blendphase'><float name='weight' value='0.5'/><phase type='isotropic'/>\
                 <phase type='sggx'><string name='S' value='1 1 1 0 0 0'/></phase>";
    let message = load(folder.path(), mixed, "").unwrap_err();
    assert!(message.contains("cannot be part of a mixture"), "{message}");
}
