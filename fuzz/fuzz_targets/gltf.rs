#![no_main]

use io::mesh::gltf;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = gltf::parse(bytes, |_| Ok(vec![0; 1000]));
});
