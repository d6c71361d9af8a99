//! Suggestion "did you mean": the known name closest to a misspelt name.

/// Minimum similarity of a plausible misspelling.
const MIN_SIMILARITY: f64 = 0.8;

/// Returns the candidate most similar to `name`, if it is similar enough to be a misspelling.
pub fn closest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // Similarity is quadratic in length; no real name is this long.
    if name.len() > 100 {
        return None;
    }
    let lower = name.to_lowercase();
    let score = |candidate: &str| similarity(&lower, &candidate.to_lowercase());
    let scored = candidates
        .into_iter()
        .map(|c| (score(c), c))
        .filter(|(s, _)| *s >= MIN_SIMILARITY);
    // Take the first of equally similar candidates, so that the suggestion does not depend on later
    // candidates.
    scored
        .reduce(|best, next| if next.0 > best.0 { next } else { best })
        .map(|(_, c)| c)
}

/// Returns `did you mean 'x'?` for the candidate closest to `name`, if one is close.
///
/// ```
/// let help = morgana_io::diagnostic::suggest("sigma_tt", ["sigma_t", "albedo"]);
/// assert_eq!(help.as_deref(), Some("did you mean 'sigma_t'?"));
/// assert_eq!(morgana_io::diagnostic::suggest("radius", ["sigma_t", "albedo"]), None);
/// ```
pub fn suggest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<String> {
    closest(name, candidates).map(|c| format!("did you mean '{c}'?"))
}

/// Returns the similarity of two names. Jaro-Winkler finds long names with a common start; a single
/// edit in a short name counts as similar, too.
fn similarity(a: &str, b: &str) -> f64 {
    let edits = strsim::damerau_levenshtein(a, b);
    let near = edits <= 1 && a.len().max(b.len()) > 2;
    let score = strsim::jaro_winkler(a, b);
    if near { score.max(0.95) } else { score }
}
