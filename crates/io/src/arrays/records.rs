//! Arrays of records of detected light.

use super::Array;
use serde_json::{Value, json};
use transport::meter::RecordTable;
use transport::mueller::STOKES_PARAMETERS;

/// Names and units of a table's arrays.
#[derive(Clone, Copy)]
pub(super) struct Layout<'a> {
    pub prefix: &'a str,
    pub channels: usize,
    /// Unit of power.
    pub power: &'static str,
}

/// Returns attributes: the regions that records distinguish, and the number of particles whose
/// records are kept, including particles without records.
pub(super) fn attributes(table: &RecordTable, prefix: &str) -> [(String, Value); 2] {
    let names: Vec<&str> = table.regions.iter().map(|r| &*r.name).collect();
    [
        (format!("{prefix}regions"), json!(names)),
        (format!("{prefix}record_particles"), json!(table.particles)),
    ]
}

impl Layout<'_> {
    /// Returns the columns of a table, given its weights and Stokes parameters in their unit.
    pub(super) fn arrays(
        &self,
        table: &RecordTable,
        [weights, stokes]: [Vec<f64>; 2],
    ) -> Vec<Array> {
        let (channels, regions) = (self.channels, table.regions.len());
        let [xyz, region] = [("xyz", 3), ("region", regions)].map(Some);
        let channel = (channels > 1).then_some(("channel", channels));
        let rows = ("record", table.particle.len());
        let column = |name: &str, axis, unit: &str, data: Vec<f64>| {
            self.array(name, &[Some(rows), axis], unit, data)
        };
        let particles = table.particle.iter().map(|number| *number as f64);
        let absorption = table.regions.iter().flat_map(|region| {
            let known = region.absorption.clone();
            known.unwrap_or_else(|| vec![f64::NAN; channels])
        });
        let mut all = vec![
            column("record_particle", None, "", particles.collect()),
            column("record_weight", channel, self.power, weights),
            column("record_position", xyz, "unit", table.position.clone()),
            column("record_direction", xyz, "", table.direction.clone()),
            column(
                "record_optical_length",
                None,
                "unit",
                table.optical_length.clone(),
            ),
            column("record_side", None, "", table.side.clone()),
            column(
                "record_path_length",
                region,
                "unit",
                table.path_length.clone(),
            ),
            column("record_scatterings", region, "", table.scatterings.clone()),
            column(
                "record_momentum_transfer",
                region,
                "",
                table.momentum_transfer.clone(),
            ),
            self.array(
                "region_mu_a",
                &[region, channel],
                "1/unit",
                absorption.collect(),
            ),
        ];
        let modulations = [
            ("record_index_modulation", &table.index_modulation),
            (
                "record_displacement_modulation",
                &table.displacement_modulation,
            ),
        ];
        for (name, data) in modulations {
            if data.len() == 2 * table.particle.len() {
                all.push(column(name, Some(("part", 2)), "unit", data.clone()));
            }
        }
        if table.optical_length_rate.len() == table.particle.len() {
            let rate = table.optical_length_rate.clone();
            all.push(column("record_optical_length_rate", None, "unit/s", rate));
            let changes = table.regions.iter().map(|region| region.velocity_change);
            all.push(self.array(
                "region_velocity_change",
                &[region],
                "1/s",
                changes.collect(),
            ));
        }
        if !table.stokes.is_empty() {
            let parameters = Some(("stokes", STOKES_PARAMETERS));
            let axes = [Some(rows), parameters, channel];
            all.push(self.array("record_stokes", &axes, self.power, stokes));
        }
        all
    }

    fn array(
        &self,
        name: &str,
        axes: &[Option<(&str, usize)>],
        unit: &str,
        data: Vec<f64>,
    ) -> Array {
        let axes = axes.iter().flatten();
        Array {
            name: format!("{}{name}", self.prefix),
            axes: axes.clone().map(|(axis, _)| (*axis).to_owned()).collect(),
            shape: axes.map(|(_, count)| *count).collect(),
            unit: unit.to_owned(),
            data,
        }
    }
}
