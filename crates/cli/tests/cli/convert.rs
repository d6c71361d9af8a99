//! `morgana convert`: round trips through all formats, its summary, and refused input.

use crate::support::Folder;
use glam::{DMat3, DVec3};
use io::volume::{AxisOrder, Options, Volume, npy};

/// A folder with `in.npy` of 3 x 4 x 5 voxels, whose values are multiples of a sixteenth.
fn folder() -> Folder {
    let folder = Folder::with_scene("");
    let data = (0..60).map(|i| i as f32 / 16.0).collect();
    let volume = Volume::<f32>::new([3, 4, 5], 1, data).unwrap();
    npy::write(&folder.path("in.npy"), &volume).unwrap();
    folder
}

/// 64-bit numbers are kept exactly. Contrasts are the index minus the reference, to the last digit
/// of a float.
#[test]
fn contrasts() {
    let folder = Folder::with_scene("");
    let index = |i: i32| 1.0 + 2.73e-4 * (-f64::from(i) / 32.0).exp();
    let samples: Vec<f64> = (0..64).map(index).collect();
    let volume = Volume::new([1, 1, 64], 1, samples.clone()).unwrap();
    npy::write(&folder.path("in.npy"), &volume).unwrap();
    let options = Options {
        axes: Some(AxisOrder::ZYX),
        dataset: None,
        limits: io::Limits::default(),
    };
    let read = |name: &str, options| Volume::<f64>::read(&folder.path(name), options).unwrap();
    folder.succeed("convert in.npy -o same.nrrd --axes zyx");
    assert_eq!(read("same.nrrd", Options::default()).into_data(), samples);
    let said = folder.succeed("convert in.npy -o c.npy --axes zyx --contrast 1 --type float32");
    assert!(
        said.contains("contrast  is the index less 1 (offset)"),
        "{said}"
    );
    for (found, n) in read("c.npy", options).into_data().into_iter().zip(samples) {
        assert!((1.0 + found - n).abs() < 2e-11, "{found} {n}");
    }
}

#[test]
fn there_and_back_is_exact() {
    let folder = folder();
    for (format, back) in [
        ("vol", ""),
        ("npz", "--axes zyx"),
        ("h5", "--axes zyx --dataset p"),
        ("mat", "--axes xyz"),
        ("nrrd", ""),
        ("vti", ""),
        ("vtk", ""),
    ] {
        let there = format!("convert in.npy -o a.{format} --axes zyx --out-dataset p");
        folder.succeed(&there);
        folder.succeed(&format!("convert a.{format} -o out.npy {back}"));
        assert_eq!(folder.read("in.npy"), folder.read("out.npy"), "{format}");
    }
}

#[test]
fn the_summary_says_what_is_there() {
    let folder = folder();
    let summary = folder.succeed(
        "convert in.npy -o a.nrrd --axes zyx --spacing 0.1,0.2,0.5 --origin=-1,0,2 --resample 3x2x5",
    );
    let expected = "in.npy: 3 x 4 x 5 voxels, float32\n  values    0 to 3.6875, mean 1.8438\n  \
                    place     not given\na.nrrd: 3 x 2 x 5 voxels, float32\n  \
                    values    0.09375 to 3.5938, mean 1.8438\n  spacing   0.1 x 0.4 x 0.5\n  \
                    first     (-1, 0.1, 2); samples at centers\n";
    assert_eq!(summary, expected);
    let summary = folder.succeed("convert a.nrrd -o b.npy --type float16");
    assert!(
        summary.contains("axes      zyx (axis_order, --axes)"),
        "{summary}"
    );
    assert!(
        summary.contains("place     is not kept by this format"),
        "{summary}"
    );
    let summary =
        folder.succeed("convert in.npy -o b.npy --axes zyx --type uint8 --scale 3 --offset 0.5");
    assert!(
        summary.contains("rounding  changes values by up to 0.5"),
        "{summary}"
    );
    let read = Volume::<f64>::read(&folder.path("b.npy"), Options::order(AxisOrder::ZYX));
    assert_eq!(read.unwrap().data()[59], 12.0);
}

#[test]
fn mistakes_are_named() {
    let folder = folder();
    let says = |arguments: &str, expected: &str| {
        let error = folder.refuse(&format!("convert {arguments}"));
        assert!(error.contains(expected), "{arguments}: {error}");
    };
    says("in.npy -o a.vol", "give the order of its axes");
    says(
        "in.npy -o a.vol --axes xxy",
        "'xxy' is not an order of axes",
    );
    says("in.npy -o a.gif --axes zyx", "volumes are .vol");
    says("none.vol -o a.npy", "none.vol: cannot read");
    says(
        "in.npy -o a.vol --axes zyx --type int8",
        "a.vol: the format has no int8; float32 comes closest",
    );
    says(
        "in.npy -o a.vol --axes zyx --resample 0x1x1",
        "three whole numbers above 0",
    );
    says(
        "in.npy -o a.vol --axes zyx --spacing 1,0,1",
        "three numbers above 0",
    );
    says(
        "in.npy -o a.vol --axes zyx --origin 0,0,0",
        "--origin needs --spacing",
    );
    let outcome = folder.run("convert in.npy -o a.npy --axes zyx --scale 1e9 --type float16");
    assert_eq!(outcome.status, Some(1));
    assert!(
        outcome.stderr.contains("as a number of type float16"),
        "{outcome:?}"
    );
    assert_eq!(folder.files(), ["in.npy", "scene.xml"]);
}

/// Readings of meters keep their placement: 2 x 3 x 4 cells of half a unit from (-0.5, -0.75, 1)
/// on, upright or rotated by a quarter turn about z.
#[test]
fn readings_keep_their_place() {
    let meter = |id: &str, turn: &str| {
        format!(
            r#"<sensor type="fluencemeter" id="{id}"><integer name="nx" value="2"/><integer name="ny" value="3"/>
                 <integer name="nz" value="4"/><transform name="to_world"><scale value="1, 1.5, 2"/>
                 <translate value="-0.5, -0.75, 1"/>{turn}</transform></sensor>"#
        )
    };
    let scene = |meters: &str| {
        format!(
            r#"<scene version="3.0.0"><integrator type="particle"/><shape type="sphere"><bsdf type="null"/>
                 <medium type="homogeneous" name="interior"/></shape><emitter type="point"/>{meters}</scene>"#
        )
    };
    let upright = DMat3::from_diagonal(DVec3::splat(0.5));
    let turn = r#"<rotate z="1" angle="90"/>"#;
    let turned = DMat3::from_rotation_z(std::f64::consts::FRAC_PI_2);
    let first = DVec3::new(-0.25, -0.5, 1.25);
    let [one, two] = [meter("one", ""), meter("two", turn)];
    for (meters, dataset, map) in [
        (one.clone(), "fluence", DMat3::IDENTITY),
        (two.clone(), "fluence", turned),
        (one + &two, "two.fluence", turned),
    ] {
        let folder = Folder::with_file(&scene(&meters));
        for format in ["npz", "h5"] {
            folder.succeed(&format!("render scene.xml --particles 64 -o a.{format}"));
            let said = folder.succeed(&format!(
                "convert a.{format} -o a.vti --axes zyx --dataset {dataset}"
            ));
            assert!(!said.contains("not given"), "{said}");
            assert_eq!(
                said.matches("spacing   0.5 x 0.5 x 0.5").count(),
                2,
                "{said}"
            );
            let volume = Volume::<f64>::read(&folder.path("a.vti"), Options::default()).unwrap();
            let frame = volume.frame().unwrap();
            assert_eq!((volume.size(), frame.nodes), ([2, 3, 4], false));
            assert!(frame.first.distance(map * first) < 1e-12, "{frame:?}");
            assert!(frame.steps.abs_diff_eq(map * upright, 1e-12), "{frame:?}");
        }
    }
}
