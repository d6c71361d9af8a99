//! Orthonormal frames.

use glam::DVec3;

/// Right-handed orthonormal frame: s × t = n.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// First tangent.
    pub s: DVec3,
    /// Second tangent.
    pub t: DVec3,
    /// Direction from which the frame was built.
    pub n: DVec3,
}

impl Frame {
    /// Creates a frame around a unit vector, without branches (Duff et al., "Building an
    /// Orthonormal Basis, Revisited", JCGT 6(1), 2017). The tangents jump where n.z changes sign.
    pub fn from_normal(n: DVec3) -> Self {
        let sign = 1f64.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Frame {
            s: DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: DVec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// Creates a frame around a unit vector. Its first tangent follows the component of `along`
    /// perpendicular to `n`. If this component is zero, returns [`Frame::from_normal`].
    pub fn along(n: DVec3, along: DVec3) -> Self {
        match along.reject_from_normalized(n).try_normalize() {
            Some(s) => Frame {
                s,
                t: n.cross(s),
                n,
            },
            None => Frame::from_normal(n),
        }
    }

    /// Converts world to local coordinates.
    pub fn to_local(&self, v: DVec3) -> DVec3 {
        DVec3::new(self.s.dot(v), self.t.dot(v), self.n.dot(v))
    }

    /// Converts local to world coordinates.
    pub fn to_world(&self, v: DVec3) -> DVec3 {
        v.x * self.s + v.y * self.t + v.z * self.n
    }
}
