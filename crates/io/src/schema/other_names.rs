//! Names that users try, for suggestions in messages.

use crate::scene::PluginKind;

/// Volumes that are easily mistaken for each other: a quantity and a refractive index have different
/// volumes.
const ELSEWHERE: [(&str, &str); 4] = [
    ("gridvolume", "bspline"),
    ("bspline", "gridvolume"),
    ("constvolume", "constant"),
    ("constant", "constvolume"),
];

/// Returns the plugin among `known` to use instead of one that belongs elsewhere.
pub(crate) fn counterpart(kind: PluginKind, name: &str, known: &[&str]) -> Option<&'static str> {
    let mut rows = ELSEWHERE.iter();
    let row = rows.find(|(this, other)| *this == name && known.contains(other));
    row.filter(|_| kind == PluginKind::Volume)
        .map(|(_, other)| *other)
}

/// Common names of parameters in other programs and in the literature, with the parameter's name.
const SYNONYMS: [(PluginKind, &str, &str); 6] = [
    (PluginKind::Medium, "mua", "sigma_a"),
    (PluginKind::Medium, "mu_a", "sigma_a"),
    (PluginKind::Medium, "mus", "sigma_s"),
    (PluginKind::Medium, "mu_s", "sigma_s"),
    (PluginKind::Medium, "mut", "sigma_t"),
    (PluginKind::Medium, "mu_t", "sigma_t"),
];

/// Returns the parameter that has another name elsewhere.
pub(crate) fn synonym(kind: PluginKind, name: &str) -> Option<&'static str> {
    let mut rows = SYNONYMS.iter();
    let row = rows.find(|(of, this, _)| *of == kind && this.eq_ignore_ascii_case(name));
    row.map(|(.., known)| *known)
}
