//! Samplers: number of samples, their grouping into replicates, and the instants of a period of
//! sound.

use super::context::Context;
use super::options::LoadOptions;
use crate::diagnostic::{Diagnostic, Diagnostics, lints, suggest};
use crate::query::Query;
use crate::scene::ObjectDescription;
use transport::integrator::Integrator;
use transport::renderer::Renderer;
use transport::sampling::Replicates;
use transport::scene::{Scene, SceneProblem, Subject};

/// Samplers of Mitsuba that, like `ldsampler`, spread samples evenly.
const EVEN_SAMPLERS: [&str; 6] = [
    "stratified",
    "multijitter",
    "orthogonal",
    "halton",
    "hammersley",
    "sobol",
];

/// Minimum number of replicates if no sampler is named. The error is estimated from the means of
/// replicates. An error from fewer than ten replicates counts as unreliable.
const DEFAULT_MIN_REPLICATES: u64 = 16;
/// Minimum number of replicates if a sampler without a replicate size is named.
const MIN_REPLICATES: u64 = 4;
/// Maximum relative increase of the number of samples by rounding it up to whole replicates, if a
/// sampler is named. Without a named sampler, the number does not change.
const MAX_INCREASE: f64 = 0.25;

/// Sampler that a scene or a caller names. The greatest one is used if there are several.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum SamplerRequest {
    /// No sampler is named.
    #[default]
    Open,
    /// Independent samples.
    Independent,
    /// Evenly distributed samples, in replicates whose size follows from the number of samples.
    Even,
    /// Evenly distributed samples, in replicates of a given size.
    EvenIn(Replicates),
}

impl SamplerRequest {
    /// Returns the request with the given name on command lines, if there is one.
    fn named(name: &str) -> Option<Self> {
        match name {
            "independent" => Some(SamplerRequest::Independent),
            "ldsampler" => Some(SamplerRequest::Even),
            _ => {
                let size = name.strip_prefix("ldsampler:")?.parse().ok()?;
                Replicates::new(size).map(SamplerRequest::EvenIn)
            }
        }
    }

    /// Returns true if the size of replicates follows from the number of samples.
    pub(crate) fn is_automatic(self) -> bool {
        matches!(self, SamplerRequest::Open | SamplerRequest::Even)
    }

    /// Returns the replicates for `count` samples, if the renderer supports replicates.
    pub fn replicates(self, scene: &Scene, count: u64) -> Replicates {
        let (least, increase) = match self {
            // Planted error "few replicates by default", found by morgana-io/io::samplers::replicates_grow_with_the_number_of_samples:
            // SamplerRequest::Open => (MIN_REPLICATES, 0.0),
            SamplerRequest::Open => (DEFAULT_MIN_REPLICATES, 0.0),
            SamplerRequest::Independent => return Replicates::SINGLE,
            SamplerRequest::Even => (MIN_REPLICATES, MAX_INCREASE),
            SamplerRequest::EvenIn(replicates) => return replicates,
        };
        let most = scene.whole_periods(count, Replicates::SINGLE) as f64 * (1.0 + increase);
        let fits = |replicates: &Replicates| {
            replicates.size().saturating_mul(least) <= count
                && scene.whole_periods(count, *replicates) as f64 <= most
        };
        let largest = Replicates::all().rev().find(fits);
        largest.unwrap_or(Replicates::SINGLE)
    }
}

/// Settings of a sampler.
#[derive(Clone, Debug)]
pub(super) struct Samples {
    /// Samples per pixel, or particles.
    pub count: u64,
    /// Number of instants of a period of sound over which the samples are spread.
    pub instants: usize,
    /// True if sound bends rays.
    pub bending: bool,
    /// Sampler that is asked for.
    pub request: SamplerRequest,
    /// Warning that another sampler is used because the scene's sampler is not available.
    pub unlike: Option<Diagnostic>,
    /// True if noisy pixels get more samples.
    pub adaptive: bool,
}

impl Default for Samples {
    fn default() -> Self {
        Samples {
            count: 0,
            instants: 1,
            bending: true,
            request: SamplerRequest::Open,
            unlike: None,
            adaptive: false,
        }
    }
}

impl Samples {
    /// Replaces the scene's settings by the caller's.
    pub(super) fn replace(&mut self, options: &LoadOptions, diagnostics: &mut Diagnostics) {
        self.adaptive |= options.adaptive;
        self.count = options.samples.unwrap_or(self.count);
        let Some(name) = options.sampler.as_deref() else {
            return;
        };
        match SamplerRequest::named(name) {
            Some(request) => (self.request, self.unlike) = (request, None),
            None => {
                let message = format!("unknown sampler '{name}'");
                diagnostics.push(Diagnostic::error(message).help(better(name)));
            }
        }
    }

    /// Raises the settings to satisfy another sampler, too.
    pub(super) fn raise(&mut self, other: Self) {
        self.count = self.count.max(other.count);
        self.instants = self.instants.max(other.instants);
        self.bending &= other.bending;
        self.request = self.request.max(other.request);
        self.unlike = self.unlike.take().or(other.unlike);
        self.adaptive |= other.adaptive;
    }
}

/// Reads the settings of a sampler; without one, `default` samples at one instant.
pub(super) fn build(
    object: Option<&ObjectDescription>,
    default: i64,
    context: &mut Context,
) -> Samples {
    let Some(object) = object else {
        return Samples {
            count: default as u64,
            ..Samples::default()
        };
    };
    // Choose the sampler, with a warning if the named one is not available.
    let name = object.plugin.as_str();
    let named = SamplerRequest::named(name);
    let (used, replacement) = if EVEN_SAMPLERS.contains(&name) {
        ("ldsampler", SamplerRequest::Even)
    } else {
        ("independent", SamplerRequest::Independent)
    };
    let unlike = named.is_none().then(|| {
        let message = format!("sampler '{name}' is not available; '{used}' is used instead");
        lints::warning(lints::REPLACED_SAMPLER, message).at(&object.plugin_location)
    });
    let mut q = Query::new(object, context.diagnostics);
    let mut request = named.unwrap_or(replacement);
    if request == SamplerRequest::Even && q.has("replicate_size") {
        let size = q.integer("replicate_size");
        match Replicates::new(size as u64) {
            Some(replicates) => request = SamplerRequest::EvenIn(replicates),
            None => {
                let most = Replicates::MAX_SAMPLES;
                let message = format!("{size} is not a power of two up to {most}");
                q.error("replicate_size", message);
            }
        }
    }
    // Read the number of samples and the instants of a period of sound.
    let count = q.integer_or("sample_count", default);
    let instants = q.integer("phases");
    let bending = q.boolean("bending");
    if !bending && instants > 1 {
        let message = "without 'bending' all instants of the sound are equal: leave out 'phases'";
        q.error("phases", message);
    }
    let adaptive = q.boolean("adaptive");
    q.has("seed");
    if EVEN_SAMPLERS.contains(&name) {
        q.has("jitter");
        q.has("strength");
    }
    q.finish(&[]);
    Samples {
        count: count as u64,
        instants: instants as usize,
        bending,
        request,
        unlike,
        adaptive,
    }
}

/// Returns help for an unknown sampler name from the caller.
fn better(name: &str) -> String {
    match suggest(name, ["independent", "ldsampler"]) {
        Some(help) if !name.contains(':') => help,
        _ if EVEN_SAMPLERS.contains(&name) => {
            "use 'ldsampler', which also spreads samples evenly".into()
        }
        _ => format!(
            "known samplers: independent, ldsampler, and ldsampler:N with replicates of N samples, a power of two up to {}",
            Replicates::MAX_SAMPLES
        ),
    }
}

/// Returns the replicates of the scene's sampler if the integrator supports them.
pub(super) fn replicates(
    scene: &Scene,
    samples: &Samples,
    renderer: &Renderer,
    mut report: impl FnMut(&SceneProblem),
) -> Replicates {
    let replicates = samples.request.replicates(scene, samples.count);
    if renderer.replicates(replicates) == replicates {
        return replicates;
    }
    if samples.request == SamplerRequest::Open {
        return Replicates::SINGLE;
    }
    let name = renderer.name();
    report(&SceneProblem::warning(
        lints::REPLACED_SAMPLER,
        Subject::Sensor,
        format!(
            "the integrator '{name}' takes independent samples: only 'path' and 'bdpt' use the replicates of 'ldsampler'"
        ),
        "make the sampler 'independent', or the integrator 'path' or 'bdpt'",
    ));
    Replicates::SINGLE
}

/// Returns the reason why samples of pictures cannot be distributed among pixels by noise, if any.
pub(super) fn incompatibility(renderer: &Renderer, reweight: bool) -> Option<String> {
    match renderer {
        Renderer::Light(Integrator::Path(_)) => {
            reweight.then(|| "with the film's 'reweight'".into())
        }
        other => Some(format!(
            "with the integrator '{}', only with 'path'",
            other.name()
        )),
    }
}

/// Returns true if samples are distributed among pixels by noise: the sampler requests it and
/// nothing prevents it.
pub(super) fn is_adaptive(
    samples: &Samples,
    incompatibility: Option<String>,
    mut report: impl FnMut(&SceneProblem),
) -> bool {
    if let (true, Some(incompatibility)) = (samples.adaptive, &incompatibility) {
        report(&SceneProblem::warning(
            lints::IGNORED,
            Subject::Sensor,
            format!("adaptive sampling has no effect {incompatibility}"),
            "leave out 'adaptive' of the sampler, or the option",
        ));
    }
    samples.adaptive && incompatibility.is_none()
}
