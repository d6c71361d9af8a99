//! Refractive index and density of air.

use crate::query::Query;

/// Density in kg/m³ of dry air at 15 °C and 101 325 Pa with 450 ppm CO₂ (P. E. Ciddor, "Refractive
/// index of air: new equations for the visible and near infrared", Appl. Opt. 35, 1996, eq. 4).
const STANDARD_DENSITY: f64 = 1.225_4;

/// Returns n − 1 of standard air at a wavelength in nm (E. R. Peck and K. Reeder, "Dispersion of
/// air", J. Opt. Soc. Am. 62, 1972, eq. 2).
fn refractivity(nm: f64) -> f64 {
    let wave_number = 1e3 / nm; // per µm
    let s = wave_number * wave_number;
    1e-8 * (5_791_817.0 / (238.0185 - s) + 167_909.0 / (57.362 - s))
}

/// Returns K of n = 1 + Kρ in m³/kg at a wavelength in nm: n − 1 of standard air divided by its
/// density. K of air varies by less than 1e-3 with temperature and pressure.
fn gladstone_dale(nm: f64) -> f64 {
    refractivity(nm) / STANDARD_DENSITY
}

/// Reads the Gladstone–Dale constant K in m³/kg. It is given directly, or it is the value of air at
/// a wavelength, by default the wavelength of the channel.
pub(super) fn constant(channel: Option<f64>, q: &mut Query) -> f64 {
    match (q.has("constant"), q.has("wavelength")) {
        (false, false) if let Some(nm) = channel => {
            let known = q.limits("wavelength");
            if !known.contains(nm) {
                let message = format!(
                    "the index of air is known from {known} nm, not at the film's {nm} nm: give \
                     a 'wavelength' or a 'constant'"
                );
                q.error("filename", message);
            }
            gladstone_dale(nm)
        }
        (true, false) => q.float("constant"),
        (false, true) => gladstone_dale(q.float("wavelength")),
        (false, false) => {
            let message = "the index of air needs a 'wavelength' in nm, or \
                           a 'constant', K in m³/kg";
            q.error("filename", message);
            0.0
        }
        (true, true) => {
            q.error(
                "wavelength",
                "give wavelength, for air, or constant, not both",
            );
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values tabulated in W. Merzkirch, Flow Visualization, 2nd ed., 1987, table 3.1, to four digits.
    #[test]
    fn agrees_with_tabulated_constants() {
        for (nm, k) in [
            (447.2, 0.2290),
            (480.1, 0.2281),
            (509.7, 0.2274),
            (567.7, 0.2264),
            (607.4, 0.2259),
        ] {
            let found = gladstone_dale(nm) * 1e3;
            assert!((found - k).abs() < 2e-4, "{nm} nm: {found}, {k}");
        }
    }

    /// n − 1 = 2.7717e-4 at 587.6 nm by Ciddor's formula of 1996, eq. 1.
    #[test]
    fn standard_air() {
        assert!((refractivity(587.6) - 2.7717e-4).abs() < 2e-8);
    }
}
