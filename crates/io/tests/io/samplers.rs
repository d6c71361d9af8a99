//! Samplers in scene files: replicates and numbers of samples.

use morgana_io::{Diagnostics, LoadOptions, Loaded, Run};
use std::time::Duration;
use transport::render::Handle;

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

/// Returns the size of the replicates of a scene.
fn size(loaded: &Loaded) -> u64 {
    loaded.replicates(loaded.samples).size()
}

#[test]
fn low_discrepancy_comes_in_whole_replicates() {
    assert_eq!(size(&load("bdpt", "ldsampler", None)), 8);
    let loaded = load("path", "ldsampler", Some(61));
    assert_eq!((size(&loaded), loaded.samples), (16, 64));
    let message = loaded.warnings.to_string();
    assert!(
        message.contains(
            "64 samples are taken instead of 61: a multiple of the sampler's 8 samples in a replicate"
        ),
        "{message}"
    );
    let whole = load("path", "ldsampler", Some(64));
    assert_eq!((whole.samples, whole.warnings.is_empty()), (64, true));
}

/// The sizes leave at least four replicates, or sixteen if no sampler is named, and add at most a
/// quarter to the samples, or nothing if no sampler is named. Rounded numbers of samples stay.
#[test]
fn replicates_grow_with_the_number_of_samples() {
    let named = load("path", "ldsampler", None);
    for (samples, expected) in [
        (1, 1),
        (7, 1),
        (8, 2),
        (64, 16),
        (100, 16),
        (1024, 256),
        (1 << 20, 1024),
    ] {
        assert_eq!(named.replicates(samples).size(), expected, "{samples}");
    }
    for samples in 1..2000 {
        let [once, twice] = [samples, named.replicates(samples).whole(samples)]
            .map(|samples| named.replicates(samples).whole(samples));
        assert!(once == twice && 4 * once <= 5 * samples, "{samples}");
    }
    let open = sky(8, &LoadOptions::default());
    for (samples, expected) in [
        (31, 1),
        (64, 4),
        (100, 4),
        (127, 1),
        (128, 8),
        (1000, 8),
        (4096, 256),
    ] {
        assert_eq!(open.replicates(samples).size(), expected, "{samples}");
    }
}

/// Loads a sky, seen by `width` × 8 pixels, whose scene names neither sampler nor integrator.
fn sky(width: usize, options: &LoadOptions) -> Loaded {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scene.json");
    let film = format!(r#"{{"type": "hdrfilm", "width": {width}, "height": 8}}"#);
    let text = format!(
        r#"{{"type": "scene", "sensor": {{"type": "perspective", "film": {film}}}, "sky": {{"type": "constant"}}}}"#
    );
    std::fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, options).unwrap_or_else(|d| panic!("{d}"))
}

/// Without a number of samples, the size follows from the number that a pilot expects within the
/// time limit. Without a pilot, it follows from the scene's number.
#[test]
fn replicates_of_unknown_numbers_of_samples_follow_from_the_time() {
    let size = |seconds: u64, width: usize, options: &LoadOptions| {
        let loaded = sky(width, options);
        let mut run = Run {
            total: None,
            time: Some(Duration::from_secs(seconds)),
            ..Run::new(&loaded)
        };
        run.choose(&Handle::default());
        run.options().replicates.size()
    };
    let open = LoadOptions::default();
    assert_eq!(size(600, 8, &open), 1024);
    let [small, large] = [8, 8000].map(|width| size(1, width, &open));
    assert!(small >= 16 * large, "{small} {large}");
    let path = LoadOptions {
        integrator: Some("path".into()),
        ..LoadOptions::default()
    };
    assert_eq!(size(600, 8, &path), 4);
    let independent = LoadOptions {
        sampler: Some("independent".into()),
        ..LoadOptions::default()
    };
    assert_eq!(size(600, 8, &independent), 1);
}

#[test]
fn scenes_and_callers_may_fix_the_size_of_replicates() {
    let fixed = |n: u32| format!(r#"<integer name="replicate_size" value="{n}"/>"#);
    let load = |n| load_with("path", "ldsampler", (&fixed(n), ""), None);
    assert_eq!(size(&load(8)), 8);
    let large = load(64);
    assert_eq!((size(&large), large.samples), (64, 64));
    let options = LoadOptions {
        sampler: Some("ldsampler:128".into()),
        ..LoadOptions::default()
    };
    let loaded = load_by("path", "independent", ("", ""), &options).unwrap();
    assert_eq!(size(&loaded), 128);
    for (sampler, points, said) in [
        ("ldsampler", 12, "12 is not a power of two up to 1024"),
        ("ldsampler", 2048, "2048"),
        ("independent", 64, "'replicate_size'"),
    ] {
        let refused = load_by(
            "path",
            sampler,
            (&fixed(points), ""),
            &LoadOptions::default(),
        );
        let message = refused.unwrap_err().to_string();
        assert!(message.contains(said), "{message}");
    }
    for name in ["ldsampler:12", "ldsampler:2048", "ldsampler:"] {
        let options = LoadOptions {
            sampler: Some(name.into()),
            ..LoadOptions::default()
        };
        let message = load_by("path", "independent", ("", ""), &options).unwrap_err();
        assert!(
            message.to_string().contains("a power of two up to 1024"),
            "{message}"
        );
    }
}

#[test]
fn other_even_samplers_are_replaced_by_ours() {
    let loaded = load("path", "multijitter", Some(64));
    assert_eq!(size(&loaded), 16);
    let message = loaded.warnings.to_string();
    assert!(
        message.contains("'multijitter' is not available; 'ldsampler' is used instead"),
        "{message}"
    );
}

#[test]
fn others_take_independent_samples_and_say_so() {
    let independent = load("path", "independent", None);
    assert_eq!(size(&independent), 1);
    assert!(independent.warnings.is_empty());
    for (integrator, sampler, said) in [
        ("path", "strange", "'independent' is used instead"),
        (
            "particle",
            "ldsampler",
            "the integrator 'particle' takes independent samples",
        ),
        (
            "particle",
            "multijitter",
            "the integrator 'particle' takes independent samples",
        ),
    ] {
        let loaded = load(integrator, sampler, None);
        let replicates = loaded.renderer.replicates(loaded.replicates(30));
        assert_eq!((replicates.size(), loaded.samples), (1, 30));
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
    assert_eq!(size(&loaded), 1);
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
