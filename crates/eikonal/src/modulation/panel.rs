//! Parts of an arc along which the modulation of the optical length is known.

use super::rule::{MOST_INNER, Rule};
use crate::field::SoundAmplitude;
use crate::ray::Arc;
use glam::DVec2;

/// Coefficients of the polynomial through the values on a panel, and the derivatives at its ends.
const COEFFICIENTS: usize = MOST_INNER + 4;

/// A part of an arc along which the modulation of its optical length is known at every place.
#[derive(Clone, Copy, Debug)]
pub struct ModulationPanel {
    /// θ where it starts and ends.
    range: [f64; 2],
    /// Amplitude of the optical length from the start of the arc's part to that of the panel.
    before: DVec2,
    /// ½h dθ: what m is multiplied by.
    scale: f64,
    /// m as a polynomial of the share of the panel.
    coefficients: [DVec2; COEFFICIENTS],
}

/// m at the places of a quadrature on a part of an arc.
pub(super) struct Panel {
    pub ends: [Node; 2],
    /// At inner places.
    pub inner: [DVec2; MOST_INNER],
    pub rule: &'static Rule,
}

/// m and dm/dθ at a θ.
#[derive(Clone, Copy)]
pub(super) struct Node {
    pub theta: f64,
    value: DVec2,
    slope: DVec2,
}

impl Node {
    pub(super) fn new(arc: &Arc, theta: f64, amplitude: &SoundAmplitude) -> Self {
        let v = arc.velocity(theta) * arc.h();
        let [re, im] = amplitude.gradient;
        Node {
            theta,
            value: amplitude.n2,
            slope: DVec2::new(re.dot(v), im.dot(v)),
        }
    }
}

impl Panel {
    fn width(&self) -> f64 {
        self.ends[1].theta - self.ends[0].theta
    }

    fn of_inner(&self, weights: &[f64]) -> DVec2 {
        let terms = self.inner.iter().zip(weights);
        terms.map(|(value, weight)| *value * *weight).sum()
    }

    /// ∫ m dθ.
    pub(super) fn integral(&self) -> DVec2 {
        let [start, end] = &self.ends;
        let slopes = (start.slope - end.slope) * (self.rule.slopes * self.width());
        let ends = (start.value + end.value) * self.rule.ends;
        (ends + slopes + self.of_inner(self.rule.weights)) * self.width()
    }

    /// Whether m is as smooth as its rule takes for granted, of |m| or of the least that counts. What is not finite does not become so.
    pub(super) fn is_smooth(&self, least: f64) -> bool {
        let [start, end] = &self.ends;
        let inner = &self.inner[..self.rule.inner.len()];
        let met = inner.iter().chain([&start.value, &end.value]);
        let scale = met
            .map(|m| m.length_squared())
            .fold(least * least, f64::max);
        let plain = (start.value + end.value) * self.rule.plain_ends
            + self.of_inner(self.rule.plain_weights);
        let off = self.integral() - plain * self.width();
        let rough = off.length_squared() > scale * (self.rule.allowed * self.width()).powi(2);
        !rough
    }

    /// By divided differences (Newton), where both ends count twice.
    pub(super) fn tabulated(&self, before: DVec2, arc: &Arc) -> ModulationPanel {
        let [start, end] = &self.ends;
        let (width, inner) = (self.width(), self.rule.inner);
        let count = inner.len() + 4;
        let (mut places, mut differences) = ([0.0; COEFFICIENTS], [start.value; COEFFICIENTS]);
        for (i, share) in inner.iter().enumerate() {
            (places[i + 2], differences[i + 2]) = (*share, self.inner[i]);
        }
        for i in count - 2..count {
            (places[i], differences[i]) = (1.0, end.value);
        }
        for order in 1..count {
            for i in (order..count).rev() {
                let step = places[i] - places[i - order];
                differences[i] = match (step > 0.0, i) {
                    (true, _) => (differences[i] - differences[i - 1]) / step,
                    (false, 1) => start.slope * width,
                    (false, _) => end.slope * width,
                };
            }
        }
        // From products of (x − place) to powers of x.
        let mut coefficients = [DVec2::ZERO; COEFFICIENTS];
        for i in (0..count).rev() {
            for j in (1..count).rev() {
                coefficients[j] = coefficients[j - 1] - coefficients[j] * places[i];
            }
            coefficients[0] = differences[i] - coefficients[0] * places[i];
        }
        ModulationPanel {
            range: [start.theta, end.theta],
            before,
            scale: 0.5 * arc.h() * width,
            coefficients,
        }
    }
}

impl ModulationPanel {
    /// θ where it ends.
    pub fn end(&self) -> f64 {
        self.range[1]
    }

    /// The amplitude of the optical length from the start of the arc's part to a θ on the panel.
    pub fn until(&self, theta: f64) -> DVec2 {
        let [from, to] = self.range;
        let share = ((theta - from) / (to - from)).clamp(0.0, 1.0);
        let terms = self.coefficients.iter().enumerate().rev();
        let mean = terms.fold(DVec2::ZERO, |sum, (power, c)| {
            sum * share + *c / (power as f64 + 1.0)
        });
        self.before + self.scale * share * mean
    }
}
