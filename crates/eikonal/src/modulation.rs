//! What sound does to optical lengths of arcs, to first order in the sound, with an error control of its own (docs/theory.md#tagged-light).

use crate::field::{Modulation, SoundAmplitude};
use crate::ray::Arc;
use glam::DVec2;

/// A panel is accepted if two quadratures over it differ by less than this share of the modulation there: that which is taken is then
/// two orders of magnitude better.
const TOLERANCE: f64 = 1e-2;
/// Where there is less than this share of the largest modulation, accuracy is relative to that.
const FAINT: f64 = 1e-3;
/// The ends alone do for a way of at most so many wavelengths, along which m turns by less than a share of it: errors of fourth order are then
/// below 1e-4 of it.
const SHORT: f64 = 1.0 / 12.0;
const TURN: f64 = 2e-2;
/// No panel is longer than so many wavelengths of the sound, so that it is seen.
const LONGEST_PANEL: f64 = 0.5;
/// Panels are halved at most so often.
const MOST_HALVINGS: u32 = 12;
/// Most panels along one arc, before they are halved: more than a second takes. A sound that needs more is too fine for the way.
const MOST_PANELS: f64 = 1e6;

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
    coefficients: [DVec2; 5],
}

impl Modulation {
    /// The amplitude of the optical length of the part of an arc between two θ: ∫ n̂ ds = ½ ∫ m dσ along it, where `ends` are the amplitudes
    /// at its ends. The error is below 1e-4 of the largest |m| on a panel of half a wavelength times its length; NaN if the sound is too fine
    /// for the length of the arc.
    pub fn along(&self, arc: &Arc, range: [f64; 2], ends: &[SoundAmplitude; 2]) -> DVec2 {
        self.panels(arc, range, ends, |_, _| ())
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
        self.panels(arc, range, ends, |before, panel| {
            see(panel.tabulated(before, arc));
        })
    }

    /// The amplitude along a part of an arc; `see` gets that before each panel, and the panel.
    fn panels(
        &self,
        arc: &Arc,
        [from, to]: [f64; 2],
        ends: &[SoundAmplitude; 2],
        mut see: impl FnMut(DVec2, &Panel),
    ) -> DVec2 {
        let wavelengths = (to - from) * arc.arc_length(1.0) / self.wavelength;
        let panels = wavelengths / LONGEST_PANEL;
        if !(0.0..MOST_PANELS).contains(&panels) {
            return DVec2::NAN;
        }
        let (mut sum, mut start) = (DVec2::ZERO, Node::new(arc, from, &ends[0]));
        if wavelengths <= SHORT {
            let end = Node::new(arc, to, &ends[1]);
            let panel = Panel {
                start,
                middle: None,
                end,
            };
            if self.is_even(&panel) {
                see(DVec2::ZERO, &panel);
                return 0.5 * arc.h() * panel.integral();
            }
        }
        let panels = panels.ceil().max(1.0);
        for i in 1..=panels as u64 {
            let end = if i as f64 == panels {
                Node::new(arc, to, &ends[1])
            } else {
                self.node(arc, from + (to - from) * (i as f64 / panels))
            };
            self.panel(arc, [start, end], MOST_HALVINGS, &mut |panel| {
                see(0.5 * arc.h() * sum, panel);
                sum += panel.integral();
            });
            start = end;
        }
        0.5 * arc.h() * sum
    }

    /// Whether m turns little along a panel.
    fn is_even(&self, panel: &Panel) -> bool {
        let scale = panel.start.value.length().max(panel.end.value.length());
        panel.turn().length() < 12.0 * TURN * scale.max(FAINT * self.largest)
    }

    fn node(&self, arc: &Arc, theta: f64) -> Node {
        Node::new(arc, theta, &self.at(arc.position(theta)))
    }

    /// A panel by values and derivatives at both ends and the value in the middle (its integral is exact for quintics), if that of the ends
    /// alone is near enough; else its halves.
    fn panel(&self, arc: &Arc, ends: [Node; 2], halvings: u32, see: &mut impl FnMut(&Panel)) {
        let [start, end] = ends;
        let middle = self.node(arc, 0.5 * (start.theta + end.theta));
        let panel = Panel {
            start,
            middle: Some(middle),
            end,
        };
        let met = [start, middle, end].map(|node| node.value.length());
        let scale = met.into_iter().fold(FAINT * self.largest, f64::max);
        // What is not finite does not become so by halving.
        let off = (panel.integral() - panel.by_ends()).length();
        let poor = off > TOLERANCE * scale * panel.width();
        if !poor || halvings == 0 {
            return see(&panel);
        }
        self.panel(arc, [start, middle], halvings - 1, see);
        self.panel(arc, [middle, end], halvings - 1, see);
    }
}

/// m at both ends of a part of an arc, and in its middle if that is wanted.
struct Panel {
    start: Node,
    middle: Option<Node>,
    end: Node,
}

impl Panel {
    fn width(&self) -> f64 {
        self.end.theta - self.start.theta
    }

    fn turn(&self) -> DVec2 {
        (self.start.slope - self.end.slope) * self.width()
    }

    /// ∫ m dθ.
    fn integral(&self) -> DVec2 {
        let Some(middle) = &self.middle else {
            return self.by_ends();
        };
        let ends = 7.0 * (self.start.value + self.end.value);
        ((ends + 16.0 * middle.value) / 30.0 + self.turn() / 60.0) * self.width()
    }

    /// The same without the middle.
    fn by_ends(&self) -> DVec2 {
        (0.5 * (self.start.value + self.end.value) + self.turn() / 12.0) * self.width()
    }

    fn tabulated(&self, before: DVec2, arc: &Arc) -> ModulationPanel {
        let width = self.width();
        let [first, slope] = [self.start.value, self.start.slope * width];
        // What the quadratic, cubic and quartic terms make of the end, of the slope there, and of the middle.
        let end = self.end.value - first - slope;
        let bend = (self.end.slope - self.start.slope) * width;
        let quartic = self.middle.map_or(DVec2::ZERO, |middle| {
            16.0 * (middle.value - first - 0.5 * slope) - 8.0 * end + 2.0 * bend
        });
        let cubic = bend - 2.0 * end - 2.0 * quartic;
        ModulationPanel {
            range: [self.start.theta, self.end.theta],
            before,
            scale: 0.5 * arc.h() * width,
            coefficients: [first, slope, end - cubic - quartic, cubic, quartic],
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
        let [a, b, c, d, e] = self.coefficients;
        let mean = a + share * (b / 2.0 + share * (c / 3.0 + share * (d / 4.0 + share * e / 5.0)));
        self.before + self.scale * share * mean
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
