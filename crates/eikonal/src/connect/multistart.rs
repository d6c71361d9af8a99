//! Dense search for every branch between two points.

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

/// Number of directions over the whole sphere: 6° apart.
const SPHERE_DIRECTIONS: usize = 1000;
/// Number of directions in a cone about the chord: 2° apart. Behind a lens, some branches are found
/// only from rays close to them.
const CONE_DIRECTIONS: usize = 500;
/// Half-angle of the cone about the chord, in radians.
const HALF_ANGLE: f64 = 25.0 * PI / 180.0;

/// Maximum number of initial guesses along one ray through one pattern. Rays that creep along
/// inside a curved interface come close to a point at the interface very often.
const MAX_STARTS: usize = 32;

/// Tolerance of the search, which only separates branches. The branches are then solved to the
/// requested tolerance.
const SEARCH_TOLERANCE: f64 = 1e-6;

/// Largest difference of two results that count as one branch: in radians and in relative optical
/// path length, or in units of the tolerance if that is more.
const SAME_BRANCH: (f64, f64) = (1e-4, 100.0);

/// Result of a dense search.
#[derive(Clone, Debug)]
pub struct All<R> {
    /// Branches, shortest optical path first, each with an initial guess from which one ray finds
    /// it.
    pub branches: Vec<(InitialGuess<R>, ConnectingRay)>,
    /// Reason why a branch that was found at the search tolerance is not among the branches; the
    /// last reason, if there are several.
    pub lost: Option<Failure>,
}

impl<R: Copy + PartialEq + std::fmt::Debug> Solver<R> {
    /// Returns every branch from point `x` in `region` to `y` that a dense search finds.
    ///
    /// Newton's method starts from the chord, and from every local closest approach to `y` of about
    /// 1500 rays from `x` in all directions. More rays are added where rays graze an interface.
    /// Each ray is followed through every possible pattern of at most `reach.reflections`
    /// reflections. The search is not random. It traces thousands of rays, and is exhaustive in
    /// practice, not by proof; it can miss branches that graze an interface within about 3°.
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
        // Collect branches at the tolerance of the search.
        let reach = &reach.within(x.distance(y));
        let mut search = Solver::new(Tolerance::new(self.tolerance().get().max(SEARCH_TOLERANCE)));
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
        // Solve for each branch at the requested tolerance.
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

    /// Returns all directions of the search.
    fn directions<W: World<Region = R>>(
        &mut self,
        world: &W,
        x: DVec3,
        region: R,
        chord: DVec3,
        reach: &Reach,
    ) -> Vec<DVec3> {
        let mut directions: Vec<DVec3> = fibonacci(DVec3::Z, SPHERE_DIRECTIONS, PI).collect();
        let cone: Vec<DVec3> = fibonacci(chord, CONE_DIRECTIONS, HALF_ANGLE).collect();
        let mut close = self.edges(world, x, region, &directions, reach);
        close.extend(self.edges(world, x, region, &cone, reach));
        directions.extend(cone);
        directions.extend(close);
        directions
    }

    /// Returns initial guesses at all local closest approaches to `y` of the ray of a family,
    /// through every pattern that the ray can take.
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
            // Keep the pieces of a lost ray up to its end.
            let _ = self.follow(world, family, region, reach, &mut reflect, |segment| {
                nearest.push(segment.nearest(y));
            });
            // Skip the part before the last reflection: the pattern without this reflection has
            // covered it.
            nearest = minima(&nearest).into_iter().map(|(_, n)| n).collect();
            nearest.retain(|n| n.pattern == pattern);
            nearest.sort_by(|a, b| a.distance.total_cmp(&b.distance));
            let new = nearest.iter().take(MAX_STARTS);
            starts.extend(new.map(|n| n.start(family, region)));
            if pattern.reflections() < reach.reflections {
                let later = choices.into_iter().filter(|&i| pattern.last() < Some(i));
                patterns.extend(later.filter_map(|i| pattern.with(i)));
            }
        }
        starts
    }

    /// Returns true if the branch solved for last lies within `reach`.
    fn within(&self, branch: &ConnectingRay, reach: &Reach) -> bool {
        let bounces = self.pieces().iter().filter(|p| p.is_reflected()).count();
        let reflections = branch.pattern.reflections();
        reach.includes(branch.optical_length, reflections, bounces as u32)
    }

    /// Returns true if two connections between the same ends are one branch, as far as rays of this
    /// tolerance can show. They may differ by 1e-4 in direction (radians) and in relative optical
    /// path length, or by 100 times the tolerance if that is more.
    pub fn is_same_branch(&self, a: &ConnectingRay, b: &ConnectingRay) -> bool {
        let same = SAME_BRANCH.0.max(SAME_BRANCH.1 * self.tolerance().get());
        a.same_branch(b, same, same)
    }

    fn keep(&self, found: &mut Vec<ConnectingRay>, branch: ConnectingRay) {
        if !found.iter().any(|f| self.is_same_branch(f, &branch)) {
            found.push(branch);
        }
    }
}

impl ConnectingRay {
    /// Returns an initial guess from which one ray finds this branch.
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

/// Returns `count` unit vectors evenly spread over the cap of a half-angle about an axis: a
/// Fibonacci spiral.
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
