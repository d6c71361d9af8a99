//! Every branch between two points, by a dense search.

use super::closest::{Nearest, minima};
use super::connection::{ConnectingRay, Failure};
use super::family::RayFamily;
use super::pattern::Pattern;
use super::solver::{Solver, chord};
use super::start::{InitialGuess, Reach};
use super::world::World;
use crate::ray::{Tolerance, perpendicular_basis};
use glam::DVec3;
use std::f64::consts::PI;

/// Directions over the whole sphere: 6° apart.
const SPHERE: usize = 1000;
/// Directions in a cone about the chord: 2° apart. Behind a lens there are branches that only rays
/// close to them lead to.
const CONE: usize = 500;
/// Half-angle of that cone, in radians.
const HALF_ANGLE: f64 = 25.0 * PI / 180.0;

/// Most starts along one ray through one pattern. Rays that creep along inside a curved interface come
/// close to a point at it very often.
const MOST_STARTS: usize = 32;

/// Branches are told apart at this tolerance, then solved to that which is asked for.
const SEARCH: f64 = 1e-6;

/// Found branches closer than this, in radians and in relative optical path length, are one, and
/// closer than this multiple of the tolerance.
const SAME: (f64, f64) = (1e-4, 100.0);

/// What a dense search finds.
#[derive(Clone, Debug)]
pub struct All<R> {
    /// The branches, the shortest optical path first, each with the start from which it is found at once.
    pub branches: Vec<(InitialGuess<R>, ConnectingRay)>,
    /// Why one that was found at a coarser tolerance is not among them: the last one, if there are several.
    pub lost: Option<Failure>,
}

impl<R: Copy + PartialEq + std::fmt::Debug> Solver<R> {
    /// Every branch from point `x` in `region` to `y` that a dense search finds.
    ///
    /// Newton's method starts from the chord, and from every local closest approach to `y` of about
    /// 1500 rays from `x` in all directions, and of more where rays only just meet an interface, each
    /// followed through every pattern of at most `reach.reflections` reflections that it can take. None
    /// of this is random. The search takes thousands of shots, and is exhaustive in practice, not by
    /// proof; branches that graze an interface within some 3° can be missed.
    pub fn all<W: World<Region = R>>(
        &mut self,
        world: &W,
        x: DVec3,
        region: R,
        y: DVec3,
        reach: &Reach,
    ) -> All<R> {
        let chord = match chord(x, y) {
            Ok(chord) => chord,
            Err(failure) => {
                return All {
                    branches: Vec::new(),
                    lost: Some(failure),
                };
            }
        };
        let reach = &reach.within(x.distance(y));
        let mut search = Solver::new(Tolerance::new(self.tolerance().get().max(SEARCH)));
        let mut rough = Vec::new();
        if let Ok(primary) = search.connect(world, x, region, y) {
            rough.push(primary);
        }
        for direction in search.directions(world, x, region, chord, reach) {
            let family = RayFamily::Point { x, direction };
            for start in search.starts(world, family, region, y, reach) {
                if let Ok(branch) = search.solve(world, &start, y) {
                    search.keep(&mut rough, branch);
                }
            }
        }
        self.work += search.work;
        let (mut found, mut lost) = (Vec::new(), None);
        for branch in &rough {
            match self.solve(world, &branch.again(region), y) {
                Ok(branch) if self.within(&branch, reach) => self.keep(&mut found, branch),
                Ok(_) => {}
                Err(failure) => lost = Some(failure),
            }
        }
        found.sort_by(|a, b| a.optical_length.total_cmp(&b.optical_length));
        All {
            branches: found.into_iter().map(|b| (b.again(region), b)).collect(),
            lost,
        }
    }

    /// All directions that the search follows.
    fn directions<W: World<Region = R>>(
        &mut self,
        world: &W,
        x: DVec3,
        region: R,
        chord: DVec3,
        reach: &Reach,
    ) -> Vec<DVec3> {
        let mut directions: Vec<DVec3> = fibonacci(DVec3::Z, SPHERE, PI).collect();
        let cone: Vec<DVec3> = fibonacci(chord, CONE, HALF_ANGLE).collect();
        let mut close = self.edges(world, x, region, &directions, reach);
        close.extend(self.edges(world, x, region, &cone, reach));
        directions.extend(cone);
        directions.extend(close);
        directions
    }

    /// Starts at all local closest approaches to `y` of the ray of a family, through every pattern that
    /// it can take.
    fn starts<W: World<Region = R>>(
        &mut self,
        world: &W,
        family: RayFamily,
        region: R,
        y: DVec3,
        reach: &Reach,
    ) -> Vec<InitialGuess<R>> {
        let mut starts = Vec::new();
        let mut patterns = vec![Pattern::REFRACT];
        while let Some(pattern) = patterns.pop() {
            let mut nearest: Vec<Nearest> = Vec::new();
            let mut choices = Vec::new();
            let mut reflect = |i| {
                choices.push(i);
                pattern.reflects(i)
            };
            // A ray that is lost counts as far as it went.
            let _ = self.follow(world, family, region, reach, &mut reflect, |leg| {
                nearest.push(leg.nearest(y));
            });
            // What comes before the last reflection has been seen without it.
            nearest = minima(&nearest).into_iter().map(|(_, n)| n).collect();
            nearest.retain(|n| n.pattern == pattern);
            nearest.sort_by(|a, b| a.distance.total_cmp(&b.distance));
            let new = nearest.iter().take(MOST_STARTS);
            starts.extend(new.map(|n| n.start(family, region)));
            if pattern.reflections() < reach.reflections {
                let later = choices.into_iter().filter(|&i| pattern.last() < Some(i));
                patterns.extend(later.filter_map(|i| pattern.with(i)));
            }
        }
        starts
    }

    /// Whether the branch that was last solved for is looked for.
    fn within(&self, branch: &ConnectingRay, reach: &Reach) -> bool {
        let bounces = self.pieces().iter().filter(|p| p.is_reflected()).count();
        let reflections = branch.pattern.reflections();
        reach.includes(branch.optical_length, reflections, bounces as u32)
    }

    /// Whether two connections between the same ends are one branch, as far as rays of this tolerance
    /// can tell: to 1e-4 in direction (radians) and in relative optical path length, or to 100 times the
    /// tolerance if that is more.
    pub fn is_same_branch(&self, a: &ConnectingRay, b: &ConnectingRay) -> bool {
        let same = SAME.0.max(SAME.1 * self.tolerance().get());
        a.same_branch(b, same, same)
    }

    fn keep(&self, found: &mut Vec<ConnectingRay>, branch: ConnectingRay) {
        if !found.iter().any(|f| self.is_same_branch(f, &branch)) {
            found.push(branch);
        }
    }
}

impl ConnectingRay {
    /// A start that leads to this branch in one shot.
    fn again<R>(&self, region: R) -> InitialGuess<R> {
        InitialGuess {
            family: RayFamily::Point {
                x: self.start,
                direction: self.direction_out,
            },
            region,
            optical_length: self.optical_length,
            pattern: self.pattern,
        }
    }
}

/// Unit vectors evenly spread over the cap of a half-angle about an axis: a Fibonacci spiral.
fn fibonacci(axis: DVec3, count: usize, half_angle: f64) -> impl Iterator<Item = DVec3> {
    let golden = PI * (3.0 - 5f64.sqrt());
    let [t1, t2] = perpendicular_basis(axis);
    let height = 1.0 - half_angle.cos();
    (0..count).map(move |i| {
        let cos = 1.0 - height * (i as f64 + 0.5) / count as f64;
        let (sin, azimuth) = ((1.0 - cos * cos).max(0.0).sqrt(), golden * i as f64);
        axis * cos + (t1 * azimuth.cos() + t2 * azimuth.sin()) * sin
    })
}
