//! Photons: light that arrives at a vertex of a light subpath (docs/theory.md#photon-maps).

use crate::Spectrum;
use crate::path::{LightPath, PathVertex, TransportMode, Vertex};
use crate::scene::{MediumId, Scene};
use glam::DVec3;

/// What a photon fell on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum PhotonSite {
    /// A medium scatters it.
    Volume(MediumId),
    /// A surface: the object, and its geometric normal there.
    Surface(usize, DVec3),
}

/// Light that arrives at a vertex of a light subpath.
#[derive(Clone, Copy, Debug)]
pub struct Photon {
    /// Where.
    pub x: DVec3,
    /// Unit direction in which it travels.
    pub direction: DVec3,
    /// What it fell on.
    pub(crate) place: PhotonSite,
    /// Power over n², in a medium times the scattering coefficient: summed over photons, weighed by a kernel
    /// and scattered, it becomes basic radiance, in a medium per unit length.
    pub power: Spectrum,
    /// Edges and specular events of its path.
    pub depth: u32,
    /// Optical path length so far.
    pub optical_length: f64,
    /// Its emitter.
    pub emitter: usize,
    /// Number of its light subpath, and of the vertex on that.
    pub(crate) path: usize,
    /// See above.
    pub(crate) vertex: usize,
}

impl Photon {
    /// The phase function where it collided, for light that goes on against the `direction` of a sensor ray.
    pub(crate) fn phase(&self, scene: &Scene, direction: DVec3) -> Spectrum {
        match self.place {
            PhotonSite::Volume(medium) => {
                let cosine = -self.direction.dot(direction);
                let phase = &scene.medium(medium).phase;
                Spectrum::splat(phase.pdf(self.x, cosine))
            }
            PhotonSite::Surface(..) => Spectrum::ZERO,
        }
    }

    /// The scattering function f̃ of a surface vertex of a sensor subpath for light of the photon, without the cosine that
    /// [`Vertex::eval`] contains. `None` if it is no measure of the light that falls there: if it lies on another object, or on the
    /// other side of a thin one.
    pub(crate) fn reflected(&self, scene: &Scene, vertex: &Vertex) -> Option<Spectrum> {
        let Vertex::Surface {
            object, surface, ..
        } = vertex
        else {
            return None;
        };
        let PhotonSite::Surface(other, normal) = self.place else {
            return None;
        };
        let cosine = surface.normal.dot(self.direction).abs();
        let alike = other == *object && normal.dot(surface.normal) > 0.0 && cosine > 0.0;
        alike.then(|| vertex.eval(scene, -self.direction, TransportMode::Radiance) / cosine)
    }
}

/// The photons of the light subpath of a number, one of so many.
pub(crate) fn landed(
    scene: &Scene,
    light: &LightPath,
    path: usize,
    paths: usize,
) -> impl Iterator<Item = Photon> {
    let emitter = light.emitter;
    let photon = move |(vertex_index, path_vertex): (usize, &PathVertex)| {
        let vertex = &path_vertex.vertex;
        let n = scene.n(vertex.medium(), vertex.position());
        Photon {
            x: vertex.position(),
            direction: vertex.arrival(),
            place: match vertex {
                Vertex::Volume { medium, .. } => PhotonSite::Volume(*medium),
                Vertex::Surface {
                    object, surface, ..
                } => PhotonSite::Surface(*object, surface.normal),
            },
            // Φ/n_p², with Φ the throughput over M. What passes straight through a surface falls on it, too.
            // Planted error "photons without 1/n²", found by morgana-transport/transport::photons::agreement::photons_show_what_bdpt_shows:
            // power: path_vertex.throughput / (n * 1.0 * paths as f64 * vertex.stopping(scene)),
            power: path_vertex.throughput / (n * n * paths as f64 * vertex.stopping(scene)),
            depth: path_vertex.depth,
            optical_length: path_vertex.optical_length,
            emitter,
            path,
            vertex: vertex_index,
        }
    };
    let vertices = light.subpath.vertices.iter().enumerate().map(photon);
    vertices.filter(|p| !p.power.is_zero() && p.power.is_finite())
}

#[cfg(test)]
impl Photon {
    /// One that carries nothing.
    pub fn at(x: DVec3) -> Self {
        Photon {
            x,
            direction: DVec3::Z,
            place: PhotonSite::Volume(crate::scene::AMBIENT),
            power: Spectrum::ZERO,
            depth: 0,
            optical_length: 0.0,
            emitter: 0,
            path: 0,
            vertex: 0,
        }
    }
}
