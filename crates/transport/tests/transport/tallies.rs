//! The path tracer, compared with independent particle tallies of curved-ray transport
//! (`data/README.md`).
//!
//! A tally counts power through a surface. The path tracer measures this power as ∫∫ L cos θ dω dA,
//! with sensor rays drawn over the bin. Unscattered light of point and beam sources is invisible to
//! sensor rays; the reference's quadrature of it is subtracted. Each test compares all bins of a
//! tally at a family-wise false-alarm rate of 1e-3.

use crate::common::{camera, container, estimate, fog, parts, vacuum};
use eikonal::Field;
use eikonal::field::{Acoustic, AcousticMode, Constant, Luneburg};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::bsdf::Bsdf;
use morgana_transport::emitter::{BeamProfile, Collimated, Emitter};
use morgana_transport::sampling::Frame;
use morgana_transport::sampling::disc::uniform_disc_sample;
use morgana_transport::sampling::sphere::cosine_hemisphere_sample;
use morgana_transport::scene::Parts;
use morgana_transport::sensor::SensorRay;
use morgana_transport::shape::{Cube, Sphere};
use morgana_transport::{Scene, Spectrum};
use serde_json::Value;
use std::f64::consts::PI;
use testkit::z_test::{max_abs_z, two_sample_z};

const FAMILY: f64 = 1e-3;

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_f64().unwrap())
        .collect()
}

fn luneburg_ball(sigma_t: f64, albedo: f64, emitter: Emitter) -> Scene {
    let ball = Sphere::around(DVec3::ZERO, 1.0).unwrap();
    let index = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
    let objects = vec![container(ball, Bsdf::Null)];
    let media = vec![vacuum(), fog(index, sigma_t, albedo, 0.0)];
    let sensor = camera(DVec3::Z * 4.0, DVec3::ZERO);
    Scene::new(parts(objects, media, vec![emitter], sensor)).unwrap()
}

#[test]
fn irradiance_of_a_luneburg_ball_around_a_point_source() {
    let data: Value = serde_json::from_str(include_str!("../data/B4.json")).unwrap();
    let tallies = &data["tallies"];
    let edges = numbers(&tallies["irradiance_by_position_cosine"]["edges"]);
    let total = numbers(&tallies["irradiance_by_position_cosine"]["mean"]);
    let error = numbers(&tallies["irradiance_by_position_cosine"]["se"]);
    let unscattered = numbers(&tallies["irradiance_unscattered_only"]["exact_quadrature"]);
    let scene = luneburg_ball(
        1.0,
        1.0,
        Emitter::Point {
            position: DVec3::X * 0.4,
            intensity: Spectrum::splat(0.25 / PI),
        },
    );
    let zs: Vec<f64> = (0..total.len())
        .map(|bin| {
            let (mean, se) = estimate(&scene, (20_000, bin as u64), |sampler| {
                let [u, v] = sampler.next_2d();
                let cos = edges[bin] + (edges[bin + 1] - edges[bin]) * u;
                let (sin, phi) = ((1.0 - cos * cos).sqrt(), 2.0 * PI * v);
                let n = DVec3::new(cos, sin * phi.cos(), sin * phi.sin());
                let out =
                    Frame::from_normal(n).to_world(cosine_hemisphere_sample(sampler.next_2d()));
                let ray = SensorRay {
                    origin: n * (1.0 + 1e-9),
                    direction: -out,
                };
                (ray, PI)
            });
            println!(
                "{bin}: {mean} ± {se}, reference {}",
                total[bin] - unscattered[bin]
            );
            two_sample_z(mean, se, total[bin] - unscattered[bin], error[bin])
        })
        .collect();
    max_abs_z(&zs, FAMILY).unwrap();
}

#[test]
fn power_that_a_luneburg_ball_scatters_out_of_a_beam() {
    let data: Value = serde_json::from_str(include_str!("../data/B1_g0.json")).unwrap();
    let tally = &data["tallies"]["exit_power_by_direction_cosine"];
    let (edges, mean) = (numbers(&tally["edges"]), numbers(&tally["mean"]));
    let error = numbers(&tally["se"]);
    let beam = Collimated::new(
        -DVec3::Z * 2.0,
        DVec3::Z,
        BeamProfile::Disc { radius: 0.3 },
        Spectrum::ONE,
    );
    let scene = luneburg_ball(1.1, 1.0 / 1.1, Emitter::Collimated(beam));
    // The last bin contains the unscattered beam.
    let zs: Vec<f64> = (0..mean.len() - 1)
        .map(|bin| {
            let (power, se) = estimate(&scene, (20_000, 100 + bin as u64), |sampler| {
                let [u, v] = sampler.next_2d();
                let width = edges[bin + 1] - edges[bin];
                let cos = edges[bin] + width * u;
                let (sin, phi) = ((1.0 - cos * cos).sqrt(), 2.0 * PI * v);
                let out = DVec3::new(sin * phi.cos(), sin * phi.sin(), cos);
                // Parallel rays over the ball's shadow: power = ∫ dω ∫ L dA⊥.
                let across = uniform_disc_sample(sampler.next_2d()).extend(0.0);
                let ray = SensorRay {
                    origin: out * 1.5 + Frame::from_normal(out).to_world(across),
                    direction: -out,
                };
                (ray, 2.0 * PI * width * PI)
            });
            println!("{bin}: {power} ± {se}, reference {}", mean[bin]);
            two_sample_z(power, se, mean[bin], error[bin])
        })
        .collect();
    max_abs_z(&zs, FAMILY).unwrap();
}

#[test]
fn irradiance_behind_a_slab_with_the_sound_off() {
    // Farther out, too few paths of a forward-peaked medium carry light for a normal mean.
    behind_a_slab("field_off", Constant::new(N_SLAB).into(), 0..10);
}

/// With the sound on, the index varies by ± 0.02 across the beam, as J₀ of the distance from its
/// axis: the sound guides most of the light that is scattered forwards. Takes minutes, so it runs
/// under `MORGANA_LONG_TESTS` only.
#[test]
fn irradiance_behind_a_slab_with_the_sound_on() {
    if std::env::var_os("MORGANA_LONG_TESTS").is_none() {
        return;
    }
    let mode = AcousticMode::new(0.02, 0, 2.0 * PI / 0.6, 0.0).unwrap();
    let sound = Acoustic::new(N_SLAB, DVec3::ZERO, DVec3::X, DVec3::Z, vec![mode]).unwrap();
    behind_a_slab("field_on", sound.into(), 0..6);
}

const N_SLAB: f64 = 1.3333;

fn behind_a_slab(entry: &str, index: Field, bins: std::ops::Range<usize>) {
    let data: Value = serde_json::from_str(include_str!("../data/B3.json")).unwrap();
    let edges = numbers(&data["radial_edges"]);
    let tally = &data[entry]["irradiance_scattered"];
    let (mean, error) = (numbers(&tally["mean"]), numbers(&tally["se"]));
    let scene = Scene::new(waveguide(index)).unwrap();
    let zs: Vec<f64> = bins
        .map(|bin| {
            let (irradiance, se) = estimate(&scene, (20_000, 200 + bin as u64), |sampler| {
                let [u, v] = sampler.next_2d();
                let (a, b) = (edges[bin].powi(2), edges[bin + 1].powi(2));
                let (r, phi) = ((a + (b - a) * u).sqrt(), 2.0 * PI * v);
                let out = Frame::from_normal(DVec3::X)
                    .to_world(cosine_hemisphere_sample(sampler.next_2d()));
                let ray = SensorRay {
                    origin: DVec3::new(6.0 + 1e-6, r * phi.cos(), r * phi.sin()),
                    direction: -out,
                };
                (ray, PI)
            });
            println!("{bin}: {irradiance} ± {se}, reference {}", mean[bin]);
            two_sample_z(irradiance, se, mean[bin], error[bin])
        })
        .collect();
    max_abs_z(&zs, FAMILY).unwrap();
}

/// The slab of the waveguide reference, surrounded by the matched index.
fn waveguide(index: Field) -> Parts {
    let to_world = DAffine3 {
        matrix3: DMat3::from_diagonal(DVec3::new(3.0, 1.5, 1.5)),
        translation: DVec3::X * 3.0,
    };
    let slab = container(Cube::new(to_world).unwrap(), Bsdf::Null);
    let mut ambient = vacuum();
    ambient.index = Constant::new(N_SLAB).into();
    let beam = Collimated::new(
        DVec3::X * 1e-6,
        DVec3::X,
        BeamProfile::Disc { radius: 0.4 },
        Spectrum::ONE,
    );
    parts(
        vec![slab],
        vec![ambient, fog(index, 0.5, 1.0, 0.85)],
        vec![Emitter::Collimated(beam)],
        camera(DVec3::X * 9.0, DVec3::ZERO),
    )
}
