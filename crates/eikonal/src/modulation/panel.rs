//! Parts of an arc along which the modulation of the optical length is known.

use super::rule::{COEFFICIENTS, MAX_INNER, Rule};
use crate::field::SoundAmplitude;
use crate::ray::Arc;
use glam::DVec2;

/// A part of an arc along which the modulation of its optical length is known at every place.
#[derive(Clone, Copy, Debug)]
pub struct ModulationPanel {
    /// Start and end of the panel in θ.
    range: [f64; 2],
    /// Amplitude of the optical length from the start of the arc's part to the start of the panel.
    before: DVec2,
    /// Reciprocal width of the range.
    per_range: f64,
    /// Polynomial in the fraction of the panel: the amplitude added since the panel's start,
    /// divided by this fraction.
    coefficients: [DVec2; COEFFICIENTS],
}

/// Values of m at the places of a quadrature on a part of an arc.
pub(super) struct Panel {
    pub ends: [Node; 2],
    /// Values at inner places, padded with zeros.
    pub inner: [DVec2; MAX_INNER],
    pub rule: &'static Rule,
    /// Integral ∫ m dθ.
    pub integral: DVec2,
}

/// Values of m and dm/dθ at a θ.
#[derive(Clone, Copy)]
pub(super) struct Node {
    pub theta: f64,
    value: DVec2,
    slope: DVec2,
}

impl Node {
    pub(super) fn new(arc: &Arc, theta: f64, amplitude: &SoundAmplitude) -> Self {
        let v = arc.derivative(theta);
        let [re, im] = amplitude.gradient;
        Node {
            theta,
            value: amplitude.n2,
            slope: DVec2::new(re.dot(v), im.dot(v)),
        }
    }
}

impl Panel {
    #[inline]
    pub(super) fn new(ends: [Node; 2], inner: [DVec2; MAX_INNER], rule: &'static Rule) -> Self {
        let [start, end] = &ends;
        let width = end.theta - start.theta;
        let slopes = (start.slope - end.slope) * (rule.slopes * width);
        let of_ends = (start.value + end.value) * rule.ends;
        let integral = (of_ends + slopes + weighted(&inner, &rule.weights)) * width;
        Panel {
            ends,
            inner,
            rule,
            integral,
        }
    }

    fn width(&self) -> f64 {
        self.ends[1].theta - self.ends[0].theta
    }

    /// Returns true if m is as smooth as its rule requires, relative to the largest |m| or to
    /// `least`. Values that are not finite count as smooth, because refinement would not help.
    #[inline]
    pub(super) fn is_smooth(&self, least: f64) -> bool {
        let [start, end] = &self.ends;
        let met = self.inner.iter().chain([&start.value, &end.value]);
        let scale = met
            .map(|m| m.length_squared())
            .fold(least * least, f64::max);
        let plain = (start.value + end.value) * self.rule.plain_ends
            + weighted(&self.inner, &self.rule.plain_weights);
        let off = self.integral - plain * self.width();
        let rough = off.length_squared() > scale * (self.rule.allowed * self.width()).powi(2);
        !rough
    }

    /// Tabulates the panel by the polynomials of its rule.
    #[inline]
    pub(super) fn tabulated(&self, before: DVec2, arc: &Arc) -> ModulationPanel {
        let ([start, end], width) = (&self.ends, self.width());
        let [first, second, _] = self.inner;
        let known = [
            start.value,
            start.slope * width,
            end.value,
            end.slope * width,
            first,
            second,
        ];
        // Scale by ∫ n̂ ds = ½ ∫ m dσ.
        let scale = 0.5 * arc.h() * width;
        let mut coefficients = [DVec2::ZERO; COEFFICIENTS];
        for (value, powers) in known.iter().zip(&self.rule.within) {
            let value = *value * scale;
            for (coefficient, power) in coefficients.iter_mut().zip(powers) {
                *coefficient += value * *power;
            }
        }
        ModulationPanel {
            range: [start.theta, end.theta],
            before,
            per_range: 1.0 / width,
            coefficients,
        }
    }
}

/// Returns the weighted sum of values.
#[inline]
fn weighted([a, b, c]: &[DVec2; MAX_INNER], weights: &[f64; MAX_INNER]) -> DVec2 {
    *a * weights[0] + *b * weights[1] + *c * weights[2]
}

impl ModulationPanel {
    /// Returns the θ at the end of the panel.
    pub fn end(&self) -> f64 {
        self.range[1]
    }

    /// Returns the amplitude of the optical length from the start of the arc's part to a θ on the
    /// panel.
    pub fn until(&self, theta: f64) -> DVec2 {
        let share = ((theta - self.range[0]) * self.per_range).clamp(0.0, 1.0);
        let square = share * share;
        // Evaluate even and odd powers separately, so that neither waits for the other.
        let [even, odd] = [0, 1].map(|first| {
            let terms = self.coefficients[first..].iter().step_by(2);
            terms.rev().fold(DVec2::ZERO, |sum, c| sum * square + *c)
        });
        // Planted error "modulations along a panel without those before it", found by morgana-eikonal/eikonal::modulation::integrals_along_arcs_are_those_of_fine_sums:
        // share * (even + share * odd)
        self.before + share * (even + share * odd)
    }
}
