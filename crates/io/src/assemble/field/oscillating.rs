//! Index of sound with one frequency, from samples of its complex amplitude.

use super::super::context::Context;
use super::super::sound_record::SoundRecord;
use super::super::{placed_grid, units};
use super::{placed, sampled_waves};
use crate::diagnostic::lints;
use crate::scene::ObjectDescription;
use eikonal::field::{Placement, SampledSound, SoundSamples};
use eikonal::{Aabb, Field};
use glam::{DAffine3, DMat3, DVec3};

/// Samples of sound with one frequency.
pub(super) struct Amplitudes {
    /// Real and imaginary parts of the pressure in Pa; x varies fastest.
    pub pressure: Vec<[f64; 2]>,
    /// Grid of the samples and their origin.
    pub record: SoundRecord,
    /// Frequency in Hz.
    pub frequency: f64,
    /// Wavelength of the sound in the world.
    pub wavelength: f64,
    /// Index without sound.
    pub n0: f64,
    /// Change of the index with the pressure.
    pub slope: f64,
    /// Elasto-optic coefficient ρc² ∂n/∂p, if the scene gives it.
    pub elasto_optic: Option<f64>,
}

/// Builds the field of sound with one frequency.
pub(super) fn oscillating(
    samples: Amplitudes,
    object: &ObjectDescription,
    context: &mut Context,
) -> Option<Field> {
    // Check that the samples have the stated wavelength.
    let warning = sampled_waves::warning(&samples.pressure, &samples.record, samples.wavelength);
    let warning = warning.map(|warning| warning.at(&object.location));
    warning
        .into_iter()
        .for_each(|warning| context.diagnostics.push(warning));
    // Convert pressure to index, and check its size.
    let in_index = |[re, im]: &[f64; 2]| [re, im].map(|v| (samples.slope * v) as f32);
    let amplitude: Vec<[f32; 2]> = samples.pressure.iter().map(in_index).collect();
    drop(samples.pressure);
    let most = amplitude.iter().map(|[re, im]| f64::from(re.hypot(*im)));
    let most = most.fold(0.0, f64::max);
    if let Some(warning) = units::of_pressure([samples.n0 - most, samples.n0 + most], samples.n0) {
        let message = format!("the sound changes the index by up to {most:.3e}: {warning}");
        let help = match object.plugin.as_str() {
            "transducer" => "check 'pressure' and 'dn_dp'",
            _ => "check the units of the file, 'dn_dp' and 'scale'",
        };
        let warning = lints::warning(lints::IMPLAUSIBLE_INDEX, message).help(help.to_owned());
        context.diagnostics.push(warning.at(&object.location));
    }
    // Record grid and sound.
    let SoundRecord {
        size,
        nodes,
        to_world,
        ..
    } = samples.record;
    let quantity = placed_grid::Quantity::Index;
    let grid = placed_grid::Placed::new(quantity, to_world, &object.location);
    context.grids.push(grid);
    context.sounds.push(SoundRecord {
        frequency: Some(samples.frequency),
        ..samples.record
    });
    // Build the field.
    let (bounds, rest) = in_place(to_world);
    let scale = rest.map_or(1.0, |map| map.matrix3.determinant().abs().cbrt());
    let field = SampledSound::new(SoundSamples {
        size,
        bounds,
        placement: [Placement::Centers, Placement::Nodes][usize::from(nodes)],
        amplitude,
        n0: samples.n0,
        frequency: samples.frequency,
        wavelength: samples.wavelength / scale,
        noise: 0.0,
    });
    let field = field.and_then(|field| match samples.elasto_optic {
        Some(elasto_optic) => field.with_elasto_optic(elasto_optic),
        None => Ok(field),
    });
    let field = context.accept(&object.location, field)?;
    placed(field.into(), rest, object, context)
}

/// Returns the box of the samples and the transform needed during rendering; the transform is
/// `None` if the box is aligned with the axes.
pub(super) fn in_place(map: DAffine3) -> (Aabb, Option<DAffine3>) {
    let diagonal = DMat3::from_diagonal(map.matrix3.diagonal());
    let aligned = map.matrix3 == diagonal && diagonal.diagonal().min_element() > 0.0;
    if aligned {
        let end = map.transform_point3(DVec3::ONE);
        (Aabb::new(map.translation, end), None)
    } else {
        (Aabb::new(DVec3::ZERO, DVec3::ONE), Some(map))
    }
}
