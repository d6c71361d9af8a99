//! Random media of any strength, in the unit ball.

use crate::certificate::in_ball;
use glam::DVec3;
use morgana_eikonal::certificate::Uniqueness;
use morgana_eikonal::field::{
    Acoustic, AcousticMode, Bspline, Fisheye, Gaussian, Luneburg, Placement, Sum,
};
use morgana_eikonal::{Aabb, Field};
use std::f64::consts::TAU;
use testkit::Rng;

/// Random medium, as a function of its strength.
pub type Family = Box<dyn Fn(f64) -> Field>;

/// Draws a family.
type Draw = fn(&mut Rng) -> Family;

/// All kinds of families, with their names.
pub const KINDS: [(&str, Draw); 6] = [
    ("lumps", lumps),
    ("lens", lens),
    ("sound", sound),
    ("Luneburg", luneburg),
    ("fisheye", fisheye),
    ("grid", grid),
];

pub fn point(rng: &mut Rng, radius: f64) -> DVec3 {
    DVec3::from_array(rng.direction()) * (radius * rng.next_1d().cbrt())
}

fn lumps(rng: &mut Rng) -> Family {
    let terms: Vec<(DVec3, f64, f64)> = (0..4)
        .map(|_| (point(rng, 0.8), rng.range(-0.5, 1.0), rng.range(0.25, 0.7)))
        .collect();
    Box::new(move |s| {
        let bump =
            |&(c, a, w): &(DVec3, f64, f64)| Gaussian::new(1.33, s * a, c, w).unwrap().into();
        Sum::new(1.33, terms.iter().map(bump).collect())
            .unwrap()
            .into()
    })
}

fn lens(rng: &mut Rng) -> Family {
    let (center, width) = (point(rng, 0.1), rng.range(0.4, 1.0));
    Box::new(move |s| Gaussian::new(1.33, s, center, width).unwrap().into())
}

fn sound(rng: &mut Rng) -> Family {
    let (order, k, phase) = (
        (rng.next_1d() * 4.0) as u16,
        rng.range(2.0, 9.0),
        rng.range(0.0, TAU),
    );
    Box::new(move |s| {
        let mode = AcousticMode::new(s, order, k, phase).unwrap();
        Acoustic::new(1.3333, DVec3::ZERO, DVec3::X, DVec3::Z, vec![mode])
            .unwrap()
            .into()
    })
}

/// Luneburg lenses larger than the ball; weaker lenses are larger.
fn luneburg(rng: &mut Rng) -> Family {
    let center = point(rng, 0.2);
    Box::new(move |s| Luneburg::new(1.0, center, 1.0 / s).unwrap().into())
}

fn fisheye(rng: &mut Rng) -> Family {
    let center = point(rng, 0.2);
    Box::new(move |s| Fisheye::new(2.0, center, 1.0 / s).unwrap().into())
}

/// Lumps, sampled on a grid.
fn grid(rng: &mut Rng) -> Family {
    let lumps = lumps(rng);
    let cube = Aabb::new(DVec3::splat(-1.2), DVec3::splat(1.2));
    Box::new(move |s| {
        let field = lumps(s);
        Bspline::from_fn([10; 3], cube, Placement::Nodes, |x| field.n(x))
            .unwrap()
            .into()
    })
}

/// Returns the member of a family with criterion `target` or up to 2 % less. If no member reaches
/// it, returns the strongest member that has a criterion.
pub fn at_criterion(family: &Family, target: f64) -> (f64, Uniqueness) {
    let (mut below, mut above) = (1e-4_f64, 0.8);
    let mut certificate = in_ball(&family(below), 1.0);
    while certificate.criterion() < 0.98 * target && above > 1.001 * below {
        let middle = (below * above).sqrt();
        let candidate = in_ball(&family(middle), 1.0);
        if candidate.criterion() < target {
            (below, certificate) = (middle, candidate);
        } else {
            above = middle;
        }
    }
    (below, certificate)
}
