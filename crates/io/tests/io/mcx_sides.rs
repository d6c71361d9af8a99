//! Sides of MCX that are mirrors, and phase functions from quantiles of the cosine.
//!
//! Light between a mirror and its source equals light of the source and of its image, in the volume
//! and its image. The phase function of Henyey and Greenstein, as quantiles, equals the phase
//! function itself. Voxels are compared at a false-alarm rate of 1e-3 for the file. Seeds are fixed.

use morgana_io::{LoadOptions, Loaded, Run};
use serde_json::{Value, json};
use std::fs;
use testkit::z_test::{max_abs_z, two_sample_z};

/// False-alarm rate of each of seven families of comparisons.
const FAMILY: f64 = 1e-3 / 7.0;
const SIZE: [usize; 3] = [3, 2, 4];
const PHOTONS: u64 = 20_000;
/// Scores that comparisons with another scene must exceed.
const POWER: f64 = 8.0;

/// Label of a voxel: two media in an irregular arrangement.
fn label([x, y, z]: [usize; 3]) -> u8 {
    1 + u8::from((x + 2 * y + z) % 3 == 0)
}

/// Numbers of a volume of a size, x fastest.
fn volume(size: [usize; 3], label: impl Fn([usize; 3]) -> u8) -> Vec<u8> {
    let [nx, ny, nz] = size;
    (0..nx * ny * nz)
        .map(|i| label([i % nx, i / nx % ny, i / nx / ny]))
        .collect()
}

fn input(size: [usize; 3], positions: &[[f64; 3]], flags: &str) -> Value {
    json!({
        "Session": {"Photons": PHOTONS, "BCFlags": flags},
        "Optode": {"Source": {
            "Type": "isotropic", "Pos": positions, "Dir": vec![[0, 0, 1]; positions.len()],
        }},
        "Domain": {
            "OriginType": 1, "LengthUnit": 2.0, "Dim": size, "VolumeFile": "volume.bin",
            "Media": [[0, 0, 1, 1], [0.02, 0.5, 0.5, 1.4], [0.1, 0.3, 0.0, 1.2]]
        }
    })
}

fn load(input: &Value, volume: &[u8]) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("volume.bin"), volume).unwrap();
    let path = folder.path().join("input.json");
    fs::write(&path, input.to_string()).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

/// Fluence of each voxel per joule, with its standard error, and the fraction of light that escapes.
fn fluence(input: &Value, volume: &[u8], seed: u64) -> (Vec<[f64; 2]>, [f64; 2]) {
    let loaded = load(input, volume).unwrap_or_else(|e| panic!("{input}: {e}"));
    let run = Run {
        seed,
        ..Run::new(&loaded)
    };
    let measured = run.measure().unwrap();
    let reading = &measured.readings[0][0];
    let values = reading.mean.iter().zip(&reading.error);
    let escaped = &measured.balance.escaped;
    (
        values.map(|(mean, error)| [*mean, *error]).collect(),
        [escaped.mean, escaped.error],
    )
}

fn scores(a: &[[f64; 2]], b: &[[f64; 2]]) -> Vec<f64> {
    let pairs = a.iter().zip(b);
    pairs
        .map(|(a, b)| two_sample_z(a[0], a[1], b[0], b[1]))
        .collect()
}

/// Largest score, which must show that a scene differs.
fn largest(scores: &[f64]) -> f64 {
    scores.iter().fold(0.0, |m, z| z.abs().max(m))
}

#[test]
fn mirrors_double_the_volume() {
    for side in 0..6 {
        let (axis, is_upper) = (side % 3, side >= 3);
        let mut flags = ["_"; 6];
        flags[side] = "m";
        let source = [0.6, 0.7, 1.2];
        let alone = input(SIZE, &[source], &flags.join(""));
        let (half, escaped) = fluence(&alone, &volume(SIZE, label), 1);
        // The doubled volume has the mirror in its middle.
        let n = SIZE[axis];
        let mut size = SIZE;
        size[axis] *= 2;
        let folded = |i: usize| match (is_upper, i < n) {
            (true, true) => i,
            (true, false) => 2 * n - 1 - i,
            (false, true) => n - 1 - i,
            (false, false) => i - n,
        };
        let both = volume(size, |mut voxel| {
            voxel[axis] = folded(voxel[axis]);
            label(voxel)
        });
        let (mut first, mut image) = (source, source);
        if is_upper {
            image[axis] = 2.0 * n as f64 - source[axis];
        } else {
            first[axis] += n as f64;
            image[axis] = n as f64 - source[axis];
        }
        let doubled = input(size, &[first, image], "______");
        let (all, all_escaped) = fluence(&doubled, &both, 2);
        let index = |size: [usize; 3], [x, y, z]: [usize; 3]| x + size[0] * (y + size[1] * z);
        let [nx, ny, nz] = SIZE;
        let voxels = (0..nx * ny * nz).map(|i| [i % nx, i / nx % ny, i / nx / ny]);
        // A joule on either side of the mirror: the sum of the two voxels, for half a joule each.
        let expected: Vec<[f64; 2]> = voxels
            .map(|voxel| {
                let (mut a, mut b) = (voxel, voxel);
                if is_upper {
                    b[axis] = 2 * n - 1 - voxel[axis];
                } else {
                    a[axis] = n + voxel[axis];
                    b[axis] = n - 1 - voxel[axis];
                }
                let [a, b] = [a, b].map(|v| all[index(size, v)]);
                [a[0] + b[0], a[1].hypot(b[1])]
            })
            .collect();
        let mut zs = scores(&half, &expected);
        zs.push(two_sample_z(
            escaped[0],
            escaped[1],
            all_escaped[0],
            all_escaped[1],
        ));
        max_abs_z(&zs, FAMILY).unwrap_or_else(|e| panic!("{flags:?}: {e}"));
        let (open, _) = fluence(&input(SIZE, &[source], "______"), &volume(SIZE, label), 3);
        assert!(largest(&scores(&open, &expected)) > POWER, "{flags:?}");
    }
}

/// Between mirrors on all sides no light escapes, with and without refraction.
#[test]
fn no_light_escapes_from_mirrors() {
    for mismatch in [0, 1] {
        let mut closed = input(SIZE, &[[0.6, 0.7, 1.2]], "mmMMmm");
        closed["Session"]["DoMismatch"] = json!(mismatch);
        let (_, escaped) = fluence(&closed, &volume(SIZE, label), 1);
        assert_eq!(escaped[0], 0.0);
    }
}

/// Quantiles of the cosine for the phase function of Henyey and Greenstein, without the ends.
fn henyey_greenstein(g: f64, count: usize) -> Vec<f64> {
    let quantile = |i: usize| {
        let u = i as f64 / (count + 1) as f64;
        let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
        (1.0 + g * g - s * s) / (2.0 * g)
    };
    (1..=count).map(quantile).collect()
}

/// The quantiles replace g. With 2000 of them, the mean cosine differs from 0.8 by less than 1e-4,
/// far below the statistical errors.
#[test]
fn quantiles_of_the_cosine() {
    let g = 0.8;
    let plain = |g: f64| {
        let mut file = input(SIZE, &[[0.6, 0.7, 1.2]], "______");
        file["Domain"]["Media"] = json!([[0, 0, 1, 1], [0.02, 3.0, g, 1.4], [0.1, 1.0, g, 1.2]]);
        file
    };
    let mut with_quantiles = plain(0.0);
    with_quantiles["Domain"]["InverseCDF"] = json!(henyey_greenstein(g, 2000));
    let labels = volume(SIZE, label);
    let loaded = load(&with_quantiles, &labels).unwrap();
    for medium in loaded.scene().media().iter().filter(|m| m.scatters()) {
        let found = medium.phase.mean_cosine(glam::DVec3::ZERO).unwrap();
        assert!((found - g).abs() < 1e-4, "{found}");
    }
    let (expected, _) = fluence(&plain(g), &labels, 1);
    let (found, _) = fluence(&with_quantiles, &labels, 2);
    max_abs_z(&scores(&found, &expected), FAMILY).unwrap();
    let (isotropic, _) = fluence(&plain(0.0), &labels, 3);
    assert!(largest(&scores(&isotropic, &expected)) > POWER);
    // Coefficients of voxels take the quantiles, too, even where g is 1.
    let mut coefficients = plain(1.0);
    coefficients["Domain"]["MediaFormat"] = json!("muamus_float");
    coefficients["Domain"]["InverseCDF"] = with_quantiles["Domain"]["InverseCDF"].clone();
    coefficients["Domain"]["Media"] = json!([[0, 0, 1, 1], [0, 0, 1, 1.4]]);
    let numbers = labels.iter().flat_map(|_| [0.02f32, 3.0]);
    let numbers: Vec<u8> = numbers.flat_map(f32::to_le_bytes).collect();
    let mut alike = plain(g);
    alike["Domain"]["Media"][2] = json!([0.02, 3.0, g, 1.4]);
    let (expected, _) = fluence(&alike, &labels, 4);
    let (found, _) = fluence(&coefficients, &numbers, 5);
    max_abs_z(&scores(&found, &expected), FAMILY).unwrap();
}

#[test]
fn mistakes() {
    for (change, expected) in [
        (json!([]), "must be numbers that increase"),
        (json!([0.0, 0.5, 0.4]), "number 3 is 0.4"),
        (json!([0.0, 0.0]), "number 2 is 0"),
        (json!([-1.0, 0.0]), "number 1 is -1"),
        (json!([0.0, 1.5]), "number 2 is 1.5"),
        (json!(["_NaN_"]), "must be numbers that increase"),
    ] {
        let mut file = input(SIZE, &[[0.6, 0.7, 1.2]], "______");
        file["Domain"]["InverseCDF"] = change;
        let message = load(&file, &volume(SIZE, label)).unwrap_err();
        assert!(message.contains(expected), "{expected}: {message}");
        assert!(message.contains("input.json:1:"), "{message}");
    }
}
