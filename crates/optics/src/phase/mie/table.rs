//! Table of the elements of the scattering matrix, at enough cosines for interpolation.
//!
//! Theory: docs/theory.md#mie-scattering.

use super::series::Angular;
use super::sizes::Size;
use std::f64::consts::PI;

/// Largest interpolation error of an element at the middle between two nodes, as a fraction of F₁₁.
const TOLERANCE: f64 = 2e-3;
/// Number of initial intervals per partial wave: several for each lobe.
const PLACES_PER_TERM: usize = 4;
/// Maximum number of halvings of an interval. This is a safeguard that spheres do not reach.
const MAX_HALVINGS: u32 = 12;

/// Elements of the scattering matrix of spheres, summed over sizes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Elements {
    pub f11: f64,
    pub f12: f64,
    pub f33: f64,
    pub f34: f64,
}

impl Elements {
    /// Returns (1 − t) times these elements plus t times `other`.
    pub(super) fn mixed(&self, other: &Self, t: f64) -> Self {
        let mix = |a: f64, b: f64| a + t * (b - a);
        Elements {
            f11: mix(self.f11, other.f11),
            f12: mix(self.f12, other.f12),
            f33: mix(self.f33, other.f33),
            f34: mix(self.f34, other.f34),
        }
    }

    /// Computes the elements at a cosine, from at most `terms` partial waves.
    pub(super) fn at(sizes: &[Size], terms: usize, cos: f64) -> Self {
        let angular = Angular::new(cos, terms);
        let mut sum = Elements::default();
        for size in sizes {
            let [s1, s2] = size.series.amplitudes(&angular);
            let (across, within) = (s1.norm_sqr(), s2.norm_sqr());
            let mixed = s1 * s2.conj();
            sum.f11 += 0.5 * size.number * (across + within);
            // Planted error "spheres that polarise along the plane of scattering", found by morgana-transport/transport::polarization::mie::slabs_of_spheres_agree_with_electric_fields:
            // sum.f12 += 0.5 * size.number * (within - across);
            sum.f12 += 0.5 * size.number * (across - within);
            sum.f33 += size.number * mixed.re;
            sum.f34 -= size.number * mixed.im;
        }
        sum
    }

    fn differs(&self, other: &Self) -> bool {
        let pairs = [
            (self.f11, other.f11),
            (self.f12, other.f12),
            (self.f33, other.f33),
            (self.f34, other.f34),
        ];
        pairs
            .iter()
            .any(|(a, b)| (a - b).abs() > TOLERANCE * self.f11)
    }
}

/// Node of the table.
#[derive(Clone, Copy)]
struct Place {
    angle: f64,
    cos: f64,
    elements: Elements,
}

/// Computes cosines from −1 to 1, and the elements there.
pub(super) fn table(sizes: &[Size]) -> (Vec<f64>, Vec<Elements>) {
    let terms = sizes.iter().map(|s| s.series.terms());
    let terms = terms.max().unwrap_or(1);
    let at = |angle: f64, cos: f64| Place {
        angle,
        cos,
        elements: Elements::at(sizes, terms, cos),
    };
    let intervals = PLACES_PER_TERM * terms;
    let mut places = vec![at(PI, -1.0)];
    for i in (0..intervals).rev() {
        let angle = PI * i as f64 / intervals as f64;
        let last = places[places.len() - 1];
        refine(&at, [last, at(angle, angle.cos())], 0, &mut places);
    }
    places.iter().map(|p| (p.cos, p.elements)).unzip()
}

/// Adds the nodes of an interval after its first. Halves the interval until interpolation at its
/// middle is accurate.
fn refine(
    at: &impl Fn(f64, f64) -> Place,
    [from, to]: [Place; 2],
    halvings: u32,
    places: &mut Vec<Place>,
) {
    let angle = 0.5 * (from.angle + to.angle);
    let middle = at(angle, angle.cos());
    let t = (middle.cos - from.cos) / (to.cos - from.cos);
    let guess = from.elements.mixed(&to.elements, t);
    if halvings < MAX_HALVINGS && middle.elements.differs(&guess) {
        refine(at, [from, middle], halvings + 1, places);
        refine(at, [middle, to], halvings + 1, places);
    } else {
        places.extend([middle, to]);
    }
}
