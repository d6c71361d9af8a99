//! Rays that start on surfaces, and the surfaces that BSDFs receive.

use crate::bsdf::Surface;
use crate::connection_end::OnSurface;
use crate::scene::{MediumId, Scene};
use crate::shape::Hit;
use eikonal::connect::World;
use glam::DVec3;

/// Returns the point from which a ray leaves a surface, on the side to which the ray goes. The
/// point lies off the surface by the ray epsilon, which is less than any tolerance.
pub(in crate::path) fn leave(scene: &Scene, x: DVec3, normal: DVec3, direction: DVec3) -> DVec3 {
    x + normal * scene.ray_epsilon().copysign(normal.dot(direction))
}

/// Returns the surface as BSDFs need it, with the local index of the media on either side. `medium`
/// is the medium through which a ray arrives.
pub(crate) fn surface_at(scene: &Scene, object: usize, hit: &Hit, medium: MediumId) -> Surface {
    let site = scene.objects()[object].shape.site(hit);
    let on = OnSurface {
        object,
        normal: hit.normal,
        site,
    };
    surface_of(scene, hit.position, &on, medium)
}

/// Returns the surface at a point, given the medium on one of its sides.
pub(super) fn surface_of(scene: &Scene, x: DVec3, on: &OnSurface, medium: MediumId) -> Surface {
    let beside = |direction| {
        let medium = scene.medium_beside(on.object, medium, x, on.normal, direction);
        scene.n(medium, x)
    };
    let object = &scene.objects()[on.object];
    Surface {
        normal: on.normal,
        shading_normal: object.shape.shading_normal(&on.site, on.normal),
        tangents: if object.bsdf.uses_tangents() {
            object.shape.tangents(&on.site)
        } else {
            [DVec3::ZERO; 2]
        },
        is_back: false,
        n_outer: beside(on.normal),
        n_inner: beside(-on.normal),
        site: on.site,
    }
}
