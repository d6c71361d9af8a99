//! `morgana view`.

use crate::args::ViewArgs;
use crate::browser;
use crate::command_error::{CommandError, warn};
use crate::interrupt::Interrupt;
use crate::load::check_defines;
use crate::output::say;
use std::process::ExitCode;
use std::time::Duration;
use view::{Item, ItemOptions, OpenError, Page, ViewOptions, ViewServer};

/// Time between checks for a request to end.
const CHECK_INTERVAL: Duration = Duration::from_millis(100);

/// Shows files in the browser until the user ends the program.
pub fn view(args: &ViewArgs) -> Result<ExitCode, CommandError> {
    check_defines(&args.defines)?;
    let options = ItemOptions {
        defines: args.defines.clone(),
        limits: args.memory.limits(),
    };
    let open = |file| {
        Item::open(file, &options).map_err(|error| match error {
            OpenError::File(error) => CommandError::Usage(error.to_string()),
            OpenError::Scene(diagnostics) => CommandError::Scene(diagnostics),
        })
    };
    let files = args.files.iter().map(|file| open(file));
    let items = files.collect::<Result<_, _>>()?;
    let interrupt = Interrupt::watch()?;
    let options = ViewOptions {
        listen: args.listen,
        port: args.port,
        ..ViewOptions::default()
    };
    let server = ViewServer::start(Page::new(items).into(), &options).map_err(|e| {
        CommandError::Usage(format!(
            "cannot listen at {} port {}: {e}; choose another --port (0 for any free one) or --listen",
            args.listen, args.port
        ))
    })?;
    if !args.listen.is_loopback() {
        warn("anyone who can reach this machine and knows the address below can see the files");
    }
    say(&format!("{} (Ctrl-C ends)", server.address()))?;
    if args.open {
        browser::open(&server.address());
    }
    while !interrupt.requested() {
        std::thread::sleep(CHECK_INTERVAL);
    }
    Ok(ExitCode::SUCCESS)
}
