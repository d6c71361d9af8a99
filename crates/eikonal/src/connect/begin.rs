//! Primary branches. The initial guess is the chord, bent by the field on the chord if only one
//! field bends rays (docs/theory.md#collocation).

use super::bend::{BentChord, Guess, bent};
use super::collocate::{Collocation, collocated};
use super::connection::{ConnectingRay, Failure};
use super::family::RayFamily;
use super::fermat::shortest;
use super::pattern::Pattern;
use super::solver::Solver;
use super::start::InitialGuess;
use super::world::{Piece, World};
use crate::interface::Rule;
use crate::ray::Arc;
use glam::DVec3;

/// Accuracy of a guess, in units of the tolerance: the largest change of its initial direction by a
/// further round.
const GUESS_ACCURACY: f64 = 3.0;
/// Maximum number of pieces of a chord that are examined.
const MAX_PIECES: usize = 8;

impl<R: Copy + PartialEq + std::fmt::Debug> Solver<R> {
    /// Returns the primary branch to `y` from a point or plane in `region`. The direction of
    /// `family` must point along the chord.
    ///
    /// If only one field lies between two points and bends the ray mildly, collocation finds the
    /// branch. Otherwise Newton's method finds it from an initial guess along the chord, refracted
    /// wherever refraction is possible. The guess is bent if exactly one region on the chord bends
    /// rays, and all interfaces on the chord are index-matched by declaration.
    ///
    /// # Errors
    ///
    /// See [`Failure`].
    pub fn primary<W: World<Region = R>>(
        &mut self,
        world: &W,
        family: RayFamily,
        region: R,
        y: DVec3,
    ) -> Result<ConnectingRay, Failure> {
        let x = family.x();
        // Use collocation if the whole chord lies in one field.
        let within = only_bending_region(world, x, region, y);
        if let (Some((only, line)), RayFamily::Point { .. }) = (&within, family)
            && *only == region
            && line.part == [0.0, 1.0]
            && let Some(found) = self.collocated(world, x, region, y)
        {
            return Ok(found);
        }
        // Otherwise use Newton's method from the bent chord.
        let straight = InitialGuess {
            family,
            region,
            optical_length: x.distance(y) * world.field(region).n(x),
            pattern: Pattern::REFRACT,
        };
        let bent = self.bent(world, &straight, within.as_ref());
        let found = self.solve(world, &bent, y);
        // If that fails, start from the shortest path.
        if let (Err(Failure::NotConverged), Some((region, line))) = (found, &within)
            && let Some(guess) = shortest(world.field(*region), line, is_plane(&straight))
        {
            let start = self.guessed(&straight, &guess);
            return self.solve(world, &start, y).or(found);
        }
        found
    }

    /// Returns the branch from `x` to `y` by collocation, and stores its pieces. Returns `None` if
    /// the branch leaves the region.
    fn collocated<W: World<Region = R>>(
        &mut self,
        world: &W,
        x: DVec3,
        region: R,
        y: DVec3,
    ) -> Option<ConnectingRay> {
        let tolerance = self.tolerance().get();
        let mut found = Collocation {
            arcs: &mut self.arcs,
            evaluations: &mut self.work.evaluations,
            relaxation: &mut self.relaxation,
        };
        let ray = collocated(world.field(region), x, y - x, tolerance, &mut found)?;
        if self
            .arcs
            .iter()
            .any(|arc| world.crossing(region, arc).is_some())
        {
            return None;
        }
        self.pieces.clear();
        self.pieces.extend(self.arcs.iter().map(|&arc| Piece {
            region,
            arc,
            theta_end: 1.0,
            event: None,
        }));
        let indices = ray.v.map(DVec3::length);
        let [direction_out, direction_in] = ray.v.map(DVec3::normalize);
        Some(ConnectingRay {
            start: x,
            direction_out,
            direction_in,
            indices,
            arc_length: ray.arc_length,
            optical_length: ray.optical_length,
            sigma: ray.sigma,
            jacobian: ray.jacobian,
            miss: 0.0,
            pattern: Pattern::REFRACT,
            shots: 0,
        })
    }

    /// Returns the initial guess bent by the region `within`, given with the line through it; the
    /// unchanged guess if there is no such region.
    fn bent<W: World<Region = R>>(
        &mut self,
        world: &W,
        start: &InitialGuess<R>,
        within: Option<&(R, BentChord)>,
    ) -> InitialGuess<R> {
        let Some((region, line)) = within else {
            return *start;
        };
        let accuracy = GUESS_ACCURACY * self.tolerance().get();
        match bent(world.field(*region), line, is_plane(start), accuracy) {
            Some(guess) => self.guessed(start, &guess),
            None => *start,
        }
    }

    /// Returns the initial guess with the direction, place and optical length of `guess`.
    fn guessed(&mut self, start: &InitialGuess<R>, guess: &Guess) -> InitialGuess<R> {
        self.work.evaluations += guess.evaluations;
        let family = match start.family {
            RayFamily::Point { x, .. } => RayFamily::Point {
                x,
                direction: guess.direction,
            },
            RayFamily::Plane { x, direction } => RayFamily::Plane {
                x: x + guess.offset,
                direction,
            },
        };
        InitialGuess {
            family,
            optical_length: guess.optical_length,
            ..*start
        }
    }
}

fn is_plane<R>(start: &InitialGuess<R>) -> bool {
    matches!(start.family, RayFamily::Plane { .. })
}

/// Finds the only region on the chord from `start` to `y` with a field that bends rays. Returns the
/// region, the chord, and its part in the region. Returns `None` if no region or more than one
/// bends rays, or if an interface refracts.
fn only_bending_region<W: World>(
    world: &W,
    start: DVec3,
    mut region: W::Region,
    y: DVec3,
) -> Option<(W::Region, BentChord)> {
    let chord = y - start;
    let d = chord.length();
    let mut bends = None;
    let mut line = BentChord {
        x: start,
        chord,
        part: [0.0, 1.0],
        optical: [0.0; 2],
    };
    // Follow the chord from interface to interface.
    let (mut x, mut done) = (start, 0.0);
    for _ in 0..MAX_PIECES {
        let remaining = Arc::line(x, y - x, 1.0);
        let crossing = world.crossing(region, &remaining);
        let theta = crossing.as_ref().map_or(1.0, |c| c.theta);
        let end = done + (1.0 - done) * theta;
        let field = world.field(region);
        if field.is_constant() {
            line.optical[usize::from(bends.is_some())] += field.n(x) * (end - done) * d;
        } else if bends.is_none() {
            bends = Some(region);
            line.part = [done, end];
        } else {
            return None;
        }
        let Some(crossing) = crossing else {
            return Some((bends?, line)).filter(|_| d > 0.0);
        };
        if crossing.rule != Rule::Pass {
            return None;
        }
        let side = crossing.normal.dot(chord);
        x = crossing.position + crossing.normal * world.ray_epsilon().copysign(side);
        (region, done) = (crossing.beyond, end);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::connect::Crossing;
    use crate::field::{Constant, Field, LinearSquare};
    use crate::ray::Tolerance;
    use glam::DMat3;

    /// Layer between z = 0 and 1, in which n² grows along x, in air.
    struct Layer([Field; 2], Rule);

    impl World for Layer {
        type Region = usize;

        fn field(&self, region: usize) -> &Field {
            &self.0[region]
        }

        fn crossing(&self, region: usize, arc: &Arc) -> Option<Crossing<usize>> {
            let first = |height: f64| {
                let z = arc.control().map(|p| p.z - height);
                crate::ray::bernstein::first_root(&z, 0.0, 1.0, [1e-14; 2])
            };
            let hits = [0.0, 1.0].into_iter().filter_map(first);
            let theta = hits.min_by(f64::total_cmp)?;
            Some(Crossing {
                theta,
                position: arc.position(theta),
                normal: DVec3::Z,
                shape: DMat3::ZERO,
                rule: self.1,
                beyond: 1 - region,
                surface: 0,
            })
        }

        fn ray_epsilon(&self) -> f64 {
            1e-12
        }
    }

    fn layer(rule: Rule) -> Layer {
        let graded = LinearSquare::new(1.0, DVec3::X * 0.2, DVec3::ZERO);
        Layer([Constant::new(1.0).into(), graded.unwrap().into()], rule)
    }

    fn straight(family: RayFamily, optical_length: f64) -> InitialGuess<usize> {
        InitialGuess {
            family,
            region: 0,
            optical_length,
            pattern: Pattern::REFRACT,
        }
    }

    fn bent(
        solver: &mut Solver<usize>,
        world: &Layer,
        start: &InitialGuess<usize>,
        y: DVec3,
    ) -> InitialGuess<usize> {
        let within = only_bending_region(world, start.family.x(), start.region, y);
        solver.bent(world, start, within.as_ref())
    }

    /// Largest error of the bent guess, relative to the error of the straight guess.
    const MAX_ERROR_RATIO: f64 = 0.02;

    #[test]
    fn rays_through_a_layer_are_met_from_points_and_planes() {
        let world = layer(Rule::Pass);
        let mut solver = Solver::new(Tolerance::new(1e-8));
        let (x, y) = (DVec3::new(0.1, 0.0, -1.0), DVec3::new(0.2, 0.1, 1.7));
        let direction = (y - x).normalize();
        let first = straight(RayFamily::Point { x, direction }, x.distance(y));
        let guess = bent(&mut solver, &world, &first, y);
        let ray = solver.solve(&world, &first, y).unwrap();
        let off = |d: DVec3| d.distance(ray.direction_out);
        assert!(off(direction) > 0.02, "{ray:?}");
        assert!(off(guess.family.direction()) < MAX_ERROR_RATIO * off(direction));
        assert!((guess.optical_length / ray.optical_length - 1.0).abs() < 1e-3);
        let (direction, foot) = (DVec3::Z, DVec3::new(0.2, 0.1, -1.0));
        let family = RayFamily::Plane { x: foot, direction };
        let first = straight(family, foot.distance(y));
        let guess = bent(&mut solver, &world, &first, y);
        let ray = solver.solve(&world, &first, y).unwrap();
        let off = |p: DVec3| p.distance(ray.start);
        assert!(off(foot) > 0.02, "{ray:?}");
        assert!(off(guess.family.x()) < MAX_ERROR_RATIO * off(foot));
        assert!((guess.optical_length / ray.optical_length - 1.0).abs() < 1e-3);
    }

    #[test]
    fn starts_across_refracting_interfaces_stay_straight() {
        let mut solver = Solver::new(Tolerance::default());
        let (x, y) = (DVec3::new(0.1, 0.0, -1.0), DVec3::new(0.2, 0.1, 1.7));
        let direction = (y - x).normalize();
        let first = straight(RayFamily::Point { x, direction }, x.distance(y));
        let guess = bent(&mut solver, &layer(Rule::Refract), &first, y);
        assert_eq!(guess, first);
    }
}
