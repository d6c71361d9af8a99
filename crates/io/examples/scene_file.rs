//! Reads a scene file, renders it and writes the picture.
//!
//! `cargo run --release -p morgana-io --example scene_file -- scenes/mirage.xml mirage.png`
//!
//! Without arguments it writes a small scene of its own into the system's folder for temporary files.

use morgana_io::rendered::Picture;
use morgana_io::{LoadOptions, Run, load_scene};
use std::error::Error;
use std::path::PathBuf;

const SCENE: &str = r#"<scene version="3.0.0">
    <integrator type="path"/>
    <sensor type="perspective">
        <float name="fov" value="30"/>
        <transform name="to_world"><lookat origin="0, 0, -5" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/></film>
        <sampler type="independent"><integer name="sample_count" value="8"/></sampler>
    </sensor>
    <emitter type="constant"/>
    <shape type="sphere">
        <bsdf type="null"/>
        <medium name="interior" type="homogeneous">
            <float name="sigma_t" value="1"/>
            <float name="albedo" value="0.5"/>
            <volume name="ior" type="luneburg"/>
        </medium>
    </shape>
</scene>"#;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let folder = std::env::temp_dir();
    let scene = match arguments.next() {
        Some(path) => path,
        None => {
            let path = folder.join("morgana_example.xml");
            std::fs::write(&path, SCENE)?;
            path
        }
    };
    let picture = arguments.next();
    let picture = picture.unwrap_or_else(|| folder.join("morgana_example.png"));

    let loaded = load_scene(&scene, &LoadOptions::default())?;
    eprint!("{}", loaded.warnings);
    let rendering = Run::new(&loaded).render()?;
    let (mean, error) = rendering.film.summary();
    println!(
        "{} samples per pixel, mean {mean:.4} ± {error:.4}",
        rendering.samples
    );
    Picture::new(&rendering, &loaded, Vec::new()).write(&picture)?;
    println!("wrote {}", picture.display());
    Ok(())
}
