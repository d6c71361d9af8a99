//! What a scene may say: every plugin with its parameters and children, in one table.
//!
//! Readers infer kinds from it, [`Query`](crate::Query) checks (in debug builds) that nothing is asked for
//! that is not listed, and [`json_schema`] tells editors. What a parameter means is told in full in
//! `docs/scene-format.md`.

mod bsdf;
mod emitter;
mod film;
mod integrator;
mod json;
mod medium;
mod metals;
pub(crate) mod mitsuba;
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

use crate::scene::PluginKind;
use row::{many, plugin};

/// A plugin: one `type` of a kind.
#[derive(Debug)]
pub struct Plugin {
    /// Its `type`; empty for the scene.
    pub name: &'static str,
    /// What it is, in a line.
    pub help: &'static str,
    parameters: &'static [&'static [Parameter]],
    children: &'static [Slot],
    /// What a parameter of any other name is, if there may be such.
    others: Option<&'static Parameter>,
}

/// A place for children of one kind.
#[derive(Clone, Copy, Debug)]
pub struct Slot {
    /// What fits.
    pub kind: PluginKind,
    /// The name that a child must have; without one the kind says it all.
    pub role: Option<&'static str>,
    /// Whether there may be several.
    pub many: bool,
    /// What they are for, in a line.
    pub help: &'static str,
}

impl Plugin {
    /// Its parameters.
    pub fn parameters(&self) -> impl Iterator<Item = &'static Parameter> {
        self.parameters.iter().copied().flatten()
    }

    /// The parameter with this name.
    pub fn parameter(&self, name: &str) -> Option<&'static Parameter> {
        self.parameters().find(|p| p.name == name).or(self.others)
    }

    /// What a parameter of any other name is, if there may be such; its name stands for theirs.
    pub fn others(&self) -> Option<&'static Parameter> {
        self.others
    }

    /// Its children. Where several kinds may have a plugin of the same name, the first is meant.
    pub fn children(&self) -> &'static [Slot] {
        self.children
    }

    /// Whether there is a parameter or a role with this name.
    pub fn has(&self, name: &str) -> bool {
        self.parameter(name).is_some() || self.roles(name).next().is_some()
    }

    /// Whether a parameter may be each of some words.
    pub fn allows(&self, name: &str, words: &[&str]) -> bool {
        match self.parameter(name).map(|parameter| parameter.value) {
            Some(Type::Word(all) | Type::NumberOrWord(all)) => {
                words.iter().all(|word| all.contains(word))
            }
            _ => false,
        }
    }

    /// Whether it takes children of this kind, whatever their names.
    pub fn takes(&self, kind: PluginKind) -> bool {
        let mut slots = self.children.iter();
        slots.any(|slot| slot.role.is_none() && slot.kind == kind)
    }

    /// The kinds of children that may have this role.
    pub fn roles(&self, name: &str) -> impl Iterator<Item = PluginKind> {
        let slots = self.children.iter();
        slots
            .filter(move |slot| slot.role == Some(name))
            .map(|slot| slot.kind)
    }
}

/// The plugins of a kind.
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

/// The plugin of a kind and name.
pub fn find(kind: PluginKind, name: &str) -> Option<&'static Plugin> {
    plugins(kind).iter().find(|p| p.name == name)
}

/// The kinds that have a plugin of this name.
pub fn kinds(name: &str) -> impl Iterator<Item = PluginKind> {
    let all = PluginKind::ALL.into_iter();
    all.filter(move |kind| *kind != PluginKind::Scene && find(*kind, name).is_some())
}

/// What acts in a scene comes before what is only defined there for others to refer to.
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
