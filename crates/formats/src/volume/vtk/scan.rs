//! Scanner of the content of `.vtk` files.

use std::io::{BufRead, Read, Seek, SeekFrom};

use glam::DVec3;

use super::{bad, word};
use crate::element::Element;
use crate::error::Problem;

/// Longest accepted line, in bytes.
const MAX_LINE_LENGTH: u64 = 4096;

/// An array of values.
pub(super) struct Array {
    pub name: String,
    pub element: Element,
    pub components: usize,
    /// Number of values of all components.
    pub count: usize,
    pub on_points: bool,
    /// Offset and length of the values in the file, in bytes.
    pub at: u64,
    pub bytes: u64,
}

/// Content of a file.
pub(super) struct File {
    pub binary: bool,
    pub dimensions: [usize; 3],
    pub origin: DVec3,
    pub spacing: DVec3,
    pub arrays: Vec<Array>,
}

impl File {
    /// Reads everything except the values of arrays.
    pub(super) fn scan(reader: &mut (impl BufRead + Seek), size: u64) -> Result<Self, Problem> {
        let mut scanner = Scanner {
            reader,
            size,
            binary: false,
            // Store the number of samples, and true for samples at points, once the file states
            // them.
            samples: None,
        };
        scanner.head()?;
        let mut file = File {
            binary: scanner.binary,
            dimensions: [0; 3],
            origin: DVec3::ZERO,
            spacing: DVec3::ONE,
            arrays: Vec::new(),
        };
        while let Some(line) = scanner.line()? {
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            match words[..] {
                ["DATASET", "STRUCTURED_POINTS"] => {}
                ["DATASET", other] => {
                    let message = format!("VTK data of type {other} (only STRUCTURED_POINTS are)");
                    return Err(Problem::Unsupported(message));
                }
                ["DIMENSIONS", x, y, z] => file.dimensions = three([x, y, z])?,
                ["ORIGIN", x, y, z] => file.origin = three([x, y, z])?.into(),
                ["SPACING" | "ASPECT_RATIO", x, y, z] => file.spacing = three([x, y, z])?.into(),
                ["POINT_DATA", n] => scanner.samples = Some((number(n)?, true)),
                ["CELL_DATA", n] => scanner.samples = Some((number(n)?, false)),
                ["SCALARS", name, kind] => file.arrays.push(scanner.scalars(name, kind, "1")?),
                ["SCALARS", name, kind, n] => file.arrays.push(scanner.scalars(name, kind, n)?),
                ["VECTORS" | "NORMALS", name, kind] => {
                    let (n, _) = scanner.samples()?;
                    file.arrays.extend(scanner.array(name, kind, 3, n)?);
                }
                ["FIELD", _, arrays] => {
                    let arrays: usize = number(arrays)?;
                    for _ in 0..arrays {
                        file.arrays.extend(scanner.field()?);
                    }
                }
                ["METADATA"] => scanner.skip_paragraph()?,
                _ => {
                    let message = format!("the line '{}' in a .vtk file", line.trim());
                    return Err(Problem::Unsupported(message));
                }
            }
        }
        Ok(file)
    }
}

struct Scanner<'r, R> {
    reader: &'r mut R,
    size: u64,
    binary: bool,
    samples: Option<(usize, bool)>,
}

impl<R: BufRead + Seek> Scanner<'_, R> {
    /// Reads the first lines: version, title, kind of data.
    fn head(&mut self) -> Result<(), Problem> {
        let version = self.raw_line()?;
        if !version.starts_with("# vtk DataFile Version") {
            return Err(bad("it does not begin with '# vtk DataFile Version'"));
        }
        self.raw_line()?;
        self.binary = match self.raw_line()?.trim() {
            "ASCII" => false,
            "BINARY" => true,
            other => return Err(bad(&format!("'{other}' instead of ASCII or BINARY"))),
        };
        Ok(())
    }

    fn scalars(&mut self, name: &str, kind: &str, components: &str) -> Result<Array, Problem> {
        let table = self.line()?.unwrap_or_default();
        if !table.starts_with("LOOKUP_TABLE") {
            return Err(bad(&format!("SCALARS {name} has no LOOKUP_TABLE")));
        }
        let (n, _) = self.samples()?;
        let array = self.array(name, kind, number(components)?, n)?;
        array.ok_or_else(|| bad("SCALARS before POINT_DATA"))
    }

    /// Reads an array of a field. Returns `None` for arrays that belong neither to points nor to
    /// cells.
    fn field(&mut self) -> Result<Option<Array>, Problem> {
        loop {
            let line = self.line()?.unwrap_or_default();
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            match words[..] {
                ["METADATA"] => self.skip_paragraph()?,
                [name, components, n, kind] => {
                    return self.array(name, kind, number(components)?, number(n)?);
                }
                _ => return Err(bad(&format!("'{}' instead of an array", line.trim()))),
            }
        }
    }

    /// Reads an array whose values begin at the current position, and skips the values.
    fn array(
        &mut self,
        name: &str,
        kind: &str,
        components: usize,
        n: usize,
    ) -> Result<Option<Array>, Problem> {
        let element = element(kind)?;
        let at = self.position()?;
        let too_large = || Problem::TooLarge(format!("an array of {n} x {components}"));
        let count = n.checked_mul(components).ok_or_else(too_large)?;
        let bytes = if self.binary {
            let bytes = (count as u64).checked_mul(element.size() as u64);
            let end = bytes.and_then(|bytes| bytes.checked_add(at));
            let end = end.ok_or_else(too_large)?;
            if end > self.size {
                return Err(Problem::Truncated {
                    expected: end,
                    found: self.size,
                });
            }
            let seek = self.reader.seek(SeekFrom::Start(end));
            seek.map_err(Problem::Read)? - at
        } else {
            for _ in 0..count {
                self.skip_word()?;
            }
            self.position()? - at
        };
        Ok(self.samples.map(|(_, on_points)| Array {
            name: decoded(name),
            element,
            components,
            count,
            on_points,
            at,
            bytes,
        }))
    }

    fn samples(&self) -> Result<(usize, bool), Problem> {
        self.samples
            .ok_or_else(|| bad("an array before POINT_DATA and CELL_DATA"))
    }

    fn position(&mut self) -> Result<u64, Problem> {
        self.reader.stream_position().map_err(Problem::Read)
    }

    /// Returns the next line that is not empty; `None` at the end of the file.
    fn line(&mut self) -> Result<Option<String>, Problem> {
        loop {
            let line = self.raw_line()?;
            if line.is_empty() || !line.trim().is_empty() {
                return Ok(Some(line).filter(|line| !line.is_empty()));
            }
        }
    }

    /// Returns the next line with its line break; empty at the end of the file.
    fn raw_line(&mut self) -> Result<String, Problem> {
        let mut line = Vec::new();
        let mut limited = self.reader.by_ref().take(MAX_LINE_LENGTH);
        limited
            .read_until(b'\n', &mut line)
            .map_err(Problem::Read)?;
        match String::from_utf8(line) {
            Ok(line) if (line.len() as u64) < MAX_LINE_LENGTH => Ok(line),
            _ => Err(bad("something other than a line of text between its data")),
        }
    }

    /// Skips lines up to an empty line.
    fn skip_paragraph(&mut self) -> Result<(), Problem> {
        while !self.raw_line()?.trim().is_empty() {}
        Ok(())
    }

    fn skip_word(&mut self) -> Result<(), Problem> {
        let mut inside = false;
        loop {
            let buffer = self.reader.fill_buf().map_err(Problem::Read)?;
            if buffer.is_empty() {
                return if inside {
                    Ok(())
                } else {
                    Err(bad("an array ends early"))
                };
            }
            for (i, byte) in buffer.iter().enumerate() {
                match (byte.is_ascii_whitespace(), inside) {
                    (true, true) => {
                        self.reader.consume(i);
                        return Ok(());
                    }
                    (blank, _) => inside = !blank,
                }
            }
            let all = buffer.len();
            self.reader.consume(all);
        }
    }
}

fn element(kind: &str) -> Result<Element, Problem> {
    let same = |element: &Element| *element != Element::F16 && word(*element) == kind;
    let found = Element::ALL.into_iter().find(same);
    let found = found.or((kind == "char").then_some(Element::I8));
    found.ok_or_else(|| match kind {
        "long" | "unsigned_long" | "vtkIdType" => Problem::Unsupported(format!(
            "numbers of type '{kind}', whose size is not the same everywhere; write them as int or double"
        )),
        _ => Problem::Unsupported(format!("numbers of type '{kind}'")),
    })
}

fn number<N: std::str::FromStr>(word: &str) -> Result<N, Problem> {
    let other = |_| bad(&format!("'{word}' instead of a number"));
    word.parse().map_err(other)
}

fn three<N: std::str::FromStr>([x, y, z]: [&str; 3]) -> Result<[N; 3], Problem> {
    Ok([number(x)?, number(y)?, number(z)?])
}

/// Decodes a name in which VTK wrote special characters as `%` and two hexadecimal digits.
fn decoded(name: &str) -> String {
    let mut bytes = Vec::with_capacity(name.len());
    let mut rest = name.as_bytes();
    while let [first, tail @ ..] = rest {
        let pair = tail.get(..2).and_then(|pair| str::from_utf8(pair).ok());
        let code = pair.and_then(|pair| u8::from_str_radix(pair, 16).ok());
        match (first, code) {
            (b'%', Some(code)) => {
                bytes.push(code);
                rest = &tail[2..];
            }
            _ => {
                bytes.push(*first);
                rest = tail;
            }
        }
    }
    String::from_utf8(bytes).unwrap_or_else(|_| name.to_owned())
}
