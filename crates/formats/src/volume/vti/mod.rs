//! VTK's XML image data (`.vti`): regular grids with their position in space.
//!
//! Supported are files of one piece with numbers of any type, as text, base64 or appended data (raw
//! or base64), uncompressed or compressed: "VTK XML file formats", docs.vtk.org.

mod grid;
mod payload;
mod write;

use std::path::Path;

use roxmltree::{Document, Node, ParsingOptions};

use super::layout::Layout;
use super::{Options, Sample, Volume};
use crate::error::{FileError, Problem};
use crate::input;
use grid::Grid;
use payload::{Appended, Payload};

pub use write::write;

/// Maximum number of elements, texts and comments in a header.
const MAX_NODES: u32 = 100_000;

/// Reads the volume from the array with the dataset's name, or from the only array if none is
/// given.
///
/// # Errors
///
/// A file that cannot be read, is not a valid `.vti` file or has several pieces, a missing array,
/// and NaN or infinite values.
pub fn read<T: Sample>(path: &Path, options: Options) -> Result<Volume<T>, FileError> {
    let bytes = input::read(path)?;
    parse(&bytes, options).map_err(|problem| problem.at(path))
}

/// Returns the names of the arrays.
pub(super) fn names(path: &Path) -> Result<Vec<String>, FileError> {
    let bytes = input::read(path)?;
    let found = split(&bytes).and_then(|(header, _)| {
        let document = document(&header)?;
        let arrays = arrays(child(image(&document)?, "Piece")?);
        Ok(arrays
            .into_iter()
            .map(|(name, ..)| name.to_owned())
            .collect())
    });
    found.map_err(|problem| problem.at(path))
}

/// Reads a volume from the bytes of a file.
///
/// # Errors
///
/// As for [`read`].
pub fn parse<T: Sample>(bytes: &[u8], options: Options) -> Result<Volume<T>, Problem> {
    let (header, appended) = split(bytes)?;
    let document = document(&header)?;
    let root = document.root_element();
    let image = image(&document)?;
    let piece = child(image, "Piece")?;
    let (data, on_points) = choose(piece, options.dataset)?;
    let grid = Grid::read(image, piece, on_points)?;
    let channels = match data.attribute("NumberOfComponents") {
        Some(text) => integer(text)?,
        None => 1,
    };
    let layout = Layout::plain(grid.size, channels)?;
    let payload = Payload::of(root, data)?;
    // Check the memory for the values, and for the elements from which they are made.
    let each = size_of::<T>() + payload.element().size();
    options
        .limits
        .check(layout.count() as u64, each as u64, bytes.len() as u64)?;
    let values = payload.values(data, appended.as_ref(), &layout)?;
    let volume = Volume::new(grid.size, channels, values)?;
    Ok(volume
        .with_frame(grid.frame)
        .with_element(payload.element()))
}

fn document(header: &str) -> Result<Document<'_>, Problem> {
    let parsing = ParsingOptions {
        nodes_limit: MAX_NODES,
        ..ParsingOptions::default()
    };
    Document::parse_with_options(header, parsing).map_err(|e| bad(e.to_string()))
}

fn image<'a, 'i>(document: &'a Document<'i>) -> Result<Node<'a, 'i>, Problem> {
    let root = document.root_element();
    if root.tag_name().name() != "VTKFile" || root.attribute("type") != Some("ImageData") {
        return Err(bad("it is not a VTKFile of type ImageData".into()));
    }
    child(root, "ImageData")
}

/// Splits the XML part from the appended data, whose raw bytes are not XML.
fn split(bytes: &[u8]) -> Result<(String, Option<Appended<'_>>), Problem> {
    const TAG: &[u8] = b"<AppendedData";
    let text = |bytes: &[u8]| {
        let text = std::str::from_utf8(bytes).map_err(|_| bad("its header is not UTF-8".into()));
        text.map(str::to_owned)
    };
    let Some(start) = bytes.windows(TAG.len()).position(|w| w == TAG) else {
        return Ok((text(bytes)?, None));
    };
    let unfinished = || bad("its appended data do not begin".into());
    let end = |from: usize, byte| {
        let found = bytes[from..].iter().position(|b| *b == byte);
        found.map(|i| from + i + 1).ok_or_else(unfinished)
    };
    let tag_end = end(start, b'>')?;
    let data = end(tag_end, b'_')?;
    let mut header = text(&bytes[..tag_end])?;
    header.push_str("</AppendedData></VTKFile>");
    let is_base64 = header[start..].contains("base64");
    let appended = Appended::new(&bytes[data..], is_base64);
    Ok((header, Some(appended)))
}

/// Returns the arrays with their names, and true for values at points.
fn arrays<'a, 'i>(piece: Node<'a, 'i>) -> Vec<(&'a str, Node<'a, 'i>, bool)> {
    let of = |tag: &'static str, on_points: bool| {
        let groups = piece.children().filter(move |n| n.has_tag_name(tag));
        let arrays = groups.flat_map(|g| g.children().filter(|n| n.has_tag_name("DataArray")));
        arrays.map(move |n| (n.attribute("Name").unwrap_or_default(), n, on_points))
    };
    of("PointData", true).chain(of("CellData", false)).collect()
}

/// Returns the array with the given name, or the only array, and true for values at points.
fn choose<'a, 'i>(
    piece: Node<'a, 'i>,
    name: Option<&str>,
) -> Result<(Node<'a, 'i>, bool), Problem> {
    let all = arrays(piece);
    let names: Vec<&str> = all.iter().map(|(name, ..)| *name).collect();
    let (_, node, on_points) = all[super::choose(&names, name)?];
    Ok((node, on_points))
}

fn child<'a, 'i>(node: Node<'a, 'i>, tag: &str) -> Result<Node<'a, 'i>, Problem> {
    let mut found = node.children().filter(|n| n.has_tag_name(tag));
    match (found.next(), found.next()) {
        (Some(one), None) => Ok(one),
        (None, _) => Err(bad(format!("it has no <{tag}>"))),
        _ => Err(Problem::Unsupported(format!(
            "several <{tag}> in a .vti file"
        ))),
    }
}

fn integer<I: std::str::FromStr>(text: &str) -> Result<I, Problem> {
    let number = text.trim().parse();
    number.map_err(|_| bad(format!("'{text}' is not a whole number")))
}

fn bad(reason: String) -> Problem {
    Problem::WrongFormat {
        format: "VTI",
        reason,
    }
}
