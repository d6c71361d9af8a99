//! Agreement of photon maps, without their known bias, with other estimators.

use crate::common::{mean, shoot_by};
use crate::photons::support::{bdpt, in_glass, matched, photons, white_ball};
use crate::photons::{FAMILY, long};
use morgana_transport::film::Decomposition;
use morgana_transport::integrator::{Bdpt, Integrator, PhotonMapping, PhotonQuery};
use morgana_transport::render::{RenderOptions, render};
use morgana_transport::scene::Parts;
use morgana_transport::{Film, Scene};
use testkit::z_test::{max_abs_z, two_sample_z};

/// Mean of the debiased image and its standard error.
fn debiased(mapping: PhotonMapping, parts: Parts, samples: u64, seed: u64) -> (f64, f64) {
    let rendering = shoot_by(Integrator::Photon(mapping), parts, samples, seed);
    assert_eq!(rendering.stats.not_finite, 0);
    rendering.debiased.unwrap().film.summary()
}

/// Means agree. In each scene the errors of both means are 1 to 4 %.
#[test]
fn photons_show_what_bdpt_shows() {
    type Make = fn() -> Parts;
    let mut zs = Vec::new();
    let scenes: [(&str, Make, &[PhotonQuery]); 3] = [
        ("matched", matched, &[PhotonQuery::Beam, PhotonQuery::Point]),
        (
            "in glass",
            in_glass,
            &[PhotonQuery::Beam, PhotonQuery::Point],
        ),
        ("white ball", white_ball, &[PhotonQuery::Beam]),
    ];
    let more = if long() { 10 } else { 1 };
    for (name, make, queries) in scenes {
        let mut scene = make();
        scene.reflections = 2;
        let (a, se_a) = mean(&shoot_by(bdpt(), scene, 800 * more, 1));
        for &query in queries {
            let (radius, samples) = match query {
                PhotonQuery::Beam => (0.1, 25),
                PhotonQuery::Point => (0.15, 80),
            };
            let mapping = photons(2500, radius, query);
            let (b, se_b) = debiased(mapping, make(), samples * more, 2);
            println!("{name} {query:?}: bdpt {a} ± {se_a}, photons {b} ± {se_b}");
            assert!(se_a < 0.02 * a && se_b < 0.04 * a, "no power");
            zs.push(two_sample_z(a, se_a, b, se_b));
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// Depths are counted as in other estimators: layers by bounces agree.
#[test]
fn bounces_are_told_apart() {
    let film = |integrator, samples, seed| -> Film {
        let mut options = RenderOptions::new(integrator, samples, seed);
        options.decomposition = Decomposition {
            bounces: Some(2),
            ..Decomposition::default()
        };
        let scene = Scene::new(matched()).unwrap();
        render(&[scene], &options, |_| std::ops::ControlFlow::Continue(())).film
    };
    let max_depth = Some(3);
    let a = film(
        Integrator::Bdpt(Bdpt {
            max_depth,
            ..Bdpt::default()
        }),
        300,
        3,
    );
    let b = film(
        Integrator::Photon(PhotonMapping {
            max_depth,
            ..photons(2000, 0.05, PhotonQuery::Beam)
        }),
        60,
        4,
    );
    let zs: Vec<f64> = (0..4)
        .map(|layer| {
            let ((a, se_a), (b, se_b)) = (a.layer_summary(layer), b.layer_summary(layer));
            println!("{layer}: bdpt {a} ± {se_a}, photons {b} ± {se_b}");
            two_sample_z(a, se_a, b, se_b)
        })
        .collect();
    assert_eq!(b.layer_summary(3).0, 0.0);
    max_abs_z(&zs, FAMILY).unwrap();
    let sum: f64 = (0..4).map(|layer| b.layer_summary(layer).0).sum();
    assert!((sum / b.summary().0 - 1.0).abs() < 1e-12);
}
