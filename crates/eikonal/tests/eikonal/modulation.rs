//! First-order phase modulation by sound: amplitudes compared with fields at instants, integrals
//! along arcs compared with fine sums, and displacements. All comparisons are numerical.

use crate::common::{Random, rigid};
use glam::{DAffine3, DVec2, DVec3};
use morgana_eikonal::field::*;
use morgana_eikonal::ray::Arc;
use morgana_eikonal::{Aabb, Field, ModulationQuadrature};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

const K: f64 = 6.0;
const N0: f64 = 1.33;
const ETA: f64 = 0.32;

/// A rotating wave, which is not a standing one: both parts of its amplitude matter.
fn turning(amplitude: f64) -> Field {
    let mode = |phase: f64, time_phase: f64| {
        let mode = AcousticMode::new(amplitude, 2, K, phase).unwrap();
        mode.with_time_phase(time_phase).unwrap()
    };
    let modes = vec![mode(0.0, 0.3), mode(-FRAC_PI_2, 0.3 - FRAC_PI_2)];
    let field = Acoustic::new(N0, DVec3::ZERO, DVec3::Z, DVec3::X, modes).unwrap();
    field.with_elasto_optic(ETA).unwrap().into()
}

/// Samples of a plane wave A e^{−ikx}.
fn plane(amplitude: f64) -> Field {
    let size = [121, 3, 3];
    let at = |i: usize| -1.5 + 3.0 * (i % size[0]) as f64 / (size[0] - 1) as f64;
    let pair = |i: usize| [(K * at(i)).cos(), -(K * at(i)).sin()].map(|v| (amplitude * v) as f32);
    let samples = SoundSamples {
        size,
        bounds: Aabb::new(DVec3::splat(-1.5), DVec3::splat(1.5)),
        placement: Placement::Nodes,
        amplitude: (0..size.iter().product()).map(pair).collect(),
        n0: N0,
        frequency: 1e6,
        wavelength: TAU / K,
        noise: 0.0,
    };
    let field = SampledSound::new(samples).unwrap();
    field.with_elasto_optic(ETA).unwrap().into()
}

/// Adds another field, then moves, stretches and disperses the sum.
fn wrapped(field: Field) -> Field {
    let bump = Gaussian::new(1.34, 0.1, DVec3::X, 0.8).unwrap();
    let sum = Sum::new(N0, vec![field, bump.into()]).unwrap();
    let map = rigid() * DAffine3::from_scale(DVec3::splat(1.7));
    let moved = Affine::new(sum.into(), map).unwrap();
    Scaled::new(moved.into(), 1.01).unwrap().into()
}

fn points() -> Vec<DVec3> {
    let mut random = Random(5);
    (0..50).map(|_| random.vector() * 1.4 - 0.7).collect()
}

/// Half the difference of the index at instants half a period apart is Re(m e^{iωt}) exactly,
/// because squares of the amplitude cancel.
#[test]
fn amplitudes_are_those_of_the_field_at_instants() {
    for field in [turning(0.01), plane(0.01)] {
        for field in [field.clone(), wrapped(field)] {
            let sound = Modulation::of(&field.at_phase(1.0)).unwrap();
            for phase in [0.0, 0.7, 2.0, 4.0] {
                let now = field.at_phase(phase);
                let then = field.at_phase(phase + PI);
                let turn = DVec2::from_angle(phase);
                for x in points() {
                    let (now, then) = (now.gradient(x), then.gradient(x));
                    let found = sound.at(x);
                    let [re, im] = found.gradient;
                    let n2 = turn.x * found.n2.x - turn.y * found.n2.y;
                    // Splines are stored in single precision, 1e-7 of the amplitude of n².
                    assert!((n2 - 0.5 * (now.0 - then.0)).abs() < 2e-8);
                    let gradient = re * turn.x - im * turn.y;
                    assert!((gradient - 0.5 * (now.1 - then.1)).length() < 1e-6);
                }
            }
        }
    }
}

#[test]
fn fields_without_sound_have_none() {
    assert!(Modulation::of(&Constant::new(1.3).into()).is_none());
    let rest = turning(0.01).without_sound();
    assert!(rest.is_constant() && rest.n(DVec3::splat(0.3)) == N0);
    assert!(Modulation::of(&rest).is_some());
    let back = rest.at_phase(0.4);
    let expected = turning(0.01).at_phase(0.4);
    assert_eq!(back.n2(DVec3::splat(0.3)), expected.n2(DVec3::splat(0.3)));
    assert!(plane(0.01).without_sound().is_constant());
}

/// The displacement of a plane wave is ∇n̂/(k²η), in world lengths: û = −i n̂/(kη) along its
/// direction. An unknown coefficient is reported.
#[test]
fn displacements_follow_the_gradient_of_pressure() {
    let field = plane(0.01);
    for stretch in [1.0, 1.7] {
        let map = DAffine3::from_scale(DVec3::splat(stretch));
        let sound = Modulation::of(&Affine::new(field.clone(), map).unwrap().into()).unwrap();
        let k = K / stretch;
        for x in points() {
            let found = sound.displacement(x, &sound.at(x));
            // Expect −i e^{−ikx}.
            let expected = DVec2::from_angle(-k * x.x - FRAC_PI_2) * (0.01 / (k * ETA));
            let error = DVec2::new(found[0].x, found[1].x) - expected;
            // Splines have 42 samples per wavelength; measured errors of derivatives are 2e-5.
            assert!(error.length() < 5e-5 * 0.01 / (k * ETA), "{error}");
        }
    }
    let mode = AcousticMode::new(0.01, 0, K, 0.0).unwrap();
    let field = Acoustic::new(N0, DVec3::ZERO, DVec3::Z, DVec3::X, vec![mode]).unwrap();
    let sound = Modulation::of(&field.into()).unwrap();
    let x = DVec3::splat(0.3);
    assert!(sound.displacement(x, &sound.at(x))[0].x.is_nan());
    assert!(plane_without_sign().is_err());
}

fn plane_without_sign() -> Result<Acoustic, FieldError> {
    let mode = AcousticMode::new(0.01, 0, K, 0.0).unwrap();
    let field = Acoustic::new(N0, DVec3::ZERO, DVec3::Z, DVec3::X, vec![mode]).unwrap();
    field.with_elasto_optic(-ETA)
}

/// Returns the sum along an arc, and true if one quadrature suffices for it.
fn along(sound: &Modulation, arc: &Arc, range: [f64; 2]) -> (DVec2, bool) {
    let ends = range.map(|theta| sound.at(arc.position(theta)));
    let found = sound.along(arc, range, &ends);
    let quadrature = sound.quadrature(arc, range);
    if let Some(quadrature) = quadrature {
        let (places, count) = quadrature.places(arc, range);
        let mut values = [DVec2::ZERO; ModulationQuadrature::MAX_PLACES];
        for (value, x) in values.iter_mut().zip(&places[..count]) {
            *value = sound.value(*x);
        }
        let by_one = sound.along_by(quadrature, arc, range, ends.each_ref(), &values);
        assert_eq!(by_one, found);
    }
    (found, quadrature.is_some())
}

/// White noise of 40 samples per wavelength: the integrator halves panels where it sees noise, in
/// both interfaces. Half of the sums are accurate to a thirtieth, and nearly all to a quarter.
#[test]
fn noise_that_is_finer_than_sound_is_integrated_to_its_order() {
    let mut random = Random(8);
    let size = [121, 3, 3];
    let mut pair = || random.vector().to_array();
    let samples = SoundSamples {
        size,
        bounds: Aabb::new(DVec3::splat(-1.5), DVec3::splat(1.5)),
        placement: Placement::Nodes,
        amplitude: (0..size.iter().product())
            .map(|_| pair())
            .map(|[re, im, _]| [0.01 * re as f32, 0.01 * im as f32])
            .collect(),
        n0: N0,
        frequency: 1e6,
        wavelength: TAU / K,
        noise: 0.0,
    };
    let field = SampledSound::new(samples).unwrap();
    let sound = Modulation::of(&field.into()).unwrap();
    let mut errors = Vec::new();
    for i in 0..200 {
        let length = 0.1 + 0.005 * f64::from(i);
        let start = DVec3::new(-1.2 + 0.004 * f64::from(i), 0.2, 0.1);
        let arc = Arc::line(start, DVec3::X * N0, length / N0);
        let (found, single) = along(&sound, &arc, [0.0, 1.0]);
        assert!(single);
        let value = |i: i32| sound.value(arc.position((f64::from(i) + 0.5) / 5_000.0));
        let expected = (0..5_000).map(value).sum::<DVec2>() * (0.5 * arc.h() / 5_000.0);
        errors.push((found - expected).length() / (0.01 * length));
    }
    errors.sort_by(f64::total_cmp);
    let [half, most] = [100, 190].map(|i| errors[i]);
    println!("{half}, {most}, {}", errors[199]);
    assert!(half < 0.033 && most < 0.25);
}

/// Integrals along straight and curved arcs, shorter and much longer than a wavelength, agree with
/// sums of 20 000 terms.
#[test]
fn integrals_along_arcs_are_those_of_fine_sums() {
    let (mut worst, mut singles) = (0.0_f64, 0);
    for (field, bound) in [(turning(0.01), 1e-4), (plane(0.01), 1e-4)] {
        let sound = Modulation::of(&field).unwrap();
        for (i, x) in points().into_iter().enumerate() {
            let length = [0.05, 0.3, 1.0, 2.5][i % 4];
            let v = (DVec3::splat(0.1) - x).normalize() * N0;
            let h = length / N0;
            let bend = DVec3::new(0.3, -0.4, 0.2);
            let arc = if i % 3 == 0 {
                Arc::line(x, v, h)
            } else {
                let end = [x + v * h + bend * (h * h / 2.0), v + bend * h, bend];
                Arc::hermite([x, v, bend], end, h)
            };
            let to = if i % 2 == 0 { 1.0 } else { 0.63 };
            let ends = [0.0, to].map(|theta| sound.at(arc.position(theta)));
            let (found, single) = along(&sound, &arc, [0.0, to]);
            singles += u32::from(single);
            // Tabulate the integral by shorter panels: it is then known at every position between
            // them, with lower accuracy within panels.
            let mut panels = Vec::new();
            let tabulated = sound.tabulate(&arc, [0.0, to], &ends, |p| panels.push(p));
            let error = (tabulated - found).length() / (0.01 * length * to);
            assert!(error < 2.0 * bound, "{i}, tabulated: {error}");
            for share in [0.1, 0.5, 0.77, 1.0] {
                let theta = share * to;
                let panel = panels.iter().find(|panel| panel.end() >= theta).unwrap();
                let (expected, _) = along(&sound, &arc, [0.0, theta]);
                let error = (panel.until(theta) - expected).length() / (0.01 * length * to);
                assert!(error < 10.0 * bound, "{i}, up to {share}: {error}");
            }
            let n = 20_000;
            let sum: DVec2 = (0..n)
                .map(|j| {
                    let theta = to * (f64::from(j) + 0.5) / f64::from(n);
                    sound.at(arc.position(theta)).n2
                })
                .sum();
            let expected = sum * (0.5 * h * to / f64::from(n));
            let error = (found - expected).length() / (0.01 * length * to);
            worst = worst.max(error / bound);
            assert!(error < bound, "{i}: {error}");
        }
    }
    println!("largest error: {worst} of the bound");
    assert!((1..100).contains(&singles), "{singles}");
}

/// The integrator gives up on a wavelength far below the length of an arc instead of summing
/// without limit.
#[test]
fn too_fine_a_sound_is_given_up() {
    let mode = AcousticMode::new(0.01, 0, 1e9, 0.0).unwrap();
    let field = Acoustic::new(N0, DVec3::ZERO, DVec3::Z, DVec3::X, vec![mode]).unwrap();
    let sound = Modulation::of(&field.into()).unwrap();
    let arc = Arc::line(DVec3::ZERO, DVec3::X, 1.0);
    let ends = [0.0, 1.0].map(|theta| sound.at(arc.position(theta)));
    assert!(sound.along(&arc, [0.0, 1.0], &ends).is_nan());
    assert!(sound.quadrature(&arc, [0.0, 1.0]).is_none());
    for h in [f64::NAN, f64::INFINITY] {
        let arc = Arc::line(DVec3::ZERO, DVec3::X, h);
        assert!(sound.quadrature(&arc, [0.0, 1.0]).is_none());
        assert!(sound.along(&arc, [0.0, 1.0], &ends).is_nan());
    }
}
