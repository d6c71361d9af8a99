//! Single rays from the sensor, and quantities measured along them.

use super::unscattered::{Continuation, RayObserver, TraceEnding, UnscatteredRay};
use crate::Spectrum;
use crate::budget::STEPS_PER_RAY;
use crate::medium::Attenuation;
use crate::path::workspace::Workspace;
use crate::scene::{MediumId, Scene};
use crate::shape::Hit;
use eikonal::connect::World;
use eikonal::ray::{Step, Work};
use eikonal::{PathDifference, Reference};
use glam::DVec3;
use std::ops::ControlFlow;

/// Ray up to an opaque surface, or up to the last boundary if it left the scene. If it crossed no
/// boundary, it ends at its start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FollowedRay {
    /// Position of the end.
    pub x: DVec3,
    /// Unit direction at the end, beyond a boundary.
    pub direction: DVec3,
    /// Arc length.
    pub length: f64,
    /// ∫n ds.
    pub optical_length: f64,
    /// ∫n ds minus ∫n ds of rays of the reference: see [`PathDifference`]. Zero without a
    /// reference.
    pub path_difference: f64,
    /// Optical depth.
    pub depth: Spectrum,
    /// Number of arcs, including the last one out of the scene.
    pub steps: u64,
    /// Ending of the ray.
    pub ending: TraceEnding,
    /// First surface that does more than separate media, if there is one.
    pub seen: Option<SeenSurface>,
}

/// First surface along a ray that does more than separate media.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SeenSurface {
    /// Index of the object.
    pub object: usize,
    /// Intersection of the ray with the surface.
    pub hit: Hit,
    /// Unit direction of the ray before the surface.
    pub direction: DVec3,
    /// Medium through which the ray arrives.
    pub medium: MediumId,
    /// Arc length up to the surface.
    pub length: f64,
}

/// Condition at which a ray is no longer followed.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Until {
    /// End at the first surface that does more than separate media.
    Seen,
    /// End at the first surface that leaves the ray no single direction.
    Scattered,
}

/// Follows the ray from `x` in a unit direction. Smooth dielectrics refract or totally reflect the
/// ray, and smooth metals reflect it. The ray passes straight through index-matched boundaries and
/// surfaces that transmit at least half of the light. With a `reference`, its optical path
/// difference is computed too.
pub(crate) fn follow(
    scene: &Scene,
    x: DVec3,
    direction: DVec3,
    medium: MediumId,
    reference: Option<Reference<'_>>,
    ws: &mut Workspace,
) -> FollowedRay {
    let difference = reference.map(|reference| PathDifference::new(reference, direction));
    run(
        scene,
        [x, direction],
        medium,
        Until::Scattered,
        difference,
        ws,
    )
}

/// Follows the ray from `x` in a unit direction through null boundaries, up to the first other
/// surface.
pub(crate) fn see(
    scene: &Scene,
    x: DVec3,
    direction: DVec3,
    medium: MediumId,
    ws: &mut Workspace,
) -> FollowedRay {
    run(scene, [x, direction], medium, Until::Seen, None, ws)
}

fn run(
    scene: &Scene,
    [x, direction]: [DVec3; 2],
    medium: MediumId,
    until: Until,
    difference: Option<PathDifference<'_>>,
    ws: &mut Workspace,
) -> FollowedRay {
    let mut follower = Follower {
        scene,
        difference,
        until,
        ray: FollowedRay {
            x,
            direction,
            length: 0.0,
            optical_length: 0.0,
            path_difference: 0.0,
            depth: Spectrum::ZERO,
            steps: 0,
            ending: TraceEnding::Lost,
            seen: None,
        },
        ws,
    };
    let mut ray = UnscatteredRay::new(scene, x, direction, medium);
    let mut ending = ray.follow(follower.ws.tolerance(), &mut follower);
    let Follower {
        mut difference,
        ray: followed,
        ws,
        ..
    } = follower;
    let path_difference = difference
        .as_mut()
        .map(|compared| compared.value(&mut ws.stats.work));
    let is_over_budget = difference.is_some_and(|compared| compared.is_over_budget());
    if path_difference.is_some_and(f64::is_nan) {
        ending = TraceEnding::Lost;
    }
    let is_too_long = ray.steps > STEPS_PER_RAY;
    // Planted error "rays given up without being counted", found by morgana-transport/transport::budgets::rays_that_take_too_many_steps_are_given_up_and_counted:
    // ws.stats.over_budget.rays += u64::from(is_over_budget);
    ws.stats.over_budget.rays += u64::from(is_over_budget) + u64::from(is_too_long);
    ws.stats.lost += u64::from(ending == TraceEnding::Lost);
    FollowedRay {
        ending,
        steps: ray.steps as u64,
        path_difference: path_difference.unwrap_or(0.0),
        ..followed
    }
}

/// Observer that accumulates quantities along a ray.
struct Follower<'a, 'w> {
    scene: &'a Scene,
    difference: Option<PathDifference<'a>>,
    until: Until,
    ray: FollowedRay,
    ws: &'w mut Workspace,
}

impl RayObserver for Follower<'_, '_> {
    fn reach(&mut self, x: DVec3, _: DVec3, _: MediumId) -> ControlFlow<TraceEnding, f64> {
        ControlFlow::Continue(self.scene.reach(x))
    }

    fn advance(
        &mut self,
        step: &Step<()>,
        hit: Option<&Hit>,
        medium: MediumId,
    ) -> ControlFlow<TraceEnding> {
        let field = self.scene.field(medium);
        if hit.is_none() && field.is_constant() {
            return ControlFlow::Break(TraceEnding::Left);
        }
        let theta = hit.map_or(1.0, |hit| hit.theta);
        let attenuation = Attenuation::new(self.scene.medium(medium), &step.arc, theta);
        let [arc_length, optical_length] = step.arc.lengths(theta);
        self.ray.depth += attenuation.depth(theta, arc_length);
        self.ray.length += arc_length;
        self.ray.optical_length += optical_length;
        if let Some(difference) = &mut self.difference {
            difference.add(field, &step.arc, [0.0, theta], &mut self.ws.stats.work);
        }
        let is_lost = self.scene.is_outside(step.end.x) || self.ws.stop.is_raised();
        if hit.is_none() && is_lost {
            return ControlFlow::Break(TraceEnding::Lost);
        }
        ControlFlow::Continue(())
    }

    fn arrive(
        &mut self,
        object: usize,
        hit: &Hit,
        direction: DVec3,
        medium: MediumId,
    ) -> ControlFlow<TraceEnding> {
        self.ray.x = hit.position;
        self.ray.direction = direction;
        let is_null = self.scene.objects()[object].bsdf.is_null();
        // Planted error "boundaries of media seen as surfaces", found by morgana-transport/transport::first_surface::a_ball_behind_a_matched_boundary:
        // if self.ray.seen.is_none() {
        if self.ray.seen.is_none() && !is_null {
            self.ray.seen = Some(SeenSurface {
                object,
                hit: *hit,
                direction,
                medium,
                // Planted error "depths of surfaces as straight lines", found by morgana-transport/transport::first_surface::depth_is_measured_along_the_curve:
                // length: self.scene.sensor().position().distance(hit.position),
                length: self.ray.length,
            });
            if self.until == Until::Seen {
                return ControlFlow::Break(TraceEnding::Surface(object));
            }
        }
        ControlFlow::Continue(())
    }

    fn continue_walk(&mut self, _: &Hit, beyond: &Continuation) {
        self.ray.direction = beyond.v.normalize();
        if beyond.is_reflection
            && let Some(difference) = &mut self.difference
        {
            difference.reflect(self.ray.direction, &mut self.ws.stats.work);
        }
    }

    fn work(&mut self) -> &mut Work {
        &mut self.ws.stats.work
    }
}
