//! Encircled energy of the diffraction image of a disc or a ring, and its inverse
//! (docs/theory.md#diffraction-at-the-aperture).

/// Distance of the nodes of the table, in units of v. Cubic pieces between them have an error of at
/// most 1e-6.
const STEP: f64 = std::f64::consts::PI / 32.0;
/// Largest radius of the table, times 1 − ε, where ε is the obscured fraction of the radius. Beyond
/// it, rings add less than 1e-6 to the mean decay.
const MAX_RADIUS: f64 = 1200.0;
/// Nodes and weights of Gauss's rule of three points on [−1, 1].
const GAUSS: [[f64; 2]; 3] = [
    [-0.774_596_669_241_483_4, 5.0 / 9.0],
    [0.0, 8.0 / 9.0],
    [0.774_596_669_241_483_4, 5.0 / 9.0],
];

/// Encircled energy E(v): the fraction of the light of a point within the reduced radius v = 2π a
/// sin θ/λ of its image. The aperture has the radius a, and a disc of radius εa of it is covered.
/// The error is at most 2e-6.
#[derive(Debug)]
pub(super) struct EncircledEnergy {
    /// Values of E and dE/dv at multiples of [`STEP`].
    nodes: Vec<[f64; 2]>,
}

impl EncircledEnergy {
    /// Tabulates E for an aperture with the obscuration ε in [0, 1).
    pub(super) fn new(obscuration: f64) -> Self {
        let count = (MAX_RADIUS / (1.0 - obscuration) / STEP).ceil() as usize;
        let mut energy = 0.0;
        let mut nodes = vec![[0.0; 2]];
        for i in 0..count {
            let piece = |[x, weight]: [f64; 2]| {
                let v = (i as f64 + 0.5 * (1.0 + x)) * STEP;
                0.5 * STEP * weight * density(obscuration, v)
            };
            energy += GAUSS.map(piece).iter().sum::<f64>();
            nodes.push([energy, density(obscuration, (i + 1) as f64 * STEP)]);
        }
        EncircledEnergy { nodes }
    }

    /// Returns the radius v that contains a fraction `energy`, in [0, 1), of the light.
    pub(super) fn radius(&self, energy: f64) -> f64 {
        let last = self.nodes.len() - 1;
        let within = self.nodes[last][0];
        if energy >= within {
            // 1 − E falls as 1/v.
            return (1.0 - within) * last as f64 * STEP / (1.0 - energy);
        }
        // The first energy is zero, and the last one exceeds `energy`.
        let right = self.nodes.partition_point(|node| node[0] <= energy);
        let (a, b) = (self.nodes[right - 1], self.nodes[right]);
        let (mut low, mut high) = (0.0, 1.0);
        while high - low > f64::EPSILON {
            let middle = 0.5 * (low + high);
            if cubic(a, b, middle) < energy {
                low = middle
            } else {
                high = middle
            }
        }
        ((right - 1) as f64 + 0.5 * (low + high)) * STEP
    }
}

/// Evaluates Hermite's cubic between two neighbouring nodes, at a fraction `t` of their distance.
fn cubic([a, slope_a]: [f64; 2], [b, slope_b]: [f64; 2], t: f64) -> f64 {
    let s = 1.0 - t;
    s * s * (a * (1.0 + 2.0 * t) + STEP * slope_a * t)
        + t * t * (b * (1.0 + 2.0 * s) - STEP * slope_b * s)
}

/// Returns dE/dv = 2 [J₁(v) − ε J₁(εv)]²/((1 − ε²) v).
fn density(obscuration: f64, v: f64) -> f64 {
    // Planted error "rings of an obscured aperture too faint", found by morgana-transport/transport::diffraction::a_point_becomes_the_pattern_of_the_aperture:
    // let amplitude = libm::j1(v) - obscuration * obscuration * libm::j1(obscuration * v);
    let amplitude = libm::j1(v) - obscuration * libm::j1(obscuration * v);
    2.0 * amplitude * amplitude / ((1.0 - obscuration * obscuration) * v)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Computes E by Simpson's rule, from 0 to each of several ascending radii.
    fn energies(obscuration: f64, radii: &[f64]) -> Vec<f64> {
        let at = |v: f64| {
            if v > 0.0 {
                density(obscuration, v)
            } else {
                0.0
            }
        };
        let (mut from, mut energy) = (0.0, 0.0);
        let mut found = Vec::new();
        for &to in radii {
            let steps = ((to - from) / 0.02_f64).ceil();
            let width = (to - from) / steps;
            for i in 0..steps as usize {
                let [a, m, b] = [0.0, 0.5, 1.0].map(|t| at(from + (i as f64 + t) * width));
                energy += width * (a + 4.0 * m + b) / 6.0;
            }
            from = to;
            found.push(energy);
        }
        found
    }

    #[test]
    fn a_disc_has_the_energy_of_rayleigh() {
        let table = EncircledEnergy::new(0.0);
        for i in 1..20_000 {
            let energy = f64::from(i) / 20_000.0;
            let v = table.radius(energy);
            // Rayleigh (1881).
            let expected = 1.0 - libm::j0(v).powi(2) - libm::j1(v).powi(2);
            assert!((energy - expected).abs() < 2e-6, "{v}: {expected}");
        }
        // Check the dark rings at 1.220, 2.233 and 3.238 λN, where v = π r/(λN), and the energy
        // within: Born and Wolf, table 8.2.
        for (ring, energy) in [(1.2197, 0.8378), (2.2331, 0.9099), (3.2383, 0.9376)] {
            let v = std::f64::consts::PI * ring;
            assert!(libm::j1(v).abs() < 1e-4);
            let within = 1.0 - libm::j0(v).powi(2) - libm::j1(v).powi(2);
            assert!((within - energy).abs() < 1e-4);
            // Near dark rings, the energy determines the radius poorly.
            let [a, b] = [-1e-4, 1e-4].map(|change| table.radius(within + change));
            assert!(a < v && v < b, "{a} {v} {b}");
        }
    }

    /// Compares with sums over other nodes, within the table and beyond. The total energy is 1.
    #[test]
    fn rings_have_the_energy_of_their_integral() {
        for obscuration in [0.2, 0.5, 0.9] {
            let table = EncircledEnergy::new(obscuration);
            let end = MAX_RADIUS / (1.0 - obscuration);
            let wanted = [0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 0.999, 0.9998];
            let radii = wanted.map(|energy| table.radius(energy));
            assert!(radii[7] > end, "the last one is beyond the table");
            for (energy, expected) in wanted.into_iter().zip(energies(obscuration, &radii)) {
                assert!((energy - expected).abs() < 2e-6, "{obscuration}: {energy}");
            }
        }
    }

    /// Compares with the first dark rings in λN and the energy within: Schroeder, Astronomical
    /// Optics, table 10.2.
    #[test]
    fn an_obscuration_moves_light_to_the_rings() {
        for (obscuration, ring, energy) in [
            (0.2, 1.167, 0.764),
            (0.33, 1.098, 0.654),
            (0.5, 1.001, 0.479),
        ] {
            let v = std::f64::consts::PI * ring;
            assert!(density(obscuration, v) < 1e-5, "{obscuration}");
            let [within] = energies(obscuration, &[v])[..] else {
                unreachable!()
            };
            assert!((within - energy).abs() < 6e-4, "{obscuration}: {within}");
            let table = EncircledEnergy::new(obscuration);
            // Near dark rings, the energy determines the radius poorly.
            let [a, b] = [-1e-4, 1e-4].map(|change| table.radius(within + change));
            assert!(a < v && v < b, "{a} {v} {b}");
        }
    }
}
