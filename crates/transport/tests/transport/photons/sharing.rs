//! Photon maps on several threads, and scenes without photons.

use crate::common::{glass, parts, shoot_by, vacuum};
use crate::photons::support::{ball, in_glass, photons, view};
use eikonal::field::Luneburg;
use glam::DVec3;
use morgana_transport::Scene;
use morgana_transport::integrator::{Integrator, PhotonMapping, PhotonQuery};
use morgana_transport::render::{RenderOptions, render};
use rayon::ThreadPoolBuilder;
use std::ops::ControlFlow;

#[test]
fn images_do_not_depend_on_threads() {
    for query in [PhotonQuery::Beam, PhotonQuery::Point] {
        let mapping = Integrator::Photon(PhotonMapping {
            radius: None,
            progressive: true,
            ..photons(1000, 1.0, query)
        });
        let image = |threads| {
            let pool = ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| shoot_by(mapping, in_glass(), 4, 12))
        };
        let one = image(1);
        assert!(one.stats.photons.in_media > 1000);
        assert!(one.first_radius > 0.0 && one.film.summary().0 > 0.0);
        for threads in [2, 5] {
            let several = image(threads);
            assert_eq!(one.film, several.film);
            assert_eq!(one.debiased, several.debiased);
            assert_eq!(one.stats, several.stats);
        }
    }
}

/// A scene without photons is not an error, but is counted.
#[test]
fn a_scene_without_photons_is_dark() {
    let scene = parts(vec![], vec![vacuum()], vec![], view(1.0));
    let mapping = Integrator::Photon(PhotonMapping::default());
    let rendering = shoot_by(mapping, scene, 2, 13);
    assert_eq!(rendering.stats.photons.in_media, 0);
    assert_eq!(rendering.stats.photons.on_surfaces, 0);
    assert_eq!(rendering.film.summary().0, 0.0);
}

/// Colours of different indices are rendered one by one, each with its own bias.
#[test]
fn groups_of_channels_have_their_own_bias() {
    let scenes = [1.1, 1.2, 1.3].map(|n0| {
        let index = Luneburg::new(n0, DVec3::ZERO, 2.0).unwrap().into();
        let mut scene = ball(index, glass(), 0.5);
        (scene.film.channels, scene.film.group_size) = (3, 1);
        Scene::new(scene).unwrap()
    });
    let options = RenderOptions::new(photons(1000, 0.2, PhotonQuery::Beam), 4, 14);
    let rendering = render(&scenes, &options, |_| ControlFlow::Continue(()));
    let debiased = rendering.debiased.unwrap();
    assert_eq!(debiased.film.groups(), 3);
    let bias = debiased.pixel_bias(&rendering.film);
    assert_eq!(bias.len(), 4 * 4 * 3);
    assert!(bias.iter().all(|b| *b != 0.0));
}
