//! The addressed sampler: uniform, independent between neighbours, and unchanged for ever.
//!
//! False alarms: 5e-4 for each of the two families, so 1e-3 for the file. Seeds are fixed.

use morgana_transport::sampling::Sampler;
use testkit::{Family, Mass, Moments, Table, uniform_edges, z_test};

const FALSE_ALARM: f64 = 5e-4;

/// Tests the exact numbers: any change of them changes every image ever rendered.
#[test]
fn golden_values() {
    let mut s = Sampler::new(0, 0, 0);
    assert_eq!(s.next_2d(), [0.4948510344089725, 0.23993021584432528]);
    let mut s = Sampler::new(1, 2, 3);
    assert_eq!(s.next_2d(), [0.4335528521007467, 0.6314214916915417]);
    let mut copy = s.clone();
    assert_eq!(s.next_1d(), copy.next_1d());
}

/// Address of the `i`-th point of a walk along one word of the address.
fn address(word: usize, i: u64) -> [u64; 3] {
    let mut a = [17, 1_000, 5];
    a[word] += i;
    a
}

#[test]
fn numbers_are_uniform_across_addresses() {
    let mut family = Family::new(FALSE_ALARM);
    let table = || Table::new(uniform_edges(0.0, 1.0, 16), uniform_edges(0.0, 1.0, 16));
    for word in 0..3 {
        for dimension in [0, 1, 6] {
            let mut i = 0;
            // Pair a number of this address with the corresponding number of the next one.
            let draw = |_: &mut testkit::Rng| {
                i += 1;
                let [a, b] = [2 * i, 2 * i + 1].map(|i| nth(address(word, i), dimension));
                Some([a, b])
            };
            let report = table()
                .test(0, 50_000, Mass::Exactly(1.0), draw, |_| 1.0)
                .unwrap();
            family.push(
                format!("word {word}, dimension {dimension}"),
                report.p_value,
            );
        }
    }
    let mut stream = Sampler::new(3, 4, 5);
    let draw = |_: &mut testkit::Rng| Some(stream.next_2d());
    let report = table()
        .test(0, 100_000, Mass::Exactly(1.0), draw, |_| 1.0)
        .unwrap();
    family.push("one stream", report.p_value);
    family.check().unwrap();
}

fn nth([seed, pixel, sample]: [u64; 3], dimension: usize) -> f64 {
    let mut s = Sampler::new(seed, pixel, sample);
    (0..dimension).for_each(|_| _ = s.next_1d());
    s.next_1d()
}

#[test]
fn neighbouring_addresses_are_uncorrelated() {
    let mut zs = Vec::new();
    for word in 0..3 {
        for distance in [1, 2, 64, 1 << 32] {
            for dimension in [0, 3] {
                let mut product = Moments::default();
                for i in 0..20_000 {
                    let a = nth(address(word, i), dimension) - 0.5;
                    let b = nth(address(word, i + distance), dimension) - 0.5;
                    product.push(a * b);
                }
                zs.push(product.z(0.0));
            }
        }
    }
    z_test::max_abs_z(&zs, FALSE_ALARM).unwrap();
}

#[test]
fn the_words_of_an_address_are_not_interchangeable() {
    let first = |a, b, c| Sampler::new(a, b, c).next_1d();
    let mut all = [
        first(1, 2, 3),
        first(1, 3, 2),
        first(2, 1, 3),
        first(2, 3, 1),
        first(3, 1, 2),
        first(3, 2, 1),
    ];
    all.sort_by(f64::total_cmp);
    assert!(all.windows(2).all(|w| w[0] != w[1]));
}
