//! Input of MCX with coefficients of voxels instead of labels. Formats and numbers are those of
//! MCX's option --mediabyte. The family of comparisons with labels has a false-alarm rate of 1e-3.

use glam::DVec3;
use morgana_io::{LoadOptions, Loaded, Run};
use serde_json::{Value, json};
use std::fs;
use testkit::z_test::{max_abs_z, two_sample_z};

const FAMILY: f64 = 1e-3;
const SIZE: [usize; 3] = [3, 4, 5];
const UNIT: f64 = 0.5;

fn input(format: Value) -> Value {
    json!({
        "Session": {"Photons": 4000, "DoMismatch": 0},
        "Optode": {"Source": {"Type": "pencil", "Pos": [1.5, 2.5, -1], "Dir": [0, 0, 1]}},
        "Domain": {
            "OriginType": 1, "LengthUnit": UNIT, "Dim": SIZE, "VolumeFile": "volume.bin", "MediaFormat": format,
            "Media": [[0, 0, 1, 1], [0.25, 2.0, 0.5, 1.5], [1.25, 4.0, 0.75, 1.25]]
        }
    })
}

fn load(input: &Value, bytes: &[u8]) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("volume.bin"), bytes).unwrap();
    let path = folder.path().join("input.json");
    fs::write(&path, input.to_string()).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

/// μ_a, μ_s and n at the centre of a voxel.
fn properties(loaded: &Loaded, voxel: [usize; 3]) -> [f64; 3] {
    let place = UNIT * (DVec3::from_array(voxel.map(|v| v as f64)) + 0.5);
    let medium = loaded.scene().medium(loaded.scene().medium_at(place));
    let (total, scattered) = (medium.extinction(place)[0], medium.scattering(place)[0]);
    [total - scattered, scattered, medium.index.n(place)]
}

#[track_caller]
fn near(found: [f64; 3], expected: [f64; 3]) {
    let close = found
        .iter()
        .zip(expected)
        .all(|(a, b)| (a - b).abs() < 1e-6);
    assert!(close, "{found:?} {expected:?}");
}

/// Voxels in the order of a file: x fastest, or z fastest.
fn voxels(rows_first: bool) -> Vec<[usize; 3]> {
    let [x, y, z] = SIZE;
    let mut all = Vec::new();
    for i in 0..x * y * z {
        all.push(if rows_first {
            [i / (y * z), i / z % y, i % z]
        } else {
            [i % x, i / x % y, i / x / y]
        });
    }
    all
}

fn coefficients([i, j, k]: [usize; 3]) -> [f32; 2] {
    [0.5 * i as f32 + 0.25 * k as f32, 1.0 + j as f32]
}

#[test]
fn absorption_and_scattering() {
    let hole = [2, 1, 3];
    for (order, rows_first) in [(None, false), (Some("c"), false), (Some("r"), true)] {
        let mut bytes = Vec::new();
        for voxel in voxels(rows_first) {
            let numbers = if voxel == hole {
                [f32::NAN; 2]
            } else {
                coefficients(voxel)
            };
            bytes.extend(numbers.into_iter().flat_map(f32::to_le_bytes));
        }
        let mut file = input(json!("muamus_float"));
        if let Some(order) = order {
            file["Domain"]["ArrayOrder"] = json!(order);
        }
        let loaded = load(&file, &bytes).unwrap();
        for voxel in voxels(false) {
            let [mu_a, mu_s] = coefficients(voxel).map(f64::from);
            let expected = if voxel == hole {
                [0.0, 0.0, 1.0]
            } else {
                [mu_a, mu_s, 1.5]
            };
            near(properties(&loaded, voxel), expected);
        }
    }
}

/// Arrays of JData have the channels last, as MCX writes them, or first.
#[test]
fn annotated_arrays() {
    let [x, y, z] = SIZE;
    let by_voxel: Vec<f32> = voxels(true).into_iter().flat_map(coefficients).collect();
    let by_channel: Vec<f32> = (0..2)
        .flat_map(|c| {
            voxels(true)
                .into_iter()
                .map(move |voxel| coefficients(voxel)[c])
        })
        .collect();
    for (shape, numbers) in [([x, y, z, 2], by_voxel), ([2, x, y, z], by_channel)] {
        let mut file = input(json!("muamus_float"));
        file["Domain"]["VolumeFile"] = json!("");
        file["Shapes"] =
            json!({"_ArrayType_": "single", "_ArraySize_": shape, "_ArrayData_": numbers});
        let loaded = load(&file, &[]).unwrap();
        for voxel in voxels(false) {
            let [mu_a, mu_s] = coefficients(voxel).map(f64::from);
            near(properties(&loaded, voxel), [mu_a, mu_s, 1.5]);
        }
    }
}

#[test]
fn all_formats() {
    let count = SIZE.iter().product::<usize>();
    let repeated = |voxel: Vec<u8>| voxel.repeat(count);
    let floats = |numbers: &[f32]| numbers.iter().flat_map(|v| v.to_le_bytes()).collect();
    let shorts = |numbers: &[u16]| numbers.iter().flat_map(|v| v.to_le_bytes()).collect();
    // 0.5 and 2 in half precision.
    let halves = [0x3800, 0x4000];
    let cases: [(Value, Vec<u8>, [f64; 3]); 6] = [
        (
            json!(96),
            floats(&[0.5, 3.0, 0.25, 1.375]),
            [0.5, 3.0, 1.375],
        ),
        (json!("mua_float"), floats(&[0.75]), [0.75, 2.0, 1.5]),
        // Numbers of half precision are per voxel edge.
        (json!("muamus_half"), shorts(&halves), [1.0, 4.0, 1.5]),
        (json!(103), vec![51, 0, 0, 255], [0.45, 2.0, 1.25]),
        (
            json!("muamus_short"),
            shorts(&[65535, 13107]),
            [1.25, 2.4, 1.5],
        ),
        (json!(100), floats(&[0.0, 0.5]), [0.0, 0.5, 1.5]),
    ];
    for (format, voxel, expected) in cases {
        let loaded = load(&input(format.clone()), &repeated(voxel));
        let loaded = loaded.unwrap_or_else(|e| panic!("{format}: {e}"));
        near(properties(&loaded, [1, 2, 3]), expected);
    }
    // Labels of 16 bits.
    let labels: Vec<u8> = shorts(&[2]);
    near(
        properties(
            &load(&input(json!("short")), &repeated(labels)).unwrap(),
            [0, 0, 0],
        ),
        [1.25, 4.0, 1.25],
    );
}

#[test]
fn indices_that_vary() {
    let mut file = input(json!("asgn_float"));
    file["Session"]["DoMismatch"] = json!(1);
    let mut bytes = Vec::new();
    for [.., k] in voxels(false) {
        let n = if k < 2 { 1.375 } else { 1.5 };
        let numbers = [0.1f32, 1.0, 0.1 * k as f32, n];
        bytes.extend(numbers.into_iter().flat_map(f32::to_le_bytes));
    }
    let loaded = load(&file, &bytes).unwrap();
    near(properties(&loaded, [1, 1, 1]), [0.1, 1.0, 1.375]);
    near(properties(&loaded, [1, 1, 2]), [0.1, 1.0, 1.5]);
    let run = Run {
        total: Some(200),
        ..Run::new(&loaded)
    };
    let absorbed = run.measure().unwrap().readings[0][1].clone();
    assert!(absorbed.mean.iter().any(|v| *v > 0.0));
}

/// Absorbed energy of layers, as labels and as coefficients.
#[test]
fn readings_agree_with_those_of_labels() {
    let labels: Vec<u8> = voxels(false)
        .iter()
        .map(|v| 1 + u8::from(v[2] > 1))
        .collect();
    let mut numbers = Vec::new();
    for [.., k] in voxels(false) {
        let row: [f32; 4] = if k > 1 {
            [1.25, 4.0, 0.75, 1.5]
        } else {
            [0.25, 2.0, 0.5, 1.5]
        };
        numbers.extend(row.into_iter().flat_map(f32::to_le_bytes));
    }
    let mut by_label = input(json!("byte"));
    by_label["Domain"]["Media"][2][3] = json!(1.5);
    let measured = |file: &Value, bytes: &[u8], seed| {
        let loaded = load(file, bytes).unwrap();
        let run = Run {
            seed,
            ..Run::new(&loaded)
        };
        let absorbed = run.measure().unwrap().readings[0][1].clone();
        (absorbed.mean, absorbed.error)
    };
    let (a, a_error) = measured(&by_label, &labels, 1);
    let (b, b_error) = measured(&input(json!("asgn_float")), &numbers, 2);
    let column = |i: usize| (i * SIZE[1] + 2) * SIZE[0] + 1;
    let zs: Vec<f64> = (0..SIZE[2])
        .map(column)
        .map(|i| two_sample_z(a[i], a_error[i], b[i], b_error[i]))
        .collect();
    max_abs_z(&zs, FAMILY).unwrap();
}

#[test]
fn mistakes() {
    let count = SIZE.iter().product::<usize>();
    let floats = |numbers: &[f32]| -> Vec<u8> {
        let one: Vec<u8> = numbers.iter().flat_map(|v| v.to_le_bytes()).collect();
        one.repeat(count)
    };
    for (format, bytes, expected) in [
        ("svmc", Vec::new(), "MediaFormat must be byte"),
        (
            "muamus_float",
            vec![0; 4],
            "3 x 4 x 5 voxels of 8 bytes each",
        ),
        (
            "muamus_float",
            floats(&[-1.0, 1.0]),
            "mua is -1 at voxel (0, 0, 0)",
        ),
        ("muamus_float", floats(&[0.0, f32::INFINITY]), "mus is inf"),
        ("asgn_float", floats(&[0.0, 1.0, -1.0, 1.0]), "g is -1"),
        ("asgn_float", floats(&[0.0, 1.0, 0.5, 0.0]), "n is 0"),
    ] {
        let message = load(&input(json!(format)), &bytes).expect_err(expected);
        assert!(message.contains(expected), "{format}: {message}");
    }
    let mut indices = Vec::new();
    let mut file = input(json!("asgn_float"));
    file["Domain"]["Dim"] = json!([300, 1, 1]);
    for i in 0..300u16 {
        let numbers = [0.0f32, 1.0, 0.0, 1.0 + f32::from(i) / 1024.0];
        indices.extend(numbers.into_iter().flat_map(f32::to_le_bytes));
    }
    assert!(
        load(&file, &indices)
            .unwrap_err()
            .contains("more than 255 refractive indices")
    );
    let mut file = input(json!("muamus_float"));
    file["Shapes"] = json!([{"Sphere": {"O": [1, 1, 1], "R": 1, "Tag": 1}}]);
    assert!(
        load(&file, &floats(&[0.0, 1.0]))
            .unwrap_err()
            .contains("shapes have labels")
    );
    let mut file = input(json!("muamus_float"));
    file["Session"]["DoMismatch"] = json!(1);
    file["Domain"]["Media"][0][3] = json!(1.25);
    assert!(
        load(&file, &floats(&[0.0, 1.0]))
            .unwrap_err()
            .contains("n of medium 0")
    );
}

/// Beams stand at the corners of the array and between them, with equal power.
#[test]
fn arrays_of_pencil_beams() {
    let mut file = input(json!("byte"));
    file["Optode"]["Source"] = json!({
        "Type": "pencilarray", "Pos": [0.5, 0.5, -1], "Dir": [0, 0, 1], "Param1": [2, 0, 0, 3], "Param2": [0, 2, 0, 2],
    });
    file["Domain"]["Media"][1] = json!([1.0, 0, 1, 1]);
    let loaded = load(&file, &[1; 60]).unwrap();
    let reading = Run::new(&loaded).measure().unwrap().readings[0][0].clone();
    for [i, j, ..] in voxels(false).into_iter().filter(|v| v[2] == 0) {
        let found = reading.mean[j * SIZE[0] + i] * UNIT * UNIT;
        let expected = if j % 2 == 0 && j < 3 {
            (1.0 - (-UNIT).exp()) / UNIT / 6.0
        } else {
            0.0
        };
        // Four standard errors of 4000 / 6 particles.
        assert!(
            (found - expected).abs() <= 4.0 * expected * (5.0f64 / 4000.0).sqrt(),
            "{i} {j} {found} {expected}"
        );
    }
    file["Optode"]["Source"]["Param2"][3] = json!(1.5);
    assert!(
        load(&file, &[1; 60])
            .unwrap_err()
            .contains("numbers of beams")
    );
    // SIMPA writes a single beam without sides and numbers.
    let source = &mut file["Optode"]["Source"];
    (source["Param1"], source["Param2"]) = (json!([0, 0, 0, 0]), json!([0, 0, 0, 0]));
    let of = |file: &Value| {
        let loaded = load(file, &[1; 60]).unwrap();
        Run::new(&loaded).measure().unwrap().readings[0][0].clone()
    };
    let single = of(&file);
    file["Optode"]["Source"]["Type"] = json!("pencil");
    assert_eq!(single, of(&file));
}

#[test]
fn sides() {
    for (flags, mismatch, expected) in [
        ("______", 1, None),
        ("rRr___", 1, None),
        ("aaaaaa000010", 0, None),
        ("a_____", 1, Some("sides act like all faces")),
        ("__c__c", 0, Some("wide that little light")),
        ("mMm___000010", 1, None),
        ("m_____", 0, None),
        ("x_____", 0, Some("'x' at place 1")),
        ("______2", 0, Some("place 7")),
    ] {
        let mut file = input(json!("byte"));
        file["Session"]["BCFlags"] = json!(flags);
        file["Session"]["DoMismatch"] = json!(mismatch);
        let loaded = load(&file, &[1; 60]);
        match expected {
            None => assert!(loaded.is_ok(), "{flags}"),
            Some(expected) => assert!(loaded.unwrap_err().contains(expected), "{flags}"),
        }
    }
    let mut file = input(json!("byte"));
    file["Session"]["DoSaveRef"] = json!(1);
    let loaded = load(&file, &[1; 60]).unwrap();
    let names: Vec<&str> = loaded.instruments.iter().map(|i| i.name.as_str()).collect();
    assert_eq!(names, ["cells", "surface"]);
}
