//! Shapes drawn into a volume in order. Later shapes replace the labels of earlier shapes. A voxel
//! gets the label of a shape if the voxel's centre lies in the shape. As in MCX, `Origin` moves
//! boxes, subgrids and cylinders.

use super::super::tree::{Entry, Json, Node};
use super::labels::Labels;
use super::{Reader, field, numbers};
use glam::DVec3;
use std::ops::Range;

/// Draws shapes into a volume; a `Grid` replaces the volume. The first voxel is at `origin`.
/// Returns `None` after an error.
pub(super) fn draw(
    shapes: &Node,
    start: Option<Labels>,
    origin: DVec3,
    reader: &mut Reader,
) -> Option<Labels> {
    let errors = reader.diagnostics.error_count();
    let Json::Array(items) = &shapes.json else {
        reader.error(
            shapes,
            "Shapes must be a list of shapes, or an array of JData",
        );
        return None;
    };
    let mut canvas = Canvas {
        labels: start,
        origin,
    };
    for item in items {
        let Json::Object(entries) = &item.json else {
            reader.error(
                item,
                "a shape must be an object, such as {\"Sphere\": {...}}",
            );
            continue;
        };
        for entry in entries {
            canvas.shape(entry, reader);
        }
    }
    (reader.diagnostics.error_count() == errors).then_some(canvas.labels)?
}

struct Canvas {
    labels: Option<Labels>,
    origin: DVec3,
}

impl Canvas {
    fn shape(&mut self, entry: &Entry, reader: &mut Reader) {
        let node = &entry.node;
        match entry.key.to_ascii_lowercase().as_str() {
            "name" => {}
            "origin" => match numbers(node).and_then(|v| <[f64; 3]>::try_from(v).ok()) {
                Some(origin) => self.origin = origin.into(),
                None => reader.error(node, "Origin must be a list of 3 numbers"),
            },
            "grid" => {
                let tag = reader.number_or(node, "Tag", 0.0) as f32;
                let Some(size) = reader.numbers::<3>(node, "Size") else {
                    return;
                };
                let size = size.map(|v| v.max(0.0) as usize);
                // Free the previous volume before the new one is allocated.
                self.labels = None;
                match Labels::filled(size, tag, reader.limits) {
                    Ok(labels) => self.labels = Some(labels),
                    Err(e) => reader.error(node, format!("Size: {e}")),
                }
            }
            "sphere" => {
                let (c, r) = (
                    self.point(node, &["O", "C0"], reader),
                    reader.number(node, "R"),
                );
                let part = Part::between(c - r.abs(), c + r.abs());
                self.fill(node, part, reader, |p| p.distance_squared(c) <= r * r);
            }
            "box" | "subgrid" => {
                let low = self.point(node, &["O"], reader) - self.origin;
                let size = reader
                    .numbers::<3>(node, "Size")
                    .map_or(DVec3::ZERO, DVec3::from);
                // Voxels of a subgrid count from 1, and its last voxels are included.
                let is_subgrid = entry.key.eq_ignore_ascii_case("subgrid");
                let (low, size) = if is_subgrid {
                    (low - 1.0, size + 1.0)
                } else {
                    (low, size)
                };
                let part = Part::between(low, low + size);
                self.fill(node, part, reader, |p| {
                    (p - low).min_element() >= 0.0 && (low + size - p).min_element() >= 0.0
                });
            }
            "cylinder" => {
                let ends = ["C0", "C1"].map(|key| self.point(node, &[key], reader) - self.origin);
                let r = reader.number(node, "R");
                let axis = ends[1] - ends[0];
                let length = axis.length_squared();
                let part = Part::between(
                    ends[0].min(ends[1]) - r.abs(),
                    ends[0].max(ends[1]) + r.abs(),
                );
                self.fill(node, part, reader, |p| {
                    let t = (p - ends[0]).dot(axis) / length;
                    (0.0..=1.0).contains(&t) && p.distance_squared(ends[0] + axis * t) <= r * r
                });
            }
            "upperspace" => {
                let Some([a, b, c, d]) = reader.numbers::<4>(node, "Coef") else {
                    return;
                };
                let normal = DVec3::new(a, b, c);
                self.fill(node, Part::WHOLE, reader, |p| normal.dot(p) > d);
            }
            key @ ("xlayers" | "ylayers" | "zlayers") => self.layers(axis_of(key), node, reader),
            key @ ("xslabs" | "yslabs" | "zslabs") => self.slabs(axis_of(key), node, reader),
            other => {
                let message = format!(
                    "unknown shape '{other}': known shapes are Grid, Sphere, Box, Subgrid, Cylinder, UpperSpace, XLayers and XSlabs (Y, Z)"
                );
                reader.error(node, message);
            }
        }
    }

    /// Returns a point in voxels from the volume's corner. The point may have any of several keys.
    fn point(&self, node: &Node, keys: &[&str], reader: &mut Reader) -> DVec3 {
        let key = keys
            .iter()
            .find(|key| field(node, key).is_some())
            .unwrap_or(&keys[0]);
        let found = reader.numbers::<3>(node, key);
        found.map_or(DVec3::ZERO, DVec3::from)
    }

    /// Gives a shape's label to all voxels with centres inside the shape.
    fn fill(
        &mut self,
        node: &Node,
        part: Part,
        reader: &mut Reader,
        inside: impl Fn(DVec3) -> bool,
    ) {
        let tag = reader.number_or(node, "Tag", 0.0) as f32;
        self.each(node, part, reader, |p| inside(p).then_some(tag));
    }

    /// Gives labels to the voxels of a part, by the voxels' centres.
    fn each(
        &mut self,
        node: &Node,
        part: Part,
        reader: &mut Reader,
        label: impl Fn(DVec3) -> Option<f32>,
    ) {
        let Some(labels) = &mut self.labels else {
            return reader.error(
                node,
                "the volume has no size yet: put a Grid first, or give Dim",
            );
        };
        let [nx, ny, _] = labels.size;
        let [xs, ys, zs] = part.voxels(labels.size);
        for z in zs {
            for y in ys.clone() {
                let row = nx * (y + ny * z);
                for x in xs.clone() {
                    if let Some(label) = label(DVec3::new(x as f64, y as f64, z as f64) + 0.5) {
                        labels.data[row + x] = label;
                    }
                }
            }
        }
    }

    /// Draws layers, each given by its first and last voxel, counted from 1, and its label.
    fn layers(&mut self, axis: usize, node: &Node, reader: &mut Reader) {
        let Some(rows) = rows::<3>(node) else {
            return reader.error(
                node,
                "layers must be lists of three numbers: first, last, label",
            );
        };
        for [first, last, tag] in rows {
            let part = Part::along(axis, first - 1.0, last);
            self.each(node, part, reader, |p| {
                (first - 1.0..last).contains(&p[axis]).then_some(tag as f32)
            });
        }
    }

    /// Draws slabs between two coordinates, in whole voxels.
    fn slabs(&mut self, axis: usize, node: &Node, reader: &mut Reader) {
        let Some(bounds) = field(node, "Bound").and_then(rows::<2>) else {
            return reader.error(node, "slabs need a Bound: lists of two numbers");
        };
        for [low, high] in bounds {
            let (first, last) = ((low - 0.5).max(0.0).floor(), high.floor());
            let part = Part::along(axis, first, last);
            self.fill(node, part, reader, |p| (first..last).contains(&p[axis]));
        }
    }
}

/// Bounding box of a shape, in voxels.
#[derive(Clone, Copy)]
struct Part {
    low: DVec3,
    high: DVec3,
}

impl Part {
    const WHOLE: Part = Part {
        low: DVec3::NEG_INFINITY,
        high: DVec3::INFINITY,
    };

    fn between(low: DVec3, high: DVec3) -> Self {
        Part { low, high }
    }

    /// Returns the part between two coordinates along an axis.
    fn along(axis: usize, low: f64, high: f64) -> Self {
        let mut part = Part::WHOLE;
        part.low[axis] = low;
        part.high[axis] = high;
        part
    }

    /// Returns the voxels of a volume whose centres may lie in the part.
    fn voxels(&self, size: [usize; 3]) -> [Range<usize>; 3] {
        std::array::from_fn(|axis| {
            let place = |x: f64| x.floor().clamp(0.0, size[axis] as f64) as usize;
            place(self.low[axis])..place(self.high[axis] + 1.0)
        })
    }
}

fn axis_of(key: &str) -> usize {
    match key.as_bytes()[0] {
        b'x' => 0,
        b'y' => 1,
        _ => 2,
    }
}

/// Returns rows of `N` numbers. The node may also be a single row.
fn rows<const N: usize>(node: &Node) -> Option<Vec<[f64; N]>> {
    let rows = super::rows(node)?;
    rows.into_iter().map(|row| row.try_into().ok()).collect()
}
