//! Volumes: round trips, axis order, and refused files.

use std::path::{Path, PathBuf};

use glam::DVec3;
use morgana_io::element::Element;
use morgana_io::volume::{AxisOrder, Options, Volume, npy, vol};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name)
}

/// A volume whose value encodes its position: x + 10 y + 100 z + 1000 channel.
fn sample(size: [usize; 3], channels: usize) -> Volume {
    let [nx, ny, nz] = size;
    let mut data = Vec::new();
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                data.extend((0..channels).map(|c| (x + 10 * y + 100 * z + 1000 * c) as f32));
            }
        }
    }
    let volume = Volume::new(size, channels, data).unwrap();
    volume.with_bbox([DVec3::splat(-1.0), DVec3::new(1.0, 2.0, 3.0)])
}

fn vol_bytes(version: u8, encoding: i32, sizes: [i32; 4], values: &[f32]) -> Vec<u8> {
    let mut bytes = b"VOL".to_vec();
    bytes.push(version);
    bytes.extend(encoding.to_le_bytes());
    bytes.extend(sizes.iter().flat_map(|n| n.to_le_bytes()));
    bytes.extend(
        [0f32, 0.0, 0.0, 1.0, 1.0, 1.0]
            .iter()
            .flat_map(|v| v.to_le_bytes()),
    );
    bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    bytes
}

/// An array of version 1 as NumPy writes it.
fn npy_bytes(descr: &str, fortran: bool, shape: &str, data: &[u8]) -> Vec<u8> {
    let fortran = if fortran { "True" } else { "False" };
    let mut header =
        format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}");
    while (header.len() + 11) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

fn f32s(values: impl IntoIterator<Item = f32>) -> Vec<u8> {
    values.into_iter().flat_map(f32::to_le_bytes).collect()
}

#[track_caller]
fn vol_error(bytes: &[u8], expected: &str) {
    assert_eq!(vol::parse::<f32>(bytes).unwrap_err().to_string(), expected);
}

#[track_caller]
fn npy_error(bytes: &[u8], expected: &str) {
    assert_eq!(
        npy::parse::<f32>(bytes, Options::order(AxisOrder::ZYX))
            .unwrap_err()
            .to_string(),
        expected
    );
}

#[test]
fn the_reference_volume() {
    let volume = Volume::<f32>::read(&data("p5_sigma_t.vol"), Options::default()).unwrap();
    assert_eq!((volume.size(), volume.channels()), ([16; 3], 1));
    // The values follow a formula of the position of the voxel's centre.
    let centre = |i: usize| 2.0 * (i as f64 + 0.5) / 16.0 - 1.0;
    for (i, value) in volume.data().iter().enumerate() {
        let (x, y, z) = (centre(i % 16), centre(i / 16 % 16), centre(i / 256));
        let waves = (5.0 * x + 1.0).sin() * (4.0 * y).sin() * (6.0 * z + 0.5).sin();
        let blob = 6.0 * (-3.0 * ((x - 0.1).powi(2) + (y + 0.2).powi(2) + z * z)).exp();
        let expected = blob * (1.0 + 0.5 * x) * (0.6 + 0.4 * waves) + 0.2;
        assert!(
            (f64::from(*value) - expected).abs() < 1e-5,
            "{x} {y} {z}: {value}, {expected}"
        );
    }
}

#[test]
fn a_vol_file_round_trips() {
    let folder = tempfile::tempdir().unwrap();
    for channels in [1, 3] {
        let volume = sample([2, 3, 4], channels);
        let path = folder.path().join("a.vol");
        vol::write(&path, &volume).unwrap();
        assert_eq!(vol::read(&path).unwrap(), volume);
    }
    let copy = folder.path().join("copy.vol");
    vol::write(&copy, &vol::read::<f32>(&data("p5_sigma_t.vol")).unwrap()).unwrap();
    assert_eq!(
        std::fs::read(&copy).unwrap(),
        std::fs::read(data("p5_sigma_t.vol")).unwrap()
    );
}

#[test]
fn an_npy_file_round_trips() {
    let folder = tempfile::tempdir().unwrap();
    for channels in [1, 3] {
        let volume = sample([2, 3, 4], channels);
        let path = folder.path().join("a.npy");
        npy::write(&path, &volume).unwrap();
        let read = Volume::<f32>::read(&path, Options::order(AxisOrder::ZYX)).unwrap();
        assert_eq!((read.size(), read.data()), (volume.size(), volume.data()));
        assert_eq!(read.bbox(), None);
    }
}

#[test]
fn the_same_array_in_every_layout() {
    let expected = sample([2, 3, 4], 1);
    let value = |x: usize, y: usize, z: usize| (x + 10 * y + 100 * z) as f32;
    let range = |n: usize| 0..n;
    // Values with z outermost and x innermost, and the reverse.
    let x_fastest: Vec<f32> = range(4)
        .flat_map(|z| range(3).flat_map(move |y| range(2).map(move |x| value(x, y, z))))
        .collect();
    let z_fastest: Vec<f32> = range(2)
        .flat_map(|x| range(3).flat_map(move |y| range(4).map(move |z| value(x, y, z))))
        .collect();
    for (shape, fortran, values, axes) in [
        ("(4, 3, 2)", false, &x_fastest, AxisOrder::ZYX),
        ("(4, 3, 2)", true, &z_fastest, AxisOrder::ZYX),
        ("(2, 3, 4)", false, &z_fastest, AxisOrder::XYZ),
        ("(2, 3, 4)", true, &x_fastest, AxisOrder::XYZ),
        ("(2, 3, 4, 1)", true, &x_fastest, AxisOrder::XYZ),
    ] {
        let mut encodings = vec![("<f4", f32s(values.iter().copied()))];
        encodings.push((">f4", values.iter().flat_map(|v| v.to_be_bytes()).collect()));
        encodings.push((
            "<f8",
            values
                .iter()
                .flat_map(|v| f64::from(*v).to_le_bytes())
                .collect(),
        ));
        encodings.push((
            ">f8",
            values
                .iter()
                .flat_map(|v| f64::from(*v).to_be_bytes())
                .collect(),
        ));
        for (descr, bytes) in encodings {
            let volume = npy::parse::<f32>(
                &npy_bytes(descr, fortran, shape, &bytes),
                Options::order(axes),
            )
            .unwrap();
            assert_eq!(volume.size(), [2, 3, 4]);
            assert_eq!(
                volume.data(),
                expected.data(),
                "{descr} {shape} {fortran} {axes:?}"
            );
        }
    }
}

#[test]
fn channels_of_a_fortran_array() {
    // [z, y, x, channel] = (1, 1, 2, 2) with the first axis fastest: both voxels of channel 0 first.
    let bytes = npy_bytes(
        "<f4",
        true,
        "(1, 1, 2, 2)",
        &f32s([0.0, 1.0, 1000.0, 1001.0]),
    );
    let volume = npy::parse::<f32>(&bytes, Options::order(AxisOrder::ZYX)).unwrap();
    assert_eq!(volume.data(), [0.0, 1000.0, 1.0, 1001.0]);
}

/// Reads any order of the axes, with the channels anywhere; compares with written-out indices.
#[test]
fn every_order_of_axes() {
    let lengths = |letter| match letter {
        'x' => 2,
        'y' => 3,
        'z' => 4,
        _ => 2,
    };
    for order in ["zyx", "xyz", "yxz", "zxy", "czyx", "zcyx", "xycz", "yxzc"] {
        let axes: Vec<char> = order.chars().collect();
        let shape: Vec<usize> = axes.iter().map(|a| lengths(*a)).collect();
        for fortran in [false, true] {
            let count: usize = shape.iter().product();
            let values = (0..count).map(|i| {
                // The index along each axis, the fastest first.
                let mut rest = i;
                let mut at = std::collections::HashMap::new();
                let mut fastest: Vec<usize> = (0..axes.len()).collect();
                if !fortran {
                    fastest.reverse();
                }
                for axis in fastest {
                    at.insert(axes[axis], rest % shape[axis]);
                    rest /= shape[axis];
                }
                let at = |axis| *at.get(&axis).unwrap_or(&0) as f32;
                at('x') + 10.0 * at('y') + 100.0 * at('z') + 1000.0 * at('c')
            });
            let text = format!(
                "({})",
                shape.iter().map(|n| format!("{n},")).collect::<String>()
            );
            let bytes = npy_bytes("<f4", fortran, &text, &f32s(values));
            let options = Options::order(order.parse().unwrap());
            let volume = npy::parse::<f32>(&bytes, options).unwrap();
            let channels = if axes.len() == 4 { 2 } else { 1 };
            assert_eq!(
                volume.data(),
                sample([2, 3, 4], channels).data(),
                "{order} {fortran}"
            );
        }
    }
    for bad in ["", "xy", "xxz", "xyzz", "xyzcc", "abc"] {
        assert!(bad.parse::<AxisOrder>().is_err(), "{bad}");
    }
}

#[test]
fn an_order_of_axes_is_never_guessed() {
    let bytes = npy_bytes("<f4", false, "(1, 1, 1)", &f32s([1.0]));
    let error = npy::parse::<f32>(&bytes, Options::default()).unwrap_err();
    assert!(
        error.to_string().contains("give the order of its axes"),
        "{error}"
    );
    let czyx = Options::order("czyx".parse().unwrap());
    let error = npy::parse::<f32>(&bytes, czyx).unwrap_err().to_string();
    assert_eq!(
        error,
        "expected an array of 4 axes (czyx), found an array of shape [1, 1, 1]"
    );
}

/// Half precision and bytes; the format maps 0 to 255 to 0 to 1.
#[test]
fn encodings_of_vol() {
    let head = |encoding| vol_bytes(3, encoding, [2, 1, 1, 1], &[]);
    // 1 and −2 in half precision are 0x3c00 and 0xc000.
    let half = [&head(2)[..], &[0x00, 0x3c, 0x00, 0xc0]].concat();
    let volume = vol::parse::<f32>(&half).unwrap();
    assert_eq!(volume.data(), [1.0, -2.0]);
    assert_eq!(volume.element(), Element::F16);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("half.vol");
    vol::write(&path, &volume.with_bbox([DVec3::ZERO, DVec3::ONE])).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), half);
    let bytes = [&head(3)[..], &[255, 51]].concat();
    assert_eq!(vol::parse::<f32>(&bytes).unwrap().data(), [1.0, 0.2]);
    vol_error(&bytes[..49], "truncated: expected 50 bytes, found 49");
}

#[test]
fn vol_files_that_are_refused() {
    let good = vol_bytes(3, 1, [2, 1, 1, 1], &[1.0, 2.0]);
    assert!(vol::parse::<f32>(&good).is_ok());
    vol_error(b"PNG", "not a VOL file: it does not begin with 'VOL'");
    vol_error(b"", "not a VOL file: it does not begin with 'VOL'");
    vol_error(&good[..20], "truncated: expected 48 bytes, found 20");
    vol_error(&good[..52], "truncated: expected 56 bytes, found 52");
    vol_error(
        &[&good[..], &[0; 3]].concat(),
        "3 unexpected bytes after the data: check the sizes in the header, or copy the file again",
    );
    vol_error(
        &vol_bytes(2, 1, [1; 4], &[1.0]),
        "not supported: VOL version 2",
    );
    vol_error(
        &vol_bytes(3, 4, [1; 4], &[1.0]),
        "not supported: VOL encoding 4, directions; a volume needs numbers (encodings 1, 2, 3)",
    );
    vol_error(
        &vol_bytes(3, 9, [1; 4], &[1.0]),
        "not supported: VOL encoding 9; known are 1 (float32), 2 (float16) and 3 (uint8)",
    );
    vol_error(
        &vol_bytes(3, 1, [0, 1, 1, 1], &[]),
        "empty: 0 x 1 x 1 voxels with 1 channels",
    );
    vol_error(
        &vol_bytes(3, 1, [-2, 1, 1, 1], &[]),
        "a size of -2 in the header",
    );
    let huge = i32::MAX;
    vol_error(
        &vol_bytes(3, 1, [huge; 4], &[]),
        "too large: 2147483647 x 2147483647 x 2147483647 voxels with 2147483647 channels",
    );
    vol_error(
        &vol_bytes(3, 1, [huge, 1000, 1, 1], &[1.0]),
        "truncated: expected 8589934588048 bytes, found 52",
    );
    vol_error(
        &vol_bytes(3, 1, [2, 2, 1, 1], &[1.0, 2.0, 3.0, f32::NAN]),
        "value NaN at voxel (1, 1, 0) is not finite",
    );
    vol_error(
        &vol_bytes(3, 1, [1, 1, 2, 2], &[1.0, 2.0, 3.0, f32::INFINITY]),
        "value inf at voxel (0, 0, 1), channel 1 is not finite",
    );
}

#[test]
fn npy_files_that_are_refused() {
    let one = f32s([1.0]);
    let file = |descr, shape| npy_bytes(descr, false, shape, &one);
    assert!(npy::parse::<f32>(&file("<f4", "(1, 1, 1)"), Options::order(AxisOrder::ZYX)).is_ok());
    npy_error(
        b"VOL and more",
        "not a NPY file: it does not begin with the magic bytes",
    );
    npy_error(b"\x93NUMPY", "truncated: expected 10 bytes, found 6");
    npy_error(
        b"\x93NUMPY\x01\x00\x76\x00{",
        "truncated: expected 128 bytes, found 11",
    );
    npy_error(
        b"\x93NUMPY\x09\x00\x76\x00{",
        "not supported: NPY version 9",
    );
    npy_error(
        b"\x93NUMPY\x02\x00\xff\xff\xff\xff",
        "too large: a header of 4294967295 bytes",
    );
    npy_error(
        &file("<U1", "(1, 1, 1)"),
        "expected elements that are integers, floating-point or complex numbers, found '<U1'",
    );
    npy_error(
        &file("<f4", "(1, 1)"),
        "expected an array of 3 axes, or 4 with the channels last, found an array of shape [1, 1]",
    );
    npy_error(
        &file("<f4", "(2, 1, 1)"),
        "truncated: expected 136 bytes, found 132",
    );
    npy_error(
        &npy_bytes("<f4", false, "(0, 1, 1)", &[]),
        "empty: 1 x 1 x 0 voxels with 1 channels",
    );
    npy_error(
        &file("<f4", "(99999999999, 99999999999, 1)"),
        "too large: 1 x 99999999999 x 99999999999 voxels with 1 channels",
    );
    npy_error(
        &file("<f4", "(99999999999999999999999, 1, 1)"),
        "too large: an axis of length 99999999999999999999999",
    );
    let axes = format!("({})", "1, ".repeat(40));
    npy_error(&file("<f4", &axes), "too large: more than 32 axes");
    npy_error(
        &file("<f4", "(a, 1, 1)"),
        "not a NPY file: 'shape' in its header holds something other than numbers",
    );
    npy_error(
        &file("<f4', 'x': '", "(1, 1, 1)"),
        "not a NPY file: unknown entry 'x' in its header",
    );
    npy_error(
        &npy_bytes("<f8", false, "(1, 1, 1)", &1e300f64.to_le_bytes()),
        "value inf at voxel (0, 0, 0) is not finite",
    );
}

#[test]
fn a_missing_file_is_named() {
    for name in ["no/such.vol", "no/such.npy"] {
        let error = Volume::<f32>::read(Path::new(name), Options::default())
            .unwrap_err()
            .to_string();
        assert!(
            error.starts_with(&format!("{name}: cannot read: No such file")),
            "{error}"
        );
    }
    let error = Volume::<f32>::read(Path::new("a.png"), Options::default())
        .unwrap_err()
        .to_string();
    assert_eq!(
        error,
        "a.png: not supported: volumes are .vol, .npy, .npz, .h5, .hdf5, .mat, .nrrd, .nhdr, .vti, .vtk, .nii, .nii.gz, .jnii, .bnii, .jdt and \
         .jdb, and .vdb to read; meshes (.vtu, .vtr, .vts, .vtm, .foam, .cgns) are resampled by python -m morgana.flow"
    );
}

#[test]
fn a_volume_must_fit_its_data() {
    let error = Volume::new([2, 2, 2], 1, vec![0.0; 7])
        .unwrap_err()
        .to_string();
    assert_eq!(
        error,
        "expected 2 x 2 x 2 voxels with 1 channels, found 7 values"
    );
}
