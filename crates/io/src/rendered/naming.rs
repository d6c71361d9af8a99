//! Layer names of films with separated light, for files and reports.

use crate::assemble::{Layering, Loaded};
use serde_json::{Value, json};
use transport::Film;
use transport::film::LightParts;

/// Minimum number of digits of bin numbers, so that alphabetical order is numerical order.
const MIN_DIGITS: usize = 4;

/// Data for naming layers.
#[derive(Clone, Copy, Debug)]
pub struct Naming<'a> {
    layering: &'a Layering,
    emitters: &'a [String],
}

impl<'a> Naming<'a> {
    /// Takes the names from the scene; `None` if its film does not separate light.
    pub fn of(loaded: &'a Loaded) -> Option<Self> {
        loaded.layering.decomposition.is_some().then_some(Naming {
            layering: &loaded.layering,
            emitters: &loaded.emitter_names,
        })
    }

    /// Returns the name of the first axis.
    fn length(&self) -> &'static str {
        match self.layering.speed_of_light {
            Some(_) => "time",
            None => "length",
        }
    }

    /// Returns the name of a layer, such as `length.0012.bounce.1.light.bulb`.
    fn name(&self, layer: usize) -> String {
        let decomposition = &self.layering.decomposition;
        let [length, bounce, emitter, part] = decomposition.slots(layer);
        let mut parts = Vec::new();
        if let Some(bins) = &decomposition.length {
            let slot = match length.checked_sub(bins.count) {
                None => format!("{length:0MIN_DIGITS$}"),
                Some(0) => "under".into(),
                Some(_) => "over".into(),
            };
            parts.push(format!("{}.{slot}", self.length()));
        }
        if let Some(most) = decomposition.bounces {
            parts.push(if bounce > most as usize {
                "bounce.over".into()
            } else {
                format!("bounce.{bounce}")
            });
        }
        if decomposition.emitters.is_some() {
            parts.push(format!("light.{}", self.emitters[emitter]));
        }
        if let Some(kind) = &decomposition.parts {
            parts.push(kind.part_name(part));
        }
        parts.join(".")
    }

    /// Returns the axes along which light is separated, in the order of arrays and names.
    pub fn axes(&self) -> Vec<Value> {
        let decomposition = &self.layering.decomposition;
        let mut axes = Vec::new();
        if let Some(bins) = self.layering.bins() {
            axes.push(json!({
                "name": self.length(),
                "min": bins.min,
                "max": bins.max,
                "width": bins.width(),
                "bins": bins.count,
                "speed_of_light": self.layering.speed_of_light,
            }));
        }
        if let Some(most) = decomposition.bounces {
            axes.push(json!({ "name": "bounce", "max": most }));
        }
        if decomposition.emitters.is_some() {
            axes.push(json!({ "name": "light", "emitters": self.emitters }));
        }
        if let Some(parts) = &decomposition.parts {
            axes.push(parts_axis(parts));
        }
        axes
    }

    /// Describes the axes in a few words, for people.
    pub fn describe(&self) -> String {
        let decomposition = &self.layering.decomposition;
        let length = self.layering.bins().map(|bins| {
            let max = bins.max;
            let name = self.length();
            format!("{} bins of {name} from {} to {max}", bins.count, bins.min)
        });
        let bounces = decomposition.bounces.map(|k| format!("0 to {k} bounces"));
        let lights = decomposition.emitters.map(|n| format!("{n} lights"));
        let parts = decomposition.parts.map(|parts| match parts {
            LightParts::Sidebands(of) => {
                format!("{} orders and {} delays", of.orders() + 1, of.delays())
            }
            parts => parts.facts().name.into(),
        });
        let parts = [length, bounces, lights, parts].into_iter().flatten();
        let parts: Vec<String> = parts.collect();
        parts.join(" × ")
    }

    fn layers(&self) -> std::ops::Range<usize> {
        0..self.layering.decomposition.layers()
    }

    /// Returns the names of all layers, in their order on the film.
    pub fn names(&self) -> impl Iterator<Item = String> + '_ {
        self.layers().map(|layer| self.name(layer))
    }

    /// Returns the layers of light within the bins.
    pub(super) fn regular(&self) -> impl Iterator<Item = usize> {
        let decomposition = &self.layering.decomposition;
        self.layers().filter(|&l| decomposition.is_regular(l))
    }

    /// Returns the lengths of the requested axes.
    pub(super) fn shape(&self) -> impl Iterator<Item = usize> {
        let decomposition = &self.layering.decomposition;
        let asked = [
            decomposition.length.is_some(),
            decomposition.bounces.is_some(),
            decomposition.emitters.is_some(),
            decomposition.parts.is_some(),
        ];
        let axes = decomposition.axes().into_iter().zip(asked);
        axes.filter(|(_, asked)| *asked)
            .map(|(axis, _)| axis.regular)
    }

    /// Returns true if a layer's samples have one sign, so that their effective number is
    /// meaningful. Correlations, and Stokes parameters after the first, may have either sign.
    pub fn is_of_one_sign(&self, layer: usize) -> bool {
        let [.., part] = self.layering.decomposition.slots(layer);
        let parts = self.layering.decomposition.parts;
        parts.is_none_or(|parts| parts.is_of_one_sign(part))
    }

    /// Returns true if a layer holds light, not a component of it such as a Stokes parameter.
    fn is_of_light(&self, layer: usize) -> bool {
        let [.., part] = self.layering.decomposition.slots(layer);
        part == 0
    }

    /// Returns the axes, and mean and standard error of each layer.
    pub fn json(&self, film: &Film) -> Value {
        let layer = |i| {
            let (mean, error) = film.layer_summary(i);
            json!({
                "name": self.name(i),
                "slots": self.layering.decomposition.slots(i),
                "mean": mean,
                "standard_error": finite(error),
                "few": self.is_of_one_sign(i).then(|| film.few_in_all(Some(i))),
                "few_pixels": self.is_of_one_sign(i).then(|| film.few_pixels(Some(i))),
            })
        };
        json!({
            "axes": self.axes(),
            "outside": self.outside(film),
            "layers": self.layers().map(layer).collect::<Vec<_>>(),
        })
    }

    /// Returns the fraction of the image's light outside the bins.
    pub fn outside(&self, film: &Film) -> f64 {
        let decomposition = &self.layering.decomposition;
        let outside = self.layers().filter(|&l| !decomposition.is_regular(l));
        let outside = outside.filter(|&l| self.is_of_light(l));
        let light: f64 = outside.map(|l| film.layer_summary(l).0).sum();
        match film.summary().0 {
            0.0 => 0.0,
            whole => light / whole,
        }
    }
}

fn parts_axis(parts: &LightParts) -> Value {
    match parts {
        LightParts::Sidebands(sidebands) => {
            let count = f64::from(sidebands.delays());
            let delays: Vec<f64> = (1..=sidebands.delays())
                .map(|i| 0.5 * f64::from(i) / count)
                .collect();
            json!({
                "name": "tagged",
                "orders": sidebands.orders(),
                "delays": delays,
            })
        }
        parts => {
            let names: Vec<String> = (0..parts.count())
                .map(|part| parts.part_name(part))
                .collect();
            json!({ "name": parts.facts().integrator, "parameters": names })
        }
    }
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}
