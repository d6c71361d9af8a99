//! Equiangular sampling of distances around a point-like emitter
//! (docs/theory.md#point-emitters-in-media).

use super::edge::{Edge, Span};
use crate::scene::Scene;
use glam::DVec3;

/// A density over the arc length of an edge, proportional to 1/(D² + t²) around the closest
/// approach to a point. See Kulla and Fajardo, "Importance Sampling Techniques for Path Tracing in
/// Participating Media", 2012. On a curved edge, t is the arc length from the closest approach. The
/// density is then normalised but not exactly proportional to 1/r².
#[derive(Clone, Copy, Debug)]
pub(crate) struct Equiangular {
    closest: f64,
    distance: f64,
    /// Arc lengths at which the sampled part of the edge begins and ends.
    part: [f64; 2],
    angles: [f64; 2],
}

impl Equiangular {
    /// Makes the density over a part of an extended edge before its first specular event. The part
    /// extends from the first medium that scatters to the end of the last one. Returns `None` if
    /// this part has no length.
    pub(crate) fn new(scene: &Scene, edge: &Edge, point: DVec3) -> Option<Self> {
        let scatters = |span: &&Span| scene.medium(span.medium).scatters();
        let first = edge.lead().iter().find(scatters)?;
        let last = edge.lead().iter().rfind(scatters)?;
        let part = [first.length_before, last.length_after()];
        let nearest = edge.lead().iter().map(|span| {
            let theta = span.closest_approach(point);
            (span.arc.position(theta).distance(point), span, theta)
        });
        let (distance, span, theta) = nearest.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let closest = span.length_before + span.length_at(theta);
        // Limit the distance from below to keep the density finite; any positive distance is valid.
        let distance = distance.max(1e-9 * part[1]);
        let angles = part.map(|s| ((s - closest) / distance).atan());
        (angles[1] > angles[0]).then_some(Equiangular {
            closest,
            distance,
            part,
            angles,
        })
    }

    /// Samples an arc length from the start of the edge.
    pub(crate) fn sample(&self, u: f64) -> f64 {
        let [a, b] = self.angles;
        // Planted error "distances around a light of another density than they are sampled with", found by morgana-io/io::reference::fog_beside_a_point_light:
        // self.closest + self.distance * (a + (b - a) * u * u).tan()
        self.closest + self.distance * (a + (b - a) * u).tan()
    }

    /// Returns the density per unit length; zero outside the sampled part.
    pub(crate) fn pdf(&self, s: f64) -> f64 {
        let [from, to] = self.part;
        if !(from..=to).contains(&s) {
            return 0.0;
        }
        let t = s - self.closest;
        let [a, b] = self.angles;
        self.distance / ((b - a) * (self.distance * self.distance + t * t))
    }
}
