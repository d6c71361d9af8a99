//! Sampling an edge from its start: flow, collisions, and choices at specular surfaces.
//!
//! Theory: docs/theory.md#connectable-edges, docs/theory.md#free-flight.

use crate::Spectrum;
use crate::bsdf::{Bsdf, BsdfSample, PartialTransmission};
use crate::budget::{EVENTS_PER_EDGE, STEPS_PER_RAY};
use crate::medium::Attenuation;
use crate::path::segment::{
    Edge, End, Front, Point, RayDifferentials, Span, Split, Start, TransportMode, leave, share,
    surface_at, to_entrance,
};
use crate::path::workspace::Workspace;
use crate::sampling::{Purpose, Sampler};
use crate::scene::{MediumId, Scene};
use crate::shape::{Hit, Meeting};
use eikonal::connect::{Pattern, World};
use eikonal::interface::{Interface, Rule};
use eikonal::ray::{Arc, Flow, Node, Variation};
use glam::DVec3;
use std::ops::ControlFlow;

/// How an edge is sampled.
#[derive(Clone, Copy, Debug)]
pub struct Sampling {
    /// What it carries.
    pub mode: TransportMode,
    /// Probabilities with which each channel's extinction is used to sample the distance; they sum to
    /// one.
    pub channel_pdf: Spectrum,
    /// Whether spans are recorded beyond a collision up to the next surface that is not index-matched, or until they are
    /// 32 radii of the scene long.
    pub extend: bool,
    /// Whether the edge may end at a collision; if not it goes on to a surface, through all media.
    pub collides: bool,
    /// Whether its spans are kept: see [`Edge::spans`].
    pub spans: bool,
    /// Whether it collides for certain where it would leave the scene, if there is anything to collide with: see
    /// [`Edge::forcing`]. Only if it is extended.
    pub forced: bool,
    /// Whether both ways are taken at the first specular event, if it is one of refraction or reflection: see [`Edge::split`].
    pub splitting: bool,
}

/// Samples an edge.
pub fn trace<'a>(
    scene: &'a Scene,
    start: Start,
    sampling: Sampling,
    sampler: &mut Sampler,
    ws: &mut Workspace,
) -> Edge<'a> {
    ws.stats.edges += 1;
    let mut edge = Edge::new(start);
    let mut walk = Walk::new(scene, &mut edge, sampling, sampler);
    while walk.region(ws).is_continue() {}
    if sampling.forced {
        walk.force();
    }
    let (length, reflections) = (walk.reach, walk.reflections);
    ws.stats.over_budget.rays += u64::from(walk.over_budget);
    let within = scene.branch_reach();
    edge.connectable &= within.includes(length, reflections, edge.geometry.reflections)
        && edge.geometry.geometry_term > 0.0;
    ws.stats.lost += u64::from(edge.lost);
    edge
}

struct Walk<'a, 'b> {
    scene: &'a Scene,
    sampler: &'b mut Sampler,
    edge: &'b mut Edge<'a>,
    sampling: Sampling,
    /// Channel and optical depth of the collision that was drawn.
    target: (usize, f64),
    collided: bool,
    x: DVec3,
    v: DVec3,
    differentials: RayDifferentials,
    medium: MediumId,
    /// An object that the ray does not meet as long as it is straight.
    left: Option<usize>,
    /// Number of spans so far.
    spans: usize,
    /// Depth at the start of the next span.
    depth: Spectrum,
    /// Length at the start of the next span.
    length: f64,
    /// ∏ n_after/n_before over declared index matches.
    jump: f64,
    /// Whether it passed a surface straight on by chance.
    passed_by_chance: bool,
    /// Whether it, or its extension, left the scene.
    escaped: bool,
    /// Whether it, or its extension, went so far that no extension goes farther.
    is_long: bool,
    /// Whether it was given up because it took too many steps or events.
    over_budget: bool,
    /// Reflections where refraction was possible.
    reflections: u32,
    /// Optical path length that counts for the reach of connections: how far away a plane is does not.
    reach: f64,
}

impl<'a, 'b> Walk<'a, 'b> {
    /// At the start of an edge.
    fn new(
        scene: &'a Scene,
        edge: &'b mut Edge<'a>,
        sampling: Sampling,
        sampler: &'b mut Sampler,
    ) -> Self {
        let start = edge.start;
        // Draw a channel with probability w_c, and the depth −ln(1 − u) of the collision in it.
        let channel = choose_channel(sampling.channel_pdf, sampler.next_1d_for(Purpose::Channel));
        let drawn = |u: f64| {
            if scene.is_clear() {
                f64::INFINITY
            } else {
                -(1.0 - u).ln()
            }
        };
        let target = if sampling.collides {
            drawn(sampler.next_1d_for(Purpose::Distance))
        } else {
            f64::INFINITY
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
            differentials: RayDifferentials::new(scene, &start),
            medium: start.medium,
            left: start.left,
            spans: 0,
            depth: Spectrum::ZERO,
            length: 0.0,
            jump: 1.0,
            passed_by_chance: false,
            escaped: false,
            is_long: false,
            over_budget: false,
            reflections: 0,
            reach: 0.0,
            edge,
        }
    }

    /// Follows the ray through one region. Breaks where the edge ends.
    fn region(&mut self, ws: &mut Workspace) -> ControlFlow<()> {
        if ws.stop.is_raised() {
            return self.die(true);
        }
        let field = self.scene.field(self.medium);
        if field.is_constant() {
            return self.line(ws);
        }
        let node = Node::new(field, self.x, self.v, self.differentials.tangents());
        let mut flow = Flow::new(field, node, self.scene.tolerance());
        loop {
            let reach = self.scene.reach(flow.node().x);
            let step = flow.advance(reach / flow.node().v.length(), &mut ws.stats.work);
            if !step.end.x.is_finite() {
                return self.die(true);
            }
            let met = self.scene.first_beyond(&step.arc, None);
            let theta_end = met.map_or(1.0, |(_, meeting)| meeting.theta);
            self.record(step.arc, met, |theta| {
                let (_, v, tangents) = step.at(theta);
                (v, RayDifferentials::Bent(tangents))
            });
            if self.collided && !self.sampling.extend {
                return ControlFlow::Break(());
            }
            if let Some(met) = met {
                let (_, v, tangents) = step.at(theta_end);
                self.differentials = RayDifferentials::Bent(tangents);
                return self.surface(met, v);
            }
            self.is_long |= self.scene.is_long(self.length);
            if self.collided && self.is_long {
                return ControlFlow::Break(());
            }
            let outside = self.scene.is_outside(step.end.x);
            self.over_budget |= self.spans > STEPS_PER_RAY;
            if outside || self.over_budget || ws.stop.is_raised() {
                return self.die(true);
            }
        }
    }

    /// Follows the ray through a region of constant index: one line, without any of the work that
    /// curves take. Breaks where the edge ends.
    fn line(&mut self, ws: &mut Workspace) -> ControlFlow<()> {
        let h = self.scene.reach(self.x) / self.v.length();
        let (v, start) = (self.v, self.differentials);
        let arc = Arc::line(self.x, v, h);
        ws.stats.work.steps += 1;
        if !arc.end().is_finite() {
            return self.die(true);
        }
        let at = |theta: f64| (v, start.drifted(theta * h));
        let met = self.scene.first_beyond(&arc, self.left);
        self.record(arc, met, at);
        if self.collided && !self.sampling.extend {
            return ControlFlow::Break(());
        }
        self.differentials = at(met.map_or(1.0, |(_, meeting)| meeting.theta)).1;
        match met {
            Some(met) => self.surface(met, v),
            None => self.escape(&arc, v),
        }
    }

    /// Adds one arc, and the collision if it happens there. `at` is the velocity and the spread at θ.
    fn record(
        &mut self,
        arc: Arc,
        met: Option<(usize, Meeting)>,
        at: impl Fn(f64) -> (DVec3, RayDifferentials),
    ) {
        let theta_end = met.map_or(1.0, |(_, meeting)| meeting.theta);
        // Add the arc: its length, and its depth up to the collision if that is on it.
        let attenuation = Attenuation::new(self.scene.medium(self.medium), &arc, theta_end);
        let (length_before, depth_before) = (self.length, self.depth);
        let length = arc.arc_length(theta_end);
        self.length += length;
        if !self.collided {
            let (channel, target) = self.target;
            let target = (channel, target - depth_before[channel]);
            let (theta, depth) = attenuation.reach(&arc, theta_end, target);
            self.depth += depth;
            self.edge.geometry.depth = self.depth;
            self.edge.length = self.length;
            self.lengthen(arc.optical_length(theta.unwrap_or(theta_end)));
            if let Some(theta) = theta {
                self.edge.length = length_before + arc.arc_length(theta);
                self.collide(&arc, theta, at(theta), attenuation.rate(&arc, theta));
            }
        }
        if self.collided && self.sampling.extend {
            self.depth = depth_before + attenuation.depth(&arc, theta_end);
        }
        self.spans += 1;
        if !self.sampling.spans {
            return;
        }
        self.edge.spans.push(Span {
            arc,
            theta_end,
            medium: self.medium,
            attenuation,
            length,
            length_before,
            depth_before,
            weight_before: self.edge.weight,
            events_before: self.edge.geometry.events,
            surface: met,
        });
        // Where it ends must not depend on where the edge collides.
        if self.edge.geometry.events == 0 && !self.passed_by_chance && !self.is_long {
            self.edge.lead = self.edge.spans.len();
        }
    }

    /// Ends the edge at a collision, up to which length and depth are known.
    fn collide(
        &mut self,
        arc: &Arc,
        theta: f64,
        (v, spread): (DVec3, RayDifferentials),
        rate: Spectrum,
    ) {
        self.edge.end = End::Collision(Point {
            theta,
            x: arc.position(theta),
            direction: v.normalize(),
            medium: self.medium,
            length: self.edge.length,
            depth: self.edge.geometry.depth,
            rate,
            weight: self.edge.weight,
        });
        self.edge.geometry.geometry_term = spread.at_point(v, self.jump);
        self.collided = true;
    }

    /// Adds to the optical path length.
    fn lengthen(&mut self, length: f64) {
        let first = self.spans == 0 && self.edge.start.front == Front::Plane;
        if !(first && self.scene.field(self.medium).is_constant()) {
            self.reach += length;
        }
        self.edge.optical_length += length;
    }

    /// Goes through, is reflected, or ends at a surface. Breaks where the edge ends.
    fn surface(&mut self, (object, meeting): (usize, Meeting), v: DVec3) -> ControlFlow<()> {
        let scene = self.scene;
        let bsdf = &scene.objects()[object].bsdf;
        if self.collided && !bsdf.is_null() {
            // Beyond a collision only index-matched boundaries are passed.
            return ControlFlow::Break(());
        }
        let hit = &scene.hit(object, &meeting);
        if bsdf.is_null() {
            return self.pass(object, hit, v);
        }
        let shape = &scene.objects()[object].shape;
        let direction = v.normalize();
        let through = || bsdf.through(&shape.site(hit), hit.normal.dot(direction));
        if let Some(through) = bsdf.is_partial().then(through).flatten() {
            if self.sampler.next_1d() < through.probability {
                return self.pass_by_chance((object, hit), v, through);
            }
            if bsdf.is_delta() {
                self.edge.geometry.choice *= 1.0 - through.probability;
            }
        }
        if bsdf.is_delta() && self.edge.geometry.events < EVENTS_PER_EDGE {
            return self.specular(object, hit, (v, direction));
        }
        if bsdf.is_delta() {
            self.over_budget = true;
            return self.die(true);
        }
        self.edge.geometry.geometry_term = self.differentials.at_point(v, self.jump);
        self.edge.end = End::Surface {
            object,
            hit: *hit,
            direction,
            medium: self.medium,
        };
        ControlFlow::Break(())
    }

    /// Straight through a boundary that is declared index-matched. If the indices differ all the
    /// same, power and L, rather than L/n², are conserved: the declared jump takes no energy away.
    /// See docs/theory.md#declared-index-matches.
    fn pass(&mut self, object: usize, hit: &Hit, v: DVec3) -> ControlFlow<()> {
        let direction = v.normalize();
        let beyond = self.beyond(object, hit, direction);
        let ratio = self.scene.n(beyond, hit.position) / self.scene.n(self.medium, hit.position);
        if self.sampling.mode == TransportMode::Radiance {
            self.edge.weight *= ratio * ratio;
        }
        self.jump *= ratio;
        self.go_on((object, hit), v, direction, beyond, Rule::Pass)
    }

    /// Straight through a surface that lets part of the light pass.
    fn pass_by_chance(
        &mut self,
        at: (usize, &Hit),
        v: DVec3,
        through: PartialTransmission,
    ) -> ControlFlow<()> {
        self.passed_by_chance = true;
        self.edge.weight *= through.factor;
        self.edge.geometry.choice *= through.probability;
        self.go_on(at, v, v.normalize(), self.medium, Rule::Pass)
    }

    /// Refracted or reflected by chance at a smooth surface.
    fn specular(
        &mut self,
        object: usize,
        hit: &Hit,
        (v, direction): (DVec3, DVec3),
    ) -> ControlFlow<()> {
        let Some(sample) = self.turn((object, hit), -direction) else {
            return self.die(false);
        };
        let bsdf = &self.scene.objects()[object].bsdf;
        self.edge.connectable &= matches!(bsdf, Bsdf::Dielectric(_));
        if !sample.transmitted && sample.pdf < 1.0 {
            self.reflections += 1;
            // Connections know patterns of so many encounters.
            self.edge.connectable &= self.edge.geometry.events < Pattern::ENCOUNTERS;
        }
        self.edge.geometry.reflections += u32::from(!sample.transmitted);
        self.edge.geometry.events += 1;
        self.edge.geometry.choice *= sample.pdf;
        self.edge.weight *= sample.weight;
        let beyond = self.beyond(object, hit, sample.direction);
        let rule = if sample.transmitted {
            Rule::Refract
        } else {
            Rule::Reflect
        };
        self.go_on((object, hit), v, sample.direction, beyond, rule)
    }

    /// The way to go on from a smooth surface: one by chance, or, where the edge is split, the refracted one.
    fn turn(&mut self, (object, hit): (usize, &Hit), toward: DVec3) -> Option<BsdfSample> {
        let bsdf = &self.scene.objects()[object].bsdf;
        let surface = surface_at(self.scene, object, hit, self.medium);
        let sample = |u| bsdf.sample(&surface, toward, [u, 0.5, 0.5]);
        let is_first = self.edge.geometry.events == 0 && matches!(bsdf, Bsdf::Dielectric(_));
        if self.sampling.splitting && is_first {
            let (one, other) = (sample(0.0)?, sample(1.0f64.next_down())?);
            if !one.transmitted && other.transmitted {
                self.edge.split = Some(Box::new(self.split((object, hit), &one)));
                return Some(certain(other));
            }
        }
        sample(self.sampler.next_1d())
    }

    /// The way that is not gone on here (docs/theory.md#first-vertex-techniques).
    fn split(&self, (object, hit): (usize, &Hit), way: &BsdfSample) -> Split {
        let (scene, direction) = (self.scene, way.direction);
        let so_far = share(self.sampling.channel_pdf, self.edge.geometry.depth) * self.edge.weight;
        Split {
            start: Start {
                left: scene.left(object, hit.normal, direction),
                ..Start::point(
                    leave(scene, hit.position, hit.normal, direction),
                    direction,
                    self.beyond(object, hit, direction),
                )
            },
            throughput: so_far * certain(*way).weight,
            optical_length: self.edge.optical_length,
        }
    }

    fn beyond(&self, object: usize, hit: &Hit, direction: DVec3) -> MediumId {
        let at = (hit.position, hit.normal);
        self.scene.medium_beside(object, self.medium, at, direction)
    }

    /// On from a surface with the velocity before and the direction after.
    fn go_on(
        &mut self,
        (object, hit): (usize, &Hit),
        v: DVec3,
        direction: DVec3,
        beyond: MediumId,
        rule: Rule,
    ) -> ControlFlow<()> {
        self.x = leave(self.scene, hit.position, hit.normal, direction);
        self.left = self.scene.left(object, hit.normal, direction);
        let (near, far) = (self.scene.field(self.medium), self.scene.field(beyond));
        let alike = || near.n2(hit.position) == far.n2(hit.position);
        if rule == Rule::Pass && near.is_constant() && far.is_constant() && alike() {
            // Nothing happens to the ray nor to its neighbours.
            self.medium = beyond;
            return ControlFlow::Continue(());
        }
        let local = |field| {
            let (n2, a, ()) = <() as Variation>::local(field, hit.position);
            (n2, a)
        };
        let shape = &self.scene.objects()[object].shape;
        let interface = Interface {
            normal: hit.normal,
            shape: shape.shape_operator(hit.position, hit.primitive),
            near: local(near),
            far: local(far),
        };
        match interface.tangents(rule, v, &self.differentials.tangents()) {
            Some(tangents) => self.differentials = RayDifferentials::Bent(tangents),
            None => self.edge.connectable = false,
        }
        self.v = direction * interface.far.0.sqrt();
        self.medium = beyond;
        ControlFlow::Continue(())
    }

    /// Leaves the scene along its last arc.
    fn escape(&mut self, arc: &Arc, v: DVec3) -> ControlFlow<()> {
        self.escaped = true;
        if !self.collided {
            let (n, toward) = (v.length(), v.normalize());
            self.edge.optical_length += to_entrance(self.scene, n, arc.end(), toward);
            self.reach -= arc.optical_length(1.0);
            self.edge.geometry.geometry_term = self.differentials.at_plane(v, self.jump);
            self.edge.end = End::Escaped {
                direction: toward,
                medium: self.medium,
            };
        }
        ControlFlow::Break(())
    }

    /// Has an edge that left the scene collide. What is left of the depth X that was drawn beyond the depth D of the whole way
    /// is an exponential deviate, too: its rank 1 − e^(D − X) among deviates is given to one below D. Collisions of
    /// each channel become 1/(1 − e⁻ᴰ) times as dense; even numbers stay even (docs/theory.md#first-vertex-techniques).
    fn force(&mut self) {
        if !self.escaped || self.is_long || self.edge.geometry.events > 0 || self.passed_by_chance {
            return;
        }
        let whole = self.depth;
        self.edge.forcing = whole.map(|depth| {
            if depth > f64::MIN_POSITIVE {
                -1.0 / (-depth).exp_m1()
            } else {
                1.0
            }
        });
        let (channel, target) = self.target;
        if !self.collided && whole[channel] > f64::MIN_POSITIVE {
            // Depths are added up in another order: the difference may be positive by rounding.
            let rank = -(whole[channel] - target).min(0.0).exp_m1();
            let target = -(-rank / self.edge.forcing[channel]).ln_1p();
            self.edge.collide_at((channel, target));
        }
    }

    fn die(&mut self, lost: bool) -> ControlFlow<()> {
        if !self.collided {
            self.edge.end = End::Dead;
            self.edge.lost = lost;
        }
        ControlFlow::Break(())
    }
}

/// A way that is taken for certain, not by chance.
fn certain(way: BsdfSample) -> BsdfSample {
    BsdfSample {
        weight: way.weight * way.pdf,
        pdf: 1.0,
        ..way
    }
}

fn choose_channel(channel_pdf: Spectrum, mut u: f64) -> usize {
    let last = channel_pdf.0.iter().rposition(|&p| p > 0.0).unwrap_or(0);
    for (i, p) in channel_pdf.0.into_iter().enumerate() {
        if u < p {
            return i;
        }
        u -= p;
    }
    last
}
