//! Kinds of plugins.

use std::fmt;

/// Kind of an object. Each kind has its own tag.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum PluginKind {
    /// The whole scene.
    Scene,
    /// A method of solving the transport equation.
    Integrator,
    /// A camera or detector.
    Sensor,
    /// A source of random numbers.
    Sampler,
    /// An image.
    Film,
    /// A reconstruction filter.
    Rfilter,
    /// A light source.
    Emitter,
    /// A surface.
    Shape,
    /// The scattering of a surface.
    Bsdf,
    /// A participating medium.
    Medium,
    /// A phase function.
    Phase,
    /// A quantity that varies in space.
    Volume,
    /// A quantity that varies on a surface.
    Texture,
    /// A spectrum that a plugin computes.
    Spectrum,
}

impl PluginKind {
    /// Every kind.
    pub const ALL: [PluginKind; 14] = [
        PluginKind::Scene,
        PluginKind::Integrator,
        PluginKind::Sensor,
        PluginKind::Sampler,
        PluginKind::Film,
        PluginKind::Rfilter,
        PluginKind::Emitter,
        PluginKind::Shape,
        PluginKind::Bsdf,
        PluginKind::Medium,
        PluginKind::Phase,
        PluginKind::Volume,
        PluginKind::Texture,
        PluginKind::Spectrum,
    ];

    /// Returns the tag, for example `shape`.
    pub fn tag(self) -> &'static str {
        match self {
            PluginKind::Scene => "scene",
            PluginKind::Integrator => "integrator",
            PluginKind::Sensor => "sensor",
            PluginKind::Sampler => "sampler",
            PluginKind::Film => "film",
            PluginKind::Rfilter => "rfilter",
            PluginKind::Emitter => "emitter",
            PluginKind::Shape => "shape",
            PluginKind::Bsdf => "bsdf",
            PluginKind::Medium => "medium",
            PluginKind::Phase => "phase",
            PluginKind::Volume => "volume",
            PluginKind::Texture => "texture",
            PluginKind::Spectrum => "spectrum",
        }
    }

    /// Returns the kind with the given tag.
    pub(crate) fn from_tag(tag: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.tag() == tag)
    }

    /// Returns the kind of a name that only states a kind: `shape`, or `shape_2`.
    pub fn of_key(key: &str) -> Option<Self> {
        let (word, number) = key.rsplit_once('_').unwrap_or((key, "1"));
        let numbered = !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit());
        let kind = Self::from_tag(word).filter(|kind| *kind != PluginKind::Scene);
        kind.filter(|_| numbered)
    }
}

impl fmt::Display for PluginKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.tag())
    }
}
