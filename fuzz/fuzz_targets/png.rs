#![no_main]

use io::image::png;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = png::decode(bytes);
});
