//! Parts of a loaded scene that scenes with other values of parameters reuse.

use super::assets::Assets;
use crate::scene::{FileRegistry, ObjectDescription, ObjectId, PluginKind, SceneDescription};
use std::collections::{HashMap, HashSet};
use std::fmt;

/// Parts of a loaded scene, by the objects of its description, and the hashes of its files.
#[derive(Clone)]
pub(super) struct Reuse {
    pub assets: Assets,
    pub files: FileRegistry,
}

impl fmt::Debug for Reuse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Reuse").finish_non_exhaustive()
    }
}

impl Reuse {
    /// Returns the parts that do not depend on the changed objects of a description.
    pub(super) fn without(
        &self,
        description: &SceneDescription,
        changed: &HashSet<ObjectId>,
    ) -> Reuse {
        let mut outdated = Outdated {
            changed,
            known: HashMap::new(),
            parts: HashSet::new(),
            shapes: HashSet::new(),
            films: false,
        };
        outdated.visit(&description.root);
        let mut assets = self.assets.clone();
        assets.retain(
            |object| !outdated.parts.contains(&object),
            |object| !outdated.shapes.contains(&object),
            !outdated.films,
        );
        Reuse {
            assets,
            files: self.files.clone(),
        }
    }
}

/// Objects whose parts must be built again.
struct Outdated<'a> {
    changed: &'a HashSet<ObjectId>,
    /// Objects that were visited, with the kinds of change in them.
    known: HashMap<ObjectId, Change>,
    /// Objects that changed, or contain a changed object, or whose values a changed texture scales.
    parts: HashSet<ObjectId>,
    /// Shapes whose geometry changed.
    shapes: HashSet<ObjectId>,
    /// True if the film or the integrator changed, and thus perhaps the channels.
    films: bool,
}

/// Kinds of change in an object.
#[derive(Clone, Copy, Default)]
struct Change {
    /// Anything changed.
    any: bool,
    /// The geometry of a shape changed.
    geometry: bool,
}

impl Outdated<'_> {
    fn visit(&mut self, object: &ObjectDescription) -> Change {
        if let Some(known) = self.known.get(&object.number) {
            return *known;
        }
        let own = self.changed.contains(&object.number);
        let mut change = Change {
            any: own,
            geometry: own,
        };
        for child in &object.children {
            let nested = self.visit(&child.object);
            change.any |= nested.any;
            // Surfaces, media, emitters and sensors do not change the shape that holds them.
            change.geometry |= match child.object.kind {
                PluginKind::Shape => nested.geometry,
                PluginKind::Volume | PluginKind::Texture => nested.any,
                _ => false,
            };
        }
        if own && object.kind == PluginKind::Texture {
            self.forget_below(object);
        }
        if change.any {
            self.parts.insert(object.number);
            let kinds = [PluginKind::Film, PluginKind::Integrator];
            self.films |= kinds.contains(&object.kind);
        }
        if change.geometry {
            self.shapes.insert(object.number);
        }
        self.known.insert(object.number, change);
        change
    }

    /// Forgets the parts of all objects in an object.
    fn forget_below(&mut self, object: &ObjectDescription) {
        for child in &object.children {
            self.parts.insert(child.object.number);
            self.forget_below(&child.object);
        }
    }
}
