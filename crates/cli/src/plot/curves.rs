//! Curves, with bands for their standard errors.

use super::figure::{Scale, failed, label, range};
use crate::command_error::CommandError;
use plotters::chart::ChartContext;
use plotters::coord::Shift;
use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::prelude::*;

/// Colours that are distinguishable with any kind of colour vision (Okabe and Ito 2008).
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

/// A curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// x, y and the standard error of y (zero if there is none).
    pub points: Vec<[f64; 3]>,
    /// True for a guide to the eye: a thin, dark line without markers.
    pub guide: bool,
}

/// Curves in one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Curves {
    /// Title above the frame.
    pub title: String,
    /// Label of the horizontal axis.
    pub x: String,
    /// Label of the vertical axis.
    pub y: String,
    /// True if both axes are logarithmic. Points that are not positive are then left out.
    pub logarithmic: bool,
    /// Curves.
    pub series: Vec<Series>,
}

impl Curves {
    /// Draws the curves.
    pub fn draw<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        scale: Scale,
    ) -> Result<(), CommandError> {
        let [x0, x1] = range(self.shown().map(|p| p[0]));
        let ends = self.shown().flat_map(|[_, y, e]| {
            if self.logarithmic {
                [y, y]
            } else {
                [y - e, y + e]
            }
        });
        let [y0, y1] = range(ends);
        let mut builder = ChartBuilder::on(area);
        builder
            .caption(&self.title, scale.font(20))
            .margin(scale.px(12))
            .x_label_area_size(scale.px(44))
            .y_label_area_size(scale.px(76));
        if self.logarithmic {
            let x = (x0 / 1.2..x1 * 1.2).log_scale();
            let y = (y0 / 1.3..y1 * 1.3).log_scale();
            let mut chart = builder.build_cartesian_2d(x, y).map_err(failed)?;
            self.inside(&mut chart, scale)
        } else {
            let room = 0.04 * (y1 - y0);
            let y = y0 - room..y1 + room;
            let mut chart = builder.build_cartesian_2d(x0..x1, y).map_err(failed)?;
            self.inside(&mut chart, scale)
        }
    }

    fn shown(&self) -> impl Iterator<Item = [f64; 3]> {
        let points = self.series.iter().flat_map(|s| &s.points).copied();
        points.filter(|p| self.shows(p))
    }

    fn shows(&self, [x, y, _]: &[f64; 3]) -> bool {
        x.is_finite() && y.is_finite() && (!self.logarithmic || (*x > 0.0 && *y > 0.0))
    }

    fn inside<'a, B, X, Y>(
        &self,
        chart: &mut ChartContext<'a, B, Cartesian2d<X, Y>>,
        scale: Scale,
    ) -> Result<(), CommandError>
    where
        B: DrawingBackend + 'a,
        X: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.1))
            .label_style(scale.font(13))
            .axis_desc_style(scale.font(15))
            .x_desc(&self.x)
            .y_desc(&self.y)
            .x_label_formatter(&label)
            .y_label_formatter(&label)
            .draw()
            .map_err(failed)?;
        for (i, series) in self.series.iter().enumerate() {
            let colour = COLOURS[i % COLOURS.len()];
            self.line(chart, scale, series, colour)?;
        }
        if self.series.len() > 1 {
            chart
                .configure_series_labels()
                .background_style(WHITE.mix(0.85))
                .border_style(BLACK.mix(0.2))
                .label_font(scale.font(13))
                .legend_area_size(scale.px(30))
                .position(SeriesLabelPosition::UpperRight)
                .draw()
                .map_err(failed)?;
        }
        Ok(())
    }

    fn line<'a, B, X, Y>(
        &self,
        chart: &mut ChartContext<'a, B, Cartesian2d<X, Y>>,
        scale: Scale,
        series: &Series,
        colour: RGBColor,
    ) -> Result<(), CommandError>
    where
        B: DrawingBackend + 'a,
        X: Ranged<ValueType = f64>,
        Y: Ranged<ValueType = f64>,
    {
        let points: Vec<[f64; 3]> = series
            .points
            .iter()
            .filter(|p| self.shows(p))
            .copied()
            .collect();
        if points.iter().any(|p| p[2] > 0.0) && !self.logarithmic {
            let upper = points.iter().map(|[x, y, e]| (*x, y + e));
            let lower = points.iter().rev().map(|[x, y, e]| (*x, y - e));
            let band = Polygon::new(upper.chain(lower).collect::<Vec<_>>(), colour.mix(0.22));
            chart.draw_series([band]).map_err(failed)?;
        }
        let (colour, width) = if series.guide {
            (BLACK.mix(0.6), 1)
        } else {
            (colour.to_rgba(), 2)
        };
        let style = colour.stroke_width(scale.px(width));
        let path = points.iter().map(|p| (p[0], p[1]));
        let long = scale.px(22) as i32;
        chart
            .draw_series(LineSeries::new(path.clone(), style))
            .map_err(failed)?
            .label(&series.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + long, y)], style));
        // Mark the points if they are few.
        if !series.guide && points.len() <= 40 {
            let dots = path.map(|p| Circle::new(p, scale.px(3), colour.filled()));
            chart.draw_series(dots).map_err(failed)?;
        }
        Ok(())
    }
}
