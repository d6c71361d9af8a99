//! Requested outputs of a scene, and refused ones.

use morgana_io::{Limits, LoadOptions, Loaded, Refusal, Run};
use std::time::Duration;
use transport::render::{Measure, Target};

fn load(integrator: &str) -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    let text = format!(
        r#"<scene version="3.0.0"><integrator type="{integrator}"/>
  <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="6"/></film>
    <sampler type="independent"><integer name="sample_count" value="10"/></sampler></sensor>
  <emitter type="constant"/></scene>"#
    );
    std::fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).unwrap()
}

fn target() -> Option<Target> {
    Some(Target {
        error: 0.01,
        measure: Measure::Image,
    })
}

#[test]
fn what_cannot_be_done_is_refused() {
    let check = |run: &Run| run.check(Limits::default());
    let (path, photon) = (load("path"), load("photon"));
    assert!(check(&Run::new(&path)).is_ok());
    let unlimited = |loaded| Run {
        total: None,
        target: target(),
        ..Run::new(loaded)
    };
    assert!(check(&unlimited(&path)).is_ok());
    assert!(matches!(
        check(&unlimited(&photon)),
        Err(Refusal::Unreachable)
    ));
    let timed = Run {
        time: Some(Duration::from_secs(1)),
        ..unlimited(&photon)
    };
    assert!(check(&timed).is_ok());
    let strategies = |loaded| Run {
        strategies: true,
        ..Run::new(loaded)
    };
    assert!(matches!(
        check(&strategies(&path)),
        Err(Refusal::OneStrategy("path"))
    ));
    let bdpt = load("bdpt");
    assert!(check(&strategies(&bdpt)).is_ok());
    let film = strategies(&bdpt).check(Limits::of(1000)).unwrap_err();
    let message = film.to_string();
    let expected = [
        "8 × 6 pixels",
        "images of strategies",
        "1000 bytes (--memory)",
    ];
    for part in expected {
        assert!(message.contains(part), "{message}");
    }
}

/// A meter in the light of a point.
fn load_meter() -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    let text = r#"<scene version="3.0.0">
  <sensor type="fluencemeter"><integer name="nx" value="1"/><integer name="ny" value="1"/><integer name="nz" value="1"/></sensor>
  <emitter type="point"/></scene>"#;
    std::fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).unwrap()
}

#[test]
fn time_ends_a_run_after_a_pass() {
    let (path, meter) = (load("path"), load_meter());
    let timed = |loaded, time, total| Run {
        time: Some(time),
        total,
        ..Run::new(loaded)
    };
    for total in [None, Some(1 << 40)] {
        let rendering = timed(&path, Duration::ZERO, total).render().unwrap();
        assert!((1..1 << 20).contains(&rendering.samples));
        let measured = timed(&meter, Duration::ZERO, total).measure().unwrap();
        assert!((1..1 << 20).contains(&measured.particles));
    }
    let long = Duration::from_secs(1000);
    assert_eq!(timed(&path, long, Some(10)).render().unwrap().samples, 10);
    let open = Run {
        total: None,
        ..Run::new(&path)
    };
    assert!(matches!(open.render(), Err(Refusal::NoEnd)));
}

#[test]
fn parts_that_the_whole_does_not_have_are_refused() {
    let (path, meter) = (load("path"), load_meter());
    for shard in [[3, 3], [0, 0], [u64::MAX, 1]] {
        let part = |loaded| Run {
            shard: Some(shard),
            ..Run::new(loaded)
        };
        let message = part(&path).render().unwrap_err().to_string();
        let [index, count] = shard;
        let expected = format!("there is no part {index} of {count}: parts are counted from 0");
        assert_eq!(message, expected);
        assert_eq!(part(&meter).measure().unwrap_err().to_string(), expected);
    }
}

#[test]
fn parts_have_their_samples_and_say_what_they_are_of() {
    let loaded = load("path");
    let part = |index| Run {
        shard: Some([index, 3]),
        seed: 5,
        target: target(),
        ..Run::new(&loaded)
    };
    let ranges = [0, 1, 2].map(|index| {
        let options = part(index).options();
        assert_eq!(options.seed, 5);
        options.range()
    });
    assert_eq!(ranges, [0..3, 3..6, 6..10]);
    let header = part(1).header();
    assert!(header.agrees(&part(2).header()).is_ok());
    let other = Run {
        target: None,
        ..part(1)
    };
    let error = header.agrees(&other.header()).unwrap_err().to_string();
    assert!(error.contains("target error = 0.01 (image)"), "{error}");
    assert_eq!(Run::new(&loaded).options().range(), 0..10);
}
