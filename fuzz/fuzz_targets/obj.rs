#![no_main]

use io::mesh::obj;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = obj::parse(bytes);
});
