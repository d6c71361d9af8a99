//! Indices sampled on a grid, or following from samples of a density or a pressure.

use super::super::context::Context;
use super::super::texture::{SOURCE, read};
use super::{air, placed};
use crate::query::{POSITIVE, Query};
use crate::scene::Object;
use eikonal::field::{Bspline, Placement};
use eikonal::{Aabb, Field};
use glam::{DMat3, DVec3};

/// More than any liquid or gas has, in 1/Pa; water has 1.4e-10.
const LARGEST_DN_DP: f64 = 1e-6;
/// An index below this is a mistake of units: no matter that light passes has one.
const LEAST_INDEX: f64 = 0.9;

/// What a sample q says of the index: n = `n0` + `slope` (q − `reference`).
struct Law {
    n0: f64,
    slope: f64,
    reference: f64,
}

/// The field of a volume of type `bspline`, `gladstone_dale` or `pressure`: samples, interpolated by
/// tricubic B-splines, in the box that `to_world` makes of the unit cube or of the file's own box.
pub(super) fn build(object: &Object, context: &mut Context) -> Option<Field> {
    // In double precision: rounding of n to single would drown contrasts of 1e-6.
    let (volume, source) = read::<f64>(object, context);
    let nm = context.channels.wavelength(context.group);
    let mut query = Query::new(object, context.diagnostics);
    for known in SOURCE {
        query.has(known);
    }
    // A file that cannot be read may say it.
    let says = volume.as_ref().is_none_or(|v| v.frame().is_some());
    if !query.has("placement") && !says {
        let message = "a grid of the index needs 'placement': \"centers\" if samples \
                       sit at voxel centres, \"nodes\" if the outermost lie on the bounds";
        query.error("filename", message);
    }
    let law = law(object, nm, &mut query);
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
    let size = volume.size();
    let samples = match law {
        None => volume.into_data(),
        Some(law) => indices(law, volume.into_data(), object, context)?,
    };
    let placement = [Placement::Centers, Placement::Nodes][source.placement];
    let map = source.to_world;
    // An axis-aligned box needs no transform at run time.
    let diagonal = DMat3::from_diagonal(map.matrix3.diagonal());
    let aligned = map.matrix3 == diagonal && diagonal.diagonal().min_element() > 0.0;
    let (bounds, rest) = if aligned {
        (
            Aabb::new(map.translation, map.transform_point3(DVec3::ONE)),
            None,
        )
    } else {
        (Aabb::new(DVec3::ZERO, DVec3::ONE), Some(map))
    };
    let field = Bspline::from_samples(size, bounds, placement, &samples);
    let field = context.accept(&object.location, field)?.into();
    placed(field, rest, object, context)
}

/// What the samples say, unless they are the index as it is, at the wavelength `nm` of the channel if it has one.
fn law(object: &Object, nm: Option<f64>, q: &mut Query) -> Option<Law> {
    let law = match object.plugin.as_str() {
        "gladstone_dale" => Law {
            n0: q.float_in("n0", POSITIVE, 1.0),
            slope: gladstone_dale(nm, q),
            reference: q.float_or("reference", 0.0),
        },
        "pressure" => Law {
            n0: q.float_in("n0", POSITIVE, None),
            slope: dn_dp(q),
            reference: q.float_or("reference", 0.0),
        },
        _ if q.has("scale") || q.has("offset") => Law {
            n0: q.float_or("offset", 0.0),
            slope: 1.0,
            reference: 0.0,
        },
        _ => return None,
    };
    let scale = q.float_or("scale", 1.0);
    Some(Law {
        slope: law.slope * scale,
        ..law
    })
}

/// K of Gladstone and Dale in m³/kg: given, or that of air at a wavelength, which is that of the channel
/// unless it is given.
fn gladstone_dale(channel: Option<f64>, q: &mut Query) -> f64 {
    match (q.has("constant"), q.has("wavelength")) {
        (false, false) if let Some(nm) = channel => {
            if !air::VALID.contains(&nm) {
                let (least, most) = (air::VALID.start(), air::VALID.end());
                let message = format!(
                    "the index of air is known from {least} to {most} nm, not at the film's {nm} nm: give \
                     a 'wavelength' or a 'constant'"
                );
                q.error("filename", message);
            }
            air::gladstone_dale(nm)
        }
        (true, false) => q.float_in("constant", 0.0..=0.1, None),
        (false, true) => air::gladstone_dale(q.float_in("wavelength", air::VALID, None)),
        (false, false) => {
            let message = "a gladstone_dale volume needs a 'wavelength' in nm, for air, or \
                           a 'constant', K in m³/kg";
            q.error("filename", message);
            0.0
        }
        (true, true) => {
            q.error(
                "wavelength",
                "give wavelength, for air, or constant, not both",
            );
            0.0
        }
    }
}

/// The change of the index with pressure, per pascal.
pub(super) fn dn_dp(q: &mut Query) -> f64 {
    q.float_in("dn_dp", -LARGEST_DN_DP..=LARGEST_DN_DP, None)
}

fn indices(
    law: Law,
    mut samples: Vec<f64>,
    object: &Object,
    context: &mut Context,
) -> Option<Vec<f64>> {
    for sample in &mut samples {
        let q = *sample;
        *sample = law.n0 + law.slope * (q - law.reference);
        if !sample.is_finite() || *sample < LEAST_INDEX {
            let message = format!(
                "a sample of {q:e} makes an index of {:.6}: check the units of the file, and 'scale'",
                *sample
            );
            context.error_at(&object.location, message);
            return None;
        }
    }
    Some(samples)
}
