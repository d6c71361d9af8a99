//! Background that shows the refractive index, with its colour bar.

use super::axes::tick;
use super::colour::{INK, hex, scale};
use super::ticks::ticks;
use super::view::View;
use crate::command_error::CommandError;
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use io::image::RgbImage;
use io::image::png::{Depth, encode};
use io::image::tone::Tone;
use io::scene::linear_from_srgb;
use std::fmt::Write;
use transport::Scene;

/// Side of a cell of the background, in pixels of the page.
const CELL: f64 = 2.0;
/// Largest difference of the index that counts as round-off.
const ROUND_OFF: f64 = 1e-9;

/// Refractive index over the window.
#[derive(Debug)]
pub struct Heat {
    png: String,
    low: f64,
    high: f64,
}

impl Heat {
    /// Computes the index in the plane of a view. Colours show media with varying index; if no
    /// index varies within a medium, they show all media. Returns `None` if all shown indices are
    /// equal.
    pub fn new(scene: &Scene, view: &View) -> Result<Option<Heat>, CommandError> {
        let [width, height] = view.size().map(|s| (s / CELL).ceil().max(1.0) as usize);
        let place = |i: usize| [(i % width) as f64, (i / width) as f64].map(|c| (c + 0.5) * CELL);
        let cells: Vec<(bool, f64)> = (0..width * height)
            .map(|i| {
                let x = view.point(place(i));
                let medium = scene.medium_at(x);
                (
                    !scene.medium(medium).index.is_constant(),
                    scene.n(medium, x),
                )
            })
            .collect();
        let graded = cells.iter().any(|(varies, _)| *varies);
        let shown = |cell: &&(bool, f64)| (cell.0 || !graded) && cell.1.is_finite();
        let values = || cells.iter().filter(shown).map(|cell| cell.1);
        let (low, high) = (
            values().fold(f64::INFINITY, f64::min),
            values().fold(f64::NEG_INFINITY, f64::max),
        );
        let differs = high - low > ROUND_OFF;
        if !differs {
            return Ok(None);
        }
        let colour = |cell: &(bool, f64)| {
            if shown(&cell) {
                scale((cell.1 - low) / (high - low)).map(|v| linear_from_srgb(v) as f32)
            } else {
                [1.0; 3]
            }
        };
        let image = RgbImage {
            width,
            height,
            pixels: cells.iter().map(colour).collect(),
        };
        let bytes = encode(&image, Depth::Eight, Tone::default());
        let bytes = bytes.map_err(|e| CommandError::Runtime(e.to_string()))?;
        let png = BASE64_STANDARD.encode(bytes);
        Ok(Some(Heat { png, low, high }))
    }

    /// Draws the background.
    pub fn image(&self, view: &View) -> String {
        let [width, height] = view.size().map(|s| (s / CELL).ceil() * CELL);
        format!(
            "<g clip-path=\"url(#plot)\"><image width=\"{width}\" height=\"{height}\" \
             preserveAspectRatio=\"none\" href=\"data:image/png;base64,{}\"/></g>\n",
            self.png
        )
    }

    /// Draws the colour bar to the right of a plot.
    pub fn bar(&self, width: f64, height: f64) -> String {
        const STOPS: usize = 6;
        let (x, bar) = (width + 22.0, 14.0);
        let mut out =
            String::from("<linearGradient id=\"index\" x1=\"0\" y1=\"1\" x2=\"0\" y2=\"0\">");
        for i in 0..=STOPS {
            let t = i as f64 / STOPS as f64;
            let colour = hex(scale(t));
            let _ = write!(out, "<stop offset=\"{t:.4}\" stop-color=\"{colour}\"/>");
        }
        let _ = writeln!(
            out,
            "</linearGradient>\n<rect x=\"{x:.2}\" width=\"{bar}\" height=\"{height:.2}\" \
             fill=\"url(#index)\" stroke=\"{INK}\" stroke-width=\"0.8\"/>\n<g fill=\"{INK}\">"
        );
        let count = (height / 80.0).round().max(2.0) as usize;
        for (value, label) in ticks(self.low, self.high, count) {
            let y = (self.high - value) / (self.high - self.low) * height;
            out.push_str(&tick([x + bar, y], [4.0, 0.0]));
            let (left, base) = (x + bar + 8.0, y + 4.5);
            let _ = writeln!(out, "<text x=\"{left:.2}\" y=\"{base:.2}\">{label}</text>");
        }
        let _ = writeln!(
            out,
            "<text x=\"{:.2}\" y=\"-16\" text-anchor=\"middle\">index <tspan \
             font-style=\"italic\">n</tspan></text>\n</g>",
            x + 0.5 * bar + 12.0
        );
        out
    }
}
