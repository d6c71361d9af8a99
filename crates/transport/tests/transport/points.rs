//! Points of replicates: each uniform, together evenly distributed, and independent between
//! replicates.
//!
//! False alarms: 5e-4 for the family of χ² tests, and for pairings. The other tests are exact.

use morgana_transport::sampling::{Purpose, Replicates, Sampler};
use testkit::z_test::max_abs_z;
use testkit::{Family, Mass, Moments, Table, uniform_edges};

const FALSE_ALARM: f64 = 5e-4;
/// Kinds of replicates, with the number of points in a replicate.
const KINDS: [(Replicates, u64); 4] = [kind(2), kind(8), kind(64), kind(1024)];
/// Number of edges with evenly distributed numbers.
const EDGES: u32 = 4;

/// Kinds of replicates in which an even distribution is no coincidence.
const PROPER: [(Replicates, u64); 3] = [kind(8), kind(64), kind(1024)];

const fn kind(size: u64) -> (Replicates, u64) {
    (Replicates::new(size).unwrap(), size)
}

/// Draws the two numbers for a purpose, or one number and its neighbour's.
fn draw(replicates: Replicates, address: [u64; 3], edge: u32, purpose: Purpose) -> [f64; 2] {
    let mut sampler = Sampler::in_replicates(replicates, address);
    (0..edge).for_each(|_| sampler.next_edge());
    sampler.next_2d_for(purpose)
}

/// Returns the points of a replicate.
fn replicate(replicates: Replicates, pixel: u64, edge: u32, purpose: Purpose) -> Vec<[f64; 2]> {
    let samples = 3 * replicates.size()..4 * replicates.size();
    samples
        .map(|sample| draw(replicates, [7, pixel, sample], edge, purpose))
        .collect()
}

/// All divisions of the square into as many boxes as there are points.
fn shapes(size: u64) -> impl Iterator<Item = [u64; 2]> {
    let columns = (1..size).map(|k| 1 << k).take_while(move |c| *c < size);
    columns.map(move |columns| [columns, size / columns])
}

/// True if each of `columns` times `rows` cells of the unit square contains one point.
fn is_even(points: &[[f64; 2]], [columns, rows]: [u64; 2]) -> bool {
    let cell = |[x, y]: &[f64; 2]| {
        let [column, row] = [x * columns as f64, y * rows as f64].map(|v| v as u64);
        row * columns + column
    };
    let mut cells: Vec<u64> = points.iter().map(cell).collect();
    cells.sort_unstable();
    cells == (0..columns * rows).collect::<Vec<_>>()
}

#[test]
fn every_number_of_a_set_is_spread_evenly() {
    use Purpose::*;
    let purposes = [
        Direction,
        Distance,
        ConnectionEnd,
        Emitter,
        AroundAim,
        AroundEmitter,
        Channel,
        Lens,
        Specular,
    ];
    for (pixel, purpose) in (0..200).flat_map(|pixel| purposes.map(|purpose| (pixel, purpose))) {
        for (edge, (replicates, size)) in (0..EDGES).flat_map(|edge| KINDS.map(|kind| (edge, kind)))
        {
            let points = replicate(replicates, pixel, edge, purpose);
            assert!(is_even(&points, [size, 1]), "{purpose:?} {edge}");
            assert!(is_even(&points, [1, size]), "{purpose:?} {edge}");
        }
    }
}

/// The first numbers of a group are a (0, m, 3)-net in base 2.
#[test]
fn directions_and_distances_are_spread_evenly_together() {
    for (pixel, (replicates, size)) in (0..50).flat_map(|pixel| KINDS.map(|kind| (pixel, kind))) {
        let directions = replicate(replicates, pixel, 1, Purpose::Direction);
        let distances = replicate(replicates, pixel, 1, Purpose::Distance);
        let points = directions.iter().zip(&distances);
        let points: Vec<[f64; 3]> = points.map(|([a, b], [c, _])| [*a, *b, *c]).collect();
        for [rows, more] in shapes(2 * size) {
            for columns in (0..11)
                .map(|k| 1 << k)
                .filter(|c| more % c == 0 && more > *c)
            {
                let sizes = [rows / 2, columns, more / columns];
                let cell = |point: &[f64; 3]| {
                    let places = point.iter().zip(sizes);
                    places.fold(0, |sum, (x, size)| sum * size + (x * size as f64) as u64)
                };
                let mut cells: Vec<u64> = points.iter().map(cell).collect();
                cells.sort_unstable();
                assert_eq!(
                    cells,
                    (0..size).collect::<Vec<_>>(),
                    "{replicates:?} {sizes:?}"
                );
            }
        }
    }
}

/// Numbers of different groups are paired at random: over a replicate, the mean product of two
/// signs has the variance 1/(N − 1) for N points, as without replacement. A
/// fixed pairing would give 1.
#[test]
fn groups_are_paired_at_random() {
    let sign = |x: f64| (x - 0.5).signum();
    let others = [
        (1, Purpose::ConnectionEnd),
        (1, Purpose::Channel),
        (2, Purpose::Direction),
    ];
    let z = |(edge, other): (u32, Purpose), (replicates, size): (Replicates, u64)| {
        let mut squares = Moments::default();
        for pixel in 0..(160_000 / size).max(2000) {
            let pairs = replicate(replicates, pixel, 1, Purpose::Direction)
                .into_iter()
                .zip(replicate(replicates, pixel, edge, other));
            let sum: f64 = pairs.map(|(a, b)| sign(a[0]) * sign(b[0])).sum();
            squares.push((sum / size as f64).powi(2));
        }
        squares.z(1.0 / (size - 1) as f64)
    };
    let zs = others.map(|other| PROPER.map(|kind| z(other, kind)));
    max_abs_z(zs.as_flattened(), FALSE_ALARM).unwrap();
}

#[test]
fn places_on_emitters_are_spread_evenly_over_the_square() {
    for purpose in [Purpose::ConnectionEnd, Purpose::AroundAim, Purpose::Channel] {
        for (pixel, (replicates, size)) in
            (0..200).flat_map(|pixel| KINDS.map(|kind| (pixel, kind)))
        {
            let points = replicate(replicates, pixel, 1, purpose);
            assert!(shapes(size).all(|shape| is_even(&points, shape)));
        }
    }
}

#[test]
fn numbers_of_late_edges_and_without_a_purpose_are_not_spread() {
    for (replicates, size) in PROPER {
        let even = |points: &[[f64; 2]]| is_even(points, [size, 1]);
        // At random 8!/8⁸ = 0.24 % of them are even, and far fewer of sixty-four.
        let late = (0..200)
            .filter(|&pixel| even(&replicate(replicates, pixel, EDGES, Purpose::Direction)));
        assert!(late.count() < 5);
        let plain = |pixel| {
            let samplers = (0..size).map(|i| Sampler::in_replicates(replicates, [7, pixel, i]));
            samplers.map(|mut s| s.next_2d()).collect::<Vec<_>>()
        };
        assert!((0..200).filter(|&pixel| even(&plain(pixel))).count() < 5);
    }
}

#[test]
fn single_samples_are_those_of_the_plain_sampler() {
    let mut plain = Sampler::new(1, 2, 3);
    let mut single = Sampler::in_replicates(Replicates::SINGLE, [1, 2, 3]);
    for _ in 0..6 {
        assert_eq!(plain.next_1d(), single.next_1d_for(Purpose::Distance));
        assert_eq!(plain.next_2d(), single.next_2d_for(Purpose::ConnectionEnd));
        single.next_edge();
    }
}

/// Pairs of numbers are uniform in the square.
#[test]
fn points_are_uniform_and_replicates_independent() {
    let mut family = Family::new(FALSE_ALARM);
    for (replicates, size) in KINDS {
        uniform_and_independent(&mut family, (replicates, size));
    }
    family.check().unwrap();
}

fn uniform_and_independent(family: &mut Family, (replicates, size): (Replicates, u64)) {
    type Pair<'a> = &'a dyn Fn(u64) -> [f64; 2];
    let pairs: [(&str, Pair<'_>); 7] = [
        ("numbers of one purpose", &|i| {
            draw(replicates, [1, i, 3], 0, Purpose::Direction)
        }),
        ("numbers of two groups", &|i| {
            let mut sampler = Sampler::in_replicates(replicates, [1, i, 5]);
            [Purpose::Distance, Purpose::Channel].map(|p| sampler.next_1d_for(p))
        }),
        ("numbers of two edges", &|i| {
            let mut sampler = Sampler::in_replicates(replicates, [1, i, 6]);
            [0, 1].map(|_| {
                sampler.next_edge();
                sampler.next_1d_for(Purpose::Distance)
            })
        }),
        ("replicates of a pixel", &|i| {
            [0, size].map(|more| {
                draw(
                    replicates,
                    [1, 9, 2 * size * i + more],
                    0,
                    Purpose::Distance,
                )[0]
            })
        }),
        ("pixels", &|i| {
            [0, 1].map(|more| draw(replicates, [1, 2 * i + more, 0], 0, Purpose::Distance)[0])
        }),
        ("seeds", &|i| {
            [0, 1].map(|more| draw(replicates, [2 * i + more, 0, 0], 0, Purpose::Distance)[0])
        }),
        // Positions within the strata: later digits.
        ("remainders in a replicate", &|i| {
            [0, 1].map(|more| {
                (size as f64 * draw(replicates, [1, i, more], 0, Purpose::Distance)[0]).fract()
            })
        }),
    ];
    for (name, pair) in pairs {
        let mut i = 0;
        let next = |_: &mut testkit::Rng| {
            i += 1;
            Some(pair(i))
        };
        let table = Table::new(uniform_edges(0.0, 1.0, 16), uniform_edges(0.0, 1.0, 16));
        let report = table.test(0, 50_000, Mass::Exactly(1.0), next, |_| 1.0);
        family.push(format!("{name}, {replicates:?}"), report.unwrap().p_value);
    }
}
