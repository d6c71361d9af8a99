//! Sound in time: standing and rotating waves, and their wavelengths.

use crate::common::{CENTER, Random, rigid};
use glam::{DAffine3, DMat3, DVec3};
use morgana_eikonal::field::*;
use morgana_eikonal::{Aabb, Field};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

const K: f64 = 6.0;

fn around_z(modes: Vec<AcousticMode>) -> Field {
    let field = Acoustic::new(1.33, DVec3::ZERO, DVec3::Z, DVec3::X, modes);
    field.unwrap().into()
}

fn mode(phase: f64, time_phase: f64) -> AcousticMode {
    let mode = AcousticMode::new(0.02, 2, K, phase).unwrap();
    mode.with_time_phase(time_phase).unwrap()
}

fn points() -> Vec<DVec3> {
    let mut random = Random(5);
    (0..100).map(|_| random.vector() * 2.0 - 1.0).collect()
}

/// The amplitude at phase ωt is Δ cos(ωt + τ), whatever fields surround the wave. At phase 0 the
/// field is bit-identical to the original.
#[test]
fn a_standing_wave_oscillates_in_place() {
    let still = around_z(vec![mode(0.3, 0.0)]);
    let wrapped = |field: Field| -> Field {
        let sum = Sum::new(1.33, vec![field, Constant::new(1.34).into()]).unwrap();
        let moved = Affine::new(sum.into(), rigid()).unwrap();
        Scaled::new(moved.into(), 1.01).unwrap().into()
    };
    for (tau, phase) in [(0.0, 0.0), (0.0, 0.7), (0.4, 2.0), (-1.0, PI)] {
        let amplitude = AcousticMode::new(0.02 * (phase + tau).cos(), 2, K, 0.3).unwrap();
        let expected = around_z(vec![amplitude]);
        let found = around_z(vec![mode(0.3, tau)]).at_phase(phase);
        let (wrapped_found, wrapped_expected) = (
            wrapped(around_z(vec![mode(0.3, tau)])).at_phase(phase),
            wrapped(expected.clone()),
        );
        for x in points() {
            assert_eq!(found.n2(x), expected.n2(x));
            assert_eq!(wrapped_found.n2(x), wrapped_expected.n2(x));
            assert_eq!(still.at_phase(0.0).n2(x), still.n2(x));
        }
    }
}

/// The sum cos mφ cos ωt + sin mφ sin ωt equals cos(mφ − ωt): the pattern of order m = 2 rotates by
/// ωt/2.
#[test]
fn two_modes_make_a_wave_that_turns() {
    let field = around_z(vec![mode(0.0, 0.0), mode(-FRAC_PI_2, -FRAC_PI_2)]);
    let still = around_z(vec![mode(0.0, 0.0)]);
    for phase in [0.0, 0.5, 1.7, 3.9] {
        let turned = field.at_phase(phase);
        let back = DMat3::from_rotation_z(-0.5 * phase);
        for x in points() {
            assert!((turned.n2(x) - still.n2(back * x)).abs() < 1e-14);
        }
    }
}

#[test]
fn bad_phases_are_refused() {
    let mode = AcousticMode::new(0.02, 2, K, 0.0).unwrap();
    assert!(mode.with_time_phase(f64::NAN).is_err());
    // A mode that vanishes at one instant is loud at another, and is refused for its amplitude.
    let loud = AcousticMode::new(2.0, 0, K, 0.0).unwrap();
    let silent = loud.with_time_phase(FRAC_PI_2).unwrap();
    let field = Acoustic::new(1.33, DVec3::ZERO, DVec3::Z, DVec3::X, vec![silent]);
    assert!(field.is_err());
}

#[test]
fn wavelengths_follow_transforms() {
    let field = around_z(vec![mode(0.0, 0.0)]);
    let close = |field: &Field, expected: f64| {
        let [shortest, longest] = field.sound_wavelengths().unwrap();
        assert_eq!(shortest, longest);
        assert!((shortest - expected).abs() < 1e-12);
    };
    close(&field, TAU / K);
    let larger = DAffine3::from_scale(DVec3::splat(1.7));
    close(
        &Affine::new(field.clone(), larger).unwrap().into(),
        1.7 * TAU / K,
    );
    close(&Scaled::new(field.clone(), 1.1).unwrap().into(), TAU / K);
    let other = AcousticMode::new(0.01, 0, 2.0 * K, 0.0).unwrap();
    let both = Sum::new(1.33, vec![field, around_z(vec![other])]).unwrap();
    assert_eq!(
        Field::from(both).sound_wavelengths(),
        Some([PI / K, TAU / K])
    );
    let bump = Gaussian::new(1.33, 0.1, CENTER, 0.4).unwrap();
    assert_eq!(Field::from(bump).sound_wavelengths(), None);
}

/// Tests samples of the complex amplitude of a rotating wave, cos mφ cos ωt + sin mφ sin ωt. Its
/// index at every phase agrees to within the error of splines of 21 samples per wavelength (limit
/// 3e-4 of the amplitude; measured 1.7e-4).
#[test]
fn sampled_sound_is_the_wave_of_which_it_has_samples() {
    let amplitude = 0.02;
    let field = around_z(vec![mode(0.0, 0.0), mode(-FRAC_PI_2, -FRAC_PI_2)]);
    let size = [41; 3];
    let bounds = Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0));
    let at = |i: usize| {
        let place = [i % 41, i / 41 % 41, i / 1681].map(|k| -1.0 + 2.0 * k as f64 / 40.0);
        DVec3::from(place)
    };
    // The index at ωt = 0 contains the real part, and the index at −π/2 the imaginary part.
    let [now, before] = [field.clone(), field.at_phase(-FRAC_PI_2)];
    let pair = |i: usize| [&now, &before].map(|f| (f.n(at(i)) - 1.33) as f32);
    let samples = SoundSamples {
        size,
        bounds,
        placement: Placement::Nodes,
        amplitude: (0..41 * 41 * 41).map(pair).collect(),
        n0: 1.33,
        frequency: 1e6,
        wavelength: TAU / K,
        noise: 0.0,
    };
    let sampled = Field::from(SampledSound::new(samples.clone()).unwrap());
    let sound = Sound {
        elasto_optic: None,
        frequency: Some(1e6),
        wavelength: TAU / K,
    };
    assert_eq!(sampled.sounds(), [sound]);
    for phase in [0.0, 0.7, FRAC_PI_2, 4.0] {
        let (expected, found) = (field.at_phase(phase), sampled.at_phase(phase));
        let error = points()
            .into_iter()
            .map(|x| (expected.n(x) - found.n(x)).abs());
        let largest = error.fold(0.0, f64::max);
        println!("{phase}: {largest:.1e}");
        assert!(largest < 3e-4 * amplitude, "{phase}: {largest}");
    }
    let silent = |more: SoundSamples| SampledSound::new(more).is_err();
    assert!(silent(SoundSamples {
        n0: 0.005,
        ..samples.clone()
    }));
    assert!(silent(SoundSamples {
        wavelength: 0.0,
        ..samples.clone()
    }));
    assert!(silent(SoundSamples {
        frequency: 0.0,
        ..samples.clone()
    }));
    for noise in [-1.0, f64::NAN] {
        assert!(silent(SoundSamples {
            noise,
            ..samples.clone()
        }));
    }
    assert!(silent(SoundSamples {
        size: [40, 41, 41],
        ..samples
    }));
}
