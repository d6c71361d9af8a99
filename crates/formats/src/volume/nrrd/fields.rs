//! Names and values in the header of NRRD files.

use std::io::{BufRead, Read};

use super::bad;
use crate::error::Problem;

/// Longest accepted header, in bytes.
const MAX_HEADER_SIZE: u64 = 1 << 20;

/// Names and values of a header.
pub(super) struct Fields {
    list: Vec<(String, String)>,
    /// Size of the header, in bytes.
    pub bytes: u64,
}

impl Fields {
    pub(super) fn read(reader: &mut impl BufRead) -> Result<Self, Problem> {
        let mut fields = Fields {
            list: Vec::new(),
            bytes: 0,
        };
        let mut limited = reader.by_ref().take(MAX_HEADER_SIZE);
        let mut line = Vec::new();
        loop {
            line.clear();
            let read = limited.read_until(b'\n', &mut line);
            let first = fields.bytes == 0;
            fields.bytes += read.map_err(Problem::Read)? as u64;
            if first && !line.starts_with(b"NRRD000") {
                return Err(bad("it does not begin with 'NRRD000'"));
            }
            if fields.bytes >= MAX_HEADER_SIZE {
                return Err(Problem::TooLarge("a header of a megabyte".into()));
            }
            let text = String::from_utf8_lossy(&line);
            let text = text.trim();
            // Stop at an empty line, after which data follow. The header of a separate file may end
            // without one.
            if text.is_empty() {
                return Ok(fields);
            }
            // Skip notes, which have `:=`.
            if let Some((name, value)) = text.split_once(": ").filter(|_| !text.starts_with('#')) {
                let name = match name.trim().to_ascii_lowercase().as_str() {
                    "datafile" => "data file".to_owned(),
                    "lineskip" => "line skip".to_owned(),
                    "byteskip" => "byte skip".to_owned(),
                    other => other.to_owned(),
                };
                fields.list.push((name, value.trim().to_owned()));
            }
        }
    }

    pub(super) fn take(&mut self, name: &str) -> Option<String> {
        let at = self.list.iter().position(|(n, _)| n == name)?;
        Some(self.list.swap_remove(at).1)
    }

    pub(super) fn required(&mut self, name: &str) -> Result<String, Problem> {
        let missing = || bad(&format!("its header has no '{name}'"));
        self.take(name).ok_or_else(missing)
    }

    pub(super) fn number<I: std::str::FromStr>(
        &mut self,
        name: &str,
    ) -> Result<Option<I>, Problem> {
        let Some(text) = self.take(name) else {
            return Ok(None);
        };
        let number = text.parse().map(Some);
        number.map_err(|_| bad(&format!("its '{name}' is '{text}'")))
    }

    /// Returns a value of several words.
    pub(super) fn all<T>(
        &mut self,
        name: &str,
        parse: impl Fn(&str) -> Option<T>,
    ) -> Result<Option<Vec<T>>, Problem> {
        let Some(text) = self.take(name) else {
            return Ok(None);
        };
        let close = text.replace(", ", ",");
        let words: Option<Vec<T>> = close.split_whitespace().map(parse).collect();
        let wrong = || bad(&format!("its '{name}' is '{text}'"));
        words.map(Some).ok_or_else(wrong)
    }
}
