//! Volumes that emit light.

use super::super::context::Context;
use super::super::texture::texture;
use super::super::transforms::affine;
use super::{check_medium, light};
use crate::diagnostic::Location;
use crate::query::{Input, Query};
use crate::scene::{ObjectDescription, PluginKind};
use eikonal::field::Placement;
use glam::DAffine3;
use std::sync::Arc;
use transport::Spectrum;
use transport::emitter::{Emitter, VolumeLight};
use transport::volume::{GridFilter, GridSamples, VolumeGrid, VolumeTexture};

const RADIANCE: &str = "radiance";
/// Allowed range of radiances.
const ALLOWED: [f64; 2] = [0.0, f64::MAX];

/// Builds a volume that emits light; `None` after an error.
pub(super) fn volumelight(object: &ObjectDescription, context: &mut Context) -> Option<Emitter> {
    let mut q = Query::new(object, context.diagnostics);
    let inside = q.child(PluginKind::Medium).cloned();
    let radiance = q.volume_or_spectrum(RADIANCE);
    let power = q.has("power").then(|| q.spectrum("power"));
    let cube = match radiance {
        Input::Spectrum(_) => {
            let matrix = q.transform("to_world");
            Some(affine(matrix, "to_world", &mut q))
        }
        Input::Object(_) => None,
    };
    q.finish(&["to_world"]);
    check_medium(inside, context);
    let volume = match (radiance, cube) {
        (Input::Spectrum(value), Some(cube)) => {
            let value = light(&value, RADIANCE, object, context);
            let grid = context.accept(&object.location, unit_grid(cube))?;
            context.accept(&object.location, VolumeLight::new(grid, value))?
        }
        (Input::Object(nested), _) => from_volume(nested, object, context)?,
        (Input::Spectrum(_), None) => return None,
    };
    let Some(power) = power else {
        return Some(Emitter::Volume(Arc::new(volume)));
    };
    let power = light(&power, "power", object, context);
    let volume = with_power(volume, power, &object.location, context)?;
    Some(Emitter::Volume(Arc::new(volume)))
}

/// Builds the light of a nested volume.
fn from_volume(
    nested: &Arc<ObjectDescription>,
    object: &ObjectDescription,
    context: &mut Context,
) -> Option<VolumeLight> {
    let location = &nested.location;
    if nested.plugin == "constvolume" {
        let mut q = Query::new(nested, context.diagnostics);
        let value = q.spectrum("value");
        let matrix = q.transform("to_world");
        let cube = affine(matrix, "to_world", &mut q);
        q.finish(&[]);
        let value = light(&value, "value", nested, context);
        let grid = context.accept(location, unit_grid(cube))?;
        return context.accept(location, VolumeLight::new(grid, value));
    }
    let values = texture(Input::Object(nested), object, RADIANCE, ALLOWED, context);
    let VolumeTexture::Grid(grid) = values else {
        return None;
    };
    let used = context.channels_of_group();
    let white = Spectrum(std::array::from_fn(|c| f64::from(u8::from(c < used))));
    let light = VolumeLight::new(grid, white);
    context.accept(location, light)
}

/// Scales a volume light to a given power.
fn with_power(
    volume: VolumeLight,
    power: Spectrum,
    location: &Location,
    context: &mut Context,
) -> Option<VolumeLight> {
    let own = volume.power();
    if (0..Spectrum::CHANNELS).any(|c| power[c] > 0.0 && own[c] == 0.0) {
        let message = "the volume is black in a channel in which the light has power";
        context.error_at(location, message);
        return None;
    }
    context.accept(location, volume.with_power(power))
}

/// Returns a grid with the value 1 in the image of the unit cube.
fn unit_grid(cube: DAffine3) -> Result<VolumeGrid, transport::volume::GridError> {
    let samples = GridSamples {
        size: [1; 3],
        channels: 1,
        data: vec![1.0],
    };
    VolumeGrid::new(
        samples,
        cube,
        Placement::Centers,
        GridFilter::Nearest,
        ALLOWED,
    )
}
