//! Wavefront OBJ: vertices, their colours, normals and texture coordinates, and faces.
//!
//! Materials, groups and smoothing are ignored: a mesh is geometry here. Errors name the line,
//! which existing crates for OBJ do not.

use std::collections::HashMap;
use std::path::Path;

use glam::DVec3;

use super::MeshData;
use super::build::{check_mesh, check_position, fan};
use crate::error::{FileError, Problem};
use crate::input::{self, Limits};

/// Maximum memory while reading, in bytes: for a position, a texture coordinate, a normal, a vertex
/// and a triangle.
const BYTES_PER_POSITION: u64 = 80;
const BYTES_PER_UV: u64 = 32;
const BYTES_PER_NORMAL: u64 = 48;
const BYTES_PER_VERTEX: u64 = 240;
const BYTES_PER_TRIANGLE: u64 = 24;

/// Reads a mesh from all objects of a file.
///
/// # Errors
///
/// A file that cannot be read or has no faces. With their line: invalid numbers, positions that are
/// not finite, and faces with indices out of range. Faces with fewer than three corners are
/// skipped.
pub fn read(path: &Path, limits: Limits) -> Result<MeshData, FileError> {
    let bytes = input::read(path)?;
    parse(&bytes, limits).map_err(|(problem, line)| FileError {
        path: path.to_owned(),
        line,
        problem,
    })
}

/// Reads a mesh from the bytes of a file. Errors have a line number.
///
/// # Errors
///
/// As for [`read`].
pub fn parse(bytes: &[u8], limits: Limits) -> Result<MeshData, (Problem, Option<usize>)> {
    // Decode leniently: names of materials and objects may have any encoding, and the rest is
    // ASCII.
    let text = String::from_utf8_lossy(bytes);
    let mut reader = Reader {
        most: limits.most(bytes.len() as u64),
        ..Reader::default()
    };
    let mut joined = String::new();
    for (index, line) in text.lines().enumerate() {
        // Join a line with a trailing backslash to the next line.
        if let Some(part) = line.trim_end().strip_suffix('\\') {
            joined.push_str(part);
            joined.push(' ');
            continue;
        }
        joined.push_str(line);
        reader
            .line(&joined)
            .map_err(|problem| (problem, Some(index + 1)))?;
        joined.clear();
    }
    reader.finish().map_err(|problem| (problem, None))
}

/// Indices of a corner of a face.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Corner {
    position: u32,
    uv: Option<u32>,
    normal: Option<u32>,
}

#[derive(Default)]
struct Reader {
    /// Memory that the file may take, in bytes.
    most: u64,
    positions: Vec<DVec3>,
    /// Colours after positions.
    colours: Vec<Option<[f32; 3]>>,
    uvs: Vec<[f64; 2]>,
    normals: Vec<DVec3>,
    /// Vertices of the mesh.
    vertices: Vec<Corner>,
    numbers: HashMap<Corner, u32>,
    triangles: Vec<[u32; 3]>,
    skipped_faces: usize,
}

impl Reader {
    fn line(&mut self, line: &str) -> Result<(), Problem> {
        let content = line.split('#').next().unwrap_or("");
        let mut words = content.split_whitespace();
        match words.next() {
            Some("v") => {
                let [x, y, z] = numbers(&mut words)?;
                let position = check_position(DVec3::new(x, y, z), self.positions.len() + 1)?;
                self.positions.push(position);
                self.colours.push(colour(words)?);
                self.check(0)?;
            }
            Some("vt") => {
                let [u] = numbers(&mut words)?;
                let v = words.next().map_or(Ok(0.0), number)?;
                self.uvs.push([u, v]);
                self.check(0)?;
            }
            Some("vn") => {
                let normal: [f64; 3] = numbers(&mut words)?;
                self.normals.push(normal.into());
                self.check(0)?;
            }
            Some("f") => self.face(words)?,
            _ => {}
        }
        Ok(())
    }

    fn face<'w>(&mut self, words: impl Iterator<Item = &'w str>) -> Result<(), Problem> {
        let words: Vec<&str> = words.collect();
        if words.len() < 3 {
            self.skipped_faces += 1;
            return Ok(());
        }
        let polygon = words
            .into_iter()
            .map(|word| self.vertex(word))
            .collect::<Result<Vec<_>, _>>()?;
        self.check(polygon.len())?;
        fan(&mut self.triangles, &polygon);
        Ok(())
    }

    /// Checks that the memory is within the limit, including `more` triangles.
    fn check(&self, more: usize) -> Result<(), Problem> {
        let taken = self.positions.len() as u64 * BYTES_PER_POSITION
            + self.uvs.len() as u64 * BYTES_PER_UV
            + self.normals.len() as u64 * BYTES_PER_NORMAL
            + self.vertices.len() as u64 * BYTES_PER_VERTEX
            + (self.triangles.len() + more) as u64 * BYTES_PER_TRIANGLE;
        if taken <= self.most {
            Ok(())
        } else {
            Err(Problem::TooLarge(
                "it takes more memory than the limit (--memory)".into(),
            ))
        }
    }

    /// Returns the vertex of the mesh for `position`, `position/uv`, `position//normal` or all
    /// three.
    fn vertex(&mut self, word: &str) -> Result<u32, Problem> {
        let mut parts = word.split('/');
        let position = index(parts.next().unwrap_or(""), self.positions.len(), "vertex")?;
        let mut other = |count, what| match parts.next() {
            None | Some("") => Ok(None),
            Some(part) => index(part, count, what).map(Some),
        };
        let corner = Corner {
            position,
            uv: other(self.uvs.len(), "texture coordinate")?,
            normal: other(self.normals.len(), "normal")?,
        };
        let next = self.vertices.len();
        if let Some(&number) = self.numbers.get(&corner) {
            return Ok(number);
        }
        let number = u32::try_from(next)
            .map_err(|_| Problem::TooLarge("more than 2^32 vertices".to_owned()))?;
        self.numbers.insert(corner, number);
        self.vertices.push(corner);
        Ok(number)
    }

    fn finish(self) -> Result<MeshData, Problem> {
        let position = |c: &Corner| self.positions[c.position as usize];
        let positions = self.vertices.iter().map(position).collect();
        let uv = |c: &Corner| c.uv.map_or([0.0; 2], |uv| self.uvs[uv as usize]);
        let without_uvs = (0..).zip(&self.vertices).filter(|(_, c)| c.uv.is_none());
        let mut without_uvs: Vec<u32> = without_uvs.map(|(vertex, _)| vertex).collect();
        let has_uvs = without_uvs.len() < self.vertices.len();
        let uvs = has_uvs.then(|| self.vertices.iter().map(uv).collect());
        if !has_uvs {
            without_uvs.clear();
        }
        let normal = |c: &Corner| {
            c.normal
                .map_or(DVec3::ZERO, |normal| self.normals[normal as usize])
        };
        let has_normals = self.vertices.iter().any(|c| c.normal.is_some());
        let normals = has_normals.then(|| self.vertices.iter().map(normal).collect());
        let colour = |c: &Corner| self.colours[c.position as usize];
        let colours = self.vertices.iter().map(colour).collect();
        check_mesh(MeshData {
            positions,
            triangles: self.triangles,
            uvs,
            without_uvs,
            normals,
            colours,
            skipped_faces: self.skipped_faces,
            ..MeshData::default()
        })
    }
}

/// Parses the numbers after a position: a weight, which is ignored, or a colour.
fn colour<'w>(mut words: impl Iterator<Item = &'w str>) -> Result<Option<[f32; 3]>, Problem> {
    let rest: Vec<&str> = words.by_ref().take(4).collect();
    if rest.len() < 3 {
        return Ok(None);
    }
    let [red, green, blue] = numbers(&mut rest[rest.len() - 3..].iter().copied())?;
    Ok(Some([red, green, blue].map(|v| v as f32)))
}

fn numbers<'w, const N: usize>(
    words: &mut impl Iterator<Item = &'w str>,
) -> Result<[f64; N], Problem> {
    let mut out = [0.0; N];
    for (i, value) in out.iter_mut().enumerate() {
        let missing = || Problem::Malformed(format!("expected {N} numbers, found {i}"));
        *value = number(words.next().ok_or_else(missing)?)?;
    }
    Ok(out)
}

fn number(word: &str) -> Result<f64, Problem> {
    word.parse()
        .map_err(|_| Problem::Malformed(format!("'{word}' is not a number")))
}

/// Parses an index. It counts from 1, or backwards from -1 for the latest of `count` items.
fn index(word: &str, count: usize, what: &str) -> Result<u32, Problem> {
    let malformed = || Problem::Malformed(format!("'{word}' is not an index"));
    let value: i64 = word.parse().map_err(|_| malformed())?;
    let count = count as i64;
    let from_zero = if value < 0 {
        value.checked_add(count)
    } else {
        value.checked_sub(1)
    };
    match from_zero {
        Some(i) if (0..count).contains(&i) => u32::try_from(i).map_err(|_| malformed()),
        _ => Err(Problem::Malformed(format!(
            "{what} {value} does not exist (there are {count})"
        ))),
    }
}
