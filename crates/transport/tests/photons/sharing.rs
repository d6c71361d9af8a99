//! Photon maps and threads, and scenes without photons.

use crate::common::{parts, shoot_by, vacuum};
use crate::support::{in_glass, photons, view};
use morgana_transport::integrator::{Integrator, PhotonMapping, PhotonQuery};
use rayon::ThreadPoolBuilder;

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

/// Nothing to see is no error, but it is counted.
#[test]
fn a_scene_without_photons_is_dark() {
    let scene = parts(vec![], vec![vacuum()], vec![], view(1.0));
    let mapping = Integrator::Photon(PhotonMapping::default());
    let rendering = shoot_by(mapping, scene, 2, 13);
    assert_eq!(rendering.stats.photons.in_media, 0);
    assert_eq!(rendering.stats.photons.on_surfaces, 0);
    assert_eq!(rendering.film.summary().0, 0.0);
}
