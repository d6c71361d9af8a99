//! Groups of shapes that are placed several times.

use super::super::context::Context;
use super::super::transforms::affine;
use super::{add_at, merge};
use crate::query::Query;
use crate::scene::{ObjectDescription, PluginKind};
use glam::DAffine3;

/// Maximum number of shapes in all copies together. They take some gigabytes of memory.
const MAX_COPIES: usize = 10_000_000;

/// Returns false, and reports an error, if the scene's instances make too many copies.
pub(in super::super) fn fit(shapes: &[&ObjectDescription], context: &mut Context) -> bool {
    let holds = |o: &ObjectDescription| ["instance", "merge"].contains(&o.plugin.as_str());
    let holders = || shapes.iter().filter(|shape| holds(shape));
    let copies: usize = holders().map(|shape| shapes_in(shape)).sum();
    if let (true, Some(first)) = (copies > MAX_COPIES, holders().next()) {
        let message =
            format!("the instances make {copies} shapes: at most {MAX_COPIES} are possible");
        context.error_at(&first.location, message);
    }
    copies <= MAX_COPIES
}

/// Returns the number of shapes for which a shape stands.
fn shapes_in(shape: &ObjectDescription) -> usize {
    if !["instance", "merge", "shapegroup"].contains(&shape.plugin.as_str()) {
        return 1;
    }
    let children = shape.children.iter().map(|c| &c.object);
    let shapes = children.filter(|c| c.kind == PluginKind::Shape);
    shapes.map(|c| shapes_in(c)).sum()
}

/// Adds a copy of the shapes of a group. Each instance takes the memory of its shapes.
pub(super) fn add(object: &ObjectDescription, context: &mut Context) {
    let mut q = Query::new(object, context.diagnostics);
    let group = q.child(PluginKind::Shape).cloned();
    let matrix = q.transform("to_world");
    let frame = affine(matrix, "to_world", &mut q);
    q.finish(&[]);
    let Some(group) = group.filter(|g| g.plugin == "shapegroup") else {
        let message = "an instance needs a shape of type 'shapegroup', nested or referenced";
        return context.error_at(&object.location, message);
    };
    // Report the errors of a group only once.
    if context.refused_groups.contains(&group.number) {
        return;
    }
    let errors = context.diagnostics.error_count();
    let mut q = Query::new(&group, context.diagnostics);
    let shapes = q.children(PluginKind::Shape);
    q.finish(&[]);
    for shape in shapes {
        add_member(shape, frame, context);
    }
    if context.diagnostics.error_count() > errors {
        context.refused_groups.insert(group.number);
    }
}

/// Adds a shape of a group at the position of an instance.
fn add_member(shape: &ObjectDescription, frame: DAffine3, context: &mut Context) {
    match shape.plugin.as_str() {
        "shapegroup" | "instance" => {
            let message = "a shapegroup must contain shapes, not groups or instances";
            context.error_at(&shape.location, message);
        }
        "labels" | "tetrahedra" => {
            let message = "instances cannot copy volumes of labels and tetrahedra: put them directly into the scene";
            context.error_at(&shape.location, message);
        }
        "merge" => merge(
            shape,
            |shape, context| add_member(shape, frame, context),
            context,
        ),
        _ => add_at(shape, Some(frame), context),
    }
}
