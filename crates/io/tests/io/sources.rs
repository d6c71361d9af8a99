//! Sources of the documents: sources of the guide to tissue optics load without a warning and emit
//! one watt each, as do the examples of the manual.

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

/// A section of a document, by its heading.
fn section(document: &str, heading: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../docs")
        .join(document);
    let text = std::fs::read_to_string(path).unwrap();
    let (_, section) = text.split_once(&format!("\n{heading}\n")).unwrap();
    let end = section.find("\n## ").unwrap_or(section.len());
    section[..end].to_owned()
}

#[test]
fn examples_of_the_manual_can_be_loaded() {
    let examples = [
        ("emitters.md", "## Beams and fibres", 2),
        ("emitters.md", "## Volumes that emit", 2),
        ("media.md", "## Media that emit", 1),
    ];
    for (page, heading, emitters) in examples {
        let section = section(&format!("scene/{page}"), heading);
        let (_, example) = section.split_once("```xml\n").unwrap();
        let (example, _) = example.split_once("```").unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.xml");
        let sensor = "<sensor type=\"perspective\"><float name=\"fov\" value=\"40\"/></sensor>";
        let scene = format!("<scene version=\"3.0.0\">{sensor}{example}</scene>");
        std::fs::write(&path, scene).unwrap();
        let loaded = morgana_io::load_scene(&path, &LoadOptions::default())
            .unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(loaded.scene().emitters().len(), emitters);
        let text = loaded.warnings.to_string();
        assert!(!text.contains("warning"), "{text}");
    }
}

/// The emitters of the table, verbatim.
fn emitters() -> Vec<String> {
    let section = section("guides/tissue-optics.md", "## Sources");
    let rows = section.lines().filter(|line| line.starts_with('|'));
    let code = rows.flat_map(|row| row.split('`').map(str::to_owned));
    code.filter(|code| code.starts_with('{')).collect()
}

#[test]
fn sources_of_the_guide_emit_one_watt() {
    let folder = tempfile::tempdir().unwrap();
    write_files(folder.path());
    let all = emitters();
    assert_eq!(all.len(), 16);
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

/// Emission of media in files: by a grid, by label, and refused cases.
#[test]
fn media_of_files_emit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.json");
    npy::write(&folder.path().join("warm.npy"), &[1, 1, 2], &[1.0, 3.0]).unwrap();
    let film = r#""film": {"type": "hdrfilm", "pixel_format": "luminance"}"#;
    let load = |body: &str| {
        let scene = format!(
            r#"{{"type": "scene", "sensor": {{"type": "perspective", "fov": 40, {film}}}, "body": {body}}}"#
        );
        std::fs::write(&path, scene).unwrap();
        morgana_io::load_scene(&path, &LoadOptions::default())
    };
    let filled = |medium: &str| {
        format!(r#"{{"type": "cube", "bsdf": {{"type": "null"}}, "interior": {medium}}}"#)
    };
    let medium = |emission: &str| {
        format!(
            r#"{{"type": "homogeneous", "sigma_a": 2, "sigma_s": 1, "ior": 1, "emission": {emission}}}"#
        )
    };
    let grid = r#"{"type": "gridvolume", "filename": "warm.npy", "axis_order": "zyx",
        "to_world": [{"translate": [-0.5, -0.5, -0.5]}, {"scale": 2}]}"#;
    let loaded = load(&filled(&medium(grid))).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(loaded.emitter_names, ["homogeneous"]);
    let emitted = |x: [f64; 3]| loaded.scene().medium(1).emitted(x.into())[0];
    for (x, expected) in [(-0.9, 2.0), (0.0, 4.0), (0.9, 6.0)] {
        assert!((emitted([x, 0.2, 0.3]) - expected).abs() < 1e-6, "{x}");
    }
    let labels = |emission: &str| {
        format!(
            r#"{{"type": "labels", "filename": "labels.npy", "axis_order": "zyx",
                "1": {}, "2": {}}}"#,
            medium(emission),
            medium("5")
        )
    };
    npy::write(&folder.path().join("labels.npy"), &[1, 1, 2], &[1.0, 2.0]).unwrap();
    let loaded = load(&labels("0.5")).unwrap_or_else(|e| panic!("{e}"));
    let hot = loaded
        .scene()
        .media()
        .iter()
        .find(|m| m.emission.is_some())
        .unwrap();
    assert_eq!(hot.emitted([0.25, 0.5, 0.5].into())[0], 1.0);
    assert_eq!(hot.emitted([0.75, 0.5, 0.5].into())[0], 10.0);
    let refused = |body: &str, words: &str| {
        let text = load(body).err().unwrap().to_string();
        assert!(text.contains(words), "{text}");
    };
    let loaded = load(&labels(grid)).unwrap_or_else(|e| panic!("{e}"));
    let mut media = loaded.scene().media().iter();
    assert!(media.any(|m| (m.emitted([0.25, 0.5, 0.5].into())[0] - 5.0).abs() < 1e-6));
    refused(
        &filled(&medium("-1")),
        "'emission' is -1; light must not be negative",
    );
}
