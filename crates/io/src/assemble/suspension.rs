//! Suspended spheres, given by size and index, and the media that hold them
//! (docs/scene/phase-functions.md#mie-scattering).

use super::colour;
use super::context::Context;
use crate::diagnostic::lints;
use crate::query::Query;
use crate::scene::{ObjectDescription, SpectrumValue};
use transport::Spectrum;
use transport::phase::{Mie, Phase, PhaseError, Spheres};

/// Micrometres per millimetre; coefficients are per millimetre.
const UM_PER_MM: f64 = 1e3;
/// Micrometres per nanometre, the unit of wavelengths.
const UM_PER_NM: f64 = 1e-3;
/// Volume fraction above which spheres do not scatter independently.
const MAX_INDEPENDENT_FRACTION: f64 = 0.1;
/// Builds the phase function of type `mie`, at the wavelength of the group's channel.
pub(super) fn mie(object: &ObjectDescription, context: &mut Context) -> Phase {
    let channel = context.wavelength();
    let mut q = Query::new(object, context.diagnostics);
    let wavelength = match (q.has("wavelength"), channel) {
        (false, Some(nm)) => Some(nm),
        (false, None) => {
            let message = "scattering by spheres depends on the wavelength, but the film has none: give it the \
                           pixel_format \"spectral\" and wavelengths such as \"450, 550, 650\" (nm), or give a 'wavelength' here";
            q.error("wavelength", message);
            None
        }
        (true, _) => Some(q.float("wavelength")),
    };
    let radius = q.float("radius");
    let geometric_deviation = q.float("geometric_deviation");
    let eta = q.spectrum("eta");
    let k = q.spectrum("k");
    let exterior = q.spectrum("ext_eta");
    q.finish(&[]);
    let Some(wavelength) = wavelength else {
        return Phase::isotropic();
    };
    let mut at = |value: &SpectrumValue| at_wavelength(value, wavelength, object, context);
    let (Some(n), Some(k), Some(exterior)) = (at(&eta), at(&k), at(&exterior)) else {
        return Phase::isotropic();
    };
    let spheres = Spheres {
        radius,
        geometric_deviation,
        n,
        k,
        exterior,
        wavelength: wavelength * UM_PER_NM,
    };
    let phase = Phase::mie(&spheres);
    let phase = context.accept(&object.location, phase.map_err(|e| advice(&e)));
    phase.unwrap_or_else(Phase::isotropic)
}

/// Returns the message about an error of spheres, with advice.
fn advice(error: &PhaseError) -> String {
    match error {
        PhaseError::SphereSize { .. } => format!(
            "{error}: check that 'radius' is in µm and 'wavelength' in nm; larger drops are scenery, of shapes and \
             bsdfs, or a 'tabphase'"
        ),
        PhaseError::SphereIndex { .. } => format!("{error}: check 'eta', 'k' and 'ext_eta'"),
        PhaseError::Matched => format!("{error}: 'eta' and 'ext_eta' must differ"),
        _ => error.to_string(),
    }
}

/// Returns a spectrum at a wavelength in nm; `None` after an error.
fn at_wavelength(
    value: &SpectrumValue,
    nm: f64,
    object: &ObjectDescription,
    context: &mut Context,
) -> Option<f64> {
    let errors = context.diagnostics.error_count();
    let loaded = context.loaded(value, &object.location).into_owned();
    if context.diagnostics.error_count() > errors {
        return None;
    }
    let found = colour::at(&loaded, nm);
    if found.is_none() {
        let message = "the index of spheres is a number, or pairs of wavelengths in nm and numbers";
        context.error_at(&object.location, message);
    }
    found
}

/// Concentration of the spheres in a medium.
#[derive(Clone, Copy)]
pub(super) enum Concentration {
    /// Fraction of the volume.
    Fraction(f64),
    /// Number per cubic millimetre.
    Number(f64),
}

/// Reads the concentration of the spheres in a medium, if given.
pub(super) fn concentration(q: &mut Query) -> Option<Concentration> {
    let names = ["volume_fraction", "number_density"];
    let [fraction, number] = names.map(|name| q.has(name));
    if !fraction && !number {
        return None;
    }
    let others = ["sigma_s", "sigma_t", "albedo", "material", "tissue"];
    if let Some(other) = others.into_iter().find(|name| q.has(name)) {
        let message = "spheres give scattering and absorption: leave it out, or give no concentration; sigma_a may \
                       be given as well, as that of the medium around the spheres";
        q.error(other, message);
    }
    if fraction && number {
        q.error(
            "number_density",
            "give volume_fraction or number_density, not both",
        );
    }
    if !fraction {
        return Some(Concentration::Number(q.float("number_density")));
    }
    let share = q.float("volume_fraction");
    if share > MAX_INDEPENDENT_FRACTION {
        let message = format!(
            "the spheres fill more than {MAX_INDEPENDENT_FRACTION} of the volume: morgana assumes independent scattering, which does not hold for dense spheres"
        );
        q.warning(lints::DENSE_SPHERES, "volume_fraction", message);
    }
    Some(Concentration::Fraction(share))
}

impl Concentration {
    /// Returns σ_s and σ_a of the spheres per millimetre.
    pub(super) fn coefficients(self, mie: &Mie) -> [f64; 2] {
        let per_cubic_um = match self {
            Concentration::Fraction(share) => share / mie.volume(),
            Concentration::Number(number) => number / UM_PER_MM.powi(3),
        };
        let cross_sections = [
            mie.scattering_cross_section(),
            mie.absorption_cross_section(),
        ];
        cross_sections.map(|c| c * per_cubic_um * UM_PER_MM)
    }

    /// Returns σ_s and σ_a of spheres in a medium that absorbs light itself; σ_s is zero after an
    /// error.
    pub(super) fn in_medium(
        self,
        medium: &Suspension,
        object: &ObjectDescription,
        context: &mut Context,
    ) -> [Spectrum; 2] {
        let Phase::Mie(mie) = medium.phase else {
            if medium.plugin != Some("mie") {
                let message = "'volume_fraction' and 'number_density' need a phase function 'mie' of the medium, outside of a mixture";
                context.error_at(&object.location, message);
            }
            return [Spectrum::ZERO, medium.absorption];
        };
        let [s, a] = self.coefficients(mie).map(Spectrum::splat);
        [s, a + medium.absorption]
    }
}

/// Medium that holds spheres.
pub(super) struct Suspension<'a> {
    /// Phase function.
    pub phase: &'a Phase,
    /// Type of the phase function, if the medium has one.
    pub plugin: Option<&'a str>,
    /// Absorption coefficient σ_a of the matter around the spheres.
    pub absorption: Spectrum,
}
