//! Shorthands for reading scenes in tests, and the inputs of property tests.

use std::ops::ControlFlow;
use std::sync::Arc;

use morgana_io::scene::Value;
use morgana_io::{
    Diagnostic, Diagnostics, LoadOptions, Loaded, ObjectDescription, PluginKind, SceneDescription,
    json, xml,
};
use proptest::test_runner::{Config, RngSeed};
use transport::meter::Meter;
use transport::render::{Handle, MeasureError, MeasureOptions, Measurement, measure};

/// Configuration of property tests: always 1000 equal inputs, so that a change cannot fail on parts
/// that it did not touch; under `MORGANA_LONG_TESTS` 50 000 new random inputs.
pub fn inputs() -> Config {
    let long = std::env::var_os("MORGANA_LONG_TESTS").is_some();
    let (cases, rng_seed) = if long {
        (50_000, RngSeed::Random)
    } else {
        (1000, RngSeed::Fixed(1))
    };
    Config {
        cases,
        rng_seed,
        failure_persistence: None,
        ..Config::default()
    }
}

/// Reads a scene with the given contents; panics if there is any message.
pub fn read(contents: &str) -> SceneDescription {
    let mut diagnostics = Diagnostics::new();
    let text = format!("<scene version='3.0.0'>{contents}</scene>");
    let scene = xml::parse(&text, "scene.xml", &[], &mut diagnostics);
    assert!(diagnostics.is_empty(), "{diagnostics}");
    scene.expect("no error")
}

/// Reads a scene of one object.
pub fn object(text: &str) -> Arc<ObjectDescription> {
    Arc::clone(&read(text).root.children[0].object)
}

/// The messages for a scene file; panics if there is none.
pub fn messages(text: &str) -> Vec<Diagnostic> {
    let mut diagnostics = Diagnostics::new();
    assert!(xml::parse(text, "scene.xml", &[], &mut diagnostics).is_none());
    let messages: Vec<_> = diagnostics.iter().cloned().collect();
    assert!(!messages.is_empty());
    messages
}

/// The value of a property.
pub fn value<'a>(object: &'a ObjectDescription, name: &str) -> &'a Value {
    let property = object.properties.iter().find(|p| p.name == name);
    &property.expect("the property is there").value
}

/// The first child of a kind.
pub fn child(object: &ObjectDescription, kind: PluginKind) -> &Arc<ObjectDescription> {
    let child = object.children.iter().find(|c| c.object.kind == kind);
    &child.expect("the child is there").object
}

/// Assembles a scene in JSON that needs no files beside it.
pub fn load_json(scene: &serde_json::Value) -> Result<Loaded, Diagnostics> {
    let mut diagnostics = Diagnostics::new();
    let text = scene.to_string();
    let description = json::parse(&text, "scene.json", &[], &mut diagnostics);
    let description = description.ok_or_else(|| diagnostics.clone())?;
    morgana_io::assemble(&description, &LoadOptions::default(), diagnostics)
}

/// Measures a scene in JSON; panics if it has an error.
pub fn measure_json(scene: &serde_json::Value, particles: u64, seed: u64) -> Measurement {
    let loaded = load_json(scene).unwrap_or_else(|problems| panic!("{problems}"));
    measured(&loaded, particles, seed).unwrap()
}

/// Measures a scene by its meters.
pub fn measured(loaded: &Loaded, particles: u64, seed: u64) -> Result<Measurement, MeasureError> {
    let meters: Vec<Meter> = loaded.instruments.iter().map(|i| i.meter.clone()).collect();
    let options = MeasureOptions {
        first: 0,
        particles,
        seed,
        max_depth: None,
        rr_depth: 5,
    };
    let go_on = |_| ControlFlow::Continue(());
    measure(&loaded.groups, &meters, &options, &Handle::default(), go_on)
}
