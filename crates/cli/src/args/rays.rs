//! Arguments of `morgana trace` and `morgana connect`.

use super::SceneArgs;
use super::values::{direction, not_negative, point, positive, rays, reflections};
use clap::Args as ClapArgs;
use glam::DVec3;
use std::path::PathBuf;

/// `morgana trace`.
#[derive(Debug, ClapArgs)]
pub struct TraceArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Start of the rays.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point)]
    pub from: DVec3,
    /// Direction of the middle ray; any length.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = direction)]
    pub direction: DVec3,
    /// Number of rays.
    #[arg(long, value_name = "N", default_value = "1", value_parser = rays)]
    pub rays: usize,
    /// Angle of the fan of rays, in degrees.
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, value_parser = not_negative)]
    pub spread: f64,
    /// Width over which the rays start, across their direction.
    #[arg(long, value_name = "LENGTH", default_value_t = 0.0, value_parser = not_negative)]
    pub width: f64,
    /// Longest ray; ten times the size of the scene by default.
    #[arg(long, value_name = "LENGTH", value_parser = positive, hide_short_help = true)]
    pub max_length: Option<f64>,
    /// Index of the straight reference rays of optical path differences.
    ///
    /// The default is the `reference_index` of the scene's `aov`, which may vary in space, or else
    /// the index of the surroundings.
    #[arg(long, value_name = "N", value_parser = positive, hide_short_help = true)]
    pub reference_index: Option<f64>,
    /// Wavelength in vacuum, in scene units, to write optical path differences also in waves.
    #[arg(long, value_name = "LENGTH", value_parser = positive, hide_short_help = true)]
    pub wavelength: Option<f64>,
    /// Draw the rays over this picture (.png) of the scene.
    ///
    /// The rays are drawn as the scene's camera sees them. This needs -o FILE.svg.
    #[arg(
        long,
        value_name = "PICTURE",
        requires = "output",
        hide_short_help = true
    )]
    pub overlay: Option<PathBuf>,
    /// File to write: .csv, .json, .svg, .obj, .ply or .vtk.
    ///
    /// .svg is a plot; .obj, .ply and .vtk are for other programs.
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

/// `morgana connect`.
#[derive(Debug, ClapArgs)]
pub struct ConnectArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Start of the ray.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point)]
    pub from: DVec3,
    /// End of the ray.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point)]
    pub to: DVec3,
    /// Find every branch by a dense search, instead of the primary branch only.
    #[arg(long)]
    pub all: bool,
    /// Number of reflections to allow where refraction is possible.
    ///
    /// A ray of a branch may be reflected up to this many times at smooth dielectrics that it could
    /// also pass. Total reflections do not count.
    #[arg(long, value_name = "K", default_value_t = 0, requires = "all", value_parser = reflections)]
    pub reflections: u32,
}
