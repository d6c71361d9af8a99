//! Index in the sound field of a transducer.

use super::super::context::Context;
use super::super::sound_record::{FactSource, SoundRecord};
use super::super::transforms::affine;
use super::elasto_optic;
use super::grid;
use super::oscillating::{Amplitudes, oscillating};
use crate::query::Query;
use crate::scene::ObjectDescription;
use crate::transducer::{
    ArrayLayout, ElementArray, Places, SoundAperture, Transducer, TransducerError,
};
use eikonal::Field;
use glam::{DAffine3, DMat3, DVec3};
use std::f64::consts::TAU;

/// Default number of samples per wavelength. docs/validation.md states the error of the spline
/// through them.
const SAMPLES_PER_WAVELENGTH: f64 = 10.0;
/// Memory in bytes per sample during the computation: the amplitude in double precision, the
/// amplitude of the field, and the coefficient.
const BYTES_PER_SAMPLE: u64 = 40;
/// Parameters that only some apertures have.
const OF_APERTURES: [&str; 9] = [
    "radius",
    "diameter",
    "elements",
    "pitch",
    "width",
    "height",
    "focus",
    "delays",
    "apodization",
];

/// Parameters of a volume of type `transducer`.
struct Description {
    transducer: Transducer,
    /// Frequency in Hz.
    frequency: f64,
    /// Focus of a linear or ring array, in the transducer's coordinates.
    focus: Option<DVec3>,
    /// Map from the transducer's coordinates to the field's.
    place: DAffine3,
    /// Lower corner of the box in which the sound is computed, in the field's coordinates.
    low: DVec3,
    /// Upper corner of the box in which the sound is computed, in the field's coordinates.
    high: DVec3,
    spacing: f64,
    n0: f64,
    dn_dp: f64,
    time_phase: f64,
    elasto_optic: Option<f64>,
}

/// Builds the field of a volume of type `transducer`; `None` after an error.
pub(super) fn build(object: &ObjectDescription, context: &mut Context) -> Option<Field> {
    let mut q = Query::new(object, context.diagnostics);
    let described = Description::read(&mut q);
    let matrix = q.transform("to_world");
    let to_world = affine(matrix, "to_world", &mut q);
    q.finish(&[]);
    let described = described?;
    if context.diagnostics.has_errors() {
        return None;
    }
    let size = described.size();
    let count = size.iter().product::<f64>();
    let permitted = context
        .files
        .limits()
        .permit(count as u64, BYTES_PER_SAMPLE, 0);
    context.accept(&object.location, permitted)?;
    let pressure = described.pressure(size.map(|n| n as usize));
    let pressure = context.accept(&object.location, pressure)?;
    let scale = to_world.matrix3.determinant().abs().cbrt();
    let amplitudes = Amplitudes {
        pressure,
        record: SoundRecord {
            plugin: object.plugin.clone(),
            file: None,
            size: size.map(|n| n as usize),
            nodes: true,
            to_world: to_world * described.cube(),
            placed_by: FactSource::Scene,
            frequency: None,
            series: None,
        },
        frequency: described.frequency,
        wavelength: described.transducer.wavelength * scale,
        n0: described.n0,
        slope: described.dn_dp,
        elasto_optic: described.elasto_optic,
    };
    oscillating(amplitudes, object, context)
}

impl Description {
    fn read(q: &mut Query) -> Option<Self> {
        let frequency = q.float("frequency");
        let wavelength = q.float("sound_speed") / frequency;
        let pressure = q.float("pressure");
        let place = place(q);
        let aperture = aperture(q, frequency);
        let (low, high) = (q.point("min"), q.point("max"));
        if !(high - low).cmpgt(DVec3::ZERO).all() {
            let message =
                "the box of the sound is empty: 'max' must be larger than 'min' along each axis";
            q.error("max", message);
        }
        let spacing = q.float_or("spacing", wavelength / SAMPLES_PER_WAVELENGTH);
        if spacing > 0.5 * wavelength {
            let message = format!(
                "a spacing of {spacing:.3e} is too large for the wavelength {wavelength:.3e} of the sound: leave 'spacing' out, or give at most half the wavelength"
            );
            q.error("spacing", message);
        }
        let n0 = q.float("n0");
        let dn_dp = grid::dn_dp(q);
        let time_phase = q.float("time_phase");
        let elasto_optic = elasto_optic(q);
        let (aperture, focus) = aperture?;
        Some(Description {
            transducer: Transducer {
                aperture,
                wavelength,
                pressure,
            },
            frequency,
            focus: focus.map(|at| place.inverse().transform_point3(at)),
            place,
            low,
            high,
            spacing,
            n0,
            dn_dp,
            time_phase,
            elasto_optic,
        })
    }

    /// Returns the number of samples along x, y and z: nodes whose distance is at most `spacing`.
    fn size(&self) -> [f64; 3] {
        let cells = ((self.high - self.low) / self.spacing)
            .ceil()
            .max(DVec3::ONE);
        (cells + 1.0).to_array()
    }

    /// Returns the map from the unit cube to the box.
    fn cube(&self) -> DAffine3 {
        let matrix3 = DMat3::from_diagonal(self.high - self.low);
        DAffine3 {
            matrix3,
            translation: self.low,
        }
    }

    /// Computes complex amplitudes of the pressure at the samples.
    fn pressure(&self, size: [usize; 3]) -> Result<Vec<[f64; 2]>, TransducerError> {
        let own = self.place.inverse();
        let cells = DVec3::from_array(size.map(|n| (n - 1) as f64));
        let step = (self.high - self.low) / cells;
        let axes = own.matrix3 * DMat3::from_diagonal(step);
        let places = Places {
            size,
            first: own.transform_point3(self.low),
            steps: [axes.x_axis, axes.y_axis, axes.z_axis],
        };
        let mut transducer = self.transducer.clone();
        if let (SoundAperture::ElementArray(array), Some(focus)) =
            (&transducer.aperture, self.focus)
        {
            let focused = array.clone().focused(focus, transducer.wavelength)?;
            transducer.aperture = SoundAperture::ElementArray(focused);
        }
        let mut pressure = transducer.amplitudes(&places)?;
        let (sin, cos) = self.time_phase.sin_cos();
        for [re, im] in &mut pressure {
            (*re, *im) = (*re * cos - *im * sin, *re * sin + *im * cos);
        }
        Ok(pressure)
    }
}

/// Reads the position and orientation of the transducer. Its z axis points along `direction`, its x
/// axis along the component of `reference` perpendicular to `direction`.
fn place(q: &mut Query) -> DAffine3 {
    let translation = q.point("origin");
    let direction = q.vector("direction").try_normalize();
    let z = direction.unwrap_or_else(|| {
        q.error("direction", "'direction' must not be zero");
        DVec3::Z
    });
    // Use x unless it is nearly parallel to the direction.
    let usual = if z.x.abs() < 0.9 { DVec3::X } else { DVec3::Y };
    let reference = q.vector_or("reference", usual);
    let x = reference.reject_from_normalized(z).try_normalize();
    let x = x
        .filter(|_| reference.normalize_or_zero().cross(z).length() > 1e-6)
        .unwrap_or_else(|| {
            q.error(
                "reference",
                "'reference' must not be parallel to 'direction'",
            );
            z.any_orthonormal_vector()
        });
    DAffine3 {
        matrix3: DMat3::from_cols(x, z.cross(x), z),
        translation,
    }
}

/// Reads the aperture, and the focus of its elements in the field's coordinates; `None` after an
/// error.
fn aperture(q: &mut Query, frequency: f64) -> Option<(SoundAperture, Option<DVec3>)> {
    if !q.has("aperture") {
        let message = "a transducer needs an 'aperture': \"bowl\", \"piston\", \"linear_array\" or \"ring_array\"";
        q.error("aperture", message);
        for name in OF_APERTURES {
            q.has(name);
        }
        return None;
    }
    Some(match q.word("aperture") {
        "bowl" => (
            SoundAperture::Bowl {
                radius: q.float("radius"),
                diameter: q.float("diameter"),
            },
            None,
        ),
        "piston" => (
            SoundAperture::Disc {
                diameter: q.float("diameter"),
            },
            None,
        ),
        "linear_array" => {
            let pitch = q.float("pitch");
            array(q, frequency, ArrayLayout::Line { pitch }, pitch)
        }
        _ => {
            let radius = q.float("radius");
            let elements = q.integer("elements") as f64;
            // Side of the polygon circumscribed about the circle.
            let side = 2.0 * radius * (0.5 * TAU / elements.max(3.0)).tan();
            array(q, frequency, ArrayLayout::Ring { radius }, side)
        }
    })
}

/// Reads the elements of an array. By default their width fills the array.
fn array(
    q: &mut Query,
    frequency: f64,
    layout: ArrayLayout,
    width: f64,
) -> (SoundAperture, Option<DVec3>) {
    let focus = q.has("focus").then(|| q.point("focus"));
    if focus.is_some() && q.has("delays") {
        q.error("delays", "give a 'focus', or 'delays', not both");
    }
    let numbers = |q: &mut Query, name| {
        if q.has(name) {
            q.numbers(name)
        } else {
            Vec::new()
        }
    };
    let delays = numbers(q, "delays");
    let array = ElementArray {
        layout,
        elements: q.integer("elements") as usize,
        width: q.float_or("width", width),
        height: q.float("height"),
        lags: delays.iter().map(|delay| TAU * frequency * delay).collect(),
        weights: numbers(q, "apodization"),
    };
    (SoundAperture::ElementArray(array), focus)
}
