//! Colours of plots.

/// Colour of rays.
pub const RAY: &str = "#c2410c";
/// Colour of text, frames and outlines.
pub const INK: &str = "#1f2937";
/// Colour of secondary text.
pub const SECONDARY_TEXT: &str = "#6b7280";
/// Colour scale of the index, from low to high, in sRGB; light enough for rays to stand out.
const SCALE: [[f64; 3]; 4] = [
    [0.965, 0.975, 0.990],
    [0.800, 0.880, 0.955],
    [0.560, 0.730, 0.890],
    [0.330, 0.545, 0.790],
];

/// Returns the colour at `t` in [0, 1] of the scale, in sRGB.
pub fn scale(t: f64) -> [f64; 3] {
    let position = t.clamp(0.0, 1.0) * (SCALE.len() - 1) as f64;
    let i = (position as usize).min(SCALE.len() - 2);
    let u = position - i as f64;
    std::array::from_fn(|c| SCALE[i][c] * (1.0 - u) + SCALE[i + 1][c] * u)
}

/// Formats a colour for SVG.
pub fn hex(rgb: [f64; 3]) -> String {
    let [r, g, b] = rgb.map(|v| (v * 255.0).round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}
