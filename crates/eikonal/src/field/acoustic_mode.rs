//! Modes of the sound in a field (docs/theory.md#sound).

use super::bessel;
use super::bessel_table::{BesselTable, ERROR, Piece};
use super::error::{FieldError, finite, positive};
use super::sound::Sound;
use glam::DVec2;
use std::f64::consts::{FRAC_2_PI, PI, TAU};

/// A cylindrical mode of standing sound, Δn J_m(kr) cos(mφ + φ₀) cos(ωt + τ), at an instant t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AcousticMode {
    /// Peak amplitude Δn.
    peak: f64,
    /// Phase τ in time.
    time_phase: f64,
    /// Complex instant e^{i(ωt + τ)}; zero without sound.
    instant: DVec2,
    /// Amplitude Δn cos(ωt + τ).
    amplitude: f64,
    order: u16,
    wave_number: f64,
    /// Azimuthal phase e^{iφ₀}.
    turn: DVec2,
    /// Frequency in Hz, if it was given.
    frequency: Option<f64>,
}

impl AcousticMode {
    /// Creates a mode of `amplitude` Δn (any sign) and azimuthal `order` m, at t = 0 and with τ =
    /// 0. The `wave_number` k > 0 is in radians per scene unit, and the azimuthal `phase` φ₀ in
    /// radians.
    ///
    /// # Errors
    ///
    /// An amplitude or phase that is not finite; a wave number that is not positive and finite.
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
            instant: DVec2::X,
            amplitude,
            order,
            wave_number: positive("wave number of an acoustic mode", wave_number)?,
            turn: DVec2::from_angle(finite("phase of an acoustic mode", phase)?),
            frequency: None,
        })
    }

    /// Creates a mode like [`AcousticMode::new`], with k = 2πf/c from `frequency` f > 0 in Hz and
    /// `sound_speed` c > 0 in scene units per second.
    ///
    /// # Errors
    ///
    /// Errors of [`AcousticMode::new`]; a frequency or speed that is not positive and finite.
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

    /// Returns the mode with the phase in time τ = `time_phase`, in radians, at t = 0. Two modes
    /// with τ = 0 and −π/2 and φ₀ = 0 and −π/2 form a rotating mode, cos(mφ − ωt).
    ///
    /// # Errors
    ///
    /// A phase that is not finite.
    pub fn with_time_phase(self, time_phase: f64) -> Result<Self, FieldError> {
        let time_phase = finite("phase in time of an acoustic mode", time_phase)?;
        let mode = AcousticMode { time_phase, ..self };
        Ok(mode.at_phase(0.0))
    }

    /// Returns the azimuthal order m.
    pub(super) fn order(&self) -> u16 {
        self.order
    }

    /// Returns the wave number k.
    pub(super) fn wave_number(&self) -> f64 {
        self.wave_number
    }

    /// Returns true if the mode does not change the index at this instant.
    pub(super) fn is_silent(&self) -> bool {
        self.amplitude == 0.0
    }

    pub(super) fn sound(&self) -> Sound {
        Sound {
            frequency: self.frequency,
            wavelength: TAU / self.wave_number,
            elasto_optic: None,
        }
    }

    /// Returns the mode without sound.
    pub(super) fn without_sound(self) -> Self {
        AcousticMode {
            instant: DVec2::ZERO,
            amplitude: 0.0,
            ..self
        }
    }

    /// Returns the mode at its peak, and e^{iτ}.
    pub(super) fn peak_in_time(&self) -> (Self, DVec2) {
        (self.at_peak(), DVec2::from_angle(self.time_phase))
    }

    /// Returns the mode at the instant when it changes the index most.
    pub(super) fn at_peak(self) -> Self {
        AcousticMode {
            instant: DVec2::X,
            amplitude: self.peak,
            ..self
        }
    }

    /// Returns the mode at the phase ωt.
    pub(super) fn at_phase(self, phase: f64) -> Self {
        let instant = DVec2::from_angle(phase + self.time_phase);
        AcousticMode {
            instant,
            amplitude: self.peak * instant.x,
            ..self
        }
    }

    /// Returns the parameters of the mode, in the order of [`MODE_PARAMETERS`].
    pub(super) fn numbers(&self) -> [f64; 4] {
        [
            self.peak,
            self.wave_number,
            self.turn.to_angle(),
            self.time_phase,
        ]
    }

    /// Returns the derivatives of value and gradient at the transverse position `d` with respect to
    /// these parameters.
    pub(super) fn changes(&self, d: DVec2, table: Option<&BesselTable>) -> [(f64, DVec2); 4] {
        let of = |amplitude: f64, turn: DVec2| {
            let mode = AcousticMode {
                amplitude,
                turn,
                ..*self
            };
            mode.wave(d, table)
        };
        let unit = of(1.0, self.turn);
        let turned = of(self.amplitude, DVec2::Y.rotate(self.turn));
        let wave = of(self.amplitude, self.turn);
        let hess_d = DVec2::new(wave.xx * d.x + wave.xy * d.y, wave.xy * d.x + wave.yy * d.y);
        let per = 1.0 / self.wave_number;
        let scaled = |factor: f64| (unit.value * factor, unit.grad * factor);
        [
            scaled(self.instant.x),
            // Planted error "modes of sound of which the wave number stretches values only", found by morgana-eikonal/eikonal::adjoint::parameters::fields_by_their_parameters:
            // (d.dot(wave.grad) * per, wave.grad * per),
            (d.dot(wave.grad) * per, (wave.grad + hess_d) * per),
            (turned.value, turned.grad),
            scaled(-self.peak * self.instant.y),
        ]
    }

    /// Returns the upper bounds of |value|, |gradient| and |curvature| over all radii r in `range`.
    ///
    /// J_m(kr)e^{imφ} is a mean of plane waves of wave number k over all directions. Its p-th
    /// derivative along any line is thus at most kᵖ times the mean of |cos|ᵖ: 2/π, 1/2, 4/(3π). As
    /// a sum of neighbouring orders (see `wave`) it is at most the sum of their peaks.
    pub(super) fn limits(&self, range: [f64; 2]) -> [f64; 3] {
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

    /// Returns the upper bounds of the errors of |value|, |gradient| and |curvature| within the
    /// tables.
    pub(super) fn errors(&self) -> [f64; 3] {
        [0, 1, 2].map(|p| ERROR * self.amplitude.abs() * self.wave_number.powi(p))
    }

    /// Returns an upper bound of all third derivatives along a line.
    pub(super) fn third_limit(&self) -> f64 {
        4.0 / (3.0 * PI) * self.amplitude.abs() * self.wave_number.powi(3)
    }

    /// Returns an upper bound of all fourth derivatives along a line.
    pub(super) fn fourth_limit(&self) -> f64 {
        0.375 * self.amplitude.abs() * self.wave_number.powi(4)
    }

    /// Returns value and derivatives at the transverse position `d`, given the table of the order,
    /// if there is one.
    pub(super) fn wave(&self, d: DVec2, table: Option<&BesselTable>) -> Wave {
        self.inline_wave(d, table)
    }

    /// Returns value and gradient, bit-identical to [`AcousticMode::wave`].
    pub(super) fn gradient(&self, d: DVec2, table: Option<&BesselTable>) -> (f64, DVec2) {
        let wave = self.inline_wave(d, table);
        (wave.value, wave.grad)
    }

    /// Returns the value alone.
    pub(super) fn value(&self, d: DVec2, table: Option<&BesselTable>) -> f64 {
        self.inline_wave(d, table).value
    }

    /// Computes the wave. Inlined, so that the compiler removes the unused parts.
    #[inline(always)]
    fn inline_wave(&self, d: DVec2, table: Option<&BesselTable>) -> Wave {
        let rho2 = d.length_squared() * (self.wave_number * self.wave_number);
        match table.and_then(|table| table.piece(rho2)) {
            Some(piece) => self.tabulated(piece, d, rho2),
            None => self.computed(d),
        }
    }

    /// Evaluates the mode from a table. With z = k(x + iy)/ρ_c the mode is Re(e^{iφ₀} zᵐ) times a
    /// function of η, with ∇η = kz and Hess η = k²/ρ_c.
    #[inline(always)]
    fn tabulated(&self, piece: &Piece, d: DVec2, rho2: f64) -> Wave {
        let [value, first, second] = piece.at(rho2).map(|v| v * self.amplitude);
        let per = self.wave_number * piece.per_center();
        let z = d * per;
        let [angular, slope, bend] = self.angular(z, per);
        let radial = z * self.wave_number;
        let steep = radial * (angular.x * second);
        let cross = slope * first;
        let round = angular.x * first * self.wave_number * per;
        Wave {
            value: angular.x * value,
            grad: slope * value + radial * (angular.x * first),
            xx: bend.x * value + radial.x * (2.0 * cross.x + steep.x) + round,
            xy: radial.x * (cross.y + steep.y) + radial.y * cross.x - bend.y * value,
            yy: radial.y * (2.0 * cross.y + steep.y) + round - bend.x * value,
        }
    }

    /// Returns P = Re(e^{iφ₀} zᵐ), with z = `per`(x + iy), and its derivatives: P in the first
    /// component, ∇P, and (∂²P/∂x², −∂²P/∂x∂y).
    #[inline(always)]
    fn angular(&self, z: DVec2, per: f64) -> [DVec2; 3] {
        if self.order == 0 {
            return [self.turn, DVec2::ZERO, DVec2::ZERO];
        }
        let m = f64::from(self.order);
        // Clamp the power m − 2: a negative power has no effect.
        let least = self.turn.rotate(power(z, self.order.saturating_sub(2)));
        let below = if self.order > 1 {
            z.rotate(least)
        } else {
            least
        };
        let slope = DVec2::new(below.x, -below.y) * (m * per);
        [z.rotate(below), slope, least * (m * (m - 1.0) * per * per)]
    }

    /// Evaluates the mode without a table. With E_p = e^{iφ₀} J_p(kr) e^{ipφ} the mode is Re E_m,
    /// and (∂x ± i∂y) E_p = ∓k E_{p±1}. Every derivative is thus a sum of E_p of several orders,
    /// which are smooth on the axis.
    #[cold]
    fn computed(&self, d: DVec2) -> Wave {
        let r = d.length();
        let turn = if r > 0.0 { d / r } else { DVec2::X };
        let back = DVec2::new(turn.x, -turn.y);
        let center = self.turn.rotate(power(turn, self.order));
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

/// Names of the parameters of a mode, as in scenes.
pub(super) const MODE_PARAMETERS: [&str; 4] = ["amplitude", "wave_number", "phase", "time_phase"];

/// Range of all distances to the axis.
pub(super) const EVERYWHERE: [f64; 2] = [0.0, f64::INFINITY];

/// Returns `z`ᵐ of a complex number.
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
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Wave {
    pub value: f64,
    pub grad: DVec2,
    pub xx: f64,
    pub xy: f64,
    pub yy: f64,
}

impl Wave {
    pub(super) fn plus(self, o: Wave) -> Wave {
        Wave {
            value: self.value + o.value,
            grad: self.grad + o.grad,
            xx: self.xx + o.xx,
            xy: self.xy + o.xy,
            yy: self.yy + o.yy,
        }
    }

    /// Returns the eigenvalues of the Hessian.
    pub(super) fn curvatures(&self) -> [f64; 2] {
        let middle = 0.5 * (self.xx + self.yy);
        let spread = (0.5 * (self.xx - self.yy)).hypot(self.xy);
        [middle - spread, middle + spread]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns value and derivatives in units of Δn and 1/k.
    fn numbers(wave: Wave, k: f64) -> [f64; 6] {
        let (grad, k2) = (wave.grad / k, k * k);
        [
            wave.value,
            grad.x,
            grad.y,
            wave.xx / k2,
            wave.xy / k2,
            wave.yy / k2,
        ]
    }

    #[test]
    fn tables_say_what_is_computed_without_them() {
        let k = 2.5;
        for order in [0, 1, 2, 3, 8, 40, 200] {
            let table = BesselTable::new(order);
            let mode = AcousticMode::new(1.0, order, k, 0.7).unwrap();
            for i in 0..4000 {
                let place = DVec2::from_angle(2.4 * f64::from(i)) * (0.05 * f64::from(i));
                let found = numbers(mode.wave(place, table.as_ref()), k);
                let expected = numbers(mode.computed(place), k);
                for (found, expected) in found.into_iter().zip(expected) {
                    assert!((found - expected).abs() < 0.5 * ERROR, "{order} at {place}");
                }
            }
        }
    }
}
