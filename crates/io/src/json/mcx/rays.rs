//! Directions in which light leaves the points of a source.

use super::super::tree::{Json, Node};
use super::{Reader, field, numbers};
use serde_json::{Value, json};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI, TAU};

/// Half angle of light that is parallel or converges, where an emitter needs a cone, in degrees.
const NARROW: f64 = 1e-4;
/// Number of intervals of the angle of a Gaussian.
const INTERVALS: usize = 1024;
/// Largest angle of a Gaussian in units of its parameter. Larger angles have a probability below
/// 1e-15.
const TAIL: f64 = 8.0;

/// Directions of the light of a source around its direction.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Rays {
    /// Light along the direction.
    Parallel,
    /// Light towards a point at this distance along the direction, in voxels, or away from a point
    /// at the opposite of a negative distance.
    Focus(f64),
    /// Equal intensity in all directions.
    Isotropic,
    /// Intensity proportional to the cosine of the angle from the direction, up to a right angle.
    Lambertian,
    /// Angles from the direction in degrees, and the relative probabilities between them.
    Angles(Vec<f64>, Vec<f64>),
}

impl Rays {
    /// Returns the rays for a focal length, the fourth number of `Dir`.
    pub(super) fn of_focus(length: f64) -> Self {
        match length {
            v if v.is_nan() => Rays::Isotropic,
            f64::NEG_INFINITY => Rays::Lambertian,
            0.0 | f64::INFINITY => Rays::Parallel,
            v => Rays::Focus(v),
        }
    }

    /// Returns rays with equally probable angles between neighbouring angles, in degrees.
    pub(super) fn quantiles(angles: Vec<f64>) -> Self {
        let equal = vec![1.0; angles.len() - 1];
        Rays::Angles(angles, equal)
    }

    /// Returns the rays of the source `zgaussian`: the angle is the product of `width`, of a number
    /// with the Rayleigh distribution, and of a number that is uniform from −1 to 1. Its density is
    /// proportional to erfc(θ/(√2 `width`)).
    pub(super) fn gaussian(width: f64) -> Self {
        // Probability of larger angles. Unlike the probability of smaller angles, it keeps its digits
        // in the tail.
        let above = |angle: f64| {
            let a = angle / width;
            (-0.5 * a * a).exp() - a * FRAC_PI_2.sqrt() * libm::erfc(a * FRAC_1_SQRT_2)
        };
        let between = |a: f64, b: f64| (above(a) - above(b)).max(0.0);
        let last = (TAIL * width).min(PI);
        let edge = |i: usize| last * i as f64 / INTERVALS as f64;
        let turns = (TAIL * width / TAU).ceil() as usize;
        let probability = |i: usize| -> f64 {
            // Angles beyond π are directions of angles below π.
            let [a, b] = [edge(i), edge(i + 1)];
            let folded = (0..turns.max(1)).map(|k| {
                let turn = TAU * k as f64;
                between(turn + a, turn + b) + between(turn + TAU - b, turn + TAU - a)
            });
            folded.sum()
        };
        let angles = (0..=INTERVALS).map(|i| edge(i).to_degrees().min(180.0));
        Rays::Angles(angles.collect(), (0..INTERVALS).map(probability).collect())
    }

    /// Returns the type and the angular fields of an emitter with an aperture. `axis` is the
    /// direction in the frame of the aperture, unless the direction is the normal of the aperture.
    pub(super) fn emitter(&self, axis: Option<[f64; 3]>, unit: f64) -> Value {
        let mut emitter = match self {
            Rays::Parallel if axis.is_none() => return json!({"type": "collimated"}),
            Rays::Parallel => json!({"type": "fiber", "cutoff_angle": NARROW}),
            Rays::Focus(distance) => {
                json!({"type": "fiber", "cutoff_angle": NARROW, "focus": distance * unit})
            }
            Rays::Isotropic => json!({"type": "fiber", "cutoff_angle": 180}),
            Rays::Lambertian => {
                json!({"type": "fiber", "angular_profile": "lambertian", "cutoff_angle": 90})
            }
            Rays::Angles(angles, weights) => json!({
                "type": "fiber", "angular_profile": "angles", "angles": angles, "angle_weights": weights,
            }),
        };
        if let Some(axis) = axis {
            emitter["axis"] = json!(axis);
        }
        emitter
    }
}

/// Returns the rays that a file gives by the quantiles of θ/π, at equal steps of probability; `None`
/// without them, and after an error.
pub(super) fn by_quantiles(source: &Node, reader: &mut Reader) -> Option<Rays> {
    const KEY: &str = "AngleInverseCDF";
    let given = field(source, KEY)?;
    let list = numbers(given).unwrap_or_default();
    let increases = list.windows(2).all(|pair| pair[0] < pair[1]);
    let right = list.iter().all(|v| (0.0..=1.0).contains(v));
    if list.len() < 2 || !increases || !right {
        let message = format!(
            "{KEY} (angleinvcdf) must be at least two numbers that increase from one to the next, all from 0 to 1: the quantiles of the \
             angle over pi{}",
            misplaced(&list, |v| (0.0..=1.0).contains(&v))
        );
        reader.error(given, message);
        return None;
    }
    Some(Rays::quantiles(
        list.into_iter().map(|v| (180.0 * v).min(180.0)).collect(),
    ))
}

/// Returns the quantiles of the cosine of scattering angles, from −1 to 1, of the field
/// `InverseCDF`; `None` without it, and after an error.
pub(super) fn cosines(domain: &Node, reader: &mut Reader) -> Option<Vec<f64>> {
    const KEY: &str = "InverseCDF";
    let given = field(domain, KEY)?;
    let list = numbers(given).unwrap_or_default();
    let within = |v: f64| -1.0 < v && v < 1.0;
    let increases = list.windows(2).all(|pair| pair[0] < pair[1]);
    if list.is_empty() || !increases || !list.iter().all(|v| within(*v)) {
        let message = format!(
            "{KEY} (invcdf) must be numbers that increase from one to the next, all above -1 and below 1: the quantiles of the cosine \
             without the ends{}",
            misplaced(&list, within)
        );
        reader.error(given, message);
        return None;
    }
    Some([&[-1.0], &list[..], &[1.0]].concat())
}

/// Returns the end of a message: the first number that is out of range or out of order.
fn misplaced(list: &[f64], within: impl Fn(f64) -> bool) -> String {
    let is_wrong = |i: &usize| !within(list[*i]) || (*i > 0 && list[*i] <= list[*i - 1]);
    let found = (0..list.len()).find(is_wrong);
    found.map_or_else(String::new, |i| {
        format!("; number {} is {}", i + 1, list[i])
    })
}

/// Returns a number, which may be infinite or no number at all, also in the notation of JData.
pub(super) fn special(node: &Node) -> Option<f64> {
    let Json::String(text) = &node.json else {
        return node.number();
    };
    match text.to_ascii_lowercase().as_str() {
        "_nan_" | "nan" => Some(f64::NAN),
        "_inf_" | "inf" => Some(f64::INFINITY),
        "-_inf_" | "-inf" => Some(f64::NEG_INFINITY),
        _ => None,
    }
}
