//! Transmittance of rough dielectric coats.
//!
//! Facets lose the light that they send to their neighbours. Below a coat of Mitsuba's
//! `roughplastic` the losses accumulate, because light meets the coat repeatedly. A lossless coat
//! transmits all light that it does not reflect.

use super::fresnel;
use super::microfacet::{Distribution, Microfacets, Roughness};
use super::surface::{reflect, refract};
use crate::shared::Shared;
use glam::DVec3;
use std::sync::Arc;

/// Number of cosines at which the transmittance of a coat is tabulated.
const COSINES: usize = 65;
/// Number of points along each of the two random numbers from which facets are sampled.
const POINTS: usize = 64;

/// Number of coats that are tabulated if the roughness varies. Coats between them are interpolated.
const COATS: usize = 33;

/// Coat of a given roughness.
#[derive(Debug)]
struct Coat {
    /// Transmittance at cosines evenly spaced over [0, 1].
    transmittance: Vec<f64>,
    /// Mean reflectance from below.
    from_below: f64,
}

/// Coats of a range of roughness.
#[derive(Debug)]
pub(super) struct Coats {
    range: [f64; 2],
    /// A single coat if the roughness is a number. Otherwise several coats, more closely spaced at
    /// the smooth end, where they change faster.
    coats: Vec<Arc<Coat>>,
}

/// Key of a coat: the bits of its index and its roughness, its distribution of facets, and true if
/// it is lossless.
type Key = ([u64; 2], Distribution, bool);

/// Cache of all coats in use. Computing a coat takes tens of milliseconds.
static COATS_IN_USE: Shared<Key, Coat> = Shared::new();

/// Coat at a point of a surface.
pub(super) struct Local<'a> {
    between: [&'a Coat; 2],
    t: f64,
}

impl Coats {
    /// Creates coats of relative index `eta`, with facets of isotropic roughness.
    pub(super) fn new(eta: f64, roughness: &Roughness, lossless: bool) -> Self {
        let [least, most] = roughness.range();
        let count = if least < most { COATS } else { 1 };
        let alpha = |k: usize| {
            let t = k as f64 / (COATS - 1) as f64;
            least + (most - least) * t.powi(3)
        };
        let coat = |k: usize| {
            let bits = [eta, alpha(k)].map(f64::to_bits);
            let key = (bits, roughness.distribution(), lossless);
            COATS_IN_USE.get(key, || {
                let means = Means(roughness.facets(alpha(k)));
                if lossless {
                    Coat::lossless(&means, eta)
                } else {
                    Coat::lossy(&means, eta)
                }
            })
        };
        Coats {
            range: [least, most],
            coats: (0..count).map(coat).collect(),
        }
    }

    /// Returns the coat for the roughness of `facets`.
    pub(super) fn at(&self, facets: &Microfacets) -> Local<'_> {
        let [least, most] = self.range;
        let Some(last) = self.coats.len().checked_sub(2) else {
            return Local {
                between: [self.coats[0].as_ref(); 2],
                t: 0.0,
            };
        };
        let x = ((facets.alphas()[0] - least) / (most - least)).clamp(0.0, 1.0);
        let x = libm::cbrt(x) * (COATS - 1) as f64;
        let k = (x as usize).min(last);
        Local {
            between: [self.coats[k].as_ref(), self.coats[k + 1].as_ref()],
            t: x - k as f64,
        }
    }
}

impl Local<'_> {
    /// Returns the transmittance at a cosine to the normal.
    pub(super) fn passes(&self, cos: f64) -> f64 {
        let [a, b] = self.between.map(|coat| coat.passes(cos));
        a + (b - a) * self.t
    }

    /// Returns the mean reflectance of light from below.
    pub(super) fn returned(&self) -> f64 {
        let [a, b] = self.between.map(|coat| coat.from_below);
        a + (b - a) * self.t
    }
}

impl Coat {
    /// Creates a coat that transmits all light it does not reflect.
    fn lossless(means: &Means, eta: f64) -> Self {
        let transmittance = table(|cos| 1.0 - means.reflected(cos, eta));
        Coat {
            // The light that leaves the coat equals the light that would enter it, divided by η²
            // (reciprocity).
            from_below: 1.0 - mean(&transmittance) / (eta * eta),
            transmittance,
        }
    }

    /// Creates a coat that loses the light its facets send to their neighbours.
    fn lossy(means: &Means, eta: f64) -> Self {
        Coat {
            transmittance: table(|cos| means.refracted(cos, eta)),
            from_below: mean(&table(|cos| means.reflected(cos, 1.0 / eta))),
        }
    }

    /// Interpolates linearly between the cosines of the table.
    fn passes(&self, cos: f64) -> f64 {
        let x = cos.clamp(0.0, 1.0) * (COSINES - 1) as f64;
        let i = (x as usize).min(COSINES - 2);
        let [a, b] = [self.transmittance[i], self.transmittance[i + 1]];
        a + (b - a) * (x - i as f64)
    }
}

/// Tabulates values over the cosines.
fn table(value: impl Fn(f64) -> f64) -> Vec<f64> {
    let cosines = (0..COSINES).map(|k| k as f64 / (COSINES - 1) as f64);
    cosines.map(value).collect()
}

/// Means over the facets that are visible at a cosine.
struct Means(Microfacets);

impl Means {
    /// Returns the mean of F G₁(i), the reflected fraction, for a relative index `eta`.
    fn reflected(&self, cos: f64, eta: f64) -> f64 {
        self.over_visible(cos, |o, h| {
            let i = reflect(o, h, o.dot(h));
            let f = fresnel::dielectric(o.dot(h).clamp(0.0, 1.0), 1.0, eta).reflectance;
            if i.z > 0.0 { f * self.0.g1(i) } else { 0.0 }
        })
    }

    /// Returns the mean of (1 − F) G₁(i), the fraction refracted into a relative index `eta`.
    fn refracted(&self, cos: f64, eta: f64) -> f64 {
        self.over_visible(cos, |o, h| {
            let cos = o.dot(h).clamp(0.0, 1.0);
            let interface = fresnel::dielectric(cos, 1.0, eta);
            let i = refract(o, h, cos, interface.cos_far, 1.0 / eta);
            if i.z < 0.0 && interface.reflectance < 1.0 {
                (1.0 - interface.reflectance) * self.0.g1(i)
            } else {
                0.0
            }
        })
    }

    fn over_visible(&self, cos: f64, value: impl Fn(DVec3, DVec3) -> f64) -> f64 {
        // Avoid the horizon itself, from which no facet is visible.
        let cos = cos.max(1e-4);
        let o = DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
        let normals = self.0.visible_grid(o, POINTS);
        normals.iter().map(|h| value(o, *h)).sum::<f64>() / normals.len() as f64
    }
}

/// Computes 2∫T cosθ d(cosθ) over the table, linear between its cosines.
fn mean(table: &[f64]) -> f64 {
    let h = 1.0 / (table.len() - 1) as f64;
    let cell = |(k, pair): (usize, &[f64])| {
        let (low, rise) = (k as f64 * h, pair[1] - pair[0]);
        // ∫₀¹ (a + rise t)(low + h t) dt
        pair[0] * (low + 0.5 * h) + rise * (0.5 * low + h / 3.0)
    };
    2.0 * h * table.windows(2).enumerate().map(cell).sum::<f64>()
}
