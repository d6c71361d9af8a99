//! Assembly of a scene from a scene description.
//!
//! Reports all errors, with their places, before giving up.

mod aperture;
mod assets;
mod brightness;
mod bsdf;
mod channels;
mod clipping;
mod colour;
mod content;
mod context;
mod described;
mod distant;
mod division;
mod emitter;
mod field;
mod film;
mod flakes;
mod fluorescence;
mod frequency_domain;
mod group;
mod index_grid;
mod instrument;
mod integrator;
mod lint;
mod loaded;
mod medium;
mod meter;
mod options;
mod phase;
mod placed_grid;
mod quantities;
mod reuse;
mod sampler;
mod sensor;
mod shape;
mod side_request;
mod sides;
mod sound_record;
mod surface_texture;
mod suspension;
mod tagging;
mod texture;
mod texture_role;
mod tissue;
mod transforms;
mod undisturbed;
mod units;
mod velocity;
mod volume_source;

pub use crate::diagnostic::Difference;
pub use field::CondensedGrid;
pub use film::Layering;
pub use instrument::{Gruneisen, Instrument, Normalization};
pub use lint::{SpecularSurfaces, steps_across};
pub use loaded::{Loaded, NamedRenderer};
pub use options::LoadOptions;
pub use quantities::NamedQuantity;
pub use sampler::SamplerRequest;
pub use sound_record::{FactSource, SeriesRecord, SoundRecord};

use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::features::Features;
use crate::query::Query;
use crate::read_scene;
use crate::scene::{FileRegistry, PluginKind, SceneDescription, SceneHash};
use assets::Assets;
use channels::Channels;
use context::Context;
use group::Group;
use reuse::Reuse;
use std::path::Path;
use transport::renderer::Renderer;
use transport::scene::Scene;

/// Reads a scene file with [`read_scene`], assembles the scene and checks it.
///
/// # Errors
/// All errors of the scene, with its warnings.
pub fn load_scene(path: &Path, options: &LoadOptions) -> Result<Loaded, Diagnostics> {
    load_described_scene(path, options).map(|(loaded, _)| loaded)
}

/// Loads a scene file like [`load_scene`]. Also returns the description of the scene.
///
/// # Errors
/// All errors of the scene, with its warnings.
pub fn load_described_scene(
    path: &Path,
    options: &LoadOptions,
) -> Result<(Loaded, SceneDescription), Diagnostics> {
    let mut diagnostics = Diagnostics::new();
    options.loading.begin("reading the scene file");
    match read_scene(path, &options.defines, options.limits, &mut diagnostics) {
        Some(description) => {
            let loaded = assemble(&description, options, diagnostics)?;
            Ok((loaded, description))
        }
        None => Err(diagnostics),
    }
}

/// Assembles and checks a scene description. `diagnostics` holds messages from reading the
/// description. [`LoadOptions::defines`] have no effect: [`read_scene`] has applied them as
/// `overrides`.
///
/// # Errors
/// All errors of the scene, with its warnings.
pub fn assemble(
    description: &SceneDescription,
    options: &LoadOptions,
    diagnostics: Diagnostics,
) -> Result<Loaded, Diagnostics> {
    assemble_from(description, options, None, diagnostics)
}

/// Assembles a scene like [`assemble`], from parts and scenes of a similar description.
fn assemble_from(
    description: &SceneDescription,
    options: &LoadOptions,
    known: Option<(Reuse, &[Scene])>,
    mut diagnostics: Diagnostics,
) -> Result<Loaded, Diagnostics> {
    // Prepare the description and the channels.
    diagnostics.silence(&options.silenced);
    let without = options
        .undisturbed
        .then(|| undisturbed::undisturbed(description));
    let description = without.as_ref().unwrap_or(description);
    let (reuse, known) = known.unzip();
    let Reuse {
        mut assets,
        mut files,
    } = reuse.unwrap_or_else(|| Reuse {
        assets: Assets::default(),
        files: FileRegistry::within(options.limits).searching(description.folders.clone()),
    });
    let channels = integrator::channels(&description.root, options, &mut diagnostics);
    // Assemble the scene of each group of channels.
    let mut groups = Vec::new();
    for group in 0..channels.groups() {
        // Report warnings for the first group only: all groups have equal ones.
        let mut later = Diagnostics::new();
        let log = if group == 0 {
            &mut diagnostics
        } else {
            &mut later
        };
        let context = Context::new(&channels, group, log, &mut files, &mut assets);
        let first = groups.first().map(|group: &Group| &group.scene);
        let alike = first.or(known.and_then(|scenes| scenes.first()));
        let group = Group::new(description, options, alike, context);
        groups.extend(group);
        if let Some(error) = options.loading.error() {
            return Err(error);
        }
        if later.has_errors() {
            return Err(later);
        }
        if diagnostics.has_errors() {
            return Err(diagnostics);
        }
    }
    // Hash the description and its files.
    options.loading.begin("hashing the files of the scene");
    if options.keeps_parts
        && let Err(error) = files.hash_contents()
    {
        diagnostics.push(Diagnostic::error(error.to_string()));
        return Err(diagnostics);
    }
    let Some(hash) = fingerprint(description, &files, &mut diagnostics) else {
        return Err(diagnostics);
    };
    let hash = if options.undisturbed {
        hash.undisturbed()
    } else {
        hash
    };
    let Some(first) = groups.first_mut() else {
        return Err(diagnostics);
    };
    let emitter_names = std::mem::take(&mut first.emitter_names);
    // Find the differences from Mitsuba.
    let known = lint::Known {
        description,
        scene: &first.scene,
        counted: options.samples.is_some(),
    };
    let mut met = std::mem::take(&mut first.differences);
    met.extend(diagnostics.differences());
    let differences = lint::differences(&known, &met);
    let is_for_mitsuba = Features::of(description).own.is_empty();
    // Collect the settings that all groups share from the first.
    let (renderer, estimators) = (first.method.renderer, first.method.parameters);
    let samples = first.whole_periods(&mut diagnostics);
    let (layering, reweight) = (first.layering, first.reweight);
    let adaptive = first.adaptive;
    let sampler = first.sampler;
    let candidates = std::mem::take(&mut first.candidates);
    let instruments = std::mem::take(&mut first.instruments);
    let sounds = std::mem::take(&mut first.sounds);
    let condensed = std::mem::take(&mut first.condensed);
    let (quantities, moment) = (first.method.quantities, first.method.moment.take());
    let quantity_names = std::mem::take(&mut first.method.names);
    let channel_names = match &renderer {
        Renderer::Quantities(_) => {
            let names = quantity_names.iter().flat_map(|q| q.channels.clone());
            names.collect()
        }
        Renderer::Light(_) => channels.names(),
    };
    let held = assets.held.clone();
    let paths = files.paths().map(Path::to_owned).collect();
    let reuse = options.keeps_parts.then_some(Reuse { assets, files });
    Ok(Loaded {
        instruments,
        sounds,
        condensed,
        held,
        reuse,
        groups: groups.into_iter().map(|g| g.scene).collect(),
        renderer,
        candidates,
        samples,
        sampler,
        warnings: diagnostics,
        differences,
        is_for_mitsuba,
        files: paths,
        hash,
        channel_names,
        quantities,
        moment,
        quantity_names,
        emitter_names,
        layering,
        reweight,
        hide_emitters: estimators.hide_emitters,
        adaptive,
        has_open_tolerance: estimators.tolerance.is_none(),
        estimators,
    })
}

/// Refractive index without a scene.
#[derive(Debug)]
pub struct LoadedField {
    /// Field of the index.
    pub field: eikonal::Field,
    /// Hash of the description and of all files to which it refers.
    pub hash: SceneHash,
    /// Warnings about the index.
    pub warnings: Diagnostics,
}

/// Assembles the refractive index that the only volume of a description describes. If the
/// description has a sensor with a film of wavelengths, the index is at the first of these.
/// `diagnostics` holds messages from reading the description.
///
/// # Errors
/// All errors of the description.
pub fn assemble_field(
    description: &SceneDescription,
    mut diagnostics: Diagnostics,
) -> Result<LoadedField, Diagnostics> {
    let root = &description.root;
    let channels = Channels::of(root, &mut diagnostics).apart();
    let mut query = Query::new(root, &mut diagnostics);
    let volume = query.required_child(PluginKind::Volume);
    // Mark sensors as used: only their film matters, and it has been read.
    query.children(PluginKind::Sensor);
    query.finish(&[]);
    let mut files = FileRegistry::new().searching(description.folders.clone());
    let mut assets = Assets::default();
    let mut context = Context::new(&channels, 0, &mut diagnostics, &mut files, &mut assets);
    let field = volume.and_then(|volume| field::build(volume, &mut context));
    match (field, fingerprint(description, &files, &mut diagnostics)) {
        (Some(field), Some(hash)) if !diagnostics.has_errors() => Ok(LoadedField {
            field,
            hash,
            warnings: diagnostics,
        }),
        _ => Err(diagnostics),
    }
}

/// Returns the hash of a description and of the files to which it refers.
fn fingerprint(
    description: &SceneDescription,
    files: &FileRegistry,
    diagnostics: &mut Diagnostics,
) -> Option<SceneHash> {
    let hash = description.hash(files);
    hash.map_err(|error| diagnostics.push(Diagnostic::error(error.to_string())))
        .ok()
}
