//! Standing ultrasound, given by its amplitude in index or in pressure.

use crate::query::Query;
use crate::scene::PluginKind;
use eikonal::Field;
use eikonal::field::{Acoustic, AcousticMode, FieldError};

/// Builds the field that a volume describes.
pub(super) fn build(q: &mut Query) -> Result<Field, FieldError> {
    let n0 = q.float("n0");
    let origin = q.point("origin");
    let direction = q.vector("direction");
    let perpendicular = direction.any_orthogonal_vector();
    let reference = q.vector_or("reference", perpendicular);
    let elasto_optic = super::elasto_optic(q);
    let modes = if q.has("amplitude") || q.has("pressure") {
        vec![mode(q)?]
    } else {
        let children = q.children(PluginKind::Volume);
        if let Some(other) = children.iter().find(|c| c.plugin != "mode") {
            let message = format!(
                "an acoustic field takes volumes of type 'mode', not '{}'",
                other.plugin
            );
            q.error("amplitude", message);
        }
        let modes = children.into_iter().map(|child| q.nested(child, mode));
        let modes: Vec<_> = modes.collect::<Result<_, _>>()?;
        if modes.is_empty() {
            q.error(
                "amplitude",
                "an acoustic field needs an amplitude, or a pressure, or nested volumes of type 'mode'",
            );
        }
        modes
    };
    let field = Acoustic::new(n0, origin, direction, reference, modes)?;
    Ok(match elasto_optic {
        Some(elasto_optic) => field.with_elasto_optic(elasto_optic)?.into(),
        None => field.into(),
    })
}

/// Reads one mode. Its wave number is given directly, or by frequency and speed of sound.
fn mode(q: &mut Query) -> Result<AcousticMode, FieldError> {
    let amplitude = amplitude(q);
    let order = q.integer("order") as u16;
    let phase = q.float("phase");
    let time_phase = q.float("time_phase");
    if q.has("frequency") || q.has("sound_speed") {
        let frequency = q.float("frequency");
        let speed = q.float("sound_speed");
        if q.has("wave_number") {
            q.error(
                "wave_number",
                "give frequency and sound_speed, or wave_number, not both",
            );
        }
        let mode = AcousticMode::from_frequency(amplitude, order, frequency, speed, phase)?;
        return mode.with_time_phase(time_phase);
    }
    AcousticMode::new(amplitude, order, q.float("wave_number"), phase)?.with_time_phase(time_phase)
}

/// Reads the amplitude of the index, given directly or as a pressure amplitude times dn/dp.
fn amplitude(q: &mut Query) -> f64 {
    if !q.has("pressure") {
        return q.float("amplitude");
    }
    if q.has("amplitude") {
        q.error(
            "amplitude",
            "give amplitude, or pressure and dn_dp, not both",
        );
    }
    q.float("pressure") * super::grid::dn_dp(q)
}
