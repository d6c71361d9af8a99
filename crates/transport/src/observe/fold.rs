//! Quantities of paths that are computed event by event, such as Stokes vectors.
//!
//! Theory: docs/theory.md#derivatives-of-light, docs/theory.md#stokes-vectors.

use crate::emitter::EmittedRay;
use crate::path::{
    BranchPoint, ConnectionArcs, Edge, EdgePart, FoundPath, PathLog, RayPart, Span, SubpathEnd,
    TransportMode, Vertex,
};
use glam::DVec3;

/// Quantity of paths. It has a state at each point of a subpath, and each state follows from the
/// previous one.
///
/// [`Folded`] turns it into a [`PathLog`], so that every estimator that writes the log supports
/// every quantity.
pub(crate) trait Fold {
    /// State at a point of a subpath.
    type State: Clone;
    /// Data of a connection.
    type ConnectionLog;

    /// True if edges need their spans: see [`PathLog::NEEDS_SPANS`].
    const NEEDS_SPANS: bool;
    /// True if edges need their parts: see [`PathLog::NEEDS_PARTS`].
    const NEEDS_PARTS: bool;

    /// Returns the state at the start of the sensor's subpath.
    fn start(&mut self) -> Self::State;

    /// Returns the state of light that leaves an emitter along a ray.
    fn emit(&mut self, ray: &EmittedRay) -> Self::State;

    /// Follows an edge to its end, with a scattering if it ends at a collision. `parts` are the
    /// arcs of the edge; it is empty if only the spans are kept.
    fn follow(
        &mut self,
        state: &mut Self::State,
        mode: TransportMode,
        edge: &Edge,
        parts: &[RayPart],
    );

    /// Follows a part of an edge of the sensor's subpath.
    fn follow_part(&mut self, state: &mut Self::State, part: &EdgePart);

    /// Passes a surface between two edges of the sensor's subpath. The surface is at the end of
    /// `span` and at the start of `next`.
    fn pass(&mut self, state: &mut Self::State, span: &Span, next: &Span);

    /// Turns at a vertex into `direction`; `specular` is true for a specular lobe.
    fn turn(
        &mut self,
        state: &mut Self::State,
        mode: TransportMode,
        vertex: &Vertex,
        direction: DVec3,
        specular: bool,
    );

    /// Records a connection: see [`PathLog::way`].
    fn log_connection(
        &mut self,
        mode: TransportMode,
        vertex: &Vertex,
        arcs: ConnectionArcs,
    ) -> Self::ConnectionLog;

    /// Records the path of a contribution.
    fn contribute(&mut self, path: FoldedPath<Self::State, Self::ConnectionLog>);
}

/// States at the ends of the subpaths of a contribution, and the connection between them: see
/// [`FoundPath`].
pub(crate) struct FoldedPath<'a, S, W> {
    pub sensor: Option<FoldedEnd<'a, S>>,
    pub light: Option<FoldedEnd<'a, S>>,
    pub connection_log: Option<&'a W>,
    pub ray: Option<&'a EmittedRay>,
}

/// State at the end of the part of a subpath that a contribution uses.
pub(crate) struct FoldedEnd<'a, S> {
    /// State where the contribution leaves the subpath.
    pub branch_point: &'a S,
    /// State at the end.
    pub state: S,
}

/// Accumulated quantity, with its states along the subpaths of a sample.
#[derive(Clone, Debug)]
pub(crate) struct Folded<F: Fold> {
    pub fold: F,
    sensor: States<F::State>,
    light: States<F::State>,
}

/// States along a subpath.
#[derive(Clone, Debug)]
struct States<S> {
    start: S,
    /// State at the current end.
    last: S,
    /// States at the numbered vertices.
    vertices: Vec<S>,
}

impl<S: Clone> States<S> {
    fn at(start: S) -> Self {
        States {
            last: start.clone(),
            start,
            vertices: Vec::new(),
        }
    }

    fn begin(&mut self, start: S) {
        self.last.clone_from(&start);
        self.start = start;
        self.vertices.clear();
    }

    fn state(&self, branch_point: BranchPoint) -> &S {
        match branch_point {
            BranchPoint::Start => &self.start,
            BranchPoint::Vertex(number) => &self.vertices[number],
            BranchPoint::Last => &self.last,
        }
    }

    /// Returns the state at the end of the part of the subpath that a contribution uses.
    fn end<F: Fold<State = S>>(
        &self,
        fold: &mut F,
        mode: TransportMode,
        end: &SubpathEnd,
    ) -> FoldedEnd<'_, S> {
        let branch_point = self.state(end.branch_point);
        let mut state = branch_point.clone();
        let after = end.passed.iter().skip(1).chain(end.part.map(|p| p.edge));
        for (edge, next) in end.passed.iter().zip(after) {
            fold.follow(&mut state, mode, edge, &[]);
            // Follow a specular lobe of the surface at the edge's end.
            // Planted error "mirrors in view of volumes left out of derivatives", found by morgana-transport/transport::derivatives::colours::what_a_coat_shows_of_volumes_is_in_proportion_to_its_colour:
            // if let (Some(span), Some(next)) = (edge.spans.last().filter(|_| false), next.spans.first()) {
            if let (Some(span), Some(next)) = (edge.spans.last(), next.spans.first()) {
                fold.pass(&mut state, span, next);
            }
        }
        if let Some(part) = &end.part {
            fold.follow_part(&mut state, part);
        }
        if let Some((vertex, direction)) = end.turn {
            fold.turn(&mut state, mode, vertex, direction, false);
        }
        FoldedEnd {
            branch_point,
            state,
        }
    }
}

impl<F: Fold> Folded<F> {
    /// Creates the states before the first path.
    pub(crate) fn new(mut fold: F) -> Self {
        let start = fold.start();
        Folded {
            sensor: States::at(start.clone()),
            light: States::at(start),
            fold,
        }
    }

    /// Begins the paths of a sample.
    pub(crate) fn begin(&mut self) {
        self.sensor.begin(self.fold.start());
    }

    fn states(&mut self, mode: TransportMode) -> (&mut F, &mut States<F::State>) {
        let states = match mode {
            TransportMode::Radiance => &mut self.sensor,
            TransportMode::Importance => &mut self.light,
        };
        (&mut self.fold, states)
    }
}

impl<F: Fold> PathLog for Folded<F> {
    type ConnectionLog = F::ConnectionLog;
    const NEEDS_SPANS: bool = F::NEEDS_SPANS;
    const NEEDS_PARTS: bool = F::NEEDS_PARTS;

    fn emit(&mut self, ray: &EmittedRay) {
        self.light.begin(self.fold.emit(ray));
    }

    fn follow(&mut self, mode: TransportMode, edge: &Edge, parts: &[RayPart]) {
        let (fold, states) = self.states(mode);
        fold.follow(&mut states.last, mode, edge, parts);
    }

    fn number_vertex(&mut self, mode: TransportMode) {
        let (_, states) = self.states(mode);
        states.vertices.push(states.last.clone());
    }

    fn turn(&mut self, mode: TransportMode, vertex: &Vertex, direction: DVec3, specular: bool) {
        let (fold, states) = self.states(mode);
        fold.turn(&mut states.last, mode, vertex, direction, specular);
    }

    fn log_connection(
        &mut self,
        mode: TransportMode,
        vertex: &Vertex,
        arcs: ConnectionArcs,
    ) -> F::ConnectionLog {
        self.fold.log_connection(mode, vertex, arcs)
    }

    fn contribute(&mut self, path: &FoundPath<F::ConnectionLog>) {
        let fold = &mut self.fold;
        let sensor = path.sensor.as_ref();
        let sensor = sensor.map(|end| self.sensor.end(fold, TransportMode::Radiance, end));
        let light = path.light.as_ref();
        let light = light.map(|end| self.light.end(fold, TransportMode::Importance, end));
        fold.contribute(FoldedPath {
            sensor,
            light,
            connection_log: path.connection_log,
            ray: path.ray,
        });
    }
}
