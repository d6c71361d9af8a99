//! Figures: drawn from the program's files, with messages if they cannot be drawn.

use crate::support::Folder;

const CAMERA: &str = r#"<scene version="3.0.0">
  <sensor type="perspective"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0, 0, -4" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="6"/><integer name="height" value="4"/>
      <string name="decomposition" value="length"/>
      <float name="min_bound" value="3"/><float name="max_bound" value="9"/>
      <float name="bin_width" value="1"/>
    </film>
  </sensor>
  MEDIUM
</scene>"#;
const METER: &str = r#"<scene version="3.0.0">
  <sensor type="fluencemeter" id="cells">
    <transform name="to_world"><translate value="-0.5"/><scale value="2"/></transform>
    <integer name="nx" value="3"/><integer name="ny" value="4"/><integer name="nz" value="5"/>
  </sensor>
  MEDIUM
</scene>"#;
const MEDIUM: &str = r#"<shape type="sphere"><bsdf type="null"/>
    <medium type="homogeneous" name="interior">
      <float name="sigma_t" value="0.5"/><float name="albedo" value="0.9"/>
    </medium>
  </shape>
  <emitter type="point"><point name="position" value="-1, 2, -1"/>
    <float name="intensity" value="9"/></emitter>"#;

fn folder() -> Folder {
    let folder = Folder::with_scene("");
    for (name, scene) in [("scene.xml", CAMERA), ("meter.xml", METER)] {
        std::fs::write(folder.path(name), scene.replace("MEDIUM", MEDIUM)).unwrap();
    }
    folder.succeed("render scene.xml --spp 8 -o a.exr --stats a.json");
    folder.succeed("render scene.xml --spp 32 -o b.exr --stats b.json");
    folder.succeed("render meter.xml --particles 2000 -o meter.npz");
    folder
}

fn svg(folder: &Folder, command: &str) -> String {
    folder.succeed(&format!("plot {command} -o figure.svg"));
    let text = std::fs::read_to_string(folder.path("figure.svg")).unwrap();
    roxmltree::Document::parse(&text).unwrap();
    text
}

#[test]
fn figures_are_drawn() {
    let folder = folder();
    let profile = svg(&folder, "profile a.exr b.exr --row 2");
    // Expect two lines, each with its band.
    assert_eq!(profile.matches("<polygon").count(), 2);
    assert!(profile.contains("Profile along row 2"));
    assert!(
        svg(
            &folder,
            "profile a.exr --column 3 --channel G --layer length.0003"
        )
        .contains("row")
    );
    let histogram = svg(&folder, "histogram a.exr --pixel 3,2");
    assert!(histogram.contains("pixel (3, 2)"));
    let image = svg(&folder, "image a.exr --layer length.0003 --channel R");
    assert_eq!(image.matches("<rect").count(), 6 * 4 + 200 + 1);
    let convergence = svg(&folder, "convergence a.json b.json");
    assert!(convergence.contains("1/√samples") && convergence.contains("path"));
    let slice = svg(&folder, "slice meter.npz --axis y --at 0.1");
    assert!(slice.contains("fluence at y = 0.1"));
    assert!(slice.contains("x (scene units)") && slice.contains("W/unit²"));
    // Expect one rectangle for each of 3 × 5 cells, 200 for the colour bar, and one for the page.
    assert_eq!(slice.matches("<rect").count(), 15 + 200 + 1);
    for command in [
        "slice meter.npz --at 0 --log --array absorbed",
        "profile a.exr --row 0",
    ] {
        folder.succeed(&format!("plot {command} -o figure.png"));
        let image = io::image::RgbImage::read(&folder.path("figure.png")).unwrap();
        assert_eq!((image.width, image.height), (1600, 1000));
        assert!(image.pixels.iter().any(|p| *p != image.pixels[0]));
    }
}

const TAGGED: &str = r#"<scene version="3.0.0">
  <shape type="sphere"><bsdf type="null"/>
    <medium type="homogeneous" name="interior">
      <float name="sigma_t" value="0.5"/><float name="albedo" value="0.9"/>
      <volume type="acoustic" name="ior"><float name="n0" value="1.33"/><float name="amplitude" value="1e-3"/>
        <float name="wave_number" value="3"/><float name="elasto_optic" value="0.3"/></volume>
    </medium>
  </shape>
  <emitter type="point"><point name="position" value="0, 0, 0"/>
    <float name="intensity" value="1e6"/></emitter>
  PARTS
</scene>"#;
const TAGGED_FILM: &str = r#"<integrator type="tagged"><float name="wavelength" value="1e-2"/>
    <integrator type="path"/></integrator>
  <sensor type="perspective"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0, 0, -4" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/>
      <string name="decomposition" value="length"/>
      <float name="min_bound" value="0"/><float name="max_bound" value="90"/>
      <float name="bin_width" value="90"/>
    </film>
  </sensor>"#;
const TAGGED_METER: &str = r#"<sensor type="fluencemeter" id="cells">
    <float name="wavelength" value="1e-2"/><boolean name="tagged" value="true"/>
    <transform name="to_world"><translate value="-0.5"/><scale value="2"/></transform>
    <integer name="nx" value="2"/><integer name="ny" value="2"/><integer name="nz" value="2"/>
  </sensor>"#;

/// Returns the largest number beside an axis or a colour bar.
fn largest(svg: &str) -> f64 {
    let document = roxmltree::Document::parse(svg).unwrap();
    let numbers = document
        .descendants()
        .filter_map(|n| n.text()?.trim().parse::<f64>().ok());
    numbers.fold(0.0, f64::max)
}

/// Sidebands are parts of the light: figures add them neither to the light nor to each other.
#[test]
fn sidebands_are_not_added_to_the_light() {
    let folder = Folder::with_scene("");
    for (name, parts) in [("film.xml", TAGGED_FILM), ("meter.xml", TAGGED_METER)] {
        std::fs::write(folder.path(name), TAGGED.replace("PARTS", parts)).unwrap();
    }
    folder.succeed("render film.xml --spp 64 -o film.exr");
    folder.succeed("render meter.xml --particles 2000 -o meter.npz");
    let [mean, all] = [false, true].map(|all| {
        let image = io::image::exr::read(&folder.path("film.exr")).unwrap();
        let of_bin = image
            .layers
            .iter()
            .filter(|l| l.name.starts_with("length.0000"));
        let of_bin = of_bin.filter(|l| all || l.name.ends_with(".total"));
        let channel = |l: &io::image::Layer| {
            l.channels[0].1.iter().map(|v| f64::from(*v)).sum::<f64>() / 16.0
        };
        of_bin.map(channel).sum::<f64>() / 90.0
    });
    assert!(all > 1.5 * mean);
    // This exceeds any length along the axis.
    let shown = largest(&svg(&folder, "histogram film.exr"));
    assert!(shown < 1.2 * mean && shown > 0.5 * mean, "{shown}: {mean}");
    let outcome = folder.run("plot slice meter.npz --at 0.5 --array fluence_sidebands -o f.svg");
    let expected = "has a value for each order, which must not be summed: choose one by --bin order=N, with N from 0 to";
    assert!(outcome.stderr.contains(expected), "{}", outcome.stderr);
    let [carrier, sideband] = [0, 1].map(|m| {
        let command = format!("slice meter.npz --at 0.5 --array fluence_sidebands --bin order={m}");
        let slice = svg(&folder, &command);
        assert!(slice.contains(&format!("fluence_sidebands at z = 0.5, order {m}")));
        largest(&slice)
    });
    assert!(carrier != sideband);
    for (bin, expected) in [
        ("order=9", "axis 'order' has bins 0 to"),
        ("gate=0", "has no axis 'gate' of bins; it has: order"),
    ] {
        let outcome = folder.run(&format!(
            "plot slice meter.npz --at 0.5 --array fluence_sidebands --bin {bin} -o f.svg"
        ));
        assert!(outcome.stderr.contains(expected), "{}", outcome.stderr);
    }
}

#[test]
fn mistakes_are_named() {
    let folder = folder();
    let says = |command: &str, text: &str| {
        let outcome = folder.run(&format!("plot {command}"));
        assert!(matches!(outcome.status, Some(1 | 2)), "{command}");
        let error = outcome.stderr;
        assert!(error.contains(text), "{command}: {error}");
    };
    says("profile a.exr --row 4 -o p.svg", "only lines 0 to 3");
    says("profile a.exr --row 0 --layer no -o p.svg", "no layer 'no'");
    says(
        "profile a.exr --row 0 --channel X -o p.svg",
        "no channel 'X': the image has B, G, R",
    );
    says(
        "profile a.exr --row 0 -o p.gif",
        "write a figure to .svg or .png",
    );
    says(
        "histogram a.exr --pixel 6,0 -o p.svg",
        "the image has 6 x 4 pixels",
    );
    says(
        "slice meter.npz --at 7 -o p.svg",
        "the grid reaches from z = -1 to 1",
    );
    says("slice a.json --at 0 -o p.svg", "not a readable archive");
    says("convergence meter.npz -o p.svg", "meter.npz");
}
