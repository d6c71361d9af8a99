//! Media of flakes: extinction by the projected area, and agreement of estimators.
//!
//! References are closed forms, the furnace, and other estimators. False-alarm rate: 1e-3 for each
//! of the statistical tests, over all its comparisons, with fixed seeds.

use crate::agreement::cloud;
use crate::agreement::compare::{Effort, compare, judge, table};
use crate::aov::of_ray;
use crate::common::{
    camera, container, fog, mean, parts, path_tracer, shoot, shoot_by, sky, vacuum,
};
use crate::photons::support::{beam, view};
use eikonal::Field;
use eikonal::field::{Constant, LinearIndex, LinearSquare, Luneburg, Placement};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::bsdf::Bsdf;
use morgana_transport::integrator::Vcm;
use morgana_transport::medium::Medium;
use morgana_transport::phase::{Phase, Sggx};
use morgana_transport::scene::{Object, Parts};
use morgana_transport::shape::{Cube, Sphere};
use morgana_transport::volume::{GridFilter, GridSamples, VolumeGrid, VolumeTexture};
use morgana_transport::{Scene, Spectrum};
use std::sync::Arc;
use testkit::z_test::{max_abs_z, two_sample_z};

const RATE: f64 = 1e-3;

/// Tilted flakes with areas between 0.3 and 1.2.
const TILTED: [f64; 6] = [0.8, 0.5, 0.3, 0.3, -0.2, 0.1];

/// Returns √(ωᵀSω).
fn area(direction: DVec3) -> f64 {
    let [xx, yy, zz, xy, xz, yz] = TILTED;
    let rows = DMat3::from_cols(
        DVec3::new(xx, xy, xz),
        DVec3::new(xy, yy, yz),
        DVec3::new(xz, yz, zz),
    );
    direction.dot(rows * direction).sqrt()
}

fn flakes(index: impl Into<Field>, sigma_t: f64, albedo: f64) -> Medium {
    fog(index, sigma_t, albedo, 0.0).with_phase(Phase::sggx(TILTED).unwrap())
}

/// Grid over the cube [-1, 1]³ with the given triples.
fn grid(size: [usize; 3], triples: &[[f64; 3]]) -> VolumeTexture {
    let samples = GridSamples {
        size,
        channels: 3,
        data: triples.iter().flatten().map(|v| *v as f32).collect(),
    };
    let to_world = DAffine3::from_scale(DVec3::splat(2.0));
    let to_world = DAffine3::from_translation(-DVec3::ONE) * to_world;
    let any = [f64::MIN, f64::MAX];
    let grid = VolumeGrid::new(
        samples,
        to_world,
        Placement::Centers,
        GridFilter::Trilinear,
        any,
    );
    VolumeTexture::Grid(Arc::new(grid.unwrap()))
}

/// Flakes whose orientation varies along x, from discs to fibres.
fn varying() -> Phase {
    let diagonal = grid([2, 1, 1], &[[0.05, 0.05, 1.0], [0.8, 0.1, 0.6]]);
    let others = grid([2, 1, 1], &[[0.0; 3], [0.2, -0.1, 0.05]]);
    Phase::Sggx(Box::new(Sggx::varying(diagonal, others).unwrap()))
}

/// The depth of a slab of flakes is the area along the ray times the path length, whether the
/// extinction and the matrix are numbers or on grids.
#[test]
fn clear_slabs_absorb_by_the_projected_area() {
    let [xx, yy, zz, xy, xz, yz] = TILTED;
    let on_grid = Sggx::varying(
        grid([2, 1, 1], &[[xx, yy, zz]; 2]),
        grid([2, 1, 1], &[[xy, xz, yz]; 2]),
    );
    let on_grid = Phase::Sggx(Box::new(on_grid.unwrap()));
    let even = || grid([2, 2, 2], &[[1.0; 3]; 8]);
    let uniform = || flakes(Constant::new(1.0), 0.7, 0.5);
    let extinction_on_grid = |medium: Medium| Medium {
        sigma_t: even(),
        scale: 0.7,
        ..medium
    };
    let media = [
        uniform(),
        uniform().with_phase(on_grid.clone()),
        extinction_on_grid(uniform()),
        extinction_on_grid(uniform().with_phase(on_grid)),
    ];
    for (i, medium) in media.into_iter().enumerate() {
        let objects = vec![container(
            Cube::new(DAffine3::IDENTITY).unwrap(),
            Bsdf::Null,
        )];
        let camera = camera(DVec3::Z * -5.0, DVec3::ZERO);
        let scene = parts(objects, vec![vacuum(), medium], vec![sky()], camera);
        let scene = Scene::new(scene).unwrap();
        for direction in [
            DVec3::Z,
            DVec3::new(0.2, -0.1, 1.0),
            DVec3::new(-0.4, 0.3, 1.0),
        ] {
            let direction = direction.normalize();
            let depth = 0.7 * 2.0 / direction.z * area(direction);
            let found = of_ray(&scene, -3.0 * direction, direction)("optical_depth");
            // Samples of grids have single precision.
            assert!(
                (found / depth - 1.0).abs() < 1e-6,
                "medium {i} along {direction}: {found}, expected {depth}"
            );
        }
    }
}

/// In an index with a constant ∇n², rays are parabolas x = x₀ + v₀τ + ∇n² τ²/4, along which
/// ds = n dτ. The depth is ∫ σ_t |Lᵀv| dτ.
#[test]
fn flakes_along_bent_arcs() {
    let (slope, n0, sigma_t) = (DVec3::new(0.0, -0.9, 0.3), 1.4, 0.8);
    let index = LinearSquare::new(n0, slope, DVec3::ZERO).unwrap();
    let direction = DVec3::new(0.6, 0.8, 0.0);
    let (v0, pull) = (n0 * direction, 0.5 * slope);
    let position = |t: f64| v0 * t + 0.5 * pull * t * t;
    // The parameter at which the ray leaves the unit ball.
    let (mut low, mut high) = (0.0, 2.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if position(middle).length() < 1.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let count = 20_000;
    let at = |i: usize| v0 + pull * (low * (i as f64 + 0.5) / count as f64);
    let depth = (0..count).map(|i| area(at(i))).sum::<f64>() * sigma_t * low / count as f64;
    let ball = Sphere::around(DVec3::ZERO, 1.0).unwrap();
    let scene = parts(
        vec![container(ball, Bsdf::Null)],
        vec![vacuum(), flakes(index, sigma_t, 0.5)],
        vec![sky()],
        camera(DVec3::ZERO, direction),
    );
    let scene = Scene::new(scene).unwrap();
    let found = of_ray(&scene, DVec3::ZERO, direction)("optical_depth");
    assert!(
        (found / depth - 1.0).abs() < 1e-6,
        "{found}, expected {depth}"
    );
}

/// In a uniform sky, light has the radiance n² everywhere, if scattering conserves energy and is
/// reciprocal.
#[test]
fn furnace() {
    let index = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
    let media = [
        flakes(index, 3.0, 1.0),
        flakes(index, 3.0, 1.0).with_phase(varying()),
    ];
    for (i, medium) in media.into_iter().enumerate() {
        let ball = Sphere::around(DVec3::ZERO, 1.0).unwrap();
        let from = DVec3::new(0.2, 0.1, 0.3);
        let scene = parts(
            vec![container(ball, Bsdf::Null)],
            vec![vacuum(), medium],
            vec![sky()],
            camera(from, DVec3::ZERO),
        );
        let (found, error) = mean(&shoot(scene, 512, i as u64));
        let exact = 2.0 - from.length_squared();
        assert!(
            (found - exact).abs() < 4.0 * error + 1e-6,
            "{found} ± {error}, expected {exact}"
        );
    }
}

/// A ball of flakes in a beam, seen from the side.
fn in_beam(medium: Medium) -> Parts {
    let ball: Object = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null);
    parts(
        vec![ball],
        vec![vacuum(), medium],
        vec![beam(0.5)],
        view(0.5),
    )
}

/// Balls of flakes that are uniform, on a grid, in a cloud, and where the index bends rays.
fn cases() -> [(&'static str, Parts); 4] {
    let linear = LinearIndex::new(1.2, DVec3::X * 0.2, DVec3::ZERO).unwrap();
    let uniform = |sigma_t| flakes(Constant::new(1.0), sigma_t, 0.8);
    let cloudy = Medium {
        sigma_t: cloud(),
        ..uniform(1.0)
    };
    [
        ("uniform", in_beam(uniform(2.0))),
        ("grid", in_beam(uniform(2.0).with_phase(varying()))),
        ("cloud", in_beam(cloudy)),
        ("bent", in_beam(flakes(linear, 2.0, 0.8))),
    ]
}

#[test]
fn estimators_agree_on_flakes() {
    let effort = Effort {
        batches: 12,
        work: 1_500_000,
    };
    let rows: Vec<_> = cases()
        .into_iter()
        .enumerate()
        .map(|(i, (name, parts))| compare(name, &parts, effort, 9000 + i as u64, Some(effort)))
        .collect();
    println!("{}", table(&rows, RATE, effort));
    judge(&rows, &[], RATE).unwrap();
}

/// Merging removes the scattering coefficient along one of both directions.
#[test]
fn merging_agrees_with_paths_in_flakes() {
    let mut zs = Vec::new();
    for (i, (name, mut parts)) in cases().into_iter().enumerate() {
        (parts.film.width, parts.film.height) = (32, 32);
        let estimator = Vcm {
            radius: Some(0.1),
            ..Vcm::default()
        };
        let rendering = shoot_by(estimator, parts.clone(), 16, 70 + i as u64);
        let merged = rendering.debiased.as_ref().unwrap().film.summary();
        let path = mean(&shoot_by(path_tracer(), parts, 64, 80 + i as u64));
        println!("{name}: path {path:?}, vcm {merged:?}");
        assert!(
            path.1 < 0.02 * path.0 && merged.1 < 0.03 * merged.0,
            "no power"
        );
        zs.push(two_sample_z(path.0, path.1, merged.0, merged.1));
    }
    max_abs_z(&zs, RATE).unwrap();
}

/// Flakes with all normals equally often scatter like isotropic fog of half the extinction, because
/// their area is the square root of 1/4.
#[test]
fn flakes_of_all_normals_are_isotropic_fog() {
    let sphere = Phase::sggx([0.25, 0.25, 0.25, 0.0, 0.0, 0.0]).unwrap();
    let fog = fog(Constant::new(1.0), 1.0, 0.8, 0.0);
    let flakes = Medium {
        sigma_t: VolumeTexture::Uniform(Spectrum::splat(2.0)),
        ..fog.clone().with_phase(sphere)
    };
    let means = [fog, flakes].map(|medium| mean(&shoot(in_beam(medium), 2048, 5)));
    let [(a, se_a), (b, se_b)] = means;
    println!("{means:?}");
    assert!(se_a < 0.02 * a, "no power");
    max_abs_z(&[two_sample_z(a, se_a, b, se_b)], RATE).unwrap();
}
