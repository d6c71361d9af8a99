//! Plugins that a scene uses, and features that Mitsuba 3 lacks.

use crate::diagnostic::{Diagnostics, Severity};
use crate::scene::{ObjectDescription, PluginKind, SceneDescription, Value, descendants};
use crate::schema::mitsuba;
use std::collections::BTreeMap;
use transport::aov::Aov;

/// Plugins and own features that a scene uses.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Features {
    /// Number of uses of each plugin, by kind and name.
    pub plugins: BTreeMap<(PluginKind, String), usize>,
    /// Features that Mitsuba 3 does not have, for example `'ior' of medium 'homogeneous'`.
    pub own: Vec<String>,
}

impl Features {
    /// Collects the features of a scene. Objects with several references count once.
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

/// Lists the features of an object that only morgana has.
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

/// Returns true if an `aov` lists quantities that Mitsuba's plugin does not have. Mitsuba accepts
/// `NAME:TYPE` with surface quantities only.
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

/// Counts errors by message, regardless of their positions. The most frequent message comes first.
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
