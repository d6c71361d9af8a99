//! Noise of samples, mainly from rounding: its effect on derivatives, and smoothing splines that
//! ignore it.
//!
//! The atmosphere n = 1 + 2.73e-4 exp(−z/8 km) is sampled every 0.25 km. Rays bend correctly if the
//! samples are in double precision, but not if they are in single precision.

use glam::DVec3;
use morgana_eikonal::field::{Bspline, Field, Placement};
use morgana_eikonal::ray::{StopCondition, march};
use morgana_eikonal::{Aabb, Tolerance};

const HEIGHT: f64 = 8.0;
const SPACING: f64 = 0.25;
const SAMPLES: usize = 321;
/// Standard deviation of rounding to single precision between 1 and 2.
const ROUNDING: f64 = 1.192_092_895_507_812_5e-7 / 3.464_101_615_137_754_6;

fn index(z: f64) -> f64 {
    1.0 + 2.73e-4 * (-z / HEIGHT).exp()
}

fn bounds() -> Aabb {
    let top = SPACING * (SAMPLES - 1) as f64;
    Aabb::new(DVec3::new(-1e3, -1e3, 0.0), DVec3::new(1e3, 1e3, top))
}

fn rounded() -> Vec<f32> {
    let sample = |i: usize| index(SPACING * i as f64) as f32;
    (0..SAMPLES).map(sample).collect()
}

fn from(samples: Vec<f32>, noise: f64) -> Bspline {
    let dims = [1, 1, samples.len()];
    Bspline::from_vec(dims, bounds(), Placement::Nodes, samples, |n| n, noise).unwrap()
}

fn exact() -> Bspline {
    let dims = [1, 1, SAMPLES];
    Bspline::from_fn(dims, bounds(), Placement::Nodes, |x| index(x.z)).unwrap()
}

/// Returns the angles by which horizontal rays at several heights turn over 100 km.
fn bending(field: &Field) -> Vec<f64> {
    let turn = |i: i32| {
        let x = DVec3::new(-50.0, 0.0, 4.1 + f64::from(i));
        let tolerance = Tolerance::new(1e-9);
        let stop = StopCondition::ArcLength(100.0);
        let end = march(field, x, DVec3::X, &stop, 200.0, tolerance, |_, _| ());
        end.v.angle_between(DVec3::X)
    };
    (0..12).map(turn).collect()
}

/// Returns the root mean square of relative differences.
fn error(found: &[f64], exact: &[f64]) -> f64 {
    let squares = found.iter().zip(exact).map(|(f, e)| (f / e - 1.0).powi(2));
    (squares.sum::<f64>() / exact.len() as f64).sqrt()
}

#[test]
fn bending_from_single_precision_is_mended_by_smoothing() {
    let exact = bending(&exact().into());
    let rough = error(&bending(&from(rounded(), 0.0).into()), &exact);
    let smooth = error(&bending(&from(rounded(), ROUNDING).into()), &exact);
    assert!(rough > 1e-3, "{rough}");
    assert!(smooth < 1e-3 && smooth < 0.05 * rough, "{rough} {smooth}");
}

/// The reported fractions of noise in derivatives agree with the differences between derivatives
/// with rounding and without.
#[test]
fn shares_of_noise_are_what_they_say() {
    let (rough, exact) = (from(rounded(), 0.0), Field::from(exact()));
    let shares = rough.noise_shares(ROUNDING);
    let rough = Field::from(rough);
    let (mut noise, mut total) = ([0.0; 2], [0.0; 2]);
    // Leave out the top: samples there are all equal and have no noise.
    for i in 5..SAMPLES / 2 {
        let x = DVec3::new(0.0, 0.0, SPACING * i as f64);
        let [a, b] = [&rough, &exact].map(|field| field.jet(x));
        let pairs = [(a.grad.z, b.grad.z), (a.hess.z_axis.z, b.hess.z_axis.z)];
        for (k, (a, b)) in pairs.into_iter().enumerate() {
            noise[k] += (a - b).powi(2);
            total[k] += a.powi(2);
        }
    }
    let found = [0, 1].map(|k| f64::sqrt(noise[k] / total[k]));
    for (found, stated) in found.into_iter().zip([shares.first, shares.second]) {
        assert!((0.5..2.0).contains(&(stated / found)), "{found} {stated}");
    }
    assert!(shares.fourth > 0.9, "{shares:?}");
    // No noise is reported for exact samples.
    let none = Bspline::from_fn([1, 1, SAMPLES], bounds(), Placement::Nodes, |x| index(x.z));
    assert!(none.unwrap().noise_shares(1e-16).first < 1e-9);
}

/// Smoothing keeps a cubic n² for any assumed noise, and it keeps structure that is stronger than
/// the noise.
#[test]
fn smoothing_keeps_what_is_no_noise() {
    let cubic = |x: DVec3| (1.7 + 0.1 * x.x - 0.2 * x.x * x.y * x.y + 0.1 * x.z.powi(3)).sqrt();
    let cube = Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
    let dims = [24, 20, 18];
    let sample = |i: usize| {
        let at = [i % 24, i / 24 % 20, i / 480];
        let t = |a: usize| 2.0 * at[a] as f64 / (dims[a] - 1) as f64 - 1.0;
        cubic(DVec3::new(t(0), t(1), t(2)))
    };
    let samples: Vec<f64> = (0..24 * 20 * 18).map(sample).collect();
    let field = Bspline::smoothed(dims, cube, Placement::Nodes, &samples, 1e-3).unwrap();
    let field = Field::from(field);
    for i in 0..50 {
        let x = [0.754_877, 0.569_840, 0.438_579].map(|s| 1.8 * (s * f64::from(i) % 1.0) - 0.9);
        let x = DVec3::from_array(x);
        let error = (field.n(x) - cubic(x)).abs();
        assert!(error < 4e-7, "{x} {error}");
    }
    // Waves of four samples, with an amplitude a thousand times the noise.
    let wave = |i: usize| 1.3 + 1e-3 * (1.6 * i as f64).sin();
    let samples: Vec<f64> = (0..SAMPLES).map(wave).collect();
    let dims = [1, 1, SAMPLES];
    let field = Bspline::smoothed(dims, bounds(), Placement::Nodes, &samples, 1e-6).unwrap();
    let field = Field::from(field);
    for i in 5..SAMPLES - 5 {
        let x = DVec3::new(0.0, 0.0, SPACING * i as f64);
        assert!((field.n(x) - wave(i)).abs() < 4e-6, "{i}");
    }
}

/// The field is bit-identical whether the samples are converted in place or copied.
#[test]
fn samples_in_place_are_the_same_samples() {
    let cube = Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
    for dims in [[9, 8, 7], [1, 5, 2], [3, 1, 1], [31, 17, 33]] {
        let count = dims.iter().product();
        let sample = |i: usize| 1.3 + 0.1 * (1.7 * i as f64).sin();
        let samples: Vec<f32> = (0..count).map(|i| sample(i) as f32).collect();
        let elsewhere = Bspline::from_samples(dims, cube, Placement::Centers, &samples).unwrap();
        let inside = Bspline::from_vec(dims, cube, Placement::Centers, samples, |n| n, 0.0);
        let fields = [elsewhere, inside.unwrap()].map(Field::from);
        for i in 0..300 {
            let x = [0.754_877, 0.569_840, 0.438_579].map(|s| 3.0 * (s * f64::from(i) % 1.0) - 1.5);
            let [a, b] = fields.each_ref().map(|f| f.jet(DVec3::from_array(x)));
            assert_eq!(a, b);
        }
    }
    let wrong = Bspline::from_vec([2; 3], cube, Placement::Nodes, vec![1.0; 7], |n| n, 0.0);
    assert!(wrong.unwrap_err().to_string().contains("8 samples"));
    let negative = Bspline::from_vec([2; 3], cube, Placement::Nodes, vec![-1.0; 8], |n| n, 0.0);
    assert!(negative.is_err());
    for noise in [-1.0, f64::NAN, f64::INFINITY] {
        let samples = vec![1.3f32; 8];
        let elsewhere = Bspline::smoothed([2; 3], cube, Placement::Nodes, &samples, noise);
        let inside = Bspline::from_vec([2; 3], cube, Placement::Nodes, samples, |n| n, noise);
        for refused in [elsewhere, inside] {
            let message = refused.unwrap_err().to_string();
            let expected = format!("noise of samples must be 0 or more and finite, but is {noise}");
            assert_eq!(message, expected);
        }
    }
}
