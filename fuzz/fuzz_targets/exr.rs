#![no_main]

use io::image::exr;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = exr::decode(bytes);
});
