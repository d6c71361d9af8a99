//! Fingerprints of the results of estimators and meters.

/// Name of each estimator and each kind of meter, with the beginning of a hash of its result in a
/// small scene, to five digits. Parts must not be added up if their builds differ in a fingerprint
/// that the run uses. `io/tests/io/results.rs` computes the hashes.
pub const RESULTS: [(&str, &str); 9] = [
    ("path", "82e67c8f0cebf1b1"),
    ("particle", "18ecd8eeec308f4c"),
    ("bdpt", "f7f5af586547bf0d"),
    ("vcm", "62c4fcf25f319264"),
    ("photon", "df7a6992e6d4879a"),
    ("sppm", "59c573cd53181730"),
    ("preview", "ceeaac3b05672368"),
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
