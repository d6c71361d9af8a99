//! State of a path while it is followed: its next ray, its length, and its last edge.

use crate::Spectrum;
use crate::path::{Edge, Equiangular, Split, Start, Vertex};
use crate::scene::Scene;
use glam::DVec3;
use std::cell::Cell;

/// The next ray of the path, with the data that its MIS weight needs.
pub(super) struct Next {
    pub(super) start: Start,
    /// Throughput in basic radiance, including n² of the sensor.
    pub(super) throughput: Spectrum,
    /// Vertex that scattered the ray, and the density of the direction. `None` if no connection
    /// competes (at the sensor, or along a specular lobe).
    pub(super) from: Option<(Vertex, f64)>,
    /// Length of the path up to the start of this ray.
    pub(super) length: PathLength,
    /// True if the light that volumes emit along the edge is still to be added.
    pub(super) gathers: bool,
    /// True if photons bring the light that arrives at the start of the ray after scattering: the
    /// ray only finds emitters.
    pub(super) is_last: bool,
}

impl Next {
    /// Returns the next ray of the other branch of a split edge, or `None` if the branch
    /// contributes nothing.
    pub(super) fn split_off(&self, split: &Split) -> Option<Self> {
        let throughput = self.throughput * split.throughput;
        // Planted error "splitting that are followed where they bring nothing", found by morgana-transport/transport::first_vertex::a_split_that_brings_nothing_is_left:
        // true.then(|| Next {
        (!throughput.is_zero()).then(|| Next {
            start: split.start,
            throughput,
            from: None,
            // The reflection counts like an edge.
            // Planted error "splitting that start anew", found by morgana-transport/transport::first_vertex::reflections_have_no_variance:
            // length: self.length,
            length: self.length.and(0, split.optical_length),
            // The split edge already gathered for both branches.
            // Planted error "what volumes emit counted by both parts of a split path", found by morgana-transport/transport::sources::volumes::split_rays_gather_once:
            // gathers: true,
            gathers: false,
            is_last: false,
        })
    }
}

/// Length of a part of a path.
#[derive(Clone, Copy, Default)]
pub(super) struct PathLength {
    pub(super) edges: u32,
    /// Number of edges and specular events.
    pub(super) depth: u32,
    pub(super) optical_length: f64,
}

impl PathLength {
    /// Returns the length with another edge, which passes some specular events.
    pub(super) fn and(self, events: u32, optical_length: f64) -> Self {
        PathLength {
            edges: self.edges.saturating_add(1),
            depth: self.depth.saturating_add(1 + events),
            optical_length: self.optical_length + optical_length,
        }
    }
}

/// An edge of a path, with the path up to the edge.
pub(super) struct SampledEdge<'p> {
    pub(super) edge: &'p Edge<'p>,
    /// Ray that was followed.
    pub(super) next: &'p Next,
    /// Channel probabilities with which the edge was sampled.
    pub(super) channel_pdf: Spectrum,
    /// Length of the path up to the end of the edge.
    pub(super) length: PathLength,
    /// Cached equiangular density along the edge, with the position around which it was last
    /// needed.
    pub(super) around: Cell<Option<(DVec3, Option<Equiangular>)>>,
}

impl SampledEdge<'_> {
    /// Returns the equiangular density along the edge around a position.
    pub(super) fn around(&self, scene: &Scene, place: DVec3) -> Option<Equiangular> {
        // Planted error "distances around one light taken for those around another", found by morgana-transport/transport::connections::two_points_add_up_in_thick_fog:
        // let known = self.around.get();
        let known = self.around.get().filter(|(at, _)| *at == place);
        let (_, around) =
            known.unwrap_or_else(|| (place, Equiangular::new(scene, self.edge, place)));
        self.around.set(Some((place, around)));
        around
    }
}
