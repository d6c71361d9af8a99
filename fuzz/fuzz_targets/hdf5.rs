#![no_main]

use io::volume::{AxisOrder, Options, hdf5};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = hdf5::parse::<f32>(bytes, Options::order(AxisOrder::ZYX).of("p_final"));
});
