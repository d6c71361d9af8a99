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
/// Percentile of the positive values at which a logarithmic scale begins, in percent. Single values
/// near zero would otherwise stretch the scale.
const DARK_PERCENTILE: usize = 1;
/// Smallest ratio of the ends of signed values. Filters of films with negative lobes make a few
/// values of unsigned quantities slightly negative.
const MIN_SIGNED_RATIO: f64 = 0.02;
/// Colours of the lowest value, of zero, and of the highest value of signed quantities
/// (ColorBrewer's RdBu).
const DIVERGING: [RGBColor; 3] = [
    RGBColor(33, 102, 172),
    RGBColor(247, 247, 247),
    RGBColor(178, 24, 43),
];
/// Largest number of decades of a logarithmic scale below the largest value.
const MAX_DECADES: i32 = 6;

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
        let colours = self.colours();
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
        chart.draw_series(self.cells(colours)).map_err(failed)?;
        self.bar(&right, scale, colours, above)
    }

    fn cells(&self, colours: Colours) -> impl Iterator<Item = Rectangle<(f64, f64)>> {
        let (x, y) = (&self.x.1, &self.y.1);
        let columns = x.len() - 1;
        self.values.iter().enumerate().map(move |(i, value)| {
            let (column, row) = (i % columns, i / columns);
            let corners = [(x[column], y[row]), (x[column + 1], y[row + 1])];
            Rectangle::new(corners, colours.colour(*value).filled())
        })
    }

    /// Returns the scale of colours.
    fn colours(&self) -> Colours {
        if self.logarithmic {
            let mut positive: Vec<f64> = self.values.iter().copied().filter(|v| *v > 0.0).collect();
            positive.sort_by(f64::total_cmp);
            let first = positive.len().saturating_sub(1) * DARK_PERCENTILE / 100;
            let [low, high] = range(positive.iter().copied().skip(first));
            let low = low.max(high * 10f64.powi(-MAX_DECADES));
            return Colours {
                low,
                high,
                kind: ScaleKind::Logarithmic,
            };
        }
        let [low, high] = range(self.values.iter().copied());
        let most = high.max(-low);
        if high.min(-low) > MIN_SIGNED_RATIO * most {
            return Colours {
                low: -most,
                high: most,
                kind: ScaleKind::Signed,
            };
        }
        Colours {
            low,
            high,
            kind: ScaleKind::Linear,
        }
    }

    fn bar<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        scale: Scale,
        colours: Colours,
        above: u32,
    ) -> Result<(), CommandError> {
        let Colours { low, high, .. } = colours;
        let step = |i: usize| colours.value(i as f64 / STEPS as f64);
        let cells = (0..STEPS).map(|i| {
            let colour = colours.colour(step(i));
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
        let even = |count: u32| {
            (0..=count)
                .map(|i| colours.value(f64::from(i) / f64::from(count)))
                .collect()
        };
        let ticks: Vec<f64> = match colours.kind {
            ScaleKind::Logarithmic => decades(low, high),
            ScaleKind::Linear => even(5),
            // An even number of intervals has a tick at zero.
            ScaleKind::Signed => even(4),
        };
        let (_, height) = area.dim_in_pixel();
        let (top, bottom) = (scale.px(42) + above, height - scale.px(56) - above);
        for value in ticks {
            let y = f64::from(bottom) - colours.place(value) * f64::from(bottom - top);
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

/// A scale of colours.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Colours {
    /// Value of the first colour.
    low: f64,
    /// Value of the last colour.
    high: f64,
    kind: ScaleKind,
}

/// Spacing and colours of a scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ScaleKind {
    Linear,
    Logarithmic,
    /// Linear, with diverging colours that are white at zero.
    Signed,
}

impl Colours {
    /// Returns the place of a value on the scale, from 0 to 1.
    fn place(self, value: f64) -> f64 {
        match self.kind {
            ScaleKind::Logarithmic => (value / self.low).ln() / (self.high / self.low).ln(),
            ScaleKind::Linear | ScaleKind::Signed => (value - self.low) / (self.high - self.low),
        }
    }

    /// Returns the value at a place from 0 to 1.
    fn value(self, place: f64) -> f64 {
        match self.kind {
            ScaleKind::Logarithmic => self.low * (self.high / self.low).powf(place),
            ScaleKind::Linear | ScaleKind::Signed => self.low + (self.high - self.low) * place,
        }
    }

    /// Returns the colour of a value; values that the scale cannot show are grey.
    fn colour(self, value: f64) -> RGBColor {
        let place = self.place(value);
        if place.is_nan() {
            return RGBColor(200, 200, 200);
        }
        let place = place.clamp(0.0, 1.0);
        match self.kind {
            ScaleKind::Signed => DerivedColorMap::new(&DIVERGING).get_color(place),
            ScaleKind::Linear | ScaleKind::Logarithmic => ViridisRGB.get_color(place),
        }
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

#[cfg(test)]
mod tests {
    use super::{DIVERGING, Map, RGBColor, ScaleKind};

    fn map(values: Vec<f64>, logarithmic: bool) -> Map {
        Map {
            title: String::new(),
            x: (
                String::new(),
                (0..=values.len()).map(|i| i as f64).collect(),
            ),
            y: (String::new(), vec![0.0, 1.0]),
            values,
            quantity: String::new(),
            logarithmic,
        }
    }

    #[test]
    fn signed_values_have_diverging_colours() {
        let colours = map(vec![-1.0, f64::NAN, 3.0], false).colours();
        assert_eq!((colours.low, colours.high), (-3.0, 3.0));
        let found = [-3.0, 0.0, 3.0].map(|v| colours.colour(v));
        assert_eq!(found, DIVERGING);
        assert_eq!(colours.colour(f64::NAN), RGBColor(200, 200, 200));
        for unsigned in [[-1.0, 100.0], [0.0, 1.0], [-2.0, -1.0]] {
            let colours = map(unsigned.to_vec(), false).colours();
            assert_eq!(colours.kind, ScaleKind::Linear);
            assert_eq!([colours.low, colours.high], unsigned);
        }
    }

    #[test]
    fn logarithmic_scales_begin_at_a_percentile() {
        let mut values = vec![1e-3; 9];
        values.extend((0..=991).map(|i| 1.0 + f64::from(i) / 991.0));
        values.push(-1.0);
        let colours = map(values, true).colours();
        assert!((1.0..1.01).contains(&colours.low) && colours.high == 2.0);
        assert_eq!(colours.kind, ScaleKind::Logarithmic);
        assert_eq!(map(vec![1e-3, 1.0], true).colours().low, 1e-3);
    }
}
