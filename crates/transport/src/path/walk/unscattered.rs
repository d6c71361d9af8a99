//! Rays that are not scattered: on the path that Snell's law and mirrors leave no choice of, and straight through what lets at least
//! half of the light pass. Geometric quantities of pictures and traced rays follow them by the same loop.

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

/// How an unscattered ray ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TraceEnding {
    /// On an object that neither passes it on in one direction nor lets at least half of its light pass straight on.
    Surface(usize),
    /// It left the scene.
    Left,
    /// It reached the longest length allowed.
    Length,
    /// It left the field of its medium, took too many steps, so that it may be trapped, or no ray of the reference joins its ends.
    Lost,
}

/// Measures a ray on its way, and may end it.
pub(crate) trait RayObserver {
    /// The length that the next step from `x` in a unit direction may have.
    fn reach(
        &mut self,
        x: DVec3,
        direction: DVec3,
        medium: MediumId,
    ) -> ControlFlow<TraceEnding, f64>;

    /// The ray takes a step through a medium, up to a surface if there is a `hit`.
    fn advance(
        &mut self,
        step: &Step<()>,
        hit: Option<&Hit>,
        medium: MediumId,
    ) -> ControlFlow<TraceEnding>;

    /// The ray arrives at the surface of an object in a unit direction.
    fn arrive(
        &mut self,
        object: usize,
        hit: &Hit,
        direction: DVec3,
        medium: MediumId,
    ) -> ControlFlow<TraceEnding>;

    /// The ray goes on from that surface.
    fn go_on(&mut self, hit: &Hit, beyond: &Continuation);

    /// Where the work of following the ray is counted.
    fn work(&mut self) -> &mut Work;
}

/// An unscattered ray on its way through a scene.
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
    /// The ray that starts at `x` in a unit direction through a medium.
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

    /// Goes on from a surface if there is only one direction to go.
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
        observer.go_on(hit, &beyond);
        ControlFlow::Continue(())
    }
}

/// The way of a ray beyond a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Continuation {
    /// Start of the ray, off the surface.
    pub x: DVec3,
    /// Its velocity there.
    pub v: DVec3,
    /// The medium into which it goes.
    pub medium: MediumId,
    /// True if it stays on its side of the surface.
    pub is_reflection: bool,
}

/// The way beyond a surface for a ray that arrives through a medium with a velocity, if the surface leaves it one direction, or lets
/// at least half of its light pass straight on. `None` if the ray ends there.
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
    // The arc's speed is the index up to the tolerance: here it becomes the index again.
    let v = v.normalize() * interface.near.0.sqrt();
    let passed = interface.velocity(rule, v);
    let is_reflection = passed.is_none() || rule == Rule::Reflect;
    let after = passed
        .or_else(|| interface.velocity(Rule::Reflect, v))
        .unwrap_or(-v);
    // A shading normal may have a mirror send rays below the surface.
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

/// The only rule that a surface leaves to light that arrives on the side of its normal, or behind.
fn rule(bsdf: &Bsdf, front: bool) -> Option<Rule> {
    match bsdf {
        Bsdf::Null => Some(Rule::Pass),
        Bsdf::Dielectric(_) => Some(Rule::Refract),
        Bsdf::Conductor(_) if front => Some(Rule::Reflect),
        Bsdf::TwoSided(b) => rule(&b.sides()[usize::from(!front)], true),
        _ => None,
    }
}
