//! Arguments of `morgana convert`.

use super::MemoryArgs;
use super::values::{element, finite, grid, point, spacing};
use clap::Args as ClapArgs;
use glam::DVec3;
use io::element::Element;
use io::volume::AxisOrder;
use std::path::PathBuf;

/// `morgana convert`.
#[derive(Debug, ClapArgs)]
pub struct ConvertArgs {
    /// Volume to read.
    #[arg(value_name = "IN")]
    pub input: PathBuf,
    /// Volume to write; its extension chooses the format.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Array to read among several: path of a dataset, name of an array or variable.
    #[arg(long, value_name = "NAME")]
    pub dataset: Option<String>,
    /// Axis order of the array, if the format does not state it, such as xyz or zyx.
    ///
    /// zyx if the last index runs along x, xyz if the first does. Add c for channels that are not
    /// last.
    #[arg(long, value_name = "ORDER")]
    pub axes: Option<AxisOrder>,
    /// Name of the written array, in formats with names.
    #[arg(
        long,
        value_name = "NAME",
        default_value = "volume",
        hide_short_help = true
    )]
    pub out_dataset: String,
    /// Resample the box to this grid.
    ///
    /// Values are interpolated linearly between samples, and constant outside them. With fewer
    /// samples than before, the new samples are not averages over the old ones.
    #[arg(long, value_name = "NXxNYxNZ", value_parser = grid)]
    pub resample: Option<[usize; 3]>,
    /// Distances between samples along x, y and z, instead of the file's.
    ///
    /// The first sample is at the origin if neither the file nor --origin gives its position.
    #[arg(long, value_name = "X,Y,Z", value_parser = spacing)]
    pub spacing: Option<DVec3>,
    /// Position of the first sample, instead of the file's.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point)]
    pub origin: Option<DVec3>,
    /// Multiply all values by this factor.
    #[arg(long, value_name = "S", default_value_t = 1.0, allow_negative_numbers = true, value_parser = finite, hide_short_help = true)]
    pub scale: f64,
    /// Add this to all values, after --scale.
    #[arg(long, value_name = "O", default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite, hide_short_help = true)]
    pub offset: f64,
    /// Subtract this index from all values, after --scale and --offset.
    ///
    /// The scene adds it back as the volume's 'offset'. In 32-bit numbers, contrasts are far more
    /// accurate than the index.
    #[arg(long, value_name = "N_REF", allow_negative_numbers = true, value_parser = finite, hide_short_help = true)]
    pub contrast: Option<f64>,
    /// Type of the written numbers, such as float32 or uint8.
    ///
    /// Types: float16, float32, float64, int8 to int64, uint8 to uint64.
    #[arg(long = "type", value_name = "TYPE", value_parser = element)]
    pub kind: Option<Element>,
    #[command(flatten)]
    pub memory: MemoryArgs,
}
