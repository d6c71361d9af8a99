//! The user's browser.

use crate::command_error::warn;

/// Opens an address in the browser; a failure is a warning, since the address is printed, too.
pub fn open(address: &str) {
    if let Err(error) = open::that_detached(address) {
        warn(&format!(
            "--open: no browser could be started: {error}; open the printed address"
        ));
    }
}
