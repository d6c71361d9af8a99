//! A scene that is ready to render, and how.

use super::CondensedGrid;
use super::film::Layering;
use super::instrument::Instrument;
use super::integrator::{self, AUTO, Kind};
use super::lint;
use super::quantities::NamedQuantity;
use super::sound_record::SoundRecord;
use crate::diagnostic::Difference;
use crate::diagnostic::{Diagnostic, Diagnostics, lints};
use crate::scene::SceneHash;
use eikonal::Reference;
use std::any::Any;
use std::path::PathBuf;
use std::sync::Arc;
use transport::aov::AovTracer;
use transport::integrator::Integrator;
use transport::renderer::Renderer;
use transport::sampling::Replicates;
use transport::scene::Scene;

/// What a name stands for in a scene.
#[derive(Debug)]
pub struct NamedRenderer {
    /// What makes the picture.
    pub renderer: Renderer,
    /// Estimators among which a pilot chooses, if that is what the name says: see [`Loaded::candidates`].
    pub candidates: Vec<Integrator>,
    /// What is doubtful about it.
    pub doubts: Diagnostics,
}

/// A scene that is ready to render.
#[derive(Debug)]
pub struct Loaded {
    /// One scene for each group of up to four spectral channels; they differ in spectra only. If an index or
    /// a phase function depends on the wavelength, one for each channel.
    pub groups: Vec<Scene>,
    /// What the picture shows, and how that is found.
    pub renderer: Renderer,
    /// Estimators among which a pilot chooses, the renderer being one of them; none if the scene or the caller names one.
    pub candidates: Vec<Integrator>,
    /// Samples per pixel; particles if there are instruments.
    pub samples: u64,
    /// How samples of a pixel belong together: see [`transport::render::RenderOptions::replicates`].
    pub replicates: Replicates,
    /// Whether nothing names a sampler.
    pub has_open_sampler: bool,
    /// Meters, if the scene has these in place of a camera.
    pub instruments: Vec<Instrument>,
    /// What its volumes of sound are made of.
    pub sounds: Vec<SoundRecord>,
    /// Which grids of the index are held by fewer samples than their files have.
    pub condensed: Vec<CondensedGrid>,
    /// Prefiltered grids of the index and surfaces between labels: other scenes share them as long as they are held here.
    pub held: Vec<Arc<dyn Any + Send + Sync>>,
    /// What is doubtful about it.
    pub warnings: Diagnostics,
    /// Where Mitsuba would render it otherwise.
    pub differences: Vec<Difference>,
    /// The data files that it refers to.
    pub files: Vec<PathBuf>,
    /// Hash of the description and of all files it refers to.
    pub hash: SceneHash,
    /// Names of the channels: `R`, `G`, `B`, or `Y`, or wavelengths, or quantities.
    pub channel_names: Vec<String>,
    /// What is found of sensor rays besides light, if light is what the picture shows.
    pub quantities: Option<AovTracer>,
    /// Quantities of sensor rays, be they what the picture shows or found besides, in the order of their tracer.
    pub quantity_names: Vec<NamedQuantity>,
    /// Name of the layer of the second moment of light, if that is wanted.
    pub moment: Option<String>,
    /// Names of the emitters, all different: their ids, those of their shapes, or their kinds. Without dots,
    /// which separate the names of layers.
    pub emitter_names: Vec<String>,
    /// How the film tells light apart.
    pub layering: Layering,
    /// Whether an image with less weight for rare bright samples is wanted beside the plain one.
    pub reweight: bool,
    /// Whether light that comes straight from emitters is left out: see [`transport::render::RenderOptions::hide_emitters`].
    pub hide_emitters: bool,
    /// Whether noisy pixels get more samples: see [`transport::render::RenderOptions::adaptive`].
    pub adaptive: bool,
    /// Whether nothing names a tolerance: see [`transport::render::RenderOptions::loosens_tolerance`].
    pub has_open_tolerance: bool,
    /// What the scene says of its estimator.
    pub(super) estimators: integrator::Parameters,
}

impl Loaded {
    /// What the scene's `aov` takes optical path differences against, if it names an index.
    pub fn reference(&self) -> Option<Reference<'_>> {
        let tracer = match &self.renderer {
            Renderer::Quantities(tracer) => Some(tracer),
            Renderer::Light(_) => self.quantities.as_ref(),
        };
        let reference = tracer.and_then(|tracer| tracer.reference);
        reference.map(|index| index.of(self.scene()))
    }

    /// Name of the integrator, as scene files say it: `auto` if a pilot chooses one.
    pub fn integrator(&self) -> &'static str {
        if self.candidates.is_empty() {
            self.renderer.name()
        } else {
            AUTO
        }
    }

    /// Whether each wavelength has paths of its own: some medium disperses, or the sensor's aperture diffracts.
    pub fn is_dispersive(&self) -> bool {
        self.scene().film().group_size == 1 && self.groups.len() > 1
    }

    /// The scenes whose rays are those of the first: all, unless each wavelength has paths of its own.
    pub fn same_rays(&self) -> &[Scene] {
        if self.is_dispersive() {
            &self.groups[..1]
        } else {
            &self.groups
        }
    }

    /// Notes of where Mitsuba would render it otherwise.
    pub fn notes_of_differences(&self) -> Diagnostics {
        let mut notes = self.warnings.emptied();
        for (i, Difference { topic, text }) in self.differences.iter().enumerate() {
            let last = i + 1 == self.differences.len();
            let help = last.then(|| String::from("docs/mitsuba.md says how much it matters"));
            let message = format!("not as in Mitsuba 3 ({topic}): {text}");
            notes.push(lints::note(lints::DIFFERS_FROM_MITSUBA, message).help(help));
        }
        notes
    }

    /// The scene of the first channel group: geometry and sensor are the same in all, and indices if no medium
    /// disperses.
    pub fn scene(&self) -> &Scene {
        &self.groups[0]
    }

    /// The renderer of the given name, with what the scene says of its own, as [`LoadOptions`](crate::LoadOptions) would
    /// choose it.
    ///
    /// # Errors
    /// An unknown name; one that does not follow the parts of light that the scene asks for; and one that needs the scene to be assembled
    /// anew: `aov` in place of light, or light in place of `aov`.
    pub fn renderer_named(&self, name: &str) -> Result<NamedRenderer, Diagnostics> {
        let mut diagnostics = Diagnostics::new();
        let kind = integrator::named(name, &mut diagnostics);
        let kind = integrator::of_parts(kind, self.layering.decomposition.parts);
        let kind = kind.unwrap_or_else(|message| {
            diagnostics.push(Diagnostic::error(message));
            Kind::Path
        });
        let mut renderer = self.estimators.renderer(kind);
        if renderer.is_light() != self.renderer.is_light() {
            let message = format!(
                "the scene was loaded for the integrator {}",
                self.renderer.name()
            );
            let help = format!("load it for the integrator {name}");
            diagnostics.push(Diagnostic::error(message).help(help));
        }
        if diagnostics.has_errors() {
            return Err(diagnostics);
        }
        let mut candidates = Vec::new();
        if kind == Kind::Auto {
            candidates = lint::complete(self.scene(), self.estimators.candidates(), self.adaptive);
            renderer = candidates.first().map_or(renderer, |i| Renderer::Light(*i));
        }
        let problems = renderer
            .integrator()
            .map(|i| lint::missing_light(self.scene(), i));
        for problem in problems.into_iter().flatten() {
            diagnostics.push(lints::of_scene(&problem));
        }
        Ok(NamedRenderer {
            renderer,
            candidates,
            doubts: diagnostics,
        })
    }
}
