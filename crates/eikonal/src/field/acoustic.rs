//! Index modulated by cylindrical standing waves of sound.

use super::axis::Axis;
use super::error::{FieldError, finite, positive};
use super::{Jet, bessel};
use crate::bounds::{Aabb, FieldBounds, IndexBounds};
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// One cylindrical mode, Δn J_m(kr) cos(mφ + φ₀).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AcousticMode {
    amplitude: f64,
    order: u16,
    wave_number: f64,
    phase: f64,
}

impl AcousticMode {
    /// A mode of `amplitude` Δn (any sign), azimuthal `order` m, `wave_number` k > 0 in radians
    /// per scene unit and azimuthal `phase` φ₀ in radians.
    pub fn new(
        amplitude: f64,
        order: u16,
        wave_number: f64,
        phase: f64,
    ) -> Result<Self, FieldError> {
        Ok(AcousticMode {
            amplitude: finite("amplitude of an acoustic mode", amplitude)?,
            order,
            wave_number: positive("wave number of an acoustic mode", wave_number)?,
            phase: finite("phase of an acoustic mode", phase)?,
        })
    }

    /// As [`AcousticMode::new`] with k = 2πf/c from `frequency` f > 0 in Hz and `sound_speed`
    /// c > 0 in scene units per second.
    pub fn from_frequency(
        amplitude: f64,
        order: u16,
        frequency: f64,
        sound_speed: f64,
        phase: f64,
    ) -> Result<Self, FieldError> {
        let frequency = positive("frequency of an acoustic mode", frequency)?;
        let sound_speed = positive("speed of sound", sound_speed)?;
        Self::new(amplitude, order, TAU * frequency / sound_speed, phase)
    }

    /// Upper bound of |Δn J_m(kr)|: |J₀| ≤ 1, |J_m| < 0.674886 m^(−1/3) (Landau 2000).
    fn peak(&self) -> f64 {
        let bessel = match self.order {
            0 => 1.0,
            m => 0.674886 / f64::from(m).cbrt(),
        };
        self.amplitude.abs() * bessel
    }

    /// Value and derivatives at transverse position `d`.
    ///
    /// With E_p = e^{iφ₀} J_p(kr) e^{ipφ} the mode is Re E_m, and (∂x ± i∂y) E_p = ∓k E_{p±1}, so
    /// that every derivative is a sum of such terms, smooth on the axis.
    fn wave(&self, d: DVec2) -> Wave {
        let r = d.length();
        let turn = if r > 0.0 { d / r } else { DVec2::X };
        let back = DVec2::new(turn.x, -turn.y);
        let center = DVec2::from_angle(self.phase).rotate(power(turn, self.order));
        let (below, above) = (back.rotate(center), turn.rotate(center));
        let angular = [back.rotate(below), below, center, above, turn.rotate(above)];
        let j = bessel::around(self.order, self.wave_number * r);
        let e: [DVec2; 5] = std::array::from_fn(|i| angular[i] * (j[i] * self.amplitude));
        let (k, k2) = (0.5 * self.wave_number, 0.25 * self.wave_number.powi(2));
        Wave {
            value: e[2].x,
            grad: DVec2::new(e[1].x - e[3].x, -(e[1].y + e[3].y)) * k,
            xx: k2 * (e[0].x - 2.0 * e[2].x + e[4].x),
            xy: k2 * (e[4].y - e[0].y),
            yy: -k2 * (e[0].x + 2.0 * e[2].x + e[4].x),
        }
    }
}

/// `z`ᵐ of a complex number.
fn power(z: DVec2, m: u16) -> DVec2 {
    let (mut result, mut square, mut rest) = (DVec2::X, z, m);
    while rest > 0 {
        if rest & 1 == 1 {
            result = square.rotate(result);
        }
        square = square.rotate(square);
        rest >>= 1;
    }
    result
}

/// Value, gradient and Hessian in the transverse plane.
#[derive(Clone, Copy, Default)]
struct Wave {
    value: f64,
    grad: DVec2,
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Wave {
    fn plus(self, o: Wave) -> Wave {
        Wave {
            value: self.value + o.value,
            grad: self.grad + o.grad,
            xx: self.xx + o.xx,
            xy: self.xy + o.xy,
            yy: self.yy + o.yy,
        }
    }

    /// Eigenvalues of the Hessian.
    fn curvatures(&self) -> [f64; 2] {
        let middle = 0.5 * (self.xx + self.yy);
        let spread = (0.5 * (self.xx - self.yy)).hypot(self.xy);
        [middle - spread, middle + spread]
    }
}

/// n(x) = n₀ + Σ Δn J_m(kr) cos(mφ + φ₀), (r, φ) polar coordinates around an axis: a snapshot of
/// standing ultrasound in a cylindrical transducer, a virtual light guide.
///
/// φ = 0 lies along the transverse part of a reference direction e₁, and φ grows from there
/// towards axis × e₁.
#[derive(Clone, Debug, PartialEq)]
pub struct Acoustic {
    n0: f64,
    axis: Axis,
    modes: Vec<AcousticMode>,
}

impl Acoustic {
    /// Mean index `n0` > 0 around an axis through `origin` along `direction`; `reference` is not
    /// parallel to it. The sum of the peaks of the modes stays below `n0`.
    pub fn new(
        n0: f64,
        origin: DVec3,
        direction: DVec3,
        reference: DVec3,
        modes: Vec<AcousticMode>,
    ) -> Result<Self, FieldError> {
        let peaks: f64 = modes.iter().map(AcousticMode::peak).sum();
        positive("smallest index in the acoustic field", n0 - peaks)?;
        Ok(Acoustic {
            n0: positive("mean refractive index", n0)?,
            axis: Axis::with_reference(origin, direction, reference)?,
            modes,
        })
    }

    fn wave(&self, d: DVec2) -> Wave {
        let modes = self.modes.iter();
        modes.fold(Wave::default(), |sum, mode| sum.plus(mode.wave(d)))
    }

    pub(super) fn n2(&self, x: DVec3) -> f64 {
        self.gradient(x).0
    }

    pub(super) fn gradient(&self, x: DVec3) -> (f64, DVec3) {
        let wave = self.wave(self.axis.transverse(x));
        let n = self.n0 + wave.value;
        (n * n, self.axis.vector(wave.grad * (2.0 * n)))
    }

    pub(super) fn jet(&self, x: DVec3) -> Jet {
        let w = self.wave(self.axis.transverse(x));
        Jet::from_index(
            self.n0 + w.value,
            self.axis.vector(w.grad),
            self.axis.matrix(w.xx, w.xy, w.yy),
        )
    }

    /// Σ |Δn| kᵖ, the scale of the p-th derivatives.
    fn derivative_scale(&self, p: i32) -> f64 {
        let modes = self.modes.iter();
        modes
            .map(|m| m.amplitude.abs() * m.wave_number.powi(p))
            .sum()
    }

    /// J_m(kr)e^{imφ} is a mean of plane waves of wave number k over all directions, so its p-th
    /// derivative along any line is at most kᵖ times the mean of |cos|ᵖ: 2/π, 1/2, 4/(3π). These
    /// hold everywhere; a Taylor expansion about the middle of the box is better in a small one.
    pub(super) fn bounds(&self, region: &Aabb) -> FieldBounds {
        // The limit gives an unbounded box a middle.
        let far = DVec2::splat(1e100);
        let [min, max] = self.axis.transverse_range(region);
        let (min, max) = (min.clamp(-far, far), max.clamp(-far, far));
        let half = 0.5 * (max - min);
        let reach = half.length();
        let middle = self.wave(0.5 * (min + max));

        let hess_limit = 0.5 * self.derivative_scale(2);
        let hess_change = 4.0 / (3.0 * PI) * self.derivative_scale(3) * reach;
        let [low, high] = middle.curvatures();
        // Zero is the eigenvalue along the axis.
        let hess_min = (low - hess_change).max(-hess_limit).min(0.0);
        let hess_max = (high + hess_change).min(hess_limit).max(0.0);

        let grad_limit = 2.0 / PI * self.derivative_scale(1);
        let grad_change = hess_min.abs().max(hess_max) * reach;
        let peaks: f64 = self.modes.iter().map(AcousticMode::peak).sum();
        let slope = middle.grad.abs().dot(half);
        let (down, up) = (
            0.5 * hess_min * reach * reach - slope,
            0.5 * hess_max * reach * reach + slope,
        );
        IndexBounds {
            n_min: self.n0 + (middle.value + down).max(-peaks),
            n_max: self.n0 + (middle.value + up).min(peaks),
            grad_max: (middle.grad.length() + grad_change).min(grad_limit),
            hess_min,
            hess_max,
        }
        .squared()
    }

    /// 1/k of the shortest wave.
    pub(super) fn length_scale(&self, _: DVec3) -> f64 {
        let modes = self.modes.iter().filter(|m| m.amplitude != 0.0);
        1.0 / modes.map(|m| m.wave_number).fold(0.0, f64::max)
    }

    pub(super) fn is_constant(&self) -> bool {
        self.modes.iter().all(|m| m.amplitude == 0.0)
    }
}
