//! Report of parameters and children that were not queried.

use std::collections::BTreeSet;

use super::Query;
use crate::diagnostic::{Diagnostic, lints, suggest};
use crate::scene::{Child, Property};
use crate::schema;

impl Query<'_, '_> {
    /// Reports every parameter and child that was not queried, with a similar name that may be
    /// meant.
    ///
    /// `also_known` lists parameters that the plugin knows but did not query this time, for example
    /// because another parameter excludes them. Such parameters cause only a warning that they have
    /// no effect. Unknown plugins are skipped, because they have their own error.
    pub fn finish(self, also_known: &[&str]) {
        if schema::find(self.object.kind, &self.object.plugin).is_none() {
            return;
        }
        for property in &self.object.properties {
            if !self.asked.contains(&property.name) {
                let diagnostic = self.unused_property(property, also_known);
                self.diagnostics.push(diagnostic);
            }
        }
        let children = self.object.children.iter().zip(&self.used_children);
        let named = |child: &Child| child.name.as_ref().is_some_and(|n| self.asked.contains(n));
        for (child, _) in children.filter(|(child, used)| !**used && !named(child)) {
            let kind = self.element(child.object.kind);
            let (message, help) = match &child.name {
                Some(name) => {
                    let message = format!("{} has no {kind} '{name}'", self.object.label());
                    (message, suggest(name, self.names(also_known)))
                }
                None => (
                    format!("{} takes no {kind} here", self.object.label()),
                    None,
                ),
            };
            self.diagnostics
                .push(Diagnostic::error(message).help(help).at(&child.location));
        }
    }

    /// Returns the diagnostic about a parameter that was not queried.
    fn unused_property(&self, property: &Property, also_known: &[&str]) -> Diagnostic {
        let name = property.name.as_str();
        let label = self.object.label();
        if also_known.contains(&name) {
            let message = format!("'{name}' has no effect in this {label}");
            return lints::warning(lints::IGNORED, message).at(&property.name_location);
        }
        let plugin = schema::find(self.object.kind, &self.object.plugin);
        if let Some(known) = plugin.and_then(|p| p.parameters().find(|p| p.name == name)) {
            // Other parameters, or their absence, exclude it.
            let message = format!("{label} does not use '{name}' here");
            return Diagnostic::error(message)
                .help(format!("{name}: {}", known.help))
                .at(&property.name_location);
        }
        let known: BTreeSet<_> = self.names(also_known).collect();
        let synonym = schema::other_names::synonym(self.object.kind, name);
        let help = match synonym.filter(|synonym| known.contains(synonym)) {
            Some(synonym) => Some(format!("did you mean '{synonym}'?")),
            None => suggest(name, known.iter().copied()),
        };
        let help = help.or_else(|| {
            (!known.is_empty()).then(|| format!("it has: {}", Vec::from_iter(known).join(", ")))
        });
        let message = format!("{label} has no parameter '{name}'");
        Diagnostic::error(message)
            .help(help)
            .at(&property.name_location)
    }

    /// Returns the names that were queried and those that are also known.
    fn names<'n>(&'n self, also_known: &'n [&str]) -> impl Iterator<Item = &'n str> {
        self.asked
            .iter()
            .map(String::as_str)
            .chain(also_known.iter().copied())
    }
}
