//! Fingerprints of the results of estimators and meters.

/// Name of each estimator and each kind of meter, with the beginning of a hash of its result in a
/// small scene, to five digits. Parts must not be added up if their builds differ in a fingerprint
/// that the run uses. `io/tests/io/results.rs` computes the hashes.
pub const RESULTS: [(&str, &str); 8] = [
    ("path", "8083d3722b9fff5f"),
    ("particle", "dcfa42d55cce81ac"),
    ("bdpt", "82589a10619f70a1"),
    ("vcm", "542b29a036d48872"),
    ("photon", "8c710500bec6bce1"),
    ("sppm", "96a43dade5813398"),
    ("fluence", "378767ea8f232d40"),
    ("irradiance", "d9ad2f2b0f47283b"),
];

/// Fingerprints of the named estimators and meters, in the order of the table. Unknown names have
/// none.
pub fn results<'a>(names: impl Iterator<Item = &'a str> + Clone) -> String {
    let is_used = |name: &str| names.clone().any(|used| used == name);
    let used = RESULTS.iter().filter(|(name, _)| is_used(name));
    let found: Vec<&str> = used.map(|(_, found)| *found).collect();
    found.join(" ")
}
