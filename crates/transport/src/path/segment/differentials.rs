//! Ray differentials: spread of the rays of a family around the ray that is followed.

use super::edge::{Front, Start};
use super::edge_geometry;
use crate::scene::Scene;
use eikonal::connect::World;
use eikonal::ray::{Tangents, Variation, perpendicular_basis};
use glam::DVec3;

/// Differentials of a ray: in closed form until something bends the neighbours, then by tangents.
#[derive(Clone, Copy, Debug)]
pub(in crate::path) enum RayDifferentials {
    /// Straight rays of a family since their start, over a span of σ where the index is `n`.
    Straight {
        front: Front,
        direction: DVec3,
        n: f64,
        sigma: f64,
    },
    /// Rays that were bent along the edge.
    Bent(Tangents),
    /// Differentials that are not followed: see
    /// [`Sampling::differentials`](crate::path::walk::Sampling::differentials).
    Ignored,
}

impl From<()> for RayDifferentials {
    fn from((): ()) -> Self {
        RayDifferentials::Ignored
    }
}

impl From<Tangents> for RayDifferentials {
    fn from(tangents: Tangents) -> Self {
        RayDifferentials::Bent(tangents)
    }
}

impl RayDifferentials {
    /// Returns the differentials at the start of an edge, where the index is `n`.
    pub(crate) fn new(scene: &Scene, start: &Start, n: f64) -> Self {
        let field = scene.field(start.medium);
        let Start {
            front, direction, ..
        } = *start;
        if field.is_constant() {
            return RayDifferentials::Straight {
                front,
                direction,
                n,
                sigma: 0.0,
            };
        }
        let gradient = match front {
            Front::Point => DVec3::ZERO,
            Front::Plane => field.gradient(start.x).1,
        };
        RayDifferentials::Bent(initial_tangents(front, direction, n, gradient))
    }

    /// Returns the differentials further along the ray, by a span `h` of σ at constant index.
    #[inline]
    pub(crate) fn drifted(mut self, h: f64) -> Self {
        match &mut self {
            RayDifferentials::Straight { sigma, .. } => *sigma += h,
            RayDifferentials::Bent(tangents) => tangents.drift(h),
            RayDifferentials::Ignored => {}
        }
        self
    }

    /// Returns the tangents as columns for unit changes of the direction, or of the position, at
    /// the start. Returns `None` if differentials are ignored.
    pub(crate) fn tangents(&self) -> Option<Tangents> {
        Some(match *self {
            RayDifferentials::Straight {
                front,
                direction,
                n,
                sigma,
            } => {
                let mut tangents = initial_tangents(front, direction, n, DVec3::ZERO);
                tangents.drift(sigma);
                tangents
            }
            RayDifferentials::Bent(tangents) => tangents,
            RayDifferentials::Ignored => return None,
        })
    }

    /// Returns G for a ray that arrives at a point with velocity `v`: see
    /// [`edge_geometry::to_point`]. Returns 0 if differentials are ignored.
    pub(crate) fn at_point(&self, v: DVec3, jump: f64) -> f64 {
        let section = match self {
            RayDifferentials::Straight {
                front: Front::Point,
                n,
                sigma,
                ..
            } => (n * sigma) * (n * sigma),
            RayDifferentials::Straight { .. } => 1.0,
            RayDifferentials::Bent(tangents) => tangents.cross_section(v),
            RayDifferentials::Ignored => return 0.0,
        };
        edge_geometry::to_point(section, v, jump)
    }

    /// Returns G for a ray that arrives with velocity `v` at a plane across the ray: see
    /// [`edge_geometry::to_plane`]. Returns 0 if differentials are ignored.
    pub(crate) fn at_plane(&self, v: DVec3, jump: f64) -> f64 {
        let spread = match self {
            RayDifferentials::Straight {
                front: Front::Point,
                n,
                ..
            } => n * n,
            RayDifferentials::Straight { .. } => 0.0,
            RayDifferentials::Bent(tangents) => {
                tangents.dv[0].cross(tangents.dv[1]).dot(v.normalize())
            }
            RayDifferentials::Ignored => return 0.0,
        };
        edge_geometry::to_plane(spread, jump)
    }
}

/// Returns the tangents at the start of a ray, where the index is `n`. The `gradient` of n² matters
/// only for planes.
fn initial_tangents(front: Front, direction: DVec3, n: f64, gradient: DVec3) -> Tangents {
    let basis = perpendicular_basis(direction);
    match front {
        Front::Point => Tangents::angular(n, basis),
        Front::Plane => Tangents::lateral(n, gradient, direction, basis),
    }
}
