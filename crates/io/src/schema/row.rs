//! Shorthands for plugins and the places of their children.

use super::{Parameter, Plugin, Slot};
use crate::scene::PluginKind;

/// A plugin; its parameters come in groups, which others may share.
pub(super) const fn plugin(
    name: &'static str,
    help: &'static str,
    parameters: &'static [&'static [Parameter]],
    children: &'static [Slot],
) -> Plugin {
    Plugin {
        name,
        help,
        parameters,
        children,
        others: None,
    }
}

impl Plugin {
    /// The same, with parameters of other names.
    pub(super) const fn with_others(self, others: &'static Parameter) -> Self {
        Plugin {
            others: Some(others),
            ..self
        }
    }
}

const fn slot(
    kind: PluginKind,
    role: Option<&'static str>,
    many: bool,
    help: &'static str,
) -> Slot {
    Slot {
        kind,
        role,
        many,
        help,
    }
}

/// At most one child of a kind, whatever its name.
pub(super) const fn one(kind: PluginKind, help: &'static str) -> Slot {
    slot(kind, None, false, help)
}

/// Any number of children of a kind.
pub(super) const fn many(kind: PluginKind, help: &'static str) -> Slot {
    slot(kind, None, true, help)
}

/// A child in a role.
pub(super) const fn role(kind: PluginKind, name: &'static str, help: &'static str) -> Slot {
    slot(kind, Some(name), false, help)
}

/// A texture in the place of a parameter.
pub(super) const fn texture(name: &'static str) -> Slot {
    role(PluginKind::Texture, name, "A texture in its place.")
}
