//! Stokes vectors of images (docs/theory.md#stokes-vectors).
//!
//! If all paths of a pixel have equal matrices, its normalised Stokes vector is known without
//! noise, from fields in world coordinates ([`field`]), which use no frames. Other means are
//! compared at a family-wise false-alarm rate of 1e-4 per test.

mod chains;
mod estimators;
mod field;
mod filters;
mod haze;
mod invariants;
mod meters;
mod mie;
mod panes;
mod rayleigh;
mod slab;

use glam::DVec3;
use morgana_transport::Scene;
use morgana_transport::film::{Decomposition, LightParts};
use morgana_transport::integrator::{Integrator, PathTracer};
use morgana_transport::render::{RenderOptions, Rendering};

/// Renders the Stokes parameters.
fn polarized(scene: &Scene, max_depth: Option<u32>, samples: u64, seed: u64) -> Rendering {
    let path = PathTracer {
        max_depth,
        rr_depth: 50,
    };
    polarized_by(Integrator::Path(path), scene, samples, seed)
}

/// Renders the Stokes parameters by an estimator.
fn polarized_by(integrator: Integrator, scene: &Scene, samples: u64, seed: u64) -> Rendering {
    scene.render(&RenderOptions {
        decomposition: Decomposition {
            parts: Some(LightParts::Stokes),
            ..Decomposition::default()
        },
        ..RenderOptions::new(integrator, samples, seed)
    })
}

/// Means of the Stokes parameters of the first pixel's first channel.
fn stokes(rendering: &Rendering) -> [f64; 4] {
    let mean = |layer| f64::from(rendering.film.mean_at(Some(layer), 0, 0));
    std::array::from_fn(mean)
}

/// Asserts that a Stokes vector is a multiple of another.
fn assert_alike(found: [f64; 4], expected: [f64; 4], allowed: f64) {
    println!("{found:?} {expected:?}");
    assert!(found[0] > 0.0);
    for (a, b) in found.iter().zip(expected) {
        let difference = a / found[0] - b / expected[0];
        assert!(difference.abs() < allowed, "{found:?} {expected:?}");
    }
}

/// Returns the first axis of the frame of a sensor ray.
fn horizontal(direction: DVec3, up: DVec3) -> DVec3 {
    direction.cross(up).normalize()
}
