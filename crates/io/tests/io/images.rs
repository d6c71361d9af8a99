//! Images: round trips and refused files.

use morgana_io::image::tone::Tone;
use morgana_io::image::{ImageLayers, Layer, RgbImage, exr, npy, png};

fn ramp(n: usize, scale: f32) -> Vec<f32> {
    (0..n).map(|i| i as f32 * scale - 1.0).collect()
}

fn layer(name: &str, channels: &[&str], n: usize) -> Layer {
    let scale = |i: usize| 0.1 * (i + 1) as f32;
    let channels = channels.iter().enumerate();
    let channels = channels
        .map(|(i, c)| (c.to_string(), ramp(n, scale(i))))
        .collect();
    Layer {
        name: name.to_owned(),
        channels,
    }
}

fn sample() -> ImageLayers {
    ImageLayers {
        width: 5,
        height: 3,
        layers: vec![
            layer("", &["B", "G", "R"], 15),
            layer("samples", &["Y"], 15),
            layer("variance", &["B", "G", "R"], 15),
        ],
        attributes: vec![
            ("options".into(), "--spp 16 é".into()),
            ("scene_hash".into(), "abc".into()),
            ("seed".into(), "7".into()),
            ("version_of_program".into(), "0.1.0".into()),
        ],
    }
}

#[test]
fn an_exr_file_round_trips() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    exr::write(&path, &sample()).unwrap();
    let image = exr::read(&path).unwrap();
    assert_eq!(image, sample());
    assert_eq!(image.attribute("seed"), Some("7"));
    assert_eq!(
        image.layer("samples").unwrap().channel("Y").unwrap()[3],
        ramp(15, 0.1)[3]
    );
}

#[test]
fn the_same_image_gives_the_same_bytes() {
    let first = exr::encode(&sample()).unwrap();
    assert!((0..10).all(|_| exr::encode(&sample()).unwrap() == first));
}

/// Writing piece by piece, with the headers sorted afterwards, gives the bytes of writing in
/// memory.
#[test]
fn a_file_is_the_same_as_its_bytes_in_memory() {
    let folder = tempfile::tempdir().unwrap();
    let names: Vec<String> = (0..5000).map(|i| format!("channel {i}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut many = sample();
    many.layers.push(layer("many", &names, 15));
    for (name, image) in [("few.exr", sample()), ("many.exr", many)] {
        let path = folder.path().join(name);
        for _ in 0..3 {
            exr::write(&path, &image).unwrap();
            assert!(std::fs::read(&path).unwrap() == exr::encode(&image).unwrap());
        }
    }
}

#[test]
fn infinities_and_nan_survive_in_an_exr_file() {
    let mut image = sample();
    image.layers[0].channels[0].1[0] = f32::INFINITY;
    image.layers[0].channels[0].1[1] = f32::NAN;
    let read = exr::decode(&exr::encode(&image).unwrap()).unwrap();
    assert_eq!(read.layers[0].channels[0].1[0], f32::INFINITY);
    assert!(read.layers[0].channels[0].1[1].is_nan());
}

#[track_caller]
fn exr_error(change: impl FnOnce(&mut ImageLayers), expected: &str) {
    let mut image = sample();
    change(&mut image);
    assert_eq!(exr::encode(&image).unwrap_err().to_string(), expected);
}

#[test]
fn images_that_cannot_be_written() {
    let empty = "empty: the image has no pixels or no channels";
    exr_error(|i| i.width = 0, empty);
    exr_error(|i| i.layers.clear(), empty);
    exr_error(
        |i| i.width = 4,
        "expected 4 x 3 values, found 15 in channel 'B'",
    );
    let name = "is empty, too long or holds a zero byte";
    exr_error(
        |i| i.layers[0].channels[0].0.clear(),
        &format!("the channel name '' {name}"),
    );
    exr_error(
        |i| i.layers[0].channels[0].0 = "G".into(),
        "two channels have the name 'G'",
    );
    exr_error(
        |i| i.attributes[0].0 = "seed".into(),
        "two attributes have the name 'seed'",
    );
    let long = "x".repeat(300);
    exr_error(
        |i| i.attributes[0].0 = long.clone(),
        &format!("the attribute name '{long}' {name}"),
    );
    exr_error(
        |i| i.attributes[0].0 = "compression".into(),
        "cannot be stored as EXR: invalid: attribute name `compression` is reserved and cannot be custom",
    );
}

/// Eight damaged bytes anywhere in a file never cause a message of the system about an invalid
/// argument.
#[test]
fn damaged_exr_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let bytes = exr::encode(&sample()).unwrap();
    let mut found = 0;
    for at in 0..bytes.len() - 8 {
        let mut damaged = bytes.clone();
        damaged[at..at + 8].fill(0xff);
        std::fs::write(&path, &damaged).unwrap();
        if let Err(error) = exr::read(&path) {
            let error = error.to_string();
            assert!(!error.contains("os error"), "{at}: {error}");
            found += usize::from(error.contains("refers to pixels outside of it"));
        }
    }
    assert!(found > 0);
}

#[test]
fn files_that_are_no_images() {
    let error = exr::decode(b"not an image at all").unwrap_err().to_string();
    assert!(error.starts_with("not a EXR file: "), "{error}");
    let bytes = exr::encode(&sample()).unwrap();
    assert!(exr::decode(&bytes[..bytes.len() - 20]).is_err());
    assert!(exr::decode(&bytes[..100]).is_err());
    let error = exr::read("no.exr".as_ref()).unwrap_err().to_string();
    assert!(
        error.starts_with("no.exr: cannot read: No such file"),
        "{error}"
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    std::fs::write(&path, b"no").unwrap();
    let error = RgbImage::read(&path).unwrap_err().to_string();
    assert!(error.contains("a.png: not a PNG file: "), "{error}");
    let error = RgbImage::read("a.gif".as_ref()).unwrap_err().to_string();
    assert_eq!(
        error,
        "a.gif: not supported: colour images are read from .exr, .hdr, .pfm, .png, .jpg, .bmp and .tga"
    );
}

#[test]
fn a_header_that_claims_a_huge_image_is_refused_before_allocating() {
    let mut bytes = exr::encode(&sample()).unwrap();
    // The data window's right and lower edge.
    let name = b"dataWindow\0box2i\0";
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4 + 8;
    bytes[at..at + 8].copy_from_slice(&[0, 0, 0, 0x20, 0, 0, 0, 0x20]);
    assert!(exr::decode(&bytes).is_err());
}

fn colours() -> RgbImage {
    let pixels = vec![
        [0.0, 0.25, 1.0],
        [0.5, 2.0, -1.0],
        [f32::NAN, 0.1, 0.7],
        [0.9, 0.003, 0.2],
    ];
    RgbImage {
        width: 2,
        height: 2,
        pixels,
    }
}

#[test]
fn png_files_round_trip_up_to_their_depth() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let expected = |v: f32| if v.is_nan() { 0.0 } else { v.clamp(0.0, 1.0) };
    for (depth, tolerance) in [(png::Depth::Eight, 5e-3), (png::Depth::Sixteen, 2e-5)] {
        png::write(&path, &colours(), depth, Tone::default()).unwrap();
        let image = RgbImage::read(&path).unwrap();
        assert_eq!((image.width, image.height), (2, 2));
        for (a, b) in image
            .pixels
            .iter()
            .flatten()
            .zip(colours().pixels.iter().flatten())
        {
            assert!((a - expected(*b)).abs() < tolerance, "{depth:?}: {a} {b}");
        }
    }
}

#[test]
fn exposure_counts_in_stops() {
    let grey = RgbImage {
        width: 1,
        height: 1,
        pixels: vec![[0.125; 3]],
    };
    let bright = RgbImage {
        width: 1,
        height: 1,
        pixels: vec![[0.5; 3]],
    };
    let brighter = Tone {
        exposure: 2.0,
        ..Tone::default()
    };
    let bytes = png::encode(&grey, png::Depth::Eight, brighter).unwrap();
    let unchanged = png::encode(&bright, png::Depth::Eight, Tone::default()).unwrap();
    assert_eq!(
        png::decode(&bytes).unwrap(),
        png::decode(&unchanged).unwrap()
    );
    // The file records how it was processed.
    let texts = |bytes: &[u8]| {
        let reader = ::png::Decoder::new(std::io::Cursor::new(bytes)).read_info();
        let info = reader.unwrap().info().utf8_text.clone();
        let text = |chunk: &::png::text_metadata::ITXtChunk| {
            (chunk.keyword.clone(), chunk.get_text().unwrap())
        };
        info.iter().map(text).collect::<Vec<_>>()
    };
    assert_eq!(texts(&unchanged), []);
    assert_eq!(texts(&bytes), [("exposure".to_owned(), "2".to_owned())]);
}

#[test]
fn a_png_must_fit_its_pixels() {
    for (width, height) in [(3, 2), (0, 4)] {
        let image = RgbImage {
            width,
            height,
            ..colours()
        };
        let error = png::encode(&image, png::Depth::Eight, Tone::default())
            .unwrap_err()
            .to_string();
        assert_eq!(
            error,
            format!("expected {width} x {height} pixels, found 4")
        );
    }
}

#[test]
fn an_npy_image_has_rows_columns_and_channels() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npy");
    npy::write(&path, &sample(), "variance").unwrap();
    let array = morgana_io::npy::read(&path).unwrap();
    assert_eq!(
        (array.shape.as_slice(), array.fortran_order),
        (&[3, 5, 3][..], false)
    );
    let morgana_io::npy::NpyData::F32(data) = array.data else {
        panic!()
    };
    assert_eq!(
        data[3..6],
        [0.1 - 1.0, 0.2 - 1.0, 0.3 - 1.0].map(|v: f64| v as f32)
    );
    let error = npy::write(&path, &sample(), "none")
        .unwrap_err()
        .to_string();
    assert!(error.ends_with("the image has no layer 'none'"), "{error}");
}

#[test]
fn environment_maps_are_colours_or_grey_and_finite() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("env.exr");
    let write = |image: &ImageLayers| exr::write(&path, image).unwrap();
    write(&sample());
    let image = RgbImage::read(&path).unwrap();
    assert_eq!((image.width, image.height), (5, 3));
    assert_eq!(
        image.pixels[1],
        [0.3 - 1.0, 0.2 - 1.0, 0.1 - 1.0].map(|v: f64| v as f32)
    );
    let grey = ImageLayers {
        layers: vec![layer("", &["Y"], 15)],
        ..sample()
    };
    write(&grey);
    assert_eq!(RgbImage::read(&path).unwrap().pixels[1], [0.1f32 - 1.0; 3]);
    let depth = ImageLayers {
        layers: vec![layer("", &["Z"], 15)],
        ..sample()
    };
    write(&depth);
    let error = RgbImage::read(&path).unwrap_err().to_string();
    assert!(
        error.ends_with("expected the channels R, G, B or Y, or R, G, B in one layer, found Z"),
        "{error}"
    );
    let mut bad = grey;
    bad.layers[0].channels[0].1[7] = f32::NAN;
    write(&bad);
    let error = RgbImage::read(&path).unwrap_err().to_string();
    assert!(
        error.ends_with("value NaN at pixel (2, 1) is not finite"),
        "{error}"
    );
}

/// Metadata for other programs, besides the channels.
#[test]
fn an_exr_file_states_its_colours_and_its_program() {
    use ::exr::meta::MetaData;
    let bytes = exr::encode(&sample()).unwrap();
    let metadata = MetaData::read_from_buffered(bytes.as_slice(), true).unwrap();
    let header = &metadata.headers[0];
    let colours = header.shared_attributes.chromaticities.unwrap();
    assert_eq!((colours.red.x(), colours.white.y()), (0.64, 0.329));
    let software = header.own_attributes.software_name.as_ref().unwrap();
    assert!(software.to_string().starts_with("morgana "));
    let names: Vec<String> = header
        .channels
        .list
        .iter()
        .map(|c| c.name.to_string())
        .collect();
    assert_eq!(
        names,
        [
            "B",
            "G",
            "R",
            "samples.Y",
            "variance.B",
            "variance.G",
            "variance.R"
        ]
    );
}

/// Layers of a JPEG file are its colours. TIFF is refused with advice.
#[test]
fn jpeg_is_read_as_layers() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = path.join("tests/data/images/two_colours.jpg");
    let colours = RgbImage::read(&path).unwrap();
    let image = ImageLayers::read(&path).unwrap();
    assert_eq!((image.width, image.height), (colours.width, colours.height));
    let main = image.layer("").unwrap();
    for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
        let plane: Vec<f32> = colours.pixels.iter().map(|p| p[c]).collect();
        assert_eq!(main.channel(name).unwrap(), plane);
    }
    let folder = tempfile::tempdir().unwrap();
    let gif = ImageLayers::read(&folder.path().join("a.gif")).unwrap_err();
    assert!(
        gif.to_string().contains(".exr, .png, .jpg and .npy"),
        "{gif}"
    );
    let error = ImageLayers::read(&folder.path().join("a.tif")).unwrap_err();
    assert!(
        error
            .to_string()
            .contains(".exr or .npy with linear values"),
        "{error}"
    );
}

/// Mitsuba 3.9.1 wrote `data/images/two_colours.jpg` at quality 100: (200, 100, 50) on the left,
/// (20, 40, 240) on the right. JPEG keeps these to within a few steps of 255.
#[test]
fn jpeg_files_are_srgb() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = path.join("tests/data/images/two_colours.jpg");
    let image = RgbImage::read(&path).unwrap();
    assert_eq!((image.width, image.height), (16, 16));
    for (x, expected) in [(1, [200.0, 100.0, 50.0]), (14, [20.0, 40.0, 240.0])] {
        let pixel = image.pixels[5 * 16 + x];
        for (found, expected) in pixel.into_iter().zip(expected) {
            let encoded = morgana_io::scene::srgb_from_linear(f64::from(found)) * 255.0;
            assert!(
                (encoded - expected).abs() < 4.0,
                "{x}: {encoded} against {expected}"
            );
        }
    }
    let broken = tempfile::tempdir().unwrap();
    let broken = broken.path().join("b.jpg");
    std::fs::write(&broken, b"no image").unwrap();
    let error = RgbImage::read(&broken).unwrap_err().to_string();
    assert!(error.contains("not a JPEG file"), "{error}");
}

fn floats(values: &[f32], bytes: fn(f32) -> [u8; 4]) -> Vec<u8> {
    values.iter().flat_map(|v| bytes(*v)).collect()
}

/// Four pixels of 24 bits, last row first, in the order blue, green, red.
const LAST_ROW_FIRST: [u8; 12] = [1, 2, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120];

fn bmp() -> Vec<u8> {
    let mut bytes = b"BM".to_vec();
    bytes.extend([70_u32, 0, 54, 40, 2, 2].map(u32::to_le_bytes).concat());
    bytes.extend([1, 0, 24, 0]);
    bytes.extend([0_u32, 16, 2835, 2835, 0, 0].map(u32::to_le_bytes).concat());
    for row in LAST_ROW_FIRST.chunks(6) {
        bytes.extend(row);
        bytes.extend([0, 0]);
    }
    bytes
}

fn tga() -> Vec<u8> {
    let mut bytes = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 2, 0, 24, 0];
    bytes.extend(LAST_ROW_FIRST);
    bytes
}

/// Values agree with `mi.Bitmap` of Mitsuba 3.9.1 for these bytes, made linear. The `.tga` file has
/// the pixels of the `.bmp` file.
#[test]
fn formats_are_read_as_mitsuba_does() {
    let mut hdr = b"#?RGBE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n-Y 2 +X 2\n".to_vec();
    hdr.extend([128, 64, 32, 129, 200, 100, 50, 127]);
    hdr.extend([1, 2, 3, 136, 255, 0, 128, 120]);
    let tenths: Vec<f32> = (0..12).map(|i| 0.1 * i as f32).collect();
    let pfm = [b"PF\n2 2\n-2.0\n", &floats(&tenths, f32::to_le_bytes)[..]].concat();
    let grey = floats(&[1.0, 2.0, 3.0, 4.0], f32::to_be_bytes);
    let grey = [b"Pf\n2 2\n1.0\n", &grey[..]].concat();
    let decoded = [
        [0.102_241_8, 0.080_219_87, 0.061_246_06],
        [0.187_820_8, 0.155_926_5, 0.127_437_8],
        [0.012_983_06, 0.000_607_054, 0.000_303_527],
        [0.045_186_17, 0.031_896_0, 0.021_219_01],
    ];
    for (name, bytes, expected) in [
        (
            "a.hdr",
            hdr,
            [
                [1.0, 0.5, 0.25],
                [0.390625, 0.1953125, 0.09765625],
                [1.0, 2.0, 3.0],
                [0.003_890_991, 0.0, 0.001953125],
            ],
        ),
        (
            "a.pfm",
            pfm,
            [
                [1.2, 1.4, 1.6],
                [1.8, 2.0, 2.2],
                [0.0, 0.2, 0.4],
                [0.6, 0.8, 1.0],
            ],
        ),
        ("b.PFM", grey, [[3.0; 3], [4.0; 3], [1.0; 3], [2.0; 3]]),
        ("a.bmp", bmp(), decoded),
        ("a.tga", tga(), decoded),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, &bytes).unwrap();
        let image = RgbImage::read(&path).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!([image.width, image.height], [2, 2]);
        for (found, expected) in image.pixels.iter().zip(&expected) {
            for c in 0..3 {
                let error = (found[c] - expected[c]).abs();
                assert!(
                    error <= 2e-7 + 2e-6 * expected[c],
                    "{name}: {found:?}, {expected:?}"
                );
            }
        }
        // Cut off the end of the file.
        std::fs::write(&path, &bytes[..bytes.len() - 3]).unwrap();
        let error = RgbImage::read(&path).unwrap_err().to_string();
        assert!(error.contains(name), "{error}");
    }
}

#[test]
fn headers_that_claim_huge_images_are_refused() {
    for (name, bytes) in [
        ("a.hdr", &b"#?RADIANCE\n\n-Y 60000 +X 60000\n\x01\x02"[..]),
        ("a.pfm", b"PF 4000000000 4000000000 1 \x01"),
        ("a.pfm", b"PF 99999999999 1 1 \x01"),
        ("a.pfm", b"PF 1 1 0 123456789012"),
        ("a.hdr", b"#?RADIANCE\n\n-Y 0 +X 5\n"),
        ("a.hdr", b"RADIANCE\n\n-Y 1 +X 1\n1234"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        assert!(RgbImage::read(&path).is_err(), "{name}");
    }
}
