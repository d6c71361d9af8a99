//! The scene: immutable, and valid by construction.

mod check;
mod group;
mod light_bounds;
mod lights;
mod period;
mod regions;
mod world;

pub use check::{SceneProblem, Severity, Subject};
pub(crate) use light_bounds::Receiver;
pub use regions::{GlassBall, Region};

use crate::Spectrum;
use crate::bsdf::Bsdf;
use crate::connection_end::{ConnectionEnd, OnSurface};
use crate::emitter::{Class, Emitter, Surroundings};
use crate::film::Filter;
use crate::medium::Medium;
use crate::sampling::Replicates;
use crate::sensor::Sensor;
use crate::shape::{Accel, Shape};
use eikonal::connect::{Guide, Pattern, RayFamily, Reach, Start, World};
use eikonal::{Aabb, Tolerance};
use glam::DVec3;
use lights::Lights;

/// Index of a medium in [`Scene::media`].
pub type MediumId = usize;

/// The medium outside every shape that does not say otherwise.
pub const AMBIENT: MediumId = 0;

/// A shape with its surface properties and what lies on either side of it.
#[derive(Clone, Debug)]
pub struct Object {
    /// Name used in messages.
    pub name: String,
    /// Geometry.
    pub shape: Shape,
    /// Surface scattering.
    pub bsdf: Bsdf,
    /// What lies on either side; `None` if it is the same medium, whichever that is.
    pub sides: Option<Sides>,
    /// Index of the emitter that covers it.
    pub emitter: Option<usize>,
}

impl Object {
    /// Whether rays pass on a deterministic way: connections go through such a surface.
    pub fn is_interface(&self) -> bool {
        matches!(self.bsdf, Bsdf::Null | Bsdf::Dielectric(_))
    }

    /// The medium inside, if the surface separates media.
    pub fn interior(&self) -> Option<MediumId> {
        self.sides.map(|s| s.interior)
    }
}

/// The media on the two sides of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sides {
    /// Inside a closed shape, whichever way its normals point; behind the normal of an open one.
    pub interior: MediumId,
    /// On the other side.
    pub exterior: MediumId,
}

/// The size of the picture and how samples are weighted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmSpec {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Number of spectral channels.
    pub channels: usize,
    /// Number of channels that share their paths, 1 to [`Spectrum::CHANNELS`]: one where the index depends on
    /// the wavelength.
    pub group_size: usize,
    /// Reconstruction filter.
    pub filter: Filter,
}

impl FilmSpec {
    /// Number of groups of channels, each with a scene and paths of its own.
    pub fn groups(&self) -> usize {
        self.channels.div_ceil(self.group_size)
    }

    /// Number of channels in a group.
    pub fn channels_of(&self, group: usize) -> usize {
        (self.channels - group * self.group_size).min(self.group_size)
    }
}

/// Everything that a scene is made of.
#[derive(Clone, Debug)]
pub struct Parts {
    /// Objects.
    pub objects: Vec<Object>,
    /// Media; the first is the ambient one, whose index must be constant.
    pub media: Vec<Medium>,
    /// Emitters.
    pub emitters: Vec<Emitter>,
    /// Sensor.
    pub sensor: Sensor,
    /// Film.
    pub film: FilmSpec,
    /// Tolerance of rays.
    pub tolerance: Tolerance,
    /// Connections are looked for through at most this many reflections at smooth dielectrics where
    /// refraction is possible; total reflections are not counted.
    pub reflections: u32,
}

/// A scene that can be rendered.
#[derive(Debug)]
pub struct Scene {
    parts: Parts,
    all: Index,
    interfaces: Index,
    partial: Index,
    blockers: Index,
    regions: Vec<Region>,
    sensor_medium: MediumId,
    lights: Lights,
    around: Surroundings,
    /// See [`World::ray_epsilon`].
    ray_epsilon: f64,
    /// Whether nothing takes any light between surfaces.
    clear: bool,
    reach: Reach,
    bending: Bending,
    glass_ball: Option<GlassBall>,
    point_like_emitters: Vec<DVec3>,
    /// Objects that touch, overlap or hold others: what lies beside their surfaces varies.
    overlapping: Vec<bool>,
    /// For each emitter that is a beam, where it goes.
    guides: Vec<Option<Guide<MediumId>>>,
    warnings: Vec<SceneProblem>,
    /// How samples of a pixel belong together.
    replicates: Replicates,
    /// The scene at later instants of the sound's period.
    later: Vec<Scene>,
}

/// Some of the objects, for intersection tests.
#[derive(Debug)]
struct Index {
    objects: Vec<usize>,
    /// Where each object is in the list.
    places: Vec<Option<usize>>,
    shapes: Vec<Shape>,
    accel: Accel,
}

impl Index {
    fn new(objects: &[Object], keep: impl Fn(&Object) -> bool) -> Self {
        let all = objects.len();
        let (objects, shapes): (Vec<usize>, Vec<Shape>) = objects
            .iter()
            .enumerate()
            .filter(|(_, o)| keep(o))
            .map(|(i, o)| (i, o.shape.clone()))
            .unzip();
        let mut places = vec![None; all];
        for (place, object) in objects.iter().enumerate() {
            places[*object] = Some(place);
        }
        Index {
            accel: Accel::new(&shapes),
            objects,
            places,
            shapes,
        }
    }

    /// The place of an object in the list, if it is there.
    fn place(&self, object: Option<usize>) -> Option<usize> {
        self.places[object?]
    }
}

impl Scene {
    /// Puts a scene together and checks it.
    ///
    /// # Errors
    /// Everything that is wrong with it, errors first.
    pub fn new(parts: Parts) -> Result<Self, Vec<SceneProblem>> {
        let around = surroundings(&parts);
        let regions = regions::survey(&parts, &around);
        let sensor_medium = medium_at(&parts.objects, parts.sensor.position());
        let overlapping = overlapping(&parts.objects, around.radius * 1e-9);
        let mut scene = Scene {
            guides: Vec::new(),
            warnings: Vec::new(),
            later: Vec::new(),
            replicates: Replicates::default(),
            all: Index::new(&parts.objects, |_| true),
            interfaces: Index::new(&parts.objects, Object::is_interface),
            partial: Index::new(&parts.objects, |o| o.bsdf.is_partial()),
            blockers: Index::new(&parts.objects, |o| {
                !o.is_interface() && !o.bsdf.is_partial()
            }),
            lights: Lights::new(&parts, &around),
            regions,
            point_like_emitters: point_like_emitters(&parts),
            glass_ball: regions::glass_ball(&parts, &overlapping),
            overlapping,
            reach: Reach {
                optical_length: REACH * around.radius,
                reflections: parts.reflections,
                bounces: parts.reflections + TOTAL_REFLECTIONS,
            },
            bending: Bending::of(&parts),
            sensor_medium,
            ray_epsilon: 1e-10 * (around.radius + around.center.length()),
            clear: parts.media.iter().all(Medium::is_transparent),
            around,
            parts,
        };
        scene.guides = guides(&scene);
        let problems = check::check(&scene);
        if problems.iter().any(|p| p.severity == Severity::Error) {
            return Err(problems);
        }
        scene.warnings = problems;
        Ok(scene)
    }

    /// The scene, to be rendered by samples in replicates where estimators can ([`Integrator::replicates`]).
    ///
    /// [`Integrator::replicates`]: crate::integrator::Integrator::replicates
    pub fn in_replicates(self, replicates: Replicates) -> Self {
        Scene { replicates, ..self }
    }

    /// How samples of a pixel are to belong together.
    pub fn replicates(&self) -> Replicates {
        self.replicates
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

    /// Whether it is known that no two rays connect two points, given with their media: all rays are
    /// straight, or both points are in the only medium that bends rays, which is convex, so that no ray that
    /// leaves it returns, and [certified](eikonal::Uniqueness).
    pub fn is_unique(&self, (x, medium): (DVec3, MediumId), (y, other): (DVec3, MediumId)) -> bool {
        match self.bending {
            Bending::None => true,
            Bending::One(id) if id == medium && id == other => {
                let certificate = self.regions[id].uniqueness.as_ref();
                certificate
                    .is_some_and(|u| u.whole_medium() || u.pair(&self.medium(id).index, x, y))
            }
            _ => false,
        }
    }

    /// The smooth ball that is all that bends rays, if that is so.
    pub(crate) fn glass_ball(&self) -> Option<&GlassBall> {
        self.glass_ball.as_ref()
    }

    /// The medium at an aim that is a point, if [`Scene::is_unique`] could make use of it.
    pub(crate) fn medium_of_aim(&self, aim: &ConnectionEnd) -> Option<MediumId> {
        match (self.bending, aim) {
            (Bending::One(_), ConnectionEnd::Point { position, .. }) => {
                Some(self.medium_at(*position))
            }
            _ => None,
        }
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

    /// The innermost medium that surrounds a point.
    pub fn medium_at(&self, x: DVec3) -> MediumId {
        medium_at(&self.parts.objects, x)
    }

    /// The medium beside an object's surface at `x`, on the side to which `direction` points, for a ray
    /// that arrives through `current`.
    ///
    /// Where closed objects touch, overlap or hold one another, containment decides, so that a ray
    /// that leaves one layer enters the next one.
    pub fn medium_beside(
        &self,
        object: usize,
        current: MediumId,
        (x, normal): (DVec3, DVec3),
        direction: DVec3,
    ) -> MediumId {
        let side = normal.dot(direction);
        match self.objects()[object].sides {
            None => current,
            Some(_) if self.overlapping[object] => {
                self.medium_at(x + normal * (2.0 * self.ray_epsilon()).copysign(side))
            }
            Some(sides) if (side > 0.0) != self.is_inverted(object) => sides.exterior,
            Some(sides) => sides.interior,
        }
    }

    /// Whether the normals of a closed object point inwards.
    fn is_inverted(&self, object: usize) -> bool {
        let shape = &self.objects()[object].shape;
        shape.is_closed() && shape.has_flipped_normals()
    }

    /// The medium in which a sensor ray starts.
    pub(crate) fn medium_of_sensor_ray(&self, origin: DVec3) -> MediumId {
        match self.sensor() {
            Sensor::Perspective(_) | Sensor::Absent(_) => self.sensor_medium,
            _ => self.medium_at(origin),
        }
    }

    /// The index at a point of a medium.
    pub fn n(&self, medium: MediumId, x: DVec3) -> f64 {
        self.medium(medium).index.n(x)
    }

    /// Power of each emitter in the first so many channels, and none in the others.
    pub fn powers(&self, channels: usize) -> impl Iterator<Item = Spectrum> {
        let white = Spectrum(std::array::from_fn(|c| f64::from(u8::from(c < channels))));
        let shape = |object: usize| &self.objects()[object].shape;
        let emitters = self.emitters().iter();
        emitters.map(move |e| e.power(self.around(), shape) * white)
    }

    /// The classes that the emitters belong to.
    pub(crate) fn classes(&self) -> impl Iterator<Item = Class> + '_ {
        self.lights.classes()
    }

    /// Chooses an emitter of a class that has some for a receiver to be connected to: its index and the
    /// probability of the choice.
    pub(crate) fn choose_emitter(&self, class: Class, receiver: &Receiver, u: f64) -> (usize, f64) {
        self.lights.choose(class, (self.emitters(), receiver), u)
    }

    /// Probability that [`Scene::choose_emitter`] chooses `emitter` among those of its class.
    pub(crate) fn emitter_probability(&self, emitter: usize, receiver: &Receiver) -> f64 {
        self.lights.probability(emitter, self.emitters(), receiver)
    }

    /// Chooses an emitter for a light subpath to start from: its index and the probability of the choice.
    pub(crate) fn choose_source(&self, u: f64) -> Option<(usize, f64)> {
        let pick = self.lights.sources()?.sample(u);
        Some((pick.index, pick.probability))
    }

    /// Probability that [`Scene::choose_source`] chooses `emitter`.
    pub(crate) fn source_probability(&self, emitter: usize) -> f64 {
        self.lights.sources().map_or(0.0, |s| s.pdf(emitter))
    }

    /// Whether paths that leave the scene find no light, and may be scattered before: see
    /// [`FirstVertexTechniques`](crate::path::FirstVertexTechniques).
    pub fn is_dark(&self) -> bool {
        self.environments().next().is_none() && self.media().iter().any(Medium::scatters)
    }

    /// Whether there are smooth dielectrics.
    pub(crate) fn has_dielectrics(&self) -> bool {
        self.objects()
            .iter()
            .any(|o| matches!(o.bsdf, Bsdf::Dielectric(_)))
    }

    /// The environments and their indices.
    pub(crate) fn environments(
        &self,
    ) -> impl Iterator<Item = (usize, &crate::emitter::Environment)> {
        let emitters = self.parts.emitters.iter().enumerate();
        emitters.filter_map(|(i, e)| match e {
            Emitter::Environment(e) => Some((i, e)),
            _ => None,
        })
    }

    /// The emitter that covers a surface, the radiance that leaves it in `direction`, and the density per unit
    /// area with which aims choose the point; `None` where no light leaves.
    pub(crate) fn emitted(
        &self,
        on: &OnSurface,
        direction: DVec3,
    ) -> Option<(usize, Spectrum, f64)> {
        let object = &self.objects()[on.object];
        let emitter = object.emitter?;
        let (radiance, pdf) = self.emitters()[emitter].on_surface(&object.shape, &on.site)?;
        let shines = on.normal.dot(direction) > 0.0 && !radiance.is_zero();
        shines.then_some((emitter, radiance, pdf))
    }
}

/// The innermost closed object around a point decides: the one with the smallest box.
pub fn medium_at<'a>(objects: impl IntoIterator<Item = &'a Object>, x: DVec3) -> MediumId {
    objects
        .into_iter()
        .filter_map(|o| Some((o.interior()?, &o.shape)))
        .filter(|(_, shape)| shape.is_closed() && shape.contains(x))
        .min_by(|(_, a), (_, b)| a.aabb().diagonal().total_cmp(&b.aabb().diagonal()))
        .map_or(AMBIENT, |(medium, _)| medium)
}

/// Whether each object is closed, separates media, and comes near another one that does.
fn overlapping(objects: &[Object], margin: f64) -> Vec<bool> {
    let matters = |o: &Object| o.sides.is_some() && o.shape.is_closed();
    let near = |a: &Object, b: &Object| a.shape.aabb().grown(margin).overlaps(&b.shape.aabb());
    let others = |i: usize| objects.iter().enumerate().filter(move |(k, _)| *k != i);
    objects
        .iter()
        .enumerate()
        .map(|(i, o)| matters(o) && others(i).any(|(_, b)| matters(b) && near(o, b)))
        .collect()
}

/// What bends rays in a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Bending {
    /// Nothing.
    None,
    /// The index of one medium only.
    One(MediumId),
    /// Smooth interfaces, or several media.
    Several,
}

impl Bending {
    fn of(parts: &Parts) -> Self {
        let bends = |o: &Object| matches!(o.bsdf, Bsdf::Dielectric(_));
        let curved = |id: &MediumId| !parts.media[*id].index.is_constant();
        let mut curved = (0..parts.media.len()).filter(curved);
        match (curved.next(), curved.next()) {
            _ if parts.objects.iter().any(bends) => Bending::Several,
            (None, _) => Bending::None,
            (Some(id), None) => Bending::One(id),
            _ => Bending::Several,
        }
    }
}

/// Beams are followed, and branches looked for, over this many radii of the scene in optical path
/// length: enough for several bounces inside a tank.
const REACH: f64 = 20.0;
/// Branches are looked for through this many total reflections. Inside a glass ball there is no end
/// of branches that run along its surface from one to the next; each is ever harder to find.
pub const TOTAL_REFLECTIONS: u32 = 3;

fn guides(scene: &Scene) -> Vec<Option<Guide<MediumId>>> {
    let guide = |emitter: &Emitter| match emitter {
        Emitter::Collimated(beam) => {
            let start = Start {
                family: RayFamily::Plane {
                    x: beam.origin(),
                    direction: beam.direction(),
                },
                region: scene.medium_at(beam.origin()),
                optical_length: scene.reach.optical_length,
                pattern: Pattern::REFRACT,
            };
            Guide::new(scene, start, scene.tolerance()).ok()
        }
        _ => None,
    };
    scene.emitters().iter().map(guide).collect()
}

fn point_like_emitters(parts: &Parts) -> Vec<DVec3> {
    if !parts.media.iter().any(Medium::scatters) {
        return Vec::new();
    }
    parts
        .emitters
        .iter()
        .filter_map(Emitter::singularity)
        .collect()
}

fn surroundings(parts: &Parts) -> Surroundings {
    let shapes = parts.objects.iter().map(|o| o.shape.aabb());
    let points = parts.emitters.iter().filter_map(|e| match e {
        Emitter::Collimated(beam) => Some(beam.origin()),
        e => e.singularity(),
    });
    let points = points.chain([parts.sensor.position()]);
    let all = shapes.fold(Aabb::EMPTY, Aabb::union);
    let all = points.fold(all, Aabb::include);
    Surroundings {
        center: all.center(),
        radius: f64::max(
            0.5 * all.diagonal() * 1.01,
            1e-3 * (1.0 + all.center().length()),
        ),
    }
}
