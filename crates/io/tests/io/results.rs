//! Small renders by all estimators: what they give is part of every checkpoint and shard, lest parts of different builds be added
//! up. A change of results is no mistake, but must not go unnoticed: set [`RESULTS`] to what this test says.
//!
//! Values count to five digits, so that nothing depends on the last bits of a processor's arithmetic.

use morgana_io::{Diagnostics, LoadOptions, Loaded, xml};
use std::ops::ControlFlow;
use transport::meter::Meter;
use transport::render::{Handle, MeasureOptions, MeasureState, RESULTS, RenderOptions, render};

/// A lens of fog, a ball of glass and a wall, before a light of each kind.
const SCENE: &str = r#"<scene version="3.0.0">
  <integrator type="path"/>
  <sensor type="perspective"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0,0,-5" target="0,0,0" up="0,1,0"/></transform>
    <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="3"/></film>
    <sampler type="independent"><integer name="sample_count" value="8"/></sampler>
  </sensor>
  <emitter type="constant"><rgb name="radiance" value="0.2, 0.4, 0.8"/></emitter>
  <emitter type="point"><point name="position" x="2" y="3" z="-3"/><rgb name="intensity" value="20, 15, 10"/></emitter>
  <shape type="sphere"><bsdf type="null"/>
    <medium type="homogeneous" name="interior">
      <float name="sigma_t" value="0.7"/><float name="albedo" value="0.9"/>
      <phase type="hg"><float name="g" value="0.4"/></phase>
      <volume name="ior" type="gaussian"><float name="n0" value="1"/><float name="delta" value="0.1"/>
        <float name="width" value="0.4"/></volume>
    </medium>
  </shape>
  <shape type="sphere"><point name="center" x="1.2" y="-0.5" z="-1"/><float name="radius" value="0.5"/>
    <bsdf type="dielectric"><float name="int_ior" value="1.5"/></bsdf></shape>
  <shape type="rectangle"><transform name="to_world"><scale value="4"/><rotate y="1" angle="180"/><translate x="0" y="0" z="2"/></transform>
    <bsdf type="roughconductor"><string name="distribution" value="ggx"/><float name="alpha" value="0.3"/></bsdf></shape>
  <shape type="sphere"><point name="center" x="-1.5" y="1" z="0"/><float name="radius" value="0.3"/>
    <emitter type="area"><rgb name="radiance" value="3, 4, 5"/></emitter></shape>
</scene>"#;

const METERS: &str = r#"<scene version="3.0.0">
  <integrator type="particle"/>
  <emitter type="point"><point name="position" x="0.3" y="0" z="0"/><rgb name="intensity" value="1, 2, 3"/></emitter>
  <shape type="sphere"><bsdf type="diffuse"/><sensor type="irradiancemeter" id="wall"/>
    <medium type="homogeneous" name="interior"><float name="sigma_t" value="2"/><float name="albedo" value="0.8"/></medium>
  </shape>
</scene>"#;

fn load(text: &str, options: &LoadOptions) -> Loaded {
    let mut diagnostics = Diagnostics::new();
    let scene = xml::parse(text, "scene.xml", &[], &mut diagnostics);
    let scene = scene.unwrap_or_else(|| panic!("{diagnostics}"));
    morgana_io::assemble(&scene, options, diagnostics).unwrap_or_else(|e| panic!("{e}"))
}

/// Adds numbers to a hash, to five digits.
fn add<'a>(hash: &mut blake3::Hasher, what: &str, values: impl Iterator<Item = &'a f64>) {
    hash.update(what.as_bytes());
    for value in values {
        hash.update(format!(" {value:.4e}").as_bytes());
    }
}

fn picture(hash: &mut blake3::Hasher, integrator: &str) {
    let options = LoadOptions {
        integrator: Some(integrator.to_owned()),
        ..LoadOptions::default()
    };
    let loaded = load(SCENE, &options);
    let options = RenderOptions::new(loaded.renderer, loaded.samples, 7);
    let rendering = render(&loaded.groups, &options, |_| ControlFlow::Continue(()));
    let mean: Vec<f64> = rendering.film.mean().into_iter().map(f64::from).collect();
    add(hash, integrator, mean.iter());
}

fn readings(hash: &mut blake3::Hasher) {
    let loaded = load(METERS, &LoadOptions::default());
    let meters: Vec<Meter> = loaded.instruments.iter().map(|i| i.meter.clone()).collect();
    let options = MeasureOptions {
        first: 0,
        particles: 200,
        seed: 7,
        max_depth: None,
        rr_depth: 5,
    };
    let mut state = MeasureState::new(&loaded.groups, &meters).unwrap();
    let handle = Handle::default();
    state
        .advance(&loaded.groups, &meters, &options, &handle, |_| {
            ControlFlow::Continue(())
        })
        .unwrap();
    let measurement = state.into_measurement(&loaded.groups, &meters).unwrap();
    for reading in measurement.readings.iter().flatten() {
        add(
            hash,
            &reading.name,
            reading.mean.iter().chain(&reading.error),
        );
    }
}

#[test]
fn results_that_change_are_told_apart() {
    let mut hash = blake3::Hasher::new();
    for integrator in ["path", "particle", "bdpt", "vcm", "photon", "sppm"] {
        picture(&mut hash, integrator);
    }
    readings(&mut hash);
    let found = &hash.finalize().to_hex()[..16];
    assert_eq!(
        found, RESULTS,
        "results have changed: if they should have, set RESULTS in transport/src/render/results.rs to \"{found}\""
    );
}
