//! Frame, grid, ticks and labels of plots.

use super::colour::{INK, SECONDARY_TEXT};
use super::escape;
use super::ticks::ticks;
use super::view::View;
use std::fmt::Write;

/// Approximate number of pixels between ticks.
const SPACING: f64 = 80.0;
const NAMES: [&str; 3] = ["x", "y", "z"];

/// Returns the ticks of an axis: positions in pixels from the left or from the top, and labels.
fn places(view: &View, k: usize) -> Vec<(f64, String)> {
    let [low, high] = view.range(k);
    let size = view.size()[k];
    let count = (size / SPACING).round().max(4.0) as usize;
    let place = |value: f64| match k {
        0 => (value - low) / (high - low) * size,
        _ => (high - value) / (high - low) * size,
    };
    ticks(low, high, count)
        .into_iter()
        .map(|(v, label)| (place(v), label))
        .collect()
}

/// Draws faint lines at the ticks.
pub fn grid(view: &View) -> String {
    let [width, height] = view.size();
    let mut path = String::new();
    for (x, _) in places(view, 0) {
        let _ = write!(path, "M{x:.2},0V{height:.2}");
    }
    for (y, _) in places(view, 1) {
        let _ = write!(path, "M0,{y:.2}H{width:.2}");
    }
    format!("<path d=\"{path}\" stroke=\"{INK}\" stroke-opacity=\"0.07\"/>\n")
}

/// Draws the frame, ticks with labels, names of the axes, title and note.
pub fn frame(view: &View, title: &str) -> String {
    let [width, height] = view.size();
    let mut out = format!(
        "<rect width=\"{width:.2}\" height=\"{height:.2}\" fill=\"none\" stroke=\"{INK}\"/>\n\
         <g fill=\"{INK}\" stroke=\"none\">\n"
    );
    for (x, label) in places(view, 0) {
        let y = height + 20.0;
        out.push_str(&tick([x, height], [0.0, 5.0]));
        let _ = writeln!(
            out,
            "<text x=\"{x:.2}\" y=\"{y:.2}\" text-anchor=\"middle\">{label}</text>"
        );
    }
    for (y, label) in places(view, 1) {
        out.push_str(&tick([0.0, y], [-5.0, 0.0]));
        let y = y + 4.5;
        let _ = writeln!(
            out,
            "<text x=\"-9\" y=\"{y:.2}\" text-anchor=\"end\">{label}</text>"
        );
    }
    let [right, up, away] = view.axes.map(|a| NAMES[a]);
    let (x, y) = (0.5 * width, height + 44.0);
    let italic = "font-style=\"italic\" font-size=\"15\" text-anchor=\"middle\"";
    let _ = writeln!(
        out,
        "<text x=\"{x:.2}\" y=\"{y:.2}\" {italic}>{right}</text>"
    );
    let middle = 0.5 * height;
    let _ = writeln!(
        out,
        "<text x=\"-56\" y=\"{middle:.2}\" {italic}>{up}</text>"
    );
    let title = escape(title);
    let _ = writeln!(out, "<text y=\"-16\" font-size=\"15\">{title}</text>");
    let depth = crate::numbers::plain(view.depth).replace('-', "−");
    let _ = writeln!(
        out,
        "<text x=\"{width:.2}\" y=\"{y:.2}\" text-anchor=\"end\" font-size=\"11\" fill=\"{SECONDARY_TEXT}\">\
         lengths in scene units · section at {away} = {depth}</text>\n</g>"
    );
    out
}

/// Draws a tick mark without its text.
pub fn tick([x, y]: [f64; 2], [dx, dy]: [f64; 2]) -> String {
    format!("<path d=\"M{x:.2},{y:.2}l{dx},{dy}\" stroke=\"{INK}\"/>\n")
}
