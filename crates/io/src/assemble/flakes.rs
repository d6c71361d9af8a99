//! Phase functions of flakes.

use super::context::Context;
use super::texture::{Sampled, sampled};
use crate::query::{Query, numbers};
use crate::scene::{ObjectDescription, PluginKind};
use std::sync::Arc;
use transport::phase::{Phase, PhaseError, Sggx};
use transport::volume::{GridSamples, VolumeGrid, VolumeTexture};

/// Number of elements of a symmetric matrix: xx, yy, zz, xy, xz, yz.
const CHANNELS: usize = 6;

/// Reads the phase function `sggx`, whose matrix may vary in space; `None` after an error.
pub(super) fn build(
    object: &ObjectDescription,
    context: &mut Context,
) -> Option<Result<Phase, PhaseError>> {
    let mut query = Query::new(object, context.diagnostics);
    let volume = query.stand_in(PluginKind::Volume, "S").cloned();
    if let Some(volume) = volume {
        query.finish(&[]);
        return varying(&volume, context);
    }
    let given = query.has("S").then(|| query.string("S"));
    let matrix = given.as_deref().and_then(numbers).unwrap_or_default();
    let Ok(matrix) = <[f64; CHANNELS]>::try_from(matrix) else {
        let message = "'S': expected six numbers, the elements xx, yy, zz, xy, xz, yz of a matrix, or a 'gridvolume' of six channels";
        query.error("S", message);
        query.finish(&["S"]);
        return None;
    };
    query.finish(&[]);
    Some(Phase::sggx(matrix))
}

/// Reads a matrix that varies in space; `None` after an error.
fn varying(
    volume: &Arc<ObjectDescription>,
    context: &mut Context,
) -> Option<Result<Phase, PhaseError>> {
    let Sampled {
        volume: samples,
        source,
        placement,
        filter,
    } = sampled(volume, &["gridvolume"], context)?;
    let channels = samples.channels();
    if channels != CHANNELS {
        let message = format!(
            "'S' has {CHANNELS} channels, the elements xx, yy, zz, xy, xz, yz of a matrix, but the grid has {channels}"
        );
        context.error_at(&volume.location, message);
        return None;
    }
    let first = &samples.data()[..CHANNELS];
    if samples.data().chunks_exact(CHANNELS).all(|v| v == first) {
        let matrix = std::array::from_fn(|i| f64::from(first[i]));
        return Some(Phase::sggx(matrix));
    }
    let part = |from: usize, context: &mut Context| {
        let each = samples.data().chunks_exact(CHANNELS);
        let samples = GridSamples {
            size: samples.size(),
            channels: 3,
            data: each.flat_map(|v| &v[from..from + 3]).copied().collect(),
        };
        let any = [f64::MIN, f64::MAX];
        let grid = VolumeGrid::new(samples, source.to_world, placement, filter, any);
        let grid = context.accept(&volume.location, grid)?;
        Some(VolumeTexture::Grid(Arc::new(grid)))
    };
    let (diagonal, others) = (part(0, context)?, part(3, context)?);
    let flakes = Sggx::varying(diagonal, others);
    Some(flakes.map(|flakes| Phase::Sggx(Box::new(flakes))))
}
