//! PLY, the Stanford triangle format: ASCII, and binary in either byte order.

use std::io::{BufRead, BufReader, ErrorKind, Seek};
use std::path::Path;

use glam::DVec3;
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Header, Property, PropertyAccess, PropertyAccessResult};

use super::MeshData;
use super::attributes::{Channels, MeshAttribute, grouped};
use super::build::{check_mesh, check_position, fan};
use super::wedges::{self, Wedges};
use crate::colour::linear_from_srgb;
use crate::error::{FileError, Problem};
use crate::input::{self, Limits};

/// Reads a mesh from a PLY file.
///
/// Vertices have positions `x y z` and optionally normals `nx ny nz`, texture coordinates `u v` or
/// `s t`, and colours `r g b`, `red green blue` or `color_0 color_1 color_2`. Faces may have
/// colours with these names, and texture coordinates of their corners, the list `texcoord`. Other
/// properties such as `weight_0` or `velocity_x velocity_y velocity_z`, of one channel or three,
/// are attributes.
///
/// # Errors
///
/// A file that cannot be read, is not a valid PLY file, or has no faces. Counts that exceed the
/// file. Positions that are not finite, and faces with indices out of range. Faces with fewer than
/// three corners are skipped.
pub fn read(path: &Path, limits: Limits) -> Result<MeshData, FileError> {
    let (reader, size) = input::open(path)?;
    read_from(reader, size, limits).map_err(|(problem, line)| FileError {
        path: path.to_owned(),
        line,
        problem,
    })
}

/// Reads a mesh from the bytes of a file. Errors have a line number if there is one.
///
/// # Errors
///
/// As for [`read`].
pub fn parse(bytes: &[u8], limits: Limits) -> Result<MeshData, (Problem, Option<usize>)> {
    read_from(
        BufReader::new(std::io::Cursor::new(bytes)),
        bytes.len() as u64,
        limits,
    )
}

type Located = (Problem, Option<usize>);

fn read_from(reader: impl BufRead + Seek, size: u64, limits: Limits) -> Result<MeshData, Located> {
    let mut reader = Reader::new(reader);
    let header = Parser::<Vertex>::new()
        .read_header(&mut reader)
        .map_err(|e| describe_header(&e))?;
    check_header(&header, size, limits).map_err(|problem| (problem, None))?;
    let mut mesh = MeshData::default();
    let count = header.elements.get("vertex").map_or(0, |e| e.count);
    let mut wedges = None;
    for (name, element) in &header.elements {
        match name.as_str() {
            "vertex" => read_vertices(&mut reader, element, &header, &mut mesh)?,
            "face" => {
                let mut faces = Faces::new(element, count);
                let mut corners = 0;
                in_blocks(
                    &mut reader,
                    element,
                    &header,
                    |first, block: &mut [Face]| {
                        corners += block.iter().map(Face::corners).sum::<usize>();
                        limits.check(faces.bytes(corners as u64), 1, size)?;
                        faces.add(&mut mesh, first, block)
                    },
                )?;
                wedges = faces.finish(&mut mesh);
            }
            _ => in_blocks(&mut reader, element, &header, |_, _: &mut [Other]| Ok(()))?,
        }
    }
    if let Some(wedges) = wedges {
        wedges.finish(&mut mesh);
    }
    check_mesh(mesh).map_err(|p| (p, None))
}

/// Number of elements that are read at a time: few enough to take little memory.
const BLOCK: usize = 1 << 12;

/// Reads all elements of a kind in blocks, and passes each block to `take` with the number of its
/// first element.
fn in_blocks<E: PropertyAccess>(
    reader: &mut Reader<impl BufRead>,
    element: &ElementDef,
    header: &Header,
    mut take: impl FnMut(usize, &mut [E]) -> Result<(), Problem>,
) -> Result<(), Located> {
    let mut block = element.clone();
    for first in (0..element.count).step_by(BLOCK) {
        block.count = BLOCK.min(element.count - first);
        let elements = Parser::new().read_payload_for_element(reader, &block, header);
        let mut elements = elements.map_err(|e| describe(e, element))?;
        take(first, &mut elements).map_err(|problem| (problem, None))?;
    }
    Ok(())
}

/// Checks that the file is large enough for the counts in its header: every element takes at least
/// a byte.
fn check_header(header: &Header, size: u64, limits: Limits) -> Result<(), Problem> {
    for (name, element) in &header.elements {
        if element.count as u64 > size {
            let message = format!("{} elements '{name}' in {size} bytes", element.count);
            return Err(Problem::TooLarge(message));
        }
        if element.properties.is_empty() && element.count > 0 {
            return Err(Problem::Malformed(format!(
                "element '{name}' has no properties"
            )));
        }
    }
    let elements = header.elements.values();
    let bytes = elements.map(|e| {
        let each = BYTES_PER_ELEMENT + BYTES_PER_PROPERTY * others(e).len() as u64;
        (e.count as u64).saturating_mul(each)
    });
    limits.check(bytes.fold(0, u64::saturating_add), 1, size)?;
    let has = |element: &str, property: &str| {
        header
            .elements
            .get(element)
            .is_some_and(|e| e.properties.contains_key(property))
    };
    for axis in ["x", "y", "z"] {
        if !has("vertex", axis) {
            return Err(Problem::Malformed(format!(
                "there is no property '{axis}' of 'vertex'"
            )));
        }
    }
    if !FACE_LISTS.iter().any(|name| has("face", name)) {
        let message = "there is no property 'vertex_indices' of 'face'".to_owned();
        return Err(Problem::Malformed(message));
    }
    Ok(())
}

/// Converts an error within an element.
fn describe(error: ParseError, element: &ElementDef) -> Located {
    if error.kind() == ErrorKind::UnexpectedEof {
        let (name, count) = (&element.name, element.count);
        let message = format!("the file ends early, within the {count} elements '{name}'");
        return (Problem::Malformed(message), error.line());
    }
    describe_header(&error)
}

fn describe_header(error: &ParseError) -> Located {
    // Keep the first line: all later lines repeat the input.
    let text = error.to_string();
    let first = text
        .lines()
        .next()
        .unwrap_or("")
        .trim_end_matches(['.', ' ']);
    let message = match error.line() {
        Some(line) => first.trim_start_matches(&format!("Line {line}: ")),
        None => first,
    };
    (
        Problem::WrongFormat {
            format: "PLY",
            reason: message.chars().take(200).collect(),
        },
        error.line(),
    )
}

/// Names of texture coordinates in different programs.
const UV_NAMES: [[&str; 2]; 3] = [["u", "v"], ["s", "t"], ["texture_u", "texture_v"]];

fn read_vertices(
    reader: &mut Reader<impl BufRead>,
    element: &ElementDef,
    header: &Header,
    mesh: &mut MeshData,
) -> Result<(), Located> {
    let has = |name: &str| element.properties.contains_key(name);
    let has_uvs = UV_NAMES
        .iter()
        .any(|names| names.iter().all(|name| has(name)));
    let has_normals = ["nx", "ny", "nz"].into_iter().all(has);
    mesh.positions.reserve_exact(element.count);
    mesh.uvs = has_uvs.then(|| Vec::with_capacity(element.count));
    mesh.normals = has_normals.then(|| Vec::with_capacity(element.count));
    mesh.colours = is_coloured(element).then(|| Vec::with_capacity(element.count));
    let mut attributes = Columns::new("vertex", element);
    in_blocks(reader, element, header, |first, block: &mut [Vertex]| {
        for (i, v) in (first..).zip(block) {
            let position = DVec3::from_array(v.position);
            mesh.positions.push(check_position(position, i)?);
            mesh.uvs.iter_mut().for_each(|all| all.push(v.uv));
            let normal = DVec3::from_array(v.normal);
            mesh.normals.iter_mut().for_each(|all| all.push(normal));
            mesh.colours.iter_mut().for_each(|all| all.push(v.colour));
            attributes.add(&v.others, 1);
        }
        Ok(())
    })?;
    mesh.attributes.extend(attributes.finish());
    Ok(())
}

/// Returns the properties of an element that become attributes, in their order.
fn others(element: &ElementDef) -> Vec<&str> {
    let names = element.properties.keys().map(String::as_str);
    names.filter(|name| !is_known(name)).collect()
}

fn is_known(name: &str) -> bool {
    const KNOWN: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];
    let is_uv = UV_NAMES.as_flattened().contains(&name);
    let is_list = FACE_LISTS.contains(&name) || name == WEDGES;
    KNOWN.contains(&name) || is_uv || is_list || channel(name).is_some()
}

/// Attributes of vertices or faces, collected from their other properties.
struct Columns(Vec<(Channels, Vec<[f32; 3]>)>);

impl Columns {
    fn new(kind: &str, element: &ElementDef) -> Self {
        let groups = grouped(kind, &others(element)).into_iter();
        Columns(groups.map(|channels| (channels, Vec::new())).collect())
    }

    /// Adds the other properties of an element, `times` times.
    fn add(&mut self, others: &[f32], times: usize) {
        for (channels, values) in &mut self.0 {
            let channel = |c: usize| others.get(channels.first + c).copied().unwrap_or(0.0);
            let value = [0, 1, 2].map(|c| channel(if channels.count == 1 { 0 } else { c }));
            values.extend(std::iter::repeat_n(value, times));
        }
    }

    fn finish(self) -> impl Iterator<Item = MeshAttribute> {
        self.0.into_iter().map(|(channels, values)| MeshAttribute {
            name: channels.name,
            is_number: channels.count == 1,
            values,
        })
    }
}

/// Returns true if an element has all channels of a colour.
fn is_coloured(element: &ElementDef) -> bool {
    let has = |name: &&str| element.properties.contains_key(*name);
    COLOURS.iter().any(|names| names.iter().all(has))
}

/// Returns true if faces have texture coordinates of their corners.
fn has_wedges(element: &ElementDef) -> bool {
    element.properties.contains_key(WEDGES)
}

/// Collector of the faces of a mesh.
struct Faces {
    /// Number of vertices.
    vertices: usize,
    /// Texture coordinates of corners, if the file has them.
    wedges: Option<Wedges>,
    /// Colours of triangles, if faces have colours.
    colours: Option<Vec<[f32; 3]>>,
    attributes: Columns,
}

impl Faces {
    fn new(element: &ElementDef, vertices: usize) -> Self {
        Faces {
            vertices,
            wedges: has_wedges(element).then(|| Wedges::new(vertices)),
            colours: is_coloured(element).then(Vec::new),
            attributes: Columns::new("face", element),
        }
    }

    /// Returns the memory for faces with a total of `corners` corners, in bytes.
    fn bytes(&self, corners: u64) -> u64 {
        match self.wedges {
            Some(_) => {
                corners * (BYTES_PER_CORNER + wedges::BYTES_PER_CORNER)
                    + self.vertices as u64 * wedges::BYTES_PER_VERTEX
            }
            None => corners * BYTES_PER_CORNER,
        }
    }

    /// Adds faces; the first face has the number `first`.
    fn add(
        &mut self,
        mesh: &mut MeshData,
        first: usize,
        faces: &mut [Face],
    ) -> Result<(), Problem> {
        let count = self.vertices;
        mesh.triangles
            .reserve(faces.iter().map(Face::triangles).sum());
        for (i, face) in (first..).zip(faces) {
            let malformed = |message| Err(Problem::Malformed(format!("face {i} {message}")));
            let triangles = face.triangles();
            let Some(polygon) = &mut face.polygon else {
                return malformed("has an index that is not a whole number or negative".to_owned());
            };
            self.attributes.add(&face.others, triangles);
            if polygon.len() < 3 {
                mesh.skipped_faces += 1;
                continue;
            }
            if let Some(vertex) = polygon.iter().find(|v| **v as usize >= count) {
                return malformed(format!("has the vertex {vertex} (there are {count})"));
            }
            let uvs = face.wedges.as_chunks::<2>().0;
            if !face.wedges.is_empty() && face.wedges.len() != 2 * polygon.len() {
                let (found, count) = (face.wedges.len(), polygon.len());
                return malformed(format!(
                    "has {found} numbers '{WEDGES}', not two for each of its {count} vertices"
                ));
            }
            if let Some(wedges) = &mut self.wedges {
                for (k, vertex) in polygon.iter_mut().enumerate() {
                    *vertex = wedges.vertex(*vertex, uvs.get(k).copied());
                }
            }
            fan(&mut mesh.triangles, polygon);
            if let Some(colours) = &mut self.colours {
                colours.resize(mesh.triangles.len(), face.colour);
            }
        }
        Ok(())
    }

    /// Stores colours and attributes of the triangles in the mesh. Returns texture coordinates of
    /// corners, which can be used only after all vertices are known.
    fn finish(self, mesh: &mut MeshData) -> Option<Wedges> {
        mesh.face_colours = self.colours;
        mesh.attributes.extend(self.attributes.finish());
        self.wedges
    }
}

/// Maximum memory while reading, in bytes. `BYTES_PER_ELEMENT` is for a vertex or a face without
/// its corners and other properties. `BYTES_PER_PROPERTY` is for each other property with its part
/// of an attribute, and `BYTES_PER_CORNER` for each corner.
const BYTES_PER_ELEMENT: u64 = 96;
const BYTES_PER_PROPERTY: u64 = 24;
const BYTES_PER_CORNER: u64 = 32;

/// Names of the list of a face's vertices.
const FACE_LISTS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Name of the list of texture coordinates of a face's corners: u and v of each.
const WEDGES: &str = "texcoord";

/// Names of the channels of a colour.
const COLOURS: [[&str; 3]; 3] = [
    ["r", "g", "b"],
    ["red", "green", "blue"],
    ["color_0", "color_1", "color_2"],
];

/// Returns the number of a property's colour channel.
fn channel(name: &str) -> Option<usize> {
    let place = |names: &[&str; 3]| names.iter().position(|n| *n == name);
    COLOURS.iter().find_map(place)
}

/// Sets a channel of a colour.
fn set_channel(place: &mut f32, property: &Property) -> PropertyAccessResult {
    match intensity(property) {
        Some(value) => {
            *place = value as f32;
            PropertyAccessResult::Set
        }
        None => PropertyAccessResult::UnsupportedType,
    }
}

/// Keeps a property that may be part of an attribute. Lists count as zero.
fn keep(others: &mut Vec<f32>, property: &Property) -> PropertyAccessResult {
    others.push(scalar(property).map_or(0.0, |v| v as f32));
    PropertyAccessResult::Set
}

#[derive(Debug)]
struct Vertex {
    position: [f64; 3],
    normal: [f64; 3],
    uv: [f64; 2],
    colour: [f32; 3],
    /// Other properties, in their order.
    others: Vec<f32>,
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Vertex {
            position: [0.0; 3],
            normal: [0.0; 3],
            uv: [0.0; 2],
            colour: [0.0; 3],
            others: Vec::new(),
        }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if let Some(channel) = channel(name) {
            return set_channel(&mut self.colour[channel], &property);
        }
        let place = match name {
            "x" => &mut self.position[0],
            "y" => &mut self.position[1],
            "z" => &mut self.position[2],
            "nx" => &mut self.normal[0],
            "ny" => &mut self.normal[1],
            "nz" => &mut self.normal[2],
            "u" | "s" | "texture_u" => &mut self.uv[0],
            "v" | "t" | "texture_v" => &mut self.uv[1],
            _ if is_known(name) => return PropertyAccessResult::Ignored,
            _ => return keep(&mut self.others, &property),
        };
        match scalar(&property) {
            Some(value) => {
                *place = value;
                PropertyAccessResult::Set
            }
            None => PropertyAccessResult::UnsupportedType,
        }
    }
}

#[derive(Debug)]
struct Face {
    /// Vertices of the face; `None` if an index is invalid.
    polygon: Option<Vec<u32>>,
    colour: [f32; 3],
    /// Texture coordinates of the corners; empty if there are none.
    wedges: Vec<f64>,
    /// Other properties, in their order.
    others: Vec<f32>,
}

impl Face {
    fn corners(&self) -> usize {
        self.polygon.as_ref().map_or(0, Vec::len)
    }

    fn triangles(&self) -> usize {
        self.corners().saturating_sub(2)
    }
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Face {
            polygon: Some(Vec::new()),
            colour: [0.0; 3],
            wedges: Vec::new(),
            others: Vec::new(),
        }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if let Some(channel) = channel(name) {
            return set_channel(&mut self.colour[channel], &property);
        }
        if name == WEDGES {
            self.wedges = numbers(&property);
            return PropertyAccessResult::Set;
        }
        if FACE_LISTS.contains(&name) {
            self.polygon = match property {
                // Convert in place, because most files have this type.
                Property::ListInt(list) => {
                    list.into_iter().map(|v| u32::try_from(v).ok()).collect()
                }
                other => other.to_u32_list(),
            };
            return PropertyAccessResult::Set;
        }
        if is_known(name) {
            return PropertyAccessResult::Ignored;
        }
        keep(&mut self.others, &property)
    }
}

/// Element of another kind, which is skipped.
#[derive(Debug)]
struct Other;

impl PropertyAccess for Other {
    fn new() -> Self {
        Other
    }

    fn set_property(&mut self, _: &str, _: Property) -> PropertyAccessResult {
        PropertyAccessResult::Ignored
    }
}

fn scalar(property: &Property) -> Option<f64> {
    match *property {
        Property::Char(v) => Some(v.into()),
        Property::UChar(v) => Some(v.into()),
        Property::Short(v) => Some(v.into()),
        Property::UShort(v) => Some(v.into()),
        Property::Int(v) => Some(v.into()),
        Property::UInt(v) => Some(v.into()),
        Property::Float(v) => Some(v.into()),
        Property::Double(v) => Some(v),
        _ => None,
    }
}

/// Returns the numbers of a list of floating-point numbers; empty for other properties.
fn numbers(property: &Property) -> Vec<f64> {
    match property {
        Property::ListFloat(values) => values.iter().copied().map(f64::from).collect(),
        Property::ListDouble(values) => values.clone(),
        _ => Vec::new(),
    }
}

/// Returns a channel of a colour. Whole numbers are fractions of the largest one, encoded as in
/// sRGB; other numbers are linear.
fn intensity(property: &Property) -> Option<f64> {
    let share = match *property {
        Property::UChar(v) => f64::from(v) / f64::from(u8::MAX),
        Property::UShort(v) => f64::from(v) / f64::from(u16::MAX),
        Property::Float(_) | Property::Double(_) => return scalar(property),
        _ => return None,
    };
    Some(linear_from_srgb(share))
}
