//! Uniform matter and its extent, for flights from one collision to the next
//! (docs/theory.md#free-flight).

use super::Scene;
use super::parts::{MediumId, Partition, Parts};
use crate::Spectrum;
use crate::medium::Medium;
use crate::phase::Phase;
use crate::shared::Distinct;
use crate::volume::LabelGrid;
use glam::DVec3;
use smallvec::{SmallVec, smallvec};
use std::sync::Arc;

/// Largest number of cubes of voxels with one matter through which a line is followed.
const MAX_STEPS: usize = 16;
/// Number that stands for other media in voxels.
const OTHER: u8 = u8::MAX;

/// Matter with one index and uniform coefficients: a medium, or one label of a medium.
#[derive(Clone, Debug)]
pub struct Matter {
    /// Refractive index; NaN if it varies from point to point.
    pub n: f64,
    /// Extinction coefficient σ_t per unit length.
    pub extinction: Spectrum,
    /// Absorption coefficient μ_a per unit length.
    pub absorption: Spectrum,
    /// Albedo σ_s/σ_t; 1 without extinction.
    pub albedo: Spectrum,
    /// Phase function.
    pub phase: Phase,
}

/// A part of a straight line through one matter.
#[derive(Clone, Copy, Debug)]
pub struct Segment<'a> {
    /// Length of the part.
    pub length: f64,
    /// Matter along the part.
    pub matter: &'a Matter,
}

/// The parts of a straight line.
pub type Segments<'a> = SmallVec<[Segment<'a>; 2]>;

/// All uniform matter of a scene.
#[derive(Clone, Debug)]
pub(super) struct Matters {
    list: Vec<Matter>,
    /// Extent of each medium, if it is known.
    extents: Vec<Option<Extent>>,
}

/// Extent of the matter of a medium.
#[derive(Clone, Debug)]
enum Extent {
    /// A medium with a single matter.
    Everywhere(usize),
    /// A medium in which rays bend, whose matter is the same everywhere except for its index.
    Curved(usize),
    /// Voxels that store the number of their matter.
    Voxels {
        grid: Arc<LabelGrid>,
        /// Matter for each number in a voxel; `None` if the matter belongs to another medium.
        numbered: Vec<Option<usize>>,
        /// Divided volume whose voxels hold all of the medium.
        partition: Option<usize>,
    },
}

impl Matter {
    fn new(n: f64, [extinction, absorption]: [Spectrum; 2], phase: &Phase) -> Self {
        let albedo = |c: usize| 1.0 - absorption[c] / extinction[c];
        let known = |c: usize| if extinction[c] > 0.0 { albedo(c) } else { 1.0 };
        Matter {
            n,
            extinction,
            absorption,
            albedo: Spectrum(std::array::from_fn(known)),
            phase: phase.clone(),
        }
    }
}

impl Matters {
    /// Lists all uniform matter of a scene. `grids` holds the grids of all scenes with the same
    /// surfaces.
    pub(super) fn of(parts: &Parts, grids: &Distinct<LabelGrid>) -> Self {
        let mut matters = Matters {
            list: Vec::new(),
            extents: Vec::new(),
        };
        for medium in &parts.media {
            let extent = matters.add(medium);
            matters.extents.push(extent);
        }
        for (number, partition) in parts.partitions.iter().enumerate() {
            if let Some(grid) = matters.voxels(partition) {
                matters.divide(parts, number, &grids.intern(grid));
            }
        }
        matters
    }

    /// Adds the matter of a medium.
    fn add(&mut self, medium: &Medium) -> Option<Extent> {
        let first = self.list.len();
        if !medium.index.is_constant() {
            let coefficients = [medium.uniform_extinction()?, medium.uniform_absorption()?];
            self.list
                .push(Matter::new(f64::NAN, coefficients, &medium.phase));
            return Some(Extent::Curved(first));
        }
        let n = medium.index.n(DVec3::ZERO);
        if let Some(labels) = &medium.labels {
            let matter = |label: usize| {
                let of = &labels.list()[label];
                let phase = medium.phase.of_label(labels.grid(), label);
                phase.map(|phase| Matter::new(n, [of.extinction, of.absorption], phase))
            };
            let count = labels.list().len();
            self.list
                .extend((0..count).map(matter).collect::<Option<Vec<_>>>()?);
            let numbered = |number: usize| Some(first + number.min(count - 1));
            return Some(Extent::Voxels {
                grid: labels.grid().clone(),
                numbered: (0..=usize::from(u8::MAX)).map(numbered).collect(),
                partition: None,
            });
        }
        let coefficients = [medium.uniform_extinction()?, medium.uniform_absorption()?];
        self.list.push(Matter::new(n, coefficients, &medium.phase));
        Some(Extent::Everywhere(first))
    }

    /// Records the extents of all media of a divided volume.
    fn divide(&mut self, parts: &Parts, number: usize, grid: &Arc<LabelGrid>) {
        let partition = &parts.partitions[number];
        let voxels = partition.voxels().into_iter();
        let media = voxels.flat_map(|v| v.media()).copied();
        for medium in media.filter(|m| *m != partition.exterior && *m < parts.media.len()) {
            let own = self.own(medium);
            let numbered = |i: usize| own.contains(&i).then_some(i);
            self.extents[medium] = Some(Extent::Voxels {
                grid: grid.clone(),
                numbered: (0..=usize::from(u8::MAX)).map(numbered).collect(),
                partition: Some(number),
            });
        }
    }

    /// Returns the matter in each voxel of a divided volume, if it is known and the numbers
    /// suffice.
    fn voxels(&self, partition: &Partition) -> Option<LabelGrid> {
        let voxels = partition.voxels()?;
        let parts = voxels.parts();
        let number = |voxel: usize| {
            let medium = voxels.of_voxel(voxel).filter(|m| *m != partition.exterior);
            let matter = match medium.and_then(|m| self.extents.get(m)?.as_ref()) {
                None | Some(Extent::Curved(_)) => return Some(OTHER),
                Some(Extent::Everywhere(matter)) => *matter,
                Some(Extent::Voxels { grid, numbered, .. }) => {
                    let same = grid.size() == parts.size() && grid.to_world() == parts.to_world();
                    let label = same.then(|| grid.labels()[voxel])?;
                    numbered[usize::from(label)]?
                }
            };
            u8::try_from(matter).ok().filter(|n| *n != OTHER)
        };
        let numbers: Option<Vec<u8>> = (0..parts.labels().len()).map(number).collect();
        LabelGrid::new(parts.size(), numbers?, parts.to_world()).ok()
    }

    /// Returns a matter by number.
    pub(super) fn numbered(&self, number: usize) -> &Matter {
        &self.list[number]
    }

    /// Returns for each voxel of a divided volume the number of its matter, or a number that no
    /// medium of the volume has. Returns `None` if the numbers are unknown.
    pub(super) fn voxels_of(&self, number: usize) -> Option<&Arc<LabelGrid>> {
        self.extents
            .iter()
            .flatten()
            .find_map(|extent| match extent {
                Extent::Voxels {
                    grid,
                    partition: Some(of),
                    ..
                } if *of == number => Some(grid),
                _ => None,
            })
    }

    /// Returns the numbers of the matter of a medium.
    pub(super) fn own(&self, medium: MediumId) -> Vec<usize> {
        match &self.extents[medium] {
            None => Vec::new(),
            Some(Extent::Everywhere(matter) | Extent::Curved(matter)) => vec![*matter],
            Some(Extent::Voxels { numbered, .. }) => numbered.iter().flatten().copied().collect(),
        }
    }
}

impl Scene {
    /// Returns the matter of a medium in which rays bend, if it is the same everywhere except for
    /// its index.
    #[inline]
    pub(crate) fn matter_of_curved(&self, medium: MediumId) -> Option<&Matter> {
        let matters = self.matters();
        match matters.extents[medium] {
            Some(Extent::Curved(matter)) => Some(&matters.list[matter]),
            _ => None,
        }
    }

    /// Returns the segments of a straight line from `x` in a unit direction, up to an optical depth
    /// in a channel. The point `x` is in `medium`. Returns `None` if the line may meet a surface,
    /// if the matter is unknown, or if there are too many segments.
    #[inline]
    pub(crate) fn free_segments(
        &self,
        medium: MediumId,
        line: [DVec3; 2],
        channel: usize,
        depth: f64,
    ) -> Option<Segments<'_>> {
        let matters = self.matters();
        let (segments, within) = match matters.extents[medium].as_ref()? {
            Extent::Curved(_) => return None,
            Extent::Everywhere(matter) => {
                let matter = &matters.list[*matter];
                let length = depth / matter.extinction[channel];
                (smallvec![Segment { length, matter }], None)
            }
            Extent::Voxels {
                grid,
                numbered,
                partition,
            } => {
                let matter = |number: u8| numbered[usize::from(number)].map(|i| &matters.list[i]);
                let segments = segments(grid, matter, line, channel, depth)?;
                (segments, *partition)
            }
        };
        let length: f64 = segments.iter().map(|segment| segment.length).sum();
        // Light without a collision within the scene leaves it.
        let ends = length < self.reach(line[0]);
        (ends && self.is_free_line(medium, within, line, length)).then_some(segments)
    }
}

/// Returns the segments of a straight line from `x` in a unit direction through voxels, up to an
/// optical depth in a channel. Returns `None` if the line leaves the known matter before, or has
/// too many segments.
#[inline]
fn segments<'a>(
    grid: &LabelGrid,
    matter: impl Fn(u8) -> Option<&'a Matter>,
    [x, direction]: [DVec3; 2],
    channel: usize,
    depth: f64,
) -> Option<Segments<'a>> {
    let mut segments = Segments::new();
    let (mut left, mut gone, mut last) = (depth, 0.0, None);
    let mut line = grid.along(x, direction);
    for _ in 0..MAX_STEPS {
        let voxel = line.cell()?;
        let number = grid.labels()[voxel];
        let matter = matter(number)?;
        let rate = matter.extinction[channel];
        let ends = line.stays(voxel, gone + left / rate);
        let length = if ends {
            left / rate
        } else {
            (line.leap(voxel) - gone).max(0.0)
        };
        if last == Some(number) {
            segments.last_mut()?.length += length;
        } else {
            segments.push(Segment { length, matter });
        }
        if ends {
            return Some(segments);
        }
        (left, gone, last) = (left - rate * length, gone + length, Some(number));
    }
    None
}
