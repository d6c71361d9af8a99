#![no_main]

use io::mesh::ply;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = ply::parse(bytes);
});
