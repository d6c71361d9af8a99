//! Phase functions.

use super::context::Context;
use crate::query::{Query, unknown_plugin};
use crate::scene::{ObjectDescription, PluginKind};
use transport::phase::{Phase, PhaseError};

const KNOWN: [&str; 6] = [
    "isotropic",
    "hg",
    "vmf",
    "rayleigh",
    "tabphase",
    "blendphase",
];

/// The phase function that an object describes; isotropic after an error.
pub(super) fn build(object: &ObjectDescription, context: &mut Context) -> Phase {
    let mut query = Query::new(object, context.diagnostics);
    let phase = match object.plugin.as_str() {
        "isotropic" => Ok(Phase::isotropic()),
        "hg" => Phase::henyey_greenstein(query.float_or("g", 0.8)),
        "vmf" => Phase::von_mises_fisher(query.float_in("kappa", 0.0.., None)),
        "rayleigh" => Ok(Phase::rayleigh()),
        "tabphase" => tabulated(&mut query),
        "blendphase" => return blend(object, context),
        _ => {
            unknown_plugin(object, &KNOWN, context.diagnostics);
            return Phase::isotropic();
        }
    };
    query.finish(&[]);
    accepted(object, phase, context)
}

fn accepted(
    object: &ObjectDescription,
    phase: Result<Phase, PhaseError>,
    context: &mut Context,
) -> Phase {
    context
        .accept(&object.location, phase)
        .unwrap_or_else(Phase::isotropic)
}

fn tabulated(query: &mut Query) -> Result<Phase, PhaseError> {
    let values = query.string("values");
    match numbers(&values) {
        Some(values) if values.len() >= 2 => {
            let last = (values.len() - 1) as f64;
            let cosines = (0..values.len()).map(|i| -1.0 + 2.0 * i as f64 / last);
            Phase::tabulated(cosines.collect(), &values)
        }
        _ => {
            let message =
                "'values': expected at least two numbers, at equally spaced cosines from -1 to 1";
            query.error("values", message);
            Ok(Phase::isotropic())
        }
    }
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    let words = text.split([',', ' ']).filter(|w| !w.is_empty());
    words.map(|w| w.parse().ok()).collect()
}

fn blend(object: &ObjectDescription, context: &mut Context) -> Phase {
    let mut query = Query::new(object, context.diagnostics);
    let weight = query.float_in("weight", 0.0..=1.0, None);
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
    accepted(object, Phase::blend(phases, weight), context)
}
