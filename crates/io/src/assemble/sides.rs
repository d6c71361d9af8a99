//! Media on both sides of each surface, and their indices.
//!
//! A medium's own `ior` decides. A dielectric's `int_ior` and `ext_ior` give the index where no
//! medium does; where both give one, they must agree. A side without a description belongs to the
//! medium that surrounds the shape.

use super::context::{Context, IndexSource};
use super::side_request::SideRequest;
use crate::diagnostic::difference;
use crate::diagnostic::{Diagnostic, Location, lints};
use eikonal::field::Constant;
use eikonal::{Aabb, Shown};
use glam::DVec3;
use std::ops::Range;
use transport::bsdf::Bsdf;
use transport::medium::Medium;
use transport::scene::{AMBIENT, Bodies, Containment, MediumId, Partition, Sides};

/// Default index inside a dielectric: Mitsuba's default, BK7 glass.
const DEFAULT_INNER: f64 = 1.5046;
/// Difference below which two indices count as equal. It covers the difference between air and
/// vacuum.
const INDEX_TOLERANCE: f64 = 3e-4;

/// Determines the media and indices on both sides of all objects.
pub(super) fn settle(context: &mut Context) {
    // Determine the medium inside each object.
    let side_requests = std::mem::take(&mut context.side_requests);
    for (i, request) in side_requests.iter().enumerate() {
        let interior = interior(i, request, context);
        // Determine the exterior later, because it depends on all interiors.
        context.objects[i].sides = interior.map(|interior| Sides {
            interior,
            exterior: AMBIENT,
        });
    }
    // Determine the sides of divided volumes.
    divide(context);
    // Determine the medium outside each other object.
    let bodies = Bodies::new(&context.objects, &context.partitions);
    for (i, request) in side_requests.iter().enumerate() {
        let speaks = request.exterior.is_some() || context.objects[i].sides.is_some();
        let divides = context.partitions.iter().any(|p| p.objects.contains(&i));
        if !speaks || divides {
            continue;
        }
        let exterior = request
            .exterior
            .unwrap_or_else(|| surrounding(i, &bodies, context));
        if request.exterior.is_none() && exterior != AMBIENT {
            let difference = match request.interior {
                Some(_) => Some(difference::EXTERIOR),
                None => {
                    (!context.media[exterior].is_transparent()).then_some(difference::CLEAR_GLASS)
                }
            };
            context.differences.extend(difference);
        }
        let interior = context.objects[i].interior().unwrap_or(exterior);
        context.objects[i].sides = Some(Sides { interior, exterior });
    }
    for (i, request) in side_requests.iter().enumerate() {
        if let Some(sides) = context.objects[i].sides {
            apply_indices(i, request, sides, context);
        }
    }
    match_divided(context);
}

/// Determines the sides of divided volumes, larger volumes first, since smaller ones may lie in
/// them.
fn divide(context: &mut Context) {
    context.partitions = context
        .divided
        .iter()
        .map(|divided| Partition {
            objects: divided.objects.clone(),
            exterior: AMBIENT,
            cells: divided.cells.clone(),
        })
        .collect();
    if context.partitions.is_empty() {
        return;
    }
    let bodies = Bodies::new(&context.objects, &context.partitions);
    for i in by_size(context) {
        let divided = &context.divided[i];
        let outer = divided.sides.iter().position(|s| s.contains(&None));
        let around = || surrounding(divided.objects.start + outer.unwrap_or(0), &bodies, context);
        let exterior = divided.exterior.unwrap_or_else(around);
        let (index, location) = (divided.outer_index, divided.location.clone());
        for (object, sides) in divided.objects.clone().zip(divided.sides.clone()) {
            let [interior, exterior] = sides.map(|side| side.unwrap_or(exterior));
            context.objects[object].sides = Some(Sides { interior, exterior });
        }
        context.partitions[i].exterior = exterior;
        if let Some(n) = index {
            set_index(exterior, n, "the index of label 0", &location, context);
        }
    }
}

/// Returns the divided volumes in descending order of size.
fn by_size(context: &Context) -> Vec<usize> {
    let size = |i: &usize| {
        let objects = context.divided[*i].objects.clone();
        let boxes = context.objects[objects].iter().map(|o| o.shape.aabb());
        boxes.fold(Aabb::EMPTY, Aabb::union).diagonal()
    };
    let mut order: Vec<usize> = (0..context.divided.len()).collect();
    order.sort_by(|a, b| size(b).total_cmp(&size(a)));
    order
}

/// Gives media of labels without an index the index of the surrounding medium. Surfaces between
/// equal indices become null surfaces, except where other objects may touch them.
fn match_divided(context: &mut Context) {
    for i in by_size(context) {
        let Partition {
            objects, exterior, ..
        } = context.partitions[i].clone();
        let around = context.media[exterior].index.clone();
        for k in objects.clone() {
            let Some(sides) = context.objects[k].sides else {
                continue;
            };
            for id in [sides.interior, sides.exterior] {
                if id != exterior && std::mem::take(&mut context.index_open[id]) {
                    context.media[id].index = around.clone();
                }
            }
            let [near, far] = [sides.interior, sides.exterior].map(|id| &context.media[id].index);
            let alike = near.is_constant()
                && far.is_constant()
                && near.n2(DVec3::ZERO) == far.n2(DVec3::ZERO);
            if alike && !is_near_others(k, &objects, context) {
                context.objects[k].bsdf = Bsdf::Null;
            }
        }
    }
}

/// Returns true if an object lies near another object that separates media and is outside the range
/// `own`.
fn is_near_others(object: usize, own: &Range<usize>, context: &Context) -> bool {
    let aabb = context.objects[object].shape.aabb();
    let aabb = aabb.grown(1e-9 * aabb.diagonal());
    let others = context.objects.iter().enumerate();
    others
        .filter(|(i, o)| !own.contains(i) && o.sides.is_some())
        .any(|(_, o)| aabb.overlaps(&o.shape.aabb()))
}

/// Returns the medium inside an object. A dielectric without a medium encloses a transparent one.
fn interior(i: usize, request: &SideRequest, context: &mut Context) -> Option<MediumId> {
    if request.interior.is_some() || request.indices.is_none() {
        return request.interior;
    }
    let name = format!("inside of {}", context.objects[i].name);
    let place = Some(context.places.objects[i].clone());
    let medium = Medium::transparent(name, Constant::new(1.0));
    Some(context.add_medium(medium, true, place))
}

/// Returns the medium around an object, or around the volume that it divides: the medium of the
/// innermost other object that contains it.
fn surrounding(i: usize, bodies: &Bodies, context: &Context) -> MediumId {
    let containment = Containment {
        objects: &context.objects,
        partitions: &context.partitions,
        bodies,
    };
    let point = context.objects[i].shape.sample_area([0.31, 0.64]).position;
    containment.medium_around(i, point)
}

/// Sets the indices that a dielectric requests for the media on its sides.
fn apply_indices(object: usize, request: &SideRequest, sides: Sides, context: &mut Context) {
    let Some(indices) = &request.indices else {
        return;
    };
    let inner = indices
        .inner
        .or_else(|| context.index_open[sides.interior].then_some(DEFAULT_INNER));
    if let Some(n) = inner {
        set_index(sides.interior, n, "int_ior", &indices.location, context);
    }
    if let Some(n) = indices.outer
        && !meets_other_glass(object, n, sides.exterior, context)
    {
        set_index(sides.exterior, n, "ext_ior", &indices.location, context);
    }
}

/// Returns true, and reports a warning, if a dielectric lies inside another dielectric with an
/// index other than `n`. `n` is the `ext_ior` of the inner dielectric. Programs that export scenes
/// write the index of air around all shapes.
fn meets_other_glass(object: usize, n: f64, exterior: MediumId, context: &mut Context) -> bool {
    let other = context
        .objects
        .iter()
        .position(|o| o.interior() == Some(exterior));
    let inner = |other: &usize| {
        context.index_from.get(&exterior).filter(|from| {
            *other != object && from.name == "int_ior" && context.media[exterior].is_transparent()
        })
    };
    let Some((other, _)) = other.and_then(|other| Some((other, inner(&other)?))) else {
        return false;
    };
    let own = context.media[exterior].index.n(DVec3::ZERO);
    if (own - n).abs() < INDEX_TOLERANCE {
        return false;
    }
    let named = |i: usize| {
        format!(
            "'{}' at {}",
            context.objects[i].name, context.places.objects[i]
        )
    };
    let message = format!(
        "{} overlaps {}, or lies in it: there its ext_ior {} is taken as {}, the int_ior of the other",
        named(object),
        named(other),
        Shown(n),
        Shown(own)
    );
    let help =
        "where two shapes overlap, the smaller one counts: move them apart, or leave out ext_ior";
    let warning = lints::warning(lints::GLASS_IN_GLASS, message).help(help.to_owned());
    context
        .diagnostics
        .push(warning.at(&context.places.objects[object]));
    true
}

/// Sets the index of a medium, or reports that it has another index.
fn set_index(id: MediumId, n: f64, name: &'static str, location: &Location, context: &mut Context) {
    let medium = &mut context.media[id];
    if context.index_open[id] {
        medium.index = Constant::new(n).into();
        context.index_open[id] = false;
        let location = location.clone();
        context
            .index_from
            .insert(id, IndexSource { name, location });
        return;
    }
    let own = medium
        .index
        .is_constant()
        .then(|| medium.index.n(DVec3::ZERO));
    let off = own.map_or(f64::INFINITY, |own| (own - n).abs());
    if off < 1e-12 {
        return;
    }
    let said = Shown(n);
    let diagnostic = match (own, context.index_from.get(&id)) {
        (Some(own), Some(source)) => {
            let own = format!("{}, by {} at {}", Shown(own), source.name, source.location);
            if off < INDEX_TOLERANCE {
                lints::warning(
                    lints::CONTRADICTING_INDEX,
                    format!("{name} {said} is taken as {own}"),
                )
            } else {
                Diagnostic::error(format!(
                    "{name} is {said}, but the index on that side is {own}"
                ))
                .help(String::from("leave one of them out, or make them agree"))
            }
        }
        _ => {
            let message = format!(
                "{name} is {said}, but medium '{}' on that side has an index of its own",
                medium.name
            );
            Diagnostic::error(message).help(format!("leave {name} out, or make them agree"))
        }
    };
    context.diagnostics.push(diagnostic.at(location));
}
