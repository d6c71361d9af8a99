//! The scene: immutable, and valid by construction.

mod bending;
mod bending_ball;
mod builder;
mod check;
mod clearance;
mod coincident;
mod containment;
mod emission;
mod emissive;
mod emitted_power;
mod faces;
mod geometry;
mod group;
mod index;
mod light_bounds;
mod lights;
pub mod lint;
mod matter;
mod partition;
mod parts;
mod period;
mod regions;
mod voxels;
mod world;

pub use crate::film::{FilmSpec, FilmWindow};
pub use bending::TOTAL_REFLECTIONS;
pub(crate) use bending_ball::BendingBall;
pub use builder::{BuildError, BuildProblem, ObjectBuilder, SceneBuilder};
pub use check::{ProblemSeverity, SceneProblem, Subject};
pub use containment::{Bodies, Containment};
pub(crate) use light_bounds::Receiver;
pub use lint::Lint;
pub use matter::{Leg, Legs, Matter};
pub use parts::{AMBIENT, MediumId, Object, Partition, Parts, Sides};
pub use regions::Region;
pub use voxels::VoxelVolume;
pub(crate) use voxels::{BeyondFace, VoxelMatter};

use crate::bsdf::Bsdf;
use crate::emitter::{Emitter, Surroundings};
use crate::medium::Medium;
use crate::sensor::Sensor;
use crate::stop::Stop;
use bending::{Bending, REACH, guides};
use clearance::Clearance;
use eikonal::connect::{Guide, Reach};
use eikonal::{Aabb, Tolerance};
use emission::{point_like_emitters, volume_lights};
use geometry::Geometry;
use glam::DVec3;
use lights::Lights;
use matter::Matters;
use std::sync::{Arc, OnceLock};
use voxels::VoxelVolumes;

/// How far off surfaces rays start, relative to the extent of the scene: thousands of times the round-off of positions.
const RAY_EPSILON: f64 = 1e-12;

/// Least radius of the ball around a scene, relative to the distance of its centre from the origin.
const LEAST_RADIUS: f64 = 1e-3;

/// What a panic says where scenes are asked for and there is none.
pub(crate) const NO_SCENE: &str = "there must be a scene for each group of channels, at least one";

/// A scene that can be rendered.
#[derive(Debug)]
pub struct Scene {
    parts: Parts,
    /// Shared by scenes that have it in common.
    geometry: Arc<Geometry>,
    regions: Vec<Region>,
    sensor_medium: MediumId,
    lights: Lights,
    around: Surroundings,
    /// See [`World::ray_epsilon`](eikonal::World::ray_epsilon).
    ray_epsilon: f64,
    /// Whether nothing takes any light between surfaces.
    clear: bool,
    /// How far surfaces are, once somebody asks.
    clearance: OnceLock<Arc<Clearance>>,
    /// Matter that is the same everywhere, once somebody asks.
    matters: OnceLock<Matters>,
    /// Volumes of voxels, once somebody asks.
    voxel_volumes: OnceLock<VoxelVolumes>,
    reach: Reach,
    bending: Bending,
    bending_ball: Option<BendingBall>,
    point_like_emitters: Vec<DVec3>,
    /// Indices of the volumes that emit.
    volume_lights: Vec<usize>,
    /// For each emitter that is a beam, where it goes.
    guides: Vec<Option<Guide<MediumId>>>,
    warnings: Vec<SceneProblem>,
    /// The scene at later instants of the sound's period.
    later: Vec<Scene>,
}

impl Scene {
    /// Puts a scene together and checks it.
    ///
    /// # Errors
    /// Everything that is wrong with it, errors first.
    pub fn new(parts: Parts) -> Result<Self, Vec<SceneProblem>> {
        Self::unless_stopped(parts, None, &Stop::default())
    }

    /// Does the same as [`Scene::new`] until `stop` is raised, and then returns no problem, but an error. The scene shares the geometry of
    /// `alike` if its surfaces are the same.
    fn unless_stopped(
        mut parts: Parts,
        alike: Option<&Scene>,
        stop: &Stop,
    ) -> Result<Self, Vec<SceneProblem>> {
        let go_on = || {
            if stop.is_raised() {
                Err(Vec::new())
            } else {
                Ok(())
            }
        };
        let shared = alike.filter(|scene| scene.geometry.place(&scene.parts, &mut parts));
        let geometry = match shared {
            Some(scene) => Arc::clone(&scene.geometry),
            None => Arc::new(Geometry::new(&mut parts, stop).ok_or_else(Vec::new)?),
        };
        settle_fibers(&mut parts, &geometry.bodies);
        parts = parts.with_emissive_media();
        go_on()?;
        let around = surroundings(&parts);
        let regions = regions::all(&parts, &around, stop);
        go_on()?;
        for (medium, region) in parts.media.iter_mut().zip(&regions) {
            medium.index = medium.index.prepared(&region.aabb);
        }
        let containment = parts.containment(&geometry.bodies);
        let sensor_medium = containment.medium_at(parts.sensor.position());
        let bending_ball = bending_ball::bending_ball(&parts, &geometry.overlapping, &regions);
        go_on()?;
        let mut scene = Scene {
            guides: Vec::new(),
            warnings: Vec::new(),
            later: Vec::new(),
            geometry,
            lights: Lights::new(&parts, &around),
            regions,
            point_like_emitters: point_like_emitters(&parts),
            volume_lights: volume_lights(&parts),
            bending_ball,
            reach: Reach {
                optical_length: REACH * around.radius,
                reflections: parts.reflections,
                bounces: parts.reflections.saturating_add(TOTAL_REFLECTIONS),
            },
            bending: Bending::of(&parts),
            sensor_medium,
            ray_epsilon: ray_epsilon(&around),
            clear: parts.media.iter().all(Medium::is_transparent),
            clearance: OnceLock::new(),
            matters: OnceLock::new(),
            voxel_volumes: OnceLock::new(),
            around,
            parts,
        };
        go_on()?;
        scene.guides = guides(&scene);
        let problems = check::check(&scene, stop);
        go_on()?;
        if problems
            .iter()
            .any(|p| p.severity == ProblemSeverity::Error)
        {
            return Err(problems);
        }
        scene.warnings = problems;
        Ok(scene)
    }

    /// What is doubtful about the scene.
    pub fn warnings(&self) -> &[SceneProblem] {
        &self.warnings
    }

    /// Objects.
    pub fn objects(&self) -> &[Object] {
        &self.parts.objects
    }

    /// Media; the first is the ambient one.
    pub fn media(&self) -> &[Medium] {
        &self.parts.media
    }

    /// A medium.
    pub fn medium(&self, id: MediumId) -> &Medium {
        &self.parts.media[id]
    }

    /// Emitters.
    pub fn emitters(&self) -> &[Emitter] {
        &self.parts.emitters
    }

    /// What is known of the region that each medium fills; same order as [`Scene::media`].
    pub fn regions(&self) -> &[Region] {
        &self.regions
    }

    /// Whether surfaces divide a volume into several media.
    pub(crate) fn is_divided(&self) -> bool {
        !self.parts.partitions.is_empty()
    }

    /// Sensor.
    pub fn sensor(&self) -> &Sensor {
        &self.parts.sensor
    }

    /// The medium that the sensor is in.
    pub fn sensor_medium(&self) -> MediumId {
        self.sensor_medium
    }

    /// Film.
    pub fn film(&self) -> &FilmSpec {
        &self.parts.film
    }

    /// Tolerance of rays.
    pub fn tolerance(&self) -> Tolerance {
        self.parts.tolerance
    }

    /// A ball that contains every object, the sensor and all emitters at finite distance.
    pub fn around(&self) -> &Surroundings {
        &self.around
    }

    /// How far, and through how many reflections, connections are looked for.
    pub fn branch_reach(&self) -> &Reach {
        &self.reach
    }

    /// Whether no ray is bent anywhere.
    pub fn is_straight(&self) -> bool {
        self.bending == Bending::None
    }

    /// Whether nothing takes any light between surfaces.
    pub(crate) fn is_clear(&self) -> bool {
        self.clear
    }

    /// The smooth ball that is all that bends rays, if that is so.
    pub(crate) fn bending_ball(&self) -> Option<&BendingBall> {
        self.bending_ball.as_ref()
    }

    /// Positions of point-like emitters, if anything scatters their light: near them its 1/r² fall-off
    /// needs care.
    pub(crate) fn point_like_emitters(&self) -> &[DVec3] {
        &self.point_like_emitters
    }

    /// The ray from the centre of a beam, if the emitter is one.
    pub(crate) fn guide(&self, emitter: usize) -> Option<&Guide<MediumId>> {
        self.guides.get(emitter)?.as_ref()
    }

    /// The index at a point of a medium.
    pub fn n(&self, medium: MediumId, x: DVec3) -> f64 {
        self.medium(medium).index.n(x)
    }

    /// Whether paths that leave the scene find no light, and may be scattered before: see
    /// [`FirstVertexTechniques`](crate::render::FirstVertexTechniques).
    pub fn is_dark(&self) -> bool {
        self.environments().next().is_none() && self.media().iter().any(Medium::scatters)
    }

    /// Whether there are smooth dielectrics.
    pub(crate) fn has_dielectrics(&self) -> bool {
        self.objects()
            .iter()
            .any(|o| matches!(o.bsdf, Bsdf::Dielectric(_)))
    }
}

/// The distance by which rays start off surfaces.
fn ray_epsilon(around: &Surroundings) -> f64 {
    RAY_EPSILON * (around.radius + around.center.length())
}

/// Gives fibres the cones that they have in the media in which they end.
fn settle_fibers(parts: &mut Parts, bodies: &Bodies) {
    let containment = Containment {
        objects: &parts.objects,
        partitions: &parts.partitions,
        bodies,
    };
    for emitter in &mut parts.emitters {
        if let Emitter::Fiber(fiber) = emitter {
            let medium = containment.medium_at(fiber.origin());
            let n = parts.media[medium].index.n(fiber.origin());
            *fiber = fiber.clone().in_medium(n);
        }
    }
}

/// A ball around all that is at finite distance. What has no extent has a ball in proportion to its distance from the origin, or
/// of radius 1 there: light does not depend on the unit of length.
fn surroundings(parts: &Parts) -> Surroundings {
    let shapes = parts.objects.iter().map(|o| o.shape.aabb());
    let points = parts.emitters.iter().filter_map(Emitter::position);
    let points = points.chain(parts.sensor.positions());
    let all = shapes.fold(Aabb::EMPTY, Aabb::union);
    let all = points.fold(all, Aabb::include);
    let volumes = parts.emitters.iter().filter_map(|e| match e {
        Emitter::Volume(volume) => Some(volume.aabb()),
        _ => None,
    });
    let all = volumes.fold(all, Aabb::union).union(parts.measured);
    let center = all.center();
    let radius = f64::max(0.5 * all.diagonal() * 1.01, LEAST_RADIUS * center.length());
    Surroundings {
        center,
        radius: if radius > 0.0 { radius } else { 1.0 },
    }
}
