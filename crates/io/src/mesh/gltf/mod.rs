//! glTF 2.0, as text or binary: the triangles of all nodes of a file's scene, in one mesh.
//!
//! Materials, skins, morph targets and cameras are not read.

mod accessor;

use std::fs;
use std::path::Path;

use ::gltf::buffer::Source;
use ::gltf::mesh::Mode;
use ::gltf::{Document, Gltf, Node, Primitive, Semantic};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use glam::{DAffine3, DMat4, DVec3};

use super::MeshData;
use super::build::{check_mesh, check_position};
use crate::error::{FileError, Problem};
use accessor::{indices, vectors};

/// Triangles of one file: nodes may show one mesh many times.
const MOST_TRIANGLES: usize = 100_000_000;

/// Reads a `.gltf` or `.glb` file, and the files that hold its buffers.
///
/// # Errors
///
/// A file that cannot be read or is no glTF 2.0, without triangles, with sparse or compressed data, or whose numbers do
/// not fit together.
pub fn read(path: &Path) -> Result<MeshData, FileError> {
    let bytes = fs::read(path).map_err(|e| Problem::Read(e).at(path))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let load = |name: &str| fs::read(folder.join(name)).map_err(Problem::Read);
    parse(&bytes, load).map_err(|problem| problem.at(path))
}

/// Reads a mesh from the bytes of a file; `load` reads the files that it names.
///
/// # Errors
///
/// As for [`read`].
pub fn parse(
    bytes: &[u8],
    load: impl Fn(&str) -> Result<Vec<u8>, Problem>,
) -> Result<MeshData, Problem> {
    let Gltf { document, blob } = Gltf::from_slice(bytes).map_err(|e| wrong(e.to_string()))?;
    let buffers = buffers(&document, blob, load)?;
    let scene = document.default_scene().or(document.scenes().next());
    let scene = scene.ok_or_else(|| wrong("the file has no scene"))?;
    let mut builder = Builder {
        buffers: &buffers,
        mesh: MeshData {
            uvs: Some(Vec::new()),
            colours: Some(Vec::new()),
            ..MeshData::default()
        },
    };
    // Every node has one parent at most, or the file has a cycle.
    let mut open: Vec<(Node, DAffine3)> = scene.nodes().map(|n| (n, DAffine3::IDENTITY)).collect();
    for _ in document.nodes() {
        let Some((node, outer)) = open.pop() else {
            break;
        };
        let frame = outer * placement(&node);
        for primitive in node.mesh().iter().flat_map(::gltf::Mesh::primitives) {
            builder.primitive(&primitive, frame)?;
        }
        open.extend(node.children().map(|child| (child, frame)));
    }
    match open.is_empty() {
        true => check_mesh(builder.mesh),
        false => Err(wrong("a node is below itself, or below two others")),
    }
}

/// Names of the files that hold the buffers of a file; none if it cannot be read.
pub fn data_files(path: &Path) -> Vec<String> {
    let document = fs::read(path)
        .ok()
        .and_then(|bytes| Gltf::from_slice(&bytes).ok());
    let buffers = document.iter().flat_map(|d| d.document.buffers());
    let external = buffers.filter_map(|b| match b.source() {
        Source::Uri(uri) if !uri.starts_with("data:") => name(uri),
        _ => None,
    });
    external.collect()
}

fn wrong(reason: impl Into<String>) -> Problem {
    Problem::WrongFormat {
        format: "glTF 2.0",
        reason: reason.into(),
    }
}

fn name(uri: &str) -> Option<String> {
    urlencoding::decode(uri).ok().map(|name| name.into_owned())
}

fn buffers(
    document: &Document,
    mut blob: Option<Vec<u8>>,
    load: impl Fn(&str) -> Result<Vec<u8>, Problem>,
) -> Result<Vec<Vec<u8>>, Problem> {
    let read = |buffer: ::gltf::Buffer| {
        let data = match buffer.source() {
            Source::Bin => blob
                .take()
                .ok_or_else(|| wrong("the binary part is missing")),
            Source::Uri(uri) => match uri.strip_prefix("data:") {
                Some(data) => embedded(data),
                None => load(&name(uri).ok_or_else(|| wrong("a file name is not UTF-8"))?),
            },
        }?;
        match data.len() < buffer.length() {
            true => Err(Problem::Truncated {
                expected: buffer.length() as u64,
                found: data.len() as u64,
            }),
            false => Ok(data),
        }
    };
    document.buffers().map(read).collect()
}

fn embedded(uri: &str) -> Result<Vec<u8>, Problem> {
    let data = uri.split_once(";base64,").map(|(_, data)| data);
    let data = data.ok_or_else(|| wrong("embedded data are not base64"))?;
    BASE64_STANDARD
        .decode(data)
        .map_err(|e| wrong(e.to_string()))
}

fn placement(node: &Node) -> DAffine3 {
    let columns = node.transform().matrix();
    let columns = columns.map(|c| c.map(f64::from));
    DAffine3::from_mat4(DMat4::from_cols_array_2d(&columns))
}

/// The mesh so far.
struct Builder<'a> {
    buffers: &'a [Vec<u8>],
    mesh: MeshData,
}

impl Builder<'_> {
    fn primitive(&mut self, primitive: &Primitive, frame: DAffine3) -> Result<(), Problem> {
        let Some(corners) = self.triangles(primitive)? else {
            return Ok(());
        };
        let first = self.mesh.positions.len();
        let missing = || wrong("a part has no positions");
        let positions = primitive.get(&Semantic::Positions).ok_or_else(missing)?;
        for (i, x) in vectors::<3>(&positions, self.buffers)?
            .into_iter()
            .enumerate()
        {
            let x = frame.transform_point3(DVec3::from_array(x));
            self.mesh.positions.push(check_position(x, first + i)?);
        }
        let count = self.mesh.positions.len() - first;
        self.attributes(primitive, count)?;
        // A mirrored part is wound the other way round.
        let mirrored = frame.matrix3.determinant() < 0.0;
        for [a, b, c] in corners {
            if [a, b, c].iter().any(|i| *i as usize >= count) {
                return Err(wrong(format!(
                    "a triangle of vertex {}, of {count}",
                    a.max(b).max(c)
                )));
            }
            let [a, b, c] = [a, b, c].map(|i| i + first as u32);
            self.mesh
                .triangles
                .push(if mirrored { [a, c, b] } else { [a, b, c] });
        }
        Ok(())
    }

    /// Texture coordinates and colours, if all parts have them. Both are as in images: v grows downwards, and
    /// colours are linear.
    fn attributes(&mut self, primitive: &Primitive, count: usize) -> Result<(), Problem> {
        let fits = |n: usize| match n == count {
            true => Ok(()),
            false => Err(wrong(format!("{n} attributes of {count} vertices"))),
        };
        let uvs = primitive.get(&Semantic::TexCoords(0));
        match (uvs, &mut self.mesh.uvs) {
            (Some(uvs), Some(all)) => {
                let uvs = vectors::<2>(&uvs, self.buffers)?;
                fits(uvs.len())?;
                all.extend(uvs);
            }
            _ => self.mesh.uvs = None,
        }
        let colours = primitive.get(&Semantic::Colors(0));
        match (colours, &mut self.mesh.colours) {
            (Some(colours), Some(all)) => {
                let colours = vectors::<3>(&colours, self.buffers)?;
                fits(colours.len())?;
                all.extend(colours.into_iter().map(|c| c.map(|v| v as f32)));
            }
            _ => self.mesh.colours = None,
        }
        Ok(())
    }

    /// The corners of a part's triangles, by its own vertices; `None` of points and lines.
    fn triangles(&self, primitive: &Primitive) -> Result<Option<Vec<[u32; 3]>>, Problem> {
        if !matches!(
            primitive.mode(),
            Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
        ) {
            return Ok(None);
        }
        let order = match primitive.indices() {
            Some(accessor) => indices(&accessor, self.buffers)?,
            None => {
                let positions = primitive.get(&Semantic::Positions);
                let count = match positions {
                    Some(accessor) => vectors::<3>(&accessor, self.buffers)?.len(),
                    None => 0,
                };
                (0..count as u32).collect()
            }
        };
        let corners: Vec<[u32; 3]> = match primitive.mode() {
            Mode::Triangles => order.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
            // Every other triangle of a strip is wound the other way round.
            Mode::TriangleStrip => order
                .windows(3)
                .enumerate()
                .map(|(i, c)| {
                    if i % 2 == 0 {
                        [c[0], c[1], c[2]]
                    } else {
                        [c[1], c[0], c[2]]
                    }
                })
                .collect(),
            _ => match order.split_first() {
                Some((hub, rim)) => rim.windows(2).map(|c| [*hub, c[0], c[1]]).collect(),
                None => Vec::new(),
            },
        };
        if self.mesh.triangles.len() + corners.len() > MOST_TRIANGLES {
            return Err(wrong(format!("more than {MOST_TRIANGLES} triangles")));
        }
        Ok(Some(corners))
    }
}
