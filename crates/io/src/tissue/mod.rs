//! Tissues by name: scattering and absorption coefficients per millimetre
//! (docs/scene/media.md#tissues).

mod tables;

use tables::{FAT, HAEMOGLOBIN, RANGE, WATER};

/// Concentration of haemoglobin in whole blood in mol/l: 150 g/l at 64 500 g/mol.
const HAEMOGLOBIN_IN_BLOOD: f64 = 150.0 / 64_500.0;
/// Millimetres per centimetre.
const MM_PER_CM: f64 = 10.0;

/// Mean cosine of scattering, which converts reduced coefficients to σ_s.
pub(crate) const MEAN_COSINE: f64 = 0.9;

/// Names of tissues, after `none`.
pub(crate) const NAMES: [&str; 6] = [
    "none",
    "soft tissue",
    "fatty tissue",
    "bone",
    "gray matter",
    "white matter",
];

/// A tissue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Tissue {
    /// Mean of many samples: σ_s' = a (f (λ/500 nm)⁻⁴ + (1 − f) (λ/500 nm)⁻ᵇ). Its [`Content`]
    /// absorbs.
    Mean {
        /// σ_s' at 500 nm in 1/cm.
        at_500: f64,
        /// Fraction f of Rayleigh scattering at 500 nm.
        rayleigh: f64,
        /// Exponent b of Mie scattering.
        mie: f64,
    },
    /// Measured wavelengths in nm, and σ_s' and σ_a in 1/mm.
    Measured(&'static [[f64; 3]]),
}

/// Mean properties of soft tissue: S. L. Jacques, "Optical properties of biological tissues: a
/// review", Physics in Medicine and Biology 58, R37 (2013), table 2.
const SOFT: Tissue = mean(19.1, 0.153, 1.091);
const FATTY: Tissue = mean(19.3, 0.174, 0.447);
const BONE: Tissue = mean(15.3, 0.022, 0.326);

/// Wavelength in nm, σ_s (1 − g), and σ_a. Source: A. N. Yaroslavsky and others, "Optical
/// properties of selected native and coagulated human brain tissues in vitro in the visible and
/// near infrared spectral range", Physics in Medicine and Biology 47, 2059 (2002), as in table 1 of
/// PubMed Central PMC6366475.
const GRAY_MATTER: [[f64; 3]; 5] = [
    [670.0, 8.4 * 0.10, 0.020],
    [810.0, 7.3 * 0.11, 0.028],
    [850.0, 7.0 * 0.10, 0.033],
    [980.0, 6.0 * 0.09, 0.052],
    [1064.0, 5.9 * 0.09, 0.053],
];
const WHITE_MATTER: [[f64; 3]; 5] = [
    [670.0, 40.1 * 0.15, 0.070],
    [810.0, 38.0 * 0.13, 0.092],
    [850.0, 35.0 * 0.13, 0.100],
    [980.0, 31.0 * 0.12, 0.110],
    [1064.0, 30.0 * 0.12, 0.105],
];

const fn mean(at_500: f64, rayleigh: f64, mie: f64) -> Tissue {
    Tissue::Mean {
        at_500,
        rayleigh,
        mie,
    }
}

/// Absorbers in a tissue: volume fractions of blood, water, fat and melanosomes, and the blood's
/// oxygen saturation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Content {
    pub blood: f64,
    pub saturation: f64,
    pub water: f64,
    pub fat: f64,
    pub melanin: f64,
}

impl Tissue {
    /// Returns the tissue with one of the [`NAMES`]; `None` for the first.
    pub(crate) fn of(name: &str) -> Option<Self> {
        match name {
            "soft tissue" => Some(SOFT),
            "fatty tissue" => Some(FATTY),
            "bone" => Some(BONE),
            "gray matter" => Some(Tissue::Measured(&GRAY_MATTER)),
            "white matter" => Some(Tissue::Measured(&WHITE_MATTER)),
            _ => None,
        }
    }

    /// Returns the range of wavelengths in nm at which the tissue with a content is known.
    pub(crate) fn range(self, content: Content) -> [f64; 2] {
        match self {
            Tissue::Mean { .. } if content.fat > 0.0 => range(&FAT),
            Tissue::Mean { .. } => RANGE,
            Tissue::Measured(rows) => range(rows),
        }
    }

    /// Returns σ_s and σ_a in 1/mm at a wavelength within the range.
    pub(crate) fn coefficients(self, nm: f64, content: Content) -> [f64; 2] {
        let [reduced, absorbed] = match self {
            Tissue::Mean {
                at_500,
                rayleigh,
                mie,
            } => {
                let x = nm / 500.0;
                let relative = rayleigh * x.powi(-4) + (1.0 - rayleigh) * x.powf(-mie);
                [at_500 * relative / MM_PER_CM, content.absorption(nm)]
            }
            Tissue::Measured(rows) => between(rows, nm),
        };
        [reduced / (1.0 - MEAN_COSINE), absorbed]
    }
}

impl Content {
    /// Returns σ_a in 1/mm.
    fn absorption(self, nm: f64) -> f64 {
        let step = (RANGE[1] - RANGE[0]) / (HAEMOGLOBIN.len() - 1) as f64;
        let place = (nm - RANGE[0]) / step;
        let i = (place as usize).min(HAEMOGLOBIN.len() - 2);
        let t = place - i as f64;
        let extinction = |k: usize| HAEMOGLOBIN[i][k] * (1.0 - t) + HAEMOGLOBIN[i + 1][k] * t;
        let s = self.saturation;
        let molar = s * extinction(0) + (1.0 - s) * extinction(1);
        let blood = std::f64::consts::LN_10 * molar * HAEMOGLOBIN_IN_BLOOD;
        let [water] = between(&WATER, nm);
        let fat = if self.fat > 0.0 {
            let [fat] = between(&FAT, nm);
            self.fat * fat
        } else {
            0.0
        };
        let melanin = self.melanin * melanosome(nm);
        (self.blood * blood + self.water * water + fat + melanin) / MM_PER_CM
    }
}

/// Returns the absorption coefficient inside a melanosome of the skin in 1/cm. Source: S. L. Jacques,
/// "Melanosome absorption coefficient", Oregon Medical Laser Center (1998). Concentrations of melanin
/// in melanosomes vary tenfold.
fn melanosome(nm: f64) -> f64 {
    1.70e12 * nm.powf(-3.48)
}

/// Returns the range of the first column of a table.
fn range<const N: usize>(rows: &[[f64; N]]) -> [f64; 2] {
    [rows[0][0], rows[rows.len() - 1][0]]
}

/// Interpolates the other columns of a table linearly at a value `x` of the first column, which
/// increases.
fn between<const N: usize, const M: usize>(rows: &[[f64; N]], x: f64) -> [f64; M] {
    let next = rows
        .partition_point(|row| row[0] <= x)
        .clamp(1, rows.len() - 1);
    let (low, high) = (&rows[next - 1], &rows[next]);
    let t = (x - low[0]) / (high[0] - low[0]);
    std::array::from_fn(|k| low[k + 1] * (1.0 - t) + high[k + 1] * t)
}
