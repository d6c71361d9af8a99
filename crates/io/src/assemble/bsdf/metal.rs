//! Complex indices of metals.

use crate::query::Query;
use crate::scene::SpectrumValue;

/// Real and imaginary part of the index against vacuum.
pub(super) struct Optics {
    pub eta: SpectrumValue,
    pub k: SpectrumValue,
}

/// η and k of metals in the channels of linear sRGB. The names are those of Mitsuba, the values what Mitsuba
/// 3.9.1 makes of its measured spectra in an RGB render.
const METALS: [(&str, [f64; 3], [f64; 3]); 7] = [
    (
        "Ag",
        [0.155276, 0.116728, 0.138388],
        [4.82835, 3.12222, 2.1469],
    ),
    ("Al", [1.6575, 0.880405, 0.521244], [9.22381, 6.2695, 4.837]),
    (
        "Au",
        [0.143036, 0.375307, 1.44205],
        [3.983, 2.38556, 1.60336],
    ),
    ("Cr", [4.36967, 2.91651, 1.6549], [5.20655, 4.23131, 3.7547]),
    (
        "Cu",
        [0.201005, 0.92375, 1.10222],
        [3.91326, 2.45305, 2.14209],
    ),
    (
        "Hg",
        [2.39894, 1.44003, 0.90957],
        [6.32759, 4.37192, 3.42176],
    ),
    (
        "W",
        [4.37082, 3.30025, 2.99841],
        [3.50064, 2.60487, 2.27323],
    ),
];

/// What a conductor says: η and k, the name of a metal, or nothing (or `none`), which makes a perfect mirror.
pub(super) fn optics(q: &mut Query) -> Optics {
    let optical = q.has("eta") || q.has("k");
    if q.has("material") {
        let names: Vec<&str> = ["none"]
            .into_iter()
            .chain(METALS.map(|(name, ..)| name))
            .collect();
        let chosen = q.one_of("material", &names);
        if optical {
            q.error(
                "material",
                "give the name of a metal, or eta and k, not both",
            );
        }
        if let Some((_, eta, k)) = chosen.checked_sub(1).map(|i| METALS[i]) {
            return Optics {
                eta: SpectrumValue::Rgb(eta),
                k: SpectrumValue::Rgb(k),
            };
        }
    }
    if optical {
        Optics {
            eta: q.spectrum_or("eta", SpectrumValue::Uniform(0.0)),
            k: q.spectrum_or("k", SpectrumValue::Uniform(1.0)),
        }
    } else {
        Optics {
            eta: SpectrumValue::Uniform(0.0),
            k: SpectrumValue::Uniform(1.0),
        }
    }
}
