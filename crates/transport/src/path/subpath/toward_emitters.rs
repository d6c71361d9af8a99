//! Sampling of directions towards point-like emitters.

use crate::path::segment::{Scatter, TransportMode, Vertex};
use crate::sampling::{Frame, Purpose, Sampler};
use crate::scene::Scene;
use crate::spectrum::Spectrum;
use glam::DVec3;
use std::f64::consts::PI;

/// Fraction of the directions at a volume vertex that are sampled towards an emitter.
const EMITTER_FRACTION: f64 = 0.25;

/// Returns the density per steradian of directions with uniform polar angle about `axis`.
///
/// An edge that passes an emitter at distance D gains light as 1/D, and D grows as sin θ. With
/// directions from the phase function alone, the variance diverges logarithmically
/// (docs/theory.md#point-emitters-in-media). This density cancels the divergence. About the chord
/// of a curved ray the density is only approximately right.
fn pdf(axis: DVec3, direction: DVec3) -> f64 {
    let sin = axis.cross(direction).length();
    1.0 / (2.0 * PI * PI * sin.max(1e-300))
}

fn sample(axis: DVec3, [u, v]: [f64; 2]) -> DVec3 {
    let ((sin, cos), (y, x)) = ((PI * u).sin_cos(), (2.0 * PI * v).sin_cos());
    Frame::from_normal(axis).to_world(DVec3::new(sin * x, sin * y, cos))
}

/// Returns the chord directions from a volume vertex to the point-like emitters of the scene.
/// Returns `None` for a surface, where the bsdf alone gives the density.
fn axes<'a>(scene: &'a Scene, vertex: &Vertex) -> Option<(DVec3, &'a [DVec3])> {
    match vertex {
        Vertex::Volume { x, .. } if !scene.point_like_emitters().is_empty() => {
            Some((*x, scene.point_like_emitters()))
        }
        _ => None,
    }
}

fn axis(x: DVec3, emitter: DVec3) -> DVec3 {
    (emitter - x).try_normalize().unwrap_or(DVec3::Z)
}

/// Returns the density per steradian with which [`scatter`] samples `direction`.
pub(crate) fn scatter_pdf(scene: &Scene, vertex: &Vertex, direction: DVec3) -> f64 {
    let own = vertex.pdf(scene, direction);
    match axes(scene, vertex) {
        None => own,
        Some((x, emitters)) => {
            let all: f64 = emitters.iter().map(|&e| pdf(axis(x, e), direction)).sum();
            (1.0 - EMITTER_FRACTION) * own + EMITTER_FRACTION * all / emitters.len() as f64
        }
    }
}

/// Samples the direction in which a path from the sensor continues at a vertex; `None` if the path
/// is absorbed.
pub(crate) fn scatter(scene: &Scene, vertex: &Vertex, sampler: &mut Sampler) -> Option<Scatter> {
    let Some((x, emitters)) = axes(scene, vertex) else {
        return vertex.scatter(scene, TransportMode::Radiance, sampler);
    };
    let choice = sampler.next_1d_for(Purpose::Attraction);
    let direction = if choice < EMITTER_FRACTION {
        let i = (choice / EMITTER_FRACTION * emitters.len() as f64) as usize;
        let emitter = emitters[i.min(emitters.len() - 1)];
        sample(axis(x, emitter), sampler.next_2d_for(Purpose::Direction))
    } else {
        vertex
            .scatter(scene, TransportMode::Radiance, sampler)?
            .start
            .direction
    };
    let pdf = scatter_pdf(scene, vertex, direction);
    Some(Scatter {
        start: vertex.start(scene, direction),
        weight: Spectrum::splat(vertex.pdf(scene, direction) / pdf),
        pdf,
        delta: false,
    })
}
