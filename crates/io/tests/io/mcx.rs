//! Input files of MCX: their translation, and refused files.

use glam::DVec3;
use morgana_io::{Limits, LoadOptions, Loaded, Refusal, Run};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use transport::emitter::Emitter;
use transport::medium::Medium;
use transport::meter::Meter;

/// Two layers, with a ball of a third medium and an empty ball.
fn input() -> Value {
    json!({
        "Session": {"ID": "test", "Photons": 3000, "RNGSeed": 1, "DoMismatch": 1},
        "Forward": {"T0": 0, "T1": 5e-9, "Dt": 5e-9},
        "Optode": {"Source": {"Type": "pencil", "Pos": [5, 4, 0], "Dir": [0, 0, 1, 0]}},
        "Domain": {
            "OriginType": 1, "LengthUnit": 0.5,
            "Media": [
                {"mua": 1e-5, "mus": 0.1, "g": 0, "n": 1.2},
                {"mua": 0.01, "mus": 1.0, "g": 0.5, "n": 1.37},
                {"mua": 0.02, "mus": 2.0, "g": 0.9, "n": 1.37},
                {"mua": 0.5, "mus": 0.5, "g": 0.0, "n": 1.5}
            ]
        },
        "Shapes": [
            {"Name": "test"},
            {"Grid": {"Tag": 1, "Size": [10, 8, 12]}},
            {"ZLayers": [[7, 12, 2]]},
            {"Sphere": {"Tag": 3, "O": [5, 4, 6], "R": 2}},
            {"Subgrid": {"Tag": 0, "O": [1, 1, 12], "Size": [9, 7, 0]}}
        ]
    })
}

fn load_in(folder: &Path, input: &Value) -> Result<Loaded, String> {
    let path = folder.join("input.json");
    fs::write(&path, input.to_string()).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

fn load(input: &Value) -> Result<Loaded, String> {
    load_in(tempfile::tempdir().unwrap().path(), input)
}

/// The medium at a position in voxels.
fn medium_at(loaded: &Loaded, voxel: [f64; 3]) -> &Medium {
    let x = 0.5 * (DVec3::from(voxel) + 0.5);
    loaded.scene().medium(loaded.scene().medium_at(x))
}

/// μ_a at a position in voxels.
fn absorption(loaded: &Loaded, voxel: [f64; 3]) -> f64 {
    let x = 0.5 * (DVec3::from(voxel) + 0.5);
    let medium = medium_at(loaded, voxel);
    (medium.extinction(x) - medium.scattering(x))[0]
}

#[track_caller]
fn near(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-9, "{a} {b}");
}

#[test]
fn labels_media_and_source_are_those_of_the_file() {
    let loaded = load(&input()).unwrap();
    assert_eq!(loaded.samples, 3000);
    assert_eq!(medium_at(&loaded, [20.0, 1.0, 1.0]).name, "ambient");
    near(
        medium_at(&loaded, [20.0, 1.0, 1.0]).index.n(DVec3::ZERO),
        1.2,
    );
    near(absorption(&loaded, [1.0, 1.0, 5.0]), 0.01);
    near(absorption(&loaded, [1.0, 1.0, 6.0]), 0.02);
    near(absorption(&loaded, [4.0, 4.0, 6.0]), 0.5);
    near(
        medium_at(&loaded, [4.0, 4.0, 6.0]).index.n(DVec3::ZERO),
        1.5,
    );
    assert_eq!(medium_at(&loaded, [4.0, 4.0, 11.0]).name, "ambient");
    let [Emitter::Collimated(beam)] = loaded.scene().emitters() else {
        panic!("{:?}", loaded.scene().emitters());
    };
    // Photons start in the voxel that contains their position, within the volume.
    assert!((beam.origin() - DVec3::new(2.5 + 2.5e-5, 2.0 + 2.5e-5, 2.5e-5)).length() < 1e-12);
    assert_eq!(loaded.scene().medium_at(beam.origin()), 1);
}

/// Light on a side of the volume starts in the voxel there, whatever its direction. Absorption of
/// row 0 does not count.
#[test]
fn sources_on_sides_start_inside() {
    for position in [[0, 4, 5], [5, 0, 3], [9, 7, 10]] {
        let mut file = input();
        file["Optode"]["Source"]["Type"] = json!("isotropic");
        file["Optode"]["Source"]["Pos"] = json!(position);
        let loaded = load(&file).unwrap();
        let x = loaded.scene().emitters()[0].singularity().unwrap();
        assert_ne!(loaded.scene().medium_at(x), 0, "{position:?}");
        assert!(loaded.scene().media()[0].is_transparent());
    }
}

/// Positions from 1, time gates, no refraction.
#[test]
fn settings() {
    let mut other = input();
    other["Domain"]["OriginType"] = json!(0);
    other["Optode"]["Source"]["Pos"] = json!([6, 5, 1]);
    other["Session"]["DoMismatch"] = json!(0);
    other["Forward"]["Dt"] = json!(1e-9);
    let loaded = load(&other).unwrap();
    let [Emitter::Collimated(beam)] = loaded.scene().emitters() else {
        panic!("{:?}", loaded.scene().emitters());
    };
    assert!((beam.origin() - DVec3::new(2.5 + 2.5e-5, 2.0 + 2.5e-5, 2.5e-5)).length() < 1e-12);
    assert!(loaded.scene().is_straight());
    let run = Run {
        total: Some(200),
        ..Run::new(&loaded)
    };
    let readings = run.measure().unwrap().readings;
    let gates = &readings[0][0].axes[0];
    assert_eq!((gates.name.as_ref(), gates.len()), ("opl", 5));
    near(gates.edges[5], 1498.96229);
}

/// Values are always the fluence per joule; a note explains other requested outputs.
#[test]
fn other_outputs_are_told() {
    for (kind, told) in [
        ("F", None),
        ("X", Some("divide 'fluence' by the width of a time gate")),
        ("energy", Some("for the energy density, read 'absorbed'")),
        (
            "rf",
            Some("divide 'fluence_in_phase' − i 'fluence_quadrature'"),
        ),
        ("J", Some("morgana measures nothing else")),
    ] {
        let mut other = input();
        other["Session"]["OutputType"] = json!(kind);
        let warnings = load(&other).unwrap().warnings.to_string();
        let expected = told.map_or(warnings.is_empty(), |told| warnings.contains(told));
        assert!(expected, "{kind}: {warnings}");
    }
}

/// A modulated source makes the voxels and the detectors measure amplitude and phase.
#[test]
fn modulated_sources() {
    let mut modulated = input();
    modulated["Optode"]["Detector"] = json!([{"Pos": [2, 4, 0], "R": 1}]);
    modulated["Optode"]["Source"]["Frequency"] = json!(1e8);
    let loaded = load(&modulated).unwrap();
    assert_eq!(loaded.instruments.len(), 2);
    for instrument in &loaded.instruments {
        let domain = instrument.meter.frequency_domain().unwrap();
        assert_eq!(domain.hertz(), [1e8]);
    }
    modulated["Optode"]["Source"]["Frequency"] = json!(0);
    let steady = load(&modulated).unwrap();
    assert!(steady.instruments[0].meter.frequency_domain().is_none());
    modulated["Optode"]["Source"]["Frequency"] = json!(-1e8);
    let told = load(&modulated).unwrap_err();
    assert!(told.contains("must be the modulation in Hz"), "{told}");
}

/// `DoMismatch` alone determines whether entering light is reflected.
#[test]
fn light_that_enters_is_reflected_as_all_other_light() {
    let with = |mismatch: i32, specular: Value| {
        let mut other = input();
        other["Session"]["DoMismatch"] = json!(mismatch);
        other["Session"]["DoSpecular"] = specular;
        load(&other).map(|loaded| loaded.warnings.to_string())
    };
    for (mismatch, specular) in [(1, json!(1)), (1, json!(true)), (0, json!(0))] {
        let told = with(mismatch, specular).unwrap();
        assert!(!told.contains("DoSpecular"), "{told}");
    }
    let told = with(1, json!(0)).unwrap();
    assert!(
        told.contains("DoSpecular (isspecular) 0 changes nothing"),
        "{told}"
    );
    let refused = with(0, json!(1)).unwrap_err();
    assert!(
        refused.contains("give DoMismatch 1 or DoSpecular 0"),
        "{refused}"
    );
}

#[test]
fn photons_are_counted_in_whole_numbers() {
    let mut half = input();
    half["Session"]["Photons"] = json!(1000.5);
    let refused = load(&half).map(|_| ()).unwrap_err();
    assert!(
        refused.contains("Photons must be a whole number"),
        "{refused}"
    );
    half["Session"]["Photons"] = json!(1e3);
    assert!(load(&half).is_ok());
}

/// Each shape labels the voxels whose centres it contains.
#[test]
fn shapes_are_drawn_one_over_the_other() {
    for (shape, inside, outside) in [
        (
            json!({"Box": {"Tag": 3, "O": [2, 2, 2], "Size": [2, 3, 1]}}),
            [3.0, 4.0, 2.0],
            [4.0, 4.0, 2.0],
        ),
        (
            json!({"Subgrid": {"Tag": 3, "O": [2, 2, 2], "Size": [2, 3, 1]}}),
            [3.0, 4.0, 2.0],
            [4.0, 4.0, 2.0],
        ),
        (
            json!({"Sphere": {"Tag": 3, "O": [5, 4, 6], "R": 2}}),
            [6.0, 4.0, 6.0],
            [7.0, 4.0, 6.0],
        ),
        (
            json!({"Cylinder": {"Tag": 3, "C0": [0, 4, 6], "C1": [5, 4, 6], "R": 1}}),
            [4.0, 4.0, 6.0],
            [5.0, 4.0, 6.0],
        ),
        (
            json!({"UpperSpace": {"Tag": 3, "Coef": [1, 0, 0, 4]}}),
            [4.0, 1.0, 1.0],
            [3.0, 1.0, 1.0],
        ),
        (
            json!({"XLayers": [[2, 3, 3]]}),
            [2.0, 1.0, 1.0],
            [3.0, 1.0, 1.0],
        ),
        (
            json!({"YSlabs": {"Tag": 3, "Bound": [[2, 4]]}}),
            [1.0, 3.0, 1.0],
            [1.0, 4.0, 1.0],
        ),
    ] {
        let mut file = input();
        file["Shapes"] = json!([{"Grid": {"Tag": 1, "Size": [10, 8, 12]}}, shape]);
        // Positions of boxes, subgrids and cylinders also count from 1 if positions do, as in
        // MCX-CL.
        let counts = ["Box", "Subgrid", "Cylinder"]
            .iter()
            .any(|kind| shape.get(kind).is_some());
        for origin in [1, 0] {
            file["Domain"]["OriginType"] = json!(origin);
            let loaded = load(&file).unwrap_or_else(|e| panic!("{shape}: {e}"));
            let shift = if counts && origin == 0 { 1.0 } else { 0.0 };
            let found =
                [inside, outside].map(|voxel| absorption(&loaded, voxel.map(|i| i - shift)));
            assert!(
                (found[0] - 0.5).abs() < 1e-9 && (found[1] - 0.01).abs() < 1e-9,
                "{shape}: {found:?}"
            );
        }
    }
}

/// Photons start in the voxel that contains the source, also from its corner, and from a side of
/// the volume along it.
#[test]
fn pencils_on_edges_of_voxels_stay_in_one() {
    for (position, direction, column) in [
        ([5, 4, 0], [0, 0, 1], [5, 4, 0]),
        ([0, 4, 3], [1, 0, 0], [0, 4, 3]),
    ] {
        let mut file = input();
        file["Shapes"] = json!([{"Grid": {"Tag": 1, "Size": [10, 8, 12]}}]);
        file["Domain"]["Media"][1] = json!({"mua": 0.1, "mus": 0, "g": 1, "n": 1.37});
        file["Session"]["DoMismatch"] = json!(0);
        file["Optode"]["Source"]["Pos"] = json!(position);
        file["Optode"]["Source"]["Dir"] = json!(direction);
        let loaded = load(&file).unwrap();
        let run = Run {
            total: Some(2000),
            ..Run::new(&loaded)
        };
        let readings = run.measure().unwrap().readings;
        // Cells are [z, y, x]. The remaining part of 1 J passes the voxels of one column, half a
        // millimetre each.
        let fluence = &readings[0][0].mean;
        let of = |[x, y, z]: [usize; 3]| fluence[(z * 8 + y) * 10 + x] * 0.125;
        let expected = (1.0 - (-0.05_f64).exp()) / 0.1;
        assert!(
            (of(column) - expected).abs() < 1e-3 * expected,
            "{position:?}"
        );
        let beside = fluence.iter().filter(|v| **v > 0.0).count();
        assert_eq!(beside, if position[2] == 0 { 12 } else { 10 });
    }
}

#[test]
fn volumes_come_from_files() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = input();
    let shapes = json!({"Shapes": file.as_object_mut().unwrap().remove("Shapes").unwrap()});
    fs::write(folder.path().join("shapes.json"), shapes.to_string()).unwrap();
    let bytes: Vec<u8> = (0..10 * 8 * 12).map(|i| 1 + u8::from(i % 10 > 4)).collect();
    fs::write(folder.path().join("labels.bin"), bytes).unwrap();
    file["Domain"]["Dim"] = json!([10, 8, 12]);
    file["Domain"]["VolumeFile"] = json!("shapes.json");
    let loaded = load_in(folder.path(), &file).unwrap();
    near(absorption(&loaded, [4.0, 4.0, 6.0]), 0.5);
    file["Domain"]["VolumeFile"] = json!("labels.bin");
    let loaded = load_in(folder.path(), &file).unwrap();
    near(absorption(&loaded, [4.0, 4.0, 6.0]), 0.01);
    near(absorption(&loaded, [5.0, 4.0, 6.0]), 0.02);
    file["Domain"]["Dim"] = json!([10, 8, 13]);
    let message = load_in(folder.path(), &file).unwrap_err();
    assert!(
        message.contains("but Dim states 10 x 8 x 13 voxels of a byte each"),
        "{message}"
    );
    file["Domain"]["VolumeFile"] = json!("nowhere.bin");
    assert!(
        load_in(folder.path(), &file)
            .unwrap_err()
            .contains("nowhere.bin")
    );
}

/// Every accepted kind of source has power 1.
#[test]
fn sources() {
    for (source, kind) in [
        (
            json!({"Type": "isotropic", "Param1": [0, 0, 0, 0]}),
            "point",
        ),
        (json!({"Type": "cone", "Param1": [0.3, 0, 0, 0]}), "spot"),
        (
            json!({"Type": "gaussian", "Param1": [2, 0, 0, 0]}),
            "collimated",
        ),
        (
            json!({"Type": "disk", "Param1": [2, 0, 0, 0]}),
            "collimated",
        ),
        (
            json!({"Type": "planar", "Param1": [3, 0, 0, 0], "Param2": [0, 2, 0, 0]}),
            "collimated",
        ),
        (
            json!({"Type": "slit", "Param1": [3, 0, 0, 0]}),
            "collimated",
        ),
    ] {
        let mut file = input();
        for (key, value) in source.as_object().unwrap() {
            file["Optode"]["Source"][key] = value.clone();
        }
        let loaded = load(&file).unwrap_or_else(|e| panic!("{source}: {e}"));
        assert_eq!(loaded.scene().emitters()[0].kind(), kind, "{source}");
        let run = Run {
            total: Some(100),
            ..Run::new(&loaded)
        };
        near(run.measure().unwrap().emitted[0], 1.0);
    }
}

#[test]
fn mistakes() {
    let refused = |change: fn(&mut Value), expected: &str| {
        let mut file = input();
        change(&mut file);
        let message = load(&file).expect_err(expected);
        assert!(
            message.contains(expected),
            "expected {expected:?} in:\n{message}"
        );
    };
    refused(
        |f| f["Optode"]["Source"]["Type"] = json!("pattern3d"),
        "source 'pattern3d': sources are pencil",
    );
    refused(
        |f| f["Forward"] = json!({"T0": 0, "T1": 5e-9, "Dt": 3e-9}),
        "no whole number of gates: give 2.5e-9 s for 2",
    );
    refused(
        |f| f["Optode"]["Source"]["Dir"] = json!([0, 0, 0]),
        "Dir must be a direction",
    );
    refused(
        |f| f["Optode"]["Source"]["Pos"] = json!([[1, 2, 3, 1], [2, 3, 4, 1]]),
        "have a row for each source",
    );
    refused(|f| f["Optode"] = json!({}), "Optode needs a Source");
    refused(|f| f["Domain"]["Media"] = json!(3), "Media must be a list");
    refused(
        |f| f["Domain"]["Media"][1]["mua"] = json!("x"),
        "mua must be a number",
    );
    refused(
        |f| f["Shapes"] = json!({"Torus": 1}),
        "Shapes must be a list of shapes, or an array of JData",
    );
    refused(
        |f| f["Shapes"][2] = json!({"Torus": {}}),
        "unknown shape 'torus'",
    );
    refused(
        |f| f["Shapes"] = json!([]),
        "Domain needs a VolumeFile or Shapes",
    );
    refused(
        |f| f["Shapes"] = json!([{"Grid": {"Tag": 1, "Size": [1e9, 1e9, 1e9]}}]),
        "Size: too large",
    );
    refused(|f| f["Forward"]["T1"] = json!(0), "T1 above T0");
    refused(
        |f| f["Optode"]["Detector"] = json!([{"Pos": [1, 2, 3], "R": 0}]),
        "the radius R of a detector must be above 0",
    );
    refused(
        |f| f["Optode"]["Detector"] = json!([{"Pos": [1, 2, 3], "R": 1, "Angle": 5}]),
        "morgana does not support 'Angle'",
    );
    refused(
        |f| f["Optode"]["Detector"] = json!([[1, 2, 3]]),
        "a detector must be {\"Pos\": [x, y, z], \"R\": radius}",
    );
}

#[test]
fn detectors_are_meters_that_keep_records() {
    let mut file = input();
    file["Optode"]["Detector"] = json!([{"Pos": [2, 4, 0], "R": 1.5}, [8, 4, 0, 1]]);
    file["Session"]["MaxDetPhoton"] = json!(5000);
    let loaded = load(&file).unwrap();
    let names: Vec<&str> = loaded.instruments.iter().map(|i| &*i.name).collect();
    assert_eq!(names, ["cells", "detector1", "detector2"]);
    assert_eq!(loaded.samples, 3000);
    let Meter::Irradiance(first) = &loaded.instruments[1].meter else {
        panic!("{:?}", loaded.instruments[1]);
    };
    let patch = first.acceptance.patch.unwrap();
    assert_eq!(
        (patch.center, patch.radius),
        (DVec3::new(1.0, 2.0, 0.0), 0.75)
    );
    assert_eq!(first.most_records, Some(5000));
    let run = Run {
        total: Some(3000),
        ..Run::new(&loaded)
    };
    let measured = run.measure().unwrap();
    let table = measured.records[1].as_ref().unwrap();
    assert!(table.particle.len() > 30, "{}", table.particle.len());
    for position in table.position.chunks(3) {
        assert!(DVec3::from_slice(position).distance(patch.center) <= 0.75);
    }
    let names: Vec<&str> = table.regions.iter().map(|r| &*r.name).collect();
    for label in ["tissue: label 1", "tissue: label 2", "tissue: label 3"] {
        assert!(names.contains(&label), "{names:?}");
    }
    file["Session"]["DoPartialPath"] = json!(0);
    let loaded = load(&file).unwrap();
    let Meter::Irradiance(first) = &loaded.instruments[1].meter else {
        panic!("{:?}", loaded.instruments[1]);
    };
    assert_eq!(first.most_records, None);
}

/// Sizes that a file states respect the memory limit, and so do meters of voxels.
#[test]
fn sizes_are_within_the_limit_of_memory() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("input.json");
    let load = |input: &Value, memory: u64| {
        fs::write(&path, input.to_string()).unwrap();
        let options = LoadOptions {
            limits: Limits::of(memory),
            ..LoadOptions::default()
        };
        morgana_io::load_scene(&path, &options).map_err(|d| d.to_string())
    };
    let size = json!([1000, 1000, 1000]);
    let mut by_shape = input();
    by_shape["Shapes"] = json!([{"Grid": {"Tag": 1, "Size": size}}]);
    let mut by_domain = input();
    by_domain["Domain"]["Dim"] = size;
    for file in [by_shape, by_domain] {
        let error = load(&file, 64 << 20).unwrap_err();
        assert!(
            error.contains("13.0 GiB of memory, more than the limit of 64.0 MiB"),
            "{error}"
        );
    }
    let loaded = load(&input(), 0).unwrap();
    let refused = Run::new(&loaded).check(Limits::of(10_000)).unwrap_err();
    assert!(
        matches!(refused, Refusal::MeterMemory(_, 10_000)),
        "{refused}"
    );
    Run::new(&loaded).check(Limits::of(1 << 20)).unwrap();
}

/// A thousand small shapes in a large volume take time proportional to their voxels, and label the
/// voxels whose centres they contain.
#[test]
fn shapes_cost_what_they_cover() {
    let mut file = input();
    let mut shapes = vec![json!({"Grid": {"Tag": 1, "Size": [100, 100, 100]}})];
    for i in 0..20_000 {
        let place = [i % 40, i / 40 % 40, i / 1600].map(|k| 2.5 * f64::from(k));
        shapes.push(json!({"Sphere": {"Tag": 2, "O": place, "R": 0.9}}));
    }
    shapes.push(json!({"Sphere": {"Tag": 3, "O": [-1, 50, 50], "R": 2}}));
    shapes.push(json!({"Cylinder": {"Tag": 3, "C0": [96, 96, 90], "C1": [96, 96, 1000], "R": 2}}));
    file["Shapes"] = json!(shapes);
    let started = std::time::Instant::now();
    let loaded = load(&file).unwrap();
    assert!(started.elapsed().as_secs() < 20, "{:?}", started.elapsed());
    let expected = [
        ([2.0, 2.0, 2.0], 0.02),
        ([3.0, 3.0, 3.0], 0.01),
        ([0.0, 50.0, 50.0], 0.5),
        ([1.0, 50.0, 50.0], 0.01),
        ([95.0, 95.0, 99.0], 0.5),
        ([95.0, 95.0, 85.0], 0.01),
    ];
    for (voxel, mu_a) in expected {
        let found = absorption(&loaded, voxel);
        assert!((found - mu_a).abs() < 1e-12, "{voxel:?}: {found}");
    }
}
