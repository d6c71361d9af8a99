//! Integrators and the integrators that wrap them.

use super::channels::Channels;
use super::context::Context;
use super::options::LoadOptions;
use super::quantities::{NamedQuantity, RequestedQuantities, Setting, requests_colour, square_of};
use super::tagging::sidebands;
use crate::diagnostic::{Diagnostic, Diagnostics, suggest};
use crate::query::{Query, unknown_plugin};
use crate::scene::{ObjectDescription, PluginKind, Value};
use crate::schema;
use eikonal::Tolerance;
use transport::aov::AovTracer;
use transport::film::LightParts;
use transport::integrator::{
    Bdpt, Connections, Heuristic, Integrator, ParticleTracer, PathTracer, PhotonMapping,
    PhotonQuery, Vcm,
};
use transport::renderer::Renderer;

/// Name that leaves the choice of the integrator to a pilot.
pub(super) const AUTO: &str = "auto";
/// Names by which scene files and command lines request an estimator. `path`, `volpath` and
/// `volpathmis` are the same path tracer; `particle` and `ptracer` are the same particle tracer.
const KNOWN: [(&str, Kind); 14] = [
    (AUTO, Kind::Auto),
    ("path", Kind::Path),
    ("volpath", Kind::Path),
    ("volpathmis", Kind::Path),
    ("direct", Kind::Direct),
    ("particle", Kind::Particle),
    ("ptracer", Kind::Particle),
    ("bdpt", Kind::Bdpt),
    ("vcm", Kind::Vcm),
    ("aov", Kind::Aov),
    ("depth", Kind::Depth),
    ("photon", Kind::Photon),
    ("sppm", Kind::Sppm),
    ("preview", Kind::Preview),
];
/// Parameters specific to `aov`: see [`RequestedQuantities::of`].
const AOV: [&str; 3] = ["aovs", "wavelength", "reference_index"];
/// Number of edges of a path that scatters once: from the emitter to the surface to the sensor.
const DIRECT_DEPTH: u32 = 2;
/// Kind of integrator that a name requests.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Estimator that a pilot finds best.
    Auto,
    Path,
    /// Path tracer of light that scatters at most once.
    Direct,
    Particle,
    Bdpt,
    Vcm,
    Aov,
    /// The quantity `depth` alone, as by Mitsuba's integrator of that name.
    Depth,
    Photon,
    Sppm,
    /// Path tracing of light that scatters once, and photons for the rest.
    Preview,
}

impl Kind {
    /// Returns true if quantities of sensor rays replace light.
    fn is_of_quantities(self) -> bool {
        matches!(self, Kind::Aov | Kind::Depth)
    }
}

/// Rendering method of a scene.
pub(super) struct Method {
    pub renderer: Renderer,
    /// True if a pilot chooses the estimator.
    pub is_open: bool,
    pub parameters: Parameters,
    /// Tracer of quantities of sensor rays in addition to light.
    pub quantities: Option<AovTracer>,
    /// Names of the quantities, whether they replace light or accompany it.
    pub names: Vec<NamedQuantity>,
    /// Name of the layer for the second moment of light, if requested.
    pub moment: Option<String>,
    /// Requested parts of light, such as Stokes parameters.
    pub parts: Option<LightParts>,
}

impl Method {
    /// Returns true if quantities other than light are requested.
    pub(crate) fn is_aov(&self) -> bool {
        !self.renderer.is_light()
    }

    /// Removes features that only pictures have.
    pub(crate) fn leave_pictures(&mut self) {
        (self.quantities, self.moment, self.parts) = (None, None, None);
        self.names.clear();
    }
}

/// Parameters of the estimator in a scene file. `bdpt` includes the parameters that all estimators
/// have in common.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Parameters {
    bdpt: Bdpt,
    aov: AovTracer,
    photon: PhotonMapping,
    /// True if light that comes straight from emitters is left out.
    pub hide_emitters: bool,
    /// Accuracy of rays; `None` leaves it to the default, or to a pilot.
    pub tolerance: Option<Tolerance>,
    pub reflections: u32,
}

impl Parameters {
    /// Returns the renderer of a kind.
    pub(super) fn renderer(&self, kind: Kind) -> Renderer {
        let integrator = self.integrator(kind).map(Renderer::Light);
        integrator.unwrap_or(Renderer::Quantities(self.aov))
    }

    /// Returns the estimators from which a pilot may choose.
    pub(super) fn candidates(&self) -> impl Iterator<Item = Integrator> {
        let kinds = [Kind::Path, Kind::Particle, Kind::Bdpt].into_iter();
        kinds.filter_map(|kind| self.integrator(kind))
    }

    /// Returns an estimator; `None` for an integrator that does not compute light.
    fn integrator(&self, kind: Kind) -> Option<Integrator> {
        let Bdpt {
            max_depth,
            rr_depth,
            heuristic,
            connections,
        } = self.bdpt;
        Some(match kind {
            Kind::Aov | Kind::Depth => return None,
            Kind::Auto | Kind::Path => Integrator::Path(PathTracer {
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
            Kind::Vcm => Integrator::Vcm(Vcm {
                max_depth,
                rr_depth,
                heuristic,
                connections,
                radius: self.photon.radius,
            }),
            Kind::Photon | Kind::Sppm => Integrator::Photon(PhotonMapping {
                max_depth,
                rr_depth,
                progressive: kind == Kind::Sppm,
                ..self.photon
            }),
            Kind::Preview => Integrator::Photon(PhotonMapping {
                max_depth,
                rr_depth,
                photons: self.photon.photons,
                radius: self.photon.radius,
                ..PhotonMapping::preview()
            }),
        })
    }
}

/// Returns true if the scene requests quantities other than light.
fn is_aov(root: &ObjectDescription, options: &LoadOptions) -> bool {
    let name = options.integrator.as_deref();
    let name = name.or(nested_in(root).map(|o| held(o).plugin.as_str()));
    name.and_then(find).is_some_and(Kind::is_of_quantities)
}

/// Returns the channels of a scene. Quantities that replace light have one channel, unless one of
/// them is a colour.
pub(super) fn channels(
    root: &ObjectDescription,
    options: &LoadOptions,
    diagnostics: &mut Diagnostics,
) -> Channels {
    let channels = Channels::of(root, diagnostics);
    if !is_aov(root, options) || (channels == Channels::Rgb && shows_colour(root)) {
        return channels;
    }
    channels.single(diagnostics)
}

/// Returns true if an `aov` of the scene lists a colour.
fn shows_colour(root: &ObjectDescription) -> bool {
    let chain = std::iter::successors(nested_in(root), |object| nested_in(object));
    let lists = chain.flat_map(|object| &object.properties);
    let mut lists = lists.filter(|property| property.name == "aovs");
    lists.any(|list| matches!(&list.value, Value::String(list) if requests_colour(list)))
}

/// Results that wrapping integrators add to the wrapped integrator.
#[derive(Default)]
struct Additions {
    quantities: RequestedQuantities,
    /// True if second moments of the wrapped results are requested.
    squared: bool,
    /// Requested parts of light.
    parts: Option<LightParts>,
    /// Name that the wrapping integrator gives to the wrapped integrator.
    name: Option<String>,
}

/// Builds the scene's integrator, or leaves the choice to a pilot. An estimator that the caller
/// names replaces the scene's, but keeps the parameters that all estimators share.
pub(super) fn build(
    object: Option<&ObjectDescription>,
    options: &LoadOptions,
    context: &mut Context,
) -> Method {
    // Find the integrator that renders, and the additions of the integrators around it.
    let additions = object.map_or(Additions::default(), |object| holders(object, context));
    let object = object.map(held);
    let written = object.and_then(|object| plugin(object, context));
    let wanted = options
        .integrator
        .as_deref()
        .map(|n| named(n, context.diagnostics));
    let Additions {
        mut quantities,
        squared,
        parts,
        name,
    } = additions;
    // Choose the estimator; the caller's takes precedence.
    let kind = of_parts(wanted.or(written).unwrap_or(Kind::Auto), parts);
    let kind = kind.unwrap_or_else(|message| {
        if let Some(object) = object {
            context.error_at(&object.location, message);
        }
        Kind::Path
    });
    // Read its parameters.
    let is_aov = kind.is_of_quantities();
    let mut parameters = Parameters::default();
    if let (Some(object), Some(written)) = (object, written) {
        parameters = read(object, written, context);
        if written == Kind::Aov && kind == Kind::Aov {
            let setting = Setting::new(object, squared, context);
            let mut query = Query::new(object, context.diagnostics);
            let own = RequestedQuantities::of(&mut query, &setting);
            quantities.add(own, &mut query);
        }
    }
    if kind == Kind::Depth {
        quantities.add_depth(squared);
    } else if is_aov && quantities.is_empty() {
        quantities = RequestedQuantities::all();
    }
    if is_aov {
        parameters.aov = quantities.tracer();
    }
    if let (true, Some(object), Some(name)) = (squared, object, name.as_deref())
        && quantities.has(name)
    {
        let message =
            format!("an integrator and one of its quantities both have the name '{name}'");
        context.error_at(&object.location, message);
    }
    Method {
        renderer: parameters.renderer(kind),
        is_open: kind == Kind::Auto,
        parameters,
        quantities: (!is_aov && !quantities.is_empty()).then(|| quantities.tracer()),
        names: if is_aov || !quantities.is_empty() {
            quantities.named(!is_aov)
        } else {
            Vec::new()
        },
        moment: (!is_aov && squared).then(|| square_of(name.as_deref())),
        parts,
    }
}

/// Returns the estimator for the requested parts of light. `auto` becomes `path`, because pilots do
/// not measure the cost of following parts.
///
/// # Errors
/// Message about an estimator that does not follow parts.
pub(super) fn of_parts(kind: Kind, parts: Option<LightParts>) -> Result<Kind, String> {
    let Some(parts) = parts else {
        return Ok(kind);
    };
    match kind {
        Kind::Auto => Ok(Kind::Path),
        Kind::Path | Kind::Direct | Kind::Particle | Kind::Bdpt => Ok(kind),
        _ => {
            let known = KNOWN.iter().find(|(_, known)| *known == kind);
            let name = known.map_or("this integrator", |(name, _)| name);
            Err(format!(
                "'{}' cannot contain '{name}': only 'path', 'direct', 'particle' and 'bdpt' follow {}",
                parts.facts().integrator,
                parts.facts().quantity
            ))
        }
    }
}

/// Returns the first integrator nested in an object.
fn nested_in(object: &ObjectDescription) -> Option<&ObjectDescription> {
    let mut children = object.children.iter().map(|c| &*c.object);
    children.find(|o| o.kind == PluginKind::Integrator)
}

/// Returns true if an integrator wraps another.
fn holds(object: &ObjectDescription) -> bool {
    let row = schema::find(PluginKind::Integrator, &object.plugin);
    row.is_some_and(|row| row.takes(PluginKind::Integrator))
}

/// Returns the integrator that renders: the innermost of wrapped integrators.
fn held(object: &ObjectDescription) -> &ObjectDescription {
    let nested = nested_in(object).filter(|_| holds(object));
    nested.map_or(object, held)
}

/// Reads the wrapping integrators, and reports their errors.
fn holders(object: &ObjectDescription, context: &mut Context) -> Additions {
    let mut additions = Additions::default();
    let mut object = object;
    while holds(object)
        && let Some(nested) = nested_in(object)
    {
        additions.squared |= object.plugin == "moment";
        if object.plugin == "stokes" {
            add_parts(LightParts::Stokes, &mut additions, object, context);
        }
        let is_aov = object.plugin == "aov";
        let setting = is_aov.then(|| Setting::new(object, additions.squared, context));
        let mut query = Query::new(object, context.diagnostics);
        query.children(PluginKind::Integrator);
        let sidebands =
            (object.plugin == "tagged").then(|| sidebands(&mut query, context.channels));
        if let Some(setting) = setting
            && !(query.has("aovs") && query.string("aovs").is_empty())
        {
            let requested = RequestedQuantities::of(&mut query, &setting);
            additions.quantities.add(requested, &mut query);
        }
        query.finish(&[]);
        if let Some(sidebands) = sidebands.flatten() {
            let parts = LightParts::Sidebands(sidebands);
            add_parts(parts, &mut additions, object, context);
        }
        let mut children = object.children.iter();
        let child = children.find(|child| child.object.number == nested.number);
        additions.name = child.and_then(|child| child.name.clone());
        object = nested;
    }
    additions
}

/// Requests parts of light. Light can have parts of only one kind.
fn add_parts(
    parts: LightParts,
    additions: &mut Additions,
    object: &ObjectDescription,
    context: &mut Context,
) {
    if additions.parts.replace(parts).is_some() {
        let message = "light has Stokes parameters or sidebands, not both: leave one of 'stokes' and 'tagged' out";
        context.error_at(&object.location, message);
    }
}

/// Returns the kind of an integrator's name.
fn find(name: &str) -> Option<Kind> {
    KNOWN
        .iter()
        .find(|(n, _)| *n == name)
        .map(|(_, kind)| *kind)
}

/// Returns the kind that a file requests; `None` for an unknown type and for a wrapper without an
/// integrator in it.
fn plugin(object: &ObjectDescription, context: &mut Context) -> Option<Kind> {
    let known = find(&object.plugin);
    if known.is_none() && holds(object) {
        Query::new(object, context.diagnostics).required_child(PluginKind::Integrator);
        return None;
    }
    if known.is_none() {
        unknown_plugin(object, context.diagnostics);
    }
    known
}

/// Returns the kind that the caller requests.
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

/// Reads the parameters of an estimator.
fn read(object: &ObjectDescription, kind: Kind, context: &mut Context) -> Parameters {
    let default = Parameters::default();
    let mut bdpt = default.bdpt;
    let mut query = Query::new(object, context.diagnostics);
    let max_depth = match kind {
        Kind::Direct => i64::from(DIRECT_DEPTH),
        _ => query.integer("max_depth"),
    };
    let rr_depth = query.integer("rr_depth");
    let is_named = query.has("tolerance");
    let tolerance = query.float("tolerance");
    let reflections = query.integer("reflections");
    let hide_emitters = query.boolean("hide_emitters");
    // Accept parameters of Mitsuba's scene files that divide the work.
    query.float("timeout");
    query.has("samples_per_pass");
    query.has("block_size");
    if kind == Kind::Direct {
        for name in ["shading_samples", "emitter_samples", "bsdf_samples"] {
            query.integer(name);
        }
    }
    bdpt.max_depth = u32::try_from(max_depth).ok();
    bdpt.rr_depth = rr_depth as u32;
    if matches!(kind, Kind::Bdpt | Kind::Vcm | Kind::Auto) {
        bdpt.heuristic = match query.word("heuristic") {
            "power" => Heuristic::Power,
            _ => Heuristic::Balance,
        };
        bdpt.connections = match query.word("connections") {
            "all" => Connections::All,
            _ => Connections::Resampled,
        };
    }
    if kind == Kind::Aov {
        AOV.iter().for_each(|name| _ = query.has(name));
    }
    let photon = match kind {
        Kind::Photon | Kind::Sppm => photons(&mut query),
        Kind::Preview => PhotonMapping {
            photons: photon_count(&mut query),
            radius: radius(&mut query),
            ..default.photon
        },
        Kind::Vcm => PhotonMapping {
            radius: radius(&mut query),
            ..default.photon
        },
        _ => default.photon,
    };
    query.finish(&[]);
    Parameters {
        bdpt,
        photon,
        hide_emitters,
        tolerance: is_named.then(|| Tolerance::new(tolerance)),
        reflections: reflections as u32,
        ..default
    }
}

/// Reads the parameters of photon mapping.
fn photons(query: &mut Query) -> PhotonMapping {
    let mut photon = PhotonMapping {
        photons: photon_count(query),
        radius: radius(query),
        ..PhotonMapping::default()
    };
    photon.query = match query.word("query") {
        "point" => PhotonQuery::Point,
        _ => PhotonQuery::Beam,
    };
    photon
}

/// Returns the number of light subpaths of each map, if given.
fn photon_count(query: &mut Query) -> Option<usize> {
    let is_given = query.has("photons");
    is_given.then(|| query.integer("photons") as usize)
}

/// Returns the initial radius within which photons count, if given.
fn radius(query: &mut Query) -> Option<f64> {
    query.float_if_given("radius")
}
