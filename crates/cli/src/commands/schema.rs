//! `morgana schema`: schemas of scenes, for editors.

use crate::command_error::CommandError;
use std::io::Write;
use std::process::ExitCode;

/// Prints the schema of scenes in JSON or in XML.
pub fn schema(format: &str) -> Result<ExitCode, CommandError> {
    let schema = match format {
        "xsd" => io::xml::xml_schema(),
        _ => io::schema::json_schema(),
    };
    std::io::stdout().write_all(schema.as_bytes())?;
    Ok(ExitCode::SUCCESS)
}
