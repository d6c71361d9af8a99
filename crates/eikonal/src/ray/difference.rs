//! Optical path differences: how much longer, or shorter, a ray is than straight rays in a constant index.
//!
//! With S = ∫n² dσ the optical length of a ray, c and u the length and the unit direction of the chord of its ends, and
//! c = ∫v·u dσ,
//!
//! ```text
//! S − n_r c = ½ ∫ [(n² − n_r²) + |v − n_r u|²] dσ        (|v|² = n² on the ray)
//! ```
//!
//! Nothing cancels here: both terms are as small as the contrast. The right-hand side is Hamilton's action less that
//! of the reference ray, hence stationary in the path between the ends: an error of the path counts in second
//! order only. Steps are chosen for positions, and in weak fields are far longer than what the contrast varies
//! over, so the integral has an error control of its own.
//!
//! Theory: docs/theory.md#optical-path-difference.

use super::arc::Arc;
use super::flow::Work;
use crate::field::Field;
use glam::DVec3;

/// Nodes of the quadrature of Kronrod with 15 points on [−1, 1], from the end to the middle. Every second is one of Gauss's
/// with 7 points.
const NODES: [f64; 8] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
    0.0,
];
/// Kronrod's weights.
const KRONROD: [f64; 8] = [
    0.022_935_322_010_529_224,
    0.063_092_092_629_978_56,
    0.104_790_010_322_250_18,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_9,
    0.209_482_141_084_727_82,
];
/// Gauss's weights, of every second node.
const GAUSS: [f64; 4] = [
    0.129_484_966_168_869_7,
    0.279_705_391_489_276_64,
    0.381_830_050_505_118_9,
    0.417_959_183_673_469_4,
];
/// Evaluations of a panel.
const POINTS: u64 = 15;
/// Difference of the two quadratures over a panel at which it is accepted, relative to the largest contrast so far: that of
/// Kronrod is an order of magnitude better.
const TOLERANCE: f64 = 1e-6;
/// Panels are halved at most so often.
const MOST_HALVINGS: u32 = 12;
/// No panel is a smaller part of an arc, lest a field without any scale take for ever.
const LEAST_PANEL: f64 = 1e-6;

/// The optical path difference of a ray, arc by arc: its optical length less that of straight rays in a constant index
/// that join its start, the points where it was reflected, and its end.
///
/// The error is about 1e-7 of the largest contrast |n − n_r| on the way times the length, whatever the tolerance of
/// the ray, and rounding, 2e-16 of the length.
#[derive(Clone, Copy, Debug)]
pub struct PathDifference {
    n_ref: f64,
    /// Of the legs that have ended.
    done: f64,
    leg: Leg,
    /// Largest |n² − n_r²| so far.
    contrast: f64,
}

/// A ray since its start or its last reflection. `w` is v − n_r e for the unit direction e in which it started.
#[derive(Clone, Copy, Debug)]
struct Leg {
    /// e.
    toward: DVec3,
    /// ∫ (n² − n_r² + |w|²) dσ.
    action: f64,
    /// ∫ w dσ.
    drift: DVec3,
    /// ∫ dσ.
    span: f64,
}

impl Leg {
    fn new(toward: DVec3) -> Self {
        Leg {
            toward,
            action: 0.0,
            drift: DVec3::ZERO,
            span: 0.0,
        }
    }

    /// S − n_r c. With the chord's direction u = e + t, ∫|v − n_r u|² = ∫|w|² − 2n_r t·∫w + n_r²|t|²∫dσ.
    fn difference(&self, n_ref: f64) -> f64 {
        let chord = self.toward * (n_ref * self.span) + self.drift;
        let length = chord.length();
        if length == 0.0 {
            return 0.5 * self.action;
        }
        let t = (chord - self.toward * length) / length;
        let turned = n_ref * n_ref * t.length_squared() * self.span;
        0.5 * (self.action - 2.0 * n_ref * t.dot(self.drift) + turned)
    }
}

impl PathDifference {
    /// Of a ray that starts in the unit direction `toward`, against the index `n_ref` > 0.
    pub fn new(n_ref: f64, toward: DVec3) -> Self {
        PathDifference {
            n_ref,
            done: 0.0,
            leg: Leg::new(toward),
            contrast: 0.0,
        }
    }

    /// So far, in units of length.
    pub fn value(&self) -> f64 {
        self.done + self.leg.difference(self.n_ref)
    }

    /// The ray is reflected into the unit direction `toward`, and so are those of the reference.
    pub fn reflect(&mut self, toward: DVec3) {
        self.done = self.value();
        self.leg = Leg::new(toward);
    }

    /// Adds the part of an arc in `field` between two θ.
    pub fn add(&mut self, field: &Field, arc: &Arc, [from, to]: [f64; 2], work: &mut Work) {
        let e = self.leg.toward * self.n_ref;
        self.leg.span += (to - from) * arc.h();
        if arc.is_straight() {
            // Where the index does not change.
            let (span, w) = ((to - from) * arc.h(), arc.velocity(from) - e);
            let contrast = field.n2(arc.position(from)) - self.n_ref * self.n_ref;
            self.contrast = self.contrast.max(contrast.abs());
            self.leg.action += (contrast + w.length_squared()) * span;
            self.leg.drift += w * span;
            return;
        }
        let moved = arc.position(to) - arc.position(from);
        self.leg.drift += moved - e * ((to - from) * arc.h());
        let mut at = from;
        while at < to {
            let span = field.resolved_span(arc.position(at), arc.velocity(at));
            let width = (span / arc.h()).max(LEAST_PANEL * (to - from));
            let end = (at + width).min(to);
            let panel = self.panel(field, arc, [at, end], MOST_HALVINGS, work);
            self.leg.action += panel * arc.h();
            at = end;
        }
    }

    /// ∫ (n² − n_r² + |w|²) dθ.
    fn panel(
        &mut self,
        field: &Field,
        arc: &Arc,
        [from, to]: [f64; 2],
        halvings: u32,
        work: &mut Work,
    ) -> f64 {
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        let n2_ref = self.n_ref * self.n_ref;
        let e = self.leg.toward * self.n_ref;
        let mut at = |theta: f64| {
            let contrast = field.n2(arc.position(theta)) - n2_ref;
            self.contrast = self.contrast.max(contrast.abs());
            contrast + (arc.velocity(theta) - e).length_squared()
        };
        let (mut kronrod, mut gauss) = (0.0, 0.0);
        for (i, node) in NODES.into_iter().enumerate() {
            let value = match node {
                0.0 => at(middle),
                _ => at(middle - half * node) + at(middle + half * node),
            };
            kronrod += KRONROD[i] * value;
            if i % 2 == 1 {
                gauss += GAUSS[i / 2] * value;
            }
        }
        work.evaluations += POINTS;
        // What is not finite does not become so by halving.
        let poor = (kronrod - gauss).abs() > TOLERANCE * self.contrast;
        if !poor || halvings == 0 {
            return kronrod * half;
        }
        let below = self.panel(field, arc, [from, middle], halvings - 1, work);
        below + self.panel(field, arc, [middle, to], halvings - 1, work)
    }
}
