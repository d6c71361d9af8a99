//! Newton's method for trajectories (docs/theory.md#damping-and-trust-region).

use super::collocate::Relaxation;
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

/// Largest miss, in tolerances, that is corrected to first order instead of tracing another ray,
/// unless the ray tube is narrow. The square of this miss is below the tolerance, and the Jacobian
/// changes by at most this many tolerances. Where steps are rejected, rays jump by about a
/// tolerance, and another ray would be no better.
const MAX_CORRECTED_MISS: f64 = 10.0;
/// Largest change of the Jacobian by the last correction, in tolerances. If the change may be
/// larger, another ray is traced (docs/theory.md#second-shots). This happens where the field varies
/// within a small part of the ray's length.
const MAX_JACOBIAN_CHANGE: f64 = 10.0;
/// Miss below which no second ray is traced, whatever the field's length scale, in tolerances times
/// the ray's length (docs/theory.md#second-shots).
const MIN_MISS: f64 = 0.1;
/// Typical third derivative along a ray, relative to the bound that the length scale implies
/// (docs/theory.md#second-shots).
const TYPICAL_THIRD_DERIVATIVE: f64 = 2e-3;
/// Largest correction without another iteration, as a fraction of the longest step of Newton's
/// method.
const MAX_LAST_CORRECTION: f64 = 0.1;
/// Smallest width of a ray tube at the target, relative to the width of a tube of straight rays, in
/// tolerances. The target of a narrower tube lies on a caustic (docs/theory.md#acceptance).
const MIN_TUBE_WIDTH: f64 = 2.0;
/// Largest step after a step that did not reduce the miss, relative to the previous step.
const STEP_REDUCTION: f64 = 0.5;
/// Ratio of successive misses below which the trust region may grow.
const TRUST_GROWTH_RATIO: f64 = 0.5;
/// Largest step after a step that reduced the miss below [`TRUST_GROWTH_RATIO`] times the smallest
/// miss, relative to the previous step.
const STEP_GROWTH: f64 = 3.0;
/// Step size below which the iteration has reached a local minimum of the miss.
const MIN_STEP: f64 = 1e-3;

/// The end of a traced ray.
#[derive(Clone, Copy)]
pub(super) struct Hit {
    /// Index at the start of the ray.
    pub first_index: f64,
    pub end_state: EndState,
    pub travelled: Travelled,
    /// Reflections by choice.
    pub pattern: Pattern,
}

impl Hit {
    /// Returns |J| or |A| at the end.
    fn jacobian(&self) -> f64 {
        let EndState { v, variation, .. } = &self.end_state;
        variation.cross_section(*v).abs()
    }
}

/// Finder of connections, with storage that connections reuse.
#[derive(Clone, Debug)]
pub struct Solver<R> {
    pub(super) tolerance: Tolerance,
    pub(super) pieces: Vec<Piece<R>>,
    /// Arcs of a ray under examination.
    pub(super) arcs: Vec<Arc>,
    pub(super) relaxation: Relaxation,
    /// Work done so far.
    pub work: Work,
}

impl<R: Copy + PartialEq + std::fmt::Debug> Solver<R> {
    /// Creates a solver. It accepts a ray that passes the target within ten times `tolerance` times
    /// the length of the ray's last segment. The last segment starts at the last interface, or at
    /// the start of the ray. Directions and lengths are corrected to first order for the remaining
    /// miss.
    pub fn new(tolerance: Tolerance) -> Self {
        Solver {
            tolerance,
            pieces: Vec::new(),
            arcs: Vec::new(),
            relaxation: Relaxation::default(),
            work: Work::default(),
        }
    }

    /// Returns the tolerance of rays.
    pub fn tolerance(&self) -> Tolerance {
        self.tolerance
    }

    /// Returns the pieces of the ray found last, in order.
    pub fn pieces(&self) -> &[Piece<R>] {
        &self.pieces
    }

    /// Returns the [primary](Self::primary) branch from point `x` in `region` to `y`, searched from
    /// the chord; refracted wherever that is possible.
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

    /// Returns the [primary](Self::primary) branch from the plane through `x` perpendicular to
    /// `direction`, of any length, to `y`. The search starts at the foot of `y` on the plane; the
    /// ray is refracted wherever that is possible.
    ///
    /// # Errors
    ///
    /// [`Failure::Coincident`] if `y` is not in front of the plane, or the direction is zero;
    /// otherwise see [`Failure`].
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

    /// Returns the branch to which Newton's method converges from an initial guess.
    ///
    /// The unknowns are the two parameters of the family and the optical path length ℓ; the
    /// residual is x(ℓ) − y. Steps are Levenberg–Marquardt steps within a trust region, which
    /// shrinks where steps do not reduce the residual. Points of the family at equal ℓ (rather than
    /// σ) form a wavefront, which approaches a focus from one side.
    ///
    /// # Errors
    ///
    /// See [`Failure`]. A guess that is not finite, or has no positive length, does not converge.
    pub fn solve<W: World<Region = R>>(
        &mut self,
        world: &W,
        start: &InitialGuess<R>,
        y: DVec3,
    ) -> Result<ConnectingRay, Failure> {
        self.refine(world, start, None, y)
    }

    /// Returns the branch that [`Self::solve`] finds, from a guess whose ray has been traced
    /// before; this saves one ray.
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
            // Trace the ray with its tangents: the miss is r of eq. (Newton step).
            let shot = self.shoot(world, &trial, start);
            let miss = shot.map_or(f64::INFINITY, |hit| hit.end_state.x.distance(y));
            // Take the length at which the ray has ended, not the requested one.
            if let Ok(hit) = &shot
                && hit.travelled.optical_length > 0.0
            {
                trial.length = hit.travelled.optical_length;
            }
            // Accept the ray if r is small, and correct it by one more step.
            // Planted error "solver tolerance looser than the distance to the wall", found by morgana-transport/transport::slabs::mcml_mismatched_half_space:
            // let arrived = |hit: &Hit| miss <= self.tolerance.get() * distance;
            let arrived = |hit: &Hit| miss <= self.allowed_miss(&trial.family, hit, floor);
            if let Some(hit) = shot.ok().filter(arrived) {
                match self.finish(&trial, &hit, y, shots) {
                    Ok(found) => {
                        let before = best.as_ref().map(|(iterate, end, _)| (iterate, end));
                        if is_last || self.needs_no_second_ray(world, before, &trial, &found) {
                            return Ok(found);
                        }
                        is_last = true;
                    }
                    Err(caustic) => failure = caustic,
                }
            }
            // Shrink the trust region if r did not become smaller; let it grow if r became much
            // smaller.
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
                    if least.is_some_and(|least| miss < TRUST_GROWTH_RATIO * least) {
                        radius = radius.max(STEP_GROWTH * tried).min(DVec2::ONE);
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

    /// Returns the smallest miss that can be demanded: positions are limited by round-off, and by
    /// the distance by which rays are kept off interfaces.
    pub(super) fn least_miss<W: World<Region = R>>(&self, world: &W, x: DVec3, y: DVec3) -> f64 {
        1e-13 * (x.distance(y) + y.length()) + 10.0 * world.ray_epsilon()
    }

    /// Returns the largest miss with which a ray is accepted. It is proportional to the length of
    /// the ray since the last interface: the ray to a target just behind a wall must be accurate on
    /// the scale of the distance to the wall. It is smaller where the ray tube is narrow, because
    /// directions and the Jacobian depend more strongly on the target there.
    pub(super) fn allowed_miss(&self, family: &RayFamily, hit: &Hit, floor: f64) -> f64 {
        let straight = family.spread(hit.travelled.arc_length).powi(2);
        let correctable =
            (MAX_CORRECTED_MISS * hit.jacobian() / straight).clamp(1.0, MAX_CORRECTED_MISS);
        f64::max(
            correctable * self.tolerance.get() * hit.travelled.segment,
            floor,
        )
    }

    /// Returns true if the last correction hardly changes the Jacobian. The estimate uses the
    /// change of the Jacobian since the previous iterate or, without one, the field's length scale
    /// (docs/theory.md#second-shots).
    fn needs_no_second_ray<W: World<Region = R>>(
        &self,
        world: &W,
        before: Option<(&Iterate, &EndState)>,
        last: &Iterate,
        found: &ConnectingRay,
    ) -> bool {
        let length = found.arc_length;
        let allowed = MAX_JACOBIAN_CHANGE * self.tolerance.get();
        let Some((before, end_state)) = before else {
            if found.miss <= MIN_MISS * self.tolerance.get() * length {
                return true;
            }
            let scale =
                |piece: &Piece<R>| world.field(piece.region).length_scale(piece.arc.start());
            let finest = self.pieces.iter().map(scale).fold(f64::INFINITY, f64::min);
            return TYPICAL_THIRD_DERIVATIVE * (length / finest).powi(2) * (found.miss / finest)
                <= allowed;
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

    /// Traces the ray of an iterate with tangents, and stores its pieces.
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

    /// Returns the ray of an iterate, corrected to first order for its remaining miss. Fails with
    /// [`Failure::Caustic`] if the correction is not small, or the ray tube at the target is
    /// narrower than the tolerance (docs/theory.md#acceptance).
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
        let small = MAX_LAST_CORRECTION * start.longest_step(start.x().distance(y));
        let narrow = (MIN_TUBE_WIDTH * self.tolerance.get() * start.spread(arc_length)).powi(2);
        let sound = step.truncate().length() <= small && jacobian.is_finite();
        if !sound || jacobian <= narrow {
            return Err(Failure::Caustic);
        }
        let family = iterate.family.moved(step.truncate());
        // Move the end sideways by the tangents at equal σ, and along the ray by the rest of the
        // miss.
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

/// Shrinks the trust region after a step that did not reduce the miss. It shortens the step in the
/// same direction, but only along the ray if the family hardly changed. `None` if the step was
/// already shortest.
fn shortened(radius: DVec2, tried: DVec2) -> Option<DVec2> {
    let tried = STEP_REDUCTION * tried;
    match (tried.x < MIN_STEP, tried.y < MIN_STEP) {
        (false, _) => Some(DVec2::new(tried.x, radius.y)),
        (true, false) => Some(DVec2::new(radius.x, tried.y)),
        (true, true) => None,
    }
}

/// Returns the unit direction from one point to another.
pub(super) fn chord(x: DVec3, y: DVec3) -> Result<DVec3, Failure> {
    let failure = if (y - x).length().is_finite() {
        Failure::Coincident
    } else {
        Failure::TooFar
    };
    (y - x).try_normalize().ok_or(failure)
}
