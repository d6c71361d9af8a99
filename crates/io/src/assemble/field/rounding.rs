//! Precision of samples: the rounding that they underwent before they were read.

use crate::element::Element;

/// Maximum number of samples that are examined.
const MAX_SAMPLES: usize = 4096;
/// Maximum number of decimal digits for which rounding to decimals is detected.
const MAX_DIGITS: i32 = 9;

/// Minimum number of distinct values of rounded samples. Fewer values are labels of materials,
/// which are exact.
const MIN_LEVELS: usize = 16;

/// Rounding of samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rounding {
    /// Standard deviation of the error. For numbers rounded to a unit, with an error of at most
    /// half a unit, it is the unit divided by √12.
    pub deviation: f64,
    /// Numbers to which samples are rounded.
    pub to: To,
}

/// Set of numbers to which samples are rounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum To {
    /// Floating-point numbers of a type.
    Floats(Element),
    /// Multiples of a number.
    Steps(f64),
}

impl Rounding {
    /// Detects the rounding of `count` samples, which `at` returns, in a file of type `element`.
    /// Returns the coarsest rounding that all examined samples fit: numbers of 64 bits may have
    /// been rounded before to 32 bits or to five decimals.
    pub(super) fn of(element: Element, count: usize, at: impl Fn(usize) -> f64) -> Self {
        let stride = stride(count);
        let looked_at = (0..count.min(MAX_SAMPLES)).map(|i| at(i * stride % count));
        let samples: Vec<f64> = looked_at.collect();
        let is_graded = levels(&samples) >= MIN_LEVELS;
        let all = |rounded: &dyn Fn(f64) -> bool| samples.iter().all(|v| rounded(*v));
        if element.is_integer() && is_graded {
            return Self::steps(1.0);
        }
        // Rounding to decimals is detectable only if the type of the file has many numbers between
        // them, because decimals are themselves rounded to this type.
        let is_multiple = |v: f64, per: f64| element.nearest((v * per).round() / per) == v;
        let fine = 100.0 * Self::floats(element, &samples);
        let mut scales = (0..=MAX_DIGITS).map(|digits| 10f64.powi(digits));
        let told = scales.find(|per| fine * per < 1.0 && all(&|v| is_multiple(v, *per)));
        if let Some(per) = told.filter(|_| is_graded) {
            return Self::steps(1.0 / per);
        }
        let narrower = [Element::F16, Element::F32];
        let narrow = narrower.into_iter().find(|e| all(&|v| e.nearest(v) == v));
        let element = narrow.unwrap_or(element);
        Rounding {
            deviation: Self::floats(element, &samples),
            to: To::Floats(element),
        }
    }

    /// Returns the rounding to multiples of `step`.
    fn steps(step: f64) -> Self {
        Rounding {
            deviation: step / 12f64.sqrt(),
            to: To::Steps(step),
        }
    }

    /// Returns the root mean square over samples of the rounding error of a type. The error depends
    /// on the exponent of each sample.
    fn floats(element: Element, samples: &[f64]) -> f64 {
        let bits = match element {
            Element::F16 => 10,
            Element::F32 => 23,
            _ => 52,
        };
        let unit = |v: f64| match v {
            0.0 => 0.0,
            v => v.abs().log2().floor().exp2() * f64::from(-bits).exp2(),
        };
        let squares: f64 = samples.iter().map(|v| unit(*v).powi(2)).sum();
        (squares / (12.0 * samples.len() as f64)).sqrt()
    }
}

/// Returns the distance between successive examined samples, in the order of the file and wrapping
/// around its end. It has no common factor with the count, nor with any axis of the grid. The
/// samples are therefore spread over all axes instead of a few planes. Multiples of the golden
/// ratio are evenly spread.
fn stride(count: usize) -> usize {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let mut stride = ((count as f64 * GOLDEN) as usize).max(1);
    while common_factor(stride, count) != 1 {
        stride += 1;
    }
    stride
}

/// Returns the greatest common factor of two numbers.
fn common_factor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { common_factor(b, a % b) }
}

/// Returns the number of distinct values.
fn levels(samples: &[f64]) -> usize {
    let mut sorted = samples.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.dedup();
    sorted.len()
}

impl std::fmt::Display for To {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            To::Floats(element) => write!(f, "{element}"),
            To::Steps(step) => write!(f, "multiples of {step}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(element: Element, sample: impl Fn(f64) -> f64) -> Rounding {
        Rounding::of(element, 10_000, |i| {
            sample(1.5 + 0.2 * (1e-3 * i as f64).sin())
        })
    }

    /// Uses exact halves on the end plane of each axis and other numbers elsewhere. A stride that
    /// is a power of two would see one plane only.
    #[test]
    fn samples_are_spread_over_all_axes() {
        for n in [64, 96, 128, 256] {
            for axis in 0..3 {
                let at = |i: usize| {
                    let place = [i % n, i / n % n, i / n / n][axis];
                    1.5 + 0.01 * (0.1 * place as f64).sin()
                };
                let rounding = Rounding::of(Element::F64, n * n * n, at);
                assert_eq!(rounding.to, To::Floats(Element::F64), "{n}, axis {axis}");
            }
        }
        for count in 1..2000 {
            let stride = stride(count);
            let mut seen: Vec<usize> = (0..count).map(|i| i * stride % count).collect();
            seen.sort_unstable();
            assert_eq!(seen, (0..count).collect::<Vec<_>>());
        }
    }

    #[test]
    fn roundings_are_told_from_the_samples() {
        let unit = |r: Rounding| r.deviation * 12f64.sqrt();
        let exact = of(Element::F64, |v| v);
        assert_eq!(exact.to, To::Floats(Element::F64));
        assert!(unit(exact) < 3e-16);
        for element in [Element::F32, Element::F64] {
            let single = of(element, |v| f64::from(v as f32));
            assert_eq!(single.to, To::Floats(Element::F32));
            assert!((unit(single) / 2f64.powi(-23) - 1.0).abs() < 1e-9);
            let decimal = of(element, |v| element.nearest((v * 1e5).round() / 1e5));
            assert_eq!(decimal, Rounding::steps(1e-5));
        }
        let half = of(Element::F64, |v| Element::F16.nearest(v));
        assert_eq!(half.to, To::Floats(Element::F16));
        assert_eq!(of(Element::U8, |v| (100.0 * v).round()).to, To::Steps(1.0));
        // Labels of two materials.
        let labels = of(Element::F64, |v| if v < 1.5 { 1.0 } else { 1.3 });
        assert!(labels.deviation < 1e-3, "{labels:?}");
    }
}
