//! Volumes that are written and read back, resampled, and scaled.

use std::path::Path;

use glam::{DMat3, DVec3};
use morgana_io::element::Element;
use morgana_io::volume::{AxisOrder, Format, Options, Volume, VolumeFrame, write};

const FORMATS: [&str; 14] = [
    "vol", "npy", "npz", "h5", "mat", "nrrd", "vti", "vtk", "nii", "nii.gz", "jnii", "bnii", "jdt",
    "jdb",
];

/// Values that a type represents exactly: quarters in floating point, integers otherwise.
fn sample(element: Element, channels: usize) -> Volume<f64> {
    let whole = if element.is_integer() { 1.0 } else { 0.25 };
    let values = (0..24 * channels).map(|i| whole * i as f64).collect();
    let volume = Volume::new([2, 3, 4], channels, values).unwrap();
    volume.with_element(element)
}

/// A placement whose numbers are exact in binary.
fn place(nodes: bool) -> VolumeFrame {
    VolumeFrame {
        first: DVec3::new(0.5, -1.0, 2.0),
        steps: DMat3::from_diagonal(DVec3::new(0.25, 0.5, 2.0)),
        nodes,
    }
}

/// Options that read a written file back.
fn reading(path: &Path, axes: Option<AxisOrder>) -> Options<'static> {
    let several = Format::of(path).unwrap().has_datasets();
    Options {
        axes,
        dataset: several.then_some("density"),
        ..Options::default()
    }
}

#[test]
fn round_trips() {
    let folder = tempfile::tempdir().unwrap();
    for format in FORMATS {
        let path = folder.path().join("a").with_extension(format);
        for element in Element::ALL {
            for channels in [1, 3, 5] {
                let what = format!("{format} {element} {channels}");
                let volume = sample(element, channels);
                let stored = write(&path, &volume, "density").unwrap();
                assert_eq!(stored.rounding, 0.0, "{what}");
                let read = Volume::<f64>::read(&path, reading(&path, stored.axes)).unwrap();
                assert_eq!(
                    (read.size(), read.channels()),
                    ([2, 3, 4], channels),
                    "{what}"
                );
                assert_eq!(read.data(), volume.data(), "{what}");
                assert_eq!(read.element(), stored.element, "{what}");
                let same = Format::of(&path).unwrap().element(element);
                assert_eq!(stored.element, same, "{what}");
            }
        }
    }
}

#[test]
fn types_that_formats_have() {
    for element in Element::ALL {
        for format in [Format::Npy, Format::Npz] {
            assert_eq!(format.element(element), element);
        }
        for format in [
            Format::Hdf5,
            Format::Mat,
            Format::Nrrd,
            Format::Vti,
            Format::Vtk,
            Format::Jnifti,
            Format::Jdata,
            Format::Nifti,
        ] {
            let expected = if element == Element::F16 {
                Element::F32
            } else {
                element
            };
            assert_eq!(format.element(element), expected);
        }
    }
    assert_eq!(Format::Vol.element(Element::F64), Element::F32);
    assert_eq!(Format::Vol.element(Element::F16), Element::F16);
}

#[test]
fn places_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    for format in ["nrrd", "vti", "vtk", "nii"] {
        let path = folder.path().join("a").with_extension(format);
        for nodes in [false, true] {
            // NIfTI has samples at the centres of cells only.
            let nodes = nodes && format != "nii";
            let volume = sample(Element::F32, 1)
                .with_frame(place(nodes))
                .with_unit(Some("mm".into()));
            assert!(write(&path, &volume, "density").unwrap().place);
            let read = Volume::<f64>::read(&path, Options::default()).unwrap();
            assert_eq!(read.frame(), Some(place(nodes)), "{format}");
            if ["nrrd", "nii"].contains(&format) {
                assert_eq!(read.unit(), Some("mm"));
            }
        }
    }
    // A box of cells, from half a step before the first sample.
    let path = folder.path().join("a.vol");
    let volume = sample(Element::F32, 1).with_frame(place(true));
    assert!(write(&path, &volume, "density").unwrap().place);
    let read = Volume::<f64>::read(&path, Options::default()).unwrap();
    let corners = [DVec3::new(0.375, -1.25, 1.0), DVec3::new(0.875, 0.25, 9.0)];
    assert_eq!(read.bbox(), Some(corners));
    assert_eq!(read.place(), place(false));
}

#[test]
fn turned_grids() {
    let folder = tempfile::tempdir().unwrap();
    let steps = DMat3::from_cols(DVec3::Y * 0.5, DVec3::X * -0.25, DVec3::Z);
    let volume = sample(Element::F32, 1).with_frame(VolumeFrame {
        steps,
        ..place(false)
    });
    for (format, kept) in [
        ("nrrd", true),
        ("vti", true),
        ("jnii", true),
        ("bnii", true),
        ("nii", true),
        ("vtk", false),
        ("vol", false),
    ] {
        let path = folder.path().join("a").with_extension(format);
        assert_eq!(
            write(&path, &volume, "density").unwrap().place,
            kept,
            "{format}"
        );
        let read = Volume::<f64>::read(&path, Options::default()).unwrap();
        assert_eq!(read.frame() == volume.frame(), kept, "{format}");
    }
}

#[test]
fn rounding_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npy");
    let third = Volume::<f64>::new([1, 1, 1], 1, vec![1.0 / 3.0]).unwrap();
    let stored = |element| write(&path, &third.clone().with_element(element), "a");
    assert_eq!(stored(Element::F64).unwrap().rounding, 0.0);
    let expected = (f64::from(1.0f32 / 3.0) - 1.0 / 3.0).abs();
    assert_eq!(stored(Element::F32).unwrap().rounding, expected);
    assert_eq!(stored(Element::U8).unwrap().rounding, 1.0 / 3.0);
    let large = Volume::<f64>::new([1, 1, 1], 1, vec![70000.0]).unwrap();
    for element in [Element::F16, Element::U16, Element::I8] {
        let error = write(&path, &large.clone().with_element(element), "a").unwrap_err();
        let expected = format!("too large: 70000 as a number of type {element}");
        assert!(error.to_string().ends_with(&expected), "{error}");
    }
}

#[test]
fn names_that_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let volume = sample(Element::F32, 1);
    for (file, name) in [
        ("a.npz", ""),
        ("a.vti", "a\"b"),
        ("a.h5", "a/b"),
        ("a.vtk", "a b"),
        ("a.mat", "1a"),
    ] {
        let path = folder.path().join(file);
        let error = write(&path, &volume, name).unwrap_err().to_string();
        assert!(error.contains(&format!("'{name}' as ")), "{error}");
        assert!(!path.exists());
    }
    let error = write(&folder.path().join("a.vdb"), &volume, "a").unwrap_err();
    assert!(error.to_string().contains("volumes are .vol"), "{error}");
}

/// Linear values stay linear, up to the outermost samples.
#[test]
fn resampled_linear_values() {
    let linear = |p: DVec3| 1.0 + 2.0 * p.x - 3.0 * p.y + 0.5 * p.z;
    let positions = |frame: VolumeFrame, [nx, ny, nz]: [usize; 3]| {
        let at =
            move |i: usize| DVec3::new((i % nx) as f64, (i / nx % ny) as f64, (i / nx / ny) as f64);
        (0..nx * ny * nz).map(move |i| frame.first + frame.steps * at(i))
    };
    let size = [4, 5, 3];
    for nodes in [false, true] {
        let frame = place(nodes);
        let values = positions(frame, size).map(linear).collect();
        let volume = Volume::<f64>::new(size, 1, values)
            .unwrap()
            .with_frame(frame);
        let last = frame.first + frame.steps * DVec3::new(3.0, 4.0, 2.0);
        for new in [[4, 5, 3], [7, 9, 5], [2, 3, 2], [1, 1, 1], [16, 16, 16]] {
            let resampled = volume.resampled(new).unwrap();
            let frame = resampled.frame().unwrap();
            let (old_box, new_box) = (volume.place().to_file(size), frame.to_file(new));
            if !nodes || !new.contains(&1) {
                assert!(
                    old_box.abs_diff_eq(new_box, 1e-12),
                    "{new:?} {old_box} {new_box}"
                );
            }
            for (position, value) in positions(frame, new).zip(resampled.data()) {
                let expected = linear(position.clamp(place(nodes).first, last));
                assert!(
                    (value - expected).abs() < 1e-12,
                    "{nodes} {new:?} {position}"
                );
            }
        }
    }
}

#[test]
fn the_same_size_gives_the_same_values() {
    let values = (0..2 * 105).map(|i| (f64::from(i) * 0.7).sin()).collect();
    let volume = Volume::<f64>::new([3, 5, 7], 2, values).unwrap();
    assert_eq!(volume.resampled([3, 5, 7]).unwrap(), volume);
    for nodes in [false, true] {
        let volume = volume.clone().with_frame(place(nodes));
        assert_eq!(volume.resampled([3, 5, 7]).unwrap(), volume);
    }
    assert!(volume.resampled([0, 1, 1]).is_err());
    let error = volume.resampled([1 << 19; 3]).unwrap_err().to_string();
    assert_eq!(
        error,
        "too large: no memory for 524288 x 524288 x 524288 voxels"
    );
}

#[test]
fn scaled_integers() {
    let volume = sample(Element::U8, 1).with_frame(place(true));
    let scaled = volume.clone().scaled(0.5, -1.0).unwrap();
    let expected = volume.data().iter().map(|v| 0.5 * v - 1.0);
    assert!(scaled.data().iter().copied().eq(expected));
    assert_eq!(
        (scaled.element(), scaled.frame()),
        (Element::F32, volume.frame())
    );
    assert!(volume.scaled(1e308, 0.0).is_err());
}
