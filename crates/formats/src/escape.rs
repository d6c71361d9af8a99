//! Escaping of external texts and names, which must not control a terminal.

use std::borrow::Cow;
use std::path::Path;

/// Returns a text with its control characters written as `\u{1b}`, `\n` and so on, including
/// characters that change the direction of writing.
pub fn escaped(text: &str) -> Cow<'_, str> {
    if !text.chars().any(drives) {
        return text.into();
    }
    let mut out = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if drives(c) {
            out.extend(c.escape_default())
        } else {
            out.push(c)
        }
    }
    out.into()
}

/// Returns the [`escaped`] name of a file.
pub fn shown(path: &Path) -> String {
    escaped(&path.to_string_lossy()).into_owned()
}

/// Returns true if a character controls a terminal instead of being visible.
pub fn drives(c: char) -> bool {
    let turns = matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    c.is_control() || turns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_drives_a_terminal_is_written_out() {
        assert_eq!(escaped("fog über 米"), "fog über 米");
        assert_eq!(
            escaped("a\u{1b}[2Jb\n\r\t\u{9b}\u{202e}c"),
            r"a\u{1b}[2Jb\n\r\t\u{9b}\u{202e}c"
        );
    }
}
