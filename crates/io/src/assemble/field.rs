//! Refractive-index fields: volumes named `ior`.

use super::context::Context;
use super::texture::{affine, read};
use crate::query::{POSITIVE, Query, unknown_plugin};
use crate::scene::{Object, PluginKind};
use eikonal::field::{
    Acoustic, AcousticMode, Affine, Bspline, Constant, FieldError, Fisheye, Gaussian, LinearIndex,
    LinearSquare, Luneburg, Placement, Selfoc, Sum,
};
use eikonal::{Aabb, Field};
use glam::{DAffine3, DVec3};

const KNOWN: [&str; 10] = [
    "constant",
    "linear",
    "linear_square",
    "luneburg",
    "selfoc",
    "fisheye",
    "gaussian",
    "acoustic",
    "bspline",
    "sum",
];

/// The field that a volume describes; `None` after an error.
pub(super) fn build(object: &Object, context: &mut Context) -> Option<Field> {
    if object.plugin == "bspline" {
        return grid(object, context);
    }
    if object.plugin == "sum" {
        return sum(object, context);
    }
    let mut query = Query::new(object, context.diagnostics);
    let field = match analytic(object, &mut query) {
        Some(field) => field,
        None => {
            unknown_plugin(object, &KNOWN, context.diagnostics);
            return None;
        }
    };
    let has_transform = query.has("to_world");
    let matrix = query.transform("to_world");
    let map = affine(matrix, "to_world", &mut query);
    query.finish(&[]);
    let field = context.accept(&object.location, field)?;
    placed(field, has_transform.then_some(map), object, context)
}

fn placed(
    field: Field,
    map: Option<DAffine3>,
    object: &Object,
    context: &mut Context,
) -> Option<Field> {
    match map {
        None => Some(field),
        Some(map) => context
            .accept(&object.location, Affine::new(field, map))
            .map(Field::from),
    }
}

/// Fields given by formulas; `None` if the type is not known.
fn analytic(object: &Object, q: &mut Query) -> Option<Result<Field, FieldError>> {
    let origin = DVec3::ZERO;
    Some(match object.plugin.as_str() {
        "constant" => Ok(Constant::new(q.float_in("value", POSITIVE, None)).into()),
        "linear" => {
            let (n0, slope) = (q.float_in("n0", POSITIVE, None), q.vector("slope"));
            LinearIndex::new(n0, slope, q.point_or("origin", origin)).map(Field::from)
        }
        "linear_square" => {
            let (n0, slope) = (q.float_in("n0", POSITIVE, None), q.vector("slope"));
            LinearSquare::new(n0, slope, q.point_or("origin", origin)).map(Field::from)
        }
        "luneburg" => {
            let n = q.float_in("n_exterior", POSITIVE, 1.0);
            let center = q.point_or("center", origin);
            Luneburg::new(n, center, q.float_in("radius", POSITIVE, 1.0)).map(Field::from)
        }
        "selfoc" => {
            let n0 = q.float_in("n0", POSITIVE, None);
            let alpha = q.float_in("alpha", 0.0.., None);
            let (o, d) = (
                q.point_or("origin", origin),
                q.vector_or("direction", DVec3::Z),
            );
            Selfoc::new(n0, alpha, o, d).map(Field::from)
        }
        "fisheye" => {
            let n0 = q.float_in("n0", POSITIVE, 2.0);
            let center = q.point_or("center", origin);
            Fisheye::new(n0, center, q.float_in("radius", POSITIVE, 1.0)).map(Field::from)
        }
        "gaussian" => {
            let n0 = q.float_in("n0", POSITIVE, None);
            let delta = q.float("delta");
            let center = q.point_or("center", origin);
            Gaussian::new(n0, delta, center, q.float_in("width", POSITIVE, None)).map(Field::from)
        }
        "acoustic" => acoustic(q),
        _ => return None,
    })
}

fn acoustic(q: &mut Query) -> Result<Field, FieldError> {
    let n0 = q.float_in("n0", POSITIVE, None);
    let origin = q.point_or("origin", DVec3::ZERO);
    let direction = q.vector_or("direction", DVec3::Z);
    let perpendicular = direction.any_orthogonal_vector();
    let reference = q.vector_or("reference", perpendicular);
    let modes = if q.has("amplitude") {
        vec![mode(q)?]
    } else {
        let children = q.children(PluginKind::Volume);
        if let Some(other) = children.iter().find(|c| c.plugin != "mode") {
            let message = format!(
                "an acoustic field takes <volume type=\"mode\">, not '{}'",
                other.plugin
            );
            q.error("amplitude", message);
        }
        let modes = children.into_iter().map(|child| q.nested(child, mode));
        let modes: Vec<_> = modes.collect::<Result<_, _>>()?;
        if modes.is_empty() {
            q.error(
                "amplitude",
                "an acoustic field needs an amplitude, or nested <volume type=\"mode\">",
            );
        }
        modes
    };
    Ok(Acoustic::new(n0, origin, direction, reference, modes)?.into())
}

/// One mode; its wave number is given as such, or by frequency and speed of sound.
fn mode(q: &mut Query) -> Result<AcousticMode, FieldError> {
    let amplitude = q.float("amplitude");
    let order = q.integer_in("order", 0..=64, 0) as u16;
    let phase = q.float_or("phase", 0.0);
    if q.has("frequency") || q.has("sound_speed") {
        let frequency = q.float_in("frequency", POSITIVE, None);
        let speed = q.float_in("sound_speed", POSITIVE, None);
        if q.has("wave_number") {
            q.error(
                "wave_number",
                "give frequency and sound_speed, or wave_number, not both",
            );
        }
        return AcousticMode::from_frequency(amplitude, order, frequency, speed, phase);
    }
    AcousticMode::new(
        amplitude,
        order,
        q.float_in("wave_number", POSITIVE, None),
        phase,
    )
}

/// Samples of n, interpolated by tricubic B-splines, in the box that `to_world` makes of the unit
/// cube.
fn grid(object: &Object, context: &mut Context) -> Option<Field> {
    // In double precision: rounding of n to single would drown contrasts of 1e-6.
    let (volume, source) = read::<f64>(object, context);
    let mut query = Query::new(object, context.diagnostics);
    for known in ["filename", "axis_order", "to_world"] {
        query.has(known);
    }
    if !query.has("placement") {
        let message = "a bspline volume needs <string name=\"placement\">: \"centers\" if samples \
                       sit at voxel centres, \"nodes\" if the outermost lie on the bounds";
        query.error("filename", message);
    }
    query.finish(&[]);
    let volume = volume?;
    if volume.channels() != 1 {
        let message = format!(
            "a refractive index has one channel, this has {}",
            volume.channels()
        );
        context.error_at(&object.location, message);
        return None;
    }
    let placement = [Placement::Centers, Placement::Nodes][source.placement];
    let map = source.to_world;
    // An axis-aligned box needs no transform at run time.
    let diagonal = glam::DMat3::from_diagonal(map.matrix3.diagonal());
    let aligned = map.matrix3 == diagonal && diagonal.diagonal().min_element() > 0.0;
    let (bounds, rest) = if aligned {
        (
            Aabb::new(map.translation, map.transform_point3(DVec3::ONE)),
            None,
        )
    } else {
        (Aabb::new(DVec3::ZERO, DVec3::ONE), Some(map))
    };
    let field = Bspline::from_samples(volume.size(), bounds, placement, volume.data());
    let field = context.accept(&object.location, field)?.into();
    placed(field, rest, object, context)
}

fn sum(object: &Object, context: &mut Context) -> Option<Field> {
    let mut query = Query::new(object, context.diagnostics);
    let reference = query.float_in("reference", POSITIVE, 1.0);
    let terms = query.children(PluginKind::Volume);
    let has_transform = query.has("to_world");
    let matrix = query.transform("to_world");
    let map = affine(matrix, "to_world", &mut query);
    query.finish(&[]);
    let terms: Option<Vec<Field>> = terms.into_iter().map(|t| build(t, context)).collect();
    let field = context.accept(&object.location, Sum::new(reference, terms?))?;
    placed(field.into(), has_transform.then_some(map), object, context)
}
