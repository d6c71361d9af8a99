//! Text files.

use crate::diagnostic::{Diagnostic, SourceFile, shown};
use crate::input;
use std::path::Path;
use std::sync::Arc;

/// Reads a file as UTF-8 text. Removes the byte order mark that some editors write.
pub(crate) fn read(path: &Path) -> Result<Arc<SourceFile>, Diagnostic> {
    let bytes = input::read(path)?;
    let mut text = String::from_utf8(bytes).map_err(|e| not_utf8(path, &e))?;
    if text.starts_with('\u{feff}') {
        text.remove(0);
    }
    Ok(SourceFile::new(path, text))
}

fn not_utf8(path: &Path, error: &std::string::FromUtf8Error) -> Diagnostic {
    let before = &error.as_bytes()[..error.utf8_error().valid_up_to()];
    let line = 1 + before.iter().filter(|byte| **byte == b'\n').count();
    let message = format!("{}:{line}: not UTF-8 text", shown(path));
    Diagnostic::error(message).help("save the file as UTF-8".to_owned())
}

/// Returns the beginning of a text, for messages.
pub(crate) fn shorten(text: &str) -> String {
    const LIMIT: usize = 40;
    match text.char_indices().nth(LIMIT) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}
