//! Power of media that emit: exact for simple regions and emissions, otherwise estimated
//! (docs/theory.md#media-that-emit).

use super::containment::Containment;
use super::parts::{AMBIENT, MediumId, Object, Partition, Parts};
use crate::Spectrum;
use crate::emitter::Estimate;
use crate::medium::Medium;
use crate::sampling::Sampler;
use crate::shape::Shape;
use crate::volume::{GridFilter, VolumeGrid, VolumeTexture};
use eikonal::Aabb;
use glam::{DAffine3, DVec3};
use rayon::prelude::*;

/// Number of cells of the estimate along each axis. Each cell has two random points, whose
/// difference gives the error.
const CELLS: usize = 32;
/// Relative size of overlaps that rounding may cause. Faces that touch do not overlap.
const ROUNDING: f64 = 1e-9;
/// Deviation from the estimate, in standard errors, beyond which an exact volume is rejected. The
/// formula gives a wrong volume for a mesh that crosses itself.
const MAX_DEVIATION: f64 = 6.0;

/// Returns ∫ ε dV of a medium within `bounds`, which contain all of it.
pub(super) fn integral(
    parts: &Parts,
    containment: Containment,
    id: MediumId,
    bounds: &Aabb,
) -> Estimate {
    let Some(exact) = exact(parts, id) else {
        return estimate(parts, containment, id, bounds);
    };
    let winding = |o: &Object| matches!(o.shape, Shape::Mesh(_)) && !o.shape.is_convex();
    if parts.objects.iter().any(winding) && parts.partitions.is_empty() {
        let estimate = estimate(parts, containment, id, bounds);
        let off = (exact - estimate.value).map(f64::abs).sum();
        if off > MAX_DEVIATION * estimate.error.sum() && !estimate.value.is_zero() {
            return estimate;
        }
    }
    Estimate {
        value: exact,
        error: Spectrum::ZERO,
    }
}

/// Estimates the integral from two random points in each cell of the bounds.
fn estimate(parts: &Parts, containment: Containment, id: MediumId, bounds: &Aabb) -> Estimate {
    let size = bounds.max - bounds.min;
    let cell = size / CELLS as f64;
    let layer = |k: usize| {
        let mut sums = [Spectrum::ZERO; 2];
        for row in 0..CELLS * CELLS {
            let corner = DVec3::new((row % CELLS) as f64, (row / CELLS) as f64, k as f64);
            let mut sampler = Sampler::new(0, k as u64, row as u64);
            let [a, b] = [(); 2].map(|()| {
                let u = DVec3::from([(); 3].map(|()| sampler.next_1d()));
                let x = bounds.min + (corner + u) * cell;
                let is_here = containment.medium_at(x) == id && !containment.is_displaced(id, x);
                if is_here {
                    parts.media[id].emitted(x)
                } else {
                    Spectrum::ZERO
                }
            });
            sums[0] += (a + b) * 0.5;
            sums[1] += (a - b) * (a - b) * 0.25;
        }
        sums
    };
    let layers: Vec<[Spectrum; 2]> = (0..CELLS).into_par_iter().map(layer).collect();
    let [sum, squares] = layers
        .into_iter()
        .fold([Spectrum::ZERO; 2], |[a, b], [c, d]| [a + c, b + d]);
    let volume = cell.element_product();
    Estimate {
        value: sum * volume,
        error: squares.map(f64::sqrt) * volume,
    }
}

fn is_opaque(object: &Object) -> bool {
    object.shape.is_closed() && object.bsdf.is_opaque()
}

/// Returns the exact integral; `None` if no closed form is known.
fn exact(parts: &Parts, id: MediumId) -> Option<Spectrum> {
    let medium = &parts.media[id];
    if !medium.index.is_constant() {
        return None;
    }
    let grids = grids(medium);
    match grids.first() {
        None => Some(medium.emitted(DVec3::ZERO) * volume(parts, id)?),
        Some(first) => {
            let range = grid_range(parts, id, first)?;
            let alike = grids.iter().all(|g| g.to_world() == first.to_world());
            alike.then(|| sum_of_cells(medium, &grids, range))
        }
    }
}

/// Returns the grids on which the emission of a medium depends.
fn grids(medium: &Medium) -> Vec<&VolumeGrid> {
    let textures = [
        Some(&medium.sigma_t),
        Some(&medium.albedo),
        medium.emission.as_ref(),
    ];
    let grids = textures.into_iter().flatten().map(|texture| match texture {
        VolumeTexture::Grid(grid) => Some(&**grid),
        VolumeTexture::Uniform(_) => None,
    });
    grids.flatten().collect()
}

/// Part of space that a medium, or several media, occupy.
struct Body<'a> {
    medium: Option<MediumId>,
    shape: Option<&'a Shape>,
    /// Points with a convex hull that contains the body.
    hull: Vec<DVec3>,
    aabb: Aabb,
    /// Volume of the body; `None` if it is unknown.
    volume: Option<f64>,
}

impl<'a> Body<'a> {
    fn of_object(object: &'a Object) -> Option<Self> {
        let fills = object.shape.is_closed() && (object.sides.is_some() || is_opaque(object));
        fills.then(|| Body {
            medium: object.interior(),
            shape: Some(&object.shape),
            hull: object.shape.hull(),
            aabb: object.shape.aabb(),
            volume: object.shape.volume(),
        })
    }

    fn of_partition(partition: &Partition, objects: &[Object]) -> Self {
        let aabb = partition.aabb(objects);
        Body {
            medium: None,
            shape: None,
            hull: aabb.corners().to_vec(),
            aabb,
            volume: partition.volume(objects, None),
        }
    }

    fn of_box(hull: [DVec3; 8]) -> Self {
        Body {
            medium: None,
            shape: None,
            aabb: Aabb::around(hull),
            hull: hull.to_vec(),
            volume: None,
        }
    }

    /// Returns true if this body certainly has no volume in common with another body.
    fn is_apart(&self, other: &Body) -> bool {
        let common = self.aabb.max.min(other.aabb.max) - self.aabb.min.max(other.aabb.min);
        let hair = ROUNDING * self.aabb.diagonal().min(other.aabb.diagonal());
        let balls = self.ball().zip(other.ball());
        common.min_element() <= hair
            || balls.is_some_and(|((a, r), (b, s))| a.distance(b) >= (r + s) * (1.0 - ROUNDING))
    }

    /// Returns true if this body certainly contains all of another, smaller body, up to rounding.
    fn holds(&self, other: &Body) -> bool {
        let Some(shape) = self.shape.filter(|shape| shape.is_convex()) else {
            return false;
        };
        if other.aabb.diagonal() >= self.aabb.diagonal() {
            return false;
        }
        if let Some(((a, r), (b, s))) = self.ball().zip(other.ball()) {
            return a.distance(b) + s <= r * (1.0 + ROUNDING);
        }
        let center = other.aabb.center();
        let inner = |p: &DVec3| shape.contains(center + (*p - center) * (1.0 - ROUNDING));
        other.hull.iter().all(inner)
    }

    /// Returns centre and radius of a sphere.
    fn ball(&self) -> Option<(DVec3, f64)> {
        let Some(Shape::Sphere(sphere)) = self.shape else {
            return None;
        };
        sphere
            .is_even()
            .then(|| (self.aabb.center(), 0.5 * sphere.diameter()))
    }
}

/// Returns all bodies: first objects, then partitions, in order.
fn bodies(parts: &Parts) -> Vec<Body<'_>> {
    let divides = |i: usize| parts.partitions.iter().any(|p| p.objects.contains(&i));
    let objects = parts.objects.iter().enumerate();
    let alone = objects.filter_map(|(i, o)| (!divides(i)).then(|| Body::of_object(o))?);
    let partitions = parts.partitions.iter();
    alone
        .chain(partitions.map(|p| Body::of_partition(p, &parts.objects)))
        .collect()
}

/// Returns the volume of the region of a medium.
fn volume(parts: &Parts, id: MediumId) -> Option<f64> {
    let bodies = bodies(parts);
    let first = bodies.len() - parts.partitions.len();
    let mut volume = 0.0;
    for (i, body) in bodies.iter().enumerate() {
        if let Some(number) = i.checked_sub(first) {
            let own = parts.partitions[number].volume(&parts.objects, Some(id))?;
            if own > 0.0 && !within(i, &bodies)?.is_empty() {
                return None;
            }
            volume += own;
        } else if body.medium == Some(id) {
            let taken = within(i, &bodies)?;
            let taken = taken.into_iter().map(|b| b.volume).sum::<Option<f64>>()?;
            // Planted error "hollows that emit", found by morgana-io/io::emitted_power::simple_regions_emit_exactly:
            // volume += body.volume? + 0.0 * taken;
            volume += body.volume? - taken;
        }
    }
    Some(volume)
}

/// Returns the largest bodies within a body; `None` if some overlap, or containment is unknown.
fn within<'b, 'a>(number: usize, bodies: &'b [Body<'a>]) -> Option<Vec<&'b Body<'a>>> {
    let body = &bodies[number];
    let mut inner: Vec<&Body> = Vec::new();
    for (i, other) in bodies.iter().enumerate() {
        if i == number || other.is_apart(body) || other.holds(body) {
            continue;
        }
        if !body.holds(other) {
            return None;
        }
        inner.push(other);
    }
    for (i, a) in inner.iter().enumerate() {
        let is_clear = |b: &&Body| a.is_apart(b) || a.holds(b) || b.holds(a);
        if !inner[i + 1..].iter().all(is_clear) {
            return None;
        }
    }
    let is_largest = |a: &&&Body| !inner.iter().any(|b| b.holds(a));
    Some(inner.iter().filter(is_largest).copied().collect())
}

/// Returns the ranges of the coordinates of a grid's unit cube in which a medium emits; `None` if
/// its region is not a box along the axes.
fn grid_range(parts: &Parts, id: MediumId, grid: &VolumeGrid) -> Option<[DVec3; 2]> {
    let bodies = bodies(parts);
    let ends_with_grid = matches!(parts.media[id].sigma_t, VolumeTexture::Grid(_));
    let whole = [DVec3::ZERO, DVec3::ONE];
    if ends_with_grid && is_filled(id, grid.to_world(), whole, &bodies) {
        return Some(whole);
    }
    let mut holders = bodies.iter().filter(|b| b.medium == Some(id));
    let (holder, None) = (holders.next()?, holders.next()) else {
        return None;
    };
    let Some(Shape::Cube(cube)) = holder.shape else {
        return None;
    };
    let to_unit = grid.to_world().inverse();
    let corners = cube.corners().map(|p| to_unit.transform_point3(p));
    let mut range = Aabb::around(corners);
    let hair = ROUNDING * (range.max - range.min);
    let is_corner = |p: &DVec3| {
        let off = (*p - range.min).abs().min((*p - range.max).abs());
        off.cmple(hair).all()
    };
    if !corners.iter().all(is_corner) {
        return None;
    }
    if ends_with_grid {
        range = Aabb::new(range.min.max(DVec3::ZERO), range.max.min(DVec3::ONE));
    }
    let range = [range.min, range.max];
    is_filled(id, grid.to_world(), range, &bodies).then_some(range)
}

/// Returns true if all of a box, given in a grid's coordinates, is in one medium.
fn is_filled(id: MediumId, to_world: DAffine3, [min, max]: [DVec3; 2], bodies: &[Body]) -> bool {
    let corners = Aabb::new(min, max).corners();
    let filled = Body::of_box(corners.map(|p| to_world.transform_point3(p)));
    let is_same = |body: &Body| {
        let Some(Shape::Cube(cube)) = body.shape else {
            return false;
        };
        let hair = ROUNDING * filled.aabb.diagonal();
        let near = |p: &DVec3| cube.corners().iter().any(|q| q.distance(*p) <= hair);
        filled.hull.iter().all(near)
    };
    let holds = |body: &Body| body.holds(&filled) || is_same(body);
    let mut around = Vec::new();
    for body in bodies.iter().filter(|body| !body.is_apart(&filled)) {
        if !holds(body) {
            return false;
        }
        around.push(body);
    }
    let innermost = around
        .into_iter()
        .min_by(|a, b| a.aabb.diagonal().total_cmp(&b.aabb.diagonal()));
    innermost.map_or(id == AMBIENT, |body| body.medium == Some(id))
}

/// Integrates over a box in the coordinates of coincident grids, cell by cell with Gauss's rule,
/// which is exact for products of three linear functions.
fn sum_of_cells(medium: &Medium, grids: &[&VolumeGrid], [min, max]: [DVec3; 2]) -> Spectrum {
    let linear = grids.iter().filter(|g| g.filter() == GridFilter::Trilinear);
    let offsets: &[f64] = match linear.count() {
        0 | 1 => &[0.0],
        _ => &[-0.577_350_269_189_625_8, 0.577_350_269_189_625_8],
    };
    let nodes = [0, 1, 2].map(|axis| nodes(&edges(grids, axis, [min[axis], max[axis]]), offsets));
    let to_world = grids[0].to_world();
    let [xs, ys, zs] = &nodes;
    let layer = |(z, dz): &(f64, f64)| {
        let mut sum = Spectrum::ZERO;
        for (y, dy) in ys {
            for (x, dx) in xs {
                let point = to_world.transform_point3(DVec3::new(*x, *y, *z));
                sum += medium.emitted(point) * (dx * dy * dz);
            }
        }
        sum
    };
    let layers: Vec<Spectrum> = zs.par_iter().map(layer).collect();
    let sum = layers.into_iter().fold(Spectrum::ZERO, |a, b| a + b);
    sum * to_world.matrix3.determinant().abs()
}

/// Returns the ends of the intervals along an axis in which all grids are linear, within a range.
fn edges(grids: &[&VolumeGrid], axis: usize, [min, max]: [f64; 2]) -> Vec<f64> {
    let ends = grids.iter().flat_map(|g| g.intervals(axis));
    let inner = ends.flat_map(|i| i.edges).filter(|u| *u > min && *u < max);
    let mut edges: Vec<f64> = inner.chain([min, max]).collect();
    edges.sort_by(f64::total_cmp);
    edges.dedup();
    edges
}

/// Returns the points and weights of Gauss's rule in each interval.
fn nodes(edges: &[f64], offsets: &[f64]) -> Vec<(f64, f64)> {
    let intervals = edges.windows(2).flat_map(|pair| {
        let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
        let weight = 2.0 * half / offsets.len() as f64;
        offsets.iter().map(move |o| (middle + o * half, weight))
    });
    intervals.collect()
}
