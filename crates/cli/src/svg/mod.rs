//! Plots of rays.

mod axes;
mod colour;
mod heat;
mod outline;
mod overlay;
mod ticks;
mod view;

use crate::command_error::CommandError;
use glam::DVec3;
use heat::Heat;
use std::fmt::Write;
use transport::Scene;
use transport::trace::{Path, TraceEnding};
use view::View;

pub use overlay::overlay;

/// Space around the plot, in pixels: left, top, right, bottom.
const MARGIN: [f64; 4] = [72.0, 44.0, 24.0, 62.0];
/// Space for the colour bar, in pixels.
const BAR: f64 = 84.0;

/// Largest number of rays with marked starts.
const MAX_DOTS: usize = 30;

/// Returns an SVG document that shows rays, the outlines of objects and the index, in the
/// coordinate plane of the rays' two largest extents.
pub fn plot(scene: &Scene, paths: &[Path], title: &str) -> Result<String, CommandError> {
    let view = View::new(scene, paths);
    let heat = Heat::new(scene, &view)?;
    let right = MARGIN[2] + if heat.is_some() { BAR } else { 0.0 };
    let [width, height] = view.size();
    let (total_width, total_height) = (MARGIN[0] + width + right, MARGIN[1] + height + MARGIN[3]);
    let mut out = header(total_width, total_height, [width, height]);
    if let Some(heat) = &heat {
        out.push_str(&heat.image(&view));
    }
    out.push_str("<g clip-path=\"url(#plot)\">\n");
    out.push_str(&axes::grid(&view));
    out.push_str(&outline::outlines(scene, &view));
    out.push_str(&rays(paths, &view));
    out.push_str("</g>\n");
    out.push_str(&axes::frame(&view, title));
    if let Some(heat) = &heat {
        out.push_str(&heat.bar(width, height));
    }
    out.push_str("</g>\n</svg>\n");
    Ok(out)
}

/// Opens the document, and the group in which the plot starts at the origin.
fn header(width: f64, height: f64, plot: [f64; 2]) -> String {
    let [left, top, ..] = MARGIN;
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
         viewBox=\"0 0 {width:.1} {height:.1}\" \
         font-family=\"Helvetica, Arial, 'DejaVu Sans', sans-serif\" font-size=\"13\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n\
         <clipPath id=\"plot\"><rect width=\"{:.2}\" height=\"{:.2}\"/></clipPath>\n\
         <g transform=\"translate({left},{top})\">\n",
        plot[0], plot[1]
    )
}

/// Draws the rays, with a dot at each start. Many rays are drawn thinner and fainter.
fn rays(paths: &[Path], view: &View) -> String {
    let crowd = (paths.len() as f64 / 16.0).max(1.0).sqrt();
    let (stroke, opacity) = (1.7 / crowd.min(2.0), 0.85 / crowd.min(2.0));
    let mut out = format!(
        "<g fill=\"none\" stroke=\"{}\" stroke-width=\"{stroke:.2}\" \
         stroke-opacity=\"{opacity:.2}\" stroke-linejoin=\"round\" stroke-linecap=\"round\">\n",
        colour::RAY
    );
    for path in paths {
        let points: Vec<String> = path
            .points
            .iter()
            .map(|p| p.x)
            .chain(beyond(path))
            .map(|x| view.place(x))
            .map(|[x, y]| format!("{x:.2},{y:.2}"))
            .collect();
        let _ = writeln!(out, "<polyline points=\"{}\"/>", points.join(" "));
    }
    out.push_str("</g>\n");
    let _ = writeln!(out, "<g fill=\"{}\">", colour::INK);
    for path in paths.iter().filter(|_| paths.len() <= MAX_DOTS) {
        if let Some(start) = path.points.first() {
            let [x, y] = view.place(start.x);
            let _ = writeln!(out, "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"2\"/>");
        }
    }
    out.push_str("</g>\n");
    out
}

/// Returns a point far outside the plot on a ray that has left the scene, so that the ray reaches
/// the frame.
fn beyond(path: &Path) -> Option<DVec3> {
    let last = path
        .points
        .last()
        .filter(|_| path.ending == TraceEnding::Left)?;
    Some(last.x + last.direction * (10.0 * last.arc_length))
}

/// Escapes text, so that it cannot end an element or an attribute.
fn escape(text: &str) -> String {
    text.chars()
        .map(|c| match c {
            '&' => "&amp;".into(),
            '<' => "&lt;".into(),
            '>' => "&gt;".into(),
            '"' => "&quot;".into(),
            c if c.is_control() => " ".into(),
            c => c.to_string(),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn titles_cannot_break_the_document() {
        assert_eq!(
            super::escape("a<b>&\"c\"\n"),
            "a&lt;b&gt;&amp;&quot;c&quot; "
        );
    }
}
