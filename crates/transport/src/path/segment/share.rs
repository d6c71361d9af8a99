//! What is left of power on an edge whose length was sampled for several channels at once.

use super::edge::Point;
use crate::Spectrum;

/// Transmittance of each channel over the probability of getting that far, for channel probabilities
/// `channel_pdf`. Nothing underflows: only differences of depths enter.
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
            // Of one channel, and in grey media: not worth a call.
            1.0
        } else {
            (least - depth[i]).exp()
        }
    };
    let transmittance = Spectrum(std::array::from_fn(relative));
    transmittance / (channel_pdf * transmittance).sum()
}

/// What a particle of power 1 that collides is worth there, over the density per unit length of the collision,
/// Σ p σ_t T.
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
