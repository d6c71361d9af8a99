//! Numbers as text for people.

use std::time::Duration;

/// Formats a value and its standard error, both to two digits of the error: `0.5321 ± 0.0011`.
pub fn with_error(value: f64, error: f64) -> String {
    if !error.is_finite() {
        return format!(
            "{} (unknown error: too few samples per pixel)",
            plain(value)
        );
    }
    if error == 0.0 {
        return format!("{} ± 0", plain(value));
    }
    let digits = 1 - error.abs().log10().floor() as i32;
    if (0..=9).contains(&digits) {
        let digits = digits as usize;
        format!("{value:.digits$} ± {error:.digits$}")
    } else {
        format!("{value:.4e} ± {error:.1e}")
    }
}

/// Formats up to five significant digits, without trailing zeros.
pub fn plain(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let magnitude = value.abs().log10().floor();
    if !value.is_finite() {
        return value.to_string();
    }
    if !(-4.0..6.0).contains(&magnitude) {
        return format!("{value:.3e}");
    }
    let digits = (4.0 - magnitude).max(0.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// Formats the exposure of a picture: `exposure +1.25 stops`.
pub fn exposure(stops: f64) -> String {
    let sign = if stops > 0.0 { "+" } else { "" };
    format!("exposure {sign}{} stops", plain(stops))
}

/// Formats a large count with a prefix: `1.23 M`.
pub fn count(value: f64) -> String {
    let (scaled, prefix) = match value {
        v if v >= 1e9 => (v / 1e9, " G"),
        v if v >= 1e6 => (v / 1e6, " M"),
        v if v >= 1e3 => (v / 1e3, " k"),
        v => return format!("{v:.0}"),
    };
    let digits = if scaled >= 100.0 {
        0
    } else if scaled >= 10.0 {
        1
    } else {
        2
    };
    format!("{scaled:.digits$}{prefix}")
}

/// Formats a duration: `0.42 s`, `3 min 05 s`, `1 h 07 min`.
pub fn duration(time: Duration) -> String {
    let seconds = time.as_secs();
    if seconds < 60 {
        format!("{:.2} s", time.as_secs_f64())
    } else if seconds < 3600 {
        format!("{} min {:02} s", seconds / 60, seconds % 60)
    } else {
        format!("{} h {:02} min", seconds / 3600, seconds / 60 % 60)
    }
}

/// Formats a fraction as a percentage.
pub fn percent(share: f64) -> String {
    format!("{}%", plain((share * 1e5).round() / 1e3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_show_the_digits_that_the_error_leaves() {
        assert_eq!(with_error(0.53214, 0.00112), "0.5321 ± 0.0011");
        assert_eq!(with_error(1234.5, 31.2), "1234 ± 31");
        assert_eq!(with_error(0.0, 0.0), "0 ± 0");
        assert_eq!(with_error(1.5e-12, 2e-14), "1.5000e-12 ± 2.0e-14");
        assert!(with_error(1.0, f64::INFINITY).starts_with("1 ("));
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!(plain(1.33), "1.33");
        assert_eq!(plain(100.0), "100");
        assert_eq!(plain(-0.25), "-0.25");
        assert_eq!(plain(f64::INFINITY), "inf");
        assert_eq!(count(1_234_000.0), "1.23 M");
        assert_eq!(count(999.0), "999");
        assert_eq!(percent(0.001234), "0.123%");
        assert_eq!(duration(Duration::from_secs(185)), "3 min 05 s");
    }
}
