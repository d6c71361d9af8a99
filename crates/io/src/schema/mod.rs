//! Table of every plugin that a scene may use, with its parameters and children.
//!
//! Readers infer the kinds of objects from this table. In debug builds, [`Query`](crate::Query)
//! checks that the code reads only listed parameters. [`json_schema`] exports the table to editors.
//! `docs/scene-format.md` and the pages that it lists explain the parameters in full.

mod bsdf;
mod emitter;
mod film;
mod integrator;
mod json;
mod medium;
mod metals;
pub(crate) mod mitsuba;
pub(crate) mod other_names;
mod parameter;
mod row;
mod sensor;
mod shape;
mod spectrum;
pub(crate) mod substance;
mod texture;
mod volume;

pub use json::json_schema;
pub use parameter::{Default, NumberRange, Parameter, Type};

pub(crate) use metals::METALS;
pub(crate) use row::PhaseConstructor;

use crate::scene::PluginKind;
use row::{many, plugin};

/// A plugin: one `type` of a kind.
#[derive(Debug)]
pub struct Plugin {
    /// Name that a scene gives as `type`; empty for the scene itself.
    pub name: &'static str,
    /// Description of the plugin, in one line.
    pub help: &'static str,
    parameters: &'static [&'static [Parameter]],
    children: &'static [Slot],
    /// Parameter that stands for parameters of any other name, if the plugin accepts them.
    others: Option<&'static Parameter>,
    /// True if Mitsuba 3 has the plugin.
    in_mitsuba: bool,
    /// Constructor of a phase function, if its numbers determine it.
    pub(crate) phase: Option<PhaseConstructor>,
}

/// A place for children of one kind.
#[derive(Clone, Copy, Debug)]
pub struct Slot {
    /// Kind of the children.
    pub kind: PluginKind,
    /// Name that a child must have; `None` if its kind is enough.
    pub role: Option<&'static str>,
    /// True if several children may stand here.
    pub many: bool,
    /// Purpose of the children, in one line.
    pub help: &'static str,
}

impl Plugin {
    /// Returns the listed parameters.
    pub fn parameters(&self) -> impl Iterator<Item = &'static Parameter> {
        self.parameters.iter().copied().flatten()
    }

    /// Returns the parameter with this name.
    pub fn parameter(&self, name: &str) -> Option<&'static Parameter> {
        self.parameters().find(|p| p.name == name).or(self.others)
    }

    /// Returns the parameter that stands for parameters of any other name, if the plugin accepts
    /// them.
    pub fn others(&self) -> Option<&'static Parameter> {
        self.others
    }

    /// Returns the places for children. If several kinds have a plugin of one name, the first kind
    /// wins.
    pub fn children(&self) -> &'static [Slot] {
        self.children
    }

    /// Returns true if there is a parameter or a role with this name.
    pub fn has(&self, name: &str) -> bool {
        self.parameter(name).is_some() || self.roles(name).next().is_some()
    }

    /// Returns true if the parameter `name` accepts each of `words`.
    pub fn allows(&self, name: &str, words: &[&str]) -> bool {
        match self.parameter(name).map(|parameter| parameter.value) {
            Some(Type::Word(all) | Type::NumberOrWord(all)) => {
                words.iter().all(|word| all.contains(word))
            }
            _ => false,
        }
    }

    /// Returns true if the plugin accepts children of this kind without a role.
    pub fn takes(&self, kind: PluginKind) -> bool {
        let mut slots = self.children.iter();
        slots.any(|slot| slot.role.is_none() && slot.kind == kind)
    }

    /// Returns the kinds of children that may have this role.
    pub fn roles(&self, name: &str) -> impl Iterator<Item = PluginKind> {
        let slots = self.children.iter();
        slots
            .filter(move |slot| slot.role == Some(name))
            .map(|slot| slot.kind)
    }
}

/// Returns the plugins of a kind.
pub fn plugins(kind: PluginKind) -> &'static [Plugin] {
    match kind {
        PluginKind::Scene => SCENE,
        PluginKind::Integrator => integrator::PLUGINS,
        PluginKind::Sensor => sensor::PLUGINS,
        PluginKind::Sampler => film::SAMPLERS,
        PluginKind::Film => film::PLUGINS,
        PluginKind::Rfilter => film::FILTERS,
        PluginKind::Emitter => emitter::PLUGINS,
        PluginKind::Shape => shape::PLUGINS,
        PluginKind::Bsdf => bsdf::PLUGINS,
        PluginKind::Medium => medium::PLUGINS,
        PluginKind::Phase => medium::PHASES,
        PluginKind::Volume => volume::PLUGINS,
        PluginKind::Texture => texture::PLUGINS,
        PluginKind::Spectrum => spectrum::PLUGINS,
    }
}

/// Returns the plugin of a kind and name.
pub fn find(kind: PluginKind, name: &str) -> Option<&'static Plugin> {
    plugins(kind).iter().find(|p| p.name == name)
}

/// Returns the kinds that have a plugin of this name.
pub fn kinds(name: &str) -> impl Iterator<Item = PluginKind> {
    let all = PluginKind::ALL.into_iter();
    all.filter(move |kind| *kind != PluginKind::Scene && find(*kind, name).is_some())
}

/// Root of a scene. Children that are part of the scene come before children that are only referred
/// to.
const SCENE: &[Plugin] = &[plugin(
    "",
    "A scene.",
    &[],
    &[
        many(PluginKind::Integrator, "At most one; path without any."),
        many(PluginKind::Sensor, "One camera, or any number of meters."),
        many(PluginKind::Shape, "Surfaces, and the bounds of media."),
        many(PluginKind::Emitter, "Sources of light."),
        many(PluginKind::Medium, "Media to refer to."),
        many(PluginKind::Bsdf, "Bsdfs to refer to."),
        many(PluginKind::Phase, "Phase functions to refer to."),
        many(PluginKind::Volume, "Volumes to refer to."),
        many(PluginKind::Texture, "Textures to refer to."),
        many(PluginKind::Sampler, "Samplers to refer to."),
        many(PluginKind::Film, "Films to refer to."),
        many(PluginKind::Rfilter, "Filters to refer to."),
    ],
)];
