//! Points of sets of samples: each uniform, together evenly spread, sets independent of one another.
//!
//! False alarms: 5e-4 for the family of χ² tests, and for pairings. The other tests are exact.

use testkit::z_test::max_abs_z;
use testkit::{Family, Mass, Moments, Table, uniform_edges};
use transport::sampling::{Purpose, Sampler, Sets};

const FALSE_ALARM: f64 = 5e-4;
const SIZE: u64 = 8;
/// Edges whose numbers are spread.
const EDGES: u32 = 4;

/// The two numbers for a purpose, or the one and that of its neighbour.
fn draw([seed, pixel, sample]: [u64; 3], edge: u32, purpose: Purpose) -> [f64; 2] {
    let mut sampler = Sampler::in_sets(Sets::OfEight, [seed, pixel, sample]);
    (0..edge).for_each(|_| sampler.next_edge());
    sampler.next_2d_for(purpose)
}

/// The numbers of a set.
fn set(pixel: u64, edge: u32, purpose: Purpose) -> Vec<[f64; 2]> {
    let samples = 3 * SIZE..4 * SIZE;
    samples
        .map(|sample| draw([7, pixel, sample], edge, purpose))
        .collect()
}

/// Whether a division of the unit square into `columns` times `rows` cells has one point in each.
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
        Aim,
        Emitter,
        AroundAim,
        AroundEmitter,
        Channel,
        Lens,
    ];
    for (pixel, purpose) in (0..200).flat_map(|pixel| purposes.map(|purpose| (pixel, purpose))) {
        for edge in 0..EDGES {
            let points = set(pixel, edge, purpose);
            assert!(is_even(&points, [SIZE, 1]), "{purpose:?} {edge}");
            assert!(is_even(&points, [1, SIZE]), "{purpose:?} {edge}");
        }
    }
}

/// The first numbers of a group are a (0, 3, 3)-net in base 2.
#[test]
fn directions_and_distances_are_spread_evenly_together() {
    for pixel in 0..200 {
        let directions = set(pixel, 1, Purpose::Direction);
        let distances = set(pixel, 1, Purpose::Distance);
        let pairs = directions.iter().zip(&distances);
        let [first, second] = [0, 1].map(|i| {
            let pairs = pairs
                .clone()
                .map(|(direction, distance)| [direction[i], distance[0]]);
            pairs.collect::<Vec<_>>()
        });
        for shape in [[4, 2], [2, 4]] {
            assert!(
                [&directions, &first, &second]
                    .iter()
                    .all(|p| is_even(p, shape))
            );
        }
        let octant = |([a, b], [c, _]): (&[f64; 2], &[f64; 2])| {
            [a, b, c]
                .iter()
                .fold(0, |sum, x| 2 * sum + (2.0 * **x) as u32)
        };
        let mut octants: Vec<u32> = pairs.map(octant).collect();
        octants.sort_unstable();
        assert_eq!(octants, (0..8).collect::<Vec<_>>());
    }
}

/// Numbers of different groups are paired at random: the product of two signs has a mean over a set whose variance
/// is (1 + 1/7)/8, that of eight points without replacement. Were the pairing always the same it would be 1.
#[test]
fn groups_are_paired_at_random() {
    let sign = |x: f64| (x - 0.5).signum();
    let others = [
        (1, Purpose::Aim),
        (1, Purpose::Channel),
        (2, Purpose::Direction),
    ];
    let zs = others.map(|(edge, other)| {
        let mut squares = Moments::default();
        for pixel in 0..20_000 {
            let pairs = set(pixel, 1, Purpose::Direction)
                .into_iter()
                .zip(set(pixel, edge, other));
            let sum: f64 = pairs.map(|(a, b)| sign(a[0]) * sign(b[0])).sum();
            squares.push((sum / SIZE as f64).powi(2));
        }
        squares.z(1.0 / 7.0)
    });
    max_abs_z(&zs, FALSE_ALARM).unwrap();
}

#[test]
fn places_on_emitters_are_spread_evenly_over_the_square() {
    for purpose in [Purpose::Aim, Purpose::AroundAim, Purpose::Channel] {
        for pixel in 0..200 {
            let points = set(pixel, 1, purpose);
            assert!(is_even(&points, [4, 2]) && is_even(&points, [2, 4]));
        }
    }
}

#[test]
fn numbers_of_late_edges_and_without_a_purpose_are_not_spread() {
    let even = |points: &[[f64; 2]]| is_even(points, [SIZE, 1]);
    // By chance 8!/8⁸ = 0.24 % of them are.
    let late = (0..200).filter(|&pixel| even(&set(pixel, EDGES, Purpose::Direction)));
    assert!(late.count() < 5);
    let plain = |pixel| {
        let samplers = (0..SIZE).map(|i| Sampler::in_sets(Sets::OfEight, [7, pixel, i]));
        samplers.map(|mut s| s.next_2d()).collect::<Vec<_>>()
    };
    assert!((0..200).filter(|&pixel| even(&plain(pixel))).count() < 5);
}

#[test]
fn single_samples_are_those_of_the_plain_sampler() {
    let mut plain = Sampler::new(1, 2, 3);
    let mut single = Sampler::in_sets(Sets::Single, [1, 2, 3]);
    for _ in 0..6 {
        assert_eq!(plain.next_1d(), single.next_1d_for(Purpose::Distance));
        assert_eq!(plain.next_2d(), single.next_2d_for(Purpose::Aim));
        single.next_edge();
    }
}

/// Pairs of numbers against the uniform density of the square.
#[test]
fn points_are_uniform_and_sets_independent() {
    type Pair = fn(u64) -> [f64; 2];
    let pairs: [(&str, Pair); 7] = [
        ("numbers of one purpose", |i| {
            draw([1, i, 3], 0, Purpose::Direction)
        }),
        ("numbers of two groups", |i| {
            let mut sampler = Sampler::in_sets(Sets::OfEight, [1, i, 5]);
            [Purpose::Distance, Purpose::Channel].map(|p| sampler.next_1d_for(p))
        }),
        ("numbers of two edges", |i| {
            let mut sampler = Sampler::in_sets(Sets::OfEight, [1, i, 6]);
            [0, 1].map(|_| {
                sampler.next_edge();
                sampler.next_1d_for(Purpose::Distance)
            })
        }),
        ("sets of a pixel", |i| {
            [0, SIZE].map(|more| draw([1, 9, 2 * SIZE * i + more], 0, Purpose::Distance)[0])
        }),
        ("pixels", |i| {
            [0, 1].map(|more| draw([1, 2 * i + more, 0], 0, Purpose::Distance)[0])
        }),
        ("seeds", |i| {
            [0, 1].map(|more| draw([2 * i + more, 0, 0], 0, Purpose::Distance)[0])
        }),
        // What is within the strata: digits beyond the third.
        ("remainders in a set", |i| {
            [0, 1].map(|more| (8.0 * draw([1, i, more], 0, Purpose::Distance)[0]).fract())
        }),
    ];
    let mut family = Family::new(FALSE_ALARM);
    for (name, pair) in pairs {
        let mut i = 0;
        let next = |_: &mut testkit::Rng| {
            i += 1;
            Some(pair(i))
        };
        let table = Table::new(uniform_edges(0.0, 1.0, 16), uniform_edges(0.0, 1.0, 16));
        let report = table.test(0, 50_000, Mass::Exactly(1.0), next, |_| 1.0);
        family.push(name, report.unwrap().p_value);
    }
    family.check().unwrap();
}
