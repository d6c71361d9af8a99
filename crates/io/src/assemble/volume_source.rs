//! Sources of the samples of volumes, and their positions.

use super::context::Context;
use super::sound_record::{FactSource, SoundRecord, file_of};
use super::transforms::affine;
use crate::error::Problem;
use crate::query::Query;
use crate::scene::{FileRegistry, ObjectDescription};
use crate::volume::series::{Plan, Series};
use crate::volume::{AxisOrder, Format, Options, Sample, Volume, VolumeFrame, nrrd};
use eikonal::Shown;
use eikonal::field::Placement;
use glam::DAffine3;
use std::path::PathBuf;

/// Parameters that [`read`] uses.
pub(super) const SOURCE: [&str; 7] = [
    "filename",
    "data",
    "axis_order",
    "dataset",
    "placement",
    "to_world",
    "use_grid_bbox",
];

/// Advice about samples without a value, such as simulations have in solids.
const FILL: &str = "every sample needs a value: fill samples in solids or outside of the data with the value of their surroundings, for example by numpy.where(numpy.isfinite(a), a, surroundings)";

/// Placement of the samples of a volume file.
pub(super) struct Source {
    /// Placement of the samples: centres of voxels, or nodes on the bounds.
    pub placement: Placement,
    /// Map from the unit cube to the world, through the file's own coordinates if it has any.
    pub to_world: DAffine3,
    /// Source of the placement, apart from the scene's `to_world`.
    pub placed_by: FactSource,
}

impl Source {
    /// Returns a record of samples of sound without a frequency or a series.
    pub(super) fn record(&self, object: &ObjectDescription, size: [usize; 3]) -> SoundRecord {
        SoundRecord {
            plugin: object.plugin.clone(),
            file: file_of(object),
            size,
            nodes: self.placement == Placement::Nodes,
            to_world: self.to_world,
            placed_by: self.placed_by,
            frequency: None,
            series: None,
        }
    }
}

/// Reads the samples of a volume, from the array that it holds or the file that it names.
pub(super) fn read<T: Sample>(
    object: &ObjectDescription,
    context: &mut Context,
) -> (Option<Volume<T>>, Source) {
    read_by(object, context, |query, files| {
        if query.has("data") {
            let axes = axes_of_data(query);
            let volume = Volume::of_tensor(&*query.tensor("data")?, axes);
            return volume
                .map_err(|e| refuse("data", &e, e.to_string(), query))
                .ok();
        }
        let file = VolumeFile::of(query, files)?;
        let read = Volume::read(&file.path, file.options(files));
        read.map_err(|e| refuse("filename", &e.problem, e.to_string(), query))
            .ok()
    })
}

/// Reports samples that cannot be used. Explains how to fill samples without a value.
fn refuse(name: &str, problem: &Problem, message: String, query: &mut Query) {
    let fill = matches!(problem, Problem::NotFinite { .. }).then(|| FILL.to_owned());
    query.helped_error(name, message, fill);
}

/// Reads sums over the frames of a volume's samples. The channels of the samples are the frames.
pub(super) fn read_series(
    object: &ObjectDescription,
    context: &mut Context,
    plan: &mut Plan,
) -> (Option<Series>, Source) {
    let mut found = None;
    let (sums, source) = read_by(object, context, |query, files| {
        let series = if query.has("data") {
            let axes = axes_of_data(query);
            let tensor = query.complex_tensor("data")?;
            let axes_found = tensor.shape().len();
            if tensor.is_complex() && axes_found != 4 {
                let found = axes_found - 1;
                let message = format!("complex amplitudes have three axes, this array has {found}");
                query.error("data", message);
                return None;
            }
            let series = Series::of_tensor(&tensor, axes, plan);
            series
                .map_err(|e| refuse("data", &e, e.to_string(), query))
                .ok()?
        } else {
            let file = VolumeFile::of(query, files)?;
            let read = Series::read(&file.path, file.options(files), plan);
            read.map_err(|e| refuse("filename", &e.problem, e.to_string(), query))
                .ok()?
        };
        found = Some((series.squares, series.shape));
        Some(series.sums)
    });
    let series = sums.zip(found).map(|(sums, (squares, shape))| Series {
        sums,
        squares,
        shape,
    });
    (series, source)
}

/// Reads samples and determines their placement.
fn read_by<T: Sample>(
    object: &ObjectDescription,
    context: &mut Context,
    read: impl FnOnce(&mut Query, &mut FileRegistry) -> Option<Volume<T>>,
) -> (Option<Volume<T>>, Source) {
    let mut query = Query::new(object, context.diagnostics);
    let volume = read(&mut query, context.files);
    let chosen = query.has("placement");
    let mut placement = match query.word("placement") {
        "nodes" => Placement::Nodes,
        _ => Placement::Centers,
    };
    let matrix = query.transform("to_world");
    let boxed = query.boolean("use_grid_bbox");
    let mut to_world = affine(matrix, "to_world", &mut query);
    let mut placed_by = FactSource::Scene;
    if let Some((volume, frame)) = volume.as_ref().and_then(|v| Some((v, v.frame()?))) {
        let own = if frame.nodes {
            Placement::Nodes
        } else {
            Placement::Centers
        };
        if chosen && placement != own {
            query.error(
                "placement",
                "the file states another placement: leave 'placement' out",
            );
        }
        placement = own;
        to_world *= frame.to_file(volume.size());
        placed_by = FactSource::File;
    } else if let (Some(volume), true) = (&volume, boxed) {
        to_world *= own_box(volume, placement == Placement::Nodes, &mut query);
        placed_by = FactSource::File;
    }
    let source = Source {
        placement,
        to_world,
        placed_by,
    };
    (volume, source)
}

/// File that a volume names.
struct VolumeFile {
    path: PathBuf,
    axes: Option<AxisOrder>,
    dataset: Option<String>,
}

impl VolumeFile {
    /// Reads the file name, and the properties that the file format does not record, such as the
    /// order of axes.
    fn of(query: &mut Query, files: &mut FileRegistry) -> Option<Self> {
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
        let is_named = !path.as_os_str().is_empty();
        is_named.then_some(VolumeFile {
            path,
            axes,
            dataset,
        })
    }

    fn options(&self, files: &FileRegistry) -> Options<'_> {
        Options {
            axes: self.axes,
            dataset: self.dataset.as_deref(),
            limits: files.limits(),
        }
    }
}

/// Returns the axis order of an array in the scene itself: `[z, y, x]` by default, as in Mitsuba.
fn axes_of_data(query: &mut Query) -> AxisOrder {
    if query.has("filename") || query.has("dataset") {
        query.error("data", "give 'data' or 'filename', not both");
    }
    axes(None, query).unwrap_or(AxisOrder::ZYX)
}

/// Returns the map from the unit cube to the bounding box in a file. If samples lie at the centres
/// of the box's cells and are placed as `nodes`, the map covers the first centre to the last.
fn own_box<T: Sample>(volume: &Volume<T>, nodes: bool, query: &mut Query) -> DAffine3 {
    let Some([min, max]) = volume.bbox() else {
        let message = "the file has no bounding box: place the volume by 'to_world'";
        query.error("use_grid_bbox", message);
        return DAffine3::IDENTITY;
    };
    if !(min.is_finite() && max.is_finite()) {
        let message = format!(
            "the bounding box in the file is not finite: {} to {}; place the volume by 'to_world'",
            Shown(min),
            Shown(max)
        );
        query.error("use_grid_bbox", message);
        return DAffine3::IDENTITY;
    }
    let size = max - min;
    if size.min_element() <= 0.0 {
        let message = format!("the file's bounding box is empty: {min} to {max}");
        query.error("use_grid_bbox", message);
        return DAffine3::IDENTITY;
    }
    if nodes && volume.has_box_of_cells() {
        let cells = VolumeFrame::of_box([min, max], volume.size());
        return VolumeFrame { nodes, ..cells }.to_file(volume.size());
    }
    DAffine3::from_translation(min) * DAffine3::from_scale(size)
}

/// Reads the order of the axes of an array.
fn axes(format: Option<Format>, query: &mut Query) -> Option<AxisOrder> {
    let named = query.has("axis_order");
    match format {
        // Exclude HDF5: output files of k-Wave state the axis order.
        Some(format) if format.needs_axis_order() && format != Format::Hdf5 && !named => {
            let message = "the format does not state the order of the axes: give 'axis_order', \"zyx\" if the last index runs along x, \"xyz\" if the first index does";
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

/// Reads the name of the dataset among the volumes of a file.
fn dataset(format: Option<Format>, query: &mut Query) -> Option<String> {
    let named = query.has("dataset");
    match format {
        Some(format) if named && !format.has_datasets() => {
            let message = "only .npz, HDF5, .mat, .vti, .vtk and .jdt files hold several";
            query.error("dataset", message);
            None
        }
        _ => named.then(|| query.string("dataset")),
    }
}
