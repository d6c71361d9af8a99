//! From a scene description to a scene.
//!
//! Everything that is wrong is reported, with its place, before giving up.

mod bsdf;
mod channels;
mod context;
mod costly;
mod coverage;
mod differences;
mod emitter;
mod entry;
mod field;
mod film;
mod instrument;
mod integrator;
mod ior;
mod medium;
mod meter;
mod non_terminating;
mod phase;
mod reach;
mod sampler;
mod sensor;
mod shape;
mod sides;
mod surface_texture;
mod texture;
mod transforms;
mod units;

pub use costly::steps_across;
pub use coverage::{Needs, Walls};
pub use differences::Difference;
pub use film::Layering;
pub use instrument::{Gruneisen, Instrument, Normalization};

use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::input::Limits;
use crate::query::{Query, unknown_plugin};
use crate::scene::{FileRegistry, Object, PluginKind, SceneDescription, SceneHash};
use channels::Channels;
use context::Context;
use std::collections::BTreeSet;
use std::path::Path;
use transport::integrator::{Integrator, PathTracer};
use transport::render::ADAPTIVE_FROM;
use transport::scene::{Parts, Problem, Scene, Severity, Subject};

/// What a caller may change about a scene file.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Parameters that replace those of `<default>`, by name.
    pub defines: Vec<(String, String)>,
    /// Estimator to use instead of the scene's.
    pub integrator: Option<String>,
    /// Samples per pixel to use instead of the scene's.
    pub samples: Option<u64>,
    /// Sampler to use instead of the scene's: `independent`, `ldsampler`, or `ldsampler:64` with larger sets.
    pub sampler: Option<String>,
    /// Whether noisy pixels get more samples, even if the scene's sampler does not ask for it.
    pub adaptive: bool,
    /// How much memory each data file may take.
    pub limits: Limits,
}

/// A scene that is ready to render.
#[derive(Debug)]
pub struct Loaded {
    /// One scene for each group of up to four spectral channels; they differ in spectra only. If an index depends
    /// on the wavelength, one for each channel.
    pub groups: Vec<Scene>,
    /// Estimator.
    pub integrator: Integrator,
    /// Samples per pixel; particles if there are instruments.
    pub samples: u64,
    /// Meters, if the scene has these in place of a camera.
    pub instruments: Vec<Instrument>,
    /// What is doubtful about it.
    pub warnings: Diagnostics,
    /// Where Mitsuba would render it otherwise.
    pub differences: Vec<Difference>,
    /// Hash of the description and of all files it refers to.
    pub hash: SceneHash,
    /// Names of the channels: `R`, `G`, `B`, or `Y`, or wavelengths, or quantities.
    pub channel_names: Vec<String>,
    /// Names of the emitters, all different: their ids, those of their shapes, or their kinds. Without dots,
    /// which separate the names of layers.
    pub emitter_names: Vec<String>,
    /// How the film tells light apart.
    pub layering: Layering,
    /// Whether an image with less weight for rare bright samples is wanted beside the plain one.
    pub reweight: bool,
    /// Whether noisy pixels get more samples: see [`transport::render::Options::adaptive`].
    pub adaptive: bool,
    /// What the scene says of its estimator.
    estimators: integrator::Parameters,
}

impl Loaded {
    /// Whether groups differ in their indices: some medium disperses, and each wavelength has rays of its own.
    pub fn is_dispersive(&self) -> bool {
        self.scene().film().group_size == 1 && self.groups.len() > 1
    }

    /// The scenes whose rays are those of the first: all, unless some medium disperses.
    pub fn same_rays(&self) -> &[Scene] {
        match self.is_dispersive() {
            true => &self.groups[..1],
            false => &self.groups,
        }
    }

    /// Notes of where Mitsuba would render it otherwise.
    pub fn notes_of_differences(&self) -> Diagnostics {
        let mut notes = Diagnostics::new();
        for (i, Difference { topic, text }) in self.differences.iter().enumerate() {
            let last = i + 1 == self.differences.len();
            let help = last.then(|| String::from("docs/mitsuba.md says how much it matters"));
            let message = format!("not as in Mitsuba 3 ({topic}): {text}");
            notes.push(Diagnostic::note(message).help(help));
        }
        notes
    }

    /// The scene of the first channel group: geometry and sensor are the same in all, and indices if no medium
    /// disperses.
    pub fn scene(&self) -> &Scene {
        &self.groups[0]
    }
}

/// Reads, assembles and checks a scene file: JSON if its extension is `.json`, else XML.
///
/// # Errors
/// Everything that is wrong with it, warnings included.
pub fn load_scene(path: &Path, options: &LoadOptions) -> Result<Loaded, Diagnostics> {
    let mut diagnostics = Diagnostics::new();
    let read = match path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("json"))
    {
        true => crate::json::load,
        false => crate::xml::load,
    };
    match read(path, &options.defines, &mut diagnostics) {
        Some(description) => assemble(&description, options, diagnostics),
        None => Err(diagnostics),
    }
}

/// Assembles and checks a scene description; `diagnostics` holds what reading it has reported.
///
/// # Errors
/// Everything that is wrong with it, warnings included.
pub fn assemble(
    description: &SceneDescription,
    options: &LoadOptions,
    mut diagnostics: Diagnostics,
) -> Result<Loaded, Diagnostics> {
    let mut files = FileRegistry::within(options.limits);
    let mut channels = Channels::of(&description.root, &mut diagnostics);
    if integrator::is_aov(&description.root, options) {
        channels = channels.single(&mut diagnostics);
    }
    let mut parts = Vec::new();
    for group in 0..channels.groups() {
        // What is doubtful is the same in every group: it is reported for the first only.
        let mut later = Diagnostics::new();
        let log = if group == 0 {
            &mut diagnostics
        } else {
            &mut later
        };
        let context = Context::new(&channels, group, log, &mut files);
        parts.extend(group_parts(description, options, context));
        if later.has_errors() {
            return Err(later);
        }
        if diagnostics.has_errors() {
            return Err(diagnostics);
        }
    }
    let hash = match description.hash(&files) {
        Ok(hash) => hash,
        Err(error) => {
            diagnostics.push(Diagnostic::error(error.to_string()));
            return Err(diagnostics);
        }
    };
    let Some(first) = parts.first_mut() else {
        return Err(diagnostics);
    };
    let emitter_names = std::mem::take(&mut first.emitter_names);
    let known = differences::Known {
        description,
        scene: &first.scene,
        counted: options.samples.is_some(),
    };
    let differences = differences::of(&known, &first.differences);
    let (integrator, estimators) = (first.method.integrator, first.method.parameters);
    let samples = whole_periods(options, first, &mut diagnostics);
    let (layering, reweight) = (first.layering, first.reweight);
    let adaptive = first.adaptive;
    let instruments = std::mem::take(&mut first.instruments);
    Ok(Loaded {
        instruments,
        groups: parts.into_iter().map(|p| p.scene).collect(),
        integrator,
        samples,
        warnings: diagnostics,
        differences,
        hash,
        channel_names: match &integrator {
            Integrator::Aov(tracer) => tracer.channels().map(str::to_owned).collect(),
            _ => channels.names(),
        },
        emitter_names,
        layering,
        reweight,
        adaptive,
        estimators,
    })
}

/// Assembles the refractive index that the only volume of a description describes, at the first wavelength if there are
/// several; `diagnostics` holds what reading it has reported.
///
/// # Errors
/// Everything that is wrong with it.
pub fn assemble_field(
    description: &SceneDescription,
    mut diagnostics: Diagnostics,
) -> Result<eikonal::Field, Diagnostics> {
    let root = &description.root;
    let channels = Channels::of(root, &mut diagnostics);
    let mut query = Query::new(root, &mut diagnostics);
    let volume = query.required_child(PluginKind::Volume);
    query.finish(&[]);
    let mut files = FileRegistry::new();
    let mut context = Context::new(&channels, 0, &mut diagnostics, &mut files);
    let field = volume.and_then(|volume| field::build(volume, &mut context));
    match field {
        Some(field) if !diagnostics.has_errors() => Ok(field),
        _ => Err(diagnostics),
    }
}

/// The number of samples: the same at each instant of a period of sound, in whole sets.
fn whole_periods(options: &LoadOptions, parts: &GroupParts, diagnostics: &mut Diagnostics) -> u64 {
    let wanted = options.samples.unwrap_or(parts.samples);
    let samples = parts.scene.whole_periods(wanted);
    if samples != wanted {
        let reasons = [
            (parts.scene.instants() as u64, "phases"),
            (parts.scene.sets().size(), "samples in a set"),
        ];
        let reasons = reasons.iter().filter(|(number, _)| *number > 1);
        let reasons: Vec<_> = reasons.map(|(n, what)| format!("{n} {what}")).collect();
        let message = format!(
            "{samples} samples are taken instead of {wanted}: a multiple of the sampler's {}",
            reasons.join(" and of its ")
        );
        diagnostics.push(Diagnostic::warning(message));
    }
    let even = ADAPTIVE_FROM.next_multiple_of(parts.scene.whole_periods(1));
    if parts.adaptive && samples <= even {
        let message = format!(
            "{samples} samples are too few for adaptive sampling, which begins after the first {even}"
        );
        diagnostics.push(Diagnostic::warning(message).help(String::from("take more samples")));
    }
    samples
}

/// What the description makes for one channel group.
struct GroupParts {
    scene: Scene,
    method: integrator::Method,
    samples: u64,
    emitter_names: Vec<String>,
    layering: Layering,
    reweight: bool,
    adaptive: bool,
    instruments: Vec<Instrument>,
    /// Those that only show while it is assembled.
    differences: BTreeSet<Difference>,
}

/// The scene of one channel group and how to render it; `None` after an error.
fn group_parts(
    description: &SceneDescription,
    options: &LoadOptions,
    mut context: Context,
) -> Option<GroupParts> {
    let root = &*description.root;
    let (integrators, sensors, shapes, emitters) = children(root, &mut context);
    if let [_, second, ..] = integrators[..] {
        context.error_at(&second.location, "the scene has more than one integrator");
    }
    let method = integrator::build(integrators.first().copied(), options, &mut context);
    if !shape::fit(&shapes, &mut context) {
        return None;
    }
    for &shape in &shapes {
        shape::add(shape, &mut context);
    }
    for &emitter in &emitters {
        emitter::add(emitter, &mut context);
    }
    let (meters, sensors): (Vec<_>, Vec<_>) = sensors.into_iter().partition(|s| meter::is_meter(s));
    let mut instruments = Vec::new();
    let sensor = match sensors[..] {
        _ if !meters.is_empty() || !context.meters.is_empty() => meter::build(
            (&meters, &sensors),
            integrators.first().copied(),
            &mut context,
        )
        .map(|(sensor, list)| {
            instruments = list;
            sensor
        }),
        [sensor] => sensor::build(sensor, &mut context),
        [] => {
            context.error_at(&root.location, "the scene has no sensor");
            None
        }
        [_, second, ..] => {
            context.error_at(&second.location, "the scene has more than one sensor");
            None
        }
    };
    sides::settle(&mut context);
    reach::warnings(&mut context);
    let mut sensor = sensor?;
    sensor.samples.replace(options, context.diagnostics);
    if matches!(method.integrator, Integrator::Aov(_)) {
        let apart = sensor.film.layering.decomposition.is_some() || sensor.film.reweight;
        let what = match instruments.is_empty() {
            false => "meters",
            true => "the film's 'decomposition' and 'reweight'",
        };
        if apart || !instruments.is_empty() {
            let message = format!("the integrator aov sees no light: leave it, or {what}, out");
            context.error_at(&root.location, message);
        }
    }
    if context.diagnostics.has_errors() {
        return None;
    }
    let parts = Parts {
        objects: context.objects,
        media: context.media,
        emitters: context.emitters,
        sensor: sensor.sensor,
        film: sensor.film.spec,
        tolerance: method.parameters.tolerance,
        reflections: method.parameters.reflections,
    };
    let mut layering = sensor.film.layering;
    if let Some(emitters) = &mut layering.decomposition.emitters {
        *emitters = parts.emitters.len();
    }
    let emitter_names = emitter::names(&context.emitter_ids, &parts.emitters);
    let places = context.places;
    let mut report = |problem: &Problem| {
        let location = match problem.subject {
            Subject::Scene => Some(&root.location),
            Subject::Sensor => sensors.first().or(meters.first()).map(|s| &s.location),
            Subject::Medium(i) => places.media[i].as_ref(),
            Subject::Object(i) => places.objects.get(i),
            Subject::Emitter(i) => places.emitters.get(i),
        };
        let diagnostic = match problem.severity {
            Severity::Error => Diagnostic::error(problem.message.clone()),
            Severity::Warning => Diagnostic::warning(problem.message.clone()),
        };
        let diagnostic = diagnostic.help(problem.help.clone());
        context.diagnostics.push(match location {
            Some(location) => diagnostic.at(location),
            None => diagnostic,
        });
    };
    match Scene::over_period(parts, sensor.samples.instants) {
        Ok(scene) => {
            let sets = sensor.samples.sets;
            let scene = sampler::in_sets(scene, sets, &method.integrator, &mut report);
            let incompatibility = match instruments.is_empty() {
                true => sampler::incompatibility(&method.integrator, sensor.film.reweight),
                false => Some("with meters".into()),
            };
            let adaptive = sampler::is_adaptive(&sensor.samples, incompatibility, &mut report);
            // Without light a picture is black, but other quantities are not.
            let dark = matches!(method.integrator, Integrator::Aov(_));
            let matters = |p: &&Problem| !(dark && p.subject == Subject::Scene);
            scene
                .warnings()
                .iter()
                .filter(matters)
                .for_each(&mut report);
            costly::problems(&scene).iter().for_each(&mut report);
            non_terminating::warnings(&scene, &method.integrator)
                .iter()
                .for_each(&mut report);
            entry::warnings(&scene).iter().for_each(&mut report);
            if instruments.is_empty() {
                let missed = coverage::warnings(&scene, &method.integrator);
                missed.iter().for_each(&mut report);
            }
            for problem in instruments.iter().filter_map(|i| i.doubt(&scene)) {
                report(&problem);
            }
            if let (Some(medium), [object]) = (sensor.medium, &sensors[..])
                && medium != scene.sensor_medium()
            {
                let message =
                    "the sensor names a medium, but no closed shape around it holds that medium";
                context
                    .diagnostics
                    .push(Diagnostic::error(message).at(&object.location));
                return None;
            }
            // A sampler whose like is not taken either has been spoken of.
            if let (true, Some(unlike)) = (scene.sets() == sets, sensor.samples.unlike) {
                context.diagnostics.push(unlike);
            }
            Some(GroupParts {
                scene,
                method,
                samples: sensor.samples.count,
                emitter_names,
                layering,
                reweight: sensor.film.reweight,
                adaptive,
                instruments,
                differences: context.differences,
            })
        }
        Err(problems) => {
            problems.iter().for_each(&mut report);
            None
        }
    }
}

type Children<'a> = (
    Vec<&'a Object>,
    Vec<&'a Object>,
    Vec<&'a Object>,
    Vec<&'a Object>,
);

/// The scene's children by kind: integrators, sensors, shapes, emitters. Definitions that others
/// refer to (media, bsdfs, ...) are taken note of, so that they do not count as unused.
fn children<'a>(root: &'a Object, context: &mut Context) -> Children<'a> {
    let mut query = Query::new(root, context.diagnostics);
    let mut of =
        |kind| -> Vec<&'a Object> { query.children(kind).into_iter().map(|o| &**o).collect() };
    let wanted = (
        of(PluginKind::Integrator),
        of(PluginKind::Sensor),
        of(PluginKind::Shape),
        of(PluginKind::Emitter),
    );
    for kind in [
        PluginKind::Medium,
        PluginKind::Bsdf,
        PluginKind::Phase,
        PluginKind::Volume,
        PluginKind::Texture,
    ] {
        of(kind);
    }
    query.finish(&[]);
    wanted
}
