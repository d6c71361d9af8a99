//! Memory of films during renders, in bytes per pixel, and of meshes during reading, in bytes per
//! triangle.
//!
//! This file has a single test, because the allocator counts the memory of the whole program.

use morgana_io::{LoadOptions, Loaded, Run};
use peak_alloc::PeakAlloc;
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::path::Path;
use transport::render::{Handle, State, memory};

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Pixels along each side of a film.
const SIDE: usize = 256;
/// Number of threads, and maximum bytes per thread for its work.
const THREADS: usize = 2;
const WORK: usize = 1 << 20;
/// Maximum bytes per pixel of three channels, by a path tracer, with filters of one pixel and with
/// wider ones, for which values of cells wait until they are spread over pixels.
const MAX_BYTES_PER_PIXEL: [(&str, usize); 2] = [("box", 170), ("path", 200)];
/// Maximum bytes per triangle of a closed mesh: kept, and during reading. The search for straight
/// lines keeps copies of the triangles in single precision, which take 20 bytes more than a
/// hierarchy over the mesh alone and halve the time of a line among many meshes.
const MAX_KEPT: usize = 130;
const MAX_READ: usize = 200;

fn load(folder: &Path, scene: &Value) -> Loaded {
    let path = folder.join("scene.json");
    std::fs::write(&path, scene.to_string()).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).unwrap()
}

/// A ball under a sky.
fn ball(integrator: &Value, film: &Value, samples: u64, sampler: &str) -> Value {
    let mut all = json!({"type": "hdrfilm", "width": SIDE, "height": SIDE});
    let more = film.as_object().unwrap().clone();
    all.as_object_mut().unwrap().extend(more);
    json!({
        "type": "scene",
        "integrator": integrator,
        "sensor": {
            "type": "perspective", "fov": 40, "to_world": [{"translate": [0, 0, -4]}], "film": all,
            "sampler": {"type": sampler, "sample_count": samples},
        },
        "ball": {"type": "sphere", "bsdf": {"type": "diffuse"}},
        "sky": {"type": "constant"},
    })
}

/// Peak memory of a render, and its estimate in advance.
fn rendered(loaded: &Loaded) -> [usize; 2] {
    let options = Run::new(loaded).options();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(THREADS);
    let pool = pool.build().unwrap();
    let before = ALLOCATOR.current_usage();
    ALLOCATOR.reset_peak_usage();
    let state = pool.install(|| {
        let mut state = State::new(&loaded.groups, &options);
        let handle = Handle::default();
        state.advance(&loaded.groups, &options, &handle, |_| {
            ControlFlow::Continue(())
        });
        state
    });
    assert_eq!(state.done().count(), options.samples);
    let peak = ALLOCATOR.peak_usage() - before;
    [peak, memory(loaded.scene(), &options)]
}

fn films(folder: &Path) {
    let path = json!({"type": "path"});
    let aov = json!({"type": "aov", "aovs": "depth:depth", "image": {"type": "path"}});
    let photons = json!({"type": "photon"});
    let plain = json!({});
    let layers = json!({"decomposition": "bounce", "max_bounces": 3});
    for (name, integrator, film) in [
        ("path", &path, &plain),
        ("box", &path, &json!({"rfilter": {"type": "box"}})),
        ("layers", &path, &layers),
        ("reweight", &path, &json!({"reweight": true})),
        ("one channel", &path, &json!({"pixel_format": "luminance"})),
        ("aov", &aov, &plain),
        ("bdpt", &json!({"type": "bdpt"}), &plain),
        ("photons", &photons, &plain),
        ("vcm", &json!({"type": "vcm"}), &plain),
    ] {
        for (samples, sampler) in [(1, "independent"), (24, "independent"), (16, "ldsampler")] {
            let loaded = load(folder, &ball(integrator, film, samples, sampler));
            let [peak, told] = rendered(&loaded);
            let pixels = SIDE * SIDE;
            println!(
                "{name}, {samples} samples: {} and {} bytes a pixel",
                peak / pixels,
                told / pixels
            );
            // The check of memory does not include photon maps.
            if !["photons", "vcm"].contains(&name) {
                assert!(peak < told + THREADS * WORK, "{name}: {peak} {told}");
            }
            let limit = MAX_BYTES_PER_PIXEL.iter().find(|(of, _)| *of == name);
            if let (Some((_, most)), 1) = (limit, samples) {
                assert!(peak < most * pixels, "{name}: {peak}");
                assert!(told < most * pixels, "{name}: {told}");
            }
        }
    }
}

/// Triangles of a closed surface, two for each cell of `n` × 2n, as a binary PLY file.
fn ply(n: usize) -> (Vec<u8>, usize) {
    let (rows, columns) = (n, 2 * n);
    let mut vertices: Vec<[f32; 3]> = Vec::new();
    for row in 1..rows {
        for column in 0..columns {
            let polar = std::f64::consts::PI * row as f64 / rows as f64;
            let around = std::f64::consts::TAU * column as f64 / columns as f64;
            let r = 1.0 + 0.1 * (7.0 * around).sin() * polar.sin();
            let p = [
                polar.sin() * around.cos(),
                polar.sin() * around.sin(),
                polar.cos(),
            ];
            vertices.push(p.map(|x| (r * x) as f32));
        }
    }
    let poles = [vertices.len(), vertices.len() + 1];
    vertices.extend([[0.0, 0.0, 1.1], [0.0, 0.0, -1.1]]);
    let at = |row: usize, column: usize| (row - 1) * columns + column % columns;
    let mut faces: Vec<[usize; 3]> = Vec::new();
    for column in 0..columns {
        faces.push([poles[0], at(1, column), at(1, column + 1)]);
        faces.push([poles[1], at(rows - 1, column + 1), at(rows - 1, column)]);
        for row in 1..rows - 1 {
            let [a, b] = [at(row, column), at(row, column + 1)];
            let [c, d] = [at(row + 1, column), at(row + 1, column + 1)];
            faces.extend([[a, c, b], [b, c, d]]);
        }
    }
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        faces.len()
    )
    .into_bytes();
    bytes.extend(vertices.iter().flatten().flat_map(|x| x.to_le_bytes()));
    for face in &faces {
        bytes.push(3);
        bytes.extend(face.iter().flat_map(|v| (*v as i32).to_le_bytes()));
    }
    (bytes, faces.len())
}

fn meshes(folder: &Path) {
    let (bytes, triangles) = ply(200);
    std::fs::write(folder.join("mesh.ply"), bytes).unwrap();
    let mut scene = ball(
        &json!({"type": "path"}),
        &json!({"width": 4, "height": 4}),
        1,
        "independent",
    );
    scene["ball"] = json!({"type": "ply", "filename": "mesh.ply", "bsdf": {"type": "diffuse"}});
    let before = ALLOCATOR.current_usage();
    ALLOCATOR.reset_peak_usage();
    let loaded = load(folder, &scene);
    let [kept, read] = [ALLOCATOR.current_usage(), ALLOCATOR.peak_usage()]
        .map(|bytes| (bytes - before) / triangles);
    assert!(loaded.scene().objects()[0].shape.is_closed());
    println!("{triangles} triangles: {kept} bytes each, {read} at most");
    assert!(kept < MAX_KEPT && read < MAX_READ, "{kept} {read}");
}

#[test]
fn pixels_and_triangles_take_no_more_than_they_may() {
    let folder = tempfile::tempdir().unwrap();
    films(folder.path());
    meshes(folder.path());
}
