//! Steps of paths through sound, recorded while the paths are sampled. The modulation of the
//! optical length is computed later, only for the contributions that need it
//! (docs/theory.md#tagged-light).

use super::path::{SoundInMedia, TaggedPath};
use super::sound_along::SoundAlong;
use super::steps::Step;
use crate::emitter::EmittedRay;
use crate::observe::fold::{Fold, FoldedEnd, FoldedPath};
use crate::path::{ConnectionArcs, Edge, EdgePart, End, RayPart, Span, TransportMode, Vertex};
use crate::scene::Scene;
use glam::{DVec2, DVec3};
use std::ops::Range;

/// Steps of the paths of a sample through sound, as a tree.
#[derive(Debug)]
pub(crate) struct TaggedFold {
    sound: SoundInMedia,
    /// Arcs of the steps.
    parts: Vec<RayPart>,
    steps: Vec<PlacedStep>,
    /// Paths of contributions, in order.
    found: Vec<TaggedContribution>,
    /// Modulations already computed, by the node to which they lead, in ascending order.
    known: Vec<(Place, TaggedPath)>,
    /// Steps of a path, in order.
    path_steps: Vec<Step>,
    along: SoundAlong,
}

/// Node of a subpath: the number of steps taken when it was reached, 0 at the start.
pub(crate) type Place = usize;

/// Step with the node before it.
#[derive(Clone, Copy, Debug)]
struct PlacedStep {
    step: Step,
    before: Place,
}

/// Path of a contribution.
#[derive(Clone, Debug)]
struct TaggedContribution {
    sensor: PathEnd,
    light: PathEnd,
    /// Range of the connection's parts.
    connection_log: Range<usize>,
}

/// End of the part of a subpath that a contribution uses.
#[derive(Clone, Copy, Debug, Default)]
struct PathEnd {
    /// Node where the contribution leaves the subpath.
    branch_point: Place,
    end: Place,
}

impl PathEnd {
    fn of(end: Option<FoldedEnd<Place>>) -> Self {
        end.map_or(PathEnd::default(), |end| PathEnd {
            branch_point: *end.branch_point,
            end: end.state,
        })
    }
}

impl TaggedFold {
    pub(crate) fn new(scene: &Scene) -> Self {
        TaggedFold {
            sound: SoundInMedia::of(scene),
            parts: Vec::new(),
            steps: Vec::new(),
            found: Vec::new(),
            known: Vec::new(),
            path_steps: Vec::new(),
            along: SoundAlong::default(),
        }
    }

    /// Begins the paths of a sample.
    pub(crate) fn begin(&mut self) {
        self.parts.clear();
        self.steps.clear();
        self.found.clear();
        self.known.clear();
    }

    /// Returns the amplitudes of the optical lengths of contributions. Their indices are given in
    /// ascending order.
    pub(crate) fn modulations(
        &mut self,
        contributions: impl Iterator<Item = usize>,
    ) -> impl Iterator<Item = DVec2> {
        let mut contributions = contributions.peekable();
        std::iter::from_fn(move || {
            let contribution = self.found[contributions.next()?].clone();
            // Nothing leaves the subpaths after the last contribution.
            let is_last = contributions.peek().is_none();
            let sensor = self.modulation(contribution.sensor, contribution.connection_log, is_last);
            Some(if contribution.light.end == 0 {
                sensor
            } else {
                // Planted error "sidebands without the phases of light subpaths", found by morgana-transport/transport::meters::sidebands::estimators_find_the_same_sidebands:
                // sensor + 0.0 * self.modulation(contribution.light, 0..0, is_last)
                sensor + self.modulation(contribution.light, 0..0, is_last)
            })
        })
    }

    /// Returns the modulation of a part of a subpath, followed by a connection. Unless it
    /// `is_last`, later contributions may leave the subpath at the same node or beyond.
    fn modulation(&mut self, path: PathEnd, connection_log: Range<usize>, is_last: bool) -> DVec2 {
        let mut tagged = if is_last {
            self.path_steps.clear();
            self.collect(path.end)
        } else {
            self.path_steps.clear();
            let mut tagged = self.collect(path.branch_point);
            self.follow(&mut tagged);
            self.remember(path.branch_point, tagged);
            self.path_steps.clear();
            self.collect(path.end)
        };
        // Planted error "phases of tagged paths from the sensor without those of connections", found by morgana-transport/transport::meters::instants::light_that_is_scattered_back_once_has_the_phases_of_moved_scatterers:
        // let _ = (connection_log, Step::Connect);
        self.path_steps.extend(connection_log.map(Step::Connect));
        self.follow(&mut tagged);
        tagged.modulation().total()
    }

    /// Collects the steps from the last node with a known modulation to the node `place`. Returns
    /// the path up to the known node.
    fn collect(&mut self, place: Place) -> TaggedPath {
        let (mut place, first) = (place, self.path_steps.len());
        let known = loop {
            if place == 0 {
                break TaggedPath::default();
            }
            if let Ok(i) = self.known.binary_search_by_key(&place, |(place, _)| *place) {
                // Planted error "phases of tagged paths without what was followed for earlier contributions", found by morgana-transport/transport::meters::sidebands::estimators_find_the_same_sidebands:
                // break TaggedPath { ..Default::default() };
                break self.known[i].1;
            }
            let PlacedStep { step, before } = self.steps[place - 1];
            self.path_steps.push(step);
            place = before;
        };
        self.path_steps[first..].reverse();
        known
    }

    fn follow(&mut self, path: &mut TaggedPath) {
        path.go(&self.sound, &self.parts, &self.path_steps, &mut self.along);
    }

    fn remember(&mut self, place: Place, path: TaggedPath) {
        if let Err(i) = self.known.binary_search_by_key(&place, |(place, _)| *place) {
            self.known.insert(i, (place, path));
        }
    }

    fn push(&mut self, place: &mut Place, step: Step) {
        self.steps.push(PlacedStep {
            step,
            before: *place,
        });
        *place = self.steps.len();
    }

    /// Records arcs in media with sound.
    fn fly(&mut self, place: &mut Place, parts: impl Iterator<Item = RayPart>) {
        for part in parts {
            if self.sound.is_in(part.medium) {
                self.push(place, Step::Fly(self.parts.len()));
                self.parts.push(part);
            }
        }
    }
}

impl Fold for TaggedFold {
    type State = Place;
    /// Range of the connection's parts.
    type ConnectionLog = Range<usize>;
    const NEEDS_SPANS: bool = false;
    const NEEDS_PARTS: bool = true;

    fn start(&mut self) -> Place {
        0
    }

    fn emit(&mut self, _ray: &EmittedRay) -> Place {
        0
    }

    fn follow(&mut self, place: &mut Place, _mode: TransportMode, edge: &Edge, parts: &[RayPart]) {
        if parts.is_empty() {
            let length = match &edge.end {
                End::Collision(point) => point.length,
                _ => f64::INFINITY,
            };
            self.fly(place, up_to(edge, length));
        } else {
            self.fly(place, parts.iter().copied());
        }
    }

    fn follow_part(&mut self, place: &mut Place, part: &EdgePart) {
        self.fly(place, up_to(part.edge, part.length));
    }

    /// Surfaces do not move.
    fn pass(&mut self, _place: &mut Place, _span: &Span, _next: &Span) {}

    fn turn(
        &mut self,
        place: &mut Place,
        _mode: TransportMode,
        vertex: &Vertex,
        direction: DVec3,
        _specular: bool,
    ) {
        if let Vertex::Volume { medium, .. } = vertex
            && self.sound.is_in(*medium)
        {
            // Planted error "scatterers that rest where tagged paths from the sensor are connected", found by morgana-transport/transport::meters::instants::light_that_is_scattered_back_once_has_the_phases_of_moved_scatterers:
            // let _ = (place, direction);
            self.push(place, Step::Scatter(direction));
        }
    }

    fn log_connection(
        &mut self,
        _mode: TransportMode,
        _vertex: &Vertex,
        arcs: ConnectionArcs,
    ) -> Self::ConnectionLog {
        let first = self.parts.len();
        arcs.each(|medium, arc, theta_end| {
            if self.sound.is_in(medium) {
                let arc = *arc;
                self.parts.push(RayPart {
                    arc,
                    theta_end,
                    medium,
                });
            }
        });
        first..self.parts.len()
    }

    fn contribute(&mut self, path: FoldedPath<Place, Self::ConnectionLog>) {
        self.found.push(TaggedContribution {
            sensor: PathEnd::of(path.sensor),
            light: PathEnd::of(path.light),
            connection_log: path.connection_log.cloned().unwrap_or_default(),
        });
    }
}

/// Returns the arcs of an edge up to an arc length.
fn up_to(edge: &Edge, length: f64) -> impl Iterator<Item = RayPart> {
    let flown = edge
        .spans
        .iter()
        .take_while(move |span| span.length_before < length);
    flown.map(move |span| RayPart {
        medium: span.medium,
        arc: span.arc,
        theta_end: if span.length_after() < length {
            span.theta_end
        } else {
            span.theta_at_length(length - span.length_before)
        },
    })
}
