//! How a film's light is told apart: by the length of its paths, their bounces, their emitters (docs/theory.md#layers).

use crate::Bins;
use crate::mueller::STOKES_PARAMETERS;
use crate::sidebands::Sidebands;
use serde::{Deserialize, Serialize};

/// What a film asks about the path of a contribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathFacts {
    /// Optical length ∫n ds from the emitter to the sensor, in scene units. Where it starts:
    /// [`lead_in`](crate::path::lead_in).
    pub optical_length: f64,
    /// Scatterings and specular events on the path, crossings of index-matched boundaries not counted: the depth
    /// of the path less one.
    pub bounces: u32,
    /// Index of the emitter.
    pub emitter: usize,
}

/// The slot of a value: that of its bin, or their number below and one more above them all.
fn slot(bins: &Bins, value: f64) -> usize {
    match bins.index(value) {
        Some(bin) => bin,
        None if value < bins.min => bins.count,
        None => bins.count + 1,
    }
}

/// The ways in which a film's light is told apart: all combinations of those that are given. The default
/// keeps it together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Decomposition {
    /// Bins of optical length, [valid](Bins::is_valid) ones.
    pub length: Option<Bins>,
    /// Each number of bounces up to this one, which is at most [`MOST_BOUNCES`](Decomposition::MOST_BOUNCES).
    pub bounces: Option<u32>,
    /// Each of so many emitters: all of the scene, at least one.
    pub emitters: Option<usize>,
    /// Parts of each layer of light.
    #[serde(default)]
    pub parts: Option<LightParts>,
}

/// Quantities that estimators follow along paths besides light: parts of each layer of light, the first of which is the light itself.
/// Estimators that [blur](crate::integrator::Integrator::blurs) do not follow them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum LightParts {
    /// The Stokes parameters: see [`polarization`](crate::polarization).
    Stokes,
    /// Light, its carrier and sidebands, and correlations: see [`tagging`](crate::tagging).
    Sidebands(Sidebands),
}

impl LightParts {
    /// How many there are.
    pub fn count(&self) -> usize {
        match self {
            LightParts::Stokes => STOKES_PARAMETERS,
            LightParts::Sidebands(sidebands) => 1 + sidebands.parts(),
        }
    }

    /// Whether the values of a part have one sign.
    pub fn is_of_one_sign(&self, part: usize) -> bool {
        match self {
            LightParts::Stokes => part == 0,
            LightParts::Sidebands(sidebands) => part <= 1 + sidebands.orders() as usize,
        }
    }
}

/// One of the ways in which light is told apart: `regular` slots, and a few more for what fits in none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LayerAxis {
    /// Number of bins, of numbers of bounces, or of emitters.
    pub regular: usize,
    /// Slots after them: below and above the bins; more bounces than any.
    pub others: usize,
}

impl LayerAxis {
    /// All slots.
    pub fn slots(&self) -> usize {
        self.regular + self.others
    }
}

impl Decomposition {
    /// The most bounces that a film tells apart.
    pub const MOST_BOUNCES: u32 = 1000;

    /// Whether light is told apart at all.
    pub fn is_some(&self) -> bool {
        *self != Decomposition::default()
    }

    /// Its axes: length, bounces, emitters, parts; one regular slot for each that is not asked for.
    pub fn axes(&self) -> [LayerAxis; 4] {
        let axis = |regular, others| LayerAxis { regular, others };
        let whole = axis(1, 0);
        [
            self.length.map_or(whole, |bins| axis(bins.count, 2)),
            self.bounces.map_or(whole, |k| axis(k as usize + 1, 1)),
            self.emitters.map_or(whole, |n| axis(n, 0)),
            self.parts.map_or(whole, |parts| axis(parts.count(), 0)),
        ]
    }

    /// Number of layers: combinations of slots, the last axis varying fastest.
    pub fn layers(&self) -> usize {
        self.axes().iter().map(LayerAxis::slots).product()
    }

    /// The layer to which a path belongs, or the first of its parts, which follow one another.
    pub fn layer(&self, path: &PathFacts) -> usize {
        let [_, bounces, emitters, parts] = self.axes();
        let length = self
            .length
            .map_or(0, |bins| slot(&bins, path.optical_length));
        let bounce = self.bounces.map_or(0, |k| path.bounces.min(k + 1) as usize);
        let emitter = self.emitters.map_or(0, |_| path.emitter);
        let layer = (length * bounces.slots() + bounce) * emitters.slots() + emitter;
        layer * parts.slots()
    }

    /// The slot of a layer on each axis.
    pub fn slots(&self, layer: usize) -> [usize; 4] {
        let [_, bounces, emitters, parts] = self.axes().map(|a| a.slots());
        let (rest, part) = (layer / parts, layer % parts);
        [
            rest / emitters / bounces,
            rest / emitters % bounces,
            rest % emitters,
            part,
        ]
    }

    /// Panics unless it can tell apart the light of a scene with so many emitters.
    pub(crate) fn assert_fits(&self, emitters: usize) {
        if let Some(bins) = &self.length {
            assert!(
                bins.is_valid(),
                "bins of length need finite ends, min below max, and a count of at least 1, but they are {bins:?}"
            );
        }
        if let Some(bounces) = self.bounces {
            let most = Self::MOST_BOUNCES;
            assert!(
                bounces <= most,
                "a film tells at most {most} bounces apart, not {bounces}"
            );
        }
        if let Some(told) = self.emitters {
            assert!(
                told > 0 && told == emitters,
                "the film tells {told} emitters apart, but the scene has {emitters}"
            );
        }
    }

    /// Whether a layer is one of regular slots only.
    pub fn is_regular(&self, layer: usize) -> bool {
        let slots = self.slots(layer);
        self.axes().iter().zip(slots).all(|(a, s)| s < a.regular)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facts(optical_length: f64, bounces: u32, emitter: usize) -> PathFacts {
        PathFacts {
            optical_length,
            bounces,
            emitter,
        }
    }

    #[test]
    fn light_outside_of_the_bins_has_slots() {
        let bins = Bins {
            min: 1.0,
            max: 3.0,
            count: 4,
        };
        for (value, expected) in [
            (1.0, 0),
            (2.999, 3),
            (0.999, 4),
            (f64::NEG_INFINITY, 4),
            (3.001, 5),
            (f64::INFINITY, 5),
            (f64::NAN, 5),
        ] {
            assert_eq!(slot(&bins, value), expected, "{value}");
        }
    }

    #[test]
    fn every_combination_is_a_layer_of_its_own() {
        let all = Decomposition {
            length: Some(Bins {
                min: 0.0,
                max: 3.0,
                count: 3,
            }),
            bounces: Some(1),
            emitters: Some(2),
            parts: None,
        };
        assert_eq!(all.layers(), 5 * 3 * 2);
        let mut seen = Vec::new();
        for length in [0.5, 1.5, 2.5, -1.0, 9.0] {
            for bounces in [0, 1, 7] {
                for emitter in [0, 1] {
                    let layer = all.layer(&facts(length, bounces, emitter));
                    let regular = (0.0..3.0).contains(&length) && bounces <= 1;
                    assert_eq!(all.is_regular(layer), regular);
                    assert_eq!(all.slots(layer)[2], emitter);
                    seen.push(layer);
                }
            }
        }
        assert_eq!(seen, (0..30).collect::<Vec<_>>());
        let none = Decomposition::default();
        assert_eq!((none.layers(), none.layer(&facts(1.0, 3, 5))), (1, 0));
    }
}
