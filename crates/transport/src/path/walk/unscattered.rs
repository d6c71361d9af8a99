//! Unscattered rays: rays with a single direction by Snell's law and mirrors, passing straight
//! through surfaces that transmit at least half of the light. One loop follows them for geometric
//! quantities of pictures and for traced rays.

use crate::bsdf::Bsdf;
use crate::budget::STEPS_PER_RAY;
use crate::path::segment::leave;
use crate::scene::{MediumId, Scene};
use crate::shape::Hit;
use eikonal::Tolerance;
use eikonal::connect::World;
use eikonal::interface::{Interface, Rule};
use eikonal::ray::{Flow, Node, Step, Work};
use glam::{DMat3, DVec3};
use std::ops::ControlFlow;

/// Ending of an unscattered ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TraceEnding {
    /// The ray ended at an object: the surface has no single direction for it, and transmits less
    /// than half of the light straight on.
    Surface(usize),
    /// The ray left the scene.
    Left,
    /// The ray reached the largest allowed length.
    Length,
    /// The ray was lost: it left the field of its medium, took too many steps and may be trapped,
    /// or no ray of the reference joins its ends.
    Lost,
}

/// Measures a ray while it is followed, and may end it.
pub(crate) trait RayObserver {
    /// Returns the largest length of the next step from `x` in a unit direction.
    fn reach(
        &mut self,
        x: DVec3,
        direction: DVec3,
        medium: MediumId,
    ) -> ControlFlow<TraceEnding, f64>;

    /// Receives a step through a medium, up to a surface if there is a `hit`.
    fn advance(
        &mut self,
        step: &Step<()>,
        hit: Option<&Hit>,
        medium: MediumId,
    ) -> ControlFlow<TraceEnding>;

    /// Receives the arrival at the surface of an object in a unit direction.
    fn arrive(
        &mut self,
        object: usize,
        hit: &Hit,
        direction: DVec3,
        medium: MediumId,
    ) -> ControlFlow<TraceEnding>;

    /// Receives the continuation from the surface of the last [`arrive`](Self::arrive).
    fn continue_walk(&mut self, hit: &Hit, beyond: &Continuation);

    /// Returns the counter of the work of following the ray.
    fn work(&mut self) -> &mut Work;
}

/// State of an unscattered ray in a scene.
#[derive(Debug)]
pub(crate) struct UnscatteredRay<'a> {
    scene: &'a Scene,
    x: DVec3,
    v: DVec3,
    medium: MediumId,
    /// Number of steps so far.
    pub steps: usize,
}

impl<'a> UnscatteredRay<'a> {
    /// Starts a ray at `x` in a unit direction through a medium.
    pub(crate) fn new(scene: &'a Scene, x: DVec3, direction: DVec3, medium: MediumId) -> Self {
        UnscatteredRay {
            scene,
            x,
            v: direction * scene.n(medium, x),
            medium,
            steps: 0,
        }
    }

    /// Follows the ray to its end.
    pub(crate) fn follow(
        &mut self,
        tolerance: Tolerance,
        observer: &mut impl RayObserver,
    ) -> TraceEnding {
        loop {
            if let ControlFlow::Break(ending) = self.cross(tolerance, observer) {
                return ending;
            }
        }
    }

    /// Follows the ray through one medium, and into the next.
    fn cross(
        &mut self,
        tolerance: Tolerance,
        observer: &mut impl RayObserver,
    ) -> ControlFlow<TraceEnding> {
        let (scene, medium) = (self.scene, self.medium);
        let field = scene.field(medium);
        let mut flow = Flow::new(field, Node::new(field, self.x, self.v, ()), tolerance);
        loop {
            let (x, v) = (flow.node().x, flow.node().v);
            let reach = observer.reach(x, v.normalize(), medium)?;
            let step = flow.advance(reach / v.length(), observer.work());
            self.steps += 1;
            let hit = scene.first_hit(&step.arc);
            if hit.is_none() && !step.end.x.is_finite() {
                return ControlFlow::Break(TraceEnding::Lost);
            }
            observer.advance(&step, hit.as_ref().map(|(_, hit)| hit), medium)?;
            if let Some((object, hit)) = hit {
                return self.pass(object, &hit, step.at(hit.theta).1, observer);
            }
            if self.steps > STEPS_PER_RAY {
                return ControlFlow::Break(TraceEnding::Lost);
            }
        }
    }

    /// Continues from a surface if there is only one direction.
    fn pass(
        &mut self,
        object: usize,
        hit: &Hit,
        v: DVec3,
        observer: &mut impl RayObserver,
    ) -> ControlFlow<TraceEnding> {
        observer.arrive(object, hit, v.normalize(), self.medium)?;
        let Some(beyond) = continuation(self.scene, object, self.medium, hit, v) else {
            return ControlFlow::Break(TraceEnding::Surface(object));
        };
        (self.x, self.v, self.medium) = (beyond.x, beyond.v, beyond.medium);
        observer.continue_walk(hit, &beyond);
        ControlFlow::Continue(())
    }
}

/// Continuation of a ray beyond a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Continuation {
    /// Start of the continued ray, off the surface.
    pub x: DVec3,
    /// Velocity at the start.
    pub v: DVec3,
    /// Medium in which the ray continues.
    pub medium: MediumId,
    /// True if the ray continues on the side of the surface from which it came.
    pub is_reflection: bool,
}

/// Returns the continuation of a ray that arrives at a surface through a medium with velocity `v`.
/// The ray continues if there is only one direction, or if the surface transmits at least half of
/// the light straight on. Returns `None` if the ray ends.
fn continuation(
    scene: &Scene,
    object: usize,
    medium: MediumId,
    hit: &Hit,
    v: DVec3,
) -> Option<Continuation> {
    let surface = &scene.objects()[object];
    let site = surface.shape.site(hit);
    let cos = hit.normal.dot(v.normalize());
    let rule = match surface.bsdf.through(&site, cos) {
        Some(through) if through.probability >= 0.5 => Rule::Pass,
        _ => rule(&surface.bsdf, cos < 0.0)?,
    };
    let beyond = scene.medium_beside(object, medium, hit.position, hit.normal, v);
    let n2 = |medium| (scene.field(medium).n2(hit.position), DVec3::ZERO);
    let interface = Interface {
        normal: match rule {
            Rule::Reflect => surface.shape.shading_normal(&site, hit.normal),
            Rule::Refract | Rule::Pass => hit.normal,
        },
        shape: DMat3::ZERO,
        near: n2(medium),
        far: n2(beyond),
    };
    // Restore |v| = n: along the arc it holds only up to the tolerance.
    let v = v.normalize() * interface.near.0.sqrt();
    let passed = interface.velocity(rule, v);
    let is_reflection = passed.is_none() || rule == Rule::Reflect;
    let after = passed
        .or_else(|| interface.velocity(Rule::Reflect, v))
        .unwrap_or(-v);
    // With a shading normal, a mirror may send rays below the surface.
    let is_below = hit.normal.dot(after) * hit.normal.dot(v) >= 0.0;
    if rule == Rule::Reflect && is_below {
        return None;
    }
    Some(Continuation {
        x: leave(scene, hit.position, hit.normal, after),
        v: after,
        medium: if is_reflection { medium } else { beyond },
        is_reflection,
    })
}

/// Returns the only rule by which a surface continues light that arrives from the front or from the
/// back, if there is only one.
fn rule(bsdf: &Bsdf, front: bool) -> Option<Rule> {
    match bsdf {
        Bsdf::Null => Some(Rule::Pass),
        Bsdf::Dielectric(_) => Some(Rule::Refract),
        Bsdf::Conductor(_) if front => Some(Rule::Reflect),
        Bsdf::TwoSided(b) => rule(&b.sides()[usize::from(!front)], true),
        _ => None,
    }
}
