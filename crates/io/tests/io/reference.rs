//! Whole renders, compared with Mitsuba 3 and a light tracer (`data/README.md`), with unmodified
//! scene files.
//!
//! Pixels are averaged over blocks of 8 × 8, so that means are close to normal with the few samples
//! of a test. Each channel of each block is compared by z-test at a family-wise false-alarm rate of
//! 1e-4 per image. The mean of z² over the blocks must agree with a normal distribution within four
//! of its standard errors. `MORGANA_LONG_TESTS=1` takes 16 times as many samples.

use morgana_io::npy::{self, NpyData};
use std::ops::ControlFlow;
use std::path::PathBuf;
use testkit::z_test::{max_abs_z, two_sample_z};
use transport::render::{RenderOptions, Rendering, render};

const SIZE: usize = 96;
const BLOCK: usize = 8;
const FAMILY: f64 = 1e-4;
/// Blocks dimmer than this fraction of the image's mean are pooled into one comparison. Where few
/// paths carry light, as at the edges of a thin fog, means of a test's few samples are far from
/// normal.
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

fn load(scene: &str, integrator: Option<&str>) -> morgana_io::Loaded {
    let options = morgana_io::LoadOptions {
        integrator: integrator.map(str::to_owned),
        ..morgana_io::LoadOptions::default()
    };
    morgana_io::load_scene(&data(&format!("{scene}.xml")), &options)
        .unwrap_or_else(|d| panic!("{d}"))
}

fn shoot(loaded: &morgana_io::Loaded, samples: u64, seed: u64) -> Rendering {
    let long = std::env::var_os("MORGANA_LONG_TESTS").is_some();
    let samples = if long { 16 * samples } else { samples };
    let options = RenderOptions::new(loaded.renderer, samples, seed);
    let rendering = render(&loaded.groups, &options, |_| ControlFlow::Continue(()));
    assert_eq!(rendering.stats.not_finite, 0);
    assert_eq!(rendering.stats.lost, 0);
    rendering
}

/// Block means of a channel and their variances.
type Blocks = Box<dyn Fn(usize) -> (Vec<f64>, Vec<f64>)>;

/// Renders by the path tracer, whose pixels are independent.
fn by_paths(scene: &str, samples: u64) -> Blocks {
    let rendering = shoot(&load(scene, None), samples, 1);
    let wide = |values: Vec<f32>| -> Vec<f64> { values.into_iter().map(f64::from).collect() };
    let (mean, variance) = (wide(rendering.film.mean()), wide(rendering.film.variance()));
    Box::new(move |c| (blocks(&mean, c), of_means(blocks(&variance, c))))
}

/// Renders by an estimator that contributes to many pixels at once, so that pixels are correlated.
/// The variance comes from renders of one sample with different seeds. With 64 renders, z follows
/// Student's distribution instead of a normal one, and false alarms are 1e-3 instead of 1e-4 per
/// image.
fn by_batches(scene: &str, integrator: &str) -> Blocks {
    const BATCHES: u64 = 64;
    let loaded = load(scene, Some(integrator));
    let batches: Vec<Vec<f64>> = (0..BATCHES)
        .map(|seed| shoot(&loaded, 1, seed).film.mean())
        .map(|mean| mean.into_iter().map(f64::from).collect())
        .collect();
    Box::new(move |c| {
        let n = BATCHES as f64;
        let batches: Vec<Vec<f64>> = batches.iter().map(|b| blocks(b, c)).collect();
        let sum = |f: &dyn Fn(usize, f64) -> f64| -> Vec<f64> {
            let of = |i: usize| batches.iter().map(|b| f(i, b[i])).sum();
            (0..batches[0].len()).map(of).collect()
        };
        let mean: Vec<f64> = sum(&|_, v| v / n);
        let variance = sum(&|i, v| (v - mean[i]).powi(2) / (n * (n - 1.0)));
        (mean, variance)
    })
}

/// Variances of block means, from the means of pixels' variances.
fn of_means(variances: Vec<f64>) -> Vec<f64> {
    let area = (BLOCK * BLOCK) as f64;
    variances.into_iter().map(|v| v / area).collect()
}

/// Compares a scene's blocks with a reference, in `channels` different channels.
fn compare(scene: &str, ours: Blocks, reference: &str, channels: usize) {
    let theirs = image(reference);
    let square: Vec<f64> = image(&format!("{reference}_se"))
        .iter()
        .map(|e| e * e)
        .collect();
    let mut zs = Vec::new();
    for c in 0..channels {
        let (a, va) = ours(c);
        let (b, vb) = (blocks(&theirs, c), of_means(blocks(&square, c)));
        let mean = b.iter().sum::<f64>() / b.len() as f64;
        let mut dim = [0.0; 4];
        for i in 0..a.len() {
            let (va, vb) = (va[i], vb[i]);
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

fn check(scene: &str, reference: &str, channels: usize, samples: u64) {
    compare(scene, by_paths(scene, samples), reference, channels);
}

#[test]
fn fog_around_a_point_light() {
    // With a quarter of the samples, means are far from normal: scattering near the emitter is rare
    // and bright.
    check("p1_fog_cube", "p1_fog_cube_lt", 1, 256);
}

#[test]
fn fog_beside_a_point_light() {
    check("p1b_fog_cube_outside", "p1b_fog_cube_outside", 1, 64);
}

#[test]
fn scattering_ball_behind_a_smooth_wall() {
    check("p2_milk_ball", "p2_milk_ball", 3, 32);
}

#[test]
fn diffuse_surfaces() {
    check("p3_cornell", "p3_cornell", 3, 32);
}

#[test]
fn rough_glass_and_metal() {
    check("p4_rough_glass", "p4_rough_glass", 3, 64);
}

/// Textures, a mask, a pane, plastic and a principled surface.
#[test]
fn many_surfaces() {
    check("p6_surfaces", "p6_surfaces", 3, 64);
}

#[test]
fn heterogeneous_smoke() {
    check("p5_het_smoke", "p5_het_smoke", 1, 64);
}

/// Render only some of the scenes, except in long tests.
#[test]
fn bidirectionally() {
    let scenes = [
        ("p1b_fog_cube_outside", "p1b_fog_cube_outside", 1),
        ("p5_het_smoke", "p5_het_smoke", 1),
        ("p4_rough_glass", "p4_rough_glass", 3),
        ("p3_cornell", "p3_cornell", 3),
        ("p2_milk_ball", "p2_milk_ball", 3),
        ("p1_fog_cube", "p1_fog_cube_lt", 1),
    ];
    let long = std::env::var_os("MORGANA_LONG_TESTS").is_some();
    for (scene, reference, channels) in scenes.into_iter().take(if long { 6 } else { 3 }) {
        compare(scene, by_batches(scene, "bdpt"), reference, channels);
    }
}

#[test]
fn by_particles() {
    for (scene, reference) in [
        ("p1_fog_cube", "p1_fog_cube_lt"),
        ("p1b_fog_cube_outside", "p1b_fog_cube_outside"),
    ] {
        compare(scene, by_batches(scene, "particle"), reference, 1);
    }
}
