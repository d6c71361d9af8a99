//! Mitsuba's serialized meshes, versions 3 and 4: several meshes, each compressed by zlib, and a
//! table of their offsets at the end of the file.

use std::io::Read;
use std::path::Path;

use flate2::read::ZlibDecoder;
use glam::DVec3;

use super::MeshData;
use super::build::{check_mesh, check_position};
use crate::element::{Element, Encoding};
use crate::error::{FileError, Problem};
use crate::input::{self, Limits};

/// First two bytes of every mesh.
const MAGIC: u16 = 0x041c;
/// Maximum length of the name of a mesh, in bytes.
const MAX_NAME_LENGTH: usize = 1 << 16;

/// Maximum memory for a vertex and for a triangle while reading, in bytes.
const BYTES_PER_VERTEX: u64 = 176;
const BYTES_PER_TRIANGLE: u64 = 64;

/// Flags for data of a mesh in addition to positions and triangles, and for double precision.
const NORMALS: u32 = 0x0001;
const UVS: u32 = 0x0002;
const COLOURS: u32 = 0x0008;
const DOUBLE: u32 = 0x2000;

/// Reads one of the meshes of a file.
///
/// # Errors
///
/// A file that cannot be read, is not a serialized mesh of these versions, or ends early. A missing
/// mesh. Positions that are not finite, and indices out of range.
pub fn read(path: &Path, index: usize, limits: Limits) -> Result<MeshData, FileError> {
    let bytes = input::read(path)?;
    parse(&bytes, index, limits).map_err(|problem| problem.at(path))
}

/// Reads one of the meshes from the bytes of a file.
///
/// # Errors
///
/// As for [`read`].
pub fn parse(bytes: &[u8], index: usize, limits: Limits) -> Result<MeshData, Problem> {
    let version = version(bytes)?;
    let offset = offset(bytes, version, index)?;
    let mesh = bytes.get(offset..).unwrap_or(&[]);
    self::version(mesh)?;
    Reader {
        stream: ZlibDecoder::new(&mesh[4..]),
        limits,
        size: bytes.len() as u64,
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

/// Returns the offset of a mesh, from the table at the end of the file.
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
    limits: Limits,
    /// Size of the file, in bytes.
    size: u64,
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
        let needed = vertices
            .saturating_mul(BYTES_PER_VERTEX)
            .saturating_add(triangles.saturating_mul(BYTES_PER_TRIANGLE));
        self.limits.check(needed, 1, self.size)?;
        let element = match flags & DOUBLE {
            0 => Element::F32,
            _ => Element::F64,
        };
        let positions: Vec<[f64; 3]> = self.vectors(vertices, element)?;
        let normals = (flags & NORMALS != 0).then(|| self.vectors::<3>(vertices, element));
        let normals = normals.transpose()?;
        let uvs = (flags & UVS != 0).then(|| self.vectors(vertices, element));
        let uvs = uvs.transpose()?;
        let colours = (flags & COLOURS != 0).then(|| self.vectors::<3>(vertices, element));
        let triangles = self.vectors::<3>(triangles, Element::U32)?;
        let position = |(i, p): (usize, [f64; 3])| check_position(DVec3::from_array(p), i);
        let positions = positions.into_iter().enumerate().map(position);
        let single = |c: [f64; 3]| c.map(|v| v as f32);
        check_mesh(MeshData {
            positions: positions.collect::<Result<_, _>>()?,
            triangles: corners(triangles, vertices)?,
            uvs,
            normals: normals.map(|all| all.into_iter().map(DVec3::from_array).collect()),
            colours: colours
                .transpose()?
                .map(|values| values.into_iter().map(single).collect()),
            ..MeshData::default()
        })
    }

    fn pass_name(&mut self) -> Result<(), Problem> {
        for _ in 0..MAX_NAME_LENGTH {
            if self.chunk()? == [0] {
                return Ok(());
            }
        }
        Err(wrong("the mesh's name has no end"))
    }

    fn chunk<const N: usize>(&mut self) -> Result<[u8; N], Problem> {
        let mut chunk = [0; N];
        self.stream.read_exact(&mut chunk).map_err(damaged)?;
        Ok(chunk)
    }

    /// Reads `count` vectors. Memory is allocated as they arrive.
    fn vectors<const N: usize>(
        &mut self,
        count: u64,
        element: Element,
    ) -> Result<Vec<[f64; N]>, Problem> {
        let count = usize::try_from(count).ok().and_then(|n| n.checked_mul(N));
        let count = count.ok_or_else(|| Problem::TooLarge("more elements than memory".into()))?;
        let mut vectors = Vec::new();
        let (mut vector, mut filled) = ([0.0; N], 0);
        let sink = |v| {
            vector[filled] = v;
            filled += 1;
            if filled == N {
                vectors.push(vector);
                filled = 0;
            }
        };
        let read = Encoding::little(element).read(&mut self.stream, count, sink);
        read.map_err(damaged)?;
        Ok(vectors)
    }
}

fn damaged(error: std::io::Error) -> Problem {
    wrong(format!("its compressed data: {error}"))
}

/// Converts the numbers of corners of triangles.
fn corners(triangles: Vec<[f64; 3]>, vertices: u64) -> Result<Vec<[u32; 3]>, Problem> {
    let outside = |v: &&f64| **v >= vertices as f64;
    if let Some(v) = triangles.iter().flatten().find(outside) {
        let message = format!("the vertex {v} does not exist (there are {vertices})");
        return Err(Problem::Malformed(message));
    }
    let whole = |t: [f64; 3]| t.map(|v| v as u32);
    Ok(triangles.into_iter().map(whole).collect())
}
