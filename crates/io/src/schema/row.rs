//! Shorthands for the rows of the table.

use super::{Parameter, Plugin, Slot, Type};
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

/// A parameter of any type.
const fn parameter(
    value: Type,
    name: &'static str,
    default: &'static str,
    help: &'static str,
) -> Parameter {
    Parameter {
        name,
        value,
        default,
        help,
    }
}

/// Shorthands of one type each: name, default, help.
macro_rules! typed {
    ($($function:ident: $value:ident;)*) => {$(
        pub(super) const fn $function(name: &'static str, default: &'static str, help: &'static str) -> Parameter {
            parameter(Type::$value, name, default, help)
        }
    )*};
}

typed! {
    float: Float;
    integer: Integer;
    boolean: Boolean;
    text: Text;
    list: List;
    spectrum: Spectrum;
    point: Point;
    vector: Vector;
    transform: Transform;
    tensor: Tensor;
}

/// One of some words, the first of which is the default.
pub(super) const fn word(
    name: &'static str,
    words: &'static [&'static str],
    help: &'static str,
) -> Parameter {
    parameter(Type::Word(words), name, words[0], help)
}

/// One of some words, with another default.
pub(super) const fn choice(
    name: &'static str,
    words: &'static [&'static str],
    default: &'static str,
    help: &'static str,
) -> Parameter {
    parameter(Type::Word(words), name, default, help)
}

/// A number, or one of some words, the first of which is the default.
pub(super) const fn number_or_word(
    name: &'static str,
    words: &'static [&'static str],
    help: &'static str,
) -> Parameter {
    parameter(Type::NumberOrWord(words), name, words[0], help)
}

/// An index of refraction: a number, or the name of a substance.
pub(super) const fn index(
    name: &'static str,
    default: &'static str,
    help: &'static str,
) -> Parameter {
    let substances = Type::NumberOrWord(&super::substance::NAMES);
    parameter(substances, name, default, help)
}

/// A map from local coordinates to the world.
pub(super) const TO_WORLD: Parameter = transform(
    "to_world",
    "[]",
    "from local coordinates to the parent's, invertible",
);

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
