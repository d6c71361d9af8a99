//! Geometry and refractive indices at a surface point.

#[cfg(doc)]
use super::Bsdf;
use crate::sampling::Frame;
use crate::shape::{Site, Uv};
use glam::DVec3;

/// Surface point with the data that a BSDF needs.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Geometric unit normal, on the shape's outward side.
    pub normal: DVec3,
    /// Unit normal for scattering, on the side of `normal`. It is interpolated on a mesh with
    /// vertex normals, and equal to `normal` elsewhere.
    pub shading_normal: DVec3,
    /// Derivatives of the position with respect to texture coordinates, in scene units; zero unless
    /// [`Bsdf::uses_tangents`].
    pub tangents: [DVec3; 2],
    /// True if the normals have been reversed by [`Bsdf::TwoSided`], so that they point to the
    /// inward side of the shape.
    pub is_back: bool,
    /// Refractive index at the point, on the side of the normal; > 0.
    pub n_outer: f64,
    /// Refractive index at the point, on the other side; > 0.
    pub n_inner: f64,
    /// Surface point with the data that textures need.
    pub site: Site,
}

impl Surface {
    /// Creates a point of a surface without textures.
    pub const fn plain(normal: DVec3, n_outer: f64, n_inner: f64) -> Self {
        Surface {
            normal,
            shading_normal: normal,
            tangents: [DVec3::ZERO; 2],
            is_back: false,
            n_outer,
            n_inner,
            site: Site {
                position: DVec3::ZERO,
                uv: Uv::Plain([0.0; 2]),
                primitive: 0,
            },
        }
    }

    /// Returns the point with reversed normals.
    pub(super) fn turned(&self) -> Self {
        Surface {
            normal: -self.normal,
            shading_normal: -self.shading_normal,
            is_back: !self.is_back,
            n_outer: self.n_inner,
            n_inner: self.n_outer,
            ..*self
        }
    }

    /// Returns the frame whose first vector follows the first tangent, and whose third is the
    /// normal. On the back it is the mirror image of the frame in front, as in Mitsuba.
    pub(super) fn frame(&self) -> Frame {
        let frame = Frame::along(self.normal, self.tangents[0]);
        if self.is_back && self.tangents[0] != DVec3::ZERO {
            Frame {
                t: -frame.t,
                ..frame
            }
        } else {
            frame
        }
    }

    /// Returns the surface seen from the side of `toward`.
    pub(super) fn facing(&self, toward: DVec3) -> Facing {
        if self.normal.dot(toward) >= 0.0 {
            Facing {
                normal: self.normal,
                tangent: self.tangents[0],
                n_near: self.n_outer,
                n_far: self.n_inner,
            }
        } else {
            Facing {
                normal: -self.normal,
                tangent: self.tangents[0],
                n_near: self.n_inner,
                n_far: self.n_outer,
            }
        }
    }
}

/// Surface seen from one side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facing {
    /// Unit normal on the near side.
    pub normal: DVec3,
    /// First tangent.
    pub tangent: DVec3,
    /// Index on the near side.
    pub n_near: f64,
    /// Index on the far side.
    pub n_far: f64,
}

impl Facing {
    /// Returns the frame whose first vector follows the first tangent, and whose third is the
    /// normal of the near side.
    pub(super) fn frame(&self) -> Frame {
        Frame::along(self.normal, self.tangent)
    }
}

/// Returns the mirror image of `v` about the unit vector `axis`, with `cos` = v·axis.
pub(super) fn reflect(v: DVec3, axis: DVec3, cos: f64) -> DVec3 {
    2.0 * cos * axis - v
}

/// Returns the direction on the far side that Snell's law pairs with `v` on the near side. `cos` =
/// v·axis > 0, `cos_far` is the cosine on the far side, and `eta` = n_near/n_far.
pub(super) fn refract(v: DVec3, axis: DVec3, cos: f64, cos_far: f64, eta: f64) -> DVec3 {
    (eta * cos - cos_far) * axis - eta * v
}

/// Returns `toward`, `direction` and their half vector in the frame of the surface, if both
/// directions are above it.
pub(super) fn above(s: &Surface, toward: DVec3, direction: DVec3) -> Option<[DVec3; 3]> {
    let frame = s.frame();
    let (o, i) = (frame.to_local(toward), frame.to_local(direction));
    let above = o.z > 0.0 && i.z > 0.0;
    let half = above.then(|| (o + i).try_normalize()).flatten()?;
    Some([o, i, half])
}
