//! Reading the XML elements of a scene file and of the files that it includes.

use std::path::PathBuf;
use std::sync::Arc;

use glam::DMat4;
use roxmltree::Node;

use super::element::{self, Element};
use super::tags::{self, Tag};
use super::{document, properties, transforms};
use crate::diagnostic::{Diagnostic, Diagnostics, Location, SourceFile, lints, shown, suggest};
use crate::draft::{
    self, Alias, Dialect, Draft, DraftChild, Drafts, MAX_DEPTH, Parameters, Target,
};
use crate::scene::{self, PluginKind, Property, SceneDescription, Value};

/// Largest number of included files, with repetitions. Without a limit, files that each include the
/// next one twice would multiply exponentially.
const MAX_INCLUDES: usize = 1000;
/// Largest number of folders in which a file is searched.
const MAX_FOLDERS: usize = 100;

/// Reads the scene in `source`.
pub(super) fn load(
    source: Arc<SourceFile>,
    overrides: &[(String, String)],
    diagnostics: &mut Diagnostics,
) -> Option<SceneDescription> {
    let mut loader = Loader {
        parameters: Parameters::new(overrides, |name| {
            format!("<default name=\"{name}\" value=\"...\"/>")
        }),
        drafts: Drafts::default(),
        open_files: vec![identity(&source)],
        folders: vec![source.directory().to_owned()],
        includes: 0,
        dialect: Dialect::default(),
        diagnostics,
    };
    loader.root(&source)?;
    let Loader {
        parameters,
        drafts,
        dialect,
        folders,
        ..
    } = loader;
    dialect.report(diagnostics);
    parameters.report_open(diagnostics);
    parameters.report_unused(diagnostics);
    let root = drafts.resolve(diagnostics)?;
    let scene = SceneDescription {
        root,
        parameters: parameters.into_values(),
        folders,
    };
    (!diagnostics.has_errors()).then_some(scene)
}

/// Returns a path that identifies a file, however the path to it is written.
fn identity(source: &SourceFile) -> PathBuf {
    source
        .path()
        .canonicalize()
        .unwrap_or_else(|_| source.path().to_owned())
}

struct Loader<'d> {
    parameters: Parameters,
    drafts: Drafts,
    /// The file being read, after the files that include it.
    open_files: Vec<PathBuf>,
    /// Folders that are searched besides the folder of the file that names a file: first the
    /// `<path>`s, the last one first, then the folder of the scene.
    folders: Vec<PathBuf>,
    includes: usize,
    dialect: Dialect,
    diagnostics: &'d mut Diagnostics,
}

impl Loader<'_> {
    fn error(&mut self, message: impl Into<String>, location: &Location) {
        self.diagnostics
            .push(Diagnostic::error(message).at(location));
    }

    fn element(&mut self, node: Node<'_, '_>, source: &Arc<SourceFile>) -> Element {
        Element::new(node, source, &mut self.parameters, self.diagnostics)
    }

    fn root(&mut self, source: &Arc<SourceFile>) -> Option<()> {
        let document = document::parse(source)
            .map_err(|d| self.diagnostics.push(d))
            .ok()?;
        let node = document.root_element();
        let element = self.element(node, source);
        if element.tag != "scene" {
            let message = format!("expected <scene>, found <{}>", element.tag);
            self.error(message, &element.location);
            return None;
        }
        element.require("version", self.diagnostics);
        self.check_scene(&element);
        let location = element.location.clone();
        let mut draft = Draft::new(PluginKind::Scene, String::new(), location.clone(), location);
        self.contents(node, source, &mut draft, 1);
        self.drafts.set_root(draft);
        Some(())
    }

    fn check_scene(&mut self, element: &Element) {
        element.allow(&["version"], self.diagnostics);
        let Some(version) = element.get("version") else {
            return;
        };
        let mut numbers = version.value.split('.');
        match (numbers.next(), numbers.next()) {
            (Some("2" | "3"), _) => self.dialect.old = false,
            (Some("0"), Some("4" | "5" | "6")) => {
                self.dialect.enter(&version.location);
            }
            _ => {
                let message = format!("scenes of version '{}' are not supported", version.value);
                let help = "write version=\"3.0.0\" and use the parameter names of Mitsuba 3";
                let diagnostic = Diagnostic::error(message).help(help.to_owned());
                self.diagnostics.push(diagnostic.at(&version.location));
            }
        }
    }

    /// Adds the children of `node` to `parent`.
    fn contents(
        &mut self,
        node: Node<'_, '_>,
        source: &Arc<SourceFile>,
        parent: &mut Draft,
        depth: usize,
    ) {
        for child in element::children(node, source, self.diagnostics) {
            self.item(child, source, parent, depth);
        }
    }

    /// Adds the parameter or object in `node` to `parent`.
    fn item(
        &mut self,
        node: Node<'_, '_>,
        source: &Arc<SourceFile>,
        parent: &mut Draft,
        depth: usize,
    ) {
        let element = self.element(node, source);
        if depth > MAX_DEPTH {
            return self.error("elements are nested too deeply", &element.location);
        }
        match Tag::new(&element.tag, element.get("type").is_some()) {
            Tag::Plugin(kind) => self.plugin(kind, &element, node, parent, depth),
            _ if element.broken => {}
            Tag::Include => self.include(&element, parent, depth),
            Tag::Transform => {
                if let Some(property) = self.transform(&element, node) {
                    self.add_property(property, parent);
                }
            }
            Tag::Animation => {
                if let Some(property) = self.animation(&element, node) {
                    self.add_property(property, parent);
                }
            }
            Tag::Blackbody => {
                self.childless(node, source);
                self.blackbody(&element, parent);
            }
            tag => {
                self.childless(node, source);
                self.leaf(tag, &element, parent);
            }
        }
    }

    /// Handles elements that have no children.
    fn leaf(&mut self, tag: Tag, element: &Element, parent: &mut Draft) {
        match tag {
            Tag::Ref => self.reference(element, parent),
            Tag::Alias => self.alias(element),
            Tag::Default => self.default(element),
            Tag::Path => self.folder(element),
            Tag::Property => {
                if let Some(property) = properties::property(element, self.diagnostics) {
                    self.add_property(property, parent);
                }
            }
            _ => {
                let message = format!("unknown element <{}>", element.tag);
                let help = suggest(&element.tag, tags::known());
                let diagnostic = Diagnostic::error(message).help(help);
                self.diagnostics.push(diagnostic.at(&element.location));
            }
        }
    }

    fn add_property(&mut self, property: Property, parent: &mut Draft) {
        let property = Property {
            name: self.dialect.name(property.name),
            value: self.dialect.value(property.value),
            ..property
        };
        parent.add_property(property, self.diagnostics);
    }

    /// Adds an object in the role that an element gives it.
    fn add_child(&mut self, element: &Element, target: Target, parent: &mut Draft) {
        let name = element.get("name");
        let name = name.map(|a| (self.dialect.name(a.value.clone()), a.name_location.clone()));
        let child = DraftChild {
            name,
            target,
            location: element.location.clone(),
        };
        parent.add_child(child, self.diagnostics);
    }

    fn childless(&mut self, node: Node<'_, '_>, source: &Arc<SourceFile>) {
        // An unknown element may contain anything: report only its name.
        if let Some(child) = element::children(node, source, self.diagnostics).first()
            && !matches!(Tag::new(node.tag_name().name(), false), Tag::Unknown)
        {
            let message = format!("<{}> cannot contain elements", node.tag_name().name());
            self.error(message, &Location::new(source, child.range().start, 1));
        }
    }

    fn plugin(
        &mut self,
        kind: PluginKind,
        element: &Element,
        node: Node<'_, '_>,
        parent: &mut Draft,
        depth: usize,
    ) {
        element.allow(&["type", "id", "name"], self.diagnostics);
        let plugin = element.require("type", self.diagnostics);
        let plugin_location = plugin.map_or(&element.location, |a| &a.location).clone();
        let plugin = plugin.map_or(String::new(), |a| a.value.clone());
        let mut draft = Draft::new(kind, plugin, element.location.clone(), plugin_location);
        let source = Arc::clone(element.location.source());
        self.contents(node, &source, &mut draft, depth + 1);
        self.dialect.update(&mut draft, self.diagnostics);
        let is_integrator =
            |child: &DraftChild| self.drafts.kind(&child.target) == Some(PluginKind::Integrator);
        if let Some(nested) = self.dialect.nested(&mut draft, is_integrator) {
            return self.add_child(element, nested.target, parent);
        }
        let kind = |child: &DraftChild| self.drafts.kind(&child.target);
        if let Some(null) = self.dialect.boundary(&draft, kind) {
            let location = null.location.clone();
            let target = Target::Draft(self.drafts.add(null, None, self.diagnostics));
            let name = None;
            draft.children.push(DraftChild {
                name,
                target,
                location,
            });
        }
        let id = element
            .get("id")
            .map(|a| (a.value.clone(), a.location.clone()));
        let index = self.drafts.add(draft, id, self.diagnostics);
        self.add_child(element, Target::Draft(index), parent);
    }

    /// Adds thermal radiation in the notation of Mitsuba 0.6. In Mitsuba 3 it is a nested spectrum.
    fn blackbody(&mut self, element: &Element, parent: &mut Draft) {
        let location = element.location.clone();
        let plugin = "blackbody".to_owned();
        let mut draft = Draft::new(PluginKind::Spectrum, plugin, location.clone(), location);
        for property in properties::blackbody(element, self.diagnostics) {
            draft.add_property(property, self.diagnostics);
        }
        if element.require("name", self.diagnostics).is_some() {
            let index = self.drafts.add(draft, None, self.diagnostics);
            self.add_child(element, Target::Draft(index), parent);
        }
    }

    fn reference(&mut self, element: &Element, parent: &mut Draft) {
        element.allow(&["id", "name"], self.diagnostics);
        if let Some(id) = element.require("id", self.diagnostics) {
            let target = Target::Id(id.value.clone(), id.location.clone());
            self.add_child(element, target, parent);
        }
    }

    fn alias(&mut self, element: &Element) {
        element.allow(&["id", "as"], self.diagnostics);
        let target = element.require("id", self.diagnostics);
        let name = element.require("as", self.diagnostics);
        if let (Some(target), Some(name)) = (target, name) {
            self.drafts.add_alias(Alias {
                name: name.value.clone(),
                name_location: name.location.clone(),
                target: target.value.clone(),
                location: target.location.clone(),
            });
        }
    }

    fn default(&mut self, element: &Element) {
        element.allow(&["name", "value"], self.diagnostics);
        let name = element.require("name", self.diagnostics);
        let value = element.require("value", self.diagnostics);
        if let (Some(name), Some(value)) = (name, value) {
            self.parameters.declare(&name.value, &value.value);
        }
    }

    /// Adds a folder in which files are searched.
    fn folder(&mut self, element: &Element) {
        element.allow(&["value"], self.diagnostics);
        let Some(value) = element.require("value", self.diagnostics) else {
            return;
        };
        let here = element.location.source().directory();
        let folder = scene::find(&value.value, here, &self.folders);
        if self.folders.len() > MAX_FOLDERS {
            self.error("too many folders", &value.location);
        } else if folder.is_dir() {
            self.folders.insert(0, folder);
        } else {
            let message = format!("'{}' is no folder", shown(&folder));
            self.error(message, &value.location);
        }
    }

    fn transform(&mut self, element: &Element, node: Node<'_, '_>) -> Option<Property> {
        element.allow(&["name"], self.diagnostics);
        let matrix = self.matrix(element, node)?;
        let (value, location) = (Value::Transform(matrix), element.location.clone());
        properties::named(element, value, location, self.diagnostics)
    }

    /// Returns the first transform of an animation.
    fn animation(&mut self, element: &Element, node: Node<'_, '_>) -> Option<Property> {
        element.allow(&["name"], self.diagnostics);
        let source = element.location.source();
        let children = element::children(node, source, self.diagnostics);
        let mut first = None;
        for child in children {
            let part = self.element(child, source);
            if part.tag != "transform" {
                let message = format!("an animation is made of <transform>, not <{}>", part.tag);
                self.error(message, &part.location);
                return None;
            }
            part.allow(&["time"], self.diagnostics);
            let matrix = self.matrix(&part, child)?;
            first.get_or_insert(matrix);
        }
        let Some(matrix) = first else {
            self.error("the animation has no <transform>", &element.location);
            return None;
        };
        let message = "morgana renders no motion: it uses the first transform of the animation";
        self.diagnostics
            .push(lints::note(lints::ANIMATION, message).at(&element.location));
        let (value, location) = (Value::Transform(matrix), element.location.clone());
        properties::named(element, value, location, self.diagnostics)
    }

    /// Returns the product of a transform's parts; `None` (reported) if it is not finite.
    fn matrix(&mut self, element: &Element, node: Node<'_, '_>) -> Option<DMat4> {
        let source = element.location.source();
        let mut matrix = DMat4::IDENTITY;
        for child in element::children(node, source, self.diagnostics) {
            let part = self.element(child, source);
            self.childless(child, source);
            // Parts act in their order.
            if part.broken {
                continue;
            }
            if let Some(part) = transforms::part(&part, self.diagnostics) {
                matrix = part * matrix;
            }
        }
        if !matrix.is_finite() {
            self.error("the transform is not finite", &element.location);
            return None;
        }
        Some(matrix)
    }

    fn include(&mut self, element: &Element, parent: &mut Draft, depth: usize) {
        element.allow(&["filename"], self.diagnostics);
        let Some(filename) = element.require("filename", self.diagnostics) else {
            return;
        };
        let folder = element.location.source().directory();
        let path = scene::find(&filename.value, folder, &self.folders);
        self.includes += 1;
        if self.includes > MAX_INCLUDES {
            return self.error("too many included files", &filename.location);
        }
        match draft::read(&path) {
            Err(diagnostic) => self.diagnostics.push(diagnostic.at(&filename.location)),
            Ok(source) => self.included(&source, &filename.location, parent, depth),
        }
    }

    fn included(
        &mut self,
        source: &Arc<SourceFile>,
        from: &Location,
        parent: &mut Draft,
        depth: usize,
    ) {
        let identity = identity(source);
        if self.open_files.contains(&identity) {
            let name = shown(source.path());
            return self.error(format!("'{name}' includes itself"), from);
        }
        let document = match document::parse(source) {
            Ok(document) => document,
            Err(diagnostic) => return self.diagnostics.push(diagnostic),
        };
        self.open_files.push(identity);
        let node = document.root_element();
        // If the root is a whole scene, add its contents. Any other root is an element.
        if node.tag_name().name() == "scene" {
            let (element, outer) = (self.element(node, source), self.dialect.old);
            self.check_scene(&element);
            self.contents(node, source, parent, depth + 1);
            self.dialect.old = outer;
        } else {
            self.item(node, source, parent, depth + 1);
        }
        self.open_files.pop();
    }
}
