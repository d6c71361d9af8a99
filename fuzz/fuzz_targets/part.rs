#![no_main]

use io::part::Part;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = Part::from_bytes(bytes);
});
