//! Regions of constant index with planes and balls between them.

use glam::{DMat3, DVec3};
use morgana_eikonal::Field;
use morgana_eikonal::connect::{Crossing, World};
use morgana_eikonal::field::Constant;
use morgana_eikonal::interface::Rule;
use morgana_eikonal::ray::Arc;
use morgana_eikonal::ray::bernstein::{first_root, height, product};

/// A surface between two regions.
#[derive(Clone, Copy)]
pub enum Surface {
    /// The plane z = height, between the regions below and above it.
    Plane(f64),
    /// A ball of this radius around the origin, between the regions inside and outside.
    Ball(f64),
}

/// Regions with fields, and refracting surfaces between them. Each surface lists its region below
/// (or inside) before its region above (or outside).
pub struct Glass {
    pub fields: Vec<Field>,
    pub surfaces: Vec<(Surface, [usize; 2])>,
}

impl Glass {
    /// Creates a slab: region 1 of index `n` between z = 0 and `thickness`, with index 1 below
    /// (region 0) and above (region 2).
    pub fn slab(n: f64, thickness: f64) -> Self {
        Glass {
            fields: [1.0, n, 1.0].map(|n| Constant::new(n).into()).to_vec(),
            surfaces: vec![
                (Surface::Plane(0.0), [0, 1]),
                (Surface::Plane(thickness), [1, 2]),
            ],
        }
    }

    /// Creates a ball: region 0 of index `n` in the unit ball, inside region 1 of index 1.
    pub fn ball(n: f64) -> Self {
        Glass {
            fields: [n, 1.0].map(|n| Constant::new(n).into()).to_vec(),
            surfaces: vec![(Surface::Ball(1.0), [0, 1])],
        }
    }
}

impl Surface {
    fn at(self, x: DVec3) -> (DVec3, DMat3) {
        match self {
            Surface::Plane(_) => (DVec3::Z, DMat3::ZERO),
            Surface::Ball(radius) => {
                let n = x / radius;
                let along = DMat3::from_cols(n * n.x, n * n.y, n * n.z);
                (n, (DMat3::IDENTITY - along) * (1.0 / radius))
            }
        }
    }

    fn first(self, arc: &Arc) -> Option<f64> {
        let control = &arc.control();
        match self {
            Surface::Plane(z) => {
                first_root(&height(control, DVec3::Z * z, DVec3::Z), 0.0, 1.0, [0.0; 2])
            }
            Surface::Ball(radius) => {
                let squares = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| {
                    let c = height(control, DVec3::ZERO, axis);
                    product::<6, 6, 11>(&c, &c)
                });
                let [x, y, z] = squares;
                let f = std::array::from_fn::<f64, 11, _>(|i| x[i] + y[i] + z[i] - radius * radius);
                first_root(&f, 0.0, 1.0, [0.0; 2])
            }
        }
    }
}

impl World for Glass {
    type Region = usize;

    fn field(&self, region: usize) -> &Field {
        &self.fields[region]
    }

    fn crossing(&self, region: usize, arc: &Arc) -> Option<Crossing<usize>> {
        let beside = |(_, sides): &&(Surface, [usize; 2])| sides.contains(&region);
        let hits = self
            .surfaces
            .iter()
            .filter(beside)
            .filter_map(|&(surface, sides)| Some((surface.first(arc)?, surface, sides)));
        let (theta, surface, sides) = hits.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let position = arc.position(theta);
        let (normal, shape) = surface.at(position);
        Some(Crossing {
            theta,
            position,
            normal,
            shape,
            rule: Rule::Refract,
            beyond: sides[usize::from(sides[0] == region)],
            surface: 0,
        })
    }

    fn ray_epsilon(&self) -> f64 {
        1e-12
    }
}
