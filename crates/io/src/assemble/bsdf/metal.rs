//! Complex indices of metals.

use super::parameters::index;
use crate::query::Query;
use crate::scene::SpectrumValue;
use crate::schema::METALS;

/// Real and imaginary part of the index, with the index of the dielectric outside to which they are
/// relative.
pub(super) struct Optics {
    pub eta: SpectrumValue,
    pub k: SpectrumValue,
    pub surroundings: f64,
}

/// Reads the complex index of a conductor: η and k, the name of a metal, or nothing (or `none`) for
/// a perfect mirror.
pub(super) fn optics(q: &mut Query) -> Optics {
    let surroundings = index(q, "ext_eta").unwrap_or(1.0);
    let optical = q.has("eta") || q.has("k");
    if q.has("material") {
        let chosen = q.word("material");
        if optical {
            q.error(
                "material",
                "give the name of a metal, or eta and k, not both",
            );
        }
        if let Some((_, eta, k)) = METALS.into_iter().find(|(name, ..)| *name == chosen) {
            return Optics {
                eta: SpectrumValue::Rgb(eta),
                k: SpectrumValue::Rgb(k),
                surroundings,
            };
        }
    }
    if optical {
        Optics {
            eta: q.spectrum("eta"),
            k: q.spectrum("k"),
            surroundings,
        }
    } else {
        Optics {
            eta: SpectrumValue::Uniform(0.0),
            k: SpectrumValue::Uniform(1.0),
            surroundings,
        }
    }
}
