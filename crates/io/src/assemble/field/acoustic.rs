//! Standing ultrasound, by its amplitude in index or in pressure.

use crate::query::{INDEX, POSITIVE, Query};
use crate::scene::PluginKind;
use eikonal::Field;
use eikonal::field::{Acoustic, AcousticMode, FieldError};
use glam::DVec3;

/// The field that a volume describes.
pub(super) fn build(q: &mut Query) -> Result<Field, FieldError> {
    let n0 = q.float_in("n0", INDEX, None);
    let origin = q.point_or("origin", DVec3::ZERO);
    let direction = q.vector_or("direction", DVec3::Z);
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

/// One mode; its wave number is given as such, or by frequency and speed of sound.
fn mode(q: &mut Query) -> Result<AcousticMode, FieldError> {
    let amplitude = amplitude(q);
    let order = q.integer_in("order", 0..=64, 0) as u16;
    let phase = q.float_or("phase", 0.0);
    let time_phase = q.float_or("time_phase", 0.0);
    if q.has("frequency") || q.has("sound_speed") {
        let frequency = q.float_in("frequency", POSITIVE, None);
        let speed = q.float_in("sound_speed", POSITIVE, None);
        if q.has("wave_number") {
            q.error(
                "wave_number",
                "give frequency and sound_speed, or wave_number, not both",
            );
        }
        let mode = AcousticMode::from_frequency(amplitude, order, frequency, speed, phase)?;
        return mode.with_time_phase(time_phase);
    }
    AcousticMode::new(
        amplitude,
        order,
        q.float_in("wave_number", POSITIVE, None),
        phase,
    )?
    .with_time_phase(time_phase)
}

/// The amplitude of the index: as such, or that of the pressure times dn/dp.
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
