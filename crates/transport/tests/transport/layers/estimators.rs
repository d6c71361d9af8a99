//! Agreement of estimators layer by layer.

use super::{bins, bounded, estimators, means, shoot};
use crate::common::{camera, container, fog, parts, vacuum};
use eikonal::field::Gaussian;
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::Spectrum;
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::emitter::{BeamProfile, Collimated, Emitter};
use morgana_transport::film::Decomposition;
use morgana_transport::integrator::Integrator;
use morgana_transport::scene::{Object, Parts};
use morgana_transport::shape::{Rectangle, Sphere};
use testkit::Family;
use testkit::batches::{moments, welch};

const RATE: f64 = 1e-3;
const BATCHES: u64 = 16;
/// Smallest fraction of light of a layer that is compared: the means of fainter layers are far from
/// normal.
const MIN_SHARE: f64 = 0.02;
/// Largest relative error of a layer; deviations of five times this error are found.
const WORST: f64 = 0.06;

/// A graded ball of fog, lit by a beam from one side and an emitter above.
fn fog_in_beam() -> Parts {
    let index = Gaussian::new(1.0, 0.1, DVec3::ZERO, 0.4).unwrap();
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    let to_world = DAffine3 {
        matrix3: DMat3::from_cols(DVec3::X * 1.5, DVec3::Z * 1.5, -DVec3::Y),
        translation: DVec3::Y * 1.4,
    };
    let light = Object {
        name: "light".into(),
        shape: Rectangle::new(to_world).unwrap().into(),
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::splat(0.3)).unwrap()),
        sides: None,
        emitter: Some(0),
    };
    let area = Emitter::Area {
        object: 1,
        radiance: Spectrum::ONE,
    };
    let beam = Emitter::Collimated(Collimated::new(
        DVec3::new(-1.5, 0.2, -0.5),
        DVec3::new(1.0, -0.1, 0.2).normalize(),
        BeamProfile::Disc { radius: 0.4 },
        Spectrum::splat(4.0),
    ));
    let sensor = camera(DVec3::new(0.0, -0.4, 3.0), DVec3::ZERO);
    let media = vec![vacuum(), fog(index, 1.0, 0.9, 0.3)];
    parts(vec![ball, light], media, vec![area, beam], sensor)
}

/// Means over the image of every layer, one per batch.
fn batches(integrator: Integrator, decomposition: Decomposition, samples: u64) -> Vec<Vec<f64>> {
    let parts = fog_in_beam();
    let batch = |seed| means(&shoot((integrator, decomposition), &parts, samples, seed));
    let batches: Vec<Vec<f64>> = (0..BATCHES).map(|b| batch(100 + b)).collect();
    let layer = |l: usize| batches.iter().map(|b| b[l]).collect();
    (0..decomposition.layers()).map(layer).collect()
}

#[test]
fn estimators_agree_in_every_bin() {
    let decomposition = Decomposition {
        length: bins(2.0, 1.0, 4),
        bounces: Some(1),
        emitters: Some(2),
        parts: None,
    };
    let [path, particle, bdpt] = estimators();
    let effort = [(path, 576), (particle, 192), (bdpt, 192)];
    let means = effort.map(|(e, samples)| batches(e, decomposition, samples));
    let total: f64 = means[2].iter().map(|l| moments(l).mean()).sum();
    let mut family = Family::new(RATE);
    let mut compared = 0.0;
    for (layer, reference) in means[2].iter().enumerate() {
        let m = moments(reference);
        if m.mean() < MIN_SHARE * total {
            continue;
        }
        compared += m.mean() / total;
        for (k, (integrator, _)) in effort.iter().enumerate() {
            let m = moments(&means[k][layer]);
            let error = m.standard_error() / m.mean();
            let name = format!("{} in {:?}", integrator.name(), decomposition.slots(layer));
            println!("{name}: {} ± {}", m.mean(), m.standard_error());
            assert!(error < WORST, "{name}: {error}");
            if k < 2 {
                family.push(name, welch(&means[k][layer], reference, 0.0));
            }
        }
    }
    assert!(compared > 0.9, "{compared} of the light is compared");
    family.check().unwrap();
}

/// Layers of bounces are on average differences of renders with different longest paths; this holds
/// for estimators whose paths depend on the longest one.
#[test]
fn bounces_are_differences_of_depths_in_the_mean() {
    let by_bounces = Decomposition {
        bounces: Some(2),
        ..Decomposition::default()
    };
    let mut family = Family::new(RATE);
    for kind in 1..3 {
        let layers = batches(estimators()[kind], by_bounces, 48);
        let sum = |b: usize| layers[0][b] + layers[1][b] + layers[2][b];
        let sums: Vec<f64> = (0..BATCHES as usize).map(sum).collect();
        let none = Decomposition {
            length: bins(0.0, 1e9, 1),
            ..Decomposition::default()
        };
        let short = &batches(bounded(3)[kind], none, 48)[0];
        let m = moments(short);
        assert!(
            m.standard_error() < 0.02 * m.mean(),
            "{}",
            m.standard_error() / m.mean()
        );
        assert!(moments(&layers[3]).mean() > 0.05 * m.mean());
        family.push(format!("{kind}"), welch(&sums, short, 0.0));
    }
    family.check().unwrap();
}
