//! What a scene uses, beside what Mitsuba 3 has.

use crate::diagnostic::{Diagnostics, Severity};
use crate::scene::{ObjectDescription, PluginKind, SceneDescription, Value, descendants};
use crate::schema::mitsuba;
use std::collections::BTreeMap;
use transport::aov::Aov;

/// What a scene uses.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Features {
    /// How often each plugin stands in it, by kind and name.
    pub plugins: BTreeMap<(PluginKind, String), usize>,
    /// What Mitsuba 3 does not have, for example `'ior' of medium 'homogeneous'`.
    pub own: Vec<String>,
}

impl Features {
    /// Those of a scene, objects that are referred to several times counted once.
    pub fn of(scene: &SceneDescription) -> Self {
        let mut features = Features::default();
        for object in descendants([&*scene.root]).filter(|o| o.kind != PluginKind::Scene) {
            let plugin = (object.kind, object.plugin.clone());
            *features.plugins.entry(plugin).or_default() += 1;
            features.own.extend(own(object));
        }
        features.own.sort();
        features.own.dedup();
        features
    }
}

/// What only morgana has of an object.
fn own(object: &ObjectDescription) -> Vec<String> {
    let (kind, plugin) = (object.kind, object.plugin.as_str());
    if !mitsuba::has_plugin(kind, plugin) {
        return vec![format!("{kind} '{plugin}'")];
    }
    let properties = object.properties.iter().map(|p| &p.name);
    let roles = object.children.iter().filter_map(|c| c.name.as_ref());
    let of_rays = kind == PluginKind::Integrator && plugin == "aov" && lists_own(object);
    let of_rays = of_rays.then(|| "quantities of rays, or without a name, in 'aovs'".to_owned());
    let unknown = properties
        .chain(roles)
        .filter(|name| !mitsuba::has_parameter(kind, plugin, name));
    let unknown = unknown.map(|name| format!("'{name}' of {kind} '{plugin}'"));
    unknown.chain(of_rays).collect()
}

/// Whether an `aov` lists what Mitsuba's does not: it takes `NAME:TYPE`, of surfaces only.
fn lists_own(object: &ObjectDescription) -> bool {
    let list = object.properties.iter().find(|p| p.name == "aovs");
    let Some(Value::String(list)) = list.map(|p| &p.value) else {
        return true;
    };
    let is_own = |word: &str| match word.split_once(':') {
        Some((_, kind)) => Aov::ALL
            .into_iter()
            .any(|aov| aov.name() == kind && !aov.is_of_surface()),
        None => true,
    };
    list.split(',').map(str::trim).any(is_own)
}

/// Errors without their places: each message, and how often it stands there, the most frequent first.
pub fn missing(diagnostics: &Diagnostics) -> Vec<(String, usize)> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    let errors = diagnostics.iter().filter(|d| d.severity == Severity::Error);
    for error in errors {
        *counts.entry(&error.message).or_default() += 1;
    }
    let mut missing: Vec<_> = counts
        .into_iter()
        .map(|(message, count)| (message.to_owned(), count))
        .collect();
    missing.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    missing
}
