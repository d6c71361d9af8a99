#![no_main]

use io::volume::vtk;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = vtk::parse::<f32>(bytes, None);
});
