//! A field in a box, in surroundings of constant index.

use super::receiver::{entering, leaving};
use crate::bounds::Aabb;
use crate::connect::{Crossing, World};
use crate::field::{Constant, Field};
use crate::interface::Rule;
use crate::ray::Arc;
use glam::DMat3;

/// Distance from the faces at which rays start, in units of the box's diagonal.
const RAY_EPSILON: f64 = 1e-12;

/// A field in a box, surrounded by a constant index. The faces are index-matched by declaration:
/// rays keep their direction there.
#[derive(Clone, Debug)]
pub struct Embedded<'a> {
    field: &'a Field,
    region: Aabb,
    surroundings: Field,
}

impl<'a> Embedded<'a> {
    /// Creates `field` in the box `region`, with the index `ambient` > 0 around it.
    pub fn new(field: &'a Field, region: Aabb, ambient: f64) -> Self {
        Embedded {
            field,
            region,
            surroundings: Constant::new(ambient).into(),
        }
    }
}

impl Embedded<'_> {
    /// Returns the field in the box.
    pub(super) fn inside(&self) -> &Field {
        self.field
    }
}

impl World for Embedded<'_> {
    /// True for the inside.
    type Region = bool;

    fn field(&self, inside: bool) -> &Field {
        if inside {
            self.field
        } else {
            &self.surroundings
        }
    }

    fn crossing(&self, inside: bool, arc: &Arc) -> Option<Crossing<bool>> {
        let met = if inside {
            leaving(arc, &self.region)
        } else {
            entering(arc, &self.region)
        }?;
        Some(Crossing {
            theta: met.theta,
            position: met.position,
            normal: met.normal,
            shape: DMat3::ZERO,
            rule: Rule::Pass,
            beyond: !inside,
            surface: 0,
        })
    }

    fn ray_epsilon(&self) -> f64 {
        RAY_EPSILON * self.region.diagonal()
    }
}
