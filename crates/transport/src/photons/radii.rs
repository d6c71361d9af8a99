//! How far around a place photons count, and how that shrinks (docs/theory.md#progressive-photon-maps).

/// The radii of one map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Radii {
    /// For photons in media.
    pub volume: f64,
    /// For photons on surfaces.
    pub surface: f64,
}

impl Radii {
    /// Those of the map of a sample, given that of the first; photons in media count in so many dimensions.
    pub(crate) fn shrunk(first: f64, sample: u64, in_media: f64) -> Self {
        Radii {
            volume: first * shrinkage(in_media, sample),
            surface: first * shrinkage(2.0, sample),
        }
    }
}

/// Radius of the map of a sample, counted from 0, over that of the first. With the exponent that makes
/// bias and noise of the mean fall alike, the content r^d shrinks by (i + α)/(i + 1) after sample i
/// (Knaus and Zwicker 2011): r_i^d = Γ(i + α)/(Γ(1 + α) Γ(i + 1)), i counted from 1.
fn shrinkage(dimensions: f64, sample: u64) -> f64 {
    let alpha = 4.0 / (dimensions + 4.0);
    let i = sample as f64 + 1.0;
    let log = libm::lgamma(i + alpha) - libm::lgamma(1.0 + alpha) - libm::lgamma(i + 1.0);
    (log / dimensions).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radii_shrink_by_the_recursion() {
        for dimensions in [2.0, 3.0] {
            let alpha = 4.0 / (dimensions + 4.0);
            let mut content = 1.0;
            for sample in 0..1000 {
                let expected = f64::powf(content, 1.0 / dimensions);
                let found = shrinkage(dimensions, sample);
                assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
                let i = sample as f64 + 1.0;
                content *= (i + alpha) / (i + 1.0);
            }
        }
    }
}
