//! Translation of other dialects to the names of Mitsuba 3 and of morgana. The dialects are Mitsuba
//! 0.5, Mitsuba 0.6, and the refractive fork of Mitsuba 0.6 by Pediredla et al. Parameters of
//! Mitsuba 3 without effect here are dropped, too.
//!
//! A [`PluginTranslation`] defines the meaning of each old name once. Translations that depend on
//! values are in [`special`].

mod rules;
mod special;
mod textures;

use crate::diagnostic::{Diagnostics, Location, lints};
use crate::draft::{Draft, DraftChild};
use crate::scene::{PluginKind, Property, SpectrumValue, Value};
use rules::RULES;

/// Translation of a plugin of another dialect.
struct PluginTranslation {
    kind: PluginKind,
    from: &'static str,
    to: &'static str,
    /// True if the translation applies only to scenes of Mitsuba 0.5 and 0.6, because the name has
    /// another meaning in later versions.
    old: bool,
    /// Parameters and roles with other names.
    renamed: &'static [(&'static str, &'static str)],
    /// Parameters and roles that control the computation but not the result.
    dropped: &'static [&'static str],
    /// Parameters to keep, if all others are dropped.
    kept: Option<&'static [&'static str]>,
    /// Defaults that differ from the defaults of the plugin's translation.
    implied: &'static [(&'static str, Implied)],
}

/// Default value of a parameter.
#[derive(Clone, Copy)]
enum Implied {
    Float(f64),
    Integer(i64),
    Boolean(bool),
    String(&'static str),
    Vector(f64, f64, f64),
}

/// Integrators of Mitsuba 0.6 that render the result of another integrator.
const FRAMES: [&str; 3] = ["irrcache", "adaptive", "multichannel"];

/// Dialect of a scene, with the translations that were applied.
#[derive(Default)]
pub(crate) struct Dialect {
    /// True if the current file is of Mitsuba 0.5 or 0.6.
    pub old: bool,
    /// Place where another dialect first occurs.
    first: Option<Location>,
    /// Plugins whose names were translated.
    read: Vec<String>,
    /// Parameters and roles that were dropped, with their plugins.
    ignored: Vec<String>,
}

impl Dialect {
    /// Returns the kinds of plugins that have this name in scenes of any version and another name
    /// here.
    pub(crate) fn kinds(plugin: &str) -> impl Iterator<Item = PluginKind> {
        let named = RULES.iter().filter(move |r| !r.old && r.from == plugin);
        named.map(|rule| rule.kind)
    }

    /// Records that the file is of Mitsuba 0.5 or 0.6. `version` is the place of its version
    /// number.
    pub(crate) fn enter(&mut self, version: &Location) {
        self.old = true;
        self.first.get_or_insert_with(|| version.clone());
    }

    /// Returns the name of a parameter or role in Mitsuba 3.
    pub(crate) fn name(&self, name: String) -> String {
        if self.old { snake_case(&name) } else { name }
    }

    /// Returns the value of a parameter in Mitsuba 3. In old scenes, a spectrum of one number is
    /// equal in all channels.
    pub(crate) fn value(&self, value: Value) -> Value {
        match value {
            Value::Spectrum(SpectrumValue::EqualEnergy(v)) if self.old => {
                Value::Spectrum(SpectrumValue::Uniform(v))
            }
            value => value,
        }
    }

    /// Translates a plugin.
    pub(crate) fn update(&mut self, draft: &mut Draft, diagnostics: &mut Diagnostics) {
        special::before(draft, self.old, diagnostics);
        if let Some(format) = special::tristimulus(draft) {
            add(&mut self.read, format!("pixel_format '{format}' as 'rgb'"));
            let place = &draft.plugin_location;
            self.first.get_or_insert_with(|| place.clone());
        }
        if special::drops_alpha(draft) {
            self.ignore(draft, "alpha");
        }
        if let Some(facets) = self.old.then(|| special::other_facets(draft)).flatten() {
            add(&mut self.read, format!("facets '{facets}' as 'beckmann'"));
        }
        let applies = |rule: &&PluginTranslation| {
            rule.kind == draft.kind && rule.from == draft.plugin && (self.old || !rule.old)
        };
        let Some(rule) = RULES.iter().find(applies) else {
            return;
        };
        for name in drop(draft, rule.dropped) {
            self.ignore(draft, &name);
        }
        if let Some(kept) = rule.kept {
            let others = draft.properties.iter().map(|p| p.name.clone());
            let others: Vec<_> = others.filter(|p| !kept.contains(&p.as_str())).collect();
            for name in others {
                drop(draft, &[&name]);
                self.ignore(draft, &name);
            }
        }
        for (from, to) in rule.renamed {
            draft.rename(from, to);
        }
        for (name, value) in rule.implied {
            imply(draft, name, *value);
        }
        if rule.from != rule.to {
            draft.plugin = rule.to.to_owned();
            add(&mut self.read, format!("'{}' as '{}'", rule.from, rule.to));
            let place = &draft.plugin_location;
            self.first.get_or_insert_with(|| place.clone());
        }
    }

    /// Returns the nested integrator if the outer integrator only accelerates it.
    pub(crate) fn nested(
        &mut self,
        draft: &mut Draft,
        is_integrator: impl Fn(&DraftChild) -> bool,
    ) -> Option<DraftChild> {
        let speeds_up = self.old
            && draft.kind == PluginKind::Integrator
            && FRAMES.contains(&draft.plugin.as_str());
        if !speeds_up {
            return None;
        }
        let inner = draft.children.iter().position(is_integrator)?;
        let names: Vec<_> = draft.properties.iter().map(|p| p.name.clone()).collect();
        names.iter().for_each(|name| self.ignore(draft, name));
        let read = format!("'{}' as the integrator in it", draft.plugin);
        add(&mut self.read, read);
        if draft.children.len() > 1 {
            self.ignore(draft, "what else is nested");
        }
        Some(draft.children.swap_remove(inner))
    }

    /// Returns a null bsdf for a shape that has a medium and no bsdf. In Mitsuba 3 the surface
    /// would be diffuse.
    pub(crate) fn boundary(
        &mut self,
        draft: &Draft,
        kind: impl Fn(&DraftChild) -> Option<PluginKind>,
    ) -> Option<Draft> {
        let kinds: Vec<_> = draft.children.iter().map(kind).collect();
        let has = |kind| kinds.contains(&Some(kind));
        // Children of unknown kind may be a bsdf; area emitters must not be null.
        let is_open = has(PluginKind::Medium)
            && !has(PluginKind::Bsdf)
            && !has(PluginKind::Emitter)
            && !kinds.contains(&None);
        if !(self.old && draft.kind == PluginKind::Shape && is_open) {
            return None;
        }
        add(
            &mut self.read,
            "boundaries of media without a bsdf as 'null'".to_owned(),
        );
        let place = draft.plugin_location.clone();
        Some(Draft::new(
            PluginKind::Bsdf,
            "null".to_owned(),
            place.clone(),
            place,
        ))
    }

    /// Records a parameter or role that was dropped.
    fn ignore(&mut self, draft: &Draft, what: &str) {
        add(&mut self.ignored, format!("'{what}' of '{}'", draft.plugin));
        let place = &draft.plugin_location;
        self.first.get_or_insert_with(|| place.clone());
    }

    /// Reports all translations in one note.
    pub(crate) fn report(&self, diagnostics: &mut Diagnostics) {
        let Some(first) = &self.first else { return };
        let read = (!self.read.is_empty()).then(|| format!("read: {}", self.read.join(", ")));
        let ignored =
            (!self.ignored.is_empty()).then(|| format!("ignored: {}", self.ignored.join(", ")));
        let done: Vec<String> = [read, ignored].into_iter().flatten().collect();
        let note = lints::note(
            lints::OTHER_DIALECT,
            "the scene says some things in another form, or for other programs",
        );
        let help = (!done.is_empty()).then(|| done.join("; "));
        diagnostics.push(note.help(help).at(first));
    }
}

/// Adds an item unless the list has it.
fn add(list: &mut Vec<String>, item: String) {
    if !list.contains(&item) {
        list.push(item);
    }
}

/// Drops parameters and roles. Returns the names of those that existed.
fn drop(draft: &mut Draft, names: &[&str]) -> Vec<String> {
    let there: Vec<String> = names
        .iter()
        .filter(|name| draft.names.remove(**name).is_some())
        .map(|name| (*name).to_owned())
        .collect();
    draft.properties.retain(|p| !there.contains(&p.name));
    let goes = |name: &Option<(String, Location)>| {
        name.as_ref().is_some_and(|(name, _)| there.contains(name))
    };
    draft.children.retain(|c| !goes(&c.name));
    there
}

/// Returns a number that a plugin gives, or `default`.
fn number(draft: &Draft, name: &str, default: f64) -> f64 {
    let property = draft.properties.iter().find(|p| p.name == name);
    match property.map(|p| &p.value) {
        Some(Value::Float(v)) => *v,
        Some(Value::Integer(v)) => *v as f64,
        _ => default,
    }
}

/// Adds a parameter unless the plugin has it.
fn imply(draft: &mut Draft, name: &str, value: Implied) {
    if draft.names.contains_key(name) {
        return;
    }
    let value = match value {
        Implied::Float(v) => Value::Float(v),
        Implied::Integer(v) => Value::Integer(v),
        Implied::Boolean(v) => Value::Boolean(v),
        Implied::String(v) => Value::String(v.to_owned()),
        Implied::Vector(x, y, z) => Value::Vector(glam::DVec3::new(x, y, z)),
    };
    draft.set(name, value);
}

impl Draft {
    /// Renames a parameter or role.
    fn rename(&mut self, from: &str, to: &str) {
        let Some(location) = self.names.remove(from) else {
            return;
        };
        self.names.insert(to.to_owned(), location);
        for property in self.properties.iter_mut().filter(|p| p.name == from) {
            property.name = to.to_owned();
        }
        let roles = self.children.iter_mut().filter_map(|c| c.name.as_mut());
        for (name, _) in roles.filter(|(name, _)| name == from) {
            *name = to.to_owned();
        }
    }

    /// Sets a parameter that the file does not mention. Its place is the place of the plugin's
    /// type.
    fn set(&mut self, name: &str, value: Value) {
        self.properties.retain(|p| p.name != name);
        self.names
            .insert(name.to_owned(), self.plugin_location.clone());
        self.properties.push(Property {
            name: name.to_owned(),
            value,
            name_location: self.plugin_location.clone(),
            location: self.plugin_location.clone(),
        });
    }
}

/// Converts names: `toWorld` → `to_world`, `intIOR` → `int_ior`, `sigmaT` → `sigma_t`.
fn snake_case(name: &str) -> String {
    let mut out = String::with_capacity(name.len() + 2);
    let mut before = '_';
    for c in name.chars() {
        if c.is_ascii_uppercase() && (before.is_ascii_lowercase() || before.is_ascii_digit()) {
            out.push('_');
        }
        out.push(c.to_ascii_lowercase());
        before = c;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::snake_case;

    #[test]
    fn names_become_those_of_mitsuba_3() {
        for (old, new) in [
            ("toWorld", "to_world"),
            ("intIOR", "int_ior"),
            ("sigmaT", "sigma_t"),
            ("rrDepth", "rr_depth"),
            ("cropOffsetX", "crop_offset_x"),
            ("n_o", "n_o"),
            ("filename", "filename"),
            ("p0", "p0"),
        ] {
            assert_eq!(snake_case(old), new);
        }
    }
}
