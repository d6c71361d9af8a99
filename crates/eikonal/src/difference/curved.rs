//! A segment of a ray against the ray in another field that connects its ends.
//!
//! Let γ(σ) be the ray, with span Σ, and y(σ) the reference ray, stretched from its own span ρΣ to
//! the span of γ. With δ = γ − y, and the equation of motion y″ = ½ρ²∇n_r²(y) used on ∫y′·δ′,
//!
//! ```text
//! S − S_r = ½ ∫ [ n²(γ) − n_r²(γ) + n_r²(γ) − n_r²(y) − ρ²∇n_r²(y)·δ + (1 − ρ)² n_r²(y) + |δ′|² ] dσ
//! ```
//!
//! The first two terms are the contrast; all other terms are of second order in it
//! (docs/theory.md#optical-path-difference).

use super::quadrature::{Integrand, Quadrature};
use crate::connect::{InitialGuess, Pattern, Piece, RayFamily, Solver, Unbounded};
use crate::field::Field;
use crate::ray::{Arc, Tolerance, Work};
use glam::DVec3;

/// Tolerance of the reference ray. Its error has a second-order effect.
const TOLERANCE: f64 = 1e-9;

/// Part of a ray since its start or its last reflection.
#[derive(Clone, Debug)]
pub(super) struct CurvedSegment<'a> {
    reference: &'a Field,
    /// Direction in which the ray started.
    toward: DVec3,
    parts: Vec<Part>,
    /// Integral ∫ (n² − n_r²) dσ.
    contrast: f64,
    /// Optical length ∫n ds.
    optical_length: f64,
}

/// A part of an arc between two θ.
#[derive(Clone, Copy, Debug)]
struct Part {
    arc: Arc,
    from: f64,
    to: f64,
    /// Shift of the part's start to the end of the previous part: rays start slightly beyond the
    /// surfaces that they cross.
    shift: DVec3,
    /// Parameter σ at the start of the part.
    sigma: f64,
}

impl Part {
    fn position(&self, theta: f64) -> DVec3 {
        self.arc.position(theta) + self.shift
    }

    fn end(&self) -> DVec3 {
        self.position(self.to)
    }

    /// Returns σ from the start of the segment.
    fn sigma(&self, theta: f64) -> f64 {
        self.sigma + (theta - self.from) * self.arc.h()
    }
}

impl<'a> CurvedSegment<'a> {
    pub(super) fn new(reference: &'a Field, toward: DVec3) -> Self {
        CurvedSegment {
            reference,
            toward,
            parts: Vec::new(),
            contrast: 0.0,
            optical_length: 0.0,
        }
    }

    /// Starts the segment of a reflected ray.
    pub(super) fn reflected(&self, toward: DVec3) -> Self {
        CurvedSegment::new(self.reference, toward)
    }

    pub(super) fn add(
        &mut self,
        field: &Field,
        arc: &Arc,
        [from, to]: [f64; 2],
        quadrature: &mut Quadrature,
    ) {
        let before = self.parts.last();
        let part = Part {
            arc: *arc,
            from,
            to,
            shift: before.map_or(DVec3::ZERO, |part| part.end() - arc.position(from)),
            sigma: before.map_or(0.0, |part| part.sigma(part.to)),
        };
        quadrature.subtract(self.reference.n2(part.position(from)));
        let integrand = |theta| Integrand {
            contrast: field.n2(arc.position(theta)) - self.reference.n2(part.position(theta)),
            rest: 0.0,
        };
        let width = |theta| {
            let (x, v) = (arc.position(theta), arc.velocity(theta));
            field.resolved_span(x, v).min(span_of(self.reference, x, v)) / arc.h()
        };
        self.contrast += arc.h() * quadrature.integrate([from, to], width, integrand);
        self.optical_length += arc.optical_length(to) - arc.optical_length(from);
        self.parts.push(part);
    }

    /// Returns S − S_r; NaN if no reference ray is found.
    pub(super) fn value(&self, quadrature: &mut Quadrature, work: &mut Work) -> f64 {
        let (Some(first), Some(last)) = (self.parts.first(), self.parts.last()) else {
            return 0.0;
        };
        let (x, y) = (first.position(first.from), last.end());
        if x == y || quadrature.is_over_budget() {
            return f64::NAN;
        }
        match self.reference_ray(x, y, work) {
            Some(ray) => {
                let span = last.sigma(last.to);
                0.5 * (self.contrast + self.second_order(&ray, span, quadrature))
            }
            None => f64::NAN,
        }
    }

    /// Finds the reference ray, from the ray itself or else from the chord.
    fn reference_ray(&self, x: DVec3, y: DVec3, work: &mut Work) -> Option<ReferenceRay> {
        let mut solver = Solver::new(Tolerance::new(TOLERANCE));
        let world = Unbounded(self.reference);
        let start = InitialGuess {
            family: RayFamily::Point {
                x,
                direction: self.toward,
            },
            region: (),
            optical_length: self.optical_length,
            pattern: Pattern::REFRACT,
        };
        let near = solver.solve(&world, &start, y);
        let found = near.or_else(|_| solver.connect(&world, x, (), y));
        *work += solver.work;
        found.ok().map(|_| ReferenceRay::new(solver.pieces()))
    }

    /// Returns twice the terms of second order in the contrast.
    fn second_order(&self, ray: &ReferenceRay, span: f64, quadrature: &mut Quadrature) -> f64 {
        let rho = ray.span / span;
        let field = self.reference;
        let mut sum = 0.0;
        for part in &self.parts {
            let integrand = |theta| {
                let (y, v) = ray.at(rho * part.sigma(theta));
                let x = part.position(theta);
                let (delta, turn) = (x - y, part.arc.velocity(theta) - rho * v);
                let jet = field.jet(y);
                // Planted error "reference rays of their own span in optical path differences", found by morgana-eikonal/eikonal::path_difference_field::rods_of_other_strength_have_a_closed_form:
                // let curved = field.n2(x) - jet.n2 - jet.grad.dot(delta);
                let curved = field.n2(x) - jet.n2 - rho * rho * jet.grad.dot(delta);
                let drawn_out = (1.0 - rho) * (1.0 - rho) * jet.n2;
                Integrand {
                    contrast: 0.0,
                    rest: curved + drawn_out + turn.length_squared(),
                }
            };
            let width = |theta| {
                let v = part.arc.velocity(theta);
                span_of(field, part.position(theta), v) / part.arc.h()
            };
            sum += part.arc.h() * quadrature.integrate([part.from, part.to], width, integrand);
        }
        sum
    }
}

/// Returns the span of σ over which a field has no feature that a quadrature with 15 points would
/// miss.
fn span_of(field: &Field, x: DVec3, v: DVec3) -> f64 {
    field
        .resolved_span(x, v)
        .min(field.length_scale(x) / v.length())
}

/// Arcs of a reference ray.
struct ReferenceRay {
    arcs: Vec<Arc>,
    /// Parameter σ at the starts of the arcs.
    starts: Vec<f64>,
    /// Parameter σ at the end.
    span: f64,
}

impl ReferenceRay {
    fn new(pieces: &[Piece<()>]) -> Self {
        let mut span = 0.0;
        let mut starts = Vec::with_capacity(pieces.len());
        for piece in pieces {
            starts.push(span);
            span += piece.theta_end * piece.arc.h();
        }
        let arcs = pieces.iter().map(|piece| piece.arc).collect();
        ReferenceRay { arcs, starts, span }
    }

    /// Returns position and velocity at σ.
    fn at(&self, sigma: f64) -> (DVec3, DVec3) {
        let i = self.starts.partition_point(|start| *start <= sigma).max(1) - 1;
        let arc = &self.arcs[i];
        let theta = (sigma - self.starts[i]) / arc.h();
        (arc.position(theta), arc.velocity(theta))
    }
}
