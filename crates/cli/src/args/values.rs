//! Parsers for the values of options.

use glam::DVec3;
use io::element::Element;
use io::image::exposure::Exposure;
use io::image::tone::Curve;
use std::path::PathBuf;
use std::time::Duration;
use transport::render::{Measure, MeasureOptions};
use transport::sum::ReproducibleSum;

use crate::numbers::plain;
pub use crate::shard::parse as shard;

pub fn define(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.to_owned(), value.to_owned())),
        _ => Err("expected NAME=VALUE".into()),
    }
}

/// Parses a bin of an axis.
pub fn bin(text: &str) -> Result<(String, usize), String> {
    let (axis, number) = text.split_once('=').unwrap_or_default();
    let number = number.parse().ok().filter(|_| !axis.is_empty());
    let number = number.ok_or("expected AXIS=N, such as order=1")?;
    Ok((axis.to_owned(), number))
}

/// Parses the name of a scene file to write.
pub fn scene_file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let extension = path.extension().and_then(|e| e.to_str());
    let known =
        extension.is_some_and(|e| ["xml", "json"].iter().any(|k| e.eq_ignore_ascii_case(k)));
    known
        .then_some(path)
        .ok_or_else(|| "expected the name of a .xml or .json file".into())
}

/// Largest number of rays. All rays are held in memory until they are written.
const MAX_RAYS: u64 = 1_000_000;
/// Largest number of threads, beyond the largest machines.
const MAX_THREADS: u64 = 4096;

pub fn measure(text: &str) -> Result<Measure, String> {
    let of = |measure: &Measure| measure.name() == text;
    let known = [Measure::Image, Measure::Pixel].into_iter().find(of);
    known.ok_or_else(|| format!("expected one of: {}", Measure::NAMES.join(", ")))
}

pub fn curve(text: &str) -> Result<Curve, String> {
    let known = Curve::NAMES.iter().find(|(name, _)| *name == text);
    let names = || Curve::NAMES.map(|(name, _)| name).join(", ");
    known
        .map(|(_, curve)| *curve)
        .ok_or_else(|| format!("expected one of: {}", names()))
}

pub fn exposure(text: &str) -> Result<Exposure, String> {
    match text {
        "auto" => Ok(Exposure::Auto),
        text => finite(text)
            .map(Exposure::Stops)
            .map_err(|_| "expected a number of stops, such as -1.5, or auto".into()),
    }
}

pub fn seed(text: &str) -> Result<u64, String> {
    text.parse()
        .map_err(|_| "expected a whole number from 0 to 2⁶⁴ − 1".to_owned())
}

pub fn samples(text: &str) -> Result<u64, String> {
    count(text, ReproducibleSum::MAX_NUMBERS, "256 or 1e3")
}

pub fn particles(text: &str) -> Result<u64, String> {
    count(text, MeasureOptions::MAX_PARTICLES, "250000 or 1e7")
}

/// Parses a whole number from 1 to `most`, which may be written like `1e7`.
fn count(text: &str, most: u64, example: &str) -> Result<u64, String> {
    // Only powers of ten pass through a float: other numbers keep all of their digits.
    let rounded = || {
        finite(text)
            .ok()
            .filter(|n| n.fract() == 0.0 && *n < 2f64.powi(64))
    };
    let number = text.parse().ok().or_else(|| rounded().map(|n| n as u64));
    number
        .filter(|n| (1..=most).contains(n))
        .ok_or_else(|| format!("expected a whole number from 1 to {most}, such as {example}"))
}

pub fn block(text: &str) -> Result<usize, String> {
    bounded(text, u32::MAX.into())
}

pub fn rays(text: &str) -> Result<usize, String> {
    bounded(text, MAX_RAYS)
}

pub fn threads(text: &str) -> Result<usize, String> {
    bounded(text, MAX_THREADS)
}

/// Largest number of reflections. Each reflection multiplies the number of paths to trace.
const MAX_REFLECTIONS: u32 = 8;

pub fn reflections(text: &str) -> Result<u32, String> {
    let number = text.parse().ok().filter(|k| *k <= MAX_REFLECTIONS);
    number.ok_or_else(|| format!("expected a whole number from 0 to {MAX_REFLECTIONS}"))
}

fn bounded(text: &str, most: u64) -> Result<usize, String> {
    let number = whole(text, most).and_then(|n| usize::try_from(n).ok());
    number.ok_or_else(|| format!("expected a whole number from 1 to {most}"))
}

fn whole(text: &str, most: u64) -> Option<u64> {
    text.parse().ok().filter(|n| (1..=most).contains(n))
}

pub fn pixel(text: &str) -> Result<[usize; 2], String> {
    let numbers = text
        .split_once(',')
        .map(|(x, y)| [x, y].map(|t| t.trim().parse().ok()));
    match numbers {
        Some([Some(x), Some(y)]) => Ok([x, y]),
        _ => Err("expected two whole numbers X,Y, such as 20,30".into()),
    }
}

pub fn finite(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        _ => Err("expected a number".into()),
    }
}

pub fn not_negative(text: &str) -> Result<f64, String> {
    let message = || "expected a number of at least 0".to_owned();
    finite(text).ok().filter(|v| *v >= 0.0).ok_or_else(message)
}

pub fn positive(text: &str) -> Result<f64, String> {
    let message = || "expected a number above 0".to_owned();
    finite(text).ok().filter(|v| *v > 0.0).ok_or_else(message)
}

pub fn point(text: &str) -> Result<DVec3, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|t| finite(t).ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) => Ok(DVec3::new(x, y, z)),
        _ => Err("expected three numbers separated by commas, such as 0,1,-2.5".into()),
    }
}

pub fn direction(text: &str) -> Result<DVec3, String> {
    let zero = || "the direction must not be zero".to_owned();
    point(text)?.try_normalize().ok_or_else(zero)
}

/// Parses a fraction above zero.
pub fn fraction(text: &str) -> Result<f64, String> {
    let percentage = text.trim().strip_suffix('%').map(positive);
    match percentage {
        Some(Ok(percent)) => Err(format!(
            "write it as a fraction, {}",
            plain(percent / 100.0)
        )),
        _ => positive(text),
    }
}

/// Parses hours, minutes and seconds in this order: `1h30m`, `2m`, `1.5s`. A plain number is
/// seconds.
pub fn duration(text: &str) -> Result<Duration, String> {
    let message = || "expected a time above 0, such as 30s, 2m or 1h30m".to_owned();
    let (mut rest, mut seconds) = (text.trim(), 0.0);
    for (unit, length) in [('h', 3600.0), ('m', 60.0), ('s', 1.0)] {
        if let Some((number, after)) = rest.split_once(unit) {
            seconds += length * not_negative(number).map_err(|_| message())?;
            rest = after;
        }
    }
    if !rest.is_empty() {
        seconds += not_negative(rest).map_err(|_| message())?;
    }
    match Duration::try_from_secs_f64(seconds) {
        Ok(time) if !time.is_zero() => Ok(time),
        _ => Err(message()),
    }
}

/// Parses a number of bytes: `8G`, `512M`, `1.5GiB`, `4e9`.
pub fn size(text: &str) -> Result<u64, String> {
    let message = || "expected a size above 0, such as 512M or 8G".to_owned();
    let plain = text.trim().trim_end_matches("iB").trim_end_matches('B');
    let units = [("K", 10), ("M", 20), ("G", 30), ("T", 40)];
    let unit = units.iter().find_map(|(letter, shift)| {
        let number = plain.strip_suffix(letter)?;
        Some((number, *shift))
    });
    let (number, shift) = unit.unwrap_or((plain, 0));
    let bytes = positive(number).map_err(|_| message())? * 2f64.powi(shift);
    if bytes < 2f64.powi(63) && bytes >= 1.0 {
        Ok(bytes as u64)
    } else {
        Err(message())
    }
}

/// Parses three lengths above zero.
pub fn spacing(text: &str) -> Result<DVec3, String> {
    let message = || "expected three numbers above 0, such as 0.1,0.1,0.2".to_owned();
    let spacing = point(text)?;
    (spacing.min_element() > 0.0)
        .then_some(spacing)
        .ok_or_else(message)
}

/// Parses three counts, such as 64x64x32.
pub fn grid(text: &str) -> Result<[usize; 3], String> {
    let numbers: Option<Vec<usize>> = text.split('x').map(|n| n.trim().parse().ok()).collect();
    let numbers = numbers.and_then(|n| n.try_into().ok());
    let numbers = numbers.filter(|n: &[usize; 3]| !n.contains(&0));
    numbers.ok_or_else(|| "expected three whole numbers above 0, such as 64x64x32".into())
}

/// Parses a type of numbers.
pub fn element(text: &str) -> Result<Element, String> {
    let names = Element::ALL.map(Element::name);
    Element::of_name(text).ok_or_else(|| format!("expected one of: {}", names.join(", ")))
}

/// Parses a type of floating-point numbers.
pub fn floating(text: &str) -> Result<Element, String> {
    let types = [Element::F32, Element::F64];
    let found = types.into_iter().find(|element| element.name() == text);
    found.ok_or_else(|| "expected float32 or float64".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations() {
        let seconds = |text| duration(text).map(|d| d.as_secs_f64());
        assert_eq!(seconds("30s"), Ok(30.0));
        assert_eq!(seconds("2m"), Ok(120.0));
        assert_eq!(seconds("1h30m"), Ok(5400.0));
        assert_eq!(seconds("1h0m1.5s"), Ok(3601.5));
        assert_eq!(seconds("90"), Ok(90.0));
        for bad in ["", "0s", "s", "1x", "3m1h", "-1s", "1e400s", "nan"] {
            assert!(duration(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn sizes() {
        for (text, bytes) in [
            ("8G", 8 << 30),
            ("512M", 512 << 20),
            ("1.5KiB", 1536),
            ("2TB", 2 << 40),
            ("4e9", 4_000_000_000),
        ] {
            assert_eq!(size(text), Ok(bytes), "{text}");
        }
        for bad in ["", "G", "0", "-1G", "1X", "1e30", "nan", "inf"] {
            assert!(size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn numbers_of_samples_and_particles() {
        assert_eq!(particles("1e7"), Ok(10_000_000));
        assert_eq!(particles("123"), Ok(123));
        assert_eq!(samples("1e3"), Ok(1000));
        assert_eq!(samples("2.5e2"), Ok(250));
        for bad in ["0", "0.5", "-1", "1e30", "1e-3", "inf", "many", ""] {
            assert!(particles(bad).is_err(), "{bad}");
            assert!(samples(bad).is_err(), "{bad}");
        }
        let most = MeasureOptions::MAX_PARTICLES;
        assert_eq!(particles(&most.to_string()), Ok(most));
        assert!(particles(&(most + 1).to_string()).is_err());
    }

    #[test]
    fn percentages_become_fractions() {
        assert_eq!(fraction("0.02"), Ok(0.02));
        assert_eq!(
            fraction("2%"),
            Err("write it as a fraction, 0.02".to_owned())
        );
        for bad in ["0", "-1", "0%", "%", "much"] {
            assert_eq!(fraction(bad), Err("expected a number above 0".to_owned()));
        }
    }

    #[test]
    fn points() {
        assert_eq!(point("1,-2, 3.5"), Ok(DVec3::new(1.0, -2.0, 3.5)));
        for bad in ["1,2", "1,2,3,4", "a,b,c", "1,2,inf", ""] {
            assert!(point(bad).is_err(), "{bad}");
        }
        assert!(direction("0,0,0").is_err());
    }
}
