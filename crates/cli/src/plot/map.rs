//! Maps of values over a plane.

use super::figure::{Scale, failed, label, range};
use crate::command_error::CommandError;
use plotters::coord::Shift;
use plotters::prelude::*;
use std::ops::Range;

/// Width of the colour bar with its numbers, in pixels.
const BAR: u32 = 120;
/// Number of steps of the colour bar.
const STEPS: usize = 200;
/// Largest number of decades of a logarithmic scale below the largest value.
const DECADES: i32 = 6;

/// A map of cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Title above the frame.
    pub title: String,
    /// Label of the horizontal axis, and the edges of the cells along it.
    pub x: (String, Vec<f64>),
    /// Label of the vertical axis, and the edges of the cells along it.
    pub y: (String, Vec<f64>),
    /// Values, row by row from the bottom.
    pub values: Vec<f64>,
    /// Label of the values.
    pub quantity: String,
    /// True if the colour scale is logarithmic.
    pub logarithmic: bool,
}

impl Map {
    /// Draws the map.
    pub fn draw<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        scale: Scale,
    ) -> Result<(), CommandError> {
        let (width, height) = area.dim_in_pixel();
        let (left, right) = area.split_horizontally(width - scale.px(BAR));
        let [low, high] = self.limits();
        let (x, y) = (ends(&self.x.1), ends(&self.y.1));
        let caption = scale.font(20);
        // Use equal lengths per unit on both axes.
        let (margin, foot, side, head) = (scale.px(12), scale.px(44), scale.px(70), scale.px(30));
        let room = (
            f64::from(width - scale.px(BAR) - 2 * margin - side),
            f64::from(height - 2 * margin - foot - head),
        );
        let unit = (room.0 / (x.end - x.start)).min(room.1 / (y.end - y.start));
        let spare = |room: f64, range: &Range<f64>| {
            ((room - unit * (range.end - range.start)) / 2.0).max(0.0) as u32
        };
        let (aside, above) = (spare(room.0, &x), spare(room.1, &y));
        let labels = |range: &Range<f64>, space: u32| {
            ((unit * (range.end - range.start)) as u32 / scale.px(space)).max(2) as usize
        };
        let (across, upwards) = (labels(&x, 56), labels(&y, 36));
        let mut chart = ChartBuilder::on(&left)
            .caption(&self.title, caption)
            .margin(margin)
            .margin_left(margin + aside)
            .margin_right(margin + aside)
            .margin_bottom(margin + above)
            .margin_top(margin + above)
            .x_label_area_size(foot)
            .y_label_area_size(side)
            .build_cartesian_2d(x, y)
            .map_err(failed)?;
        chart
            .configure_mesh()
            .disable_mesh()
            .x_labels(across)
            .y_labels(upwards)
            .label_style(scale.font(13))
            .axis_desc_style(scale.font(15))
            .x_desc(&self.x.0)
            .y_desc(&self.y.0)
            .x_label_formatter(&label)
            .y_label_formatter(&label)
            .draw()
            .map_err(failed)?;
        chart.draw_series(self.cells(low, high)).map_err(failed)?;
        self.bar(&right, scale, [low, high], above)
    }

    fn cells(&self, low: f64, high: f64) -> impl Iterator<Item = Rectangle<(f64, f64)>> {
        let (x, y) = (&self.x.1, &self.y.1);
        let columns = x.len() - 1;
        self.values.iter().enumerate().map(move |(i, value)| {
            let (column, row) = (i % columns, i / columns);
            let corners = [(x[column], y[row]), (x[column + 1], y[row + 1])];
            Rectangle::new(corners, self.colour(*value, low, high).filled())
        })
    }

    /// Returns the lowest and highest value of the colour scale.
    fn limits(&self) -> [f64; 2] {
        if !self.logarithmic {
            return range(self.values.iter().copied());
        }
        let [low, high] = range(self.values.iter().copied().filter(|v| *v > 0.0));
        [low.max(high * 10f64.powi(-DECADES)), high]
    }

    fn colour(&self, value: f64, low: f64, high: f64) -> RGBColor {
        let place = if self.logarithmic {
            (value / low).ln() / (high / low).ln()
        } else {
            (value - low) / (high - low)
        };
        if place.is_nan() {
            RGBColor(200, 200, 200)
        } else {
            ViridisRGB.get_color(place.clamp(0.0, 1.0))
        }
    }

    fn bar<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        scale: Scale,
        [low, high]: [f64; 2],
        above: u32,
    ) -> Result<(), CommandError> {
        let step = |i: usize| {
            let t = i as f64 / STEPS as f64;
            if self.logarithmic {
                low * (high / low).powf(t)
            } else {
                low + (high - low) * t
            }
        };
        let cells = (0..STEPS).map(|i| {
            let colour = self.colour(step(i), low, high);
            Rectangle::new([(0.0, step(i)), (1.0, step(i + 1))], colour.filled())
        });
        let mut builder = ChartBuilder::on(area);
        builder
            .margin_top(scale.px(12 + 30) + above)
            .margin_bottom(scale.px(12 + 44) + above)
            .margin_left(scale.px(4))
            .margin_right(scale.px(84))
            .right_y_label_area_size(scale.px(0));
        area.draw(&Text::new(
            self.quantity.clone(),
            (0, (scale.px(20) + above) as i32),
            scale.font(13),
        ))
        .map_err(failed)?;
        let ticks: Vec<f64> = if self.logarithmic {
            decades(low, high)
        } else {
            (0..=5)
                .map(|i| low + (high - low) * f64::from(i) / 5.0)
                .collect()
        };
        let (_, height) = area.dim_in_pixel();
        let (top, bottom) = (scale.px(42) + above, height - scale.px(56) - above);
        let place = |value: f64| {
            if self.logarithmic {
                (value / low).ln() / (high / low).ln()
            } else {
                (value - low) / (high - low)
            }
        };
        for value in ticks {
            let y = f64::from(bottom) - place(value) * f64::from(bottom - top);
            let at = (scale.px(40) as i32, y as i32 - scale.px(6) as i32);
            area.draw(&Text::new(short(value), at, scale.font(13)))
                .map_err(failed)?;
        }
        if self.logarithmic {
            let mut chart = builder
                .build_cartesian_2d(0.0..1.0, (low..high).log_scale())
                .map_err(failed)?;
            chart.draw_series(cells).map_err(failed)?;
        } else {
            let mut chart = builder
                .build_cartesian_2d(0.0..1.0, low..high)
                .map_err(failed)?;
            chart.draw_series(cells).map_err(failed)?;
        }
        Ok(())
    }
}

fn ends(edges: &[f64]) -> Range<f64> {
    edges.first().copied().unwrap_or(0.0)..edges.last().copied().unwrap_or(1.0)
}

/// Returns the powers of ten in a range, or its ends if there are fewer than two powers.
fn decades(low: f64, high: f64) -> Vec<f64> {
    let first = low.log10().ceil() as i32;
    let last = high.log10().floor() as i32;
    if last > first {
        (first..=last).map(|k| 10f64.powi(k)).collect()
    } else {
        vec![low, high]
    }
}

/// Formats a number beside the colour bar with three digits.
fn short(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-2..1e4).contains(&size) {
        return format!("{value:.2e}").replace('-', "−");
    }
    let digits = match size {
        s if s >= 100.0 => 0,
        s if s >= 10.0 => 1,
        s if s >= 1.0 => 2,
        _ => 3,
    };
    format!("{value:.digits$}").replace('-', "−")
}
