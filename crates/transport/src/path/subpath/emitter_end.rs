//! Ends at emitters to which a vertex is connected. One of several candidates is chosen in
//! proportion to an estimate of its contribution (resampled importance sampling: J. Talbot, D.
//! Cline and P. Egbert, "Importance Resampling for Global Illumination", 2005).
//!
//! Theory: docs/theory.md#resampled-ends.

use super::toward_emitters::scatter_pdf;
use crate::connection_end::{ConnectionEnd, EndSample};
use crate::emitter::{Class, Emitter};
use crate::path::segment::Vertex;
use crate::sampling::{R2_STEPS, Sampler};
use crate::scene::{Receiver, Scene};
use crate::stats::Stats;
use glam::DVec3;
use smallvec::SmallVec;

/// Shift between candidates in the unit square, modulo 1 (Roberts' R₂ sequence). Each candidate is
/// uniform, and all of them together are spread evenly.
const SHIFT: [f64; 2] = R2_STEPS;
/// Fraction of uniform choices in scenes that bend rays, where estimates along straight lines may
/// be wrong.
const UNIFORM_FRACTION: f64 = 0.5;

/// Resampling of ends on emitters: the number of candidates, and the number of samples for MIS
/// weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Resampling {
    /// Number of candidates, at least one.
    candidates: usize,
    /// Number of independent samples that MIS weights assume, at least one. It is less than the
    /// number of candidates if candidates often share a shadow.
    pub samples: f64,
}

impl Resampling {
    const NONE: Self = Resampling {
        candidates: 1,
        samples: 1.0,
    };
    /// Resampling for emitters on surfaces, from surfaces. The numbers have the best efficiency
    /// (docs/development/product-sampling.md).
    const AREA: Self = Resampling {
        candidates: 4,
        samples: 4.0,
    };
    /// Resampling for environments, from surfaces.
    const SKY: Self = Resampling {
        candidates: 2,
        samples: std::f64::consts::SQRT_2,
    };

    /// Returns the resampling for connections from a vertex to emitters of a class.
    pub(crate) fn of(scene: &Scene, class: Class, vertex: &Vertex) -> Self {
        match (class, vertex) {
            (Class::Area, Vertex::Surface { .. }) => Resampling::AREA,
            (Class::Sky, Vertex::Surface { .. }) if scene.has_image(class) => Resampling::SKY,
            _ => Resampling::NONE,
        }
    }
}

/// End of a connection at an emitter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EmitterEnd {
    /// Index of the emitter.
    pub emitter: usize,
    /// Probability with which a candidate is at this emitter.
    pub probability: f64,
    /// Sampled end on the emitter, with its density as a candidate.
    pub sampled: EndSample,
    /// Factor on the contribution over `probability` and density: 1/(M P), where this end was
    /// chosen with probability P among M candidates.
    pub weight: f64,
}

/// Inputs for the choice of an end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EndChoice<'a> {
    pub scene: &'a Scene,
    pub vertex: &'a Vertex,
    /// Data of the vertex on which the choice of an emitter depends.
    pub receiver: &'a Receiver<'a>,
    pub class: Class,
    /// Probability of making the connection.
    pub rate: f64,
}

impl EndChoice<'_> {
    /// Samples an end from the random numbers `u` and `place`, uniform in [0, 1). Returns `None` if
    /// no candidate contributes.
    pub(crate) fn sample(
        &self,
        u: f64,
        place: [f64; 2],
        sampler: &mut Sampler,
        stats: &mut Stats,
    ) -> Option<EmitterEnd> {
        let Resampling {
            candidates,
            samples,
        } = Resampling::of(self.scene, self.class, self.vertex);
        let emitters = self.scene.emitter_choice(self.class, self.receiver);
        let candidate = |u: f64, place: [f64; 2]| {
            let (emitter, probability) = emitters.choose(u);
            Candidate {
                emitter,
                probability,
                place,
            }
        };
        if candidates == 1 {
            return Some(self.end(&candidate(u, place), 1.0));
        }
        stats.connections.candidates += candidates as u64;
        let emitter = sampler.next_1d();
        let shifted = |k: usize| {
            let shifted = |axis: usize| fraction(place[axis] + k as f64 * SHIFT[axis]);
            let emitter = fraction(emitter + k as f64 / candidates as f64);
            candidate(emitter, [shifted(0), shifted(1)])
        };
        // Sample the ends for the estimates, and the chosen end again, because ends are large.
        let all: SmallVec<[Candidate; 4]> = (0..candidates).map(shifted).collect();
        let guesses: SmallVec<[f64; 4]> = all.iter().map(|c| self.guess(c, samples)).collect();
        let evenly = if self.scene.is_straight() {
            0.0
        } else {
            UNIFORM_FRACTION
        };
        let Chosen { index, probability } = choose(&guesses, evenly, u)?;
        let weight = 1.0 / (candidates as f64 * probability);
        Some(self.end(&all[index], weight))
    }

    /// Samples the end of a candidate.
    fn end(&self, candidate: &Candidate, weight: f64) -> EmitterEnd {
        let (scene, emitter) = (self.scene, candidate.emitter);
        let shape = |object: usize| &scene.objects()[object].shape;
        EmitterEnd {
            emitter,
            probability: candidate.probability,
            sampled: scene.emitters()[emitter].sample_end(scene.around(), shape, candidate.place),
            weight,
        }
    }

    /// Estimates the contribution of a straight connection to a candidate, up to a factor, times
    /// its MIS weight over the density of the candidate. MIS counts a candidate as `samples`
    /// samples. The density of directions replaces the scattering function.
    fn guess(&self, candidate: &Candidate, samples: f64) -> f64 {
        let (scene, x) = (self.scene, self.vertex.position());
        let emitter = &scene.emitters()[candidate.emitter];
        let (chord, pdf, emitted) = if let Emitter::Area { object, radiance } = emitter {
            // Leave out the data of the point that only connections need.
            let point = scene.objects()[*object].shape.sample_area(candidate.place);
            let chord = Chord::to_surface(x, point.position, point.normal);
            (chord, point.pdf, (*radiance * chord.cos).sum())
        } else {
            let end = self.end(candidate, 1.0).sampled;
            let chord = Chord::to(x, &end.end);
            let emitted = emitter.emitted_roughly(&end, x, -chord.direction);
            (chord, end.pdf, emitted)
        };
        if chord.cos <= 0.0 {
            return 0.0;
        }
        let scattered = scatter_pdf(scene, self.vertex, chord.direction);
        if scattered <= 0.0 {
            return 0.0;
        }
        let by_connection = self.rate * candidate.probability * pdf * samples;
        let by_chance = scattered * chord.cos / chord.squared;
        scattered * emitted / chord.squared / (by_connection + by_chance)
    }
}

/// Emitter of a candidate, and the random numbers of its position there.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    emitter: usize,
    /// Probability with which a candidate is at this emitter.
    probability: f64,
    place: [f64; 2],
}

/// Straight line from a vertex to a candidate.
#[derive(Clone, Copy, Debug)]
struct Chord {
    /// Unit direction from the vertex.
    direction: DVec3,
    /// Squared length; 1 to a plane.
    squared: f64,
    /// Cosine of the angle between the line and the normal of the surface at its end; 1 without a
    /// surface, negative behind it.
    cos: f64,
}

impl Chord {
    fn to(x: DVec3, end: &ConnectionEnd) -> Self {
        match *end {
            ConnectionEnd::Plane { direction, .. } => Chord {
                direction: -direction,
                squared: 1.0,
                cos: 1.0,
            },
            ConnectionEnd::Point {
                position,
                surface: Some(on),
            } => Chord::to_surface(x, position, on.normal),
            ConnectionEnd::Point {
                position,
                surface: None,
            } => Chord {
                cos: 1.0,
                ..Chord::to_surface(x, position, DVec3::ZERO)
            },
        }
    }

    #[inline]
    fn to_surface(x: DVec3, position: DVec3, normal: DVec3) -> Self {
        let chord = position - x;
        let squared = chord.length_squared();
        let direction = chord / squared.sqrt();
        Chord {
            direction,
            squared,
            cos: -normal.dot(direction),
        }
    }
}

/// Returns the fractional part of a small number, at least 0. This takes fewer instructions than
/// [`f64::fract`].
fn fraction(x: f64) -> f64 {
    x - f64::from(x as u32)
}

/// A candidate chosen among several.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Chosen {
    index: usize,
    /// Probability of the choice, > 0.
    probability: f64,
}

/// Chooses in proportion to `guesses`, which are at least 0, except for a fraction `evenly` of
/// uniform choices. `u` is uniform in [0, 1). Returns `None` if all guesses and `evenly` are zero.
fn choose(guesses: &[f64], evenly: f64, u: f64) -> Option<Chosen> {
    let total: f64 = guesses.iter().sum();
    let usable = total > 0.0 && total.is_finite();
    if !usable && total == 0.0 && evenly == 0.0 {
        return None;
    }
    let even = 1.0 / guesses.len() as f64;
    let probability = |guess: f64| {
        if usable {
            (1.0 - evenly) * guess / total + evenly * even
        } else {
            even
        }
    };
    let (mut left, mut chosen) = (u, None);
    for (index, &guess) in guesses.iter().enumerate() {
        let probability = probability(guess);
        if probability > 0.0 {
            chosen = Some(Chosen { index, probability });
            if left < probability {
                break;
            }
        }
        left -= probability;
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Choices from a fine grid of `u` occur with their probabilities, up to the width of the grid.
    #[test]
    fn choices_have_their_probabilities() {
        let many = 100_000;
        for (guesses, evenly, expected) in [
            (&[1.0, 0.0, 3.0][..], 0.0, [0.25, 0.0, 0.75]),
            (&[0.0, 0.0, 3.0], 0.3, [0.1, 0.1, 0.8]),
            (&[0.0, 0.0, 0.0], 0.3, [1.0 / 3.0; 3]),
            (&[1.0, f64::INFINITY, 0.0], 0.0, [1.0 / 3.0; 3]),
        ] {
            let mut counts = [0u32; 3];
            for i in 0..many {
                let u = (f64::from(i) + 0.5) / f64::from(many);
                let chosen = choose(guesses, evenly, u).unwrap();
                assert!((chosen.probability - expected[chosen.index]).abs() < 1e-12);
                counts[chosen.index] += 1;
            }
            for (count, expected) in counts.iter().zip(expected) {
                assert!((f64::from(*count) / f64::from(many) - expected).abs() < 2e-5);
            }
        }
        assert_eq!(choose(&[0.0; 3], 0.0, 0.5), None);
        // Rounding may exhaust the probabilities; the last possible choice is then taken.
        let last = choose(&[1.0, 2.0, 0.0], 0.0, 1.0).unwrap();
        assert_eq!(last.index, 1);
    }
}
