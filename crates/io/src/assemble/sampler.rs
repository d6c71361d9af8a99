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
const EVEN: [&str; 6] = [
    "stratified",
    "multijitter",
    "orthogonal",
    "halton",
    "hammersley",
    "sobol",
];

/// Minimum number of samples for which a render without a named sampler uses evenly spread ones.
/// There are then at least 16 replicates of 8 samples, from whose means the error is estimated.
const EVEN_FROM: u64 = 128;

/// Settings of a sampler.
#[derive(Clone, Debug)]
pub(super) struct Samples {
    /// Samples per pixel, or particles.
    pub count: u64,
    /// Number of instants of a period of sound over which the samples are spread.
    pub instants: usize,
    /// True if sound bends rays.
    pub bending: bool,
    /// Grouping of the samples of a pixel into replicates.
    pub replicates: Replicates,
    /// True if no sampler is named.
    pub is_open: bool,
    /// Warning that the scene's sampler is not available and another one is used.
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
            replicates: Replicates::Single,
            is_open: false,
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
        match Replicates::ALL
            .into_iter()
            .find(|replicates| replicates.name() == name)
        {
            Some(replicates) => {
                (self.replicates, self.unlike) = (replicates, None);
                self.is_open = false;
            }
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
        self.replicates = self.replicates.max(other.replicates);
        self.is_open &= other.is_open;
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
            is_open: true,
            ..Samples::default()
        };
    };
    // Choose the replicates, with a warning if the named sampler is not available.
    let name = object.plugin.as_str();
    let known = [Replicates::Single, Replicates::OfEight];
    let named = known
        .into_iter()
        .find(|replicates| replicates.name() == name);
    let replicates = named.unwrap_or(known[usize::from(EVEN.contains(&name))]);
    let unlike = named.is_none().then(|| {
        let used = replicates.name();
        let message = format!("sampler '{name}' is not available; '{used}' is used instead");
        lints::warning(lints::REPLACED_SAMPLER, message).at(&object.plugin_location)
    });
    let mut q = Query::new(object, context.diagnostics);
    let replicates = match replicates {
        Replicates::Single => replicates,
        _ => match q.integer("set") {
            64 => Replicates::OfSixtyFour,
            8 => replicates,
            other => {
                q.error("set", format!("{other} is neither 8 nor 64"));
                replicates
            }
        },
    };
    // Read the number of samples and the instants of a period of sound.
    let count = q.integer_or("sample_count", default);
    let instants = q.integer("phases");
    let bending = q.boolean("bending");
    if !bending && instants > 1 {
        let message = "where sound does not bend rays, all instants are alike: leave 'phases' out";
        q.error("phases", message);
    }
    let adaptive = q.boolean("adaptive");
    q.has("seed");
    if EVEN.contains(&name) {
        q.has("jitter");
        q.has("strength");
    }
    q.finish(&[]);
    Samples {
        count: count as u64,
        instants: instants as usize,
        bending,
        replicates,
        is_open: false,
        unlike,
        adaptive,
    }
}

/// Returns help for an unknown sampler name from the caller.
fn better(name: &str) -> String {
    let names = Replicates::ALL.map(Replicates::name);
    match suggest(name, names) {
        Some(help) if !name.contains(':') => help,
        _ if EVEN.contains(&name) => "use 'ldsampler', which also spreads samples evenly".into(),
        _ => format!("known samplers: {}", names.join(", ")),
    }
}

/// Returns the replicates of the scene's sampler if the integrator supports them.
pub(super) fn replicates(
    scene: &Scene,
    samples: &Samples,
    renderer: &Renderer,
    mut report: impl FnMut(&SceneProblem),
) -> Replicates {
    let replicates = samples.replicates;
    if samples.is_open {
        return unless_named(scene, renderer, samples.count);
    }
    if renderer.replicates(replicates) == replicates {
        return replicates;
    }
    let name = renderer.name();
    report(&SceneProblem::warning(
        lints::REPLACED_SAMPLER,
        Subject::Sensor,
        format!(
            "samples of '{name}' are independent here: only the integrators 'path' and 'bdpt' take those of 'ldsampler'"
        ),
        "make the sampler 'independent', or the integrator 'path' or 'bdpt'",
    ));
    Replicates::Single
}

/// Returns the replicates for `count` samples when no sampler is named: evenly spread if there are
/// enough samples.
pub(crate) fn unless_named(scene: &Scene, renderer: &Renderer, count: u64) -> Replicates {
    let even = Replicates::OfEight;
    let is_even = count >= EVEN_FROM
        && scene.whole_periods(count, even) == count
        && renderer.replicates(even) == even;
    if is_even { even } else { Replicates::Single }
}

/// Returns the replicates when no sampler is named and the number of samples is only a guess.
pub(crate) fn unless_named_by_guess(scene: &Scene, renderer: &Renderer, guess: f64) -> Replicates {
    unless_named(scene, renderer, guess as u64 / EVEN_FROM * EVEN_FROM)
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

/// True if samples are distributed among pixels by noise: the sampler requests it and nothing
/// prevents it.
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
            "leave out what asks for it: the sampler's 'adaptive', or the option",
        ));
    }
    samples.adaptive && incompatibility.is_none()
}
