//! Constructors for plugins and the places of their children.

use super::{Parameter, Plugin, Slot};
use crate::scene::PluginKind;
use transport::phase::{Phase, PhaseError};

/// Constructor of a phase function, given the values of its parameters by name.
pub(crate) type PhaseConstructor = fn(&mut dyn FnMut(&str) -> f64) -> Result<Phase, PhaseError>;

/// Makes a plugin that Mitsuba has. Its parameters come in groups, which plugins may share.
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
        in_mitsuba: true,
        phase: None,
    }
}

/// Makes a plugin that Mitsuba does not have.
pub(super) const fn own_plugin(
    name: &'static str,
    help: &'static str,
    parameters: &'static [&'static [Parameter]],
    children: &'static [Slot],
) -> Plugin {
    Plugin {
        in_mitsuba: false,
        ..plugin(name, help, parameters, children)
    }
}

impl Plugin {
    /// Returns the plugin with a constructor.
    pub(super) const fn phase(self, constructor: PhaseConstructor) -> Self {
        Plugin {
            phase: Some(constructor),
            ..self
        }
    }

    /// Returns the plugin, which then also accepts parameters of any other name, described by
    /// `others`.
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

/// Makes a place for at most one child of a kind, whatever its name.
pub(super) const fn one(kind: PluginKind, help: &'static str) -> Slot {
    slot(kind, None, false, help)
}

/// Makes a place for any number of children of a kind.
pub(super) const fn many(kind: PluginKind, help: &'static str) -> Slot {
    slot(kind, None, true, help)
}

/// Makes a place for a child with the role `name`.
pub(super) const fn role(kind: PluginKind, name: &'static str, help: &'static str) -> Slot {
    slot(kind, Some(name), false, help)
}

/// Makes a place for a texture that replaces the parameter `name`.
pub(super) const fn texture(name: &'static str) -> Slot {
    role(
        PluginKind::Texture,
        name,
        "Texture instead of the number or colour.",
    )
}
