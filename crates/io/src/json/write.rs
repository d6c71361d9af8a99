//! Writing scene descriptions as JSON.

use super::keys::{self, ID, PARAMETERS, SCHEMA, TYPE};
use crate::scene::{
    ObjectDescription, ObjectId, PluginKind, SceneDescription, SpectrumValue, Value,
};
use std::collections::{BTreeSet, HashMap, HashSet};

/// Converts a scene to JSON. The JSON reads as an equal scene with an equal hash. Roles of the
/// scene's own children, which have no effect, are left out. Names of data files stay relative to
/// the folder of the original scene; the folders that the scene searches are left out.
pub fn write(scene: &SceneDescription) -> String {
    let children = &scene.root.children;
    let mut writer = Writer {
        out: String::new(),
        top: children.iter().map(|child| child.object.number).collect(),
        written: HashSet::new(),
    };
    writer.root(&scene.root);
    writer.out
}

struct Writer {
    out: String,
    /// Children of the scene itself. Other objects refer to them.
    top: HashSet<ObjectId>,
    written: HashSet<ObjectId>,
}

impl Writer {
    fn root(&mut self, root: &ObjectDescription) {
        self.out.push_str("{\n  \"type\": \"scene\"");
        self.properties(root, 1);
        let mut keys = Keys::new(root);
        for child in &root.children {
            let object = &*child.object;
            let is_new = self.written.insert(object.number);
            // A name may replace the kind as a key if the type determines the kind.
            let tells = |id: &str| {
                let kind = keys::infer(root.kind, &root.plugin, id, &object.plugin);
                kind.is_ok_and(|kind| kind == object.kind)
            };
            let id = object.id.as_deref().filter(|id| is_new && tells(id));
            match id.filter(|id| keys.take(id)) {
                Some(id) => self.object(id, object, false, 1),
                None => {
                    let key = keys.fresh(object.kind);
                    if is_new {
                        self.object(&key, object, true, 1)
                    } else {
                        self.reference(&key, object, 1)
                    }
                }
            }
        }
        self.out.push_str("\n}\n");
    }

    fn object(&mut self, key: &str, object: &ObjectDescription, with_id: bool, depth: usize) {
        self.key(key, depth);
        self.out.push_str("{\n");
        self.out.push_str(&"  ".repeat(depth + 1));
        self.out
            .push_str(&format!("\"{TYPE}\": {}", text(&object.plugin)));
        if let Some(id) = object.id.as_deref().filter(|_| with_id) {
            self.key(ID, depth + 1);
            self.out.push_str(&text(id));
        }
        self.properties(object, depth + 1);
        let mut keys = Keys::new(object);
        for child in &object.children {
            let key = child.name.clone();
            let key = key.unwrap_or_else(|| keys.fresh(child.object.kind));
            let above = self.top.contains(&child.object.number);
            let again = above || !self.written.insert(child.object.number);
            if again && child.object.id.is_some() {
                self.reference(&key, &child.object, depth + 1)
            } else {
                self.object(&key, &child.object, true, depth + 1)
            }
        }
        self.out.push('\n');
        self.out.push_str(&"  ".repeat(depth));
        self.out.push('}');
    }

    fn reference(&mut self, key: &str, object: &ObjectDescription, depth: usize) {
        self.key(key, depth);
        let id = text(object.id.as_deref().unwrap_or_default());
        self.out
            .push_str(&format!("{{\"{TYPE}\": \"ref\", \"{ID}\": {id}}}"));
    }

    fn properties(&mut self, object: &ObjectDescription, depth: usize) {
        for property in &object.properties {
            self.key(&property.name, depth);
            self.out.push_str(&value(&property.value));
        }
    }

    /// Starts another key of an object, which already has its type.
    fn key(&mut self, key: &str, depth: usize) {
        self.out.push_str(",\n");
        self.out.push_str(&"  ".repeat(depth));
        self.out.push_str(&format!("{}: ", text(key)));
    }
}

/// Keys of an object.
struct Keys {
    taken: BTreeSet<String>,
    /// Number of keys that are only a kind, by kind.
    counts: HashMap<PluginKind, usize>,
}

impl Keys {
    /// Reserves the names of parameters and roles, and keys with another meaning.
    fn new(object: &ObjectDescription) -> Self {
        let reserved = [TYPE, ID, PARAMETERS, SCHEMA].map(str::to_owned);
        let properties = object.properties.iter().map(|p| p.name.clone());
        let roles = object.children.iter().filter_map(|c| c.name.clone());
        Keys {
            taken: reserved
                .into_iter()
                .chain(properties)
                .chain(roles)
                .collect(),
            counts: HashMap::new(),
        }
    }

    /// Reserves a name, if it is free and not just a kind. Returns true on success.
    fn take(&mut self, name: &str) -> bool {
        PluginKind::of_key(name).is_none() && self.taken.insert(name.to_owned())
    }

    /// Reserves a key that is only a kind, with a number if necessary.
    fn fresh(&mut self, kind: PluginKind) -> String {
        loop {
            let count = self.counts.entry(kind).or_default();
            *count += 1;
            let key = match count {
                1 => kind.tag().to_owned(),
                count => format!("{kind}_{count}"),
            };
            if self.taken.insert(key.clone()) {
                return key;
            }
        }
    }
}

fn value(value: &Value) -> String {
    match value {
        Value::Float(v) => number(*v),
        Value::Integer(v) => v.to_string(),
        Value::Boolean(v) => v.to_string(),
        Value::String(v) => text(v),
        Value::Spectrum(spectrum) => self::spectrum(spectrum),
        Value::Point(v) | Value::Vector(v) => numbers(&v.to_array()),
        Value::Transform(matrix) => {
            let rows = [0, 1, 2, 3].map(|i| numbers(&matrix.row(i).to_array()));
            array(rows)
        }
        Value::Tensor(tensor) => nested(tensor.shape(), &mut tensor.iter()),
    }
}

fn spectrum(value: &SpectrumValue) -> String {
    let of_type = |word: &str, key: &str, value: &str| {
        format!("{{\"{TYPE}\": \"{word}\", \"{key}\": {value}}}")
    };
    match value {
        SpectrumValue::Uniform(v) => number(*v),
        SpectrumValue::EqualEnergy(v) => of_type("spectrum", "value", &number(*v)),
        SpectrumValue::Rgb(rgb) => of_type("rgb", "value", &numbers(rgb)),
        SpectrumValue::Sampled(pairs) => {
            let pairs = pairs.iter().map(|(w, v)| numbers(&[*w, *v]));
            of_type("spectrum", "value", &array(pairs))
        }
        SpectrumValue::File(name) => of_type("spectrum", "filename", &text(name)),
        SpectrumValue::D65(scale) => of_type("d65", "scale", &number(*scale)),
        SpectrumValue::Blackbody {
            temperature,
            scale,
            range: [min, max],
        } => {
            let [t, scale, min, max] = [*temperature, *scale, *min, *max].map(number);
            format!(
                "{{\"{TYPE}\": \"blackbody\", \"temperature\": {t}, \"scale\": {scale}, \"wavelength_min\": {min}, \"wavelength_max\": {max}}}"
            )
        }
    }
}

fn text(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// Returns the shortest text that reads as the same number.
fn number(v: f64) -> String {
    match v as i64 {
        whole if whole as f64 == v => whole.to_string(),
        _ => format!("{v:?}"),
    }
}

fn numbers(values: &[f64]) -> String {
    array(values.iter().map(|v| number(*v)))
}

/// Converts an array to nested lists.
fn nested(shape: &[usize], numbers: &mut impl Iterator<Item = f64>) -> String {
    match shape {
        [] => number(numbers.next().unwrap_or_default()),
        [count, rest @ ..] => array((0..*count).map(|_| nested(rest, numbers))),
    }
}

fn array(items: impl IntoIterator<Item = String>) -> String {
    let items: Vec<String> = items.into_iter().collect();
    format!("[{}]", items.join(", "))
}
