//! How the rays of a family spread around the one that is followed.

use super::edge::{Front, Start};
use super::edge_geometry;
use crate::scene::Scene;
use eikonal::connect::World;
use eikonal::ray::{Tangents, Variation, perpendicular_basis};
use glam::DVec3;

/// The neighbours of a ray: in closed form until something bends them, then by tangents; or nothing where nobody asks for them.
#[derive(Clone, Copy, Debug)]
pub(in crate::path) enum RayDifferentials {
    /// Straight rays of a family since their start, over a span of σ where the index is `n`.
    Straight {
        front: Front,
        direction: DVec3,
        n: f64,
        sigma: f64,
    },
    /// Bent on the way.
    Bent(Tangents),
    /// Not followed: see [`Sampling::differentials`](crate::path::walk::Sampling::differentials).
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
    /// At the start of an edge, where the index is `n`.
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

    /// Further along the ray by a span of σ where the index is constant.
    #[inline]
    pub(crate) fn drifted(mut self, h: f64) -> Self {
        match &mut self {
            RayDifferentials::Straight { sigma, .. } => *sigma += h,
            RayDifferentials::Bent(tangents) => tangents.drift(h),
            RayDifferentials::Ignored => {}
        }
        self
    }

    /// The tangents, columns of unit changes of the direction, or of the place, at the start; `None` if they are ignored.
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

    /// G where the ray arrives at a point with velocity `v`: see [`edge_geometry::to_point`]. 0 if neighbours are ignored.
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

    /// G where the ray arrives at a plane across it with velocity `v`: see [`edge_geometry::to_plane`]. 0 if neighbours are
    /// ignored.
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

/// Tangents at the start of a ray where the index is `n`, with the gradient of n², which planes ask for.
fn initial_tangents(front: Front, direction: DVec3, n: f64, gradient: DVec3) -> Tangents {
    let basis = perpendicular_basis(direction);
    match front {
        Front::Point => Tangents::angular(n, basis),
        Front::Plane => Tangents::lateral(n, gradient, direction, basis),
    }
}
