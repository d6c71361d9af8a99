//! Sampling an edge from its start: flow, collisions, and choices at specular surfaces.

use super::Workspace;
use super::edge::{Carry, Edge, End, Front, Span, Start};
use super::length::to_entrance;
use super::tube::{self, Tube};
use crate::Spectrum;
use crate::bsdf::{Bsdf, Surface, Through};
use crate::medium::Attenuation;
use crate::sampling::{Purpose, Sampler};
use crate::scene::{MediumId, Scene};
use crate::shape::Hit;
use eikonal::connect::{Pattern, World};
use eikonal::interface::{Interface, Rule};
use eikonal::ray::{Arc, Flow, Node, Tangents, Variation, perpendicular_basis};
use glam::DVec3;

/// More arcs than any sensible edge has.
const MOST_SPANS: usize = 20_000;
/// More specular events than any edge needs: light between perfect mirrors never ends.
const MOST_EVENTS: u32 = 1_000;

/// How an edge is sampled.
#[derive(Clone, Copy, Debug)]
pub struct Sampling {
    /// What it carries.
    pub carry: Carry,
    /// Probabilities with which each channel's extinction is used to sample the distance; they sum to
    /// one.
    pub lanes: Spectrum,
    /// Whether spans are recorded beyond a collision up to the next surface that is not index-matched.
    pub extend: bool,
    /// Whether the edge may end at a collision; if not it goes on to a surface, through all media.
    pub collides: bool,
}

/// Samples an edge.
pub fn trace(
    scene: &Scene,
    start: Start,
    sampling: Sampling,
    sampler: &mut Sampler,
    ws: &mut Workspace,
) -> Edge {
    ws.stats.edges += 1;
    let mut walk = Walk::new(scene, start, sampling, sampler);
    while walk.region(ws) {}
    ws.stats.lost += u64::from(walk.edge.lost);
    let reach = scene.branch_reach();
    walk.edge.connectable &=
        reach.includes(walk.reach, walk.reflections, walk.edge.tube.reflections)
            && walk.edge.tube.geometry > 0.0;
    walk.edge
}

struct Walk<'a> {
    scene: &'a Scene,
    sampler: &'a mut Sampler,
    edge: Edge,
    sampling: Sampling,
    /// Channel and optical depth of the collision that was drawn.
    target: (usize, f64),
    collided: bool,
    x: DVec3,
    v: DVec3,
    tangents: Tangents,
    medium: MediumId,
    /// Depth at the start of the next span.
    depth: Spectrum,
    /// Length at the start of the next span.
    length: f64,
    /// ∏ n_after/n_before over declared index matches.
    jump: f64,
    /// Whether it passed a surface straight on by chance.
    veiled: bool,
    /// Reflections where refraction was possible.
    reflections: u32,
    /// Optical path length that counts for the reach of connections: how far away a plane is does not.
    reach: f64,
}

impl<'a> Walk<'a> {
    fn new(scene: &'a Scene, start: Start, sampling: Sampling, sampler: &'a mut Sampler) -> Self {
        let channel = choose_lane(sampling.lanes, sampler.next_1d_for(Purpose::Channel));
        let target = match sampling.collides {
            true => -(1.0 - sampler.next_1d_for(Purpose::Distance)).ln(),
            false => f64::INFINITY,
        };
        let n = scene.n(start.medium, start.x);
        Walk {
            scene,
            sampler,
            sampling,
            target: (channel, target),
            collided: false,
            x: start.x,
            v: start.direction * n,
            tangents: tangents(scene, &start),
            medium: start.medium,
            depth: Spectrum::ZERO,
            length: 0.0,
            jump: 1.0,
            veiled: false,
            reflections: 0,
            reach: 0.0,
            edge: Edge {
                start,
                spans: Vec::new(),
                lead: 0,
                end: End::Dead,
                length: 0.0,
                weight: Spectrum::ONE,
                tube: Tube::new(),
                optical_length: 0.0,
                connectable: true,
                lost: false,
            },
        }
    }

    /// Follows the ray through one region. Returns whether it goes on into another.
    fn region(&mut self, ws: &mut Workspace) -> bool {
        let field = self.scene.field(self.medium);
        if field.is_constant() {
            return self.line(ws);
        }
        let node = Node::new(field, self.x, self.v, self.tangents);
        let mut flow = Flow::new(field, node, self.scene.tolerance());
        loop {
            let reach = self.scene.reach(flow.node().x);
            let step = flow.advance(reach / flow.node().v.length(), &mut ws.stats.work);
            if !step.end.x.is_finite() {
                return self.die(true);
            }
            let hit = self.scene.first_hit(&step.arc);
            let theta_end = hit.map_or(1.0, |(_, hit)| hit.theta);
            self.record(&step.arc, hit, |theta| {
                let (_, v, tangents) = step.at(theta);
                (v, tangents)
            });
            if self.collided && !self.sampling.extend {
                return false;
            }
            if let Some((object, hit)) = hit {
                let (_, v, tangents) = step.at(theta_end);
                self.tangents = tangents;
                return self.surface(object, hit, v);
            }
            let outside = self.scene.is_outside(step.end.x);
            if outside || self.edge.spans.len() > MOST_SPANS {
                return self.die(true);
            }
        }
    }

    /// Follows the ray through a region of constant index: one line, without any of the work that
    /// curves take. Returns whether it goes on into another.
    fn line(&mut self, ws: &mut Workspace) -> bool {
        let h = self.scene.reach(self.x) / self.v.length();
        let (end, v, start) = (self.x + self.v * h, self.v, self.tangents);
        ws.stats.work.steps += 1;
        if !end.is_finite() {
            return self.die(true);
        }
        let at = |theta: f64| {
            let mut tangents = start;
            tangents.drift(theta * h);
            (v, tangents)
        };
        let arc = Arc::line(self.x, v, h);
        let hit = self.scene.first_hit(&arc);
        self.record(&arc, hit, at);
        if self.collided && !self.sampling.extend {
            return false;
        }
        self.tangents = at(hit.map_or(1.0, |(_, hit)| hit.theta)).1;
        match hit {
            Some((object, hit)) => self.surface(object, hit, v),
            None => self.escape(end, v),
        }
    }

    /// Adds one arc, and the collision if it happens there. `at` is the velocity and the tangents at θ.
    fn record(
        &mut self,
        &arc: &Arc,
        hit: Option<(usize, Hit)>,
        at: impl Fn(f64) -> (DVec3, Tangents),
    ) {
        let theta_end = hit.map_or(1.0, |(_, hit)| hit.theta);
        let medium = self.scene.medium(self.medium);
        let attenuation = Attenuation::new(medium, &arc, theta_end);
        let span = Span {
            arc,
            theta_end,
            medium: self.medium,
            attenuation,
            length: arc.arc_length(theta_end),
            length_before: self.length,
            depth_before: self.depth,
            weight_before: self.edge.weight,
            events_before: self.edge.tube.events,
            surface: hit,
        };
        if !self.collided {
            let (channel, target) = self.target;
            let left = target - self.depth[channel];
            if let Some(theta) = span.attenuation.invert(&arc, theta_end, channel, left) {
                self.collide(&span, theta, at(theta));
            } else {
                self.lengthen(arc.optical_length(theta_end));
            }
        }
        self.depth += span.attenuation.depth(&arc, theta_end);
        self.length = span.length_after();
        if !self.collided {
            self.edge.tube.depth = self.depth;
            self.edge.length = self.length;
        }
        self.edge.spans.push(span);
        if self.edge.tube.events == 0 && !self.veiled {
            self.edge.lead = self.edge.spans.len();
        }
    }

    fn collide(&mut self, span: &Span, theta: f64, (v, tangents): (DVec3, Tangents)) {
        let point = span.at(theta);
        self.edge.tube.depth = point.depth;
        self.edge.tube.geometry = tube::to_point(&tangents, v, self.jump);
        self.edge.length = point.length;
        self.lengthen(span.arc.optical_length(theta));
        self.edge.end = End::Collision(point);
        self.collided = true;
    }

    /// Adds to the optical path length.
    fn lengthen(&mut self, length: f64) {
        let first = self.edge.spans.is_empty() && self.edge.start.front == Front::Plane;
        if !(first && self.scene.field(self.medium).is_constant()) {
            self.reach += length;
        }
        self.edge.optical_length += length;
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
        let shape = &scene.objects()[object].shape;
        let cos = hit.normal.dot(v.normalize());
        if let Some(through) = bsdf.through(&shape.site(&hit), cos) {
            if self.sampler.next_1d() < through.probability {
                return self.slip((object, hit), v, through);
            }
            if bsdf.is_delta() {
                self.edge.tube.choice *= 1.0 - through.probability;
            }
        }
        if bsdf.is_delta() && self.edge.tube.events < MOST_EVENTS {
            return self.specular(object, hit, v);
        }
        if bsdf.is_delta() {
            return self.die(true);
        }
        self.edge.tube.geometry = tube::to_point(&self.tangents, v, self.jump);
        self.edge.end = End::Surface {
            object,
            hit,
            direction: v.normalize(),
            medium: self.medium,
        };
        false
    }

    /// Straight through a boundary that is declared index-matched. If the indices differ all the
    /// same, power and L, rather than L/n², are conserved: the declared jump takes no energy away.
    fn pass(&mut self, object: usize, hit: Hit, v: DVec3) -> bool {
        let direction = v.normalize();
        let beyond = self.beyond(object, &hit, direction);
        let ratio = self.scene.n(beyond, hit.position) / self.scene.n(self.medium, hit.position);
        if self.sampling.carry == Carry::Radiance {
            self.edge.weight *= ratio * ratio;
        }
        self.jump *= ratio;
        let constant = |medium| self.scene.field(medium).is_constant();
        if ratio == 1.0 && constant(self.medium) && constant(beyond) {
            // Nothing happens to the ray nor to its tangents.
            self.x = leave(self.scene, hit.position, hit.normal, direction);
            self.medium = beyond;
            return true;
        }
        self.go_on((object, hit), (v, direction), beyond, Rule::Pass)
    }

    /// Straight through a surface that lets part of the light pass.
    fn slip(&mut self, at: (usize, Hit), v: DVec3, through: Through) -> bool {
        self.veiled = true;
        self.edge.weight *= through.factor;
        self.edge.tube.choice *= through.probability;
        self.go_on(at, (v, v.normalize()), self.medium, Rule::Pass)
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
        self.edge.connectable &= matches!(bsdf, Bsdf::Dielectric(_));
        if !sample.transmitted && sample.pdf < 1.0 {
            self.reflections += 1;
            // Connections know patterns of so many encounters.
            self.edge.connectable &= self.edge.tube.events < Pattern::ENCOUNTERS;
        }
        self.edge.tube.reflections += u32::from(!sample.transmitted);
        self.edge.tube.events += 1;
        self.edge.tube.choice *= sample.pdf;
        self.edge.weight *= sample.weight;
        let beyond = self.beyond(object, &hit, sample.direction);
        let rule = match sample.transmitted {
            true => Rule::Refract,
            false => Rule::Reflect,
        };
        self.go_on((object, hit), (v, sample.direction), beyond, rule)
    }

    fn beyond(&self, object: usize, hit: &Hit, direction: DVec3) -> MediumId {
        let at = (hit.position, hit.normal);
        self.scene.medium_beside(object, self.medium, at, direction)
    }

    /// On from a surface with the velocity before and the direction after.
    fn go_on(
        &mut self,
        (object, hit): (usize, Hit),
        (v, direction): (DVec3, DVec3),
        beyond: MediumId,
        rule: Rule,
    ) -> bool {
        let local = |medium| {
            let (n2, a, ()) = <() as Variation>::local(self.scene.field(medium), hit.position);
            (n2, a)
        };
        let shape = &self.scene.objects()[object].shape;
        let interface = Interface {
            normal: hit.normal,
            shape: shape.shape_operator(hit.position, hit.primitive),
            near: local(self.medium),
            far: local(beyond),
        };
        match interface.tangents(rule, v, &self.tangents) {
            Some(tangents) => self.tangents = tangents,
            None => self.edge.connectable = false,
        }
        self.x = leave(self.scene, hit.position, hit.normal, direction);
        self.v = direction * interface.far.0.sqrt();
        self.medium = beyond;
        true
    }

    fn escape(&mut self, x: DVec3, v: DVec3) -> bool {
        if !self.collided {
            let (n, toward) = (v.length(), v.normalize());
            self.edge.optical_length += to_entrance(self.scene, n, x, toward);
            let last = self.edge.spans.last();
            self.reach -= last.map_or(0.0, |s| s.arc.optical_length(s.theta_end));
            self.edge.tube.geometry = tube::to_plane(&self.tangents, v, self.jump);
            self.edge.end = End::Escaped {
                direction: toward,
                medium: self.medium,
            };
        }
        false
    }

    fn die(&mut self, lost: bool) -> bool {
        if !self.collided {
            self.edge.end = End::Dead;
            self.edge.lost = lost;
        }
        false
    }
}

/// The tangents with which an edge starts: unit changes of the direction, or of the place.
fn tangents(scene: &Scene, start: &Start) -> Tangents {
    let basis = perpendicular_basis(start.direction);
    let (n2, gradient) = scene.field(start.medium).gradient(start.x);
    match start.front {
        Front::Point => Tangents::angular(n2.sqrt(), basis),
        Front::Plane => Tangents::lateral(n2.sqrt(), gradient, start.direction, basis),
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
        site: scene.objects()[object].shape.site(hit),
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
