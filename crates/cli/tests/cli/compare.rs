//! `morgana compare` and `morgana tonemap`. Renders of two seeds are compared at a false-alarm rate
//! of 1e-3 for the largest z, and 1e-4 for the mean of z², of which 48 values are independent.

use crate::support::Folder;
use io::image::{ImageLayers, Layer, RgbImage, exr};

/// Fog whose albedo can be set.
fn fog() -> Folder {
    Folder::with_scene(
        r#"<default name="albedo" value="0.9"/>
           <shape type="sphere"><bsdf type="null"/>
             <medium type="homogeneous" name="interior">
               <float name="sigma_t" value="0.5"/><float name="albedo" value="$albedo"/>
             </medium>
           </shape>"#,
    )
}

fn compared(folder: &Folder, arguments: &str) -> serde_json::Value {
    let text = folder.succeed(&format!("compare {arguments} --json"));
    serde_json::from_str(&text).unwrap()
}

#[test]
fn renders_of_two_seeds_agree_within_their_errors() {
    let folder = fog();
    for seed in [1, 2] {
        folder.succeed(&format!(
            "render scene.xml --spp 256 --seed {seed} -o {seed}.exr"
        ));
    }
    folder.succeed("render scene.xml --spp 256 --seed 3 -D albedo=0.5 -o other.exr");
    let z = |images: &str| {
        let z = compared(&folder, images)["z"].clone();
        let number = |v: &serde_json::Value| v.as_f64().unwrap();
        let largest = number(&z["largest"]["z"]).abs();
        (largest / number(&z["limit"]), number(&z["mean_square"]))
    };
    for images in ["1.exr 2.exr", "1.exr 2.exr --block 3"] {
        let (largest, mean_square) = z(images);
        assert!(
            largest < 1.0 && (0.2..2.2).contains(&mean_square),
            "{largest}, {mean_square}"
        );
    }
    let (largest, mean_square) = z("1.exr other.exr");
    assert!(
        largest > 1.0 && mean_square > 4.0,
        "{largest}, {mean_square}"
    );
}

#[test]
fn the_exit_status_tells_whether_a_limit_is_exceeded() {
    let folder = fog();
    folder.succeed("render scene.xml --seed 1 -o a.exr -o a.png");
    folder.succeed("render scene.xml --seed 2 -o b.exr -o b.npy");
    let text = folder.succeed("compare a.exr b.exr");
    for name in ["RMSE", "relative MSE", "PSNR", "FLIP", "mean z²"] {
        assert!(text.contains(name), "{text}");
    }
    let everything = "--max-rmse 0 --max-relative-mse 0 --min-psnr 200 --max-flip 0 --max-z 0";
    folder.succeed(&format!("compare a.exr a.exr {everything}"));
    let outcome = folder.run(&format!("compare a.exr b.exr {everything}"));
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(1), ""));
    assert_eq!(
        outcome.stdout.matches("differs").count(),
        5,
        "{}",
        outcome.stdout
    );
    folder.succeed("compare a.exr b.exr --max-rmse 10 --min-psnr -20 --max-z 1000");
    // Without variances there are no standard errors.
    assert!(
        folder
            .succeed("compare a.exr b.npy")
            .contains("unknown: both images need variances")
    );
    for wrong in [
        "compare a.exr b.npy --max-z 5",
        "compare a.exr gone.exr",
        "compare a.exr scene.xml",
        "compare a.exr b.exr --layer bounce.1",
        "compare a.exr b.exr --image map.jpg",
        "compare a.exr b.exr --block 0",
    ] {
        folder.refuse(wrong);
    }
}

#[test]
fn maps_show_where_images_differ() {
    let folder = fog();
    folder.succeed("render scene.xml --seed 1 -o a.exr -o a.npy");
    folder.succeed("render scene.xml --seed 2 -o b.exr");
    folder.succeed("compare a.exr b.exr --image flip.png --zmap z.png");
    let numbers = compared(&folder, "a.exr b.exr --image flip.exr --zmap z.exr");
    let map = exr::read(&folder.path("flip.exr")).unwrap();
    let map = map.layer("").unwrap().channel("Y").unwrap();
    let mean = map.iter().map(|v| f64::from(*v)).sum::<f64>() / 48.0;
    assert!((mean - numbers["flip"].as_f64().unwrap()).abs() < 1e-9);
    let z = exr::read(&folder.path("z.exr")).unwrap();
    let squares = ["R", "G", "B"].map(|c| z.layer("").unwrap().channel(c).unwrap());
    let squares = squares
        .iter()
        .flat_map(|c| c.iter())
        .map(|z| f64::from(z * z));
    let mean = squares.sum::<f64>() / 144.0;
    assert!((mean - numbers["z"]["mean_square"].as_f64().unwrap()).abs() < 1e-5);
    // Equal images: no visible difference is violet, and no measurable difference is white.
    folder.succeed("compare a.exr a.exr --image flip.png --zmap z.png");
    let white = RgbImage::read(&folder.path("z.png")).unwrap().pixels[0];
    assert_eq!(white, [1.0; 3]);
    let violet = RgbImage::read(&folder.path("flip.png")).unwrap().pixels[0];
    assert!(violet[2] > violet[1], "{violet:?}");
}

#[test]
fn tone_is_that_of_a_render() {
    let folder = fog();
    let tone = "--exposure 1.5 --tone-map filmic";
    folder.succeed(&format!("render scene.xml -o a.exr -o a.png {tone}"));
    folder.succeed(&format!("tonemap a.exr -o b.png {tone}"));
    folder.succeed("tonemap a.exr -o plain.png");
    assert!(folder.read("a.png") == folder.read("b.png"));
    assert!(folder.read("a.png") != folder.read("plain.png"));
    folder.succeed("tonemap a.exr --layer variance -o v.png");
    folder.refuse("tonemap a.exr -o b.exr");
    folder.refuse("tonemap a.exr --layer gone -o b.png");
    folder.refuse("tonemap a.exr --tone-map pretty -o b.png");
}

/// A neutral pixel becomes grey, as does the colour of the light, without a change of luminance;
/// light of a colour temperature becomes white.
#[test]
fn white_is_that_of_a_pixel_a_colour_or_a_temperature() {
    let folder = fog();
    let channel = |name: &str, value: f32| (name.to_owned(), vec![0.5, value]);
    let image = ImageLayers {
        width: 2,
        height: 1,
        layers: vec![Layer {
            name: String::new(),
            channels: vec![channel("R", 0.4), channel("G", 0.2), channel("B", 0.1)],
        }],
        attributes: Vec::new(),
    };
    exr::write(&folder.path("a.exr"), &image).unwrap();
    let shown = |white: &str| {
        folder.succeed(&format!("tonemap a.exr --exposure 0 {white} -o a.png"));
        RgbImage::read(&folder.path("a.png")).unwrap().pixels
    };
    // 0.2126 · 0.4 + 0.7152 · 0.2 + 0.0722 · 0.1, to a step of eight bits.
    for white in ["--neutral 1,0", "--white 0.8,0.4,0.2"] {
        let grey = shown(white)[1];
        assert!(
            grey.iter().all(|v| (v - 0.2353).abs() < 0.005),
            "{white}: {grey:?}"
        );
    }
    let [r, g, b] = shown("--white 3200")[0];
    assert!(r < 0.4 && (g - 0.5).abs() < 0.1 && b > 0.9, "{r} {g} {b}");
    for (arguments, words) in [
        ("--white 900", "from 2000 to 40000"),
        ("--white red", "such as 3200"),
        ("--neutral 2,0", "2 × 1 pixels"),
        ("--neutral 1,0 --white 3200", "cannot be used with"),
    ] {
        let error = folder.refuse(&format!("tonemap a.exr {arguments} -o a.png"));
        assert!(error.contains(words), "{arguments}: {error}");
    }
}
