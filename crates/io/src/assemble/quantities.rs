//! Quantities of sensor rays that a scene requests, and their names.

use super::channels::Channels;
use super::context::Context;
use super::field;
use crate::diagnostic::suggest;
use crate::query::Query;
use crate::scene::ObjectDescription;
use glam::DVec3;
use std::collections::HashSet;
use transport::aov::{Aov, AovTracer, ReferenceIndex};
use transport::medium::Medium;

/// Quantity of sensor rays with the name that the scene gives it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedQuantity {
    /// Kind of the quantity.
    pub aov: Aov,
    /// Name in the scene; the quantity's own name by default.
    pub name: String,
    /// Names of the quantity's channels, as in image files.
    pub channels: Vec<String>,
    /// True if the second moment of the quantity is requested, too.
    pub squared: bool,
}

/// Quantity requested in a list.
#[derive(Clone, Debug)]
pub(super) struct RequestedQuantity {
    aov: Aov,
    /// Name, if it differs from the quantity's own.
    name: Option<String>,
    squared: bool,
}

/// Quantities requested by one `aov`, or by several nested `aov`s.
#[derive(Clone, Debug, Default)]
pub(super) struct RequestedQuantities {
    list: Vec<RequestedQuantity>,
    reference: Option<ReferenceIndex>,
    wavelength: Option<f64>,
}

/// Context for reading a list of quantities.
pub(super) struct Setting {
    reference: Option<ReferenceIndex>,
    /// True if the film has wavelengths rather than colours.
    is_spectral: bool,
    /// True if second moments are requested.
    squared: bool,
}

impl Setting {
    /// Reads the context of an `aov`.
    pub(super) fn new(object: &ObjectDescription, squared: bool, context: &mut Context) -> Self {
        Setting {
            reference: reference(object, context),
            is_spectral: matches!(context.channels, Channels::Wavelengths { .. }),
            squared,
        }
    }
}

/// Quantities of Mitsuba that morgana does not compute.
const SCREEN_DERIVATIVES: [&str; 2] = ["duv_dx", "duv_dy"];
/// First parts of the names of layers that images use for other purposes.
const RESERVED_NAMES: [&str; 10] = [
    "variance",
    "few",
    "samples",
    "reweighted",
    "bias",
    "bound",
    "length",
    "time",
    "bounce",
    "light",
];
/// Prefix of the names of second moments, as in Mitsuba.
const SQUARE: &str = "m2";
/// Maximum length of a name in bytes. Image files limit the full name of a channel, with its prefix
/// and suffix, to 255 bytes.
const MAX_NAME_LENGTH: usize = 200;

impl RequestedQuantities {
    /// Returns true if a quantity has this name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.list
            .iter()
            .any(|requested| requested.named(true).name == name)
    }
}

/// Returns the name of the second moment of a quantity or an integrator.
pub(super) fn square_of(name: Option<&str>) -> String {
    name.map_or(SQUARE.into(), |name| format!("{SQUARE}_{name}"))
}

impl NamedQuantity {
    /// Returns the names of the channels of the quantity's second moment.
    pub fn squares(&self) -> impl Iterator<Item = String> {
        let wanted = self.channels.iter().filter(|_| self.squared);
        wanted.map(|channel| square_of(Some(channel)))
    }
}

impl RequestedQuantity {
    /// Returns the quantity with the names of its channels. If `beside` is true, it accompanies
    /// light, and each channel belongs to a layer.
    fn named(&self, beside: bool) -> NamedQuantity {
        let own = self.aov.channels().iter();
        let channel = |own: &&str| match (&self.name, own.rsplit_once('.')) {
            (Some(name), Some((_, suffix))) => format!("{name}.{suffix}"),
            (Some(name), None) => format!("{name}.V"),
            (None, None) if beside => format!("{own}.V"),
            (None, _) => (*own).to_owned(),
        };
        NamedQuantity {
            aov: self.aov,
            name: self
                .name
                .clone()
                .unwrap_or_else(|| self.aov.name().to_owned()),
            channels: own.map(channel).collect(),
            squared: self.squared,
        }
    }
}

impl RequestedQuantities {
    /// Reads the quantities of one `aov`. Without a list these are all quantities of the ray path,
    /// including waves if a wavelength is given.
    pub(super) fn of(query: &mut Query, setting: &Setting) -> Self {
        let wavelength = query.float_if_given("wavelength");
        query.has("reference_index");
        let list = if query.has("aovs") {
            listed(query, setting.squared)
        } else {
            unlisted(wavelength.is_some(), setting.squared)
        };
        let asks = |aov: Aov| list.iter().any(|requested| requested.aov == aov);
        if asks(Aov::Waves) && wavelength.is_none() {
            let message = "waves need a 'wavelength', in vacuum and in scene units";
            query.error("aovs", message);
        }
        if asks(Aov::Albedo) && setting.is_spectral {
            let message = "the albedo is a colour: it needs a film of colours or of luminance";
            query.error("aovs", message);
        }
        check_names(&list, query);
        RequestedQuantities {
            list,
            reference: setting.reference,
            wavelength,
        }
    }

    /// Returns all quantities of the ray path, except waves, which need a wavelength.
    pub(super) fn all() -> Self {
        RequestedQuantities {
            list: unlisted(false, false),
            ..RequestedQuantities::default()
        }
    }

    /// Adds the distance to the first surface, unless it is requested already.
    pub(super) fn add_depth(&mut self, squared: bool) {
        if self
            .list
            .iter()
            .all(|requested| requested.aov != Aov::Depth)
        {
            self.list.push(RequestedQuantity {
                aov: Aov::Depth,
                name: None,
                squared,
            });
        }
    }

    /// Adds the quantities of a nested `aov`.
    pub(super) fn add(&mut self, inner: Self, query: &mut Query) {
        let is_second = !self.is_empty();
        self.list.extend(inner.list);
        self.reference = inner.reference.or(self.reference);
        self.wavelength = inner.wavelength.or(self.wavelength);
        if is_second {
            check_names(&self.list, query);
        }
    }

    /// Returns true if no quantity is requested.
    pub(super) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Returns the tracer of the quantities.
    pub(super) fn tracer(&self) -> AovTracer {
        let wanted: Vec<Aov> = self.list.iter().map(|requested| requested.aov).collect();
        let mut tracer = AovTracer::new(&wanted);
        (tracer.reference, tracer.wavelength) = (self.reference, self.wavelength);
        tracer
    }

    /// Returns the quantities with their names, in the order of the tracer. If `beside` is true,
    /// they accompany light, and each channel belongs to a layer.
    pub(super) fn named(&self, beside: bool) -> Vec<NamedQuantity> {
        let tracer = self.tracer();
        let named = |aov| {
            let requested = self.list.iter().find(|requested| requested.aov == aov);
            let added = RequestedQuantity {
                aov,
                name: None,
                squared: false,
            };
            requested.unwrap_or(&added).named(beside)
        };
        tracer.aovs().map(named).collect()
    }
}

/// Returns true if a list requests a colour.
pub(super) fn requests_colour(list: &str) -> bool {
    kinds(list).any(|aov| aov == Aov::Albedo)
}

/// Returns true if a list requests quantities of first surfaces.
pub(super) fn requests_surfaces(list: &str) -> bool {
    kinds(list).any(Aov::is_of_surface)
}

/// Returns the known quantities in a list.
fn kinds(list: &str) -> impl Iterator<Item = Aov> {
    words(list).filter_map(|word| find(word.split_once(':').map_or(word, |(_, kind)| kind)))
}

fn find(kind: &str) -> Option<Aov> {
    Aov::ALL.into_iter().find(|aov| aov.name() == kind)
}

fn words(list: &str) -> impl Iterator<Item = &str> {
    list.split([',', ' ']).filter(|word| !word.is_empty())
}

/// Reads a list of quantities such as `deflection, dd.y:depth`.
fn listed(query: &mut Query, squared: bool) -> Vec<RequestedQuantity> {
    let names = Aov::ALL.map(Aov::name);
    let list = query.string("aovs");
    let mut requested = Vec::new();
    for word in words(&list) {
        let (name, kind) = match word.split_once(':') {
            Some((name, kind)) => (Some(name.to_owned()), kind),
            None => (None, word),
        };
        if name.as_ref().is_some_and(String::is_empty) {
            query.error("aovs", format!("'{word}': expected name:type"));
        }
        match find(kind) {
            Some(aov) => requested.push(RequestedQuantity { aov, name, squared }),
            None if SCREEN_DERIVATIVES.contains(&kind) => {
                let message = format!(
                    "'{kind}' is not known: rays have no differentials with respect to pixels"
                );
                query.error("aovs", message);
            }
            None => {
                let help = suggest(kind, names).unwrap_or_else(|| names.join(", "));
                query.error("aovs", format!("unknown aov '{kind}' ({help})"));
            }
        }
    }
    if requested.is_empty() {
        query.error("aovs", format!("expected a list of: {}", names.join(", ")));
    }
    requested
}

/// Returns all quantities of the ray path, with waves only if `waves` is true.
fn unlisted(waves: bool, squared: bool) -> Vec<RequestedQuantity> {
    let all = Aov::ALL.into_iter();
    let wanted = all.filter(|aov| !aov.is_of_surface() && (waves || *aov != Aov::Waves));
    let requested = |aov| RequestedQuantity {
        aov,
        name: None,
        squared,
    };
    wanted.map(requested).collect()
}

/// Reports duplicate quantities, and names that images cannot hold.
fn check_names(list: &[RequestedQuantity], query: &mut Query) {
    let mut seen = HashSet::new();
    let mut channels = HashSet::new();
    let mut names = HashSet::new();
    for requested in list {
        let named = requested.named(true);
        if !names.insert(named.name.clone()) {
            let message = format!("two quantities have the name '{}'", named.name);
            query.error("aovs", message);
        }
        if !seen.insert(requested.aov.name()) {
            let message = format!("'{}' is listed twice", requested.aov.name());
            query.error("aovs", message);
        } else if let Some(twice) = named.channels.iter().find(|c| channels.contains(*c)) {
            query.error("aovs", format!("two quantities have the channel '{twice}'"));
        }
        channels.extend(named.channels);
        let Some(name) = &requested.name else {
            continue;
        };
        let start = name.split('.').next().unwrap_or(name);
        if RESERVED_NAMES.contains(&start) || start == SQUARE || start.starts_with("m2_") {
            let message = format!(
                "'{name}': images have layers of their own called '{start}': choose another name"
            );
            query.error("aovs", message);
        }
        if name.len() > MAX_NAME_LENGTH {
            let message = format!("a name is longer than {MAX_NAME_LENGTH} bytes");
            query.error("aovs", message);
        }
    }
}

/// Reads the reference index for optical path differences.
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
