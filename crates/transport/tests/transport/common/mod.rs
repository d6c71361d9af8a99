//! Small scenes for tests.
#![allow(dead_code, unused_imports)]

pub mod fan;
pub mod lens;

use eikonal::field::Constant;
use eikonal::{Field, Tolerance};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::bsdf::{Bsdf, Dielectric};
use morgana_transport::emitter::{Emitter, Environment};
use morgana_transport::film::Filter;
use morgana_transport::integrator::{Integrator, PathTracer};
use morgana_transport::medium::Medium;
use morgana_transport::phase::Phase;
use morgana_transport::render::{Handle, RenderOptions, Rendering, State, render};
use morgana_transport::renderer::Renderer;
use morgana_transport::scene::{FilmSpec, Object, Parts, Sides};
use morgana_transport::sensor::{Perspective, Sensor};
use morgana_transport::shape::Shape;
use morgana_transport::volume::VolumeTexture;
use morgana_transport::{Scene, Spectrum};
use std::ops::ControlFlow;
pub use testkit::samples;

/// A camera at `from` that looks at `to` through a field of view of 40°.
pub fn camera(from: DVec3, to: DVec3) -> Sensor {
    let dir = (to - from).normalize();
    let up = if dir.y.abs() > 0.9 {
        DVec3::X
    } else {
        DVec3::Y
    };
    let left = up.cross(dir).normalize();
    let basis = DMat3::from_cols(left, dir.cross(left), dir);
    let to_world = DAffine3 {
        matrix3: basis,
        translation: from,
    };
    Sensor::Perspective(Perspective::new(to_world, 40f64.to_radians(), 1.0))
}

/// Vacuum around everything.
pub fn vacuum() -> Medium {
    Medium::transparent("vacuum", Constant::new(1.0))
}

/// A homogeneous medium with any field.
pub fn fog(index: impl Into<Field>, sigma_t: f64, albedo: f64, g: f64) -> Medium {
    Medium {
        name: "fog".into(),
        index: index.into(),
        sigma_t: VolumeTexture::Uniform(Spectrum::splat(sigma_t)),
        scale: 1.0,
        albedo: VolumeTexture::Uniform(Spectrum::splat(albedo)),
        phase: Phase::henyey_greenstein(g).unwrap(),
        emission: None,
        velocity: None,
        fluorescence: None,
        labels: None,
    }
}

/// An object that holds medium 1 in medium 0.
pub fn container(shape: impl Into<Shape>, bsdf: Bsdf) -> Object {
    Object {
        name: "container".into(),
        shape: shape.into(),
        bsdf,
        sides: Some(Sides {
            interior: 1,
            exterior: 0,
        }),
        emitter: None,
    }
}

/// A smooth dielectric.
pub fn glass() -> Bsdf {
    Bsdf::Dielectric(Dielectric::default())
}

/// A uniform environment of radiance 1.
pub fn sky() -> Emitter {
    Emitter::Environment(Environment::Constant(Spectrum::ONE))
}

/// Scene parts with defaults for everything else.
pub fn parts(
    objects: Vec<Object>,
    media: Vec<Medium>,
    emitters: Vec<Emitter>,
    sensor: Sensor,
) -> Parts {
    Parts {
        partitions: Vec::new(),
        objects,
        media,
        emitters,
        sensor,
        film: FilmSpec {
            width: 4,
            height: 4,
            channels: 1,
            group_size: Spectrum::CHANNELS,
            filter: Filter::Box,
            window: None,
        },
        tolerance: Tolerance::default(),
        reflections: 0,
        measured: eikonal::Aabb::EMPTY,
    }
}

/// Renders with a given number of samples and seed.
pub fn shoot(parts: Parts, samples: u64, seed: u64) -> Rendering {
    shoot_by(path_tracer(), parts, samples, seed)
}

/// Renders by any renderer with a given number of samples and seed.
pub fn shoot_by(renderer: impl Into<Renderer>, parts: Parts, samples: u64, seed: u64) -> Rendering {
    let scene = Scene::new(parts).unwrap_or_else(|problems| panic!("{problems:?}"));
    let options = RenderOptions::new(renderer, samples, seed);
    render(&[scene], &options, |_| ControlFlow::Continue(()))
}

/// A render whose pilots have run. Batches of its samples share the scene and the results of the
/// pilots, which take longer than a batch.
pub struct Batches {
    scene: [Scene; 1],
    options: RenderOptions,
    state: State,
}

impl Batches {
    pub fn new(renderer: impl Into<Renderer>, parts: Parts, seed: u64) -> Self {
        let scene = [Scene::new(parts).unwrap_or_else(|problems| panic!("{problems:?}"))];
        let options = RenderOptions::new(renderer, 0, seed);
        let mut batches = Batches {
            state: State::new(&scene, &options),
            scene,
            options,
        };
        batches.state = batches.advanced(0, 0);
        batches
    }

    /// Renders a batch of samples per pixel. Batches of one size have different samples.
    pub fn render(&self, number: u64, samples: u64) -> Rendering {
        let state = self.advanced(number * samples, samples);
        let rendering = state.into_rendering(&self.scene);
        assert_eq!(rendering.stats.not_finite, 0);
        rendering
    }

    fn advanced(&self, first: u64, samples: u64) -> State {
        let options = RenderOptions {
            first,
            samples,
            ..self.options
        };
        let mut state = self.state.clone();
        state.advance(&self.scene, &options, &Handle::default(), |_| {
            ControlFlow::Continue(())
        });
        state
    }
}

/// Mean of the image and its standard error.
pub fn mean(rendering: &Rendering) -> (f64, f64) {
    assert_eq!(rendering.stats.not_finite, 0);
    rendering.film.summary()
}

/// Returns mean and standard error of the radiance along rays from `ray`, each with a weight.
pub fn estimate(
    scene: &Scene,
    run: (u64, u64),
    ray: impl FnMut(
        &mut morgana_transport::sampling::Sampler,
    ) -> (morgana_transport::sensor::SensorRay, f64),
) -> (f64, f64) {
    estimate_by(path_tracer(), scene, run, ray)
}

/// Returns mean and standard error by any integrator. Every contribution of a sample counts,
/// wherever in the image it lies; rays must therefore be drawn from the image's positions.
pub fn estimate_by(
    integrator: Integrator,
    scene: &Scene,
    (samples, seed): (u64, u64),
    mut ray: impl FnMut(
        &mut morgana_transport::sampling::Sampler,
    ) -> (morgana_transport::sensor::SensorRay, f64),
) -> (f64, f64) {
    let mut ws = morgana_transport::path::Workspace::new(scene.tolerance());
    let (mut sum, mut squares) = (0.0, 0.0);
    for i in 0..samples {
        let mut sampler = morgana_transport::sampling::Sampler::new(seed, 0, i);
        let (ray, weight) = ray(&mut sampler);
        let mut found = Vec::new();
        integrator.sample(scene, ray, 1, &mut sampler, &mut ws, &mut found);
        let inside = |x: &f64| (0.0..1.0).contains(x);
        found.retain(|c| c.image.is_none_or(|place| place.iter().all(inside)));
        let value = found.iter().map(|c| c.weighted()[0]).sum::<f64>() * weight;
        assert!(value.is_finite());
        sum += value;
        squares += value * value;
    }
    let n = samples as f64;
    let mean = sum / n;
    (
        mean,
        ((squares / n - mean * mean).max(0.0) / (n - 1.0)).sqrt(),
    )
}

/// The path tracer with its defaults.
pub fn path_tracer() -> Integrator {
    Integrator::Path(PathTracer::default())
}

/// Renders in single passes, each with another number of threads, until the image is complete.
pub fn in_passes(scenes: &[Scene], options: &RenderOptions) -> State {
    let mut state = State::new(scenes, options);
    for threads in [1, 2, 7].into_iter().cycle() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let handle = Handle::default();
        let before = state.done().count();
        pool.build().unwrap().install(|| {
            state.advance(scenes, options, &handle, |_| ControlFlow::Break(()));
        });
        if state.done().count() == before {
            break;
        }
    }
    state
}
