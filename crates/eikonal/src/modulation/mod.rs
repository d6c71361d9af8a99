//! Modulation of optical lengths of arcs by sound, to first order in the sound, with its own error
//! control (docs/theory.md#tagged-light).

mod panel;
mod rule;

pub use panel::ModulationPanel;

use crate::field::{Modulation, SoundAmplitude};
use crate::ray::Arc;
use glam::{DVec2, DVec3};
use panel::{Node, Panel};
use rule::{MAX_INNER, RULES, Rule, TABULATED_RULES};

/// Smallest modulation to which the accuracy is relative, as a fraction of the largest modulation.
const MIN_RELATIVE_MODULATION: f64 = 1e-3;
/// Maximum number of times that a panel is halved.
const MAX_HALVINGS: u32 = 12;
/// Longest arc, in wavelengths of the sound. Such an arc takes more than a second of computation.
const MAX_ARC_LENGTH: f64 = 5e5;

/// Purpose of panels.
#[derive(Clone, Copy)]
enum Purpose {
    /// Modulation over the whole length.
    Total,
    /// Modulation over the whole length and up to every place.
    Within,
}

impl Purpose {
    /// Returns the rules, and the function that returns their longest panel.
    #[inline]
    fn rules(self) -> (&'static [Rule], fn(&Rule) -> f64) {
        match self {
            Purpose::Total => (&RULES, |rule| rule.longest),
            Purpose::Within => (&RULES[..TABULATED_RULES], |rule| rule.longest_within),
        }
    }

    /// Returns the rule with the fewest nodes for one panel of a length in wavelengths of the
    /// sound; `None` if the panel is too long.
    #[inline]
    fn rule(self, wavelengths: f64) -> Option<&'static Rule> {
        let (rules, longest) = self.rules();
        // Count without branches: lengths are random, and branches would be mispredicted.
        let suffices = |rule| usize::from(wavelengths <= longest(rule));
        let few = rules.len() - rules.iter().map(suffices).sum::<usize>();
        rules.get(few)
    }

    /// Returns the smallest number of panels for an arc, and the rule with the fewest nodes for
    /// these panels. `wavelengths` is the length of the arc in wavelengths of the sound.
    fn panels(self, wavelengths: f64) -> (&'static Rule, u64) {
        if let Some(rule) = self.rule(wavelengths) {
            return (rule, 1);
        }
        let (rules, longest) = self.rules();
        let finest = &rules[rules.len() - 1];
        let panels = (wavelengths / longest(finest)).ceil();
        let rule = self.rule(wavelengths / panels).unwrap_or(finest);
        (rule, panels as u64)
    }
}

/// A quadrature for a part of an arc.
#[derive(Clone, Copy, Debug)]
pub struct ModulationQuadrature(&'static Rule);

impl ModulationQuadrature {
    /// Maximum number of places between the ends of a part.
    pub const MAX_PLACES: usize = MAX_INNER;

    /// Returns the places between the ends of the part at which the quadrature needs values of the
    /// sound, and the number of valid places.
    #[inline]
    pub fn places(self, arc: &Arc, [from, to]: [f64; 2]) -> ([DVec3; MAX_INNER], usize) {
        let place = |share| arc.position(from + share * (to - from));
        (self.0.inner.map(place), self.0.inner_count)
    }
}

impl Modulation {
    /// Returns the amplitude of the optical length of the part of an arc between two θ, ∫ n̂ ds = ½
    /// ∫ m dσ. `ends` are the amplitudes at its ends. On each panel, of at most two wavelengths,
    /// the error is below 1e-4 of the largest |m| times the panel's length. For noise finer than
    /// the sound, the error is of the order of the noise. Returns NaN if the sound is too fine for
    /// the length of the arc.
    pub fn along(&self, arc: &Arc, range: [f64; 2], ends: &[SoundAmplitude; 2]) -> DVec2 {
        self.panels(arc, range, ends, Purpose::Total, |_, _| ())
    }

    /// Returns the quadrature by which [`Modulation::along`] computes the modulation of a part of
    /// an arc. With the quadrature, values of the sound for many parts can be computed together.
    /// `None` if the part is too long, and must be divided.
    #[inline]
    pub fn quadrature(&self, arc: &Arc, range: [f64; 2]) -> Option<ModulationQuadrature> {
        let wavelengths = length_estimate(arc, range) * self.per_wavelength;
        Purpose::Total.rule(wavelengths).map(ModulationQuadrature)
    }

    /// Computes [`Modulation::along`] with a quadrature for this part of the arc and the
    /// [values](Modulation::value) at its [places](ModulationQuadrature::places), zero at invalid
    /// places.
    #[inline]
    pub fn along_by(
        &self,
        quadrature: ModulationQuadrature,
        arc: &Arc,
        [from, to]: [f64; 2],
        ends: [&SoundAmplitude; 2],
        values: &[DVec2; MAX_INNER],
    ) -> DVec2 {
        let ends = [Node::new(arc, from, ends[0]), Node::new(arc, to, ends[1])];
        let panel = Panel::new(ends, *values, quadrature.0);
        let mut sum = DVec2::ZERO;
        let mut add = |panel: &Panel| sum += panel.integral;
        self.accept(arc, &panel, MAX_HALVINGS, &mut add);
        0.5 * arc.h() * sum
    }

    /// Computes [`Modulation::along`], and passes the panels in turn to `see`. Within a panel they
    /// give the modulation up to every place, to 1e-3 of the largest |m| there times the panel's
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

    /// Computes the amplitude along a part of an arc; `see` receives the amplitude before each
    /// panel, and the panel.
    fn panels(
        &self,
        arc: &Arc,
        [from, to]: [f64; 2],
        ends: &[SoundAmplitude; 2],
        purpose: Purpose,
        mut see: impl FnMut(DVec2, &Panel),
    ) -> DVec2 {
        let wavelengths = length_estimate(arc, [from, to]) * self.per_wavelength;
        // The estimate may be negative by rounding.
        if !(-MAX_ARC_LENGTH..MAX_ARC_LENGTH).contains(&wavelengths) {
            return DVec2::NAN;
        }
        let (rule, panels) = purpose.panels(wavelengths);
        let (mut sum, mut start) = (DVec2::ZERO, Node::new(arc, from, &ends[0]));
        for i in 1..=panels {
            let end = if i == panels {
                Node::new(arc, to, &ends[1])
            } else {
                self.node(arc, from + (to - from) * (i as f64 / panels as f64))
            };
            self.panel(arc, rule, [start, end], MAX_HALVINGS, &mut |panel| {
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

    /// Integrates a panel by a rule if m is as smooth along it as a wave of the sound's length,
    /// otherwise finer panels.
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
        let mut inner = [DVec2::ZERO; MAX_INNER];
        let shares = &rule.inner[..rule.inner_count];
        for (value, share) in inner.iter_mut().zip(shares) {
            let theta = start.theta + share * (end.theta - start.theta);
            *value = self.value(arc.position(theta));
        }
        self.accept(arc, &Panel::new(ends, inner, rule), halvings, see);
    }

    /// Accepts a panel if it is smooth, otherwise refines it.
    #[inline]
    fn accept(&self, arc: &Arc, panel: &Panel, halvings: u32, see: &mut impl FnMut(&Panel)) {
        if halvings == 0 || panel.is_smooth(MIN_RELATIVE_MODULATION * self.largest) {
            see(panel);
        } else {
            self.finer(arc, panel.rule, panel.ends, halvings, see);
        }
    }

    /// Refines a panel: adds an inner value, or halves the panel.
    #[cold]
    fn finer(
        &self,
        arc: &Arc,
        rule: &'static Rule,
        ends: [Node; 2],
        halvings: u32,
        see: &mut impl FnMut(&Panel),
    ) {
        if rule.inner_count == 0 {
            return self.panel(arc, &RULES[1], ends, halvings, see);
        }
        let [start, end] = ends;
        let middle = self.node(arc, 0.5 * (start.theta + end.theta));
        self.panel(arc, rule, [start, middle], halvings - 1, see);
        self.panel(arc, rule, [middle, end], halvings - 1, see);
    }
}

/// Estimates the length of a part of an arc, by the larger of the speeds at its ends; exact if the
/// arc is straight.
fn length_estimate(arc: &Arc, [from, to]: [f64; 2]) -> f64 {
    if arc.is_straight() {
        return arc.arc_length(to) - arc.arc_length(from);
    }
    let [first, last] = [from, to].map(|theta| arc.derivative(theta).length_squared());
    (to - from) * first.max(last).sqrt()
}
