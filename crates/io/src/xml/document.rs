//! Parsing of XML text, with error messages for users.

use std::sync::Arc;

use roxmltree::{Document, Error, ParsingOptions};

use crate::diagnostic::{Diagnostic, Location, SourceFile};

/// Largest number of elements, texts and comments in a file.
const MAX_NODES: u32 = 10_000_000;

/// Parses the text of `source`.
pub(super) fn parse(source: &Arc<SourceFile>) -> Result<Document<'_>, Diagnostic> {
    let options = ParsingOptions {
        nodes_limit: MAX_NODES,
        ..ParsingOptions::default()
    };
    Document::parse_with_options(source.text(), options).map_err(|e| describe(source, &e))
}

fn describe(source: &Arc<SourceFile>, error: &Error) -> Diagnostic {
    let text = source.text();
    let (message, start) = match error {
        Error::DtdDetected => {
            let start = text.find("<!DOCTYPE").unwrap_or(0);
            (
                "document type declarations and entities are not accepted".to_owned(),
                start,
            )
        }
        Error::NodesLimitReached | Error::AttributesLimitReached => {
            ("the file has too many elements or attributes".to_owned(), 0)
        }
        Error::NoRootNode => ("the file has no root element".to_owned(), text.len()),
        Error::UnclosedRootNode | Error::UnexpectedEndOfStream => (
            "the file ends before its elements are closed".to_owned(),
            text.len(),
        ),
        Error::UnexpectedCloseTag(expected, actual, pos) => {
            let message = format!("expected the closing tag </{expected}>, found </{actual}>");
            (message, source.offset(pos.row as usize, pos.col as usize))
        }
        other => {
            let pos = other.pos();
            let start = source.offset(pos.row as usize, pos.col as usize);
            let said = other.to_string();
            let said = said.rsplit_once(" at ").map_or(&*said, |(said, _)| said);
            let is_element = text.get(start..).is_some_and(|rest| rest.starts_with('<'));
            let message = match other {
                Error::InvalidComment(_) => "'--' must not stand within a comment",
                Error::UnknownToken(_) if is_element => {
                    "nothing may follow the end of the root element"
                }
                _ => said,
            };
            (message.to_owned(), start)
        }
    };
    Diagnostic::error(format!("invalid XML: {message}")).at(&Location::new(source, start, 1))
}
