//! Arguments of `morgana plot`.

use super::MemoryArgs;
use super::values::{bin, finite, pixel};
use clap::{Args as ClapArgs, Subcommand};
use std::path::PathBuf;

/// `morgana plot`.
#[derive(Debug, ClapArgs)]
pub struct PlotArgs {
    #[command(flatten)]
    pub memory: MemoryArgs,
    /// Figure.
    #[command(subcommand)]
    pub figure: FigureArgs,
}

/// Figures.
#[derive(Debug, Subcommand)]
pub enum FigureArgs {
    /// Values along a row or a column of EXR images, with bands of one standard error.
    #[command(
        after_help = "Example:\n  morgana plot profile with.exr without.exr --row 48 -o profile.svg"
    )]
    Profile {
        /// Images (.exr).
        #[arg(required = true, value_name = "IMAGE")]
        images: Vec<PathBuf>,
        /// Row of pixels, from 0 at the top.
        #[arg(
            long,
            value_name = "Y",
            conflicts_with = "column",
            required_unless_present = "column"
        )]
        row: Option<usize>,
        /// Column of pixels, from 0 at the left.
        #[arg(long, value_name = "X")]
        column: Option<usize>,
        /// Layer, for example bounce.1; the image itself by default.
        #[arg(
            long,
            value_name = "NAME",
            default_value = "",
            hide_default_value = true
        )]
        layer: String,
        /// Channel; the mean over all by default.
        #[arg(long, value_name = "NAME")]
        channel: Option<String>,
        /// File to write: .svg or .png.
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
    /// A layer of an EXR image in false colours, with a colour bar.
    #[command(after_help = "Example:\n  \
        morgana plot image jet.exr --layer deflection --channel X -o deflection.png")]
    Image {
        /// Image (.exr).
        #[arg(value_name = "IMAGE")]
        image: PathBuf,
        /// Layer, for example deflection; the image itself by default.
        #[arg(
            long,
            value_name = "NAME",
            default_value = "",
            hide_default_value = true
        )]
        layer: String,
        /// Channel; the mean over all by default.
        #[arg(long, value_name = "NAME")]
        channel: Option<String>,
        /// Logarithmic colour scale.
        #[arg(long)]
        log: bool,
        /// File to write: .svg or .png.
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
    /// Light over optical length or time, from EXR images with bins.
    #[command(
        after_help = "Example:\n  morgana plot histogram transient.exr --pixel 20,30 -o time.png"
    )]
    Histogram {
        /// Images (.exr).
        #[arg(required = true, value_name = "IMAGE")]
        images: Vec<PathBuf>,
        /// Pixel, from 0,0 at the top left, instead of the mean over all.
        #[arg(long, value_name = "X,Y", value_parser = pixel)]
        pixel: Option<[usize; 2]>,
        /// Channel; the mean over all by default.
        #[arg(long, value_name = "NAME")]
        channel: Option<String>,
        /// File to write: .svg or .png.
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
    /// A section through readings of a fluence meter.
    #[command(after_help = "Example:\n  \
        morgana plot slice fluence.npz --axis z --at 0.5 --log -o slice.png")]
    Slice {
        /// Readings (.npz).
        #[arg(value_name = "READINGS")]
        readings: PathBuf,
        /// Normal of the section: x, y or z of the meter.
        #[arg(long, value_name = "AXIS", default_value = "z", value_parser = ["x", "y", "z"])]
        axis: String,
        /// Position on --axis.
        #[arg(long, value_name = "POSITION", allow_hyphen_values = true, value_parser = finite)]
        at: f64,
        /// Array, for example absorbed; the fluence by default.
        #[arg(long, value_name = "NAME")]
        array: Option<String>,
        /// Bin of another axis, from 0, such as order=1, delay=3 or channel=2.
        ///
        /// Without it, gates are summed and channels averaged. Sidebands and correlations require it.
        #[arg(long = "bin", value_name = "AXIS=N", value_parser = bin)]
        bins: Vec<(String, usize)>,
        /// Logarithmic colour scale.
        #[arg(long)]
        log: bool,
        /// File to write: .svg or .png.
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
    /// Errors over samples per pixel, from files of `render --stats`, with a line per integrator.
    #[command(after_help = "Example:\n  morgana plot convergence a.json b.json -o convergence.svg")]
    Convergence {
        /// Statistics (.json).
        #[arg(required = true, value_name = "STATS")]
        stats: Vec<PathBuf>,
        /// File to write: .svg or .png.
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
}
