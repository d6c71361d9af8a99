//! The bias of photon maps and its estimate, compared with closed forms.

use crate::common::shoot_by;
use crate::photons::FAMILY;
use crate::photons::support::{InBox, boxed, photons};
use morgana_transport::integrator::{Integrator, PhotonMapping, PhotonQuery};
use morgana_transport::photons::Kernel;
use testkit::z_test::{max_abs_z, z_score};

fn kernel(query: PhotonQuery, radius: f64) -> Kernel {
    match query {
        PhotonQuery::Beam => Kernel::disc(radius),
        PhotonQuery::Point | PhotonQuery::Indirect => Kernel::ball(radius),
    }
}

/// The expectation of the blurred image differs from the image by r², and of the debiased image by
/// r⁴. The closed forms of the next test do so, too. They are not pure powers; the tolerance is the
/// term of the next order.
#[test]
fn bias_is_of_second_order_and_what_is_left_of_fourth() {
    let truth = InBox::pixels().iter().sum::<f64>() / 16.0;
    for query in [PhotonQuery::Beam, PhotonQuery::Point] {
        let [few, more] = [0.1, 0.2].map(|r| InBox::blurred(kernel(query, r), query));
        let orders = [0, 1].map(|k| ((more[k] - truth) / (few[k] - truth)).log2());
        println!("{query:?}: {orders:?}");
        assert!((orders[0] - 2.0).abs() < 0.1, "{orders:?}");
        assert!((orders[1] - 4.0).abs() < 0.5, "{orders:?}");
    }
}

/// Renders have these expectations for several radii. At the largest radius the bias is 15 % of the
/// image.
#[test]
fn renders_are_blurred_and_debiased_as_they_should_be() {
    let truth = InBox::pixels().iter().sum::<f64>() / 16.0;
    let mut zs = Vec::new();
    // A point of a ray collects less than the whole ray.
    for (query, paths, samples) in [
        (PhotonQuery::Beam, 4000, 30),
        (PhotonQuery::Point, 1000, 150),
    ] {
        for radius in [0.1, 0.2, 0.4] {
            let mapping = Integrator::Photon(PhotonMapping {
                max_depth: Some(2),
                ..photons(paths, radius, query)
            });
            let rendering = shoot_by(mapping, boxed(), samples, 7);
            let films = [&rendering.film, &rendering.debiased.as_ref().unwrap().film];
            let expected = InBox::blurred(kernel(query, radius), query);
            for (film, expected) in films.into_iter().zip(expected) {
                let (mean, se) = film.summary();
                println!(
                    "{query:?} {radius}: {mean} ± {se}, expected {expected}, unblurred {truth}"
                );
                zs.push(z_score(mean, se, expected));
            }
            let (mean, se) = rendering.film.summary();
            assert!(radius < 0.4 || (mean - truth).abs() > 5.0 * se, "no power");
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}
