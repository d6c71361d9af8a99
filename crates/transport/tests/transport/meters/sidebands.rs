//! Sidebands and correlations of tagged light, on films and by meters, compared with each other,
//! with records, with a closed form, and with their sum.
//!
//! Statistical tests have a family-wise false-alarm rate of 1e-3 each.

use crate::layers::bounded;
use crate::meters::free_flights::{hull, net};
use crate::meters::support::*;
use crate::meters::tagged::{N0, cases, sound, water};
use eikonal::Aabb;
use eikonal::field::{Constant, Placement, SampledSound, SoundSamples};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::bsdf::Bsdf;
use morgana_transport::film::{Decomposition, Film, LightParts};
use morgana_transport::integrator::{Integrator, PathTracer};
use morgana_transport::medium::Medium;
use morgana_transport::meter::{Coordinates, Estimator, FluenceMeter, Meter};
use morgana_transport::render::{RenderOptions, Rendering};
use morgana_transport::renderer::Renderer;
use morgana_transport::scene::{Object, Parts};
use morgana_transport::sensor::{Perspective, Sensor};
use morgana_transport::shape::{Cube, Sphere};
use morgana_transport::sidebands::Sidebands;
use morgana_transport::volume::VolumeTexture;
use morgana_transport::{Bins, Scene, Spectrum};
use std::f64::consts::TAU;
use testkit::z_test::max_abs_z;

/// Wavelength for which phases are of the order of one.
const WAVELENGTH: f64 = 1.5e-4;
const ORDERS: u32 = 2;
const DELAYS: u32 = 2;

fn sidebands() -> Sidebands {
    Sidebands::new(WAVELENGTH, ORDERS, DELAYS).unwrap()
}

pub fn without_sound(mut parts: Parts) -> Parts {
    for medium in &mut parts.media {
        medium.index = medium.index.without_sound();
    }
    parts
}

/// Starts and directions of rays.
pub fn rays() -> [[DVec3; 2]; 2] {
    let start = DVec3::new(0.4, -0.3, -2.0);
    let through = |x: DVec3| [start, (x - start).normalize()];
    [
        through(DVec3::new(0.1, 0.2, 0.0)),
        through(DVec3::new(-0.5, -0.2, 0.3)),
    ]
}

/// Scene with a pixel that sees one ray, in a bright environment.
pub fn seen(parts: Parts, [start, z]: [DVec3; 2]) -> Parts {
    let x = z.any_orthonormal_vector();
    let to_world = DAffine3 {
        matrix3: DMat3::from_cols(x, z.cross(x), z),
        translation: start,
    };
    let mut parts = Parts {
        emitters: vec![sky()],
        sensor: Sensor::Perspective(Perspective::new(to_world, 1e-5, 1.0)),
        ..parts
    };
    (parts.film.width, parts.film.height) = (1, 1);
    parts
}

/// Scene with a beam along a ray, and a sphere around everything.
pub fn lit(parts: Parts, [start, direction]: [DVec3; 2]) -> Parts {
    let mut parts = Parts {
        emitters: vec![beam(start, direction, 1e-9)],
        ..parts
    };
    parts.objects.push(Object {
        sides: None,
        ..container(Sphere::around(DVec3::ZERO, 3.0).unwrap(), Bsdf::Null)
    });
    parts
}

pub fn tagged_film(parts: Parts, sidebands: Option<Sidebands>, samples: u64) -> Rendering {
    tagged_film_by(PathTracer::default(), parts, sidebands, samples)
}

pub fn tagged_film_by(
    integrator: impl Into<Renderer>,
    parts: Parts,
    sidebands: Option<Sidebands>,
    samples: u64,
) -> Rendering {
    let scene = Scene::new(parts).unwrap();
    scene.render(&RenderOptions {
        decomposition: Decomposition {
            parts: sidebands.map(LightParts::Sidebands),
            ..Decomposition::default()
        },
        ..RenderOptions::new(integrator, samples, 4)
    })
}

/// Mean and standard error of a layer.
pub fn layer(rendering: &Rendering, layer: usize) -> [f64; 2] {
    let film = &rendering.film;
    let mean = film.mean_at(Some(layer), 0, 0);
    [
        f64::from(mean),
        f64::from(film.variance_at(Some(layer), 0, 0)).sqrt(),
    ]
}

/// Tests all light that leaves the ball: from a beam into it, and, by reciprocity, along a ray from
/// the sensor in an environment of radiance 1.
#[test]
fn films_and_meters_find_the_same_sidebands() {
    let mut zs = Vec::new();
    let [ray, _] = rays();
    for (name, parts) in cases() {
        let rendering = tagged_film(
            seen(without_sound(parts.clone()), ray),
            Some(sidebands()),
            particles(6_000),
        );
        let parts = lit(without_sound(parts), ray);
        let mut meter = through(&parts.objects, 1, [1, 1], false);
        meter.sidebands = Some(sidebands());
        let meters = [Meter::Irradiance(meter)];
        let measured = run(parts, &meters, &options(particles(12_000), 9));
        let [orders, delays] =
            ["power_sidebands", "power_correlation"].map(|name| reading(&measured, 0, name));
        for (first, found) in [(1, orders), (2 + ORDERS as usize, delays)] {
            for i in 0..found.mean.len() / 2 {
                let [mean, error] = layer(&rendering, first + i);
                let (other, its) = (found.mean[2 * i], found.error[2 * i]);
                println!(
                    "{name}, {} {i}: {mean} ± {error}, {other} ± {its}",
                    found.name
                );
                assert!(error < 0.1 * mean.abs().max(0.1));
                zs.push((mean - other) / error.hypot(its));
            }
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// The ball in an image of four pixels, in the light of its point source, of its own fog and of the
/// sky.
fn pictured(mut parts: Parts) -> Parts {
    parts.media[1].emission = Some(VolumeTexture::Uniform(Spectrum::splat(0.05)));
    let [ray, _] = rays();
    let own = parts.emitters.clone();
    let mut parts = seen(parts, ray);
    parts.emitters.extend(own);
    parts.sensor = Sensor::Perspective(Perspective::new(*parts.sensor.to_world(), 0.4, 1.0));
    (parts.film.width, parts.film.height) = (2, 2);
    parts
}

/// The path tracer adds modulations up from the sensor, the particle tracer from the emitter, and
/// bidirectional path tracing from both; at most 5 edges and events.
#[test]
fn estimators_find_the_same_sidebands() {
    let mut zs = Vec::new();
    let parts_of_layers = 1 + sidebands().parts();
    for (name, parts) in cases() {
        let parts = pictured(without_sound(parts));
        let [path, particle, both] = bounded(5);
        let film = |integrator: Integrator, samples| {
            let samples = particles(samples);
            tagged_film_by(integrator, parts.clone(), Some(sidebands()), samples).film
        };
        let path = film(path, 6_000);
        for (other, film) in [
            ("particle", film(particle, 12_000)),
            ("bdpt", film(both, 6_000)),
        ] {
            let (mut light, mut square) = (0.0, 0.0);
            for layer in 0..parts_of_layers {
                for pixel in 0..4 {
                    let of = |film: &Film| {
                        let mean = f64::from(film.mean_at(Some(layer), 0, pixel));
                        (mean, f64::from(film.variance_at(Some(layer), 0, pixel)))
                    };
                    let [(a, va), (b, vb)] = [&path, &film].map(of);
                    zs.push((a - b) / (va + vb).sqrt());
                    if layer == 0 {
                        light += a;
                        square += va + vb;
                    }
                }
            }
            println!("{name}, {other}: ± {:.2} %", 100.0 * square.sqrt() / light);
        }
    }
    max_abs_z(&zs, FAMILY).unwrap_or_else(|e| panic!("{e}: {zs:.1?}"));
}

/// Sidebands of many orders.
fn many() -> Sidebands {
    Sidebands::new(WAVELENGTH, Sidebands::MAX_ORDERS, 4).unwrap()
}

/// Asserts that all orders (`part` returns the orders, then the delays) add up to `total` and
/// reproduce the correlations.
fn add_up(total: f64, part: impl Fn(usize) -> f64, accuracy: f64) {
    const HIGHEST_ORDER: usize = Sidebands::MAX_ORDERS as usize;
    for delay in 0..=4 {
        let turn = 0.25 * TAU * f64::from(delay) / 2.0;
        let of = |m: usize| 2.0 * part(m) * (m as f64 * turn).cos();
        let sum = part(0) + (1..=HIGHEST_ORDER).map(of).sum::<f64>();
        let expected = match delay {
            0 => total,
            _ => part(HIGHEST_ORDER + delay as usize),
        };
        let off = (sum - expected).abs();
        assert!(off < accuracy * total, "{sum} {expected}");
    }
}

/// Orders up to 100 contain all light of pixels and reproduce the correlations, in single
/// precision. The image is bit-identical to the image without them.
#[test]
fn orders_are_all_light() {
    for (_, parts) in cases() {
        for ray in rays() {
            let parts = seen(without_sound(parts.clone()), ray);
            let tagged = tagged_film(parts.clone(), Some(many()), 64);
            let part = |part: usize| layer(&tagged, 1 + part)[0];
            add_up(layer(&tagged, 0)[0], part, 1e-5);
            let plain = tagged_film(parts, None, 64);
            assert_eq!(plain.film.mean(), tagged.film.mean());
            assert_eq!(plain.film.mean(), tagged.film.layer_mean(0));
        }
    }
}

/// Orders add up in each layer by bounces, too; light of layers does not depend on them.
#[test]
fn orders_are_all_light_of_layers() {
    let layered = |parts: Parts, sidebands: Option<Sidebands>| {
        let scene = Scene::new(parts).unwrap();
        scene.render(&RenderOptions {
            decomposition: Decomposition {
                bounces: Some(2),
                parts: sidebands.map(LightParts::Sidebands),
                ..Decomposition::default()
            },
            ..RenderOptions::new(PathTracer::default(), 64, 4)
        })
    };
    let count = LightParts::Sidebands(many()).count();
    for (name, parts) in cases() {
        let parts = seen(without_sound(parts), rays()[0]);
        let [tagged, plain] = [Some(many()), None].map(|s| layered(parts.clone(), s));
        let mut lit = 0;
        for bounces in 0..4 {
            let [total, _] = layer(&tagged, bounces * count);
            assert_eq!(total, layer(&plain, bounces)[0]);
            let part = |part: usize| layer(&tagged, bounces * count + 1 + part)[0];
            if total > 0.0 {
                add_up(total, part, 1e-5);
                lit += 1;
            }
        }
        assert!(lit > 1, "{name}: {lit}");
    }
}

/// Orders add up in voxels, to the rounding of sums, 2⁻³³ of the largest term each.
#[test]
fn orders_are_all_fluence() {
    const HIGHEST_ORDER: usize = Sidebands::MAX_ORDERS as usize;
    for (_, parts) in cases() {
        let meters = [Estimator::TrackLength, Estimator::Collision]
            .map(|estimator| Meter::Fluence(voxels(estimator, many())));
        let parts = lit(without_sound(parts), rays()[0]);
        let measured = run(parts, &meters, &options(400, 3));
        for meter in 0..2 {
            let [total, orders, delays] = ["fluence", "fluence_sidebands", "fluence_correlation"]
                .map(|name| &reading(&measured, meter, name).mean);
            let cells = total.len();
            assert!(total.iter().filter(|fluence| **fluence > 0.0).count() > cells / 2);
            for (cell, total) in total.iter().enumerate() {
                let part = |part: usize| match part {
                    0..=HIGHEST_ORDER => orders[part * cells + cell],
                    _ => delays[(part - HIGHEST_ORDER - 1) * cells + cell],
                };
                add_up(*total, part, 1e-8);
            }
        }
    }
}

fn voxels(estimator: Estimator, sidebands: Sidebands) -> FluenceMeter {
    FluenceMeter {
        estimator,
        sidebands: Some(sidebands),
        ..fluence(
            Coordinates::Cartesian,
            [3, 3, 2],
            scaled(DVec3::splat(1.2), DVec3::splat(-0.6)),
        )
    }
}

/// Path lengths within voxels and collisions in them are different estimators of one fluence.
#[test]
fn track_lengths_and_collisions_find_the_same_sidebands() {
    let mut zs = Vec::new();
    for ((_, parts), seed) in cases().into_iter().take(2).zip([5, 6]) {
        let parts = lit(without_sound(parts), rays()[0]);
        let measured = [Estimator::TrackLength, Estimator::Collision].map(|estimator| {
            let meter = Meter::Fluence(voxels(estimator, sidebands()));
            let seed = seed + 100 * u64::from(estimator == Estimator::Collision);
            run(parts.clone(), &[meter], &options(particles(10_000), seed))
        });
        for name in ["fluence_sidebands", "fluence_correlation"] {
            let [a, b] = measured.each_ref().map(|m| reading(m, 0, name));
            for i in 0..a.mean.len() {
                zs.push((a.mean[i] - b.mean[i]) / a.error[i].hypot(b.error[i]));
            }
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// A cube of triangles with further triangles inside; far from these, flights are free.
fn meshes() -> Parts {
    let net = Object {
        sides: None,
        ..container(net(), Bsdf::Null)
    };
    parts(
        vec![container(hull(), Bsdf::Null), net],
        vec![water(N0), fog(sound(), 12.0, 0.9, 0.4)],
        vec![beam(DVec3::new(0.1, 0.2, -2.0), DVec3::Z, 0.2)],
        nobody(),
    )
}

/// A meter's sidebands are sums over its records, to rounding. Where rays are straight, particles
/// are equal with free flights and, for records, with edges.
#[test]
fn sidebands_of_meters_are_sums_over_records() {
    for (name, parts) in cases().into_iter().chain([("meshes", meshes())]) {
        let parts = without_sound(parts);
        let mut meter = through(&parts.objects, 0, [1, 1], false);
        meter.sidebands = Some(sidebands());
        let wanted = Meter::Irradiance(meter.clone());
        (meter.sidebands, meter.tagged) = (None, true);
        meter.most_records = Some(1_000_000);
        let recorder = Meter::Irradiance(meter);
        // Meters that keep records make walks use edges.
        let bends = parts.media.iter().any(|medium| !medium.index.is_constant());
        let mut meters = vec![wanted];
        meters.extend(bends.then(|| recorder.clone()));
        let measured = run(parts.clone(), &meters, &options(2_000, 8));
        let recorded = run(parts, &[recorder], &options(2_000, 8));
        let table = recorded.records[0].as_ref().unwrap();
        let found = &reading(&measured, 0, "power_sidebands").mean;
        for side in 0..2 {
            let rows = (0..table.particle.len()).filter(|row| table.side[*row] == side as f64);
            let mut sums = [0.0; ORDERS as usize + 1];
            let total = reading(&measured, 0, "power").mean[side];
            assert!(total > 0.0);
            for row in rows {
                let part = |i: usize| {
                    table.index_modulation[2 * row + i] + table.displacement_modulation[2 * row + i]
                };
                let phase = part(0).hypot(part(1)) * TAU / WAVELENGTH;
                for (m, sum) in sums.iter_mut().enumerate() {
                    *sum += table.weight[row] * libm::jn(m as i32, phase).powi(2);
                }
            }
            for (m, sum) in sums.into_iter().enumerate() {
                let found = found[2 * m + side];
                assert!((found - sum).abs() < 1e-9 * total, "{name}: {found} {sum}");
            }
        }
    }
}

/// Modulations are evaluated on arrival if nothing else is requested, and at ends of flights for
/// fluence by collisions. Results are bit-identical, also for particles that are split for late
/// gates.
#[test]
fn records_do_not_depend_on_what_else_is_asked() {
    let gates = Bins {
        min: 0.0,
        max: 12.0,
        count: 4,
    };
    for (name, parts) in cases() {
        let parts = without_sound(parts);
        let mut meter = through(&parts.objects, 0, [1, 1], false);
        (meter.tagged, meter.most_records) = (true, Some(1_000_000));
        (meter.optical_length, meter.weight_windows) = (Some(gates), true);
        let alone = Meter::Irradiance(meter);
        let fluence = Meter::Fluence(voxels(Estimator::Collision, sidebands()));
        let tables = [vec![alone.clone()], vec![alone, fluence]].map(|meters| {
            let mut measured = run(parts.clone(), &meters, &options(300, 2));
            measured.records[0].take().unwrap()
        });
        let divided = tables[0].particle.windows(2).filter(|w| w[0] == w[1]);
        assert!(divided.count() > 20, "{name}");
        let [a, b] = tables.map(|t| {
            let modulations = [t.index_modulation, t.displacement_modulation];
            (t.particle, t.weight, modulations)
        });
        assert!(a == b, "{name}");
    }
}

/// Along a beam through a plane sound wave without scattering, |A| = 2n̂ |sin(kz/2)|/k at the depth
/// z. Voxels are much shorter than the wave, and each draws the position of every particle at
/// random. The accuracy is the accuracy of the splines, 1e-4 of all light, beyond statistical
/// errors.
#[test]
fn sidebands_in_a_beam_have_a_closed_form() {
    let (amplitude, wavelength, depth) = (2e-5, 1.3, 4.0);
    let k = TAU / wavelength;
    let size = [3, 3, 401];
    let at = |i: usize| -0.5 + (depth + 1.0) * (i / 9) as f64 / 400.0;
    let pair = |i: usize| [(k * at(i)).cos(), -(k * at(i)).sin()].map(|v| (amplitude * v) as f32);
    let wide = DVec3::new(2.0, 2.0, 0.5);
    let samples = SoundSamples {
        size,
        bounds: Aabb::new(-wide, wide + DVec3::Z * depth),
        placement: Placement::Nodes,
        amplitude: (0..size.iter().product()).map(pair).collect(),
        n0: N0,
        frequency: 1e6,
        wavelength,
        noise: 0.0,
    };
    let field = SampledSound::new(samples).unwrap();
    let field = field.with_elasto_optic(0.32).unwrap();
    let place = DAffine3::from_translation(DVec3::Z * (0.5 * depth))
        * DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.5 * depth));
    let slab = container(Cube::new(place).unwrap(), Bsdf::Null);
    let index = eikonal::Field::from(field).without_sound();
    let media = vec![
        Medium::transparent("around", Constant::new(N0)),
        Medium::transparent("sound", index),
    ];
    let light = beam(DVec3::new(0.1, 0.1, -0.2), DVec3::Z, 0.05);
    let parts = parts(vec![slab], media, vec![light], nobody());
    const CELLS: usize = 60;
    let cells = scaled(DVec3::new(1.0, 1.0, depth), DVec3::new(-0.4, -0.4, 0.0));
    let meter = FluenceMeter {
        sidebands: Some(sidebands()),
        ..fluence(Coordinates::Cartesian, [1, 1, CELLS], cells)
    };
    let measured = run(
        parts,
        &[Meter::Fluence(meter)],
        &options(particles(4_000), 2),
    );
    let found = reading(&measured, 0, "fluence_sidebands");
    let mut zs = Vec::new();
    for cell in 0..CELLS {
        for m in 0..=ORDERS as usize {
            let part = |i: usize| {
                let z = depth * (cell as f64 + (i as f64 + 0.5) / 200.0) / CELLS as f64;
                let modulation = 2.0 * amplitude * (0.5 * k * z).sin().abs() / k;
                libm::jn(m as i32, modulation * TAU / WAVELENGTH).powi(2)
            };
            let expected = (0..200).map(part).sum::<f64>() / 200.0;
            let i = m * CELLS + cell;
            zs.push((found.mean[i] - expected) / found.error[i].hypot(1e-4));
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}
