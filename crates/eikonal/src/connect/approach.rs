//! From the ray of a launch to a start of Newton's method.

use super::closest::{Nearest, follow};
use super::launch::Launch;
use super::solver::Solver;
use super::start::{Reach, Start};
use super::world::World;
use crate::ray::Tolerance;
use glam::DVec3;

/// Starts need no more than this: Newton's method corrects them.
const SCOUT: f64 = 1e-4;

impl<R: Copy + PartialEq + std::fmt::Debug> Solver<R> {
    /// The start at the closest approach to `y` of the ray of a launch, and the unit direction in which
    /// the ray arrives there.
    ///
    /// The ray is followed over `reach.optical_length`, or until `reach.bounces` reflections of any kind are
    /// exceeded. At each encounter with an interface where it could be refracted or reflected, `decide`
    /// says whether it is reflected, until `reach.reflections` are used up. `None` if the ray is lost, or
    /// nowhere closer to `y` than at its start.
    pub fn approach<W: World<Region = R>>(
        &mut self,
        world: &W,
        (launch, region): (Launch, R),
        y: DVec3,
        reach: &Reach,
        decide: &mut dyn FnMut() -> bool,
    ) -> Option<(Start<R>, DVec3)> {
        let mut used = 0;
        let mut reflect = |_| {
            let reflected = used < reach.reflections && decide();
            used += u32::from(reflected);
            reflected
        };
        let mut best: Option<Nearest> = None;
        follow(
            world,
            (launch, region),
            (reach, self.scouting()),
            &mut reflect,
            &mut self.work,
            |leg| {
                let nearest = leg.nearest(y);
                if best.is_none_or(|b| nearest.distance < b.distance) {
                    best = Some(nearest);
                }
            },
        )
        .ok()?;
        let nearest = best.filter(|n| n.optical_length > 0.0 && n.distance.is_finite())?;
        Some((nearest.start(launch, region), nearest.direction))
    }

    /// The tolerance of rays along which starts are looked for.
    pub(super) fn scouting(&self) -> Tolerance {
        Tolerance::new(self.tolerance().get().max(SCOUT))
    }
}
