//! Reports on a measurement: as text, in file attributes, and as JSON.

use crate::balance;
use crate::load::file_name;
use crate::numbers;
use crate::report::Report;
use io::arrays::Quality;
use io::clock::Stopped;
use io::diagnostic::escaped;
use io::report;
use serde_json::{Value, json};
use transport::meter::{Reading, RecordTable};
use transport::render::Measurement;

/// Describes the statistical quality of a reading's bins in a few words.
fn text(quality: &Quality) -> String {
    let empty = match quality.empty {
        0 => String::new(),
        n if n == quality.bins => ", no light".into(),
        n => format!(
            ", {} without light",
            numbers::percent(n as f64 / quality.bins as f64)
        ),
    };
    let bins = match quality.bins {
        1 => "1 bin".into(),
        n => format!("{} bins", numbers::count(n as f64)),
    };
    let error = quality.error.map_or(String::new(), |e| {
        format!(", median error {}", numbers::percent(e))
    });
    let few = match quality.few {
        0 => String::new(),
        _ => format!(
            ", {} from too few particles to trust their errors",
            numbers::percent(quality.few_share())
        ),
    };
    format!("{bins}{empty}{error}{few}")
}

impl Report<'_, Measurement> {
    fn rate(&self) -> f64 {
        let particles = self.result.stats.paths as f64;
        particles / self.elapsed.as_secs_f64().max(1e-9)
    }

    /// Returns the names of meters that received no light.
    pub fn dark(&self) -> impl Iterator<Item = &str> {
        self.meters()
            .filter(|(_, readings)| {
                readings
                    .iter()
                    .all(|r| r.mean.written(0..r.mean.len()).all(|(_, mean)| mean == 0.0))
            })
            .map(|(name, _)| name)
    }

    fn meters(&self) -> impl Iterator<Item = (&str, &Vec<Reading>)> {
        let names = self.run.loaded.instruments.iter().map(|i| i.name.as_str());
        names.zip(&self.result.readings)
    }

    /// Describes how many records were kept.
    fn recorded(&self, table: &RecordTable) -> String {
        let count = numbers::count(table.particle.len() as f64);
        let particles = numbers::count(table.particles as f64);
        if table.particles == self.result.particles {
            return format!("{count} records");
        }
        format!("{count} records, from {particles} of the particles: raise max_records for more")
    }

    /// Returns the lines at the end of a measurement: the work, each meter's readings, and the
    /// energy balance.
    pub fn text(&self) -> String {
        let stopped = match self.stopped {
            Some(Stopped::Interrupted) => "interrupted: ",
            _ => "",
        };
        let device = match self.run.device_name() {
            "cpu" => String::new(),
            name => format!(" on {}", escaped(name)),
        };
        let mut lines = vec![format!(
            "{stopped}{} · {} particles · {} particles/s{device}",
            numbers::duration(self.elapsed),
            numbers::count(self.result.particles as f64),
            numbers::count(self.rate()),
        )];
        for ((name, readings), records) in self.meters().zip(&self.result.records) {
            let each = readings
                .iter()
                .map(|r| format!("{} ({})", r.name, text(&Quality::of(r))));
            let all: Vec<String> = each
                .chain(records.as_ref().map(|table| self.recorded(table)))
                .collect();
            lines.push(format!("{name}: {}", all.join("; ")));
        }
        lines.push(balance::text(&self.result.balance));
        let stats = &self.result.stats;
        for (count, what) in [
            (stats.lost, "rays lost"),
            (stats.not_finite, "scores not finite"),
        ] {
            if count > 0 {
                lines.push(format!("{} {what}", numbers::count(count as f64)));
            }
        }
        lines.extend(report::possible_bias(stats));
        lines.join("\n")
    }

    /// Returns attributes for files. They depend on the computation, not on its time, place or
    /// speed.
    pub fn attributes(&self) -> Vec<(String, Value)> {
        let stats = &self.result.stats;
        let pairs = [
            ("scene", file_name(&self.job.scene).into()),
            ("scene_hash", self.run.loaded.hash.to_string().into()),
            ("morgana_version", env!("CARGO_PKG_VERSION").into()),
            ("seed", self.job.seed.into()),
            ("particles", self.result.particles.into()),
            ("options", self.job.command_line().into()),
            ("balance", report::balance(&self.result.balance)),
            ("lost", stats.lost.into()),
            ("over_budget", report::over_budget(stats)),
            ("not_finite", stats.not_finite.into()),
        ];
        pairs.map(|(name, value)| (name.to_owned(), value)).into()
    }

    /// Returns the whole report as JSON.
    pub fn json(&self) -> Value {
        let measurement = self.result;
        let reading = |r: &Reading| Quality::of(r).json(&r.name);
        let meter = |((name, readings), records): ((&str, &Vec<Reading>), &Option<RecordTable>)| {
            let readings: Vec<Value> = readings.iter().map(reading).collect();
            json!({"name": name, "readings": readings, "records": records.as_ref().map(report::records)})
        };
        json!({
            "version": env!("CARGO_PKG_VERSION"),
            "scene": file_name(&self.job.scene),
            "scene_hash": self.run.loaded.hash.to_string(),
            "options": self.job.command_line(),
            "seed": self.job.seed,
            "particles": measurement.particles,
            "stopped": self.stopped.map(Stopped::name),
            "threads": self.threads,
            "device": self.run.device_name(),
            "seconds": self.elapsed.as_secs_f64(),
            "particles_per_second": self.rate(),
            "channels": self.run.loaded.channel_names,
            "emitted": measurement.emitted,
            "emitted_error": measurement.emitted_error,
            "balance": report::balance(&measurement.balance),
            "meters": self.meters().zip(&measurement.records).map(meter).collect::<Vec<_>>(),
            "counters": report::counters(&measurement.stats),
        })
    }
}
