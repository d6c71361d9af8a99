//! Films of tagged light, and records of light in a flow, compared with brute force. The reference
//! uses paths of particles, found without phasors, and their optical lengths at many instants of
//! the sound. At each instant the field is frozen, and scatterers are at their displaced positions.

use crate::meters::sidebands::{
    layer, lit, rays, seen, tagged_film, tagged_film_by, without_sound,
};
use crate::meters::support::*;
use crate::meters::tagged::{ALBEDO, EXTINCTION, G, cases, length_through, moved, path, sound};
use eikonal::Field;
use eikonal::field::Placement;
use glam::{DVec2, DVec3};
use morgana_transport::bsdf::{Bsdf, Diffuse};
use morgana_transport::emitter::Emitter;
use morgana_transport::integrator::PathTracer;
use morgana_transport::medium::Velocity;
use morgana_transport::meter::Meter;
use morgana_transport::scene::{Object, Parts};
use morgana_transport::shape::Sphere;
use morgana_transport::sidebands::Sidebands;
use morgana_transport::volume::{GridFilter, GridSamples, VolumeGrid, VolumeTexture};
use morgana_transport::{Scene, Spectrum};
use std::f64::consts::TAU;
use std::sync::Arc;
use testkit::z_test::max_abs_z;

const WAVELENGTH: f64 = 1.5e-4;
const ORDERS: usize = 3;
/// Number of instants. Means over this number are exact to J₉(2) = 2e-6, because phases are of the
/// order of one.
const INSTANTS: usize = 12;
/// Relative tolerance of optical lengths; phases are then accurate to 1e-3.
const TOLERANCE: f64 = 1e-8;

/// Light that reaches the target: carrier, sidebands, and correlations after a quarter and half of
/// a period, as means over instants.
struct Brute {
    mean: Vec<f64>,
    error: Vec<f64>,
}

/// A path with its power: entry into the ball, collisions, and exit.
struct Way {
    power: f64,
    /// Rate at which flow changes the path's optical length, by the meter.
    rate: f64,
    places: Vec<DVec3>,
}

impl Way {
    /// Optical lengths at the instants. The ends are kept at rest: indices match there, so that the
    /// length does not depend on the ends to first order.
    fn lengths(&self, index: &Field) -> Vec<f64> {
        let [entry, collisions @ .., exit] = &self.places[..] else {
            unreachable!("a path has two ends");
        };
        let at = |i: usize| {
            let phase = TAU * i as f64 / INSTANTS as f64;
            let (index, sound) = (index.at_phase(phase), sound().at_phase(phase));
            let mut places = vec![*entry];
            places.extend(collisions.iter().map(|x| moved(&sound, *x)));
            places.push(*exit);
            length_through(&index, &places, TOLERANCE)
        };
        (0..INSTANTS).map(at).collect()
    }

    /// Power of the path in each part.
    fn parts(&self, index: &Field) -> Vec<f64> {
        let lengths = self.lengths(index);
        let turn = |i: usize, j: usize| TAU / WAVELENGTH * (lengths[i % INSTANTS] - lengths[j]);
        let instants = || 0..INSTANTS;
        let in_order = |m: usize| {
            let back = |i: usize| TAU * ((m * i) % INSTANTS) as f64 / INSTANTS as f64;
            let wave = instants().map(|i| DVec2::from_angle(turn(i, 0) - back(i)));
            (wave.sum::<DVec2>() / INSTANTS as f64).length_squared()
        };
        let after = |delay: usize| {
            let cosines = instants().map(|i| turn(i + delay, i).cos());
            cosines.sum::<f64>() / INSTANTS as f64
        };
        let orders = (0..=ORDERS).map(in_order);
        let delays = [INSTANTS / 4, INSTANTS / 2].map(after);
        orders
            .chain(delays)
            .map(|share| share * self.power)
            .collect()
    }
}

/// Source of light in the film. By reciprocity, the reference counts particles of a beam that reach
/// it.
#[derive(Clone, Copy, Debug)]
enum Light {
    /// An environment around the ball.
    Sky,
    /// A small sphere in the ball, most of whose light is found by connections.
    Bulb,
}

impl Light {
    /// Scene with a pixel that sees a ray, and light of radiance 1.
    fn seen(self, parts: Parts, ray: [DVec3; 2]) -> Parts {
        let mut parts = seen(parts, ray);
        if let Light::Bulb = self {
            parts.objects.push(bulb(Some(0)));
            parts.emitters = vec![Emitter::Area {
                object: 1,
                radiance: Spectrum::ONE,
            }];
        }
        parts
    }

    /// Paths of particles from a beam along a ray to the light; `None` for a particle that does not
    /// reach it.
    fn ways(self, parts: Parts, ray: [DVec3; 2], particles: u64, seed: u64) -> Vec<Option<Way>> {
        let mut parts = lit(parts, ray);
        parts.objects.truncate(1);
        // Count light that leaves the ball, or that reaches the bulb on the side of its normals.
        let (object, side) = match self {
            Light::Sky => (0, 0.0),
            Light::Bulb => (1, 1.0),
        };
        if let Light::Bulb = self {
            parts.objects.push(bulb(None));
        }
        let mut meter = through(&parts.objects, object, [1, 1], false);
        meter.most_records = Some(1_000_000);
        let mut options = options(particles, seed);
        options.rr_depth = u32::MAX;
        let scene = Scene::new(parts.clone()).unwrap();
        let measured = run(parts, &[Meter::Irradiance(meter)], &options);
        let table = measured.records[0].as_ref().unwrap();
        let followed = table.particles;
        let mut ways: Vec<Option<Way>> = (0..followed).map(|_| None).collect();
        for row in (0..table.particle.len()).filter(|row| table.side[*row] == side) {
            let number = table.particle[row];
            let mut places = vec![entry(ray)];
            places.extend(path(&scene, seed, number).vertices);
            places.push(DVec3::from_slice(&table.position[3 * row..]));
            let way = Way {
                power: table.weight[row] * followed as f64,
                rate: table.optical_length_rate.get(row).copied().unwrap_or(0.0),
                places,
            };
            let last = ways[number as usize].replace(way);
            assert!(last.is_none(), "a path gets there once");
        }
        ways
    }
}

/// A black sphere.
fn bulb(emitter: Option<usize>) -> Object {
    let sphere = Sphere::around(DVec3::new(-0.35, 0.35, 0.3), 0.2).unwrap();
    Object {
        sides: None,
        emitter,
        ..container(sphere, Bsdf::Diffuse(Diffuse::new(Spectrum::ZERO).unwrap()))
    }
}

/// Point where a ray enters the unit ball.
fn entry([start, direction]: [DVec3; 2]) -> DVec3 {
    let along = start.dot(direction);
    let closest = start.length_squared() - along * along;
    start - direction * (along + (1.0 - closest).sqrt())
}

fn brute(light: Light, parts: Parts, ray: [DVec3; 2], particles: u64) -> Brute {
    let index = parts.media[1].index.clone();
    let ways = light.ways(without_sound(parts), ray, particles, 21);
    let nothing = vec![0.0; ORDERS + 3];
    let of = |way: &Option<Way>| match way {
        Some(way) => way.parts(&index),
        None => nothing.clone(),
    };
    let all: Vec<Vec<f64>> = ways.iter().map(of).collect();
    let n = all.len() as f64;
    let mean_of = |part: usize| all.iter().map(|way| way[part]).sum::<f64>() / n;
    let mean: Vec<f64> = (0..nothing.len()).map(mean_of).collect();
    let error_of = |part: usize| {
        let squares = all.iter().map(|way| (way[part] - mean[part]).powi(2));
        (squares.sum::<f64>() / (n * (n - 1.0))).sqrt()
    };
    Brute {
        error: (0..nothing.len()).map(error_of).collect(),
        mean,
    }
}

/// Tests pixels whose rays pass the ball at two places, straight and bent. Family-wise false-alarm
/// rate 1e-3; errors are up to a tenth of all light.
#[test]
fn films_are_means_over_frozen_instants() {
    let sidebands = Sidebands::new(WAVELENGTH, ORDERS as u32, 2).unwrap();
    let mut zs = Vec::new();
    for (name, parts) in cases().into_iter().take(2) {
        for ray in rays() {
            for (light, walks, samples) in [(Light::Sky, 300, 4_000), (Light::Bulb, 4_000, 12_000)]
            {
                let scene = light.seen(without_sound(parts.clone()), ray);
                let film = tagged_film(scene, Some(sidebands), particles(samples));
                let brute = brute(light, parts.clone(), ray, particles(walks));
                for (part, (expected, its)) in brute.mean.iter().zip(&brute.error).enumerate() {
                    let [mean, error] = layer(&film, 1 + part);
                    println!(
                        "{name}, {light:?}, part {part}: {mean} ± {error}, {expected} ± {its}"
                    );
                    zs.push((mean - expected) / error.hypot(*its));
                }
            }
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// Tests light of a point in the ball that is scattered back once, towards a pixel whose ray
/// crosses the waves. Sound moves scatterers along the ray, so that about half of the phase is due
/// to displacement. The reference is a sum over positions along the ray, with optical lengths
/// between displaced scatterers. Family-wise false-alarm rate 1e-3; omitting the displacement would
/// be off by more than twenty standard errors.
#[test]
fn light_that_is_scattered_back_once_has_the_phases_of_moved_scatterers() {
    const PLACES: usize = 200;
    let ray = [DVec3::new(-2.0, 0.05, 0.1), DVec3::X];
    let light = DVec3::new(-0.7, 0.4, 0.2);
    let (_, parts) = cases().into_iter().next().unwrap();
    let (index, sidebands) = (
        parts.media[1].index.clone(),
        Sidebands::new(WAVELENGTH, ORDERS as u32, 2).unwrap(),
    );
    let mut scene = seen(without_sound(parts), ray);
    scene.emitters = vec![Emitter::Point {
        position: light,
        intensity: Spectrum::ONE,
    }];
    let once = PathTracer {
        max_depth: Some(2),
        ..PathTracer::default()
    };
    let film = tagged_film_by(once, scene, Some(sidebands), particles(20_000));
    let first = entry(ray);
    let step = -2.0 * first.dot(ray[1]) / PLACES as f64;
    let mut expected = [0.0; ORDERS + 3];
    for i in 0..PLACES {
        let along = (i as f64 + 0.5) * step;
        let x = first + along * ray[1];
        let (distance, toward) = ((x - light).length(), (x - light).normalize());
        // Henyey–Greenstein phase function.
        let cosine = -toward.dot(ray[1]);
        let phase = (1.0 - G * G) / (2.0 * TAU * (1.0 + G * G - 2.0 * G * cosine).powf(1.5));
        let depth = EXTINCTION * (along + distance);
        let way = Way {
            power: ALBEDO * EXTINCTION * phase * (-depth).exp() / distance.powi(2) * step,
            rate: 0.0,
            places: vec![light, x, first],
        };
        for (sum, part) in expected.iter_mut().zip(way.parts(&index)) {
            *sum += part;
        }
    }
    let of = |(part, expected): (usize, &f64)| {
        let [mean, error] = layer(&film, 1 + part);
        println!("part {part}: {mean} ± {error}, {expected}");
        (mean - expected) / error
    };
    let zs: Vec<f64> = expected.iter().enumerate().map(of).collect();
    max_abs_z(&zs, FAMILY).unwrap();
}

/// Tests scatterers in a flow that varies in space: rates of records are compared with optical
/// lengths a little earlier and later. The ends of a scattered path are at rest, because indices
/// match there. Numerical: 1e-5 of the root mean square.
#[test]
fn rates_are_those_of_lengths_between_scatterers_that_flow() {
    const STEP: f64 = 1e-6;
    let samples = GridSamples {
        size: [2; 3],
        channels: 3,
        data: (0..24).map(|i| ((7 * i) % 11) as f32 - 5.0).collect(),
    };
    let cube = scaled(DVec3::splat(2.0), DVec3::NEG_ONE);
    let any = [f64::MIN, f64::MAX];
    let filter = GridFilter::Trilinear;
    let grid = VolumeGrid::new(samples, cube, Placement::Nodes, filter, any).unwrap();
    let flow = Velocity::sampled(VolumeTexture::Grid(Arc::new(grid)));
    for (name, parts) in cases().into_iter().take(2) {
        let mut parts = without_sound(parts);
        parts.media[1].velocity = Some(flow.clone());
        let index = parts.media[1].index.clone();
        let ways = Light::Sky.ways(parts, rays()[0], 400, 5);
        let ways: Vec<&Way> = ways
            .iter()
            .flatten()
            .filter(|w| w.places.len() > 2)
            .collect();
        let length = |way: &Way, time: f64| {
            let last = way.places.len() - 1;
            let at = |(i, x): (usize, &DVec3)| match i {
                0 => *x,
                i if i == last => *x,
                _ => *x + flow.at(*x) * time,
            };
            let places: Vec<DVec3> = way.places.iter().enumerate().map(at).collect();
            length_through(&index, &places, 1e-12)
        };
        let squares: f64 = ways.iter().map(|way| way.rate.powi(2)).sum();
        let rms = (squares / ways.len() as f64).sqrt();
        assert!(ways.len() > 100 && rms > 1.0, "{name}: {rms}");
        for way in ways {
            let expected = (length(way, STEP) - length(way, -STEP)) / (2.0 * STEP);
            let off = (way.rate - expected).abs() / rms;
            assert!(off < 1e-5, "{name}: {} {expected}", way.rate);
        }
    }
}
