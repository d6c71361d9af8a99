//! Failures of commands, and their messages to the user.

use io::diagnostic::Style;
use io::{Diagnostics, Refusal};
use std::io::{ErrorKind, IsTerminal, Write};
use std::process::ExitCode;

/// Reason why a command failed.
#[derive(Debug)]
pub enum CommandError {
    /// The command line requests something impossible.
    Usage(String),
    /// The scene cannot be used.
    Scene(Diagnostics),
    /// A failure during the run.
    Runtime(String),
    /// Exit status after the user ended the program before it had anything to write. A message has
    /// said so.
    Interrupted(ExitCode),
    /// The reader of the output has stopped reading. This is no error.
    ReaderGone,
    /// A bug in this program. The panic hook has already reported it.
    Internal,
}

impl CommandError {
    /// Reports the failure to the user, and returns the exit status.
    pub fn report(self) -> ExitCode {
        match self {
            CommandError::Usage(message) => {
                complain(&message);
                ExitCode::from(2)
            }
            CommandError::Scene(diagnostics) => {
                show(&diagnostics);
                ExitCode::from(2)
            }
            CommandError::Runtime(message) => {
                complain(&message);
                ExitCode::FAILURE
            }
            CommandError::Interrupted(status) => status,
            CommandError::ReaderGone => ExitCode::SUCCESS,
            CommandError::Internal => ExitCode::FAILURE,
        }
    }
}

impl From<Diagnostics> for CommandError {
    fn from(diagnostics: Diagnostics) -> Self {
        CommandError::Scene(diagnostics)
    }
}

impl From<Refusal> for CommandError {
    fn from(refusal: Refusal) -> Self {
        CommandError::Usage(refusal.to_string())
    }
}

/// Converts a failure to write to the standard output.
impl From<std::io::Error> for CommandError {
    fn from(error: std::io::Error) -> Self {
        match error.kind() {
            ErrorKind::BrokenPipe => CommandError::ReaderGone,
            _ => CommandError::Runtime(format!("cannot write the output: {error}")),
        }
    }
}

impl From<io::FileError> for CommandError {
    fn from(error: io::FileError) -> Self {
        CommandError::Runtime(error.to_string())
    }
}

fn complain(message: &str) {
    let mut diagnostics = Diagnostics::new();
    message
        .lines()
        .for_each(|line| diagnostics.push(io::Diagnostic::error(line)));
    show(&diagnostics);
}

/// Shows a warning.
pub fn warn(message: &str) {
    let mut diagnostics = Diagnostics::new();
    diagnostics.push(io::Diagnostic::warning(message));
    show(&diagnostics);
}

/// Shows messages on the standard error, with colours if it is a terminal.
pub fn show(diagnostics: &Diagnostics) {
    let mut stderr = std::io::stderr();
    let text = diagnostics.render(Style::detect(stderr.is_terminal()));
    // If this write fails, there is no other place for the message.
    let _ = stderr.write_all(text.as_bytes());
}

/// Installs a panic hook that reports a bug in this program in one line. If RUST_BACKTRACE is set,
/// the hook shows the runtime's own message, too.
pub fn hide_panics() {
    let default = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if std::env::var_os("RUST_BACKTRACE").is_some() {
            default(panic);
        }
        let place = panic
            .location()
            .map_or(String::new(), |l| format!(" at {l}"));
        let payload = panic.payload();
        let text = payload.downcast_ref::<&str>().copied();
        let text = text.or(payload.downcast_ref::<String>().map(String::as_str));
        let message = text.unwrap_or("unknown");
        complain(&format!(
            "internal error{place}: {message}; please report it"
        ));
    }));
}
