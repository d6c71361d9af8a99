//! Energy balance as text.

use crate::numbers;
use transport::render::{EnergyBalance, Share};

/// Formats the balance as emitted = absorbed + escaped + ..., with the rest as left over. Entries
/// that are certainly zero are left out.
pub fn text(b: &EnergyBalance) -> String {
    let entries = [
        ("absorbed by media", b.media),
        ("by surfaces", b.surfaces),
        ("escaped", b.escaped),
        ("cut off at max_depth", b.cut),
        ("lost", b.lost),
        ("left over", b.residual),
    ];
    let fluorescence = Some(b.fluorescence).filter(|share| share.mean > 0.0);
    let fluorescence = fluorescence.map_or_else(String::new, |share| {
        let power = numbers::with_error(share.mean, share.error);
        format!(", and as fluorescence {power}")
    });
    let text = |(name, share): &(&str, Share)| {
        format!("{name} {}", numbers::with_error(share.mean, share.error))
    };
    let there = entries
        .iter()
        .filter(|(_, s)| s.mean.abs() > 1e-12 * b.emitted || s.error > 1e-12 * b.emitted);
    let mut parts: Vec<String> = there.map(text).collect();
    if parts.is_empty() {
        parts.push("there is no light".into());
    }
    format!(
        "emitted {}{fluorescence}: {}",
        numbers::plain(b.emitted),
        parts.join(" · ")
    )
}
