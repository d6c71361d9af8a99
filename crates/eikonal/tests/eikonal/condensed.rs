//! Grids finer than their field: fewer samples represent it equally well
//! (docs/theory.md#sampled-fields).

use crate::common::Random;
use crate::homogeneous::flow;
use glam::DVec3;
use morgana_eikonal::field::{Bspline, Placement};
use morgana_eikonal::{Aabb, Field};

/// A bump, sharper along z, surrounded by air of constant index.
fn bump(x: DVec3) -> f64 {
    let away = (x * DVec3::new(1.0, 1.0, 2.5)).length_squared();
    let cut = (1.0 - away).max(0.0).powi(6);
    1.3 + 0.1 * cut * (-1.5 * away).exp()
}

fn cube() -> Aabb {
    Aabb::new(DVec3::splat(-1.5), DVec3::splat(1.5))
}

fn grid(dims: [usize; 3], placement: Placement) -> Bspline {
    Bspline::from_fn(dims, cube(), placement, bump).unwrap()
}

#[test]
fn smooth_grids_are_held_by_fewer_samples() {
    for placement in [Placement::Nodes, Placement::Centers] {
        let fine = grid([160, 144, 200], placement);
        let tolerance = 1e-4;
        let condensed = fine.condensed(tolerance).expect("far finer than the bump");
        let [x, y, z] = condensed.dims();
        assert!(x <= 81 && y <= 73 && z <= 101, "{:?}", condensed.dims());
        assert!(x < z, "{:?}: z needs more samples", condensed.dims());
        let (fine, condensed) = (Field::from(fine), Field::from(condensed));
        assert!(condensed.memory() < fine.memory() / 5);
        let mut rng = Random(7);
        for _ in 0..20_000 {
            let x = DVec3::from_array([0; 3].map(|_| rng.between(-1.5, 1.5)));
            let (a, b) = (fine.jet(x), condensed.jet(x));
            assert!(
                (a.n2 - b.n2).abs() <= 1.2 * tolerance,
                "{x}: {} {}",
                a.n2,
                b.n2
            );
            // The bound of the gradient is the gradient of a wave two spacings long, with the
            // tolerance as its amplitude.
            let wave = std::f64::consts::PI / (3.0 / 100.0);
            assert!((a.grad - b.grad).length() <= wave * tolerance, "{x}");
        }
    }
}

#[test]
fn grids_as_fine_as_their_field_stay() {
    let mut rng = Random(5);
    let rough: Vec<f64> = (0..128 * 128 * 128)
        .map(|_| 1.3 + rng.between(-1e-3, 1e-3))
        .collect();
    let noise = Bspline::from_samples([128; 3], cube(), Placement::Nodes, &rough).unwrap();
    assert!(noise.condensed(1e-4).is_none());
    // A single deviating sample is detected, wherever it lies.
    let mut samples = vec![1.3; 128 * 128 * 128];
    samples[(100 * 128 + 17) * 128 + 45] += 1e-3;
    let spike = Bspline::from_samples([128; 3], cube(), Placement::Nodes, &samples).unwrap();
    assert!(spike.condensed(1e-4).is_none());
    // A very long grid stays as it is: choosing its samples would take longer than everything else.
    let wave = |x: DVec3| 1.3 + 1e-3 * x.z.sin();
    let long = Bspline::from_fn([1, 1, 1_200_000], cube(), Placement::Nodes, wave).unwrap();
    assert!(long.condensed(1e-4).is_none());
    // Small grids stay as they are, because the caches hold them.
    assert!(grid([64; 3], Placement::Nodes).condensed(1e-2).is_none());
    assert!(noise.condensed(f64::INFINITY).is_none());
}

/// Condensing the samples gives the field that results from condensing the spline through all of
/// them. Regions that the first condensed field reports as constant are constant in the second,
/// too.
#[test]
fn samples_themselves_say_which_are_needed() {
    let dims = [160, 144, 200];
    let spacing = cube().size() / DVec3::from_array(dims.map(|n| (n - 1) as f64));
    let position = |i: usize| {
        let place = [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
        cube().min + spacing * DVec3::from_array(place.map(|i| i as f64))
    };
    let samples: Vec<f64> = (0..dims.iter().product::<usize>())
        .map(|i| bump(position(i)))
        .collect();
    let from = |samples: &[f64], tolerance: f64| {
        Bspline::from_fewer(dims, cube(), Placement::Nodes, samples, |n| n, tolerance)
    };
    let fine = grid(dims, Placement::Nodes);
    let condensed = fine.condensed(1e-5).unwrap();
    let direct = from(&samples, 1e-5).expect("far finer than the bump");
    assert_eq!(direct.dims(), condensed.dims());
    let [fine, condensed, direct] = [fine, condensed, direct].map(Field::from);
    let mut rng = Random(23);
    let mut still = 0;
    for _ in 0..5_000 {
        let x = DVec3::from_array([0; 3].map(|_| rng.between(-1.5, 1.5)));
        let (a, b) = (condensed.jet(x), direct.jet(x));
        assert!((a.n2 - b.n2).abs() < 1e-6, "{x}: {} {}", a.n2, b.n2);
        let v = DVec3::from_array([0; 3].map(|_| rng.between(-1.0, 1.0)));
        let span = direct.homogeneous_span(x, v);
        assert!(span <= fine.homogeneous_span(x, v), "{x} {v}");
        still += usize::from(span > 0.0);
    }
    assert!(still > 500, "{still}");
    // Invalid input is refused.
    assert!(from(&samples, f64::NAN).is_none());
    assert!(from(&vec![1.3; samples.len()], 1e-5).is_none());
    for (bad, at) in [(f64::NAN, 77), (-1.3, 1_000_000), (1.31, 2_345_678)] {
        let mut samples = samples.clone();
        samples[at] = bad;
        assert!(from(&samples, 1e-5).is_none(), "{bad}");
    }
}

/// Across layers every sample may matter, while few matter along the other axes.
#[test]
fn each_axis_keeps_what_it_needs() {
    let layers = |x: DVec3| 1.0 + 1e-3 * (60.0 * x.z).sin() * (-2.0 * x.x * x.x).exp();
    let fine = Bspline::from_fn([128, 128, 128], cube(), Placement::Nodes, layers).unwrap();
    let condensed = fine.condensed(1e-6).unwrap();
    let [x, y, z] = condensed.dims();
    assert!(x <= 33 && y == 17 && z == 128, "{:?}", condensed.dims());
    let flat = |x: DVec3| bump(DVec3::new(x.x, x.y, 0.0));
    let plane = Bspline::from_fn([2048, 1024, 1], cube(), Placement::Nodes, flat).unwrap();
    let condensed = plane.condensed(1e-6).unwrap();
    assert!(
        condensed.dims()[0] <= 513 && condensed.dims()[2] == 1,
        "{:?}",
        condensed.dims()
    );
}

/// Fields need not be flat at the faces of their box: the slopes there are kept.
#[test]
fn slopes_at_faces_are_kept() {
    let slope = |x: DVec3| 1.3 + 0.05 * (0.7 * x.x).exp() * x.y.cos() * (0.5 * x.z).sin();
    let fine = Bspline::from_fn([128; 3], cube(), Placement::Nodes, slope).unwrap();
    let condensed = fine.condensed(3e-7).unwrap();
    let count: usize = condensed.dims().iter().product();
    assert!(count <= 23 * 65 * 23, "{:?}", condensed.dims());
}

/// Rays through the condensed grid agree within the tolerance of the field, and cross constant air
/// without evaluations.
#[test]
fn rays_are_the_same() {
    let round = |x: DVec3| bump(x / DVec3::new(1.0, 1.0, 2.5));
    let fine = Bspline::from_fn([180; 3], cube(), Placement::Nodes, round).unwrap();
    let condensed = fine.condensed(2e-6).expect("finer than the bump");
    let (fine, condensed) = (Field::from(fine), Field::from(condensed));
    let mut rng = Random(11);
    for _ in 0..200 {
        let x = DVec3::new(rng.between(-1.0, 1.0), rng.between(-1.0, 1.0), -1.4);
        let toward = DVec3::new(rng.between(-0.3, 0.3), rng.between(-0.3, 0.3), 1.0);
        let ends = [&fine, &condensed].map(|field| flow(field, (x, toward.normalize()), 2.0).0);
        let apart = ends[0].x.distance(ends[1].x);
        assert!(apart < 1e-5, "{x}: {apart:e}");
    }
    let corner = DVec3::splat(-1.4);
    let span = |field: &Field| field.homogeneous_span(corner, DVec3::X);
    assert!(span(&fine) > 0.5);
    assert_eq!(span(&fine), span(&condensed));
}
