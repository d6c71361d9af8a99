//! The table of sources in the guide to tissue optics: each can be loaded without a warning, and emits one watt.

use morgana_io::image::{ImageLayers, Layer, exr};
use morgana_io::{LoadOptions, npy};
use std::path::Path;

/// The files that the table names.
fn write_files(folder: &Path) {
    let channel = |name: &str| {
        let values = (0..24).map(|i| 0.25 + (i % 3) as f32).collect();
        (name.to_owned(), values)
    };
    let layer = Layer {
        name: String::new(),
        channels: ["B", "G", "R"].map(channel).into(),
    };
    let image = ImageLayers {
        width: 6,
        height: 4,
        layers: vec![layer],
        attributes: Vec::new(),
    };
    exr::write(&folder.join("pattern.exr"), &image).unwrap();
    let values: Vec<f32> = (0..24).map(|i| (i % 5) as f32).collect();
    npy::write(&folder.join("density.npy"), &[2, 3, 4], &values).unwrap();
}

/// The emitters of the table, as they stand there.
fn emitters() -> Vec<String> {
    let guide = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/guides/tissue-optics.md");
    let guide = std::fs::read_to_string(guide).unwrap();
    let (_, section) = guide.split_once("\n## Sources\n").unwrap();
    let (section, _) = section.split_once("\n## ").unwrap();
    let rows = section.lines().filter(|line| line.starts_with('|'));
    let code = rows.flat_map(|row| row.split('`').map(str::to_owned));
    code.filter(|code| code.starts_with('{')).collect()
}

#[test]
fn sources_of_the_guide_emit_one_watt() {
    let folder = tempfile::tempdir().unwrap();
    write_files(folder.path());
    let all = emitters();
    assert_eq!(all.len(), 14);
    for emitter in all {
        let path = folder.path().join("scene.json");
        let film = r#""film": {"type": "hdrfilm", "pixel_format": "luminance"}"#;
        let scene = format!(
            r#"{{"type": "scene", "sensor": {{"type": "perspective", "fov": 40, {film}}}, "source": {emitter}}}"#
        );
        std::fs::write(&path, scene).unwrap();
        let loaded = morgana_io::load_scene(&path, &LoadOptions::default())
            .unwrap_or_else(|e| panic!("{emitter}: {e}"));
        let text = loaded.warnings.to_string();
        assert!(!text.contains("warning"), "{emitter}: {text}");
        let power: f64 = loaded.scene().powers(1).map(|power| power[0]).sum();
        assert!((power - 1.0).abs() < 1e-6, "{emitter}: {power}");
    }
}
