//! Reproducibility of readings for any number of threads, and consistency of bins.

use crate::meters::support::*;
use eikonal::field::Luneburg;
use glam::DVec3;
use morgana_transport::Bins;
use morgana_transport::Scene;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::meter::{Coordinates, Cosines, Meter};
use morgana_transport::render::{Handle, Measurement, measure};
use morgana_transport::scene::Parts;
use morgana_transport::shape::Sphere;
use std::ops::ControlFlow;

fn ball() -> Parts {
    let index = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    let media = vec![vacuum(), fog(index, 3.0, 0.9, 0.6)];
    let light = beam(DVec3::Z * -2.0, DVec3::Z, 0.3);
    parts(vec![ball], media, vec![light], nobody())
}

fn meters(parts: &Parts, length: Option<Bins>) -> Vec<Meter> {
    let to_world = scaled(DVec3::splat(2.0), DVec3::NEG_ONE);
    let mut fluence = fluence(Coordinates::Cartesian, [9, 7, 8], to_world);
    fluence.optical_length = length;
    fluence.weight_windows = length.is_some();
    let mut power = through(&parts.objects, 0, [4, 3], false);
    power.cosines = Some(Cosines {
        count: 5,
        axis: None,
    });
    power.optical_length = length;
    power.weight_windows = length.is_some();
    vec![Meter::Fluence(fluence), Meter::Irradiance(power)]
}

fn bits(measurement: &Measurement) -> Vec<u64> {
    let readings = measurement.readings.iter().flatten();
    let values = readings.flat_map(|r| r.mean.iter().chain(&r.error));
    values.map(|v| v.to_bits()).collect()
}

#[test]
fn threads_and_passes_leave_no_trace() {
    let reference = run(ball(), &meters(&ball(), None), &options(5_000, 11));
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let found = pool
            .build()
            .unwrap()
            .install(|| run(ball(), &meters(&ball(), None), &options(5_000, 11)));
        assert_eq!(bits(&found), bits(&reference), "{threads}");
        assert_eq!(found.balance, reference.balance);
        assert_eq!(found.stats, reference.stats);
    }
}

#[test]
fn a_measurement_that_is_stopped_is_a_shorter_one() {
    let scene = Scene::new(ball()).unwrap();
    let meters = meters(&ball(), None);
    let stop = |_| ControlFlow::Break(());
    let handle = Handle::default();
    let found = measure(&[scene], &meters, &options(5_000, 12), &handle, stop).unwrap();
    assert!(found.particles < 5_000);
    let shorter = run(ball(), &meters, &options(found.particles, 12));
    assert_eq!(bits(&found), bits(&shorter));
}

#[test]
fn bins_of_optical_length_add_up() {
    let all = Bins {
        min: 0.0,
        max: 1e3,
        count: 1,
    };
    let fine = Bins { count: 2000, ..all };
    let [one, many] =
        [all, fine].map(|b| run(ball(), &meters(&ball(), Some(b)), &options(300, 13)));
    for (meter, name) in [(0, "fluence"), (0, "absorbed"), (1, "binned_power")] {
        let (one, many) = (
            &reading(&one, meter, name).mean,
            &reading(&many, meter, name).mean,
        );
        // The optical length is the slowest index, except for the side.
        let sides = if meter == 1 { 2 } else { 1 };
        let inner = one.len() / sides;
        for (i, whole) in one.iter().enumerate() {
            let (side, cell) = (i / inner, i % inner);
            let bins = (0..2000).map(|b| many[(side * 2000 + b) * inner + cell]);
            let sum: f64 = bins.sum();
            assert!(
                (sum - whole).abs() <= 1e-9 * (whole.abs() + 1e-6),
                "{name} {i}: {sum} {whole}"
            );
        }
    }
}

#[test]
fn cells_add_up_to_the_whole() {
    let whole = [Meter::Fluence(fluence(
        Coordinates::Cartesian,
        [1, 1, 1],
        scaled(DVec3::splat(2.0), DVec3::NEG_ONE),
    ))];
    let whole = run(ball(), &whole, &options(2_000, 14));
    let cells = run(ball(), &meters(&ball(), None), &options(2_000, 14));
    let mean = |m: &Measurement| {
        let values = &reading(m, 0, "fluence").mean;
        values.iter().sum::<f64>() / values.len() as f64
    };
    assert!((mean(&cells) / mean(&whole) - 1.0).abs() < 1e-9);
    // The content of the ball is equal in shells and in rings.
    let rings = fluence(
        Coordinates::Cylindrical,
        [6, 1, 8],
        scaled(DVec3::new(1.0, 1.0, 2.0), DVec3::NEG_Z),
    );
    let meters = [Meter::Fluence(shells(9)), Meter::Fluence(rings)];
    let found = run(ball(), &meters, &options(2_000, 14));
    let absorbed = |meter: usize, volume: &dyn Fn(usize) -> f64| {
        let values = &reading(&found, meter, "absorbed").mean;
        values
            .iter()
            .enumerate()
            .map(|(i, v)| v * volume(i))
            .sum::<f64>()
    };
    let (Meter::Fluence(shells), Meter::Fluence(rings)) = (&meters[0], &meters[1]) else {
        unreachable!()
    };
    let in_shells = absorbed(0, &|i| shells.grid.volume(i));
    let in_rings = absorbed(1, &|i| rings.grid.volume(i));
    assert!(
        (in_shells / in_rings - 1.0).abs() < 1e-9,
        "{in_shells} {in_rings}"
    );
    let in_cells = reading(&cells, 0, "absorbed").mean.iter().sum::<f64>() * 8.0 / 504.0;
    assert!(
        (in_cells / in_rings - 1.0).abs() < 1e-9,
        "{in_cells} {in_rings}"
    );
}
