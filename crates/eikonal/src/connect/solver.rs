//! Newton's method on the shot (docs/theory.md#damping-and-trust-region).

use super::connection::{ConnectingRay, Failure};
use super::family::RayFamily;
use super::newton::{EndState, Iterate, system};
use super::pattern::Pattern;
use super::shoot::{Trajectory, Travelled};
use super::start::{Followed, InitialGuess};
use super::world::{Piece, World};
use crate::budget::{SHOTS_PER_CONNECTION, STEPS_PER_CONNECTION};
use crate::ray::{Arc, Tolerance, Work};
use glam::{DVec2, DVec3};

/// A ray that misses by this many tolerances is corrected to first order instead of being shot again,
/// unless its tube is narrow: the square of such a miss is below the tolerance, and the Jacobian changes
/// by no more than that many tolerances. Where steps are rejected, rays jump by a tolerance or so, and no
/// shot would do better.
const LAST_CORRECTION: f64 = 10.0;
/// The ray is shot once more if the last correction may change the Jacobian by more tolerances than this, as where the field varies within a
/// small part of the ray's length.
const STEADY: f64 = 10.0;
/// Misses of less than this many tolerances of the ray's length are corrected without asking how fine the field is.
const NEAR: f64 = 0.1;
/// Of the third derivatives that length scales allow everywhere, rays meet such a share.
const MET: f64 = 2e-3;
/// Share of the longest step that the last correction may make.
const SMALL: f64 = 0.1;
/// A tube is too narrow if straight rays would diverge to its width over this many tolerances: rays may meet in half the
/// arc's length, and the ray may miss the focus by the tolerance.
const NARROW: f64 = 2.0;
/// After a step that did not reduce the miss the next one is at most so much of it;
const SHORTER: f64 = 0.5;
/// after one that left less than this share of it,
const GOOD: f64 = 0.5;
/// at most this multiple of it.
const LONGER: f64 = 3.0;
/// Steps below this size show that the iteration has come to a local minimum of the miss.
const STUCK: f64 = 1e-3;

/// The end of a shot.
#[derive(Clone, Copy)]
pub(super) struct Hit {
    /// The index where the ray starts.
    pub first_index: f64,
    pub end_state: EndState,
    pub travelled: Travelled,
    /// Reflections by choice.
    pub pattern: Pattern,
}

impl Hit {
    /// |J| or |A| there.
    fn jacobian(&self) -> f64 {
        let EndState { v, variation, .. } = &self.end_state;
        variation.cross_section(*v).abs()
    }
}

/// Finds connections; holds the storage that they reuse.
#[derive(Clone, Debug)]
pub struct Solver<R> {
    pub(super) tolerance: Tolerance,
    pub(super) pieces: Vec<Piece<R>>,
    /// Those of a ray that is looked at.
    pub(super) arcs: Vec<Arc>,
    /// Work done so far.
    pub work: Work,
}

impl<R: Copy + PartialEq + std::fmt::Debug> Solver<R> {
    /// A solver that accepts a ray when it passes the target within ten times `tolerance` times the length
    /// of its last leg (from the last interface, or from the start), and corrects directions and lengths
    /// to first order for what remains.
    pub fn new(tolerance: Tolerance) -> Self {
        Solver {
            tolerance,
            pieces: Vec::new(),
            arcs: Vec::new(),
            work: Work::default(),
        }
    }

    /// The tolerance of rays.
    pub fn tolerance(&self) -> Tolerance {
        self.tolerance
    }

    /// The pieces of the ray that was last found, in order.
    pub fn pieces(&self) -> &[Piece<R>] {
        &self.pieces
    }

    /// The [primary](Self::primary) branch from point `x` in `region` to `y`, started along the chord; refracted
    /// wherever that is possible.
    ///
    /// # Errors
    ///
    /// See [`Failure`].
    pub fn connect<W: World<Region = R>>(
        &mut self,
        world: &W,
        x: DVec3,
        region: R,
        y: DVec3,
    ) -> Result<ConnectingRay, Failure> {
        let direction = chord(x, y)?;
        self.primary(world, RayFamily::Point { x, direction }, region, y)
    }

    /// The [primary](Self::primary) branch from the plane through `x` perpendicular to `direction`, of any length, to `y`, started at
    /// the foot of `y` on the plane; refracted wherever that is possible.
    ///
    /// # Errors
    ///
    /// [`Failure::Coincident`] if `y` is not in front of the plane, or the direction is zero; see [`Failure`].
    pub fn connect_plane<W: World<Region = R>>(
        &mut self,
        world: &W,
        x: DVec3,
        direction: DVec3,
        region: R,
        y: DVec3,
    ) -> Result<ConnectingRay, Failure> {
        let direction = direction.try_normalize().ok_or(Failure::Coincident)?;
        let depth = (y - x).dot(direction);
        let foot = y - direction * depth;
        if !depth.is_finite() {
            return Err(Failure::TooFar);
        }
        if depth <= 0.0 {
            return Err(Failure::Coincident);
        }
        let family = RayFamily::Plane { x: foot, direction };
        self.primary(world, family, region, y)
    }

    /// The branch to which Newton's method converges from a start.
    ///
    /// The unknowns are the family's two parameters and the optical path length ℓ, the residual is
    /// x(ℓ) − y; steps are those of Levenberg and Marquardt within a trust region, which shrinks where they do not reduce it.
    /// With ℓ rather than σ the family's points at equal parameter form a wavefront, which near a focus
    /// closes in on it from one side.
    ///
    /// # Errors
    ///
    /// See [`Failure`]. What is not finite, or no length above zero, does not converge.
    pub fn solve<W: World<Region = R>>(
        &mut self,
        world: &W,
        start: &InitialGuess<R>,
        y: DVec3,
    ) -> Result<ConnectingRay, Failure> {
        self.refine(world, start, None, y)
    }

    /// The same from a start whose ray has been followed before: one shot less.
    ///
    /// # Errors
    ///
    /// See [`Failure`].
    pub fn solve_on<W: World<Region = R>>(
        &mut self,
        world: &W,
        known: &Followed<R>,
        y: DVec3,
    ) -> Result<ConnectingRay, Failure> {
        self.work.evaluations += known.evaluations;
        self.refine(world, &known.start, Some(&known.end), y)
    }

    fn refine<W: World<Region = R>>(
        &mut self,
        world: &W,
        start: &InitialGuess<R>,
        known: Option<&EndState>,
        y: DVec3,
    ) -> Result<ConnectingRay, Failure> {
        let distance = start.family.x().distance(y);
        let sound = distance.is_finite() && start.optical_length.is_finite();
        if !sound || start.optical_length <= 0.0 {
            return Err(Failure::NotConverged);
        }
        let floor = self.least_miss(world, start.family.x(), y);
        let mut trial = Iterate {
            family: start.family,
            length: start.optical_length,
        };
        let longest = start.family.longest_step(distance);
        let (mut radius, mut tried) = (DVec2::ONE, DVec2::ZERO);
        let mut best: Option<(Iterate, EndState, f64)> = None;
        let mut is_last = false;
        if let Some(end_state) = known {
            best = Some((trial, *end_state, end_state.x.distance(y)));
            (trial, tried) = trial.stepped(end_state, y, radius, longest)?;
        }
        let mut failure = Failure::NotConverged;
        let before = self.work.steps;
        for shots in 1..=SHOTS_PER_CONNECTION {
            // Shoot the ray, with its tangents: the miss is r of eq. (Newton step).
            let shot = self.shoot(world, &trial, start);
            let miss = shot.map_or(f64::INFINITY, |hit| hit.end_state.x.distance(y));
            // Where the ray has ended counts, not where it should have.
            if let Ok(hit) = &shot
                && hit.travelled.optical_length > 0.0
            {
                trial.length = hit.travelled.optical_length;
            }
            // Accept it if r is small, and correct it by one more step.
            // Planted error "solver tolerance looser than the distance to the wall", found by morgana-transport/transport::slabs::mcml_mismatched_half_space:
            // let arrived = |hit: &Hit| miss <= self.tolerance.get() * distance;
            let arrived = |hit: &Hit| miss <= self.allowed_miss(&trial.family, hit, floor);
            if let Some(hit) = shot.ok().filter(arrived) {
                match self.finish(&trial, &hit, y, shots) {
                    Ok(found) => {
                        let before = best.as_ref().map(|(iterate, end, _)| (iterate, end));
                        if is_last || self.is_steady(world, before, &trial, &found) {
                            return Ok(found);
                        }
                        is_last = true;
                    }
                    Err(caustic) => failure = caustic,
                }
            }
            // Adapt the trust region to whether r became smaller.
            let least = best.as_ref().map(|(_, _, least)| *least);
            match (least, shot) {
                (None, Err(failure)) => return Err(failure),
                (Some(least), _) if miss.is_nan() || miss >= least => {
                    let Some(shorter) = shortened(radius, tried) else {
                        break;
                    };
                    radius = shorter;
                }
                (_, Ok(hit)) => {
                    if least.is_some_and(|least| miss < GOOD * least) {
                        radius = radius.max(LONGER * tried).min(DVec2::ONE);
                    }
                    best = Some((trial, hit.end_state, miss));
                }
                (_, Err(failure)) => return Err(failure),
            }
            // Step from the best iterate: M⁻¹r, damped.
            let Some((iterate, end_state, _)) = &best else {
                return Err(failure);
            };
            if self.work.steps - before > STEPS_PER_CONNECTION {
                return Err(Failure::OverBudget);
            }
            (trial, tried) = iterate.stepped(end_state, y, radius, longest)?;
        }
        Err(failure)
    }

    /// Positions are no better than round-off, nor than the distance by which rays are kept off interfaces.
    pub(super) fn least_miss<W: World<Region = R>>(&self, world: &W, x: DVec3, y: DVec3) -> f64 {
        1e-13 * (x.distance(y) + y.length()) + 10.0 * world.ray_epsilon()
    }

    /// How close to the target a ray must pass: on the scale of its length since the last interface,
    /// since a target just behind a wall that is lit from far away must be met on the scale of its
    /// distance to the wall. Where the ray tube is narrow, directions and the Jacobian depend on the
    /// target the more.
    pub(super) fn allowed_miss(&self, family: &RayFamily, hit: &Hit, floor: f64) -> f64 {
        let straight = family.spread(hit.travelled.arc_length).powi(2);
        let correctable = (LAST_CORRECTION * hit.jacobian() / straight).clamp(1.0, LAST_CORRECTION);
        f64::max(
            correctable * self.tolerance.get() * hit.travelled.leg,
            floor,
        )
    }

    /// Whether the last correction hardly changes the Jacobian: judged by how it has changed since the iterate before, or else by
    /// how fine the field is (docs/theory.md#second-shots).
    fn is_steady<W: World<Region = R>>(
        &self,
        world: &W,
        before: Option<(&Iterate, &EndState)>,
        last: &Iterate,
        found: &ConnectingRay,
    ) -> bool {
        let length = found.arc_length;
        let allowed = STEADY * self.tolerance.get();
        let Some((before, end_state)) = before else {
            if found.miss <= NEAR * self.tolerance.get() * length {
                return true;
            }
            let scale =
                |piece: &Piece<R>| world.field(piece.region).length_scale(piece.arc.start());
            let finest = self.pieces.iter().map(scale).fold(f64::INFINITY, f64::min);
            return MET * (length / finest).powi(2) * (found.miss / finest) <= allowed;
        };
        let then = end_state.variation.cross_section(end_state.v).abs();
        let straight = before.family.spread(length).powi(2);
        let change = (found.jacobian - then).abs() / found.jacobian.max(straight);
        let moved = |[x, direction]: [DVec3; 2]| {
            x.distance(last.family.x()) + direction.distance(last.family.direction())
        };
        let step = moved([before.family.x(), before.family.direction()]);
        let correction = moved([found.start, found.direction_out]);
        change * correction <= allowed * step
    }

    /// Shoots the ray of an iterate with tangents; keeps its pieces.
    fn shoot<W: World<Region = R>>(
        &mut self,
        world: &W,
        iterate: &Iterate,
        start: &InitialGuess<R>,
    ) -> Result<Hit, Failure> {
        let region = start.region;
        let node = iterate.family.node(world.field(region));
        let (tolerance, work) = (self.tolerance, &mut self.work);
        let mut shot = Trajectory::new(world, node, region, iterate.length, tolerance, work);
        self.pieces.clear();
        while let Some(piece) = shot.advance(&mut |i| start.pattern.reflects(i), work)? {
            self.pieces.push(piece);
        }
        Ok(Hit {
            first_index: node.n2.sqrt(),
            end_state: *shot.end(),
            travelled: shot.travelled(),
            pattern: shot.pattern(),
        })
    }

    /// The ray of an iterate, corrected to first order for its remaining miss: unless that is no small
    /// correction, or the ray tube at the target is narrower than the tolerance (docs/theory.md#acceptance).
    pub(super) fn finish(
        &self,
        iterate: &Iterate,
        hit: &Hit,
        y: DVec3,
        shots: u32,
    ) -> Result<ConnectingRay, Failure> {
        let (end_state, jacobian) = (&hit.end_state, hit.jacobian());
        let miss = y - end_state.x;
        let step = system(end_state).inverse() * miss;
        let Travelled {
            arc_length,
            optical_length,
            sigma,
            ..
        } = hit.travelled;
        let start = iterate.family;
        let small = SMALL * start.longest_step(start.x().distance(y));
        let narrow = (NARROW * self.tolerance.get() * start.spread(arc_length)).powi(2);
        let sound = step.truncate().length() <= small && jacobian.is_finite();
        if !sound || jacobian <= narrow {
            return Err(Failure::Caustic);
        }
        let family = iterate.family.moved(step.truncate());
        // The end moves sideways by the tangents at equal σ and along the ray by what is left of the miss.
        let at_equal_sigma =
            end_state.variation.dx[0] * step.x + end_state.variation.dx[1] * step.y;
        let shift = end_state.v.dot(miss - at_equal_sigma) / end_state.v.length_squared();
        let dv = end_state.variation.dv[0] * step.x
            + end_state.variation.dv[1] * step.y
            + end_state.a * shift;
        let along = end_state.v.dot(miss);
        let n = end_state.v.length();
        Ok(ConnectingRay {
            start: family.x(),
            direction_out: family.direction(),
            direction_in: (end_state.v + dv).normalize(),
            indices: [hit.first_index, end_state.n2.sqrt()],
            arc_length: arc_length + along / n,
            optical_length: optical_length + along,
            sigma: sigma + along / (n * n),
            jacobian,
            miss: miss.length(),
            pattern: hit.pattern,
            shots,
        })
    }
}

/// The trust region after a step that did not reduce the miss: a shorter step is one in the same direction, but along the
/// ray where the family hardly changed. `None` after the shortest.
fn shortened(radius: DVec2, tried: DVec2) -> Option<DVec2> {
    let tried = SHORTER * tried;
    match (tried.x < STUCK, tried.y < STUCK) {
        (false, _) => Some(DVec2::new(tried.x, radius.y)),
        (true, false) => Some(DVec2::new(radius.x, tried.y)),
        (true, true) => None,
    }
}

/// The unit direction from one point to another.
pub(super) fn chord(x: DVec3, y: DVec3) -> Result<DVec3, Failure> {
    let failure = if (y - x).length().is_finite() {
        Failure::Coincident
    } else {
        Failure::TooFar
    };
    (y - x).try_normalize().ok_or(failure)
}
