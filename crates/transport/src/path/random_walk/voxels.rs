//! Walks through the voxels of a divided volume, from face to face. They sample free flights and
//! refraction in a simpler way, because all faces are rectangular and all matter within a voxel is
//! uniform.
//!
//! Theory: docs/theory.md#walks-through-voxels.

use super::{Observer, RandomWalk, Survival, WalkRay};
use crate::Spectrum;
use crate::bsdf::fresnel;
use crate::budget::EVENTS_PER_EDGE;
use crate::path::segment::Start;
use crate::path::workspace::Workspace;
use crate::sampling::Sampler;
use crate::scene::{BeyondFace, Matter, MediumId, Scene, VoxelMatter, VoxelVolume};
use eikonal::connect::World;
use glam::DVec3;

/// A straight flight within one voxel.
#[derive(Clone, Copy, Debug)]
pub struct VoxelFlight<'v> {
    /// Volume of the voxel.
    pub volume: &'v VoxelVolume,
    /// Index of the voxel, x fastest.
    pub voxel: usize,
    /// Matter in the voxel.
    pub matter: &'v Matter,
    /// Index of the only channel.
    pub channel: usize,
    /// Length of the flight.
    pub length: f64,
    /// Power in the channel.
    pub power: f64,
    /// Optical path length from the emitter to the start of the flight.
    pub optical_length: f64,
}

/// Collision in a voxel.
#[derive(Clone, Copy, Debug)]
pub struct VoxelCollision<'v> {
    /// Scene of the walk.
    pub scene: &'v Scene,
    /// Volume of the voxel.
    pub volume: &'v VoxelVolume,
    /// Position, in voxels from the volume's corner.
    place: DVec3,
    /// Medium in the voxel.
    pub medium: MediumId,
    /// Power of the particle that the voxel absorbs.
    pub absorbed: f64,
    /// Number of edges and specular events up to the collision.
    pub depth: u32,
    /// Optical path length from the emitter to the collision.
    pub optical_length: f64,
}

impl VoxelCollision<'_> {
    /// Returns the position in the world.
    pub fn x(&self) -> DVec3 {
        self.volume.in_world(self.place)
    }
}

/// Parameters of a walk through voxels.
pub(super) struct VoxelWalk<'w, 'o, O> {
    pub walk: &'w RandomWalk<'w>,
    pub volume: &'w VoxelVolume,
    pub channel: usize,
    pub observer: &'o mut O,
    pub sampler: &'o mut Sampler,
}

/// State of a ray in a voxel.
struct VoxelRay<'v> {
    /// Index of the voxel, and its lowest corner.
    voxel: usize,
    low: DVec3,
    held: &'v VoxelMatter,
    /// Position, in voxels from the volume's corner.
    place: DVec3,
    /// Unit direction, in components along the edges of voxels, and the direction in voxels per
    /// length.
    direction: DVec3,
    speed: DVec3,
    throughput: Spectrum,
    depth: u32,
    optical_length: f64,
    /// Number of reflections and refractions since the last collision.
    events: u32,
}

/// Ending of a flight.
enum Ending {
    /// A collision.
    Collision,
    /// A face at which the ray must continue by edges.
    Unknown,
    /// A face of the volume through which the ray left, refracted or straight; the medium beyond,
    /// and the axis across which the face lies.
    Left(MediumId, usize),
}

impl<'w, O: Observer> VoxelWalk<'w, '_, O> {
    /// Follows a ray for at most `budget` edges, and subtracts them from `budget`, until the ray
    /// splits or ends at a collision. Returns the number of its copies; `None` if the ray continues
    /// outside voxels.
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
        ws.stats.in_voxels += flights;
        ws.stats.work.steps += flights;
        copies
    }

    fn run(
        &mut self,
        state: &mut VoxelRay<'w>,
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

    /// Returns the state of a ray in its first voxel, if this voxel has the ray's medium.
    fn enter(&self, ray: &WalkRay) -> Option<VoxelRay<'w>> {
        let place = self.volume.in_voxels(ray.start.x);
        let (low, size) = (place.floor(), self.volume.size());
        let index = |axis: usize| {
            let inside = (0.0..size[axis] as f64).contains(&low[axis]);
            inside.then_some(low[axis] as usize)
        };
        let voxel = index(0)? + size[0] * (index(1)? + size[1] * index(2)?);
        let held = self.volume.matter(voxel)?;
        let direction = self.volume.along_edges(ray.start.direction);
        (held.medium == ray.start.medium).then(|| VoxelRay {
            voxel,
            low,
            held,
            place,
            direction,
            speed: direction * self.volume.voxels_per_length(),
            throughput: ray.throughput,
            depth: ray.depth,
            optical_length: ray.optical_length,
            events: 0,
        })
    }

    /// Flies to a collision, voxel by voxel, or to the place where the ray continues by edges.
    fn fly(&mut self, ray: &mut VoxelRay<'w>) -> Ending {
        let mut depth = self.sampler.next_exponential();
        loop {
            let matter = &ray.held.matter;
            let rate = matter.extinction[self.channel];
            let length = depth / rate;
            if ray.is_inside(ray.place + ray.speed * length) {
                self.cross(ray, length);
                return Ending::Collision;
            }
            let (axis, length) = ray.exit();
            self.cross(ray, length);
            // Planted error "collisions drawn anew at each face of voxels", found by morgana-io/io::voxel_walks::walks_through_voxels_agree_with_walks_by_edges:
            // depth = depth.max(0.0 * rate * length);
            depth = (depth - rate * length).max(0.0);
            let up = ray.speed[axis] > 0.0;
            ray.place[axis] = ray.low[axis] + f64::from(u8::from(up));
            if let Some(ending) = self.meet(ray, axis, up) {
                return ending;
            }
        }
    }

    /// Moves straight on within a voxel.
    #[inline]
    fn cross(&mut self, ray: &mut VoxelRay, length: f64) {
        let matter = &ray.held.matter;
        self.observer.fly_in_voxel(&VoxelFlight {
            volume: self.volume,
            voxel: ray.voxel,
            matter,
            channel: self.channel,
            length,
            power: ray.throughput[self.channel],
            optical_length: ray.optical_length,
        });
        ray.place += ray.speed * length;
        ray.optical_length += matter.n * length;
    }

    /// Passes the face across an axis, or is reflected. Returns the ending of the flight, if it
    /// ends.
    #[inline]
    fn meet(&mut self, ray: &mut VoxelRay<'w>, axis: usize, up: bool) -> Option<Ending> {
        let volume = self.volume;
        let beyond = volume.beyond(ray.voxel, ray.low, axis, up);
        let (n, medium) = match beyond {
            BeyondFace::Voxel(_, held) => (held.matter.n, held.medium),
            BeyondFace::Exterior(medium, n) => (n, medium),
            BeyondFace::Unknown => return Some(Ending::Unknown),
        };
        if medium != ray.held.medium && volume.refracts() {
            if ray.depth >= self.last_depth() || ray.events >= EVENTS_PER_EDGE {
                return Some(Ending::Unknown);
            }
            (ray.depth, ray.events) = (ray.depth + 1, ray.events + 1);
            if self.is_reflected(ray, axis, n) {
                return None;
            }
        }
        match beyond {
            BeyondFace::Voxel(voxel, held) => {
                (ray.voxel, ray.held) = (voxel, held);
                ray.low[axis] += if up { 1.0 } else { -1.0 };
                None
            }
            _ => Some(Ending::Left(medium, axis)),
        }
    }

    /// Samples reflection or refraction at a face across an axis, with index `n` beyond it.
    /// Reflects the ray with the probability of the reflected power and returns true, or refracts
    /// it and returns false.
    fn is_reflected(&mut self, ray: &mut VoxelRay, axis: usize, n: f64) -> bool {
        let (near, cos) = (ray.held.matter.n, ray.direction[axis]);
        let interface = fresnel::dielectric(cos.abs().min(1.0), near, n);
        if self.sampler.next_1d() < interface.reflectance {
            ray.direction[axis] = -cos;
            ray.speed[axis] = -ray.speed[axis];
            return true;
        }
        // Planted error "light bent away from the normal where it enters voxels of a larger index", found by morgana-io/io::voxel_walks::walks_through_voxels_agree_with_walks_by_edges:
        // ray.direction *= n / near;
        ray.direction *= near / n;
        ray.direction[axis] = interface.cos_far.copysign(cos);
        self.turn(ray, ray.direction.normalize());
        false
    }

    /// Absorbs part of the power and scatters the ray.
    #[inline]
    fn collide(&mut self, ray: &mut VoxelRay) {
        let matter = &ray.held.matter;
        let albedo = matter.albedo[self.channel];
        let power = ray.throughput[self.channel];
        (ray.depth, ray.events) = (ray.depth + 1, 0);
        self.observer.collide_in_voxel(&VoxelCollision {
            scene: self.walk.scene,
            volume: self.volume,
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

    /// Turns a ray into a direction along the edges of voxels.
    #[inline]
    fn turn(&self, ray: &mut VoxelRay, direction: DVec3) {
        ray.direction = direction;
        ray.speed = direction * self.volume.voxels_per_length();
    }

    /// Returns the ray with which the walk continues after a flight with the given ending.
    #[cold]
    fn leave(&self, ray: &VoxelRay, ending: &Ending) -> WalkRay {
        let mut place = ray.place;
        let medium = match ending {
            Ending::Left(medium, axis) => {
                place[*axis] += self.hair(*axis).copysign(ray.direction[*axis]);
                *medium
            }
            Ending::Unknown | Ending::Collision => {
                // Move off all faces, into the voxel.
                let inwards = |axis: usize| {
                    let (low, hair) = (ray.low[axis], self.hair(axis));
                    place[axis].clamp(low + hair, low + 1.0 - hair)
                };
                place = DVec3::new(inwards(0), inwards(1), inwards(2));
                ray.held.medium
            }
        };
        let direction = self.volume.direction(ray.direction);
        WalkRay {
            start: Start::point(self.volume.in_world(place), direction, medium),
            // The family of rays is unknown, as along a specular lobe.
            pdf: 1.0,
            specular: true,
            throughput: ray.throughput,
            depth: ray.depth,
            optical_length: ray.optical_length,
        }
    }

    /// Returns the distance from a face across an axis at which rays start, in voxels.
    fn hair(&self, axis: usize) -> f64 {
        // Limit it to a quarter of a voxel, for scenes that are very large compared with a voxel.
        (self.walk.scene.ray_epsilon() * self.volume.voxels_per_length()[axis]).min(0.25)
    }
}

impl VoxelRay<'_> {
    /// Returns true if a position is in the ray's voxel.
    #[inline]
    fn is_inside(&self, place: DVec3) -> bool {
        let within = place - self.low;
        let inside = |p: f64| (0.0..=1.0).contains(&p);
        inside(within.x) && inside(within.y) && inside(within.z)
    }

    /// Returns the axis across which the exit face lies, and the length up to this face.
    #[inline]
    fn exit(&self) -> (usize, f64) {
        let length = |axis: usize| match self.speed[axis] {
            0.0 => f64::INFINITY,
            v if v > 0.0 => (self.low[axis] + 1.0 - self.place[axis]) / v,
            v => (self.low[axis] - self.place[axis]) / v,
        };
        let [x, y, z] = [length(0), length(1), length(2)];
        let (axis, length) = match (x <= y, x <= z, y <= z) {
            (true, true, _) => (0, x),
            (_, _, true) => (1, y),
            _ => (2, z),
        };
        // Rounding may put the position slightly beyond a face.
        (axis, length.max(0.0))
    }
}
