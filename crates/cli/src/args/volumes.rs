//! Arguments about volumes.

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
    /// Volume to write.
    #[arg(value_name = "OUT")]
    pub output: PathBuf,
    /// Which of several arrays to read: path of a dataset, name of an array or variable.
    #[arg(long, value_name = "NAME")]
    pub dataset: Option<String>,
    /// Which axis of the array is which, where the format does not say: zyx if the last index runs along
    /// x, xyz if the first does; with c where the channels are, if not last.
    #[arg(long, value_name = "ORDER")]
    pub axes: Option<AxisOrder>,
    /// Name of the array that is written, in formats that have names.
    #[arg(long, value_name = "NAME", default_value = "volume")]
    pub out_dataset: String,
    /// Change the number of samples in the same box: trilinear between samples, constant from the outermost
    /// on. Fewer samples are not means over what lies between them.
    #[arg(long, value_name = "NXxNYxNZ", value_parser = grid)]
    pub resample: Option<[usize; 3]>,
    /// Distances between samples along x, y and z, instead of those of the file. The first sample is at the
    /// origin if neither the file nor --origin says where it is.
    #[arg(long, value_name = "X,Y,Z", value_parser = spacing)]
    pub spacing: Option<DVec3>,
    /// Position of the first sample, instead of that of the file.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point)]
    pub origin: Option<DVec3>,
    /// Multiply all values by this.
    #[arg(long, value_name = "S", default_value_t = 1.0, allow_negative_numbers = true, value_parser = finite)]
    pub scale: f64,
    /// Then add this.
    #[arg(long, value_name = "O", default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite)]
    pub offset: f64,
    /// Store contrasts: subtract this index from all values, last of all. The scene adds it again, as the volume's
    /// 'offset'. Contrasts are known far better than the index in numbers of 32 bits.
    #[arg(long, value_name = "N_REF", allow_negative_numbers = true, value_parser = finite)]
    pub contrast: Option<f64>,
    /// Type of the numbers that are written: float16, float32, float64, int8 to int64, uint8 to uint64.
    #[arg(long = "type", value_name = "TYPE", value_parser = element)]
    pub kind: Option<Element>,
    #[command(flatten)]
    pub memory: MemoryArgs,
}
