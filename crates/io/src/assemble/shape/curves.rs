//! Curves from files.

use crate::mesh::curves;
use crate::query::Query;
use crate::scene::{FileRegistry, ObjectDescription};
use glam::DAffine3;
use transport::shape::{Mesh, ShapeError};

/// The curves that a shape names, as triangles; `None` if the file cannot be read (reported then). Transforms move
/// their points and leave their radii.
pub(super) fn geometry(
    object: &ObjectDescription,
    frame: DAffine3,
    q: &mut Query,
    files: &mut FileRegistry,
) -> Option<Result<Mesh, ShapeError>> {
    let path = q.path("filename", files);
    // Only what follows gradients needs it.
    q.float_or("silhouette_sampling_weight", 1.0);
    let read = curves::read(&path, files.limits());
    let read = read.map_err(|e| q.file_error("filename", &e)).ok()?;
    let curves = curves::moved(read, frame);
    let mesh = match object.plugin.as_str() {
        "linearcurve" => curves::lines(&curves),
        _ => curves::splines(&curves),
    };
    let mesh = mesh.map_err(|problem| q.error("filename", problem.to_string()));
    let mesh = mesh.ok()?;
    Some(super::mesh::built(mesh, false))
}
