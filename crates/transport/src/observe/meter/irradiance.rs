//! Power through a surface, by side, position, direction and optical path length.

use super::acceptance::Acceptance;
use super::flight::Passing;
use super::fluence::Slots;
use super::layout::{CellLayout, Cells};
use super::positions::Positions;
use super::reading::{Quantity, ReadingAxis, Value};
use crate::frequency_domain::{Factors, FrequencyDomain};
use crate::mueller::STOKES_PARAMETERS;
use crate::scene::CellVolume;
use crate::sidebands::Sidebands;
use crate::{Bins, Spectrum};
use glam::{DVec2, DVec3};

/// Bins of direction by the cosine with an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cosines {
    /// Number of equal bins, at least one.
    pub count: usize,
    /// Unit axis; `None` for the normal of the surface, on the side to which the light travels.
    pub axis: Option<DVec3>,
}

/// Meter of the power that passes through the surfaces of one or more objects, or arrives at them
/// if they are opaque. Side 0 is light that travels to where the normal points: light that leaves a
/// closed shape. Side 1 is the opposite.
#[derive(Clone, Debug)]
pub struct IrradianceMeter {
    /// Surfaces at which the meter measures, at least one, each of another object.
    pub surfaces: Vec<MeterSurface>,
    /// Light that the meter accepts.
    pub acceptance: Acceptance,
    /// Bins of position.
    pub positions: Positions,
    /// Bins of direction.
    pub cosines: Option<Cosines>,
    /// Bins of the optical path length from the emitter.
    pub optical_length: Option<Bins>,
    /// Weight windows divide and terminate particles, so that late bins of optical length are as
    /// accurate as early ones.
    pub weight_windows: bool,
    /// Maximum number of records of accepted light, if the meter keeps records.
    pub most_records: Option<usize>,
    /// True if records also hold the effect of sound on the light's optical length.
    pub tagged: bool,
    /// Sidebands into which the meter separates power by the phase shift from sound; `None` if it
    /// does not.
    pub sidebands: Option<Sidebands>,
    /// Frequencies at which the meter measures modulated power; `None` if it does not.
    pub frequency_domain: Option<FrequencyDomain>,
    /// True if the meter measures the [Stokes parameters](crate::polarization) of light. The first
    /// axis of their frame is perpendicular to the direction of the light and to the [y
    /// axis](crate::shape::Shape::y_axis) of the shape.
    pub stokes: bool,
}

/// Surface at which a meter measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeterSurface {
    /// Index of the object in the scene.
    pub object: usize,
    /// True if side 0 is the side from which the object's normals point away.
    pub inverted: bool,
}

/// Number of cells before the bins: power and its optical moment on either side.
const TOTALS: usize = 4;

impl Cosines {
    fn bins(&self) -> Bins {
        Bins {
            min: if self.axis.is_some() { -1.0 } else { 0.0 },
            max: 1.0,
            count: self.count,
        }
    }

    fn index(&self, passing: &Passing) -> Option<usize> {
        let cosine = match self.axis {
            Some(axis) => axis.dot(passing.direction),
            None => passing.hit.normal.dot(passing.direction).abs(),
        };
        self.bins().index(cosine.clamp(-1.0, 1.0))
    }
}

impl IrradianceMeter {
    /// Returns true if any of the meter's surfaces is a face of a volume of voxels.
    pub(super) fn measures_faces_of(&self, volume: &CellVolume) -> bool {
        self.surfaces.iter().any(|s| volume.has_face(s.object))
    }

    /// Creates a meter of all light that passes through the surface of one object.
    pub fn at(object: usize, positions: Positions) -> Self {
        let surface = MeterSurface {
            object,
            inverted: false,
        };
        IrradianceMeter {
            surfaces: vec![surface],
            acceptance: Acceptance::default(),
            positions,
            cosines: None,
            optical_length: None,
            weight_windows: false,
            most_records: None,
            tagged: false,
            sidebands: None,
            frequency_domain: None,
            stokes: false,
        }
    }

    /// Returns the number of bins on one side.
    fn bins(&self) -> usize {
        let lengths = self.optical_length.map_or(1, |b| b.count);
        let cosines = self.cosines.map_or(1, |c| c.count);
        lengths
            .saturating_mul(cosines)
            .saturating_mul(self.positions.bins())
    }

    /// Returns the order of cells. The values of a bin are its power, the parts into which sound
    /// separates the power, the Stokes parameters, and the parts of modulated light.
    pub(super) fn layout(&self) -> CellLayout {
        let frequencies = self.frequency_domain.as_ref();
        let modulated = frequencies.map_or(0, FrequencyDomain::parts);
        CellLayout {
            totals: TOTALS,
            bins: self.bins().saturating_mul(2),
            values: self.first_modulated() + modulated,
        }
    }

    /// Returns the first Stokes parameter among the values of a bin.
    fn first_stokes(&self) -> usize {
        1 + self.sidebands.map_or(0, |sidebands| sidebands.parts())
    }

    /// Returns the first part of modulated light among the values of a bin.
    fn first_modulated(&self) -> usize {
        self.first_stokes() + if self.stokes { STOKES_PARAMETERS } else { 0 }
    }

    /// Returns the quantities. The binned power and the irradiance share
    /// their sums.
    pub(super) fn quantities(&self) -> Vec<Quantity> {
        let sides = Bins {
            min: 0.0,
            max: 2.0,
            count: 2,
        };
        let side = ReadingAxis::new("side", &sides);
        let mut axes = vec![side.clone()];
        axes.extend(
            self.optical_length
                .map(|bins| ReadingAxis::optical_length(&bins)),
        );
        axes.extend(self.cosines.map(|c| ReadingAxis::new("cosine", &c.bins())));
        axes.extend(self.positions.axes());
        let layout = self.layout();
        let power = layout.part(0, 1);
        let quantity = |name, axes: &[ReadingAxis], cells: Cells, measures: &[f64]| Quantity {
            name,
            axes: axes.to_vec(),
            cells,
            measures: measures.to_vec(),
            unsigned: None,
            value: Value::Mean,
        };
        let mut quantities = vec![
            quantity(
                "power",
                std::slice::from_ref(&side),
                Cells::totals(0, 2),
                &[1.0],
            ),
            quantity("optical_moment", &[side], Cells::totals(2, 2), &[1.0]),
        ];
        if axes.len() > 1 {
            quantities.push(quantity("binned_power", &axes, power, &[1.0]));
        }
        if let Some(areas) = self
            .positions
            .areas()
            .filter(|_| self.acceptance.is_everywhere())
        {
            quantities.push(quantity("irradiance", &axes, power, areas));
        }
        if let Some(sidebands) = &self.sidebands {
            let names = ["power_sidebands", "power_correlation"];
            let parts = quantity("power", &axes, layout.part(1, 1), &[1.0]);
            quantities.extend(parts.of_parts(sidebands, names));
        }
        if let Some(domain) = &self.frequency_domain {
            let names = [
                "power_in_phase",
                "power_quadrature",
                "power_amplitude",
                "power_phase",
            ];
            let cells = layout.part(self.first_modulated(), 1);
            let parts = quantity("power", &axes, cells, &[1.0]);
            quantities.extend(parts.of_frequencies(domain, names, power));
        }
        if self.stokes {
            axes.insert(0, ReadingAxis::numbers("stokes", STOKES_PARAMETERS));
            let cells = layout.part(self.first_stokes(), STOKES_PARAMETERS);
            quantities.push(Quantity {
                unsigned: Some(power),
                ..quantity("power_stokes", &axes, cells, &[1.0])
            });
        }
        quantities
    }

    /// Scores light that passes a surface. `modulation` of its optical length and `stokes`, per
    /// unit of power, are given if they are known. Returns the side to which the light travels, if
    /// the meter accepts it.
    pub(super) fn pass(
        &self,
        passing: &Passing,
        modulation: Option<DVec2>,
        stokes: Option<&[Spectrum; 4]>,
        slots: &mut Slots,
    ) -> Option<usize> {
        self.scores(passing, |cell, power| {
            slots.add(cell, power);
            if cell < TOTALS {
                return;
            }
            if let (Some(sidebands), Some(modulation)) = (&self.sidebands, modulation) {
                slots.add_parts(cell + 1, power, &sidebands.shares(modulation));
            }
            if let Some(stokes) = stokes {
                for (first, parameter) in (cell + self.first_stokes()..).zip(stokes) {
                    slots.add(first, power * *parameter);
                }
            }
            if let Some((first, factors)) = self.modulated(cell, passing.optical_length) {
                slots.add_parts(first, power, &factors);
            }
        })
    }

    /// Returns the meter's surface at which light passes, if the light is accepted.
    pub(super) fn accepting(&self, passing: &Passing) -> Option<&MeterSurface> {
        let at = |surface: &&MeterSurface| surface.object == passing.object;
        let surface = self.surfaces.iter().find(at)?;
        self.acceptance.accepts(passing).then_some(surface)
    }

    /// Returns the first cell of the parts of modulated light in a bin, given the cell of its power,
    /// and the factors of the parts. Returns `None` for totals, and if the meter measures no
    /// modulated light.
    fn modulated(&self, cell: usize, optical_length: f64) -> Option<(usize, Factors)> {
        let domain = self.frequency_domain.as_ref().filter(|_| cell >= TOTALS)?;
        Some((
            cell + self.first_modulated(),
            domain.factors(optical_length),
        ))
    }

    /// Calls `score` like [`scores`](Self::scores), and with the parts of modulated light.
    pub(super) fn all_scores(&self, passing: &Passing, mut score: impl FnMut(usize, Spectrum)) {
        self.scores(passing, |cell, power| {
            score(cell, power);
            if let Some((first, factors)) = self.modulated(cell, passing.optical_length) {
                for (cell, factor) in (first..).zip(factors) {
                    score(cell, power * factor);
                }
            }
        });
    }

    /// Calls `score` with each cell to which passing light adds, and the value that it adds.
    /// Returns the side to which it travels if it is accepted.
    #[inline]
    pub(super) fn scores(
        &self,
        passing: &Passing,
        mut score: impl FnMut(usize, Spectrum),
    ) -> Option<usize> {
        let surface = self.accepting(passing)?;
        // Score the power on its side, in total and in the bin of its direction, position and
        // length.
        let along = passing.hit.normal.dot(passing.direction) > 0.0;
        let side = usize::from(along == surface.inverted);
        score(side, passing.power);
        score(2 + side, passing.power * passing.optical_length);
        if let Some(bin) = self.bin(passing) {
            let bin = side * self.bins() + bin;
            score(TOTALS + bin * self.layout().values, passing.power);
        }
        Some(side)
    }

    /// Returns the bin of light among the bins of one side; `None` outside the range of optical
    /// lengths.
    fn bin(&self, passing: &Passing) -> Option<usize> {
        let length = self
            .optical_length
            .map_or(Some(0), |b| b.index(passing.optical_length))?;
        let cosine = self.cosines.map_or(Some(0), |c| c.index(passing))?;
        let cosines = self.cosines.map_or(1, |c| c.count);
        let position = self.positions.index(&passing.hit)?;
        Some((length * cosines + cosine) * self.positions.bins() + position)
    }
}
