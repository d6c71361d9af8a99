//! The uniqueness certificate (docs/theory.md#certificate). Media and pairs that it certifies have
//! no second ray; it certifies none that have one; and it certifies useful media.

mod draws;
mod families;
mod search;

use crate::common::tables::tables;
use glam::DVec3;
use morgana_eikonal::certificate::Uniqueness;
use morgana_eikonal::field::{Acoustic, AcousticMode, Gaussian, Luneburg, Selfoc};
use morgana_eikonal::{Aabb, Field, FieldBounds};
use search::all_rays;
use std::f64::consts::{PI, TAU};

/// Margin around the medium within which bounds are taken, relative to its size.
const MARGIN: f64 = 0.02;

/// Returns the certificate of a box.
fn in_box(field: &Field, min: DVec3, max: DVec3) -> Uniqueness {
    let medium = Aabb::new(min, max);
    let region = medium.grown(MARGIN * medium.diagonal());
    Uniqueness::new(region, medium.diagonal(), field.bounds(&region))
}

/// Returns the certificate of a ball around the origin. Its bounds leave out the corners of the box
/// around the ball.
fn in_ball(field: &Field, radius: f64) -> Uniqueness {
    let reach = radius * (1.0 + MARGIN);
    let region = Aabb::new(DVec3::splat(-reach), DVec3::splat(reach));
    const CELLS: usize = 12;
    let corner = |i: usize, j: usize, k: usize| {
        region.min + region.size() * DVec3::new(i as f64, j as f64, k as f64) / CELLS as f64
    };
    let bounds = (0..CELLS.pow(3))
        .map(|c| (c % CELLS, c / CELLS % CELLS, c / CELLS / CELLS))
        .map(|(i, j, k)| Aabb::new(corner(i, j, k), corner(i + 1, j + 1, k + 1)))
        .filter(|cell| cell.nearest_distance(DVec3::ZERO) < reach)
        .map(|cell| field.bounds(&cell))
        .reduce(FieldBounds::union);
    Uniqueness::new(region, 2.0 * radius, bounds.unwrap())
}

#[test]
fn what_has_several_rays_is_never_certified() {
    let (mut several, mut listed, mut seen) = (0, 0, 0);
    for table in tables() {
        let field = &table.field;
        let [min, max] = table.corners();
        let certificate = in_box(field, min, max);
        for pair in &table.pairs {
            let ([x, y], branches) = (pair.ends, pair.branches.len());
            if branches < 2 {
                continue;
            }
            several += 1;
            assert!(!certificate.whole_medium(), "{}", pair.id);
            assert!(!certificate.pair(field, x, y), "{}", pair.id);
            assert!(!certificate.pair(field, y, x), "{}", pair.id);
            // Check that the search for rays, on which the other tests rely, finds several where
            // they exist.
            listed += branches;
            let rays = all_rays(field, [x, y], (200, 1.2), |p| table.contains(p));
            seen += rays.len().min(branches);
        }
    }
    assert_eq!(several, 21);
    assert!(
        seen * 10 >= listed * 9,
        "found {seen} of {listed} listed rays"
    );
}

#[test]
fn strong_lenses_are_not_certified_and_weak_parts_of_them_are() {
    let lens: Field = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap().into();
    assert!(!in_ball(&lens, 1.0).whole_medium());
    assert!(in_ball(&lens, 0.3).whole_medium());
    let weak = Field::from(Gaussian::new(1.33, 0.01, DVec3::ZERO, 0.25).unwrap());
    assert!(in_ball(&weak, 1.0).whole_medium());
}

#[test]
fn a_lens_beside_the_chord_counts() {
    // Rays of curvature κ = 0.5 may leave a chord of length two by 0.25. This chord passes the
    // middle of a small but strong lens at a distance of 0.22.
    let field = Field::from(Gaussian::new(1.33, 0.055, DVec3::ZERO, 0.05).unwrap());
    let corner = DVec3::new(1.01, 0.5, 0.5);
    let certificate = in_box(&field, -corner, corner);
    let beside = |y: f64| [DVec3::new(-1.0, y, 0.0), DVec3::new(1.0, y, 0.0)];
    let [x, y] = beside(0.22);
    assert!(certificate.longest_ray().is_finite());
    assert!(!certificate.pair(&field, x, y));
    let chord = field.bounds(&Aabb::new(x, y));
    assert!(Uniqueness::new(Aabb::new(x, y), 2.0, chord).whole_medium());
}

#[test]
fn a_graded_rod_is_certified_up_to_a_good_part_of_its_focal_length() {
    // On the axis a rod of α = 1 refocuses after π cos θ. Rays that stay within the radius 0.3
    // refocus from a length of 2.997.
    let rod = Field::from(Selfoc::new(1.5, 1.0, DVec3::ZERO, DVec3::Z).unwrap());
    let radius = 0.3 / 2f64.sqrt(); // The box lies inside the cylinder.
    let certificate = |length: f64| {
        let corner = DVec3::new(radius, radius, 0.5 * length);
        in_box(&rod, -corner, corner)
    };
    let focus = PI * (1.0 - 0.3 * 0.3f64).sqrt();
    let mut length = 0.0;
    while certificate(length + 0.01).whole_medium() {
        length += 0.01;
    }
    assert!(
        (0.5 * focus..focus).contains(&length),
        "{length} of {focus}"
    );

    // In a longer rod, pairs close to each other are certified.
    let long = certificate(3.5);
    let ends = |d: f64| (DVec3::Z * (-0.5 * d), DVec3::Z * (0.5 * d));
    let certified = |d: f64| long.pair(&rod, ends(d).0, ends(d).1);
    assert!(!long.whole_medium() && certified(1.0) && !certified(0.99 * focus));
}

#[test]
fn ultrasound_in_tissue_is_certified() {
    // Lengths in centimetres: 1 MHz at 1500 m/s.
    let k = TAU * 1e6 / 1.5e5;
    for (delta, half) in [(1e-5, 5.0), (3e-5, 2.5), (1e-4, 1.0)] {
        for order in [0, 1, 3] {
            let mode = AcousticMode::new(delta, order, k, 0.2).unwrap();
            let field = Acoustic::new(1.36, DVec3::ZERO, DVec3::Z, DVec3::X, vec![mode]);
            let corner = DVec3::splat(half);
            let certificate = in_box(&field.unwrap().into(), -corner, corner);
            assert!(certificate.whole_medium(), "Δn {delta}, mode {order}");
        }
    }
}
