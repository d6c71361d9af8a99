//! Reading the objects of a scene file.

use super::keys::{self, ID, PARAMETERS, SCHEMA, TYPE};
use super::mcx;
use super::parameters::Parameters;
use super::tree::{self, Entry, Json, Node};
use super::values::{self, get, only, report};
use crate::diagnostic::{Diagnostic, Diagnostics, Location, SourceFile};
use crate::draft::{Dialect, Draft, DraftChild, Drafts, MAX_DEPTH, Target};
use crate::input::Limits;
use crate::scene::{PluginKind, Property, SceneDescription};
use crate::schema;
use std::sync::Arc;

/// Reads the scene in `source`.
pub(super) fn load(
    source: &Arc<SourceFile>,
    overrides: &[(String, String)],
    limits: Limits,
    diagnostics: &mut Diagnostics,
) -> Option<SceneDescription> {
    let root = tree::parse(source, diagnostics)?;
    describe(root, overrides, limits, diagnostics)
}

/// Makes a scene from a tree.
pub(super) fn describe(
    mut root: Node,
    overrides: &[(String, String)],
    limits: Limits,
    diagnostics: &mut Diagnostics,
) -> Option<SceneDescription> {
    let mut parameters = Parameters::new(overrides);
    if let Json::Object(entries) = &mut root.json {
        for entry in entries.iter_mut().filter(|e| e.key == PARAMETERS) {
            parameters.declare(&mut entry.node, diagnostics);
        }
        for entry in entries.iter_mut().filter(|e| e.key != PARAMETERS) {
            parameters.substitute(&mut entry.node, diagnostics);
        }
    }
    let parameters = parameters.finish(diagnostics);
    if mcx::is_one(&root) {
        root = mcx::scene(&root, limits, diagnostics)?;
    }
    let mut loader = Loader {
        drafts: Drafts::default(),
        dialect: Dialect::default(),
        diagnostics,
    };
    loader.root(&root)?;
    loader.dialect.report(loader.diagnostics);
    let root = loader.drafts.resolve(diagnostics)?;
    let scene = SceneDescription {
        root,
        parameters,
        folders: Vec::new(),
    };
    (!diagnostics.has_errors()).then_some(scene)
}

struct Loader<'d> {
    drafts: Drafts,
    dialect: Dialect,
    diagnostics: &'d mut Diagnostics,
}

impl Loader<'_> {
    fn error(&mut self, message: impl Into<String>, help: Option<String>, at: &Location) {
        let diagnostic = Diagnostic::error(message).help(help);
        self.diagnostics.push(diagnostic.at(at));
    }

    fn root(&mut self, root: &Node) -> Option<()> {
        let Json::Object(entries) = &root.json else {
            let message = format!("expected an object, found {}", root.json.describe());
            report(root, message, self.diagnostics);
            return None;
        };
        let (plugin, location) = self.plugin(root, entries)?;
        if plugin != PluginKind::Scene.tag() {
            let message = format!("expected \"type\": \"scene\", found \"{plugin}\"");
            self.error(message, None, &location);
            return None;
        }
        let mut draft = Draft::new(PluginKind::Scene, String::new(), location.clone(), location);
        for entry in entries {
            if ![TYPE, PARAMETERS, SCHEMA].contains(&&*entry.key) {
                self.entry(entry, &mut draft, 1);
            }
        }
        self.drafts.set_root(draft);
        Some(())
    }

    /// Returns an object's type and the place of the type.
    fn plugin(&mut self, node: &Node, entries: &[Entry]) -> Option<(String, Location)> {
        match get(entries, TYPE) {
            None => {
                let start = Location::new(node.location.source(), node.location.span().0, 1);
                self.error("this object needs a \"type\"", None, &start);
                None
            }
            Some(value) => match &value.json {
                Json::String(plugin) => Some((plugin.clone(), value.location.clone())),
                other => {
                    let message = format!("\"type\" is a text, not {}", other.describe());
                    report(value, message, self.diagnostics);
                    None
                }
            },
        }
    }

    /// Adds a parameter or a child to `parent`.
    fn entry(&mut self, entry: &Entry, parent: &mut Draft, depth: usize) {
        if depth > MAX_DEPTH {
            let message = "objects are nested too deeply";
            return self.error(message, None, &entry.key_location);
        }
        let Json::Object(entries) = &entry.node.json else {
            return self.property(entry, parent);
        };
        let Some((plugin, location)) = self.plugin(&entry.node, entries) else {
            return;
        };
        match plugin.as_str() {
            "rgb" | "spectrum" => self.property(entry, parent),
            "ref" => self.reference(entry, entries, parent),
            _ => self.object(entry, entries, plugin, location, parent, depth),
        }
    }

    fn property(&mut self, entry: &Entry, parent: &mut Draft) {
        let plugin = schema::find(parent.kind, &parent.plugin);
        let known = plugin.and_then(|plugin| plugin.parameter(&entry.key));
        let known = known.map(|parameter| parameter.value);
        if let Some(value) = values::value(&entry.node, known, self.diagnostics) {
            let property = Property {
                name: entry.key.clone(),
                value,
                name_location: entry.key_location.clone(),
                location: entry.node.location.clone(),
            };
            parent.add_property(property, self.diagnostics);
        }
    }

    fn reference(&mut self, entry: &Entry, entries: &[Entry], parent: &mut Draft) {
        only(entries, &[TYPE, ID], self.diagnostics);
        match get(entries, ID).map(|id| (&id.json, &id.location)) {
            Some((Json::String(id), location)) => {
                let target = Target::Id(id.clone(), location.clone());
                let child = child(entry, parent, target);
                parent.add_child(child, self.diagnostics);
            }
            _ => {
                let message = "a reference needs the \"id\" of an object";
                self.error(message, None, &entry.key_location);
            }
        }
    }

    fn object(
        &mut self,
        entry: &Entry,
        entries: &[Entry],
        plugin: String,
        location: Location,
        parent: &mut Draft,
        depth: usize,
    ) {
        let kind = match keys::infer(parent.kind, &parent.plugin, &entry.key, &plugin) {
            Ok(kind) => kind,
            Err((message, help)) => return self.error(message, help, &location),
        };
        let mut draft = Draft::new(kind, plugin, entry.key_location.clone(), location);
        for entry in entries.iter().filter(|e| ![TYPE, ID].contains(&&*e.key)) {
            self.entry(entry, &mut draft, depth + 1);
        }
        self.dialect.update(&mut draft, self.diagnostics);
        let id = self.id(entry, entries, parent);
        let anonymous = parent.kind == PluginKind::Scene && id.is_none();
        let index = self.drafts.add(draft, id, self.diagnostics);
        if anonymous {
            let (key, at) = (&entry.key, &entry.key_location);
            self.drafts.name(key, index, at, self.diagnostics);
        }
        let child = child(entry, parent, Target::Draft(index));
        parent.add_child(child, self.diagnostics);
    }

    /// Returns the id of an object. Without `id`, the key of a child of the scene is its id, unless
    /// the key is only the name of a kind.
    fn id(
        &mut self,
        entry: &Entry,
        entries: &[Entry],
        parent: &Draft,
    ) -> Option<(String, Location)> {
        if let Some(id) = get(entries, ID) {
            if let Json::String(text) = &id.json {
                return Some((text.clone(), id.location.clone()));
            }
            let message = format!("\"id\" is a text, not {}", id.json.describe());
            report(id, message, self.diagnostics);
        }
        let named = parent.kind == PluginKind::Scene && PluginKind::of_key(&entry.key).is_none();
        named.then(|| (entry.key.clone(), entry.key_location.clone()))
    }
}

/// Makes a child with its key as its role. Children of the scene have no roles.
fn child(entry: &Entry, parent: &Draft, target: Target) -> DraftChild {
    let place = schema::find(parent.kind, &parent.plugin);
    // A role may have the name of a kind.
    let role = place.and_then(|place| place.roles(&entry.key).next());
    let unlike = role.is_some() || PluginKind::of_key(&entry.key).is_none();
    let named = parent.kind != PluginKind::Scene && unlike;
    DraftChild {
        name: named.then(|| (entry.key.clone(), entry.key_location.clone())),
        target,
        location: entry.key_location.clone(),
    }
}
