//! What sound does to optical lengths of arcs, to first order in the sound, with an error control of its own (docs/theory.md#tagged-light).

use crate::field::{Modulation, SoundAmplitude};
use crate::ray::Arc;
use glam::DVec2;

/// A panel is accepted if two quadratures over it differ by less than this share of the modulation there: that which is taken is then
/// two orders of magnitude better.
const TOLERANCE: f64 = 1e-2;
/// Where there is less than this share of the largest modulation, accuracy is relative to that.
const FAINT: f64 = 1e-3;
/// No panel is longer than so many wavelengths of the sound, so that it is seen.
const LONGEST_PANEL: f64 = 0.5;
/// Panels are halved at most so often.
const MOST_HALVINGS: u32 = 12;
/// Most panels along one arc, before they are halved: more than a second takes. A sound that needs more is too fine for the way.
const MOST_PANELS: f64 = 1e6;

impl Modulation {
    /// The amplitude of the optical length of the part of an arc between two θ: ∫ n̂ ds = ½ ∫ m dσ along it, where `ends` are the amplitudes
    /// at its ends. The error is below 1e-4 of the largest |m| on a panel of half a wavelength times its length; NaN if the sound is too fine
    /// for the length of the arc.
    pub fn along(&self, arc: &Arc, [from, to]: [f64; 2], ends: &[SoundAmplitude; 2]) -> DVec2 {
        let panels = (to - from) * arc.arc_length(1.0) / (LONGEST_PANEL * self.wavelength);
        if !(0.0..MOST_PANELS).contains(&panels) {
            return DVec2::NAN;
        }
        let panels = panels.ceil().max(1.0);
        let (mut sum, mut start) = (DVec2::ZERO, Node::new(arc, from, &ends[0]));
        for i in 1..=panels as u64 {
            let end = if i as f64 == panels {
                Node::new(arc, to, &ends[1])
            } else {
                self.node(arc, from + (to - from) * (i as f64 / panels))
            };
            sum += self.panel(arc, &start, &end, MOST_HALVINGS);
            start = end;
        }
        0.5 * arc.h() * sum
    }

    fn node(&self, arc: &Arc, theta: f64) -> Node {
        Node::new(arc, theta, &self.at(arc.position(theta)))
    }

    /// ∫ m dθ by values and derivatives at both ends and the value in the middle (exact for quintics), if that of the ends alone is near
    /// enough; else over its halves.
    fn panel(&self, arc: &Arc, start: &Node, end: &Node, halvings: u32) -> DVec2 {
        let middle = self.node(arc, 0.5 * (start.theta + end.theta));
        let width = end.theta - start.theta;
        let turn = (start.slope - end.slope) * width;
        let coarse = 0.5 * (start.value + end.value) + turn / 12.0;
        let fine = (7.0 * (start.value + end.value) + 16.0 * middle.value) / 30.0 + turn / 60.0;
        let met = [start, &middle, end].map(|node| node.value.length());
        let scale = met.into_iter().fold(FAINT * self.largest, f64::max);
        // What is not finite does not become so by halving.
        let poor = (fine - coarse).length() > TOLERANCE * scale;
        if !poor || halvings == 0 {
            return fine * width;
        }
        self.panel(arc, start, &middle, halvings - 1) + self.panel(arc, &middle, end, halvings - 1)
    }
}

/// m and dm/dθ at a θ.
#[derive(Clone, Copy)]
struct Node {
    theta: f64,
    value: DVec2,
    slope: DVec2,
}

impl Node {
    fn new(arc: &Arc, theta: f64, amplitude: &SoundAmplitude) -> Self {
        let v = arc.velocity(theta) * arc.h();
        let [re, im] = amplitude.gradient;
        Node {
            theta,
            value: amplitude.n2,
            slope: DVec2::new(re.dot(v), im.dot(v)),
        }
    }
}
