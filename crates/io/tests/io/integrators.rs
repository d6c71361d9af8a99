//! Integrators of scene files: names, parameters, and warnings.

use morgana_io::{LoadOptions, Loaded};
use std::fs;
use transport::integrator::{
    Bdpt, Connections, Heuristic, Integrator, ParticleTracer, PathTracer, PhotonMapping,
    PhotonQuery, Vcm,
};

const CAMERA: &str = r#"<sensor type="perspective"><float name="fov" value="40"/>
  <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
</sensor>"#;
const LIGHT: &str = r#"<emitter type="point"><point name="position" value="0, 3, 0"/>
  <float name="intensity" value="1"/></emitter>"#;
const SKY: &str = r#"<emitter type="constant"/>"#;
const GLASS: &str = r#"<shape type="sphere" id="glass"><bsdf type="dielectric"/></shape>"#;
const METAL: &str = r#"<shape type="sphere" id="metal"><bsdf type="conductor"/></shape>"#;

fn load(body: &str, integrator: Option<&str>) -> Result<Loaded, String> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scene.xml");
    // The given contents begin on line 4.
    let text = format!("<scene version=\"3.0.0\">{CAMERA}\n{body}</scene>");
    fs::write(&path, text).unwrap();
    let options = LoadOptions {
        integrator: integrator.map(str::to_owned),
        ..LoadOptions::default()
    };
    morgana_io::load_scene(&path, &options).map_err(|d| d.to_string())
}

fn accepted(body: &str, integrator: Option<&str>) -> Loaded {
    load(body, integrator).unwrap_or_else(|e| panic!("{e}"))
}

#[track_caller]
/// Returns the estimator of a scene that renders light.
fn light(loaded: &Loaded) -> Integrator {
    *loaded.renderer.integrator().unwrap()
}

fn refused(body: &str, integrator: Option<&str>, expected: &[&str]) {
    let message = load(body, integrator).expect_err("the scene was accepted");
    for part in expected {
        assert!(message.contains(part), "expected {part:?} in:\n{message}");
    }
}

fn integrator(kind: &str, parameters: &str) -> String {
    format!("<integrator type=\"{kind}\">{parameters}</integrator>{SKY}")
}

/// Returns the names of the estimators among which a pilot chooses.
fn candidates(loaded: &Loaded) -> Vec<&'static str> {
    loaded.candidates.iter().map(Integrator::name).collect()
}

/// Estimators that miss light are no candidates, unless all do.
#[test]
fn auto_chooses_among_those_that_find_all_light() {
    let auto = r#"<integrator type="auto"><integer name="max_depth" value="7"/></integrator>"#;
    let matched = r#"<integrator type="auto"><integer name="reflections" value="1"/></integrator>"#;
    let of = |parts: &[&str]| accepted(&parts.concat(), None);
    for (parts, expected, warns) in [
        (&[SKY][..], &["path", "particle", "bdpt"][..], false),
        (&[SKY, GLASS], &["path", "bdpt"], false),
        (&[SKY, GLASS, matched], &["path", "particle", "bdpt"], false),
        (&[LIGHT, METAL], &["bdpt"], true),
    ] {
        let loaded = of(parts);
        assert_eq!(loaded.integrator(), "auto", "{parts:?}");
        assert_eq!(candidates(&loaded), expected, "{parts:?}");
        assert_eq!(light(&loaded).name(), expected[0]);
        let message = loaded.warnings.to_string();
        assert_eq!(message.contains("is missing"), warns, "{message}");
    }
    let loaded = of(&[SKY, auto]);
    assert!(loaded.candidates.iter().all(|i| i.depths().0 == Some(7)));
    // A named integrator leaves no choice, and the caller's name takes precedence.
    assert!(candidates(&accepted(SKY, Some("path"))).is_empty());
    let path = integrator("path", "");
    assert!(candidates(&accepted(&path, None)).is_empty());
    assert_eq!(candidates(&accepted(&path, Some("auto"))).len(), 3);
    let named = accepted(&path, None).renderer_named("auto").unwrap();
    assert_eq!(named.candidates.len(), 3);
}

/// Samples are distributed evenly if no sampler is named and there are enough of them to estimate
/// the error.
#[test]
fn many_samples_are_spread_evenly() {
    let of = |body: &str, samples| {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("scene.xml");
        fs::write(
            &path,
            format!("<scene version=\"3.0.0\">{CAMERA}{body}</scene>"),
        )
        .unwrap();
        let options = LoadOptions {
            samples: Some(samples),
            ..LoadOptions::default()
        };
        let loaded = morgana_io::load_scene(&path, &options).unwrap();
        let replicates = loaded.replicates(loaded.samples);
        let even = loaded.renderer.replicates(replicates).size();
        (
            even,
            loaded.samples,
            loaded.warnings.to_string().contains("samples"),
        )
    };
    assert_eq!(of(SKY, 128), (8, 128, false));
    assert_eq!(of(SKY, 64), (4, 64, false));
    assert_eq!(of(SKY, 129), (1, 129, false));
    assert_eq!(of(&integrator("particle", ""), 128), (1, 128, false));
}

#[test]
fn every_name_has_its_estimator() {
    for (name, expected) in [
        ("path", "path"),
        ("volpath", "path"),
        ("volpathmis", "path"),
        ("particle", "particle"),
        ("ptracer", "particle"),
        ("bdpt", "bdpt"),
        ("vcm", "vcm"),
        ("aov", "aov"),
        ("photon", "photon"),
        ("sppm", "sppm"),
    ] {
        let loaded = accepted(&integrator(name, ""), None);
        assert_eq!(loaded.renderer.name(), expected);
        let loaded = accepted(SKY, Some(name));
        assert_eq!(loaded.renderer.name(), expected);
    }
}

#[test]
fn defaults_are_those_of_the_estimators() {
    let of = |name| light(&accepted(&integrator(name, ""), None));
    assert_eq!(of("path"), Integrator::Path(PathTracer::default()));
    assert_eq!(
        of("ptracer"),
        Integrator::Particle(ParticleTracer::default())
    );
    assert_eq!(of("bdpt"), Integrator::Bdpt(Bdpt::default()));
    let scene = accepted(&integrator("bdpt", ""), None);
    assert_eq!(scene.scene().branch_reach().reflections, 0);
}

const COMMON: &str = r#"<integer name="max_depth" value="7"/><integer name="rr_depth" value="3"/>
  <float name="tolerance" value="1e-8"/><integer name="reflections" value="2"/>"#;

#[test]
fn the_command_line_replaces_the_type_only() {
    let body = integrator("volpath", COMMON);
    for (name, expected) in [
        (
            "particle",
            Integrator::Particle(ParticleTracer {
                max_depth: Some(7),
                rr_depth: 3,
            }),
        ),
        (
            "bdpt",
            Integrator::Bdpt(Bdpt {
                max_depth: Some(7),
                rr_depth: 3,
                ..Bdpt::default()
            }),
        ),
    ] {
        let loaded = accepted(&body, Some(name));
        assert_eq!(light(&loaded), expected);
        assert_eq!(loaded.scene().tolerance().get(), 1e-8);
        assert_eq!(loaded.scene().branch_reach().reflections, 2);
    }
    let body = integrator(
        "bdpt",
        &format!("{COMMON}<string name=\"heuristic\" value=\"power\"/>"),
    );
    let path = PathTracer {
        max_depth: Some(7),
        rr_depth: 3,
    };
    let loaded = accepted(&body, Some("path"));
    assert_eq!(light(&loaded), Integrator::Path(path));
    assert!(loaded.warnings.is_empty(), "{}", loaded.warnings);
}

#[test]
fn choices_are_made_by_name() {
    let bdpt = |words: &str| match light(&accepted(&integrator("bdpt", words), None)) {
        Integrator::Bdpt(bdpt) => bdpt,
        other => panic!("{other:?}"),
    };
    assert_eq!(bdpt(""), Bdpt::default());
    for (name, expected) in [("power", Heuristic::Power), ("balance", Heuristic::Balance)] {
        let words = format!("<string name=\"heuristic\" value=\"{name}\"/>");
        assert_eq!(bdpt(&words).heuristic, expected);
    }
    for (name, expected) in [
        ("all", Connections::All),
        ("resampled", Connections::Resampled),
    ] {
        let words = format!("<string name=\"connections\" value=\"{name}\"/>");
        assert_eq!(bdpt(&words).connections, expected);
    }
    refused(
        &integrator("bdpt", "<string name=\"heuristic\" value=\"balanced\"/>"),
        None,
        &["scene.xml:4:", "did you mean 'balance'?"],
    );
    refused(
        &integrator("path", "<string name=\"heuristic\" value=\"power\"/>"),
        None,
        &["scene.xml:4:", "no parameter 'heuristic'"],
    );
}

#[test]
fn merging_has_parameters() {
    let vcm = |words: &str| match light(&accepted(&integrator("vcm", words), None)) {
        Integrator::Vcm(vcm) => vcm,
        other => panic!("{other:?}"),
    };
    assert_eq!(vcm(""), Vcm::default());
    let words = r#"<float name="radius" value="0.1"/><string name="heuristic" value="power"/>
      <string name="connections" value="all"/><integer name="max_depth" value="4"/>
      <integer name="rr_depth" value="3"/>"#;
    let expected = Vcm {
        max_depth: Some(4),
        rr_depth: 3,
        heuristic: Heuristic::Power,
        connections: Connections::All,
        radius: Some(0.1),
    };
    assert_eq!(vcm(words), expected);
    let bdpt = integrator("bdpt", r#"<float name="radius" value="0.1"/>"#);
    refused(&bdpt, None, &["scene.xml:4:", "no parameter 'radius'"]);
    let zero = integrator("vcm", r#"<float name="radius" value="0"/>"#);
    refused(&zero, None, &["must be greater than 0"]);
}

#[test]
fn photon_maps_have_parameters() {
    let photon = |kind: &str, words: &str| match light(&accepted(&integrator(kind, words), None)) {
        Integrator::Photon(photon) => photon,
        other => panic!("{other:?}"),
    };
    assert_eq!(photon("photon", ""), PhotonMapping::default());
    let words = r#"<integer name="photons" value="1000"/><float name="radius" value="0.1"/>
      <string name="query" value="point"/><integer name="max_depth" value="4"/>"#;
    assert_eq!(
        photon("sppm", words),
        PhotonMapping {
            photons: Some(1000),
            radius: Some(0.1),
            progressive: true,
            query: PhotonQuery::Point,
            max_depth: Some(4),
            rr_depth: 5,
        }
    );
    let words = r#"<integer name="photons" value="1000"/><float name="radius" value="0.1"/>"#;
    assert_eq!(
        photon("preview", words),
        PhotonMapping {
            photons: Some(1000),
            radius: Some(0.1),
            ..PhotonMapping::preview()
        }
    );
    let queried = integrator("preview", r#"<string name="query" value="beam"/>"#);
    refused(&queried, None, &["no parameter 'query'"]);
    for (words, expected) in [
        (
            r#"<float name="radius" value="0"/>"#,
            "'radius' is 0 but must be greater than 0",
        ),
        (
            r#"<float name="radius" value="-1"/>"#,
            "must be greater than 0",
        ),
        (
            r#"<integer name="photons" value="0"/>"#,
            "'photons' is 0 but must be at least 1",
        ),
        (
            r#"<string name="query" value="bean"/>"#,
            "did you mean 'beam'?",
        ),
        (
            r#"<string name="heuristic" value="power"/>"#,
            "no parameter 'heuristic'",
        ),
    ] {
        refused(
            &integrator("photon", words),
            None,
            &["scene.xml:4:", expected],
        );
    }
    refused(
        &integrator("path", r#"<float name="radius" value="1"/>"#),
        None,
        &["no parameter 'radius'"],
    );
}

#[test]
fn mistakes_have_places_and_help() {
    refused(
        &integrator("bdtp", ""),
        None,
        &[
            "scene.xml:4:",
            "unknown integrator type 'bdtp'",
            "did you mean 'bdpt'?",
        ],
    );
    refused(
        SKY,
        Some("bdtp"),
        &["unknown integrator 'bdtp'", "did you mean 'bdpt'?"],
    );
    // The message lists all known types, each once.
    refused(
        &integrator("metropolis", ""),
        None,
        &[
            "known types: auto, path, volpath, volpathmis, direct, particle, ptracer, bdpt, vcm, aov, depth, moment, stokes, tagged, photon, sppm, preview\n",
        ],
    );
    refused(
        SKY,
        Some("metropolis"),
        &["known integrators: auto, path, "],
    );
    refused(
        &integrator("bdpt", "<integer name=\"reflections\" value=\"29\"/>"),
        None,
        &["scene.xml:4:", "'reflections' is 29", "at most 28"],
    );
    refused(
        &integrator("particle", "<integer name=\"reflexions\" value=\"1\"/>"),
        None,
        &["did you mean 'reflections'?"],
    );
    refused(
        &format!("{}{}", integrator("path", ""), integrator("bdpt", "")),
        None,
        &["more than one integrator"],
    );
}

/// Returns the warnings of a scene with an integrator of a given number of reflections.
fn warnings(kind: &str, reflections: u32, things: &str) -> String {
    let parameters = format!("<integer name=\"reflections\" value=\"{reflections}\"/>");
    let integrator = format!("<integrator type=\"{kind}\">{parameters}</integrator>");
    accepted(&format!("{integrator}{things}"), None)
        .warnings
        .to_string()
}

#[test]
fn light_that_nothing_finds_draws_a_warning() {
    for (kind, things, expected) in [
        (
            "path",
            [LIGHT, GLASS],
            "this point emitter that smooth dielectrics ('glass') reflect",
        ),
        (
            "path",
            [LIGHT, METAL],
            "this point emitter that a mirror ('metal') reflects",
        ),
        (
            "particle",
            [SKY, GLASS],
            "smooth dielectrics ('glass') show no reflections",
        ),
        (
            "particle",
            [SKY, METAL],
            "a mirror ('metal') shows emitters only",
        ),
        ("bdpt", [LIGHT, GLASS], "on every part of its way"),
        ("bdpt", [LIGHT, METAL], "on every part of its way"),
    ] {
        let text = warnings(kind, 0, &things.concat());
        assert!(text.contains(expected), "{kind}: {text}");
        assert_eq!(text.matches("warning[").count(), 1, "{kind}: {text}");
        assert!(text.contains("scene.xml:"), "{kind}: {text}");
    }
}

#[test]
fn light_that_is_found_draws_none() {
    for (kind, reflections, things) in [
        ("path", 0, [LIGHT, ""]),
        ("path", 0, [SKY, GLASS]),
        ("path", 0, [SKY, METAL]),
        ("path", 1, [LIGHT, GLASS]),
        ("particle", 0, [LIGHT, ""]),
        ("particle", 1, [SKY, GLASS]),
        ("bdpt", 0, [SKY, GLASS]),
        ("bdpt", 0, [SKY, METAL]),
        ("bdpt", 1, [LIGHT, GLASS]),
        ("photon", 0, [LIGHT, METAL]),
        ("vcm", 0, [LIGHT, METAL]),
        ("sppm", 0, [SKY, GLASS]),
    ] {
        let text = warnings(kind, reflections, &things.concat());
        assert_eq!(text, "", "{kind} {reflections}");
    }
}

#[test]
fn aovs_are_chosen_by_name() {
    let aovs = |list: &str| {
        let list = format!("<string name=\"aovs\" value=\"{list}\"/>");
        integrator("aov", &list)
    };
    let loaded = accepted(&aovs("steps, deflection"), None);
    let expected = ["valid", "deflection.X", "deflection.Y", "steps"];
    assert_eq!(loaded.channel_names, expected);
    // No light is needed, and one wavelength is enough.
    let loaded = accepted("", Some("aov"));
    assert!(loaded.warnings.is_empty(), "{}", loaded.warnings);
    assert_eq!(loaded.channel_names.len(), 16);
    assert_eq!(loaded.scene().film().channels, 1);
    refused(
        &aovs("steps, deflexion"),
        None,
        &[":4:", "deflexion", "did you mean 'deflection'?"],
    );
    let wave = "<float name=\"wavelength\" value=\"5e-7\"/>";
    let loaded = accepted(&integrator("aov", wave), None);
    assert_eq!(loaded.channel_names.last().unwrap(), "waves");
    refused(&aovs("waves"), None, &["waves need a 'wavelength'"]);
    let reference = |parameter: &str| integrator("aov", parameter);
    let of = |text: &str| {
        let loaded = accepted(text, None);
        let quiet = text.is_empty() || loaded.warnings.is_empty();
        assert!(quiet, "{}", loaded.warnings);
        format!("{:?}", loaded.reference())
    };
    let number = reference("<float name=\"reference_index\" value=\"1.25\"/>");
    assert_eq!(of(&number), "Some(Index(1.25))");
    let volume = reference(
        "<volume name=\"reference_index\" type=\"gaussian\"><float name=\"n0\" value=\"1\"/><float name=\"width\" value=\"1\"/><float name=\"delta\" value=\"0.1\"/></volume>",
    );
    assert!(
        of(&volume).starts_with("Some(Field(Gaussian"),
        "{}",
        of(&volume)
    );
    let same = reference(
        "<volume name=\"reference_index\" type=\"constant\"><float name=\"value\" value=\"1.5\"/></volume>",
    );
    assert_eq!(of(&same), "Some(Index(1.5))");
    assert_eq!(of(""), "None");
    let negative = reference("<float name=\"reference_index\" value=\"-1\"/>");
    refused(&negative, None, &["reference_index"]);
    refused(
        &aovs(""),
        None,
        &["expected a list of: valid, exit_position"],
    );
    refused(
        &integrator("path", "<string name=\"aovs\" value=\"steps\"/>"),
        None,
        &["aovs"],
    );
}
