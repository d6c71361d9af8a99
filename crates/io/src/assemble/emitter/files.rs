//! Emitters that use a data file.

use super::super::clipping::{Pixels, without_rounding};
use super::super::context::Context;
use super::super::sensor::fov;
use super::super::surface_texture::{Read, RequestedValues, Role, accepted, image, screen};
use super::super::transforms::pose;
use super::light;
use crate::diagnostic::lints;
use crate::ies;
use crate::query::{Input, Query, misplaced_plugin};
use crate::scene::{ObjectDescription, SpectrumValue};
use std::f64::consts::PI;
use transport::Spectrum;
use transport::emitter::{Emitter, Environment, Luminaire, Projector, Slide};
use transport::texture::{BitmapFilter, Wrap};

/// Builds an environment from an image; `None` after an error.
pub(super) fn envmap(object: &ObjectDescription, context: &mut Context) -> Option<Emitter> {
    let mut q = Query::new(object, context.diagnostics);
    let read = image(&mut q, context.files);
    let scale = q.float("scale");
    // Accept Mitsuba's choice of a sampling method, which does not affect the result.
    q.boolean("mis_compensation");
    let pose = pose(&mut q, "an environment");
    q.finish(&[]);
    let Read { image, name, .. } = read?;
    // Convert the pixels to radiance, and clip negative values.
    let mut radiance = |rgb: &[f32; 3]| {
        let rgb = rgb.map(|v| f64::from(v) * scale);
        context.spectrum(&SpectrumValue::Rgb(rgb), Role::Emission, &object.location)
    };
    let mut pixels: Vec<Spectrum> = image.pixels.iter().map(&mut radiance).collect();
    let (_, orientation) = pose?;
    let mut seen = Pixels::new();
    for (i, pixel) in pixels.iter().enumerate() {
        let row = (i / image.width) as f64 + 0.5;
        let weight = (PI * row / image.height as f64).sin();
        seen.see(pixel.0.into_iter(), weight);
    }
    if accepted(
        &seen,
        &name,
        RequestedValues::plainly(Role::Emission),
        &object.location,
        context,
    )? {
        for pixel in &mut pixels {
            pixel.0 = pixel.0.map(|v| without_rounding(v, Role::Emission));
        }
    }
    // Replace a black image, which has no distribution to sample, by a uniform environment.
    if seen.are_black() {
        let message = if scale == 0.0 {
            "the environment is black, because its 'scale' is 0".to_owned()
        } else {
            format!("the environment is black, because all pixels of {name} are 0")
        };
        let warning = lints::warning(lints::BLACK_EMITTER, message).at(&object.location);
        context.diagnostics.push(warning);
        let black = Environment::Constant(Spectrum::ZERO);
        return Some(Emitter::Environment(black));
    }
    let environment = Environment::image(image.width, image.height, pixels, orientation);
    context
        .accept(&object.location, environment)
        .map(Emitter::Environment)
}

/// Builds a point that projects an image.
pub(super) fn projector(object: &ObjectDescription, context: &mut Context) -> Option<Emitter> {
    let mut q = Query::new(object, context.diagnostics);
    let pose = pose(&mut q, "a projector");
    let fov = fov(&mut q);
    let scale = q.float("scale");
    let shown = q.texture_or_spectrum("irradiance");
    q.finish(&[]);
    let mut slide = match shown {
        Input::Spectrum(value) => Slide {
            size: [1, 1],
            pixels: vec![light(&value, "irradiance", object, context)],
            filter: BitmapFilter::Nearest,
            wrap: Wrap::Clamp,
        },
        Input::Object(image) if image.plugin == "bitmap" => screen(image, context)?,
        Input::Object(image) => {
            misplaced_plugin(image, &["bitmap"], context.diagnostics);
            return None;
        }
    };
    for pixel in &mut slide.pixels {
        *pixel *= scale;
    }
    let size = slide.size;
    let fov = fov.horizontal(size[0] as f64 / size[1] as f64);
    let (position, orientation) = pose?;
    let projector = Projector::new(position, orientation, fov, slide);
    let projector = context.accept(&object.location, projector);
    projector.map(Emitter::from)
}

/// Builds a luminaire from measured photometric data.
pub(super) fn luminaire(object: &ObjectDescription, context: &mut Context) -> Option<Emitter> {
    let mut q = Query::new(object, context.diagnostics);
    let pose = pose(&mut q, "a photometric emitter");
    let scale = q.spectrum("scale");
    let path = q.path("filename", context.files);
    let luminaire = ies::read(&path).map_err(|e| q.file_error("filename", &e));
    q.finish(&[]);
    let scale = light(&scale, "scale", object, context);
    let luminaire = luminaire.ok()?;
    let angles = [luminaire.vertical, luminaire.horizontal];
    let (position, orientation) = pose?;
    let luminaire = Luminaire::new(position, orientation, scale, angles, luminaire.candela);
    let luminaire = context.accept(&object.location, luminaire);
    luminaire.map(Emitter::from)
}
