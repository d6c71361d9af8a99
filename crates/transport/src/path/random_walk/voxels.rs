//! A walk through the voxels of a divided volume, from face to face: what free flights and refraction there come to where all that light
//! meets is rectangular and everything within a voxel is the same.
//!
//! Theory: docs/theory.md#walks-through-voxels.

use super::{Observer, RandomWalk, Survival, WalkRay};
use crate::Spectrum;
use crate::bsdf::fresnel;
use crate::budget::EVENTS_PER_EDGE;
use crate::path::segment::Start;
use crate::path::workspace::Workspace;
use crate::sampling::Sampler;
use crate::scene::{BeyondFace, Matter, MediumId, VoxelMatter, VoxelVolume};
use eikonal::connect::World;
use glam::DVec3;

/// A straight flight within one voxel.
#[derive(Clone, Copy, Debug)]
pub struct VoxelFlight<'v> {
    /// The volume.
    pub volume: &'v VoxelVolume,
    /// Number of the voxel, x fastest.
    pub voxel: usize,
    /// What it holds.
    pub matter: &'v Matter,
    /// The only channel.
    pub channel: usize,
    /// Its length.
    pub length: f64,
    /// Power in the channel.
    pub power: f64,
    /// Optical path length from the emitter to its start.
    pub optical_length: f64,
}

/// What a walk through voxels needs besides its state.
pub(super) struct VoxelWalk<'w, 'o, O> {
    pub walk: &'w RandomWalk<'w>,
    pub volume: &'w VoxelVolume,
    pub channel: usize,
    pub observer: &'o mut O,
    pub sampler: &'o mut Sampler,
}

/// A ray in a voxel.
struct VoxelRay<'v> {
    /// Number of the voxel, and its lowest corner.
    voxel: usize,
    low: DVec3,
    held: &'v VoxelMatter,
    /// In voxels from the volume's corner.
    place: DVec3,
    /// Unit vector along the edges of voxels, and the same in voxels per length.
    direction: DVec3,
    speed: DVec3,
    throughput: Spectrum,
    depth: u32,
    optical_length: f64,
    /// Reflections and refractions since the last collision.
    events: u32,
}

/// How a flight ends.
enum Ending {
    /// By a collision.
    Collision,
    /// In front of something that is no voxel.
    Unknown,
    /// Refracted, or straight on, out of the volume; through a face across an axis.
    Left(MediumId, usize),
}

impl<'w, O: Observer> VoxelWalk<'w, '_, O> {
    /// Follows a ray for at most `budget` edges, which are taken from it, until it is to be divided or ends at a collision. Returns the number of its
    /// copies; `None` where it goes on among other things than voxels.
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

    /// Depth from which on the walk goes on elsewhere, so that it ends where it must.
    fn last_depth(&self) -> u32 {
        self.walk.max_depth.saturating_sub(1)
    }

    /// The voxel in which a ray starts, if it is in the ray's medium.
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

    /// Flies to a collision, voxel by voxel, or to where the ray goes on elsewhere.
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

    /// Goes straight on within a voxel.
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

    /// Goes on beyond the face across an axis, or is reflected. Returns how the flight ends, if it does.
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

    /// Decides what becomes of a ray where it meets a face across an axis, beyond which the index is `n`: reflects it with the probability of the power that is
    /// reflected, and returns whether it does, or refracts it.
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

    /// Is partly absorbed, and scattered.
    #[inline]
    fn collide(&mut self, ray: &mut VoxelRay) {
        let matter = &ray.held.matter;
        let albedo = matter.albedo[self.channel];
        let power = ray.throughput[self.channel];
        self.observer.collide_in_voxel(power * (1.0 - albedo));
        ray.throughput *= albedo;
        (ray.depth, ray.events) = (ray.depth + 1, 0);
        let (u, around) = (self.sampler.next_1d(), self.sampler.next_turn());
        self.turn(ray, matter.phase.turn(ray.direction, u, around));
    }

    /// Turns a ray into a direction along the edges of voxels.
    #[inline]
    fn turn(&self, ray: &mut VoxelRay, direction: DVec3) {
        ray.direction = direction;
        ray.speed = direction * self.volume.voxels_per_length();
    }

    /// The ray with which the walk goes on after a flight with that ending.
    #[cold]
    fn leave(&self, ray: &VoxelRay, ending: &Ending) -> WalkRay {
        let mut place = ray.place;
        let medium = match ending {
            Ending::Left(medium, axis) => {
                place[*axis] += self.hair(*axis).copysign(ray.direction[*axis]);
                *medium
            }
            Ending::Unknown | Ending::Collision => {
                // Off all faces, into the voxel.
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
            // No family of rays is known.
            pdf: 1.0,
            specular: true,
            throughput: ray.throughput,
            depth: ray.depth,
            optical_length: ray.optical_length,
        }
    }

    /// How far off a face across an axis rays start, in voxels.
    fn hair(&self, axis: usize) -> f64 {
        // A quarter of a voxel, if the scene is that much larger.
        (self.walk.scene.ray_epsilon() * self.volume.voxels_per_length()[axis]).min(0.25)
    }
}

impl VoxelRay<'_> {
    /// Whether a place is in the ray's voxel.
    #[inline]
    fn is_inside(&self, place: DVec3) -> bool {
        let within = place - self.low;
        let inside = |p: f64| (0.0..=1.0).contains(&p);
        inside(within.x) && inside(within.y) && inside(within.z)
    }

    /// The axis across which the face lies by which the ray leaves its voxel, and the length up to there.
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
        // By rounding a place may lie a hair beyond a face.
        (axis, length.max(0.0))
    }
}
