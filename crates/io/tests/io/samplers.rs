//! Samplers in scene files: replicates and numbers of samples.

use morgana_io::{Diagnostics, LoadOptions, Loaded};
use transport::sampling::Replicates;

fn load(integrator: &str, sampler: &str, samples: Option<u64>) -> Loaded {
    load_with(integrator, sampler, ("", ""), samples)
}

/// Loads a scene with further parameters of the sampler and of the film.
fn load_with(integrator: &str, sampler: &str, more: (&str, &str), samples: Option<u64>) -> Loaded {
    let options = LoadOptions {
        samples,
        ..LoadOptions::default()
    };
    load_by(integrator, sampler, more, &options).unwrap_or_else(|d| panic!("{d}"))
}

fn load_by(
    integrator: &str,
    sampler: &str,
    (more, film): (&str, &str),
    options: &LoadOptions,
) -> Result<Loaded, Diagnostics> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scene.xml");
    let text = format!(
        r#"<scene version="3.0.0"><integrator type="{integrator}"/>
<sensor type="perspective"><sampler type="{sampler}"><integer name="sample_count" value="30"/>{more}</sampler>
<film type="hdrfilm">{film}</film></sensor>
<emitter type="constant"/>
</scene>"#
    );
    std::fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, options)
}

#[test]
fn low_discrepancy_comes_in_whole_replicates() {
    let both_ends = load("bdpt", "ldsampler", None);
    assert_eq!(both_ends.replicates, Replicates::OfEight);
    let loaded = load("path", "ldsampler", None);
    assert_eq!(loaded.replicates, Replicates::OfEight);
    assert_eq!(loaded.samples, 32);
    let message = loaded.warnings.to_string();
    assert!(
        message.contains(
            "32 samples are taken instead of 30: a multiple of the sampler's 8 samples in a replicate"
        ),
        "{message}"
    );
    let whole = load("path", "ldsampler", Some(64));
    assert_eq!((whole.samples, whole.warnings.is_empty()), (64, true));
}

#[test]
fn replicates_may_be_larger() {
    let set = |n: u32| format!(r#"<integer name="set" value="{n}"/>"#);
    let load = |n| load_with("path", "ldsampler", (&set(n), ""), None);
    assert_eq!(load(8).replicates, Replicates::OfEight);
    let large = load(64);
    assert_eq!(large.replicates, Replicates::OfSixtyFour);
    assert_eq!(large.samples, 64);
    let options = LoadOptions {
        sampler: Some("ldsampler:64".into()),
        ..LoadOptions::default()
    };
    let loaded = load_by("path", "independent", ("", ""), &options).unwrap();
    assert_eq!(loaded.replicates, Replicates::OfSixtyFour);
    for (sampler, points, said) in [
        ("ldsampler", 16, "16 is neither 8 nor 64"),
        ("ldsampler", 128, "128 is neither 8 nor 64"),
        ("independent", 64, "'set'"),
    ] {
        let set = format!(r#"<integer name="set" value="{points}"/>"#);
        let refused = load_by("path", sampler, (&set, ""), &LoadOptions::default());
        let message = refused.unwrap_err().to_string();
        assert!(message.contains(said), "{message}");
    }
}

#[test]
fn other_even_samplers_are_replaced_by_ours() {
    let loaded = load("path", "multijitter", Some(64));
    assert_eq!(loaded.replicates, Replicates::OfEight);
    let message = loaded.warnings.to_string();
    assert!(
        message.contains("'multijitter' is not available; 'ldsampler' is used instead"),
        "{message}"
    );
}

#[test]
fn others_take_independent_samples_and_say_so() {
    let independent = load("path", "independent", None);
    assert_eq!(independent.replicates, Replicates::Single);
    assert!(independent.warnings.is_empty());
    for (integrator, sampler, said) in [
        ("path", "strange", "'independent' is used instead"),
        (
            "particle",
            "ldsampler",
            "samples of 'particle' are independent",
        ),
        (
            "particle",
            "multijitter",
            "samples of 'particle' are independent",
        ),
    ] {
        let loaded = load(integrator, sampler, None);
        assert_eq!(
            (loaded.replicates, loaded.samples),
            (Replicates::Single, 30)
        );
        assert_eq!(loaded.warnings.iter().count(), 1, "{}", loaded.warnings);
        let message = loaded.warnings.to_string();
        assert!(message.contains(said), "{message}");
    }
}

#[test]
fn what_a_caller_replaces_is_not_spoken_of() {
    let options = LoadOptions {
        sampler: Some("independent".into()),
        ..LoadOptions::default()
    };
    let loaded = load_by("path", "multijitter", ("", ""), &options).unwrap();
    assert_eq!(loaded.replicates, Replicates::Single);
    assert!(loaded.warnings.is_empty(), "{}", loaded.warnings);
}

#[test]
fn samples_are_shared_out_where_that_can_be() {
    let adaptive = r#"<boolean name="adaptive" value="true"/>"#;
    let reweight = r#"<boolean name="reweight" value="true"/>"#;
    let load = |integrator, film| load_with(integrator, "independent", (adaptive, film), None);
    let loaded = load("path", "");
    assert!(loaded.adaptive && loaded.warnings.is_empty());
    assert!(!load_with("path", "independent", ("", ""), None).adaptive);
    let few = load_with("path", "ldsampler", (adaptive, ""), Some(16));
    let message = few.warnings.to_string();
    assert!(
        message.contains("16 samples are too few for adaptive sampling"),
        "{message}"
    );
    for (loaded, reason) in [
        (
            load("bdpt", ""),
            "with the integrator 'bdpt', only with 'path'",
        ),
        (load("path", reweight), "with the film's 'reweight'"),
    ] {
        assert!(!loaded.adaptive);
        let message = loaded.warnings.to_string();
        let said = format!("adaptive sampling has no effect {reason}");
        assert!(message.contains(&said), "{message}");
    }
}
