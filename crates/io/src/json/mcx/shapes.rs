//! Shapes that are drawn into a volume, each over those before: a voxel has the label of a shape if its centre lies in it. `Origin` moves
//! what it moves in MCX: boxes, subgrids and cylinders.

use super::super::tree::{Entry, Json, Node};
use super::labels::Labels;
use super::{Reader, field, numbers};
use glam::DVec3;

/// Draws shapes into a volume, which a `Grid` makes anew; `None` after an error. The first voxel is at `origin`.
pub(super) fn draw(
    shapes: &Node,
    start: Option<Labels>,
    origin: DVec3,
    reader: &mut Reader,
) -> Option<Labels> {
    let errors = reader.diagnostics.error_count();
    let Json::Array(items) = &shapes.json else {
        reader.error(shapes, "Shapes is a list of shapes, or an array of JData");
        return None;
    };
    let mut canvas = Canvas {
        labels: start,
        origin,
    };
    for item in items {
        let Json::Object(entries) = &item.json else {
            reader.error(item, "a shape is an object, such as {\"Sphere\": {...}}");
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
                None => reader.error(node, "Origin is a list of 3 numbers"),
            },
            "grid" => {
                let tag = reader.number_or(node, "Tag", 0.0) as f32;
                let Some(size) = reader.numbers::<3>(node, "Size") else {
                    return;
                };
                let size = size.map(|v| v.max(0.0) as usize);
                self.labels = Labels::filled(size, tag);
                if self.labels.is_none() {
                    reader.error(node, "Size is that of a volume with voxels");
                }
            }
            "sphere" => {
                let (c, r) = (
                    self.point(node, &["O", "C0"], reader),
                    reader.number(node, "R"),
                );
                self.fill(node, reader, |p| p.distance_squared(c) <= r * r);
            }
            "box" | "subgrid" => {
                let low = self.point(node, &["O"], reader) - self.origin;
                let size = reader
                    .numbers::<3>(node, "Size")
                    .map_or(DVec3::ZERO, DVec3::from);
                // A subgrid is counted in voxels, from 1 and with its last ones.
                let is_subgrid = entry.key.eq_ignore_ascii_case("subgrid");
                let (low, size) = if is_subgrid {
                    (low - 1.0, size + 1.0)
                } else {
                    (low, size)
                };
                self.fill(node, reader, |p| {
                    (p - low).min_element() >= 0.0 && (low + size - p).min_element() >= 0.0
                });
            }
            "cylinder" => {
                let ends = ["C0", "C1"].map(|key| self.point(node, &[key], reader) - self.origin);
                let r = reader.number(node, "R");
                let axis = ends[1] - ends[0];
                let length = axis.length_squared();
                self.fill(node, reader, |p| {
                    let t = (p - ends[0]).dot(axis) / length;
                    (0.0..=1.0).contains(&t) && p.distance_squared(ends[0] + axis * t) <= r * r
                });
            }
            "upperspace" => {
                let Some([a, b, c, d]) = reader.numbers::<4>(node, "Coef") else {
                    return;
                };
                let normal = DVec3::new(a, b, c);
                self.fill(node, reader, |p| normal.dot(p) > d);
            }
            key @ ("xlayers" | "ylayers" | "zlayers") => self.layers(axis_of(key), node, reader),
            key @ ("xslabs" | "yslabs" | "zslabs") => self.slabs(axis_of(key), node, reader),
            other => {
                let message = format!(
                    "'{other}' is not among the shapes Grid, Sphere, Box, Subgrid, Cylinder, UpperSpace, XLayers and XSlabs (Y, Z)"
                );
                reader.error(node, message);
            }
        }
    }

    /// A point in voxels from the volume's corner, by one of several names.
    fn point(&self, node: &Node, keys: &[&str], reader: &mut Reader) -> DVec3 {
        let key = keys
            .iter()
            .find(|key| field(node, key).is_some())
            .unwrap_or(&keys[0]);
        let found = reader.numbers::<3>(node, key);
        found.map_or(DVec3::ZERO, DVec3::from)
    }

    /// Gives the label of a shape to all voxels whose centres are inside.
    fn fill(&mut self, node: &Node, reader: &mut Reader, inside: impl Fn(DVec3) -> bool) {
        let tag = reader.number_or(node, "Tag", 0.0) as f32;
        self.each(node, reader, |p| inside(p).then_some(tag));
    }

    fn each(&mut self, node: &Node, reader: &mut Reader, label: impl Fn(DVec3) -> Option<f32>) {
        let Some(labels) = &mut self.labels else {
            return reader.error(
                node,
                "the volume has no size yet: begin with a Grid, or give Dim",
            );
        };
        let [nx, ny, _] = labels.size;
        for (i, voxel) in labels.data.iter_mut().enumerate() {
            let place = DVec3::new((i % nx) as f64, (i / nx % ny) as f64, (i / nx / ny) as f64);
            if let Some(label) = label(place + 0.5) {
                *voxel = label;
            }
        }
    }

    /// First and last layer of voxels, counted from 1, and a label.
    fn layers(&mut self, axis: usize, node: &Node, reader: &mut Reader) {
        let Some(rows) = rows::<3>(node) else {
            return reader.error(
                node,
                "layers are lists of three numbers: first, last, label",
            );
        };
        for [first, last, tag] in rows {
            self.each(node, reader, |p| {
                (first - 1.0..last).contains(&p[axis]).then_some(tag as f32)
            });
        }
    }

    /// Slabs between two coordinates, in whole voxels.
    fn slabs(&mut self, axis: usize, node: &Node, reader: &mut Reader) {
        let Some(bounds) = field(node, "Bound").and_then(rows::<2>) else {
            return reader.error(node, "slabs have a Bound: lists of two numbers");
        };
        self.fill(node, reader, |p| {
            let within = |[low, high]: &[f64; 2]| {
                let first = (low - 0.5).max(0.0).floor();
                (first..high.floor()).contains(&p[axis])
            };
            bounds.iter().any(within)
        });
    }
}

fn axis_of(key: &str) -> usize {
    match key.as_bytes()[0] {
        b'x' => 0,
        b'y' => 1,
        _ => 2,
    }
}

/// Rows of so many numbers, or one of them.
fn rows<const N: usize>(node: &Node) -> Option<Vec<[f64; N]>> {
    let rows = super::rows(node)?;
    rows.into_iter().map(|row| row.try_into().ok()).collect()
}
