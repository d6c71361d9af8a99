//! Distances sampled around a point-like emitter.

use super::edge::Edge;
use glam::DVec3;

/// A density over the arc length of an edge that falls off around its closest approach to a point as
/// 1/(D² + t²) (Kulla and Fajardo, "Importance Sampling Techniques for Path Tracing in Participating
/// Media", 2012). On a curved edge, t is arc length from the closest approach: the density is then
/// not exactly proportional to 1/r², but it is a density.
#[derive(Clone, Copy, Debug)]
pub struct Equiangular {
    closest: f64,
    distance: f64,
    length: f64,
    angles: [f64; 2],
}

impl Equiangular {
    /// Over the part of an extended edge before its first specular event; `None` if it has no length.
    pub fn new(edge: &Edge, point: DVec3) -> Option<Self> {
        let length = edge.lead().last()?.length_after();
        let nearest = edge.lead().iter().map(|span| {
            let theta = span.closest_approach(point);
            let distance = span.arc.position(theta).distance(point);
            (distance, span.length_before + span.length_at(theta))
        });
        let (distance, closest) = nearest.min_by(|a, b| a.0.total_cmp(&b.0))?;
        // Any positive distance gives a valid density; the floor keeps it finite.
        let distance = distance.max(1e-9 * length);
        let angle = |s: f64| ((s - closest) / distance).atan();
        (length > 0.0).then(|| Equiangular {
            closest,
            distance,
            length,
            angles: [angle(0.0), angle(length)],
        })
    }

    /// An arc length from the start of the edge.
    pub fn sample(&self, u: f64) -> f64 {
        let [a, b] = self.angles;
        self.closest + self.distance * (a + (b - a) * u).tan()
    }

    /// Density per unit length; zero beyond the first specular event.
    pub fn pdf(&self, s: f64) -> f64 {
        if s > self.length {
            return 0.0;
        }
        let t = s - self.closest;
        let [a, b] = self.angles;
        self.distance / ((b - a) * (self.distance * self.distance + t * t))
    }
}
