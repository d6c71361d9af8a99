//! Mitsuba's serialized meshes, versions 3 and 4: several meshes, each compressed by zlib, with a table of where
//! they begin at the end of the file.

use std::fs;
use std::io::Read;
use std::path::Path;

use flate2::read::ZlibDecoder;
use glam::DVec3;

use super::MeshData;
use super::build::{check_mesh, check_position};
use crate::error::{FileError, Problem};

/// The first two bytes of every mesh.
const MAGIC: u16 = 0x041c;
/// Longest name of a mesh.
const LONGEST_NAME: usize = 1 << 16;

/// What a mesh holds besides positions and triangles.
const NORMALS: u32 = 0x0001;
const UVS: u32 = 0x0002;
const COLOURS: u32 = 0x0008;
const DOUBLE: u32 = 0x2000;

/// Reads one of the meshes of a file.
///
/// # Errors
///
/// A file that cannot be read, is no serialized mesh of these versions, has no mesh of this number, ends
/// early, or has positions that are not finite or indices out of range.
pub fn read(path: &Path, index: usize) -> Result<MeshData, FileError> {
    let bytes = fs::read(path).map_err(|e| Problem::Read(e).at(path))?;
    parse(&bytes, index).map_err(|problem| problem.at(path))
}

/// Reads one of the meshes from the bytes of a file.
///
/// # Errors
///
/// As for [`read`].
pub fn parse(bytes: &[u8], index: usize) -> Result<MeshData, Problem> {
    let version = version(bytes)?;
    let offset = offset(bytes, version, index)?;
    let mesh = bytes.get(offset..).unwrap_or(&[]);
    self::version(mesh)?;
    Reader {
        stream: ZlibDecoder::new(&mesh[4..]),
    }
    .mesh(version)
}

fn wrong(reason: impl Into<String>) -> Problem {
    Problem::WrongFormat {
        format: "serialized mesh",
        reason: reason.into(),
    }
}

fn version(bytes: &[u8]) -> Result<u16, Problem> {
    let Some([a, b, c, d]) = bytes.first_chunk::<4>() else {
        return Err(wrong("too short"));
    };
    match (u16::from_le_bytes([*a, *b]), u16::from_le_bytes([*c, *d])) {
        (MAGIC, version @ 3..=4) => Ok(version),
        (MAGIC, other) => Err(Problem::Unsupported(format!("version {other}"))),
        _ => Err(wrong("it does not begin with 1c 04")),
    }
}

/// Where a mesh begins, by the table at the end of the file.
fn offset(bytes: &[u8], version: u16, index: usize) -> Result<usize, Problem> {
    let Some(count) = bytes.last_chunk::<4>() else {
        return Err(wrong("too short"));
    };
    let count = u32::from_le_bytes(*count) as usize;
    if index >= count {
        let message = format!("there is no mesh {index}: the file has {count}, from 0 on");
        return Err(Problem::Malformed(message));
    }
    let width = if version == 3 { 4 } else { 8 };
    let entry = (count - index)
        .checked_mul(width)
        .and_then(|before_end| bytes.len().checked_sub(4 + before_end))
        .and_then(|start| bytes.get(start..start + width));
    let entry = entry.ok_or_else(|| wrong("its table of meshes is cut off"))?;
    let value = entry.iter().rev().fold(0, |v, b| v << 8 | u64::from(*b));
    usize::try_from(value)
        .ok()
        .filter(|start| *start < bytes.len())
        .ok_or_else(|| wrong("a mesh begins beyond the end of the file"))
}

struct Reader<'b> {
    stream: ZlibDecoder<&'b [u8]>,
}

impl Reader<'_> {
    fn mesh(&mut self, version: u16) -> Result<MeshData, Problem> {
        let flags = u32::from_le_bytes(self.chunk()?);
        if version == 4 {
            self.pass_name()?;
        }
        let vertices = u64::from_le_bytes(self.chunk()?);
        let triangles = u64::from_le_bytes(self.chunk()?);
        if vertices > u64::from(u32::MAX) {
            return Err(Problem::TooLarge("more than 2^32 vertices".into()));
        }
        let mut numbers = |per_vertex: u64| -> Result<Vec<f64>, Problem> {
            match flags & DOUBLE {
                0 => {
                    let bytes = self.bytes(vertices, 4 * per_vertex)?;
                    let (values, _) = bytes.as_chunks::<4>();
                    Ok(values
                        .iter()
                        .map(|b| f32::from_le_bytes(*b).into())
                        .collect())
                }
                _ => {
                    let bytes = self.bytes(vertices, 8 * per_vertex)?;
                    let (values, _) = bytes.as_chunks::<8>();
                    Ok(values.iter().map(|b| f64::from_le_bytes(*b)).collect())
                }
            }
        };
        let positions = numbers(3)?;
        if flags & NORMALS != 0 {
            numbers(3)?;
        }
        let uvs = (flags & UVS != 0).then(|| numbers(2)).transpose()?;
        let colours = (flags & COLOURS != 0).then(|| numbers(3)).transpose()?;
        let indices = self.bytes(triangles, 12)?;
        let (indices, _) = indices.as_chunks::<4>();
        let triples = |values: &[f64]| -> Vec<[f64; 3]> { values.as_chunks::<3>().0.to_vec() };
        let position = |(i, p): (usize, [f64; 3])| check_position(DVec3::from_array(p), i);
        let positions = triples(&positions).into_iter().enumerate().map(position);
        check_mesh(MeshData {
            positions: positions.collect::<Result<_, _>>()?,
            triangles: corners(indices, vertices)?,
            uvs: uvs.map(|values| values.as_chunks::<2>().0.to_vec()),
            colours: colours.map(|values| {
                let single = |c: [f64; 3]| c.map(|v| v as f32);
                triples(&values).into_iter().map(single).collect()
            }),
        })
    }

    fn pass_name(&mut self) -> Result<(), Problem> {
        for _ in 0..LONGEST_NAME {
            if self.chunk()? == [0] {
                return Ok(());
            }
        }
        Err(wrong("the mesh's name has no end"))
    }

    fn chunk<const N: usize>(&mut self) -> Result<[u8; N], Problem> {
        let mut chunk = [0; N];
        let read = self.stream.read_exact(&mut chunk);
        read.map_err(|e| wrong(format!("its compressed data: {e}")))?;
        Ok(chunk)
    }

    /// The bytes of so many things; memory is taken as they arrive.
    fn bytes(&mut self, count: u64, each: u64) -> Result<Vec<u8>, Problem> {
        let expected = count
            .checked_mul(each)
            .ok_or_else(|| Problem::TooLarge(format!("{count} elements")))?;
        let mut bytes = Vec::new();
        let read = (&mut self.stream).take(expected).read_to_end(&mut bytes);
        read.map_err(|e| wrong(format!("its compressed data: {e}")))?;
        match bytes.len() as u64 {
            found if found < expected => Err(Problem::Truncated { expected, found }),
            _ => Ok(bytes),
        }
    }
}

/// Triangles from the numbers of their corners.
fn corners(indices: &[[u8; 4]], vertices: u64) -> Result<Vec<[u32; 3]>, Problem> {
    let (triangles, _) = indices.as_chunks::<3>();
    let corner = |bytes: &[u8; 4]| u32::from_le_bytes(*bytes);
    let triangles: Vec<[u32; 3]> = triangles
        .iter()
        .map(|t| [0, 1, 2].map(|k| corner(&t[k])))
        .collect();
    let outside = |v: &&u32| u64::from(**v) >= vertices;
    match triangles.iter().flatten().find(outside) {
        Some(v) => {
            let message = format!("the vertex {v} does not exist (there are {vertices})");
            Err(Problem::Malformed(message))
        }
        None => Ok(triangles),
    }
}
