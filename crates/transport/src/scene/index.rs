//! Search for the objects that a ray meets.

use super::containment::by_size;
use super::parts::Object;
use crate::bsdf::Bsdf;
use crate::shape::{Accel, Intersection, Shape};
use eikonal::Aabb;
use eikonal::ray::Arc;
use glam::DVec3;
use std::cmp::Ordering;

/// Orders coincident surfaces by the order in which they act. Opaque surfaces come first, then
/// scattering surfaces, smooth dielectrics, and null surfaces, which only declare a boundary.
/// Within a kind, emitters come first; then the order is [by size](by_size).
pub(super) fn precedence([a, b]: [&Object; 2], [box_a, box_b]: [&Aabb; 2]) -> Ordering {
    let by_class = class(a).cmp(&class(b));
    by_class
        .then(b.emitter.is_some().cmp(&a.emitter.is_some()))
        .then_with(|| by_size((box_a, &a.name), (box_b, &b.name)))
}

/// Returns the position of an object's kind in the order of [`precedence`].
pub(super) fn class(object: &Object) -> u8 {
    match &object.bsdf {
        Bsdf::Null => 3,
        Bsdf::Dielectric(_) => 2,
        other => u8::from(!other.is_opaque()),
    }
}

/// Sorts objects, given by their indices, by [`precedence`].
pub(super) fn sort_by_precedence(numbers: &mut [usize], objects: &[Object]) {
    let boxes: Vec<Aabb> = objects.iter().map(|o| o.shape.aabb()).collect();
    // Planted error "coincident surfaces in the order of the list", found by morgana-io/io::placement::the_order_of_coincident_objects_does_not_matter:
    // (no line)
    numbers.sort_by(|&a, &b| precedence([&objects[a], &objects[b]], [&boxes[a], &boxes[b]]));
}

/// A selection of objects, for intersection tests.
#[derive(Debug)]
pub(super) struct Index {
    /// Indices of the objects; rays meet the first of coincident surfaces.
    pub objects: Vec<usize>,
    /// Position of each object in the list.
    places: Vec<Option<usize>>,
    pub shapes: Vec<Shape>,
    pub accel: Accel,
}

impl Index {
    pub(super) fn new(objects: &[Object], keep: impl Fn(&Object) -> bool) -> Self {
        let mut kept: Vec<usize> = (0..objects.len()).filter(|i| keep(&objects[*i])).collect();
        sort_by_precedence(&mut kept, objects);
        let mut places = vec![None; objects.len()];
        for (place, object) in kept.iter().enumerate() {
            places[*object] = Some(place);
        }
        let shapes: Vec<Shape> = kept.iter().map(|i| objects[*i].shape.clone()).collect();
        Index {
            accel: Accel::new(&shapes),
            objects: kept,
            places,
            shapes,
        }
    }

    /// Returns a surface within `distance` of a point along a unit `normal`, and its normal there;
    /// skips `except`.
    pub(super) fn touching(
        &self,
        x: DVec3,
        normal: DVec3,
        distance: f64,
        except: Option<usize>,
    ) -> Option<(usize, DVec3)> {
        let arc = Arc::line(x - normal * distance, normal, 2.0 * distance);
        let (i, intersection) = self.first(&arc, 0.0, self.place(except))?;
        Some((self.objects[i], self.shapes[i].hit(&intersection).normal))
    }

    /// Returns the surfaces within `distance` of a point along a unit `direction`, each with its
    /// normal there.
    pub(super) fn within(
        &self,
        x: DVec3,
        direction: DVec3,
        distance: f64,
    ) -> impl Iterator<Item = (usize, DVec3)> {
        let arc = Arc::line(x - direction * distance, direction, 2.0 * distance);
        let mut from = 0.0;
        std::iter::from_fn(move || {
            let (i, intersection) = self.first(&arc, from, None)?;
            from = intersection.theta;
            Some((self.objects[i], self.shapes[i].hit(&intersection).normal))
        })
    }

    fn first(&self, arc: &Arc, from: f64, except: Option<usize>) -> Option<(usize, Intersection)> {
        if self.objects.is_empty() {
            return None;
        }
        self.accel
            .first(&self.shapes, arc, [from, 1.0], [except, None])
    }

    /// Returns the position of an object in the list, if the list contains it.
    pub(super) fn place(&self, object: Option<usize>) -> Option<usize> {
        self.places[object?]
    }
}
