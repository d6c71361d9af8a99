//! Elements of a MATLAB file: tags, and the data before the numbers of an array.

use std::io::Read;

use super::wrong;
use crate::element::Element;
use crate::error::Problem;

pub(super) const INT8: u32 = 1;
pub(super) const UINT16: u32 = 4;
pub(super) const INT32: u32 = 5;
pub(super) const UINT32: u32 = 6;
pub(super) const MATRIX: u32 = 14;
pub(super) const COMPRESSED: u32 = 15;

/// Number types by the type of a tag.
const NUMBERS: [(u32, Element); 10] = [
    (1, Element::I8),
    (2, Element::U8),
    (3, Element::I16),
    (4, Element::U16),
    (5, Element::I32),
    (6, Element::U32),
    (7, Element::F32),
    (9, Element::F64),
    (12, Element::I64),
    (13, Element::U64),
];
/// Number types by the class of an array.
const CLASSES: [(u8, Element); 10] = [
    (6, Element::F64),
    (7, Element::F32),
    (8, Element::I8),
    (9, Element::U8),
    (10, Element::I16),
    (11, Element::U16),
    (12, Element::I32),
    (13, Element::U32),
    (14, Element::I64),
    (15, Element::U64),
];
/// Class of an array of characters.
pub(super) const TEXT_CLASS: u8 = 4;
/// Flag of an array with an imaginary part.
const COMPLEX: u8 = 8;
/// Longest accepted name or shape, in bytes.
const MAX_LENGTH: u32 = 1024;

/// Returns the number type of a tag.
pub(super) fn number(kind: u32) -> Result<Element, Problem> {
    let found = NUMBERS.iter().find(|(k, _)| *k == kind);
    let other = || wrong(&format!("numbers of type {kind}"));
    found.map(|(_, element)| *element).ok_or_else(other)
}

/// Returns the type of a tag and the class of an array with a number type.
pub(super) fn codes(element: Element) -> Option<(u32, u8)> {
    let kind = NUMBERS.iter().find(|(_, e)| *e == element)?.0;
    let class = CLASSES.iter().find(|(_, e)| *e == element)?.0;
    Some((kind, class))
}

/// Tag before data.
pub(super) struct Tag {
    pub kind: u32,
    /// Size of the data without padding, in bytes.
    pub size: u32,
    /// Data of up to four bytes, stored in the tag itself.
    pub small: Option<[u8; 4]>,
}

impl Tag {
    /// Size of a tag, in bytes.
    pub(super) const SIZE: u64 = 8;

    pub(super) fn read(reader: &mut impl Read, big: bool) -> Result<Self, Problem> {
        let mut bytes = [0; Self::SIZE as usize];
        let cut = |_| wrong("an element ends early");
        reader.read_exact(&mut bytes).map_err(cut)?;
        let [a, b, c, d, rest @ ..] = bytes;
        let (first, second) = (word([a, b, c, d], big), word(rest, big));
        match first >> 16 {
            0 => Ok(Tag {
                kind: first,
                size: second,
                small: None,
            }),
            size if size <= 4 => Ok(Tag {
                kind: first & 0xffff,
                size,
                small: Some(rest),
            }),
            _ => Err(wrong("a tag makes no sense")),
        }
    }

    /// Reads short data of the given type.
    fn short(reader: &mut impl Read, big: bool, kind: u32) -> Result<Vec<u8>, Problem> {
        let tag = Self::read(reader, big)?;
        if tag.kind != kind || tag.size > MAX_LENGTH {
            return Err(wrong("the head of an array makes no sense"));
        }
        let size = tag.size as usize;
        if let Some(small) = tag.small {
            return Ok(small[..size].to_vec());
        }
        let mut bytes = vec![0; size.next_multiple_of(8)];
        let cut = |_| wrong("an array ends early");
        reader.read_exact(&mut bytes).map_err(cut)?;
        bytes.truncate(size);
        Ok(bytes)
    }
}

/// Data before the numbers of an array.
pub(super) struct Head {
    pub name: String,
    pub shape: Vec<usize>,
    pub element: Element,
    pub complex: bool,
}

impl Head {
    /// Reads the head of an array of numbers; other arrays are an error.
    pub(super) fn read(reader: &mut impl Read, big: bool) -> Result<Self, Problem> {
        let flags = Tag::short(reader, big, UINT32)?;
        let Some(flags) = flags.first_chunk().map(|bytes| word(*bytes, big)) else {
            return Err(wrong("an array has no flags"));
        };
        let [class, flags, ..] = flags.to_le_bytes();
        let Some((_, element)) = CLASSES.iter().find(|(c, _)| *c == class) else {
            return Err(wrong("an array of other things than numbers"));
        };
        let shape = Tag::short(reader, big, INT32)?;
        let (words, _) = shape.as_chunks::<4>();
        let length = |bytes: &[u8; 4]| usize::try_from(word(*bytes, big) as i32);
        let shape: Result<Vec<usize>, _> = words.iter().map(length).collect();
        let name = Tag::short(reader, big, INT8)?;
        Ok(Head {
            name: String::from_utf8_lossy(&name).into_owned(),
            shape: shape.map_err(|_| wrong("an axis of negative length"))?,
            element: *element,
            complex: flags & COMPLEX != 0,
        })
    }
}

fn word(bytes: [u8; 4], big: bool) -> u32 {
    if big {
        u32::from_be_bytes(bytes)
    } else {
        u32::from_le_bytes(bytes)
    }
}
