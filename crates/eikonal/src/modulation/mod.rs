//! What sound does to optical lengths of arcs, to first order in the sound, with an error control of its own (docs/theory.md#tagged-light).

mod panel;
mod rule;

pub use panel::ModulationPanel;

use crate::field::{Modulation, SoundAmplitude};
use crate::ray::Arc;
use glam::DVec2;
use panel::{Node, Panel};
use rule::{RULES, Rule, TABULATED};

/// Where there is less than this share of the largest modulation, accuracy is relative to that.
const FAINT: f64 = 1e-3;
/// Panels are halved at most so often.
const MOST_HALVINGS: u32 = 12;
/// The longest arc, in wavelengths of the sound: more than a second takes. A sound that needs more is too fine for the way.
const LONGEST: f64 = 5e5;

/// What panels are for.
#[derive(Clone, Copy)]
enum Purpose {
    /// The modulation of the whole length.
    Total,
    /// And up to every place.
    Within,
}

impl Purpose {
    /// The rule with the fewest nodes, and the fewest panels, for an arc of a length in wavelengths of the sound.
    fn rule(self, wavelengths: f64) -> (&'static Rule, u64) {
        let (rules, longest): (&'static [Rule], fn(&Rule) -> f64) = match self {
            Purpose::Total => (&RULES, |rule| rule.longest),
            Purpose::Within => (&RULES[..TABULATED], |rule| rule.longest_within),
        };
        let enough = |panels: f64| {
            rules
                .iter()
                .find(|rule| wavelengths <= panels * longest(rule))
        };
        if let Some(rule) = enough(1.0) {
            return (rule, 1);
        }
        let finest = &rules[rules.len() - 1];
        let panels = (wavelengths / longest(finest)).ceil();
        (enough(panels).unwrap_or(finest), panels as u64)
    }
}

impl Modulation {
    /// The amplitude of the optical length of the part of an arc between two θ: ∫ n̂ ds = ½ ∫ m dσ along it, where `ends` are the amplitudes
    /// at its ends. The error is below 1e-4 of the largest |m| on a panel, of at most two wavelengths, times its length; NaN if the sound is too
    /// fine for the length of the arc.
    pub fn along(&self, arc: &Arc, range: [f64; 2], ends: &[SoundAmplitude; 2]) -> DVec2 {
        self.panels(arc, range, ends, Purpose::Total, |_, _| ())
    }

    /// The same, and the panels in turn, by which it is known up to every place between: within a panel to 1e-3 of the largest |m| there times its
    /// length.
    pub fn tabulate(
        &self,
        arc: &Arc,
        range: [f64; 2],
        ends: &[SoundAmplitude; 2],
        mut see: impl FnMut(ModulationPanel),
    ) -> DVec2 {
        self.panels(arc, range, ends, Purpose::Within, |before, panel| {
            see(panel.tabulated(before, arc));
        })
    }

    /// The amplitude along a part of an arc; `see` gets that before each panel, and the panel.
    fn panels(
        &self,
        arc: &Arc,
        [from, to]: [f64; 2],
        ends: &[SoundAmplitude; 2],
        purpose: Purpose,
        mut see: impl FnMut(DVec2, &Panel),
    ) -> DVec2 {
        let wavelengths = longest(arc, [from, to]) * self.per_wavelength;
        if !(0.0..LONGEST).contains(&wavelengths) {
            return DVec2::NAN;
        }
        let (rule, panels) = purpose.rule(wavelengths);
        let (mut sum, mut start) = (DVec2::ZERO, Node::new(arc, from, &ends[0]));
        for i in 1..=panels {
            let end = if i == panels {
                Node::new(arc, to, &ends[1])
            } else {
                self.node(arc, from + (to - from) * (i as f64 / panels as f64))
            };
            self.panel(arc, rule, [start, end], MOST_HALVINGS, &mut |panel| {
                see(0.5 * arc.h() * sum, panel);
                sum += panel.integral;
            });
            start = end;
        }
        0.5 * arc.h() * sum
    }

    fn node(&self, arc: &Arc, theta: f64) -> Node {
        Node::new(arc, theta, &self.at(arc.position(theta)))
    }

    /// A panel by a rule, if m is as smooth along it as a wave of the sound's length is; else finer ones.
    #[inline]
    fn panel(
        &self,
        arc: &Arc,
        rule: &'static Rule,
        ends: [Node; 2],
        halvings: u32,
        see: &mut impl FnMut(&Panel),
    ) {
        let [start, end] = ends;
        let mut inner = [DVec2::ZERO; rule::MOST_INNER];
        for (value, share) in inner.iter_mut().zip(rule.inner) {
            let theta = start.theta + share * (end.theta - start.theta);
            *value = self.value(arc.position(theta));
        }
        let panel = Panel::new(ends, inner, rule);
        if halvings == 0 || panel.is_smooth(FAINT * self.largest) {
            see(&panel);
        } else {
            self.finer(arc, rule, ends, halvings, see);
        }
    }

    /// The panel with an inner value, or its halves.
    #[cold]
    fn finer(
        &self,
        arc: &Arc,
        rule: &'static Rule,
        ends: [Node; 2],
        halvings: u32,
        see: &mut impl FnMut(&Panel),
    ) {
        if rule.inner.is_empty() {
            return self.panel(arc, &RULES[1], ends, halvings, see);
        }
        let [start, end] = ends;
        let middle = self.node(arc, 0.5 * (start.theta + end.theta));
        self.panel(arc, rule, [start, middle], halvings - 1, see);
        self.panel(arc, rule, [middle, end], halvings - 1, see);
    }
}

/// The length of a part of an arc, or an upper bound of it but for what its curvature adds.
fn longest(arc: &Arc, [from, to]: [f64; 2]) -> f64 {
    if arc.is_straight() {
        return arc.arc_length(to) - arc.arc_length(from);
    }
    let [first, last] = [from, to].map(|theta| arc.derivative(theta).length_squared());
    (to - from) * first.max(last).sqrt()
}
