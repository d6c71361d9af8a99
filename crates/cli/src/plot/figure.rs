//! Drawing figures as SVG or PNG, and writing the files.

use super::{Curves, Map};
use crate::command_error::CommandError;
use io::atomic;
use io::image::RgbImage;
use io::image::png::{Depth, encode};
use io::image::tone::Tone;
use io::scene::linear_from_srgb;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use std::fmt::Display;
use std::path::Path;

/// Size of a figure, in pixels.
pub const SIZE: (u32, u32) = (800, 500);
/// Pixels of a PNG file per pixel of the figure, for sharp text.
const SHARPNESS: u32 = 2;

/// File format of figures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Vector graphics.
    Svg,
    /// Pixel graphics.
    Png,
}

/// A figure.
#[derive(Clone, Debug)]
pub enum Figure {
    /// Curves with errors.
    Curves(Curves),
    /// Values over a plane, with a colour bar.
    Map(Map),
}

/// Number of canvas pixels per pixel of the figure.
#[derive(Clone, Copy, Debug)]
pub struct Scale(u32);

impl Scale {
    /// Converts a length in the figure to canvas pixels.
    pub fn px(self, length: u32) -> u32 {
        length * self.0
    }

    /// Returns the font with this height.
    pub fn font(self, height: u32) -> (&'static str, u32) {
        ("sans-serif", height * self.0)
    }
}

/// Makes the error for a failure to draw.
pub fn failed(error: impl Display) -> CommandError {
    CommandError::Runtime(format!("cannot draw the figure: {error}"))
}

/// Draws a figure and writes it, completely or not at all.
pub fn write(path: &Path, format: Format, figure: &Figure) -> Result<(), CommandError> {
    let font = epaint_default_fonts::UBUNTU_LIGHT;
    register_font("sans-serif", FontStyle::Normal, font)
        .map_err(|_| failed("the font cannot be read"))?;
    let bytes = match format {
        Format::Svg => {
            let mut text = String::new();
            let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
            draw(&area, Scale(1), figure)?;
            area.present().map_err(failed)?;
            drop(area);
            text.into_bytes()
        }
        Format::Png => {
            let (width, height) = (SIZE.0 * SHARPNESS, SIZE.1 * SHARPNESS);
            let mut pixels = vec![0; 3 * width as usize * height as usize];
            let area = BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area();
            draw(&area, Scale(SHARPNESS), figure)?;
            area.present().map_err(failed)?;
            drop(area);
            let linear = |v: u8| linear_from_srgb(f64::from(v) / 255.0) as f32;
            let image = RgbImage {
                width: width as usize,
                height: height as usize,
                pixels: pixels
                    .chunks_exact(3)
                    .map(|p| [linear(p[0]), linear(p[1]), linear(p[2])])
                    .collect(),
            };
            encode(&image, Depth::Eight, Tone::default()).map_err(failed)?
        }
    };
    Ok(atomic::write_bytes(path, &bytes)?)
}

fn draw<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    scale: Scale,
    figure: &Figure,
) -> Result<(), CommandError> {
    area.fill(&WHITE).map_err(failed)?;
    match figure {
        Figure::Curves(curves) => curves.draw(area, scale),
        Figure::Map(map) => map.draw(area, scale),
    }
}

/// Formats a number beside a tick.
pub fn label(value: &f64) -> String {
    let size = value.abs();
    let text = if size != 0.0 && !(1e-3..1e5).contains(&size) {
        format!("{value:.3e}").replace(".000e", "e")
    } else {
        // Hide round-off in the positions of ticks.
        format!("{}", (value * 1e9).round() / 1e9)
    };
    text.replace('-', "−")
}

/// Returns the range of numbers, widened if it is empty.
pub fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let finite = values.filter(|v| v.is_finite());
    let [low, high] = finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
        [low.min(v), high.max(v)]
    });
    match low.partial_cmp(&high) {
        Some(std::cmp::Ordering::Less) => [low, high],
        Some(_) if low.is_finite() => {
            let room = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
            [low - room, low + room]
        }
        _ => [0.0, 1.0],
    }
}

#[cfg(test)]
mod tests {
    use super::{label, range};

    #[test]
    fn labels_are_short() {
        let labels = [0.0, -0.25, 1200.0, 1e-6, 0.30000000000000004].map(|v| label(&v));
        assert_eq!(labels, ["0", "−0.25", "1200", "1e−6", "0.3"]);
    }

    #[test]
    fn ranges_are_never_empty() {
        assert_eq!(range([1.0, f64::NAN, 3.0].into_iter()), [1.0, 3.0]);
        assert_eq!(range([2.0].into_iter()), [1.8, 2.2]);
        assert_eq!(range([0.0].into_iter()), [-1.0, 1.0]);
        assert_eq!(range(std::iter::empty()), [0.0, 1.0]);
    }
}
