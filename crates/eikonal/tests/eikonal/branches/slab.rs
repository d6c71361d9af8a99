//! Branches of a flat slab of glass, compared with mirror images.

use crate::branches::world::Glass;
use glam::DVec3;
use morgana_eikonal::connect::{Pattern, Reach};
use morgana_eikonal::{ConnectingRay, Solver, Tolerance};

const N: f64 = 1.5;
const THICKNESS: f64 = 1.0;

/// Relative tolerance of the closed forms. The remaining error comes from the offset of rays from
/// interfaces, 1e-11.
const MAX_ERROR: f64 = 1e-8;

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= MAX_ERROR * b.abs().max(1.0)
}

/// Returns the branches of the slab, from `x` in a region.
fn branches(
    x: DVec3,
    region: usize,
    y: DVec3,
    optical_length: f64,
    reflections: u32,
) -> Vec<ConnectingRay> {
    let world = Glass::slab(N, THICKNESS);
    let reach = Reach {
        optical_length,
        reflections,
        bounces: u32::MAX,
    };
    let found = Solver::new(Tolerance::new(1e-10))
        .all(&world, x, region, y, &reach)
        .branches;
    found.into_iter().map(|(_, branch)| branch).collect()
}

/// Returns the images of a point at height `z` in mirrors at 0 and `THICKNESS`, with at most `most`
/// reflections, and the number of reflections of each.
fn images(z: f64, most: i32) -> Vec<(f64, u32)> {
    let image = |m: i32| {
        // Image in cell m of the unfolded slab.
        let odd = m.rem_euclid(2) == 1;
        let z = if odd { THICKNESS - z } else { z };
        (f64::from(m) * THICKNESS + z, m.unsigned_abs())
    };
    (-most..=most).map(image).collect()
}

#[test]
fn branches_within_a_slab_are_its_mirror_images() {
    let (x, y) = (DVec3::new(0.1, -0.2, 0.3), DVec3::new(0.4, 0.1, 0.8));
    let reach = 14.0;
    for most in 0..=2 {
        let found = branches(x, 1, y, reach, most);
        // Beyond the critical angle reflection is total and not a choice. These images exist for
        // any allowed number of reflections.
        let total = |d: DVec3| d.truncate().length() / d.length() * N > 1.0;
        let expected: Vec<(DVec3, u32)> = images(y.z, 30)
            .into_iter()
            .map(|(z, k)| (DVec3::new(y.x, y.y, z) - x, k))
            .map(|(d, k)| (d, if total(d) { 0 } else { k }))
            .filter(|(d, k)| *k <= most && N * d.length() <= reach)
            .collect();
        assert_eq!(found.len(), expected.len(), "{most}: {found:?}");
        assert_eq!(expected.len(), 1 + 2 * most as usize);
        for (d, reflections) in expected {
            let branch = found
                .iter()
                .find(|b| b.direction_out.distance(d.normalize()) < MAX_ERROR);
            let branch = branch.expect("the image is found");
            assert!(close(branch.jacobian, d.length_squared()));
            assert!(close(branch.optical_length, N * d.length()));
            assert_eq!(branch.pattern.reflections(), reflections);
        }
    }
}

#[test]
fn total_reflections_are_not_counted() {
    // Far along the slab, nearly all images lie beyond the critical angle.
    let (x, y) = (DVec3::new(0.0, 0.0, 0.4), DVec3::new(4.0, 0.0, 0.7));
    let total = |d: DVec3| d.truncate().length() / d.length() * N > 1.0;
    let images: Vec<DVec3> = images(y.z, 30)
        .into_iter()
        .map(|(z, _)| DVec3::new(y.x, y.y, z) - x)
        .filter(|d| N * d.length() <= 12.0)
        .collect();
    let expected = images.iter().filter(|d| total(**d)).count();
    let found = branches(x, 1, y, 12.0, 0);
    assert!(expected > 6 && expected < images.len());
    assert_eq!(found.len(), expected);
    for branch in &found {
        assert_eq!(branch.pattern, Pattern::REFRACT);
        let is = |d: &&DVec3| d.normalize().distance(branch.direction_out) < MAX_ERROR;
        let image = images.iter().find(is).expect("an image");
        assert!(close(branch.jacobian, image.length_squared()));
    }
}

/// Returns the sine in air, the optical length, and J = ρ ρ'(θ) cos θ/sin θ of a ray. The ray
/// crosses the height `air` of air and the height `glass` of glass, and ends at the lateral
/// distance `lateral`.
fn through(lateral: f64, air: f64, glass: f64) -> (f64, f64, f64) {
    let distance = |s: f64| air * s / (1.0 - s * s).sqrt() + glass * s / (N * N - s * s).sqrt();
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if distance(middle) < lateral {
            low = middle;
        } else {
            high = middle;
        }
    }
    let s = 0.5 * (low + high);
    let (cos, root) = ((1.0 - s * s).sqrt(), (N * N - s * s).sqrt());
    let optical = air / cos + N * N * glass / root;
    let slope = cos * (air / cos.powi(3) + glass * N * N / root.powi(3));
    (s, optical, distance(s) * slope * cos / s)
}

#[test]
fn branches_beside_a_slab_follow_snells_law() {
    // Both ends are below the slab. Expect the direct ray, one reflected off the front, and those
    // that enter, are reflected 1, 3, 5, … times inside and leave.
    let (x, y) = (DVec3::new(0.0, 0.1, -0.6), DVec3::new(0.5, -0.3, -0.9));
    let lateral = (y - x).truncate().length();
    for most in 0..=4 {
        let found = branches(x, 0, y, 20.0, most);
        let mut expected = vec![through(lateral, (y.z - x.z).abs(), 0.0)];
        if most >= 1 {
            expected.push(through(lateral, 1.5, 0.0));
        }
        let inside = (1..=most).step_by(2);
        expected.extend(inside.map(|k| through(lateral, 1.5, f64::from(k + 1) * THICKNESS)));
        assert_eq!(found.len(), expected.len(), "{most}: {found:?}");
        for (branch, (sine, optical, jacobian)) in found.iter().zip(expected) {
            assert!(close(branch.direction_out.truncate().length(), sine));
            assert!(close(branch.optical_length, optical));
            assert!(close(branch.jacobian, jacobian), "{branch:?} {jacobian}");
        }
        let reflections: Vec<u32> = found.iter().map(|b| b.pattern.reflections()).collect();
        let odd = [0, 1, 1, 3];
        assert_eq!(reflections, odd[..found.len()]);
    }
}

#[test]
fn branches_through_a_slab_have_even_numbers_of_reflections() {
    let (x, y) = (DVec3::new(0.0, 0.1, -0.6), DVec3::new(0.5, -0.3, 1.9));
    let lateral = (y - x).truncate().length();
    let found = branches(x, 0, y, 20.0, 4);
    assert_eq!(found.len(), 3);
    for (k, branch) in [0, 2, 4].into_iter().zip(&found) {
        let (sine, optical, jacobian) = through(lateral, 1.5, f64::from(k + 1) * THICKNESS);
        assert_eq!(branch.pattern.reflections(), k);
        assert!(close(branch.direction_out.truncate().length(), sine));
        assert!(close(branch.optical_length, optical));
        assert!(close(branch.jacobian, jacobian));
    }
}
