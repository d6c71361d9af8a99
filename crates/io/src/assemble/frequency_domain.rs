//! Modulated light: requested frequencies (docs/theory.md#frequency-domain).

use crate::diagnostic::lints;
use crate::query::Query;
use transport::frequency_domain::FrequencyDomain;

/// Frequency in Hz below which light in tissue has no measurable phase.
const MIN_PLAUSIBLE: f64 = 1e4;

/// Reads the frequencies at which a meter measures modulated light, if any are requested.
pub(super) fn frequency_domain(q: &mut Query) -> Option<FrequencyDomain> {
    let name = "modulation_frequencies";
    if !q.has(name) {
        return None;
    }
    let hertz = q.numbers(name);
    if !q.has("metres_per_unit") {
        let message = format!(
            "'{name}' needs 'metres_per_unit', the length of a scene unit in metres: 1e-3 if scene units are mm"
        );
        q.error(name, message);
        return None;
    }
    let increasing = hertz.is_sorted_by(|a, b| a < b);
    let domain = FrequencyDomain::new(&hertz, q.float("metres_per_unit"));
    let domain = domain.filter(|_| increasing);
    if domain.is_none() {
        let message = format!(
            "'{name}' are 1 to {} frequencies in Hz, positive and increasing, but they are '{}'",
            FrequencyDomain::MAX_FREQUENCIES,
            q.string(name)
        );
        q.error(name, message);
    }
    if let Some(slow) = hertz.iter().find(|f| (0.0..MIN_PLAUSIBLE).contains(*f)) {
        let message = format!(
            "'{name}' are in Hz, and light of {slow} Hz has hardly any phase: write 100e6 for 100 MHz"
        );
        q.warning(lints::MODULATION, name, message);
    }
    domain
}
