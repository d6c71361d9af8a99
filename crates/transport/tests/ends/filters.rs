//! Filters.

use crate::support::FALSE_ALARM;
use morgana_transport::film::Filter;
use std::f64::consts::PI;
use testkit::{Family, Mass, Rng, Table, uniform_edges};

const FILTERS: [(&str, Filter); 5] = [
    ("box", Filter::Box),
    ("tent", Filter::Tent { radius: 1.0 }),
    ("wide tent", Filter::Tent { radius: 2.3 }),
    ("Gaussian", Filter::Gaussian { stddev: 0.5 }),
    ("narrow Gaussian", Filter::Gaussian { stddev: 0.2 }),
];

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
    }
}

#[test]
fn filters_are_sampled_by_their_density() {
    let mut family = Family::new(FALSE_ALARM);
    for (name, filter) in FILTERS {
        let radius = filter.radius();
        // Half the bins lie beyond the support.
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
    for (name, filter) in FILTERS {
        let radius = filter.radius();
        for i in 0..100 {
            let x = radius * (i as f64 / 50.0 - 1.0);
            let error = filter.pdf(x) - shape(filter, x);
            assert!(error.abs() < 1e-12, "{name} at {x}: {error}");
        }
        for beyond in [-1.0001, 1.0001, 3.0] {
            assert_eq!(filter.pdf(radius * beyond), 0.0, "{name}");
        }
    }
}

/// Positions on the borders of pixels included.
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
