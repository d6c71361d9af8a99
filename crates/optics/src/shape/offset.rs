//! Surfaces displaced along their normals by a distance small compared with their size.

use super::{Shape, each};
use glam::{DAffine3, DVec3};

impl Shape {
    /// Returns the surface displaced by `distance` along its normals. A flat surface is shifted, a
    /// closed one grows or shrinks. If the displacement leaves nothing of the surface, the surface
    /// stays unchanged.
    pub fn moved_along_normals(&self, distance: f64) -> Shape {
        let flipped = self.has_flipped_normals();
        let outward = if flipped { -distance } else { distance };
        let moved = each!(self, s => s.moved_along_normals(outward).map(Shape::from), {
            Shape::Mesh(mesh) => mesh.moved_along_normals(outward).map(Shape::from),
            // Faces of voxels separate media, so they stay in place.
            Shape::VoxelFaces(_) => return self.clone(),
        });
        moved.map_or_else(|_| self.clone(), |s| s.with_flipped_normals(flipped))
    }
}

impl super::placement::Placement {
    /// Returns the map with the plane z = 0 shifted by `distance` along its normal.
    pub(super) fn shifted(&self, distance: f64) -> DAffine3 {
        let mut map = *self.map();
        map.translation += self.upright_normal() * distance;
        map
    }

    /// Returns the map with the shape scaled about a local `center`, so that its ends along the
    /// local axes move outwards by about `distance`.
    pub(super) fn grown(&self, distance: f64, center: DVec3) -> DAffine3 {
        let m = self.map().matrix3;
        let half = DVec3::ONE - center;
        let lengths = DVec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length());
        let scale = DVec3::ONE + distance / (lengths * half);
        let about = DAffine3::from_translation(center)
            * DAffine3::from_scale(scale)
            * DAffine3::from_translation(-center);
        *self.map() * about
    }
}
