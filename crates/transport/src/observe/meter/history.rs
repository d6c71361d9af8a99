//! What has happened to particles on their way, region by region: how far they have flown, how often they were scattered, and
//! by how much (docs/theory.md#records); and what flow does to the optical length of their way (docs/theory.md#flow).

use super::copies::Copies;
use super::flight::Flight;
use super::grid::{Coordinates, MeterGrid};
use crate::medium::{Medium, MediumLabels};
use crate::path::Point;
use crate::scene::{MediumId, Scene};
use glam::DVec3;

/// The regions of a scene: its media, or the labels of which they are made.
#[derive(Clone, Debug)]
pub(super) struct HistoryRegions {
    media: Vec<MediumRegions>,
    count: usize,
    flows: bool,
}

/// The regions of one medium.
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

    /// Whether what scatters light flows in any of them.
    pub(super) fn flows(&self) -> bool {
        self.flows
    }

    /// The region of a place in a medium.
    fn at(&self, medium: MediumId, x: DVec3) -> usize {
        let regions = &self.media[medium];
        let labels = regions.labels.as_ref();
        let label = labels.map_or(0, |(labels, _)| labels.at(x));
        regions.first + label
    }
}

/// What has happened to a particle in one region.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct RegionHistory {
    /// Geometric length of its way.
    pub length: f64,
    /// Number of times that it was scattered.
    pub scatterings: f64,
    /// Sum of 1 − cos ϑ over these, where ϑ is the angle by which its direction changed.
    pub momentum_transfer: f64,
}

/// What has happened to a particle.
#[derive(Clone, Debug)]
struct History {
    regions: Vec<RegionHistory>,
    /// How fast flow changes the optical length of its way, Σ n (ω − ω')·v.
    flow: f64,
}

/// The histories of a particle and of its copies.
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

    /// A particle starts.
    pub(super) fn start(&mut self) {
        self.copies.start(|history| {
            history.regions.fill(RegionHistory::default());
            history.flow = 0.0;
        });
    }

    /// The next copy takes its next edge.
    pub(super) fn resume(&mut self) {
        self.copies.resume();
    }

    /// The walk goes on in so many copies.
    pub(super) fn go_on(&mut self, copies: usize) {
        self.copies.go_on(copies);
    }

    /// What has happened to the particle so far.
    pub(super) fn current(&self) -> &[RegionHistory] {
        &self.copies.current.regions
    }

    /// How fast flow changes the optical length of its way so far, if anything flows.
    pub(super) fn optical_length_rate(&self) -> Option<f64> {
        self.regions.flows().then_some(self.copies.current.flow)
    }

    /// The particle flies.
    pub(super) fn fly(&mut self, flight: &Flight) {
        let (arc, medium) = (&flight.span.arc, flight.span.medium);
        let current = &mut self.copies.current.regions;
        let Some((_, cells)) = &self.regions.media[medium].labels else {
            let region = self.regions.media[medium].first;
            current[region].length += arc.arc_length(flight.theta_end);
            return;
        };
        // Cut the arc where it passes from voxel to voxel, and add the length of each piece to the label of its middle.
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

    /// The particle is scattered into a direction.
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
