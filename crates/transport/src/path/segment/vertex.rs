//! Vertices: points at which light is scattered.

use super::boundary::{leave, surface_at, surface_of};
use super::edge::{Edge, End, Front, Point, Start, TransportMode};
use super::edge_geometry::EdgeGeometry;
use crate::Spectrum;
use crate::bsdf::{Bsdf, Surface};
use crate::connection_end::{ConnectionEnd, OnSurface};
use crate::phase::Phase;
use crate::sampling::{Purpose, Sampler};
use crate::scene::{MediumId, Receiver, Scene};
use glam::DVec3;

/// A point at which light is scattered, except by specular events.
#[derive(Clone, Copy, Debug)]
pub enum Vertex {
    /// A vertex inside a medium.
    Volume {
        /// Position.
        x: DVec3,
        /// Unit direction in which the subpath arrives.
        direction: DVec3,
        /// Medium.
        medium: MediumId,
    },
    /// A vertex on a surface.
    Surface {
        /// Position.
        x: DVec3,
        /// Unit direction in which the subpath arrives.
        direction: DVec3,
        /// Object.
        object: usize,
        /// Normal, shading data and indices of the surface.
        surface: Surface,
        /// Medium through which the subpath arrives.
        medium: MediumId,
    },
}

/// A scattered direction in which a path continues.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scatter {
    /// Start of the next edge.
    pub start: Start,
    /// Weight of the sample: scattering function (and cosine) over density.
    pub weight: Spectrum,
    /// Density per steradian; irrelevant for a specular lobe.
    pub pdf: f64,
    /// True if the lobe is specular, so that no connection can replace the direction.
    pub delta: bool,
}

impl Vertex {
    /// Makes a vertex for an end of a path that lies on no surface. The scattering of this vertex
    /// has no meaning.
    pub fn end(start: &Start) -> Vertex {
        Vertex::Volume {
            x: start.x,
            direction: start.direction,
            medium: start.medium,
        }
    }

    /// Makes the vertex at the start of an emitter's subpath, at the position of `end`. The
    /// scattering of this vertex has no meaning.
    pub fn source(scene: &Scene, start: &Start, end: &ConnectionEnd) -> Vertex {
        match *end {
            ConnectionEnd::Point {
                position,
                surface: Some(on),
            } => Vertex::Surface {
                x: position,
                direction: -start.direction,
                object: on.object,
                surface: surface_of(scene, position, &on, start.medium),
                medium: start.medium,
            },
            _ => Vertex::end(start),
        }
    }

    /// Returns the vertex at the end of an edge, if the edge ends at one.
    pub fn of(scene: &Scene, edge: &Edge) -> Option<Vertex> {
        match edge.end {
            End::Collision(point) => Some(Vertex::volume(&point)),
            End::Surface {
                object,
                hit,
                direction,
                medium,
            } => Some(Vertex::Surface {
                x: hit.position,
                direction,
                object,
                surface: surface_at(scene, object, &hit, medium),
                medium,
            }),
            End::Escaped { .. } | End::Dead => None,
        }
    }

    /// Makes the vertex at a point of an edge.
    pub fn volume(point: &Point) -> Vertex {
        Vertex::Volume {
            x: point.x,
            direction: point.direction,
            medium: point.medium,
        }
    }

    /// Returns the start of an edge that leaves in a given direction.
    pub fn start(&self, scene: &Scene, direction: DVec3) -> Start {
        match *self {
            Vertex::Volume { x, medium, .. } => Start::point(x, direction, medium),
            Vertex::Surface {
                x,
                object,
                surface,
                medium,
                ..
            } => Start {
                x: leave(scene, x, surface.normal, direction),
                direction,
                medium: scene.medium_beside(object, medium, x, surface.normal, direction),
                front: Front::Point,
                start_object: self.start_object(scene, direction),
            },
        }
    }

    /// Returns the position.
    pub fn position(&self) -> DVec3 {
        match *self {
            Vertex::Volume { x, .. } | Vertex::Surface { x, .. } => x,
        }
    }

    /// Returns the object on whose surface the vertex lies, if a straight line that leaves in
    /// `direction` never meets the object again.
    pub(in crate::path) fn start_object(&self, scene: &Scene, direction: DVec3) -> Option<usize> {
        match *self {
            Vertex::Volume { .. } => None,
            Vertex::Surface {
                object, surface, ..
            } => scene.start_object(object, surface.normal, direction),
        }
    }

    /// Returns the medium through which the subpath arrived.
    pub fn medium(&self) -> MediumId {
        match self {
            Vertex::Volume { medium, .. } | Vertex::Surface { medium, .. } => *medium,
        }
    }

    /// Returns the unit direction in which the subpath arrived.
    pub fn arrival(&self) -> DVec3 {
        match self {
            Vertex::Volume { direction, .. } | Vertex::Surface { direction, .. } => *direction,
        }
    }

    /// Returns the emitter on whose surface the vertex lies, and the radiance emitted against the
    /// arriving subpath. Also returns the density per unit area with which connections choose this
    /// point.
    pub fn emitted(&self, scene: &Scene) -> Option<(usize, Spectrum, f64)> {
        let Vertex::Surface {
            direction,
            object,
            surface,
            ..
        } = *self
        else {
            return None;
        };
        scene.emitted(&on(object, &surface), -direction)
    }

    /// Returns the vertex as the end of a connection.
    pub(crate) fn as_end(&self) -> ConnectionEnd {
        match *self {
            Vertex::Volume { x, .. } => ConnectionEnd::at(x),
            Vertex::Surface {
                x, object, surface, ..
            } => ConnectionEnd::Point {
                position: x,
                surface: Some(on(object, &surface)),
            },
        }
    }

    /// Returns the object on whose surface the vertex lies.
    pub fn object(&self) -> Option<usize> {
        match self {
            Vertex::Volume { .. } => None,
            Vertex::Surface { object, .. } => Some(*object),
        }
    }

    /// Returns the data of the vertex on which the choice of an emitter depends.
    pub(crate) fn receiver<'a>(&self, scene: &'a Scene) -> Receiver<'a> {
        match *self {
            Vertex::Volume {
                x,
                direction,
                medium,
            } => Receiver::Volume {
                x,
                direction,
                phase: &scene.medium(medium).phase,
            },
            Vertex::Surface {
                x,
                direction,
                object,
                surface,
                ..
            } => Receiver::Surface {
                x,
                normal: if surface.normal.dot(direction) > 0.0 {
                    -surface.normal
                } else {
                    surface.normal
                },
                opaque: scene.objects()[object].bsdf.is_opaque(),
            },
        }
    }

    /// Returns true if the vertex is known to scatter no light, as is common for surfaces of
    /// emitters.
    pub(crate) fn is_black(&self, scene: &Scene) -> bool {
        match self {
            Vertex::Volume { .. } => false,
            Vertex::Surface {
                object, surface, ..
            } => {
                matches!(scene.objects()[*object].bsdf, Bsdf::Diffuse(_))
                    && self
                        .eval(scene, surface.shading_normal, TransportMode::Radiance)
                        .is_zero()
            }
        }
    }

    /// Returns true if two directions leave on one side of the vertex's surface.
    pub fn same_side(&self, a: DVec3, b: DVec3) -> bool {
        match self {
            Vertex::Volume { .. } => true,
            Vertex::Surface { surface, .. } => surface.normal.dot(a) * surface.normal.dot(b) > 0.0,
        }
    }

    /// Returns the vertex for a path that arrives from the direction `from`, a unit vector away
    /// from the vertex.
    pub(crate) fn seen_from(mut self, from: DVec3) -> Self {
        match &mut self {
            Vertex::Volume { direction, .. } | Vertex::Surface { direction, .. } => {
                *direction = -from;
            }
        }
        self
    }

    /// Returns the sampling density of the event that ends a path here, for a ray tube in the
    /// direction `direction` and channel probabilities `channel_pdf`. In a volume it is the density
    /// of a collision, per unit length. On a surface it is the probability of survival times the
    /// cosine and the probability of stopping there.
    pub fn event(
        &self,
        scene: &Scene,
        channel_pdf: Spectrum,
        direction: DVec3,
        geometry: &EdgeGeometry,
    ) -> f64 {
        match self {
            Vertex::Volume { x, medium, .. } => {
                let extinction = scene.medium(*medium).extinction_along(*x, direction);
                (channel_pdf * extinction * geometry.depth.exp_neg()).sum()
            }
            Vertex::Surface { surface, .. } => {
                let cos = surface.normal.dot(direction).abs();
                cos * geometry.survival(channel_pdf) * self.stopping(scene)
            }
        }
    }

    /// Returns the probability that arriving light is scattered here: less than 1 on a surface that
    /// lets a part of the light pass straight on. The surface's scattering has an equal factor, so
    /// that the two cancel in the contribution of a path (docs/theory.md#masks-and-panes).
    pub fn stopping(&self, scene: &Scene) -> f64 {
        match self {
            Vertex::Volume { .. } => 1.0,
            Vertex::Surface {
                direction,
                object,
                surface,
                ..
            } => {
                let bsdf = &scene.objects()[*object].bsdf;
                let through = bsdf.through(&surface.site, surface.normal.dot(*direction));
                through.map_or(1.0, |t| 1.0 - t.probability)
            }
        }
    }

    /// Evaluates the scattering between `direction` and the arrival of the subpath: the phase
    /// function, or f̃·|cos|. `mode` is the quantity that the vertex's subpath carries. The
    /// scattering coefficient of a volume vertex is part of the sampling of the edge.
    pub fn eval(&self, scene: &Scene, direction: DVec3, mode: TransportMode) -> Spectrum {
        match self {
            Vertex::Volume { .. } => Spectrum::splat(self.pdf(scene, direction)),
            Vertex::Surface {
                direction: arrival,
                object,
                surface,
                ..
            } => {
                let bsdf = &scene.objects()[*object].bsdf;
                match mode {
                    TransportMode::Radiance => bsdf.eval(surface, -*arrival, direction),
                    TransportMode::Importance => {
                        bsdf.eval_importance(surface, -*arrival, direction)
                    }
                }
            }
        }
    }

    /// Returns the density per steradian with which [`Vertex::scatter`] samples `direction`.
    pub fn pdf(&self, scene: &Scene, direction: DVec3) -> f64 {
        match self {
            Vertex::Volume {
                x,
                direction: arrival,
                medium,
            } => {
                let phase = &scene.medium(*medium).phase;
                phase.pdf(*x, [*arrival, direction])
            }
            Vertex::Surface {
                direction: arrival,
                object,
                surface,
                ..
            } => scene.objects()[*object]
                .bsdf
                .pdf(surface, -*arrival, direction),
        }
    }

    /// Samples the scattered direction of light in a volume, given its position and direction of
    /// arrival. Returns the direction and its density per steradian.
    #[inline]
    pub(crate) fn scatter_in_volume(
        phase: &Phase,
        [x, direction]: [DVec3; 2],
        sampler: &mut Sampler,
    ) -> (DVec3, f64) {
        let u = sampler.next_2d_for(Purpose::Direction);
        // Draw as many random numbers as on surfaces.
        sampler.next_1d_for(Purpose::Lobe);
        phase.sample(x, direction, u)
    }

    /// Samples the direction in which a subpath of `mode` continues; `None` if it is absorbed.
    pub(crate) fn scatter(
        &self,
        scene: &Scene,
        mode: TransportMode,
        sampler: &mut Sampler,
    ) -> Option<Scatter> {
        match self {
            Vertex::Volume {
                x,
                direction,
                medium,
            } => {
                let phase = &scene.medium(*medium).phase;
                let (direction, pdf) = Vertex::scatter_in_volume(phase, [*x, *direction], sampler);
                Some(Scatter {
                    start: self.start(scene, direction),
                    weight: Spectrum::ONE,
                    pdf,
                    delta: false,
                })
            }
            Vertex::Surface {
                direction,
                object,
                surface,
                ..
            } => {
                let [u, v] = sampler.next_2d_for(Purpose::Direction);
                let w = sampler.next_1d_for(Purpose::Lobe);
                let bsdf = &scene.objects()[*object].bsdf;
                let sample = match mode {
                    TransportMode::Radiance => bsdf.sample(surface, -*direction, [w, u, v]),
                    TransportMode::Importance => {
                        bsdf.sample_importance(surface, -*direction, [w, u, v])
                    }
                }?;
                Some(Scatter {
                    start: self.start(scene, sample.direction),
                    weight: sample.weight,
                    pdf: sample.pdf,
                    delta: sample.delta,
                })
            }
        }
    }
}

/// Makes the end of a path at a point of an object's surface.
fn on(object: usize, surface: &Surface) -> OnSurface {
    OnSurface {
        object,
        normal: surface.normal,
        site: surface.site,
    }
}
