//! Separation of a film's light by the length, the bounces and the emitter of its paths
//! (docs/theory.md#layers).

use crate::Bins;
use crate::mueller::STOKES_PARAMETERS;
use crate::sidebands::Sidebands;
use serde::{Deserialize, Serialize};

/// Properties of a contribution's path that decide to which layers of a film the contribution
/// belongs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathFacts {
    /// Optical length ∫n ds from the emitter to the sensor, in scene units.
    /// [`lead_in`](crate::path::lead_in) defines its origin at each emitter.
    pub optical_length: f64,
    /// Number of scattering and specular events on the path, one less than the path's depth.
    /// Crossings of index-matched boundaries are not included.
    pub bounces: u32,
    /// Index of the emitter.
    pub emitter: usize,
}

/// Returns the slot of a value: the index of its bin, `bins.count` below the bins, and `bins.count`
/// + 1 above them.
fn slot(bins: &Bins, value: f64) -> usize {
    match bins.index(value) {
        Some(bin) => bin,
        None if value < bins.min => bins.count,
        None => bins.count + 1,
    }
}

/// Criteria that separate a film's light into layers: one layer for each combination of their
/// slots. The default keeps all light together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Decomposition {
    /// Bins of optical length, which must be [valid](Bins::is_valid).
    pub length: Option<Bins>,
    /// Largest number of bounces with a layer of its own, at most
    /// [`MAX_BOUNCES`](Decomposition::MAX_BOUNCES). Each smaller number has a layer, too.
    pub bounces: Option<u32>,
    /// Number of emitters, each with a layer of its own: all emitters of the scene, at least one.
    pub emitters: Option<usize>,
    /// Parts of each layer.
    #[serde(default)]
    pub parts: Option<LightParts>,
}

/// Quantities that estimators follow along paths besides light. Each quantity is a part of every
/// layer; the first part is the light itself. Estimators that
/// [blur](crate::integrator::Integrator::blurs) do not follow them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum LightParts {
    /// Stokes parameters: see [`polarization`](crate::polarization).
    Stokes,
    /// Light, its carrier and sidebands, and their correlations: see [`tagging`](crate::tagging).
    Sidebands(Sidebands),
}

/// Names that concern one kind of parts of light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PartsFacts {
    /// Name of the parts.
    pub name: &'static str,
    /// Name of the integrator that requests the parts.
    pub integrator: &'static str,
    /// Quantity of paths that the parts depend on.
    pub quantity: &'static str,
}

impl PartsFacts {
    /// Facts of [`LightParts::Stokes`].
    pub const STOKES: Self = PartsFacts {
        name: "Stokes parameters",
        integrator: "stokes",
        quantity: "polarisation",
    };
    /// Facts of [`LightParts::Sidebands`].
    pub const SIDEBANDS: Self = PartsFacts {
        name: "sidebands",
        integrator: "tagged",
        quantity: "phases",
    };
}

impl LightParts {
    /// Returns the names that concern the parts.
    pub fn facts(&self) -> PartsFacts {
        match self {
            LightParts::Stokes => PartsFacts::STOKES,
            LightParts::Sidebands(_) => PartsFacts::SIDEBANDS,
        }
    }

    /// Returns the name of a part, as it appears in names of layers.
    pub fn part_name(&self, part: usize) -> String {
        match self {
            LightParts::Stokes => format!("S{part}"),
            LightParts::Sidebands(sidebands) => {
                let orders = sidebands.orders() as usize;
                match part {
                    0 => "total".into(),
                    1 => "carrier".into(),
                    part if part <= 1 + orders => format!("sideband.{}", part - 1),
                    part => format!("delay.{}", part - 1 - orders),
                }
            }
        }
    }

    /// Returns the number of parts.
    pub fn count(&self) -> usize {
        match self {
            LightParts::Stokes => STOKES_PARAMETERS,
            LightParts::Sidebands(sidebands) => 1 + sidebands.parts(),
        }
    }

    /// Returns true if all values of a part have the same sign.
    pub fn is_of_one_sign(&self, part: usize) -> bool {
        match self {
            LightParts::Stokes => part == 0,
            LightParts::Sidebands(sidebands) => part <= 1 + sidebands.orders() as usize,
        }
    }
}

/// Axis along which light is separated: `regular` slots, and slots for light outside of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LayerAxis {
    /// Number of bins, of bounce counts, or of emitters.
    pub regular: usize,
    /// Number of slots after the regular slots: below and above the bins of length, or for more
    /// bounces.
    pub others: usize,
}

impl LayerAxis {
    /// Returns the total number of slots.
    pub fn slots(&self) -> usize {
        self.regular + self.others
    }
}

impl Decomposition {
    /// Largest number of bounces that a film separates.
    pub const MAX_BOUNCES: u32 = 1000;

    /// Returns true if the film separates light.
    pub fn is_some(&self) -> bool {
        *self != Decomposition::default()
    }

    /// Returns the axes: length, bounces, emitters, parts. An axis that was not requested has one
    /// regular slot.
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

    /// Returns the number of layers: all combinations of slots. The last axis varies fastest.
    pub fn layers(&self) -> usize {
        self.axes().iter().map(LayerAxis::slots).product()
    }

    /// Returns the layer of a path. Where layers have parts, the result is the first of consecutive
    /// parts.
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

    /// Returns the slot of a layer on each axis.
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

    /// Checks that the criteria are valid for a scene with `emitters` emitters; panics otherwise.
    pub(crate) fn assert_fits(&self, emitters: usize) {
        if let Some(bins) = &self.length {
            assert!(
                bins.is_valid(),
                "bins of length need finite ends, min below max, and a count of at least 1, but they are {bins:?}"
            );
        }
        if let Some(bounces) = self.bounces {
            let most = Self::MAX_BOUNCES;
            assert!(
                bounces <= most,
                "a film separates at most {most} bounces, not {bounces}"
            );
        }
        if let Some(told) = self.emitters {
            assert!(
                told > 0 && told == emitters,
                "the film separates {told} emitters, but the scene has {emitters}"
            );
        }
    }

    /// Returns true if all slots of a layer are regular.
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
