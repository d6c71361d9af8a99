//! Reflectance of a smooth dielectric, and its derivatives by the ray and the indices
//! (docs/theory.md#derivatives-by-the-index-behind-scattering).

/// Minimum probability of the rarer of reflection and refraction. Near grazing incidence and near
/// the critical angle the refracted fraction vanishes, but its derivative does not.
const MIN_PROBABILITY: f64 = 0.25;

/// Reflected or refracted fraction of the power, F or 1 − F, with its derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct FresnelShare {
    /// Fraction, in [0, 1].
    pub value: f64,
    /// Derivative by the normal component p = |N·v| of the velocity before the surface.
    pub by_normal: f64,
    /// Derivatives by n² on the near and the far side, at constant p.
    pub by_n2: [f64; 2],
}

impl FresnelShare {
    /// Returns the reflected fraction of light that arrives with normal component `p` > 0 of the
    /// velocity; 1 beyond the critical angle.
    pub(super) fn reflected(p: f64, [near, far]: [f64; 2]) -> Self {
        let q2 = far - near + p * p;
        if q2 <= 0.0 {
            return FresnelShare {
                value: 1.0,
                ..FresnelShare::default()
            };
        }
        let q = q2.sqrt();
        let (a, b) = (far * p, near * q);
        let (s, t) = ((p - q) / (p + q), (a - b) / (a + b));
        // Derivatives by p, q, near and far, with the others held fixed.
        let by_s = |dp: f64, dq: f64| 2.0 * (q * dp - p * dq) / (p + q).powi(2);
        let by_t = |da: f64, db: f64| 2.0 * (b * da - a * db) / (a + b).powi(2);
        let change = |dp: f64, near_change: f64, far_change: f64| {
            let dq = (far_change - near_change + 2.0 * p * dp) / (2.0 * q);
            let (da, db) = (far_change * p + far * dp, near_change * q + near * dq);
            s * by_s(dp, dq) + t * by_t(da, db)
        };
        FresnelShare {
            value: 0.5 * (s * s + t * t),
            by_normal: change(1.0, 0.0, 0.0),
            by_n2: [change(0.0, 1.0, 0.0), change(0.0, 0.0, 1.0)],
        }
    }

    /// Returns the complement, 1 − the fraction.
    pub(super) fn rest(&self) -> Self {
        FresnelShare {
            value: 1.0 - self.value,
            by_normal: -self.by_normal,
            by_n2: self.by_n2.map(|by| -by),
        }
    }

    /// Returns the probability with which a path is reflected.
    pub(super) fn probability(&self) -> f64 {
        if self.value == 0.0 || self.value >= 1.0 {
            self.value
        } else {
            self.value.min(1.0 - MIN_PROBABILITY)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::FresnelShare;
    use crate::bsdf::fresnel;

    #[test]
    fn shares_are_those_of_fresnel_and_their_derivatives_differences() {
        for (near, far) in [(1.0f64, 1.5f64), (1.5, 1.0), (1.33, 1.4)] {
            for i in 1..20 {
                let cos = f64::from(i) / 20.0;
                let (p, n2) = (near * cos, [near * near, far * far]);
                let share = FresnelShare::reflected(p, n2);
                let known = fresnel::dielectric(cos, near, far).reflectance;
                assert!((share.value - known).abs() < 1e-12, "{near} {far} {cos}");
                if share.value == 1.0 {
                    continue;
                }
                let h = 1e-6;
                let at =
                    |d: [f64; 3]| FresnelShare::reflected(p + d[0], [n2[0] + d[1], n2[1] + d[2]]);
                let slope = |d: [f64; 3]| (at(d).value - at(d.map(|d| -d)).value) / (2.0 * h);
                let exact = [share.by_normal, share.by_n2[0], share.by_n2[1]];
                for (axis, exact) in exact.into_iter().enumerate() {
                    let mut step = [0.0; 3];
                    step[axis] = h;
                    let found = slope(step);
                    assert!(
                        (found - exact).abs() < 1e-4 * exact.abs().max(1.0),
                        "{near} {far} {cos} {axis}: {found} {exact}"
                    );
                }
            }
        }
    }
}
