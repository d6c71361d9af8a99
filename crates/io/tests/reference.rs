//! Whole renders against Mitsuba 3 and a light tracer (`data/README.md`), scene files unmodified.
//!
//! Pixels are averaged over blocks of 8 × 8, so that with the few samples of a test the means are
//! close to normal; each channel of each block is compared by z-test at a family-wise false-alarm
//! rate of 1e-4 per image, and the mean of z² over the blocks must be that of a normal distribution
//! within four of its standard errors. `MORGANA_LONG_TESTS=1` takes 16 times as many samples.

use io::npy::{self, NpyData};
use std::ops::ControlFlow;
use std::path::PathBuf;
use testkit::z_test::{max_abs_z, two_sample_z};
use transport::render::{Options, Rendering, render};

const SIZE: usize = 96;
const BLOCK: usize = 8;
const FAMILY: f64 = 1e-4;
/// Blocks dimmer than this share of the image's mean are pooled into one comparison: where few paths
/// bring light, as at the edges of a thin fog, means of a test's few samples are far from normal.
const DIM: f64 = 0.15;

fn data(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name)
}

fn image(name: &str) -> Vec<f64> {
    let array = npy::read(&data(&format!("{name}.npy"))).unwrap();
    assert_eq!(array.shape, [SIZE, SIZE, 3]);
    match array.data {
        NpyData::F32(values) => values.into_iter().map(f64::from).collect(),
        NpyData::F64(values) => values,
    }
}

/// Block means of one channel.
fn blocks(image: &[f64], channel: usize) -> Vec<f64> {
    let n = SIZE / BLOCK;
    let mut sums = vec![0.0; n * n];
    for (i, pixel) in image.chunks_exact(3).enumerate() {
        sums[i / SIZE / BLOCK * n + i % SIZE / BLOCK] += pixel[channel];
    }
    let area = (BLOCK * BLOCK) as f64;
    sums.into_iter().map(|s| s / area).collect()
}

fn shoot(scene: &str, samples: u64) -> Rendering {
    let path = data(&format!("{scene}.xml"));
    let loaded =
        io::load_scene(&path, &io::LoadOptions::default()).unwrap_or_else(|d| panic!("{d}"));
    let long = std::env::var_os("MORGANA_LONG_TESTS").is_some();
    let samples = if long { 16 * samples } else { samples };
    let options = Options {
        integrator: loaded.integrator,
        samples,
        seed: 1,
        strategies: false,
    };
    render(&loaded.groups, &options, |_| ControlFlow::Continue(()))
}

/// Compares a scene's render to a reference in as many channels as differ.
fn compare(scene: &str, reference: &str, channels: usize, samples: u64) {
    let rendering = shoot(scene, samples);
    assert_eq!(rendering.stats.not_finite, 0);
    assert_eq!(rendering.stats.lost, 0);
    let wide = |values: Vec<f32>| -> Vec<f64> { values.into_iter().map(f64::from).collect() };
    let ours = wide(rendering.film.mean());
    let variance = wide(rendering.film.variance());
    let theirs = image(reference);
    let square: Vec<f64> = image(&format!("{reference}_se"))
        .iter()
        .map(|e| e * e)
        .collect();
    let mut zs = Vec::new();
    for c in 0..channels {
        let (a, b) = (blocks(&ours, c), blocks(&theirs, c));
        let (va, vb) = (blocks(&variance, c), blocks(&square, c));
        let mean = b.iter().sum::<f64>() / b.len() as f64;
        let mut dim = [0.0; 4];
        for i in 0..a.len() {
            let [va, vb] = [va[i], vb[i]].map(|v| v / (BLOCK * BLOCK) as f64);
            if va + vb <= 1e-14 * mean * mean {
                assert!((a[i] - b[i]).abs() < 1e-5 * mean, "{scene}: block {i}");
            } else if b[i] < DIM * mean {
                dim = [dim[0] + a[i], dim[1] + va, dim[2] + b[i], dim[3] + vb];
            } else {
                zs.push(two_sample_z(a[i], va.sqrt(), b[i], vb.sqrt()));
            }
        }
        if dim[1] > 0.0 {
            zs.push(two_sample_z(dim[0], dim[1].sqrt(), dim[2], dim[3].sqrt()));
        }
    }
    let mean_square = zs.iter().map(|z| z * z).sum::<f64>() / zs.len() as f64;
    let largest = zs.iter().fold(0.0, |m: f64, z| m.max(z.abs()));
    println!(
        "{scene}: {} comparisons, mean z² {mean_square:.3}, largest |z| {largest:.2}",
        zs.len()
    );
    max_abs_z(&zs, FAMILY).unwrap_or_else(|e| panic!("{scene}: {e}"));
    // Channels of one block share their paths: only the blocks count as independent.
    let independent = zs.len() as f64 / channels as f64;
    let allowed = 4.0 * (2.0 / independent).sqrt();
    assert!(
        (mean_square - 1.0).abs() < allowed,
        "{scene}: mean z² {mean_square}"
    );
}

#[test]
fn fog_around_a_point_light() {
    compare("p1_fog_cube", "p1_fog_cube_lt", 1, 64);
}

#[test]
fn fog_beside_a_point_light() {
    compare("p1b_fog_cube_outside", "p1b_fog_cube_outside", 1, 64);
}

#[test]
fn scattering_ball_behind_a_smooth_wall() {
    compare("p2_milk_ball", "p2_milk_ball", 3, 32);
}

#[test]
fn diffuse_surfaces() {
    compare("p3_cornell", "p3_cornell", 3, 32);
}

#[test]
fn rough_glass_and_metal() {
    compare("p4_rough_glass", "p4_rough_glass", 3, 64);
}

#[test]
fn heterogeneous_smoke() {
    compare("p5_het_smoke", "p5_het_smoke", 1, 64);
}
