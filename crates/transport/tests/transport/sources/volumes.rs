//! Emitting volumes, compared with closed forms.

use crate::common::{
    camera, container, fog, glass, mean, parts, path_tracer, shoot_by, sky, vacuum,
};
use crate::sources::support::*;
use eikonal::field::{Constant, LinearSquare, Placement};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::bsdf::{Bsdf, Conductor};
use morgana_transport::emitter::{Emitter, Surroundings, VolumeLight};
use morgana_transport::integrator::{Bdpt, Integrator, ParticleTracer, PhotonMapping, Vcm};
use morgana_transport::path::Workspace;
use morgana_transport::sampling::Sampler;
use morgana_transport::scene::Parts;
use morgana_transport::sensor::{Orthographic, Sensor, SensorRay};
use morgana_transport::shape::{Cube, Disk, Shape};
use morgana_transport::volume::{GridFilter, GridSamples, VolumeGrid};
use morgana_transport::{Scene, Spectrum};
use std::f64::consts::PI;
use std::sync::Arc;
use testkit::z_test::{max_abs_z, z_score};
use testkit::{Family, Mass, Moments, Rng, Table, uniform_edges};

const SIZE: [usize; 3] = [3, 2, 4];

/// A linear map that is neither orthogonal nor right-handed.
fn skewed() -> DAffine3 {
    DAffine3 {
        matrix3: DMat3::from_cols(
            DVec3::new(1.0, 0.2, 0.0),
            DVec3::new(0.0, -0.8, 0.3),
            DVec3::new(0.4, 0.0, 1.5),
        ),
        translation: DVec3::new(-0.5, 0.3, -0.7),
    }
}

fn grid(to_world: DAffine3, placement: Placement, filter: GridFilter) -> VolumeLight {
    let [nx, ny, nz] = SIZE;
    let samples = GridSamples {
        size: SIZE,
        channels: 1,
        data: (0..nx * ny * nz)
            .map(|i| ((5 * i + 2) % 7) as f32)
            .collect(),
    };
    let grid = VolumeGrid::new(samples, to_world, placement, filter, [0.0, f64::MAX]).unwrap();
    VolumeLight::new(grid, Spectrum([0.5, 1.0, 2.0, 0.0])).unwrap()
}

/// A volume of uniform radiance over a box.
pub fn uniform(to_world: DAffine3, radiance: f64) -> Emitter {
    let samples = GridSamples {
        size: [1; 3],
        channels: 1,
        data: vec![1.0],
    };
    let (placement, filter) = (Placement::Centers, GridFilter::Nearest);
    let grid = VolumeGrid::new(samples, to_world, placement, filter, [0.0, f64::MAX]).unwrap();
    let light = VolumeLight::new(grid, Spectrum::splat(radiance)).unwrap();
    Emitter::Volume(Arc::new(light))
}

/// The box from −`half` to `half`.
pub fn centred(half: DVec3) -> DAffine3 {
    DAffine3::from_mat3_translation(DMat3::from_diagonal(2.0 * half), -half)
}

/// All combinations of placements and filters.
fn kinds() -> impl Iterator<Item = (Placement, GridFilter)> {
    let filters = [GridFilter::Trilinear, GridFilter::Nearest];
    let placements = [Placement::Centers, Placement::Nodes];
    placements
        .into_iter()
        .flat_map(move |p| filters.map(|f| (p, f)))
}

/// Sampled points agree with their density, which is the emission, by two marginals each. A
/// midpoint rule of 60 points across gives the densities of the bins, whose edges are edges of the
/// grid.
#[test]
fn points_follow_what_they_emit() {
    const FINE: usize = 60;
    let to_world = skewed();
    let mut family = Family::new(FAMILY);
    for (placement, filter) in kinds() {
        let light = grid(to_world, placement, filter);
        let unit = |x: DVec3| to_world.inverse().transform_point3(x).to_array();
        let volume = to_world.matrix3.determinant().abs();
        for (seed, axes) in [(1, [0, 1, 2]), (2, [2, 0, 1])] {
            let marginal = |p: [f64; 2]| {
                let at = |k: usize| {
                    let mut place = [0.0; 3];
                    place[axes[0]] = p[0];
                    place[axes[1]] = p[1];
                    place[axes[2]] = (k as f64 + 0.5) / FINE as f64;
                    to_world.transform_point3(DVec3::from_array(place))
                };
                let all = (0..FINE).map(|k| light.pdf(at(k)) * volume);
                all.sum::<f64>() / FINE as f64
            };
            let draw = |rng: &mut Rng| {
                let x = light.sample(rng.uniform());
                let place = unit(x);
                Some([place[axes[0]], place[axes[1]]])
            };
            let edges = || uniform_edges(0.0, 1.0, 12);
            let table = Table::new(edges(), edges()).with_mass_tolerance(1e-3);
            let report = table.test(seed, 40_000, Mass::Exactly(1.0), draw, marginal);
            family.push(
                format!("{placement:?} {filter:?} {seed}"),
                report.unwrap().p_value,
            );
        }
    }
    family.check().unwrap();
}

/// The power is 4π times the integral of the values: a midpoint rule of 120³ points, with errors below 1e-4.
#[test]
fn the_power_is_that_of_all_points() {
    const FINE: usize = 120;
    let to_world = skewed();
    for (placement, filter) in kinds() {
        let light = grid(to_world, placement, filter);
        let at = |k: usize| (k as f64 + 0.5) / FINE as f64;
        let mut sum = 0.0;
        for z in 0..FINE {
            for y in 0..FINE {
                for x in 0..FINE {
                    let place = DVec3::new(at(x), at(y), at(z));
                    sum += light.radiance(to_world.transform_point3(place))[0];
                }
            }
        }
        let volume = to_world.matrix3.determinant().abs();
        let expected = 4.0 * PI * volume * sum / FINE.pow(3) as f64;
        let power = light.power();
        assert!(
            (power[0] / expected - 1.0).abs() < 1e-4,
            "{placement:?} {filter:?}"
        );
        assert_eq!((power[1], power[3]), (2.0 * power[0], 0.0));
        let given = light
            .with_power(Spectrum([3.0, 1.0, 0.0, 0.0]))
            .unwrap()
            .power();
        let error = given - Spectrum([3.0, 1.0, 0.0, 0.0]);
        assert!(error.map(f64::abs).max() < 1e-12);
    }
}

/// Tests a volume that is black in some channels, as in films of many channels.
#[test]
fn a_black_volume_sends_nothing_out() {
    let emitter = uniform(skewed(), 0.0);
    let around = Surroundings {
        center: DVec3::ZERO,
        radius: 3.0,
    };
    let none = |_: usize| -> &Shape { unreachable!() };
    assert_eq!(emitter.power(&around, none), Spectrum::ZERO);
    let mut rng = Rng::new(4);
    assert!((0..100).all(|_| emitter.emit(&around, none, rng.uniform()).is_none()));
    assert_eq!(emitter.sample_end(&around, none, [0.3, 0.7]).pdf, 1.0);
    let Emitter::Volume(light) = emitter else {
        unreachable!()
    };
    let inside = skewed()
        .inverse()
        .transform_point3(light.sample([0.3, 0.7]));
    assert!(inside.min_element() >= 0.0 && inside.max_element() <= 1.0);
    assert_eq!(light.radiance(light.sample([0.3, 0.7])), Spectrum::ZERO);
}

/// With a single channel, all emissions have equal weight, which is the power.
#[test]
fn emissions_carry_the_power() {
    let emitter = uniform(skewed(), 0.7);
    let around = Surroundings {
        center: DVec3::ZERO,
        radius: 3.0,
    };
    let none = |_: usize| -> &Shape { unreachable!() };
    let power = emitter.power(&around, none)[0];
    let expected = 4.0 * PI * 0.7 * skewed().matrix3.determinant().abs();
    assert!((power / expected - 1.0).abs() < 1e-12);
    let mut rng = Rng::new(3);
    for _ in 0..1000 {
        let e = emitter.emit(&around, none, rng.uniform()).unwrap();
        let weight = e.emitted[0] / (e.end_pdf * e.pdf);
        assert!((weight / power - 1.0).abs() < 1e-12);
    }
}

/// A view from outside along −z, of ±½ about the axis.
pub fn view() -> Sensor {
    let to_world = facing(DVec3::Z * 4.0, DVec3::NEG_Z, 0.5);
    Sensor::Orthographic(Orthographic::new(to_world, 1.0))
}

fn estimators() -> [Integrator; 3] {
    [
        path_tracer(),
        Integrator::Particle(ParticleTracer::default()),
        Integrator::Bdpt(Bdpt::default()),
    ]
}

/// Returns z-scores of the mean image, by all estimators.
pub fn against(parts: &Parts, expected: f64, samples: u64) -> Vec<f64> {
    let samples = effort(samples);
    let z = |(seed, integrator)| {
        let (found, error) = mean(&shoot_by(integrator, parts.clone(), samples, seed));
        println!("{found} ± {error}, expected {expected}");
        // Without absorption, a single point gives all of the light without noise.
        if (found / expected - 1.0).abs() < 1e-9 {
            0.0
        } else {
            z_score(found, error, expected)
        }
    };
    (1..).zip(estimators()).map(z).collect()
}

/// Visible volumes are not blurred by photon maps and merging.
#[test]
fn photon_maps_see_volumes() {
    let (epsilon, sigma) = (0.8, 1.5f64);
    let half = DVec3::new(1.0, 1.0, 0.5);
    let cube = container(Cube::new(DAffine3::from_scale(half)).unwrap(), Bsdf::Null);
    let media = vec![vacuum(), fog(Constant::new(1.0), sigma, 0.0, 0.0)];
    let emitters = vec![uniform(centred(half), epsilon)];
    let scene = parts(vec![cube], media, emitters, view());
    let expected = epsilon * (1.0 - (-sigma).exp()) / sigma;
    let vcm = Integrator::Vcm(Vcm::default());
    let photon = Integrator::Photon(PhotonMapping::default());
    let z = |integrator| {
        let (found, error) = mean(&shoot_by(integrator, scene.clone(), 500, 4));
        println!("{found} ± {error}, expected {expected}");
        z_score(found, error, expected)
    };
    max_abs_z(&[vcm, photon].map(z), FAMILY).unwrap();
}

/// A pane of glass stands in the middle of a long volume. Its reflected and transmitted fractions
/// add up to one, also for light from its inside. The radiance is therefore ε (2a + d/n²), with a
/// on either side of the thickness d. Tests renders with splitting and without.
#[test]
fn split_rays_gather_once() {
    let (epsilon, n, half) = (0.7, 1.5, DVec3::new(3.0, 3.0, 0.5));
    let cube = container(Cube::new(DAffine3::from_scale(half)).unwrap(), glass());
    let media = vec![vacuum(), fog(Constant::new(n), 0.0, 0.0, 0.0)];
    let emitters = vec![uniform(centred(DVec3::new(2.0, 2.0, 2.0)), epsilon)];
    let scene = Scene::new(parts(vec![cube], media, emitters, view())).unwrap();
    let expected = epsilon * (2.0 * 1.5 + 1.0 / (n * n));
    let ray = SensorRay {
        origin: DVec3::new(0.1, 0.2, 4.0),
        direction: DVec3::NEG_Z,
    };
    let z = |splitting| {
        let mut ws = Workspace::new(scene.tolerance());
        ws.first_vertex.splitting = splitting;
        let mut moments = Moments::default();
        for sample in 0..100_000 {
            let (mut sampler, mut found) = (Sampler::new(5, 0, sample), Vec::new());
            path_tracer().sample(&scene, ray, 1, &mut sampler, &mut ws, &mut found);
            moments.push(found.iter().map(|c| c.weighted()[0]).sum());
        }
        println!(
            "{} ± {}, expected {expected}",
            moments.mean(),
            moments.standard_error()
        );
        moments.z(expected)
    };
    max_abs_z(&[false, true].map(z), FAMILY).unwrap();
}

/// In a box that absorbs and emits, the outgoing radiance is ε (1 − e^{−σd})/σ; a mirror behind the
/// box shows it again.
#[test]
fn boxes_in_view_have_their_radiance() {
    let (epsilon, sigma) = (0.8, 1.5f64);
    let half = DVec3::new(1.0, 1.0, 0.5);
    let cube = || Shape::from(Cube::new(DAffine3::from_scale(half)).unwrap());
    let light = || vec![uniform(centred(half), epsilon)];
    let media = |n: f64, sigma| vec![vacuum(), fog(Constant::new(n), sigma, 0.0, 0.0)];
    let mut zs = Vec::new();
    let absorbed = epsilon * (1.0 - (-sigma).exp()) / sigma;
    let hull = |wall| vec![container(cube(), wall)];
    let clear = parts(vec![], vec![vacuum()], light(), view());
    zs.extend(against(&clear, epsilon, 4));
    zs.extend(against(
        &parts(hull(Bsdf::Null), media(1.0, sigma), light(), view()),
        absorbed,
        2000,
    ));
    // Radiance passes a declared index match unchanged.
    let matched = parts(hull(Bsdf::Null), media(1.4, sigma), light(), view());
    zs.extend(against(&matched, absorbed, 2000));
    // The mirror behind it reflects six tenths, which pass through the box.
    let mut mirrored = parts(hull(Bsdf::Null), media(1.0, sigma), light(), view());
    let mut mirror = unseen(Disk::new(facing(DVec3::Z * -1.0, DVec3::Z, 3.0)).unwrap());
    mirror.bsdf = Bsdf::Conductor(
        Conductor::new(Spectrum::ZERO, Spectrum::ONE, Spectrum::splat(0.6)).unwrap(),
    );
    mirrored.objects.push(mirror);
    let twice = absorbed * (1.0 + 0.6 * (-sigma).exp());
    zs.extend(against(&mirrored, twice, 2000));
    max_abs_z(&zs, FAMILY).unwrap();
}

/// All media emit σ_a n² and the sky has radiance 1, so that L/n² is 1 everywhere. Absorption and
/// emission balance, for any scattering and index. n² is linear and the volume trilinear, so that
/// the result is exact.
#[test]
fn a_graded_furnace_is_even() {
    let (sigma, albedo) = (1.2, 0.4);
    let half = DVec3::splat(0.7);
    let slope = DVec3::new(0.3, 0.2, -0.25);
    let squared = |x: DVec3| 1.7 + slope.dot(x);
    let to_world = centred(half);
    let corner = |c: usize| DVec3::from_array([c & 1, c >> 1 & 1, c >> 2].map(|b| b as f64));
    let value = |c: usize| sigma * (1.0 - albedo) * squared(to_world.transform_point3(corner(c)));
    let samples = GridSamples {
        size: [2; 3],
        channels: 1,
        data: (0..8).map(|c| value(c) as f32).collect(),
    };
    let (placement, filter) = (Placement::Nodes, GridFilter::Trilinear);
    let grid = VolumeGrid::new(samples, to_world, placement, filter, [0.0, f64::MAX]).unwrap();
    let light = VolumeLight::new(grid, Spectrum::ONE).unwrap();
    let index = LinearSquare::new(1.7f64.sqrt(), slope, DVec3::ZERO).unwrap();
    let cube = container(Cube::new(DAffine3::from_scale(half)).unwrap(), glass());
    let media = vec![vacuum(), fog(index, sigma, albedo, 0.5)];
    let emitters = vec![sky(), Emitter::Volume(Arc::new(light))];
    let mut scene = parts(vec![cube], media, emitters, eye());
    scene.reflections = 3;
    let zs = against(&scene, 1.0, 400);
    max_abs_z(&zs, FAMILY).unwrap();
}

/// The furnace also holds with an index that is declared to match the surroundings.
#[test]
fn a_furnace_is_even() {
    let (sigma, albedo, half) = (1.2, 0.4, DVec3::splat(0.7));
    let cube = container(Cube::new(DAffine3::from_scale(half)).unwrap(), Bsdf::Null);
    let media = vec![vacuum(), fog(Constant::new(1.4), sigma, albedo, 0.5)];
    let emitters = vec![sky(), uniform(centred(half), sigma * (1.0 - albedo))];
    let scene = parts(vec![cube], media, emitters, eye());
    max_abs_z(&against(&scene, 1.0, 1000), FAMILY).unwrap();
}

pub fn eye() -> Sensor {
    camera(DVec3::new(0.5, 0.4, 2.5), DVec3::ZERO)
}
