//! Queries for nested objects.

use std::sync::Arc;

use super::Query;
use crate::diagnostic::{Diagnostic, lints};
use crate::scene::{ObjectDescription, PluginKind, SpectrumValue};

/// Quantity given as a spectrum, or as an object (a volume or a texture) that computes it.
#[derive(Clone, Debug)]
pub enum Input<'a> {
    /// Value that is constant in space.
    Spectrum(SpectrumValue),
    /// Object whose values vary in space.
    Object(&'a Arc<ObjectDescription>),
}

impl<'a> Query<'a, '_> {
    /// Returns the only child of a kind, if there is one. Reports more than one as an error.
    /// Ignores children in roles that were queried by name.
    pub fn child(&mut self, kind: PluginKind) -> Option<&'a Arc<ObjectDescription>> {
        let indices = self.unused_of(kind);
        for &index in &indices {
            self.used_children[index] = true;
        }
        let children = &self.object.children;
        if let Some(&second) = indices.get(1) {
            let message = format!(
                "{} takes only one {}",
                self.object.label(),
                self.element(kind)
            );
            let help = format!("the first is at {}", children[indices[0]].location);
            let location = &children[second].location;
            self.diagnostics
                .push(Diagnostic::error(message).help(help).at(location));
        }
        indices.first().map(|&index| &children[index].object)
    }

    /// Returns the only child of a kind. Reports its absence as well as further children.
    pub fn required_child(&mut self, kind: PluginKind) -> Option<&'a Arc<ObjectDescription>> {
        let child = self.child(kind);
        if child.is_none() {
            let element = self.element(kind);
            let article = if element
                .trim_start_matches('<')
                .starts_with(['a', 'e', 'i', 'o', 'u'])
            {
                "an"
            } else {
                "a"
            };
            let message = format!("{} needs {article} {element}", self.object.label());
            self.diagnostics
                .push(Diagnostic::error(message).at(&self.object.location));
        }
        child
    }

    /// Returns all children of a kind, in the order of the file. Omits children in roles that were
    /// queried by name.
    pub fn children(&mut self, kind: PluginKind) -> Vec<&'a Arc<ObjectDescription>> {
        let indices = self.unused_of(kind);
        for &index in &indices {
            self.used_children[index] = true;
        }
        indices
            .iter()
            .map(|&index| &self.object.children[index].object)
            .collect()
    }

    /// Returns the child in the role `name`, if there is one; it must be of the given kind.
    pub fn role(&mut self, kind: PluginKind, name: &str) -> Option<&'a Arc<ObjectDescription>> {
        if let Some(property) = self.property(name) {
            let found = property.value.type_name();
            self.mismatch(name, kind.tag(), found, &property.location);
            return None;
        }
        let index = self.child_index(name)?;
        self.used_children[index] = true;
        let child = &self.object.children[index];
        if child.object.kind == kind {
            return Some(&child.object);
        }
        self.mismatch(name, kind.tag(), child.object.kind.tag(), &child.location);
        None
    }

    /// Reads a spectrum or a nested volume. If it is absent, returns the default of its row;
    /// without a default it is required. After an error, returns the default, or else 1.
    pub fn volume_or_spectrum(&mut self, name: &str) -> Input<'a> {
        self.input(PluginKind::Volume, name)
    }

    /// Reads a spectrum or a nested texture. If it is absent, returns the default of its row;
    /// without a default it is required. After an error, returns the default, or else 1.
    pub fn texture_or_spectrum(&mut self, name: &str) -> Input<'a> {
        self.input(PluginKind::Texture, name)
    }

    /// Reads a number within the limits of its row, or a nested texture. If it is absent or after
    /// an error, returns the default of its row.
    pub(crate) fn texture_or_float(&mut self, name: &str) -> Input<'a> {
        if let Some(input) = self.computed_spectrum(name) {
            return input;
        }
        match self.stand_in(PluginKind::Texture, name) {
            Some(texture) => Input::Object(texture),
            None => Input::Spectrum(SpectrumValue::Uniform(self.float(name))),
        }
    }

    /// Returns the child of a kind that replaces a parameter. Mitsuba's textures may be written as
    /// spectra.
    pub(crate) fn stand_in(
        &mut self,
        kind: PluginKind,
        name: &str,
    ) -> Option<&'a Arc<ObjectDescription>> {
        let fits = |found: PluginKind| {
            found == kind || (kind, found) == (PluginKind::Texture, PluginKind::Spectrum)
        };
        let child = self.named_child(name).filter(|c| fits(c.object.kind))?;
        self.use_child(name);
        Some(&child.object)
    }

    /// Warns about a child without effect.
    pub(crate) fn ignored_child(&mut self, child: &ObjectDescription, why: &str) {
        let message = format!("{} {why}", child.label());
        self.diagnostics
            .push(lints::warning(lints::IGNORED, message).at(&child.location));
    }

    /// Marks the child in a role as used.
    pub(super) fn use_child(&mut self, name: &str) {
        if let Some(index) = self.child_index(name) {
            self.used_children[index] = true;
        }
    }

    /// Returns the indices of the children of a kind that have not been queried.
    fn unused_of(&self, kind: PluginKind) -> Vec<usize> {
        self.listed(kind.tag(), |plugin| plugin.takes(kind));
        let all = self.object.children.iter().enumerate();
        let fits = all.filter(|(i, c)| c.object.kind == kind && !self.used_children[*i]);
        fits.map(|(i, _)| i).collect()
    }
}
