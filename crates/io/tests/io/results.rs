//! Results of small renders by all estimators. Every checkpoint and shard stores their version, so
//! that parts of different builds are not added up. A change of results is no mistake, but must not
//! pass unnoticed: set [`RESULTS`] to the value that this test prints, and give the reason.
//!
//! Values are compared to five digits, so that nothing depends on the last bits of a processor's
//! arithmetic.

use morgana_io::{Diagnostics, LoadOptions, Loaded, xml};
use std::ops::ControlFlow;
use transport::meter::Meter;
use transport::render::{Handle, MeasureOptions, RESULTS, RenderOptions, measure, render};

/// A lens of fog, a glass ball and a wall, in front of a light of each kind.
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

/// A light in a ball of haze, with a meter of a kind.
fn meter(kind: &str) -> String {
    let [inside, on_the_wall] = match kind {
        "fluence" => [
            r#"<sensor type="fluencemeter" id="cells"><integer name="nx" value="2"/><integer name="ny" value="2"/><integer name="nz" value="2"/></sensor>"#,
            "",
        ],
        _ => ["", r#"<sensor type="irradiancemeter" id="wall"/>"#],
    };
    format!(
        r#"<scene version="3.0.0">
  <integrator type="particle"/>
  <emitter type="point"><point name="position" x="0.3" y="0" z="0"/><rgb name="intensity" value="1, 2, 3"/></emitter>
  {inside}
  <shape type="sphere"><bsdf type="diffuse"/>{on_the_wall}
    <medium type="homogeneous" name="interior"><float name="sigma_t" value="2"/><float name="albedo" value="0.8"/></medium>
  </shape>
</scene>"#
    )
}

fn load(text: &str, options: &LoadOptions) -> Loaded {
    let mut diagnostics = Diagnostics::new();
    let scene = xml::parse(text, "scene.xml", &[], &mut diagnostics);
    let scene = scene.unwrap_or_else(|| panic!("{diagnostics}"));
    morgana_io::assemble(&scene, options, diagnostics).unwrap_or_else(|e| panic!("{e}"))
}

/// Returns the beginning of a hash of numbers, to five digits.
fn fingerprint<'a>(values: impl Iterator<Item = &'a f64>) -> String {
    let mut hash = blake3::Hasher::new();
    for value in values {
        hash.update(format!(" {value:.4e}").as_bytes());
    }
    hash.finalize().to_hex()[..16].to_owned()
}

fn picture(integrator: &str) -> String {
    let options = LoadOptions {
        integrator: Some(integrator.to_owned()),
        ..LoadOptions::default()
    };
    let loaded = load(SCENE, &options);
    let options = RenderOptions::new(loaded.renderer, loaded.samples, 7);
    let rendering = render(&loaded.groups, &options, |_| ControlFlow::Continue(()));
    let mean: Vec<f64> = rendering.film.mean().into_iter().map(f64::from).collect();
    fingerprint(mean.iter())
}

/// Returns means and errors of the only meter of a scene.
fn readings(text: &str) -> String {
    let loaded = load(text, &LoadOptions::default());
    let meters: Vec<Meter> = loaded.instruments.iter().map(|i| i.meter.clone()).collect();
    assert_eq!(meters.len(), 1);
    let options = MeasureOptions {
        first: 0,
        particles: 200,
        seed: 7,
        max_depth: None,
        rr_depth: 5,
    };
    let go_on = |_| ControlFlow::Continue(());
    let measurement = measure(&loaded.groups, &meters, &options, &Handle::default(), go_on);
    let measurement = measurement.unwrap();
    let readings = measurement.readings.iter().flatten();
    let values: Vec<f64> = readings
        .flat_map(|reading| reading.mean.iter().chain(&reading.error).copied())
        .collect();
    fingerprint(values.iter())
}

#[test]
fn results_that_change_are_told_apart() {
    let found = RESULTS.map(|(name, known)| {
        let found = match name {
            "fluence" | "irradiance" => readings(&meter(name)),
            _ => picture(name),
        };
        (name, known, found)
    });
    let changed: Vec<_> = found
        .iter()
        .filter(|(_, known, new)| known != new)
        .collect();
    assert!(
        changed.is_empty(),
        "results have changed (name, before, now): {changed:?}. If they should have, write the last into \
         transport/src/render/results.rs"
    );
}
