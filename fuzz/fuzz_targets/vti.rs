#![no_main]

use io::volume::vti;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = vti::parse::<f32>(bytes, None);
});
