//! Faces between voxels of two labels: parts of the planes of a grid, found by walking through its
//! voxels.

use super::curve::Track;
use super::line::Line;
use super::mesh::is_degenerate;
use super::placement::Placement;
use super::{AreaSample, Hit, Intersection, Mesh, Shape, ShapeError, Tessellation, Uv};
use crate::volume::LabelGrid;
use eikonal::Aabb;
use eikonal::ray::Arc as RayArc;
use glam::{DAffine3, DVec3};
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

/// All faces in a grid between voxels of one label and voxels of another; outside the grid, the
/// label is 0. Part 2k holds the faces across axis k with the larger label above, part 2k + 1 the
/// faces with the larger label below.
///
/// Straight lines are followed from voxel to voxel. Bent rays are rare among voxels. They are
/// intersected with a triangle mesh, which the first bent ray creates.
#[derive(Clone, Debug)]
pub struct VoxelFaces {
    grid: Arc<LabelGrid>,
    /// Map from positions in voxels to the scene.
    placement: Placement,
    /// The larger label, then the smaller label.
    labels: [u8; 2],
    /// Indices of the lowest corners of the faces, by axis.
    faces: [Vec<u32>; 3],
    /// Box around the faces, in voxels.
    bounds: Aabb,
    /// Box around the faces, in the scene.
    aabb: Aabb,
    closed: bool,
    /// True if normals point into the larger label, because it encloses the smaller one.
    turned: bool,
    /// Triangles for bent rays.
    mesh: OnceLock<Option<Mesh>>,
}

impl VoxelFaces {
    /// Returns the faces between each pair of labels of a grid that touch, in the order of their
    /// [labels](VoxelFaces::labels).
    ///
    /// # Errors
    /// Fails if there are more corners of voxels than a 32-bit index can number. Fails if the grid
    /// is too thin or too far from the origin for its faces to have an area.
    pub fn all(grid: &Arc<LabelGrid>) -> Result<Vec<Self>, ShapeError> {
        let size = DVec3::from_array(grid.size().map(|n| n as f64));
        let placement = Placement::new(
            grid.to_world() * DAffine3::from_scale(1.0 / size),
            &Aabb::new(DVec3::ZERO, size),
        )?;
        // Check the number of corners and the areas of faces.
        let corners = grid.size().map(|n| n as u128 + 1).iter().product();
        if corners > u128::from(u32::MAX) {
            return Err(ShapeError::TooManyVoxels { corners });
        }
        for axis in 0..3 {
            let [a, b] = others(axis);
            let corner = [size, size - DVec3::AXES[a], size - DVec3::AXES[b]];
            if is_degenerate(corner.map(|p| placement.point(p))) {
                return Err(ShapeError::FlatVoxels { axis });
            }
        }
        // Collect the faces of each pair of labels.
        let found = Corners::of(grid).faces();
        let made = found.into_iter().map(|(labels, faces)| {
            let mut made = VoxelFaces {
                grid: grid.clone(),
                placement,
                labels,
                faces,
                bounds: Aabb::EMPTY,
                aabb: Aabb::EMPTY,
                closed: false,
                turned: false,
                mesh: OnceLock::new(),
            };
            let ends = made.all_faces().flat_map(|(axis, place)| {
                let [a, b] = others(axis);
                [place, place + DVec3::AXES[a] + DVec3::AXES[b]]
            });
            // Compute boxes, closedness and the side of the normals.
            made.bounds = Aabb::around(ends);
            let mut aabb = Aabb::EMPTY;
            made.each_face(|corners| aabb = corners.iter().fold(aabb, |b, p| b.include(*p)));
            let far = aabb.min.abs().max(aabb.max.abs()).max_element();
            made.aabb = aabb.grown(8.0 * f64::EPSILON * far);
            made.closed = made.is_closed_around_edges();
            made.turned = made.closed && made.signed_volume() < 0.0;
            made
        });
        Ok(made.collect())
    }

    /// Returns the larger label, which is behind the normals, then the smaller label in front of
    /// them. The sides are reversed if [`VoxelFaces::is_turned`].
    pub fn labels(&self) -> [u8; 2] {
        self.labels
    }

    /// Returns true if the larger label encloses the smaller one. Normals of closed surfaces point
    /// outwards.
    pub fn is_turned(&self) -> bool {
        self.turned
    }

    /// Returns the number of faces.
    pub fn count(&self) -> usize {
        self.faces.iter().map(Vec::len).sum()
    }

    /// Returns the grid to which the faces belong.
    pub(super) fn grid(&self) -> &Arc<LabelGrid> {
        &self.grid
    }

    /// Returns the y axis of the grid.
    pub(super) fn y_axis(&self) -> DVec3 {
        self.placement.vector(DVec3::Y)
    }

    pub(super) fn set_flipped(&mut self, flipped: bool) {
        self.placement.set_flipped(flipped);
    }

    pub(super) fn is_flipped(&self) -> bool {
        self.placement.is_flipped()
    }

    pub(super) fn is_closed(&self) -> bool {
        self.closed
    }

    /// Returns true if the surface is the surface of a box.
    pub(super) fn is_convex(&self) -> bool {
        let size = self.bounds.size();
        let sides = |axis: usize| 2.0 * others(axis).map(|k| size[k]).iter().product::<f64>();
        self.closed && (0..3).all(|axis| self.faces[axis].len() as f64 == sides(axis))
    }

    pub(super) fn aabb(&self) -> Aabb {
        self.aabb
    }

    /// Returns points whose convex hull contains the faces.
    pub(super) fn hull(&self) -> Vec<DVec3> {
        self.bounds
            .corners()
            .map(|p| self.placement.point(p))
            .to_vec()
    }

    pub(super) fn volume(&self) -> f64 {
        self.signed_volume().abs() * self.placement.determinant()
    }

    /// Returns true if a line along x from the point crosses the faces an odd number of times.
    pub(super) fn contains(&self, p: DVec3) -> bool {
        let cell = self.placement.local(p).floor();
        let last = self.bounds.max - 1.0;
        if !(self.closed && cell.cmpge(self.bounds.min).all() && cell.cmple(last).all()) {
            return false;
        }
        let label = |x: f64| self.label(cell.with_x(x));
        let steps = 0..(self.bounds.max.x - cell.x) as usize;
        let places = steps.map(|step| cell.x + step as f64);
        let crossed = places.filter(|x| self.are_between(label(*x), label(x + 1.0)));
        crossed.count() % 2 != 0
    }

    pub(super) fn area(&self) -> f64 {
        let area = |axis: usize| self.faces[axis].len() as f64 * self.placement.axis_stretch(axis);
        (0..3).map(area).sum()
    }

    pub(super) fn part_areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; 6];
        for (axis, place) in self.all_faces() {
            areas[self.part(axis, place)] += self.placement.axis_stretch(axis);
        }
        areas
    }

    /// Returns the areas of the bins of each part, u fastest, for `count` equal bins of u and v
    /// across the grid.
    pub fn bin_areas(&self, count: [usize; 2]) -> Vec<f64> {
        let [columns, rows] = count;
        let mut areas = vec![0.0; 6 * columns * rows];
        let size = self.size();
        for (axis, place) in self.all_faces() {
            let [a, b] = others(axis);
            let overlaps = |k: usize, bins: usize| overlaps(place[k], bins as f64 / size[k]);
            let first = rows * self.part(axis, place);
            let face = self.placement.axis_stretch(axis);
            for (row, high) in overlaps(b, rows) {
                for (column, wide) in overlaps(a, columns) {
                    areas[(first + row) * columns + column] += face * high * wide;
                }
            }
        }
        areas
    }

    pub(super) fn sample_area(&self, u: [f64; 2]) -> AreaSample {
        let mut rest = u[0] * self.area();
        let area = |axis: usize| self.faces[axis].len() as f64 * self.placement.axis_stretch(axis);
        let last = (0..3).rfind(|axis| area(*axis) > 0.0).unwrap_or(0);
        let mut axis = 0;
        while axis < last && rest >= area(axis) {
            rest -= area(axis);
            axis += 1;
        }
        rest /= self.placement.axis_stretch(axis);
        let number = (rest as usize).min(self.faces[axis].len() - 1);
        let place = Corners::of(&self.grid).place(self.faces[axis][number]);
        let [a, b] = others(axis);
        let within = [(rest - number as f64).clamp(0.0, 1.0), u[1]];
        let local = place + DVec3::AXES[a] * within[0] + DVec3::AXES[b] * within[1];
        let hit = self.hit(&Intersection {
            theta: 0.0,
            local,
            primitive: self.part(axis, place) as u32,
        });
        AreaSample {
            position: hit.position,
            normal: hit.normal,
            uv: hit.uv,
            primitive: hit.primitive,
            pdf: self.area().recip(),
        }
    }

    pub(super) fn inverse_area(&self, position: DVec3, part: u32) -> [f64; 2] {
        let axis = part as usize / 2;
        let [a, b] = others(axis);
        let local = self.placement.local(position);
        let mut place = local.floor().clamp(DVec3::ZERO, self.size() - 1.0);
        place[axis] = local[axis].round();
        let number = Corners::of(&self.grid).number(place);
        let faces = &self.faces[axis];
        let number = faces.partition_point(|face| *face < number) as f64;
        let area = |axis: usize| self.faces[axis].len() as f64 * self.placement.axis_stretch(axis);
        let before: f64 = (0..axis).map(area).sum();
        let within = [a, b].map(|k| (local[k] - place[k]).clamp(0.0, 1.0));
        let own = (number + within[0]) * self.placement.axis_stretch(axis);
        [(before + own) / self.area(), within[1]]
    }

    pub(super) fn tangents(&self, part: u32) -> [DVec3; 2] {
        let size = self.size();
        others(part as usize / 2).map(|k| self.placement.vector(DVec3::AXES[k] * size[k]))
    }

    pub(super) fn intersect(&self, arc: &RayArc, theta: [f64; 2]) -> Option<Intersection> {
        if arc.is_straight() {
            let own = |labels| (labels == self.labels).then_some(());
            return Some(self.first_of_line(arc, theta, own)?.1);
        }
        let mesh = self.mesh.get_or_init(|| {
            let Tessellation {
                positions,
                triangles,
            } = self.tessellation();
            Mesh::new(positions, triangles, None).ok()
        });
        let mesh = mesh.as_ref()?;
        let intersection = mesh.intersect(arc, theta)?;
        let hit = mesh.hit(&intersection);
        let along = |axis: usize| hit.normal.dot(self.placement.normal(DVec3::AXES[axis]));
        let nearer = |a: &usize, b: &usize| along(*a).abs().total_cmp(&along(*b).abs());
        let axis = (0..3).max_by(nearer)?;
        let mut local = self.placement.local(hit.position);
        local[axis] = local[axis].round();
        let is_below = ((along(axis) > 0.0) != self.is_flipped()) != self.turned;
        Some(Intersection {
            theta: intersection.theta,
            local,
            primitive: (2 * axis + usize::from(is_below)) as u32,
        })
    }

    /// Returns the first intersection of a straight line with faces that `wanted` accepts, together
    /// with the result of `wanted`. `wanted` receives the two labels, the larger first. Faces for
    /// which it returns `None` are skipped.
    pub(super) fn first_of_line<T>(
        &self,
        arc: &RayArc,
        theta: [f64; 2],
        wanted: impl Fn([u8; 2]) -> Option<T>,
    ) -> Option<(T, Intersection)> {
        let line = Line::new(arc, theta, &self.placement);
        let (size, layers, labels) = (self.size(), self.grid.layers(), self.grid.labels());
        let start = line.first_cell();
        let is_inside = |cell: DVec3| cell.cmpge(DVec3::ZERO).all() && cell.cmplt(size).all();
        let number = |c: DVec3| (c.x + size.x * (c.y + size.y * c.z)) as usize;
        let intersection = |axis: usize, u: f64, at: f64, [from, to]: [u8; 2]| {
            let found = wanted([from.max(to), from.min(to)])?;
            let is_below = (from > to) == line.goes_up(axis);
            let primitive = (2 * axis + usize::from(is_below)) as u32;
            Some((found, line.intersection(axis, at, u, primitive)))
        };
        // Enter the grid, and test for a face on its boundary.
        let mut cell = start;
        if !is_inside(cell) {
            let (u, axis) = line.enters(size)?;
            let at = if line.goes_up(axis) { 0.0 } else { size[axis] };
            cell = line.position(u).floor().clamp(DVec3::ZERO, size - 1.0);
            cell[axis] = if line.goes_up(axis) { 0.0 } else { at - 1.0 };
            let label = labels[number(cell)];
            let found = (label != 0).then(|| intersection(axis, u, at, [0, label]));
            if let Some(found) = found.flatten() {
                return Some(found);
            }
        }
        loop {
            // Leave the cube of equal labels around the cell.
            let own = number(cell);
            let around = f64::from(layers[own]);
            let (low, high) = (cell - around, cell + around);
            let (u, axis) = line.leaves(low, high + 1.0)?;
            let (at, beyond) = if line.goes_up(axis) {
                (high[axis] + 1.0, high[axis] + 1.0)
            } else {
                (low[axis], low[axis] - 1.0)
            };
            // Never move the cell backwards, whatever rounding does.
            let to = line.position(u).floor();
            for k in 0..3 {
                let range = if line.goes_up(k) {
                    [cell[k], high[k]]
                } else {
                    [low[k], cell[k]]
                };
                cell[k] = to[k].clamp(range[0], range[1]);
            }
            // Test for a face between the two labels.
            let before = labels[own];
            cell[axis] = beyond;
            let after = is_inside(cell).then(|| labels[number(cell)]);
            if after != Some(before) && (after.is_some() || before != 0) {
                let found = intersection(axis, u, at, [before, after.unwrap_or(0)]);
                if found.is_some() {
                    return found;
                }
            }
            after?;
        }
    }

    pub(super) fn hit(&self, at: &Intersection) -> Hit {
        let axis = at.primitive as usize / 2;
        let is_up = (at.primitive % 2 == 1) != self.turned;
        let local = at.local.clamp(DVec3::ZERO, self.size());
        let size = self.size();
        let across = others(axis).map(|k| local[k] / size[k]);
        let normal = self.placement.axis_normal(axis);
        Hit {
            theta: at.theta,
            position: self.placement.point(local),
            normal: if is_up { normal } else { -normal },
            uv: Uv::Plain(across),
            primitive: at.primitive,
        }
    }

    /// Returns the faces as triangles, counter-clockwise seen from the side of the normal.
    pub(super) fn tessellation(&self) -> Tessellation {
        let all = Corners::of(&self.grid);
        let mirrored = self.placement.map().matrix3.determinant() < 0.0;
        let quads: Vec<[u32; 4]> = self
            .all_faces()
            .map(|(axis, place)| {
                let [a, b] = others(axis).map(|k| DVec3::AXES[k]);
                let [p, q, r, s] =
                    [place, place + a, place + a + b, place + b].map(|p| all.number(p));
                let is_up = (self.part(axis, place) % 2 == 1) != self.turned;
                if is_up != mirrored {
                    [p, q, r, s]
                } else {
                    [p, s, r, q]
                }
            })
            .collect();
        let mut corners: Vec<u32> = quads.iter().flatten().copied().collect();
        corners.sort_unstable();
        corners.dedup();
        let number = |corner: u32| corners.partition_point(|c| *c < corner) as u32;
        let triangles = quads.iter().flat_map(|quad| {
            let [p, q, r, s] = quad.map(number);
            [[p, q, r], [p, r, s]]
        });
        Tessellation {
            triangles: triangles.collect(),
            positions: corners
                .iter()
                .map(|c| self.placement.point(all.place(*c)))
                .collect(),
        }
    }

    /// Calls `visit` with the corners of each face.
    pub(super) fn each_face(&self, mut visit: impl FnMut(&[DVec3])) {
        for (axis, place) in self.all_faces() {
            let [a, b] = others(axis).map(|k| DVec3::AXES[k]);
            let corners = [place, place + a, place + a + b, place + b];
            visit(&corners.map(|p| self.placement.point(p)));
        }
    }

    /// Returns the axis and lowest corner of each face.
    fn all_faces(&self) -> impl Iterator<Item = (usize, DVec3)> + '_ {
        let corners = Corners::of(&self.grid);
        (0..3).flat_map(move |axis| {
            let faces = self.faces[axis].iter();
            faces.map(move |face| (axis, corners.place(*face)))
        })
    }

    /// Returns the part to which a face belongs.
    fn part(&self, axis: usize, place: DVec3) -> usize {
        let below = self.label(place - DVec3::AXES[axis]);
        2 * axis + usize::from(below == self.labels[0])
    }

    fn size(&self) -> DVec3 {
        DVec3::from_array(self.grid.size().map(|n| n as f64))
    }

    /// Returns the label of the voxel with this lowest corner; 0 outside the grid.
    fn label(&self, cell: DVec3) -> u8 {
        let size = self.size();
        if cell.cmpge(DVec3::ZERO).all() && cell.cmplt(size).all() {
            self.grid.labels()[(cell.x + size.x * (cell.y + size.y * cell.z)) as usize]
        } else {
            0
        }
    }

    fn are_between(&self, a: u8, b: u8) -> bool {
        [a.max(b), a.min(b)] == self.labels
    }

    /// Returns true if each edge of a face has exactly one other face.
    fn is_closed_around_edges(&self) -> bool {
        self.all_faces().all(|(axis, place)| {
            let [a, b] = others(axis);
            let edges = [(a, b, 0.0), (a, b, 1.0), (b, a, 0.0), (b, a, 1.0)];
            edges.into_iter().all(|(along, across, shift)| {
                let edge = place + DVec3::AXES[across] * shift;
                let [u, v] = others(along).map(|k| DVec3::AXES[k]);
                let around = [edge - u - v, edge - v, edge, edge - u].map(|cell| self.label(cell));
                let faces = (0..4).filter(|k| self.are_between(around[*k], around[(k + 1) % 4]));
                faces.count() == 2
            })
        })
    }

    /// Returns the enclosed volume in voxels, before normals are turned, by the divergence theorem
    /// along x. It is negative for a surface that is inside out.
    fn signed_volume(&self) -> f64 {
        let corners = Corners::of(&self.grid);
        let share = |face: &u32| {
            let place = corners.place(*face);
            let side = if self.part(0, place) == 1 { 1.0 } else { -1.0 };
            side * place.x
        };
        self.faces[0].iter().map(share).sum()
    }
}

/// Returns the two other axes in cyclic order.
fn others(axis: usize) -> [usize; 2] {
    [(axis + 1) % 3, (axis + 2) % 3]
}

/// Returns the bins that a voxel overlaps along an axis, each with the fraction of the voxel in it.
/// `lowest` is the voxel's coordinate; a voxel has the width `bins`, in bins.
fn overlaps(lowest: f64, bins: f64) -> impl Iterator<Item = (usize, f64)> {
    let [start, end] = [lowest * bins, (lowest + 1.0) * bins];
    // Rounding must not add a bin.
    let bins_within = (start + 1e-9).floor() as usize..(end - 1e-9).ceil() as usize;
    bins_within.map(move |bin| {
        let part = end.min(bin as f64 + 1.0) - start.max(bin as f64);
        (bin, part / (end - start))
    })
}

/// Corners of the voxels of a grid, numbered with x varying fastest.
#[derive(Clone, Copy)]
struct Corners<'a> {
    grid: &'a LabelGrid,
    /// Numbers of corners along x and y.
    along: [usize; 2],
}

impl<'a> Corners<'a> {
    fn of(grid: &'a LabelGrid) -> Self {
        let [x, y, _] = grid.size();
        Corners {
            grid,
            along: [x + 1, y + 1],
        }
    }

    fn place(&self, number: u32) -> DVec3 {
        let ([x, y], number) = (self.along, number as usize);
        DVec3::new(
            (number % x) as f64,
            (number / x % y) as f64,
            (number / x / y) as f64,
        )
    }

    fn number(&self, place: DVec3) -> u32 {
        let [x, y] = self.along.map(|n| n as f64);
        (place.x + x * (place.y + y * place.z)) as u32
    }

    /// Returns the faces between each pair of labels: for each axis, the numbers of their lowest
    /// corners.
    fn faces(&self) -> BTreeMap<[u8; 2], [Vec<u32>; 3]> {
        let mut faces: BTreeMap<[u8; 2], [Vec<u32>; 3]> = BTreeMap::new();
        let [nx, ny, nz] = self.grid.size();
        let beyond = vec![0; nx];
        let row = |j: Option<usize>, k: Option<usize>| match (j, k) {
            (Some(j), Some(k)) if j < ny && k < nz => {
                &self.grid.labels()[nx * (j + ny * k)..][..nx]
            }
            _ => &beyond[..],
        };
        let mut add = |axis: usize, a: u8, b: u8, number: usize| {
            if a != b {
                let faces = faces.entry([a.max(b), a.min(b)]).or_default();
                faces[axis].push(number as u32);
            }
        };
        for (k, j) in (0..=nz).flat_map(|k| (0..=ny).map(move |j| (k, j))) {
            let first = self.along[0] * (j + self.along[1] * k);
            let own = row(Some(j), Some(k));
            if own.iter().any(|label| *label != 0) {
                let last = own.len();
                add(0, 0, own[0], first);
                for i in 1..last {
                    add(0, own[i - 1], own[i], first + i);
                }
                add(0, own[last - 1], 0, first + last);
            }
            let below = [
                row(j.checked_sub(1), Some(k)),
                row(Some(j), k.checked_sub(1)),
            ];
            for (axis, below) in (1..).zip(below) {
                if below != own {
                    let pairs = below.iter().zip(own);
                    for (i, (a, b)) in pairs.enumerate() {
                        add(axis, *a, *b, first + i);
                    }
                }
            }
        }
        faces
    }
}

/// Faces of one grid among a list of shapes.
#[derive(Clone, Debug)]
pub(super) struct FacesOfGrid {
    grid: Arc<LabelGrid>,
    /// Indices in the list, by labels.
    places: BTreeMap<[u8; 2], usize>,
}

impl FacesOfGrid {
    /// Returns all grids of a list.
    pub(super) fn all(shapes: &[Shape]) -> Vec<Self> {
        let mut grids: Vec<Self> = Vec::new();
        for (place, shape) in shapes.iter().enumerate() {
            let Shape::VoxelFaces(faces) = shape else {
                continue;
            };
            match grids.iter_mut().find(|known| known.has(faces)) {
                Some(known) => {
                    known.places.entry(faces.labels).or_insert(place);
                }
                None => grids.push(FacesOfGrid {
                    grid: faces.grid.clone(),
                    places: BTreeMap::from([(faces.labels, place)]),
                }),
            }
        }
        grids
    }

    pub(super) fn has(&self, faces: &VoxelFaces) -> bool {
        Arc::ptr_eq(&self.grid, faces.grid())
    }

    pub(super) fn place(&self, labels: [u8; 2]) -> Option<usize> {
        self.places.get(&labels).copied()
    }
}
