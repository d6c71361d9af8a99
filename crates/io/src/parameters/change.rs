//! Scenes with other values of parameters.

use super::{Place, places};
use crate::diagnostic::{Diagnostic, Diagnostics, closest};
use crate::json::{Item, value_of_item};
use crate::scene::{Child, ObjectDescription, ObjectId, Property, SceneDescription};
use crate::schema::Type;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Returns the scene with other values of the parameters with these names, and the changed objects.
/// Objects keep their numbers. Loading the scene checks the types and ranges of the values.
///
/// Returns `None` if there was an error; `diagnostics` gets every problem found, with places such
/// as `parameters["ball.radius"]`.
pub fn with_values(
    description: &SceneDescription,
    values: Vec<(String, Item)>,
    diagnostics: &mut Diagnostics,
) -> Option<(SceneDescription, HashSet<ObjectId>)> {
    let places = places(description);
    let mut changes: HashMap<ObjectId, Vec<Property>> = HashMap::new();
    for (name, item) in values {
        let Some(place) = places.iter().find(|place| place.parameter.name == name) else {
            diagnostics.push(unknown(&name, &places));
            continue;
        };
        let item = if place.known == Some(Type::Spectrum) {
            spectrum(item)
        } else {
            item
        };
        let label = format!("parameters[{name:?}]");
        let (value, location) = value_of_item(item, label, place.known, diagnostics);
        changes
            .entry(place.object)
            .or_default()
            .extend(value.map(|value| Property {
                name: place.property.clone(),
                value,
                name_location: location.clone(),
                location,
            }));
    }
    if diagnostics.has_errors() {
        return None;
    }
    let mut made = HashMap::new();
    let root = changed(&description.root, &changes, &mut made);
    let scene = SceneDescription {
        root,
        parameters: description.parameters.clone(),
        folders: description.folders.clone(),
    };
    Some((scene, changes.into_keys().collect()))
}

/// Converts three numbers to a colour, and rows of two numbers to a spectrum.
fn spectrum(item: Item) -> Item {
    let kind = match &item {
        Item::Array(items) if matches!(items.first(), Some(Item::Array(_))) => "spectrum",
        Item::Array(_) => "rgb",
        Item::Tensor(tensor) if tensor.shape().len() == 1 => "rgb",
        Item::Tensor(tensor) if tensor.shape().len() == 2 => "spectrum",
        _ => return item,
    };
    let kind = ("type".to_owned(), Item::String(kind.to_owned()));
    Item::Object(vec![kind, ("value".to_owned(), item)])
}

/// Returns the error about an unknown name, with the most similar name.
fn unknown(name: &str, places: &[Place]) -> Diagnostic {
    let names = places.iter().map(|place| place.parameter.name.as_str());
    let near = closest(name, names).map(|near| format!("did you mean '{near}'?"));
    Diagnostic::error(format!("the scene has no parameter '{name}'")).help(near)
}

/// Returns an object with all changes in it. Objects without changes are shared.
fn changed(
    object: &Arc<ObjectDescription>,
    changes: &HashMap<ObjectId, Vec<Property>>,
    made: &mut HashMap<ObjectId, Arc<ObjectDescription>>,
) -> Arc<ObjectDescription> {
    if let Some(known) = made.get(&object.number) {
        return known.clone();
    }
    let children: Vec<Child> = object
        .children
        .iter()
        .map(|child| Child {
            object: changed(&child.object, changes, made),
            ..child.clone()
        })
        .collect();
    let mut nested = children.iter().zip(&object.children);
    let is_same = nested.all(|(new, old)| Arc::ptr_eq(&new.object, &old.object));
    let own = changes.get(&object.number);
    let result = if is_same && own.is_none() {
        object.clone()
    } else {
        let mut new = ObjectDescription {
            children,
            ..ObjectDescription::clone(object)
        };
        for property in own.into_iter().flatten() {
            new.properties.retain(|p| p.name != property.name);
            new.properties.push(property.clone());
        }
        Arc::new(new)
    };
    made.insert(object.number, result.clone());
    result
}
