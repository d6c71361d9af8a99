//! Bounds of every field over boxes: they hold, and are not much too wide.

use crate::common::{Case, Random, all_fields, scale};
use glam::{DAffine3, DMat3, DVec3};
use morgana_eikonal::bounds::symmetric_eigenvalues;
use morgana_eikonal::field::{Affine, Bspline, Placement, Scaled};
use morgana_eikonal::{Aabb, Field, FieldBounds};

/// Extremes that dense sampling of a box finds.
struct Sampled {
    bounds: FieldBounds,
    kappa: f64,
    neg_hess_ln_n: f64,
}

fn outer(a: DVec3) -> DMat3 {
    DMat3::from_cols(a * a.x, a * a.y, a * a.z)
}

fn sample(case: &Case, region: &Aabb, random: &mut Random, count: usize) -> Sampled {
    let inside = (0..count).map(|_| random.point(region));
    let special = case.special.iter().copied().filter(|x| region.contains(*x));
    let points: Vec<DVec3> = inside.chain(region.corners()).chain(special).collect();
    let mut found = Sampled {
        bounds: FieldBounds {
            n2_min: f64::INFINITY,
            n2_max: f64::NEG_INFINITY,
            grad_max: 0.0,
            hess_min: f64::INFINITY,
            hess_max: f64::NEG_INFINITY,
        },
        kappa: 0.0,
        neg_hess_ln_n: 0.0,
    };
    for x in points {
        let jet = case.field.jet(x);
        let [low, _, high] = symmetric_eigenvalues(jet.hess);
        found.bounds = found.bounds.union(FieldBounds {
            n2_min: jet.n2,
            n2_max: jet.n2,
            grad_max: jet.grad.length(),
            hess_min: low,
            hess_max: high,
        });
        // −Hess ln n = −Hess n²/(2n²) + ∇n²⊗∇n²/(2n⁴).
        let log = (outer(jet.grad) * (1.0 / jet.n2) - jet.hess) * (0.5 / jet.n2);
        found.neg_hess_ln_n = found.neg_hess_ln_n.max(symmetric_eigenvalues(log)[2]);
        found.kappa = found.kappa.max(0.5 * jet.grad.length() / jet.n2);
    }
    found
}

#[track_caller]
fn assert_conservative(case: &Case, region: &Aabb, found: &Sampled) {
    let bounds = case.field.bounds(region);
    let f = &found.bounds;
    // Allow for rounding of the field itself, in units of n² over powers of its length scale.
    let l = scale(&case.field, region.center());
    let (e0, e1, e2) = (
        1e-14 * f.n2_max,
        1e-13 * f.n2_max / l,
        1e-13 * f.n2_max / (l * l),
    );
    let holds = bounds.n2_min <= f.n2_min + e0
        && bounds.n2_max >= f.n2_max - e0
        && bounds.grad_max >= f.grad_max - e1
        && bounds.hess_min <= f.hess_min + e2
        && bounds.hess_max >= f.hess_max - e2;
    assert!(
        holds,
        "{}: {bounds:?}\nbut found {f:?}\nin {region:?}",
        case.name
    );
    assert!(bounds.kappa() >= found.kappa - e1, "{}: κ", case.name);
    assert!(
        bounds.neg_hess_ln_n() >= found.neg_hess_ln_n - e2,
        "{}: −Hess ln n ≤ {} but found {}",
        case.name,
        bounds.neg_hess_ln_n(),
        found.neg_hess_ln_n
    );
}

#[test]
fn bounds_are_conservative() {
    let mut random = Random(11);
    for case in all_fields() {
        for _ in 0..300 {
            let region = random.sub_box(&case.region);
            let found = sample(&case, &region, &mut random, 150);
            assert_conservative(&case, &region, &found);
        }
        let found = sample(&case, &case.region, &mut random, 20_000);
        assert_conservative(&case, &case.region, &found);
    }
}

#[test]
fn bounds_over_a_point_or_over_all_space_hold() {
    let mut random = Random(5);
    for case in all_fields() {
        let found = sample(&case, &case.region, &mut random, 1000);
        let everywhere = Aabb::new(DVec3::NEG_INFINITY, DVec3::INFINITY);
        let half = Aabb::new(case.region.min, DVec3::INFINITY);
        for region in [everywhere, half] {
            let b = case.field.bounds(&region);
            assert!(b.n2_min <= found.bounds.n2_min, "{}: {b:?}", case.name);
            assert!(b.n2_max >= found.bounds.n2_max, "{}: {b:?}", case.name);
            assert!(b.grad_max >= found.bounds.grad_max, "{}: {b:?}", case.name);
            assert!(
                b.hess_min <= found.bounds.hess_min + 1e-12,
                "{}: {b:?}",
                case.name
            );
            assert!(
                b.hess_max >= found.bounds.hess_max - 1e-12,
                "{}: {b:?}",
                case.name
            );
        }
        for _ in 0..20 {
            let x = random.point(&case.region);
            let point = Aabb::new(x, x);
            assert_conservative(&case, &point, &sample(&case, &point, &mut random, 1));
        }
    }
}

/// Over a box of diagonal d, the bounds of an analytic field may exceed the sampled extremes by d
/// times the next derivative. The bounds of Hess n² may exceed them by a further 2|∇n|² =
/// |∇n²|²/(2n²), because they add the eigenvalues of the two terms of Hess n².
#[test]
fn bounds_are_tight_on_small_boxes() {
    let mut random = Random(13);
    for case in all_fields().into_iter().filter(|c| c.analytic) {
        let whole = sample(&case, &case.region, &mut random, 2000).bounds;
        let curvature = whole.hess_max.max(-whole.hess_min);
        for _ in 0..100 {
            let x = random.point(&case.region);
            let l = scale(&case.field, x);
            let region = Aabb::new(x, x + random.vector() * (0.05 * l));
            let d = region.diagonal();
            let f = sample(&case, &region, &mut random, 300).bounds;
            let b = case.field.bounds(&region);
            let bend = f.hess_max.max(-f.hess_min) + 2.0 * curvature * d / l;
            let wide = b.n2_max - b.n2_min;
            assert!(
                wide <= 2.0 * (f.grad_max + bend * d) * d + 1e-14,
                "{}",
                case.name
            );
            assert!(
                b.grad_max <= f.grad_max + 1.5 * bend * d + 1e-14,
                "{}",
                case.name
            );
            let cross = f.grad_max * f.grad_max / (2.0 * f.n2_min);
            let slack = 1.5 * cross + 4.0 * curvature * d / l + 1e-13;
            assert!(
                b.hess_max <= f.hess_max + slack,
                "{}: {b:?} {f:?}",
                case.name
            );
            assert!(
                b.hess_min >= f.hess_min - slack,
                "{}: {b:?} {f:?}",
                case.name
            );
        }
    }
}

/// Bounds over a whole region are at most a small factor too wide. Waves are the worst case,
/// because several modes do not peak together.
#[test]
fn bounds_over_a_whole_region_are_of_the_right_size() {
    let mut random = Random(17);
    for case in all_fields() {
        let region = case
            .region
            .intersection(Aabb::new(DVec3::splat(-0.7), DVec3::splat(0.7)));
        let f = sample(&case, &region, &mut random, 20_000).bounds;
        let b = case.field.bounds(&region);
        let curvature = f.hess_max.max(-f.hess_min);
        let ratios = [
            (b.n2_max - b.n2_min) / (f.n2_max - f.n2_min),
            b.grad_max / f.grad_max,
            b.hess_max / curvature,
            -b.hess_min / curvature,
        ];
        // A shear multiplies the excess by the square of its condition number.
        let factor = match case.name {
            "waves" => 4.0,
            "sheared waves" => 8.0,
            "sheared grid" => 3.5,
            _ => 2.5,
        };
        let tight = ratios.iter().all(|r| r.is_nan() || *r < factor);
        assert!(tight, "{}: {ratios:?} {b:?} {f:?}", case.name);
    }
}

/// Bounds over a large box come from blocks of cells, on several scales in a grid this long. They
/// agree with the bounds of the parts of the box.
#[test]
fn bounds_of_large_grids_are_those_of_their_parts() {
    let mut random = Random(19);
    let domain = Aabb::new(DVec3::ZERO, DVec3::new(20.0, 1.0, 2.0));
    let (dims, samples) = ([301, 12, 25], domain.grown(-0.05));
    let grid = Bspline::from_fn(dims, domain, Placement::Nodes, |x| {
        1.4 + 0.02 * (3.0 * x.x).sin() * (2.0 * x.y + x.z).cos() + 1e-3 * random.uniform()
    })
    .unwrap()
    .into();
    let case = Case {
        name: "long grid",
        field: grid,
        region: samples,
        special: vec![],
        analytic: false,
    };
    // Divide into four cells along x and two boxes along y and z, few enough cells to be bounded
    // one by one.
    let parts = |region: &Aabb| {
        let count = (region.size() / DVec3::new(0.26, 0.5, 1.0))
            .ceil()
            .max(DVec3::ONE);
        let [x, y, z] = count.to_array().map(|n| n as usize);
        let size = region.size() / count;
        let part = |i: usize| {
            let place = DVec3::new((i % x) as f64, (i / x % y) as f64, (i / x / y) as f64);
            let min = region.min + size * place;
            case.field.bounds(&Aabb::new(min, min + size))
        };
        (0..x * y * z).map(part).reduce(FieldBounds::union).unwrap()
    };
    for i in 0..200 {
        let region = match i {
            0 => samples,
            1 => domain.grown(10.0),
            _ => random.sub_box(&domain.grown(0.2)),
        };
        let found = sample(&case, &region, &mut random, 2000);
        assert_conservative(&case, &region, &found);
        if i == 0 {
            // Bends of the field outside the region have no effect.
            let (whole, parts) = (case.field.bounds(&region), parts(&region));
            assert!(whole.hess_max < 1.3 * parts.hess_max, "{whole:?} {parts:?}");
            assert!(whole.grad_max < 1.3 * parts.grad_max, "{whole:?} {parts:?}");
        }
    }
}

/// Stored bounds are the bounds, and fields of one grid store them together.
#[test]
fn fields_of_one_grid_store_bounds_together() {
    let domain = Aabb::new(DVec3::ZERO, DVec3::ONE);
    let index = |x: DVec3| 1.4 + 0.02 * (3.0 * x.x).sin() * (2.0 * x.y + x.z).cos();
    let grid = Bspline::from_fn([60; 3], domain, Placement::Nodes, index).unwrap();
    let alone: Field = grid.clone().into();
    let turn = DAffine3::from_rotation_z(0.3);
    let fields: [Field; 4] = [
        alone.clone(),
        Scaled::new(alone.clone(), 1.1).unwrap().into(),
        Scaled::excess(grid, 1.3, 0.9).unwrap().into(),
        Affine::new(Scaled::new(alone.clone(), 1.2).unwrap().into(), turn)
            .unwrap()
            .into(),
    ];
    let (mut random, mut boxes) = (Random(5), 0);
    for i in 0..50 {
        let region = random.sub_box(&domain);
        // The first three fields need the same cells: whichever comes first stores them for all.
        for (place, field) in [i % 3, (i + 1) % 3, (i + 2) % 3, 3].into_iter().enumerate() {
            let field = &fields[field];
            let bounds = field.bounds(&region);
            let before = alone.memory();
            assert_eq!(field.stored_bounds(&region), bounds);
            let stored = alone.memory();
            assert!(stored == before || place == 0 || place == 3, "{field:?}");
            boxes += usize::from(stored > before);
            assert_eq!(field.stored_bounds(&region), bounds);
            assert_eq!(alone.memory(), stored);
        }
    }
    // Small boxes are not stored.
    assert!((20..80).contains(&boxes), "{boxes}");
}

#[test]
fn eigenvalues_solve_the_characteristic_equation() {
    let mut random = Random(23);
    for _ in 0..1000 {
        let [d, o] = [random.vector() - 0.5, random.vector() - 0.5];
        // Make every second matrix nearly degenerate.
        let o = if random.uniform() < 0.5 { o * 1e-9 } else { o };
        let m = DMat3::from_cols(
            DVec3::new(d.x, o.x, o.y),
            DVec3::new(o.x, d.y, o.z),
            DVec3::new(o.y, o.z, d.z),
        );
        let values = symmetric_eigenvalues(m);
        assert!(values.is_sorted());
        for value in values {
            let shifted = m - DMat3::from_diagonal(DVec3::splat(value));
            assert!(shifted.determinant().abs() < 4e-15);
        }
        let trace = d.x + d.y + d.z;
        assert!((values.iter().sum::<f64>() - trace).abs() < 1e-14);
    }
    let double = symmetric_eigenvalues(outer(DVec3::new(1.0, 2.0, 2.0)));
    assert!(double[0].abs() < 1e-15 && double[1].abs() < 1e-15);
    assert!((double[2] - 9.0).abs() < 1e-14);
}
