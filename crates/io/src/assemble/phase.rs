//! Phase functions.

use super::context::Context;
use super::texture::texture;
use super::{flakes, suspension};
use crate::query::{Input, Query, numbers, unknown_plugin};
use crate::scene::{ObjectDescription, PluginKind};
use crate::schema;
use std::sync::Arc;
use transport::Spectrum;
use transport::phase::{Phase, PhaseError};
use transport::volume::VolumeTexture;

/// Builds the phase function that an object describes; isotropic after an error.
pub(super) fn build(object: &ObjectDescription, context: &mut Context) -> Phase {
    let mut query = Query::new(object, context.diagnostics);
    let phase = match object.plugin.as_str() {
        "hg" => return henyey_greenstein(object, context),
        "tabphase" => tabulated(&mut query),
        "mie" => return suspension::mie(object, context),
        "sggx" => {
            let flakes = flakes::build(object, context);
            return flakes.map_or_else(Phase::isotropic, |phase| accepted(object, phase, context));
        }
        "blendphase" => return blend(object, context),
        "mixturephase" => return mixture(object, context),
        _ => {
            let row = schema::find(PluginKind::Phase, &object.plugin);
            let Some(constructor) = row.and_then(|row| row.phase) else {
                unknown_plugin(object, context.diagnostics);
                return Phase::isotropic();
            };
            constructor(&mut |name| query.float(name))
        }
    };
    query.finish(&[]);
    accepted(object, phase, context)
}

/// Reports the error of a phase function, and returns an isotropic one instead.
fn accepted(
    object: &ObjectDescription,
    phase: Result<Phase, PhaseError>,
    context: &mut Context,
) -> Phase {
    context
        .accept(&object.location, phase)
        .unwrap_or_else(Phase::isotropic)
}

/// Builds a Henyey–Greenstein phase function, whose mean cosine may vary in space.
fn henyey_greenstein(object: &ObjectDescription, context: &mut Context) -> Phase {
    let mut query = Query::new(object, context.diagnostics);
    let volume = query.stand_in(PluginKind::Volume, "g");
    let g = if volume.is_none() {
        query.float("g")
    } else {
        0.0
    };
    query.finish(&[]);
    let phase = match volume.and_then(|v| varying(v, object, "g", [-1.0, 1.0], context)) {
        Some(VolumeTexture::Grid(grid)) => Phase::henyey_greenstein_grid(grid),
        Some(VolumeTexture::Uniform(value)) => Phase::henyey_greenstein(value[0]),
        None => Phase::henyey_greenstein(g),
    };
    accepted(object, phase, context)
}

/// Reads a number that varies in space; `None` after an error.
fn varying(
    volume: &Arc<ObjectDescription>,
    object: &ObjectDescription,
    name: &str,
    allowed: [f64; 2],
    context: &mut Context,
) -> Option<VolumeTexture> {
    let errors = context.diagnostics.error_count();
    let texture = texture(Input::Object(volume), object, name, allowed, context);
    if let VolumeTexture::Grid(grid) = &texture
        && grid.channels() != 1
    {
        let message = format!(
            "'{name}' has one channel, the volume has {}",
            grid.channels()
        );
        context.error_at(&volume.location, message);
    }
    (context.diagnostics.error_count() == errors).then_some(texture)
}

/// Reads a phase function that is tabulated at equally spaced cosines, or given by quantiles of the
/// cosine.
fn tabulated(query: &mut Query) -> Result<Phase, PhaseError> {
    const VALUES: &str = "values";
    const QUANTILES: &str = "quantiles";
    if query.has(QUANTILES) {
        if query.has(VALUES) {
            query.error(QUANTILES, "give 'values' or 'quantiles', not both");
        }
        let errors = query.diagnostics().error_count();
        let quantiles = query.numbers(QUANTILES);
        if query.diagnostics().error_count() > errors {
            return Ok(Phase::isotropic());
        }
        return Phase::quantiles(quantiles);
    }
    let values = query.string(VALUES);
    match numbers(&values) {
        Some(values) if values.len() >= 2 => {
            let last = (values.len() - 1) as f64;
            let cosines = (0..values.len()).map(|i| -1.0 + 2.0 * i as f64 / last);
            Phase::tabulated(cosines.collect(), &values)
        }
        _ => {
            let message =
                "'values': expected at least two numbers, at equally spaced cosines from -1 to 1";
            query.error(VALUES, message);
            Ok(Phase::isotropic())
        }
    }
}

/// Builds a blend of two phase functions, whose weight may vary in space.
fn blend(object: &ObjectDescription, context: &mut Context) -> Phase {
    let mut query = Query::new(object, context.diagnostics);
    let volume = query.stand_in(PluginKind::Volume, "weight");
    let weight = match volume {
        Some(_) => 0.0,
        None => query.float("weight"),
    };
    let nested = query.children(PluginKind::Phase);
    query.finish(&[]);
    let [first, second] = nested[..] else {
        let message = format!(
            "blendphase takes two phase functions, this has {}",
            nested.len()
        );
        context.error_at(&object.location, message);
        return Phase::isotropic();
    };
    let phases = [first, second].map(|phase| build(phase, context));
    let uniform = VolumeTexture::Uniform(Spectrum::splat(weight));
    let weight = match volume {
        Some(volume) => varying(volume, object, "weight", [0.0, 1.0], context).unwrap_or(uniform),
        None => uniform,
    };
    accepted(object, Phase::blend_by(phases, weight), context)
}

/// Amount by which the sum of the weights of a mixture may fall short of 1.
const ROUNDING: f64 = 1e-3;

/// Maximum number of phase functions in a mixture: evaluation visits each in turn.
const MAX_PHASES: usize = 100;
/// Maximum weight, which keeps sums of weights finite.
const MAX_WEIGHT: f64 = 1e100;

/// Builds a mixture of phase functions by their weights.
fn mixture(object: &ObjectDescription, context: &mut Context) -> Phase {
    let mut query = Query::new(object, context.diagnostics);
    let weights = numbers(&query.string("weights")).unwrap_or_default();
    let nested = query.children(PluginKind::Phase);
    let is_weight = |w: &f64| (0.0..=MAX_WEIGHT).contains(w);
    let count = nested.len();
    if count > MAX_PHASES {
        let message =
            format!("a mixture holds at most {MAX_PHASES} phase functions, this has {count}");
        context.error_at(&object.location, message);
        return Phase::isotropic();
    }
    if count == 0 || weights.len() != count || !weights.iter().all(is_weight) {
        let message = format!(
            "'weights' are numbers from 0 to {MAX_WEIGHT:e}, one for each of the {count} phase functions"
        );
        query.error("weights", message);
        query.finish(&[]);
        return Phase::isotropic();
    }
    if weights.iter().sum::<f64>() < 1.0 - ROUNDING {
        let message = "the weights must add up to 1: give absorption by 'sigma_a' or 'albedo'";
        query.error("weights", message);
    }
    query.finish(&[]);
    let phases = nested.into_iter().map(|phase| build(phase, context));
    let mut parts = weights.into_iter().zip(phases.collect::<Vec<_>>());
    let Some((mut sum, mut mixed)) = parts.next() else {
        return Phase::isotropic();
    };
    for (weight, phase) in parts {
        sum += weight;
        let share = if sum > 0.0 { weight / sum } else { 0.0 };
        let blended = Phase::blend([mixed, phase], share);
        mixed = accepted(object, blended, context);
    }
    mixed
}
