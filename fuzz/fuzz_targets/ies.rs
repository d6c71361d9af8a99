#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = io::ies::parse(bytes);
});
