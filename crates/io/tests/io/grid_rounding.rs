//! Grids of the index with rounded samples: warnings that state the effect and a remedy.

use morgana_io::volume::{Volume, write};
use morgana_io::{LoadOptions, Loaded};
use std::path::Path;

/// n − 1 of an exponential atmosphere, 2.73e-4 exp(−z/8 km), every 0.25 km.
fn atmosphere() -> Vec<f64> {
    (0..321)
        .map(|i| 2.73e-4 * (-f64::from(i) / 32.0).exp())
        .collect()
}

fn file(folder: &Path, name: &str, samples: Vec<f64>, element: &str) {
    let element = morgana_io::element::Element::of_name(element).unwrap();
    let volume = Volume::new([1, 1, samples.len()], 1, samples).unwrap();
    write(&folder.join(name), &volume.with_element(element), "n").unwrap();
}

fn load(folder: &Path, name: &str, more: &str) -> Loaded {
    let text = format!(
        r#"<scene version="3.0.0"><sensor type="perspective"/><emitter type="constant"/>
           <shape type="cube"><bsdf type="null"/><medium type="transparent" name="interior">
             <volume name="ior" type="bspline"><string name="filename" value="{name}"/>
               <string name="axis_order" value="zyx"/><string name="placement" value="nodes"/>
               <transform name="to_world"><translate value="-0.5"/><scale value="2.02"/></transform>{more}
           </volume></medium></shape></scene>"#
    );
    let path = folder.join("scene.xml");
    std::fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn rounded_samples_draw_a_warning_with_figures() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let index = || {
        atmosphere()
            .into_iter()
            .map(|c| 1.0 + c)
            .collect::<Vec<_>>()
    };
    file(folder, "single.npy", index(), "float32");
    file(folder, "double.npy", index(), "float64");
    file(folder, "contrast.npy", atmosphere(), "float32");
    let decimal = index().into_iter().map(|n| (n * 1e6).round() / 1e6);
    file(folder, "decimal.npy", decimal.collect(), "float64");
    let widened = index().into_iter().map(|n| f64::from(n as f32));
    file(folder, "widened.npy", widened.collect(), "float64");

    let warned = |name: &str, more: &str, words: &[&str]| {
        let loaded = load(folder, name, more);
        let warnings = loaded.warnings.to_string();
        for word in words {
            assert!(
                warnings.contains(word),
                "{name}: {word} is not in {warnings}"
            );
        }
        assert_eq!(
            warnings.contains("rounded to"),
            !words.is_empty(),
            "{name}: {warnings}"
        );
    };
    // Rounding of 3.4e-8, times 1.18 per 0.25 km, of gradients whose root mean square is 7.6e-6 per
    // km.
    let single = [
        "rounded to float32",
        "makes up 1.",
        "% of the gradient",
        "--contrast",
        "smoothing",
    ];
    warned("single.npy", "", &single);
    warned("widened.npy", "", &single);
    warned("decimal.npy", "", &["rounded to multiples of 0.000001"]);
    warned("double.npy", "", &[]);
    warned("contrast.npy", r#"<float name="offset" value="1"/>"#, &[]);
    warned(
        "single.npy",
        r#"<string name="smoothing" value="auto"/>"#,
        &[],
    );
    warned(
        "single.npy",
        r#"<float name="smoothing" value="3.4e-8"/>"#,
        &[],
    );
}

/// Gradients with `smoothing`, given or automatic, are closer to those from contrasts.
#[test]
fn smoothing_mends_gradients() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let index = atmosphere().into_iter().map(|c| 1.0 + c).collect();
    file(folder, "single.npy", index, "float32");
    file(folder, "contrast.npy", atmosphere(), "float32");
    let gradients = |name: &str, more: &str| -> Vec<f64> {
        let loaded = load(folder, name, more);
        let field = &loaded.scene().medium(1).index;
        let at = |i: i32| {
            field
                .gradient(glam::DVec3::Z * (f64::from(i) / 60.0 - 0.9))
                .1
                .z
        };
        (0..60).map(at).collect()
    };
    let exact = gradients("contrast.npy", r#"<float name="offset" value="1"/>"#);
    let error = |more: &str| {
        let found = gradients("single.npy", more);
        let square = |v: f64| v * v;
        let sum: f64 = found.iter().zip(&exact).map(|(a, b)| square(a - b)).sum();
        (sum / exact.iter().map(|b| square(*b)).sum::<f64>()).sqrt()
    };
    let none = error("");
    assert!(none > 5e-3, "{none}");
    assert_eq!(error(r#"<string name="smoothing" value="none"/>"#), none);
    for smoothing in [
        r#"<string name="smoothing" value="auto"/>"#,
        r#"<float name="smoothing" value="3.4e-8"/>"#,
    ] {
        let smooth = error(smoothing);
        assert!(smooth < 0.1 * none, "{none} {smooth}");
    }
}
