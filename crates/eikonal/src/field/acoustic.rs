//! Index modulated by cylindrical standing waves of sound (docs/theory.md#sound).

use super::axis::Axis;
use super::error::{FieldError, finite, positive};
use super::sound::Sound;
use super::{Jet, bessel};
use crate::bounds::{Aabb, FieldBounds, IndexBounds};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_2_PI, PI, TAU};

/// One cylindrical mode of standing sound, Δn J_m(kr) cos(mφ + φ₀) cos(ωt + τ), at an instant t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AcousticMode {
    /// Δn.
    peak: f64,
    /// τ.
    time_phase: f64,
    /// Δn cos(ωt + τ).
    amplitude: f64,
    order: u16,
    wave_number: f64,
    phase: f64,
    /// In Hz, if it was given.
    frequency: Option<f64>,
}

impl AcousticMode {
    /// A mode of `amplitude` Δn (any sign), azimuthal `order` m, `wave_number` k > 0 in radians
    /// per scene unit and azimuthal `phase` φ₀ in radians, at t = 0 and with τ = 0.
    pub fn new(
        amplitude: f64,
        order: u16,
        wave_number: f64,
        phase: f64,
    ) -> Result<Self, FieldError> {
        let amplitude = finite("amplitude of an acoustic mode", amplitude)?;
        Ok(AcousticMode {
            peak: amplitude,
            time_phase: 0.0,
            amplitude,
            order,
            wave_number: positive("wave number of an acoustic mode", wave_number)?,
            phase: finite("phase of an acoustic mode", phase)?,
            frequency: None,
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
        let wave_number = TAU * frequency / sound_speed;
        Ok(AcousticMode {
            frequency: Some(frequency),
            ..Self::new(amplitude, order, wave_number, phase)?
        })
    }

    /// The mode with the phase in time τ = `time_phase`, in radians, at t = 0. Two modes with τ = 0 and −π/2 and
    /// φ₀ = 0 and −π/2 are one that turns, cos(mφ − ωt).
    pub fn with_time_phase(self, time_phase: f64) -> Result<Self, FieldError> {
        let time_phase = finite("phase in time of an acoustic mode", time_phase)?;
        let mode = AcousticMode { time_phase, ..self };
        Ok(mode.at_phase(0.0))
    }

    /// The mode at the phase ωt.
    fn at_phase(self, phase: f64) -> Self {
        AcousticMode {
            amplitude: self.peak * (phase + self.time_phase).cos(),
            ..self
        }
    }

    /// Upper bounds over all radii r in `range` of |value|, |gradient| and |curvature|.
    ///
    /// J_m(kr)e^{imφ} is a mean of plane waves of wave number k over all directions, so its p-th
    /// derivative along any line is at most kᵖ times the mean of |cos|ᵖ: 2/π, 1/2, 4/(3π). As a
    /// sum of neighbouring orders (see `wave`) it is at most the sum of their peaks.
    fn limits(&self, range: [f64; 2]) -> [f64; 3] {
        let x = range.map(|r| self.wave_number * r);
        let m = i32::from(self.order);
        let peak = |p: i32| bessel::limit((m + p).unsigned_abs(), x);
        let amplitude = self.amplitude.abs();
        let k = self.wave_number;
        let slope = (0.5 * (peak(-1) + peak(1))).min(FRAC_2_PI);
        let curvature = (0.25 * (peak(-2) + 2.0 * peak(0) + peak(2))).min(0.5);
        [
            amplitude * peak(0),
            amplitude * k * slope,
            amplitude * k * k * curvature,
        ]
    }

    /// Upper bound of all third derivatives along a line.
    fn third_limit(&self) -> f64 {
        4.0 / (3.0 * PI) * self.amplitude.abs() * self.wave_number.powi(3)
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

/// All distances to the axis.
const EVERYWHERE: [f64; 2] = [0.0, f64::INFINITY];

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
    /// parallel to it. The sum of the peaks of the modes, at whatever instant, stays below `n0`.
    pub fn new(
        n0: f64,
        origin: DVec3,
        direction: DVec3,
        reference: DVec3,
        modes: Vec<AcousticMode>,
    ) -> Result<Self, FieldError> {
        let loudest = |m: &AcousticMode| AcousticMode {
            amplitude: m.peak,
            ..*m
        };
        let peaks = modes.iter().map(|m| loudest(m).limits(EVERYWHERE)[0]);
        let peaks: f64 = peaks.sum();
        positive("smallest index in the acoustic field", n0 - peaks)?;
        Ok(Acoustic {
            n0: positive("mean refractive index", n0)?,
            axis: Axis::with_reference(origin, direction, reference)?,
            modes,
        })
    }

    /// The field at the phase ωt of the sound, in radians.
    pub(super) fn at_phase(&self, phase: f64) -> Self {
        Acoustic {
            modes: self.modes.iter().map(|m| m.at_phase(phase)).collect(),
            ..*self
        }
    }

    /// Those of the modes, of the wavelengths 2π/k.
    pub(super) fn sounds(&self) -> impl Iterator<Item = Sound> {
        self.modes.iter().map(|m| Sound {
            frequency: m.frequency,
            wavelength: TAU / m.wave_number,
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

    /// Limits of the modes over the distances to the axis found in the box; in a small box a Taylor
    /// expansion about its middle is better.
    pub(super) fn bounds(&self, region: &Aabb) -> FieldBounds {
        let radii = self.axis.radius_range(region);
        let limits = self.modes.iter().fold([0.0; 3], |sum, mode| {
            let limits = mode.limits(radii);
            std::array::from_fn(|p| sum[p] + limits[p])
        });
        let third: f64 = self.modes.iter().map(AcousticMode::third_limit).sum();

        // The limit gives an unbounded box a middle.
        let far = DVec2::splat(1e100);
        let [min, max] = self.axis.transverse_range(region);
        let (min, max) = (min.clamp(-far, far), max.clamp(-far, far));
        let half = 0.5 * (max - min);
        let reach = half.length();
        let middle = self.wave(0.5 * (min + max));

        // Zero is the eigenvalue along the axis.
        let [low, high] = middle.curvatures();
        let hess_min = (low - third * reach).max(-limits[2]).min(0.0);
        let hess_max = (high + third * reach).min(limits[2]).max(0.0);
        let grad = middle.grad.length() + hess_min.abs().max(hess_max) * reach;
        let slope = middle.grad.abs().dot(half);
        let square = 0.5 * reach * reach;
        IndexBounds {
            n_min: self.n0 + (middle.value - slope + hess_min * square).max(-limits[0]),
            n_max: self.n0 + (middle.value + slope + hess_max * square).min(limits[0]),
            grad_max: grad.min(limits[1]),
            hess_min,
            hess_max,
        }
        .squared()
    }

    /// The length that makes the fifth derivative of a ray by σ n⁵L⁻⁴, by the fourth derivative of the index, which
    /// is at most 3/8 Δn k⁴ of each mode; no more than 6/k of the shortest wave, so that it is seen.
    pub(super) fn length_scale(&self, _: DVec3) -> f64 {
        let modes = || self.modes.iter().filter(|m| m.amplitude != 0.0);
        let shortest = modes().map(|m| m.wave_number).fold(0.0, f64::max);
        let fourth = |m: &AcousticMode| 0.375 * m.amplitude.abs() * m.wave_number.powi(4);
        let sum: f64 = modes().map(fourth).sum();
        (self.n0 / sum).sqrt().sqrt().min(6.0 / shortest)
    }

    pub(super) fn is_constant(&self) -> bool {
        self.modes.iter().all(|m| m.amplitude == 0.0)
    }
}
