//! Sampling an edge from its start: flow and collisions.
//!
//! Theory: docs/theory.md#connectable-edges, docs/theory.md#free-flight.

use crate::Spectrum;
use crate::budget::STEPS_PER_RAY;
use crate::medium::Attenuation;
use crate::path::segment::{
    Edge, End, Front, Point, RayDifferentials, Span, Start, TransportMode, to_entrance,
};
use crate::path::workspace::{RayPart, Workspace};
use crate::sampling::{Purpose, Sampler};
use crate::scene::{MediumId, Scene};
use crate::shape::Meeting;
use eikonal::connect::World;
use eikonal::field::Field;
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
    /// Whether its arcs up to its end are kept in [the workspace](Workspace::edge_parts), until the next edge is sampled.
    pub parts: bool,
    /// Whether it collides for certain where it would leave the scene, if there is anything to collide with: see
    /// [`Edge::forcing`]. Only if it is extended.
    pub forced: bool,
    /// Whether its neighbours are followed, which its [geometry term](crate::path::segment::EdgeGeometry::geometry_term) needs: it is 0 otherwise.
    pub differentials: bool,
    /// Whether both ways are taken at the first specular event, if it is one of refraction or reflection: see [`Edge::split`].
    pub splitting: bool,
}

/// The collision that was drawn: a channel, and the optical depth in it at which it happens.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DrawnCollision {
    pub channel: usize,
    pub depth: f64,
}

impl DrawnCollision {
    /// Draws a channel with probability w_c, and the depth −ln(1 − u) of the collision in it, which is infinite if edges do not collide.
    pub(crate) fn draw(scene: &Scene, sampling: &Sampling, sampler: &mut Sampler) -> Self {
        let channel = choose_channel(sampling.channel_pdf, sampler.next_1d_for(Purpose::Channel));
        let drawn = |u: f64| {
            if scene.is_clear() {
                f64::INFINITY
            } else {
                -(1.0 - u).ln()
            }
        };
        let depth = if sampling.collides {
            drawn(sampler.next_1d_for(Purpose::Distance))
        } else {
            f64::INFINITY
        };
        DrawnCollision { channel, depth }
    }
}

/// Samples an edge.
pub fn trace<'a>(
    scene: &'a Scene,
    start: Start,
    sampling: Sampling,
    sampler: &mut Sampler,
    ws: &mut Workspace,
) -> Edge<'a> {
    let target = DrawnCollision::draw(scene, &sampling, sampler);
    trace_to(scene, start, sampling, target, sampler, ws)
}

/// The same, given the collision.
pub(crate) fn trace_to<'a>(
    scene: &'a Scene,
    start: Start,
    sampling: Sampling,
    target: DrawnCollision,
    sampler: &mut Sampler,
    ws: &mut Workspace,
) -> Edge<'a> {
    ws.stats.edges += 1;
    ws.edge_parts.clear();
    let mut edge = Edge::new(start);
    let mut walk = Walk::new(scene, &mut edge, sampling, target, sampler);
    while walk.region(ws).is_continue() {}
    if sampling.forced {
        walk.force(ws);
    }
    let (length, reflections) = (walk.travelled.reach, walk.travelled.reflections);
    ws.stats.over_budget.rays += u64::from(walk.events.over_budget);
    let within = scene.branch_reach();
    edge.connectable &= within.includes(length, reflections, edge.geometry.reflections)
        && edge.geometry.geometry_term > 0.0;
    ws.stats.lost += u64::from(edge.lost);
    edge
}

/// An edge that is being sampled.
pub(super) struct Walk<'a, 'b> {
    pub scene: &'a Scene,
    pub sampler: &'b mut Sampler,
    pub edge: &'b mut Edge<'a>,
    pub sampling: Sampling,
    target: DrawnCollision,
    /// Where the next span starts.
    pub ray: RayState,
    /// What lies behind.
    pub travelled: Travelled,
    /// What has happened on the way.
    pub events: Events,
}

/// A ray at the start of a span.
pub(super) struct RayState {
    pub x: DVec3,
    pub v: DVec3,
    pub differentials: RayDifferentials,
    pub medium: MediumId,
    /// An object that the ray does not meet as long as it is straight.
    pub left: Option<usize>,
}

/// What a ray has gone through before a span.
pub(super) struct Travelled {
    /// Number of spans.
    spans: usize,
    /// Optical depth.
    depth: Spectrum,
    /// Arc length.
    length: f64,
    /// Optical path length that counts for the reach of connections: how far away a plane is does not.
    reach: f64,
    /// ∏ n_after/n_before over declared index matches.
    pub jump: f64,
    /// Reflections where refraction was possible.
    pub reflections: u32,
}

/// What has happened on an edge.
#[derive(Default)]
pub(super) struct Events {
    pub collided: bool,
    /// Whether it passed a surface straight on by chance.
    pub passed_by_chance: bool,
    /// Whether it, or its extension, left the scene.
    escaped: bool,
    /// Whether it, or its extension, went so far that no extension goes farther.
    is_long: bool,
    /// Whether it was given up because it took too many steps or events.
    pub over_budget: bool,
}

impl<'a, 'b> Walk<'a, 'b> {
    /// At the start of an edge.
    fn new(
        scene: &'a Scene,
        edge: &'b mut Edge<'a>,
        sampling: Sampling,
        target: DrawnCollision,
        sampler: &'b mut Sampler,
    ) -> Self {
        let start = edge.start;
        let n = scene.n(start.medium, start.x);
        Walk {
            scene,
            sampler,
            sampling,
            edge,
            target,
            ray: RayState {
                x: start.x,
                v: start.direction * n,
                differentials: if sampling.differentials {
                    RayDifferentials::new(scene, &start, n)
                } else {
                    RayDifferentials::Ignored
                },
                medium: start.medium,
                left: start.left,
            },
            travelled: Travelled {
                spans: 0,
                depth: Spectrum::ZERO,
                length: 0.0,
                reach: 0.0,
                jump: 1.0,
                reflections: 0,
            },
            events: Events::default(),
        }
    }

    /// Follows the ray through one region. Breaks where the edge ends.
    fn region(&mut self, ws: &mut Workspace) -> ControlFlow<()> {
        if ws.stop.is_raised() {
            return self.die(true);
        }
        let field = self.scene.field(self.ray.medium);
        if field.is_constant() {
            return self.line(ws);
        }
        match self.ray.differentials.tangents() {
            None => self.curve(field, (), ws),
            Some(tangents) => self.curve(field, tangents, ws),
        }
    }

    /// Follows the ray through a region where it bends, step by step, with what varies along it. Breaks where the edge ends.
    fn curve<V>(&mut self, field: &Field, variation: V, ws: &mut Workspace) -> ControlFlow<()>
    where
        V: Variation + Into<RayDifferentials>,
    {
        let node = Node::new(field, self.ray.x, self.ray.v, variation);
        let mut flow = Flow::new(field, node, ws.tolerance());
        loop {
            let reach = self.scene.reach(flow.node().x);
            let step = flow.advance(reach / flow.node().v.length(), &mut ws.stats.work);
            if !step.end.x.is_finite() {
                return self.die(true);
            }
            let met = self.scene.first_beyond(&step.arc, None);
            let theta_end = met.map_or(1.0, |(_, meeting)| meeting.theta);
            let attenuation =
                Attenuation::new(self.scene.medium(self.ray.medium), &step.arc, theta_end);
            let at = |theta| {
                let (_, v, variation) = step.at(theta);
                (v, variation.into())
            };
            self.record(step.arc, attenuation, met, at, ws);
            if self.events.collided && !self.sampling.extend {
                return ControlFlow::Break(());
            }
            if let Some((object, meeting)) = met {
                let (_, v, variation) = step.at(theta_end);
                self.ray.differentials = variation.into();
                return self.surface(object, meeting, v);
            }
            self.events.is_long |= self.scene.is_long(self.travelled.length);
            if self.events.collided && self.events.is_long {
                return ControlFlow::Break(());
            }
            let outside = self.scene.is_outside(step.end.x);
            self.events.over_budget |= self.travelled.spans > STEPS_PER_RAY;
            if outside || self.events.over_budget || ws.stop.is_raised() {
                return self.die(true);
            }
        }
    }

    /// Follows the ray through a region of constant index: one line, without any of the work that
    /// curves take. Breaks where the edge ends.
    fn line(&mut self, ws: &mut Workspace) -> ControlFlow<()> {
        let h = self.scene.reach(self.ray.x) / self.ray.v.length();
        let (v, start) = (self.ray.v, self.ray.differentials);
        let arc = Arc::line(self.ray.x, v, h);
        ws.stats.work.steps += 1;
        if !arc.end().is_finite() {
            return self.die(true);
        }
        let at = |theta: f64| (v, start.drifted(theta * h));
        let attenuation = self.along_line(&arc);
        // Where it collides first, nobody asks for the surface beyond.
        let end = if self.ends_at_collision() {
            let whole = (1.0, arc.arc_length(1.0));
            self.collision(&attenuation, &arc, whole).0.unwrap_or(1.0)
        } else {
            1.0
        };
        let is_free = |length: f64| {
            let direction = (arc.end() - arc.start()) / length;
            self.scene
                .is_free(self.ray.medium, None, [self.ray.x, direction], end * length)
        };
        let met = if is_free(arc.arc_length(1.0)) {
            None
        } else {
            self.scene.first_before(&arc, end, self.ray.left)
        };
        self.record(arc, attenuation, met, at, ws);
        if self.events.collided && !self.sampling.extend {
            return ControlFlow::Break(());
        }
        self.ray.differentials = at(met.map_or(1.0, |(_, meeting)| meeting.theta)).1;
        match met {
            Some((object, meeting)) => self.surface(object, meeting, v),
            None => self.escape(&arc, v),
        }
    }

    /// Extinction along a line, which need not be known beyond the collision if the edge ends there.
    fn along_line(&self, arc: &Arc) -> Attenuation<'a> {
        let medium = self.scene.medium(self.ray.medium);
        let DrawnCollision { channel, depth } = self.target;
        let left = depth - self.travelled.depth[channel];
        let near = || Attenuation::in_label(medium, arc, channel, left);
        let near = self.ends_at_collision().then(near).flatten();
        near.unwrap_or_else(|| Attenuation::new(medium, arc, 1.0))
    }

    /// Whether the edge ends where it collides.
    fn ends_at_collision(&self) -> bool {
        self.sampling.collides && !self.sampling.extend
    }

    /// Where on a part of an arc the collision lies that was drawn, if it does, and the depth up to there, or up to the end of the
    /// part, of which θ and the arc length are given.
    fn collision(
        &self,
        attenuation: &Attenuation,
        arc: &Arc,
        part: (f64, f64),
    ) -> (Option<f64>, Spectrum) {
        let DrawnCollision { channel, depth } = self.target;
        let left = depth - self.travelled.depth[channel];
        attenuation.reach(arc, part, channel, left)
    }

    /// Adds one arc, and the collision if it happens there. `at` is the velocity and the differentials at θ.
    fn record(
        &mut self,
        arc: Arc,
        attenuation: Attenuation<'a>,
        met: Option<(usize, Meeting)>,
        at: impl Fn(f64) -> (DVec3, RayDifferentials),
        ws: &mut Workspace,
    ) {
        let theta_end = met.map_or(1.0, |(_, meeting)| meeting.theta);
        // Add the arc: its length, and its depth up to the collision if that is on it.
        let (length_before, depth_before) = (self.travelled.length, self.travelled.depth);
        let [length, optical_length] = arc.lengths(theta_end);
        self.travelled.length += length;
        if !self.events.collided {
            let (theta, depth) = self.collision(&attenuation, &arc, (theta_end, length));
            // Planted error "path cut one arc short at the boundary", found by morgana-transport/transport::edges::an_edge_is_as_long_as_its_way:
            // if theta_end == 1.0 { self.travelled.depth += depth; }
            self.travelled.depth += depth;
            self.edge.geometry.depth = self.travelled.depth;
            let [up_to, optical_up_to] =
                theta.map_or([length, optical_length], |theta| arc.lengths(theta));
            self.edge.length = length_before + up_to;
            // Planted error "geometric in place of optical length", found by morgana-transport/transport::layers::lengths::all_rays_of_a_luneburg_ball_are_equally_long:
            // self.lengthen(up_to);
            self.lengthen(optical_up_to);
            if self.sampling.parts {
                ws.edge_parts.push(RayPart {
                    arc,
                    theta_end: theta.unwrap_or(theta_end),
                    medium: self.ray.medium,
                });
            }
            if let Some(theta) = theta {
                let (v, differentials) = at(theta);
                self.collide(&arc, theta, v, differentials, &attenuation);
            }
        }
        if self.events.collided && self.sampling.extend {
            self.travelled.depth = depth_before + attenuation.depth(theta_end, length);
        }
        self.travelled.spans += 1;
        if !self.sampling.spans {
            return;
        }
        self.edge.spans.push(Span {
            arc,
            theta_end,
            medium: self.ray.medium,
            attenuation,
            length,
            length_before,
            depth_before,
            weight_before: self.edge.weight,
            events_before: self.edge.geometry.events,
            surface: met,
        });
        // Where it ends must not depend on where the edge collides.
        let events = &self.events;
        // Planted error "edges extended farther if they collide late", found by morgana-transport/transport::edges::extensions_of_rays_that_circle_end:
        // if self.edge.geometry.events == 0 && !events.passed_by_chance {
        if self.edge.geometry.events == 0 && !events.passed_by_chance && !events.is_long {
            self.edge.lead = self.edge.spans.len();
        }
    }

    /// Ends the edge at a collision, up to which length and depth are known.
    fn collide(
        &mut self,
        arc: &Arc,
        theta: f64,
        v: DVec3,
        differentials: RayDifferentials,
        attenuation: &Attenuation<'a>,
    ) {
        self.edge.end = End::Collision(Point {
            theta,
            x: arc.position(theta),
            direction: v.normalize(),
            medium: self.ray.medium,
            length: self.edge.length,
            depth: self.edge.geometry.depth,
            rate: attenuation.rate(arc, theta),
            label: attenuation.label(),
            weight: self.edge.weight,
        });
        self.edge.geometry.geometry_term = differentials.at_point(v, self.travelled.jump);
        self.events.collided = true;
    }

    /// Adds to the optical path length.
    fn lengthen(&mut self, length: f64) {
        let first = self.travelled.spans == 0 && self.edge.start.front == Front::Plane;
        if !(first && self.scene.field(self.ray.medium).is_constant()) {
            self.travelled.reach += length;
        }
        self.edge.optical_length += length;
    }

    /// Leaves the scene along its last arc.
    fn escape(&mut self, arc: &Arc, v: DVec3) -> ControlFlow<()> {
        self.events.escaped = true;
        if !self.events.collided {
            let (n, toward) = (v.length(), v.normalize());
            self.edge.optical_length += to_entrance(self.scene, n, arc.end(), toward);
            self.travelled.reach -= arc.optical_length(1.0);
            self.edge.geometry.geometry_term =
                self.ray.differentials.at_plane(v, self.travelled.jump);
            self.edge.end = End::Escaped {
                direction: toward,
                medium: self.ray.medium,
            };
        }
        ControlFlow::Break(())
    }

    /// Has an edge that left the scene collide. What is left of the depth X that was drawn beyond the depth D of the whole way
    /// is an exponential deviate, too: its rank 1 − e^(D − X) among deviates is given to one below D. Collisions of
    /// each channel become 1/(1 − e⁻ᴰ) times as dense; even numbers stay even (docs/theory.md#first-vertex-techniques).
    fn force(&mut self, ws: &mut Workspace) {
        let (events, is_specular) = (&self.events, self.edge.geometry.events > 0);
        // Planted error "collisions forced before surfaces", found by morgana-transport/transport::first_vertex::only_what_would_leave_is_forced:
        // if is_specular || events.passed_by_chance {
        if !events.escaped || events.is_long || is_specular || events.passed_by_chance {
            return;
        }
        let whole = self.travelled.depth;
        // Planted error "forced collisions in one channel's density only", found by morgana-transport/transport::first_vertex::means_stay:
        // self.edge.forcing = whole.map(|_| whole[0]).map(|depth| {
        self.edge.forcing = whole.map(|depth| {
            if depth > f64::MIN_POSITIVE {
                -1.0 / (-depth).exp_m1()
            } else {
                1.0
            }
        });
        let DrawnCollision { channel, depth } = self.target;
        if !self.events.collided && whole[channel] > f64::MIN_POSITIVE {
            // Depths are added up in another order: the difference may be positive by rounding.
            let rank = -(whole[channel] - depth).min(0.0).exp_m1();
            // Planted error "forced collisions spread evenly over depths", found by morgana-transport/transport::first_vertex::depths_have_their_distribution:
            // let target = rank * whole[channel];
            let target = -(-rank / self.edge.forcing[channel]).ln_1p();
            let span = self.edge.collide_at(channel, target);
            if let (Some(span), End::Collision(point), true) =
                (span, &self.edge.end, self.sampling.parts)
            {
                // Planted error "parts of edges beyond collisions that are forced", found by morgana-transport/transport::first_vertex::parts_are_those_up_to_the_end:
                // (no line)
                ws.edge_parts.truncate(span + 1);
                ws.edge_parts[span].theta_end = point.theta;
            }
        }
    }

    /// Ends the edge where it is absorbed, or lost.
    pub(super) fn die(&mut self, lost: bool) -> ControlFlow<()> {
        if !self.events.collided {
            self.edge.end = End::Dead;
            self.edge.lost = lost;
        }
        ControlFlow::Break(())
    }
}

/// The channel that a random number stands for, drawn with the probability of each.
pub(crate) fn choose_channel(channel_pdf: Spectrum, mut u: f64) -> usize {
    for (i, p) in channel_pdf.0.into_iter().enumerate() {
        if u < p {
            return i;
        }
        u -= p;
    }
    // By rounding.
    channel_pdf.0.iter().rposition(|&p| p > 0.0).unwrap_or(0)
}
