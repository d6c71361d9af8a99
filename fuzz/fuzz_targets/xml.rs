#![no_main]

use io::{Diagnostics, xml};

libfuzzer_sys::fuzz_target!(|text: &str| {
    let mut diagnostics = Diagnostics::new();
    let _ = xml::parse(text, "scene.xml", &[], &mut diagnostics);
    let _ = diagnostics.to_string();
});
