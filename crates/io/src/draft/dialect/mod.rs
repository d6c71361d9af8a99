//! Other dialects: parameters of Mitsuba 3 that say nothing here, scenes of Mitsuba 0.5 and 0.6, and the plugins of the
//! refractive fork of Mitsuba 0.6 that Pediredla et al. published, said in the names of Mitsuba 3 and of this program.
//!
//! What an old name means is written down once, as a [`Rule`]. What depends on values is in [`special`].

mod rules;
mod special;
mod textures;

use crate::diagnostic::{Diagnostics, Location, lints};
use crate::draft::{Draft, DraftChild};
use crate::scene::{PluginKind, Property, SpectrumValue, Value};
use rules::RULES;

/// How a plugin of another dialect is said here.
struct PluginTranslation {
    kind: PluginKind,
    from: &'static str,
    to: &'static str,
    /// Only in scenes of Mitsuba 0.5 and 0.6: the name has another meaning in later ones.
    old: bool,
    /// Parameters and roles with other names.
    renamed: &'static [(&'static str, &'static str)],
    /// Parameters and roles that say how to compute, not what.
    dropped: &'static [&'static str],
    /// The only parameters that stay, if all others are to be dropped.
    kept: Option<&'static [&'static str]>,
    /// Defaults that differ from those of the plugin that it becomes.
    implied: &'static [(&'static str, Implied)],
}

/// A value that a plugin has without saying so.
#[derive(Clone, Copy)]
enum Implied {
    Float(f64),
    Integer(i64),
    Boolean(bool),
    String(&'static str),
    Vector(f64, f64, f64),
}

/// Integrators of Mitsuba 0.6 that render what another one finds.
const FRAMES: [&str; 3] = ["irrcache", "adaptive", "multichannel"];

/// A scene's dialect, and what was done about it.
#[derive(Default)]
pub(crate) struct Dialect {
    /// Whether the file being read is of Mitsuba 0.5 or 0.6.
    pub old: bool,
    /// Where another dialect was first met.
    first: Option<Location>,
    /// Plugins that have other names here.
    read: Vec<String>,
    /// Parameters and roles that were dropped, with their plugins.
    ignored: Vec<String>,
}

impl Dialect {
    /// Kinds of the plugins that scenes of any version may call by a name that is another one here.
    pub(crate) fn kinds(plugin: &str) -> impl Iterator<Item = PluginKind> {
        let named = RULES.iter().filter(move |r| !r.old && r.from == plugin);
        named.map(|rule| rule.kind)
    }

    /// Takes note of a file of Mitsuba 0.5 or 0.6, by its version.
    pub(crate) fn enter(&mut self, version: &Location) {
        self.old = true;
        self.first.get_or_insert_with(|| version.clone());
    }

    /// A parameter's or role's name, as Mitsuba 3 writes it.
    pub(crate) fn name(&self, name: String) -> String {
        if self.old { snake_case(&name) } else { name }
    }

    /// A parameter's value, as Mitsuba 3 means it: a spectrum of one number was the same in every channel.
    pub(crate) fn value(&self, value: Value) -> Value {
        match value {
            Value::Spectrum(SpectrumValue::EqualEnergy(v)) if self.old => {
                Value::Spectrum(SpectrumValue::Uniform(v))
            }
            value => value,
        }
    }

    /// Brings a plugin up to date.
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

    /// What stands in the place of an integrator that only speeds another one up: that one.
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

    /// The bsdf of a shape that has a medium and no bsdf: none that light notices, where it is diffuse in Mitsuba 3.
    pub(crate) fn boundary(
        &mut self,
        draft: &Draft,
        kind: impl Fn(&DraftChild) -> Option<PluginKind>,
    ) -> Option<Draft> {
        let kinds: Vec<_> = draft.children.iter().map(kind).collect();
        let has = |kind| kinds.contains(&Some(kind));
        // What is not known yet may be a bsdf; area emitters must not be null.
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

    fn ignore(&mut self, draft: &Draft, what: &str) {
        add(&mut self.ignored, format!("'{what}' of '{}'", draft.plugin));
        let place = &draft.plugin_location;
        self.first.get_or_insert_with(|| place.clone());
    }

    /// Says what was done, in one note.
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

/// Adds what is not there.
fn add(list: &mut Vec<String>, item: String) {
    if !list.contains(&item) {
        list.push(item);
    }
}

/// Drops parameters and roles; returns the names of those that were there.
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

/// A number that a plugin has, or `default`.
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
    /// Gives a parameter or role another name.
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

    /// Sets a parameter that the file does not mention: its place is that of the plugin's type.
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

/// `toWorld` → `to_world`, `intIOR` → `int_ior`, `sigmaT` → `sigma_t`.
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
