//! glTF 2.0, text or binary: the triangles of all nodes of a file's scene, in one mesh [Khronos
//! 2021].
//!
//! Materials, skins, morph targets and cameras are not read. This crate has its own reader, because
//! the crate `gltf` panics on damaged files.

mod accessor;
mod document;

use std::path::Path;

use glam::{DAffine3, DMat4, DQuat, DVec3};
use serde_json::Value;

use super::MeshData;
use super::build::{check_mesh, check_position};
use crate::error::{FileError, Problem};
use crate::input::{self, Limits};
use document::{Document, index, list, numbers};

/// Maximum number of triangles of a file. Nodes may repeat a mesh many times, so a small file may
/// have many triangles.
const MAX_TRIANGLES: u64 = 100_000_000;
/// Maximum memory for a vertex and for a triangle while reading, in bytes.
const BYTES_PER_VERTEX: u64 = 208;
const BYTES_PER_TRIANGLE: u64 = 40;
/// Modes of primitives; smaller modes are points and lines.
const TRIANGLES: usize = 4;
const STRIP: usize = 5;
const FAN: usize = 6;

/// Reads a `.gltf` or `.glb` file, and the files of its buffers.
///
/// # Errors
///
/// A file that cannot be read, is not glTF 2.0, has no triangles, has sparse or compressed data, or
/// has inconsistent numbers.
pub fn read(path: &Path, limits: Limits) -> Result<MeshData, FileError> {
    let bytes = input::read(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let load = |name: &str| input::read(&folder.join(name)).map_err(|e| e.problem);
    parse(&bytes, load, limits).map_err(|problem| problem.at(path))
}

/// Reads a mesh from the bytes of a file; `load` reads the files that it names.
///
/// # Errors
///
/// As for [`read`].
pub fn parse(
    bytes: &[u8],
    load: impl Fn(&str) -> Result<Vec<u8>, Problem>,
    limits: Limits,
) -> Result<MeshData, Problem> {
    let document = Document::new(bytes, load, limits)?;
    let mut builder = Builder {
        document: &document,
        limits,
        mesh: MeshData {
            colours: Some(Vec::new()),
            ..MeshData::default()
        },
    };
    let scene = index(&document.json, "scene").unwrap_or(0);
    let roots = list(document.item("scenes", scene)?, "nodes");
    let mut open: Vec<(&Value, DAffine3)> = Vec::new();
    open.extend(roots.iter().rev().map(|root| (root, DAffine3::IDENTITY)));
    // Visit each node at most once: every node has at most one parent, or the file has a cycle.
    for _ in list(&document.json, "nodes") {
        let Some((number, outer)) = open.pop() else {
            break;
        };
        let number = number.as_u64().map_or(usize::MAX, |n| n as usize);
        let node = document.item("nodes", number)?;
        let frame = outer * placement(node)?;
        if let Some(mesh) = index(node, "mesh") {
            for primitive in list(document.item("meshes", mesh)?, "primitives") {
                builder.primitive(primitive, frame)?;
            }
        }
        let children = list(node, "children").iter().rev();
        open.extend(children.map(|child| (child, frame)));
    }
    if open.is_empty() {
        check_mesh(builder.finish())
    } else {
        Err(wrong("a node is its own descendant, or has two parents"))
    }
}

/// Returns the names of the files of a file's buffers; empty if the file cannot be read.
pub fn data_files(path: &Path, limits: Limits) -> Vec<String> {
    let bytes = input::read(path).unwrap_or_default();
    document::data_files(&bytes, limits)
}

fn wrong(reason: impl Into<String>) -> Problem {
    Problem::WrongFormat {
        format: "glTF 2.0",
        reason: reason.into(),
    }
}

/// Returns the transform from a node to its parent: a matrix, column by column, or scale, rotation
/// and translation.
fn placement(node: &Value) -> Result<DAffine3, Problem> {
    if let Some(matrix) = numbers::<16>(node, "matrix")? {
        return Ok(DAffine3::from_mat4(DMat4::from_cols_array(&matrix)));
    }
    let scale = numbers(node, "scale")?.map_or(DVec3::ONE, DVec3::from_array);
    let rotation = numbers(node, "rotation")?.map_or(DQuat::IDENTITY, DQuat::from_array);
    let translation = numbers(node, "translation")?.map_or(DVec3::ZERO, DVec3::from_array);
    if rotation.length_squared() == 0.0 {
        return Err(wrong("a rotation is zero"));
    }
    let rotation = rotation.normalize();
    Ok(DAffine3::from_scale_rotation_translation(
        scale,
        rotation,
        translation,
    ))
}

/// Builder of the mesh.
struct Builder<'a> {
    document: &'a Document<'a>,
    limits: Limits,
    mesh: MeshData,
}

impl Builder<'_> {
    fn primitive(&mut self, primitive: &Value, frame: DAffine3) -> Result<(), Problem> {
        let mode = index(primitive, "mode").unwrap_or(TRIANGLES);
        if mode < TRIANGLES {
            return Ok(());
        }
        let (attributes, first) = (&primitive["attributes"], self.mesh.positions.len());
        let positions =
            index(attributes, "POSITION").ok_or_else(|| wrong("a part has no positions"))?;
        self.check(positions, index(primitive, "indices"))?;
        let positions = self.document.vectors::<3>(positions)?;
        let count = positions.len();
        for (i, x) in positions.into_iter().enumerate() {
            let x = frame.transform_point3(DVec3::from_array(x));
            self.mesh.positions.push(check_position(x, first + i)?);
        }
        self.attributes(attributes, count, frame)?;
        let order = match index(primitive, "indices") {
            Some(accessor) => self.document.indices(accessor)?,
            None => (0..count as u32).collect(),
        };
        if let Some(bad) = order.iter().find(|i| **i as usize >= count) {
            return Err(wrong(format!("a triangle of vertex {bad}, of {count}")));
        }
        // Reverse the winding of mirrored parts.
        let mirrored = frame.matrix3.determinant() < 0.0;
        for [a, b, c] in triangles(mode, &order)? {
            let [a, b, c] = [a, b, c].map(|i| i + first as u32);
            let corners = if mirrored { [a, c, b] } else { [a, b, c] };
            self.mesh.triangles.push(corners);
        }
        Ok(())
    }

    /// Checks that a part does not make the mesh too large: nodes may repeat a mesh many times.
    fn check(&self, positions: usize, indices: Option<usize>) -> Result<(), Problem> {
        let more = |accessor| self.document.count(accessor);
        let vertices = self.mesh.positions.len() as u64 + more(positions)?;
        // Use the number of indices as bound of the number of triangles, which strips reach.
        let corners = indices.map_or(Ok(vertices), more)?;
        let triangles = self.mesh.triangles.len() as u64 + corners;
        if vertices.max(triangles) > MAX_TRIANGLES {
            return Err(wrong(format!("more than {MAX_TRIANGLES} triangles")));
        }
        let needed = vertices * BYTES_PER_VERTEX + triangles * BYTES_PER_TRIANGLE;
        self.limits.permit(needed, 1, self.document.size)
    }

    /// Adds normals, texture coordinates and colours. Normals and texture coordinates are zero for
    /// parts without them. Colours are added only if all parts have them. The texture coordinate v
    /// increases downwards, and colours are linear.
    fn attributes(
        &mut self,
        attributes: &Value,
        count: usize,
        frame: DAffine3,
    ) -> Result<(), Problem> {
        let fits = |n: usize| {
            if n == count {
                Ok(())
            } else {
                Err(wrong(format!("{n} attributes of {count} vertices")))
            }
        };
        let first = self.mesh.positions.len() - count;
        if let Some(accessor) = index(attributes, "TEXCOORD_0") {
            let uvs = self.document.vectors::<2>(accessor)?;
            fits(uvs.len())?;
            filled(&mut self.mesh.uvs, first).extend(uvs);
        }
        if let Some(accessor) = index(attributes, "NORMAL") {
            let normals = self.document.vectors::<3>(accessor)?;
            fits(normals.len())?;
            let to_scene = frame.matrix3.inverse().transpose();
            let normals = normals.into_iter().map(DVec3::from_array);
            filled(&mut self.mesh.normals, first).extend(normals.map(|n| to_scene * n));
        }
        match (index(attributes, "COLOR_0"), &mut self.mesh.colours) {
            (Some(accessor), Some(all)) => {
                let colours = self.document.vectors::<3>(accessor)?;
                fits(colours.len())?;
                all.extend(colours.into_iter().map(|c| c.map(|v| v as f32)));
            }
            _ => self.mesh.colours = None,
        }
        Ok(())
    }

    fn finish(mut self) -> MeshData {
        let count = self.mesh.positions.len();
        if self.mesh.uvs.is_some() {
            filled(&mut self.mesh.uvs, count);
        }
        if self.mesh.normals.is_some() {
            filled(&mut self.mesh.normals, count);
        }
        self.mesh
    }
}

/// Extends the values of the first `count` vertices by zeros for parts without values.
fn filled<T: Clone + Default>(known: &mut Option<Vec<T>>, count: usize) -> &mut Vec<T> {
    let known = known.get_or_insert_default();
    known.resize(count, T::default());
    known
}

/// Returns the corners of separate triangles, of a strip or of a fan.
fn triangles(mode: usize, order: &[u32]) -> Result<Vec<[u32; 3]>, Problem> {
    // Reverse the winding of every other triangle of a strip.
    let strip = |(i, c): (usize, &[u32])| match i % 2 {
        0 => [c[0], c[1], c[2]],
        _ => [c[1], c[0], c[2]],
    };
    Ok(match (mode, order) {
        (TRIANGLES, _) => order.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
        (STRIP, _) => order.windows(3).enumerate().map(strip).collect(),
        (FAN, [hub, rim @ ..]) => rim.windows(2).map(|c| [*hub, c[0], c[1]]).collect(),
        (FAN, []) => Vec::new(),
        _ => return Err(wrong(format!("parts of mode {mode}"))),
    })
}
