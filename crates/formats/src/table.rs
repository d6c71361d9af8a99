//! Text files with two columns of numbers, separated by blanks, tabs, commas or semicolons. Lines
//! that begin with `#` are comments, and a first line of words names the columns.

use crate::error::{FileError, Problem};
use crate::input;
use std::path::Path;

/// Maximum size of a file, in bytes.
const MAX_SIZE: usize = 16 << 20;

/// Reads the first two columns of a file.
///
/// # Errors
/// A file that cannot be read, or that has a line without two finite numbers at its beginning.
pub fn read(path: &Path) -> Result<Vec<[f64; 2]>, FileError> {
    let bytes = input::read(path)?;
    parse(&bytes).map_err(|(line, problem)| FileError {
        line,
        ..problem.at(path)
    })
}

fn parse(bytes: &[u8]) -> Result<Vec<[f64; 2]>, (Option<usize>, Problem)> {
    if bytes.len() > MAX_SIZE {
        let message = format!("a table of more than {MAX_SIZE} bytes");
        return Err((None, Problem::TooLarge(message)));
    }
    let text = String::from_utf8_lossy(bytes);
    let lines = text
        .trim_start_matches('\u{feff}')
        .lines()
        .map(str::trim)
        .enumerate();
    let mut lines = lines
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
        .peekable();
    let is_heading = |line: &str| line.starts_with(|c: char| c.is_alphabetic() || c == '"');
    lines.next_if(|(_, line)| is_heading(line));
    let row = |(i, line): (usize, &str)| {
        let message = "expected two numbers".to_owned();
        pair(line).ok_or((Some(i + 1), Problem::Malformed(message)))
    };
    lines.map(row).collect()
}

/// Returns the first two numbers of a line.
fn pair(line: &str) -> Option<[f64; 2]> {
    let words = line
        .split([' ', '\t', ',', ';'])
        .filter(|word| !word.is_empty());
    let mut numbers = words.map(|word| word.parse().ok().filter(|v: &f64| v.is_finite()));
    Some([numbers.next()??, numbers.next()??])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_read_however_they_are_divided() {
        let pairs = vec![[0.0, 1.5], [0.25, 1.25]];
        for text in [
            "0 1.5\n0.25\t1.25 rest\n",
            "# depth, n\n\n0,1.5\n0.25, 1.25\n",
            "\u{feff}\"z\";\"n\"\r\n0;1.5\r\n.25;1.25",
        ] {
            assert_eq!(parse(text.as_bytes()).unwrap(), pairs, "{text}");
        }
        for (text, at) in [
            ("0 1\n1 x", 2),
            ("0 1\nz n\n1 1", 2),
            ("1\n", 1),
            ("0 nan", 1),
        ] {
            assert_eq!(parse(text.as_bytes()).unwrap_err().0, Some(at), "{text}");
        }
    }
}
