//! Power left on an edge whose length was sampled for several channels at once.

use super::edge::Point;
use crate::Spectrum;

/// Returns the transmittance of each channel over the probability of reaching the depth, for
/// channel probabilities `channel_pdf`. Only differences of depths matter, so that nothing
/// underflows.
pub(crate) fn share(channel_pdf: Spectrum, depth: Spectrum) -> Spectrum {
    let used = |i: usize| channel_pdf[i] > 0.0;
    let mut least = f64::INFINITY;
    for i in (0..Spectrum::CHANNELS).filter(|&i| used(i)) {
        least = least.min(depth[i]);
    }
    let relative = |i: usize| {
        if !used(i) {
            0.0
        } else if depth[i] == least {
            // Save a call of `exp` for a single channel and for grey media.
            1.0
        } else {
            (least - depth[i]).exp()
        }
    };
    let transmittance = Spectrum(std::array::from_fn(relative));
    transmittance / (channel_pdf * transmittance).sum()
}

/// Returns the power of a particle of initial power 1 at a collision, over the density per unit
/// length of the collision, Σ p σ_t T.
pub(crate) fn collided(channel_pdf: Spectrum, point: &Point) -> Spectrum {
    let share = share(channel_pdf, point.depth);
    point.weight * share / (channel_pdf * point.rate * share).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_channel_keeps_its_power_and_several_share_it() {
        let one = Spectrum([1.0, 0.0, 0.0, 0.0]);
        assert_eq!(share(one, Spectrum([2000.0, 0.0, 0.0, 0.0])), one);
        let two = Spectrum([0.5, 0.5, 0.0, 0.0]);
        let shared = share(two, Spectrum([1000.0, 1001.0, 0.0, 0.0]));
        let total = 0.5 + 0.5 * (-1.0f64).exp();
        assert!((shared[0] - 1.0 / total).abs() < 1e-14);
        assert!((shared[1] - (-1.0f64).exp() / total).abs() < 1e-14);
        assert_eq!(shared[2], 0.0);
    }
}
