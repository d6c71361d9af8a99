//! Films that separate light: files, reports, and sums of layers.

use crate::support::Folder;
use io::image::{ImageLayers, exr};
use io::npy::{self, NpyData};

/// Fog around a point light and under a sky; the film has 4 × 3 pixels.
fn folder(film: &str) -> Folder {
    let folder = Folder::with_scene("");
    let scene = format!(
        r#"<scene version="3.0.0">
  <sensor type="perspective"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0, 0, -4" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="3"/>
      {film}
    </film>
  </sensor>
  <shape type="sphere"><bsdf type="null"/>
    <medium type="homogeneous" name="interior">
      <float name="sigma_t" value="0.5"/><float name="albedo" value="0.9"/>
    </medium>
  </shape>
  <emitter type="point" id="light.left"><point name="position" value="-1, 2, -1"/>
    <float name="intensity" value="9"/></emitter>
  <emitter type="constant"/>
</scene>"#
    );
    std::fs::write(folder.path("scene.xml"), scene).unwrap();
    folder
}

const LENGTHS: &str = r#"<string name="decomposition" value="length"/>
  <float name="min_bound" value="6"/><float name="max_bound" value="7"/>
  <float name="bin_width" value="0.1"/>"#;

/// Sum of all layers with a matching name.
fn sum(image: &ImageLayers, channel: &str, fits: impl Fn(&str) -> bool) -> Vec<f32> {
    let mut total = vec![0.0; image.width * image.height];
    for layer in image.layers.iter().filter(|l| fits(&l.name)) {
        let values = layer.channel(channel).unwrap();
        total.iter_mut().zip(values).for_each(|(t, v)| *t += v);
    }
    total
}

fn array(folder: &Folder, name: &str) -> (Vec<usize>, Vec<f32>) {
    let array = npy::read(&folder.path(name)).unwrap();
    let NpyData::F32(data) = array.data else {
        panic!("single precision")
    };
    (array.shape, data)
}

#[test]
fn layers_add_up_in_files() {
    let folder = folder(LENGTHS);
    for integrator in ["path", "particle", "bdpt"] {
        let line = folder.succeed(&format!(
            "render scene.xml --integrator {integrator} --spp 64 -o a.exr -o a.npy -o a.png"
        ));
        assert!(line.contains("% outside of all bins"), "{line}");
        // Light traced from its emitters has an energy balance.
        let balance = line.contains("\nemitted ") && line.contains("left over");
        assert_eq!(balance, integrator != "path", "{line}");
        let image = exr::read(&folder.path("a.exr")).unwrap();
        let (shape, data) = array(&folder, "a.npy");
        assert_eq!(shape, [3, 4, 10, 3]);
        let names = image
            .layers
            .iter()
            .filter(|l| l.name.starts_with("length."));
        assert_eq!(names.count(), 12);
        for (c, channel) in ["R", "G", "B"].into_iter().enumerate() {
            let total = sum(&image, channel, |name| name.starts_with("length."));
            let main = image.layer("").unwrap().channel(channel).unwrap();
            for (a, b) in total.iter().zip(main) {
                assert!((a - b).abs() <= 1e-5 * b.abs().max(1e-3), "{a} {b}");
            }
            let bin = image
                .layer("length.0003")
                .unwrap()
                .channel(channel)
                .unwrap();
            let of_array = |pixel: usize| data[(pixel * 10 + 3) * 3 + c];
            assert!(bin.iter().enumerate().all(|(i, v)| *v == of_array(i)));
            let variance = image.layer("variance.length.0003").unwrap();
            let variance = variance.channel(channel).unwrap();
            assert!(variance.iter().any(|v| *v > 0.0));
            let few = image.layer("few.length.0003").unwrap();
            assert!(
                few.channel(channel)
                    .unwrap()
                    .iter()
                    .all(|v| [0.0, 1.0].contains(v))
            );
        }
    }
}

#[test]
fn combinations_have_their_order() {
    let folder = folder(&format!(
        "{}<integer name=\"max_bounces\" value=\"1\"/>",
        LENGTHS.replace("\"length\"", "\"light, length,bounce\"")
    ));
    folder.succeed("render scene.xml --spp 64 -o a.exr -o a.npy --stats s.json");
    let (shape, data) = array(&folder, "a.npy");
    assert_eq!(shape, [3, 4, 10, 2, 2, 3]);
    let image = exr::read(&folder.path("a.exr")).unwrap();
    let mut sum = 0.0;
    for bin in 0..10 {
        let name = format!("length.000{bin}.bounce.1.light.light_left");
        let values = image.layer(&name).unwrap().channel("R").unwrap();
        let at = |pixel: usize| data[(((pixel * 10 + bin) * 2 + 1) * 2) * 3];
        assert!(values.iter().enumerate().all(|(i, v)| *v == at(i)));
        sum += values.iter().sum::<f32>();
    }
    assert!(sum > 0.0);
    assert!(
        image
            .layer("length.over.bounce.over.light.constant")
            .is_some()
    );
    let stats = &folder.json("s.json")["decomposition"];
    let axes = serde_json::from_str::<serde_json::Value>(image.attribute("decomposition").unwrap());
    assert_eq!(axes.unwrap(), stats["axes"]);
    assert_eq!(stats["axes"][0]["max"], 7.0);
    assert_eq!(stats["axes"][1]["max"], 1);
    assert_eq!(stats["axes"][2]["emitters"][1], "constant");
    let layers = stats["layers"].as_array().unwrap();
    assert_eq!(layers.len(), 12 * 3 * 2);
    let total: f64 = layers.iter().map(|l| l["mean"].as_f64().unwrap()).sum();
    let mean = folder.json("s.json")["mean"].as_f64().unwrap();
    // Rounding bound for a sum of 64 samples.
    assert!((total / mean - 1.0).abs() < 64.0 * 2f64.powi(-33));
    assert!(
        layers
            .iter()
            .all(|l| l["standard_error"].as_f64().is_some() && l["few"].is_boolean())
    );
    assert!((0.0..1.0).contains(&stats["outside"].as_f64().unwrap()));
}

/// Time is length over the speed of light: bins of time contain the light of bins of length.
#[test]
fn time_is_length_over_speed() {
    let length = folder(LENGTHS);
    length.succeed("render scene.xml --spp 4 -o a.npy");
    let time = folder(
        r#"<string name="decomposition" value="time"/><float name="speed_of_light" value="0.25"/>
           <float name="min_bound" value="24"/><float name="max_bound" value="28"/>
           <float name="bin_width" value="0.4"/>"#,
    );
    time.succeed("render scene.xml --spp 4 -o a.npy -o a.exr");
    assert!(length.read("a.npy") == time.read("a.npy"));
    let image = exr::read(&time.path("a.exr")).unwrap();
    assert!(image.layer("time.0009").is_some());
    let axes = image.attribute("decomposition").unwrap();
    assert!(
        axes.contains("\"min\":24.0") && axes.contains("\"speed_of_light\":0.25"),
        "{axes}"
    );
}

#[test]
fn memory_is_stated_before_it_is_taken() {
    let text = folder(LENGTHS).succeed("info scene.xml");
    assert!(text.contains("10 bins of length from 6 to 7"), "{text}");
    assert!(
        text.contains("from outside counts from the ball of radius"),
        "{text}"
    );
    let huge = folder(
        r#"<string name="decomposition" value="length"/><float name="max_bound" value="60000"/>
           <float name="bin_width" value="1"/>"#,
    );
    let scene = std::fs::read_to_string(huge.path("scene.xml")).unwrap();
    let scene = scene.replace("\"width\" value=\"4\"", "\"width\" value=\"60000\"");
    let scene = scene.replace("\"height\" value=\"3\"", "\"height\" value=\"60000\"");
    std::fs::write(huge.path("scene.xml"), scene).unwrap();
    let outcome = huge.run("render scene.xml --spp 1 -o a.npy");
    assert_eq!(outcome.status, Some(2), "{outcome:?}");
    let expected = "a film of 60000 × 60000 pixels with 60000 bins of length from 0 to 60000 needs";
    assert!(outcome.stderr.contains(expected), "{outcome:?}");
    let text = Folder::with_fog().succeed("info scene.xml -D spp=3");
    assert!(!text.contains("--strategies"), "{text}");
    let bdpt = Folder::with_scene("<integrator type=\"bdpt\"/>").succeed("info scene.xml");
    assert!(bdpt.contains("with --strategies"), "{bdpt}");
}

#[test]
fn reweighted_images_lie_beside_the_plain_ones() {
    let folder = folder("<boolean name=\"reweight\" value=\"true\"/>");
    folder.succeed("render scene.xml --spp 16 -o a.exr -o a.npy");
    let image = exr::read(&folder.path("a.exr")).unwrap();
    let reweighted = image.layer("reweighted").unwrap().channel("G").unwrap();
    let plain = image.layer("").unwrap().channel("G").unwrap();
    assert!(
        reweighted
            .iter()
            .zip(plain)
            .all(|(a, b)| *a <= *b * 1.00001 && *a > 0.0)
    );
    let plainly = self::folder("");
    plainly.succeed("render scene.xml --spp 16 -o a.npy");
    assert!(folder.read("a.npy") == plainly.read("a.npy"));
}
