//! Conversion of meter readings to arrays with units.

use super::{Array, Arrays, Quality, records};
use crate::assemble::{Gruneisen, Instrument, Normalization};
use serde_json::Value;
use transport::meter::{Meter, Reading, RecordTable};
use transport::render::Measurement;

/// Name endings of arrays that hold statistics of another array.
pub(super) const STATISTICS: [&str; 3] = [ERROR, EFFECTIVE, FEW];
pub(super) const ERROR: &str = "_error";
const EFFECTIVE: &str = "_effective";
const FEW: &str = "_few";

/// Axes of numbered items, which have no edges.
pub const NUMBERED: [&str; 3] = ["side", "part", "frequency"];

/// Name of the array with the frequencies of modulated light.
pub const FREQUENCIES: &str = "modulation_frequencies";

/// Name of the attribute with the length of a scene unit in m.
pub(super) const METRES: &str = "metres_per_unit";

/// Returns the name of the standard errors of an array.
pub(super) fn error_of(name: &str) -> String {
    format!("{name}{ERROR}")
}

/// A measurement, with its meters and the names of its channels.
#[derive(Clone, Copy, Debug)]
pub struct Context<'a> {
    /// Meters.
    pub instruments: &'a [Instrument],
    /// Readings of the meters.
    pub measurement: &'a Measurement,
    /// Names of the channels.
    pub channels: &'a [String],
    /// Number of the meter whose readings are wanted; `None` for all meters.
    pub meter: Option<usize>,
}

/// Meter, with its readings and its records.
type Measured<'a> = (&'a Instrument, &'a Vec<Reading>, &'a Option<RecordTable>);

impl<'a> Context<'a> {
    /// Returns the wanted meters.
    fn meters(&self) -> impl Iterator<Item = Measured<'a>> + use<'a> {
        let (meter, measurement) = (self.meter, self.measurement);
        let measured = measurement.readings.iter().zip(&measurement.records);
        (self.instruments.iter().zip(measured).enumerate())
            .filter(move |(i, _)| meter.is_none_or(|wanted| wanted == *i))
            .map(|(_, (instrument, (readings, records)))| (instrument, readings, records))
    }
}

/// Returns all readings: means and standard errors, effective numbers of particles, flags where
/// these numbers are too low, the edges of all bins, and the positions of grids. Adds to
/// `attributes`.
pub fn arrays(context: &Context, attributes: Vec<(String, Value)>) -> Arrays {
    // Choose the first reading of a fluence meter, and the most detailed (last) reading of an
    // irradiance meter.
    let main = |(instrument, readings, _): Measured| {
        let first = matches!(instrument.meter, Meter::Fluence(_));
        let last = readings.len().saturating_sub(1);
        BEFORE_READINGS + ARRAYS * if first { 0 } else { last }
    };
    let mut meters = context.meters();
    let only = meters.next().filter(|_| meters.next().is_none());
    Arrays {
        left_out: Vec::new(),
        list: list(context, &|_| true),
        main: only.map(main),
        attributes: self::attributes(context, attributes),
    }
}

/// Returns the arrays of a measurement. Only arrays whose names are `wanted` have elements.
pub fn list(context: &Context, wanted: &dyn Fn(&str) -> bool) -> Vec<Array> {
    let mut list = vec![emitted(context)];
    for scribe in scribes(context, wanted) {
        for reading in scribe.readings {
            list.extend(scribe.reading(reading));
        }
        if let Some(gruneisen) = &scribe.instrument.gruneisen {
            list.extend(scribe.pressure(&scribe.readings[Instrument::ABSORBED], gruneisen));
        }
        list.extend(scribe.axes());
        if let Some(table) = scribe.records {
            list.extend(scribe.record_arrays(table));
        }
    }
    list
}

/// Returns the attributes of a measurement's arrays, such as names of channels and regions, after
/// the given attributes.
pub fn attributes(context: &Context, mut attributes: Vec<(String, Value)>) -> Vec<(String, Value)> {
    attributes.push(("channels".into(), context.channels.join(" ").into()));
    for scribe in scribes(context, &|_| false) {
        let prefix = &scribe.prefix;
        if let Some(metres) = scribe.instrument.metres_per_unit {
            attributes.push((format!("{prefix}{METRES}"), metres.into()));
        }
        if let Some(table) = scribe.records {
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

/// Returns a converter for the readings of each meter.
fn scribes<'a>(context: &'a Context, wanted: &'a dyn Fn(&str) -> bool) -> Vec<Scribe<'a>> {
    let several = context.meters().nth(1).is_some();
    let scribe = |(instrument, readings, records): Measured<'a>| {
        let mut axes = readings.iter().flat_map(|r| &r.axes);
        Scribe {
            context,
            instrument,
            readings,
            records,
            prefix: if several {
                format!("{}.", instrument.name)
            } else {
                String::new()
            },
            pulsed: axes.any(|axis| axis.name == "opl"),
            wanted,
        }
    };
    context.meters().map(scribe).collect()
}

/// Number of arrays before the arrays of the first reading.
const BEFORE_READINGS: usize = 1;

/// Number of arrays per reading.
const ARRAYS: usize = 4;

/// Lists for each reading the fraction of bins with unreliable errors, among the bins with light.
fn few(readings: &[Reading]) -> String {
    let share = |r: &Reading| format!("{} {:.4}", r.name, Quality::of(r).few_share());
    readings.iter().map(share).collect::<Vec<_>>().join(", ")
}

/// Name of the array that every measurement has: the power of all emitters.
pub(super) const EMITTED: &str = "emitted";

/// Returns the power of all emitters, per channel.
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

/// Returns true if a reading is a phase, which does not depend on the power of the emitters.
pub fn is_phase(name: &str) -> bool {
    ["fluence_phase", "power_phase"].contains(&name)
}

/// Converts the readings of a meter to arrays.
struct Scribe<'a> {
    context: &'a Context<'a>,
    instrument: &'a Instrument,
    readings: &'a [Reading],
    records: &'a Option<RecordTable>,
    /// Name of the meter and a dot, if there are several meters; otherwise empty.
    prefix: String,
    /// True if the meter separates light by optical length. Emitters are then pulses with an
    /// energy.
    pulsed: bool,
    /// Selects by name the arrays of readings that get elements.
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

    /// Returns mean and standard error of a reading, effective numbers of particles, and flags
    /// where these numbers are too low.
    fn reading(&self, reading: &Reading) -> [Array; ARRAYS] {
        let power = self.unit();
        let unit = match &*reading.name {
            name if is_phase(name) => "rad".into(),
            "irradiance" => format!("{power}/unit^2"),
            name if name.starts_with("fluence") => format!("{power}/unit^2"),
            "absorbed" => format!("{power}/unit^3"),
            "optical_moment" => format!("{power}*unit"),
            _ => power.to_owned(),
        };
        let per_watt = self.instrument.normalization == Normalization::PerWatt;
        let has_power = !is_phase(&reading.name);
        let scale = |c| if has_power { self.scale(c) } else { 1.0 };
        self.all(
            reading,
            [&reading.name, &unit],
            per_watt && has_power,
            scale,
        )
    }

    /// Returns the factor for power readings in a channel.
    fn scale(&self, channel: usize) -> f64 {
        match self.instrument.normalization {
            Normalization::Absolute => 1.0,
            Normalization::PerWatt => reciprocal(self.context.measurement.emitted[channel]),
        }
    }

    /// Returns the standard error of a channel's emitted power, relative to the power.
    fn relative_power_error(&self, channel: usize) -> f64 {
        let measurement = self.context.measurement;
        measurement.emitted_error[channel] * reciprocal(measurement.emitted[channel])
    }

    /// Returns the unit of power.
    fn unit(&self) -> &'static str {
        match (self.instrument.normalization, self.pulsed) {
            (Normalization::PerWatt, _) => "1",
            (_, true) => "J",
            (_, false) => "W",
        }
    }

    /// Returns the records of detected light.
    fn record_arrays(&self, table: &RecordTable) -> Vec<Array> {
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

    /// Returns the initial pressure p₀ = Γ μ_a Φ, with the fluence Φ of a short pulse, and its
    /// statistics.
    fn pressure(&self, absorbed: &Reading, gruneisen: &Gruneisen) -> [Array; ARRAYS] {
        let emitted = &self.context.measurement.emitted;
        let factor = gruneisen.factor();
        let scale = |c: usize| factor * reciprocal(emitted[c]);
        self.all(absorbed, ["p0", "Pa"], true, scale)
    }

    /// Returns the arrays of a reading times a scale. For readings `per_emitted` power, the error
    /// of the emitted power adds to the errors.
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

    /// Returns the bin edges of all axes, and the position of a grid.
    fn axes(&self) -> Vec<Array> {
        let mut list: Vec<Array> = Vec::new();
        for axis in self.readings.iter().flat_map(|r| &r.axes) {
            let name = format!("{}{}_edges", self.prefix, axis.name);
            if NUMBERED.contains(&&*axis.name) || list.iter().any(|a| a.name == name) {
                continue;
            }
            let length = ["x", "y", "z", "r", "opl"].contains(&&*axis.name);
            // Radii of a disc are relative to its own radius.
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
        if let Some(domain) = self.instrument.meter.frequency_domain() {
            list.push(Array {
                name: format!("{}{FREQUENCIES}", self.prefix),
                axes: vec!["frequency".into()],
                shape: vec![domain.hertz().len()],
                unit: "Hz".into(),
                data: domain.hertz().to_vec(),
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

/// Returns 1/x, or 0 for a channel without light.
fn reciprocal(x: f64) -> f64 {
    if x > 0.0 { x.recip() } else { 0.0 }
}
