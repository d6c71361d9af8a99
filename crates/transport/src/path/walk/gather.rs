//! Light that volumes emit along rays (docs/theory.md#volumes-that-emit).

use super::trace::{Sampling, trace};
use crate::Spectrum;
use crate::emitter::VolumeLight;
use crate::path::segment::{Edge, Point, Start, TransportMode, Vertex};
use crate::path::workspace::Workspace;
use crate::sampling::Sampler;
use crate::scene::Scene;
use glam::DVec3;
use smallvec::SmallVec;

/// Light that a volume emits along a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EmittedAlong {
    /// Index of the emitter.
    pub emitter: usize,
    /// Basic radiance that arrives at the start of the ray.
    pub light: Spectrum,
    /// Number of edges and specular events up to the emission, at least one.
    pub depth: u32,
    /// Optical path length from the start to the emission.
    pub optical_length: f64,
    /// Position of the emission.
    pub x: DVec3,
    /// Arc length from the start of the last edge to the emission.
    pub length: f64,
}

/// Samples an edge with channel probabilities `channel_pdf` and passes the light that volumes emit
/// along it to `found`. The light is an estimate of ∫ ε e^{−τ} F̄/n² ds from one point for each
/// volume. Returns the edge, which keeps its spans and ends at a collision or where a surface
/// scatters.
pub(crate) fn gather_along<'a>(
    scene: &'a Scene,
    start: Start,
    channel_pdf: Spectrum,
    sampler: &mut Sampler,
    ws: &mut Workspace,
    mut found: impl FnMut(EmittedAlong, &Edge),
) -> Edge<'a> {
    let sampling = Sampling {
        mode: TransportMode::Radiance,
        channel_pdf,
        extend: false,
        collides: true,
        spans: true,
        parts: false,
        forced: false,
        differentials: false,
        splitting: false,
    };
    sampler.independently(|sampler| {
        let edge = trace(scene, start, sampling, sampler, ws);
        for (emitter, volume) in scene.volume_lights() {
            let Some(place) = Place::sample(&edge, volume, sampler.next_1d()) else {
                continue;
            };
            let Point {
                x, depth, weight, ..
            } = place.point;
            let n = scene.n(place.point.medium, x);
            // Divide by the probability Σ w_c e^{−τ_c} that the edge reaches the point without a
            // collision.
            let transmittance = depth.exp_neg();
            let reaches = (channel_pdf * transmittance).sum();
            let emitted = scene.emitted_within(volume, place.point.medium, x);
            let light = emitted * transmittance * weight / reaches;
            let along = EmittedAlong {
                emitter,
                // Planted error "emission of volumes not divided by n²", found by morgana-transport/transport::sources::volumes::a_graded_furnace_is_even:
                // light: light * place.length * (n / n),
                light: light * (place.length / (n * n)),
                depth: 1 + place.events,
                optical_length: place.optical_length,
                x,
                length: place.point.length,
            };
            found(along, &edge);
        }
        edge
    })
}

/// Passes the light of volumes in view along a ray from the sensor to `found`. The ray ends at a
/// collision, or at the first surface that scatters it except along a specular lobe. `found` also
/// receives the edges passed before, and the edge along which the light was found.
pub(crate) fn gather_in_view(
    scene: &Scene,
    start: Start,
    channel_pdf: Spectrum,
    sampler: &mut Sampler,
    ws: &mut Workspace,
    mut found: impl FnMut(EmittedAlong, &[Edge], &Edge),
) {
    if scene.volume_lights().next().is_none() {
        return;
    }
    let (mut start, mut throughput) = (start, Spectrum::ONE);
    let (mut depth, mut optical_length) = (0, 0.0);
    let mut passed: Vec<Edge> = Vec::new();
    for _ in 0..MAX_SPECULAR_VERTICES {
        let edge = gather_along(scene, start, channel_pdf, sampler, ws, |along, edge| {
            let along = EmittedAlong {
                light: along.light * throughput,
                depth: depth + along.depth,
                optical_length: optical_length + along.optical_length,
                ..along
            };
            found(along, &passed, edge);
        });
        let Some(vertex @ Vertex::Surface { .. }) = Vertex::of(scene, &edge) else {
            return;
        };
        let scatter = sampler
            .independently(|sampler| vertex.scatter(scene, TransportMode::Radiance, sampler));
        let Some(scatter) = scatter.filter(|scatter| scatter.delta) else {
            return;
        };
        throughput *= edge.throughput(scene, channel_pdf) * scatter.weight;
        if throughput.is_zero() {
            return;
        }
        depth += 1 + edge.geometry.events;
        optical_length += edge.optical_length;
        start = scatter.start;
        passed.push(edge);
    }
    ws.stats.over_budget.rays += 1;
}

/// Largest number of specular vertices along a view; sensible views pass fewer.
const MAX_SPECULAR_VERTICES: u32 = 1000;

/// A point on an edge within a volume.
struct Place<'a> {
    point: Point<'a>,
    /// Arc length of the edge within the volume, the reciprocal of the density of the point.
    length: f64,
    /// Number of specular events before the point.
    events: u32,
    optical_length: f64,
}

impl<'a> Place<'a> {
    /// Samples a point, uniform in arc length; `None` if the edge does not pass the volume.
    fn sample(edge: &Edge<'a>, volume: &VolumeLight, u: f64) -> Option<Self> {
        let mut parts: SmallVec<[(usize, [f64; 2]); 4]> = SmallVec::new();
        let mut length = 0.0;
        for (i, span) in edge.spans.iter().enumerate() {
            if volume.medium().is_some_and(|id| id != span.medium) {
                continue;
            }
            for range in volume.parts(&span.arc, span.theta_end) {
                let last = edge.length - span.length_before;
                let [begin, end] = range.map(|theta| span.arc.arc_length(theta).min(last));
                length += end - begin;
                parts.push((i, [begin, end]));
            }
        }
        let mut left = u * length;
        let (i, at) = parts.iter().find_map(|(i, [begin, end])| {
            let inside = left <= end - begin;
            let at = begin + left;
            left -= end - begin;
            inside.then_some((*i, at))
        })?;
        let span = &edge.spans[i];
        let theta = span.theta_at_length(at);
        let before = edge.spans[..i].iter();
        let before: f64 = before.map(|s| s.arc.optical_length(s.theta_end)).sum();
        (length > 0.0).then(|| Place {
            point: span.at(theta),
            length,
            events: span.events_before,
            optical_length: before + span.arc.optical_length(theta),
        })
    }
}
