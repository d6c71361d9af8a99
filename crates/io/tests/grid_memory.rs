//! Memory of a grid of the index from its file to the scene: little more than its samples.
//!
//! This file has a single test, because the allocator counts the memory of the whole program.

use morgana_io::LoadOptions;
use morgana_io::volume::{Volume, write};
use peak_alloc::PeakAlloc;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Memory in bytes for tables, buffers, and the rest of the scene.
const SMALL: usize = 2 << 20;

#[test]
fn a_grid_of_floats_is_held_once() {
    const SIDE: usize = 128;
    let index = |i: usize| {
        1.33 + 1e-3 * (0.01 * (i % SIDE) as f32).sin() * (i / SIDE % SIDE) as f32 / 128.0
    };
    let folder = tempfile::tempdir().unwrap();
    let data = (0..SIDE.pow(3)).map(index).collect();
    let volume = Volume::<f32>::new([SIDE; 3], 1, data).unwrap();
    for name in ["n.npy", "n.vol", "n.nrrd"] {
        write(&folder.path().join(name), &volume, "n").unwrap();
    }
    drop(volume);
    let order = r#"<string name="axis_order" value="zyx"/>"#;
    let law = r#"<float name="scale" value="1.001"/><float name="offset" value="-0.001"/>"#;
    for (name, more) in [
        ("n.npy", format!("{order}{law}")),
        ("n.vol", String::new()),
        ("n.nrrd", String::new()),
    ] {
        let text = format!(
            r#"<scene version="3.0.0"><sensor type="perspective"/><emitter type="constant"/>
               <shape type="cube"><bsdf type="null"/><medium type="transparent" name="interior">
                 <volume name="ior" type="bspline"><string name="filename" value="{name}"/>{more}
                   <string name="placement" value="centers"/><string name="smoothing" value="auto"/>
                   <transform name="to_world"><translate value="-0.5"/><scale value="2.1"/></transform>
               </volume></medium></shape></scene>"#
        );
        let path = folder.path().join("scene.xml");
        std::fs::write(&path, text).unwrap();
        ALLOCATOR.reset_peak_usage();
        let before = ALLOCATOR.current_usage();
        let loaded = morgana_io::load_scene(&path, &LoadOptions::default()).unwrap();
        let peak = ALLOCATOR.peak_usage() - before;
        drop(loaded);
        let samples = size_of::<f32>() * SIDE.pow(3);
        assert!(
            peak > samples && peak < samples * 13 / 10 + SMALL,
            "{name}: {peak} bytes"
        );
    }
}
