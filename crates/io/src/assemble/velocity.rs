//! Velocity of scatterers in a medium.

use super::context::Context;
use super::texture::{Sampled, sampled};
use crate::query::Query;
use crate::scene::{ObjectDescription, PluginKind};
use eikonal::Shown;
use glam::DVec3;
use std::sync::Arc;
use transport::medium::Velocity;
use transport::volume::{GridSamples, VolumeGrid, VolumeTexture};

/// Number of components, along x, y and z.
const CHANNELS: usize = 3;

/// Velocity as given in a scene file.
pub(super) enum Written<'a> {
    Uniform(DVec3),
    Volume(&'a Arc<ObjectDescription>),
}

impl<'a> Written<'a> {
    /// Reads the velocity of a medium, if it has one.
    pub(super) fn of(query: &mut Query<'a, '_>) -> Option<Self> {
        if let Some(object) = query.stand_in(PluginKind::Volume, "velocity") {
            return Some(Written::Volume(object));
        }
        if !query.has("velocity") {
            return None;
        }
        let velocity = query.vector("velocity");
        if !velocity.is_finite() {
            let message = format!(
                "the velocity is {}; it must be finite",
                Shown(velocity.length())
            );
            query.error("velocity", message);
        }
        Some(Written::Uniform(velocity))
    }

    /// Builds the velocity; `None` after an error.
    pub(super) fn build(self, context: &mut Context) -> Option<Velocity> {
        let object = match self {
            Written::Uniform(velocity) => return Some(Velocity::uniform(velocity)),
            Written::Volume(object) => object,
        };
        let Sampled {
            volume,
            source,
            placement,
            filter,
        } = sampled(object, &["gridvolume"], context)?;
        let channels = volume.channels();
        if channels != CHANNELS {
            let message = format!(
                "a velocity must have {CHANNELS} channels, its components along x, y and z in scene units per second, but the grid has {channels}"
            );
            context.error_at(&object.location, message);
            return None;
        }
        let samples = GridSamples {
            size: volume.size(),
            channels,
            data: volume.into_data(),
        };
        let any = [f64::MIN, f64::MAX];
        let grid = VolumeGrid::new(samples, source.to_world, placement, filter, any);
        let grid = context.accept(&object.location, grid)?;
        Some(Velocity::sampled(VolumeTexture::Grid(Arc::new(grid))))
    }
}
