//! Derivatives with respect to all parameters of all types of fields.

use super::*;
use crate::common::{Random, grid};
use glam::{DAffine3, DVec3};
use morgana_eikonal::Aabb;
use morgana_eikonal::connect::Unbounded;
use morgana_eikonal::field::*;

fn selfoc(p: &[f64]) -> Field {
    Selfoc::new(p[0], p[1], vector(&p[2..]), vector(&p[5..]))
        .unwrap()
        .into()
}

/// A field under a map to the world. The rows of the map follow the field's own `count` parameters.
fn moved(p: &[f64], count: usize, field: fn(&[f64]) -> Field) -> Field {
    let (own, map) = p.split_at(count);
    let column = |i: usize| DVec3::new(map[i], map[4 + i], map[8 + i]);
    let map = DAffine3::from_cols(column(0), column(1), column(2), column(3));
    Affine::new(field(own), map).unwrap().into()
}

fn moved_sum(p: &[f64]) -> Field {
    let (first, second) = (moved(&p[1..19], 6, gaussian), selfoc(&p[19..27]));
    let scaled = Scaled::new(second, p[27]).unwrap();
    Sum::new(p[0], vec![first, scaled.into()]).unwrap().into()
}

fn acoustic(p: &[f64]) -> Field {
    let modes = p[10..].chunks(4).zip([0, 3]).map(|(mode, order)| {
        let [amplitude, k, phase, time_phase] = mode.try_into().unwrap();
        let mode = AcousticMode::new(amplitude, order, k, phase).unwrap();
        mode.with_time_phase(time_phase).unwrap()
    });
    let [origin, direction, reference] = [1, 4, 7].map(|at| vector(&p[at..]));
    Acoustic::new(p[0], origin, direction, reference, modes.collect())
        .unwrap()
        .into()
}

fn formula(text: &str, names: &[&str], p: &[f64]) -> Field {
    let parameters: Vec<(&str, f64)> = names.iter().copied().zip(p.iter().copied()).collect();
    Formula::new(text, Quantity::Index, &parameters)
        .unwrap()
        .into()
}

fn table(coordinate: Coordinate, start: f64, p: &[f64]) -> Field {
    let samples: Vec<[f64; 2]> = (0..)
        .map(|i| start + 0.35 * f64::from(i))
        .zip(p)
        .map(|(u, n)| [u, *n])
        .collect();
    IndexProfile::table(coordinate, 0.0, &samples)
        .unwrap()
        .into()
}

/// Fields as functions of their parameters.
#[allow(clippy::type_complexity)]
fn families() -> Vec<(&'static str, Vec<f64>, fn(&[f64]) -> Field)> {
    let unit = DVec3::new(0.1, 0.05, 1.0).normalize();
    let across = DVec3::X.reject_from_normalized(unit).normalize();
    let [unit, across] = [unit, across].map(|v| v.to_array().to_vec());
    let bump = vec![1.3, 0.08, 0.1, -0.1, 0.05, 0.6];
    let rod = [vec![1.5, 0.4, 0.05, -0.02, 0.1], unit.clone()].concat();
    let map = [
        1.1, 0.2, 0.1, 0.05, -0.15, 0.9, 0.1, -0.04, 0.05, -0.1, 1.2, 0.02,
    ]
    .to_vec();
    let sum = [
        vec![1.35],
        bump.clone(),
        map.clone(),
        rod.clone(),
        vec![1.1],
    ]
    .concat();
    let modes = vec![0.03, 4.0, 0.4, 0.7, 0.02, 5.0, 1.1, -0.4];
    let standing = [vec![1.33, 0.03, 0.02, 0.0], unit, across, modes].concat();
    let profile = vec![1.5, 1.49, 1.46, 1.42, 1.4, 1.35, 1.33, 1.32];
    vec![
        ("constant", vec![1.3], |p| Constant::new(p[0]).into()),
        ("linear", vec![1.3, 0.1, -0.05, 0.08, 0.1, 0.2, -0.1], |p| {
            LinearIndex::new(p[0], vector(&p[1..]), vector(&p[4..]))
                .unwrap()
                .into()
        }),
        (
            "linear square",
            vec![1.3, 0.1, -0.05, 0.08, 0.1, 0.2, -0.1],
            |p| {
                LinearSquare::new(p[0], vector(&p[1..]), vector(&p[4..]))
                    .unwrap()
                    .into()
            },
        ),
        ("luneburg", vec![1.1, 0.1, 0.05, -0.1, 1.6], |p| {
            Luneburg::new(p[0], vector(&p[1..]), p[4]).unwrap().into()
        }),
        ("selfoc", rod, selfoc),
        ("fisheye", vec![1.9, 0.1, 0.05, -0.1, 1.6], |p| {
            Fisheye::new(p[0], vector(&p[1..]), p[4]).unwrap().into()
        }),
        ("gaussian", bump.clone(), gaussian),
        ("acoustic", standing, acoustic),
        ("expression", vec![1.3, 0.1, 0.7, 0.4], |p| {
            let text = "n0 + a*exp(-(x^2 + y^2)/w^2)*cos(k*z)";
            formula(text, &["n0", "a", "w", "k"], p)
        }),
        ("powers", vec![1.4, 0.1, 2.0, 3.0, 0.004], |p| {
            let text = "n0 - a*rho^g + b*pow(2 + x - y, m)";
            formula(text, &["n0", "a", "g", "m", "b"], p)
        }),
        ("formula of a distance", vec![1.5, 0.3, 2.5], |p| {
            formula("n0 - a*r^g", &["n0", "a", "g"], p)
        }),
        ("formula of a height", vec![1.4, 0.1], |p| {
            formula("n0 + a*tanh(z)", &["n0", "a"], p)
        }),
        ("table of a distance", profile.clone(), |p| {
            table(Coordinate::R, 0.0, p)
        }),
        ("table of a height", profile, |p| {
            table(Coordinate::Z, -1.3, p)
        }),
        ("moved", [bump, map].concat(), |p| moved(p, 6, gaussian)),
        ("sum of moved and scaled", sum, moved_sum),
    ]
}

#[test]
fn fields_by_their_parameters() {
    let by = IndexDerivative {
        n2: 0.7,
        gradient: DVec3::new(0.3, -0.5, 0.2),
    };
    let mut random = Random(3);
    let region = Aabb::new(DVec3::splat(-0.7), DVec3::splat(0.7));
    for (name, p, field) in families() {
        let known = field(&p).parameters();
        let values: Vec<f64> = known
            .iter()
            .flat_map(|known| known.values.clone())
            .collect();
        assert_eq!(values.len(), field(&p).parameter_count());
        let same =
            values.len() == p.len() && values.iter().zip(&p).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(same, "{name}: {values:?} {p:?}");
        for _ in 0..20 {
            let x = random.point(&region);
            let value = |p: &[f64]| {
                let (n2, gradient) = field(p).gradient(x);
                by.n2 * n2 + by.gradient.dot(gradient)
            };
            let here = field(&p);
            let mut sums = vec![0.0; here.sum_count()];
            here.add_parameter_derivative(x, by, &mut sums);
            // The forward-mode derivative agrees with the transposed reverse-mode derivative.
            let change: Vec<f64> = p.iter().map(|_| random.between(-1.0, 1.0)).collect();
            let of = here.index_change(x, &here.parameter_change(&change));
            let found = here.parameter_derivative(sums);
            let terms = found.iter().zip(&change).map(|(by, of)| by * of);
            let (reverse, size): (f64, f64) =
                terms.fold((0.0, 0.0), |(sum, size), v| (sum + v, size + v.abs()));
            let error = (by.n2 * of.n2 + by.gradient.dot(of.gradient) - reverse).abs();
            assert!(error < 1e-12 * size, "{name}: {error:e}");
            for (i, found) in found.iter().enumerate() {
                let expected = derivative(&p, i, 1e-3, value);
                let error = (found - expected).abs();
                assert!(
                    error < 1e-8 * (1.0 + expected.abs()),
                    "{name} {i}: {error:e}"
                );
            }
        }
    }
}

/// The scaled excess of a grid by its factor, from differences, and by the grid's samples, from
/// differences of the index law n = b + s (n₀ − b) along changes of n₀² and ∇n₀².
#[test]
fn excess_of_a_grid_by_its_parameters() {
    let (background, factor, h) = (1.2, 1.4, 1e-4);
    let unscaled: Field = grid(Placement::Nodes).into();
    let scaled = |s: f64| -> Field {
        Scaled::excess(grid(Placement::Nodes), background, s)
            .unwrap()
            .into()
    };
    let square = |n2: f64, gradient: DVec3| {
        let n = background + factor * (n2.sqrt() - background);
        (n * n, gradient * (factor * n / n2.sqrt()))
    };
    let field = scaled(factor);
    let own = field.parameter_count() - 1;
    assert_eq!(field.parameters()[1].name, "factor");
    assert_eq!(field.parameters()[1].values, [factor]);
    let mut random = Random(5);
    let region = Aabb::new(DVec3::splat(-0.7), DVec3::splat(0.7));
    for _ in 0..5 {
        let x = random.point(&region);
        let mut change: Vec<f64> = (0..own).map(|_| random.between(-1.0, 1.0)).collect();
        let of = unscaled.index_change(x, &unscaled.parameter_change(&change));
        let (n2, gradient) = unscaled.gradient(x);
        let ends = [h, -h].map(|h| square(n2 + h * of.n2, gradient + h * of.gradient));
        let by_samples = [ends[0].0 - ends[1].0, (ends[0].1 - ends[1].1).length()];
        let ends = [h, -h].map(|h| scaled(factor + h).gradient(x));
        let by_factor = [ends[0].0 - ends[1].0, (ends[0].1 - ends[1].1).length()];
        change.push(0.0);
        let mut only_factor = vec![0.0; own];
        only_factor.push(1.0);
        for (change, expected) in [(&change, by_samples), (&only_factor, by_factor)] {
            let found = field.index_change(x, &field.parameter_change(change));
            for (found, expected) in [found.n2, found.gradient.length()].iter().zip(expected) {
                // Central differences have errors of second order in h.
                let error = (found.abs() - expected.abs() / (2.0 * h)).abs();
                assert!(error < 1e-6 * (1.0 + found.abs()), "{found} {error:e}");
            }
            // Forward and reverse derivatives are transposes.
            let by = IndexDerivative {
                n2: 0.7,
                gradient: DVec3::new(0.3, -0.5, 0.2),
            };
            let mut sums = vec![0.0; field.sum_count()];
            field.add_parameter_derivative(x, by, &mut sums);
            let reverse = field.parameter_derivative(sums);
            let reverse: f64 = reverse.iter().zip(change).map(|(a, b)| a * b).sum();
            let forward = by.n2 * found.n2 + by.gradient.dot(found.gradient);
            assert!((forward - reverse).abs() < 1e-11, "{forward} {reverse}");
        }
    }
}

/// Integer powers of negative numbers keep their values if the exponent is a parameter with a
/// derivative.
#[test]
fn powers_of_negative_numbers() {
    let field = formula("1.5 + 0.1*x^m", &["m"], &[3.0]);
    let x = DVec3::new(-0.5, 0.1, 0.2);
    let (n2, _) = field.gradient(x);
    let n: f64 = 1.5 - 0.1 * 0.125;
    assert!((n2 - n * n).abs() < 1e-14);
    let change = field.index_change(x, &[1.0]).n2;
    let expected = 2.0 * n * 0.1 * -0.125 * 0.5_f64.ln();
    assert!((change - expected).abs() < 1e-14, "{change} {expected}");
}

#[test]
fn rays_by_parameters_and_starts() {
    let begin = [0.15, 0.1, -1.2, 0.1, 0.05, 1.0];
    for (name, p, field) in families() {
        let index = field(&p);
        let world = Unbounded(&index);
        let mut ray = AdjointRay::new(&world, PLANE, Tolerance::new(TIGHT_TOLERANCE), 10.0);
        ray.follow(start(&begin, ())).unwrap();
        let mut sum = ParameterDerivative::new((), &index);
        let back = ray.pull_back(&LOSS, &mut sum).unwrap();
        let found = index.parameter_derivative(sum.values);
        // Differences are less accurate for tables: third derivatives jump at the samples, so that
        // the error of a ray depends on its steps, which change with its start.
        let limit = if name.starts_with("table") {
            3e-5
        } else {
            1e-6
        };
        for (i, found) in found.iter().enumerate() {
            let of = |p: &[f64]| {
                loss(&follow(
                    &Unbounded(&field(p)),
                    PLANE,
                    TIGHT_TOLERANCE,
                    start(&begin, ()),
                ))
            };
            let expected = derivative(&p, i, 2e-3, of);
            let error = (found - expected).abs() / (0.1 + expected.abs());
            assert!(error < limit, "{name} {i}: {error:e}, {expected}");
        }
        // `begin[3..]` is not a unit vector. Its derivatives are the derivatives with respect to
        // the direction, divided by the length of the vector.
        let length = DVec3::from_slice(&begin[3..]).length();
        let found = [back.x, back.direction / length]
            .map(|d| d.to_array())
            .concat();
        for (i, found) in found.iter().enumerate() {
            let expected = derivative(&begin, i, 1e-3, |b| {
                loss(&follow(&world, PLANE, TIGHT_TOLERANCE, start(b, ())))
            });
            let error = (found - expected).abs() / (0.1 + expected.abs());
            assert!(error < limit, "{name}, start {i}: {error:e}, {expected}");
        }
    }
}
