//! Files that state or expand to far more than their size. With a memory limit of zero, no reader
//! takes more than ten times the file and 64 MiB, and none runs for long. With a limit that allows
//! the stated size, valid files are read.
//!
//! This file has a single test, because the allocator counts the memory of the whole program. Small
//! files are in data/hostile (its `make.py`); the test makes the others.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use flate2::Crc;
use flate2::read::{GzEncoder, ZlibEncoder};
use morgana_io::arrays::Arrays;
use morgana_io::image::{exr, png};
use morgana_io::mesh::{gltf, obj, ply, serialized};
use morgana_io::volume::{AxisOrder, Options, Volume, hdf5, mat, npz, nrrd, vdb, vti};
use morgana_io::{Limits, ies};
use peak_alloc::PeakAlloc;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Memory in bytes that a file may take beyond ten times its size, with a margin for messages and
/// tables.
const EXTRA: usize = (64 << 20) + (1 << 20);
/// Longest time of a reader. None takes a hundredth of it on a quiet machine.
const TIME_LIMIT: Duration = Duration::from_secs(20);
/// Side of a cube of single-precision zeros that takes more than [`EXTRA`].
const SIDE: usize = 272;

/// Success, or the reason why a file is refused.
type Outcome = Result<(), String>;

fn hostile(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data/hostile")
        .join(name)
}

fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(hostile(name)).unwrap()
}

/// Reads within bounds. Returns the result.
#[track_caller]
fn bounded(size: usize, read: impl FnOnce() -> Outcome) -> Outcome {
    ALLOCATOR.reset_peak_usage();
    let (before, started) = (ALLOCATOR.current_usage(), Instant::now());
    let outcome = read();
    let peak = ALLOCATOR.peak_usage().saturating_sub(before);
    assert!(
        peak <= 10 * size + EXTRA,
        "{peak} bytes of {size}: {outcome:?}"
    );
    assert!(started.elapsed() < TIME_LIMIT, "{:?}", started.elapsed());
    outcome
}

/// A reader of files in memory.
type Reader = fn(&[u8], Limits) -> Outcome;

/// Asserts that a reader refuses a file with these words, within bounds.
#[track_caller]
fn refused(file: &[u8], words: &str, read: Reader) {
    let error = bounded(file.len(), || read(file, Limits::of(0))).unwrap_err();
    assert!(error.contains(words), "{error}");
}

/// Asserts that a reader refuses a valid file unless the limit allows the size that it states.
#[track_caller]
fn limited(file: &[u8], read: Reader) {
    refused(file, "more than the limit of", read);
    read(file, Limits::of(1 << 30)).unwrap();
}

fn outcome<T>(result: Result<T, morgana_io::Problem>) -> Outcome {
    result.map(drop).map_err(|e| e.to_string())
}

fn volume(result: Result<Volume, morgana_io::Problem>) -> Outcome {
    outcome(result)
}

fn zyx(limits: Limits) -> Options<'static> {
    Options::order(AxisOrder::ZYX).within(limits)
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut packed = Vec::new();
    let mut encoder = ZlibEncoder::new(bytes, flate2::Compression::fast());
    encoder.read_to_end(&mut packed).unwrap();
    packed
}

fn zeros() -> Vec<u8> {
    vec![0; 4 * SIDE * SIDE * SIDE]
}

fn npz_file() -> Vec<u8> {
    let mut archive = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default();
    archive.start_file("a.npy", options).unwrap();
    let header = format!(
        "{{'descr': '<f4', 'fortran_order': False, 'shape': ({SIDE}, {SIDE}, {SIDE}), }}\n"
    );
    archive.write_all(b"\x93NUMPY\x01\x00").unwrap();
    archive
        .write_all(&(header.len() as u16).to_le_bytes())
        .unwrap();
    archive.write_all(header.as_bytes()).unwrap();
    archive.write_all(&zeros()).unwrap();
    archive.finish().unwrap().into_inner()
}

fn nrrd_file() -> Vec<u8> {
    let mut file = format!(
        "NRRD0004\ntype: float\ndimension: 3\nsizes: {SIDE} {SIDE} {SIDE}\nendian: little\nencoding: gzip\n\n"
    )
    .into_bytes();
    let data = zeros();
    let mut encoder = GzEncoder::new(&data[..], flate2::Compression::fast());
    encoder.read_to_end(&mut file).unwrap();
    file
}

fn vti_file() -> Vec<u8> {
    let last = SIDE - 1;
    let extent = format!("0 {last} 0 {last} 0 {last}");
    let mut file = format!(
        "<VTKFile type=\"ImageData\" byte_order=\"LittleEndian\" compressor=\"vtkZLibDataCompressor\">\
         <ImageData WholeExtent=\"{extent}\"><Piece Extent=\"{extent}\"><PointData>\
         <DataArray type=\"Float32\" format=\"appended\" offset=\"0\"/>\
         </PointData></Piece></ImageData><AppendedData encoding=\"raw\">_"
    )
    .into_bytes();
    let (data, whole) = (zlib(&zeros()), 4 * SIDE * SIDE * SIDE);
    for n in [1, whole, 0, data.len()] {
        file.extend((n as u32).to_le_bytes());
    }
    file.extend(data);
    file
}

fn mat_file() -> Vec<u8> {
    let small = |kind: u32, words: &[u32]| {
        let size = 4 * words.len() as u32;
        let mut bytes: Vec<u8> = [&[kind, size], words]
            .concat()
            .iter()
            .flat_map(|n| n.to_le_bytes())
            .collect();
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        bytes
    };
    let data = zeros();
    let mut array = Vec::new();
    array.extend(small(6, &[7, 0]));
    array.extend(small(5, &[SIDE as u32; 3]));
    array.extend([1, 0, 1, 0, b'a', 0, 0, 0]);
    array.extend(
        [7u32, data.len() as u32]
            .iter()
            .flat_map(|n| n.to_le_bytes()),
    );
    array.extend(data);
    let mut whole: Vec<u8> = [14, array.len() as u32]
        .iter()
        .flat_map(|n: &u32| n.to_le_bytes())
        .collect();
    whole.extend(array);
    let packed = zlib(&whole);
    let mut file = vec![b' '; 124];
    file.extend([0, 1, b'I', b'M', 15, 0, 0, 0]);
    file.extend((packed.len() as u32).to_le_bytes());
    file.extend(packed);
    file
}

fn serialized_file() -> Vec<u8> {
    const VERTICES: u64 = 4_000_000;
    let mut mesh = vec![0, 0, 0, 0, b'a', 0];
    mesh.extend(VERTICES.to_le_bytes());
    mesh.extend(1u64.to_le_bytes());
    mesh.resize(mesh.len() + 12 * VERTICES as usize, 0);
    mesh.extend([0, 1, 2].iter().flat_map(|n: &u32| n.to_le_bytes()));
    let mut file = vec![0x1c, 4, 4, 0];
    file.extend(zlib(&mesh));
    file.extend(0u64.to_le_bytes());
    file.extend(1u32.to_le_bytes());
    file
}

/// An image of one bit per pixel.
fn png_file() -> Vec<u8> {
    const EDGE: u32 = 4096;
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut chunk = |name: &[u8], data: &[u8]| {
        let body = [name, data].concat();
        let mut crc = Crc::new();
        crc.update(&body);
        file.extend((data.len() as u32).to_be_bytes());
        file.extend(body);
        file.extend(crc.sum().to_be_bytes());
    };
    let size = [EDGE.to_be_bytes(), EDGE.to_be_bytes()].concat();
    chunk(b"IHDR", &[&size[..], &[1, 0, 0, 0, 0]].concat());
    chunk(b"IDAT", &zlib(&vec![0; (EDGE * (EDGE / 8 + 1)) as usize]));
    chunk(b"IEND", &[]);
    file
}

fn exr_file() -> Vec<u8> {
    let image = morgana_io::image::ImageLayers {
        width: 4096,
        height: 4096,
        layers: vec![morgana_io::image::Layer {
            name: String::new(),
            channels: vec![("Y".into(), vec![0.0; 1 << 24])],
        }],
        attributes: Vec::new(),
    };
    exr::encode(&image).unwrap()
}

fn compressed() {
    limited(&npz_file(), |file, limits| {
        volume(npz::parse(file, zyx(limits)))
    });
    limited(&nrrd_file(), |file, limits| {
        volume(nrrd::parse(file, zyx(limits)))
    });
    limited(&vti_file(), |file, limits| {
        volume(vti::parse(file, Options::default().within(limits)))
    });
    limited(&mat_file(), |file, limits| {
        volume(mat::parse(file, zyx(limits)))
    });
    limited(&serialized_file(), |file, limits| {
        outcome(serialized::parse(file, 0, limits))
    });
    limited(&png_file(), |file, limits| {
        outcome(png::decode_within(file, limits))
    });
    limited(&exr_file(), |file, limits| {
        outcome(exr::decode_within(file, limits))
    });
    // The file stores no data at all: even a limit that allows its size does not make it valid.
    refused(
        &bytes("bomb.h5"),
        "more than the limit of",
        |file, limits| volume(hdf5::parse(file, zyx(limits).of("p"))),
    );
    refused(
        &bytes("bomb.h5"),
        "more than the limit of",
        |file, limits| {
            let path = tempfile::Builder::new().suffix(".h5").tempfile().unwrap();
            std::fs::write(path.path(), file).unwrap();
            outcome(Arrays::read(path.path(), limits).map_err(|error| error.problem))
        },
    );
}

fn grids_that_point_back() {
    let read: Reader = |file, limits| volume(vdb::parse(file, Options::default().within(limits)));
    refused(
        &bytes("back.vdb"),
        "a grid that ends before it begins",
        read,
    );
    refused(
        &bytes("loop.vdb"),
        "a grid that ends before it begins",
        read,
    );
    refused(&bytes("overlap.vdb"), "two nodes of its tree overlap", read);
    refused(&bytes("tile.vdb"), "spread over 4096 x 4096 x 4096", read);
}

fn meshes() {
    let read: Reader = |file, limits| outcome(gltf::parse(file, |_| Ok(Vec::new()), limits));
    refused(&bytes("nodes.gltf"), "more than the limit of", read);
    let values = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"a\":[{}0]}}",
        "0,".repeat(1 << 20)
    );
    refused(values.as_bytes(), "more than the limit of", read);
    // All buffers share the binary part, whatever their number.
    let text = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"buffers\":[{}{{}}]}}",
        "{},".repeat(2000)
    );
    let mut file = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    for (kind, data) in [(b"JSON", text.as_bytes()), (b"BIN\0", &vec![0; 1 << 20])] {
        file.extend((data.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(data);
    }
    refused(&file, "there is no number 0 among its 'scenes'", read);
    // A byte per corner.
    let mut file = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty uchar x\nproperty uchar y\n\
         property uchar z\nelement face 1\nproperty list uint uchar vertex_indices\nend_header\n\0\0\0\x01\0\0\0\x01\0"
        .to_vec();
    file.extend((16u32 << 20).to_le_bytes());
    file.resize(file.len() + (16 << 20), 0);
    refused(&file, "more than the limit of", |file, limits| {
        outcome(ply::parse(file, limits).map_err(|(problem, _)| problem))
    });
    let read: Reader =
        |file, limits| outcome(obj::parse(file, limits).map_err(|(problem, _)| problem));
    let face = format!("v 0 0 0\nf {}", "1 ".repeat(8 << 20));
    bounded(face.len(), || read(face.as_bytes(), Limits::of(0))).unwrap();
    let mut corners = "v 0 0 0\n".repeat(999) + &"vt 0\n".repeat(999);
    for i in 1..1000 {
        for j in (1..900).step_by(3) {
            corners += &format!("f {i}/{j} {i}/{} {i}/{}\n", j + 1, j + 2);
        }
    }
    refused(corners.as_bytes(), "more memory than the limit", read);
}

/// Arrays of an archive that share their bytes.
fn overlapping_arrays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npz");
    let names: Vec<String> = (0..200).map(|i| format!("a{i:03}")).collect();
    let about: Vec<String> = names
        .iter()
        .map(|n| format!("\"{n}\":{{\"axes\":[\"x\"]}}"))
        .collect();
    let metadata = format!("{{\"arrays\":{{{}}}}}", about.join(","));
    let array = |shape: &str, kind: &str, data: &[u8]| {
        let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n");
        let length = (header.len() as u16).to_le_bytes();
        [&b"\x93NUMPY\x01\x00"[..], &length, header.as_bytes(), data].concat()
    };
    let letters: Vec<u8> = metadata
        .bytes()
        .flat_map(|b| u32::from(b).to_le_bytes())
        .collect();
    let members = [
        (
            "metadata.npy",
            array("()", &format!("<U{}", metadata.len()), &letters),
        ),
        ("a000.npy", array("(131072,)", "<f8", &vec![0; 1 << 20])),
    ];
    let mut archive = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (name, data) in &members {
        archive.start_file(*name, options).unwrap();
        archive.write_all(data).unwrap();
    }
    let file = archive.finish().unwrap().into_inner();
    // Repeat the last entry of the directory for each of the names.
    let end = file.len() - 22;
    let at = file.windows(4).rposition(|w| w == b"PK\x01\x02").unwrap();
    let mut bomb = file[..end].to_vec();
    for name in &names[1..] {
        let mut entry = file[at..end].to_vec();
        entry[46..50].copy_from_slice(name.as_bytes());
        bomb.extend(entry);
    }
    let mut last = file[end..].to_vec();
    let start = u32::from_le_bytes(last[16..20].try_into().unwrap());
    let count = (names.len() + 1) as u16;
    last[8..10].copy_from_slice(&count.to_le_bytes());
    last[10..12].copy_from_slice(&count.to_le_bytes());
    last[12..16].copy_from_slice(&((bomb.len() as u32) - start).to_le_bytes());
    bomb.extend(last);
    std::fs::write(&path, &bomb).unwrap();
    let error = bounded(bomb.len(), || {
        Arrays::read(&path, Limits::default())
            .map(drop)
            .map_err(|e| e.to_string())
    });
    assert!(error.clone().unwrap_err().contains("overlap"), "{error:?}");
}

fn photometry() {
    let text = format!(
        "TILT=NONE\n1 1 1 2 1000000 1 1 0 0 0 1 1 1 {}",
        "0 ".repeat(3_000_000)
    );
    refused(text.as_bytes(), "photometry of more than", |file, _| {
        outcome(ies::parse(file))
    });
}

#[test]
fn bombs_do_not_go_off() {
    grids_that_point_back();
    photometry();
    meshes();
    overlapping_arrays();
    compressed();
}
