//! Index modulated by cylindrical standing waves of sound (docs/theory.md#sound).

use super::acoustic_mode::{AcousticMode, EVERYWHERE, MODE_PARAMETERS, Wave};
use super::axis::Axis;
use super::bessel_table::BesselTable;
use super::error::{FieldError, positive};
use super::sound::Sound;
use super::sound_amplitude::SoundAmplitude;
use super::{IndexDerivative, Jet};
use crate::bounds::{Aabb, FieldBounds, IndexBounds};
use glam::{DVec2, DVec3};

/// Index n(x) = n₀ + Σ Δn J_m(kr) cos(mφ + φ₀), with polar coordinates (r, φ) around an axis: a
/// snapshot of standing ultrasound in a cylindrical transducer, a virtual light guide.
///
/// The angle φ is 0 along the transverse part of a reference direction e₁, and grows from there
/// towards axis × e₁.
#[derive(Clone, Debug, PartialEq)]
pub struct Acoustic {
    n0: f64,
    axis: Axis,
    modes: Vec<AcousticMode>,
    /// Tables of the modes; modes of one order share a table.
    tables: Vec<Option<BesselTable>>,
    lengths: Lengths,
    /// Elasto-optic coefficient, see [`Sound::elasto_optic`].
    elasto_optic: Option<f64>,
}

impl Acoustic {
    /// Creates a field of mean index `n0` > 0 around an axis through `origin` along `direction`;
    /// `reference` must not be parallel to it. The sum of the peaks of the modes, at any instant,
    /// must stay below `n0`.
    ///
    /// # Errors
    ///
    /// A mean index that is not positive and finite, or not above the sum of the peaks; an origin
    /// or direction that is not finite, a direction of zero, or a reference along the axis.
    pub fn new(
        n0: f64,
        origin: DVec3,
        direction: DVec3,
        reference: DVec3,
        modes: Vec<AcousticMode>,
    ) -> Result<Self, FieldError> {
        let peaks = modes.iter().map(|m| m.at_peak().limits(EVERYWHERE)[0]);
        let peaks: f64 = peaks.sum();
        positive("smallest index in the acoustic field", n0 - peaks)?;
        Ok(Acoustic {
            lengths: Lengths::new(n0, &modes),
            n0: positive("mean refractive index", n0)?,
            axis: Axis::with_reference(origin, direction, reference)?,
            tables: tables(&modes),
            modes,
            elasto_optic: None,
        })
    }

    /// Returns the field with the elasto-optic coefficient η = ρc² ∂n/∂p > 0 (0.32 in water), which
    /// determines how far sound moves scatterers.
    ///
    /// # Errors
    ///
    /// A coefficient that is not positive.
    pub fn with_elasto_optic(self, elasto_optic: f64) -> Result<Self, FieldError> {
        let elasto_optic = Some(positive("elasto-optic coefficient", elasto_optic)?);
        Ok(Acoustic {
            elasto_optic,
            ..self
        })
    }

    pub(super) fn memory(&self) -> usize {
        let distinct = |(i, mode): (usize, &AcousticMode)| {
            let first = self.modes[..i].iter().all(|m| m.order() != mode.order());
            self.tables[i].as_ref().filter(|_| first)
        };
        let tables = self.modes.iter().enumerate().filter_map(distinct);
        tables.map(BesselTable::memory).sum()
    }

    /// Returns the field at the phase ωt of the sound, in radians.
    pub(super) fn at_phase(&self, phase: f64) -> Self {
        self.over(self.modes.iter().map(|m| m.at_phase(phase)).collect())
    }

    /// Returns the field without sound, see [`Field::without_sound`](super::Field::without_sound).
    pub(super) fn without_sound(&self) -> Self {
        self.over(self.modes.iter().map(|m| m.without_sound()).collect())
    }

    /// Returns this field with its modes at another instant.
    fn over(&self, modes: Vec<AcousticMode>) -> Self {
        Acoustic {
            lengths: Lengths::new(self.n0, &modes),
            modes,
            tables: self.tables.clone(),
            ..*self
        }
    }

    /// Returns the sounds of the modes, with wavelengths 2π/k.
    pub(super) fn sounds(&self) -> impl Iterator<Item = Sound> {
        let elasto_optic = self.elasto_optic;
        self.modes.iter().map(move |mode| Sound {
            elasto_optic,
            ..mode.sound()
        })
    }

    /// Returns the field with its modes at their peaks, and e^{iτ} of each mode.
    pub(super) fn peaks_in_time(&self) -> (Self, Vec<DVec2>) {
        let (modes, turns) = self.modes.iter().map(AcousticMode::peak_in_time).unzip();
        (self.over(modes), turns)
    }

    /// Returns the amplitudes of n² of the modes, turned in time: value and gradient at `x`.
    pub(super) fn amplitudes(&self, turns: &[DVec2], x: DVec3) -> SoundAmplitude {
        let d = self.axis.transverse(x);
        let (mut value, mut re, mut im) = (DVec2::ZERO, DVec2::ZERO, DVec2::ZERO);
        for ((mode, table), turn) in self.modes.iter().zip(&self.tables).zip(turns) {
            let (wave, slope) = mode.gradient(d, table.as_ref());
            value += *turn * wave;
            re += slope * turn.x;
            im += slope * turn.y;
        }
        let scale = 2.0 * self.n0;
        SoundAmplitude {
            n2: value * scale,
            gradient: [re, im].map(|slope| self.axis.vector(slope * scale)),
        }
    }

    /// Returns only the value of [`Acoustic::amplitudes`].
    pub(super) fn values(&self, turns: &[DVec2], x: DVec3) -> DVec2 {
        let d = self.axis.transverse(x);
        let modes = self.modes.iter().zip(&self.tables).zip(turns);
        let waves = modes.map(|((mode, table), turn)| *turn * mode.value(d, table.as_ref()));
        waves.sum::<DVec2>() * (2.0 * self.n0)
    }

    /// Returns the largest possible amplitude of n².
    pub(super) fn largest_amplitude(&self) -> f64 {
        let peaks = self.modes.iter().map(|m| m.at_peak().limits(EVERYWHERE)[0]);
        2.0 * self.n0 * peaks.sum::<f64>()
    }

    /// Returns the mean index n₀.
    pub(super) fn n0(&self) -> f64 {
        self.n0
    }

    /// Returns names and values of the parameters. Parameters of several modes are numbered. The
    /// axis and the reference direction are unit vectors; the reference direction is perpendicular
    /// to the axis.
    pub(super) fn parameters(&self) -> Vec<(String, Vec<f64>)> {
        let (axis, [reference, _]) = (&self.axis, self.axis.basis());
        let vector = |name: &str, v: DVec3| (name.to_owned(), v.to_array().to_vec());
        let mut all = vec![
            ("n0".to_owned(), vec![self.n0]),
            vector("origin", axis.origin()),
            vector("direction", axis.direction()),
            vector("reference", reference),
        ];
        for (i, mode) in self.modes.iter().enumerate() {
            for (name, value) in MODE_PARAMETERS.iter().zip(mode.numbers()) {
                let name = match self.modes.len() {
                    1 => (*name).to_owned(),
                    _ => format!("modes[{i}].{name}"),
                };
                all.push((name, vec![value]));
            }
        }
        all
    }

    pub(super) fn parameter_count(&self) -> usize {
        10 + MODE_PARAMETERS.len() * self.modes.len()
    }

    /// Adds derivatives with respect to the parameters.
    pub(super) fn add_parameter_derivative(&self, x: DVec3, by: IndexDerivative, into: &mut [f64]) {
        let d = self.axis.transverse(x);
        let jet = self.jet(x);
        let n = jet.n2.sqrt();
        // Convert to derivatives with respect to n: n² and ∇n² change by 2n δn and 2(∇n δn + n
        // ∇δn).
        let by_value = 2.0 * n * by.n2 + jet.grad.dot(by.gradient) / n;
        let by_slope = self.axis.across(by.gradient) * (2.0 * n);
        into[0] += by_value;
        let moved = -(jet.grad * by.n2 + jet.hess * by.gradient);
        // Compute the derivative with respect to a rotation about the origin.
        let from = x - self.axis.origin();
        let torque = from.cross(moved) + jet.grad.cross(by.gradient);
        let (axis, [_, e2]) = (self.axis.direction(), self.axis.basis());
        let vectors = [moved, torque.cross(axis), e2 * torque.dot(axis)];
        let vectors = vectors.map(|v| v.to_array()).concat();
        into[1..10]
            .iter_mut()
            .zip(vectors)
            .for_each(|(sum, v)| *sum += v);
        let sums = into[10..].chunks_exact_mut(MODE_PARAMETERS.len());
        for ((mode, table), sums) in self.modes.iter().zip(&self.tables).zip(sums) {
            let changes = mode.changes(d, table.as_ref());
            for (sum, (value, slope)) in sums.iter_mut().zip(changes) {
                *sum += by_value * value + by_slope.dot(slope);
            }
        }
    }

    /// Returns the modes that are not silent at this instant, with their tables.
    fn heard(&self) -> impl Iterator<Item = (&AcousticMode, Option<&BesselTable>)> {
        let modes = self.modes.iter().zip(&self.tables);
        let heard = modes.filter(|(mode, _)| !mode.is_silent());
        heard.map(|(mode, table)| (mode, table.as_ref()))
    }

    fn wave(&self, d: DVec2) -> Wave {
        let waves = self.heard().map(|(mode, table)| mode.wave(d, table));
        waves.fold(Wave::default(), Wave::plus)
    }

    pub(super) fn n2(&self, x: DVec3) -> f64 {
        self.gradient(x).0
    }

    pub(super) fn gradient(&self, x: DVec3) -> (f64, DVec3) {
        let d = self.axis.transverse(x);
        let heard = self.heard().map(|(mode, table)| mode.gradient(d, table));
        let (value, slope) = heard.fold((0.0, DVec2::ZERO), |sum, wave| {
            (sum.0 + wave.0, sum.1 + wave.1)
        });
        let n = self.n0 + value;
        (n * n, self.axis.vector(slope * (2.0 * n)))
    }

    pub(super) fn jet(&self, x: DVec3) -> Jet {
        let w = self.wave(self.axis.transverse(x));
        let (n, grad) = (self.n0 + w.value, w.grad);
        // Compute ½ Hess n² = n Hess n + ∇n⊗∇n, in the transverse plane.
        let [xx, xy, yy] = [
            n * w.xx + grad.x * grad.x,
            n * w.xy + grad.x * grad.y,
            n * w.yy + grad.y * grad.y,
        ];
        Jet {
            n2: n * n,
            grad: self.axis.vector(grad * (2.0 * n)),
            hess: self.axis.matrix(2.0 * xx, 2.0 * xy, 2.0 * yy),
        }
    }

    /// Computes bounds from the limits of the modes over the range of distances to the axis in the
    /// box. In a small box, a Taylor expansion about its middle is tighter.
    pub(super) fn bounds(&self, region: &Aabb) -> FieldBounds {
        let radii = self.axis.radius_range(region);
        let sum = |of: &dyn Fn(&AcousticMode) -> [f64; 3]| {
            let each = self.modes.iter().map(of);
            each.fold([0.0; 3], |sum, v| std::array::from_fn(|p| sum[p] + v[p]))
        };
        // Add the errors of the tables, because the limits hold for exact functions.
        let errors = sum(&AcousticMode::errors);
        let exact = sum(&|mode| mode.limits(radii));
        let limits: [f64; 3] = std::array::from_fn(|p| exact[p] + errors[p]);
        let third: f64 = self.modes.iter().map(AcousticMode::third_limit).sum();

        // Clamp an unbounded box, so that it has a middle.
        let far = DVec2::splat(1e100);
        let [min, max] = self.axis.transverse_range(region);
        let (min, max) = (min.clamp(-far, far), max.clamp(-far, far));
        let half = 0.5 * (max - min);
        let reach = half.length();
        let middle = self.wave(0.5 * (min + max));

        // Include zero, the eigenvalue along the axis.
        let [low, high] = middle.curvatures();
        let change = third * reach + 2.0 * errors[2];
        let hess_min = (low - change).max(-limits[2]).min(0.0);
        let hess_max = (high + change).min(limits[2]).max(0.0);
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

    /// Returns the length scale, see [`Lengths::of_any_direction`].
    pub(super) fn length_scale(&self, _: DVec3) -> f64 {
        self.lengths.of_any_direction
    }

    /// Returns the length scale for a velocity, see [`Lengths::along`].
    pub(super) fn step_scale(&self, v: DVec3) -> f64 {
        let crossed = self.axis.across(v);
        self.lengths
            .along(crossed.length_squared() / v.length_squared())
    }

    pub(super) fn is_constant(&self) -> bool {
        self.modes.iter().all(AcousticMode::is_silent)
    }
}

/// Length scales, by which steps of rays are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Lengths {
    /// Length scale for rays of any direction.
    of_any_direction: f64,
    /// Bound of the fourth derivatives of the index, over n₀.
    fourth: f64,
    /// Squared bound of the second derivatives of the index, over n₀.
    turning: f64,
    /// Largest growth, within the field, of the squared transverse part of a ray's direction.
    swing: f64,
    /// Largest wave number k.
    wave_number: f64,
}

impl Lengths {
    fn new(n0: f64, modes: &[AcousticMode]) -> Self {
        let modes = || modes.iter().filter(|m| !m.is_silent());
        let fourth: f64 = modes().map(AcousticMode::fourth_limit).sum();
        let limits = || modes().map(|m| m.limits(EVERYWHERE));
        let second: f64 = limits().map(|[_, _, second]| second).sum();
        let peak: f64 = limits().map(|[peak, ..]| peak).sum();
        let wave_number = modes().map(AcousticMode::wave_number).fold(0.0, f64::max);
        Lengths {
            of_any_direction: (n0 / fourth).sqrt().sqrt().min(6.0 / wave_number),
            fourth: fourth / n0,
            turning: (second / n0).powi(2),
            swing: 4.0 * peak / n0,
            wave_number,
        }
    }

    /// Returns the length scale L along a direction with the squared transverse part `crossed2`.
    /// The fifth derivative of a ray with respect to σ is n⁵L⁻⁴. It follows from the fourth
    /// derivative of the index, at most 3/8 Δn k⁴ for each mode, and from second derivatives. For
    /// the tangents of a ray, fourth derivatives count times the squared transverse part; second
    /// derivatives count for every direction. L is at most 6/k of the shortest wave, so that steps
    /// resolve the wave.
    fn along(&self, crossed2: f64) -> f64 {
        let crossed2 = (crossed2 + self.swing).min(1.0);
        let fifth = self.fourth * crossed2 + self.turning;
        let seen = 6.0 / (self.wave_number * crossed2.sqrt());
        let length = (1.0 / fifth).sqrt().sqrt().min(seen);
        length.max(self.of_any_direction)
    }
}

/// Returns a table for each mode that can have one.
fn tables(modes: &[AcousticMode]) -> Vec<Option<BesselTable>> {
    let mut tables: Vec<Option<BesselTable>> = Vec::new();
    for (i, mode) in modes.iter().enumerate() {
        let alike = modes[..i].iter().position(|m| m.order() == mode.order());
        let table = match alike {
            Some(at) => tables[at].clone(),
            None => BesselTable::new(mode.order()),
        };
        tables.push(table);
    }
    tables
}
