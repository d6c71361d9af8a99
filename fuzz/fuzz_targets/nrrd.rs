#![no_main]

use io::volume::{AxisOrder, Options, nrrd};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = nrrd::parse::<f32>(bytes, Options::default());
    let _ = nrrd::parse::<f32>(bytes, Options::order(AxisOrder::ZYX));
});
