//! Round numbers along an axis.

/// Returns about `count` round numbers in [low, high], with the digits they need.
pub fn ticks(low: f64, high: f64, count: usize) -> Vec<(f64, String)> {
    let raw = (high - low) / count.max(1) as f64;
    if !(raw > 0.0 && raw.is_finite()) {
        return vec![(low, format!("{low}"))];
    }
    let power = 10f64.powf(raw.log10().floor());
    let step = power
        * [1.0, 2.0, 5.0, 10.0]
            .into_iter()
            .find(|s| s * power >= raw)
            .unwrap_or(10.0);
    // The leading digit of the step determines the number of decimals.
    let decimals = (-(step.log10() + 1e-9).floor()).clamp(0.0, 17.0) as usize;
    let (first, last) = (
        (low / step - 1e-9).ceil() as i64,
        (high / step + 1e-9).floor() as i64,
    );
    (first..=last)
        .map(|i| {
            let value = i as f64 * step;
            (value, format!("{value:.decimals$}").replace('-', "−"))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::ticks;

    fn labels(low: f64, high: f64, count: usize) -> Vec<String> {
        ticks(low, high, count).into_iter().map(|t| t.1).collect()
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(labels(-1.0, 1.0, 4), ["−1.0", "−0.5", "0.0", "0.5", "1.0"]);
        assert_eq!(labels(0.0, 40.0, 4), ["0", "10", "20", "30", "40"]);
        assert_eq!(labels(1.33, 1.330004, 4).last().unwrap(), "1.330004");
        assert_eq!(labels(3.0, 3.0, 4), ["3"]);
    }
}
