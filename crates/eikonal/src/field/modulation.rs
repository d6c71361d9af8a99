//! What sound does to the phase of light, to first order in the sound (docs/theory.md#tagged-light).

use super::{Acoustic, Bspline, Field, SampledSound};
use glam::{DAffine3, DVec2, DVec3};
use std::f64::consts::TAU;

/// The sound of one frequency in a field: n²(x, t) = n₀²(x) + Re(m(x) e^{iωt}) to first order, and how far it moves what is in the medium.
/// Complex numbers are vectors of their real and imaginary parts.
#[derive(Clone, Debug)]
pub struct Modulation {
    terms: Vec<Term>,
    /// Shortest wavelength.
    pub(crate) wavelength: f64,
    /// Largest |m| that there can be, or about so.
    pub(crate) largest: f64,
}

/// The amplitude of sound at a place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SoundAmplitude {
    /// m: that of n².
    pub n2: DVec2,
    /// Real and imaginary parts of ∇m.
    pub gradient: [DVec3; 2],
    /// Those of the displacement û of what moves with the medium; NaN where the elasto-optic coefficient is not known, or modes of one
    /// field have several wavelengths.
    pub displacement: [DVec3; 2],
}

/// One sound, in coordinates of its own.
#[derive(Clone, Debug)]
struct Term {
    wave: Wave,
    to_local: Option<DAffine3>,
    /// By which squared indices are multiplied.
    square: f64,
    /// û over ∇m.
    per_gradient: f64,
}

#[derive(Clone, Debug)]
enum Wave {
    /// At their peaks, and e^{iτ} of each.
    Modes(Acoustic, Vec<DVec2>),
    Sampled(Box<SampledWave>),
}

/// Splines of n₀² + ½ Re m and of n₀² + ½ Im m, unless these are zero.
#[derive(Clone, Debug)]
struct SampledWave {
    parts: [Option<Bspline>; 2],
    /// n₀².
    n2: f64,
    /// Largest |m|.
    largest: f64,
}

/// m and ∇m.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Amplitude {
    n2: DVec2,
    gradient: [DVec3; 2],
}

impl Amplitude {
    /// Adds `scale` `turn` times a value with a gradient.
    pub(super) fn plus(self, scale: f64, turn: DVec2, value: f64, gradient: DVec3) -> Self {
        let [re, im] = self.gradient;
        let turn = turn * scale;
        Amplitude {
            n2: self.n2 + turn * value,
            gradient: [re + gradient * turn.x, im + gradient * turn.y],
        }
    }
}

impl Modulation {
    /// That of the sound in a field, at whatever instant the field is; `None` without sound.
    pub fn of(field: &Field) -> Option<Self> {
        let mut terms = Vec::new();
        collect(field, &mut terms);
        let [wavelength, _] = field.sound_wavelengths()?;
        Some(Modulation {
            largest: terms.iter().map(Term::largest).sum(),
            wavelength,
            terms,
        })
    }

    /// The amplitude at a place.
    pub fn at(&self, x: DVec3) -> SoundAmplitude {
        let mut sum = SoundAmplitude::default();
        for term in &self.terms {
            let Amplitude { n2, gradient } = term.at(x);
            sum.n2 += n2;
            for (part, gradient) in gradient.into_iter().enumerate() {
                sum.gradient[part] += gradient;
                sum.displacement[part] += gradient * term.per_gradient;
            }
        }
        sum
    }
}

/// Adds the sounds in a field.
fn collect(field: &Field, terms: &mut Vec<Term>) {
    let (wave, n0) = match field {
        Field::Acoustic(f) => {
            let (peaks, turns) = f.peaks_in_time();
            (Wave::Modes(peaks, turns), f.n0())
        }
        Field::SampledSound(f) => (Wave::Sampled(Box::new(SampledWave::of(f))), f.wave().n0),
        Field::Sum(f) => return f.terms().for_each(|term| collect(term, terms)),
        Field::Affine(f) => {
            let first = terms.len();
            collect(f.inner(), terms);
            for term in &mut terms[first..] {
                term.to_local = Some(term.to_local.map_or(f.to_local(), |m| m * f.to_local()));
                // k becomes k over the scale.
                term.per_gradient *= f.mean_scale().powi(2);
            }
            return;
        }
        Field::Scaled(f) => {
            let first = terms.len();
            collect(f.inner(), terms);
            for term in &mut terms[first..] {
                term.square *= f.square();
                term.per_gradient /= f.square();
            }
            return;
        }
        _ => return,
    };
    let sounds = field.sounds();
    let first = sounds.first();
    let alike = first.filter(|first| sounds.iter().all(|s| s.wavelength == first.wavelength));
    // û = ∇p̂/(ρω²) with p̂ = n̂/(∂n/∂p), n̂ = m/2n₀ and η = ρc² ∂n/∂p: ∇m/(2n₀ηk²).
    let per_gradient = alike.and_then(|sound| {
        let k = TAU / sound.wavelength;
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
    fn at(&self, x: DVec3) -> Amplitude {
        let local = self.to_local.map_or(x, |map| map.transform_point3(x));
        let Amplitude { n2, gradient } = match &self.wave {
            Wave::Modes(modes, turns) => modes.amplitudes(turns, local),
            Wave::Sampled(samples) => samples.at(local),
        };
        let in_world = |g: DVec3| self.to_local.map_or(g, |map| map.matrix3.transpose() * g);
        Amplitude {
            n2: n2 * self.square,
            gradient: gradient.map(|g| in_world(g) * self.square),
        }
    }

    fn largest(&self) -> f64 {
        let local = match &self.wave {
            Wave::Modes(modes, _) => modes.largest_amplitude(),
            Wave::Sampled(samples) => samples.largest,
        };
        local * self.square
    }
}

impl SampledWave {
    fn of(sound: &SampledSound) -> Self {
        let wave = sound.wave();
        let n2 = wave.n0 * wave.n0;
        let part = |i: usize| {
            let silent = wave.amplitude.iter().all(|parts| parts[i] == 0.0);
            // As many samples as the field has, all positive, for |A| < n₀.
            let spline = || wave.spline(|parts| n2 + wave.n0 * parts[i]).ok();
            (!silent).then(spline).flatten()
        };
        let most = |[re, im]: &[f32; 2]| f64::from(re.hypot(*im));
        let most = wave.amplitude.iter().map(most).fold(0.0, f64::max);
        SampledWave {
            parts: [part(0), part(1)],
            n2,
            largest: 2.0 * wave.n0 * most,
        }
    }

    fn at(&self, x: DVec3) -> Amplitude {
        let [re, im] = [0, 1].map(|i| {
            let part = self.parts[i].as_ref().map(|spline| spline.gradient(x));
            part.map_or((0.0, DVec3::ZERO), |(n2, g)| {
                (2.0 * (n2 - self.n2), 2.0 * g)
            })
        });
        Amplitude {
            n2: DVec2::new(re.0, im.0),
            gradient: [re.1, im.1],
        }
    }
}
