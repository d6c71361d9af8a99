//! Scenes: immutable, and valid by construction.

mod bending;
mod bending_ball;
mod builder;
mod cell_volumes;
mod cells;
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
mod tetrahedra;
mod voxels;
mod world;

pub use crate::film::{FilmSpec, FilmWindow};
pub use bending::MAX_TOTAL_REFLECTIONS;
pub(crate) use bending_ball::BendingBall;
pub use builder::{BuildError, BuildProblem, ObjectBuilder, SceneBuilder};
pub use cell_volumes::CellVolume;
pub(crate) use cells::{BeyondFace, CellFrame, CellMatter, WalkCells, faces_refract};
pub use check::{ProblemSeverity, SceneProblem, Subject};
pub use containment::{Bodies, Containment};
pub(crate) use light_bounds::Receiver;
pub use lint::Lint;
pub use matter::{Matter, Segment, Segments};
pub use parts::{AMBIENT, CellMedia, MediumId, Object, Partition, Parts, Sides};
pub use regions::Region;
pub use voxels::VoxelVolume;

use crate::bsdf::Bsdf;
use crate::emitter::{Emitter, Surroundings};
use crate::medium::Medium;
use crate::sensor::Sensor;
use crate::stop::Stop;
use bending::{Bending, REACH, guides};
use cell_volumes::CellVolumes;
use clearance::Clearance;
use eikonal::connect::{Guide, Reach};
use eikonal::{Aabb, Tolerance};
use emission::{point_like_emitters, volume_lights};
use geometry::Geometry;
use glam::DVec3;
use lights::Lights;
use matter::Matters;
use std::sync::{Arc, OnceLock};

/// Distance by which rays start off surfaces, relative to the extent of the scene: thousands of
/// times the round-off of positions.
const RAY_EPSILON: f64 = 1e-12;

/// Smallest radius of the ball around a scene, relative to the distance of its centre from the
/// origin.
const MIN_RADIUS: f64 = 1e-3;

/// Panic message for an empty list of scenes.
pub(crate) const NO_SCENE: &str = "there must be a scene for each group of channels, at least one";

/// A scene that can be rendered.
#[derive(Debug)]
pub struct Scene {
    parts: Parts,
    /// Geometry shared by scenes with equal surfaces.
    geometry: Arc<Geometry>,
    regions: Vec<Region>,
    sensor_medium: MediumId,
    lights: Lights,
    around: Surroundings,
    /// Distance from a surface at which rays that leave it start: see
    /// [`World::ray_epsilon`](eikonal::World::ray_epsilon).
    ray_epsilon: f64,
    /// True if no medium attenuates light.
    clear: bool,
    /// Bounds of distances to surfaces, computed on first use.
    clearance: OnceLock<Arc<Clearance>>,
    /// Uniform matter, computed on first use.
    matters: OnceLock<Matters>,
    /// Volumes of cells, computed on first use.
    cell_volumes: OnceLock<CellVolumes>,
    reach: Reach,
    bending: Bending,
    bending_ball: Option<BendingBall>,
    point_like_emitters: Vec<DVec3>,
    /// Indices of the volumes that emit.
    volume_lights: Vec<usize>,
    /// Central rays of the emitters that are beams.
    guides: Vec<Option<Guide<MediumId>>>,
    warnings: Vec<SceneProblem>,
    /// Scenes at later instants of the sound's period.
    later: Vec<Scene>,
}

impl Scene {
    /// Builds a scene and checks it.
    ///
    /// # Errors
    /// All problems, errors first.
    pub fn new(parts: Parts) -> Result<Self, Vec<SceneProblem>> {
        Self::unless_stopped(parts, None, &Stop::default())
    }

    /// Builds a scene like [`Scene::new`], but returns an error without problems once `stop` is
    /// raised. The scene shares the geometry of `alike` if its surfaces are equal.
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
                bounces: parts.reflections.saturating_add(MAX_TOTAL_REFLECTIONS),
            },
            bending: Bending::of(&parts),
            sensor_medium,
            ray_epsilon: ray_epsilon(&around),
            clear: parts.media.iter().all(Medium::is_transparent),
            clearance: OnceLock::new(),
            matters: OnceLock::new(),
            cell_volumes: OnceLock::new(),
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

    /// Returns the scene as another sensor sees it. Both scenes share their geometry.
    ///
    /// # Errors
    /// All problems, errors first.
    pub fn seen_by(&self, sensor: Sensor, film: FilmSpec) -> Result<Self, Vec<SceneProblem>> {
        let parts = Parts {
            sensor,
            film,
            ..self.parts.clone()
        };
        Self::unless_stopped(parts, Some(self), &Stop::default())
    }

    /// Returns the warnings about the scene.
    pub fn warnings(&self) -> &[SceneProblem] {
        &self.warnings
    }

    /// Returns the objects.
    pub fn objects(&self) -> &[Object] {
        &self.parts.objects
    }

    /// Returns the media; the first is the ambient one.
    pub fn media(&self) -> &[Medium] {
        &self.parts.media
    }

    /// Returns the divided volume of which all objects are faces.
    pub(crate) fn sole_partition(&self) -> Option<&Partition> {
        let [partition] = &self.parts.partitions[..] else {
            return None;
        };
        (partition.objects == (0..self.objects().len())).then_some(partition)
    }

    /// Returns true if a medium fluoresces.
    pub fn fluoresces(&self) -> bool {
        let mut all = self.media().iter().flat_map(Medium::fluorescences);
        all.next().is_some()
    }

    /// Returns a medium.
    pub fn medium(&self, id: MediumId) -> &Medium {
        &self.parts.media[id]
    }

    /// Returns the emitters.
    pub fn emitters(&self) -> &[Emitter] {
        &self.parts.emitters
    }

    /// Returns the region that each medium fills, in the order of [`Scene::media`].
    pub fn regions(&self) -> &[Region] {
        &self.regions
    }

    /// Returns true if surfaces divide a volume into several media.
    pub(crate) fn is_divided(&self) -> bool {
        !self.parts.partitions.is_empty()
    }

    /// Returns the sensor.
    pub fn sensor(&self) -> &Sensor {
        &self.parts.sensor
    }

    /// Returns the medium that the sensor is in.
    pub fn sensor_medium(&self) -> MediumId {
        self.sensor_medium
    }

    /// Returns the film.
    pub fn film(&self) -> &FilmSpec {
        &self.parts.film
    }

    /// Returns the tolerance of rays.
    pub fn tolerance(&self) -> Tolerance {
        self.parts.tolerance
    }

    /// Returns a ball that contains every object, the sensor and all emitters at finite distance.
    pub fn around(&self) -> &Surroundings {
        &self.around
    }

    /// Returns the optical path length and the numbers of reflections up to which connections are
    /// searched for.
    pub fn branch_reach(&self) -> &Reach {
        &self.reach
    }

    /// Returns true if no ray bends anywhere.
    pub fn is_straight(&self) -> bool {
        self.bending == Bending::None
    }

    /// Returns true if no medium attenuates light.
    pub(crate) fn is_clear(&self) -> bool {
        self.clear
    }

    /// Returns the ball that alone bends rays, if there is one.
    pub(crate) fn bending_ball(&self) -> Option<&BendingBall> {
        self.bending_ball.as_ref()
    }

    /// Returns the positions of point-like emitters, if any medium scatters their light. Near them,
    /// estimators must treat the 1/r² fall-off separately.
    pub(crate) fn point_like_emitters(&self) -> &[DVec3] {
        &self.point_like_emitters
    }

    /// Returns the ray from the centre of a beam, if the emitter is a beam.
    pub(crate) fn guide(&self, emitter: usize) -> Option<&Guide<MediumId>> {
        self.guides.get(emitter)?.as_ref()
    }

    /// Returns the index at a point of a medium.
    pub fn n(&self, medium: MediumId, x: DVec3) -> f64 {
        self.medium(medium).index.n(x)
    }

    /// Returns true if paths that leave the scene find no light, and some medium may scatter them
    /// before: see [`FirstVertexTechniques`](crate::render::FirstVertexTechniques).
    pub fn is_dark(&self) -> bool {
        self.environments().next().is_none() && self.media().iter().any(Medium::scatters)
    }

    /// Returns true if the scene has smooth dielectrics.
    pub(crate) fn has_dielectrics(&self) -> bool {
        self.objects()
            .iter()
            .any(|o| matches!(o.bsdf, Bsdf::Dielectric(_)))
    }
}

/// Returns the distance by which rays start off surfaces.
fn ray_epsilon(around: &Surroundings) -> f64 {
    RAY_EPSILON * (around.radius + around.center.length())
}

/// Sets the cones of fibres for the media in which the fibres end.
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

/// Returns a ball around everything at finite distance. If the scene has no extent, the radius is
/// in proportion to the distance from the origin, or 1 at the origin. Light does not depend on the
/// unit of length.
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
    let radius = f64::max(0.5 * all.diagonal() * 1.01, MIN_RADIUS * center.length());
    Surroundings {
        center,
        radius: if radius > 0.0 { radius } else { 1.0 },
    }
}
