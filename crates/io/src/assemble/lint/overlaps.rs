//! Check for closed shapes of different media that overlap, where one medium must be chosen.

use super::super::context::Context;
use crate::diagnostic::lints;
use transport::sampling::Sampler;
use transport::scene::Object;

/// Number of points tested per surface.
const PROBES: u64 = 64;
/// Depth of the tested points under the surface, relative to the size of the shape. Shapes that
/// only touch do not overlap at this depth.
const PROBE_DEPTH: f64 = 1e-6;
/// Maximum number of pairs of shapes that are tested.
const MAX_PAIRS: usize = 1000;

/// Adds a note about the first two shapes whose media overlap, and about the medium that is used.
pub(in super::super) fn note(context: &mut Context) {
    let Some([a, b]) = first(context) else {
        return;
    };
    let size = |i: usize| context.objects[i].shape.aabb().diagonal();
    let named = |i: usize| {
        format!(
            "'{}' at {}",
            context.objects[i].name, context.places.objects[i]
        )
    };
    let (inner, outer) = if size(b) < size(a) { (b, a) } else { (a, b) };
    let message = format!(
        "{} and {} overlap in part: the medium of the first counts in the overlap",
        named(inner),
        named(outer)
    );
    let help = "where closed shapes overlap, the one with the smallest bounding box counts, and of equal ones the first by name";
    let note = lints::note(lints::OVERLAPPING_MEDIA, message).help(help.to_owned());
    context
        .diagnostics
        .push(note.at(&context.places.objects[inner]));
}

/// Returns the numbers of two overlapping objects, the smaller number first.
fn first(context: &Context) -> Option<[usize; 2]> {
    // Collect pairs of bodies with overlapping boxes, by a sweep along x.
    let divides = |i: usize| context.partitions.iter().any(|p| p.objects.contains(&i));
    let holds = |i: &usize| encloses(&context.objects[*i]) && !divides(*i);
    let mut bodies: Vec<usize> = (0..context.objects.len()).filter(holds).collect();
    let aabb = |i: usize| context.objects[i].shape.aabb();
    bodies.sort_by(|a, b| aabb(*a).min.x.total_cmp(&aabb(*b).min.x));
    let mut pairs = Vec::new();
    for (rank, &a) in bodies.iter().enumerate() {
        let later = bodies[rank + 1..].iter().copied();
        let near = later.take_while(|b| aabb(*b).min.x <= aabb(a).max.x);
        let near = near.filter(|b| aabb(a).overlaps(&aabb(*b)));
        pairs.extend(
            near.take(MAX_PAIRS - pairs.len())
                .map(|b| [a.min(b), a.max(b)]),
        );
        if pairs.len() == MAX_PAIRS {
            break;
        }
    }
    pairs.sort_unstable();
    let overlaps = |pair: &[usize; 2]| overlap(pair.map(|i| &context.objects[i]));
    pairs.into_iter().find(overlaps)
}

/// Returns true if an object encloses a medium other than its surroundings.
fn encloses(object: &Object) -> bool {
    let differs = object.sides.is_some_and(|s| s.interior != s.exterior);
    differs && object.shape.is_closed() && !object.bsdf.is_opaque()
}

/// Returns true if two objects with different media overlap and neither lies inside the other: the
/// surface of each lies on both sides of the other's surface.
fn overlap([a, b]: [&Object; 2]) -> bool {
    a.interior() != b.interior() && crosses(a, b) && crosses(b, a)
}

/// Returns true if some points just under the surface of `a` lie in `b` and others do not.
fn crosses(a: &Object, b: &Object) -> bool {
    let depth = PROBE_DEPTH * a.shape.aabb().diagonal();
    let inside = |k: u64| {
        let sample = a.shape.sample_area(Sampler::new(1, k, 0).next_2d());
        let inward = if a.shape.has_flipped_normals() {
            sample.normal
        } else {
            -sample.normal
        };
        b.shape.contains(sample.position + depth * inward)
    };
    let first = inside(0);
    (1..PROBES).any(|k| inside(k) != first)
}
