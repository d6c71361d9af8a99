//! Scene of one group of channels, with its rendering method.

use super::CondensedGrid;
use super::context::{Context, Places};
use super::described::is_meter;
use super::film::Layering;
use super::instrument::Instrument;
use super::integrator::{self, Method};
use super::options::LoadOptions;
use super::sampler::SamplerRequest;
use super::sensor::{self, SensorParts};
use super::sound_record::SoundRecord;
use super::undisturbed;
use super::{emitter, lint, meter, sampler, shape, sides, tagging};
use crate::diagnostic::Difference;
use crate::diagnostic::{Diagnostic, Diagnostics, Location, lints};
use crate::loading::Loading;
use crate::query::Query;
use crate::scene::{ObjectDescription, PluginKind, SceneDescription, descendants};
use eikonal::Aabb;
use std::collections::{BTreeSet, HashSet};
use transport::film::LightParts;
use transport::integrator::Integrator;
use transport::polarization;
use transport::render::ADAPTIVE_FROM;
use transport::renderer::Renderer;
use transport::sampling::Replicates;
use transport::scene::{Parts, Scene, SceneProblem, Subject};
use transport::sensor::Sensor;
use transport::sidebands::Sidebands;

/// Maximum number of objects that a note lists by name.
const MAX_NAMED: usize = 5;

/// Scene of one channel group, with everything that the description says about rendering it.
pub(super) struct Group {
    pub scene: Scene,
    pub method: Method,
    /// Estimators from which a pilot chooses, if the scene leaves the choice open.
    pub candidates: Vec<Integrator>,
    pub samples: u64,
    pub replicates: Replicates,
    pub sampler: SamplerRequest,
    pub emitter_names: Vec<String>,
    pub layering: Layering,
    pub reweight: bool,
    pub adaptive: bool,
    pub instruments: Vec<Instrument>,
    /// Components of the volumes of sound.
    pub sounds: Vec<SoundRecord>,
    /// Grids of the index that are stored with fewer samples.
    pub condensed: Vec<CondensedGrid>,
    /// Differences from Mitsuba that show only during assembly.
    pub differences: BTreeSet<Difference>,
}

/// Observers of the scene: a camera, or meters with a stand-in for a camera.
struct View {
    sensor: SensorParts,
    instruments: Vec<Instrument>,
}

impl Group {
    /// Assembles the scene, which shares parts with the scene `alike` of another group; `None`
    /// after an error.
    pub(super) fn new(
        description: &SceneDescription,
        options: &LoadOptions,
        alike: Option<&Scene>,
        mut context: Context,
    ) -> Option<Self> {
        let children = Children::of(&description.root, &mut context);
        let method = children.method(options, &mut context);
        let loading = &options.loading;
        children.add_parts(loading, &mut context)?;
        loading.begin("building the sensors");
        let view = children.view(&mut context);
        loading.begin("finding the media beside all surfaces");
        sides::settle(&mut context);
        lint::overlaps(&mut context);
        lint::reach(&context.grids, &context.objects, context.diagnostics);
        let mut view = view?;
        view.sensor.samples.replace(options, context.diagnostics);
        let path = matches!(method.renderer, Renderer::Light(Integrator::Path(_)));
        if matches!(view.sensor.sensor, Sensor::Batch(_)) && !path {
            let message = "a batch of cameras needs the integrator 'path': nothing connects to it";
            context.error_at(&description.root.location, message);
        }
        if method.is_aov() {
            view.refuse_layers(&children.root.location, &mut context);
        }
        if context.diagnostics.has_errors() || loading.is_given_up() {
            return None;
        }
        loading.begin("building and checking the scene as a whole");
        children.finish(method, view, options, alike, context)
    }

    /// Returns the number of samples, rounded up so that all instants of a period of sound have
    /// equally many and all replicates are complete.
    pub(super) fn whole_periods(&self, diagnostics: &mut Diagnostics) -> u64 {
        let wanted = self.samples;
        let samples = self.scene.whole_periods(wanted, self.replicates);
        if samples != wanted {
            let reasons = [
                (self.scene.instants() as u64, "phases"),
                (self.replicates.size(), "samples in a replicate"),
            ];
            let reasons = reasons.iter().filter(|(number, _)| *number > 1);
            let reasons: Vec<_> = reasons.map(|(n, what)| format!("{n} {what}")).collect();
            let message = format!(
                "{samples} samples are taken instead of {wanted}: a multiple of the sampler's {}",
                reasons.join(" and of its ")
            );
            diagnostics.push(lints::warning(lints::SAMPLE_COUNT, message));
        }
        let even = ADAPTIVE_FROM.next_multiple_of(self.scene.whole_periods(1, self.replicates));
        if self.adaptive && samples <= even {
            let message = format!(
                "{samples} samples are too few for adaptive sampling, which begins after the first {even}"
            );
            diagnostics.push(
                lints::warning(lints::FEW_SAMPLES, message).help(String::from("take more samples")),
            );
        }
        samples
    }
}

impl View {
    /// Reports features that need light, with an integrator that computes none.
    fn refuse_layers(&self, root: &Location, context: &mut Context) {
        let film = &self.sensor.film;
        let apart = film.layering.decomposition.is_some() || film.reweight;
        let what = if self.instruments.is_empty() {
            "the film's 'decomposition' and 'reweight'"
        } else {
            "meters"
        };
        if apart || !self.instruments.is_empty() {
            let message = format!("the integrator aov renders no light: leave out aov, or {what}");
            context.error_at(root, message);
        }
    }
}

/// Children of the scene by kind.
struct Children<'a> {
    root: &'a ObjectDescription,
    integrators: Vec<&'a ObjectDescription>,
    cameras: Vec<&'a ObjectDescription>,
    meters: Vec<&'a ObjectDescription>,
    shapes: Vec<&'a ObjectDescription>,
    emitters: Vec<&'a ObjectDescription>,
}

/// Removes emitters of shapes to which shapes refer: these are definitions.
fn without_covers<'a>(
    emitters: Vec<&'a ObjectDescription>,
    shapes: &[&ObjectDescription],
) -> Vec<&'a ObjectDescription> {
    let covers: HashSet<_> = descendants(shapes.iter().copied())
        .filter(|o| emitter::is_on_shape(o))
        .map(|o| o.number)
        .collect();
    let stays = |emitter: &&ObjectDescription| !covers.contains(&emitter.number);
    emitters.into_iter().filter(stays).collect()
}

impl<'a> Children<'a> {
    /// Sorts the children of the scene by kind. Marks definitions (media, bsdfs, ...) as used.
    fn of(root: &'a ObjectDescription, context: &mut Context) -> Self {
        let mut query = Query::new(root, context.diagnostics);
        let mut of = |kind| -> Vec<&'a ObjectDescription> {
            query.children(kind).into_iter().map(|o| &**o).collect()
        };
        let integrators = of(PluginKind::Integrator);
        let sensors = of(PluginKind::Sensor);
        let (meters, cameras) = sensors.into_iter().partition(|s| is_meter(s));
        let shapes = of(PluginKind::Shape);
        let emitters = without_covers(of(PluginKind::Emitter), &shapes);
        let children = Children {
            root,
            integrators,
            cameras,
            meters,
            shapes,
            emitters,
        };
        let kinds = [
            PluginKind::Medium,
            PluginKind::Bsdf,
            PluginKind::Phase,
            PluginKind::Volume,
            PluginKind::Texture,
            PluginKind::Sampler,
            PluginKind::Film,
            PluginKind::Rfilter,
        ];
        let definitions: Vec<_> = kinds.into_iter().flat_map(of).collect();
        query.finish(&[]);
        if context.group == 0 {
            let note = children.not_read(definitions);
            note.into_iter()
                .for_each(|note| context.diagnostics.push(note));
        }
        children
    }

    /// Returns a note about definitions to which nothing that is rendered refers: these are not
    /// read.
    fn not_read(&self, definitions: Vec<&ObjectDescription>) -> Option<Diagnostic> {
        let uses = [
            &self.integrators,
            &self.cameras,
            &self.meters,
            &self.shapes,
            &self.emitters,
        ];
        let used = descendants(uses.into_iter().flatten().copied());
        let used: HashSet<_> = used.map(|o| o.number).collect();
        let mut rest = definitions
            .into_iter()
            .filter(|o| !used.contains(&o.number));
        let first = rest.next()?;
        let name = |o: &ObjectDescription| match &o.id {
            Some(id) => format!("{} '{id}'", o.kind),
            None => format!("{} of type '{}'", o.kind, o.plugin),
        };
        let rest: Vec<_> = rest.collect();
        let mut names: Vec<_> = std::iter::once(first)
            .chain(rest.iter().copied().take(MAX_NAMED - 1))
            .map(name)
            .collect();
        if rest.len() >= MAX_NAMED {
            names.push(format!("{} more", rest.len() + 1 - MAX_NAMED));
        }
        let message = format!(
            "unused definitions, which morgana did not check: {}",
            names.join(", ")
        );
        Some(lints::note(lints::UNREFERENCED, message).at(&first.location))
    }

    /// Returns the rendering method of the scene.
    fn method(&self, options: &LoadOptions, context: &mut Context) -> Method {
        if let [_, second, ..] = self.integrators[..] {
            context.error_at(&second.location, "the scene has more than one integrator");
        }
        integrator::build(self.integrators.first().copied(), options, context)
    }

    /// Adds shapes and emitters; `None` if there are too many, or if loading is cancelled.
    fn add_parts(&self, loading: &Loading, context: &mut Context) -> Option<()> {
        if !shape::fit(&self.shapes, context) {
            return None;
        }
        let begin = |object: &ObjectDescription| {
            loading.build(object);
            (!loading.is_given_up()).then_some(())
        };
        for &shape in &self.shapes {
            begin(shape)?;
            shape::add(shape, context);
        }
        for &emitter in &self.emitters {
            begin(emitter)?;
            emitter::add(emitter, context);
        }
        Some(())
    }

    /// Returns the camera or the meters; `None` after an error.
    fn view(&self, context: &mut Context) -> Option<View> {
        if !self.meters.is_empty() || !context.meters.is_empty() {
            let integrator = self.integrators.first().copied();
            let (sensor, instruments) =
                meter::build(&self.meters, &self.cameras, integrator, context)?;
            return Some(View {
                sensor,
                instruments,
            });
        }
        let sensor = match self.cameras[..] {
            [sensor] => sensor::build(sensor, context)?,
            [] => {
                let message = "the scene has no sensor: morgana uses a perspective camera of 45° that sees the whole scene, along +z";
                let note = lints::note(lints::NO_SENSOR, message).at(&self.root.location);
                context.diagnostics.push(note);
                sensor::absent(context)
            }
            [first, ref others @ ..] => {
                let message = format!(
                    "the scene has {} cameras: the first one is rendered",
                    1 + others.len()
                );
                let warning = lints::warning(lints::SEVERAL_CAMERAS, message).at(&first.location);
                context.diagnostics.push(warning);
                sensor::build(first, context)?
            }
        };
        Some(View {
            sensor,
            instruments: Vec::new(),
        })
    }

    /// Builds the scene from all gathered parts, and warns about doubtful settings.
    fn finish(
        &self,
        mut method: Method,
        view: View,
        options: &LoadOptions,
        alike: Option<&Scene>,
        context: Context,
    ) -> Option<Group> {
        let View {
            sensor,
            instruments,
        } = view;
        if !instruments.is_empty() {
            method.leave_pictures();
        }
        // Collect the parts of the scene, with a light for each emissive medium.
        let grids = instruments.iter().map(|i| i.meter.aabb());
        let mut parts = Parts {
            partitions: context.partitions,
            objects: context.objects,
            media: context.media,
            emitters: context.emitters,
            sensor: sensor.sensor,
            film: sensor.film.spec,
            tolerance: method.parameters.tolerance.unwrap_or_default(),
            reflections: method.parameters.reflections,
            measured: grids.fold(Aabb::EMPTY, Aabb::union),
        }
        .with_emissive_media();
        // Complete the decomposition of light.
        let mut layering = sensor.film.layering;
        layering.decomposition.parts = method.parts;
        // A scene without emitters has no layers of emitters.
        let emitters = Some(parts.emitters.len()).filter(|number| *number > 0);
        layering.decomposition.emitters = layering.decomposition.emitters.and(emitters);
        let emitter_names = emitter::names(&context.emitter_ids, &parts);
        let mut report = Report {
            root: &self.root.location,
            sensor: self
                .cameras
                .first()
                .or(self.meters.first())
                .map(|s| &s.location),
            places: context.places,
            diagnostics: context.diagnostics,
        };
        // Remove the bending of rays by sound, or the flow, if requested.
        if !sensor.samples.bending {
            for medium in &mut parts.media {
                medium.index = medium.index.without_sound();
            }
        }
        if options.undisturbed {
            undisturbed::calm(&mut parts);
        }
        let scene = Scene::over_period(
            parts,
            sensor.samples.instants,
            alike,
            options.loading.stop(),
        );
        let scene = scene.map_err(|problems| report.all(&problems)).ok()?;
        // Refuse pictures without the fluorescence.
        if scene.fluoresces() && instruments.is_empty() && method.renderer.integrator().is_some() {
            let message = "pictures have no fluorescence: measure it with a fluencemeter or an irradiancemeter";
            let error = Diagnostic::error(message).at(&self.root.location);
            report.diagnostics.push(error);
            return None;
        }
        // Check and prepare tagged light.
        let of_film = match &method.parts {
            Some(LightParts::Sidebands(sidebands)) => Some(sidebands),
            _ => None,
        };
        let tagged = instruments.iter().filter_map(|i| i.meter.sidebands());
        let tagged: Vec<&Sidebands> = tagged.chain(of_film).collect();
        if !tagged.is_empty() || instruments.iter().any(|i| i.meter.is_tagged()) {
            let problems = tagging::problems(&scene, &tagged);
            report.all(&problems);
            if !problems.is_empty() {
                return None;
            }
            if let Some(warning) = tagging::warning(&scene, &tagged) {
                let warning =
                    lints::warning(lints::TAGGED_WAVELENGTH, warning).at(&self.root.location);
                report.diagnostics.push(warning);
            }
            if let Some(note) = tagging::note(&scene) {
                let note = lints::note(lints::SOUND_FREQUENCIES, note).at(&self.root.location);
                report.diagnostics.push(note);
            }
            transport::tagging::prepare(&scene);
        }
        // Check polarised light.
        let polarized = instruments.iter().any(|i| i.meter.has_stokes());
        if polarized || method.parts == Some(LightParts::Stokes) {
            let problems = polarization::problems(&scene);
            report.all(&problems);
            if !problems.is_empty() {
                return None;
            }
            if let Some(note) = stokes_note(polarization::depolarizing(&scene)) {
                let note = lints::note(lints::DEPOLARIZING, note).at(&self.root.location);
                report.diagnostics.push(note);
            }
        }
        // Choose the candidates for the estimator.
        let candidates = if method.is_open && instruments.is_empty() {
            lint::complete(
                &scene,
                method.parameters.candidates(),
                sensor.samples.adaptive,
            )
        } else {
            Vec::new()
        };
        if let Some(first) = candidates.first() {
            method.renderer = Renderer::Light(*first);
        }
        // Settle the replicates of samples and adaptive sampling.
        let replicates = sampler::replicates(
            &scene,
            &sensor.samples,
            &method.renderer,
            |p: &SceneProblem| report.add(p),
        );
        let is_supported = sensor
            .samples
            .request
            .replicates(&scene, sensor.samples.count)
            == replicates;
        let incompatibility = if instruments.is_empty() {
            sampler::incompatibility(&method.renderer, sensor.film.reweight)
        } else {
            Some("with meters".into())
        };
        let adaptive =
            sampler::is_adaptive(&sensor.samples, incompatibility, |p: &SceneProblem| {
                report.add(p)
            });
        // Warn about the finished scene.
        report.all(&lint::warnings(&scene, &method, &instruments));
        let camera = self.cameras.first().filter(|_| instruments.is_empty());
        report.all(camera.and_then(|c| lint::narrow_view(c, &scene)).iter());
        if let (Some(medium), [camera, ..]) = (sensor.medium, &self.cameras[..])
            && medium != scene.sensor_medium()
        {
            let message =
                "the sensor names a medium, but no closed shape around it holds that medium";
            let error = Diagnostic::error(message).at(&camera.location);
            report.diagnostics.push(error);
            return None;
        }
        // Warn about a replaced sampler, unless a warning about dropped replicates was given.
        if let (true, Some(unlike)) = (is_supported, sensor.samples.unlike) {
            report.diagnostics.push(unlike);
        }
        Some(Group {
            scene,
            method,
            candidates,
            samples: sensor.samples.count,
            replicates,
            sampler: sensor.samples.request,
            emitter_names,
            layering,
            reweight: sensor.film.reweight,
            adaptive,
            instruments,
            sounds: context.sounds,
            condensed: context.condensed,
            differences: context.differences,
        })
    }
}

/// Reports problems at the places of their subjects in scene files.
struct Report<'a> {
    root: &'a Location,
    sensor: Option<&'a Location>,
    places: Places,
    diagnostics: &'a mut Diagnostics,
}

impl Report<'_> {
    /// Reports a problem.
    fn add(&mut self, problem: &SceneProblem) {
        let location = match problem.subject {
            Subject::Scene => Some(self.root),
            Subject::Sensor => self.sensor,
            Subject::Medium(i) => self.places.media[i].as_ref(),
            Subject::Object(i) => self.places.objects.get(i),
            Subject::Emitter(i) => self.places.emitters.get(i),
        };
        let diagnostic = lints::of_scene(problem);
        self.diagnostics.push(match location {
            Some(location) => diagnostic.at(location),
            None => diagnostic,
        });
    }

    /// Reports several problems.
    fn all<'p>(&mut self, problems: impl IntoIterator<Item = &'p SceneProblem>) {
        problems.into_iter().for_each(|problem| self.add(problem));
    }
}

/// Maximum number of names in a note.
const LISTED: usize = 5;

/// Returns a note about surfaces and media, given by name, that depolarise light; `None` if there
/// are none.
fn stokes_note(depolarizing: [Vec<&str>; 2]) -> Option<String> {
    let kinds = ["surface", "medium"].into_iter().zip(&depolarizing);
    let names = kinds.flat_map(|(kind, names)| names.iter().map(move |n| format!("{kind} '{n}'")));
    let names: Vec<String> = names.collect();
    let more = names.len().saturating_sub(LISTED);
    let listed = names[..names.len() - more].join(", ");
    let more = match more {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    (!names.is_empty())
        .then(|| format!("morgana treats light as unpolarised after scattering by: {listed}{more}"))
}
