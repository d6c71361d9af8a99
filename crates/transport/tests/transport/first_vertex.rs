//! First-vertex techniques: forced collisions on first edges that would otherwise leave the scene
//! without a collision, and splitting of first edges at refraction and reflection.
//!
//! False alarms: a family-wise rate of 1e-4 each for means with forced collisions, depths of forced
//! collisions, and means with splitting.

use crate::common::{camera, container, fog, glass, parts, path_tracer, samples, sky, vacuum};
use eikonal::field::{Constant, Gaussian, Placement};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::bsdf::{Bsdf, Dielectric, Diffuse};
use morgana_transport::emitter::Emitter;
use morgana_transport::integrator::{Contribution, Integrator, ParticleTracer, PathTracer};
use morgana_transport::medium::Medium;
use morgana_transport::path::{
    Edge, End, RayPart, Sampling, Start, TransportMode, Workspace, trace,
};
use morgana_transport::render::{FirstVertexTechniques, RenderOptions, render};
use morgana_transport::sampling::{Replicates, Sampler};
use morgana_transport::scene::{Object, Parts, Sides};
use morgana_transport::sensor::SensorRay;
use morgana_transport::shape::{Cube, Rectangle, Sphere};
use morgana_transport::volume::{GridFilter, GridSamples, VolumeGrid, VolumeTexture};
use morgana_transport::{Scene, Spectrum};
use std::f64::consts::PI;
use std::ops::ControlFlow;
use testkit::batches::{moments, welch};
use testkit::{Family, Moments};

const FALSE_ALARM: f64 = 1e-4;

fn cube(half: f64) -> Cube {
    Cube::new(DAffine3::from_scale(DVec3::splat(half))).unwrap()
}

/// A sun that shines from above.
fn sun() -> Emitter {
    Emitter::Directional {
        direction: -DVec3::Y,
        irradiance: Spectrum::ONE,
    }
}

fn point_light() -> Emitter {
    Emitter::Point {
        position: DVec3::new(0.3, 0.4, -0.2),
        intensity: Spectrum::ONE,
    }
}

fn scene(objects: Vec<Object>, media: Vec<Medium>, emitter: Emitter) -> Parts {
    parts(
        objects,
        media,
        vec![emitter],
        camera(DVec3::Z * 4.0, DVec3::ZERO),
    )
}

/// A cube of fog.
fn foggy(medium: Medium, emitter: Emitter) -> Scene {
    let fog = container(cube(1.0), Bsdf::Null);
    Scene::new(scene(vec![fog], vec![vacuum(), medium], emitter)).unwrap()
}

/// A cube in a cube, of different colours and densities, also between channels.
fn nested() -> Scene {
    let [outer, inner] = [1.0, 0.5].map(|half| container(cube(half), Bsdf::Null));
    let inner = Object {
        sides: Some(Sides {
            interior: 2,
            exterior: 1,
        }),
        ..inner
    };
    let coloured = |sigma_t| Medium {
        sigma_t: VolumeTexture::Uniform(Spectrum(sigma_t)),
        ..fog(Constant::new(1.0), 1.0, 0.8, 0.4)
    };
    let media = vec![
        vacuum(),
        coloured([0.2, 0.9, 0.0, 0.0]),
        coloured([1.5, 0.3, 0.0, 0.0]),
    ];
    let mut parts = scene(vec![outer, inner], media, sun());
    parts.film.channels = 2;
    Scene::new(parts).unwrap()
}

/// A cube of smoke whose density increases to one side.
fn smoky() -> Scene {
    let samples = GridSamples {
        size: [3; 3],
        channels: 1,
        data: (0..27).map(|i| 0.1 + 0.05 * i as f32).collect(),
    };
    let to_world = DAffine3 {
        matrix3: DMat3::from_diagonal(DVec3::splat(2.0)),
        translation: -DVec3::ONE,
    };
    let filter = GridFilter::Trilinear;
    let grid = VolumeGrid::new(samples, to_world, Placement::Nodes, filter, [0.0, 10.0]).unwrap();
    let medium = Medium {
        sigma_t: VolumeTexture::Grid(std::sync::Arc::new(grid)),
        ..fog(Constant::new(1.0), 1.0, 0.8, 0.0)
    };
    foggy(medium, sun())
}

/// A cube of fog that bends light.
fn bending() -> Scene {
    let index = Gaussian::new(1.0, 0.15, DVec3::new(0.2, 0.1, 0.0), 0.4).unwrap();
    foggy(fog(index, 0.5, 0.9, 0.5), point_light())
}

/// Techniques of scenes in which neither helps: none.
const NATURAL: FirstVertexTechniques = FirstVertexTechniques {
    forced_collisions: 0,
    splitting: false,
};

/// Forced collisions on the first `edges` edges.
fn forced(edges: u32) -> FirstVertexTechniques {
    FirstVertexTechniques {
        forced_collisions: edges,
        ..NATURAL
    }
}

fn splitting(splitting: bool) -> FirstVertexTechniques {
    FirstVertexTechniques {
        splitting,
        ..NATURAL
    }
}

/// Contributions of a number of paths along a ray, and the techniques that they used.
fn paths(
    scene: &Scene,
    tracer: PathTracer,
    first_vertex: FirstVertexTechniques,
    (ray, channels): (SensorRay, usize),
    samples: u64,
) -> Vec<Vec<Contribution>> {
    let mut ws = Workspace::new(scene.tolerance());
    ws.first_vertex = first_vertex;
    let integrator = Integrator::Path(tracer);
    let seed =
        7 + u64::from(first_vertex.forced_collisions) + 1000 * u64::from(first_vertex.splitting);
    let take = |sample| {
        let (mut sampler, mut found) = (Sampler::new(seed, 0, sample), Vec::new());
        integrator.sample(scene, ray, channels, &mut sampler, &mut ws, &mut found);
        found
    };
    (0..samples).map(take).collect()
}

/// Light that each path contributes.
fn light(
    scene: &Scene,
    tracer: PathTracer,
    first_vertex: FirstVertexTechniques,
    ray: (SensorRay, usize),
    samples: u64,
) -> Vec<f64> {
    let paths = paths(scene, tracer, first_vertex, ray, samples);
    let value = |found: &Vec<Contribution>| found.iter().map(|c| c.weighted().sum()).sum();
    paths.iter().map(value).collect()
}

/// Means over batches of values.
fn batches(values: &[f64]) -> Vec<f64> {
    let size = values.len() / 100;
    let means = values
        .chunks(size)
        .map(|batch| batch.iter().sum::<f64>() / size as f64);
    means.collect()
}

fn ray() -> SensorRay {
    let origin = DVec3::new(0.2, -0.3, 4.0);
    SensorRay {
        origin,
        direction: (DVec3::new(-0.1, 0.1, 0.0) - origin).normalize(),
    }
}

/// In homogeneous fog, all forced collisions contribute equally if the distance to the light is
/// equal from everywhere on the ray: single scattering in closed form, to rounding.
#[test]
fn single_scattering_has_no_variance() {
    let sigma_t = 0.3;
    let scene = foggy(fog(Constant::new(1.0), sigma_t, 0.8, 0.0), sun());
    let ray = SensorRay {
        origin: DVec3::new(0.1, 0.2, 4.0),
        direction: -DVec3::Z,
    };
    let tracer = PathTracer {
        max_depth: Some(2),
        ..PathTracer::default()
    };
    let above: f64 = 1.0 - 0.2;
    let exact = 0.8 / (4.0 * PI) * (-sigma_t * above).exp() * (1.0 - (-sigma_t * 2.0).exp());
    let found = light(&scene, tracer, forced(1), (ray, 1), 100);
    assert!(
        found.iter().all(|value| (value / exact - 1.0).abs() < 1e-8),
        "{found:?} {exact}"
    );
    // Without forced collisions, nearly half of the paths contribute nothing.
    let natural = light(&scene, tracer, forced(0), (ray, 1), 100);
    assert!(natural.iter().filter(|value| **value == 0.0).count() > 30);
}

/// Means with forced collisions equal means without, on any number of edges: in several media and
/// channels, in smoke, and where rays bend. Variances are smaller.
#[test]
fn means_stay() {
    let mut family = Family::new(FALSE_ALARM);
    for (name, scene, channels) in [
        ("nested", nested(), 2),
        ("smoke", smoky(), 1),
        ("bent", bending(), 1),
    ] {
        let means = |edges| {
            batches(&light(
                &scene,
                tracer(),
                forced(edges),
                (ray(), channels),
                20_000,
            ))
        };
        let natural = means(0);
        for edges in [1, 3, 30] {
            let found = means(edges);
            let [a, b] = [&natural, &found].map(|batches| moments(batches));
            println!(
                "{name}, {edges}: {:.5} {:.5}, variances {:.2e} {:.2e}",
                a.mean(),
                b.mean(),
                a.variance(),
                b.variance()
            );
            family.push(format!("{name} {edges}"), welch(&natural, &found, 1e-12));
            assert!(b.variance() < 0.9 * a.variance());
        }
    }
    family.check().unwrap();
}

fn tracer() -> PathTracer {
    match path_tracer() {
        Integrator::Path(tracer) => tracer,
        _ => unreachable!(),
    }
}

fn forced_edge(scene: &Scene, direction: DVec3, seed: u64) -> Edge<'_> {
    edge_and_parts(scene, direction, seed, true).0
}

/// Returns an edge with its parts. Only forced edges are extended and have spans.
fn edge_and_parts(
    scene: &Scene,
    direction: DVec3,
    seed: u64,
    forced: bool,
) -> (Edge<'_>, Vec<RayPart>) {
    let sampling = Sampling {
        mode: TransportMode::Radiance,
        channel_pdf: Spectrum([0.5, 0.5, 0.0, 0.0]),
        extend: forced,
        collides: true,
        spans: forced,
        parts: true,
        forced,
        differentials: true,
        splitting: false,
    };
    let mut ws = Workspace::new(scene.tolerance());
    let start = Start::point(DVec3::new(0.1, 0.2, 3.0), direction, 0);
    let mut sampler = Sampler::new(seed, 0, 0);
    let edge = trace(scene, start, sampling, &mut sampler, &mut ws);
    (edge, ws.edge_parts)
}

/// The parts of an edge end where the edge does. The edge ends at a forced or natural collision,
/// behind or in front of a refracting surface, or where it leaves the scene.
#[test]
fn parts_are_those_up_to_the_end() {
    let glassy = ball(glass(), fog(Constant::new(1.5), 1.0, 0.8, 0.0), vec![sun()]);
    let scenes = [nested(), bending(), glassy];
    let [mut collided, mut left] = [0; 2];
    let edges = scenes.iter().flat_map(|s| (0..100).map(move |i| (s, i)));
    for (scene, seed) in edges {
        let across = if seed % 10 == 0 { 1.0 } else { 0.2 };
        let direction = DVec3::new(across, 0.1, -1.0).normalize();
        for forced in [false, true] {
            let (edge, parts) = edge_and_parts(scene, direction, seed, forced);
            let length: f64 = parts.iter().map(|p| p.arc.arc_length(p.theta_end)).sum();
            assert!((length - edge.length).abs() < 1e-8);
            let mut pairs = parts.iter().zip(&edge.spans);
            assert!(pairs.all(|(p, s)| p.medium == s.medium && p.arc == s.arc));
            match &edge.end {
                End::Collision(point) => {
                    let last = parts.last().unwrap();
                    let x = last.arc.position(last.theta_end);
                    assert!((x - point.x).length() < 1e-8 && last.medium == point.medium);
                    collided += 1;
                }
                _ => {
                    assert!(!forced || parts.len() == edge.spans.len());
                    left += 1;
                }
            }
        }
    }
    println!("{collided} collided, {left} left");
    assert!(collided > 300 && left > 100);
}

/// Depths of collisions have the reported distribution, (1 − e⁻ᵈ)/(1 − e⁻ᴰ) in each channel.
/// Positions belong to the depths.
#[test]
fn depths_have_their_distribution() {
    let scene = nested();
    let whole = [0.2 + 1.5, 0.9 + 0.3];
    let seeds = 20_000;
    let cuts = [0.1, 0.3, 0.5, 0.8, 1.2];
    let mut below = cuts.map(|_| Moments::default());
    for seed in 0..seeds {
        let edge = forced_edge(&scene, -DVec3::Z, seed);
        let End::Collision(point) = edge.end else {
            panic!("{:?}", edge.end);
        };
        let deep = 1.0 - point.x.z;
        let depth =
            0.2 * deep.min(0.5) + 1.5 * (deep - 0.5).clamp(0.0, 1.0) + 0.2 * (deep - 1.5).max(0.0);
        assert!((point.depth[0] - depth).abs() < 1e-8 && (point.length - 2.0 - deep).abs() < 1e-8);
        assert!(
            (edge.optical_length - point.length).abs() < 1e-8 && edge.geometry.depth == point.depth
        );
        for (cut, below) in cuts.iter().zip(&mut below) {
            below.push(f64::from(u8::from(point.depth[0] < *cut)));
        }
    }
    // Depth of the second channel where the depth of the first is d.
    let other = |d: f64| {
        if d < 0.1 {
            4.5 * d
        } else {
            0.45 + 0.2 * (d - 0.1)
        }
    };
    let share = |d: f64, whole: f64| (-d).exp_m1() / (-whole).exp_m1();
    let mut family = Family::new(FALSE_ALARM);
    for (cut, below) in cuts.iter().zip(&below) {
        let exact = 0.5 * (share(*cut, whole[0]) + share(other(*cut), whole[1]));
        println!("below {cut}: {:.4}, exact {exact:.4}", below.mean());
        family.push(format!("{cut}"), testkit::z_test::p_value(below.z(exact)));
    }
    family.check().unwrap();
}

/// Nothing is forced where the edge meets no medium, nor where it ends on a surface.
#[test]
fn only_what_would_leave_is_forced() {
    let cubes = nested();
    let past = forced_edge(&cubes, DVec3::new(1.0, 0.0, -0.1).normalize(), 1);
    assert!(matches!(past.end, End::Escaped { .. }) && past.forcing == Spectrum::ONE);
    let wall = Object {
        name: "wall".into(),
        shape: Rectangle::new(DAffine3::from_translation(-3.0 * DVec3::Z))
            .unwrap()
            .into(),
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::ONE).unwrap()),
        sides: None,
        emitter: None,
    };
    let objects = vec![container(cube(1.0), Bsdf::Null), wall];
    let media = vec![vacuum(), fog(Constant::new(1.0), 0.5, 0.8, 0.0)];
    let scene = Scene::new(scene(objects, media, sun())).unwrap();
    let mut hits = 0;
    for seed in 0..100 {
        let edge = forced_edge(&scene, -DVec3::Z, seed);
        assert_eq!(edge.forcing, Spectrum::ONE);
        hits += u32::from(matches!(edge.end, End::Surface { .. }));
    }
    assert!((20..60).contains(&hits), "{hits}");
}

/// A ball of glass, with a medium inside.
fn ball(glass: Bsdf, inside: Medium, emitters: Vec<Emitter>) -> Scene {
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), glass);
    let camera = camera(DVec3::Z * 4.0, DVec3::ZERO);
    Scene::new(parts(vec![ball], vec![vacuum(), inside], emitters, camera)).unwrap()
}

/// A ray that meets the ball at 50° from its normal.
fn slanting() -> SensorRay {
    SensorRay {
        origin: DVec3::new(50f64.to_radians().sin(), 0.0, 4.0),
        direction: -DVec3::Z,
    }
}

/// Fraction of the slanting ray that a ball of this index reflects, by Fresnel's equations.
fn reflectance(n: f64) -> f64 {
    let (sin, cos) = 50f64.to_radians().sin_cos();
    let far = (1.0 - (sin / n).powi(2)).sqrt();
    let [s, p] = [
        (cos - n * far) / (cos + n * far),
        (n * cos - far) / (n * cos + far),
    ];
    0.5 * (s * s + p * p)
}

/// Nothing is refracted out of a black ball. Each split contributes the reflected part of the sky,
/// by Fresnel's equations, along the path of a randomly reflected ray.
#[test]
fn reflections_have_no_variance() {
    let n = 1.5;
    let black = fog(Constant::new(n), 1e3, 0.0, 0.0);
    let scene = ball(glass(), black, vec![sky()]);
    let exact = reflectance(n);
    let taken = |first_vertex| paths(&scene, tracer(), first_vertex, (slanting(), 1), 400);
    let reflected = taken(splitting(true)).concat();
    assert_eq!(reflected.len(), 400);
    let chance = taken(splitting(false)).concat();
    assert!((10..60).contains(&chance.len()), "{}", chance.len());
    let by_chance = chance[0].path;
    for found in reflected {
        assert!((found.weighted()[0] / exact - 1.0).abs() < 1e-9);
        assert_eq!(found.path.bounces, by_chance.bounces);
        assert!((found.path.optical_length - by_chance.optical_length).abs() < 1e-9);
    }
}

/// The number of reflected samples among the 64 of a replicate follows Fresnel's equations, rounded
/// up or down.
#[test]
fn reflections_are_spread_evenly() {
    let black = fog(Constant::new(1.5), 1e3, 0.0, 0.0);
    let scene = ball(glass(), black, vec![sky()]);
    let expected = 64.0 * reflectance(1.5);
    let mut ws = Workspace::new(scene.tolerance());
    let integrator = Integrator::Path(tracer());
    for pixel in 0..200 {
        let is_reflected = |sample: &u64| {
            let mut found = Vec::new();
            let mut sampler =
                Sampler::in_replicates(Replicates::new(64).unwrap(), [7, pixel, *sample]);
            integrator.sample(&scene, slanting(), 1, &mut sampler, &mut ws, &mut found);
            !found.is_empty()
        };
        let reflected = (0..64).filter(is_reflected).count() as f64;
        assert!((reflected - expected).abs() < 1.0, "{reflected}");
    }
}

/// Without reflection, only the refracted path remains.
#[test]
fn a_split_that_brings_nothing_is_left() {
    let n = 1.5;
    let tinted = Dielectric::new(Spectrum::ZERO, Spectrum::ONE).unwrap();
    let clear = fog(Constant::new(n), 0.0, 0.0, 0.0);
    let scene = ball(Bsdf::Dielectric(tinted), clear, vec![sky()]);
    let transmitted = 1.0 - reflectance(n);
    let found = light(&scene, tracer(), splitting(true), (slanting(), 1), 2000);
    // Inside, random reflection at the wall loses a part.
    assert!(found.iter().all(|value| value.is_finite()));
    let lit: Vec<_> = found.iter().filter(|value| **value > 0.0).collect();
    assert!(lit.len() > 1700, "{}", lit.len());
    assert!(
        lit.iter()
            .all(|value| (*value / transmitted - 1.0).abs() < 1e-9)
    );
}

/// The two parts add up to everything: a ball without absorption under a sky of radiance 1 is
/// invisible.
#[test]
fn parts_add_up() {
    let clear = fog(Constant::new(1.5), 0.0, 0.0, 0.0);
    let scene = ball(glass(), clear, vec![sky()]);
    let unlimited = PathTracer {
        rr_depth: 1000,
        ..PathTracer::default()
    };
    for value in light(&scene, unlimited, splitting(true), (slanting(), 1), 200) {
        assert!((value - 1.0).abs() < 1e-9, "{value}");
    }
}

/// Means with splitting equal means without. The scene has fog of two colours in front of the ball
/// and inside, under light from an emitter, the sun and the sky. Tests paths of limited length,
/// too.
#[test]
fn splitting_keeps_means() {
    let coloured = |sigma_t, n| Medium {
        sigma_t: VolumeTexture::Uniform(Spectrum(sigma_t)),
        ..fog(Constant::new(n), 1.0, 0.8, 0.4)
    };
    let inner = Object {
        sides: Some(Sides {
            interior: 2,
            exterior: 1,
        }),
        ..container(Sphere::around(DVec3::ZERO, 0.6).unwrap(), glass())
    };
    let objects = vec![container(cube(1.5), Bsdf::Null), inner];
    let media = vec![
        vacuum(),
        coloured([0.1, 1.5, 0.0, 0.0], 1.0),
        coloured([2.0, 0.6, 0.0, 0.0], 1.4),
    ];
    let mut parts = parts(
        objects,
        media,
        vec![point_light(), sun(), sky()],
        camera(DVec3::Z * 4.0, DVec3::ZERO),
    );
    let Emitter::Point { position, .. } = &mut parts.emitters[0] else {
        unreachable!()
    };
    *position = DVec3::new(0.9, 0.8, 0.7);
    parts.film.channels = 2;
    let scene = Scene::new(parts).unwrap();
    let mut family = Family::new(FALSE_ALARM);
    // A grazing ray, of which the ball reflects much.
    let grazing = SensorRay {
        origin: DVec3::new(0.57, 0.0, 4.0),
        direction: -DVec3::Z,
    };
    for max_depth in [Some(2), Some(3), None] {
        let tracer = PathTracer {
            max_depth,
            ..tracer()
        };
        let means = |first_vertex| {
            batches(&light(
                &scene,
                tracer,
                first_vertex,
                (grazing, 2),
                samples(50_000, 20_000),
            ))
        };
        let [by_chance, split_off] = [false, true].map(|on| means(splitting(on)));
        let [a, b] = [&by_chance, &split_off].map(|batches| moments(batches));
        println!(
            "{max_depth:?}: {:.5} {:.5}, variances {:.2e} {:.2e}",
            a.mean(),
            b.mean(),
            a.variance(),
            b.variance()
        );
        family.push(
            format!("{max_depth:?}"),
            welch(&by_chance, &split_off, 1e-12),
        );
    }
    family.check().unwrap();
}

/// Returns the first-vertex techniques that the pilot of a render chooses.
fn chosen(scene: Scene, integrator: Integrator) -> FirstVertexTechniques {
    let options = RenderOptions::new(integrator, 1, 1);
    let rendering = render(&[scene], &options, |_| ControlFlow::Continue(()));
    rendering.first_vertex
}

/// A glass ball under a sky, and an emitter of some radius that few pixels see reflected.
fn mirroring(inside: Medium, radius: f64) -> Scene {
    let light = Object {
        name: "light".into(),
        shape: Sphere::around(DVec3::new(1.5, 1.8, 1.2), radius)
            .unwrap()
            .into(),
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::ZERO).unwrap()),
        sides: None,
        emitter: Some(0),
    };
    let emitter = Emitter::Area {
        object: 1,
        radiance: Spectrum::splat(20.0),
    };
    let ball = container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), glass());
    let camera = camera(DVec3::Z * 4.0, DVec3::ZERO);
    let mut parts = parts(
        vec![ball, light],
        vec![vacuum(), inside],
        vec![emitter, sky()],
        camera,
    );
    // Use small pixels, which resolve the reflection.
    (parts.film.width, parts.film.height) = (48, 48);
    Scene::new(parts).unwrap()
}

/// Pilots choose the techniques only where they help: in thin smoke without an environment, and at
/// glass balls that reflect an emitter. The emitter may be in few pixels (0.1 % of the image),
/// whose reflection of 4 % paths that choose one direction hardly find. Pilots do not choose them
/// where paths that leave the scene find light, for other estimators, or where the glass is not
/// seen.
#[test]
fn pilots_choose_what_pays() {
    let path = Integrator::Path(tracer());
    let particle = Integrator::Particle(ParticleTracer::default());
    assert_eq!(chosen(smoky(), path), forced(3));
    assert_eq!(chosen(smoky(), particle), NATURAL);
    let smoke = fog(Constant::new(1.0), 0.1, 0.8, 0.0);
    assert_eq!(chosen(foggy(smoke, sky()), path), NATURAL);
    let milk = || fog(Constant::new(1.33), 3.0, 0.9, 0.7);
    let clear = fog(Constant::new(1.5), 0.0, 0.0, 0.0);
    assert_eq!(chosen(mirroring(milk(), 0.25), path), splitting(true));
    assert_eq!(chosen(mirroring(milk(), 0.25), particle), NATURAL);
    assert_eq!(chosen(mirroring(clear, 0.1), path), splitting(true));
    let bead = Object {
        sides: Some(Sides {
            interior: 2,
            exterior: 1,
        }),
        ..container(
            Sphere::around(DVec3::new(0.3, 0.4, 0.0), 1e-6).unwrap(),
            glass(),
        )
    };
    let objects = vec![container(cube(1.0), Bsdf::Null), bead];
    let media = vec![
        vacuum(),
        fog(Constant::new(1.0), 0.5, 0.8, 0.0),
        fog(Constant::new(1.5), 0.0, 0.0, 0.0),
    ];
    let unseen = Scene::new(scene(objects, media, sky())).unwrap();
    assert_eq!(chosen(unseen, path), NATURAL);
}
