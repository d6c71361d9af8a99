//! Vertices: where light is scattered.

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

/// A point at which light is scattered by other than specular events.
#[derive(Clone, Copy, Debug)]
pub enum Vertex {
    /// Inside a medium.
    Volume {
        /// Position.
        x: DVec3,
        /// Unit direction of the sensor subpath on arrival.
        direction: DVec3,
        /// Medium.
        medium: MediumId,
    },
    /// On a surface.
    Surface {
        /// Position.
        x: DVec3,
        /// Unit direction of the sensor subpath on arrival.
        direction: DVec3,
        /// Object.
        object: usize,
        /// Normal and indices.
        surface: Surface,
        /// Medium through which the sensor subpath arrived.
        medium: MediumId,
    },
}

/// A direction in which a path goes on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scatter {
    /// Where the next edge starts.
    pub start: Start,
    /// Throughput: scattering function (and cosine) over density.
    pub weight: Spectrum,
    /// Density per steradian; irrelevant for a specular lobe.
    pub pdf: f64,
    /// Whether the lobe is specular, so that no connection can follow it.
    pub delta: bool,
}

impl Vertex {
    /// A vertex that stands for an end of a path on no surface; it is not to be asked how it scatters.
    pub fn end(start: &Start) -> Vertex {
        Vertex::Volume {
            x: start.x,
            direction: start.direction,
            medium: start.medium,
        }
    }

    /// The vertex that stands for the start of an emitter's subpath, where `end` says that it lies; it is not to be asked how
    /// it scatters.
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

    /// The vertex at which an edge ended, if it did at one.
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

    /// The vertex at a point of an edge.
    pub fn volume(point: &Point) -> Vertex {
        Vertex::Volume {
            x: point.x,
            direction: point.direction,
            medium: point.medium,
        }
    }

    /// Where an edge starts that leaves in a given direction.
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
                left: self.left(scene, direction),
            },
        }
    }

    /// Position.
    pub fn position(&self) -> DVec3 {
        match *self {
            Vertex::Volume { x, .. } | Vertex::Surface { x, .. } => x,
        }
    }

    /// The object on whose surface it lies, if a straight line that leaves it in a direction never meets that again.
    pub(in crate::path) fn left(&self, scene: &Scene, direction: DVec3) -> Option<usize> {
        match *self {
            Vertex::Volume { .. } => None,
            Vertex::Surface {
                object, surface, ..
            } => scene.left(object, surface.normal, direction),
        }
    }

    /// The medium through which its subpath arrived.
    pub fn medium(&self) -> MediumId {
        match self {
            Vertex::Volume { medium, .. } | Vertex::Surface { medium, .. } => *medium,
        }
    }

    /// Unit direction in which its subpath arrived.
    pub fn arrival(&self) -> DVec3 {
        match self {
            Vertex::Volume { direction, .. } | Vertex::Surface { direction, .. } => *direction,
        }
    }

    /// The emitter on whose surface the vertex lies, the radiance that it emits against the arriving
    /// subpath, and the density per unit area with which aims choose this point of it.
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

    /// Itself as the end of a connection.
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

    /// The object on whose surface the vertex lies.
    pub fn object(&self) -> Option<usize> {
        match self {
            Vertex::Volume { .. } => None,
            Vertex::Surface { object, .. } => Some(*object),
        }
    }

    /// What is to be known of it for the choice of an emitter.
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

    /// Whether it is known to scatter no light, as the surfaces of emitters often are.
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

    /// Whether two directions leave on the same side of the vertex's surface.
    pub fn same_side(&self, a: DVec3, b: DVec3) -> bool {
        match self {
            Vertex::Volume { .. } => true,
            Vertex::Surface { surface, .. } => surface.normal.dot(a) * surface.normal.dot(b) > 0.0,
        }
    }

    /// The vertex as a path sees it that comes from `direction`, a unit vector away from the vertex.
    pub(crate) fn seen_from(mut self, from: DVec3) -> Self {
        match &mut self {
            Vertex::Volume { direction, .. } | Vertex::Surface { direction, .. } => {
                *direction = -from;
            }
        }
        self
    }

    /// What sampling must have happen for a path to end here, given a tube that arrives from
    /// `direction`: a collision, per unit length, or a survival, with the cosine on a surface and the
    /// probability of stopping there. For channel probabilities `channel_pdf`.
    pub fn event(
        &self,
        scene: &Scene,
        channel_pdf: Spectrum,
        direction: DVec3,
        geometry: &EdgeGeometry,
    ) -> f64 {
        match self {
            Vertex::Volume { x, medium, .. } => {
                let extinction = scene.medium(*medium).extinction(*x);
                (channel_pdf * extinction * geometry.depth.exp_neg()).sum()
            }
            Vertex::Surface { surface, .. } => {
                let cos = surface.normal.dot(direction).abs();
                cos * geometry.survival(channel_pdf) * self.stopping(scene)
            }
        }
    }

    /// Probability that light which arrives here stops to be scattered: less than 1 on a surface that lets
    /// part of it pass straight on. The same share is that of such light in the surface's scattering, so that the two
    /// cancel in what a path brings (docs/theory.md#masks-and-panes).
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

    /// Scattering between `direction` and where the subpath came from: the phase function, or f̃·|cos|. The `mode` is that of
    /// the vertex's subpath. The scattering coefficient of a volume vertex belongs to the edge's sampling.
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

    /// Density per steradian with which [`Vertex::scatter`] chooses `direction`.
    pub fn pdf(&self, scene: &Scene, direction: DVec3) -> f64 {
        match self {
            Vertex::Volume {
                x,
                direction: arrival,
                medium,
            } => {
                let phase = &scene.medium(*medium).phase;
                phase.pdf(*x, arrival.dot(direction))
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

    /// Chooses a direction in which light goes on that arrives at a point in a direction, and its density per steradian.
    #[inline]
    pub(crate) fn scatter_in_volume(
        phase: &Phase,
        [x, direction]: [DVec3; 2],
        sampler: &mut Sampler,
    ) -> (DVec3, f64) {
        let u = sampler.next_2d_for(Purpose::Direction);
        // As many numbers as on surfaces.
        sampler.next_1d_for(Purpose::Lobe);
        phase.sample(x, direction, u)
    }

    /// Chooses a direction in which a subpath of `mode` goes on; `None` if it is absorbed.
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

/// A point of an object's surface as the end of a path.
fn on(object: usize, surface: &Surface) -> OnSurface {
    OnSurface {
        object,
        normal: surface.normal,
        site: surface.site,
    }
}
