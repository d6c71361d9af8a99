//! Section of the scene on the page.

use eikonal::Aabb;
use glam::DVec3;
use transport::Scene;
use transport::trace::Path;

/// Largest width and height of a plot, in pixels.
const MAX_SIZE: [f64; 2] = [860.0, 720.0];
/// Least height of a plot relative to its width, so that a single straight ray has room.
const MIN_ASPECT: f64 = 0.3;
/// Padding around the content, relative to its larger side.
const PADDING: f64 = 0.04;

/// A window onto a coordinate plane.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Axes to the right, upwards, and perpendicular to the page.
    pub axes: [usize; 3],
    /// Coordinate of the plane along the third axis.
    pub depth: f64,
    min: [f64; 2],
    max: [f64; 2],
    scale: f64,
}

impl View {
    /// Makes a window that shows the rays, and the whole of each shape whose interior they cross.
    pub fn new(scene: &Scene, paths: &[Path]) -> Self {
        let points = || paths.iter().flat_map(|p| &p.points);
        let rays = Aabb::around(points().map(|p| p.x));
        let passed = |o: &&transport::scene::Object| {
            o.interior()
                .is_some_and(|id| points().any(|p| p.medium == id))
                && o.shape.is_closed()
        };
        let shapes = scene
            .objects()
            .iter()
            .filter(passed)
            .map(|o| o.shape.aabb());
        let shown = shapes.fold(rays, Aabb::union);
        let axes = axes(&rays);
        let (mut min, mut max) = ([0.0; 2], [0.0; 2]);
        for k in 0..2 {
            (min[k], max[k]) = (shown.min[axes[k]], shown.max[axes[k]]);
        }
        let larger = f64::max(max[0] - min[0], max[1] - min[1]).max(1e-9);
        let widen = |k: usize, least: f64, min: &mut [f64; 2], max: &mut [f64; 2]| {
            let missing = 0.5 * (least - (max[k] - min[k])).max(0.0);
            min[k] -= missing;
            max[k] += missing;
        };
        for k in 0..2 {
            let padded = max[k] - min[k] + 2.0 * PADDING * larger;
            widen(k, padded, &mut min, &mut max);
        }
        widen(1, MIN_ASPECT * (max[0] - min[0]), &mut min, &mut max);
        widen(0, MIN_ASPECT * (max[1] - min[1]), &mut min, &mut max);
        View {
            axes,
            depth: rays.center()[axes[2]],
            min,
            max,
            scale: (MAX_SIZE[0] / (max[0] - min[0])).min(MAX_SIZE[1] / (max[1] - min[1])),
        }
    }

    /// Returns width and height of the plot, in pixels.
    pub fn size(&self) -> [f64; 2] {
        [0, 1].map(|k| (self.max[k] - self.min[k]) * self.scale)
    }

    /// Returns the range of coordinates to the right (0) or upwards (1).
    pub fn range(&self, k: usize) -> [f64; 2] {
        [self.min[k], self.max[k]]
    }

    /// Converts a position in the scene to pixels on the page, from the top left of the plot.
    pub fn place(&self, x: DVec3) -> [f64; 2] {
        [
            (x[self.axes[0]] - self.min[0]) * self.scale,
            (self.max[1] - x[self.axes[1]]) * self.scale,
        ]
    }

    /// Converts a position on the page to a point of the plane.
    pub fn point(&self, [right, down]: [f64; 2]) -> DVec3 {
        let mut x = DVec3::ZERO;
        x[self.axes[0]] = self.min[0] + right / self.scale;
        x[self.axes[1]] = self.max[1] - down / self.scale;
        x[self.axes[2]] = self.depth;
        x
    }
}

/// Returns the axes in their order on the page: the longest to the right, the next upwards.
fn axes(rays: &Aabb) -> [usize; 3] {
    let size = rays.size();
    let mut axes = [0, 1, 2];
    axes.sort_by(|&a, &b| size[b].total_cmp(&size[a]));
    axes
}
