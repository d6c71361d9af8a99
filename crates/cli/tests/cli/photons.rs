//! `morgana render` with photon maps: statements of files and reports about the bias.

use crate::support::Folder;
use io::image::exr;

const PARAMETERS: &str = r#"<integrator type="sppm"><integer name="photons" value="500"/>
  <float name="radius" value="0.2"/></integrator>"#;

/// Fog under uniform light, rendered by photons.
fn fog() -> Folder {
    Folder::with_scene(&format!(
        "{PARAMETERS}{}",
        r#"<shape type="sphere"><bsdf type="null"/>
             <medium type="homogeneous" name="interior"><float name="sigma_t" value="0.5"/></medium>
           </shape>"#
    ))
}

#[test]
fn bias_and_bounds_are_written() {
    let folder = fog();
    let line = folder.succeed("render scene.xml --spp 4 -o a.exr --stats s.json");
    assert!(line.contains("bias about"), "{line}");
    let image = exr::read(&folder.path("a.exr")).unwrap();
    let layer = |name: &str| image.layer(name).unwrap().channel("G").unwrap().to_vec();
    for (bias, bound) in layer("bias").into_iter().zip(layer("bound")) {
        assert!(bound.is_finite() && bias.abs() <= bound, "{bias} {bound}");
    }
    let photons = &folder.json("s.json")["photons"];
    assert_eq!(photons["radius"], 0.2);
    assert!(photons["in_media"].as_u64().unwrap() > 100);
    assert!(photons["error"].as_f64().unwrap() > photons["bias"].as_f64().unwrap().abs());
    folder.succeed("render scene.xml --spp 2 --integrator path --stats p.json");
    assert!(folder.json("p.json")["photons"].is_null());
}

#[test]
fn photons_that_fall_on_nothing_are_no_secret() {
    let line = Folder::with_scene("").succeed("render scene.xml --spp 2 --integrator photon");
    assert!(
        line.contains("no photon reached a surface or medium"),
        "{line}"
    );
}

#[test]
fn a_target_that_may_never_be_reached_is_refused() {
    let folder = fog();
    let message = folder.refuse("render scene.xml --integrator photon --target-error 0.01");
    assert!(message.contains("use sppm"), "{message}");
    folder.succeed("render scene.xml --integrator photon --target-error 0.01 --spp 2");
    let line = folder.succeed("render scene.xml --target-error 0.05");
    assert!(line.contains("target reached"), "{line}");
}
