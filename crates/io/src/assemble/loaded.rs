//! Scene that is ready to render, with its renderer and settings.

use super::CondensedGrid;
use super::film::Layering;
use super::instrument::Instrument;
use super::integrator::{self, AUTO, Kind};
use super::lint;
use super::options::LoadOptions;
use super::quantities::NamedQuantity;
use super::reuse::Reuse;
use super::sampler::SamplerRequest;
use super::sound_record::SoundRecord;
use crate::diagnostic::Difference;
use crate::diagnostic::{Diagnostic, Diagnostics, lints};
use crate::scene::{ObjectId, SceneDescription, SceneHash};
use eikonal::Reference;
use std::any::Any;
use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::Arc;
use transport::aov::AovTracer;
use transport::integrator::Integrator;
use transport::renderer::Renderer;
use transport::sampling::Replicates;
use transport::scene::Scene;

/// Renderer of a given name, for a scene.
#[derive(Debug)]
pub struct NamedRenderer {
    /// Renderer of the picture.
    pub renderer: Renderer,
    /// Estimators from which a pilot chooses, if the name is `auto`: see [`Loaded::candidates`].
    pub candidates: Vec<Integrator>,
    /// Warnings about the renderer.
    pub warnings: Diagnostics,
}

/// Scene that is ready to render.
#[derive(Debug)]
pub struct Loaded {
    /// Scenes of the groups of up to four spectral channels; they differ only in spectra. If an
    /// index, a phase function or diffraction at the aperture depends on the wavelength, each
    /// channel is a group.
    pub groups: Vec<Scene>,
    /// Renderer of the picture.
    pub renderer: Renderer,
    /// Estimators from which a pilot chooses, including the renderer. The list is empty if the
    /// scene or the caller names an estimator.
    pub candidates: Vec<Integrator>,
    /// Samples per pixel, or number of particles if there are instruments.
    pub samples: u64,
    /// Sampler that the scene or the caller names.
    pub sampler: SamplerRequest,
    /// Meters, if the scene has meters instead of a camera.
    pub instruments: Vec<Instrument>,
    /// Components of the volumes of sound.
    pub sounds: Vec<SoundRecord>,
    /// Grids of the index that are stored with fewer samples than their files have.
    pub condensed: Vec<CondensedGrid>,
    /// Prefiltered grids of the index and surfaces between labels. Other scenes can share them
    /// while they are held here.
    pub held: Vec<Arc<dyn Any + Send + Sync>>,
    /// Warnings about the scene.
    pub warnings: Diagnostics,
    /// Points in which Mitsuba would render the scene differently.
    pub differences: Vec<Difference>,
    /// True if Mitsuba 3 has all plugins and parameters of the scene.
    pub is_for_mitsuba: bool,
    /// Data files to which the scene refers.
    pub files: Vec<PathBuf>,
    /// Hash of the description and of all files to which it refers.
    pub hash: SceneHash,
    /// Names of the channels: `R`, `G`, `B`; `Y`; wavelengths; or quantities.
    pub channel_names: Vec<String>,
    /// Tracer of quantities of sensor rays, if the picture shows light and quantities accompany it.
    pub quantities: Option<AovTracer>,
    /// Quantities of sensor rays in the order of their tracer, whether they are the picture or
    /// accompany it.
    pub quantity_names: Vec<NamedQuantity>,
    /// Name of the layer for the second moment of light, if requested.
    pub moment: Option<String>,
    /// Unique names of the emitters: their ids, the ids of their shapes, or their kinds. They
    /// contain no dots, which separate the names of layers.
    pub emitter_names: Vec<String>,
    /// Decomposition of the light on the film.
    pub layering: Layering,
    /// True if an image with less weight for rare bright samples is requested in addition.
    pub reweight: bool,
    /// True if light that comes straight from emitters is left out: see
    /// [`transport::render::RenderOptions::hide_emitters`].
    pub hide_emitters: bool,
    /// True if noisy pixels get more samples: see [`transport::render::RenderOptions::adaptive`].
    pub adaptive: bool,
    /// True if the scene names no tolerance: see
    /// [`transport::render::RenderOptions::loosens_tolerance`].
    pub has_open_tolerance: bool,
    /// Parts that scenes with other values of parameters reuse, if they are kept.
    pub(super) reuse: Option<Reuse>,
    /// Parameters of the estimators in the scene.
    pub(super) estimators: integrator::Parameters,
}

impl Loaded {
    /// Assembles a description that differs from the description of this scene only in the
    /// `changed` objects. Meshes, images, grids and hierarchies that do not depend on these objects
    /// are shared, and their files are not read again, if [`LoadOptions::keeps_parts`] kept them.
    ///
    /// # Errors
    /// All errors of the scene, with its warnings. Warnings about shared parts are not repeated.
    pub fn with_changes(
        &self,
        description: &SceneDescription,
        changed: &HashSet<ObjectId>,
        options: &LoadOptions,
        diagnostics: Diagnostics,
    ) -> Result<Loaded, Diagnostics> {
        let reuse = self.reuse.as_ref();
        let reuse = reuse.map(|reuse| reuse.without(description, changed));
        let known = reuse.map(|reuse| (reuse, &self.groups[..]));
        super::assemble_from(description, options, known, diagnostics)
    }

    /// Returns the reference for the optical path differences of the scene's `aov`, if the `aov`
    /// names an index.
    pub fn reference(&self) -> Option<Reference<'_>> {
        let tracer = match &self.renderer {
            Renderer::Quantities(tracer) => Some(tracer),
            Renderer::Light(_) => self.quantities.as_ref(),
        };
        let reference = tracer.and_then(|tracer| tracer.reference);
        reference.map(|index| index.of(self.scene()))
    }

    /// Returns the grouping of a pixel's samples into replicates, if `samples` are taken per pixel
    /// and the renderer [supports it](Renderer::replicates).
    pub fn replicates(&self, samples: u64) -> Replicates {
        self.sampler.replicates(self.scene(), samples)
    }

    /// Returns the name of the integrator in scene files; `auto` if a pilot chooses one.
    pub fn integrator(&self) -> &'static str {
        if self.candidates.is_empty() {
            self.renderer.name()
        } else {
            AUTO
        }
    }

    /// Returns true if each wavelength has its own paths, because a medium disperses or the
    /// sensor's aperture diffracts.
    pub fn is_dispersive(&self) -> bool {
        self.scene().film().group_size == 1 && self.groups.len() > 1
    }

    /// Returns the scenes that share their rays with the first: all scenes, unless each wavelength
    /// has its own paths.
    pub fn same_rays(&self) -> &[Scene] {
        if self.is_dispersive() {
            &self.groups[..1]
        } else {
            &self.groups
        }
    }

    /// Returns a note that lists the differences from Mitsuba, if Mitsuba can render the scene and
    /// would render it differently.
    pub fn note_of_differences(&self) -> Diagnostics {
        let mut notes = self.warnings.emptied();
        if self.is_for_mitsuba && !self.differences.is_empty() {
            let topics: Vec<_> = self.differences.iter().map(|d| d.topic).collect();
            let topics = topics.join(", ");
            let message = format!("differs from Mitsuba 3 in: {topics}; `morgana check` explains");
            notes.push(lints::note(lints::DIFFERS_FROM_MITSUBA, message));
        }
        notes
    }

    /// Returns a note about each difference from Mitsuba.
    pub fn notes_of_differences(&self) -> Diagnostics {
        let mut notes = self.warnings.emptied();
        for (i, Difference { topic, text }) in self.differences.iter().enumerate() {
            let last = i + 1 == self.differences.len();
            let help =
                last.then(|| String::from("docs/mitsuba.md states the effect of each difference"));
            let message = format!("not as in Mitsuba 3 ({topic}): {text}");
            notes.push(lints::note(lints::DIFFERS_FROM_MITSUBA, message).help(help));
        }
        notes
    }

    /// Returns the scene of the first channel group. All groups share geometry and sensor, and also
    /// indices if no medium disperses.
    pub fn scene(&self) -> &Scene {
        &self.groups[0]
    }

    /// Returns the renderer of a given name, with the scene's parameters, as
    /// [`LoadOptions`](crate::LoadOptions) would choose it.
    ///
    /// # Errors
    /// An unknown name; an estimator that does not follow the parts of light that the scene
    /// requests; and an integrator for which the scene must be assembled again: `aov` in place of
    /// light, or light in place of `aov`.
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
            warnings: diagnostics,
        })
    }
}
