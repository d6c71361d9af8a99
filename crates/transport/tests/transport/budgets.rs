//! Budgets: rays, connections and searches for photons that take too much work are abandoned and
//! counted (`MORGANA_LONG_TESTS=1`). Handles stop a render in progress.

use crate::common::{camera, container, fog, parts, path_tracer, vacuum};
use eikonal::Tolerance;
use eikonal::field::{Acoustic, AcousticMode};
use glam::DVec3;
use morgana_transport::aov::AovTracer;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::budget::STEPS_PER_RAY;
use morgana_transport::emitter::Emitter;
use morgana_transport::integrator::{Bdpt, Integrator, ParticleTracer, PhotonMapping, Vcm};
use morgana_transport::render::{Handle, RenderOptions, Rendering, render, render_watched};
use morgana_transport::renderer::Renderer;
use morgana_transport::shape::Sphere;
use morgana_transport::trace::{TraceEnding, Tracer, follow_field};
use morgana_transport::{Scene, Spectrum};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// A ball of fog with ripples of `wave_number` radians per unit length, and an emitter inside.
fn ripples(wave_number: f64) -> Scene {
    let mode = AcousticMode::new(1e-3, 0, wave_number, 0.0).unwrap();
    let field = Acoustic::new(1.3, DVec3::ZERO, DVec3::Z, DVec3::X, vec![mode]).unwrap();
    let light = Emitter::Point {
        position: DVec3::new(0.3, 0.4, 0.2),
        intensity: Spectrum::splat(10.0),
    };
    let ball = Sphere::around(DVec3::ZERO, 1.0).unwrap();
    let mut parts = parts(
        vec![container(ball, Bsdf::Null)],
        vec![vacuum(), fog(field, 1.0, 0.9, 0.0)],
        vec![light],
        camera(DVec3::Z * 4.0, DVec3::ZERO),
    );
    (parts.film.width, parts.film.height) = (1, 1);
    Scene::new(parts).unwrap()
}

fn taken(scene: Scene, renderer: impl Into<Renderer>, samples: u64) -> Rendering {
    let options = RenderOptions::new(renderer, samples, 1);
    render(&[scene], &options, |_| ControlFlow::Continue(()))
}

#[test]
fn rays_that_take_too_many_steps_are_given_up_and_counted() {
    let first = AovTracer::default();
    let stats = taken(ripples(1e7), first, 4).stats;
    assert!(
        stats.lost > 0 && stats.over_budget.rays == stats.lost,
        "{stats:?}"
    );
    let stats = taken(ripples(10.0), first, 4).stats;
    assert_eq!((stats.over_budget.rays, stats.lost), (0, 0));
}

/// Rays traced alone are abandoned at the same point as rays of renders.
#[test]
fn traced_rays_take_no_more_steps() {
    let (start, most) = (DVec3::new(0.1, 0.05, 1.5), STEPS_PER_RAY + 2);
    let scene = ripples(1e7);
    let path = Tracer::new(&scene, None).follow(start, DVec3::NEG_Z);
    assert_eq!(path.ending, TraceEnding::Lost);
    assert!((STEPS_PER_RAY..=most).contains(&path.points.len()));
    let field = &scene.media()[1].index;
    let path = follow_field(
        field,
        Tolerance::default(),
        DVec3::ZERO,
        DVec3::Z,
        1.0,
        None,
    );
    assert_eq!(path.ending, TraceEnding::Lost);
    assert!((STEPS_PER_RAY..=most).contains(&path.points.len()));
}

#[test]
fn connections_that_take_too_many_steps_are_given_up_and_counted() {
    let mut connections = eikonal::Solver::new(Default::default());
    let scene = ripples(1e6);
    let ends = [DVec3::new(0.1, 0.5, -0.5), DVec3::new(0.3, -0.4, 0.2)];
    let outcome = connections.connect(&scene, ends[0], scene.medium_at(ends[0]), ends[1]);
    assert_eq!(outcome, Err(eikonal::Failure::OverBudget));
    let mut stats = morgana_transport::Stats::default();
    stats.count(&outcome);
    assert_eq!(stats.over_budget.connections, 1);
    assert_eq!(stats.connections.attempts, 1);
    assert_eq!(stats.connections.failure_rate(), 1.0);
}

/// The radius is so large that every step of a ray meets every photon. The test needs many photons.
#[test]
fn searches_among_too_many_photons_are_given_up_and_counted() {
    if std::env::var_os("MORGANA_LONG_TESTS").is_none() {
        return;
    }
    let photons = |radius, photons| {
        Integrator::Photon(PhotonMapping {
            radius: Some(radius),
            photons: Some(photons),
            ..PhotonMapping::default()
        })
    };
    let stats = taken(ripples(4e3), photons(1e9, 32_000), 2).stats;
    assert!(stats.over_budget.gathers > 0, "{stats:?}");
    let stats = taken(ripples(2e3), photons(1e-2, 1_000), 2).stats;
    assert_eq!(stats.over_budget.gathers, 0, "{stats:?}");
}

/// A render stops however long a single sample takes, including in its pilots.
#[test]
fn renders_end_within_a_pass() {
    let integrators = [
        path_tracer(),
        Integrator::Particle(ParticleTracer::default()),
        Integrator::Bdpt(Bdpt::default()),
        Integrator::Vcm(Vcm::default()),
        Integrator::Photon(PhotonMapping {
            photons: Some(100_000),
            ..PhotonMapping::default()
        }),
    ];
    let scene = [ripples(3e4)];
    for integrator in integrators {
        let (handle, started) = (Handle::default(), Instant::now());
        let options = RenderOptions::new(integrator, 1_000_000, 1);
        let rendering = std::thread::scope(|scope| {
            scope.spawn(|| {
                std::thread::sleep(Duration::from_millis(200));
                handle.end_now();
            });
            render_watched(&scene, &options, &handle, |_| ControlFlow::Continue(()))
        });
        let (elapsed, name) = (started.elapsed(), integrator.name());
        assert!(elapsed < Duration::from_secs(3), "{name}: {elapsed:?}");
        assert_eq!(rendering.film.samples(), rendering.samples, "{name}");
        assert!(rendering.samples < 1_000_000 && handle.is_given_up());
    }
}
