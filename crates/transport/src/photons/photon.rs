//! Photons: light that arrives at a vertex of a light subpath (docs/theory.md#photon-maps).

use crate::Spectrum;
use crate::emitter::Class;
use crate::path::{LightPath, PathVertex, TransportMode, Vertex};
use crate::scene::{MediumId, Scene};
use glam::DVec3;

/// Surface or medium that a photon reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum PhotonSite {
    /// Collision in a medium.
    Volume(MediumId),
    /// Surface: the index of the object, and its geometric normal at the photon.
    Surface(usize, DVec3),
}

/// Light that arrives at a vertex of a light subpath.
#[derive(Clone, Copy, Debug)]
pub struct Photon {
    /// Position.
    pub x: DVec3,
    /// Unit direction of travel.
    pub direction: DVec3,
    /// Surface or medium that the photon reached.
    pub(crate) place: PhotonSite,
    /// Power divided by n²; in a medium multiplied by the scattering coefficient. The sum over
    /// photons, weighted by a kernel and by scattering, is basic radiance; in a medium it is basic
    /// radiance per unit length.
    pub power: Spectrum,
    /// Number of edges and specular events of its path.
    pub depth: u32,
    /// Optical path length so far.
    pub optical_length: f64,
    /// Index of the emitter.
    pub emitter: usize,
    /// Index of the photon's light subpath.
    pub(crate) path: usize,
    /// Index of the photon's vertex on the subpath.
    pub(crate) vertex: usize,
}

impl Photon {
    /// Returns the phase function at the photon's collision, for light that continues against the
    /// `direction` of a sensor ray.
    pub(crate) fn phase(&self, scene: &Scene, direction: DVec3) -> Spectrum {
        match self.place {
            PhotonSite::Volume(medium) => {
                let phase = &scene.medium(medium).phase;
                Spectrum::splat(phase.pdf(self.x, [self.direction, -direction]))
            }
            PhotonSite::Surface(..) => Spectrum::ZERO,
        }
    }

    /// Returns the scattering function f̃ of a surface vertex of a sensor subpath for the photon's
    /// light, without the cosine that [`Vertex::eval`] contains. Returns `None` if the photon does
    /// not measure the light at the vertex: if it lies on another object, or on the other side of a
    /// thin object.
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

/// Returns the photons of light subpath number `path`, one of `paths` subpaths.
pub(crate) fn stored(
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
            // Divide by n_p²: the photon's Φ is the throughput over M. Light that a surface
            // transmits straight also reaches the surface.
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

/// Returns true if a path from the sensor that scatters once, with connections to emitters, cannot
/// find the light that arrives at a vertex of a light subpath: light that has been scattered before,
/// or light of a point-like emitter that no connection finds (docs/theory.md#previews).
pub(crate) fn is_indirect(scene: &Scene, light: &LightPath, vertex: usize) -> bool {
    let vertices = &light.subpath.vertices;
    let is_scattered = vertices[..vertex].iter().any(|before| !before.specular);
    let is_connectable = vertex == 0 && vertices[0].edge.connectable;
    let class = scene.emitters()[light.emitter].class();
    // Planted error "light that paths find counted by photons, too", found by morgana-transport/transport::photons::agreement::photons_show_what_bdpt_shows:
    // true || is_scattered || (class == Class::Delta && !is_connectable)
    is_scattered || (class == Class::Delta && !is_connectable)
}

#[cfg(test)]
impl Photon {
    /// Creates a photon without power.
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
