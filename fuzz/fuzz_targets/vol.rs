#![no_main]

use io::volume::vol;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = vol::parse::<f32>(bytes);
});
