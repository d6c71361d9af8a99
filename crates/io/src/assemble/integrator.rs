//! Integrators.

use super::context::Context;
use super::field;
use super::options::LoadOptions;
use crate::diagnostic::{Diagnostic, Diagnostics, suggest};
use crate::query::{POSITIVE, Query, unknown_plugin};
use crate::scene::{ObjectDescription, PluginKind};
use eikonal::Tolerance;
use glam::DVec3;
use transport::aov::{Aov, AovTracer, ReferenceIndex};
use transport::integrator::{
    Bdpt, Connections, Heuristic, Integrator, ParticleTracer, PathTracer, PhotonMapping,
    PhotonQuery,
};
use transport::medium::Medium;
use transport::renderer::Renderer;

/// Names under which scene files and command lines may ask for an estimator. The first three are one
/// and the same path tracer, the next two one particle tracer.
const KNOWN: [(&str, Kind); 10] = [
    ("path", Kind::Path),
    ("volpath", Kind::Path),
    ("volpathmis", Kind::Path),
    ("direct", Kind::Direct),
    ("particle", Kind::Particle),
    ("ptracer", Kind::Particle),
    ("bdpt", Kind::Bdpt),
    ("aov", Kind::Aov),
    ("photon", Kind::Photon),
    ("sppm", Kind::Sppm),
];
/// Integrators that show what others find, and more.
const HOLDERS: [&str; 3] = ["moment", "stokes", "aov"];
/// Edges of a path that scatters once: from the emitter to the surface to the sensor.
const DIRECT_DEPTH: u32 = 2;
/// What connections can keep track of.
const MOST_REFLECTIONS: i64 = 28;
/// More light subpaths than a map has memory for.
const MOST_PHOTONS: i64 = 1_000_000_000;

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Path,
    /// The path tracer of light that scatters once.
    Direct,
    Particle,
    Bdpt,
    Aov,
    Photon,
    Sppm,
}

/// How a scene is to be rendered.
pub(super) struct Method {
    pub renderer: Renderer,
    pub parameters: Parameters,
}

impl Method {
    /// Whether quantities other than light are asked for.
    pub(crate) fn is_aov(&self) -> bool {
        !self.renderer.is_light()
    }
}

/// What a file says of its estimator. The parameters of the bidirectional one include those that all
/// have in common.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Parameters {
    bdpt: Bdpt,
    aov: AovTracer,
    photon: PhotonMapping,
    pub tolerance: Tolerance,
    pub reflections: u32,
}

impl Parameters {
    pub fn renderer(&self, kind: Kind) -> Renderer {
        let Bdpt {
            max_depth,
            rr_depth,
            ..
        } = self.bdpt;
        let integrator = match kind {
            Kind::Aov => return Renderer::Quantities(self.aov),
            Kind::Path => Integrator::Path(PathTracer {
                max_depth,
                rr_depth,
            }),
            Kind::Direct => Integrator::Path(PathTracer {
                max_depth: Some(DIRECT_DEPTH),
                rr_depth,
            }),
            Kind::Particle => Integrator::Particle(ParticleTracer {
                max_depth,
                rr_depth,
            }),
            Kind::Bdpt => Integrator::Bdpt(self.bdpt),
            Kind::Photon | Kind::Sppm => Integrator::Photon(PhotonMapping {
                max_depth,
                rr_depth,
                progressive: kind == Kind::Sppm,
                ..self.photon
            }),
        };
        Renderer::Light(integrator)
    }
}

/// Whether the scene is asked for other quantities than light.
pub(super) fn is_aov(root: &ObjectDescription, options: &LoadOptions) -> bool {
    let name = options.integrator.as_deref();
    let name = name.or(nested_in(root).map(|o| held(o).plugin.as_str()));
    name.and_then(find) == Some(Kind::Aov)
}

/// The scene's integrator, or the path tracer with its defaults. An estimator that the caller names
/// takes its place, but keeps the parameters that are common to all.
pub(super) fn build(
    object: Option<&ObjectDescription>,
    options: &LoadOptions,
    context: &mut Context,
) -> Method {
    let object = object.map(|object| {
        let held = held(object);
        check_holders(object, context);
        held
    });
    let written = object.and_then(|object| plugin(object, context));
    let wanted = options
        .integrator
        .as_deref()
        .map(|n| named(n, context.diagnostics));
    let kind = wanted.or(written).unwrap_or(Kind::Path);
    let parameters = match (object, written) {
        (Some(object), Some(written)) => read(object, written, context),
        _ => Parameters::default(),
    };
    Method {
        renderer: parameters.renderer(kind),
        parameters,
    }
}

/// The first integrator in an object.
fn nested_in(object: &ObjectDescription) -> Option<&ObjectDescription> {
    let mut children = object.children.iter().map(|c| &*c.object);
    children.find(|o| o.kind == PluginKind::Integrator)
}

/// The integrator that renders: the first of those in one that shows what others find.
fn held(object: &ObjectDescription) -> &ObjectDescription {
    let nested = nested_in(object).filter(|_| HOLDERS.contains(&object.plugin.as_str()));
    nested.map_or(object, held)
}

/// Reports what is wrong with integrators that hold others.
fn check_holders(object: &ObjectDescription, context: &mut Context) {
    let mut object = object;
    while HOLDERS.contains(&object.plugin.as_str())
        && let Some(nested) = nested_in(object)
    {
        let mut query = Query::new(object, context.diagnostics);
        query.children(PluginKind::Integrator);
        if object.plugin == "aov" {
            query.string_or("aovs", "");
        }
        query.finish(&[]);
        object = nested;
    }
}

fn find(name: &str) -> Option<Kind> {
    KNOWN
        .iter()
        .find(|(n, _)| *n == name)
        .map(|(_, kind)| *kind)
}

/// The kind that a file asks for; none if it is unknown, and for one that holds others but has none.
fn plugin(object: &ObjectDescription, context: &mut Context) -> Option<Kind> {
    let known = find(&object.plugin);
    if known.is_none() && HOLDERS.contains(&object.plugin.as_str()) {
        Query::new(object, context.diagnostics).required_child(PluginKind::Integrator);
        return None;
    }
    if known.is_none() {
        unknown_plugin(object, &KNOWN.map(|(name, _)| name), context.diagnostics);
    }
    known
}

/// The kind that the caller asks for.
pub(super) fn named(name: &str, diagnostics: &mut Diagnostics) -> Kind {
    find(name).unwrap_or_else(|| {
        let names = KNOWN.map(|(name, _)| name);
        let help = suggest(name, names)
            .unwrap_or_else(|| format!("known integrators: {}", names.join(", ")));
        let message = format!("unknown integrator '{name}'");
        diagnostics.push(Diagnostic::error(message).help(help));
        Kind::Path
    })
}

fn read(object: &ObjectDescription, kind: Kind, context: &mut Context) -> Parameters {
    let default = Parameters::default();
    let mut bdpt = default.bdpt;
    let reference = match kind {
        Kind::Aov => reference(object, context),
        _ => None,
    };
    let mut query = Query::new(object, context.diagnostics);
    let max_depth = match kind {
        Kind::Direct => i64::from(DIRECT_DEPTH),
        _ => query.integer_in("max_depth", -1..=1_000_000, -1),
    };
    let rr_depth = query.integer_in("rr_depth", 1..=1_000_000, i64::from(bdpt.rr_depth));
    let tolerance = query.float_in("tolerance", 1e-12..=1e-4, default.tolerance.get());
    let reflections = query.integer_in("reflections", 0..=MOST_REFLECTIONS, 0);
    query.boolean_or("hide_emitters", false);
    // How work is divided; Mitsuba's scene files have them.
    query.has("samples_per_pass");
    query.has("block_size");
    if kind == Kind::Direct {
        for name in ["shading_samples", "emitter_samples", "bsdf_samples"] {
            query.integer_in(name, 0..=1_000_000, 1);
        }
    }
    bdpt.max_depth = u32::try_from(max_depth).ok();
    bdpt.rr_depth = rr_depth as u32;
    if kind == Kind::Bdpt {
        let heuristics = [Heuristic::Balance, Heuristic::Power];
        bdpt.heuristic = heuristics[query.one_of("heuristic", &["balance", "power"])];
        let connections = [Connections::Resampled, Connections::All];
        bdpt.connections = connections[query.one_of("connections", &["resampled", "all"])];
    }
    let aov = match kind {
        Kind::Aov => aov(&mut query, reference),
        _ => default.aov,
    };
    let photon = match kind {
        Kind::Photon | Kind::Sppm => photons(&mut query),
        _ => default.photon,
    };
    query.finish(&[]);
    Parameters {
        bdpt,
        aov,
        photon,
        tolerance: Tolerance::new(tolerance),
        reflections: reflections as u32,
    }
}

/// The index of which optical path differences are taken.
fn reference(object: &ObjectDescription, context: &mut Context) -> Option<ReferenceIndex> {
    let field = field::named(object, "reference_index", context)?;
    Some(if field.is_constant() {
        ReferenceIndex::Constant(field.n(DVec3::ZERO))
    } else {
        let medium = Medium::transparent("reference_index", field);
        let place = Some(object.location.clone());
        ReferenceIndex::Medium(context.add_medium(medium, false, place))
    })
}

/// Which quantities, and what they are compared with.
fn aov(query: &mut Query, reference: Option<ReferenceIndex>) -> AovTracer {
    query.has("reference_index");
    let wavelength = query
        .has("wavelength")
        .then(|| query.float_in("wavelength", POSITIVE, None));
    let mut tracer = quantities(query, wavelength.is_some());
    (tracer.reference, tracer.wavelength) = (reference, wavelength);
    tracer
}

/// The quantities in a list such as `deflection, optical_length`; all without one.
fn quantities(query: &mut Query, waves: bool) -> AovTracer {
    if !query.has("aovs") {
        return AovTracer::default();
    }
    let names = Aov::ALL.map(Aov::name);
    let list = query.string("aovs");
    let words = list.split([',', ' ']).filter(|word| !word.is_empty());
    let mut wanted = Vec::new();
    for word in words {
        match Aov::ALL.into_iter().find(|aov| aov.name() == word) {
            Some(aov) => wanted.push(aov),
            None => {
                let help = suggest(word, names).unwrap_or_else(|| names.join(", "));
                query.error("aovs", format!("unknown aov '{word}' ({help})"));
            }
        }
    }
    if wanted.contains(&Aov::Waves) && !waves {
        let message = "waves need a 'wavelength', in vacuum and in scene units";
        query.error("aovs", message);
    }
    if wanted.is_empty() {
        query.error("aovs", format!("expected a list of: {}", names.join(", ")));
    }
    AovTracer::new(&wanted)
}

fn photons(query: &mut Query) -> PhotonMapping {
    let mut photon = PhotonMapping::default();
    if query.has("photons") {
        photon.photons = Some(query.integer_in("photons", 1..=MOST_PHOTONS, 1) as usize);
    }
    if query.has("radius") {
        photon.radius = Some(query.float_in("radius", POSITIVE, 1.0));
    }
    let queries = [PhotonQuery::Beam, PhotonQuery::Point];
    photon.query = queries[query.one_of("query", &["beam", "point"])];
    photon
}
