//! Sources of MCX with patterns, several sources, and JData arrays, compared with MCX's
//! documentation. Photons start uniformly on the parallelogram of `Param1` and `Param2`, with the
//! weight of the pattern there.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};
use glam::DVec3;
use morgana_io::{LoadOptions, Loaded, Run};
use serde_json::{Value, json};
use std::f64::consts::TAU;
use std::fs;
use std::io::Write;
use std::path::Path;
use transport::emitter::Emitter;

const UNIT: f64 = 0.5;

fn input(source: &Value, shapes: &Value) -> Value {
    json!({
        "Session": {"Photons": 200},
        "Forward": {"T0": 0, "T1": 5e-9, "Dt": 5e-9},
        "Optode": {"Source": source},
        "Domain": {
            "OriginType": 1, "LengthUnit": UNIT,
            "Media": [{"mua": 0, "mus": 0, "g": 1, "n": 1}, {"mua": 1, "mus": 1, "g": 0, "n": 1}, {"mua": 2, "mus": 1, "g": 0, "n": 1}]
        },
        "Shapes": shapes,
    })
}

fn grid() -> Value {
    json!([{"Grid": {"Tag": 1, "Size": [10, 8, 12]}}])
}

fn load_in(folder: &Path, input: &Value) -> Result<Loaded, String> {
    let path = folder.join("input.json");
    fs::write(&path, input.to_string()).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

fn load(source: &Value) -> Result<Loaded, String> {
    load_in(tempfile::tempdir().unwrap().path(), &input(source, &grid()))
}

/// Irradiance at fractions of the two sides of a source that begins at a corner, in voxels.
fn irradiance(loaded: &Loaded, corner: DVec3, sides: [DVec3; 2], [x, y]: [f64; 2]) -> f64 {
    let [Emitter::Collimated(beam)] = loaded.scene().emitters() else {
        panic!("{:?}", loaded.scene().emitters());
    };
    beam.irradiance((corner + x * sides[0] + y * sides[1]) * UNIT)[0]
}

#[track_caller]
fn near(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} {b}");
}

/// Photons of a wave have the weight of the wave at their positions: along either side, for light
/// in either direction.
#[test]
fn waves() {
    let corner = DVec3::new(2.0, 2.0, -1.0);
    let [across, up] = [DVec3::new(6.0, 0.0, 0.0), DVec3::new(0.0, 4.0, 0.0)];
    let cosine = |f: f64, g: f64, phase: f64, m: f64| {
        move |x: f64, y: f64| 0.5 * (1.0 + m * (TAU * (f * x + g * y + phase)).cos())
    };
    let product = |x: f64, y: f64| {
        0.5 * (1.0 + (TAU * (1.5 * x + 0.5)).sin() * (TAU * (3.0 * y + 0.25)).sin())
    };
    // The mean is a half. Integer parts are frequencies. The fractional part of the first number is
    // the phase, and of the second it is 1 minus the modulation.
    type Relative = Box<dyn Fn(f64, f64) -> f64>;
    type Case = (&'static str, f64, [[f64; 4]; 2], [DVec3; 2], Relative);
    let cases: Vec<Case> = vec![
        (
            "fourier",
            1.0,
            [[6.0, 0.0, 0.0, 3.25], [0.0, 4.0, 0.0, 2.4]],
            [across, up],
            Box::new(cosine(3.0, 2.0, 0.25, 0.6)),
        ),
        (
            "fourier",
            -1.0,
            [[6.0, 0.0, 0.0, 3.25], [0.0, 4.0, 0.0, 2.4]],
            [across, up],
            Box::new(cosine(3.0, 2.0, 0.25, 0.6)),
        ),
        (
            "fourier",
            1.0,
            [[0.0, 4.0, 0.0, 1.0], [6.0, 0.0, 0.0, 0.0]],
            [up, across],
            Box::new(cosine(1.0, 0.0, 0.0, 1.0)),
        ),
        // The second side is the direction perpendicular to the first.
        (
            "fourierx",
            1.0,
            [[6.0, 0.0, 0.0, 4.0], [2.0, 1.0, 0.2, 0.3]],
            [across, up],
            Box::new(cosine(2.0, 1.0, 0.2, 0.7)),
        ),
        (
            "fourierx2d",
            1.0,
            [[6.0, 0.0, 0.0, 4.0], [1.5, 3.0, 0.5, 0.25]],
            [across, up],
            Box::new(product),
        ),
    ];
    for (kind, z, [first, second], sides, relative) in cases {
        let source = json!({
            "Type": kind, "Pos": corner.to_array(), "Dir": [0, 0, z], "Param1": first, "Param2": second,
        });
        let loaded = load(&source).unwrap_or_else(|e| panic!("{source}: {e}"));
        let area = 24.0 * UNIT * UNIT;
        for i in 0..40 {
            let at = [
                (f64::from(i) * 0.618 + 0.1) % 1.0,
                (f64::from(i) * 0.377 + 0.2) % 1.0,
            ];
            if at.iter().any(|t| !(0.02..0.98).contains(t)) {
                continue;
            }
            // Interpolation is linear between 64 pixels per period: (π/64)² of the modulation, in
            // two dimensions.
            let expected = relative(at[0], at[1]) / (0.5 * area);
            near(
                irradiance(&loaded, corner, sides, at),
                expected,
                0.005 / area,
            );
        }
        near(Run::new(&loaded).measure().unwrap().emitted[0], 1.0, 1e-9);
    }
}

/// Values follow one another along the first side; each applies to its part of the parallelogram.
#[test]
fn patterns() {
    let corner = DVec3::new(2.0, 1.0, -1.0);
    let sides = [DVec3::new(6.0, 0.0, 0.0), DVec3::new(0.0, 4.0, 0.0)];
    let values = [1.0f32, 0.5, 0.0, 0.25, 2.0, 0.125];
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("pattern.bin"), &bytes).unwrap();
    for pattern in [
        json!({"Nx": 3, "Ny": 2, "Data": values}),
        json!({"Nx": 3, "Ny": 2, "Data": "pattern.bin"}),
        json!({"_ArrayType_": "single", "_ArraySize_": [3, 2], "_ArrayZipType_": "zlib", "_ArrayZipData_": zlib(&bytes)}),
    ] {
        let source = json!({
            "Type": "pattern", "Pos": corner.to_array(), "Dir": [0, 0, 1],
            "Param1": [6, 0, 0, 3], "Param2": [0, 4, 0, 2], "Pattern": pattern,
        });
        let loaded = load_in(folder.path(), &input(&source, &grid()))
            .unwrap_or_else(|e| panic!("{source}: {e}"));
        let total: f32 = values.iter().sum();
        for (i, value) in values.into_iter().enumerate() {
            let at = [(0.4 + (i % 3) as f64) / 3.0, (0.7 + (i / 3) as f64) / 2.0];
            let pixel = 4.0 * UNIT * UNIT;
            let expected = f64::from(value / total) / pixel;
            near(irradiance(&loaded, corner, sides, at), expected, 1e-6);
        }
    }
}

/// Values of several patterns follow one another for each part of the parallelogram, as in MCX.
#[test]
fn several_patterns() {
    let corner = DVec3::new(2.0, 1.0, -1.0);
    let sides = [DVec3::new(6.0, 0.0, 0.0), DVec3::new(0.0, 4.0, 0.0)];
    let patterns = [
        [1.0f32, 0.5, 0.0, 0.25, 2.0, 0.125],
        [0.0, 1.0, 3.0, 0.0, 0.5, 0.5],
    ];
    let values: Vec<f32> = (0..6).flat_map(|i| patterns.map(|p| p[i])).collect();
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    for (pattern, count) in [
        (json!({"Nx": 2, "Ny": 3, "Nz": 2, "Data": values}), json!(2)),
        (
            json!({"_ArrayType_": "single", "_ArraySize_": [2, 3, 2], "_ArrayZipType_": "zlib", "_ArrayZipData_": zlib(&bytes)}),
            json!(1),
        ),
    ] {
        for (number, values) in patterns.iter().enumerate() {
            let source = json!({
                "Type": "pattern", "Pos": corner.to_array(), "Dir": [0, 0, 1], "SrcNum": count, "PatternID": number + 1,
                "Param1": [6, 0, 0, 3], "Param2": [0, 4, 0, 2], "Pattern": pattern,
            });
            let loaded = load(&source).unwrap_or_else(|e| panic!("{source}: {e}"));
            let total: f32 = values.iter().sum();
            for (i, value) in values.iter().enumerate() {
                let at = [(0.4 + (i % 3) as f64) / 3.0, (0.7 + (i / 3) as f64) / 2.0];
                let expected = f64::from(value / total) / (4.0 * UNIT * UNIT);
                near(irradiance(&loaded, corner, sides, at), expected, 1e-6);
            }
        }
    }
}

/// A photon starts at any source with equal probability, and carries the source's weight: sources
/// share the power by weight.
#[test]
fn several_sources() {
    let mut source = json!({
        "Type": "disk", "Pos": [[3, 4, -1, 1], [5, 4, -1, 3], [7, 4, -1]], "Dir": [[0, 0, 1], [0, 0, 1], [0, 0, 1, 0]],
        "Param1": [[1, 0, 0, 0], [2, 0, 0, 0], [1]],
    });
    let powers = |source: &Value| -> Vec<f64> {
        let loaded = load(source).unwrap();
        let power = |emitter: &Emitter| match emitter {
            Emitter::Collimated(beam) => beam.power()[0],
            other => panic!("{other:?}"),
        };
        loaded.scene().emitters().iter().map(power).collect()
    };
    for (found, expected) in powers(&source).iter().zip([0.2, 0.6, 0.2]) {
        near(*found, expected, 1e-12);
    }
    source["ID"] = json!(2);
    assert_eq!(powers(&source), [1.0]);
    source["ID"] = json!(4);
    assert!(
        load(&source)
            .unwrap_err()
            .contains("the number of a source from 1 to 3")
    );
    // A wave with frequency 0 has the mean ½ (1 + M cos φ), and this fraction of the power.
    let waves = json!({
        "Type": "fourier", "Pos": [[2, 2, -1], [2, 2, -1]], "Dir": [[0, 0, 1], [0, 0, 1]],
        "Param1": [[6, 0, 0, 2.0], [6, 0, 0, 0.0]], "Param2": [[0, 4, 0, 0.0], [0, 4, 0, 0.0]],
    });
    for (found, expected) in powers(&waves).iter().zip([1.0 / 3.0, 2.0 / 3.0]) {
        near(*found, expected, 1e-6);
    }
}

fn zlib(bytes: &[u8]) -> String {
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::default());
    packed.write_all(bytes).unwrap();
    STANDARD.encode(packed.finish().unwrap())
}

fn gzip(bytes: &[u8]) -> String {
    let mut packed = GzEncoder::new(Vec::new(), Compression::default());
    packed.write_all(bytes).unwrap();
    STANDARD.encode(packed.finish().unwrap())
}

/// Labels `[x, y, z]`, with the last axis fastest, in each notation.
#[test]
fn volumes_of_jdata() {
    let pencil = json!({"Pos": [1, 1, -1], "Dir": [0, 0, 1]});
    let label = |x: usize, y: usize, z: usize| 1 + u8::from(x + 2 * y > 3 * z);
    let mut labels = Vec::new();
    for x in 0..4 {
        for y in 0..3 {
            labels.extend((0..2).map(|z| label(x, y, z)));
        }
    }
    let mut columns = Vec::new();
    for z in 0..2 {
        for y in 0..3 {
            columns.extend((0..4).map(|x| label(x, y, z)));
        }
    }
    let wide: Vec<u8> = labels
        .iter()
        .flat_map(|v| u16::from(*v).to_le_bytes())
        .collect();
    for shapes in [
        json!({"_ArrayType_": "uint8", "_ArraySize_": [4, 3, 2], "_ArrayZipType_": "zlib", "_ArrayZipSize_": [1, 24], "_ArrayZipData_": zlib(&labels)}),
        json!({"_ArrayType_": "int16", "_ArraySize_": [4, 3, 2], "_ArrayZipType_": "gzip", "_ArrayZipData_": gzip(&wide)}),
        json!({"_ArrayType_": "uint8", "_ArraySize_": [4, 3, 2], "_ArrayData_": labels}),
        json!({"_ArrayType_": "uint8", "_ArraySize_": [4, 3, 2], "_ArrayData_": STANDARD.encode(&labels)}),
        json!({"_ArrayType_": "uint8", "_ArraySize_": [4, 3, 2], "_ArrayOrder_": "c", "_ArrayData_": columns}),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let loaded = load_in(folder.path(), &input(&pencil, &shapes))
            .unwrap_or_else(|e| panic!("{shapes}: {e}"));
        for (x, y, z) in [
            (0, 0, 0),
            (3, 0, 0),
            (1, 2, 1),
            (3, 2, 1),
            (0, 1, 1),
            (2, 0, 1),
        ] {
            let place = UNIT * (DVec3::new(x as f64, y as f64, z as f64) + 0.5);
            let medium = loaded.scene().medium(loaded.scene().medium_at(place));
            let absorption = (medium.extinction(place) - medium.scattering(place))[0];
            near(absorption, f64::from(label(x, y, z)), 1e-9);
        }
        // Shapes may have their own file, too.
        fs::write(
            folder.path().join("labels.json"),
            json!({"Shapes": shapes}).to_string(),
        )
        .unwrap();
        let mut named = input(&pencil, &shapes);
        named.as_object_mut().unwrap().remove("Shapes");
        named["Domain"]["VolumeFile"] = json!("labels.json");
        load_in(folder.path(), &named).unwrap();
        // A volume file of JNIfTI has the same array.
        let image = json!({"NIFTIHeader": {"VoxelSize": [1, 1, 1]}, "NIFTIData": shapes});
        fs::write(folder.path().join("labels.jnii"), image.to_string()).unwrap();
        named["Domain"]["VolumeFile"] = json!("labels.jnii");
        load_in(folder.path(), &named).unwrap();
    }
}

#[test]
fn mistakes() {
    let zeros = zlib(&[1; 24]);
    let arrays = [
        (
            json!({"_ArrayType_": "uint8", "_ArraySize_": [4, 3, 2], "_ArrayZipType_": "lzma", "_ArrayZipData_": zeros}),
            "must be zlib, gzip",
        ),
        (
            json!({"_ArrayType_": "uint8", "_ArraySize_": [4, 3, 3], "_ArrayZipType_": "zlib", "_ArrayZipData_": zeros}),
            "less than the 36 bytes",
        ),
        (
            json!({"_ArrayType_": "uint8", "_ArraySize_": [4, 3, 1], "_ArrayZipType_": "zlib", "_ArrayZipData_": zeros}),
            "more than the 12 bytes",
        ),
        (
            json!({"_ArrayType_": "uint8", "_ArraySize_": [4, 3, 2], "_ArrayZipType_": "zlib", "_ArrayZipData_": "%%"}),
            "not base64",
        ),
        (
            json!({"_ArrayType_": "uint8", "_ArraySize_": [4, 3, 2], "_ArrayZipType_": "zlib", "_ArrayZipData_": "AAAA"}),
            "is not valid zlib",
        ),
        (
            json!({"_ArrayType_": "uint8", "_ArraySize_": [1e9, 1e9, 1e9], "_ArrayZipType_": "zlib", "_ArrayZipData_": zeros}),
            "an array needs _ArraySize_",
        ),
        (
            json!({"_ArrayType_": "uint8", "_ArraySize_": [1200, 1200, 1200], "_ArrayZipType_": "zlib", "_ArrayZipData_": zeros}),
            "less than the",
        ),
        (
            json!({"_ArrayType_": "uint8", "_ArraySize_": [24], "_ArrayZipType_": "zlib", "_ArrayZipData_": zeros}),
            "coefficients of voxels",
        ),
        (
            json!({"_ArrayType_": "single", "_ArraySize_": [1, 3, 2], "_ArrayZipType_": "zlib", "_ArrayZipData_": zeros}),
            "coefficients of voxels",
        ),
        (
            json!({"_ArrayType_": "complex", "_ArraySize_": [1, 3, 2], "_ArrayZipType_": "zlib", "_ArrayZipData_": zeros}),
            "_ArrayType_ is 'complex'",
        ),
        (
            json!({"_ArrayType_": "uint8", "_ArraySize_": [1, 3, 2], "_ArrayData_": [1, 2]}),
            "2 numbers",
        ),
        (
            json!({"_ArrayType_": "uint8", "_ArraySize_": [1, 3, 2], "_ArrayOrder_": "x", "_ArrayData_": [1, 2, 1, 2, 1, 2]}),
            "_ArrayOrder_ is 'x'",
        ),
    ];
    let pencil = json!({"Pos": [1, 1, -1], "Dir": [0, 0, 1]});
    for (shapes, expected) in arrays {
        let message = load_in(
            tempfile::tempdir().unwrap().path(),
            &input(&pencil, &shapes),
        )
        .expect_err(expected);
        assert!(
            message.contains(expected),
            "expected {expected:?} in:\n{message}"
        );
    }
    let pattern = |change: Value| {
        let mut source = json!({
            "Type": "pattern", "Pos": [2, 2, -1], "Dir": [0, 0, 1],
            "Param1": [6, 0, 0, 2], "Param2": [0, 4, 0, 1], "Pattern": {"Nx": 2, "Ny": 1, "Data": [1, 1]},
        });
        for (key, value) in change.as_object().unwrap() {
            source[key] = value.clone();
        }
        source
    };
    for (change, expected) in [
        (
            json!({"Pattern": {"Data": [1, 1, 1]}}),
            "its Pattern has 3 values, but Param1 and Param2 state 2 x 1",
        ),
        (
            json!({"Pattern": {"Data": [1, -1]}}),
            "has the value -1, but values must be at least 0",
        ),
        (
            json!({"Pattern": {"Data": [0, 0]}}),
            "all values of its Pattern are 0",
        ),
        (json!({"Pattern": {"Data": "none.bin"}}), "none.bin"),
        (json!({"Param1": [6, 0, 0, 0]}), "columns and rows"),
        (json!({"Param2": [4, 0, 0, 1]}), "nor parallel"),
        (
            json!({"SrcNum": 2}),
            "its Pattern has 2 values, but SrcNum, Param1 and Param2 state 2 x 2 x 1",
        ),
        (
            json!({"SrcNum": 2, "Pattern": {"Data": [1, 1, 1, 1]}}),
            "choose one by PatternID, from 1 to 2",
        ),
        (
            json!({"SrcNum": 2, "PatternID": 3, "Pattern": {"Data": [1, 1, 1, 1]}}),
            "a pattern from 1 to 2, but it is 3",
        ),
        (json!({"SrcNum": 0.5}), "but it is 0.5"),
        (
            json!({"Type": "planar", "SrcNum": 2}),
            "only sources of the Type pattern",
        ),
        (
            json!({"Type": "fourier", "Param1": [6, 0, 0, 4000], "Param2": [0, 4, 0, 4000]}),
            "pixels per period",
        ),
        (json!({"Pos": [2, 2, -1, -1]}), "weight of a source"),
        (
            json!({"Pos": []}),
            "Pos must be a list of at least 3 numbers",
        ),
    ] {
        let message = load(&pattern(change)).expect_err(expected);
        assert!(
            message.contains(expected),
            "expected {expected:?} in:\n{message}"
        );
    }
}
