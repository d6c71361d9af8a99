//! Derivatives of images with respect to the index of scattering media
//! (docs/theory.md#derivatives-by-the-index-behind-scattering).
//!
//! The references are [central differences](crate::differences) of ordinary renders by `path` with
//! connections, which share no code with derivatives. The family of cases is fixed: fields ×
//! boundaries × phase functions × lights, fog with a colour, and voxels of smoke, 68 comparisons in
//! all. With other seeds, correct code would fail with a probability below 5e-3. Derivatives have
//! errors of 3 to 10 % in fog and larger ones behind glass. There, `attached::tests` compares
//! single paths to 1e-7, and [`crate::index_absorption`] trees of rays to a few per cent.

use crate::differences::{self, Comparisons, Mean, long, moments};
use eikonal::field::{Bspline, Gaussian, Placement};
use eikonal::{Aabb, Field, Tolerance};
use glam::{DAffine2, DAffine3, DVec3};
use morgana_transport::bsdf::{Bsdf, Dielectric, Diffuse};
use morgana_transport::emitter::{Emitter, Environment, TexturedArea};
use morgana_transport::film::{Decomposition, Filter};
use morgana_transport::integrator::PathTracer;
use morgana_transport::medium::Medium;
use morgana_transport::phase::Phase;
use morgana_transport::render::{
    Handle, IndexDerivativeOptions, IndexDerivatives, index_derivatives,
};
use morgana_transport::scene::{FilmSpec, Object, Parts, Sides};
use morgana_transport::sensor::{Perspective, Sensor};
use morgana_transport::shape::{Rectangle, Shape, Sphere};
use morgana_transport::texture::{Bitmap, BitmapFilter, Texture, Wrap};
use morgana_transport::volume::VolumeTexture;
use morgana_transport::{Orientation, Scene, Spectrum};
use std::sync::Arc;

const FOG: usize = 1;
const SIZE: usize = 3;
/// Samples of a grid along each axis.
const GRID: usize = 6;
const PATH: PathTracer = PathTracer {
    max_depth: Some(7),
    rr_depth: 5,
};

#[derive(Clone, Copy, Debug, PartialEq)]
enum Index {
    /// A Gaussian bump: n₀, Δn, width.
    Gaussian([f64; 3]),
    /// A sampled lens; a fixed pattern of samples is changed by this amount.
    Grid(f64),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Light {
    Sky,
    Panel,
}

#[derive(Clone, Copy, Debug)]
struct Setup {
    index: Index,
    dielectric: bool,
    g: f64,
    light: Light,
    extinction: [f64; 2],
    /// True if extinction and albedo are voxels, some of them empty.
    graded: bool,
}

fn lens(x: DVec3) -> f64 {
    1.3 + 0.08 * (-2.0 * x.length_squared()).exp()
}

/// Pattern of changes of the samples.
fn pattern(i: usize) -> f64 {
    ((i * 37 % 17) as f64 - 8.0) / 8.0
}

fn grid(change: f64) -> Field {
    let cube = Aabb::new(DVec3::splat(-1.1), DVec3::splat(1.1));
    let place = |k: usize| -1.1 + 2.2 * k as f64 / (GRID - 1) as f64;
    let sample = |i: usize| {
        let [x, y, z] = [i % GRID, i / GRID % GRID, i / (GRID * GRID)].map(place);
        lens(DVec3::new(x, y, z)) + change * pattern(i)
    };
    let samples: Vec<f64> = (0..GRID * GRID * GRID).map(sample).collect();
    let grid = Bspline::from_samples([GRID; 3], cube, Placement::Nodes, &samples);
    grid.unwrap().into()
}

/// A smooth sky, brighter on one side, in two colours.
fn sky() -> Emitter {
    let (width, height) = (16, 9);
    let pixel = |i: usize| {
        let u = (i % width) as f64 / width as f64 * std::f64::consts::TAU;
        let t = (i / width) as f64 / (height - 1) as f64 * std::f64::consts::PI;
        let a = 1.3 + 0.8 * t.sin() * (u + 0.5).cos() + 0.3 * (2.0 * t).cos();
        let b = 1.0 + 0.6 * t.sin() * (2.0 * u).sin();
        Spectrum([a, b, 0.0, 0.0])
    };
    let pixels = (0..width * height).map(pixel).collect();
    let up = Orientation::nearest(glam::DMat3::from_rotation_x(1.0))
        .unwrap()
        .0;
    Emitter::Environment(Environment::image(width, height, pixels, up).unwrap())
}

/// A panel behind the ball, with a pattern that is dark at its edge.
fn panel() -> (Shape, Texture) {
    let place = DAffine3::from_translation(DVec3::Z * 1.6)
        * DAffine3::from_rotation_y(std::f64::consts::PI)
        * DAffine3::from_scale(DVec3::splat(4.0));
    let size = 12;
    let value = |i: usize| {
        let [x, y] = [i % size, i / size].map(|k| k as f64 / (size - 1) as f64);
        let window = 16.0 * x * (1.0 - x) * y * (1.0 - y);
        let wave = |phase: f64| 1.0 + 0.9 * (12.0 * x + 7.0 * y + phase).sin();
        [0.0, 1.5].map(|phase| (3.0 * window * wave(phase)) as f32)
    };
    let data = (0..size * size).flat_map(value).collect();
    let bitmap = Bitmap::new(
        [size; 2],
        2,
        data,
        BitmapFilter::Bilinear,
        Wrap::Clamp,
        DAffine2::IDENTITY,
    );
    let texture = Texture::Bitmap(Arc::new(bitmap.unwrap()));
    (Rectangle::new(place).unwrap().into(), texture)
}

/// Samples around the ball, with a pattern from `low`, or from 0, to `high` in each channel.
fn voxels(low: f64, high: f64) -> VolumeTexture {
    differences::voxels(|i| {
        let share = (i * 53 % 31) as f64 / 30.0;
        (low + (high - low) * share).max(0.0) as f32
    })
}

impl Setup {
    fn field(&self) -> Field {
        match self.index {
            Index::Gaussian([n0, delta, width]) => {
                let center = DVec3::new(0.15, -0.1, 0.05);
                Gaussian::new(n0, delta, center, width).unwrap().into()
            }
            Index::Grid(change) => grid(change),
        }
    }

    fn parts(&self) -> Parts {
        let fog = Medium::homogeneous("fog", self.field(), two(self.extinction), two([0.95, 0.8]));
        let fog = if self.graded {
            Medium {
                sigma_t: voxels(-1.0, 5.0),
                albedo: voxels(0.6, 1.0),
                ..fog
            }
        } else {
            fog
        };
        let phase = Phase::henyey_greenstein(self.g).unwrap();
        let dielectric = Bsdf::Dielectric(Dielectric::default());
        let ball = Object {
            name: "ball".into(),
            shape: Sphere::around(DVec3::ZERO, 1.0).unwrap().into(),
            bsdf: if self.dielectric {
                dielectric
            } else {
                Bsdf::Null
            },
            sides: Some(Sides {
                interior: FOG,
                exterior: 0,
            }),
            emitter: None,
        };
        let mut objects = vec![ball];
        let emitter = match self.light {
            Light::Sky => sky(),
            Light::Panel => {
                let (shape, texture) = panel();
                let area = TexturedArea::new(1, &shape, texture).unwrap();
                objects.push(Object {
                    name: "panel".into(),
                    shape,
                    bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::ZERO).unwrap()),
                    sides: None,
                    emitter: Some(0),
                });
                Emitter::Textured(Arc::new(area))
            }
        };
        let eye = DAffine3::from_translation(DVec3::new(0.3, 0.2, -4.0))
            * DAffine3::from_rotation_x(0.04)
            * DAffine3::from_rotation_y(-0.06);
        let air = Medium::transparent("air", eikonal::field::Constant::new(1.0));
        Parts {
            objects,
            partitions: Vec::new(),
            media: vec![air, fog.with_phase(phase)],
            emitters: vec![emitter],
            sensor: Sensor::Perspective(Perspective::new(eye, 0.45, 1.0)),
            film: FilmSpec {
                width: SIZE,
                height: SIZE,
                channels: 2,
                group_size: 2,
                filter: Filter::Box,
                window: None,
            },
            tolerance: Tolerance::default(),
            reflections: 1,
            measured: eikonal::Aabb::EMPTY,
        }
    }

    fn scene(&self) -> Scene {
        Scene::new(self.parts()).unwrap()
    }
}

fn two([a, b]: [f64; 2]) -> Spectrum {
    Spectrum([a, b, 0.0, 0.0])
}

/// Arbitrary weights of both signs.
fn weights() -> Vec<f64> {
    let weight = |i: usize| ((i * 7 % 13) as f64 - 4.0) / 8.0;
    (0..2 * SIZE * SIZE).map(weight).collect()
}

/// Σ weight × image of each batch of samples, by ordinary renders.
fn losses(scene: Scene, samples: u64) -> Vec<f64> {
    differences::losses(PATH, scene, samples, &weights())
}

fn by(scene: Scene, samples: u64) -> IndexDerivatives {
    let options = IndexDerivativeOptions {
        path: PATH,
        samples,
        seed: 1,
        decomposition: Decomposition::default(),
        hide_emitters: false,
        media: &[FOG],
        weights: &weights(),
    };
    let found = index_derivatives(&[scene], &options, &Handle::default());
    found.unwrap().unwrap()
}

/// Returns, for each number of the index, its name, the setups with the number changed by a step
/// either way, and the change.
fn changes(setup: Setup) -> Vec<(&'static str, [Setup; 2], f64)> {
    match setup.index {
        Index::Gaussian(numbers) => {
            let change = |(i, name, step): (usize, &'static str, f64)| {
                let at = |h: f64| {
                    let mut numbers = numbers;
                    numbers[i] += h;
                    Setup {
                        index: Index::Gaussian(numbers),
                        ..setup
                    }
                };
                (name, [at(-step), at(step)], step)
            };
            let all = [(0, "n0", 0.02), (1, "delta", 0.02), (2, "width", 0.02)];
            all.map(change).into()
        }
        Index::Grid(_) => {
            let at = |change| Setup {
                index: Index::Grid(change),
                ..setup
            };
            let step = 0.01;
            vec![("pattern", [at(-step), at(step)], step)]
        }
    }
}

/// Predicts the changes from the derivatives. Errors assume full correlation of samples.
fn found(setup: Setup, derivatives: &IndexDerivatives) -> Vec<Mean> {
    let by = &derivatives.by[0];
    match setup.index {
        Index::Gaussian(_) => [0, 1, 5].map(|i| (by.values[i], by.errors[i])).into(),
        Index::Grid(_) => {
            assert_eq!(by.shape, [GRID * GRID * GRID]);
            let terms = by.values.iter().enumerate();
            let value = terms.map(|(i, v)| v * pattern(i)).sum();
            let squares = by.errors.iter().enumerate();
            let squares: f64 = squares.map(|(i, e)| (e * pattern(i)).powi(2)).sum();
            vec![(value, squares.sqrt())]
        }
    }
}

fn compare(setup: Setup) {
    let samples = if long() {
        1 << 16
    } else {
        crate::common::samples(1 << 10, 256)
    };
    let derivatives = by(setup.scene(), samples);
    let plain = moments(&losses(setup.scene(), samples));
    let mut comparisons = Comparisons::default();
    println!("{setup:?}");
    comparisons.see("loss", derivatives.value, plain);
    let all = changes(setup).into_iter().zip(found(setup, &derivatives));
    for ((name, setups, step), found) in all {
        let both = setups.map(|setup| losses(setup.scene(), samples));
        comparisons.see(name, found, differences::quotient(both, step));
    }
    comparisons.check();
}

fn cases(index: Index, dielectric: bool) {
    for g in [0.0, 0.85] {
        for light in [Light::Sky, Light::Panel] {
            let extinction = if g > 0.0 { [2.0; 2] } else { [1.0; 2] };
            compare(Setup {
                index,
                dielectric,
                g,
                light,
                extinction,
                graded: false,
            });
        }
    }
}

const BUMP: Index = Index::Gaussian([1.3, 0.1, 0.5]);

#[test]
fn derivatives_by_a_bump_in_fog_are_differences() {
    cases(BUMP, false);
}

#[test]
fn derivatives_by_a_bump_in_a_ball_of_glass_are_differences() {
    cases(BUMP, true);
}

#[test]
fn derivatives_by_samples_in_fog_are_differences() {
    cases(Index::Grid(0.0), false);
}

#[test]
fn derivatives_by_samples_in_a_ball_of_glass_are_differences() {
    cases(Index::Grid(0.0), true);
}

/// Compares in fog of two channels, or in voxels, without a refracting boundary.
fn compare_media(extinction: [f64; 2], graded: bool) {
    for (index, g, light) in [
        (BUMP, 0.0, Light::Sky),
        (BUMP, 0.85, Light::Panel),
        (Index::Grid(0.0), 0.85, Light::Sky),
    ] {
        compare(Setup {
            index,
            dielectric: false,
            g,
            light,
            extinction,
            graded,
        });
    }
}

#[test]
fn derivatives_in_fog_with_a_colour_are_differences() {
    compare_media([2.5, 0.6], false);
}

#[test]
fn derivatives_in_voxels_of_smoke_are_differences() {
    compare_media([0.0; 2], true);
}
