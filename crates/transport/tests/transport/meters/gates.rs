//! Gates of optical path length: exact in an infinite medium, with equal accuracy early and late,
//! and with sums equal to readings without gates.

use crate::meters::support::*;
use eikonal::field::Constant;
use glam::DVec3;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::emitter::Emitter;
use morgana_transport::meter::{Coordinates, FluenceMeter, Meter};
use morgana_transport::render::Measurement;
use morgana_transport::scene::Parts;
use morgana_transport::shape::{Cube, Sphere};
use morgana_transport::{Bins, Spectrum};
use std::f64::consts::PI;
use testkit::z_test::max_abs_z;

/// Index of all media.
const INDEX: f64 = 1.4;
/// Radius of the medium that represents an infinite one.
const RADIUS: f64 = 100.0;

/// `count` gates, each an absorption length wide, for an absorption coefficient of 1.
fn gates(count: usize) -> Option<Bins> {
    Some(Bins {
        min: 0.0,
        max: INDEX * count as f64,
        count,
    })
}

/// An emitter of unit power in the middle of a medium of absorption 1 and scattering `scattering`,
/// which no light leaves.
fn infinite(scattering: f64) -> Parts {
    let extinction = 1.0 + scattering;
    let medium = fog(
        Constant::new(INDEX),
        extinction,
        scattering / extinction,
        0.0,
    );
    let ball = Sphere::around(DVec3::ZERO, RADIUS).unwrap();
    let light = Emitter::Point {
        position: DVec3::ZERO,
        intensity: Spectrum::splat(0.25 / PI),
    };
    let ball = container(ball, Bsdf::Null);
    parts(vec![ball], vec![vacuum(), medium], vec![light], nobody())
}

/// A single cell that contains everything.
fn everywhere() -> FluenceMeter {
    let radius = scaled(DVec3::splat(RADIUS), DVec3::ZERO);
    fluence(Coordinates::Spherical, [1, 1, 1], radius)
}

/// Volume of the cell; readings are per volume.
const VOLUME: f64 = 4.0 / 3.0 * PI * RADIUS * RADIUS * RADIUS;

/// Power absorbed in a gate from a to b is e^−a − e^−b for any scattering; seven million particles
/// agree under `MORGANA_LONG_TESTS`. The last gate, with a millionth of the light, has an effective
/// number of particles above a twentieth of all, and no flag is raised.
#[test]
fn an_infinite_medium_absorbs_exponentially() {
    let count = 14;
    let number = match std::env::var_os("MORGANA_LONG_TESTS") {
        Some(_) => 7_000_000,
        None => 10_000,
    };
    let meter = FluenceMeter {
        optical_length: gates(count),
        weight_windows: true,
        ..everywhere()
    };
    let found = run(
        infinite(4.0),
        &[Meter::Fluence(meter)],
        &options(number, 21),
    );
    let share = |gate: usize| (-(gate as f64)).exp() - (-(gate as f64) - 1.0).exp();
    let exact: Vec<f64> = (0..count).map(|gate| share(gate) / VOLUME).collect();
    let mut all = Vec::new();
    for name in ["fluence", "absorbed"] {
        let reading = reading(&found, 0, name);
        all.extend(zs(reading, &exact));
        assert!(reading.few.iter().all(|few| !few));
        let least = reading.effective.iter().copied().fold(f64::MAX, f64::min);
        assert!(least > 0.05 * number as f64, "{least}");
    }
    max_abs_z(&all, FAMILY).unwrap();
}

/// A beam into a cube with refracting walls, from which light escapes long before it is absorbed.
fn leaky(meters: &[Meter], particles: u64, seed: u64) -> Measurement {
    let medium = fog(Constant::new(INDEX), 4.0, 0.99, 0.3);
    let cube = Cube::new(scaled(DVec3::ONE, DVec3::ZERO)).unwrap();
    let cube = container(cube, glass());
    let light = beam(DVec3::new(0.0, 0.0, -2.0), DVec3::Z, 0.5);
    let parts = parts(vec![cube], vec![vacuum(), medium], vec![light], nobody());
    run(parts, meters, &options(particles, seed))
}

/// Gates add up to readings without gates, whose particles follow no weight window. The last gates,
/// with less than a millionth of the light, are nearly as accurate as the second.
#[test]
fn gates_add_up_to_what_is_read_without() {
    let cells = || {
        fluence(
            Coordinates::Cartesian,
            [1, 1, 4],
            scaled(DVec3::splat(2.0), DVec3::NEG_ONE),
        )
    };
    let count = 10;
    let gated = FluenceMeter {
        optical_length: Some(Bins {
            min: 0.0,
            max: 60.0,
            count,
        }),
        weight_windows: true,
        ..cells()
    };
    let number = particles(10_000);
    let found = leaky(&[Meter::Fluence(gated)], number, 23);
    let plain = leaky(&[Meter::Fluence(cells())], 4 * number, 24);
    let [gated, plain] = [&found, &plain].map(|found| reading(found, 0, "fluence"));
    let mut all = Vec::new();
    for cell in 0..4 {
        let gate = |i: usize| i * 4 + cell;
        let sum: f64 = (0..count).map(|i| gated.mean[gate(i)]).sum();
        // Gates of a cell are correlated: errors add up at most.
        let error: f64 = (0..count).map(|i| gated.error[gate(i)]).sum();
        all.push((sum - plain.mean[cell]) / error.hypot(plain.error[cell]));
        let relative = |i: usize| gated.error[gate(i)] / gated.mean[gate(i)];
        let (second, last) = (relative(1), relative(count - 1));
        assert!(gated.mean[gate(count - 1)] < 1e-6 * sum);
        assert!(last < 4.0 * second, "{cell}: {last} {second}");
        assert!(!gated.few[gate(count - 1)]);
    }
    max_abs_z(&all, FAMILY).unwrap();
}

/// Without weight windows, gates sort light and change nothing else. Particles make equally many
/// edges as without gates. The gates add up to the reading without gates, because no particle of
/// this seed continues beyond the last gate. With weight windows, particles make several times as
/// many edges.
#[test]
fn gates_cost_no_edges_unless_windows_are_asked_for() {
    let cells = || {
        fluence(
            Coordinates::Cartesian,
            [1, 1, 4],
            scaled(DVec3::splat(2.0), DVec3::NEG_ONE),
        )
    };
    let gated = |weight_windows| FluenceMeter {
        optical_length: Some(Bins {
            min: 0.0,
            max: 60.0,
            count: 2,
        }),
        weight_windows,
        ..cells()
    };
    let [plain, gates, windows] = [cells(), gated(false), gated(true)]
        .map(|meter| leaky(&[Meter::Fluence(meter)], 1_000, 29));
    assert_eq!(gates.stats, plain.stats);
    assert!(windows.stats.edges > 2 * plain.stats.edges);
    let [plain, gates] = [&plain, &gates].map(|found| &reading(found, 0, "fluence").mean);
    for cell in 0..4 {
        let sum = gates[cell] + gates[4 + cell];
        assert!((sum / plain[cell] - 1.0).abs() < 1e-9, "{cell}");
    }
}

/// Bins that only a few particles reach are flagged, and their effective numbers are small.
#[test]
fn few_particles_are_flagged() {
    let shells = fluence(
        Coordinates::Spherical,
        [12, 1, 1],
        scaled(DVec3::splat(12.0), DVec3::ZERO),
    );
    let found = run(
        infinite(0.5),
        &[Meter::Fluence(shells)],
        &options(10_000, 25),
    );
    let reading = reading(&found, 0, "absorbed");
    for (shell, (effective, few)) in reading.effective.iter().zip(&reading.few).enumerate() {
        assert!(*effective >= 10.0 || *few || reading.mean[shell] == 0.0);
    }
    assert!(reading.effective[0] > 5e3 && !reading.few[0]);
    assert!(reading.few.iter().any(|few| *few));
}

/// Particles of a surface's meter keep to the weight window, too, and the meter reads all power
/// that passes, in gates or not.
#[test]
fn gates_of_surfaces_leave_the_power_as_it_is() {
    let parts = || {
        let medium = fog(Constant::new(INDEX), 4.0, 0.9, 0.0);
        let cube = Cube::new(scaled(DVec3::ONE, DVec3::ZERO)).unwrap();
        let light = beam(DVec3::new(0.0, 0.0, -2.0), DVec3::Z, 0.5);
        let mut ambient = vacuum();
        ambient.index = Constant::new(INDEX).into();
        parts(
            vec![container(cube, Bsdf::Null)],
            vec![ambient, medium],
            vec![light],
            nobody(),
        )
    };
    let mut gated = through(&parts().objects, 0, [1, 1], false);
    let plain = gated.clone();
    gated.optical_length = Some(Bins {
        min: 0.0,
        max: 30.0,
        count: 6,
    });
    gated.weight_windows = true;
    let number = particles(10_000);
    let [found, wanted] = [(gated, 26, 1), (plain, 27, 4)].map(|(meter, seed, times)| {
        let meters = [Meter::Irradiance(meter)];
        run(parts(), &meters, &options(times * number, seed))
    });
    let (found, wanted) = (reading(&found, 0, "power"), reading(&wanted, 0, "power"));
    let z = (0..2).map(|side| {
        let error = found.error[side].hypot(wanted.error[side]).max(1e-12);
        (found.mean[side] - wanted.mean[side]) / error
    });
    max_abs_z(&z.collect::<Vec<_>>(), FAMILY).unwrap();
}
