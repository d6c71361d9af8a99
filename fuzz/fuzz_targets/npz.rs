#![no_main]

use io::volume::{AxisOrder, Options, npz};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = npz::parse::<f32>(bytes, Options::order(AxisOrder::ZYX));
});
