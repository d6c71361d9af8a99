//! Integrators.

use super::context::Context;
use super::*;

/// Names under which scene files may ask for the path tracer.
const PATH_TRACERS: [&str; 3] = ["path", "volpath", "volpathmis"];

/// How a scene is to be rendered.
pub(super) struct Method {
    pub integrator: Integrator,
    pub tolerance: Tolerance,
    pub reflections: u32,
}

/// The scene's integrator, or the path tracer with its defaults.
pub(super) fn build(
    object: Option<&Object>,
    options: &LoadOptions,
    context: &mut Context,
) -> Method {
    if let Some(name) = options.integrator.as_deref().filter(|n| !NAMES.contains(n)) {
        let help = format!("known integrators: {}", NAMES.join(", "));
        let message = format!("unknown integrator '{name}'");
        context
            .diagnostics
            .push(Diagnostic::error(message).help(help));
    }
    let default = PathTracer::default();
    let Some(object) = object else {
        return Method {
            integrator: Integrator::Path(default),
            tolerance: Tolerance::default(),
            reflections: 0,
        };
    };
    if !PATH_TRACERS.contains(&object.plugin.as_str()) {
        unknown_plugin(object, &PATH_TRACERS, context.diagnostics);
    }
    let mut query = Query::new(object, context.diagnostics);
    let max_depth = query.integer_in("max_depth", -1..=1_000_000, -1);
    let rr_depth = query.integer_in("rr_depth", 1..=1_000_000, i64::from(default.rr_depth));
    let tolerance = query.float_in("tolerance", 1e-12..=1e-4, Tolerance::default().get());
    let reflections = query.integer_in("reflections", 0..=32, 0);
    query.finish(&[]);
    let path = PathTracer {
        max_depth: u32::try_from(max_depth).ok(),
        rr_depth: rr_depth as u32,
    };
    Method {
        integrator: Integrator::Path(path),
        tolerance: Tolerance::new(tolerance),
        reflections: reflections as u32,
    }
}
