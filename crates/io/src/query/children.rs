//! Nested objects.

use std::sync::Arc;

use super::Query;
use crate::diagnostic::{Diagnostic, lints};
use crate::scene::{ObjectDescription, PluginKind, SpectrumValue};

/// A quantity given as a spectrum, or as an object (a volume or texture) that computes it.
#[derive(Clone, Debug)]
pub enum Input<'a> {
    /// Constant in space.
    Spectrum(SpectrumValue),
    /// Varying in space.
    Object(&'a Arc<ObjectDescription>),
}

impl<'a> Query<'a, '_> {
    /// The only child of a kind, if there is one; more than one is an error. Children in roles
    /// that were asked for by name do not count.
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

    /// The only child of a kind; its absence is reported, too.
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

    /// All children of a kind, in the order in which they are written. Children in roles that were
    /// asked for by name are left out.
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

    /// The child that plays the role `name`, if there is one; it must be of the given kind.
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

    /// A spectrum or a nested volume. Without it, the default of its row; where there is none, it must be given. After
    /// an error, the default, or else 1.
    pub fn volume_or_spectrum(&mut self, name: &str) -> Input<'a> {
        self.input(PluginKind::Volume, name)
    }

    /// A spectrum or a nested texture. Without it, the default of its row; where there is none, it must be given.
    /// After an error, the default, or else 1.
    pub fn texture_or_spectrum(&mut self, name: &str) -> Input<'a> {
        self.input(PluginKind::Texture, name)
    }

    /// A number within the limits of its row or a nested texture. Without it and after an error, the default of its
    /// row.
    pub(crate) fn texture_or_float(&mut self, name: &str) -> Input<'a> {
        if let Some(input) = self.computed_spectrum(name) {
            return input;
        }
        match self.stand_in(PluginKind::Texture, name) {
            Some(texture) => Input::Object(texture),
            None => Input::Spectrum(SpectrumValue::Uniform(self.float(name))),
        }
    }

    /// The child of a kind that stands in the place of a parameter. Mitsuba's textures may be written as spectra.
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

    /// Warns of a child that counts for nothing.
    pub(crate) fn ignored_child(&mut self, child: &ObjectDescription, why: &str) {
        let message = format!("{} {why}", child.label());
        self.diagnostics
            .push(lints::warning(lints::IGNORED, message).at(&child.location));
    }

    /// Takes note that the child in this role was asked for.
    pub(super) fn use_child(&mut self, name: &str) {
        if let Some(index) = self.child_index(name) {
            self.used_children[index] = true;
        }
    }

    /// Indices of the children of a kind that nobody has asked for yet.
    fn unused_of(&self, kind: PluginKind) -> Vec<usize> {
        self.listed(kind.tag(), |plugin| plugin.takes(kind));
        let all = self.object.children.iter().enumerate();
        let fits = all.filter(|(i, c)| c.object.kind == kind && !self.used_children[*i]);
        fits.map(|(i, _)| i).collect()
    }
}
