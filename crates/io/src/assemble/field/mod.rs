//! Refractive-index fields: volumes named `ior`.

mod acoustic;
mod air;
mod atmosphere;
mod condense;
mod dispersion;
mod expression;
mod grid;
mod oscillating;
mod profile;
mod rounding;
mod sampled_waves;
mod transducer;
mod wave;
mod wave_fit;

pub use condense::CondensedGrid;

use super::context::Context;
use super::described::DISPERSION_LAWS;
use super::placed_grid::{Placed, Quantity};
use super::transforms::affine;
use crate::query::{Query, misplaced_plugin};
use crate::scene::{ObjectDescription, PluginKind};
use crate::schema;
use eikonal::Field;
use eikonal::field::{
    Affine, Constant, FieldError, Fisheye, Gaussian, LinearIndex, LinearSquare, Luneburg, Selfoc,
    Sum,
};
use glam::DAffine3;

/// Volumes that are not an index themselves.
const NO_INDEX: [&str; 3] = ["mode", "gridvolume", "constvolume"];

/// Returns the index that an object gives under a name, as a number or a nested volume; `None`
/// without an index, or after an error.
pub(super) fn named(
    object: &ObjectDescription,
    name: &str,
    context: &mut Context,
) -> Option<Field> {
    let mut query = Query::new(object, context.diagnostics);
    if !query.has(name) {
        return None;
    }
    let is_volume = object
        .children
        .iter()
        .any(|c| c.name.as_deref() == Some(name));
    if is_volume {
        let volume = query.role(PluginKind::Volume, name)?;
        return build(volume, context);
    }
    Some(Constant::new(query.float(name)).into())
}

/// Builds the field that a volume describes, or returns it if it was built before; `None` after an
/// error.
pub(super) fn build(object: &ObjectDescription, context: &mut Context) -> Option<Field> {
    context.once(
        |assets| &mut assets.fields,
        object.number,
        |context| built(object, context),
    )
}

fn built(object: &ObjectDescription, context: &mut Context) -> Option<Field> {
    match object.plugin.as_str() {
        "bspline" | "gladstone_dale" | "pressure" => return grid::build(object, context),
        "transducer" => return transducer::build(object, context),
        "sum" => return sum(object, context),
        plugin if DISPERSION_LAWS.contains(&plugin) => return dispersion::build(object, context),
        _ => {}
    }
    let disperses = object.plugin == "standard_atmosphere";
    let nm = disperses.then(|| context.wavelength()).flatten();
    let files = &mut *context.files;
    let mut query = Query::new(object, context.diagnostics);
    let mut table = None;
    // `None` means that an error has been reported.
    let field = match object.plugin.as_str() {
        "expression" => expression::build(&mut query).map(Ok),
        "profile" => profile::build(&mut query, files).map(|(field, extent)| {
            table = Some(extent);
            field
        }),
        "standard_atmosphere" => atmosphere::build(&mut query, nm),
        _ => match analytic(object, &mut query) {
            Some(field) => Some(field),
            None => {
                let plugins = schema::plugins(object.kind).iter();
                let names = plugins.map(|plugin| plugin.name);
                let known: Vec<&str> = names.filter(|name| !NO_INDEX.contains(name)).collect();
                misplaced_plugin(object, &known, context.diagnostics);
                return None;
            }
        },
    };
    let has_transform = query.has("to_world");
    let matrix = query.transform("to_world");
    let map = affine(matrix, "to_world", &mut query);
    query.finish(&[]);
    let grids = table.map(|extent| Placed::new(Quantity::Table, map * extent, &object.location));
    context.grids.extend(grids);
    let field = context.accept(&object.location, field?)?;
    placed(field, has_transform.then_some(map), object, context)
}

/// Reads the elasto-optic coefficient η = ρc² ∂n/∂p of sound, if the scene gives it.
fn elasto_optic(q: &mut Query) -> Option<f64> {
    let name = "elasto_optic";
    q.float_if_given(name)
}

/// Applies a map, if any, to a field; `None` after an error.
fn placed(
    field: Field,
    map: Option<DAffine3>,
    object: &ObjectDescription,
    context: &mut Context,
) -> Option<Field> {
    match map {
        None => Some(field),
        Some(map) => context
            .accept(&object.location, Affine::new(field, map))
            .map(Field::from),
    }
}

/// Builds a field given by parameters of a formula; `None` for an unknown type.
fn analytic(object: &ObjectDescription, q: &mut Query) -> Option<Result<Field, FieldError>> {
    Some(match object.plugin.as_str() {
        "constant" => Ok(Constant::new(q.float("value")).into()),
        "linear" => {
            let (n0, slope) = (q.float("n0"), q.vector("slope"));
            LinearIndex::new(n0, slope, q.point("origin")).map(Field::from)
        }
        "linear_square" => {
            let (n0, slope) = (q.float("n0"), q.vector("slope"));
            LinearSquare::new(n0, slope, q.point("origin")).map(Field::from)
        }
        "luneburg" => {
            let n = q.float("n_exterior");
            let center = q.point("center");
            Luneburg::new(n, center, q.float("radius")).map(Field::from)
        }
        "selfoc" => {
            let n0 = q.float("n0");
            let alpha = q.float("alpha");
            let (o, d) = (q.point("origin"), q.vector("direction"));
            Selfoc::new(n0, alpha, o, d).map(Field::from)
        }
        "fisheye" => {
            let n0 = q.float("n0");
            let center = q.point("center");
            Fisheye::new(n0, center, q.float("radius")).map(Field::from)
        }
        "gaussian" => {
            let n0 = q.float("n0");
            let delta = q.float("delta");
            let center = q.point("center");
            Gaussian::new(n0, delta, center, q.float("width")).map(Field::from)
        }
        "acoustic" => acoustic::build(q),
        _ => return None,
    })
}

/// Builds the sum of several fields; `None` after an error.
fn sum(object: &ObjectDescription, context: &mut Context) -> Option<Field> {
    let mut query = Query::new(object, context.diagnostics);
    let reference = query.float("reference");
    let terms = query.children(PluginKind::Volume);
    let has_transform = query.has("to_world");
    let matrix = query.transform("to_world");
    let map = affine(matrix, "to_world", &mut query);
    query.finish(&[]);
    let before = [context.grids.len(), context.sounds.len()];
    let terms: Option<Vec<Field>> = terms.into_iter().map(|t| build(t, context)).collect();
    let grids = context.grids.iter_mut().skip(before[0]);
    grids.for_each(|grid| grid.to_world = map * grid.to_world);
    let sounds = context.sounds.iter_mut().skip(before[1]);
    sounds.for_each(|sound| sound.to_world = map * sound.to_world);
    let field = context.accept(&object.location, Sum::new(reference, terms?))?;
    placed(field.into(), has_transform.then_some(map), object, context)
}
