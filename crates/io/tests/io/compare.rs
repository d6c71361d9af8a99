//! Comparisons of images, tested by closed forms and by the ꟻLIP authors' own program.

use morgana_io::compare::{compare, flip::flip};
use morgana_io::image::exposure::Exposure;
use morgana_io::image::tone::Curve;
use morgana_io::image::{ImageLayers, Layer, RgbImage, exr, npy};

fn layer(name: &str, channels: &[(&str, &[f32])]) -> Layer {
    let channels = channels.iter();
    Layer {
        name: name.into(),
        channels: channels.map(|(n, v)| (n.to_string(), v.to_vec())).collect(),
    }
}

fn image(width: usize, layers: Vec<Layer>) -> ImageLayers {
    ImageLayers {
        width,
        height: layers[0].channels[0].1.len() / width,
        layers,
        attributes: Vec::new(),
    }
}

fn grey(values: &[f32]) -> ImageLayers {
    image(values.len(), vec![layer("", &[("Y", values)])])
}

fn near(found: f64, expected: f64) {
    let close = (found - expected).abs() <= 1e-12 * expected.abs();
    assert!(close, "{found}, expected {expected}");
}

#[test]
fn errors_are_those_of_their_definitions() {
    let (a, b) = (grey(&[1.0, 2.0, 3.0, 4.0]), grey(&[1.0, 2.5, 3.0, 2.0]));
    let c = compare(&a, &b, 1).unwrap();
    near(c.means[0], 2.5);
    near(c.means[1], 2.125);
    let mse: f64 = (0.25 + 4.0) / 4.0;
    near(c.rmse, mse.sqrt());
    near(c.largest, 2.0);
    near(c.psnr, 10.0 * (9.0 / mse).log10());
    let dark = 0.05 * 2.125;
    let relative = (0.5f64 / (2.5 + dark)).powi(2) + (2.0f64 / (2.0 + dark)).powi(2);
    near(c.relative_mse, relative / 4.0);
    assert_eq!(c.z, None);
}

#[test]
fn equal_images_do_not_differ() {
    let black = grey(&[0.0; 4]);
    for image in [grey(&[0.0, -1.0, 3.5, 1e30]), black] {
        let c = compare(&image, &image, 1).unwrap();
        assert_eq!((c.rmse, c.relative_mse, c.largest), (0.0, 0.0, 0.0));
        assert_eq!(c.psnr, f64::INFINITY);
    }
}

/// z of two pixels and two channels, one of which has no variance.
#[test]
fn differences_are_measured_in_standard_errors() {
    let unknown = f32::INFINITY;
    let with = |values: &[f32; 2], variances: &[f32; 2]| {
        let main = layer("", &[("G", &[1.0, 5.0]), ("R", values)]);
        let variance = layer("variance", &[("G", &[0.02, unknown]), ("R", variances)]);
        image(2, vec![main, variance])
    };
    let (a, b) = (
        with(&[1.0, 2.0], &[0.01, 0.03]),
        with(&[1.4, 1.0], &[0.03, 0.06]),
    );
    let z = compare(&a, &b, 1).unwrap().z.unwrap();
    let [first, second] = [-0.4 / 0.2f64, 1.0 / 0.3];
    assert_eq!(z.count, 3);
    let close = |found: f64, expected: f64| {
        assert!(
            (found - expected).abs() < 1e-6,
            "{found}, expected {expected}"
        );
    };
    close(z.mean_square, (first * first + second * second) / 3.0);
    close(z.beyond_three, 1.0 / 3.0);
    let worst = z.worst.unwrap();
    close(worst.z, second);
    assert_eq!((worst.channel.as_str(), worst.pixel), ("R", [1, 0]));
    let (name, map) = &z.channels[1];
    assert_eq!(name, "R");
    close(map[0].into(), first);
    assert!(z.channels[0].1[1].is_nan());

    // Over both pixels, differences and variances add up.
    let z = compare(&a, &b, 2).unwrap().z.unwrap();
    close(z.worst.unwrap().z, 0.6 / 0.13f64.sqrt());
    assert_eq!(z.count, 1);
}

/// If all samples are equal, only round-off remains, which counts as no difference; anything larger
/// counts.
#[test]
fn round_off_is_no_difference() {
    let constant = |value: f32| {
        let layers = vec![
            layer("", &[("Y", &[value])]),
            layer("variance", &[("Y", &[0.0])]),
        ];
        image(1, layers)
    };
    let z = |a, b| {
        let c = compare(&constant(a), &constant(b), 1).unwrap();
        c.z.unwrap().worst.unwrap().z
    };
    assert!(z(0.2, 0.2f32.next_up()).abs() <= 1.0);
    assert!(z(0.2, 0.2001) < -1e3);
    assert_eq!(z(0.2, 0.2), 0.0);
}

#[test]
fn images_must_be_comparable() {
    let message = |b: &ImageLayers| compare(&grey(&[1.0, 2.0]), b, 1).unwrap_err().to_string();
    let expected = "expected 2 x 1 pixels as the other image has, found 3 x 1 pixels";
    assert_eq!(message(&grey(&[1.0, 2.0, 3.0])), expected);
    let colour = image(2, vec![layer("", &[("R", &[1.0, 2.0])])]);
    let expected = "expected channels Y as the other image has, found channels R";
    assert_eq!(message(&colour), expected);
    let message = message(&grey(&[1.0, f32::NAN]));
    assert_eq!(
        message,
        "value NaN at pixel (1, 0) of channel Y is not finite"
    );
}

#[test]
fn an_alpha_channel_of_one_image_is_left_out() {
    let transparent = image(1, vec![layer("", &[("A", &[1.0]), ("Y", &[2.0])])]);
    let c = compare(&transparent, &grey(&[2.5]), 1).unwrap();
    near(c.rmse, 0.5);
}

/// Images of 48 × 32 pixels in linear sRGB: ramps and a checkerboard. The changed image has one
/// ramp squared, the checkerboard moved by two pixels, a white dot and a red patch beyond the range
/// of a screen.
fn checkers(changed: bool) -> RgbImage {
    let shift = if changed { 2 } else { 0 };
    let pixel = |i: usize| {
        let (x, y) = (i % 48, i / 48);
        let ramp = x as f64 / 47.0;
        let red = if changed { ramp * ramp } else { ramp };
        let blue = 0.25 + 0.5 * (((x + shift) / 8 + y / 8) % 2) as f64;
        match (x, y) {
            (30, 10) if changed => [1.0, 1.0, 0.9],
            (5..9, 20..24) if changed => [4.0, 0.0, 0.1],
            _ => [red as f32, (y as f64 / 31.0) as f32, blue as f32],
        }
    };
    RgbImage {
        width: 48,
        height: 32,
        pixels: (0..48 * 32).map(pixel).collect(),
    }
}

/// Values of `flip_evaluator` 1.7 for Python, `evaluate(reference, test, "LDR", inputsRGB=False,
/// applyMagma=False)`, with the test image clamped to [0, 1]. It computes in single precision.
#[test]
fn flip_is_that_of_its_authors() {
    let map = flip(&checkers(true), &checkers(false)).unwrap();
    let mean = map.iter().map(|v| f64::from(*v)).sum::<f64>() / map.len() as f64;
    assert!((mean - 0.368_203_7).abs() < 2e-6, "{mean}");
    for (x, y, expected) in [
        (0, 0, 0.072_580_58),
        (30, 10, 0.409_011_9),
        (31, 11, 0.339_959_47),
        (6, 22, 0.977_798_8),
        (47, 31, 0.686_664_8),
        (24, 16, 0.411_218_64),
        (14, 3, 0.579_955_76),
    ] {
        let found = map[y * 48 + x];
        assert!(
            (found - expected).abs() < 1e-4,
            "({x}, {y}): {found}, {expected}"
        );
    }
}

#[test]
fn equal_images_do_not_flip() {
    let map = flip(&checkers(true), &checkers(true)).unwrap();
    assert!(map.iter().all(|v| *v == 0.0));
    let tiny = RgbImage {
        width: 1,
        height: 1,
        pixels: vec![[f32::NAN, -1.0, 7.0]],
    };
    assert!(flip(&tiny, &tiny).unwrap().iter().all(|v| v.is_finite()));
    assert!(flip(&tiny, &checkers(false)).is_err());
}

/// Arrays and PNG files of an image contain its main layer.
#[test]
fn images_of_all_formats_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let channels: [(&str, &[f32]); 3] =
        [("B", &[0.5, 1.0]), ("G", &[0.0, 0.25]), ("R", &[1.0, 0.0])];
    let mut rgb = image(2, vec![layer("", &channels)]);
    let path = |name: &str| folder.path().join(name);
    exr::write(&path("a.exr"), &rgb).unwrap();
    rgb.layers[0].channels.reverse();
    npy::write(&path("a.npy"), &rgb, "").unwrap();
    let shown = rgb.on_screen().unwrap();
    let depth = morgana_io::image::png::Depth::Sixteen;
    morgana_io::image::png::write(&path("a.png"), &shown, depth, Default::default()).unwrap();
    let read = |name| ImageLayers::read(&path(name)).unwrap();
    let reference = read("a.exr");
    assert_eq!(compare(&read("a.npy"), &reference, 1).unwrap().rmse, 0.0);
    assert!(compare(&read("a.png"), &reference, 1).unwrap().rmse < 1e-5);
    std::fs::write(path("a.tif"), "").unwrap();
    let message = ImageLayers::read(&path("a.tif")).unwrap_err().to_string();
    assert!(
        message.contains(".exr or .npy with linear values"),
        "{message}"
    );
}

/// Files of one image with different exposures or curves represent equal values, to the depth of a
/// PNG file.
#[test]
fn exposures_of_png_files_are_undone() {
    let folder = tempfile::tempdir().unwrap();
    let values: Vec<f32> = (0..64).map(|i| 0.004 * i as f32).collect();
    let channels = ["R", "G", "B"].map(|name| (name.to_owned(), values.clone()));
    let picture = ImageLayers {
        width: 8,
        height: 8,
        layers: vec![Layer {
            name: String::new(),
            channels: channels.to_vec(),
        }],
        attributes: Vec::new(),
    };
    for (exposure, curve) in [
        (1.5, Curve::Srgb),
        (-0.5, Curve::Srgb),
        (1.0, Curve::Filmic),
    ] {
        let path = folder.path().join("a.png");
        picture
            .write_png(&path, Exposure::Stops(exposure), curve)
            .unwrap();
        let read = ImageLayers::read(&path).unwrap();
        let rmse = compare(&read, &picture, 1).unwrap().rmse;
        assert!(rmse < 1e-3, "{exposure}: {rmse}");
    }
}

#[test]
fn a_layer_takes_the_place_of_the_image() {
    let layers = || {
        vec![
            layer("", &[("Y", &[1.0])]),
            layer("variance", &[("Y", &[0.1])]),
            layer("bounce.1", &[("Y", &[0.5])]),
            layer("variance.bounce.1", &[("Y", &[0.2])]),
        ]
    };
    let focused = image(1, layers()).focused("bounce.1").unwrap();
    let expected = vec![
        layer("", &[("Y", &[0.5])]),
        layer("variance", &[("Y", &[0.2])]),
    ];
    assert_eq!(focused.layers, expected);
    let main = image(1, layers()).focused("").unwrap();
    assert_eq!(main.layers, layers()[..2]);
    let message = image(1, layers())
        .focused("bounce.2")
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("no layer 'bounce.2': the image has the layers variance, bounce.1"),
        "{message}"
    );
}
