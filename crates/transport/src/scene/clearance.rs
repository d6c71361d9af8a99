//! How far surfaces are at least: most flights in dense media end before they could meet one, and need not look for it
//! (docs/theory.md#free-flight).

use super::Object;
use crate::shape::Shape;
use crate::volume::spread;
use eikonal::Aabb;
use eikonal::ray::Arc;
use glam::DVec3;

/// Cells of the grid, about.
const CELLS: f64 = 262_144.0;
/// Balls without surfaces through which a way is followed,
const MOST_BALLS: usize = 6;
/// as long as their radius is not less than this many cells.
const LEAST: f64 = 0.5;
/// Fewer triangles than these are looked through as quickly.
const FEW: usize = 64;

/// A grid over a box that knows for each cell how many layers of cells around it hold no surface.
#[derive(Clone, Debug)]
pub(super) struct Clearance {
    low: DVec3,
    /// Side of the cubic cells.
    side: f64,
    size: [usize; 3],
    /// Layers without surfaces, the cell's own included; what lies beyond the grid counts as full of them.
    layers: Vec<u8>,
}

impl Clearance {
    /// Over a box; `None` if it is empty or infinite, or if the objects have so few triangles that it does not pay.
    pub(super) fn of(objects: &[Object], within: &Aabb) -> Option<Self> {
        let triangles = |object: &Object| match &object.shape {
            Shape::Mesh(mesh) => mesh.triangles().len(),
            _ => 0,
        };
        let extent = within.max - within.min;
        let side = (extent.element_product() / CELLS).cbrt();
        let many = objects.iter().map(triangles).sum::<usize>() >= FEW;
        if !(many && side.is_finite() && extent.min_element() > 0.0) {
            return None;
        }
        let size = (extent / side)
            .to_array()
            .map(|n| n.ceil().max(1.0) as usize);
        let mut clearance = Clearance {
            low: within.min,
            side,
            size,
            layers: vec![u8::MAX; size.iter().product()],
        };
        for object in objects {
            clearance.fill(object);
        }
        spread(size, &mut clearance.layers);
        Some(clearance)
    }

    /// Whether a straight arc is known to meet no surface up to θ = `end`: it goes from ball to ball without any, a few times.
    #[inline]
    pub(super) fn is_free(&self, arc: &Arc, end: f64) -> bool {
        let whole = arc.arc_length(1.0);
        let (mut theta, mut x) = (0.0, arc.start());
        for _ in 0..MOST_BALLS {
            let free = self.at(x);
            theta += free / whole;
            if theta > end {
                return true;
            }
            if free < LEAST * self.side {
                return false;
            }
            x = arc.position(theta);
        }
        false
    }

    /// A distance from a point within which there is no surface.
    #[inline]
    pub(super) fn at(&self, x: DVec3) -> f64 {
        let place = (x - self.low) / self.side;
        if place.min_element() < 0.0 {
            return 0.0;
        }
        let [i, j, k] = place.to_array().map(|p| p as usize);
        let [nx, ny, nz] = self.size;
        if i >= nx || j >= ny || k >= nz {
            return 0.0;
        }
        match self.layers[i + nx * (j + ny * k)] {
            0 => 0.0,
            layers => {
                let within = place - DVec3::new(i as f64, j as f64, k as f64);
                let nearest = within.min(1.0 - within).min_element();
                // Less by what rounding may do.
                (f64::from(layers - 1) + nearest) * self.side * (1.0 - 1e-9)
            }
        }
    }

    /// Marks cells that an object's surface may pass through.
    fn fill(&mut self, object: &Object) {
        match &object.shape {
            Shape::Mesh(mesh) => {
                for triangle in mesh.triangles() {
                    let corners = triangle.map(|i| mesh.positions()[i as usize]);
                    self.mark(&Aabb::around(corners));
                }
            }
            shape => self.mark(&shape.aabb()),
        }
    }

    fn mark(&mut self, filled: &Aabb) {
        // A hair wider, for surfaces between cells.
        let cell = |x: DVec3, hair: f64| ((x - self.low) / self.side + hair).to_array();
        let (first, last) = (cell(filled.min, -1e-6), cell(filled.max, 1e-6));
        let range = |axis: usize| {
            let end = (last[axis].floor() + 1.0).clamp(0.0, self.size[axis] as f64) as usize;
            (first[axis].floor().max(0.0) as usize).min(end)..end
        };
        let [nx, ny, _] = self.size;
        for k in range(2) {
            for j in range(1) {
                let row = nx * (j + ny * k);
                for i in range(0) {
                    self.layers[row + i] = 0;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::Bsdf;
    use crate::shape::{Mesh, Sphere};

    /// A lattice of small triangles, and a sphere.
    fn objects() -> Vec<Object> {
        let mut positions = Vec::new();
        let mut triangles = Vec::new();
        for i in 0..100u32 {
            let corner = DVec3::new(f64::from(i % 10), f64::from(i / 10), f64::from(i * i % 7));
            positions.extend([
                corner,
                corner + DVec3::X * 0.3,
                corner + DVec3::new(0.1, 0.2, 0.3),
            ]);
            triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        let mesh = Mesh::new(positions, triangles, None).unwrap();
        let sphere = Sphere::around(DVec3::new(8.0, 2.0, 9.0), 0.7).unwrap();
        let object = |shape: Shape| Object {
            name: String::new(),
            shape,
            bsdf: Bsdf::Null,
            sides: None,
            emitter: None,
        };
        vec![object(mesh.into()), object(sphere.into())]
    }

    #[test]
    fn no_surface_is_nearer_than_it_says() {
        let objects = objects();
        let within = Aabb::new(DVec3::splat(-0.5), DVec3::new(10.3, 11.0, 10.1));
        let clearance = Clearance::of(&objects, &within).unwrap();
        let Shape::Mesh(mesh) = &objects[0].shape else {
            unreachable!()
        };
        let mut state = 1u64;
        let mut next = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut shares = 0.0;
        for _ in 0..4000 {
            let x = DVec3::new(next(), next(), next()) * 12.0 - 1.0;
            let free = clearance.at(x);
            // To points of the surfaces, many on each, and to what is beyond the grid.
            let mut nearest = f64::INFINITY;
            for triangle in mesh.triangles() {
                let [a, b, c] = triangle.map(|i| mesh.positions()[i as usize]);
                for (u, v) in [
                    (0.0, 0.0),
                    (1.0, 0.0),
                    (0.0, 1.0),
                    (0.5, 0.0),
                    (0.0, 0.5),
                    (0.5, 0.5),
                    (0.3, 0.3),
                ] {
                    nearest = nearest.min(x.distance(a + (b - a) * u + (c - a) * v));
                }
            }
            nearest = nearest.min((x.distance(DVec3::new(8.0, 2.0, 9.0)) - 0.7).abs());
            assert!(free <= nearest, "{x}: {free} {nearest}");
            shares += free / nearest.min(2.0) / 4000.0;
        }
        assert!(shares > 0.3, "it knows too little: {shares}");
    }

    #[test]
    fn few_triangles_are_not_worth_it() {
        let within = Aabb::new(DVec3::ZERO, DVec3::ONE);
        assert!(Clearance::of(&objects()[1..], &within).is_none());
        let infinite = Aabb::new(DVec3::ZERO, DVec3::splat(f64::INFINITY));
        assert!(Clearance::of(&objects(), &infinite).is_none());
    }
}
