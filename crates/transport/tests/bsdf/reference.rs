//! Rough BSDFs against numbers computed with Mitsuba 3.9.1 (`scalar_rgb`, single precision).
//!
//! Mitsuba transports radiance, so its transmission values are multiplied by nᵢ²/nₒ² here.
//! False alarm: 2e-4 for the furnace; the rest is deterministic. Seeds are fixed.

use crate::common::{metal, rough_conductor, rough_dielectric};
use glam::DVec3;
use testkit::{Moments, Rng, z_test};
use transport::bsdf::{Bsdf, Surface};

const GLASS: Surface = Surface {
    normal: DVec3::Z,
    n_outer: 1.0,
    n_inner: 1.5,
};

fn direction(cos: f64, phi: f64) -> DVec3 {
    let sin = (1.0 - cos * cos).sqrt();
    DVec3::new(sin * phi.cos(), sin * phi.sin(), cos)
}

#[test]
fn rough_dielectric_values() {
    // Cosines of `toward` and `direction`, azimuth between them, value, density.
    let table = [
        (0.8, 0.6, 3.0, 0.03371337056159973, 0.0350118987262249),
        (0.3, 0.5, 2.5, 0.010554169304668903, 0.011224057525396347),
        (0.9, -0.8, 3.1, 0.145960733294487, 0.33251670002937317),
        (0.4, -0.7, 2.8, 0.3838540017604828, 0.8834444284439087),
        (-0.8, -0.6, 3.0, 0.6731501817703247, 0.6990777254104614),
        (-0.9, 0.7, 3.1, 8.354055404663086, 3.7979180812835693),
        (-0.7, 0.3, 2.9, 0.8187140822410583, 0.4333776831626892),
    ];
    for (o, i, phi, value, pdf) in table {
        let index = |cos: f64| if cos > 0.0 { 1.0 } else { 1.5 };
        let basic = value * f64::powi(index(i) / index(o), 2);
        let (toward, direction) = (direction(o, 0.0), direction(i, phi));
        let bsdf = rough_dielectric(0.3);
        let ours = bsdf.eval(&GLASS, toward, direction)[0];
        assert!(
            (ours / basic - 1.0).abs() < 2e-4,
            "{o} {i}: value {ours} against {basic}"
        );
        let ours = bsdf.pdf(&GLASS, toward, direction);
        assert!(
            (ours / pdf - 1.0).abs() < 2e-4,
            "{o} {i}: pdf {ours} against {pdf}"
        );
    }
}

#[test]
fn rough_conductor_values() {
    let table = [
        (
            0.8,
            0.6,
            3.0,
            [0.6395378708839417, 0.6503188014030457, 0.22820596396923065],
            0.6990776062011719,
        ),
        (
            0.3,
            0.5,
            2.5,
            [
                0.10950648784637451,
                0.11197582632303238,
                0.043662089854478836,
            ],
            0.12313959002494812,
        ),
    ];
    let [_, _, tint] = metal();
    for (o, i, phi, value, pdf) in table {
        let (toward, direction) = (direction(o, 0.0), direction(i, phi));
        let ours = rough_conductor(0.3).eval(&GLASS, toward, direction);
        for lane in 0..3 {
            let expected = value[lane] * tint[lane];
            assert!(
                (ours[lane] / expected - 1.0).abs() < 2e-4,
                "{o} {i}: {ours:?} against {value:?}"
            );
        }
        let ours = rough_conductor(0.3).pdf(&GLASS, toward, direction);
        assert!(
            (ours / pdf - 1.0).abs() < 2e-4,
            "{o} {i}: pdf {ours} against {pdf}"
        );
    }
}

/// A unit sphere of rough glass (alpha 0.2) in a white furnace, seen by an orthographic camera through the
/// window [−0.6, 0.6]². Facets that shadow each other lose energy: less than 1 is right.
#[test]
fn rough_glass_sphere_in_a_furnace() {
    let (reference, reference_error) = (0.908_401, 0.000_219);
    let bsdf = rough_dielectric(0.2);
    let mut rng = Rng::new(1);
    let mut mean = Moments::default();
    for _ in 0..300_000 {
        let (x, y) = (rng.range(-0.6, 0.6), rng.range(-0.6, 0.6));
        let p = DVec3::new(x, y, (1.0 - x * x - y * y).sqrt());
        mean.push(furnace_path(&bsdf, p, &mut rng));
    }
    let z = z_test::two_sample_z(
        mean.mean(),
        mean.standard_error(),
        reference,
        reference_error,
    );
    z_test::max_abs_z(&[z], 2e-4).unwrap_or_else(|e| panic!("{e}: {}", mean.mean()));
}

/// Radiance that leaves the sphere at `p` along +z: environment and camera are both at index 1.
fn furnace_path(bsdf: &Bsdf, mut p: DVec3, rng: &mut Rng) -> f64 {
    let (mut toward, mut throughput) = (DVec3::Z, 1.0);
    loop {
        let surface = Surface { normal: p, ..GLASS };
        let Some(b) = bsdf.sample(&surface, toward, rng.uniform()) else {
            return 0.0;
        };
        throughput *= b.weight[0];
        if b.direction.dot(p) > 0.0 {
            return throughput;
        }
        // The chord to the other side of the sphere.
        p = (p - 2.0 * p.dot(b.direction) * b.direction).normalize();
        toward = -b.direction;
    }
}
