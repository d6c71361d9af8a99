//! Indices that depend on the wavelength.

use super::super::context::Context;
use crate::query::Query;
use crate::scene::{ObjectDescription, PluginKind};
use eikonal::Field;
use eikonal::Shown;
use eikonal::field::{Constant, Scaled};
use std::ops::RangeInclusive;

/// Range of plausible indices. Indices outside it come from wrong units: coefficients are for
/// wavelengths in µm.
const INDICES: RangeInclusive<f64> = 0.5..=10.0;

/// Index as a function of the wavelength λ in µm.
enum Law {
    /// Cauchy's law n = A + B/λ² + C/λ⁴, as [A, B, C].
    Cauchy([f64; 3]),
    /// Sellmeier's law n² = 1 + Σ Bᵢλ²/(λ² − Cᵢ), as pairs (Bᵢ, Cᵢ).
    Sellmeier([(f64, f64); 3]),
}

impl Law {
    fn read(plugin: &str, q: &mut Query) -> Law {
        match plugin {
            "cauchy" => Law::Cauchy([q.float("a"), q.float("b"), q.float("c")]),
            _ => Law::Sellmeier([
                (q.float("b1"), q.float("c1")),
                (q.float("b2"), q.float("c2")),
                (q.float("b3"), q.float("c3")),
            ]),
        }
    }

    /// Returns n at a wavelength in nm; not a number (NaN) where the formula has no value.
    fn index(&self, nm: f64) -> f64 {
        let square = (nm * 1e-3).powi(2);
        match self {
            Law::Cauchy([a, b, c]) => a + b / square + c / (square * square),
            Law::Sellmeier(terms) => {
                let term = |(b, c): &(f64, f64)| b * square / (square - c);
                (1.0 + terms.iter().map(term).sum::<f64>()).sqrt()
            }
        }
    }
}

/// Builds the field of a volume of type `cauchy` or `sellmeier` at the wavelength of the group;
/// `None` after an error. The index is constant in space, or the index of the nested volume times
/// n(λ)/n(λ₀).
pub(super) fn build(object: &ObjectDescription, context: &mut Context) -> Option<Field> {
    let nm = context.wavelength();
    let mut q = Query::new(object, context.diagnostics);
    let law = Law::read(&object.plugin, &mut q);
    let nested = q.child(PluginKind::Volume).cloned();
    let reference = match (&nested, q.has("reference_wavelength")) {
        (Some(_), given) => {
            let nm = q.float("reference_wavelength");
            given.then_some(nm)
        }
        (None, false) => None,
        (None, true) => {
            let message = "'reference_wavelength' needs a nested volume, which gives the index at that wavelength";
            q.error("reference_wavelength", message);
            None
        }
    };
    // Evaluate the law at the wavelength, and at the reference wavelength.
    let Some(nm) = nm else {
        let message = format!(
            "an index of type '{}' depends on the wavelength, but the film has none: give it the \
             pixel_format \"spectral\" and wavelengths such as \"450, 550, 650\" (nm), or use an index of type 'constant'; \
             morgana.load_field takes a 'wavelength'",
            object.plugin
        );
        q.error("type", message);
        q.finish(&[]);
        return None;
    };
    let mut index = |nm: f64| {
        let n = law.index(nm);
        if !INDICES.contains(&n) {
            let message = format!(
                "the index at {nm} nm is {}: check the coefficients, which are for wavelengths in µm (c1 \
                 to c3 of 'sellmeier' in µm²)",
                Shown::rounded(n)
            );
            q.error("type", message);
        }
        n
    };
    let n = index(nm);
    let reference = reference.map(&mut index);
    q.finish(&[]);
    match (nested, reference) {
        (Some(nested), Some(reference)) => {
            let field = super::build(&nested, context)?;
            let scaled = Scaled::new(field, n / reference);
            context.accept(&object.location, scaled).map(Field::from)
        }
        _ => Some(Constant::new(n).into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares N-BK7 with SCHOTT's data sheet: coefficients and indices at lines F′, d, C and t.
    #[test]
    fn sellmeier_of_bk7() {
        let law = Law::Sellmeier([
            (1.03961212, 0.00600069867),
            (0.231792344, 0.0200179144),
            (1.01046945, 103.560653),
        ]);
        for (nm, n) in [
            (479.9914, 1.52283),
            (587.5618, 1.51680),
            (656.2725, 1.51432),
            (1013.98, 1.50731),
        ] {
            assert!((law.index(nm) - n).abs() < 1e-5, "{nm}: {}", law.index(nm));
        }
    }

    #[test]
    fn cauchy_is_its_formula() {
        let law = Law::Cauchy([1.5, 0.004, 2e-4]);
        assert!((law.index(500.0) - (1.5 + 0.016 + 0.0032)).abs() < 1e-14);
    }
}
