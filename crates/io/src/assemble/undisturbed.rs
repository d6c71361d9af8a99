//! Scenes without their flow (docs/guides/schlieren.md#background-oriented-schlieren). Media with a
//! varying index get the index of undisturbed matter.

use crate::scene::{
    Child, ObjectDescription, ObjectId, PluginKind, Property, SceneDescription, Value,
};
use eikonal::field::Constant;
use std::collections::HashMap;
use std::sync::Arc;
use transport::bsdf::Bsdf;
use transport::scene::{MediumId, Object, Parts};

/// Number of points on each surface of a medium at which its index is evaluated.
const PLACES: u32 = 256;
/// Steps of a lattice in the unit square, based on the plastic number.
const LATTICE: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053_3];

/// Returns the scene without the variation of indices, for indices that give a reference.
pub(super) fn undisturbed(scene: &SceneDescription) -> SceneDescription {
    let mut known = HashMap::new();
    SceneDescription {
        root: object(&scene.root, &mut known),
        parameters: scene.parameters.clone(),
        folders: scene.folders.clone(),
    }
}

/// Copies an object, and replaces varying indices by their reference indices. Objects that are
/// shared stay shared.
fn object(
    described: &Arc<ObjectDescription>,
    known: &mut HashMap<ObjectId, Arc<ObjectDescription>>,
) -> Arc<ObjectDescription> {
    if let Some(known) = known.get(&described.number) {
        return known.clone();
    }
    let mut made = ObjectDescription::clone(described);
    if made.kind == PluginKind::Medium
        && let Some(place) = made.children.iter().position(is_index)
    {
        match dispersed(&made.children[place]) {
            Some(still) => made.children[place].object = Arc::new(still),
            None => {
                if let Some(index) = reference(&made.children[place], "ior") {
                    made.children.remove(place);
                    made.properties.push(index);
                }
            }
        }
    }
    for child in &mut made.children {
        child.object = object(&child.object, known);
    }
    let made = Arc::new(made);
    known.insert(described.number, made.clone());
    made
}

/// Returns true if a child of a medium is an index.
fn is_index(child: &Child) -> bool {
    child.name.as_deref() == Some("ior") && child.object.kind == PluginKind::Volume
}

/// Returns a dispersion law whose field is replaced by its reference index.
fn dispersed(law: &Child) -> Option<ObjectDescription> {
    let mut made = ObjectDescription::clone(&law.object);
    let volumes = made.children.iter_mut();
    let nested = volumes.filter(|child| child.object.kind == PluginKind::Volume);
    let [nested] = &mut nested.collect::<Vec<_>>()[..] else {
        return None;
    };
    if !["cauchy", "sellmeier"].contains(&made.plugin.as_str()) {
        return None;
    }
    let mut constant = ObjectDescription::clone(&nested.object);
    constant.properties = vec![reference(nested, "value")?];
    constant.plugin = "constant".to_owned();
    constant.children.clear();
    nested.object = Arc::new(constant);
    Some(made)
}

/// Returns the reference index of a field, as a property with a given name.
fn reference(field: &Child, property: &str) -> Option<Property> {
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
        name: property.to_owned(),
        value,
        name_location: field.location.clone(),
        location: field.location.clone(),
    })
}

/// Replaces each index that still varies by its mean over the medium's surfaces. At surfaces that
/// do not refract, the index of the surroundings counts instead.
pub(super) fn calm(parts: &mut Parts) {
    let still: Vec<_> = (0..parts.media.len())
        .filter(|id| !parts.media[*id].index.is_constant())
        .map(|id| (id, around(parts, id)))
        .collect();
    for (id, n) in still {
        parts.media[id].index = Constant::new(n).into();
    }
}

/// Returns the mean index at the surfaces of a medium; 1 if it has none. At surfaces that do not
/// refract, this is the index outside.
fn around(parts: &Parts, id: MediumId) -> f64 {
    let inside = |object: &&Object| object.interior() == Some(id);
    let (mut sum, mut count) = (0.0, 0);
    for object in parts.objects.iter().filter(inside) {
        let exterior = object.sides.map(|sides| sides.exterior);
        let is_matched = matches!(object.bsdf, Bsdf::Null) || object.bsdf.is_partial();
        let exterior = exterior.filter(|_| is_matched);
        let index = &parts.media[exterior.unwrap_or(id)].index;
        for i in 0..PLACES {
            let u = LATTICE.map(|step| (f64::from(i) * step).fract());
            let n = index.n(object.shape.sample_area(u).position);
            if n.is_finite() {
                (sum, count) = (sum + n, count + 1);
            }
        }
    }
    if count > 0 {
        sum / f64::from(count)
    } else {
        1.0
    }
}
