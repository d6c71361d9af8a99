//! Mie scattering by spheres of any size.
//!
//! Theory: docs/theory.md#mie-scattering.

mod series;
mod sizes;
mod table;

use super::polar::Polar;
use super::{PhaseError, Tabulated};
use crate::mueller::PlaneMueller;
use num_complex::Complex64;
use series::Series;
use sizes::Size;
use std::f64::consts::PI;
use table::Elements;

/// Spheres of one size or of many, in a clear medium.
///
/// The radius applies to each sphere. If `geometric_deviation` is not 1, the radius is the median
/// of a log-normal distribution of the number of spheres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spheres {
    /// Radius > 0, in any unit of length.
    pub radius: f64,
    /// Geometric standard deviation of the radius, from 1 to [`Spheres::MAX_DEVIATION`]. The
    /// standard deviation of the logarithm of the radius is ln `geometric_deviation`.
    pub geometric_deviation: f64,
    /// Refractive index of the spheres, > 0.
    pub n: f64,
    /// Imaginary part of the index n + ik of the spheres: > 0 if they absorb, otherwise 0.
    pub k: f64,
    /// Refractive index > 0 of the surrounding medium.
    pub exterior: f64,
    /// Wavelength > 0 in vacuum, in the unit of the radius.
    pub wavelength: f64,
}

impl Spheres {
    /// Largest geometric standard deviation.
    pub const MAX_DEVIATION: f64 = 4.0;
    /// Largest size parameter 2πnr/λ of spheres of one size. For spheres of many sizes the limit is
    /// smaller: [`Spheres::MAX_SIZE_IN_DISTRIBUTION`].
    pub const MAX_SIZE: f64 = 1000.0;
    /// Largest size parameter that contributes in a distribution of sizes.
    pub const MAX_SIZE_IN_DISTRIBUTION: f64 = 300.0;
    /// Largest index, n or k, relative to the surrounding medium.
    const MAX_INDEX: f64 = 100.0;

    /// Returns the circumference over the wavelength in the medium, at a radius.
    fn size_parameter(&self, radius: f64) -> f64 {
        2.0 * PI * self.exterior * radius / self.wavelength
    }

    /// Returns the index relative to the medium.
    fn relative_index(&self) -> Complex64 {
        Complex64::new(self.n, self.k) / self.exterior
    }

    /// Returns the bits of all parameters.
    pub(super) fn key(&self) -> [u64; 6] {
        [
            self.radius,
            self.geometric_deviation,
            self.n,
            self.k,
            self.exterior,
            self.wavelength,
        ]
        .map(f64::to_bits)
    }

    fn check(&self) -> Result<(), PhaseError> {
        let positive = |name: &'static str, value: f64| {
            let valid = value.is_finite() && value > 0.0;
            let error = PhaseError::NotPositive { name, value };
            if valid { Ok(()) } else { Err(error) }
        };
        positive("radius", self.radius)?;
        positive("wavelength", self.wavelength)?;
        positive("index of the medium around", self.exterior)?;
        if !(1.0..=Spheres::MAX_DEVIATION).contains(&self.geometric_deviation) {
            return Err(PhaseError::GeometricDeviation(self.geometric_deviation));
        }
        let m = self.relative_index();
        let valid = m.re > 0.0 && m.re <= Spheres::MAX_INDEX;
        if !valid || !(0.0..=Spheres::MAX_INDEX).contains(&m.im) {
            return Err(PhaseError::SphereIndex {
                n: self.n,
                k: self.k,
            });
        }
        if m == Complex64::ONE {
            return Err(PhaseError::Matched);
        }
        Ok(())
    }
}

/// Scattering by [`Spheres`]: cross-sections, phase function, and its Mueller matrix.
///
/// The phase function and the elements of the matrix are interpolated linearly between cosines. The
/// cosines are dense enough that, at the middles between them, the error of the elements is at most
/// 2e-3 of the phase function there.
///
/// ```
/// use morgana_optics::phase::{Mie, Spheres};
///
/// // Polystyrene of 1 µm in water, in µm.
/// let spheres = Spheres { radius: 0.5, geometric_deviation: 1.0, n: 1.587, k: 0.0, exterior: 1.332, wavelength: 0.6328 };
/// let mie = Mie::new(&spheres)?;
/// assert!((mie.mean_cosine() - 0.9183).abs() < 1e-4);
/// // Scattering coefficient of a suspension of one per cent by volume, per µm.
/// let scattering = 0.01 * mie.scattering_cross_section() / mie.volume();
/// assert!((scattering - 0.0379).abs() < 1e-4);
/// # Ok::<(), morgana_optics::phase::PhaseError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Mie {
    phase: Tabulated,
    /// Elements of the matrix, at the cosines of the phase function and in its unit.
    elements: Vec<Elements>,
    scattering: f64,
    absorption: f64,
    volume: f64,
}

impl Mie {
    /// Creates the phase function by summing Mie's series.
    ///
    /// # Errors
    /// Fails if a radius, wavelength, index or deviation is out of range. Fails if the index of the
    /// spheres equals the index around them, or if the spheres are too large.
    pub fn new(spheres: &Spheres) -> Result<Self, PhaseError> {
        spheres.check()?;
        let sizes = sizes::sizes(spheres)?;
        let area = |size: &Size| size.number * PI * size.radius * size.radius;
        let scattering: f64 = sizes.iter().map(|s| area(s) * s.series.scattering()).sum();
        let extinction: f64 = sizes.iter().map(|s| area(s) * s.series.extinction()).sum();
        let (cosines, values) = table::table(&sizes);
        let phase: Vec<f64> = values.iter().map(|v| v.f11).collect();
        let ln_deviation = spheres.geometric_deviation.ln();
        Ok(Mie {
            phase: Tabulated::new(cosines, &phase)?,
            elements: values,
            scattering,
            absorption: (extinction - scattering).max(0.0),
            // Planted error "concentrations of spheres by the median volume", found by morgana-io/io::suspensions::distributions_have_the_volume_of_their_sizes:
            // volume: 4.0 / 3.0 * PI * spheres.radius.powi(3) * (0.0 * ln_deviation.powi(2)).exp(),
            volume: 4.0 / 3.0 * PI * spheres.radius.powi(3) * (4.5 * ln_deviation.powi(2)).exp(),
        })
    }

    /// Returns the mean scattering cross-section of a sphere, in the squared unit of the radius.
    pub fn scattering_cross_section(&self) -> f64 {
        self.scattering
    }

    /// Returns the mean absorption cross-section of a sphere, in the squared unit of the radius.
    pub fn absorption_cross_section(&self) -> f64 {
        self.absorption
    }

    /// Returns the mean volume of a sphere, in the cubed unit of the radius.
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Returns the mean cosine.
    pub fn mean_cosine(&self) -> f64 {
        self.phase.mean_cosine()
    }

    /// Returns the density per steradian.
    pub fn pdf(&self, cos: f64) -> f64 {
        self.phase.pdf(cos)
    }

    pub(super) fn sample(&self, u: f64) -> (Polar, f64) {
        self.phase.sample(u)
    }

    /// Returns the matrix relative to the scattering of unpolarised light: F₁₂, F₃₃ and F₃₄ over
    /// F₁₁.
    pub(super) fn mueller(&self, cos: f64) -> PlaneMueller {
        let (i, t) = self.phase.interval(cos);
        let e = self.elements[i].mixed(&self.elements[i + 1], t);
        if e.f11 <= 0.0 {
            return PlaneMueller::DEPOLARIZER;
        }
        PlaneMueller {
            a1: 1.0,
            b1: e.f12 / e.f11,
            a2: 1.0,
            a3: e.f33 / e.f11,
            a4: e.f33 / e.f11,
            b2: e.f34 / e.f11,
        }
    }

    /// Returns the memory of the tables in bytes.
    pub(super) fn memory(&self) -> usize {
        self.elements.len() * size_of::<Elements>() + self.phase.memory()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAVELENGTH: f64 = 0.6328;
    const WATER: f64 = 1.332;

    fn spheres(radius: f64, geometric_deviation: f64, [n, k]: [f64; 2]) -> Spheres {
        Spheres {
            radius,
            geometric_deviation,
            n,
            k,
            exterior: WATER,
            wavelength: WAVELENGTH,
        }
    }

    /// Returns cases with size parameters from 0.01 to 595.
    fn cases() -> Vec<Spheres> {
        let polystyrene = [1.587, 0.0];
        let one = [7.6e-4, 0.05, 0.5, 3.0, 45.0].map(|r| spheres(r, 1.0, polystyrene));
        let many = [(0.05, 1.5), (0.5, 1.2), (1.0, 1.4), (0.02, 2.0)];
        let many = many.map(|(r, s)| spheres(r, s, polystyrene));
        let others = [
            spheres(1.0, 1.0, [0.18, 3.4]),
            spheres(4.0, 1.0, [1.0, 0.0]),
            spheres(0.3, 1.4, [1.8, 0.5]),
        ];
        one.into_iter().chain(many).chain(others).collect()
    }

    /// Compares the interpolated phase function with sums over coefficients: the mean cosine, and
    /// scattering as the integral of F₁₁.
    #[test]
    fn tables_keep_integrals() {
        for case in cases() {
            let sizes = sizes::sizes(&case).unwrap();
            let weight = |s: &Size| s.number * s.radius.powi(2) * s.series.scattering();
            let total: f64 = sizes.iter().map(weight).sum();
            let cosines = sizes.iter().map(|s| weight(s) * s.series.mean_cosine());
            let g = cosines.sum::<f64>() / total;
            let mie = Mie::new(&case).unwrap();
            let (places, elements) = table::table(&sizes);
            let intervals = places.windows(2).zip(elements.windows(2));
            let trapezoids = intervals.map(|(c, e)| 0.5 * (c[1] - c[0]) * (e[0].f11 + e[1].f11));
            let k = 2.0 * PI * WATER / WAVELENGTH;
            let integral = 2.0 * PI * trapezoids.sum::<f64>() / (k * k);
            assert!((mie.mean_cosine() - g).abs() < 5e-5);
            assert!((integral / mie.scattering - 1.0).abs() < 5e-4);
        }
    }

    /// Compares table and series: half of ∫|p − p′|, and the matrix at angles between the nodes of
    /// the table.
    #[test]
    fn tables_are_close_everywhere() {
        for case in cases() {
            let sizes = sizes::sizes(&case).unwrap();
            let terms = sizes.iter().map(|s| s.series.terms()).max().unwrap();
            let mie = Mie::new(&case).unwrap();
            let count = 4001;
            let (mut variation, mut worst) = (0.0, 0.0f64);
            let k = 2.0 * PI * WATER / WAVELENGTH;
            for i in 0..count {
                let angle = PI * (f64::from(i) + 0.5) / f64::from(count);
                let exact = Elements::at(&sizes, terms, angle.cos());
                let exact_pdf = exact.f11 / (k * k * mie.scattering);
                let weight = 2.0 * PI * angle.sin() * PI / f64::from(count);
                variation += 0.5 * weight * (mie.pdf(angle.cos()) - exact_pdf).abs();
                let matrix = mie.mueller(angle.cos());
                for (a, b) in [
                    (matrix.b1, exact.f12),
                    (matrix.a3, exact.f33),
                    (matrix.b2, exact.f34),
                ] {
                    worst = worst.max((a - b / exact.f11).abs());
                }
            }
            assert!(variation < 2e-4);
            assert!(worst < 2e-3);
        }
    }

    /// Spheres of one size keep light fully polarised: F₁₁² = F₁₂² + F₃₃² + F₃₄². Spheres of many
    /// sizes do not.
    #[test]
    fn spheres_of_one_size_do_not_depolarise() {
        for case in cases() {
            let sizes = sizes::sizes(&case).unwrap();
            let (_, elements) = table::table(&sizes);
            let kept = elements
                .iter()
                .map(|e| (e.f12 * e.f12 + e.f33 * e.f33 + e.f34 * e.f34).sqrt() / e.f11);
            let least = kept.fold(1.0, f64::min);
            assert!(
                (least > 1.0 - 1e-9) == (case.geometric_deviation == 1.0) || sizes[0].radius < 0.01,
                "{case:?}: {least}"
            );
        }
    }

    /// Compares with the amplitudes by miepython 3.3.0 of x = 10, m = 1.5 + 0.1i, as quoted in
    /// `series`. Fields vary as e^(−iωt).
    #[test]
    fn matrices_are_those_of_amplitudes() {
        let c = Complex64::new;
        let sphere = Spheres {
            radius: 10.0,
            geometric_deviation: 1.0,
            n: 1.5,
            k: 0.1,
            exterior: 1.0,
            wavelength: 2.0 * PI,
        };
        let mie = Mie::new(&sphere).unwrap();
        let s1 = c(-0.701_308_39, 2.255_322_99);
        let s2 = c(2.025_127_20, -1.377_993_59);
        let expected = PlaneMueller::of_amplitudes(s1, s2);
        let found = mie.mueller(-0.7);
        for (a, b) in [
            (found.b1, expected.b1),
            (found.a3, expected.a3),
            (found.a4, expected.a4),
            (found.b2, expected.b2),
        ] {
            assert!((a - b).abs() < 2e-3, "{found:?} {expected:?}");
        }
        assert!(expected.b2.abs() > 0.2);
    }

    /// Tests that twice as many nodes of the quadrature leave cross-sections and mean cosine
    /// unchanged up to unresolved interference.
    #[test]
    fn distributions_are_resolved() {
        for case in cases()
            .into_iter()
            .filter(|case| case.geometric_deviation > 1.0)
        {
            let sums = |sizes: Vec<Size>| {
                let mut sums = [0.0; 3];
                for s in sizes {
                    let area = s.number * s.radius.powi(2);
                    let scattered = area * s.series.scattering();
                    sums[0] += s.number * s.radius.powi(3);
                    sums[1] += scattered;
                    sums[2] += scattered * s.series.mean_cosine();
                }
                sums
            };
            let coarse = sums(sizes::sizes(&case).unwrap());
            let fine = sums(sizes::finer(&case));
            let mie = Mie::new(&case).unwrap();
            assert!((coarse[0] * 4.0 / 3.0 * PI / mie.volume - 1.0).abs() < 1e-5);
            assert!((coarse[1] / fine[1] - 1.0).abs() < 1e-3);
            assert!((coarse[2] / coarse[1] - fine[2] / fine[1]).abs() < 1e-3);
        }
    }

    #[test]
    fn what_cannot_be_computed_is_refused() {
        let good = spheres(0.5, 1.0, [1.587, 0.0]);
        let big = Mie::new(&Spheres {
            radius: 1e3,
            ..good
        });
        assert!(matches!(big, Err(PhaseError::SphereSize { .. })));
        let wide = Mie::new(&Spheres {
            geometric_deviation: 4.0,
            radius: 5.0,
            ..good
        });
        assert!(matches!(wide, Err(PhaseError::SphereSize { .. })));
        let matched = Mie::new(&Spheres { n: WATER, ..good });
        assert_eq!(matched.unwrap_err(), PhaseError::Matched);
        for bad in [
            Spheres {
                radius: 0.0,
                ..good
            },
            Spheres {
                wavelength: f64::NAN,
                ..good
            },
            Spheres {
                exterior: -1.0,
                ..good
            },
            Spheres {
                geometric_deviation: 0.9,
                ..good
            },
            Spheres { k: -0.1, ..good },
            Spheres {
                n: f64::NAN,
                ..good
            },
        ] {
            assert!(Mie::new(&bad).is_err(), "{bad:?}");
        }
    }
}
