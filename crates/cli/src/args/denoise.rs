//! Arguments of `morgana denoise`.

use super::{MemoryArgs, ToneArgs};
use clap::Args as ClapArgs;
use std::path::PathBuf;

/// `morgana denoise`.
#[derive(Debug, ClapArgs)]
pub struct DenoiseArgs {
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
    /// Layer with the albedo of first surfaces; by default the layer albedo, if it exists.
    #[arg(
        long,
        value_name = "NAME",
        conflicts_with = "no_guides",
        hide_short_help = true
    )]
    pub albedo: Option<String>,
    /// Layer with the normals of first surfaces; by default sh_normal or geo_normal.
    ///
    /// Without this option, normals guide the denoiser only if the image also has an albedo.
    #[arg(
        long,
        value_name = "NAME",
        conflicts_with = "no_guides",
        hide_short_help = true
    )]
    pub normal: Option<String>,
    /// Use neither albedo nor normals.
    #[arg(long)]
    pub no_guides: bool,
    /// Program oidnDenoise of Open Image Denoise.
    ///
    /// The default is the value of the environment variable MORGANA_OIDN, or else oidnDenoise on the
    /// PATH.
    #[arg(long, value_name = "PROGRAM")]
    pub oidn: Option<PathBuf>,
    #[command(flatten)]
    pub tone: ToneArgs,
    #[command(flatten)]
    pub memory: MemoryArgs,
    /// File to write: .exr or .png; may be repeated.
    ///
    /// The EXR file has the layers denoised and difference.
    #[arg(short, long, value_name = "FILE", required = true)]
    pub output: Vec<PathBuf>,
    /// Print only errors.
    #[arg(short, long)]
    pub quiet: bool,
}
