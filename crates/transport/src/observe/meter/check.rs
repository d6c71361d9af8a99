//! Checks of meters' fields.

use super::{Acceptance, Cosines, FluenceMeter, IrradianceMeter, Meter, MeterSurface};
use crate::Bins;
use crate::emitter::Emitter;
use crate::scene::Scene;
use eikonal::Shown;

/// Maximum error of the length of a unit vector.
const ROUNDING: f64 = 1e-12;

/// Invalid field of a meter.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{field}: {message}")]
pub struct MeterProblem {
    /// Name of the field.
    pub field: &'static str,
    /// Description of the valid values and of the value given.
    pub message: String,
}

/// Returns an error with the message unless the condition holds.
fn demand(
    is_so: bool,
    field: &'static str,
    message: impl FnOnce() -> String,
) -> Result<(), MeterProblem> {
    if is_so {
        return Ok(());
    }
    let message = message();
    Err(MeterProblem { field, message })
}

impl Meter {
    /// Checks that the meter can measure in a scene.
    ///
    /// # Errors
    /// Returns the first invalid field.
    pub(crate) fn check(&self, scene: &Scene) -> Result<(), MeterProblem> {
        if scene.fluoresces() {
            self.check_fluorescent()?;
        }
        match self {
            Meter::Fluence(meter) => meter.check(scene),
            Meter::Irradiance(meter) => meter.check(scene.objects().len()),
        }
    }

    /// Checks that the meter measures only quantities that fluorescent light has.
    fn check_fluorescent(&self) -> Result<(), MeterProblem> {
        let message = |quantity: &'static str| {
            move || format!("must be off: morgana has no {quantity} of fluorescent light")
        };
        demand(self.most_records().is_none(), "records", message("records"))?;
        let sidebands = self.sidebands().is_none();
        demand(sidebands, "sidebands", message("sidebands"))?;
        demand(!self.has_stokes(), "stokes", message("Stokes parameters"))
    }
}

impl FluenceMeter {
    fn check(&self, scene: &Scene) -> Result<(), MeterProblem> {
        let is_lit = scene.around().contains(self.grid.aabb());
        let distant = || scene.emitters().iter().any(Emitter::is_at_infinity);
        demand(is_lit || !distant(), "grid", || {
            "must lie in the ball that light from infinity fills, but it reaches beyond: give the scene its box as `measured`".into()
        })?;
        check_lengths(self.optical_length)
    }
}

impl IrradianceMeter {
    fn check(&self, objects: usize) -> Result<(), MeterProblem> {
        check_surfaces(&self.surfaces, objects)?;
        self.acceptance.check()?;
        demand(self.positions.bins() > 0, "positions", || {
            "must have a bin at least, but there is none".into()
        })?;
        self.cosines.map_or(Ok(()), |cosines| cosines.check())?;
        check_lengths(self.optical_length)
    }
}

fn check_surfaces(surfaces: &[MeterSurface], objects: usize) -> Result<(), MeterProblem> {
    let field = "surfaces";
    demand(!surfaces.is_empty(), field, || {
        "must not be empty: light is measured at a surface".into()
    })?;
    for (i, &MeterSurface { object, .. }) in surfaces.iter().enumerate() {
        demand(object < objects, field, || {
            format!(
                "must be of objects of the scene, which has {objects}, but one is of object {object}"
            )
        })?;
        let twice = surfaces[..i].iter().any(|other| other.object == object);
        demand(!twice, field, || {
            format!("must be of different objects, but two are of object {object}")
        })?;
    }
    Ok(())
}

fn check_lengths(bins: Option<Bins>) -> Result<(), MeterProblem> {
    bins.map_or(Ok(()), |bins| {
        demand(bins.is_valid(), "optical_length", || {
            format!(
                "must have finite ends, min below max, and a bin at least, but there are {} from {} to {}",
                bins.count,
                Shown(bins.min),
                Shown(bins.max)
            )
        })
    })
}

impl Acceptance {
    fn check(&self) -> Result<(), MeterProblem> {
        if let Some(patch) = &self.patch {
            demand(patch.center.is_finite(), "acceptance.patch.center", || {
                format!("must be finite, but it is {}", Shown(patch.center))
            })?;
            check_positive(patch.radius, "acceptance.patch.radius")?;
        }
        self.numerical_aperture.map_or(Ok(()), |aperture| {
            check_positive(aperture, "acceptance.numerical_aperture")
        })
    }
}

impl Cosines {
    fn check(&self) -> Result<(), MeterProblem> {
        demand(self.count > 0, "cosines.count", || {
            "must be at least 1, but it is 0".into()
        })?;
        self.axis.map_or(Ok(()), |axis| {
            let is_unit = (axis.length() - 1.0).abs() <= ROUNDING;
            demand(is_unit, "cosines.axis", || {
                format!("must be a unit vector, but it is {}", Shown(axis))
            })
        })
    }
}

fn check_positive(value: f64, field: &'static str) -> Result<(), MeterProblem> {
    demand(value > 0.0 && value.is_finite(), field, || {
        format!("must be positive and finite, but it is {}", Shown(value))
    })
}
