//! Quantities that may vary in space: constants and grids.

use super::assets::GridKey;
use super::clipping;
use super::content::{ContentHasher, GRIDS};
use super::context::Context;
use super::placed_grid;
use super::sound_record::file_of;
use super::texture_role::Role;
use super::transforms::affine;
use super::volume_source::{SOURCE, Source, read};
use crate::diagnostic::Location;
use crate::query::{Input, Query, misplaced_plugin};
use crate::scene::{ObjectDescription, SpectrumValue};
use crate::volume::Volume;
use eikonal::Shown;
use eikonal::field::Placement;
use glam::DAffine3;
use std::sync::Arc;
use transport::Spectrum;
use transport::volume::{GridFilter, GridSamples, VolumeGrid, VolumeTexture};

/// Builds a quantity that is given as a spectrum or as a nested volume. Its values must lie between
/// the two `allowed` values.
pub(super) fn texture(
    input: Input,
    parent: &ObjectDescription,
    name: &str,
    allowed: [f64; 2],
    context: &mut Context,
) -> VolumeTexture {
    match input {
        Input::Spectrum(value) => {
            let property = parent.properties.iter().find(|p| p.name == name);
            let location = property.map_or(&parent.location, |p| &p.location);
            uniform(&value, location, name, allowed, context)
        }
        Input::Object(object) if object.plugin == "constvolume" => {
            let mut query = Query::new(object, context.diagnostics);
            let value = query.spectrum("value");
            let matrix = query.transform("to_world");
            let cube = affine(matrix, "to_world", &mut query);
            query.finish(&[]);
            let value = uniform(&value, &object.location, name, allowed, context);
            match value {
                VolumeTexture::Uniform(value)
                    if name == "sigma_t" && parent.plugin == "heterogeneous" =>
                {
                    bounded(value, cube, allowed, &object.location, context)
                }
                value => value,
            }
        }
        Input::Object(object) => {
            let key = GridKey::new(object.number, name == "sigma_t", allowed);
            let grid = context.once(
                |assets| &mut assets.grids,
                key,
                |context| grid(object, name, allowed, context),
            );
            grid.map_or(VolumeTexture::Uniform(Spectrum::ZERO), VolumeTexture::Grid)
        }
    }
}

/// Builds an extinction that is constant inside a cube and zero outside, as in Mitsuba.
fn bounded(
    value: Spectrum,
    cube: DAffine3,
    allowed: [f64; 2],
    location: &Location,
    context: &mut Context,
) -> VolumeTexture {
    let channels = context.channels_of_group();
    let samples = GridSamples {
        size: [1; 3],
        channels,
        data: value.0[..channels].iter().map(|v| *v as f32).collect(),
    };
    let quantity = placed_grid::Quantity::Extinction;
    context
        .grids
        .push(placed_grid::Placed::new(quantity, cube, location));
    let grid = VolumeGrid::new(
        samples,
        cube,
        Placement::Centers,
        GridFilter::Nearest,
        allowed,
    );
    let grid = context.accept(location, grid);
    grid.map_or(VolumeTexture::Uniform(value), |grid| {
        VolumeTexture::Grid(Arc::new(grid))
    })
}

/// Converts a spectrum whose values must lie between the two `allowed` values.
fn uniform(
    value: &SpectrumValue,
    location: &Location,
    name: &str,
    allowed: [f64; 2],
    context: &mut Context,
) -> VolumeTexture {
    let value = context.loaded(value, location);
    // Fractions that rounding puts outside their limits are clipped with a note.
    let rounding = if allowed[1] == 1.0 {
        clipping::ROUNDING
    } else {
        0.0
    };
    let outside = |v: &f64| !(*v >= allowed[0] - rounding && *v <= allowed[1] + rounding);
    if let Some(bad) = value.values().into_iter().find(outside) {
        let allowed = match allowed {
            [low, f64::MAX] => format!("be at least {low}"),
            [low, high] => format!("lie between {low} and {high}"),
        };
        let message = format!("'{name}' is {}; it must {allowed}", Shown(bad));
        context.error_at(location, message);
    }
    let role = if allowed[1] == 1.0 {
        Role::Reflectance
    } else {
        Role::Coefficient
    };
    VolumeTexture::Uniform(context.spectrum(&value, role, location))
}

/// Samples of a `gridvolume`.
pub(super) struct Sampled {
    pub volume: Volume,
    pub source: Source,
    pub placement: Placement,
    pub filter: GridFilter,
}

/// Reads the grid that a volume describes; `None` after an error. `known` lists the plugins
/// accepted there, for messages.
pub(super) fn sampled(
    object: &ObjectDescription,
    known: &[&str],
    context: &mut Context,
) -> Option<Sampled> {
    if object.plugin != "gridvolume" {
        misplaced_plugin(object, known, context.diagnostics);
        return None;
    }
    let (volume, source) = read::<f32>(object, context);
    let mut query = Query::new(object, context.diagnostics);
    for known in SOURCE {
        query.has(known);
    }
    let (scale, offset) = (query.float("scale"), query.float("offset"));
    let filter = match query.word("filter_type") {
        "nearest" => GridFilter::Nearest,
        _ => GridFilter::Trilinear,
    };
    // Accept the wrap mode. Outside the grid, a medium is empty or continues the values of the
    // edge.
    query.word("wrap_mode");
    // Accept parameters of Mitsuba's scene files. Values are always used unchanged, and nothing
    // needs acceleration.
    query.boolean("raw");
    query.boolean("accel");
    query.finish(&[]);
    let volume = context.accept(&object.location, volume?.scaled(scale, offset))?;
    Some(Sampled {
        volume,
        placement: source.placement,
        source,
        filter,
    })
}

/// Builds the grid of a quantity, shared with scenes that have an equal grid. Returns `None` after
/// an error.
fn grid(
    object: &ObjectDescription,
    name: &str,
    allowed: [f64; 2],
    context: &mut Context,
) -> Option<Arc<VolumeGrid>> {
    let Sampled {
        volume,
        source,
        placement,
        filter,
    } = sampled(object, &["gridvolume", "constvolume"], context)?;
    let (channels, film) = (volume.channels(), context.channels.count());
    if channels != 1 && channels != film {
        let message = format!("the grid has {channels} channels, the film {film}");
        context.error_at(&object.location, message);
        return None;
    }
    // Clip values that rounding puts outside their limits.
    let mut samples = of_group(volume, context);
    let file = file_of(object).unwrap_or_else(|| "'data'".to_owned());
    match clipping::samples(&mut samples, &file, allowed) {
        Ok(None) => {}
        Ok(Some(note)) => context.diagnostics.push(note.at(&object.location)),
        Err(error) => {
            context.diagnostics.push(error.at(&object.location));
            return None;
        }
    }
    if name == "sigma_t" {
        let quantity = placed_grid::Quantity::Extinction;
        context.grids.push(placed_grid::Placed::new(
            quantity,
            source.to_world,
            &object.location,
        ));
    }
    // Build the grid, or share an equal one.
    let kinds = [
        samples.channels,
        usize::from(placement == Placement::Nodes),
        usize::from(filter == GridFilter::Nearest),
    ];
    let content = ContentHasher::default()
        .doubles(&samples.size.map(|n| n as f64))
        .doubles(&kinds.map(|n| n as f64))
        .doubles(&source.to_world.to_cols_array())
        .doubles(&allowed)
        // Planted error "grids told apart by all but their samples", found by morgana-io/io::shared_parts::scenes_with_equal_data_share_them:
        // .singles(&[])
        .singles(&samples.data)
        .finish();
    let grid = GRIDS.try_get(content, || {
        VolumeGrid::new(samples, source.to_world, placement, filter, allowed)
    });
    context.accept(&object.location, grid)
}

/// Returns the samples of the channels in the context's group.
fn of_group(volume: Volume, context: &Context) -> GridSamples {
    let (size, channels) = (volume.size(), volume.channels());
    if channels == 1 || channels == context.channels_of_group() {
        return GridSamples {
            size,
            channels,
            data: volume.into_data(),
        };
    }
    let used = context.channels_of_group();
    let first = context.first_channel();
    let voxels = volume.data().chunks_exact(channels);
    let data = voxels.flat_map(|v| &v[first..first + used]).copied();
    GridSamples {
        size,
        channels: used,
        data: data.collect(),
    }
}
