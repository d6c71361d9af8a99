//! Length scales of fields for which only bounds of derivatives are known
//! (docs/theory.md#formulas).

/// Bounds over a region of |∇n²|, of the eigenvalues of Hess n², and of fourth derivatives of n².
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Steepness {
    pub first: f64,
    pub second: f64,
    pub fourth: f64,
}

/// Ratio of length scales to the length L at which the fifth derivative of a ray with respect to σ
/// is n⁵L⁻⁴. It exceeds one because bounds over a ball of this radius exceed the derivatives on
/// typical rays.
const LENGTH_SCALE_RATIO: f64 = 2.0;
/// Maximum number of steps that enlarge or shrink a radius in the search for a length.
const MAX_STEPS: usize = 60;
/// Number of bisections; enough that no bit changes.
const BISECTIONS: usize = 60;
/// Smallest length, in scene units: where n² is not positive there are no rays.
const MIN_LENGTH: f64 = 1e-9;

impl Steepness {
    /// Returns the smallest of three lengths. Over the first, derivatives of this size change n² by
    /// at most its own value; over the second, they turn a ray at most once. The third makes the
    /// fifth derivative of a ray with respect to σ about n⁵L⁻⁴.
    fn length(self, n2: f64) -> f64 {
        let ratio = |derivative: f64| match derivative {
            0.0 => f64::INFINITY,
            d => (n2 / d).max(0.0),
        };
        let second = (2.0 * ratio(self.second)).sqrt();
        let fourth = (2.0 * ratio(self.fourth)).sqrt().sqrt();
        ratio(self.first)
            .min(second)
            .min(LENGTH_SCALE_RATIO * fourth)
    }
}

/// Returns the length scale at a place with a value n²: the largest radius L about the place for
/// which the derivatives within L allow the length L. `around` bounds the derivatives within a
/// radius. Consider two places at a distance d. A ball about one place lies within a ball about the
/// other place with a radius larger by d. L is therefore 1-Lipschitz.
pub(super) fn length_at(n2: f64, around: impl Fn(f64) -> Steepness) -> f64 {
    // Bracket the largest radius that its own derivatives allow.
    let allows = |radius: f64| around(radius).length(n2) >= radius;
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..MAX_STEPS {
        if !allows(high) {
            break;
        }
        (low, high) = (high, 16.0 * high);
    }
    if low == 0.0 {
        for _ in 0..MAX_STEPS {
            if high < MIN_LENGTH || allows(0.25 * high) {
                break;
            }
            high *= 0.25;
        }
        low = 0.25 * high;
    } else if allows(high) {
        return f64::INFINITY;
    }
    // Bisect the bracket.
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if allows(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low.max(MIN_LENGTH)
}

/// Returns the length that is at most the length scale anywhere in a region with values n² of at
/// least `n2`, between `least` and `most`. `around` bounds derivatives within a radius around the
/// region.
pub(super) fn length_within(
    n2: f64,
    [least, most]: [f64; 2],
    around: impl Fn(f64) -> Steepness,
) -> f64 {
    let (mut best, mut radius) = (least, most);
    while radius > best {
        let length = around(radius).length(n2);
        best = f64::max(best, length.min(radius));
        radius *= 0.5;
    }
    best
}
