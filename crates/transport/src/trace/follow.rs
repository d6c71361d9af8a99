//! Single ray from surface to surface.

use super::line::Line;
use crate::path::{Continuation, RayObserver, TraceEnding, UnscatteredRay};
use crate::scene::{AMBIENT, MediumId, Scene};
use crate::shape::Hit;
use eikonal::Aabb;
use eikonal::Reference;
use eikonal::connect::World;
use eikonal::ray::{Step, Work};
use glam::DVec3;
use std::ops::ControlFlow;

/// Radius of the ball in which rays are followed, relative to the radius around all objects.
const RADIUS_FACTOR: f64 = 1.15;

/// Point of a ray.
#[derive(Clone, Copy, Debug)]
pub struct TracePoint {
    /// Position.
    pub x: DVec3,
    /// Unit direction; at a change of direction, the direction of departure.
    pub direction: DVec3,
    /// Length from the start.
    pub arc_length: f64,
    /// Optical path length from the start.
    pub optical_length: f64,
    /// Optical path length from the start, less the optical path length of rays of the reference.
    /// These connect the start, the points of reflection and this point: see
    /// [`PathDifference`](eikonal::PathDifference). Against a field it is known only at the ray's
    /// last point. It is NaN at the others, and where no ray of the reference connects the ends.
    pub path_difference: f64,
    /// Refractive index.
    pub index: f64,
    /// Medium behind the point.
    pub medium: MediumId,
}

/// Ray that was traced.
#[derive(Clone, Debug)]
pub struct Path {
    /// Points of the ray; the first is its start.
    pub points: Vec<TracePoint>,
    /// Reason why the ray ended.
    pub ending: TraceEnding,
}

/// Tracer of rays through a scene.
#[derive(Debug)]
pub struct Tracer<'a> {
    scene: &'a Scene,
    /// Bounding box of all objects.
    bounds: Aabb,
    max_length: Option<f64>,
    reference: Option<Reference<'a>>,
}

impl<'a> Tracer<'a> {
    /// Creates a tracer. Rays end after `max_length`, or where they leave a ball around all objects
    /// and their start. If the length is missing or infinite, the maximum is twenty radii of the
    /// ball. If it is not positive, or NaN, rays end where they start.
    pub fn new(scene: &'a Scene, max_length: Option<f64>) -> Self {
        let objects = scene.objects().iter().map(|o| o.shape.aabb());
        Tracer {
            scene,
            bounds: objects.fold(Aabb::EMPTY, Aabb::union),
            max_length,
            reference: None,
        }
    }

    /// Sets the reference of optical path differences. The default is the index of the surroundings
    /// where a ray starts.
    #[must_use]
    pub fn with_reference(self, reference: Option<Reference<'a>>) -> Self {
        Tracer { reference, ..self }
    }

    /// Follows the ray from `x` in a direction of any length except zero. If `x` is exactly on a
    /// face, the ray starts as from a camera.
    pub fn follow(&self, x: DVec3, direction: DVec3) -> Path {
        let direction = direction.normalize();
        let ball = Ball::around(self.bounds.include(x));
        let start = self.scene.off_faces(x, direction);
        let medium = self.scene.medium_at(start);
        let surroundings = || Reference::Index(self.scene.n(AMBIENT, x));
        let reference = self.reference.unwrap_or_else(surroundings);
        let mut traced = TracedRay {
            scene: self.scene,
            max_length: self
                .max_length
                .filter(|length| *length != f64::INFINITY)
                .map_or(20.0 * ball.radius, |length| length.max(0.0)),
            ball,
            line: Line::new(reference, direction),
        };
        let v = direction * self.scene.n(medium, start);
        traced.line.record(x, v, medium);
        if traced.max_length == 0.0 {
            return traced.line.end(TraceEnding::Length);
        }
        let mut ray = UnscatteredRay::new(self.scene, start, direction, medium);
        let ending = ray.follow(self.scene.tolerance(), &mut traced);
        traced.line.end(ending)
    }
}

/// Ball in which a ray is followed.
struct Ball {
    center: DVec3,
    radius: f64,
}

impl Ball {
    /// Creates a ball that is somewhat larger than a box.
    fn around(bounds: Aabb) -> Self {
        // Without objects a ray still needs room to be seen.
        let radius = match 0.5 * bounds.diagonal() {
            r if r > 0.0 => RADIUS_FACTOR * r,
            _ => 1.0,
        };
        Ball {
            center: bounds.center(),
            radius,
        }
    }

    /// Returns the distance from `x` in a unit direction to the ball's surface, rounded up; zero
    /// outside the ball.
    fn exit(&self, x: DVec3, direction: DVec3) -> f64 {
        let from = x - self.center;
        let b = from.dot(direction);
        let c = from.length_squared() - self.radius * self.radius;
        if c > 0.0 {
            return 0.0;
        }
        let round_off = 8.0 * f64::EPSILON * (x.length() + self.radius);
        ((b * b - c).sqrt() - b) * (1.0 + 1e-9) + round_off
    }
}

/// Observer that records the points of a ray.
struct TracedRay<'a> {
    scene: &'a Scene,
    ball: Ball,
    max_length: f64,
    line: Line<'a>,
}

impl TracedRay<'_> {
    fn left(&self) -> f64 {
        self.max_length - self.line.length
    }
}

impl RayObserver for TracedRay<'_> {
    fn reach(
        &mut self,
        x: DVec3,
        direction: DVec3,
        medium: MediumId,
    ) -> ControlFlow<TraceEnding, f64> {
        let reach = if self.scene.field(medium).is_constant() {
            self.ball.exit(x, direction)
        } else {
            2.0 * self.ball.radius
        };
        if reach <= 0.0 {
            return ControlFlow::Break(TraceEnding::Left);
        }
        if !reach.is_finite() {
            return ControlFlow::Break(TraceEnding::Lost);
        }
        ControlFlow::Continue(reach.min(self.left()))
    }

    fn advance(
        &mut self,
        step: &Step<()>,
        hit: Option<&Hit>,
        medium: MediumId,
    ) -> ControlFlow<TraceEnding> {
        let theta = hit.map_or(1.0, |hit| hit.theta);
        // Shorten the step: for the remaining σ it may be longer than the remaining length where
        // the index grows.
        let end = step.arc.theta_at_length(self.left());
        let field = self.scene.field(medium);
        self.line.advance(field, step, theta.min(end), medium);
        if end < theta || self.line.reaches(self.max_length) {
            return ControlFlow::Break(TraceEnding::Length);
        }
        ControlFlow::Continue(())
    }

    fn arrive(&mut self, _: usize, _: &Hit, _: DVec3, _: MediumId) -> ControlFlow<TraceEnding> {
        ControlFlow::Continue(())
    }

    fn continue_walk(&mut self, hit: &Hit, beyond: &Continuation) {
        if beyond.is_reflection {
            self.line.reflect(beyond.v.normalize());
        }
        // The point on the surface has the direction and the medium behind the surface.
        self.line.replace(hit.position, beyond.v, beyond.medium);
    }

    fn work(&mut self) -> &mut Work {
        self.line.work()
    }
}
