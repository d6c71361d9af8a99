#![no_main]

use io::mesh::serialized;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = serialized::parse(bytes, 0);
});
