//! `morgana render --integrator` and `--strategies`.

use crate::support::Folder;
use io::image::{ImageLayers, exr};

fn folder() -> Folder {
    Folder::with_scene(
        r#"<shape type="sphere"><bsdf type="null"/>
             <medium type="homogeneous" name="interior">
               <float name="sigma_t" value="0.5"/><float name="albedo" value="0.9"/>
             </medium>
           </shape>
           <shape type="sphere"><float name="radius" value="0.3"/><point name="center" y="1.5"/>
             <bsdf type="diffuse"/><emitter type="area"><float name="radiance" value="5"/></emitter>
           </shape>"#,
    )
}

/// The sum of all layers of one kind.
fn sum(image: &ImageLayers, kind: &str, channel: &str) -> Vec<f32> {
    let layers = image.layers.iter().filter(|l| l.name.ends_with(kind));
    let mut total = vec![0.0; image.width * image.height];
    for layer in layers {
        let values = layer.channel(channel).unwrap();
        total.iter_mut().zip(values).for_each(|(t, v)| *t += v);
    }
    total
}

#[test]
fn weighted_layers_add_up_to_the_image() {
    let folder = folder();
    for integrator in ["bdpt", "particle"] {
        folder.succeed(&format!(
            "render scene.xml --integrator {integrator} --spp 16 -o a.exr --strategies s.exr"
        ));
        let image = exr::read(&folder.path("a.exr")).unwrap();
        let strategies = exr::read(&folder.path("s.exr")).unwrap();
        assert_eq!(strategies.layer(""), image.layer(""));
        assert_eq!(strategies.attribute("integrator"), Some(integrator));
        assert_eq!(strategies.attributes, image.attributes);
        for channel in ["R", "G", "B"] {
            let total = sum(&strategies, ".weighted", channel);
            let wanted = image.layer("").unwrap().channel(channel).unwrap();
            for (a, b) in total.iter().zip(wanted) {
                assert!((a - b).abs() <= 1e-5 * b.abs().max(1e-3), "{a} {b}");
            }
        }
    }
}

#[test]
fn each_strategy_has_its_layers() {
    let folder = folder();
    folder.succeed("render scene.xml --integrator bdpt --spp 8 -o a.npy --strategies s.exr");
    let image = exr::read(&folder.path("s.exr")).unwrap();
    for strategy in ["s0t2", "s0t3", "s1t2", "s2t1", "s2t2"] {
        for kind in ["weighted", "unweighted"] {
            let name = format!("{strategy}.{kind}");
            let layer = image.layer(&name).unwrap_or_else(|| panic!("{name}"));
            let names: Vec<&str> = layer.channels.iter().map(|(n, _)| n.as_str()).collect();
            assert_eq!(names, ["B", "G", "R"], "{name}");
        }
    }
    let of = |kind| sum(&image, kind, "R").iter().sum::<f32>();
    assert!(of(".unweighted") > 1.5 * of(".weighted"));
}

#[test]
fn the_estimator_is_named_in_all_outputs() {
    let folder = folder();
    folder.succeed("render scene.xml --integrator ptracer --spp 2 -o a.exr --stats s.json");
    let image = exr::read(&folder.path("a.exr")).unwrap();
    assert_eq!(image.attribute("integrator"), Some("particle"));
    assert_eq!(
        image.attribute("options"),
        Some("--seed 0 --spp 2 --integrator ptracer")
    );
    assert_eq!(folder.json("s.json")["integrator"], "particle");
}

#[test]
fn aovs_are_named_channels() {
    let folder = Folder::with_lens();
    folder.succeed("render scene.xml --integrator aov --spp 2");
    assert_eq!(folder.files(), ["scene.exr", "scene.xml"]);
    let image = exr::read(&folder.path("scene.exr")).unwrap();
    assert!(image.layer("deflection").unwrap().channel("Y").is_some());
    assert!(image.layer("exit.position").unwrap().channel("Z").is_some());
    let valid = image.layer("").unwrap().channel("valid").unwrap();
    assert!(valid.iter().all(|v| *v == 1.0));
    let message = folder.refuse("render scene.xml --integrator aov -o a.png");
    assert!(message.contains("write .exr or .npy"), "{message}");
}
