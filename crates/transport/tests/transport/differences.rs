//! Derivatives, compared with central differences of renders with common random numbers.
//!
//! Both are means of 32 batches. Their difference over its standard error follows Student's t with
//! 31 to 62 degrees of freedom (Welch). It is converted to the z of a normal distribution with an
//! equal p-value: at |z| < 4, correct code fails a comparison with a probability of 6.3e-5.

use eikonal::field::Placement;
use glam::{DAffine3, DVec3};
use morgana_transport::Scene;
use morgana_transport::render::{Handle, RenderOptions, State};
use morgana_transport::renderer::Renderer;
use morgana_transport::volume::{GridFilter, GridSamples, VolumeGrid, VolumeTexture};
use std::ops::ControlFlow;
use std::sync::Arc;
use testkit::batches::{self, welch_z};

/// Number of batches, equal to the number in derivatives.
pub const BATCHES: u64 = 32;
const MAX_DEVIATION: f64 = 4.0;

/// A mean and its standard error.
pub type Mean = (f64, f64);

/// True if tests take more samples.
pub fn long() -> bool {
    std::env::var_os("MORGANA_LONG_TESTS").is_some()
}

/// Mean and standard error.
pub fn moments(all: &[f64]) -> Mean {
    let moments = batches::moments(all);
    (moments.mean(), moments.standard_error())
}

/// Σ weight × image of each batch, with `samples` samples in all.
pub fn losses(
    renderer: impl Into<Renderer>,
    scene: Scene,
    samples: u64,
    weights: &[f64],
) -> Vec<f64> {
    let (scenes, renderer, each) = ([scene], renderer.into(), samples / BATCHES);
    let options = |first| RenderOptions {
        first,
        ..RenderOptions::new(renderer, each, 0)
    };
    let mut state = State::new(&scenes, &options(0));
    let mut before = 0.0;
    let batch = |number: u64| {
        state.advance(&scenes, &options(number * each), &Handle::default(), |_| {
            ControlFlow::Continue(())
        });
        let image = state.film().mean();
        let terms = image.iter().zip(weights);
        let mean: f64 = terms
            .map(|(value, weight)| f64::from(*value) * weight)
            .sum();
        let all = mean * (number + 1) as f64;
        let own = all - before;
        before = all;
        own
    };
    (0..BATCHES).map(batch).collect()
}

/// Mean and standard error of the difference quotient of two losses, a step down and a step up,
/// batch by batch.
pub fn quotient([down, up]: [Vec<f64>; 2], step: f64) -> Mean {
    let pairs = up.into_iter().zip(down);
    let quotients: Vec<f64> = pairs.map(|(up, down)| (up - down) / (2.0 * step)).collect();
    moments(&quotients)
}

/// Comparisons that are judged together.
#[derive(Default)]
pub struct Comparisons {
    wrong: Vec<String>,
}

impl Comparisons {
    /// Compares one mean with another.
    pub fn see(&mut self, what: &str, found: Mean, exact: Mean) {
        let z = welch_z(found, exact, BATCHES as usize);
        println!("{what}: {found:.4?}, expected {exact:.4?}, z = {z:.2}");
        if z.is_nan() || z.abs() >= MAX_DEVIATION {
            self.wrong.push(format!("{what}: z = {z}"));
        }
    }

    /// Fails if any comparison failed.
    pub fn check(self) {
        assert!(self.wrong.is_empty(), "{:#?}", self.wrong);
    }
}

/// Voxels of two channels around a ball of radius 1, with a value for each number in memory order.
pub fn voxels(value: impl Fn(usize) -> f32) -> VolumeTexture {
    const SIZE: usize = 5;
    let samples = GridSamples {
        size: [SIZE; 3],
        channels: 2,
        data: (0..2 * SIZE.pow(3)).map(value).collect(),
    };
    let place =
        DAffine3::from_scale(DVec3::splat(2.2)) * DAffine3::from_translation(DVec3::splat(-0.5));
    let filter = GridFilter::Trilinear;
    let grid = VolumeGrid::new(samples, place, Placement::Centers, filter, [0.0, 10.0]);
    VolumeTexture::Grid(Arc::new(grid.unwrap()))
}
