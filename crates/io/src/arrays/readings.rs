//! From what meters have read to arrays with units.

use super::{Array, ArrayPlacement, Arrays, Quality, records};
use crate::assemble::{Gruneisen, Instrument, Normalization};
use serde_json::Value;
use transport::meter::{Coordinates, Meter, Reading, RecordTable};
use transport::render::Measurement;

/// Ends of the names of the arrays with statistics of another array.
pub(super) const STATISTICS: [&str; 3] = [ERROR, EFFECTIVE, FEW];
const ERROR: &str = "_error";
const EFFECTIVE: &str = "_effective";
const FEW: &str = "_few";

/// A measurement and what it was made with.
#[derive(Clone, Copy, Debug)]
pub struct Context<'a> {
    /// Meters.
    pub instruments: &'a [Instrument],
    /// Their readings.
    pub measurement: &'a Measurement,
    /// Names of the channels.
    pub channels: &'a [String],
}

/// Everything that the meters have read: means and standard errors, effective numbers of particles and where these are too few, the edges of all bins, and where
/// grids lie. `attributes` are added to.
pub fn arrays(context: &Context, attributes: Vec<(String, Value)>) -> Arrays {
    let (mut main, mut placement) = (None, None);
    if let [instrument] = context.instruments {
        // What a fluence meter reads first, an irradiance meter in most detail.
        let readings = context.measurement.readings.first().map_or(0, Vec::len);
        let first = matches!(instrument.meter, Meter::Fluence(_));
        let reading = if first { 0 } else { readings.saturating_sub(1) };
        main = Some(BEFORE_READINGS + ARRAYS * reading);
        placement = self::placement(&instrument.meter);
    }
    Arrays {
        left_out: Vec::new(),
        list: list(context, &|_| true),
        main,
        placement,
        attributes: self::attributes(context, attributes),
    }
}

/// The arrays of a measurement. Only those whose names are `wanted` have elements.
pub fn list(context: &Context, wanted: &dyn Fn(&str) -> bool) -> Vec<Array> {
    let mut list = vec![emitted(context)];
    let scribes = scribes(context, wanted);
    for (scribe, records) in scribes.iter().zip(&context.measurement.records) {
        for reading in scribe.readings {
            list.extend(scribe.reading(reading));
        }
        if let Some(gruneisen) = &scribe.instrument.gruneisen {
            list.extend(scribe.pressure(&scribe.readings[Instrument::ABSORBED], gruneisen));
        }
        list.extend(scribe.axes());
        if let Some(table) = records {
            list.extend(scribe.records(table));
        }
    }
    list
}

/// Attributes of the arrays of a measurement, such as names of channels and regions, after those given.
pub fn attributes(context: &Context, mut attributes: Vec<(String, Value)>) -> Vec<(String, Value)> {
    attributes.push(("channels".into(), context.channels.join(" ").into()));
    let scribes = scribes(context, &|_| false);
    for (scribe, records) in scribes.iter().zip(&context.measurement.records) {
        let prefix = &scribe.prefix;
        if let Some(table) = records {
            attributes.extend(records::attributes(table, prefix));
        }
        let name = scribe.instrument.name.clone();
        attributes.push((format!("{prefix}few"), few(scribe.readings).into()));
        attributes.push((format!("{prefix}meter"), name.into()));
        attributes.push((
            format!("{prefix}normalization"),
            scribe.normalization().into(),
        ));
    }
    attributes
}

/// For each meter, what makes arrays of its readings.
fn scribes<'a>(context: &'a Context, wanted: &'a dyn Fn(&str) -> bool) -> Vec<Scribe<'a>> {
    let several = context.instruments.len() > 1;
    let measured = context
        .instruments
        .iter()
        .zip(&context.measurement.readings);
    let scribe = |(instrument, readings): (&'a Instrument, &'a Vec<Reading>)| {
        let mut axes = readings.iter().flat_map(|r| &r.axes);
        Scribe {
            context,
            instrument,
            readings,
            prefix: if several {
                format!("{}.", instrument.name)
            } else {
                String::new()
            },
            pulsed: axes.any(|axis| axis.name == "opl"),
            wanted,
        }
    };
    measured.map(scribe).collect()
}

/// Arrays before those of the first reading.
const BEFORE_READINGS: usize = 1;

/// Arrays for each reading.
const ARRAYS: usize = 4;

/// For each reading, the share of its bins with light whose errors are not to be trusted.
fn few(readings: &[Reading]) -> String {
    let share = |r: &Reading| format!("{} {:.4}", r.name, Quality::of(r).few_share());
    readings.iter().map(share).collect::<Vec<_>>().join(", ")
}

/// Name of the array that all measurements have: the power of all emitters.
pub(super) const EMITTED: &str = "emitted";

/// Power of all emitters, per channel.
fn emitted(context: &Context) -> Array {
    let power = &context.measurement.emitted;
    Array {
        name: EMITTED.into(),
        axes: vec!["channel".into()],
        shape: vec![power.len()],
        unit: "W".into(),
        data: power.clone(),
    }
}

/// Turns the readings of one meter into arrays.
struct Scribe<'a> {
    context: &'a Context<'a>,
    instrument: &'a Instrument,
    readings: &'a [Reading],
    /// Name of the meter, with a dot, if there are several.
    prefix: String,
    /// Whether light is told apart by its optical length: emitters are pulses then, of an energy.
    pulsed: bool,
    /// Chooses the arrays of readings that get elements, by their names.
    wanted: &'a dyn Fn(&str) -> bool,
}

impl Scribe<'_> {
    fn normalization(&self) -> &'static str {
        match (self.instrument.normalization, self.pulsed) {
            (Normalization::Absolute, _) => "absolute",
            (Normalization::PerWatt, false) => "per_watt",
            (Normalization::PerWatt, true) => "per_joule",
        }
    }

    /// Mean and standard error of a reading, effective numbers of particles, and where these are too few.
    fn reading(&self, reading: &Reading) -> [Array; ARRAYS] {
        let power = self.unit();
        let unit = match &*reading.name {
            "fluence" | "irradiance" | "fluence_sidebands" | "fluence_correlation" => {
                format!("{power}/unit^2")
            }
            "absorbed" => format!("{power}/unit^3"),
            "optical_moment" => format!("{power}*unit"),
            _ => power.to_owned(),
        };
        let per_watt = self.instrument.normalization == Normalization::PerWatt;
        self.all(reading, [&reading.name, &unit], per_watt, |c| self.scale(c))
    }

    /// What readings of power are multiplied by in a channel.
    fn scale(&self, channel: usize) -> f64 {
        match self.instrument.normalization {
            Normalization::Absolute => 1.0,
            Normalization::PerWatt => reciprocal(self.context.measurement.emitted[channel]),
        }
    }

    /// Standard error of the emitted power of a channel, relative to the power.
    fn relative_power_error(&self, channel: usize) -> f64 {
        let measurement = self.context.measurement;
        measurement.emitted_error[channel] * reciprocal(measurement.emitted[channel])
    }

    /// Unit of power.
    fn unit(&self) -> &'static str {
        match (self.instrument.normalization, self.pulsed) {
            (Normalization::PerWatt, _) => "1",
            (_, true) => "J",
            (_, false) => "W",
        }
    }

    /// Records of detected light.
    fn records(&self, table: &RecordTable) -> Vec<Array> {
        let channels = self.context.channels.len();
        let scaled = |values: &[f64]| -> Vec<f64> {
            let values = values.iter().enumerate();
            values.map(|(i, v)| v * self.scale(i % channels)).collect()
        };
        let powers = [&table.weight, &table.stokes].map(|values| scaled(values));
        let layout = records::Layout {
            prefix: &self.prefix,
            channels,
            power: self.unit(),
        };
        layout.arrays(table, powers)
    }

    /// Initial pressure p₀ = Γ μ_a Φ, with the fluence Φ of a short pulse, and what goes with it.
    fn pressure(&self, absorbed: &Reading, gruneisen: &Gruneisen) -> [Array; ARRAYS] {
        let emitted = &self.context.measurement.emitted;
        let factor = gruneisen.factor();
        let scale = |c: usize| factor * reciprocal(emitted[c]);
        self.all(absorbed, ["p0", "Pa"], true, scale)
    }

    /// Arrays of a reading times a scale. The error of the emitted power adds to the errors of readings `per_emitted` power.
    fn all(
        &self,
        reading: &Reading,
        [name, unit]: [&str; 2],
        per_emitted: bool,
        scale: impl Fn(usize) -> f64,
    ) -> [Array; ARRAYS] {
        let channels = self.context.channels.len();
        let mut axes: Vec<String> = reading
            .axes
            .iter()
            .map(|axis| axis.name.to_string())
            .collect();
        let mut shape: Vec<usize> = reading.axes.iter().map(|axis| axis.len()).collect();
        if channels > 1 {
            axes.push("channel".into());
            shape.push(channels);
        }
        let array = |suffix: &str, unit: &str, data: &dyn Fn() -> Vec<f64>| {
            let name = format!("{}{name}{suffix}", self.prefix);
            Array {
                data: if (self.wanted)(&name) {
                    data()
                } else {
                    Vec::new()
                },
                name,
                axes: axes.clone(),
                shape: shape.clone(),
                unit: unit.into(),
            }
        };
        let power_error = |c: usize| {
            if per_emitted {
                self.relative_power_error(c)
            } else {
                0.0
            }
        };
        let mean = |i: usize, mean: f64| mean * scale(i % channels);
        let error = |i: usize, error: f64| {
            let channel = i % channels;
            error.hypot(reading.mean[i] * power_error(channel)) * scale(channel)
        };
        let few = |_, few: bool| f64::from(u8::from(few));
        [
            array("", unit, &|| reading.mean.dense(mean)),
            array(ERROR, unit, &|| reading.error.dense(error)),
            array(EFFECTIVE, "", &|| reading.effective.dense(|_, n| n)),
            array(FEW, "", &|| reading.few.dense(few)),
        ]
    }

    /// The edges of the bins of all axes, and where a grid lies.
    fn axes(&self) -> Vec<Array> {
        let mut list: Vec<Array> = Vec::new();
        for axis in self.readings.iter().flat_map(|r| &r.axes) {
            let name = format!("{}{}_edges", self.prefix, axis.name);
            if axis.name == "side" || axis.name == "part" || list.iter().any(|a| a.name == name) {
                continue;
            }
            let length = ["x", "y", "z", "r", "opl"].contains(&&*axis.name);
            // Radii of a disk are relative to its own.
            let length = length && !matches!(self.instrument.meter, Meter::Irradiance(_))
                || axis.name == "opl";
            list.push(Array {
                name,
                axes: vec![axis.name.to_string()],
                shape: vec![axis.edges.len()],
                unit: if length { "unit".into() } else { String::new() },
                data: axis.edges.clone(),
            });
        }
        if let Meter::Fluence(meter) = &self.instrument.meter {
            let map = meter.grid.to_world();
            let columns = [
                map.matrix3.x_axis,
                map.matrix3.y_axis,
                map.matrix3.z_axis,
                map.translation,
            ];
            list.push(Array {
                name: format!("{}to_world", self.prefix),
                axes: vec!["row".into(), "column".into()],
                shape: vec![3, 4],
                unit: "unit".into(),
                data: (0..3).flat_map(|row| columns.map(|c| c[row])).collect(),
            });
        }
        list
    }
}

/// 1/x; 0 for a channel without light.
fn reciprocal(x: f64) -> f64 {
    if x > 0.0 { x.recip() } else { 0.0 }
}

/// Where the cells of a Cartesian grid lie.
fn placement(meter: &Meter) -> Option<ArrayPlacement> {
    let Meter::Fluence(meter) = meter else {
        return None;
    };
    let grid = &meter.grid;
    let step = |i: usize| (grid.to_world().matrix3.col(i) / grid.size()[i] as f64).to_array();
    (grid.coordinates() == Coordinates::Cartesian).then(|| ArrayPlacement {
        steps: ["x", "y", "z"]
            .iter()
            .enumerate()
            .map(|(i, name)| ((*name).to_owned(), step(i)))
            .collect(),
        origin: grid.middle(0).to_array(),
    })
}
