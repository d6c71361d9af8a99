//! Queries of an object for its parameters and children.
//!
//! A [`Query`] reads parameters such as the float `g`. Their limits and defaults stand in the table
//! of plugins ([`crate::schema`]). If a parameter is missing, of the wrong type or out of range,
//! the query reports the error at its place. It then returns a harmless value, so that one pass
//! finds all mistakes. [`Query::finish`] reports parameters that were not queried: the misspelt
//! names.
//!
//! ```
//! use morgana_io::{Diagnostics, Query, xml};
//!
//! let text = r#"<scene version="3.0.0"><phase type="hg"><float name="gg" value="0.5"/></phase></scene>"#;
//! let mut diagnostics = Diagnostics::new();
//! let scene = xml::parse(text, "scene.xml", &[], &mut diagnostics).unwrap();
//!
//! let mut query = Query::new(&scene.root.children[0].object, &mut diagnostics);
//! let g = query.float("g");
//! query.finish(&[]);
//! assert_eq!(g, 0.8);
//! assert!(diagnostics.to_string().contains("did you mean 'g'?"));
//! ```

mod children;
mod numbers;
mod spectra;
mod unused;
mod values;

pub use children::Input;
pub(crate) use numbers::numbers;
pub(crate) use values::resolve;

use std::collections::BTreeSet;
use std::ops::Range;

use crate::diagnostic::{Diagnostic, Diagnostics, Location, closest, lints, suggest, words};
use crate::error::FileError;
use crate::scene::{Child, ObjectDescription, PluginKind, Property, Value};
use crate::schema;
use transport::scene::Lint;

/// Query of one object. Call [`Query::finish`] at the end.
#[derive(Debug)]
pub struct Query<'a, 'd> {
    object: &'a ObjectDescription,
    diagnostics: &'d mut Diagnostics,
    /// Names that were queried, found or not.
    asked: BTreeSet<String>,
    used_children: Vec<bool>,
}

impl<'a, 'd> Query<'a, 'd> {
    /// Starts a query of `object`. Errors go to `diagnostics`.
    pub fn new(object: &'a ObjectDescription, diagnostics: &'d mut Diagnostics) -> Self {
        let used_children = vec![false; object.children.len()];
        Query {
            object,
            diagnostics,
            asked: BTreeSet::new(),
            used_children,
        }
    }

    /// Returns the object.
    pub fn object(&self) -> &'a ObjectDescription {
        self.object
    }

    /// Returns true if the object has a parameter or a child with this name. Marks the name as
    /// queried.
    pub fn has(&mut self, name: &str) -> bool {
        self.property(name).is_some() || self.named_child(name).is_some()
    }

    /// Returns the place to which errors go, for a query of a child.
    pub(crate) fn diagnostics(&mut self) -> &mut Diagnostics {
        self.diagnostics
    }

    /// Reports an error at the value of a parameter, or at the object if it has no parameter of
    /// that name.
    pub fn error(&mut self, name: &str, message: impl Into<String>) {
        let location = self.location_of(name).clone();
        self.diagnostics
            .push(Diagnostic::error(message).at(&location));
    }

    /// Reports an error with advice, at the same place as [`Query::error`].
    pub(crate) fn helped_error(
        &mut self,
        name: &str,
        message: impl Into<String>,
        help: Option<String>,
    ) {
        let location = self.location_of(name).clone();
        self.diagnostics
            .push(Diagnostic::error(message).at(&location).help(help));
    }

    /// Reports an error at a place.
    pub(crate) fn error_at(&mut self, location: &Location, message: impl Into<String>) {
        self.diagnostics
            .push(Diagnostic::error(message).at(location));
    }

    /// Reports an error at a span of bytes of a text that a parameter holds. If the file contains
    /// the text in another form, with parameters or escapes, the message gives the position of the
    /// character instead.
    pub(crate) fn error_within(
        &mut self,
        name: &str,
        text: &str,
        span: Range<usize>,
        message: &str,
        help: Option<String>,
    ) {
        let whole = self.location_of(name);
        let error = match whole.within(text, span.clone()) {
            Some(place) => Diagnostic::error(message).at(&place),
            None => {
                let before = text.get(..span.start).unwrap_or("").chars().count();
                let message = format!("{message} (character {} of '{name}')", before + 1);
                Diagnostic::error(message).at(whole)
            }
        };
        self.diagnostics.push(error.help(help));
    }

    /// Reports a warning of a check at the value of a parameter, or at the object if it has no
    /// parameter of that name.
    pub fn warning(&mut self, lint: Lint, name: &str, message: impl Into<String>) {
        let location = self.location_of(name).clone();
        self.diagnostics
            .push(lints::warning(lint, message).at(&location));
    }

    /// Reports a note of a check at the value of a parameter, or at the object if it has no
    /// parameter of that name.
    pub(crate) fn note(&mut self, lint: Lint, name: &str, message: impl Into<String>) {
        let location = self.location_of(name).clone();
        self.diagnostics
            .push(lints::note(lint, message).at(&location));
    }

    /// Reports a data file that failed to load, at the parameter that names it.
    pub fn file_error(&mut self, name: &str, error: &FileError) {
        self.error(name, error.to_string());
    }

    /// Queries a nested object with `ask`. Reports all of its parameters and children that `ask`
    /// does not query.
    pub fn nested<T>(
        &mut self,
        object: &'a ObjectDescription,
        ask: impl FnOnce(&mut Query<'a, '_>) -> T,
    ) -> T {
        let mut query = Query::new(object, self.diagnostics);
        let answer = ask(&mut query);
        query.finish(&[]);
        answer
    }

    /// Returns the place of the parameter or child with this name, or else the place of the object.
    fn location_of(&self, name: &str) -> &'a Location {
        let property = self.object.properties.iter().find(|p| p.name == name);
        let child = self
            .object
            .children
            .iter()
            .find(|c| c.name.as_deref() == Some(name));
        let location = property.map(|p| &p.location).or(child.map(|c| &c.location));
        location.unwrap_or(&self.object.location)
    }

    /// Asserts that the table of plugins lists a queried name. A new parameter of a plugin must be
    /// listed.
    fn listed(&self, what: &str, is_listed: impl FnOnce(&schema::Plugin) -> bool) {
        debug_assert!(
            schema::find(self.object.kind, &self.object.plugin).is_none_or(is_listed),
            "io::schema does not list {what} of {}",
            self.object.label()
        );
    }

    /// Returns the parameter with this name.
    fn property(&mut self, name: &str) -> Option<&'a Property> {
        self.listed(name, |plugin| plugin.has(name));
        self.asked.insert(name.to_owned());
        self.object.properties.iter().find(|p| p.name == name)
    }

    /// Returns the child in this role.
    fn named_child(&mut self, name: &str) -> Option<&'a Child> {
        self.listed(name, |plugin| plugin.has(name));
        self.asked.insert(name.to_owned());
        self.object
            .children
            .iter()
            .find(|c| c.name.as_deref() == Some(name))
    }

    /// Returns the parameter with this name as a `T`. Reports a parameter of another type, or a
    /// child in its place.
    fn convert<T>(
        &mut self,
        name: &str,
        expected: &str,
        convert: impl Fn(&Value) -> Option<T>,
    ) -> Lookup<'a, T> {
        if let Some(property) = self.property(name) {
            if let Some(value) = convert(&property.value) {
                return Lookup::Found(value, &property.location);
            }
            let found = property.value.type_name();
            self.mismatch(name, expected, found, &property.location);
            return Lookup::Wrong;
        }
        if let Some(index) = self.child_index(name) {
            self.used_children[index] = true;
            let child = &self.object.children[index];
            self.mismatch(name, expected, child.object.kind.tag(), &child.location);
            return Lookup::Wrong;
        }
        Lookup::Absent
    }

    fn child_index(&self, name: &str) -> Option<usize> {
        self.object
            .children
            .iter()
            .position(|c| c.name.as_deref() == Some(name))
    }

    /// Returns the name of a kind of objects in messages.
    fn element(&self, kind: PluginKind) -> String {
        words::element(kind.tag(), &self.object.location)
    }

    /// Reports a value of a wrong type.
    fn mismatch(&mut self, name: &str, expected: &str, found: &str, at: &Location) {
        let [expected, found] = [expected, found].map(|kind| words::element(kind, at));
        let message = format!("'{name}': expected {expected}, found {found}");
        self.diagnostics.push(Diagnostic::error(message).at(at));
    }

    /// Reports that a parameter is missing.
    fn missing(&mut self, name: &str, expected: &str) {
        let entry = words::entry(name, expected, &self.object.location);
        let message = format!("{} needs {entry}", self.object.label());
        let names = self.object.properties.iter().map(|p| p.name.as_str());
        let help = closest(name, names.filter(|name| !self.asked.contains(*name)))
            .map(|found| format!("is '{found}' meant for it?"));
        self.diagnostics.push(
            Diagnostic::error(message)
                .help(help)
                .at(&self.object.location),
        );
    }

    /// Returns the value found or the default. Without both, reports a missing parameter and
    /// returns `harmless`.
    fn settle<T>(
        &mut self,
        name: &str,
        expected: &str,
        lookup: Lookup<'a, T>,
        default: Option<T>,
        harmless: T,
    ) -> T {
        match (lookup, default) {
            (Lookup::Found(value, _), _) => value,
            (_, Some(default)) => default,
            (Lookup::Wrong, None) => harmless,
            (Lookup::Absent, None) => {
                self.missing(name, expected);
                harmless
            }
        }
    }
}

/// Result of looking for a parameter.
enum Lookup<'a, T> {
    Found(T, &'a Location),
    /// Value of a wrong type or out of range, already reported.
    Wrong,
    Absent,
}

/// Reports that the `type` of an object is unknown for its kind.
pub fn unknown_plugin(object: &ObjectDescription, diagnostics: &mut Diagnostics) {
    let known: Vec<&str> = schema::plugins(object.kind)
        .iter()
        .map(|plugin| plugin.name)
        .collect();
    misplaced_plugin(object, &known, diagnostics);
}

/// Reports that the `type` of an object is none of the types allowed in its place.
pub fn misplaced_plugin(object: &ObjectDescription, known: &[&str], diagnostics: &mut Diagnostics) {
    let listed = |name: &&str| schema::find(object.kind, name).is_some();
    debug_assert!(
        known.iter().all(listed),
        "io::schema does not list all of {known:?}"
    );
    let (kind, plugin) = (object.kind, &object.plugin);
    let message = if schema::find(kind, plugin).is_some() {
        format!("a {kind} of type '{plugin}' does not belong here")
    } else {
        format!("unknown {kind} type '{plugin}'")
    };
    let listed = format!("known types: {}", known.join(", "));
    let near = match schema::other_names::counterpart(kind, plugin, known) {
        Some(other) => Some(format!("use '{other}' here;")),
        None => suggest(plugin, known.iter().copied()),
    };
    let help = match (schema::mitsuba::substitute(kind, plugin), near) {
        (Some(substitute), _) => substitute.to_owned(),
        (None, Some(near)) => format!("{near} {listed}"),
        (None, None) => listed,
    };
    diagnostics.push(
        Diagnostic::error(message)
            .help(help)
            .at(&object.plugin_location),
    );
}
