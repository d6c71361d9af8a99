//! Numbers in glTF buffers.

use serde_json::Value;

use super::document::{Document, index, list};
use super::wrong;
use crate::element::Element;
use crate::error::Problem;

impl Document<'_> {
    /// Returns the first `N` components of vectors. Normalised integers are in [0, 1] or [−1, 1].
    pub(super) fn vectors<const N: usize>(
        &self,
        accessor: usize,
    ) -> Result<Vec<[f64; N]>, Problem> {
        let accessor = self.item("accessors", accessor)?;
        let components = components(accessor);
        if components < N {
            return Err(wrong(format!("{components} components in place of {N}")));
        }
        let (kind, scale) = (element(accessor)?, scale(accessor)?);
        let size = kind.size();
        let component = |bytes: &[u8]| match scale {
            1.0 => number(kind, bytes),
            scale => (number(kind, bytes) * scale).max(-1.0),
        };
        let vector =
            |bytes: &[u8]| std::array::from_fn(|i| component(&bytes[i * size..(i + 1) * size]));
        Ok(self
            .elements(accessor, components * size)?
            .map(vector)
            .collect())
    }

    /// Makes a message about numbers that are in no buffer.
    fn no_data(&self) -> Problem {
        let used = list(&self.json, "extensionsUsed").iter();
        let used: Vec<&str> = used.filter_map(Value::as_str).collect();
        let extensions = if used.is_empty() {
            String::new()
        } else {
            format!(
                "; morgana does not support numbers of extensions ({})",
                used.join(", ")
            )
        };
        wrong(format!(
            "some of its numbers are not in a buffer{extensions}"
        ))
    }

    /// Returns the number of elements that an accessor states.
    pub(super) fn count(&self, accessor: usize) -> Result<u64, Problem> {
        let count = index(self.item("accessors", accessor)?, "count").unwrap_or(0);
        // Limit the number by the size of the file: no buffer has more bytes.
        Ok((count as u64).min(self.size))
    }

    /// Returns the indices of vertices.
    pub(super) fn indices(&self, accessor: usize) -> Result<Vec<u32>, Problem> {
        let accessor = self.item("accessors", accessor)?;
        let kind = element(accessor)?;
        let whole = matches!(kind, Element::U8 | Element::U16 | Element::U32);
        if !whole || components(accessor) != 1 {
            return Err(wrong("indices are not whole numbers"));
        }
        let elements = self.elements(accessor, kind.size())?;
        Ok(elements.map(|bytes| number(kind, bytes) as u32).collect())
    }

    /// Returns the bytes of each element of `size` bytes, after checking that they exist.
    fn elements(
        &self,
        accessor: &Value,
        size: usize,
    ) -> Result<impl Iterator<Item = &[u8]>, Problem> {
        if !accessor["sparse"].is_null() {
            return Err(wrong("morgana does not support sparse data"));
        }
        let view = index(accessor, "bufferView").ok_or_else(|| self.no_data())?;
        let view = self.item("bufferViews", view)?;
        let buffer = self
            .buffers
            .get(index(view, "buffer").unwrap_or(usize::MAX))
            .map(|data| &*self.data[*data]);
        let count = index(accessor, "count").unwrap_or(0);
        let stride = index(view, "byteStride").unwrap_or(size);
        let offset = |object| index(object, "byteOffset").unwrap_or(0);
        let length = count.checked_sub(1).and_then(|n| n.checked_mul(stride));
        let length = length
            .and_then(|n| n.checked_add(size))
            .filter(|_| stride >= size);
        let start = offset(view).checked_add(offset(accessor));
        let bytes = buffer
            .zip(start.zip(length))
            .and_then(|(buffer, (start, length))| buffer.get(start..start.checked_add(length)?));
        let bytes = bytes.ok_or_else(|| wrong("numbers lie beyond the end of their buffer"))?;
        Ok((0..count).map(move |i| &bytes[i * stride..i * stride + size]))
    }
}

fn components(accessor: &Value) -> usize {
    match accessor["type"].as_str() {
        Some("SCALAR") => 1,
        Some("VEC2") => 2,
        Some("VEC3") => 3,
        Some("VEC4") => 4,
        _ => 0,
    }
}

fn element(accessor: &Value) -> Result<Element, Problem> {
    Ok(match index(accessor, "componentType") {
        Some(5120) => Element::I8,
        Some(5121) => Element::U8,
        Some(5122) => Element::I16,
        Some(5123) => Element::U16,
        Some(5125) => Element::U32,
        Some(5126) => Element::F32,
        _ => return Err(wrong("numbers of an unknown type")),
    })
}

/// Returns the factor on numbers: normalised integers represent fractions.
fn scale(accessor: &Value) -> Result<f64, Problem> {
    let normalized = accessor["normalized"].as_bool().unwrap_or(false);
    Ok(match element(accessor)? {
        Element::I8 if normalized => 1.0 / f64::from(i8::MAX),
        Element::U8 if normalized => 1.0 / f64::from(u8::MAX),
        Element::I16 if normalized => 1.0 / f64::from(i16::MAX),
        Element::U16 if normalized => 1.0 / f64::from(u16::MAX),
        _ => 1.0,
    })
}

fn number(kind: Element, bytes: &[u8]) -> f64 {
    let mut number = 0.0;
    kind.decode(bytes, &mut |value| number = value);
    number
}
