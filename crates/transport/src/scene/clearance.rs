//! Lower bounds of the distance to surfaces. Most flights in dense media end before they could meet
//! a surface, and need no search for one (docs/theory.md#free-flight).

use super::Object;
use super::parts::Parts;
use crate::shape::Shape;
use crate::volume::{Leaps, cell_of, number_of, spread};
use eikonal::Aabb;
use glam::DVec3;

/// Approximate number of cells of the grid.
const CELLS: f64 = 2_097_152.0;
/// Largest number of cubes of empty cells through which a line is followed.
const MAX_STEPS: usize = 8;
/// Value of the layers around a cell through which a surface may pass.
const FULL: u8 = u8::MAX;
/// Number of triangles below which a search is as fast as the grid.
const MIN_GRID_TRIANGLES: usize = 64;

/// Bounds of the distance to surfaces that are not faces between voxels.
#[derive(Clone, Debug)]
pub(super) enum Clearance {
    /// No bounds; a search for surfaces is as fast.
    Unknown,
    /// Proof that there are no surfaces.
    Everywhere,
    /// Bounds from a grid.
    Layers(ClearLayers),
}

/// A grid over a box. It stores for each cell the number of layers of cells around it that hold no
/// surface.
#[derive(Clone, Debug)]
pub(super) struct ClearLayers {
    low: DVec3,
    /// Side length of the cubic cells.
    side: f64,
    size: [usize; 3],
    /// Number of layers without surfaces around each cell, or [`FULL`]. Beyond the grid, surfaces
    /// may be anywhere.
    layers: Vec<u8>,
}

impl Clearance {
    /// Makes the bounds over a box in which they save time.
    pub(super) fn of(parts: &Parts, within: &Aabb) -> Self {
        let voxels = || parts.partitions.iter().filter(|p| p.voxels().is_some());
        let is_face = |i: usize| voxels().any(|p| p.objects.contains(&i));
        let others = parts.objects.iter().enumerate();
        let others: Vec<&Object> = others
            .filter_map(|(i, o)| (!is_face(i)).then_some(o))
            .collect();
        if others.is_empty() {
            return Clearance::Everywhere;
        }
        let triangles = |object: &&Object| match &object.shape {
            Shape::Mesh(mesh) => mesh.triangles().len(),
            _ => 0,
        };
        let many = others.iter().map(triangles).sum::<usize>() >= MIN_GRID_TRIANGLES;
        let pays = many || voxels().next().is_some();
        let layers = pays.then(|| ClearLayers::of(&others, within)).flatten();
        layers.map_or(Clearance::Unknown, Clearance::Layers)
    }

    /// Returns true if a straight line from `x` in a unit direction is known to meet no surface
    /// over a length.
    #[inline]
    pub(super) fn is_free(&self, x: DVec3, direction: DVec3, length: f64) -> bool {
        match self {
            Clearance::Unknown => false,
            Clearance::Everywhere => true,
            Clearance::Layers(layers) => layers.is_free(x, direction, length),
        }
    }

    /// Returns true if all points within a distance of `x` are known to be off all surfaces.
    #[inline]
    pub(super) fn is_free_around(&self, x: DVec3, distance: f64) -> bool {
        match self {
            Clearance::Unknown => false,
            Clearance::Everywhere => true,
            Clearance::Layers(layers) => layers.is_free_around(x, distance),
        }
    }
}

/// Returns the side of cells for which a box of an extent holds about [`CELLS`] cells, if the side
/// is finite. Along an axis where the box is thinner than a cell, it has one cell.
fn side(extent: DVec3) -> Option<f64> {
    let mut axes = extent.to_array();
    axes.sort_unstable_by(|a, b| b.total_cmp(a));
    // Take roots first: products of extents may overflow or underflow.
    let of_axes = |count: usize| {
        let root = |x: f64| x.powf(1.0 / count as f64);
        axes[..count].iter().copied().map(root).product::<f64>() / root(CELLS)
    };
    let thick = [3, 2]
        .into_iter()
        .find(|count| of_axes(*count) <= axes[count - 1]);
    Some(of_axes(thick.unwrap_or(1))).filter(|side| side.is_normal() && extent.is_finite())
}

impl ClearLayers {
    /// Makes the grid over a box; `None` if the box is empty or infinite.
    fn of(objects: &[&Object], within: &Aabb) -> Option<Self> {
        let extent = within.max - within.min;
        let side = side(extent).filter(|_| extent.min_element() > 0.0)?;
        let size = (extent / side)
            .to_array()
            .map(|n| n.ceil().max(1.0) as usize);
        let mut clearance = ClearLayers {
            low: within.min,
            side,
            size,
            layers: vec![u8::MAX; size.iter().product()],
        };
        for object in objects {
            clearance.fill(object);
        }
        spread(size, &mut clearance.layers);
        for layers in &mut clearance.layers {
            *layers = layers.checked_sub(1).unwrap_or(FULL);
        }
        Some(clearance)
    }

    /// Moves from cube to cube of empty cells, a few times.
    #[inline]
    fn is_free(&self, x: DVec3, direction: DVec3, length: f64) -> bool {
        let line = [(x - self.low) / self.side, direction / self.side];
        let mut line = Leaps::new(self.size.map(|n| n as f64).into(), &self.layers, line);
        for _ in 0..MAX_STEPS {
            match line.cell() {
                Some(cell) if self.layers[cell] != FULL => {
                    if line.stays(cell, length) {
                        return true;
                    }
                    line.leap(cell);
                }
                _ => return false,
            }
        }
        false
    }

    /// Returns true if all points within a distance of `x` are in empty cells.
    #[inline]
    fn is_free_around(&self, x: DVec3, distance: f64) -> bool {
        let cell = number_of(
            cell_of((x - self.low) / self.side),
            self.size.map(|n| n as f64).into(),
        );
        // Layers beyond the cell's own are whole.
        cell.is_some_and(|cell| {
            let layers = self.layers[cell];
            layers != FULL && distance <= f64::from(layers) * self.side
        })
    }

    /// Marks cells that an object's surface may pass through.
    fn fill(&mut self, object: &Object) {
        object
            .shape
            .each_patch(|points| self.mark(&Aabb::around(points.iter().copied())));
    }

    fn mark(&mut self, filled: &Aabb) {
        // Extend the box slightly, for surfaces between cells.
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

    /// Makes a lattice of small triangles, and a sphere.
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

    /// Thin boxes have about as many cells as others. Flat and infinite boxes have none.
    #[test]
    fn cells_are_as_many_in_every_box() {
        let objects = objects();
        let objects: Vec<&Object> = objects.iter().collect();
        let layers = |extent: DVec3| ClearLayers::of(&objects, &Aabb::new(DVec3::ZERO, extent));
        for extent in [
            DVec3::new(3.0, 4.0, 5.0),
            DVec3::new(1e3, 1e3, 1e-9),
            DVec3::new(1e-12, 7.0, 1e-9),
            DVec3::new(1e-3, 1e8, 2.0),
            DVec3::new(1e60, 1e90, 1e80),
            DVec3::splat(1e160),
            DVec3::splat(1e-200),
        ] {
            let cells = layers(extent).unwrap().layers.len() as f64;
            assert!(
                (0.9 * CELLS..8.0 * CELLS).contains(&cells),
                "{extent}: {cells}"
            );
        }
        for extent in [
            DVec3::new(1.0, 1.0, 0.0),
            DVec3::new(1.0, 1.0, f64::INFINITY),
            DVec3::splat(1e-306),
            DVec3::new(1.0, 1.0, -f64::NAN),
            DVec3::NAN,
        ] {
            assert!(layers(extent).is_none(), "{extent}");
        }
    }

    #[test]
    fn free_lines_and_balls_meet_no_surface() {
        let objects = objects();
        let within = Aabb::new(DVec3::splat(-0.5), DVec3::new(10.3, 11.0, 10.1));
        let objects: Vec<&Object> = objects.iter().collect();
        let clearance = ClearLayers::of(&objects, &within).unwrap();
        let mut rng = testkit::Rng::new(1);
        let mut next = || rng.next_1d();
        let (mut found, mut balls) = (0, 0);
        for _ in 0..4000 {
            let x = DVec3::new(next(), next(), next()) * 12.0 - 1.0;
            let direction = (DVec3::new(next(), next(), next()) - 0.5).normalize();
            let length = 3.0 * next();
            let meets_any = |direction: DVec3| {
                let arc = eikonal::ray::Arc::line(x, direction, length);
                let meets = |o: &&Object| o.shape.first_hit(&arc, 0.0, 1.0).is_some();
                objects.iter().any(meets)
            };
            if clearance.is_free_around(x, length) {
                balls += 1;
                let axes = [DVec3::X, DVec3::Y, DVec3::Z, direction];
                assert!(
                    !axes.iter().any(|d| meets_any(*d) || meets_any(-*d)),
                    "{x} {length}"
                );
            }
            if !clearance.is_free(x, direction, length) {
                continue;
            }
            found += 1;
            assert!(!meets_any(direction), "{x} {direction} {length}");
        }
        assert!(
            found > 800 && balls > 200,
            "it knows too little: {found} {balls}"
        );
    }
}
