#![no_main]

use io::volume::vdb;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = vdb::parse::<f32>(bytes, None);
});
