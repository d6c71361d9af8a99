//! Sums over the frames of time series, from files of every supporting format and in every order of
//! axes, compared with sums computed here.

use hdf5_reader::{ByteOrder, Datatype};
use hdf5_writer::{DatasetBuilder, Hdf5Builder, Hdf5Writer, WriteOptions};
use morgana_io::Problem;
use morgana_io::volume::series::{FrameSums, Series, SeriesShape};
use morgana_io::volume::{self, AxisOrder, Options, Volume, npy};
use std::fs::{self, File};
use std::io::Write;
use std::path::Path;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// Numbers of samples along x, y, z, and of frames.
const SIZE: [usize; 4] = [2, 3, 4, 7];
const AXES: [char; 4] = ['x', 'y', 'z', 'c'];
/// Range of frames that count.
const USED: std::ops::Range<usize> = 2..6;

fn value([x, y, z, t]: [usize; 4]) -> f64 {
    ((1 + x + 3 * y + 10 * z) as f64).sin() + ((t * t) as f64) * (1 + x + y) as f64
}

/// Returns an array and its shape for an order of axes, slowest axis first.
fn array(order: [char; 4]) -> (Vec<f64>, Vec<usize>) {
    let of = |letter| AXES.iter().position(|axis| *axis == letter).unwrap();
    let axes = order.map(of);
    let shape = axes.map(|axis| SIZE[axis]);
    let at = |mut i: usize| {
        let mut index = [0; 4];
        for axis in axes.iter().rev() {
            index[*axis] = i % SIZE[*axis];
            i /= SIZE[*axis];
        }
        value(index)
    };
    let count: usize = shape.iter().product();
    ((0..count).map(at).collect(), shape.to_vec())
}

fn npy_bytes(numbers: &[f64], shape: &[usize], fortran: bool) -> Vec<u8> {
    let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
    let order = if fortran { "True" } else { "False" };
    let dictionary = format!(
        "{{'descr': '<f8', 'fortran_order': {order}, 'shape': ({}), }}",
        shape.join(", ")
    );
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((dictionary.len() as u16).to_le_bytes());
    bytes.extend(dictionary.as_bytes());
    bytes.extend(numbers.iter().flat_map(|v| v.to_le_bytes()));
    bytes
}

fn write_hdf5(path: &Path, numbers: &[f64], shape: &[usize], chunk: Option<[u64; 4]>) {
    let datatype = Datatype::FloatingPoint {
        size: 8,
        byte_order: ByteOrder::LittleEndian,
    };
    let shape: Vec<u64> = shape.iter().map(|n| *n as u64).collect();
    let bytes: Vec<u8> = numbers.iter().flat_map(|v| v.to_le_bytes()).collect();
    let mut dataset = DatasetBuilder::new("p", datatype, shape).raw_data(bytes);
    if let Some(chunk) = chunk {
        dataset = dataset.chunked(chunk);
    }
    let plan = Hdf5Builder::new().dataset(dataset).into_plan().unwrap();
    let writer = Hdf5Writer::new(File::create(path).unwrap(), WriteOptions::default());
    writer.finish(plan).unwrap();
}

/// Σp, Σtp and Σt²p.
fn plan(shape: SeriesShape) -> Result<FrameSums, Problem> {
    assert_eq!(shape.frames, SIZE[3]);
    Ok(FrameSums {
        used: USED,
        count: 3,
        weights: Box::new(|t| [1.0, t as f64, (t * t) as f64]),
    })
}

#[track_caller]
fn check(series: &Series, what: &str) {
    let [nx, ny, nz, _] = SIZE;
    assert_eq!(series.sums.size(), [nx, ny, nz], "{what}");
    let mut squares = 0.0;
    for (i, sums) in series.sums.data().chunks_exact(3).enumerate() {
        let [x, y, z] = [i % nx, i / nx % ny, i / nx / ny];
        for (power, sum) in (0..3).zip(sums) {
            let terms = USED.map(|t| (t as f64).powi(power) * value([x, y, z, t]));
            let expected: f64 = terms.sum();
            assert!(
                (sum - expected).abs() < 1e-11 * expected.abs(),
                "{what}: {i} {power}"
            );
        }
        squares += USED.map(|t| value([x, y, z, t]).powi(2)).sum::<f64>();
    }
    assert!((series.squares - squares).abs() < 1e-11 * squares, "{what}");
}

/// All orders of the four axes.
fn orders() -> Vec<[char; 4]> {
    let mut orders = Vec::new();
    for i in 0..256 {
        let order = [i / 64, i / 16 % 4, i / 4 % 4, i % 4].map(|k: usize| AXES[k]);
        if AXES.iter().all(|axis| order.contains(axis)) {
            orders.push(order);
        }
    }
    orders
}

#[test]
fn sums_of_every_order_of_axes() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    assert_eq!(orders().len(), 24);
    for order in orders() {
        let (numbers, shape) = array(order);
        let letters: String = order.iter().collect();
        let axes: AxisOrder = letters.parse().unwrap();
        fs::write(path("c.npy"), npy_bytes(&numbers, &shape, false)).unwrap();
        let mut archive = ZipWriter::new(File::create(path("deflated.npz")).unwrap());
        archive
            .start_file("p.npy", SimpleFileOptions::default())
            .unwrap();
        archive
            .write_all(&npy_bytes(&numbers, &shape, false))
            .unwrap();
        archive.finish().unwrap();
        write_hdf5(&path("whole.h5"), &numbers, &shape, None);
        write_hdf5(&path("chunked.h5"), &numbers, &shape, Some([2, 2, 3, 2]));
        for name in ["c.npy", "deflated.npz", "whole.h5", "chunked.h5"] {
            let options = Options::order(axes);
            let options = if name.ends_with(".npy") {
                options
            } else {
                options.of("p")
            };
            let series = Series::read(&path(name), options, &mut plan).unwrap();
            check(&series, &format!("{name} {letters}"));
        }
        // The first index is the fastest: list the axes in reverse.
        let reversed: String = order.iter().rev().collect();
        let options = Options::order(reversed.parse().unwrap());
        let shape: Vec<usize> = shape.into_iter().rev().collect();
        let fortran = npy_bytes(&numbers, &shape, true);
        check(
            &npy::parse_series(&fortran, options, &mut plan).unwrap(),
            &letters,
        );
    }
}

/// Formats that are read as a whole.
#[test]
fn sums_of_other_formats() {
    let (numbers, _) = array(['z', 'y', 'x', 'c']);
    let [x, y, z, frames] = SIZE;
    let volume = Volume::<f64>::new([x, y, z], frames, numbers).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for name in ["p.mat", "p.nrrd", "p.vti"] {
        let path = folder.path().join(name);
        volume::write(&path, &volume, "p").unwrap();
        let axes = (name == "p.mat").then_some(AxisOrder::XYZ);
        let options = Options {
            axes,
            ..Options::default()
        };
        check(&Series::read(&path, options, &mut plan).unwrap(), name);
    }
}

/// Values that are not finite are refused within the used frames.
#[test]
fn values_that_are_not_finite() {
    let order = ['c', 'z', 'y', 'x'];
    let options = Options::order("czyx".parse().unwrap());
    let sums = |frame: usize| {
        let (mut numbers, shape) = array(order);
        numbers[frame * 24 + 6 * 3 + 2 * 2 + 1] = f64::NAN;
        npy::parse_series(&npy_bytes(&numbers, &shape, false), options, &mut plan)
    };
    check(&sums(1).unwrap(), "before the frames that count");
    check(&sums(6).unwrap(), "after them");
    let message = sums(3).unwrap_err().to_string();
    assert!(message.contains("voxel (1, 2, 3), channel 3"), "{message}");
}
