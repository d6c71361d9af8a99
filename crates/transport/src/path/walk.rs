//! Sampling an edge from its start: flow, collisions, and choices at specular surfaces.

use super::Workspace;
use super::edge::{Edge, End, Span, Start};
use crate::Spectrum;
use crate::bsdf::{Bsdf, Surface};
use crate::medium::Attenuation;
use crate::sampling::Sampler;
use crate::scene::{MediumId, Scene};
use crate::shape::Hit;
use eikonal::connect::World;
use eikonal::ray::{Flow, Node};
use glam::DVec3;

/// More arcs than any sensible edge has.
const MOST_SPANS: usize = 20_000;
/// More specular events than any edge needs: light between perfect mirrors never ends.
const MOST_EVENTS: u32 = 1_000;

/// Samples an edge. `lanes` are the probabilities with which each channel's extinction is used to
/// sample the distance; they sum to one. With `extend`, spans are recorded beyond a collision up to
/// the next surface that is not index-matched.
pub fn trace(
    scene: &Scene,
    start: Start,
    lanes: Spectrum,
    extend: bool,
    sampler: &mut Sampler,
    ws: &mut Workspace,
) -> Edge {
    ws.stats.edges += 1;
    let mut walk = Walk::new(scene, start, lanes, extend, sampler);
    while walk.region(ws) {}
    if matches!(walk.edge.end, End::Dead) && walk.lost {
        ws.stats.lost += 1;
    }
    walk.edge
}

struct Walk<'a> {
    scene: &'a Scene,
    sampler: &'a mut Sampler,
    edge: Edge,
    /// Channel and optical depth of the collision that was drawn.
    target: (usize, f64),
    extend: bool,
    collided: bool,
    lost: bool,
    x: DVec3,
    v: DVec3,
    medium: MediumId,
    /// Depth at the start of the next span.
    depth: Spectrum,
    /// Length at the start of the next span.
    length: f64,
}

impl<'a> Walk<'a> {
    fn new(
        scene: &'a Scene,
        start: Start,
        lanes: Spectrum,
        extend: bool,
        sampler: &'a mut Sampler,
    ) -> Self {
        let channel = choose_lane(lanes, sampler.next_1d());
        let target = -(1.0 - sampler.next_1d()).ln();
        Walk {
            scene,
            sampler,
            target: (channel, target),
            extend,
            collided: false,
            lost: false,
            x: start.x,
            v: start.direction * scene.n(start.medium, start.x),
            medium: start.medium,
            depth: Spectrum::ZERO,
            length: 0.0,
            edge: Edge {
                start,
                spans: Vec::new(),
                lead: 0,
                end: End::Dead,
                depth: Spectrum::ZERO,
                length: 0.0,
                weight: Spectrum::ONE,
                choice: 1.0,
                events: 0,
                connectable: true,
                straight: true,
            },
        }
    }

    /// Follows the ray through one region. Returns whether it goes on into another.
    fn region(&mut self, ws: &mut Workspace) -> bool {
        let field = self.scene.field(self.medium);
        let straight = field.is_constant();
        let mut flow = Flow::new(
            field,
            Node::new(field, self.x, self.v, ()),
            self.scene.tolerance(),
        );
        self.edge.straight &= straight;
        loop {
            let reach = self.scene.reach(flow.node().x);
            let step = flow.advance(reach / flow.node().v.length(), &mut ws.stats.work);
            if !step.end.x.is_finite() {
                return self.die(true);
            }
            let hit = self.scene.first_hit(&step.arc);
            let theta_end = hit.as_ref().map_or(1.0, |(_, hit)| hit.theta);
            self.record(step.arc, theta_end);
            if self.collided && !self.extend {
                return false;
            }
            if let Some((object, hit)) = hit {
                return self.surface(object, hit, step.arc.velocity(theta_end));
            }
            if straight {
                return self.escape(step.end.v);
            }
            let outside =
                step.end.x.distance(self.scene.around().center) > 1.01 * self.scene.around().radius;
            if outside || self.edge.spans.len() > MOST_SPANS {
                return self.die(true);
            }
        }
    }

    /// Adds one arc, and the collision if it happens there.
    fn record(&mut self, arc: eikonal::ray::Arc, theta_end: f64) {
        let medium = self.scene.medium(self.medium);
        let attenuation = Attenuation::new(medium, &arc, theta_end);
        let span = Span {
            arc,
            theta_end,
            medium: self.medium,
            attenuation,
            length_before: self.length,
            depth_before: self.depth,
            weight_before: self.edge.weight,
        };
        if !self.collided {
            let (channel, target) = self.target;
            let left = target - self.depth[channel];
            if let Some(theta) = span.attenuation.invert(&arc, theta_end, channel, left) {
                let point = span.at(theta);
                self.edge.depth = point.depth;
                self.edge.length = point.length;
                self.edge.end = End::Collision(point);
                self.collided = true;
            }
        }
        self.depth += span.attenuation.depth(&arc, theta_end);
        self.length = span.length_after();
        if !self.collided {
            self.edge.depth = self.depth;
            self.edge.length = self.length;
        }
        self.edge.spans.push(span);
        if self.edge.events == 0 {
            self.edge.lead = self.edge.spans.len();
        }
    }

    /// Goes through, is reflected, or ends at a surface. Returns whether the ray goes on.
    fn surface(&mut self, object: usize, hit: Hit, v: DVec3) -> bool {
        let scene = self.scene;
        let bsdf = &scene.objects()[object].bsdf;
        if self.collided {
            // Beyond a collision only index-matched boundaries are passed.
            return bsdf.is_null() && self.pass(object, hit, v);
        }
        if bsdf.is_null() {
            return self.pass(object, hit, v);
        }
        if bsdf.is_delta() && self.edge.events < MOST_EVENTS {
            return self.specular(object, hit, v);
        }
        if bsdf.is_delta() {
            return self.die(true);
        }
        self.edge.end = End::Surface {
            object,
            hit,
            direction: v.normalize(),
            medium: self.medium,
        };
        false
    }

    /// Straight through a boundary that is declared index-matched. If the indices differ all the
    /// same, L rather than L/n² is conserved: the declared jump carries no energy away.
    fn pass(&mut self, object: usize, hit: Hit, v: DVec3) -> bool {
        let direction = v.normalize();
        let beyond =
            self.scene
                .medium_beside(object, self.medium, (hit.position, hit.normal), direction);
        let n_near = self.scene.n(self.medium, hit.position);
        let n_far = self.scene.n(beyond, hit.position);
        self.edge.weight *= (n_far / n_near).powi(2);
        self.go_on(hit, direction, beyond, n_far)
    }

    /// Refracted or reflected by chance at a smooth surface.
    fn specular(&mut self, object: usize, hit: Hit, v: DVec3) -> bool {
        let toward = -v.normalize();
        let surface = surface_at(self.scene, object, &hit, self.medium);
        let u = [self.sampler.next_1d(), 0.5, 0.5];
        let bsdf = &self.scene.objects()[object].bsdf;
        let Some(sample) = bsdf.sample(&surface, toward, u) else {
            return self.die(false);
        };
        let forced_reflection = !sample.transmitted && sample.pdf >= 1.0;
        let dielectric = matches!(bsdf, Bsdf::Dielectric(_));
        self.edge.connectable &= dielectric && (sample.transmitted || forced_reflection);
        self.edge.straight = false;
        self.edge.events += 1;
        self.edge.choice *= sample.pdf;
        self.edge.weight *= sample.weight;
        let beyond = self.scene.medium_beside(
            object,
            self.medium,
            (hit.position, hit.normal),
            sample.direction,
        );
        let n = self.scene.n(beyond, hit.position);
        self.go_on(hit, sample.direction, beyond, n)
    }

    fn go_on(&mut self, hit: Hit, direction: DVec3, medium: MediumId, n: f64) -> bool {
        self.x = leave(self.scene, hit.position, hit.normal, direction);
        self.v = direction * n;
        self.medium = medium;
        true
    }

    fn escape(&mut self, v: DVec3) -> bool {
        if !self.collided {
            self.edge.end = End::Escaped {
                direction: v.normalize(),
                medium: self.medium,
            };
        }
        false
    }

    fn die(&mut self, lost: bool) -> bool {
        if !self.collided {
            self.edge.end = End::Dead;
            self.lost = lost;
        }
        false
    }
}

/// The point from which a ray leaves a surface: off it by less than any tolerance, on the side to
/// which it goes.
pub(super) fn leave(scene: &Scene, x: DVec3, normal: DVec3, direction: DVec3) -> DVec3 {
    x + normal * scene.nudge().copysign(normal.dot(direction))
}

/// The surface as BSDFs see it, with the local index of the media on either side. `medium` is that
/// through which a ray arrives.
pub(super) fn surface_at(scene: &Scene, object: usize, hit: &Hit, medium: MediumId) -> Surface {
    let beside = |direction| {
        let medium = scene.medium_beside(object, medium, (hit.position, hit.normal), direction);
        scene.n(medium, hit.position)
    };
    Surface {
        normal: hit.normal,
        n_outer: beside(hit.normal),
        n_inner: beside(-hit.normal),
    }
}

fn choose_lane(lanes: Spectrum, mut u: f64) -> usize {
    let last = lanes.0.iter().rposition(|&p| p > 0.0).unwrap_or(0);
    for (i, p) in lanes.0.into_iter().enumerate() {
        if u < p {
            return i;
        }
        u -= p;
    }
    last
}
