//! Reconstruction filters.

use crate::ends::support::FALSE_ALARM;
use morgana_transport::film::{Filter, SignedFilter};
use std::f64::consts::PI;
use testkit::{Family, Mass, Rng, Table, uniform_edges};

const POSITIVE: [(&str, Filter); 5] = [
    ("box", Filter::Box),
    ("tent", Filter::Tent { radius: 1.0 }),
    ("wide tent", Filter::Tent { radius: 2.3 }),
    ("Gaussian", Filter::Gaussian { stddev: 0.5 }),
    ("narrow Gaussian", Filter::Gaussian { stddev: 0.2 }),
];

fn cubic(b: f64, c: f64) -> Filter {
    Filter::Signed(SignedFilter::cubic(b, c))
}

fn lanczos(lobes: u8) -> Filter {
    Filter::Signed(SignedFilter::lanczos(lobes))
}

/// Filters with negative lobes, and a spline, which has none.
fn signed() -> [(&'static str, Filter); 5] {
    [
        ("Mitchell", cubic(1.0 / 3.0, 1.0 / 3.0)),
        ("Catmull-Rom", cubic(0.0, 0.5)),
        ("cubic spline", cubic(1.0, 0.0)),
        ("Lanczos", lanczos(3)),
        ("short Lanczos", lanczos(2)),
    ]
}

/// The filter's shape in closed form.
fn shape(filter: Filter, x: f64) -> f64 {
    match filter {
        Filter::Box => 1.0,
        Filter::Tent { radius } => (1.0 - x.abs() / radius) / radius,
        Filter::Gaussian { stddev } => {
            // Normalised over ±4 standard deviations.
            let mass = 0.999_936_657_516_334;
            (-0.5 * (x / stddev).powi(2)).exp() / (stddev * (2.0 * PI).sqrt() * mass)
        }
        Filter::Signed(_) => unreachable!("its values are tested below"),
    }
}

#[test]
fn filters_are_sampled_by_their_density() {
    let mut family = Family::new(FALSE_ALARM);
    for (name, filter) in POSITIVE.into_iter().chain(signed()) {
        let radius = filter.radius();
        // Half of the bins lie beyond the support.
        let edges = uniform_edges(-2.0 * radius, 2.0 * radius, 32);
        let report = Table::new(edges.clone(), edges)
            .with_mass_tolerance(1e-6)
            .test(
                2,
                200_000,
                Mass::Exactly(1.0),
                |rng| Some(rng.uniform::<2>().map(|u| filter.sample(u))),
                |[x, y]| filter.pdf(x) * filter.pdf(y),
            )
            .unwrap();
        family.push(name, report.p_value);
    }
    family.check().unwrap();
}

#[test]
fn densities_of_filters_are_their_shapes() {
    for (name, filter) in POSITIVE {
        let radius = filter.radius();
        for i in 0..100 {
            let x = radius * (i as f64 / 50.0 - 1.0);
            let error = filter.pdf(x) - shape(filter, x);
            assert!(error.abs() < 1e-12, "{name} at {x}: {error}");
            assert_eq!((filter.value(x), filter.weight(x)), (filter.pdf(x), 1.0));
        }
        for beyond in [-1.0001, 1.0001, 3.0] {
            assert_eq!(filter.pdf(radius * beyond), 0.0, "{name}");
        }
    }
}

/// Tests positions on the borders of pixels, too.
#[test]
fn the_box_gives_each_position_to_one_pixel() {
    let width = 7;
    let mut rng = Rng::new(8);
    let random = (0..10_000).map(|_| rng.next_1d());
    let borders = (0..width).map(|i| f64::from(i) / f64::from(width));
    let beside = borders.clone().flat_map(|s| [s.next_up(), s.next_down()]);
    let tiny = [f64::MIN_POSITIVE, 1e-20, 1f64.next_down()];
    let positions = random.chain(borders.clone()).chain(beside).chain(tiny);
    for s in positions {
        let at = s * f64::from(width);
        let owners = (-1..=width).filter(|&c| Filter::Box.pdf(at - (f64::from(c) + 0.5)) > 0.0);
        assert_eq!(owners.count(), 1, "position {s}");
    }
}

/// Values by hand from Mitchell and Netravali's cubics and the window. Cubics shifted by whole
/// pixels add up to one everywhere.
#[test]
fn filters_with_negative_lobes_have_their_values() {
    let mitchell = cubic(1.0 / 3.0, 1.0 / 3.0);
    let values = [(0.0, 8.0 / 9.0), (1.0, 1.0 / 18.0), (-1.5, -5.0 / 144.0)];
    for (x, expected) in values {
        assert!((mitchell.value(x) - expected).abs() < 1e-5, "{x}");
    }
    for (name, filter) in signed().into_iter().take(3) {
        for x in (0..10).map(|i| f64::from(i) / 10.0) {
            let sum: f64 = (-3..3).map(|k| filter.value(x + f64::from(k))).sum();
            assert!((sum - 1.0).abs() < 1e-5, "{name} at {x}: {sum}");
        }
    }
    let ratio = |x: f64| lanczos(3).value(x) / lanczos(3).value(0.0);
    let expected = 2.0 / PI * (PI / 6.0).sin() / (PI / 6.0);
    assert!((ratio(0.5) - expected).abs() < 1e-12);
    assert!(ratio(1.0).abs() < 1e-12 && ratio(1.5) < -0.1 && ratio(3.1) == 0.0);
}

/// Means of weights, and of their products with squared offsets, are the integrals of the filter
/// and of its second moment. The second moment is 1/3 for the cubic spline, and 0 for Catmull and
/// Rom's cubics, which leave quadratic images unchanged.
#[test]
fn weighted_samples_are_the_filter() {
    let count = 1 << 20;
    let moment = |filter: Filter, power: i32| {
        let at = |i: i32| filter.sample((f64::from(i) + 0.5) / f64::from(count));
        let of = |x: f64| filter.weight(x) * x.powi(power);
        (0..count).map(|i| of(at(i))).sum::<f64>() / f64::from(count)
    };
    for (name, filter) in signed() {
        let (mass, mean) = (moment(filter, 0), moment(filter, 1));
        assert!((mass - 1.0).abs() < 1e-4, "{name}: {mass}");
        assert!(mean.abs() < 1e-9, "{name}: {mean}");
    }
    let seconds = [(cubic(0.0, 0.5), 0.0), (cubic(1.0, 0.0), 1.0 / 3.0)];
    for (filter, expected) in seconds {
        let second = moment(filter, 2);
        assert!((second - expected).abs() < 1e-3, "{second}, not {expected}");
    }
}

/// Half of the range that the density of Hermite's cubics could have is zero.
#[test]
fn weights_are_finite_where_the_filter_ends() {
    let hermite = cubic(0.0, 0.0);
    for u in [0.0, f64::MIN_POSITIVE, 0.5, 1f64.next_down()] {
        assert!(hermite.weight(hermite.sample(u)).is_finite(), "{u}");
    }
    for offset in [-2.0, -1.0, 1.0, 1.5, 2.0] {
        assert!(hermite.weight(offset).is_finite(), "{offset}");
    }
}
