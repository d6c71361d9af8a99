//! Initial guesses for Newton's method from the closest approaches of a ray.

use super::closest::{Nearest, minima};
use super::family::RayFamily;
use super::solver::Solver;
use super::start::{InitialGuess, Reach};
use super::world::World;
use crate::ray::Tolerance;
use glam::DVec3;

/// Smallest tolerance of rays that only yield initial guesses. Newton's method corrects their
/// errors.
const MIN_GUESS_TOLERANCE: f64 = 1e-4;

impl<R: Copy + PartialEq + std::fmt::Debug> Solver<R> {
    /// Returns an initial guess at a closest approach to `y` of the ray of a family, and the unit
    /// direction of the ray there.
    ///
    /// The ray is traced over `reach.optical_length`, or until it exceeds `reach.bounces`
    /// reflections of any kind. At each interface where it could be refracted or reflected, it is
    /// reflected if `uniform` gives less than ½, until `reach.reflections` are used up. `uniform`
    /// supplies independent uniform numbers in [0, 1). One of the local closest approaches is
    /// chosen, with a probability in inverse proportion to its distance. The closest one must not
    /// be the only candidate, because the ray of a branch may pass by `y` before it is reflected.
    /// `None` if the ray is lost, or is nowhere closer to `y` than at its start.
    pub fn approach<W: World<Region = R>>(
        &mut self,
        world: &W,
        family: RayFamily,
        region: R,
        y: DVec3,
        reach: &Reach,
        uniform: &mut dyn FnMut() -> f64,
    ) -> Option<(InitialGuess<R>, DVec3)> {
        let mut used = 0;
        let mut reflect = |_| {
            let reflected = used < reach.reflections && uniform() < 0.5;
            used += u32::from(reflected);
            reflected
        };
        let mut all: Vec<Nearest> = Vec::new();
        self.follow(world, family, region, reach, &mut reflect, |segment| {
            all.push(segment.nearest(y));
        })
        .ok()?;
        let mut minima: Vec<Nearest> = minima(&all).into_iter().map(|(_, n)| n).collect();
        minima.retain(|n| n.optical_length > 0.0 && n.distance.is_finite());
        minima.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        let nearest = choose(&minima, uniform)?;
        Some((nearest.start(family, region), nearest.direction))
    }

    /// Returns the tolerance of rays traced to find initial guesses.
    pub(super) fn scouting(&self) -> Tolerance {
        Tolerance::new(self.tolerance().get().max(MIN_GUESS_TOLERANCE))
    }
}

/// Chooses one of several approaches, sorted by distance, in inverse proportion to their distances.
fn choose<'a>(minima: &'a [Nearest], uniform: &mut dyn FnMut() -> f64) -> Option<&'a Nearest> {
    let (first, others) = minima.split_first()?;
    if others.is_empty() {
        return Some(first);
    }
    // Take distances relative to the closest one, so that an exact hit does not divide by zero.
    let weight =
        |n: &Nearest| first.distance.max(f64::MIN_POSITIVE) / n.distance.max(f64::MIN_POSITIVE);
    let mut left = uniform() * minima.iter().map(weight).sum::<f64>();
    let chosen = minima.iter().find(|n| {
        left -= weight(n);
        left < 0.0
    });
    chosen.or(Some(first))
}
