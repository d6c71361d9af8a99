//! Curves from files.

use crate::diagnostic::lints;
use crate::mesh::{curves, hair};
use crate::query::Query;
use crate::scene::{FileRegistry, ObjectDescription};
use glam::DAffine3;
use transport::shape::{Mesh, ShapeError};

/// Builds the curves that a shape names as triangles; `None` if the file cannot be read (reported).
/// Transforms move the points of the curves and keep their radii.
pub(super) fn geometry(
    object: &ObjectDescription,
    frame: DAffine3,
    q: &mut Query,
    files: &mut FileRegistry,
) -> Option<Result<Mesh, ShapeError>> {
    if object.plugin == "hair" {
        return hair(frame, q, files);
    }
    let path = q.path("filename", files);
    // Accept a parameter that only Mitsuba's gradients need.
    q.float("silhouette_sampling_weight");
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

/// Builds strands of hair as balls swept along them. Transforms scale the radius of the strands as
/// they scale local z.
fn hair(
    frame: DAffine3,
    q: &mut Query,
    files: &mut FileRegistry,
) -> Option<Result<Mesh, ShapeError>> {
    let path = q.path("filename", files);
    let radius = q.float("radius");
    // Accept Mitsuba's threshold for leaving out segments.
    q.float("angle_threshold");
    if q.float("reduction") > 0.0 {
        q.warning(
            lints::IGNORED,
            "reduction",
            "all strands are kept: 'reduction' is ignored",
        );
    }
    let read = hair::read(&path, files.limits());
    let strands = read.map_err(|e| q.file_error("filename", &e)).ok()?;
    let radius = radius * frame.matrix3.z_axis.length();
    let curves = curves::moved(hair::with_radius(strands, radius), frame);
    let mesh = curves::lines(&curves).map_err(|problem| q.error("filename", problem.to_string()));
    Some(super::mesh::built(mesh.ok()?, false))
}
