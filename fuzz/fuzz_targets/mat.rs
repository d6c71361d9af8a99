#![no_main]

use io::volume::{AxisOrder, Options, mat};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = mat::parse::<f32>(bytes, Options::order(AxisOrder::ZYX));
});
