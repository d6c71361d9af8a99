//! Derivatives with respect to coefficients of media, in each form of coefficients.

use super::*;
use morgana_transport::volume::GridFilter;

#[test]
fn derivatives_are_differences_where_rays_are_straight() {
    let all = [&IN_MEDIA[..], &OTHERS].concat();
    compare(
        "straight",
        &Setup::new(Constant::new(1.0), MadeOf::One),
        &all,
    );
}

#[test]
fn derivatives_are_differences_along_curved_rays() {
    let all = [&IN_MEDIA[..], &OTHERS].concat();
    compare("linear", &Setup::new(linear(), MadeOf::One), &all);
}

#[test]
fn derivatives_are_differences_in_a_lens() {
    let all = [&IN_MEDIA[..], &OTHERS].concat();
    compare("lens", &Setup::new(lens(), MadeOf::One), &all);
}

#[test]
fn derivatives_by_labels_and_voxels_are_differences() {
    // Interpolated voxels allow only changes of σ_t and α: between samples, products of
    // coefficients are not coefficients.
    for (made_of, parameters) in [
        (MadeOf::Labels, &IN_MEDIA[..4]),
        (MadeOf::Voxels(GridFilter::Nearest), &IN_MEDIA[..4]),
        (MadeOf::Voxels(GridFilter::Trilinear), &IN_MEDIA[..2]),
    ] {
        for index in [Field::from(Constant::new(1.0)), linear().into()] {
            let setup = Setup::new(index.clone(), made_of);
            compare(&format!("{made_of:?} {index:?}"), &setup, parameters);
        }
    }
}

#[test]
fn derivatives_by_mean_cosines_of_labels_and_voxels_are_differences() {
    for (made_of, g) in [
        (MadeOf::Labels, vec![0.6, -0.3]),
        (
            MadeOf::Voxels(GridFilter::Trilinear),
            (0..8).map(|i| 0.1 * f64::from(i) - 0.2).collect(),
        ),
    ] {
        let mut setup = Setup::new(linear(), made_of);
        setup.g = g;
        compare(&format!("g of {made_of:?}"), &setup, &IN_MEDIA[4..]);
    }
}

#[test]
fn results_do_not_depend_on_threads() {
    let setup = Setup::new(Constant::new(1.0), MadeOf::Voxels(GridFilter::Trilinear));
    let all = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| by(setup.scene(), &IN_MEDIA[..4], 16))
    });
    assert_eq!(all[0], all[1]);
    assert_eq!(all[0][0].shape, [2, 2, 2, 2]);
}
