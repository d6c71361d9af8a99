//! Fluorophores in media (docs/theory.md#fluorescence).

use super::channels::Channels;
use super::context::Context;
use super::described::FLUOROPHORE;
use super::texture_role::Role;
use crate::cie::SPEED_OF_LIGHT;
use crate::diagnostic::lints;
use crate::query::Query;
use crate::scene::{ObjectDescription, SpectrumValue};
use transport::Spectrum;
use transport::medium::{Fluorescence, Medium};
use transport::volume::VolumeTexture;

/// Parameters that a fluorophore needs.
const EMISSION: [&str; 2] = ["fluorescence_wavelengths", "quantum_yields"];
/// Lifetime in seconds above which a number is probably in other units.
const MAX_PLAUSIBLE: f64 = 1e-2;

/// Fluorophore as given in a scene file.
pub(super) struct Fluorophore {
    absorption: SpectrumValue,
    /// Wavelengths of the emission in nm, each with the fraction of absorbed photons that it gets.
    emission: Vec<(f64, f64)>,
    /// Mean time between absorption and emission, times the speed of light, in scene units.
    mean_delay: f64,
}

impl Fluorophore {
    /// Reads the fluorophore of a medium, if it has one.
    pub(super) fn of(query: &mut Query) -> Option<Self> {
        let mean_delay = mean_delay(query);
        if !query.has(FLUOROPHORE) {
            let given = EMISSION.into_iter().find(|name| query.has(name));
            if let Some(name) = given {
                let message =
                    format!("'{name}' needs '{FLUOROPHORE}', the absorption by the fluorophore");
                query.error(name, message);
            }
            return None;
        }
        let absorption = query.spectrum(FLUOROPHORE);
        let missing = EMISSION.into_iter().find(|name| !query.has(name));
        if let Some(name) = missing {
            let message = format!(
                "a fluorophore needs '{name}': give each of the 'fluorescence_wavelengths' in nm its quantum yield"
            );
            query.error(FLUOROPHORE, message);
            return None;
        }
        let [wavelengths, yields] = EMISSION.map(|name| query.numbers(name));
        let total: f64 = yields.iter().sum();
        let problem = if wavelengths.is_empty() || wavelengths.len() != yields.len() {
            Some(format!(
                "a fluorophore needs a quantum yield for each wavelength, but there are {} for {}",
                yields.len(),
                wavelengths.len()
            ))
        } else if yields.iter().any(|y| *y < 0.0) || total > 1.0 {
            Some(format!(
                "quantum yields are emitted photons per absorbed photon, at least 0 and in total at most 1, but they \
                 are '{}'",
                query.string("quantum_yields")
            ))
        } else {
            None
        };
        if let Some(message) = problem {
            query.error("quantum_yields", message);
            return None;
        }
        Some(Fluorophore {
            absorption,
            emission: wavelengths.into_iter().zip(yields).collect(),
            mean_delay,
        })
    }

    /// Adds the fluorophore to a medium.
    fn join(&self, medium: Medium, object: &ObjectDescription, context: &mut Context) -> Medium {
        let uniform = [&medium.sigma_t, &medium.albedo].map(VolumeTexture::uniform);
        let ([Some(sigma_t), Some(albedo)], None) = (uniform, medium.phase.flakes()) else {
            let message = format!(
                "'{FLUOROPHORE}' needs a medium with uniform coefficients that do not depend on the direction: for a \
                 concentration that varies, use a volume of labels"
            );
            context.error_at(&object.location, message);
            return medium;
        };
        let role = Role::Coefficient;
        let by_fluorophore = context.spectrum(&self.absorption, role, &object.location);
        if by_fluorophore.0.iter().any(|v| *v < 0.0) {
            let message = format!("'{FLUOROPHORE}' must not be negative");
            context.error_at(&object.location, message);
            return medium;
        }
        let Some(power_yields) = self.power_yields(object, context) else {
            return medium;
        };
        let scattering = sigma_t * albedo;
        let total = sigma_t + by_fluorophore;
        let divided = |part: Spectrum, whole: Spectrum| {
            part.zip(whole, |p, w| if w > 0.0 { p / w } else { 0.0 })
        };
        let fraction = divided(by_fluorophore, total - scattering)[0].min(1.0);
        let power_yields: Vec<f64> = power_yields.iter().map(|y| y * fraction).collect();
        let fluorescence = Fluorescence::new(&power_yields, self.mean_delay);
        if fluorescence.is_none() {
            let message = "the fluorophore is too strong or its lifetime too long to be computed: check 'metres_per_unit', \
                           'lifetime' and the coefficients";
            context.error_at(&object.location, message);
        }
        Medium {
            sigma_t: VolumeTexture::Uniform(total),
            albedo: VolumeTexture::Uniform(divided(scattering, total)),
            fluorescence,
            ..medium
        }
    }

    /// Returns the power emitted in each channel of the film, as a fraction of the power that the
    /// fluorophore absorbs in the channel of this group; `None` after an error.
    fn power_yields(&self, object: &ObjectDescription, context: &mut Context) -> Option<Vec<f64>> {
        let (Channels::Wavelengths { nm, .. }, Some(absorbed)) =
            (context.channels, context.wavelength())
        else {
            let message = "fluorescence needs the wavelengths of excitation and emission: give the film the pixel_format \
                           'spectral', and 'wavelengths' in nm";
            context.error_at(&object.location, message);
            return None;
        };
        self.check(nm, object, context)?;
        let emitted = |emitted: &f64| {
            if *emitted <= absorbed {
                return 0.0;
            }
            let of_channel = self.emission.iter().filter(|(nm, _)| nm == emitted);
            let quantum_yield: f64 = of_channel.map(|(_, quantum_yield)| quantum_yield).sum();
            // Photons of longer wavelengths have less energy.
            quantum_yield * absorbed / emitted
        };
        Some(nm.iter().map(emitted).collect())
    }

    /// Checks that the film has the wavelengths of the emission, and warns about emission without
    /// excitation. Returns `None` after an error.
    fn check(&self, nm: &[f64], object: &ObjectDescription, context: &mut Context) -> Option<()> {
        let listed: Vec<String> = nm.iter().map(f64::to_string).collect();
        let listed = listed.join(", ");
        if let Some((missing, _)) = self
            .emission
            .iter()
            .find(|(emitted, _)| !nm.contains(emitted))
        {
            let message = format!(
                "'fluorescence_wavelengths' must be among the film's wavelengths, {listed} nm, but {missing} nm is not"
            );
            context.error_at(&object.location, message);
            return None;
        }
        let absorbs = |group: usize| {
            let there = context.channels.spectrum(&self.absorption, group);
            there.is_ok_and(|value| value[0] > 0.0)
        };
        let absorbing = nm.iter().enumerate().filter(|(group, _)| absorbs(*group));
        let shortest = absorbing.map(|(_, nm)| *nm).fold(f64::INFINITY, f64::min);
        let unexcited = self
            .emission
            .iter()
            .find(|(nm, y)| *nm <= shortest && *y > 0.0);
        if let Some((emitted, _)) = unexcited {
            let message = format!(
                "nothing excites the fluorescence at {emitted} nm: the fluorophore absorbs at none of the film's shorter \
                 wavelengths, and light excites only longer ones"
            );
            let warning = lints::warning(lints::FLUORESCENCE, message);
            context.diagnostics.push(warning.at(&object.location));
        }
        Some(())
    }
}

/// Adds a fluorophore, if there is one, to a medium.
pub(super) fn with_fluorophore(
    fluorophore: Option<Fluorophore>,
    medium: Medium,
    object: &ObjectDescription,
    context: &mut Context,
) -> Medium {
    match fluorophore {
        Some(fluorophore) => fluorophore.join(medium, object, context),
        None => medium,
    }
}

/// Reads the mean time between absorption and emission, times the speed of light, in scene units.
fn mean_delay(query: &mut Query) -> f64 {
    let lifetime = query.float("lifetime");
    let has_unit = query.has("metres_per_unit");
    if lifetime > 0.0 && !has_unit {
        let message = "'lifetime' needs 'metres_per_unit', the length of a scene unit in metres: 1e-3 if scene units are mm";
        query.error("lifetime", message);
        return 0.0;
    }
    if lifetime > MAX_PLAUSIBLE {
        let message = format!("'lifetime' is {lifetime} s: write 4e-9 for 4 ns");
        query.warning(lints::FLUORESCENCE, "lifetime", message);
    }
    if !has_unit {
        return 0.0;
    }
    lifetime * SPEED_OF_LIGHT / query.float("metres_per_unit")
}
