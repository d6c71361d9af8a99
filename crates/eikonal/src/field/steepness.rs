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
/// Ratio of the bounds between which a search for a length ends.
const PRECISION: f64 = 0.99;
/// Maximum number of radii that a search tries.
const MAX_RADII: usize = 80;
/// Factor between the radii of a search that has found only one bound.
const RADIUS_RATIO: f64 = 16.0;
/// Smallest length scale, relative to the distance from the origin. It also holds where n² is not
/// positive, which rays do not reach.
const MIN_RELATIVE_LENGTH: f64 = 1e-9;
/// Smallest length scale at the origin, in scene units.
const MIN_LENGTH: f64 = 1e-30;

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

/// Returns the length scale at a place with a value n² at a `distance` from the origin: the largest
/// radius L about the place for which the derivatives within L allow the length L, less one
/// percent. `around` bounds the derivatives within a radius. Consider two places at a distance d. A
/// ball about one place lies within a ball about the other place with a radius larger by d. L is
/// therefore 1-Lipschitz.
pub(super) fn length_at(n2: f64, distance: f64, around: impl Fn(f64) -> Steepness) -> f64 {
    let shortest = (MIN_RELATIVE_LENGTH * distance).max(MIN_LENGTH);
    let allowed = |radius: f64| around(radius).length(n2);
    // The bounds of derivatives grow with the radius. L therefore lies between any radius and the
    // length that the derivatives within the radius allow.
    let (mut low, mut high) = (0.0, allowed(0.0));
    for _ in 0..MAX_RADII {
        if low >= PRECISION * high || high <= shortest {
            break;
        }
        let radius = match (low > 0.0, high.is_finite()) {
            (true, true) => (low * high).sqrt(),
            (true, false) => RADIUS_RATIO * low,
            (false, true) => high / RADIUS_RATIO,
            (false, false) => 1.0,
        };
        let length = allowed(radius);
        low = f64::max(low, length.min(radius));
        high = f64::min(high, length.max(radius));
    }
    let length = if high.is_finite() { low } else { high };
    length.max(shortest)
}
