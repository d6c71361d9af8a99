//! Agreement of photon maps, without their known bias, with other estimators.

use crate::common::{container, fog, mean, parts, shoot_by, sky, vacuum};
use crate::photons::support::{bdpt, in_glass, matched, photons, white_ball};
use crate::photons::{FAMILY, long};
use eikonal::field::Constant;
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::bsdf::Bsdf;
use morgana_transport::film::Decomposition;
use morgana_transport::integrator::{Bdpt, Integrator, PhotonMapping, PhotonQuery};
use morgana_transport::render::{RenderOptions, render};
use morgana_transport::scene::Parts;
use morgana_transport::sensor::{Orthographic, Sensor};
use morgana_transport::shape::Sphere;
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
    let in_media = [PhotonQuery::Beam, PhotonQuery::Point, PhotonQuery::Indirect];
    let scenes: [(&str, Make, &[PhotonQuery]); 3] = [
        ("matched", matched, &in_media),
        ("in glass", in_glass, &in_media),
        (
            "white ball",
            white_ball,
            &[PhotonQuery::Beam, PhotonQuery::Indirect],
        ),
    ];
    let more = if long() { 10 } else { 1 };
    for (name, make, queries) in scenes {
        let mut scene = make();
        scene.reflections = 2;
        let (a, se_a) = mean(&shoot_by(bdpt(), scene, 800 * more, 1));
        for &query in queries {
            let (radius, samples) = match query {
                PhotonQuery::Beam => (0.1, 25),
                PhotonQuery::Point | PhotonQuery::Indirect => (0.15, 80),
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
    let mut zs = Vec::new();
    for query in [PhotonQuery::Beam, PhotonQuery::Indirect] {
        let b = film(
            Integrator::Photon(PhotonMapping {
                max_depth,
                ..photons(2000, 0.05, query)
            }),
            60,
            4,
        );
        zs.extend((0..4).map(|layer| {
            let ((a, se_a), (b, se_b)) = (a.layer_summary(layer), b.layer_summary(layer));
            println!("{layer}: bdpt {a} ± {se_a}, {query:?} {b} ± {se_b}");
            two_sample_z(a, se_a, b, se_b)
        }));
        assert_eq!(b.layer_summary(3).0, 0.0);
        let sum: f64 = (0..4).map(|layer| b.layer_summary(layer).0).sum();
        assert!((sum / b.summary().0 - 1.0).abs() < 1e-12);
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// A preview normalises its kernel beside the wall of a medium, where photons are on one side only:
/// in a furnace, the rim of a ball of white fog is as bright as its surroundings. The tolerance is
/// twice the bias of the radius, 1.2 mean free paths.
#[test]
fn previews_are_as_bright_at_the_rim() {
    let sphere = Sphere::around(DVec3::ZERO, 1.0).unwrap();
    let turned = DMat3::from_cols(DVec3::NEG_X, DVec3::Y, DVec3::NEG_Z);
    let rim = Sensor::Orthographic(Orthographic::new(
        DAffine3 {
            matrix3: turned * 0.1,
            translation: DVec3::new(-0.9, 0.0, 1.2),
        },
        1.0,
    ));
    let furnace = parts(
        vec![container(sphere, Bsdf::Null)],
        vec![vacuum(), fog(Constant::new(1.0), 4.0, 1.0, 0.0)],
        vec![sky()],
        rim,
    );
    let mapping = photons(8000, 0.3, PhotonQuery::Indirect);
    let (mean, error) = mean(&shoot_by(Integrator::Photon(mapping), furnace, 60, 2));
    println!("{mean} ± {error}");
    assert!(error < 0.02, "no power");
    assert!((mean - 1.0).abs() < 0.1);
}
