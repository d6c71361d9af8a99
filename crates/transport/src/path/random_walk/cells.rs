//! Walks through volumes of cells, from face to face. They sample free flights and refraction in a
//! simpler way, because all faces are flat and all matter within a cell is uniform.
//!
//! Theory: docs/theory.md#walks-through-cells.

use super::{Observer, RandomWalk, Survival, WalkRay};
use crate::Spectrum;
use crate::bsdf::fresnel;
use crate::budget::EVENTS_PER_EDGE;
use crate::path::segment::Start;
use crate::path::workspace::Workspace;
use crate::sampling::Sampler;
use crate::scene::{BeyondFace, CellFrame, CellMatter, Matter, MediumId, Scene, WalkCells};
use eikonal::connect::World;
use glam::DVec3;

/// Largest number of cells that one flight crosses. Rounding can make a ray circle around an edge
/// where cells meet; it then continues by edges.
const MAX_CELLS_PER_FLIGHT: usize = 1 << 16;

/// Flights of a walk through cells that an observer needs to see.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum CellDetail {
    /// Edges: the walk does not use the cells.
    Edges,
    /// Straight runs through one matter.
    Runs,
    /// Flights within one cell, or none at all.
    Cells,
}

/// A straight run through one matter of a volume of cells.
#[derive(Clone, Copy, Debug)]
pub struct CellRun<'v> {
    frame: &'v CellFrame,
    /// Start, and direction along the axes of the frame.
    place: DVec3,
    along_axes: DVec3,
    /// Number of the cell, if the run is within one: for [`CellDetail::Cells`].
    pub cell: Option<usize>,
    /// Matter along the run.
    pub matter: &'v Matter,
    /// Index of the only channel.
    pub channel: usize,
    /// Length of the run.
    pub length: f64,
    /// Power of the particle.
    pub power: Spectrum,
    /// Optical path length from the emitter to the start of the run.
    pub optical_length: f64,
}

impl CellRun<'_> {
    /// Returns the position in the world at which the run starts.
    pub fn start(&self) -> DVec3 {
        self.frame.in_world(self.place)
    }

    /// Returns the unit direction in the world.
    pub fn direction(&self) -> DVec3 {
        self.frame.axes * self.along_axes
    }

    /// Returns the optical path length from the emitter to the end of the run.
    pub fn length_after(&self) -> f64 {
        self.optical_length + self.matter.n * self.length
    }
}

/// Collision in a cell.
#[derive(Clone, Copy, Debug)]
pub struct CellCollision<'v> {
    /// Scene of the walk.
    pub scene: &'v Scene,
    frame: &'v CellFrame,
    place: DVec3,
    /// Medium in the cell.
    pub medium: MediumId,
    /// Power of the particle that the cell absorbs.
    pub absorbed: f64,
    /// Number of edges and specular events up to the collision.
    pub depth: u32,
    /// Optical path length from the emitter to the collision.
    pub optical_length: f64,
}

impl CellCollision<'_> {
    /// Returns the position in the world.
    pub fn x(&self) -> DVec3 {
        self.frame.in_world(self.place)
    }
}

/// Parameters of a walk through cells.
pub(super) struct CellWalk<'w, 'o, C, O> {
    pub walk: &'w RandomWalk<'w>,
    pub cells: &'w C,
    pub detail: CellDetail,
    pub channel: usize,
    pub observer: &'o mut O,
    pub sampler: &'o mut Sampler,
}

/// State of a ray in a cell.
struct CellRay<'v, C: WalkCells> {
    cell: C::Cell,
    held: &'v CellMatter,
    /// Position in the coordinates of the cells.
    place: DVec3,
    /// Unit direction along the axes of the frame, and the step in its coordinates per length.
    direction: DVec3,
    speed: DVec3,
    throughput: Spectrum,
    depth: u32,
    optical_length: f64,
    /// Number of reflections and refractions since the last collision.
    events: u32,
    /// Part of the flight that the observer has not seen.
    unseen: Unseen,
}

/// Start and length of a straight run, and the optical path length at its start.
#[derive(Clone, Copy)]
struct Unseen {
    place: DVec3,
    length: f64,
    optical_length: f64,
}

/// Ending of a flight.
enum Ending<F> {
    /// A collision.
    Collision,
    /// A face at which the ray must continue by edges.
    Unknown,
    /// A face of the volume through which the ray left, refracted or straight, and the medium
    /// beyond.
    Left(MediumId, F),
}

impl<'w, C: WalkCells, O: Observer> CellWalk<'w, '_, C, O> {
    /// Follows a ray for at most `budget` edges, and subtracts them from `budget`, until the ray
    /// splits or ends at a collision. Returns the number of its copies; `None` if the ray continues
    /// outside cells.
    pub(super) fn follow(
        &mut self,
        ray: &mut WalkRay,
        budget: &mut usize,
        survival: &mut impl Survival,
        ws: &mut Workspace,
    ) -> Option<usize> {
        let mut state = self.enter(ray)?;
        let before = *budget;
        let copies = self.run(&mut state, ray, budget, survival, ws);
        let flights = (before - *budget) as u64;
        ws.stats.edges += flights;
        ws.stats.in_cells += flights;
        ws.stats.work.steps += flights;
        copies
    }

    fn run(
        &mut self,
        state: &mut CellRay<'w, C>,
        ray: &mut WalkRay,
        budget: &mut usize,
        survival: &mut impl Survival,
        ws: &Workspace,
    ) -> Option<usize> {
        while *budget > 0 && state.depth < self.last_depth() && !ws.stop.is_raised() {
            *budget -= 1;
            match self.fly(state) {
                Ending::Collision => {}
                ending => {
                    *ray = self.leave(state, &ending);
                    return None;
                }
            }
            self.collide(state);
            let (depth, optical_length) = (state.depth, state.optical_length);
            let throughput = &mut state.throughput;
            let copies = survival.copies(throughput, depth, optical_length, self.sampler);
            if copies != 1 {
                *ray = self.leave(state, &Ending::Collision);
                return Some(copies);
            }
        }
        *ray = self.leave(state, &Ending::Collision);
        None
    }

    /// Returns the depth at which the walk continues by edges, which end it at the largest depth.
    fn last_depth(&self) -> u32 {
        self.walk.max_depth.saturating_sub(1)
    }

    /// Returns the state of a ray in its first cell, if this cell has the ray's medium.
    fn enter(&self, ray: &WalkRay) -> Option<CellRay<'w, C>> {
        let frame = self.cells.frame();
        let place = frame.in_cells(ray.start.x);
        let cell = self.cells.cell_at(place)?;
        let held = self.cells.matter(cell)?;
        let direction = frame.along_axes(ray.start.direction);
        (held.medium == ray.start.medium).then(|| CellRay {
            cell,
            held,
            place,
            direction,
            speed: direction * frame.per_length,
            throughput: ray.throughput,
            depth: ray.depth,
            optical_length: ray.optical_length,
            events: 0,
            unseen: Unseen {
                place,
                length: 0.0,
                optical_length: ray.optical_length,
            },
        })
    }

    /// Flies to a collision, cell by cell, or to the place where the ray continues by edges.
    fn fly(&mut self, ray: &mut CellRay<'w, C>) -> Ending<C::Face> {
        let mut depth = self.sampler.next_exponential();
        for _ in 0..MAX_CELLS_PER_FLIGHT {
            let rate = ray.held.matter.extinction[self.channel];
            let length = if rate > 0.0 {
                depth / rate
            } else {
                f64::INFINITY
            };
            let line = [ray.place, ray.speed];
            let Some((face, length)) = self.cells.exit(ray.cell, line, length) else {
                self.cross(ray, length);
                return Ending::Collision;
            };
            self.cross(ray, length);
            // Planted error "collisions drawn anew at each face of voxels", found by morgana-io/io::cell_walks::walks_through_cells_agree_with_walks_by_edges:
            // depth = depth.max(0.0 * rate * length);
            depth = (depth - rate * length).max(0.0);
            ray.place = self.cells.on_face(ray.cell, face, ray.place);
            if let Some(ending) = self.meet(ray, face) {
                return ending;
            }
        }
        Ending::Unknown
    }

    /// Moves straight on within a cell.
    #[inline]
    fn cross(&mut self, ray: &mut CellRay<C>, length: f64) {
        ray.place += ray.speed * length;
        ray.optical_length += ray.held.matter.n * length;
        ray.unseen.length += length;
        if self.detail == CellDetail::Cells {
            self.show(ray, Some(C::number(ray.cell)));
        }
    }

    /// Shows the observer the run up to the current position.
    #[inline]
    fn show(&mut self, ray: &mut CellRay<C>, cell: Option<usize>) {
        let Unseen {
            place,
            length,
            optical_length,
        } = ray.unseen;
        self.observer.fly_in_cells(&CellRun {
            frame: self.cells.frame(),
            place,
            along_axes: ray.direction,
            cell,
            matter: &ray.held.matter,
            channel: self.channel,
            length,
            power: ray.throughput,
            optical_length,
        });
        ray.unseen = Unseen {
            place: ray.place,
            length: 0.0,
            optical_length: ray.optical_length,
        };
    }

    /// Ends the current run, after which direction, matter or power change.
    #[inline]
    fn end_run(&mut self, ray: &mut CellRay<C>) {
        if ray.unseen.length > 0.0 {
            self.show(ray, None);
        }
        ray.unseen.place = ray.place;
    }

    /// Passes a face, or is reflected. Returns the ending of the flight, if it ends.
    #[inline]
    fn meet(&mut self, ray: &mut CellRay<'w, C>, face: C::Face) -> Option<Ending<C::Face>> {
        let cells = self.cells;
        let beyond = cells.beyond(ray.cell, face);
        let (n, medium) = match beyond {
            BeyondFace::Cell(_, held) => (held.matter.n, held.medium),
            BeyondFace::Exterior(medium, n) => (n, medium),
            BeyondFace::Unknown => return Some(Ending::Unknown),
        };
        if n != ray.held.matter.n && cells.contents().refracts() {
            if ray.depth >= self.last_depth() || ray.events >= EVENTS_PER_EDGE {
                return Some(Ending::Unknown);
            }
            (ray.depth, ray.events) = (ray.depth + 1, ray.events + 1);
            self.end_run(ray);
            if self.is_reflected(ray, face, n) {
                return None;
            }
        }
        match beyond {
            BeyondFace::Cell(cell, held) => {
                if !std::ptr::eq(held, ray.held) {
                    self.end_run(ray);
                }
                (ray.cell, ray.held) = (cell, held);
                None
            }
            _ => Some(Ending::Left(medium, face)),
        }
    }

    /// Samples reflection or refraction at a face with index `n` beyond it. Reflects the ray with
    /// the probability of the reflected power and returns true, or refracts it and returns false.
    fn is_reflected(&mut self, ray: &mut CellRay<C>, face: C::Face, n: f64) -> bool {
        let (near, normal) = (ray.held.matter.n, self.cells.normal(ray.cell, face));
        let cos = ray.direction.dot(normal);
        let interface = fresnel::dielectric(cos.abs().min(1.0), near, n);
        if self.sampler.next_1d() < interface.reflectance {
            self.turn(ray, ray.direction - 2.0 * cos * normal);
            return true;
        }
        // Planted error "light bent away from the normal where it enters voxels of a larger index", found by morgana-io/io::cell_walks::walks_through_cells_agree_with_walks_by_edges:
        // let along = (ray.direction - cos * normal) * (n / near);
        let along = (ray.direction - cos * normal) * (near / n);
        let across = interface.cos_far.copysign(cos) * normal;
        self.turn(ray, (along + across).normalize());
        false
    }

    /// Absorbs part of the power and scatters the ray.
    #[inline]
    fn collide(&mut self, ray: &mut CellRay<C>) {
        self.end_run(ray);
        let matter = &ray.held.matter;
        let albedo = matter.albedo[self.channel];
        let power = ray.throughput[self.channel];
        (ray.depth, ray.events) = (ray.depth + 1, 0);
        self.observer.collide_in_cell(&CellCollision {
            scene: self.walk.scene,
            frame: self.cells.frame(),
            place: ray.place,
            medium: ray.held.medium,
            absorbed: power * (1.0 - albedo),
            depth: ray.depth,
            optical_length: ray.optical_length,
        });
        ray.throughput *= albedo;
        let (u, around) = (self.sampler.next_1d(), self.sampler.next_turn());
        self.turn(ray, matter.phase.turn(ray.direction, u, around));
    }

    /// Turns a ray into a direction along the axes of the frame.
    #[inline]
    fn turn(&self, ray: &mut CellRay<C>, direction: DVec3) {
        ray.direction = direction;
        ray.speed = direction * self.cells.frame().per_length;
    }

    /// Returns the ray with which the walk continues after a flight with the given ending.
    #[cold]
    fn leave(&mut self, ray: &mut CellRay<C>, ending: &Ending<C::Face>) -> WalkRay {
        self.end_run(ray);
        let epsilon = self.walk.scene.ray_epsilon();
        let (place, medium) = match ending {
            Ending::Left(medium, face) => {
                let place = self.cells.outside(ray.cell, *face, ray.place, epsilon);
                (place, *medium)
            }
            Ending::Unknown | Ending::Collision => {
                let place = self.cells.inside(ray.cell, ray.place, epsilon);
                (place, ray.held.medium)
            }
        };
        let frame = self.cells.frame();
        let direction = frame.direction(ray.direction);
        WalkRay {
            start: Start::point(frame.in_world(place), direction, medium),
            // The family of rays is unknown, as along a specular lobe.
            pdf: 1.0,
            specular: true,
            throughput: ray.throughput,
            depth: ray.depth,
            optical_length: ray.optical_length,
        }
    }
}
