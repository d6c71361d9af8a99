//! Representatives: contributions of a sample that represent all light of a layer, so that fewer
//! modulations are computed (docs/theory.md#tagged-light).

use crate::Spectrum;

/// Number of contributions per representative.
const CONTRIBUTIONS_PER_REPRESENTATIVE: usize = 8;

/// Contribution that represents light of a layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Representative {
    pub contribution: usize,
    pub channel: usize,
    pub light: f64,
}

/// Passes the representatives of contributions to `see`. The contributions are given with their
/// indices, in the order of the path, and have one sign. In each channel, representatives are
/// chosen at equal steps of the accumulated light, with an offset from `u` in [0, 1). Their light
/// adds up to all light, to rounding. On average over `u`, each contribution is represented by its
/// own light.
pub(crate) fn representatives(
    contributions: impl Iterator<Item = (usize, Spectrum)> + Clone,
    channels: usize,
    u: f64,
    mut see: impl FnMut(Representative),
) {
    let count = contributions
        .clone()
        .count()
        .div_ceil(CONTRIBUTIONS_PER_REPRESENTATIVE);
    for channel in 0..channels {
        let light = contributions.clone().map(|(_, light)| light[channel]);
        let step = light.sum::<f64>() / count as f64;
        let (mut passed, mut taken) = (0.0, 0);
        for (contribution, light) in contributions.clone() {
            passed += light[channel].abs();
            // Planted error "contributions that stand for others wherever their light begins", found by morgana-transport/lib::observe::tagging::representatives::tests::all_light_is_represented:
            // while taken < count && passed > (taken as f64 + 0.0 * u) * step.abs() {
            while taken < count && passed > (taken as f64 + u) * step.abs() {
                see(Representative {
                    contribution,
                    channel,
                    light: step,
                });
                taken += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On average over many offsets, each contribution has its own light in every channel.
    /// Contributions without light are never chosen.
    #[test]
    fn all_light_is_represented() {
        let lights = [0.5, 0.0, 3.0, 0.25, 1.0, 0.125, 0.0, 2.0, 0.75];
        for sign in [1.0, -1.0] {
            let spectrum = |(i, light): (usize, &f64)| {
                let other = light * (i % 3) as f64;
                (7 + i, Spectrum([*light, other, 0.0, 0.0]) * sign)
            };
            let contributions: Vec<_> = lights.iter().enumerate().map(spectrum).collect();
            const PLACES: usize = 40_000;
            // Two of the channels have light.
            let expected_count = 2 * lights.len().div_ceil(CONTRIBUTIONS_PER_REPRESENTATIVE);
            let mut found = vec![Spectrum::ZERO; lights.len()];
            for place in 0..PLACES {
                let u = (place as f64 + 0.5) / PLACES as f64;
                let (mut sum, mut count) = (Spectrum::ZERO, 0);
                representatives(contributions.iter().copied(), 3, u, |r| {
                    found[r.contribution - 7][r.channel] += r.light / PLACES as f64;
                    sum[r.channel] += r.light;
                    count += 1;
                });
                let expected = contributions.iter().map(|(_, light)| *light);
                let off = sum - expected.fold(Spectrum::ZERO, |sum, light| sum + light);
                assert!(
                    off.map(f64::abs).max() < 1e-14 && count == expected_count,
                    "{off:?}, {count}"
                );
            }
            for ((_, light), found) in contributions.iter().zip(&found) {
                assert!(
                    (*light - *found).map(f64::abs).max() < 1e-3,
                    "{light:?} {found:?}"
                );
            }
        }
    }

    #[test]
    fn few_are_represented_by_one() {
        for count in 1..=CONTRIBUTIONS_PER_REPRESENTATIVE {
            let contributions = vec![(0, Spectrum::ONE); count];
            let mut all = Vec::new();
            representatives(contributions.iter().copied(), 1, 0.5, |r| all.push(r));
            let [one] = all[..] else {
                panic!("{count}: {all:?}");
            };
            assert_eq!(one.light, count as f64);
        }
        representatives(std::iter::empty(), 1, 0.5, |_| panic!("there is nothing"));
    }
}
