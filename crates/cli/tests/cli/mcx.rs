//! `morgana mcx`: the options and files of MCX.
//!
//! Values of voxels are compared with the law of Beer and Lambert within 10 %, five standard errors
//! of the smallest fraction of light, 0.1, that a voxel absorbs: the false-alarm rate is below 1e-4.

use crate::support::Folder;
use serde_json::{Value, json};
use std::fs;

/// Tolerance of values.
const TOLERANCE: f64 = 0.1;
/// Number of photons.
const PHOTONS: usize = 20_480;

/// A cube of absorbing voxels of half a millimetre, and a beam along +z in the middle of a voxel.
fn input() -> Value {
    json!({
        "Session": {"ID": "cube", "Photons": PHOTONS, "DoMismatch": 0},
        "Forward": {"T0": 0, "T1": 1e-9, "Dt": 1e-9},
        "Optode": {
            "Source": {"Type": "pencil", "Pos": [1.5, 0.5, -1], "Dir": [0, 0, 1]},
            "Detector": [{"Pos": [1.5, 0.5, 4], "R": 0.9}]
        },
        "Domain": {
            "OriginType": 1, "LengthUnit": 0.5, "Dim": [3, 2, 4], "VolumeFile": "volume.bin",
            "Media": [{"mua": 0, "mus": 0, "g": 1, "n": 1}, {"mua": 0.5, "mus": 0, "g": 1, "n": 1}]
        }
    })
}

fn folder(input: &Value, volume: &[u8]) -> Folder {
    let folder = Folder::with_file("<scene version=\"3.0.0\"/>");
    fs::write(folder.path("input.json"), input.to_string()).unwrap();
    fs::write(folder.path("volume.bin"), volume).unwrap();
    folder
}

/// Numbers of the file `cube.mc2`.
fn numbers(folder: &Folder) -> Vec<f64> {
    let bytes = folder.read("cube.mc2");
    let words = bytes.chunks_exact(4).map(|b| [b[0], b[1], b[2], b[3]]);
    words.map(|b| f64::from(f32::from_le_bytes(b))).collect()
}

/// Fluence of voxel k of the column under the beam, per joule and mm².
fn fluence(k: usize) -> f64 {
    let [near, far] = [k, k + 1].map(|k| (-0.25 * k as f64).exp());
    (near - far) / 0.5 / 0.125
}

fn near(found: f64, expected: f64) {
    assert!(
        (found - expected).abs() <= TOLERANCE * expected.abs(),
        "{found} {expected}"
    );
}

#[test]
fn quantities_and_orders_of_axes() {
    let folder = folder(&input(), &[1; 24]);
    for (options, scale) in [
        ("-O F", 1.0),
        ("-O X", 1e9),
        // Absorption times the volume of a voxel.
        ("-O E", 0.5 * 0.125),
        ("-O F -U 0", PHOTONS as f64 * 0.125 / 0.5),
        ("-O E -U 0", PHOTONS as f64 * 0.5 * 0.125),
        ("", 1e9),
    ] {
        folder.succeed(&format!("mcx -f input.json -F mc2 {options}"));
        for (i, found) in numbers(&folder).into_iter().enumerate() {
            let (column, k) = (i % 6, i / 6);
            near(found, if column == 1 { scale * fluence(k) } else { 0.0 });
        }
    }
    // Photons of the detector: 64 bytes of a header, then detector, path length and weight.
    let history = folder.read("cube.mch");
    assert_eq!(&history[..4], b"MCXH");
    let word = |i: usize| [0, 1, 2, 3].map(|k| history[4 * i + k]);
    let integer = |i: usize| u32::from_le_bytes(word(i)) as usize;
    // Version, media, detectors, columns, photons, detected, saved.
    assert_eq!([1, 2, 3, 4, 5].map(integer), [1, 1, 1, 3, PHOTONS]);
    let saved = integer(7);
    assert_eq!(history.len(), 64 + saved * 3 * 4);
    let number = |i: usize| f64::from(f32::from_le_bytes(word(16 + i)));
    let power = (0..saved).map(|i| {
        near(number(3 * i), 1.0);
        near(number(3 * i + 1), 4.0);
        number(3 * i + 2) * (-0.5 * 0.5 * number(3 * i + 1)).exp()
    });
    near(power.sum::<f64>() / PHOTONS as f64, (-1f64).exp());
}

#[test]
fn the_command_line_of_simpa() {
    let mut file = input();
    file["Session"] = json!({"ID": "cube", "DoAutoThread": 1, "Photons": PHOTONS as f64, "DoMismatch": 0, "RNGSeed": 471});
    file["Domain"]["MediaFormat"] = json!("muamus_float");
    file["Domain"]["OriginType"] = json!(0);
    file["Domain"]["Media"] = json!([[0, 0, 1, 1], [1, 1, 0.9, 1]]);
    file["Optode"] = json!({"Source": {
        "Type": "slit", "Pos": [2.5, 1.5, 0.5], "Dir": [0.0, 0.0, 1.0], "Param1": [1e-6, 0.0, 0.0, 0], "Param2": [0, 0, 0, 0],
    }});
    let mut bytes = Vec::new();
    for i in 0..24 {
        // Voxels with z fastest; the last layer absorbs more.
        let mu_a = if i % 4 == 3 { 1.0f32 } else { 0.5 };
        bytes.extend([mu_a, 1e-10].into_iter().flat_map(f32::to_le_bytes));
    }
    let folder = folder(&file, &bytes);
    let told = folder.succeed("mcx -f input.json -O F -a 1 -F jnii");
    assert!(told.contains("wrote cube.jnii"), "{told}");
    folder.succeed("convert cube.jnii -o cube.nrrd");
    let image = folder.json("cube.jnii");
    assert_eq!(image["NIFTIData"]["_ArraySize_"], json!([3, 2, 4, 1, 1]));
    assert_eq!(image["NIFTIData"]["_ArrayOrder_"], json!("c"));
    assert_eq!(
        image["NIFTIHeader"]["VoxelSize"],
        json!([0.5, 0.5, 0.5, 1e-9, 1])
    );
    folder.succeed("mcx -f input.json -O F -a 1 -F mc2");
    let found = numbers(&folder);
    near(found[6 + 1], fluence(1));
    near(
        found[18 + 1],
        (-0.75f64).exp() * (1.0 - (-0.5f64).exp()) / 1.0 / 0.125,
    );
}

#[test]
fn light_that_leaves() {
    let mut file = input();
    file["Session"]["BCFlags"] = json!("______000001");
    let mut volume = [1; 24];
    volume[18..].fill(0);
    let folder = folder(&file, &volume);
    folder.succeed("mcx -f input.json -O F -F mc2 -X 1");
    let found = numbers(&folder);
    near(found[6 + 1], fluence(1));
    near(found[18 + 1], -(-0.75f64).exp() / 0.25);
    // No light leaves through the side at +z, because voxels of label 0 are outside.
    folder.succeed("mcx -f input.json -F jnii -w XV");
    let photons = &folder.json("cube_detp.jdat")["MCXData"];
    assert_eq!(photons["Info"]["SavedPhoton"], json!(0));
    fs::write(folder.path("volume.bin"), [1; 24]).unwrap();
    folder.succeed("mcx -f input.json -F jnii -w XV");
    let photons = &folder.json("cube_detp.jdat")["MCXData"];
    let saved = photons["Info"]["SavedPhoton"].as_u64().unwrap();
    // The detector and the side receive the same photons.
    assert!(saved > 0 && saved.is_multiple_of(2), "{saved}");
    assert_eq!(photons["PhotonData"]["p"]["_ArraySize_"], json!([saved, 3]));
    folder.succeed("mcx -f input.json -F bnii -w XV");
    assert!(folder.files().contains(&"cube_detp.jdb".to_owned()));
}

/// Light modulated at frequency f has the complex fluence ∫ exp(−(μ_a + 2πi f n/c) z) dz in a voxel of
/// unit area.
#[test]
fn modulated_light() {
    let mut input = input();
    input["Optode"]["Source"]["Frequency"] = json!(2e10);
    let folder = folder(&input, &[1; 24]);
    folder.succeed("mcx -f input.json -F mc2 -O R");
    let found = numbers(&folder);
    assert_eq!(found.len(), 2 * 24);
    let wave_number = std::f64::consts::TAU * 2e10 / 2.997_924_58e11;
    for k in 0..4 {
        // ∫ exp(−(μ − i w) z) dz by the midpoint rule. The source is a voxel before the volume.
        let steps = 1000;
        let parts = (0..steps).map(|i| {
            let z = 0.5 * (k as f64 + (i as f64 + 0.5) / f64::from(steps));
            let phase = wave_number * (z + 0.5);
            [phase.cos(), -phase.sin()].map(|part| part * (-0.5 * z).exp())
        });
        let sums = parts.fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
        let place = 1 + 6 * k;
        let tolerance = TOLERANCE * 1e9 * fluence(k);
        for (part, sum) in sums.into_iter().enumerate() {
            let expected = 1e9 * sum * 0.5 / f64::from(steps) / 0.125;
            let value = found[24 * part + place];
            assert!(
                (value - expected).abs() < tolerance,
                "{part} {k}: {value} {expected}"
            );
        }
    }
    folder.succeed("mcx -f input.json -F jnii -O R");
    let written: Value = serde_json::from_slice(&folder.read("cube.jnii")).unwrap();
    let size = &written["NIFTIData"]["_ArraySize_"];
    assert_eq!(*size, json!([3, 2, 4, 1, 1, 2]));
    let steady = self::folder(&self::input(), &[1; 24]);
    let told = steady.fail(1, "mcx -f input.json -O R");
    assert!(
        told.contains("R needs the Frequency of the modulation"),
        "{told}"
    );
}

/// Each pattern lights another column of voxels; its light has one joule.
#[test]
fn several_patterns() {
    let mut file = input();
    file["Optode"] = json!({"Source": {
        "Type": "pattern", "Pos": [0, 0, -1], "Dir": [0, 0, 1], "Param1": [3, 0, 0, 3], "Param2": [0, 2, 0, 2], "SrcNum": 2,
        "Pattern": {"Nx": 2, "Ny": 3, "Nz": 2, "Data": "pattern.bin"},
    }});
    // Patterns run fastest, then columns: the first lights column 1 of row 0, the second columns 0 and
    // 2 of row 1 in the proportion 1 : 3.
    let mut values = [0.0f32; 12];
    (values[2], values[7], values[11]) = (0.5, 0.25, 0.75);
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let folder = folder(&file, &[1; 24]);
    fs::write(folder.path("pattern.bin"), &bytes).unwrap();
    let told = folder.succeed("mcx -f input.json -O F -F mc2");
    assert_eq!(told.matches("absorbed by media").count(), 2, "{told}");
    // The light fills a voxel, whose fluence is the fluence under a beam in its middle.
    let share = |pattern: usize, column: usize| match (pattern, column) {
        (0, 1) => 1.0,
        (1, 3) => 0.25,
        (1, 5) => 0.75,
        _ => 0.0,
    };
    for (i, found) in numbers(&folder).into_iter().enumerate() {
        let (pattern, column, k) = (i % 2, i / 2 % 6, i / 12);
        near(found, share(pattern, column) * fluence(k));
    }
    folder.succeed("mcx -f input.json -O F -F jnii");
    let image = folder.json("cube.jnii");
    assert_eq!(image["NIFTIData"]["_ArraySize_"], json!([3, 2, 4, 1, 2]));
    // A single pattern equals the first of two, bit by bit.
    let both = numbers(&folder);
    folder.succeed(r#"mcx -f input.json -O F -F mc2 -j {"Optode":{"Source":{"PatternID":1}}}"#);
    let alone: Vec<f64> = both.iter().step_by(2).copied().collect();
    assert_eq!(numbers(&folder), alone);
    file["Optode"]["Detector"] = json!([{"Pos": [1.5, 0.5, 4], "R": 0.9}]);
    fs::write(folder.path("input.json"), file.to_string()).unwrap();
    let told = folder.succeed("mcx -f input.json -O F -F mc2");
    assert!(!folder.files().contains(&"cube.mch".to_owned()), "{told}");
    for (changes, expected) in [
        (
            r#"{"SrcNum":3}"#,
            "has 12 values, but SrcNum, Param1 and Param2 state 3 x 3 x 2",
        ),
        (r#"{"PatternID":3}"#, "from 1 to 2, but it is 3"),
    ] {
        let message = folder.refuse(&format!(
            r#"mcx -f input.json -j {{"Optode":{{"Source":{changes}}}}}"#
        ));
        assert!(message.contains(expected), "{message}");
    }
    let message = folder.refuse("render input.json -o a.npz");
    assert!(
        message.contains("morgana mcx runs all of them"),
        "{message}"
    );
}

#[test]
fn other_output() {
    let folder = folder(&input(), &[1; 24]);
    // Strings of MCX's examples have line breaks.
    let text = input().to_string();
    let help = "{\"Help\": {\"en\": \"a \\\"line\\\",\n\tanother\"}, ";
    fs::write(folder.path("breaks.json"), text.replacen('{', help, 1)).unwrap();
    folder.succeed("mcx -f breaks.json -n 64");
    assert!(folder.succeed("mcx --help").contains("-f, --input FILE"));
    assert!(folder.succeed("mcx -v").contains("morgana"));
    assert!(folder.succeed("mcx -L").contains("threads of the CPU"));
    folder.succeed("mcx -f input.json -n 7 --dumpjson changed.json");
    assert_eq!(folder.json("changed.json")["Session"]["Photons"], json!(7));
    folder.succeed("mcx -f input.json -S 0 -d 0 -s none -l");
    let files = folder.files();
    assert!(
        files.contains(&"none.log".to_owned()) && !files.iter().any(|f| f.starts_with("none.j")),
        "{files:?}"
    );
    for (options, expected) in [
        ("-f input.json -O J", "give X (fluence rate)"),
        ("-f input.json -F nii", "give jnii, bnii or mc2"),
        ("-f input.json -w Q", "SaveDataMask (-w) Q"),
        ("-f input.json --foo", "unknown option"),
        ("-n 10", "give an input file"),
        ("-f input.json -B cc____", "wide that little light"),
    ] {
        let message = folder.refuse(&format!("mcx {options}"));
        assert!(message.contains(expected), "{options}: {message}");
    }
}

#[cfg(unix)]
#[test]
fn a_link_named_mcx() {
    let folder = folder(&input(), &[1; 24]);
    std::os::unix::fs::symlink(crate::support::program(), folder.path("mcx")).unwrap();
    let mut command = std::process::Command::new(folder.path("mcx"));
    let status = command
        .args(["-f", "input.json", "-F", "mc2"])
        .current_dir(folder.path("."))
        .status();
    assert!(status.unwrap().success());
    near(numbers(&folder)[1], 1e9 * fluence(0));
}
