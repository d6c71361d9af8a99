//! Samplers: how many samples there are, how they belong together, and over how many instants of a period of sound.

use super::context::Context;
use super::options::LoadOptions;
use crate::diagnostic::{Diagnostic, Diagnostics, lints, suggest};
use crate::query::Query;
use crate::scene::ObjectDescription;
use transport::integrator::Integrator;
use transport::renderer::Renderer;
use transport::sampling::Replicates;
use transport::scene::{Scene, SceneProblem, Subject};

/// Samplers of Mitsuba that spread samples evenly, too.
const EVEN: [&str; 6] = [
    "stratified",
    "multijitter",
    "orthogonal",
    "halton",
    "hammersley",
    "sobol",
];

/// Renders of so many samples have evenly spread ones unless a sampler is named: their errors are told from sixteen means or more.
const EVEN_FROM: u64 = 128;

/// What a sampler asks for.
#[derive(Clone, Debug)]
pub(super) struct Samples {
    /// Samples per pixel, or particles.
    pub count: u64,
    /// Instants of a period of sound that they are spread over.
    pub instants: usize,
    /// Whether sound bends rays.
    pub bending: bool,
    /// How the samples of a pixel belong together.
    pub replicates: Replicates,
    /// Whether no sampler says so.
    pub is_open: bool,
    /// A warning if that is not what the scene's sampler says, for it is not available.
    pub unlike: Option<Diagnostic>,
    /// Whether noisy pixels get more of them.
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
    /// Puts what a caller asks for in the place of what the scene does.
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

    /// Asks for as much as others do, too.
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

/// What a sampler asks for, or `default` samples at one instant.
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

/// What may have been meant by a sampler of a caller's.
fn better(name: &str) -> String {
    let names = Replicates::ALL.map(Replicates::name);
    match suggest(name, names) {
        Some(help) if !name.contains(':') => help,
        _ if EVEN.contains(&name) => "use 'ldsampler', which also spreads samples evenly".into(),
        _ => format!("known samplers: {}", names.join(", ")),
    }
}

/// How samples of the scene belong together, if its integrator takes them so.
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

/// How so many samples belong together unless a sampler is named: spread evenly if there are enough of them.
pub(crate) fn unless_named(scene: &Scene, renderer: &Renderer, count: u64) -> Replicates {
    let even = Replicates::OfEight;
    let is_even = count >= EVEN_FROM
        && scene.whole_periods(count, even) == count
        && renderer.replicates(even) == even;
    if is_even { even } else { Replicates::Single }
}

/// How samples belong together, unless a sampler is named, where their number is only a guess.
pub(crate) fn unless_named_by_guess(scene: &Scene, renderer: &Renderer, guess: f64) -> Replicates {
    unless_named(scene, renderer, guess as u64 / EVEN_FROM * EVEN_FROM)
}

/// Why samples of pictures cannot be shared out among pixels by noise, if they cannot.
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

/// Whether samples are shared out among pixels by noise: if the sampler asks for it and nothing hinders it.
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
