//! Quadrature of integrands as small as the contrast, independent of the steps of the ray.

use crate::budget::EVALUATIONS_PER_DIFFERENCE;

/// Nodes of Kronrod's quadrature with 15 points on [−1, 1], from the end to the middle. Every
/// second node is a node of Gauss's quadrature with 7 points.
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
/// Gauss's weights, for every second node.
const GAUSS: [f64; 4] = [
    0.129_484_966_168_869_7,
    0.279_705_391_489_276_64,
    0.381_830_050_505_118_9,
    0.417_959_183_673_469_4,
];
/// Number of evaluations of a panel.
const POINTS: u64 = 15;
/// Largest accepted difference of the two quadratures over a panel, relative to the largest
/// contrast so far. Kronrod's quadrature is an order of magnitude better than this.
const TOLERANCE: f64 = 1e-6;
/// Rounding error of a contrast, relative to the squared indices that are subtracted.
const ROUNDING: f64 = 1e-15;
/// Maximum number of times that a panel is halved.
const MAX_HALVINGS: u32 = 12;
/// Smallest panel, as a fraction of an arc. It bounds the work in fields with structure at all
/// scales.
const MIN_PANEL: f64 = 1e-6;

/// Integrand at a place: the contrast of squared indices, and all other terms.
#[derive(Clone, Copy, Debug)]
pub(super) struct Integrand {
    /// Contrast n² − n_r².
    pub contrast: f64,
    /// All terms of the integrand except the contrast.
    pub rest: f64,
}

/// Integrals with an error of 1e-7 of the largest contrast so far.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Quadrature {
    /// Largest contrast |n² − n_r²| so far.
    contrast: f64,
    /// Absolute difference below which only rounding remains.
    rounding: f64,
    /// Number of evaluations of the integrand.
    pub evaluations: u64,
}

impl Quadrature {
    /// Records a contrast.
    pub(super) fn meet(&mut self, contrast: f64) {
        self.contrast = self.contrast.max(contrast.abs());
    }

    /// Records the size of squared indices that are subtracted, which sets the rounding error.
    pub(super) fn subtract(&mut self, n2: f64) {
        self.rounding = self.rounding.max(ROUNDING * n2);
    }

    /// Integrates f over θ, in panels with widths of at most `width`(θ) at their starts; NaN if
    /// over budget.
    pub(super) fn integrate(
        &mut self,
        [from, to]: [f64; 2],
        width: impl Fn(f64) -> f64,
        f: impl Fn(f64) -> Integrand,
    ) -> f64 {
        let mut sum = 0.0;
        let mut at = from;
        while at < to && !self.is_over_budget() {
            let end = (at + width(at).max(MIN_PANEL * (to - from))).min(to);
            sum += self.panel([at, end], MAX_HALVINGS, &f);
            at = end;
        }
        if self.is_over_budget() { f64::NAN } else { sum }
    }

    /// Returns true if the computation was abandoned, so that integrals are unknown.
    pub(super) fn is_over_budget(&self) -> bool {
        self.evaluations > EVALUATIONS_PER_DIFFERENCE
    }

    fn panel(&mut self, [from, to]: [f64; 2], halvings: u32, f: &impl Fn(f64) -> Integrand) -> f64 {
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        let mut at = |theta: f64| {
            let Integrand { contrast, rest } = f(theta);
            self.meet(contrast);
            contrast + rest
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
        self.evaluations += POINTS;
        // Accept values that are not finite: halving would not help.
        let poor = (kronrod - gauss).abs() > (TOLERANCE * self.contrast).max(self.rounding);
        if !poor || halvings == 0 || self.is_over_budget() {
            return kronrod * half;
        }
        self.panel([from, middle], halvings - 1, f) + self.panel([middle, to], halvings - 1, f)
    }
}
