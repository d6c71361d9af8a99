//! Parameters of a scene by name, such as `ball.bsdf.reflectance`, and scenes with other values.
//!
//! An object is named by its id. An object without an id is named by its parent and its role, or
//! else its kind: `ball.interior`, `ball.bsdf`. Further objects of equal names have a number:
//! `shape_2`.

mod change;

pub use change::with_values;

use crate::scene::{ObjectDescription, ObjectId, PluginKind, SceneDescription, Value};
use crate::schema::{self, Default, Parameter, Type};
use std::collections::{HashMap, HashSet, VecDeque};
use std::sync::Arc;

/// Parameter of an object in a scene.
#[derive(Clone, Debug)]
pub struct SceneParameter {
    /// Unique name.
    pub name: String,
    /// Kind of the object that has the parameter.
    pub owner: PluginKind,
    /// Type of the values: `float`, `integer`, `boolean`, `word`, `spectrum`, `point`, `vector`,
    /// `transform`, `array`, `list` or `text`.
    pub kind: &'static str,
    /// Value in the scene, or the default.
    pub value: Option<ParameterValue>,
    /// True if the scene does not give the parameter.
    pub is_default: bool,
}

/// Value of a parameter.
#[derive(Clone, Debug)]
pub enum ParameterValue {
    /// Value that the scene gives.
    Given(Value),
    /// Default.
    Default(Default),
}

/// Returns all parameters of a scene's objects, except texts such as names of files. The list
/// contains the parameters that the scene gives, and the parameters that have a default.
pub fn parameters(description: &SceneDescription) -> Vec<SceneParameter> {
    let places = places(description).into_iter();
    places.map(|place| place.parameter).collect()
}

/// Parameter with its object.
struct Place {
    parameter: SceneParameter,
    object: ObjectId,
    property: String,
    known: Option<Type>,
}

/// Lists the parameters of all objects, in the order of the scene.
fn places(description: &SceneDescription) -> Vec<Place> {
    let mut all = Vec::new();
    for (name, object) in named_objects(description) {
        let schema = schema::find(object.kind, &object.plugin);
        let given = object.properties.iter();
        let mut listed: HashSet<&str> = given.clone().map(|p| p.name.as_str()).collect();
        listed.extend(object.children.iter().filter_map(|c| c.name.as_deref()));
        let place = |property: &str, known: Option<Type>, value: ParameterValue| Place {
            parameter: SceneParameter {
                name: format!("{name}.{property}"),
                owner: object.kind,
                kind: kind(known, &value),
                is_default: matches!(value, ParameterValue::Default(_)),
                value: Some(value),
            },
            object: object.number,
            property: property.to_owned(),
            known,
        };
        for property in given {
            let known = schema.and_then(|plugin| plugin.parameter(&property.name));
            let known = known.map(|parameter| parameter.value);
            if known != Some(Type::Text) {
                let value = ParameterValue::Given(property.value.clone());
                all.push(place(&property.name, known, value));
            }
        }
        let parameters = schema.into_iter().flat_map(|plugin| plugin.parameters());
        for parameter in parameters.filter(|p| !listed.contains(p.name)) {
            if let Some(value) = default(parameter) {
                all.push(place(parameter.name, Some(parameter.value), value));
            }
        }
    }
    all
}

/// Returns the default of a parameter, if it has one and an effect.
fn default(parameter: &Parameter) -> Option<ParameterValue> {
    let has_value = !matches!(
        parameter.default,
        Default::Required | Default::Absent | Default::Computed(_)
    );
    let has_effect = !parameter.help.starts_with("accepted and ignored");
    let is_text = parameter.value == Type::Text;
    (has_value && has_effect && !is_text).then_some(ParameterValue::Default(parameter.default))
}

/// Returns the name of a parameter's type.
fn kind(known: Option<Type>, value: &ParameterValue) -> &'static str {
    match (known, value) {
        (Some(Type::Float), _) => "float",
        (Some(Type::Integer), _) => "integer",
        (Some(Type::Boolean), _) => "boolean",
        (Some(Type::Text), _) => "text",
        (Some(Type::Word(_) | Type::NumberOrWord(_)), _) => "word",
        (Some(Type::List), _) => "list",
        (Some(Type::Spectrum), _) => "spectrum",
        (Some(Type::Point), _) => "point",
        (Some(Type::Vector), _) => "vector",
        (Some(Type::Transform), _) => "transform",
        (Some(Type::Tensor), _) => "array",
        (None, ParameterValue::Given(value)) => value.type_name(),
        (None, ParameterValue::Default(_)) => "float",
    }
}

/// Returns all objects of a scene with their names, each once. Objects that are nested less deeply
/// come first, so that a definition beside all shapes has its own name.
fn named_objects(description: &SceneDescription) -> Vec<(String, Arc<ObjectDescription>)> {
    let mut seen = HashSet::new();
    let mut used: HashMap<String, usize> = HashMap::new();
    let mut open = VecDeque::from([(String::new(), description.root.clone())]);
    let mut named = Vec::new();
    while let Some((prefix, parent)) = open.pop_front() {
        for child in &parent.children {
            let object = &child.object;
            if !seen.insert(object.number) {
                continue;
            }
            let role = child.name.as_deref().unwrap_or(object.kind.tag());
            let wanted = match &object.id {
                Some(id) => id.clone(),
                None if parent.kind == PluginKind::Scene => role.to_owned(),
                None => format!("{prefix}.{role}"),
            };
            let count = used.entry(wanted.clone()).or_insert(0);
            *count += 1;
            let name = if *count == 1 {
                wanted
            } else {
                format!("{wanted}_{count}")
            };
            open.push_back((name.clone(), object.clone()));
            named.push((name, object.clone()));
        }
    }
    named
}
