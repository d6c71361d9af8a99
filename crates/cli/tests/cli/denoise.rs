//! `morgana denoise` with a stand-in for Open Image Denoise's program whose results are known.

use crate::support::Folder;
use io::image::denoised::{DENOISED, DIFFERENCE, LAYER};
use io::image::{ImageLayers, Layer};
use std::path::PathBuf;

fn stand_in() -> String {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    folder.join("oidn_stand_in.sh").display().to_string()
}

/// A ball of albedo 0.25, and `a.exr`, its noisy render with guides.
fn ball() -> Folder {
    let folder = Folder::with_scene(
        r#"<integrator type="aov"><string name="aovs" value="albedo, sh_normal"/>
             <integrator type="path"/></integrator>
           <shape type="sphere"><bsdf type="diffuse"><rgb name="reflectance" value="0.25"/></bsdf></shape>"#,
    );
    folder.succeed("render scene.xml --spp 8 -o a.exr");
    folder
}

fn layer<'a>(image: &'a ImageLayers, name: &str) -> &'a Layer {
    image.layer(name).unwrap_or_else(|| panic!("{name}"))
}

#[test]
fn guides_are_handed_over_and_differences_are_in_standard_errors() {
    let folder = ball();
    let log = folder.path("log");
    let mut command = folder.command("denoise a.exr -o b.exr -o b.png --exposure 0");
    command
        .env("MORGANA_OIDN", stand_in())
        .env("STAND_IN_LOG", &log);
    let said = String::from_utf8(command.output().unwrap().stdout).unwrap();
    assert!(
        said.starts_with("denoised with albedo, sh_normal · "),
        "{said}"
    );
    let arguments = std::fs::read_to_string(log).unwrap();
    let given = [
        "--hdr",
        "noisy.pfm --alb",
        "alb.pfm --nrm",
        "nrm.pfm -o",
        "denoised.pfm",
    ];
    assert!(
        given.iter().all(|part| arguments.contains(part)),
        "{arguments}"
    );
    let [noisy, denoised] =
        ["a.exr", "b.exr"].map(|name| ImageLayers::read(&folder.path(name)).unwrap());
    let [estimate, variance, albedo] = ["", "variance", "albedo"].map(|name| layer(&noisy, name));
    let [values, difference] = [LAYER, DIFFERENCE].map(|name| layer(&denoised, name));
    assert_eq!(denoised.layers.len(), 2);
    let (mut far, mut known, mut moved) = (0, 0, false);
    for name in ["R", "G", "B"] {
        let of = |layer: &Layer| layer.channel(name).unwrap().to_vec();
        let (a, v, x, z) = (of(estimate), of(variance), of(values), of(difference));
        for i in 0..a.len() {
            // The gain for the denoiser is a power of two.
            let gain = (of(albedo)[i] / x[i]).log2();
            assert!(x[i] == 0.0 || gain.fract() == 0.0, "{gain}");
            if v[i] > 0.0 {
                let expected = (x[i] - a[i]) / v[i].sqrt();
                assert!(
                    (z[i] - expected).abs() <= 1e-5 * expected.abs(),
                    "{} {expected}",
                    z[i]
                );
                moved |= z[i] != 0.0;
            } else {
                assert!(z[i].is_nan() || (z[i] == 0.0 && x[i] == a[i]));
            }
            known += usize::from(!z[i].is_nan());
            far += usize::from(z[i].abs() > 3.0);
        }
    }
    assert!(moved && far > 0);
    let share: f64 = said
        .split(" · ")
        .nth(1)
        .unwrap()
        .split('%')
        .next()
        .unwrap()
        .parse()
        .unwrap();
    let expected = 100.0 * far as f64 / known as f64;
    assert!((share / expected - 1.0).abs() < 0.01, "{said} {expected}");
    let by = denoised.attribute(DENOISED).unwrap();
    assert!(
        by.contains("Open Image Denoise") && by.contains("albedo, sh_normal"),
        "{by}"
    );
    assert_eq!(denoised.attribute("seed"), noisy.attribute("seed"));
    let picture = folder.read("b.png");
    assert!(picture.windows(8).any(|bytes| bytes == b"denoised"));
}

#[test]
fn without_guides_the_image_alone_is_denoised() {
    let folder = ball();
    let arguments = format!("denoise a.exr --no-guides --oidn {} -o b.exr", stand_in());
    let said = folder.succeed(&arguments);
    assert_eq!(
        said,
        "denoised without guides · 0% of the values moved by more than 3 standard errors\n"
    );
    let [noisy, denoised] =
        ["a.exr", "b.exr"].map(|name| ImageLayers::read(&folder.path(name)).unwrap());
    assert_eq!(layer(&noisy, "").channels, layer(&denoised, LAYER).channels);
    // A single channel, and an image without variances.
    folder.succeed("render scene.xml --spp 8 -o a.npy");
    let outcome = folder.run(&format!("denoise a.npy --oidn {} -o c.exr", stand_in()));
    assert_eq!(outcome.stdout, "denoised without guides\n");
    assert!(outcome.stderr.contains("has no variances"), "{outcome:?}");
}

#[test]
fn a_denoised_image_is_not_taken_for_an_estimate() {
    let folder = ball();
    let oidn = format!("--oidn {}", stand_in());
    folder.succeed(&format!("denoise a.exr {oidn} -o b.exr -q"));
    let message = folder.refuse(&format!("denoise b.exr {oidn} -o c.exr"));
    assert!(
        message.contains("b.exr: the image is denoised already"),
        "{message}"
    );
    let message = folder.refuse(&format!("denoise a.exr {oidn} -o a.exr"));
    assert!(message.contains("'a.exr' is read here"), "{message}");
    let message = folder.refuse("compare b.exr a.exr");
    assert!(
        message.contains("no main layer; choose one of its layers: denoised"),
        "{message}"
    );
    let text = folder.succeed("compare b.exr a.exr --layer denoised --reference-layer=");
    assert!(
        text.contains("b.exr is denoised, which adds an unknown bias"),
        "{text}"
    );
    assert!(text.contains("z              unknown"), "{text}");
    folder.succeed("tonemap b.exr --layer denoised -o b.png");
}

#[test]
fn what_is_missing_is_named() {
    let folder = ball();
    let message = folder.refuse("denoise a.exr --oidn gone/oidnDenoise -o b.exr");
    for part in [
        "cannot run 'gone/oidnDenoise': there is no such program",
        "MORGANA_OIDN",
        "install Open",
    ] {
        assert!(message.contains(part), "{message}");
    }
    let oidn = format!("--oidn {}", stand_in());
    let message = folder.refuse(&format!("denoise a.exr {oidn} --albedo paint -o b.exr"));
    assert!(
        message.contains("no layer 'paint'") && message.contains("aov"),
        "{message}"
    );
    folder.refuse(&format!("denoise a.exr {oidn} -o b.npy"));
    folder.refuse(&format!("denoise a.exr {oidn}"));
    let mut command = folder.command(&format!("denoise a.exr {oidn} -o b.exr"));
    let output = command
        .env("STAND_IN_FAILS", "out of memory")
        .output()
        .unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(
        message.contains("exit status: 3): Error: out of memory"),
        "{message}"
    );
    assert!(!folder.path("b.exr").exists());
    let folder = Folder::with_fog();
    folder.succeed("render scene.xml --spp 4 -o plain.exr");
    let message = folder.refuse(&format!("denoise plain.exr {oidn} --normal few -o b.exr"));
    assert!(message.contains("only beside an albedo"), "{message}");
}
