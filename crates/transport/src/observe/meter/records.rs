//! Records of detected light. The record of an accepted particle holds its power, its position and
//! direction at the meter, and its history (docs/theory.md#records).
//!
//! If there are more records than there is room for, only the records of every second particle are
//! kept, or of every fourth, and so on. The selection depends only on the numbers of the particles.
//! Merged parts of a run therefore have equal records to one whole run.

use super::flight::Passing;
use super::history::RegionHistory;
use crate::Spectrum;
use crate::medium::Velocity;
use crate::mueller::STOKES_PARAMETERS;
use crate::sampling::in_fraction;
use crate::scene::Scene;
use crate::tagging::PathModulation;
use serde::{Deserialize, Serialize};

/// Region that records distinguish: a medium, or one of its labels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordRegion {
    /// Name of the region.
    pub name: String,
    /// Absorption coefficient μ_a, by channel, if it is uniform.
    pub absorption: Option<Vec<f64>>,
    /// Maximum relative rate of change of the flow's velocity, per second ([`Velocity::change`]).
    pub velocity_change: f64,
}

impl RecordRegion {
    /// Returns the regions of a scene with `channels` channels.
    pub(crate) fn of(scene: &Scene, channels: usize) -> Vec<Self> {
        let region =
            |name: &str, absorption: Option<Spectrum>, flow: &Option<Velocity>| RecordRegion {
                name: name.to_owned(),
                absorption: absorption.map(|a| a.0[..channels].to_vec()),
                velocity_change: flow.as_ref().map_or(0.0, Velocity::change),
            };
        let mut all = Vec::new();
        for medium in scene.media() {
            match &medium.labels {
                None => {
                    let absorption = medium.uniform_absorption();
                    all.push(region(&medium.name, absorption, &medium.velocity));
                }
                Some(labels) => {
                    let each = labels.list().iter();
                    all.extend(each.map(|l| region(&l.name, Some(l.absorption), &l.velocity)));
                }
            }
        }
        all
    }
}

/// Layout of a table of records.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct RecordLayout {
    pub channels: usize,
    pub regions: usize,
    /// True if records hold the effect of sound on the optical length.
    pub tagged: bool,
    /// True if records hold the effect of flow on the optical length.
    pub flows: bool,
    /// True if records hold Stokes parameters.
    #[serde(default)]
    pub stokes: bool,
}

/// Number of values for position, direction, optical path length and side.
const FIXED: usize = 8;
/// Number of values per region: length, scatterings and momentum transfer.
const PER_REGION: usize = 3;
/// Number of values for two complex amplitudes.
const TAGGED: usize = 4;

impl RecordLayout {
    fn width(self) -> usize {
        let tagged = if self.tagged { TAGGED } else { 0 };
        let flows = usize::from(self.flows);
        self.channels + FIXED + PER_REGION * self.regions + tagged + flows + self.stokes()
    }

    /// Returns the number of Stokes parameters of all channels.
    fn stokes(self) -> usize {
        if self.stokes {
            STOKES_PARAMETERS * self.channels
        } else {
            0
        }
    }

    /// Returns the bytes of `records` records.
    pub(crate) fn memory(self, records: usize) -> usize {
        records.saturating_mul((self.width() + 1) * size_of::<f64>())
    }
}

/// Rows of records, each with the number of its particle.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct RecordRows {
    particles: Vec<u64>,
    values: Vec<f64>,
}

impl RecordRows {
    /// Adds the record of light that a meter has accepted. Side 0 is the side to which the
    /// surface's normal points.
    pub(super) fn push(&mut self, detected: &Detected) {
        let Detected {
            passing, history, ..
        } = *detected;
        self.particles.push(detected.particle);
        self.values.extend(&passing.power.0[..detected.channels]);
        self.values.extend(passing.hit.position.to_array());
        self.values.extend(passing.direction.to_array());
        self.values
            // Planted error "records of optical lengths with an absolute error", found by morgana-io/io::units::records_in_any_unit:
            // .extend([passing.optical_length + 1e-9, detected.side as f64]);
            .extend([passing.optical_length, detected.side as f64]);
        self.values
            .extend(history.iter().map(|region| region.length));
        self.values
            .extend(history.iter().map(|region| region.scatterings));
        self.values
            .extend(history.iter().map(|region| region.momentum_transfer));
        if let Some(PathModulation {
            index,
            displacement,
        }) = detected.modulation
        {
            self.values
                .extend([index.x, index.y, displacement.x, displacement.y]);
        }
        self.values.extend(detected.optical_length_rate);
        for parameter in detected.stokes.iter().flatten() {
            let power = passing.power * *parameter;
            self.values.extend(&power.0[..detected.channels]);
        }
    }

    /// Adds the rows of `width` values for which `wanted` accepts the particle's number.
    fn append(&mut self, other: &RecordRows, width: usize, wanted: impl Fn(u64) -> bool) {
        for (particle, row) in other.particles.iter().zip(other.values.chunks_exact(width)) {
            if wanted(*particle) {
                self.particles.push(*particle);
                self.values.extend(row);
            }
        }
    }

    /// Keeps only the rows of `width` values for which `wanted` accepts the particle's number.
    fn retain(&mut self, width: usize, wanted: impl Fn(u64) -> bool) {
        let mut kept = 0;
        for row in 0..self.particles.len() {
            if wanted(self.particles[row]) {
                self.particles[kept] = self.particles[row];
                self.values
                    .copy_within(row * width..(row + 1) * width, kept * width);
                kept += 1;
            }
        }
        self.particles.truncate(kept);
        self.values.truncate(kept * width);
    }
}

/// Light that a meter has accepted.
#[derive(Clone, Copy)]
pub(super) struct Detected<'a> {
    /// Number of the particle.
    pub particle: u64,
    /// Position, direction and power at the surface.
    pub passing: &'a Passing<'a>,
    /// Side of the surface to which the particle travels.
    pub side: usize,
    /// History of the particle's path, by region.
    pub history: &'a [RegionHistory],
    /// Rate of change of the path's optical length by flow, if records hold it.
    pub optical_length_rate: Option<f64>,
    /// Number of channels.
    pub channels: usize,
    /// Effect of sound on the path's optical length, if records hold it.
    pub modulation: Option<PathModulation>,
    /// Stokes parameters per unit of power, if records hold them.
    pub stokes: Option<[Spectrum; 4]>,
}

/// Records of one meter, at most `most`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Records {
    layout: RecordLayout,
    most: usize,
    /// Number of halvings: records of a fraction 2^−`halvings` of all particles are kept.
    halvings: u32,
    rows: RecordRows,
}

impl Records {
    pub(crate) fn new(layout: RecordLayout, most: usize) -> Self {
        Records {
            layout,
            most,
            halvings: 0,
            rows: RecordRows::default(),
        }
    }

    /// Returns true if both sets of records can belong to one meter.
    pub(crate) fn fits(&self, other: &Records) -> bool {
        let (rows, width) = (&self.rows, self.layout.width());
        let whole = rows.particles.len().checked_mul(width) == Some(rows.values.len());
        whole && self.layout == other.layout && self.most == other.most
    }

    /// Adds rows, such as the rows of a task.
    pub(crate) fn add(&mut self, rows: &RecordRows) {
        let (width, halvings) = (self.layout.width(), self.halvings);
        self.rows
            .append(rows, width, |number| in_fraction(number, halvings));
        while self.rows.particles.len() > self.most {
            self.thin(self.halvings + 1);
        }
    }

    /// Adds the records of other particles.
    pub(crate) fn merge(&mut self, other: &Records) {
        if other.halvings > self.halvings {
            self.thin(other.halvings);
        }
        self.add(&other.rows);
    }

    fn thin(&mut self, halvings: u32) {
        self.halvings = halvings;
        let width = self.layout.width();
        self.rows
            .retain(width, |number| in_fraction(number, halvings));
    }

    /// Returns the smallest number of halvings for which all groups of channels have the records
    /// and their total number is within the limit. The records then belong to a fraction
    /// 2^−halvings of all particles.
    pub(crate) fn common_share(groups: &[&Records]) -> u32 {
        let most = groups.iter().map(|group| group.most).min().unwrap_or(0);
        let mut halvings = groups.iter().map(|group| group.halvings).max().unwrap_or(0);
        while groups
            .iter()
            .map(|group| group.count(halvings))
            .sum::<usize>()
            > most
        {
            halvings += 1;
        }
        halvings
    }

    /// Returns the number of records of a fraction 2^−`halvings` of particles.
    fn count(&self, halvings: u32) -> usize {
        let particles = self.rows.particles.iter();
        particles
            .filter(|number| in_fraction(**number, halvings))
            .count()
    }

    /// Returns the table of records of a fraction 2^−`halvings` of particles. `followed` yields the
    /// numbers of all particles in a scene. Weights add up to the power that the meter has accepted
    /// from the particles whose records are kept.
    pub(crate) fn table(
        &self,
        scene: &Scene,
        halvings: u32,
        followed: impl Iterator<Item = u64>,
    ) -> RecordTable {
        let RecordLayout {
            channels,
            regions,
            tagged,
            flows,
            ..
        } = self.layout;
        let rows = &self.rows;
        let is_kept = |number: u64| in_fraction(number, halvings);
        let particles = followed.filter(|number| is_kept(*number)).count() as u64;
        let mut order: Vec<usize> = (0..rows.particles.len()).collect();
        order.retain(|row| is_kept(rows.particles[*row]));
        order.sort_by_key(|row| rows.particles[*row]);
        let width = self.layout.width();
        let columns = |first: usize, count: usize| -> Vec<f64> {
            let row = |row: &usize| row * width + first;
            order
                .iter()
                .flat_map(|r| &rows.values[row(r)..row(r) + count])
                .copied()
                .collect()
        };
        let weight = columns(0, channels).into_iter();
        let fixed = channels;
        let by_region = channels + FIXED;
        let modulation = |first: usize| {
            let first = by_region + PER_REGION * regions + first;
            if tagged {
                columns(first, 2)
            } else {
                Vec::new()
            }
        };
        let stokes = self.layout.stokes();
        let rate = if flows {
            columns(width - stokes - 1, 1)
        } else {
            Vec::new()
        };
        let stokes = columns(width - stokes, stokes).into_iter();
        RecordTable {
            regions: RecordRegion::of(scene, channels),
            particles,
            particle: order.iter().map(|row| rows.particles[*row]).collect(),
            weight: weight.map(|w| w / particles as f64).collect(),
            position: columns(fixed, 3),
            direction: columns(fixed + 3, 3),
            optical_length: columns(fixed + 6, 1),
            side: columns(fixed + 7, 1),
            path_length: columns(by_region, regions),
            scatterings: columns(by_region + regions, regions),
            momentum_transfer: columns(by_region + 2 * regions, regions),
            index_modulation: modulation(0),
            displacement_modulation: modulation(2),
            optical_length_rate: rate,
            stokes: stokes.map(|s| s / particles as f64).collect(),
        }
    }
}

/// Records of detected light, in the order of particles. A particle has several records if it is
/// divided on its path, or passes the meter several times.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordTable {
    /// Regions that the records distinguish.
    pub regions: Vec<RecordRegion>,
    /// Number of particles whose records are kept, including particles without records. It is the
    /// number of all particles unless there were too many records.
    pub particles: u64,
    /// Number of the particle of each record.
    pub particle: Vec<u64>,
    /// Power by record and channel, over `particles`. It adds up to the power that the meter
    /// accepts from these particles.
    pub weight: Vec<f64>,
    /// Position on the surface, by record.
    pub position: Vec<f64>,
    /// Unit direction beyond the surface, by record; at an opaque surface the direction of arrival.
    pub direction: Vec<f64>,
    /// Optical path length from the emitter.
    pub optical_length: Vec<f64>,
    /// Side, by record: 0 if the light travels to where the normal points, else 1.
    pub side: Vec<f64>,
    /// Geometric length of the path, by record and region.
    pub path_length: Vec<f64>,
    /// Number of scattering events, by record and region.
    pub scatterings: Vec<f64>,
    /// Sum of 1 − cos ϑ over the scattering events, by record and region.
    pub momentum_transfer: Vec<f64>,
    /// Complex amplitude of the optical length caused by the index change from sound, real and
    /// imaginary part by record. The length changes by Re(amplitude e^{iωt}). Empty unless the
    /// meter [is tagged](super::IrradianceMeter::tagged); NaN where the sound is too fine for the
    /// path.
    pub index_modulation: Vec<f64>,
    /// Complex amplitude of the optical length caused by the displacement of scatterers, in the
    /// layout of [`index_modulation`](Self::index_modulation); NaN where a sound's elasto-optic
    /// coefficient is unknown.
    pub displacement_modulation: Vec<f64>,
    /// Rate of change of the optical length caused by the flow of scatterers, in scene units per
    /// second, by record. Empty if no medium has a velocity.
    pub optical_length_rate: Vec<f64>,
    /// Stokes parameters of the power, by record, parameter and channel, over the number of
    /// particles like [`weight`](Self::weight). Empty unless the meter [measures
    /// them](super::IrradianceMeter::stokes).
    #[serde(default)]
    pub stokes: Vec<f64>,
}

impl RecordTable {
    /// Joins the records of several groups of channels, each given with its number of channels. All
    /// are of the same fraction of particles. They have no power in each other's channels.
    pub(crate) fn joined(groups: Vec<(RecordTable, usize)>) -> Option<RecordTable> {
        let all: usize = groups.iter().map(|(_, channels)| channels).sum();
        let mut first = 0;
        let mut whole: Option<RecordTable> = None;
        for (mut table, channels) in groups {
            for values in [&mut table.weight, &mut table.stokes] {
                *values = padded(values, channels, first, all);
            }
            first += channels;
            match &mut whole {
                None => whole = Some(table),
                Some(whole) => whole.append(table),
            }
        }
        whole.map(RecordTable::in_order)
    }

    /// Sorts the records by particle.
    fn in_order(mut self) -> RecordTable {
        if self.particle.is_sorted() {
            return self;
        }
        let mut order: Vec<usize> = (0..self.particle.len()).collect();
        order.sort_by_key(|row| self.particle[*row]);
        self.particle = order.iter().map(|row| self.particle[*row]).collect();
        let columns = [
            &mut self.weight,
            &mut self.position,
            &mut self.direction,
            &mut self.optical_length,
            &mut self.side,
            &mut self.path_length,
            &mut self.scatterings,
            &mut self.momentum_transfer,
            &mut self.index_modulation,
            &mut self.displacement_modulation,
            &mut self.optical_length_rate,
            &mut self.stokes,
        ];
        for column in columns {
            let width = column.len() / order.len();
            let rows = order
                .iter()
                .flat_map(|row| &column[row * width..(row + 1) * width]);
            *column = rows.copied().collect();
        }
        self
    }

    fn append(&mut self, other: RecordTable) {
        for (region, more) in self.regions.iter_mut().zip(other.regions) {
            let both = region.absorption.take().zip(more.absorption);
            region.absorption = both.map(|(a, b)| [a, b].concat());
        }
        self.particle.extend(other.particle);
        self.weight.extend(other.weight);
        self.position.extend(other.position);
        self.direction.extend(other.direction);
        self.optical_length.extend(other.optical_length);
        self.side.extend(other.side);
        self.path_length.extend(other.path_length);
        self.scatterings.extend(other.scatterings);
        self.momentum_transfer.extend(other.momentum_transfer);
        self.index_modulation.extend(other.index_modulation);
        self.displacement_modulation
            .extend(other.displacement_modulation);
        self.optical_length_rate.extend(other.optical_length_rate);
        self.stokes.extend(other.stokes);
    }
}

/// Widens rows of `channels` values to rows of `all` values. The values start at channel `first`;
/// the others are zero.
fn padded(values: &[f64], channels: usize, first: usize, all: usize) -> Vec<f64> {
    let row = |row: &[f64]| {
        let mut whole = vec![0.0; all];
        whole[first..first + channels].copy_from_slice(row);
        whole
    };
    values.chunks(channels).flat_map(row).collect()
}
