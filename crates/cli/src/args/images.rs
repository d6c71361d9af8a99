//! Arguments of `morgana compare` and `morgana tonemap`.

use super::MemoryArgs;
use super::values::{block, curve, exposure, finite, not_negative, pixel};
use clap::Args as ClapArgs;
use io::image::exposure::Exposure;
use io::image::tone::Curve;
use io::image::white::White;
use std::path::PathBuf;

/// Brightness of images on a screen.
#[derive(Clone, Copy, Debug, ClapArgs)]
pub struct ToneArgs {
    /// Exposure of PNG files in stops; 0 for none.
    ///
    /// auto chooses an exposure for which the image is neither black nor overexposed, and prints it
    /// (docs/images.md).
    #[arg(long, value_name = "STOPS", default_value = "auto", allow_negative_numbers = true, value_parser = exposure, hide_short_help = true)]
    pub exposure: Exposure,
    /// Tone curve of PNG files: srgb or filmic.
    ///
    /// srgb clips values at 1. filmic compresses values up to 5.6 (curve of J. Hable, 2010), which
    /// darkens the others.
    #[arg(long, value_name = "CURVE", default_value = "srgb", value_parser = curve, hide_short_help = true)]
    pub tone_map: Curve,
}

/// `morgana tonemap`.
#[derive(Debug, ClapArgs)]
pub struct TonemapArgs {
    /// Image (.exr, .png or .npy).
    #[arg(value_name = "IMAGE")]
    pub image: PathBuf,
    /// Layer, for example bounce.1; the image itself by default.
    #[arg(
        long,
        value_name = "NAME",
        default_value = "",
        hide_default_value = true
    )]
    pub layer: String,
    #[command(flatten)]
    pub tone: ToneArgs,
    /// Light that looks white: its temperature in K, or red, green and blue of a neutral surface.
    ///
    /// For example 3200, or 1,0.8,0.5. Luminances of surfaces in this light do not change.
    #[arg(long, value_name = "KELVIN|R,G,B")]
    pub white: Option<White>,
    /// Pixel that looks neutral, from 0,0 at the top left.
    #[arg(long, value_name = "X,Y", value_parser = pixel, conflicts_with = "white")]
    pub neutral: Option<[usize; 2]>,
    #[command(flatten)]
    pub memory: MemoryArgs,
    /// File to write: .png.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
}

/// `morgana compare`.
#[derive(Debug, ClapArgs)]
pub struct CompareArgs {
    /// Image (.exr, .png or .npy).
    #[arg(value_name = "IMAGE")]
    pub image: PathBuf,
    /// Reference image (.exr, .png or .npy).
    #[arg(value_name = "REFERENCE")]
    pub reference: PathBuf,
    /// Layer, for example bounce.1; the images themselves by default.
    #[arg(
        long,
        value_name = "NAME",
        default_value = "",
        hide_default_value = true
    )]
    pub layer: String,
    /// Layer of the reference, if its name differs; '' for the image itself.
    #[arg(long, value_name = "NAME", hide_short_help = true)]
    pub reference_layer: Option<String>,
    /// Exposure of both images for FLIP, in stops.
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite, hide_short_help = true)]
    pub exposure: f64,
    /// Divide differences of means over blocks of N × N pixels by their standard errors.
    #[arg(long, value_name = "N", default_value = "1", value_parser = block, hide_short_help = true)]
    pub block: usize,
    /// Write a map of visible differences (FLIP): .png or .exr.
    #[arg(long = "image", value_name = "FILE")]
    pub map: Option<PathBuf>,
    /// Write a map of differences over standard errors: .png or .exr.
    ///
    /// The PNG file shows -5 (darker than the reference) in blue and 5 (brighter) in red. The EXR
    /// file has the numbers. Both images need variances.
    #[arg(long, value_name = "FILE")]
    pub zmap: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub memory: MemoryArgs,
    #[command(flatten)]
    pub limits: Limits,
}

/// Limits.
#[derive(Clone, Copy, Debug, ClapArgs)]
#[command(next_help_heading = "Limits")]
pub struct Limits {
    /// Largest root mean square difference.
    #[arg(long, value_name = "X", value_parser = not_negative, hide_short_help = true)]
    pub max_rmse: Option<f64>,
    /// Largest mean squared relative difference.
    #[arg(long, value_name = "X", value_parser = not_negative)]
    pub max_relative_mse: Option<f64>,
    /// Smallest ratio of the reference's maximum to the error, in decibels.
    #[arg(long, value_name = "DB", allow_negative_numbers = true, value_parser = finite, hide_short_help = true)]
    pub min_psnr: Option<f64>,
    /// Largest mean FLIP, from 0 to 1.
    #[arg(long, value_name = "X", value_parser = not_negative)]
    pub max_flip: Option<f64>,
    /// Largest ratio of difference to standard error.
    ///
    /// Both images need variances.
    #[arg(long, value_name = "X", value_parser = not_negative)]
    pub max_z: Option<f64>,
}
