//! One ray from surface to surface.

use super::line::Line;
use crate::budget::STEPS_PER_RAY;
use crate::path::unscattered_continuation;
use crate::scene::{AMBIENT, MediumId, Scene};
use crate::shape::Hit;
use eikonal::Aabb;
use eikonal::Reference;
use eikonal::connect::World;
use eikonal::ray::{Flow, Node, Work};
use glam::DVec3;

/// How far beyond all objects a ray is followed, relative to the size of the scene.
const BEYOND: f64 = 1.15;
/// How far ahead of its start a ray looks for its medium, relative to the size of the scene.
const AHEAD: f64 = 1e-9;

/// A point of a ray.
#[derive(Clone, Copy, Debug)]
pub struct TracePoint {
    /// Position.
    pub x: DVec3,
    /// Unit direction; that of departure where the ray changes it.
    pub direction: DVec3,
    /// Length from the start.
    pub arc_length: f64,
    /// Optical path length from the start.
    pub optical_length: f64,
    /// Optical path length from the start less that of rays of the reference, which join the start, the points of
    /// reflection and this one: see [`PathDifference`](eikonal::PathDifference). Against a field it is known at the ray's
    /// last point only, and NaN elsewhere and where no ray of the reference joins the ends.
    pub path_difference: f64,
    /// Refractive index.
    pub index: f64,
    /// The medium beyond.
    pub medium: MediumId,
}

/// How a ray ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TraceEnding {
    /// On an object that neither passes it on in one direction nor lets at least half of its light pass straight on.
    Surface(usize),
    /// It left the scene.
    Left,
    /// It reached the longest length allowed.
    Length,
    /// It left the field of its medium, or took too many steps.
    Lost,
}

/// A ray that was followed.
#[derive(Clone, Debug)]
pub struct Path {
    /// Its points; the first is its start.
    pub points: Vec<TracePoint>,
    /// How it ended.
    pub ending: TraceEnding,
}

/// Follows rays through a scene.
#[derive(Debug)]
pub struct Tracer<'a> {
    scene: &'a Scene,
    /// A box around all objects.
    bounds: Aabb,
    max_length: Option<f64>,
    reference: Option<Reference<'a>>,
}

impl<'a> Tracer<'a> {
    /// A tracer for rays that end after `max_length`, or where they leave a ball around all objects and their start. Without a length, or with
    /// an infinite one, that is twenty radii of the ball; not above zero, or not a number, where they start.
    pub fn new(scene: &'a Scene, max_length: Option<f64>) -> Self {
        let objects = scene.objects().iter().map(|o| o.shape.aabb());
        Tracer {
            scene,
            bounds: objects.fold(Aabb::EMPTY, Aabb::union),
            max_length,
            reference: None,
        }
    }

    /// The same with the reference of optical path differences; without one it is the index of the surroundings where a
    /// ray starts.
    #[must_use]
    pub fn with_reference(self, reference: Option<Reference<'a>>) -> Self {
        Tracer { reference, ..self }
    }

    /// Follows the ray from `x` in a direction of any length but zero.
    pub fn follow(&self, x: DVec3, direction: DVec3) -> Path {
        let direction = direction.normalize();
        let ball = Ball::around(self.bounds.include(x));
        // A start on a boundary belongs to the medium into which the ray goes.
        let medium = self.scene.medium_at(x + direction * (AHEAD * ball.radius));
        let index = self.scene.n(medium, x);
        let surroundings = || Reference::Index(self.scene.n(AMBIENT, x));
        let reference = self.reference.unwrap_or_else(surroundings);
        let mut ray = TracedRay {
            scene: self.scene,
            max_length: self
                .max_length
                .filter(|length| *length != f64::INFINITY)
                .map_or(20.0 * ball.radius, |length| length.max(0.0)),
            ball,
            x,
            v: direction * index,
            medium,
            line: Line::new(reference, direction),
            steps: 0,
        };
        ray.line.record(x, ray.v, medium);
        if ray.max_length == 0.0 {
            return ray.line.end(TraceEnding::Length);
        }
        let ending = loop {
            if let Some(ending) = ray.region() {
                break ending;
            }
        };
        ray.line.end(ending)
    }
}

/// Where a ray is followed.
struct Ball {
    center: DVec3,
    radius: f64,
}

impl Ball {
    /// One that is somewhat larger than a box.
    fn around(bounds: Aabb) -> Self {
        // Without any object a ray still needs room to be seen.
        let radius = match 0.5 * bounds.diagonal() {
            r if r > 0.0 => BEYOND * r,
            _ => 1.0,
        };
        Ball {
            center: bounds.center(),
            radius,
        }
    }

    /// The distance from `x` in a unit direction at which the ball is left, rounded up; zero outside.
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

struct TracedRay<'a> {
    scene: &'a Scene,
    ball: Ball,
    max_length: f64,
    x: DVec3,
    v: DVec3,
    medium: MediumId,
    line: Line<'a>,
    steps: usize,
}

impl TracedRay<'_> {
    /// Follows the ray through one medium. Returns how it ended, unless it goes on into another.
    fn region(&mut self) -> Option<TraceEnding> {
        let scene = self.scene;
        let field = scene.field(self.medium);
        let mut flow = Flow::new(
            field,
            Node::new(field, self.x, self.v, ()),
            scene.tolerance(),
        );
        loop {
            let (x, v) = (flow.node().x, flow.node().v);
            let left = self.max_length - self.line.length;
            let reach = if field.is_constant() {
                self.ball.exit(x, v.normalize())
            } else {
                2.0 * self.ball.radius
            };
            if reach <= 0.0 {
                return Some(TraceEnding::Left);
            }
            if !reach.is_finite() {
                return Some(TraceEnding::Lost);
            }
            let step = flow.advance(reach.min(left) / v.length(), &mut Work::default());
            let hit = scene.first_hit(&step.arc);
            if hit.is_none() && !step.end.x.is_finite() {
                return Some(TraceEnding::Lost);
            }
            let theta = hit.as_ref().map_or(1.0, |(_, hit)| hit.theta);
            // A step of the remaining length of σ may be longer than that where the index grows.
            let end = step.arc.theta_at_length(left);
            self.line.advance(field, &step, theta.min(end), self.medium);
            self.steps += 1;
            if end < theta || self.line.reaches(self.max_length) {
                return Some(TraceEnding::Length);
            }
            if let Some((object, hit)) = hit {
                return self.surface(object, &hit, step.at(theta).1);
            }
            if self.steps > STEPS_PER_RAY {
                return Some(TraceEnding::Lost);
            }
        }
    }

    /// Goes on from a surface if there is only one direction to go.
    fn surface(&mut self, object: usize, hit: &Hit, v: DVec3) -> Option<TraceEnding> {
        let Some(passage) = unscattered_continuation(self.scene, object, self.medium, hit, v)
        else {
            return Some(TraceEnding::Surface(object));
        };
        self.x = passage.x;
        self.v = passage.v;
        self.medium = passage.medium;
        if passage.is_reflection {
            self.line.reflect(self.v.normalize());
        }
        // The point on the surface belongs to what follows: its direction and medium.
        self.line.replace(hit.position, self.v, self.medium);
        None
    }
}
