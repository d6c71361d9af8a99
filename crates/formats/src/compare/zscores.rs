//! Differences divided by their standard errors.

use super::Pair;

/// Probability that [`ZScores::limit`] is exceeded by images without a difference.
const FALSE_ALARM: f64 = 1e-3;

/// Differences of two images divided by their standard errors, z = (a − b)/√(var a + var b).
///
/// For independent estimates of one image, z² has mean 1 (somewhat more with few samples per pixel,
/// whose variances are uncertain).
#[derive(Clone, Debug, PartialEq)]
pub struct ZScores {
    /// Name of each channel, and z of all pixels, row by row from the top left. All pixels of a
    /// block have the same z. NaN where no variance is known.
    pub channels: Vec<(String, Vec<f32>)>,
    /// Number of values of z.
    pub count: usize,
    /// Mean of z².
    pub mean_square: f64,
    /// Fraction of |z| above 3; 0.0027 for normal z.
    pub beyond_three: f64,
    /// The largest |z|.
    pub worst: Option<Worst>,
    /// Value that the largest of `count` independent normal z exceeds in one of a thousand
    /// comparisons.
    pub limit: f64,
}

/// The largest |z|.
#[derive(Clone, Debug, PartialEq)]
pub struct Worst {
    /// Signed difference divided by its standard error.
    pub z: f64,
    /// Name of the channel.
    pub channel: String,
    /// Column and row of the block's first pixel, from the top left.
    pub pixel: [usize; 2],
}

impl ZScores {
    /// Computes the scores; `None` if variances of a channel are not known.
    pub(super) fn of(pairs: &[Pair], [width, height]: [usize; 2], block: usize) -> Option<ZScores> {
        let mut scores = ZScores {
            channels: Vec::new(),
            count: 0,
            mean_square: 0.0,
            beyond_three: 0.0,
            worst: None,
            limit: 0.0,
        };
        for pair in pairs {
            let variances = pair.variances?;
            let mut map = vec![f32::NAN; width * height];
            for corner in corners(width, height, block) {
                let pixels = || pixels(corner, [width, height], block);
                if let Some(z) = z(pair, variances, pixels()) {
                    pixels().for_each(|i| map[i] = z as f32);
                    scores.note(z, pair.name, corner);
                }
            }
            scores.channels.push((pair.name.to_owned(), map));
        }
        let count = scores.count.max(1) as f64;
        scores.mean_square /= count;
        scores.beyond_three /= count;
        scores.limit = limit(count);
        Some(scores)
    }

    fn note(&mut self, z: f64, channel: &str, pixel: [usize; 2]) {
        self.count += 1;
        self.mean_square += z * z;
        self.beyond_three += f64::from(u8::from(z.abs() > 3.0));
        if self.worst.as_ref().is_none_or(|w| z.abs() > w.z.abs()) {
            self.worst = Some(Worst {
                z,
                channel: channel.to_owned(),
                pixel,
            });
        }
    }
}

/// Yields the first pixels of all blocks. Blocks at the right and at the bottom may be smaller.
fn corners(width: usize, height: usize, block: usize) -> impl Iterator<Item = [usize; 2]> {
    let rows = (0..height).step_by(block);
    rows.flat_map(move |y| (0..width).step_by(block).map(move |x| [x, y]))
}

/// Yields the indices of a block's pixels.
fn pixels(
    [x, y]: [usize; 2],
    [width, height]: [usize; 2],
    block: usize,
) -> impl Iterator<Item = usize> {
    let rows = y..y.saturating_add(block).min(height);
    let columns = x..x.saturating_add(block).min(width);
    rows.flat_map(move |y| columns.clone().map(move |x| y * width + x))
}

/// Returns z of the sums over a block; `None` if a variance is not finite, as for a single sample.
///
/// Values are stored with 24 bits. If all samples are equal, only round-off distinguishes them; it
/// is therefore a lower bound of the standard error.
fn z(pair: &Pair, [var_a, var_b]: [&[f32]; 2], pixels: impl Iterator<Item = usize>) -> Option<f64> {
    let (mut difference, mut variance) = (0.0, 0.0);
    for i in pixels {
        let (a, b) = (f64::from(pair.a[i]), f64::from(pair.b[i]));
        let round_off = f64::from(f32::EPSILON) * a.abs().max(b.abs());
        difference += a - b;
        variance += f64::from(var_a[i]) + f64::from(var_b[i]) + round_off * round_off;
    }
    match difference {
        _ if !variance.is_finite() || variance < 0.0 => None,
        0.0 => Some(0.0),
        _ => Some(difference / variance.sqrt()),
    }
}

/// Returns |z| that the largest of `count` normal values exceeds with probability [`FALSE_ALARM`]
/// (Šidák).
fn limit(count: f64) -> f64 {
    let each = -((-FALSE_ALARM).ln_1p() / count).exp_m1();
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if libm::erfc(middle * std::f64::consts::FRAC_1_SQRT_2) > each {
            low = middle
        } else {
            high = middle
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::limit;

    /// Compares with quantiles of the normal distribution: 3.2905 for 1e-3 at both ends; 4.2e-9 of
    /// 240,000.
    #[test]
    fn limits_are_quantiles() {
        assert!((limit(1.0) - 3.2905).abs() < 1e-4, "{}", limit(1.0));
        assert!((limit(1e3) - 4.8918).abs() < 1e-3, "{}", limit(1e3));
    }
}
