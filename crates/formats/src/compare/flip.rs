//! ꟻLIP: visibility of the difference of two images when flipping between them.
//!
//! This is the measure for images on a screen (of low dynamic range) by P. Andersson, J. Nilsson,
//! T. Akenine-Möller, M. Oskarsson, K. Åström and M. D. Fairchild, "ꟻLIP: A Difference Evaluator
//! for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2), 2020, with their
//! constants.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use crate::error::Problem;
use crate::image::RgbImage;

/// Pixels per degree of a screen of 3840 pixels on 0.7 m, seen from 0.7 m.
const PIXELS_PER_DEGREE: f64 = 3840.0 / 0.7 * 0.7 * PI / 180.0;
/// Contrast sensitivity as sums of Gaussians (a, b), for achromatic, red-green and blue-yellow
/// channels.
const SENSITIVITY: [&[(f64, f64)]; 3] = [
    &[(1.0, 0.0047)],
    &[(1.0, 0.0053)],
    &[(34.1, 0.04), (13.5, 0.025)],
];
/// Parameter b of the widest Gaussian in [`SENSITIVITY`].
const WIDEST_GAUSSIAN: f64 = 0.04;
/// Exponent of differences of colour; `QF` is the exponent of differences of features.
const QC: f64 = 0.7;
const QF: f64 = 0.5;
/// Breakpoint of the piecewise linear map of colour differences: a fraction of the largest
/// difference, and the fraction of the range to which it is mapped.
const BEND: (f64, f64) = (0.4, 0.95);
/// Width of the feature detector, in degrees.
const FEATURE: f64 = 0.082;

/// Computes the difference of every pixel, in [0, 1], row by row from the top left. Values of the
/// images are linear and are clamped to [0, 1], as on a screen.
///
/// # Errors
///
/// Images of different sizes.
pub fn flip(image: &RgbImage, reference: &RgbImage) -> Result<Vec<f32>, Problem> {
    if (image.width, image.height) != (reference.width, reference.height) {
        let size = |image: &RgbImage| format!("{} x {} pixels", image.width, image.height);
        return Err(Problem::Mismatch {
            expected: size(reference),
            found: size(image),
        });
    }
    let space = Space::new();
    let [a, b] = [image, reference].map(|image| Seen::new(image, &space));
    let largest = hyab(space.adjusted_lab(DVec3::Y), space.adjusted_lab(DVec3::Z)).powf(QC);
    let pixel = |i: usize| {
        let colour = stretch(hyab(a.lab[i], b.lab[i]).powf(QC), largest);
        let features = (a.edges[i] - b.edges[i])
            .abs()
            .max((a.points[i] - b.points[i]).abs());
        let features = (features / 2f64.sqrt()).powf(QF);
        // Return zero without a difference of colour, regardless of the exponent.
        match colour {
            0.0 => 0.0,
            colour => colour.powf(1.0 - features) as f32,
        }
    };
    Ok((0..image.pixels.len()).map(pixel).collect())
}

/// Maps differences of colour to [0, 1].
fn stretch(difference: f64, largest: f64) -> f64 {
    let (bend, share) = (BEND.0 * largest, BEND.1);
    if difference < bend {
        share / bend * difference
    } else {
        share + (difference - bend) / (largest - bend) * (1.0 - share)
    }
}

/// Returns the distance of colours that may be far apart.
fn hyab(a: DVec3, b: DVec3) -> f64 {
    (a.x - b.x).abs() + (a.y - b.y).hypot(a.z - b.z)
}

/// Perceived image.
struct Seen {
    /// Colours after the blur of the eye.
    lab: Vec<DVec3>,
    /// Strength of edges and of points.
    edges: Vec<f64>,
    points: Vec<f64>,
}

impl Seen {
    fn new(image: &RgbImage, space: &Space) -> Self {
        let opponent: Vec<DVec3> = image
            .pixels
            .iter()
            .map(|p| space.opponent(DVec3::from(p.map(f64::from)).clamp(DVec3::ZERO, DVec3::ONE)))
            .collect();
        let channel = |c: usize| opponent.iter().map(|v| v[c]).collect::<Vec<f64>>();
        let [y, x, z] = [0, 1, 2].map(|c| blur(&channel(c), image.width, SENSITIVITY[c]));
        let colour = |i: usize| {
            let rgb = space.rgb(DVec3::new(y[i], x[i], z[i]));
            space.adjusted_lab(rgb.clamp(DVec3::ZERO, DVec3::ONE))
        };
        let lightness: Vec<f64> = channel(0).iter().map(|y| (y + 16.0) / 116.0).collect();
        let (smooth, slope, curvature) = detectors();
        let strength = |derivative: &[f64]| {
            let across = convolve(&lightness, image.width, derivative, &smooth);
            let down = convolve(&lightness, image.width, &smooth, derivative);
            across.iter().zip(&down).map(|(a, d)| a.hypot(*d)).collect()
        };
        Seen {
            lab: (0..opponent.len()).map(colour).collect(),
            edges: strength(&slope),
            points: strength(&curvature),
        }
    }
}

/// Convolves with a sum of Gaussians a √(π/b) exp(−π² r²/b), r in degrees, of total weight 1.
fn blur(values: &[f64], width: usize, gaussians: &[(f64, f64)]) -> Vec<f64> {
    let radius =
        (3.0 * (WIDEST_GAUSSIAN / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    let mut sum = vec![0.0; values.len()];
    let mut total = 0.0;
    for (a, b) in gaussians {
        let scale = -PI * PI / b / PIXELS_PER_DEGREE.powi(2);
        let kernel: Vec<f64> = (-radius..=radius)
            .map(|x| (scale * f64::from(x * x)).exp())
            .collect();
        let weight = a * (PI / b).sqrt();
        total += weight * kernel.iter().sum::<f64>().powi(2);
        let part = convolve(values, width, &kernel, &kernel);
        sum.iter_mut().zip(part).for_each(|(s, p)| *s += weight * p);
    }
    sum.iter_mut().for_each(|s| *s /= total);
    sum
}

/// Returns a Gaussian and its first and second derivative, whose positive and negative weights add
/// up to 1 and −1.
fn detectors() -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let sigma = 0.5 * FEATURE * PIXELS_PER_DEGREE;
    let radius = (3.0 * sigma).ceil() as i32;
    let kernel = |f: &dyn Fn(f64) -> f64| {
        let gaussian = |x: f64| f(x) * (-0.5 * (x / sigma).powi(2)).exp();
        let weights: Vec<f64> = (-radius..=radius).map(|x| gaussian(x.into())).collect();
        let total = |sign: f64| weights.iter().map(|w| (sign * w).max(0.0)).sum::<f64>();
        let (above, below) = (total(1.0), total(-1.0));
        let scaled = |w: &f64| {
            w / if *w > 0.0 {
                above
            } else {
                below.max(f64::MIN_POSITIVE)
            }
        };
        weights.iter().map(scaled).collect()
    };
    (
        kernel(&|_| 1.0),
        kernel(&|x| -x),
        kernel(&|x| (x / sigma).powi(2) - 1.0),
    )
}

/// Convolves along rows, then along columns. Pixels beyond the borders equal the nearest pixels
/// inside.
fn convolve(values: &[f64], width: usize, across: &[f64], down: &[f64]) -> Vec<f64> {
    let height = values.len() / width;
    let tap = |kernel: &[f64], at: usize, size: usize, value: &dyn Fn(usize) -> f64| {
        let radius = kernel.len() / 2;
        let taps = kernel.iter().enumerate();
        let clamped = |k: usize| (at + k).saturating_sub(radius).min(size - 1);
        taps.map(|(k, w)| w * value(clamped(k))).sum::<f64>()
    };
    let indices = || (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)));
    let rows: Vec<f64> = indices()
        .map(|(x, y)| tap(across, x, width, &|x| values[y * width + x]))
        .collect();
    indices()
        .map(|(x, y)| tap(down, y, height, &|y| rows[y * width + x]))
        .collect()
}

/// Conversions between colour spaces.
struct Space {
    /// Matrix from linear sRGB to XYZ.
    xyz: DMat3,
    back: DMat3,
    /// XYZ of white.
    white: DVec3,
}

impl Space {
    fn new() -> Self {
        // Set columns to XYZ of the primaries of IEC 61966-2-1, from their chromaticities with the
        // white D65.
        let xyz = DMat3::from_cols(
            DVec3::new(
                10135552.0 / 24577794.0,
                2613072.0 / 12288897.0,
                1425312.0 / 73733382.0,
            ),
            DVec3::new(
                8788810.0 / 24577794.0,
                8788810.0 / 12288897.0,
                8788810.0 / 73733382.0,
            ),
            DVec3::new(
                4435075.0 / 24577794.0,
                887015.0 / 12288897.0,
                70074185.0 / 73733382.0,
            ),
        );
        Space {
            xyz,
            back: xyz.inverse(),
            white: xyz * DVec3::ONE,
        }
    }

    /// Converts linear sRGB to YCxCz, in which blur acts.
    fn opponent(&self, rgb: DVec3) -> DVec3 {
        let v = self.xyz * rgb / self.white;
        DVec3::new(116.0 * v.y - 16.0, 500.0 * (v.x - v.y), 200.0 * (v.y - v.z))
    }

    /// Converts YCxCz to linear sRGB.
    fn rgb(&self, opponent: DVec3) -> DVec3 {
        let y = (opponent.x + 16.0) / 116.0;
        let v = DVec3::new(y + opponent.y / 500.0, y, y - opponent.z / 200.0);
        self.back * (v * self.white)
    }

    /// Converts to L*a*b* with a reduced weight of colours of dark pixels, after Hunt.
    fn adjusted_lab(&self, rgb: DVec3) -> DVec3 {
        const DELTA: f64 = 6.0 / 29.0;
        let v = self.xyz * rgb / self.white;
        let [x, y, z] = v.to_array().map(|t| {
            if t > DELTA.powi(3) {
                t.cbrt()
            } else {
                t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
            }
        });
        let l = 116.0 * y - 16.0;
        DVec3::new(l, 0.01 * l * 500.0 * (x - y), 0.01 * l * 200.0 * (y - z))
    }
}
