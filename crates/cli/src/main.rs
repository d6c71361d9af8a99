//! The `morgana` command: renders scenes, describes them, traces rays through them.
//!
//! The program parses arguments ([`args`]), checks them ([`config`]) and executes them
//! ([`commands`]). Exit status: 0 for success, 1 for a failure while running, 2 for bad input, 130
//! or 143 after an interruption.

mod args;
mod balance;
mod browser;
mod command_error;
mod commands;
mod config;
mod difference;
mod driver;
mod interrupt;
mod job;
mod keeper;
mod load;
mod measured;
mod numbers;
mod oidn;
mod output;
mod overwrites;
mod plot;
mod preview;
mod progress;
mod report;
mod results;
mod shard;
mod svg;
mod trace;
mod watched;

use args::{Args, Command};
use clap::{CommandFactory, FromArgMatches};
use command_error::CommandError;
use std::process::ExitCode;

fn main() -> ExitCode {
    if std::env::args_os()
        .next()
        .is_some_and(|name| commands::is_mcx(&name))
    {
        command_error::hide_panics();
        let arguments = std::env::args_os().skip(1);
        let arguments: Vec<String> = arguments
            .map(|a| a.to_string_lossy().into_owned())
            .collect();
        return ended(|| commands::mcx(&arguments));
    }
    let program = Args::command();
    let matches = program.clone().get_matches();
    let args = Args::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    command_error::hide_panics();
    if let Err(failure) = interrupt::survive_size_limits() {
        return failure.report();
    }
    if let Err(failure) = overwrites::check(&program, &matches) {
        return failure.report();
    }
    ended(|| run(&args.command))
}

/// Runs a command, and reports its failure.
fn ended(
    command: impl FnOnce() -> Result<ExitCode, CommandError> + std::panic::UnwindSafe,
) -> ExitCode {
    match std::panic::catch_unwind(command) {
        Ok(Ok(code)) => code,
        Ok(Err(failure)) => failure.report(),
        Err(_) => CommandError::Internal.report(),
    }
}

fn run(command: &Command) -> Result<ExitCode, CommandError> {
    match command {
        Command::Render(args) => commands::render(args),
        Command::Merge(args) => commands::merge(args),
        Command::Status(args) => commands::status(args),
        Command::Info(args) => commands::info(args),
        Command::Trace(args) => commands::trace(args),
        Command::View(args) => commands::view(args),
        Command::Connect(args) => commands::connect(args),
        Command::Plot(args) => commands::plot(args),
        Command::Convert(args) => commands::convert(args),
        Command::Check(args) => commands::check(args),
        Command::Export(args) => commands::export(args),
        Command::Mcx { arguments } => commands::mcx(arguments),
        Command::Compare(args) => commands::compare(args),
        Command::Tonemap(args) => commands::tonemap(args),
        Command::Denoise(args) => commands::denoise(args),
        Command::Schema { format } => commands::schema(format),
        Command::Completions { shell } => commands::completions(*shell),
        Command::Man { folder } => commands::man(folder),
    }
}
