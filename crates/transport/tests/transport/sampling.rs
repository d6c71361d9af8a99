//! χ² tests of every sampling routine, and tests of inverses.
//!
//! False alarms: 1.6e-4 for each of the six families here, so below 1e-3 for the file. Seeds are
//! fixed.

use glam::{DVec2, DVec3};
use morgana_transport::sampling::disc::*;
use morgana_transport::sampling::sphere::*;
use morgana_transport::sampling::triangle::*;
use morgana_transport::sampling::{
    BilinearCell, Discrete, DistributionError, Frame, Grid2, PiecewiseConstant, PiecewiseLinear,
    TrilinearCell,
};
use std::f64::consts::PI;
use testkit::{DirectionTable, Family, Mass, Rng, Table, uniform_edges};

const FALSE_ALARM: f64 = 1.6e-4;
const SAMPLES: u64 = 100_000;

fn square(lo: f64, hi: f64, n: usize) -> Table {
    Table::new(uniform_edges(lo, hi, n), uniform_edges(lo, hi, n))
}

#[test]
fn plane_distributions() {
    let mut family = Family::new(FALSE_ALARM);
    // Use polar coordinates, so that the disc's edge is the table's edge; r is the area element.
    let polar = Table::new(uniform_edges(0.0, 1.0, 8), uniform_edges(-PI, PI, 16));
    let disc = |r: &mut Rng| uniform_disc_sample(r.uniform());
    let report = polar.test(
        1,
        SAMPLES,
        Mass::Exactly(1.0),
        |r| Some(disc(r)).map(|p| [p.length(), p.y.atan2(p.x)]),
        |[r, phi]| r * uniform_disc_pdf(r * DVec2::from_angle(phi)),
    );
    family.push("uniform disc", report.unwrap().p_value);
    let report = square(-4.0, 5.0, 12).test(
        2,
        SAMPLES,
        Mass::Exactly(1.0),
        |r| Some(gaussian_disc_sample(0.5, r.uniform()).to_array()),
        |p| gaussian_disc_pdf(0.5, DVec2::from_array(p)),
    );
    family.push("Gaussian disc", report.unwrap().p_value);
    for sigma in [0.25, 2.0] {
        let report = polar.test(
            5,
            SAMPLES,
            Mass::Exactly(1.0),
            |r| {
                let u = r.uniform();
                let p = truncated_gaussian_disc_sample(sigma, u);
                let back = truncated_gaussian_disc_inverse(sigma, p);
                assert!((0..2).all(|k| (back[k] - u[k]).abs() < 1e-9), "{u:?}");
                Some([p.length(), p.y.atan2(p.x)])
            },
            |[r, phi]| r * truncated_gaussian_disc_pdf(sigma, r * DVec2::from_angle(phi)),
        );
        family.push(
            format!("Gaussian of {sigma} in a disc"),
            report.unwrap().p_value,
        );
    }
    // The image (b₀/(1 − b₂), b₂) of a barycentric point fills the unit square.
    let report = square(0.0, 1.0, 8).test(
        3,
        SAMPLES,
        Mass::Exactly(1.0),
        |r| {
            let b = uniform_triangle_sample(r.uniform());
            Some([b[0] / (b[0] + b[1]), b[0] + b[1]])
        },
        |[a, sum]| sum * uniform_triangle_pdf([a * sum, (1.0 - a) * sum]),
    );
    family.push("triangle", report.unwrap().p_value);
    family.check().unwrap();
}

/// Tests the marginals of x and y, and of z and x, which are bilinear in closed form.
#[test]
fn trilinear_cells() {
    let mut family = Family::new(FALSE_ALARM);
    for corners in [
        [[[1.0, 2.0], [0.5, 4.0]], [[3.0, 0.0], [0.2, 1.0]]],
        [[[0.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [0.0, 3.0]]],
        [[[0.0; 2]; 2]; 2],
    ] {
        let cell = TrilinearCell::new(corners);
        let mean = |a: f64, b: f64| 0.5 * (a + b);
        let xy = [0, 1].map(|j| [0, 1].map(|i| mean(corners[0][j][i], corners[1][j][i])));
        let xz = [0, 1].map(|k| [0, 1].map(|i| mean(corners[k][0][i], corners[k][1][i])));
        for (seed, second, marginal) in [(6, 1, xy), (7, 2, xz)] {
            let report = square(0.0, 1.0, 8).test(
                seed,
                SAMPLES,
                Mass::Exactly(1.0),
                |r| {
                    let u: [f64; 3] = r.uniform();
                    let p = cell.sample(u);
                    let back = cell.inverse(p);
                    assert!(
                        (0..3).all(|k| (back[k] - u[k]).abs() < 1e-9),
                        "{u:?} {back:?}"
                    );
                    Some([p[0], p[second]])
                },
                |p| BilinearCell::new(marginal).pdf(p),
            );
            family.push(format!("{corners:?}, {second}"), report.unwrap().p_value);
        }
        let p = [0.3, 0.8, 0.6];
        let expected = if cell.mean() > 0.0 {
            cell.value(p) / cell.mean()
        } else {
            1.0
        };
        assert_eq!(cell.pdf(p), expected);
    }
    family.check().unwrap();
}

#[test]
fn bilinear_cells() {
    let mut family = Family::new(FALSE_ALARM);
    let corners = [
        [[1.0, 2.0], [0.5, 4.0]],
        [[0.0, 0.0], [0.0, 3.0]],
        [[0.0, 1.0], [0.0, 0.0]],
        [[0.0; 2]; 2],
    ];
    for corners in corners {
        let cell = BilinearCell::new(corners);
        let report = square(0.0, 1.0, 8).test(
            1,
            SAMPLES,
            Mass::Exactly(1.0),
            |r| {
                let u = r.uniform();
                let p = cell.sample(u);
                let back = cell.inverse(p);
                assert!(
                    (0..2).all(|k| (back[k] - u[k]).abs() < 1e-9),
                    "{u:?} {back:?}"
                );
                Some(p)
            },
            |p| cell.pdf(p),
        );
        family.push(format!("{corners:?}"), report.unwrap().p_value);
    }
    family.check().unwrap();
}

#[test]
fn direction_distributions() {
    let mut family = Family::new(FALSE_ALARM);
    let axis = DVec3::Z.to_array();
    let table = DirectionTable::uniform(axis, 12, 16);
    let report = table.test(
        1,
        SAMPLES,
        Mass::Exactly(1.0),
        |r| Some(uniform_sphere_sample(r.uniform()).to_array()),
        |_| uniform_sphere_pdf(),
    );
    family.push("sphere", report.unwrap().p_value);
    let report = table.test(
        2,
        SAMPLES,
        Mass::Exactly(1.0),
        |r| Some(cosine_hemisphere_sample(r.uniform()).to_array()),
        |d| cosine_hemisphere_pdf(d.into()),
    );
    family.push("cosine hemisphere", report.unwrap().p_value);
    for height in [1e-6, 0.1, 1.3] {
        // The cone's rim is an edge of the table.
        let mut edges = uniform_edges(1.0 - height, 1.0, 6);
        edges.insert(0, -1.0);
        let report = DirectionTable::new(axis, edges, 12).test(
            3,
            SAMPLES,
            Mass::Exactly(1.0),
            |r| Some(uniform_cone_sample(height, r.uniform()).to_array()),
            |d| uniform_cone_pdf(height, d.into()),
        );
        family.push(format!("cone {height}"), report.unwrap().p_value);
    }
    family.check().unwrap();
}

#[test]
fn tabulated_distributions() {
    let mut family = Family::new(FALSE_ALARM);
    let edges = vec![-1.0, -0.5, 0.25, 0.3, 2.0];
    let steps = PiecewiseConstant::new(edges.clone(), &[1.0, 0.0, 9.0, 0.5]).unwrap();
    let table = Table::new(edges.clone(), uniform_edges(0.0, 1.0, 4));
    let sample = |r: &mut Rng| Some([steps.sample(r.next_1d()).0, r.next_1d()]);
    let density = |[x, _]: [f64; 2]| steps.pdf(x);
    let report = table.test(1, SAMPLES, Mass::Exactly(1.0), sample, density);
    family.push("piecewise constant", report.unwrap().p_value);
    let linear = PiecewiseLinear::new(edges, &[0.0, 3.0, 0.0, 0.0, 1.0]).unwrap();
    let report = Table::new(uniform_edges(-1.0, 2.0, 24), uniform_edges(0.0, 1.0, 2)).test(
        2,
        SAMPLES,
        Mass::Exactly(1.0),
        |r| Some([linear.sample(r.next_1d()).0, r.next_1d()]),
        |[x, _]| linear.pdf(x),
    );
    family.push("piecewise linear", report.unwrap().p_value);
    let discrete = Discrete::new(&[2.0, 0.0, 1.0, 5.0]).unwrap();
    // The remapped number is uniform for every index.
    let report = Table::new(uniform_edges(-0.5, 3.5, 4), uniform_edges(0.0, 1.0, 10)).test(
        3,
        SAMPLES,
        Mass::Exactly(1.0),
        |r| {
            let pick = discrete.sample(r.next_1d());
            Some([pick.index as f64, pick.u])
        },
        |[i, _]| discrete.pdf(i.round() as usize),
    );
    family.push("discrete", report.unwrap().p_value);
    family.check().unwrap();
}

#[test]
fn grid_distribution() {
    let (width, height) = (5, 4);
    let mut rng = Rng::new(1);
    let mut values: Vec<f64> = (0..width * height).map(|_| rng.next_1d()).collect();
    values[3] = 0.0;
    values[7] = 40.0;
    values[2 * width..3 * width].fill(0.0);
    let grid = Grid2::new(width, height, &values).unwrap();
    // Use twice as many bins as cells, to test positions within a cell, too.
    let table = Table::new(
        uniform_edges(0.0, 1.0, 2 * width),
        uniform_edges(0.0, 1.0, 2 * height),
    );
    let draw = |r: &mut Rng| Some(grid.sample(r.uniform()).0);
    let report = table
        .test(1, SAMPLES, Mass::Exactly(1.0), draw, |p| grid.pdf(p))
        .unwrap();
    let mut family = Family::new(FALSE_ALARM);
    family.push("grid", report.p_value);
    family.check().unwrap();
    assert!((grid.integral() - values.iter().sum::<f64>() / 20.0).abs() < 1e-15);
}

/// True if |a − b| is small in both components.
fn close(a: [f64; 2], b: [f64; 2]) -> bool {
    a.iter().zip(b).all(|(x, y)| (x - y).abs() < 1e-9)
}

#[test]
fn inverses_return_the_random_numbers() {
    let mut rng = Rng::new(5);
    let steps = PiecewiseConstant::new(vec![0.0, 1.0, 3.0], &[1.0, 2.0]).unwrap();
    let linear = PiecewiseLinear::new(vec![0.0, 1.0, 3.0], &[0.0, 2.0, 0.5]).unwrap();
    let grid = Grid2::new(2, 2, &[1.0, 2.0, 3.0, 0.5]).unwrap();
    let discrete = Discrete::new(&[1.0, 0.0, 2.0]).unwrap();
    for _ in 0..1000 {
        let u: [f64; 2] = rng.uniform();
        assert!(
            close(uniform_disc_inverse(uniform_disc_sample(u)), u),
            "disc {u:?}"
        );
        assert!(
            close(gaussian_disc_inverse(0.3, gaussian_disc_sample(0.3, u)), u),
            "Gauss {u:?}"
        );
        assert!(
            close(uniform_sphere_inverse(uniform_sphere_sample(u)), u),
            "sphere {u:?}"
        );
        assert!(
            close(uniform_cone_inverse(1e-8, uniform_cone_sample(1e-8, u)), u),
            "cone {u:?}"
        );
        assert!(
            close(cosine_hemisphere_inverse(cosine_hemisphere_sample(u)), u),
            "cosine {u:?}"
        );
        assert!(
            close(uniform_triangle_inverse(uniform_triangle_sample(u)), u),
            "triangle {u:?}"
        );
        assert!(close(grid.inverse(grid.sample(u).0), u), "grid {u:?}");
        let (x, density) = steps.sample(u[0]);
        assert!((steps.inverse(x) - u[0]).abs() < 1e-12 && steps.pdf(x) == density);
        let (x, density) = linear.sample(u[0]);
        assert!((linear.inverse(x) - u[0]).abs() < 1e-12 && (linear.pdf(x) - density).abs() < 1e-9);
        let pick = discrete.sample(u[0]);
        assert!((discrete.inverse(pick.index, pick.u) - u[0]).abs() < 1e-12);
        assert_eq!(pick.probability, discrete.pdf(pick.index));
    }
}

#[test]
fn extreme_random_numbers_stay_inside() {
    let last = 1.0 - f64::EPSILON / 2.0;
    let discrete = Discrete::new(&[0.0, 1.0, 1e-30, 0.0]).unwrap();
    let linear = PiecewiseLinear::new(vec![0.0, 1.0, 2.0], &[0.0, 0.0, 1.0]).unwrap();
    for u in [0.0, 1e-300, 0.5, last] {
        assert_eq!(discrete.sample(u).index, 1);
        assert!(discrete.sample(u).u < 1.0);
        assert!((1.0..=2.0).contains(&linear.sample(u).0));
        for v in [0.0, 0.5, last] {
            for d in [
                uniform_sphere_sample([u, v]),
                cosine_hemisphere_sample([u, v]),
            ] {
                assert!((d.length() - 1.0).abs() < 1e-12, "{d} for {u}, {v}");
            }
            assert!(uniform_disc_sample([u, v]).length() <= 1.0 + 1e-15);
            assert!(gaussian_disc_sample(1.0, [u, v]).is_finite());
        }
    }
}

#[test]
fn bad_tables_are_refused() {
    let new = |edges: &[f64], values: &[f64]| PiecewiseConstant::new(edges.to_vec(), values).err();
    assert_eq!(
        new(&[0.0, 1.0], &[-1.0]),
        Some(DistributionError::Value {
            index: 0,
            value: -1.0
        })
    );
    assert_eq!(
        new(&[0.0, 1.0], &[0.0]),
        Some(DistributionError::Total { total: 0.0 })
    );
    assert_eq!(
        new(&[0.0, 0.0], &[1.0]),
        Some(DistributionError::Order { index: 1 })
    );
    assert_eq!(
        new(&[0.0, f64::NAN], &[1.0]),
        Some(DistributionError::Order { index: 1 })
    );
    assert_eq!(new(&[0.0], &[]), Some(DistributionError::Empty));
    assert_eq!(
        new(&[0.0, 1.0], &[]),
        Some(DistributionError::Length {
            expected: 1,
            got: 0
        })
    );
    assert!(Discrete::new(&[]).is_err() && Discrete::new(&[f64::INFINITY]).is_err());
    assert!(Grid2::new(0, 3, &[]).is_err() && Grid2::new(2, 2, &[1.0]).is_err());
    assert!(PiecewiseLinear::new(vec![0.0, 1.0], &[0.0, f64::NAN]).is_err());
}

#[test]
fn frames_are_orthonormal_and_right_handed() {
    let mut rng = Rng::new(9);
    let special = [
        DVec3::Z,
        -DVec3::Z,
        DVec3::X,
        -DVec3::Y,
        DVec3::new(0.0, 1e-9, -1.0).normalize(),
    ];
    let random = (0..1000).map(|_| DVec3::from_array(rng.direction()));
    for n in special.into_iter().chain(random) {
        let f = Frame::from_normal(n);
        assert!((f.s.cross(f.t) - n).length() < 1e-14, "{n}");
        assert!(
            (f.s.length() - 1.0).abs() < 1e-14 && f.s.dot(n).abs() < 1e-14,
            "{n}"
        );
        let v = DVec3::new(0.3, -0.2, 0.7);
        assert!((f.to_local(f.to_world(v)) - v).length() < 1e-14);
    }
}
