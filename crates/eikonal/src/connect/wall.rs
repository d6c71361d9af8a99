//! Rays through one smooth interface from a field that bends rays to a region of constant index, by
//! collocation (docs/theory.md#through-a-lens).
//!
//! The unknown is the point of the interface. From this point to the inner end,
//! [collocation](super::collocate) finds the ray; to the outer end the ray is straight. By Fermat's
//! principle the total optical length is stationary:
//!
//! g = v − n′e has no component along the interface,
//!
//! where v is the velocity of the arriving ray at the interface, and e the direction from there to
//! the outer end. This is Snell's law, but smooth even where rays graze the interface, and beyond.
//! The tangents give the derivatives of g.

use super::collocate::{Collocation, collocated};
use super::connection::ConnectingRay;
use super::family::RayFamily;
use super::newton::Iterate;
use super::pattern::Pattern;
use super::shoot::Travelled;
use super::solver::{Hit, Solver};
use super::world::{Crossing, Event, Piece, World};
use crate::interface::{Interface, Rule};
use crate::ray::{Arc, Node, Tangents, Variation, perpendicular_basis};
use glam::{DMat2, DMat3, DVec2, DVec3};

/// Maximum number of rounds of Newton's method.
const MAX_ROUNDS: usize = 8;
/// Longest step, as a fraction of the distance to the inner point.
const MAX_STEP: f64 = 0.5;
/// Fraction by which lines to the approximate crossing are extended, so that they intersect the
/// interface.
const EXTENSION: f64 = 0.5;

/// Initial guess of a ray between a point in a field and a point where the index is constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallGuess<R> {
    /// End of the ray in the field.
    pub inner: DVec3,
    /// The region of the field.
    pub region: R,
    /// End of the ray where the index is constant.
    pub outer: DVec3,
    /// Approximate point where the ray crosses the interface.
    pub crossing: DVec3,
    /// True for the ray from the inner to the outer end, false for the reverse ray.
    pub outward: bool,
}

/// A ray from the inner end to the interface.
struct Inside<R> {
    crossing: Crossing<R>,
    /// Unit normal on the side of the outer end.
    normal: DVec3,
    /// Velocity at the inner end.
    first: DVec3,
    /// Node at the interface, just before it.
    node: Node<Tangents>,
    travelled: Travelled,
    interface: Interface,
}

impl<R: Copy + PartialEq + std::fmt::Debug> Solver<R> {
    /// Returns the ray near a guess and stores its [pieces](Self::pieces), without tracing rays.
    /// `None` if the ray is not found, if collocation cannot find the part inside, or if anything
    /// except the one interface lies on the way.
    pub fn through_wall<W: World<Region = R>>(
        &mut self,
        world: &W,
        guess: &WallGuess<R>,
    ) -> Option<ConnectingRay> {
        let mut aim = guess.crossing;
        for _ in 0..MAX_ROUNDS {
            let inside = self.inside(world, guess, aim)?;
            if let Some(found) = self.refracted(world, guess, &inside) {
                return Some(if guess.outward {
                    found
                } else {
                    self.turned_round(guess, &found)
                });
            }
            aim = inside.next(guess, world.field(inside.crossing.beyond).n(guess.outer))?;
        }
        None
    }

    /// Returns the ray from the inner end to the point where the line towards `aim` meets the
    /// interface.
    fn inside<W: World<Region = R>>(
        &mut self,
        world: &W,
        guess: &WallGuess<R>,
        aim: DVec3,
    ) -> Option<Inside<R>> {
        let x = guess.inner;
        let line = Arc::line(x, aim - x, 1.0 + EXTENSION);
        let crossing = world.crossing(guess.region, &line)?;
        let beyond = world.field(crossing.beyond);
        if crossing.rule != Rule::Refract || !beyond.is_constant() {
            return None;
        }
        let normal = crossing.normal * crossing.normal.dot(aim - x).signum();
        let end = crossing.position - normal * world.ray_epsilon();
        let field = world.field(guess.region);
        let mut found = Collocation {
            arcs: &mut self.arcs,
            evaluations: &mut self.work.evaluations,
            relaxation: &mut self.relaxation,
        };
        let ray = collocated(field, x, end - x, self.tolerance.get(), &mut found)?;
        self.work.evaluations += 1;
        let node = Node::start(field, end, ray.v[1].normalize(), ray.tangents);
        let interface = Interface {
            normal: crossing.normal,
            shape: crossing.shape,
            near: (node.n2, node.a),
            far: (beyond.n2(end), DVec3::ZERO),
        };
        Some(Inside {
            crossing,
            normal,
            first: ray.v[0],
            node,
            travelled: Travelled {
                arc_length: ray.arc_length,
                optical_length: ray.optical_length,
                sigma: ray.sigma,
                segment: ray.arc_length,
            },
            interface,
        })
    }

    /// Continues the ray by refraction to the outer end. `None` if it misses the outer end by too
    /// much, or if anything else lies on the way.
    fn refracted<W: World<Region = R>>(
        &mut self,
        world: &W,
        guess: &WallGuess<R>,
        inside: &Inside<R>,
    ) -> Option<ConnectingRay> {
        let (y, node) = (guess.outer, &inside.node);
        let after = inside.interface.velocity(Rule::Refract, node.v)?;
        let variation = inside
            .interface
            .tangents(Rule::Refract, node.v, &node.variation)?;
        let (far_n2, _) = inside.interface.far;
        let x = inside.crossing.position + inside.normal * world.ray_epsilon();
        let sigma = (y - x).dot(after) / far_n2;
        if sigma <= 0.0 {
            return None;
        }
        let beyond = inside.crossing.beyond;
        let mut end_state = Node::new(world.field(beyond), x + after * sigma, after, variation);
        end_state.variation.drift(sigma);
        let segment = far_n2.sqrt() * sigma;
        let so_far = inside.travelled;
        let hit = Hit {
            first_index: inside.first.length(),
            end_state,
            travelled: Travelled {
                arc_length: so_far.arc_length + segment,
                optical_length: so_far.optical_length + far_n2 * sigma,
                sigma: so_far.sigma + sigma,
                segment,
            },
            pattern: Pattern::REFRACT,
        };
        let family = RayFamily::Point {
            x: guess.inner,
            direction: inside.first.normalize(),
        };
        let floor = self.least_miss(world, guess.inner, y);
        if end_state.x.distance(y) > self.allowed_miss(&family, &hit, floor) {
            return None;
        }
        let iterate = Iterate {
            family,
            length: hit.travelled.optical_length,
        };
        // Correct the ray, and check that it meets no other interface.
        let found = self.finish(&iterate, &hit, y, 0).ok()?;
        let line = Arc::line(x, after, sigma);
        let is_clear = |region, arc: &Arc| world.crossing(region, arc).is_none();
        if !is_clear(beyond, &line) || !self.arcs.iter().all(|arc| is_clear(guess.region, arc)) {
            return None;
        }
        self.keep_pieces(guess, inside, &line, after);
        Some(found)
    }

    fn keep_pieces(&mut self, guess: &WallGuess<R>, inside: &Inside<R>, line: &Arc, after: DVec3) {
        let piece = |region, arc| Piece {
            region,
            arc,
            theta_end: 1.0,
            event: None,
        };
        self.pieces.clear();
        let arcs = self.arcs.iter().map(|&arc| piece(guess.region, arc));
        self.pieces.extend(arcs);
        if let Some(last) = self.pieces.last_mut() {
            last.event = Some(Event {
                rule: Rule::Refract,
                far_n: inside.interface.far.0.sqrt(),
                surface: inside.crossing.surface,
                normal: inside.crossing.normal,
                before: inside.node.v,
                after,
            });
        }
        self.pieces.push(piece(inside.crossing.beyond, *line));
    }

    /// Returns the ray in the reverse direction, from the outer end to the inner one. J over n² at
    /// the start is equal in both directions (étendue is conserved).
    fn turned_round(&mut self, guess: &WallGuess<R>, ray: &ConnectingRay) -> ConnectingRay {
        let event = self.pieces.iter().find_map(|piece| piece.event);
        self.pieces.reverse();
        for piece in &mut self.pieces {
            piece.arc = piece.arc.reversed();
            piece.event = None;
        }
        self.pieces[0].event = event.map(|event| Event {
            far_n: event.before.length(),
            before: -event.after,
            after: -event.before,
            ..event
        });
        let [inner, outer] = ray.indices;
        ConnectingRay {
            start: guess.outer,
            direction_out: -ray.direction_in,
            direction_in: -ray.direction_out,
            indices: [outer, inner],
            // Planted error "rays through a lens turned round without their étendue", found by morgana-transport/transport::lens::rays_are_those_of_the_dense_search:
            // jacobian: ray.jacobian * (inner / outer).powi(2),
            jacobian: ray.jacobian * (outer / inner).powi(2),
            ..*ray
        }
    }
}

impl<R> Inside<R> {
    /// Returns the point of the interface to which a step of Newton's method leads; `None` if the
    /// step is not finite.
    fn next(&self, guess: &WallGuess<R>, n_far: f64) -> Option<DVec3> {
        let (p, node) = (self.crossing.position, &self.node);
        let to_outer = guess.outer - p;
        let distance = to_outer.length();
        let e = to_outer / distance;
        let g = node.v - e * n_far;
        // Compute the change of v with p from the neighbouring rays, at equal σ, and from the ray
        // itself.
        let [a, b] = node.variation.dx;
        let places = DMat3::from_cols(a, b, node.v);
        let [da, db] = node.variation.dv;
        let inner = DMat3::from_cols(da, db, node.a) * places.inverse();
        let basis = perpendicular_basis(self.normal);
        let curvature = g.dot(self.crossing.normal);
        let change = |t: DVec3| {
            let outer = (t - e * e.dot(t)) * (n_far / distance);
            inner * t + outer - self.crossing.shape * t * curvature
        };
        let column = |t: DVec3| {
            let change = change(t);
            DVec2::new(basis[0].dot(change), basis[1].dot(change))
        };
        let hessian = DMat2::from_cols(column(basis[0]), column(basis[1]));
        let step = hessian.inverse() * DVec2::new(-basis[0].dot(g), -basis[1].dot(g));
        let longest = MAX_STEP * p.distance(guess.inner);
        let step = step.clamp_length_max(longest);
        step.is_finite()
            .then(|| p + basis[0] * step.x + basis[1] * step.y)
    }
}
