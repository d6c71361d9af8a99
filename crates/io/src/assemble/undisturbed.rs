//! Scenes without their flow (docs/guides/schlieren.md#background-oriented-schlieren): media whose index varies get the index of what disturbs
//! nothing.

use crate::scene::{
    Child, ObjectDescription, ObjectId, PluginKind, Property, SceneDescription, Value,
};
use std::collections::HashMap;
use std::sync::Arc;

/// The same scene without what varies in indices: a medium has the index against which the field is told, or else that of what is around.
pub(super) fn undisturbed(scene: &SceneDescription) -> SceneDescription {
    let mut known = HashMap::new();
    SceneDescription {
        root: object(&scene.root, &mut known),
        parameters: scene.parameters.clone(),
        folders: scene.folders.clone(),
    }
}

fn object(
    described: &Arc<ObjectDescription>,
    known: &mut HashMap<ObjectId, Arc<ObjectDescription>>,
) -> Arc<ObjectDescription> {
    if let Some(known) = known.get(&described.number) {
        return known.clone();
    }
    let mut made = ObjectDescription::clone(described);
    if made.kind == PluginKind::Medium
        && let Some(place) = made.children.iter().position(varies)
    {
        let field = made.children.remove(place);
        made.properties.extend(reference(&field));
    }
    for child in &mut made.children {
        child.object = object(&child.object, known);
    }
    let made = Arc::new(made);
    known.insert(described.number, made.clone());
    made
}

/// Whether a child of a medium is an index that varies in space.
fn varies(child: &Child) -> bool {
    let is_index = child.name.as_deref() == Some("ior") && child.object.kind == PluginKind::Volume;
    is_index && !["constant", "cauchy", "sellmeier"].contains(&child.object.plugin.as_str())
}

/// The index against which a field is told, as the `ior` of its medium.
fn reference(field: &Child) -> Option<Property> {
    let (name, default) = match field.object.plugin.as_str() {
        "gladstone_dale" => ("n0", Some(1.0)),
        "pressure" | "transducer" | "acoustic" | "gaussian" => ("n0", None),
        "luneburg" => ("n_exterior", Some(1.0)),
        "sum" => ("reference", Some(1.0)),
        _ => return None,
    };
    let given = field.object.properties.iter().find(|p| p.name == name);
    let value = given
        .map(|property| property.value.clone())
        .or(default.map(Value::Float))?;
    Some(Property {
        name: "ior".to_owned(),
        value,
        name_location: field.location.clone(),
        location: field.location.clone(),
    })
}
