//! Modulation of the phase of light by sound, to first order in the sound
//! (docs/theory.md#tagged-light).

use super::sampled_amplitude::SampledAmplitude;
use super::sound_amplitude::SoundAmplitude;
use super::{Acoustic, Field};
use glam::{DAffine3, DVec2, DVec3};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Sound of one frequency in a field: n²(x, t) = n₀²(x) + Re(m(x) e^{iωt}) to first order, and the
/// displacement of scatterers in the medium. Complex numbers are vectors of their real and
/// imaginary parts.
#[derive(Clone, Debug)]
pub struct Modulation {
    terms: Vec<Term>,
    /// Reciprocal of the shortest wavelength.
    pub(crate) per_wavelength: f64,
    /// Largest possible |m|, approximately.
    pub(crate) largest: f64,
}

/// Sound of one field, in the local coordinates of this field.
#[derive(Clone, Debug)]
struct Term {
    wave: Wave,
    to_local: Option<DAffine3>,
    /// Factor of squared indices.
    square: f64,
    /// Ratio of the displacement û to ∇m.
    per_gradient: f64,
}

#[derive(Clone, Debug)]
enum Wave {
    /// Modes at their peaks, and e^{iτ} of each mode.
    Modes(Acoustic, Vec<DVec2>),
    Sampled(Arc<SampledAmplitude>),
}

impl Modulation {
    /// Returns the modulation by the sound in a field, at any instant of the field; `None` without
    /// sound.
    pub fn of(field: &Field) -> Option<Self> {
        let mut terms = Vec::new();
        collect(field, &mut terms);
        let [wavelength, _] = field.sound_wavelengths()?;
        Some(Modulation {
            largest: terms.iter().map(Term::largest).sum(),
            per_wavelength: 1.0 / wavelength,
            terms,
        })
    }

    /// Returns the amplitude at a place.
    #[inline]
    pub fn at(&self, x: DVec3) -> SoundAmplitude {
        match &self.terms[..] {
            [term] => term.at(x),
            terms => terms
                .iter()
                .fold(SoundAmplitude::default(), |sum, term| sum.plus(term.at(x))),
        }
    }

    /// Returns only the value m of [`Modulation::at`].
    #[inline]
    pub fn value(&self, x: DVec3) -> DVec2 {
        self.terms.iter().map(|term| term.value(x)).sum()
    }

    /// Returns real and imaginary parts of the displacement û of scatterers that move with the
    /// medium, at a place with the given amplitude. Returns NaN where the elasto-optic coefficient
    /// is unknown, or where modes of one field have different wavelengths.
    pub fn displacement(&self, x: DVec3, amplitude: &SoundAmplitude) -> [DVec3; 2] {
        match &self.terms[..] {
            [term] => amplitude.gradient.map(|g| g * term.per_gradient),
            terms => terms.iter().fold([DVec3::ZERO; 2], |[re, im], term| {
                let of_term = term.at(x).gradient.map(|g| g * term.per_gradient);
                [re + of_term[0], im + of_term[1]]
            }),
        }
    }
}

/// Adds the sounds in a field.
fn collect(field: &Field, terms: &mut Vec<Term>) {
    let (wave, n0) = match field {
        Field::Acoustic(f) => {
            let (peaks, turns) = f.peaks_in_time();
            (Wave::Modes(peaks, turns), f.n0())
        }
        Field::SampledSound(f) => (Wave::Sampled(f.amplitude()), f.wave().n0),
        Field::Sum(f) => return f.terms().for_each(|term| collect(term, terms)),
        Field::Affine(f) => {
            let first = terms.len();
            collect(f.inner(), terms);
            for term in &mut terms[first..] {
                term.to_local = Some(term.to_local.map_or(f.to_local(), |m| m * f.to_local()));
                // Divide k by the scale.
                // Planted error "sound under transforms with the wave number of its own coordinates", found by morgana-eikonal/eikonal::modulation::displacements_follow_the_gradient_of_pressure:
                // (no line)
                term.per_gradient *= f.mean_scale().powi(2);
            }
            return;
        }
        Field::Scaled(f) => {
            let first = terms.len();
            collect(f.inner(), terms);
            for term in &mut terms[first..] {
                let square = f.factor() * f.factor();
                term.square *= square;
                term.per_gradient /= square;
            }
            return;
        }
        _ => return,
    };
    let sounds = field.sounds();
    let first = sounds.first();
    let alike = first.filter(|first| sounds.iter().all(|s| s.wavelength == first.wavelength));
    // Use û = ∇p̂/(ρω²) with p̂ = n̂/(∂n/∂p), n̂ = m/2n₀ and η = ρc² ∂n/∂p, hence û = ∇m/(2n₀ηk²).
    let per_gradient = alike.and_then(|sound| {
        let k = TAU / sound.wavelength;
        // Planted error "displacement of scatterers counted twice", found by morgana-transport/transport::meters::tagged::modulations_are_those_of_optical_lengths_at_instants:
        // Some(1.0 / (n0 * sound.elasto_optic? * k * k))
        Some(1.0 / (2.0 * n0 * sound.elasto_optic? * k * k))
    });
    terms.push(Term {
        wave,
        to_local: None,
        square: 1.0,
        per_gradient: per_gradient.unwrap_or(f64::NAN),
    });
}

impl Term {
    fn at(&self, x: DVec3) -> SoundAmplitude {
        let local = self.to_local.map_or(x, |map| map.transform_point3(x));
        let SoundAmplitude { n2, gradient } = match &self.wave {
            Wave::Modes(modes, turns) => modes.amplitudes(turns, local),
            Wave::Sampled(samples) => samples.at(local),
        };
        let in_world = |g: DVec3| self.to_local.map_or(g, |map| map.matrix3.transpose() * g);
        SoundAmplitude {
            n2: n2 * self.square,
            gradient: gradient.map(|g| in_world(g) * self.square),
        }
    }

    fn value(&self, x: DVec3) -> DVec2 {
        let local = self.to_local.map_or(x, |map| map.transform_point3(x));
        let value = match &self.wave {
            Wave::Modes(modes, turns) => modes.values(turns, local),
            Wave::Sampled(samples) => samples.value(local),
        };
        value * self.square
    }

    fn largest(&self) -> f64 {
        let local = match &self.wave {
            Wave::Modes(modes, _) => modes.largest_amplitude(),
            Wave::Sampled(samples) => samples.largest(),
        };
        local * self.square
    }
}
