//! Keys of objects: names, roles and kinds.

use crate::diagnostic::suggest;
use crate::draft::Dialect;
use crate::scene::PluginKind;
use crate::schema;

/// Key of an object's plugin.
pub(super) const TYPE: &str = "type";
/// Key of an object's id.
pub(super) const ID: &str = "id";
/// Key of the scene's parameters.
pub(super) const PARAMETERS: &str = "parameters";
/// Key by which editors find the schema.
pub(super) const SCHEMA: &str = "$schema";

/// Infers the kind of an object from its key, its `plugin`, and the kind and type of its parent.
/// Otherwise returns an error message, with advice.
pub(super) fn infer(
    kind: PluginKind,
    parent: &str,
    key: &str,
    plugin: &str,
) -> Result<PluginKind, (String, Option<String>)> {
    let place = schema::find(kind, parent);
    let role = place.and_then(|place| place.roles(key).next());
    if let Some(kind) = role.or(PluginKind::of_key(key)) {
        return Ok(kind);
    }
    let mut kinds: Vec<PluginKind> = schema::kinds(plugin).collect();
    if kinds.is_empty() {
        kinds.extend(Dialect::kinds(plugin));
    }
    let slots = place.map_or(&[][..], schema::Plugin::children);
    let mut taken = slots.iter().filter(|slot| slot.role.is_none());
    match kinds[..] {
        [] => Err(unknown(plugin)),
        [kind] => Ok(kind),
        _ => match taken.find(|slot| kinds.contains(&slot.kind)) {
            Some(slot) => Ok(slot.kind),
            None => Err(ambiguous(plugin, &kinds)),
        },
    }
}

fn unknown(plugin: &str) -> (String, Option<String>) {
    let message = format!("unknown type '{plugin}'");
    let all = PluginKind::ALL.into_iter().flat_map(schema::plugins);
    let help = match schema::mitsuba::substitute_of_any_kind(plugin) {
        Some(substitute) => Some(substitute.to_owned()),
        None => suggest(plugin, all.map(|plugin| plugin.name)),
    };
    (message, help)
}

fn ambiguous(plugin: &str, kinds: &[PluginKind]) -> (String, Option<String>) {
    let words: Vec<String> = kinds.iter().map(|kind| format!("\"{kind}\"")).collect();
    let message = format!("'{plugin}' may be of several kinds: {}", words.join(", "));
    let help = "say which by the key: the kind, with a number if need be, such as \"volume_2\"";
    (message, Some(help.to_owned()))
}
