//! Joint significance of several tests.

/// Returns the level of each test that gives `n` tests together the false-alarm rate `family_rate`.
///
/// The level is Šidák's α: the joint rate is 1 − (1 − α)^n. It is exact for independent tests, and
/// conservative for jointly normal statistics with any correlation. It is slightly larger than
/// Bonferroni's level, `family_rate`/n.
pub fn sidak(family_rate: f64, n: usize) -> f64 {
    assert!(n > 0, "a family has at least one test");
    -((-family_rate).ln_1p() / n as f64).exp_m1()
}

/// Named p-values that are tested jointly.
///
/// [`Family::check`] has the false-alarm rate given to [`Family::new`], if the p-values are uniform
/// under the null hypothesis.
#[derive(Clone, Debug)]
pub struct Family {
    rate: f64,
    members: Vec<(String, f64)>,
}

impl Family {
    /// Makes a family with the joint false-alarm rate `rate`, in (0, 1).
    pub fn new(rate: f64) -> Self {
        assert!(
            rate > 0.0 && rate < 1.0,
            "a false-alarm rate lies in (0, 1), not {rate}"
        );
        Family {
            rate,
            members: Vec::new(),
        }
    }

    /// Adds one test's p-value.
    pub fn push(&mut self, name: impl Into<String>, p_value: f64) {
        self.members.push((name.into(), p_value));
    }

    /// Number of tests so far.
    pub fn len(&self) -> usize {
        self.members.len()
    }

    /// Returns true if no test has been added.
    pub fn is_empty(&self) -> bool {
        self.members.is_empty()
    }

    /// Compares all p-values with the Šidák level.
    ///
    /// # Errors
    /// Returns an error if there are no tests, or the names of tests with p-values that are below
    /// the level or NaN.
    pub fn check(&self) -> Result<(), String> {
        if self.members.is_empty() {
            return Err("an empty family tests nothing".into());
        }
        let level = sidak(self.rate, self.members.len());
        let failed: Vec<String> = self
            .members
            .iter()
            // Count NaN as a failure.
            .filter(|(_, p)| !matches!(p.partial_cmp(&level), Some(o) if o.is_ge()))
            .map(|(name, p)| format!("{name}: p = {p:.3e}"))
            .collect();
        if failed.is_empty() {
            return Ok(());
        }
        Err(format!(
            "{} of {} below the level {level:.3e}:\n{}",
            failed.len(),
            self.members.len(),
            failed.join("\n")
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::{Family, sidak};

    #[test]
    fn level_gives_back_the_family_rate() {
        let level = sidak(1e-3, 50);
        assert!((1.0 - (1.0 - level).powi(50) - 1e-3).abs() < 1e-14);
        assert!(level > 1e-3 / 50.0);
    }

    #[test]
    fn names_the_member_that_fails() {
        let mut family = Family::new(1e-3);
        assert!(family.is_empty() && family.check().is_err());
        family.push("good", 0.4);
        assert!(!family.is_empty());
        assert!(family.check().is_ok());
        family.push("bad", 1e-6);
        family.push("undefined", f64::NAN);
        assert_eq!(family.len(), 3);
        let message = family.check().unwrap_err();
        assert!(
            message.contains("bad") && message.contains("undefined") && !message.contains("good")
        );
    }
}
