//! Data and functions that all readers of scene files share: objects whose references are still
//! names, parameters that the command line may set, and the maps in transforms.

mod dialect;
mod parameters;
mod resolve;
mod text;
pub(crate) mod transforms;
mod unfold;

pub(crate) use dialect::Dialect;
pub(crate) use parameters::Parameters;
pub(crate) use resolve::Drafts;
pub(crate) use text::{read, shorten};

use crate::diagnostic::{Diagnostic, Diagnostics, Location};
use crate::scene::{PluginKind, Property};
use std::collections::HashMap;

/// Maximum nesting depth of objects, references and included files.
pub(crate) const MAX_DEPTH: usize = 64;

/// Object whose references are still names.
pub(crate) struct Draft {
    pub(crate) kind: PluginKind,
    pub(crate) plugin: String,
    pub(crate) id: Option<String>,
    pub(crate) properties: Vec<Property>,
    pub(crate) children: Vec<DraftChild>,
    /// Names of parameters and roles, with their places.
    pub(crate) names: HashMap<String, Location>,
    pub(crate) location: Location,
    pub(crate) plugin_location: Location,
}

/// Nested object or reference.
pub(crate) struct DraftChild {
    pub(crate) name: Option<(String, Location)>,
    pub(crate) target: Target,
    pub(crate) location: Location,
}

/// Object to which a child refers.
pub(crate) enum Target {
    /// Draft with this number.
    Draft(usize),
    /// Object with this id, and the place of the id.
    Id(String, Location),
}

/// Second name for an object.
pub(crate) struct Alias {
    pub(crate) name: String,
    pub(crate) name_location: Location,
    pub(crate) target: String,
    pub(crate) location: Location,
}

impl Draft {
    pub(crate) fn new(
        kind: PluginKind,
        plugin: String,
        location: Location,
        plugin_location: Location,
    ) -> Self {
        Draft {
            kind,
            plugin,
            id: None,
            properties: Vec::new(),
            children: Vec::new(),
            names: HashMap::new(),
            location,
            plugin_location,
        }
    }

    /// Adds a parameter. Reports a name that the object already has.
    pub(crate) fn add_property(&mut self, property: Property, diagnostics: &mut Diagnostics) {
        self.claim(&property.name, &property.name_location, diagnostics);
        self.properties.push(property);
    }

    /// Adds a child. Reports a name that the object already has.
    pub(crate) fn add_child(&mut self, child: DraftChild, diagnostics: &mut Diagnostics) {
        if let Some((name, location)) = &child.name {
            self.claim(name, location, diagnostics);
        }
        self.children.push(child);
    }

    /// Reports a name that this object already has.
    fn claim(&mut self, name: &str, location: &Location, diagnostics: &mut Diagnostics) {
        if let Some(first) = self.names.get(name) {
            let message = format!("'{name}' is set twice in this <{}>", self.kind);
            let help = format!("the first is at {first}");
            diagnostics.push(Diagnostic::error(message).help(help).at(location));
        } else {
            self.names.insert(name.to_owned(), location.clone());
        }
    }
}
