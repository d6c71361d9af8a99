//! Parts of renders as files: a written part is read back, and any other file is refused with a
//! reason.

use crate::common;
use morgana_io::part::{Body, Header, Part, PartMismatch};
use morgana_io::{LoadOptions, Loaded, Problem};
use proptest::prelude::*;
use std::ops::{ControlFlow, Range};
use std::path::Path;
use transport::meter::Meter;
use transport::render::{Handle, MeasureOptions, MeasureState, RenderOptions, State};
use transport::sampling::Replicates;

const IMAGE: &str = r#"<scene version="3.0.0">
  <integrator type="path"/>
  <sensor type="perspective"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
    <film type="hdrfilm"><integer name="width" value="3"/><integer name="height" value="2"/></film>
    <sampler type="independent"><integer name="sample_count" value="8"/></sampler>
  </sensor>
  <emitter type="constant"/>
  <shape type="sphere"><bsdf type="diffuse"/></shape>
</scene>"#;

const METERS: &str = r#"<scene version="3.0.0">
  <integrator type="particle"/>
  <emitter type="point"><point name="position" x="0" y="0" z="0"/><rgb name="intensity" value="1"/></emitter>
  <shape type="sphere"><bsdf type="diffuse"/>
    <sensor type="irradiancemeter" id="wall"/>
  </shape>
</scene>"#;

fn load(text: &str) -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    std::fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e:?}"))
}

fn header() -> Header {
    Header {
        version: "0.1.0".into(),
        results: "fedcba".into(),
        scene_hash: "abcdef".into(),
        settings: vec![("seed".into(), "0".into())],
        total: Some(8),
        replicates: Replicates::SINGLE,
        shard: None,
        origin: "scene.xml".into(),
        seconds: 0.5,
    }
}

fn image(range: Range<u64>) -> Part {
    let loaded = load(IMAGE);
    let options = RenderOptions {
        first: range.start,
        ..RenderOptions::new(loaded.renderer, range.end - range.start, 1)
    };
    let mut state = State::new(&loaded.groups, &options);
    let handle = Handle::default();
    state.advance(&loaded.groups, &options, &handle, |_| {
        ControlFlow::Continue(())
    });
    Part {
        header: header(),
        body: Body::Image(state.into()),
    }
}

fn readings(range: Range<u64>) -> Part {
    let loaded = load(METERS);
    let meters: Vec<Meter> = loaded.instruments.iter().map(|i| i.meter.clone()).collect();
    let mut state = MeasureState::new(&loaded.groups, &meters).unwrap();
    let options = MeasureOptions {
        first: range.start,
        particles: range.end - range.start,
        seed: 1,
        max_depth: None,
        rr_depth: 5,
    };
    let handle = Handle::default();
    let go_on = |_: &_| ControlFlow::Continue(());
    state
        .advance(&loaded.groups, &meters, &options, &handle, go_on)
        .unwrap();
    Part {
        header: header(),
        body: Body::Meters(state.into()),
    }
}

#[test]
fn what_is_written_is_read_again() {
    for part in [image(0..8), readings(0..640)] {
        let bytes = part.to_bytes();
        let again = Part::from_bytes(&bytes).unwrap();
        assert_eq!(again.header, part.header);
        assert_eq!(again.to_bytes(), bytes);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.part");
        part.write(&path).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), bytes);
        assert_eq!(Part::read(&path).unwrap().to_bytes(), bytes);
    }
}

#[test]
fn files_that_go_through_a_file_can_be_merged() {
    let parts = [(0..3), (3..4), (4..8)].map(image);
    let mut merged = Part::from_bytes(&parts[1].to_bytes()).unwrap();
    for part in [&parts[2], &parts[0]] {
        merged
            .merge(&Part::from_bytes(&part.to_bytes()).unwrap())
            .unwrap();
    }
    let whole = image(0..8);
    let films = [&merged, &whole].map(|p| match &p.body {
        Body::Image(state) => state.film(),
        Body::Meters(_) => unreachable!(),
    });
    assert_eq!(films[0], films[1]);
    assert_eq!(merged.header.seconds, 1.5);
}

/// Changes every byte of a file, in one bit and in all.
#[test]
fn damage_is_noticed() {
    for part in [image(0..2), readings(0..64)] {
        let bytes = part.to_bytes();
        for i in 0..bytes.len() {
            for flip in [1 << (i % 8), 0xFF] {
                let mut damaged = bytes.clone();
                damaged[i] ^= flip;
                assert!(Part::from_bytes(&damaged).is_err(), "byte {i}");
            }
            assert!(Part::from_bytes(&bytes[..i]).is_err(), "cut off at {i}");
        }
        let mut longer = bytes.clone();
        longer.push(0);
        assert!(Part::from_bytes(&longer).is_err());
    }
}

#[test]
fn the_reason_is_said() {
    let bytes = image(0..1).to_bytes();
    let message = |bytes: &[u8]| Part::from_bytes(bytes).unwrap_err().to_string();
    assert_eq!(
        message(b"P6 3 2"),
        "not a morgana part file: it starts with other bytes"
    );
    let torn = "not a morgana part file: it is incomplete or damaged (its checksum is wrong)";
    assert_eq!(message(&bytes[..bytes.len() / 2]), torn);
    assert_eq!(message(&bytes[..3]), torn);
    assert!(matches!(
        Part::read(Path::new("nowhere.part")).unwrap_err().problem,
        Problem::Read(_)
    ));
    let mut later = bytes[..bytes.len() - 32].to_vec();
    later[8] = 99;
    later.extend(blake3::hash(&later).as_bytes());
    assert_eq!(
        message(&later),
        "not supported: parts of renders by other versions of morgana"
    );
}

#[test]
fn parts_of_other_renders_are_refused() {
    let refusal = |change: &dyn Fn(&mut Part)| {
        let mut other = image(4..8);
        change(&mut other);
        let mut mine = image(0..4);
        let error = mine.merge(&other).unwrap_err();
        assert_eq!(mine.body.done().count(), 4);
        error
    };
    let version = refusal(&|p| p.header.version = "9.9.9".into());
    assert_eq!(
        version,
        PartMismatch::Version("9.9.9".into(), "0.1.0".into())
    );
    let scene = refusal(&|p| p.header.scene_hash = "0123".into());
    assert_eq!(scene, PartMismatch::Scene("0123".into(), "abcdef".into()));
    let seed = refusal(&|p| p.header.settings[0].1 = "7".into());
    assert_eq!(seed.to_string(), "it was rendered with seed = 7, not 0");
    let missing = refusal(&|p| p.header.settings.clear());
    assert_eq!(
        missing.to_string(),
        "it was rendered with seed = (none), not 0"
    );
    let total = refusal(&|p| p.header.total = None);
    assert_eq!(
        total,
        PartMismatch::Total("any number of".into(), "8".into())
    );
    let again = refusal(&|p| *p = image(2..5));
    assert_eq!(again.to_string(), "both have samples 2 to 3");
    refusal(&|p| p.body = readings(0..64).body);
}

#[test]
fn shards_are_the_whole() {
    for (total, replicates) in [
        (1, Replicates::SINGLE),
        (7, Replicates::SINGLE),
        (64, Replicates::SINGLE),
        (1_000_003, Replicates::SINGLE),
        (u64::MAX, Replicates::SINGLE),
        (64, Replicates::new(8).unwrap()),
        (1_000_000, Replicates::new(8).unwrap()),
    ] {
        for count in [1, 2, 7, 100] {
            let ranges = (0..count).map(|i| {
                let header = Header {
                    total: Some(total),
                    replicates,
                    shard: Some([i, count]),
                    ..header()
                };
                header.range()
            });
            let mut end = 0;
            for range in ranges {
                assert_eq!(range.start, end);
                assert!(range.start.is_multiple_of(replicates.size()));
                let most = (total / count).saturating_add(replicates.size());
                assert!(range.end - range.start <= most);
                end = range.end;
            }
            assert_eq!(end, total);
        }
    }
}

proptest! {
    #![proptest_config(common::inputs())]

    /// Files with a forged checksum give an error or a part, and take no more memory than their
    /// size justifies.
    #[test]
    fn forged_files_do_no_harm(at in any::<prop::sample::Index>(), bytes in prop::collection::vec(any::<u8>(), 1..20)) {
        let original = image(0..2).to_bytes();
        let mut forged = original[..original.len() - 32].to_vec();
        let start = 12 + at.index(forged.len() - 12);
        for (place, byte) in forged[start..].iter_mut().zip(bytes) {
            *place = byte;
        }
        forged.extend(blake3::hash(&forged).as_bytes());
        if let Ok(Part { body: Body::Image(state), .. }) = Part::from_bytes(&forged) {
            let loaded = load(IMAGE);
            let options = RenderOptions::new(loaded.renderer, 8, 1);
            if state.fits(&loaded.groups, &options) {
                let _ = state.into_rendering(&loaded.groups).film.summary();
            }
        }
    }
}
