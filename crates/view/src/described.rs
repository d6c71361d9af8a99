//! Scenes whose parameters a page can change.

use glam::DVec3;
use io::json::Item;
use io::parameters::{ParameterValue, SceneParameter, parameters, with_values};
use io::scene::{PluginKind, SpectrumValue, Value};
use io::{Diagnostics, LoadOptions, Loaded, SceneDescription};
use serde::Deserialize;
use serde_json::{Map, Value as Json, json};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// Values of parameters by name.
pub(crate) type Changes = Map<String, Json>;

/// Scene of a file, and the last scene with other values of parameters.
#[derive(Debug)]
pub(crate) struct DescribedScene {
    pub(crate) loaded: Arc<Loaded>,
    description: SceneDescription,
    options: LoadOptions,
    last: Mutex<Option<(Changes, Arc<Loaded>)>>,
}

impl DescribedScene {
    /// Loads the scene of a file.
    ///
    /// # Errors
    ///
    /// All errors of the scene.
    pub(crate) fn load(path: &Path, options: LoadOptions) -> Result<Self, Diagnostics> {
        let options = LoadOptions {
            keeps_parts: true,
            ..options
        };
        let (loaded, description) = io::load_described_scene(path, &options)?;
        Ok(DescribedScene {
            loaded: Arc::new(loaded),
            description,
            options,
            last: Mutex::new(None),
        })
    }

    /// Lists the parameters that a page can change, with the values of the file: name and value.
    pub(crate) fn changeable(&self) -> Vec<Json> {
        let all = parameters(&self.description).into_iter();
        let listed = all.filter_map(|parameter| {
            let value = value(&parameter)?;
            Some(json!({"name": parameter.name, "value": value}))
        });
        listed.collect()
    }

    /// Returns the scene with other values of parameters.
    ///
    /// # Errors
    ///
    /// The first problem with the values, for the reader of the page.
    pub(crate) fn with(&self, changes: &Changes) -> Result<Arc<Loaded>, String> {
        if changes.is_empty() {
            return Ok(self.loaded.clone());
        }
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((known, loaded)) = &*last
            && known == changes
        {
            return Ok(loaded.clone());
        }
        let loaded = Arc::new(self.changed(changes)?);
        *last = Some((changes.clone(), loaded.clone()));
        // Planted error "pictures with the parameters of the file", found by morgana-view/served::parameters_change_pictures:
        // Ok(self.loaded.clone())
        Ok(loaded)
    }

    fn changed(&self, changes: &Changes) -> Result<Loaded, String> {
        let all = parameters(&self.description);
        let item = |(name, wanted): (&String, &Json)| -> Result<_, String> {
            let named = all.iter().find(|parameter| parameter.name == *name);
            let named = named.filter(|parameter| value(parameter).is_some());
            let parameter =
                named.ok_or_else(|| format!("{name}: a page cannot change this parameter"))?;
            let item = item_for(parameter, wanted)
                .ok_or_else(|| format!("{name}: expected a number, or three numbers"))?;
            Ok((name.clone(), item))
        };
        let items = changes.iter().map(item).collect::<Result<_, _>>()?;
        let mut diagnostics = Diagnostics::new();
        let described = with_values(&self.description, items, &mut diagnostics);
        let loaded = match described {
            Some((described, objects)) => {
                self.loaded
                    .with_changes(&described, &objects, &self.options, diagnostics)
            }
            None => Err(diagnostics),
        };
        loaded.map_err(|diagnostics| {
            let first = diagnostics.first_error();
            first.map(|one| one.message.clone()).unwrap_or_default()
        })
    }
}

/// Returns the value of a parameter that a page can change: a number, flag, colour or vector that the
/// file gives, except for sensors and integrators. The value of a transform is its translation.
fn value(parameter: &SceneParameter) -> Option<Json> {
    let is_light_or_matter = !matches!(
        parameter.owner,
        PluginKind::Sensor
            | PluginKind::Film
            | PluginKind::Sampler
            | PluginKind::Rfilter
            | PluginKind::Integrator
    );
    let Some(ParameterValue::Given(value)) = parameter.value.as_ref() else {
        return None;
    };
    let value = match value {
        Value::Float(v) => json!(v),
        Value::Integer(v) => json!(v),
        Value::Boolean(v) => json!(v),
        Value::Spectrum(SpectrumValue::Uniform(v)) => json!(v),
        Value::Spectrum(SpectrumValue::Rgb(v)) => json!(v),
        Value::Point(v) | Value::Vector(v) => json!(v.to_array()),
        Value::Transform(v) => json!(v.w_axis.truncate().to_array()),
        Value::Spectrum(_) | Value::String(_) | Value::Tensor(_) => return None,
    };
    is_light_or_matter.then_some(value)
}

/// Converts the value of a parameter. Three numbers replace the translation of a transform.
fn item_for(parameter: &SceneParameter, wanted: &Json) -> Option<Item> {
    let Some(ParameterValue::Given(Value::Transform(matrix))) = &parameter.value else {
        return item(wanted);
    };
    let place = <[f64; 3]>::deserialize(wanted).ok()?;
    let mut moved = *matrix;
    moved.w_axis = DVec3::from(place).extend(matrix.w_axis.w);
    let row = |i: usize| Item::Array(moved.row(i).to_array().map(Item::Float).to_vec());
    Some(Item::Array((0..4).map(row).collect()))
}

/// Converts a number, a flag, or a list of numbers.
fn item(value: &Json) -> Option<Item> {
    match value {
        Json::Bool(flag) => Some(Item::Boolean(*flag)),
        Json::Number(number) => match number.as_i64() {
            Some(whole) => Some(Item::Integer(whole)),
            None => number.as_f64().map(Item::Float),
        },
        Json::Array(items) if items.iter().all(Json::is_number) => {
            let items: Option<Vec<Item>> = items.iter().map(item).collect();
            items.map(Item::Array)
        }
        _ => None,
    }
}
