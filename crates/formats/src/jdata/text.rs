//! Text form: JSON.

use std::fmt;
use std::io::{self, Write};

use base64::engine::general_purpose::STANDARD;
use base64::write::EncoderWriter;
use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};

use super::{JdataValue, MAX_DEPTH, MAX_VALUES, PackedArray, compress, type_name};
use crate::error::Problem;

/// Parses JSON.
pub(super) fn parse(bytes: &[u8]) -> Result<JdataValue, Problem> {
    let mut left = MAX_VALUES;
    let mut json = serde_json::Deserializer::from_slice(bytes);
    let tree = Tree {
        left: &mut left,
        depth: 0,
    };
    let value = tree.deserialize(&mut json);
    value
        .and_then(|value| json.end().map(|()| value))
        .map_err(|e| Problem::WrongFormat {
            format: "JData",
            reason: e.to_string(),
        })
}

/// Reads a tree, and counts its values down.
struct Tree<'a> {
    left: &'a mut usize,
    depth: usize,
}

impl Tree<'_> {
    /// Counts a value.
    fn count<E: Error>(&mut self) -> Result<(), E> {
        *self.left = self
            .left
            .checked_sub(1)
            .ok_or_else(|| E::custom(super::too_many()))?;
        Ok(())
    }

    /// Returns a reader of the values one level below.
    fn below<E: Error>(&mut self) -> Result<Tree<'_>, E> {
        if self.depth == MAX_DEPTH {
            return Err(E::custom(format!("it has more than {MAX_DEPTH} levels")));
        }
        Ok(Tree {
            left: self.left,
            depth: self.depth + 1,
        })
    }
}

impl<'de> DeserializeSeed<'de> for Tree<'_> {
    type Value = JdataValue;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<JdataValue, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Tree<'_> {
    type Value = JdataValue;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a value of JSON")
    }

    fn visit_unit<E>(self) -> Result<JdataValue, E> {
        Ok(JdataValue::Null)
    }

    fn visit_bool<E>(self, v: bool) -> Result<JdataValue, E> {
        Ok(JdataValue::Boolean(v))
    }

    fn visit_i64<E>(self, v: i64) -> Result<JdataValue, E> {
        Ok(JdataValue::Number(v as f64))
    }

    fn visit_u64<E>(self, v: u64) -> Result<JdataValue, E> {
        Ok(JdataValue::Number(v as f64))
    }

    fn visit_f64<E>(self, v: f64) -> Result<JdataValue, E> {
        Ok(JdataValue::Number(v))
    }

    fn visit_str<E>(self, v: &str) -> Result<JdataValue, E> {
        Ok(JdataValue::Text(v.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(mut self, mut items: A) -> Result<JdataValue, A::Error> {
        let mut numbers = Vec::new();
        let mut others: Vec<JdataValue> = Vec::new();
        while let Some(item) = items.next_element_seed(self.below()?)? {
            match item {
                JdataValue::Number(v) if others.is_empty() => numbers.push(v),
                item => {
                    if others.is_empty() {
                        for v in numbers.drain(..) {
                            self.count()?;
                            others.push(JdataValue::Number(v));
                        }
                    }
                    self.count()?;
                    others.push(item);
                }
            }
        }
        Ok(match (numbers.is_empty(), others.is_empty()) {
            (false, _) => JdataValue::Numbers(numbers),
            _ => JdataValue::List(others),
        })
    }

    fn visit_map<A: MapAccess<'de>>(mut self, mut map: A) -> Result<JdataValue, A::Error> {
        let mut entries = Vec::new();
        while let Some(key) = map.next_key()? {
            self.count()?;
            entries.push((key, map.next_value_seed(self.below()?)?));
        }
        Ok(JdataValue::Object(entries))
    }
}

/// Writes JSON. Numbers that are not finite become the texts of JData, such as `_NaN_`.
pub(super) fn write(value: &JdataValue, out: &mut impl Write) -> io::Result<()> {
    match value {
        JdataValue::Null => out.write_all(b"null"),
        JdataValue::Boolean(v) => write!(out, "{v}"),
        JdataValue::Number(v) => number(*v, out),
        JdataValue::Text(text) => string(text, out),
        JdataValue::Numbers(numbers) => list(numbers, out, |v, out| number(*v, out)),
        JdataValue::List(items) => list(items, out, write),
        JdataValue::Object(entries) => {
            out.write_all(b"{")?;
            for (i, (key, value)) in entries.iter().enumerate() {
                out.write_all(if i == 0 { b"\n" } else { b",\n" })?;
                string(key, out)?;
                out.write_all(b": ")?;
                write(value, out)?;
            }
            out.write_all(b"\n}")
        }
        JdataValue::Packed(packed) => array(packed, out),
    }
}

fn list<T, W: Write>(
    items: &[T],
    out: &mut W,
    write: impl Fn(&T, &mut W) -> io::Result<()>,
) -> io::Result<()> {
    out.write_all(b"[")?;
    for (i, item) in items.iter().enumerate() {
        if i > 0 {
            out.write_all(b", ")?;
        }
        write(item, out)?;
    }
    out.write_all(b"]")
}

fn string(text: &str, out: &mut impl Write) -> io::Result<()> {
    serde_json::to_writer(out, text).map_err(io::Error::from)
}

fn number(v: f64, out: &mut impl Write) -> io::Result<()> {
    if v.is_finite() {
        write!(out, "{v}")
    } else if v.is_nan() {
        out.write_all(b"\"_NaN_\"")
    } else {
        out.write_all(if v > 0.0 { b"\"_Inf_\"" } else { b"\"-_Inf_\"" })
    }
}

fn array(packed: &PackedArray, out: &mut impl Write) -> io::Result<()> {
    let count: usize = packed.shape.iter().product();
    let shape: Vec<String> = packed.shape.iter().map(usize::to_string).collect();
    write!(
        out,
        "{{\n\"_ArrayType_\": \"{}\",\n\"_ArraySize_\": [{}],\n",
        type_name(packed.element),
        shape.join(", ")
    )?;
    if packed.column_major {
        out.write_all(b"\"_ArrayOrder_\": \"c\",\n")?;
    }
    write!(
        out,
        "\"_ArrayZipType_\": \"zlib\",\n\"_ArrayZipSize_\": {count},\n\"_ArrayZipData_\": \""
    )?;
    let encoder = EncoderWriter::new(&mut *out, &STANDARD);
    compress(&packed.bytes, encoder)?.finish()?;
    out.write_all(b"\"\n}")
}
