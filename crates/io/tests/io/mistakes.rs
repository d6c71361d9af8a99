//! Scenes with random mistakes give an error or an image, without a panic or hang.

use crate::common;
use morgana_io::schema::{self, Parameter, Slot, Type};
use morgana_io::{Diagnostics, LoadOptions, Loaded, PluginKind, json, xml};
use proptest::prelude::*;
use proptest::sample::Index;
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use transport::meter::Meter;
use transport::render::{Handle, MeasureOptions, RenderOptions, measure, memory, render};

/// Memory limit of rendered images; larger ones are skipped.
const MAX_MEMORY: usize = 1 << 20;

/// A valid scene, and the file that its relative paths start from.
struct Example {
    path: PathBuf,
    scene: Value,
}

/// The scenes of the project, with few pixels and short paths.
static EXAMPLES: LazyLock<Vec<Example>> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths: Vec<PathBuf> = ["tests/data", "../../scenes"]
        .iter()
        .flat_map(|f| std::fs::read_dir(folder.join(f)).unwrap())
        .map(|f| f.unwrap().path())
        .filter(|f| f.extension().is_some_and(|e| e == "xml"))
        .collect();
    paths.sort();
    paths.into_iter().map(example).collect()
});

fn example(path: PathBuf) -> Example {
    let description = xml::load(&path, &[], &mut Diagnostics::new()).unwrap();
    let mut scene: Value = json::write(&description).parse().unwrap();
    for place in places(&scene) {
        let object = scene.pointer_mut(&place).unwrap();
        if object["type"] == "hdrfilm" {
            object["width"] = 7.into();
            object["height"] = 5.into();
        }
        if place == "/integrator" {
            object["max_depth"] = 6.into();
        }
    }
    Example { path, scene }
}

/// JSON pointers to all values.
fn places(value: &Value) -> Vec<String> {
    let mut all = vec![String::new()];
    let mut below = |key: &str, child: &Value| {
        all.extend(places(child).into_iter().map(|p| format!("/{key}{p}")));
    };
    match value {
        Value::Object(entries) => entries.iter().for_each(|(key, child)| below(key, child)),
        Value::Array(items) => {
            for (i, child) in items.iter().enumerate() {
                below(&i.to_string(), child);
            }
        }
        _ => {}
    }
    all
}

/// A mistake: its kind, place, and content.
#[derive(Clone, Debug)]
struct Mistake {
    sort: Sort,
    at: Index,
    what: Index,
    value: Index,
}

#[derive(Clone, Copy, Debug)]
enum Sort {
    /// Replaces a number.
    Number,
    /// Omits a value.
    Omission,
    /// Copies a value from elsewhere in the scene.
    Copy,
    /// Adds a parameter of the plugin.
    Parameter,
    /// Replaces a plugin by another of its kind.
    Plugin,
    /// Adds a child that the plugin accepts.
    Child,
}

fn mistakes() -> impl Strategy<Value = Vec<Mistake>> {
    let sorts = [
        Sort::Number,
        Sort::Omission,
        Sort::Copy,
        Sort::Parameter,
        Sort::Plugin,
        Sort::Child,
    ];
    let sort = prop::sample::select(sorts.to_vec());
    let index = any::<Index>;
    let mistake = (sort, index(), index(), index()).prop_map(|(sort, at, what, value)| Mistake {
        sort,
        at,
        what,
        value,
    });
    prop::collection::vec(mistake, 1..4)
}

const NUMBERS: [f64; 22] = [
    0.0, -0.0, 1.0, -1.0, 0.5, 2.0, 3.0, 1.5, -0.3, 90.0, 180.0, 1e-3, 1e-9, 1e-30, 1e-300, -1e-6,
    100.0, 1e4, 1e9, 1e30, 1e300, -1e300,
];

fn number(value: Index) -> Value {
    let number = *value.get(&NUMBERS);
    if number.fract() == 0.0 && number.abs() < 1e15 {
        Value::from(number as i64)
    } else {
        Value::from(number)
    }
}

impl Mistake {
    /// Applies the mistake, if there is a place for it.
    fn make(&self, scene: &mut Value) {
        let all = places(scene);
        let fits = |place: &&String| {
            let value = scene.pointer(place).unwrap();
            match self.sort {
                Sort::Number => value.is_number(),
                Sort::Omission | Sort::Copy => !place.is_empty(),
                Sort::Plugin => {
                    value.is_object() && !place.is_empty() && value.get("type").is_some()
                }
                Sort::Parameter | Sort::Child => value.get("type").is_some(),
            }
        };
        let all: Vec<&String> = all.iter().filter(fits).collect();
        if all.is_empty() {
            return;
        }
        let place = self.at.get(&all).to_string();
        match self.sort {
            Sort::Number => *scene.pointer_mut(&place).unwrap() = number(self.value),
            Sort::Copy => {
                let other = self.what.get(&all).as_str();
                let value = scene.pointer(other).unwrap().clone();
                *scene.pointer_mut(&place).unwrap() = value;
            }
            Sort::Omission => omit(scene, &place),
            Sort::Parameter => self.parameter(scene.pointer_mut(&place).unwrap()),
            Sort::Plugin => self.plugin(scene.pointer_mut(&place).unwrap()),
            Sort::Child => self.child(scene.pointer_mut(&place).unwrap()),
        }
    }

    fn parameter(&self, object: &mut Value) {
        let plugins = plugins(object);
        let all: Vec<&Parameter> = plugins.iter().flat_map(|p| p.parameters()).collect();
        if all.is_empty() {
            return;
        }
        let parameter = *self.what.get(&all);
        object[parameter.name] = match parameter.value {
            Type::Boolean => (self.value.index(2) == 0).into(),
            Type::Word(words) | Type::NumberOrWord(words) => (*self.value.get(words)).into(),
            Type::Point | Type::Vector => {
                json!([number(self.value), number(self.at), number(self.what)])
            }
            Type::Transform => {
                json!([{"scale": number(self.value)}, {"translate": [number(self.at), 0, 1]}])
            }
            Type::Text => "".into(),
            Type::List => "path,bdpt".into(),
            _ => number(self.value),
        };
    }

    fn plugin(&self, object: &mut Value) {
        let name = object["type"].as_str().unwrap_or_default().to_owned();
        let all: Vec<&str> = schema::kinds(&name)
            .flat_map(schema::plugins)
            .map(|p| p.name)
            .collect();
        if !all.is_empty() {
            object["type"] = (*self.value.get(&all)).into();
        }
    }

    fn child(&self, object: &mut Value) {
        let plugins = plugins(object);
        let slots: Vec<&Slot> = plugins.iter().flat_map(|p| p.children()).collect();
        if slots.is_empty() {
            return;
        }
        let slot = *self.what.get(&slots);
        let all = schema::plugins(slot.kind);
        if all.is_empty() {
            return;
        }
        object[slot.role.unwrap_or("new")] = json!({"type": self.value.get(all).name});
    }
}

/// Plugins that an object may have.
fn plugins(object: &Value) -> Vec<&'static schema::Plugin> {
    match object["type"].as_str() {
        Some("scene") => schema::plugins(PluginKind::Scene).iter().collect(),
        Some(name) => schema::kinds(name)
            .filter_map(|kind| schema::find(kind, name))
            .collect(),
        None => Vec::new(),
    }
}

fn omit(scene: &mut Value, place: &str) {
    let (parent, key) = place.rsplit_once('/').unwrap();
    match scene.pointer_mut(parent).unwrap() {
        Value::Object(entries) => drop(entries.remove(key)),
        Value::Array(items) => drop(items.remove(key.parse().unwrap())),
        _ => {}
    }
}

/// Reads a scene in the place of an example, and renders or measures a little. Returns true if that
/// is possible.
fn exercise(example: &Example, scene: &Value, integrator: Option<&str>) -> bool {
    let mut diagnostics = Diagnostics::new();
    let text = scene.to_string();
    let description = json::parse(&text, &example.path, &[], &mut diagnostics);
    assert_eq!(description.is_none(), diagnostics.has_errors());
    let options = LoadOptions {
        integrator: integrator.map(str::to_owned),
        ..LoadOptions::default()
    };
    let Some(description) = description else {
        return false;
    };
    let assembled = morgana_io::assemble(&description, &options, diagnostics);
    match &assembled {
        Err(diagnostics) => assert!(diagnostics.has_errors(), "{diagnostics}"),
        Ok(loaded) if loaded.instruments.is_empty() => photograph(loaded),
        Ok(loaded) => read_meters(loaded),
    }
    assembled.is_ok()
}

/// Renders an image, if it is small.
fn photograph(loaded: &Loaded) {
    let options = RenderOptions {
        adaptive: loaded.adaptive,
        reweight: loaded.reweight,
        decomposition: loaded.layering.decomposition,
        ..RenderOptions::new(loaded.renderer, 2, 1)
    };
    if memory(loaded.scene(), &options) > MAX_MEMORY {
        return;
    }
    let rendering = render(&loaded.groups, &options, |_| ControlFlow::Continue(()));
    assert!(rendering.film.mean().iter().all(|v| v.is_finite()));
}

fn read_meters(loaded: &Loaded) {
    let meters: Vec<Meter> = loaded.instruments.iter().map(|i| i.meter.clone()).collect();
    let (max_depth, rr_depth) = loaded.renderer.depths();
    let options = MeasureOptions {
        first: 0,
        particles: 500,
        seed: 1,
        max_depth,
        rr_depth,
    };
    let go_on = |_| ControlFlow::Continue(());
    let measured = measure(&loaded.groups, &meters, &options, &Handle::default(), go_on);
    let readings = measured.iter().flat_map(|m| m.readings.iter().flatten());
    for reading in readings {
        assert!(
            reading.mean.iter().all(|v| v.is_finite()),
            "{}",
            reading.name
        );
    }
}

/// The integrator of the scene, or another one.
fn integrators() -> impl Strategy<Value = Option<&'static str>> {
    let all = schema::plugins(PluginKind::Integrator).iter();
    let others = prop::sample::select(all.map(|plugin| plugin.name).collect::<Vec<_>>());
    prop_oneof![1 => Just(None), 1 => others.prop_map(Some)]
}

#[test]
fn the_examples_are_valid() {
    for example in EXAMPLES.iter() {
        assert!(
            exercise(example, &example.scene, None),
            "{}",
            example.path.display()
        );
    }
}

proptest! {
    // A scene takes a hundred times as long as a text.
    #![proptest_config(ProptestConfig { cases: common::inputs().cases / 5, ..common::inputs() })]

    #[test]
    fn mistakes_do_no_harm(which: Index, mistakes in mistakes(), integrator in integrators()) {
        let example = which.get(&EXAMPLES);
        let mut scene = example.scene.clone();
        for mistake in &mistakes {
            mistake.make(&mut scene);
        }
        exercise(example, &scene, integrator);
    }
}
