//! Maps of rays and their tangents at surfaces (docs/theory.md#interfaces).

use crate::ray::{Tangents, Variation};
use glam::{DMat3, DVec3};

/// Event at an interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// Snell refraction.
    Refract,
    /// Mirror reflection.
    Reflect,
    /// Index-matched by declaration: the direction stays, whatever the indices are.
    Pass,
}

/// A point of a surface, with the field on either side of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interface {
    /// Unit normal; its sign is immaterial.
    pub normal: DVec3,
    /// Shape operator S: δN = S·δx for displacements δx along the surface.
    pub shape: DMat3,
    /// n² and ½∇n² on the side from which the ray comes.
    pub near: (f64, DVec3),
    /// n² and ½∇n² on the far side.
    pub far: (f64, DVec3),
}

/// Displacement of a surface when its parameters change.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Displacement {
    /// Displacement along the normal.
    pub offset: f64,
    /// Change of the normal at a fixed position.
    pub turn: DVec3,
}

impl Interface {
    /// Returns the velocity after the interface, with |v| = n on the side where the ray continues;
    /// `None` for total internal reflection.
    pub fn velocity(&self, rule: Rule, v: DVec3) -> Option<DVec3> {
        let normal = self.along(v);
        let c = normal.dot(v);
        match rule {
            Rule::Reflect => Some(v - normal * (2.0 * c)),
            Rule::Refract => {
                let far = self.far.0 - self.near.0 + c * c;
                (far > 0.0).then(|| v + normal * (far.sqrt() - c))
            }
            Rule::Pass => Some(v * (self.far.0 / self.near.0).sqrt()),
        }
    }

    /// Returns the tangents after the interface, for the given rule and the incoming velocity `v`;
    /// `None` for total internal reflection.
    ///
    /// Perturbed rays reach the surface earlier or later by δσ*. The map moves columns onto the
    /// surface, through it, and back to equal σ. The maps of refraction and reflection are
    /// symplectic.
    pub fn tangents(&self, rule: Rule, v: DVec3, tangents: &Tangents) -> Option<Tangents> {
        let after = self.velocity(rule, v)?;
        let mut out = *tangents;
        for k in 0..2 {
            let at_rest = Displacement::default();
            let [dx, dv] = [tangents.dx[k], tangents.dv[k]];
            (out.dx[k], out.dv[k]) = self.column(rule, [v, after], dx, dv, at_rest);
        }
        Some(out)
    }

    /// Returns the contribution of a surface's displacement to the tangents (δx, δv) after the
    /// surface, at equal σ, given the velocities before and after it.
    pub(crate) fn displaced(
        &self,
        rule: Rule,
        velocities: [DVec3; 2],
        moved: Displacement,
    ) -> (DVec3, DVec3) {
        self.column(rule, velocities, DVec3::ZERO, DVec3::ZERO, moved)
    }

    fn column(
        &self,
        rule: Rule,
        [v, after]: [DVec3; 2],
        dx: DVec3,
        dv: DVec3,
        moved: Displacement,
    ) -> (DVec3, DVec3) {
        let normal = self.along(v);
        let side = if normal == self.normal { 1.0 } else { -1.0 };
        let c = normal.dot(v);
        let ((near, a), (far, a_far)) = (self.near, self.far);
        // Planted error "moved surfaces met when they were met before", found by morgana-eikonal/eikonal::adjoint::surfaces::focus_of_a_ball_lens:
        // let delay = -normal.dot(dx) / c;
        let delay = (side * moved.offset - normal.dot(dx)) / c;
        let dx_hit = dx + v * delay;
        let dv_hit = dv + a * delay;
        let d_normal = (self.shape * dx_hit + moved.turn) * side;
        let dc = normal.dot(dv_hit) + v.dot(d_normal);
        let (dv_after, a_after) = match rule {
            Rule::Reflect => (dv_hit - normal * (2.0 * dc) - d_normal * (2.0 * c), a),
            Rule::Refract => {
                let c_far = normal.dot(after);
                let dc_far = ((a_far - a).dot(dx_hit) + c * dc) / c_far;
                let bend = normal * (dc_far - dc) + d_normal * (c_far - c);
                (dv_hit + bend, a_far)
            }
            Rule::Pass => {
                let ratio = (far / near).sqrt();
                let d_ratio = ratio * (a_far.dot(dx_hit) / far - a.dot(dx_hit) / near);
                (dv_hit * ratio + v * d_ratio, a_far)
            }
        };
        (dx_hit - after * delay, dv_after - a_after * delay)
    }

    /// Returns the normal turned to point along `v`.
    fn along(&self, v: DVec3) -> DVec3 {
        if self.normal.dot(v) < 0.0 {
            -self.normal
        } else {
            self.normal
        }
    }
}

/// A quantity that rays carry along and that interfaces change.
pub trait Mapped: Variation {
    /// Returns the variation after an interface, for the rule and the incoming velocity `v`; `None`
    /// where the rule cannot apply.
    fn mapped(&self, interface: &Interface, rule: Rule, v: DVec3) -> Option<Self>;
}

impl Mapped for () {
    fn mapped(&self, _: &Interface, _: Rule, _: DVec3) -> Option<()> {
        Some(())
    }
}

impl Mapped for Tangents {
    fn mapped(&self, interface: &Interface, rule: Rule, v: DVec3) -> Option<Tangents> {
        interface.tangents(rule, v, self)
    }
}
