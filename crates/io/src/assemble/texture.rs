//! Quantities that may vary in space: constants and grids.

use super::context::Context;
use super::reach;
use super::sound_record::FactSource;
use super::texture_role::Role;
use super::transforms::affine;
use crate::diagnostic::Location;
use crate::query::{Input, Query, unknown_plugin};
use crate::scene::{FileRegistry, ObjectDescription, SpectrumValue};
use crate::volume::{AxisOrder, Format, Options, Sample, Volume, nrrd};
use eikonal::Shown;
use eikonal::field::Placement;
use glam::DAffine3;
use std::sync::Arc;
use transport::Spectrum;
use transport::volume::{GridFilter, GridSamples, VolumeGrid, VolumeTexture};

/// A quantity that must lie between the two `allowed` values, given as a spectrum or as a nested volume.
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
        Input::Object(object) => grid(object, name, allowed, context)
            .map_or(VolumeTexture::Uniform(Spectrum::ZERO), |grid| {
                VolumeTexture::Grid(Arc::new(grid))
            }),
    }
}

/// The same value all over a cube, and nothing outside, as Mitsuba's extinctions have it.
fn bounded(
    value: Spectrum,
    cube: DAffine3,
    allowed: [f64; 2],
    location: &Location,
    context: &mut Context,
) -> VolumeTexture {
    let channels = context.channels.channels_of(context.group);
    let samples = GridSamples {
        size: [1; 3],
        channels,
        data: value.0[..channels].iter().map(|v| *v as f32).collect(),
    };
    let quantity = reach::Quantity::Extinction;
    context
        .grids
        .push(reach::Placed::new(quantity, cube, location));
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

fn uniform(
    value: &SpectrumValue,
    location: &Location,
    name: &str,
    allowed: [f64; 2],
    context: &mut Context,
) -> VolumeTexture {
    let value = context.loaded(value, location);
    let outside = |v: &f64| !(*v >= allowed[0] && *v <= allowed[1]);
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

fn grid(
    object: &ObjectDescription,
    name: &str,
    allowed: [f64; 2],
    context: &mut Context,
) -> Option<VolumeGrid> {
    if object.plugin != "gridvolume" {
        unknown_plugin(object, &["gridvolume", "constvolume"], context.diagnostics);
        return None;
    }
    let (volume, source) = read::<f32>(object, context);
    let mut query = Query::new(object, context.diagnostics);
    for known in SOURCE {
        query.has(known);
    }
    let (scale, offset) = (query.float_or("scale", 1.0), query.float_or("offset", 0.0));
    let filter = query.one_of("filter_type", &["trilinear", "nearest"]);
    // Beyond the grid there is nothing in a medium, or what its edge has.
    query.one_of("wrap_mode", &["clamp", "repeat", "mirror"]);
    // Values are always used as they are, and there is nothing to accelerate: both are accepted
    // because Mitsuba's scene files have them.
    query.boolean_or("raw", true);
    query.boolean_or("accel", true);
    query.finish(&[]);
    let volume = context.accept(&object.location, volume?.scaled(scale, offset))?;
    let (channels, film) = (volume.channels(), context.channels.count());
    if channels != 1 && channels != film {
        let message = format!("the grid has {channels} channels, the film {film}");
        context.error_at(&object.location, message);
        return None;
    }
    let samples = of_group(volume, context);
    let filter = [GridFilter::Trilinear, GridFilter::Nearest][filter];
    let placement = [Placement::Centers, Placement::Nodes][source.placement];
    if name == "sigma_t" {
        let quantity = reach::Quantity::Extinction;
        context.grids.push(reach::Placed::new(
            quantity,
            source.to_world,
            &object.location,
        ));
    }
    let grid = VolumeGrid::new(samples, source.to_world, placement, filter, allowed);
    context.accept(&object.location, grid)
}

/// The samples of the channels that belong to the context's group.
fn of_group(volume: Volume, context: &Context) -> GridSamples {
    let (size, channels) = (volume.size(), volume.channels());
    let used = context.channels.channels_of(context.group);
    if channels == 1 || channels == used {
        return GridSamples {
            size,
            channels,
            data: volume.into_data(),
        };
    }
    let first = context.channels.first(context.group);
    let voxels = volume.data().chunks_exact(channels);
    let data = voxels.flat_map(|v| &v[first..first + used]).copied();
    GridSamples {
        size,
        channels: used,
        data: data.collect(),
    }
}

/// What [`read`] asks for.
pub(super) const SOURCE: [&str; 7] = [
    "filename",
    "data",
    "axis_order",
    "dataset",
    "placement",
    "to_world",
    "use_grid_bbox",
];

/// Where the samples of a volume file belong.
pub(super) struct Source {
    /// 0: voxel centres, 1: nodes on the bounds.
    pub placement: usize,
    /// From the unit cube, by way of the file's own coordinates if it has any.
    pub to_world: DAffine3,
    /// Who says where they belong, but for the scene's `to_world`.
    pub placed_by: FactSource,
}

/// The samples of a volume, from the array that it holds or the file that it names.
pub(super) fn read<T: Sample>(
    object: &ObjectDescription,
    context: &mut Context,
) -> (Option<Volume<T>>, Source) {
    let mut query = Query::new(object, context.diagnostics);
    let volume = if query.has("data") {
        held(&mut query)
    } else {
        from_file(&mut query, context.files)
    };
    let chosen = query.has("placement");
    let mut placement = query.one_of("placement", &["centers", "nodes"]);
    let matrix = query.transform("to_world");
    let boxed = query.boolean_or("use_grid_bbox", false);
    let mut to_world = affine(matrix, "to_world", &mut query);
    let mut placed_by = FactSource::Scene;
    if let Some((volume, frame)) = volume.as_ref().and_then(|v| Some((v, v.frame()?))) {
        if chosen && placement != usize::from(frame.nodes) {
            query.error(
                "placement",
                "the file says otherwise: leave 'placement' out",
            );
        }
        placement = usize::from(frame.nodes);
        to_world *= frame.to_file(volume.size());
        placed_by = FactSource::File;
    } else if let (Some(volume), true) = (&volume, boxed) {
        to_world *= own_box(volume, &mut query);
        placed_by = FactSource::File;
    }
    let source = Source {
        placement,
        to_world,
        placed_by,
    };
    (volume, source)
}

/// Reads the file that a volume names. What the file format does not say, the scene must, such as which axis of
/// an array is which.
fn from_file<T: Sample>(query: &mut Query, files: &mut FileRegistry) -> Option<Volume<T>> {
    let path = query.path("filename", files);
    let format = Format::of(&path);
    if let Some(name) = (format == Some(Format::Nrrd))
        .then(|| nrrd::data_file(&path))
        .flatten()
    {
        files.add(path.with_file_name(&name), &name);
    }
    let axes = axes(format, query);
    let dataset = dataset(format, query);
    let options = Options {
        axes,
        dataset: dataset.as_deref(),
        limits: files.limits(),
    };
    if path.as_os_str().is_empty() {
        return None;
    }
    let read = Volume::read(&path, options);
    read.map_err(|e| query.file_error("filename", &e)).ok()
}

/// The array that a volume holds itself: `[z, y, x]` unless it says otherwise, as Mitsuba has it.
fn held<T: Sample>(query: &mut Query) -> Option<Volume<T>> {
    if query.has("filename") || query.has("dataset") {
        query.error("data", "give the samples or a file with them, not both");
    }
    let axes = axes(None, query).unwrap_or(AxisOrder::ZYX);
    let volume = Volume::of_tensor(&*query.tensor("data")?, axes);
    volume.map_err(|e| query.error("data", e.to_string())).ok()
}

/// From the unit cube to the bounding box that a file states.
fn own_box<T: Sample>(volume: &Volume<T>, query: &mut Query) -> DAffine3 {
    let Some([min, max]) = volume.bbox() else {
        let message = "the file has no bounding box: place the volume by 'to_world'";
        query.error("use_grid_bbox", message);
        return DAffine3::IDENTITY;
    };
    let size = max - min;
    if size.min_element() <= 0.0 {
        let message = format!("the file's bounding box is empty: {min} to {max}");
        query.error("use_grid_bbox", message);
        return DAffine3::IDENTITY;
    }
    DAffine3::from_translation(min) * DAffine3::from_scale(size)
}

/// Which axis of an array is which.
fn axes(format: Option<Format>, query: &mut Query) -> Option<AxisOrder> {
    let named = query.has("axis_order");
    match format {
        Some(format) if format.needs_axis_order() && !named => {
            let message = "the format does not say which axis is which: give 'axis_order', \"zyx\" \
                           if the last index runs along x, \"xyz\" if the first does";
            query.error("filename", message);
            Some(AxisOrder::ZYX)
        }
        Some(format) if format.has_axis_order() && named => {
            query.error("axis_order", "the format has its own: x is fastest");
            None
        }
        _ if named => {
            let order = query.string("axis_order").parse();
            let wrong = |message: String| query.error("axis_order", message);
            Some(order.map_err(wrong).unwrap_or(AxisOrder::ZYX))
        }
        _ => None,
    }
}

/// Which of the volumes of a file is meant.
fn dataset(format: Option<Format>, query: &mut Query) -> Option<String> {
    let named = query.has("dataset");
    match format {
        Some(format) if named && !format.has_datasets() => {
            let message = "only .npz, HDF5, .mat, .vti and .vtk files hold several";
            query.error("dataset", message);
            None
        }
        _ => named.then(|| query.string("dataset")),
    }
}
