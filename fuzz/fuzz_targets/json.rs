#![no_main]

use io::{Diagnostics, json};

libfuzzer_sys::fuzz_target!(|text: &str| {
    let mut diagnostics = Diagnostics::new();
    let _ = json::parse(text, "scene.json", &[], &mut diagnostics);
    let _ = diagnostics.to_string();
});
