//! `hide_emitters` omits light that comes directly from emitters, for every estimator.
//!
//! False-alarm rate: 1e-3 for the comparison of estimators.

use morgana_io::{LoadOptions, Run};
use testkit::z_test::max_abs_z;

/// A sky, a ball under it, and a visible area light.
const SCENE: &str = r#"<scene version="3.0.0"><default name="hide" value="true"/>
<integrator type="path"><boolean name="hide_emitters" value="$hide"/></integrator>
<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="6"/><integer name="height" value="4"/>
<rfilter type="box"/></film></sensor><emitter type="constant"><rgb name="radiance" value="0.5"/></emitter>
<shape type="sphere"><point name="center" z="5"/><bsdf type="diffuse"/></shape>
<shape type="rectangle"><transform name="to_world"><scale value="0.5"/><rotate y="1" angle="180"/><translate x="-1.6" y="1" z="4"/></transform>
<emitter type="area"><rgb name="radiance" value="3"/></emitter></shape></scene>"#;

/// Means and variances of the first channel.
fn rendered(integrator: &str, hide: &str, spp: u64) -> Vec<[f64; 2]> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    std::fs::write(&path, SCENE).unwrap();
    let options = LoadOptions {
        defines: vec![("hide".into(), hide.into())],
        integrator: Some(integrator.into()),
        ..LoadOptions::default()
    };
    let loaded = morgana_io::load_scene(&path, &options).unwrap_or_else(|d| panic!("{d}"));
    let run = Run {
        total: Some(spp),
        ..Run::new(&loaded)
    };
    let film = run.render().unwrap().film;
    let pixel = |i| [film.mean_at(None, 0, i), film.variance_at(None, 0, i)].map(f64::from);
    (0..film.width() * film.height()).map(pixel).collect()
}

#[test]
fn pixels_that_see_the_sky_alone_are_black() {
    let [shown, hidden] = ["false", "true"].map(|hide| rendered("path", hide, 64));
    // The lower corners see only the sky.
    for corner in [18, 23] {
        assert!((shown[corner][0] - 0.5).abs() < 1e-6);
        assert_eq!(hidden[corner][0], 0.0);
    }
    // A pixel in the middle of the ball sees only reflected light.
    let ([a, va], [b, vb]) = (shown[14], hidden[14]);
    assert!(
        a > 0.1 && (a - b).abs() < 5.0 * (va + vb).sqrt(),
        "{a}, {b}"
    );
}

#[test]
fn estimators_hide_the_same_light() {
    let path = rendered("path", "true", 4000);
    for other in ["bdpt", "particle"] {
        let zs: Vec<f64> = path
            .iter()
            .zip(rendered(other, "true", 4000))
            .map(|([a, va], [b, vb])| (a - b) / (va + vb + 1e-8).sqrt())
            .collect();
        max_abs_z(&zs, 1e-3).unwrap_or_else(|e| panic!("{other}: {e}"));
    }
}
