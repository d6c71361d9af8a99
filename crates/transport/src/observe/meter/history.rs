//! Histories of particles by region: lengths of flights, numbers of scattering events and their
//! momentum transfer (docs/theory.md#records). Also the effect of flow on the optical length
//! (docs/theory.md#flow).

use super::copies::Copies;
use super::flight::Flight;
use super::grid::{Coordinates, MeterGrid};
use crate::medium::{Medium, MediumLabels};
use crate::path::Point;
use crate::scene::{MediumId, Scene};
use glam::DVec3;

/// Regions of a scene: its media, or their labels.
#[derive(Clone, Debug)]
pub(super) struct HistoryRegions {
    media: Vec<MediumRegions>,
    count: usize,
    flows: bool,
}

/// Regions of one medium.
#[derive(Clone, Debug)]
struct MediumRegions {
    first: usize,
    labels: Option<(MediumLabels, MeterGrid)>,
}

impl HistoryRegions {
    pub(super) fn of(scene: &Scene) -> Self {
        let mut count = 0;
        let mut regions = |labels: &Option<MediumLabels>| {
            let first = count;
            count += labels.as_ref().map_or(1, |labels| labels.list().len());
            let labels = labels.clone().and_then(|labels| {
                let (size, to_world) = (labels.grid().size(), labels.grid().to_world());
                let cells = MeterGrid::new(Coordinates::Cartesian, size, to_world)?;
                Some((labels, cells))
            });
            MediumRegions { first, labels }
        };
        let media = scene.media().iter().map(|m| regions(&m.labels)).collect();
        HistoryRegions {
            media,
            count,
            flows: scene.media().iter().any(Medium::flows),
        }
    }

    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Returns true if scatterers flow in any medium.
    pub(super) fn flows(&self) -> bool {
        self.flows
    }

    /// Returns the index of the region at a position in a medium.
    fn at(&self, medium: MediumId, x: DVec3) -> usize {
        let regions = &self.media[medium];
        let labels = regions.labels.as_ref();
        let label = labels.map_or(0, |(labels, _)| labels.at(x));
        regions.first + label
    }
}

/// History of a particle in one region.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct RegionHistory {
    /// Geometric length of the particle's path in the region.
    pub length: f64,
    /// Number of scattering events.
    pub scatterings: f64,
    /// Sum of 1 − cos ϑ over the scattering events, where ϑ is the angle of deflection.
    pub momentum_transfer: f64,
}

/// History of a particle.
#[derive(Clone, Debug)]
struct History {
    regions: Vec<RegionHistory>,
    /// Rate of change of the optical length by flow, Σ n (ω − ω')·v.
    flow: f64,
}

/// Histories of a particle and of its copies.
#[derive(Clone, Debug)]
pub(super) struct Histories {
    regions: HistoryRegions,
    copies: Copies<History>,
    cuts: Vec<f64>,
}

impl Histories {
    pub(super) fn new(regions: HistoryRegions) -> Self {
        Histories {
            copies: Copies::new(History {
                regions: vec![RegionHistory::default(); regions.count()],
                flow: 0.0,
            }),
            cuts: Vec::new(),
            regions,
        }
    }

    /// Starts a particle.
    pub(super) fn start(&mut self) {
        self.copies.start(|history| {
            history.regions.fill(RegionHistory::default());
            history.flow = 0.0;
        });
    }

    /// Continues with the next copy, along its next edge.
    pub(super) fn resume(&mut self) {
        self.copies.resume();
    }

    /// Divides the particle into `copies` copies; 0 ends it.
    pub(super) fn continue_walk(&mut self, copies: usize) {
        self.copies.continue_walk(copies);
    }

    /// Returns the history of the current particle so far, by region.
    pub(super) fn current(&self) -> &[RegionHistory] {
        &self.copies.current.regions
    }

    /// Returns the rate of change of the optical length by flow so far; `None` if nothing flows.
    pub(super) fn optical_length_rate(&self) -> Option<f64> {
        self.regions.flows().then_some(self.copies.current.flow)
    }

    /// Adds a flight.
    pub(super) fn fly(&mut self, flight: &Flight) {
        let (arc, medium) = (&flight.span.arc, flight.span.medium);
        let current = &mut self.copies.current.regions;
        let Some((_, cells)) = &self.regions.media[medium].labels else {
            let region = self.regions.media[medium].first;
            current[region].length += arc.arc_length(flight.theta_end);
            return;
        };
        // Cut the arc at voxel boundaries; add the length of each piece to the label at its
        // midpoint.
        self.cuts.clear();
        cells.cut(arc, flight.theta_end, &mut self.cuts);
        self.cuts.push(flight.theta_end);
        self.cuts.sort_unstable_by(f64::total_cmp);
        let (mut from, mut before) = (0.0, 0.0);
        for &to in &self.cuts {
            let length = arc.arc_length(to);
            let region = self.regions.at(medium, arc.position(0.5 * (from + to)));
            current[region].length += length - before;
            (from, before) = (to, length);
        }
    }

    /// Adds a scattering into a direction.
    pub(super) fn scatter(&mut self, scene: &Scene, point: &Point, direction: DVec3) {
        let current = &mut self.copies.current;
        if self.regions.flows() {
            let medium = scene.medium(point.medium);
            let velocity = medium.velocity_at(point.x);
            if velocity != DVec3::ZERO {
                // Planted error "flow of scatterers against the light's direction", found by morgana-transport/transport::meters::instants::rates_are_those_of_lengths_between_scatterers_that_flow:
                // let turn = point.direction + direction;
                let turn = point.direction - direction;
                // Planted error "flow of scatterers without the index", found by morgana-transport/transport::meters::instants::rates_are_those_of_lengths_between_scatterers_that_flow:
                // flow.current += turn.dot(velocity);
                current.flow += medium.index.n(point.x) * turn.dot(velocity);
            }
        }
        let region = self.regions.at(point.medium, point.x);
        let history = &mut current.regions[region];
        history.scatterings += 1.0;
        history.momentum_transfer += 1.0 - point.direction.dot(direction);
    }
}
