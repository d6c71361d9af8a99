//! `morgana schema`: what scenes in JSON may say, for editors.

use crate::command_error::CommandError;
use std::io::Write;
use std::process::ExitCode;

/// Prints the JSON Schema.
pub fn schema() -> Result<ExitCode, CommandError> {
    let schema = io::schema::json_schema();
    std::io::stdout().write_all(schema.as_bytes())?;
    Ok(ExitCode::SUCCESS)
}
