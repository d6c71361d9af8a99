//! Conversion of media coefficients to the parameters of Mitsuba 3.

use super::{
    Child, ObjectDescription, ObjectId, PluginKind, SceneDescription, SpectrumValue, Value,
};
use std::collections::HashMap;
use std::sync::Arc;

impl SceneDescription {
    /// Returns the scene with `sigma_t` and `albedo` instead of `sigma_s` and `sigma_a` of
    /// homogeneous media, if these are numbers or colours. Mitsuba 3 does not accept `sigma_s` and
    /// `sigma_a`.
    pub fn with_extinctions(&self) -> SceneDescription {
        SceneDescription {
            root: converted(&self.root, &mut HashMap::new()),
            ..self.clone()
        }
    }
}

/// Converts an object and all objects in it, each once, however many references it has.
fn converted(
    object: &Arc<ObjectDescription>,
    done: &mut HashMap<ObjectId, Arc<ObjectDescription>>,
) -> Arc<ObjectDescription> {
    if let Some(done) = done.get(&object.number) {
        return done.clone();
    }
    let mut copy = ObjectDescription::clone(object);
    copy.children = object
        .children
        .iter()
        .map(|child| Child {
            object: converted(&child.object, done),
            ..child.clone()
        })
        .collect();
    if copy.kind == PluginKind::Medium && copy.plugin == "homogeneous" {
        convert(&mut copy);
    }
    let copy = Arc::new(copy);
    done.insert(object.number, copy.clone());
    copy
}

/// Replaces `sigma_s` by `sigma_t` and `sigma_a` by `albedo`, if both are numbers or colours.
fn convert(medium: &mut ObjectDescription) {
    let properties = &mut medium.properties;
    let place = |name: &str| properties.iter().position(|p| p.name == name);
    let (Some(scattering), Some(absorption)) = (place("sigma_s"), place("sigma_a")) else {
        return;
    };
    let [s, a] = [scattering, absorption].map(|i| channels(&properties[i].value));
    let (Some(s), Some(a)) = (s, a) else {
        return;
    };
    let extinction: [f64; 3] = std::array::from_fn(|c| s[c] + a[c]);
    let albedo = std::array::from_fn(|c| {
        if s[c] > 0.0 {
            s[c] / extinction[c]
        } else {
            0.0
        }
    });
    for (place, name, values) in [
        (scattering, "sigma_t", extinction),
        (absorption, "albedo", albedo),
    ] {
        properties[place].name = name.into();
        properties[place].value = if values == [values[0]; 3] {
            Value::Float(values[0])
        } else {
            Value::Spectrum(SpectrumValue::Rgb(values))
        };
    }
}

/// Returns red, green and blue of a number or a colour.
fn channels(value: &Value) -> Option<[f64; 3]> {
    match value {
        Value::Float(v) | Value::Spectrum(SpectrumValue::Uniform(v)) => Some([*v; 3]),
        Value::Spectrum(SpectrumValue::Rgb(values)) => Some(*values),
        _ => None,
    }
}
