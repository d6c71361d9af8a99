//! Sampling of an edge from its start: curved rays and collisions.
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
use crate::shape::Intersection;
use eikonal::connect::World;
use eikonal::field::Field;
use eikonal::ray::{Arc, Flow, Node, Variation};
use glam::DVec3;
use std::ops::ControlFlow;

/// Parameters for sampling an edge.
#[derive(Clone, Copy, Debug)]
pub struct Sampling {
    /// Quantity that the edge carries.
    pub mode: TransportMode,
    /// Probabilities of sampling the distance with the extinction of each channel. They sum to one.
    pub channel_pdf: Spectrum,
    /// True if spans are recorded beyond a collision. They go up to the next surface that is not
    /// index-matched, or up to a length of 32 radii of the scene.
    pub extend: bool,
    /// True if the edge may end at a collision. Otherwise it continues to a surface, through all
    /// media.
    pub collides: bool,
    /// True if spans are kept: see [`Edge::spans`].
    pub spans: bool,
    /// True if the arcs up to the end are kept in [the workspace](Workspace::edge_parts), until the
    /// next edge is sampled.
    pub parts: bool,
    /// True if the edge is forced to collide where it would leave the scene, if its media attenuate
    /// light: see [`Edge::forcing`]. Requires `extend`.
    pub forced: bool,
    /// True if ray differentials are followed. The
    /// [geometry term](crate::path::segment::EdgeGeometry::geometry_term) needs them and is 0
    /// without them.
    pub differentials: bool,
    /// True if both branches are taken at the first specular event, if it can refract and reflect:
    /// see [`Edge::split`].
    pub splitting: bool,
}

/// A sampled collision: a channel, and the optical depth of the collision in this channel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DrawnCollision {
    pub channel: usize,
    pub depth: f64,
}

impl DrawnCollision {
    /// No collision, at any distance.
    const NONE: Self = DrawnCollision {
        channel: 0,
        depth: f64::INFINITY,
    };

    /// Samples a channel with probability w_c, and the depth −ln(1 − u) of the collision in it. The
    /// depth is infinite if edges do not collide.
    pub(crate) fn draw(scene: &Scene, sampling: &Sampling, sampler: &mut Sampler) -> Self {
        if scene.is_clear() || !sampling.collides {
            // Skip as many numbers as a collision takes: the numbers that follow stay the same.
            sampler.skip(1 + usize::from(sampling.collides));
            return DrawnCollision::NONE;
        }
        let channel = choose_channel(sampling.channel_pdf, sampler.next_1d_for(Purpose::Channel));
        let u = sampler.next_1d_for(Purpose::Distance);
        DrawnCollision {
            channel,
            depth: -(1.0 - u).ln(),
        }
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

/// Samples an edge, given the collision.
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

/// State of an edge that is being sampled.
pub(super) struct Walk<'a, 'b> {
    pub scene: &'a Scene,
    pub sampler: &'b mut Sampler,
    pub edge: &'b mut Edge<'a>,
    pub sampling: Sampling,
    target: DrawnCollision,
    /// Ray at the start of the next span.
    pub ray: RayState,
    /// Quantities accumulated before the next span.
    pub travelled: Travelled,
    /// Events on the edge so far.
    pub events: Events,
}

/// A ray at the start of a span.
pub(super) struct RayState {
    pub x: DVec3,
    pub v: DVec3,
    pub differentials: RayDifferentials,
    pub medium: MediumId,
    /// Object that the ray cannot meet again while it is straight.
    pub start_object: Option<usize>,
}

/// Quantities that a ray accumulated before a span.
pub(super) struct Travelled {
    /// Number of spans.
    spans: usize,
    /// Optical depth.
    depth: Spectrum,
    /// Arc length.
    length: f64,
    /// Optical path length that is compared with the reach of connections. It leaves out the
    /// distance to a plane.
    reach: f64,
    /// ∏ n_after/n_before over declared index matches.
    pub jump: f64,
    /// Number of reflections where refraction was possible.
    pub reflections: u32,
}

/// Events on an edge.
#[derive(Default)]
pub(super) struct Events {
    pub collided: bool,
    /// True if the edge passed straight through a partially transmitting surface.
    pub passed_by_chance: bool,
    /// True if the edge, or its extension, left the scene.
    escaped: bool,
    /// True if the edge, or its extension, reached the largest length of extensions.
    is_long: bool,
    /// True if the edge was abandoned after too many steps or events.
    pub over_budget: bool,
}

impl<'a, 'b> Walk<'a, 'b> {
    /// Starts an edge.
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
                start_object: start.start_object,
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

    /// Follows the ray through one region. Breaks if the edge ends.
    fn region(&mut self, ws: &mut Workspace) -> ControlFlow<()> {
        if ws.stop.is_raised() {
            return self.absorb(true);
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

    /// Follows the ray through a region where it bends, step by step, with `variation` along it.
    /// Breaks if the edge ends.
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
                return self.absorb(true);
            }
            let met = self.scene.first_beyond(&step.arc, None);
            let theta_end = met.map_or(1.0, |(_, intersection)| intersection.theta);
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
            if let Some((object, intersection)) = met {
                let (_, v, variation) = step.at(theta_end);
                self.ray.differentials = variation.into();
                return self.surface(object, intersection, v);
            }
            self.events.is_long |= self.scene.is_long(self.travelled.length);
            if self.events.collided && self.events.is_long {
                return ControlFlow::Break(());
            }
            let outside = self.scene.is_outside(step.end.x);
            self.events.over_budget |= self.travelled.spans > STEPS_PER_RAY;
            if outside || self.events.over_budget || ws.stop.is_raised() {
                return self.absorb(true);
            }
        }
    }

    /// Follows the ray through a region of constant index, as one line. Breaks if the edge ends.
    fn line(&mut self, ws: &mut Workspace) -> ControlFlow<()> {
        let h = self.scene.reach(self.ray.x) / self.ray.v.length();
        let (v, start) = (self.ray.v, self.ray.differentials);
        let arc = Arc::line(self.ray.x, v, h);
        ws.stats.work.steps += 1;
        if !arc.end().is_finite() {
            return self.absorb(true);
        }
        let at = |theta: f64| (v, start.drifted(theta * h));
        let attenuation = self.along_line(&arc);
        // If the edge ends at a collision, skip the search for surfaces beyond it.
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
            self.scene.first_before(&arc, end, self.ray.start_object)
        };
        self.record(arc, attenuation, met, at, ws);
        if self.events.collided && !self.sampling.extend {
            return ControlFlow::Break(());
        }
        self.ray.differentials = at(met.map_or(1.0, |(_, intersection)| intersection.theta)).1;
        match met {
            Some((object, intersection)) => self.surface(object, intersection, v),
            None => self.escape(&arc, v),
        }
    }

    /// Returns the extinction along a line. If the edge ends at a collision, it may be valid only
    /// up to there.
    fn along_line(&self, arc: &Arc) -> Attenuation<'a> {
        let medium = self.scene.medium(self.ray.medium);
        let DrawnCollision { channel, depth } = self.target;
        let left = depth - self.travelled.depth[channel];
        let near = || Attenuation::in_label(medium, arc, channel, left);
        let near = self.ends_at_collision().then(near).flatten();
        near.unwrap_or_else(|| Attenuation::new(medium, arc, 1.0))
    }

    /// Returns true if the edge ends where it collides.
    fn ends_at_collision(&self) -> bool {
        self.sampling.collides && !self.sampling.extend
    }

    /// Returns the θ of the sampled collision on a part of an arc, if it lies there, and the depth.
    /// The depth goes up to the collision, or up to the end of the part. `part` is θ and the arc
    /// length at the end of the part.
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

    /// Adds one arc, and the collision if it lies on the arc. `at` returns the velocity and the
    /// differentials at θ.
    fn record(
        &mut self,
        arc: Arc,
        attenuation: Attenuation<'a>,
        met: Option<(usize, Intersection)>,
        at: impl Fn(f64) -> (DVec3, RayDifferentials),
        ws: &mut Workspace,
    ) {
        let theta_end = met.map_or(1.0, |(_, intersection)| intersection.theta);
        // Add the arc: its length, and its depth up to the collision if the collision lies on it.
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
        // The lead must not depend on the place of the collision.
        let events = &self.events;
        // Planted error "edges extended farther if they collide late", found by morgana-transport/transport::edges::extensions_of_rays_that_circle_end:
        // if self.edge.geometry.events == 0 && !events.passed_by_chance {
        if self.edge.geometry.events == 0 && !events.passed_by_chance && !events.is_long {
            self.edge.lead = self.edge.spans.len();
        }
    }

    /// Ends the edge at a collision. The length and depth of the edge already end there.
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

    /// Leaves the scene along the last arc.
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

    /// Forces an edge that left the scene to collide.
    ///
    /// The sampled depth X exceeds the depth D of the whole edge; the rest X − D is an exponential
    /// deviate too. Its rank 1 − e^(D − X) among deviates becomes the rank of a deviate below D.
    /// Collisions in each channel become denser by the factor 1/(1 − e⁻ᴰ); evenly spread numbers
    /// remain evenly spread (docs/theory.md#first-vertex-techniques).
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
            // Depths are summed in a different order, so rounding may make the difference positive.
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
    pub(super) fn absorb(&mut self, lost: bool) -> ControlFlow<()> {
        if !self.events.collided {
            self.edge.end = End::Dead;
            self.edge.lost = lost;
        }
        ControlFlow::Break(())
    }
}

/// Returns the channel for a random number `u`, with the probability of each channel.
pub(crate) fn choose_channel(channel_pdf: Spectrum, mut u: f64) -> usize {
    for (i, p) in channel_pdf.0.into_iter().enumerate() {
        if u < p {
            return i;
        }
        u -= p;
    }
    // Rounding left `u` above the sum.
    channel_pdf.0.iter().rposition(|&p| p > 0.0).unwrap_or(0)
}
