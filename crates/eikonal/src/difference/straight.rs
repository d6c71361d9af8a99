//! A segment of a ray against the straight ray in a constant index that connects its ends.
//!
//! Let S = ∫n² dσ be the optical length of a ray, c the length and u the unit direction of the
//! chord between its ends. As c = ∫v·u dσ,
//!
//! ```text
//! S − n_r c = ½ ∫ [(n² − n_r²) + |v − n_r u|²] dσ        (|v|² = n² on the ray)
//! ```
//!
//! Nothing cancels here: both terms are as small as the contrast
//! (docs/theory.md#optical-path-difference).

use super::quadrature::{Integrand, Quadrature};
use crate::field::Field;
use crate::ray::Arc;
use glam::DVec3;

/// Part of a ray since its start or its last reflection. Here w = v − n_r e, for the unit direction
/// e in which the ray started.
#[derive(Clone, Copy, Debug)]
pub(super) struct StraightSegment {
    n_ref: f64,
    /// Unit direction e.
    toward: DVec3,
    /// Integral ∫ (n² − n_r² + |w|²) dσ.
    action: f64,
    /// Integral ∫ w dσ.
    drift: DVec3,
    /// Integral ∫ dσ.
    span: f64,
}

impl StraightSegment {
    pub(super) fn new(n_ref: f64, toward: DVec3) -> Self {
        StraightSegment {
            n_ref,
            toward,
            action: 0.0,
            drift: DVec3::ZERO,
            span: 0.0,
        }
    }

    /// Starts the segment of a reflected ray.
    pub(super) fn reflected(&self, toward: DVec3) -> Self {
        StraightSegment::new(self.n_ref, toward)
    }

    /// Returns S − n_r c. With the chord's direction u = e + t, ∫|v − n_r u|² = ∫|w|² − 2n_r t·∫w +
    /// n_r²|t|²∫dσ.
    pub(super) fn value(&self) -> f64 {
        let n_ref = self.n_ref;
        let chord = self.toward * (n_ref * self.span) + self.drift;
        let length = chord.length();
        if length == 0.0 {
            return 0.5 * self.action;
        }
        let t = (chord - self.toward * length) / length;
        let turned = n_ref * n_ref * t.length_squared() * self.span;
        0.5 * (self.action - 2.0 * n_ref * t.dot(self.drift) + turned)
    }

    pub(super) fn add(
        &mut self,
        field: &Field,
        arc: &Arc,
        [from, to]: [f64; 2],
        quadrature: &mut Quadrature,
    ) {
        let e = self.toward * self.n_ref;
        let n2_ref = self.n_ref * self.n_ref;
        self.span += (to - from) * arc.h();
        if arc.is_straight() {
            // Use the closed form where the index is constant.
            let (span, w) = ((to - from) * arc.h(), arc.velocity(from) - e);
            let contrast = field.n2(arc.position(from)) - n2_ref;
            quadrature.meet(contrast);
            self.action += (contrast + w.length_squared()) * span;
            self.drift += w * span;
            return;
        }
        quadrature.subtract(n2_ref);
        let moved = arc.position(to) - arc.position(from);
        self.drift += moved - e * ((to - from) * arc.h());
        let width = |theta| field.resolved_span(arc.position(theta), arc.velocity(theta)) / arc.h();
        let integrand = |theta| Integrand {
            // Planted error "the index along a ray taken from its speed in optical path differences", found by morgana-eikonal/eikonal::path_difference::weak_columns_have_the_integral_of_their_contrast:
            // contrast: arc.velocity(theta).length_squared() - n2_ref,
            contrast: field.n2(arc.position(theta)) - n2_ref,
            rest: (arc.velocity(theta) - e).length_squared(),
        };
        self.action += arc.h() * quadrature.integrate([from, to], width, integrand);
    }
}
