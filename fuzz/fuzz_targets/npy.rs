#![no_main]

use io::volume::{AxisOrder, Options, npy};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = npy::parse::<f32>(bytes, Options::order(AxisOrder::ZYX));
});
