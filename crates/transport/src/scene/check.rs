//! Checks of a scene with valid parts.

use super::Scene;
use super::lint::{self, Lint};
use super::parts::{AMBIENT, Object, Partition, Sides};
use crate::bsdf::Bsdf;
use crate::emitter::{Emitter, Fiber};
use crate::sampling::Sampler;
use crate::sensor::Sensor;
use crate::stop::Stop;
use eikonal::Aabb;
use eikonal::Shown;
use glam::DVec3;

/// Severity of a problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProblemSeverity {
    /// The scene cannot be rendered.
    Error,
    /// The scene can be rendered, but the picture may not be the intended one.
    Warning(Lint),
}

/// Part of the scene that a problem concerns; indices as in [`super::Parts`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// The scene as a whole.
    Scene,
    /// The sensor.
    Sensor,
    /// A medium.
    Medium(usize),
    /// An object.
    Object(usize),
    /// An emitter.
    Emitter(usize),
}

/// A problem of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneProblem {
    /// Severity of the problem.
    pub severity: ProblemSeverity,
    /// Part that the problem concerns.
    pub subject: Subject,
    /// Description of the problem.
    pub message: String,
    /// Description of the solution of the problem.
    pub help: String,
}

impl SceneProblem {
    /// Returns true if another problem concerns the same part and has the same solution, so that at
    /// most the numbers in the messages differ.
    pub(super) fn has_cause_of(&self, other: &SceneProblem) -> bool {
        (self.subject, &self.help) == (other.subject, &other.help)
    }
}

/// Jump of the index below which indices match up to rounding.
const INDEX_TOLERANCE: f64 = 1e-6;
/// Jump of the index below which facets of a rough dielectric scatter into cones of less than about
/// a degree.
const MIN_SCATTERING_JUMP: f64 = 1e-2;
/// Largest ratio, without a warning, of a wavelength of sound to the size of its medium, or of the
/// size to the wavelength.
const MAX_WAVELENGTH_RATIO: f64 = 1e3;
/// Number of points at which a surface is probed.
const SURFACE_PROBES: u64 = 64;
/// Number of rays of a beam with starts that are checked.
const BEAM_PROBES: u64 = 256;
/// Number of points per side at which a region is probed if its bounds are inconclusive.
const REGION_PROBES: usize = 33;

/// Returns all problems, errors first, or the problems found before `stop` was raised.
pub(super) fn check(scene: &Scene, stop: &Stop) -> Vec<SceneProblem> {
    let mut problems = Vec::new();
    let goes_on = |_: &usize| !stop.is_raised();
    for id in (0..scene.media().len()).take_while(goes_on) {
        problems.extend(check_index(scene, id));
        problems.extend(check_sound(scene, id));
        problems.extend(check_emission(scene, id));
    }
    for i in (0..scene.objects().len()).take_while(goes_on) {
        let object = &scene.objects()[i];
        problems.extend(check_sensor_outside(scene, object));
        problems.extend(check_emitter_surface(i, object));
        problems.extend(check_match(scene, i, object));
        problems.extend(check_facets(scene, i, object));
        problems.extend(check_closed(scene, i, object));
        problems.extend(check_exterior(scene, i, object));
    }
    problems.extend(check_emitters(scene));
    problems.sort_by_key(|p| p.severity != ProblemSeverity::Error);
    problems
}

pub(super) fn error(subject: Subject, message: String, help: &str) -> SceneProblem {
    SceneProblem {
        severity: ProblemSeverity::Error,
        subject,
        message,
        help: help.into(),
    }
}

impl SceneProblem {
    /// Makes a warning of a check.
    pub fn warning(
        lint: Lint,
        subject: Subject,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        SceneProblem {
            severity: ProblemSeverity::Warning(lint),
            subject,
            message: message.into(),
            help: help.into(),
        }
    }
}

/// Checks that light subpaths can start in a medium that emits.
fn check_emission(scene: &Scene, id: usize) -> Option<SceneProblem> {
    let medium = scene.medium(id);
    let found = medium.emission.is_none() || scene.parts.has_emitter(id);
    (!found).then(|| {
        error(
            Subject::Medium(id),
            format!("medium '{}' emits, but it has no bounds, or emits without bounds", medium.name),
            "fill closed shapes with it, or give it an extinction in a grid; its emission must be finite",
        )
    })
}

/// Checks that the index is positive wherever light can be.
fn check_index(scene: &Scene, id: usize) -> Option<SceneProblem> {
    let (medium, region) = (scene.medium(id), &scene.regions()[id]);
    let subject = Subject::Medium(id);
    if id == AMBIENT && !medium.index.is_constant() {
        return Some(error(
            subject,
            "the ambient medium's index varies in space, but it has no bounds".into(),
            "put the varying medium inside a closed shape",
        ));
    }
    let bounded = region.bounds.n2_min > 0.0 && region.bounds.n2_max < f64::INFINITY;
    if bounded || region.aabb.is_empty() {
        return None;
    }
    let (x, n2) = smallest_square(scene, id, &region.aabb)?;
    (!n2.is_finite() || n2 <= 0.0).then(|| {
        error(
            subject,
            format!(
                "the squared refractive index of medium '{}' is {} at {}; \
                 it must be positive and finite throughout the medium",
                medium.name,
                Shown::rounded(n2),
                Shown(x)
            ),
            "shrink the shape that holds the medium, or change the field's parameters",
        )
    })
}

/// Warns about a sound wave that is very long or very short compared with the medium, as wrong
/// units cause.
fn check_sound(scene: &Scene, id: usize) -> Option<SceneProblem> {
    let [shortest, longest] = scene.medium(id).index.sound_wavelengths()?;
    let size = scene.regions()[id].aabb.diagonal();
    if !(size.is_finite() && size > 0.0) {
        return None;
    }
    let length = match () {
        () if longest > MAX_WAVELENGTH_RATIO * size => longest,
        () if shortest * MAX_WAVELENGTH_RATIO < size => shortest,
        () => return None,
    };
    Some(SceneProblem::warning(
        lint::SOUND_WAVELENGTH,
        Subject::Medium(id),
        format!(
            "the sound in medium '{}' has a wavelength of {length:.3e}, but the medium is {size:.3e} across \
             (scene units)",
            scene.medium(id).name
        ),
        "check the units: frequency is in Hz, sound_speed in scene units per second (1.5e6 for water in \
         millimetres), wave_number in radians per scene unit",
    ))
}

/// Returns the sort key of an n²; values that no medium can have come first.
fn rank(n2: f64) -> f64 {
    if n2.is_finite() {
        n2
    } else {
        f64::NEG_INFINITY
    }
}

/// Returns the smallest n² among points of a grid inside the objects that hold a medium.
fn smallest_square(scene: &Scene, id: usize, aabb: &Aabb) -> Option<(DVec3, f64)> {
    let holders: Vec<&Object> = scene
        .objects()
        .iter()
        .filter(|o| o.interior() == Some(id) && o.shape.is_closed())
        .collect();
    let holds = |x: DVec3| holders.iter().any(|o| o.shape.contains(x));
    let n = REGION_PROBES;
    let at = |i: usize| (i as f64 + 0.5) / n as f64;
    (0..n * n * n)
        .map(|i| aabb.min + aabb.size() * DVec3::new(at(i % n), at(i / n % n), at(i / n / n)))
        .filter(|x| (holders.is_empty() || holds(*x)) && !scene.is_displaced(id, *x))
        .map(|x| (x, scene.medium(id).index.n2(x)))
        .min_by(|a, b| rank(a.1).total_cmp(&rank(b.1)))
}

fn check_sensor_outside(scene: &Scene, object: &Object) -> Option<SceneProblem> {
    let lined = matches!(object.bsdf, Bsdf::TwoSided(_)) || object.shape.has_flipped_normals();
    let inside = !matches!(scene.sensor(), Sensor::Absent(_))
        && object.bsdf.is_opaque()
        && !lined
        && object.shape.is_closed()
        && scene.sensor().positions().any(|x| object.shape.contains(x));
    inside.then(|| {
        error(
            Subject::Sensor,
            format!("the sensor is inside '{}', which is opaque", object.name),
            "move the sensor; for a room or a dome give the shape flip_normals, or a bsdf twosided; or a bsdf that lets light through",
        )
    })
}

fn check_emitter_surface(i: usize, object: &Object) -> Option<SceneProblem> {
    let specular = object.bsdf.is_delta() || object.bsdf.is_partial();
    (object.emitter.is_some() && specular).then(|| {
        error(
            Subject::Object(i),
            format!(
                "'{}' emits light from a specular, null, masked or thin surface",
                object.name
            ),
            "give the shape a diffuse bsdf (reflectance 0 for a black light)",
        )
    })
}

/// Returns the largest jump of the index across an object's boundary, at probes.
fn jump(scene: &Scene, object: &Object, sides: Sides) -> f64 {
    let probes = (0..SURFACE_PROBES).map(|k| {
        let x = object.shape.sample_area(Sampler::new(0, k, 0).next_2d());
        (scene.n(sides.interior, x.position) - scene.n(sides.exterior, x.position)).abs()
    });
    probes.fold(0.0, f64::max)
}

/// Warns about an index jump at a boundary that is declared index-matched because light passes it
/// straight on.
fn check_match(scene: &Scene, i: usize, object: &Object) -> Option<SceneProblem> {
    let passes = matches!(object.bsdf, Bsdf::Null) || object.bsdf.is_partial();
    let sides = object.sides.filter(|_| passes)?;
    let jump = jump(scene, object, sides);
    (jump > INDEX_TOLERANCE).then(|| {
        SceneProblem::warning(
            lint::INDEX_JUMP,
            Subject::Object(i),
            format!(
                "the boundary of '{}' is declared index-matched (bsdf null, mask or thindielectric), but the index \
                 jumps by up to {} across it",
                object.name,
                Shown::rounded(jump)
            ),
            "rays pass it without refraction; use a dielectric bsdf for a real surface",
        )
    })
}

/// Checks the indices at facets. Facets between equal indices pass all light straight on, which
/// connections do not find. Facets between nearly equal indices scatter into a narrow cone, which
/// connections rarely find.
fn check_facets(scene: &Scene, i: usize, object: &Object) -> Option<SceneProblem> {
    if !object.bsdf.is_rough_interface() {
        return None;
    }
    let jump = object.sides.map_or(0.0, |sides| jump(scene, object, sides));
    let help = "make its bsdf 'null', or give the sides indices that differ more";
    let subject = Subject::Object(i);
    let message = |what: &str| format!("the rough interface of '{}' {what}", object.name);
    match jump {
        j if j < INDEX_TOLERANCE => {
            let what = "has the same index on both sides: light passes it as if it were not there";
            Some(error(subject, message(what), help))
        }
        j if j < MIN_SCATTERING_JUMP => {
            let what = format!(
                "has nearly the same index on both sides, up to {j:.1e} apart: light passes it almost straight, and connections find it in rare, bright samples"
            );
            Some(SceneProblem::warning(
                lint::FAINT_INTERFACE,
                subject,
                message(&what),
                help,
            ))
        }
        _ => None,
    }
}

/// Returns the volume that an object divides with others.
fn partition_of(scene: &Scene, i: usize) -> Option<&Partition> {
    let mut partitions = scene.parts.partitions.iter();
    partitions.find(|p| p.objects.contains(&i))
}

/// Warns about a medium inside an open shape, dielectric or not.
fn check_closed(scene: &Scene, i: usize, object: &Object) -> Option<SceneProblem> {
    let sides = object.sides.filter(|s| s.interior != s.exterior)?;
    if object.shape.is_closed() || sides.interior == AMBIENT || partition_of(scene, i).is_some() {
        return None;
    }
    Some(SceneProblem::warning(
        lint::OPEN_SHAPE,
        Subject::Object(i),
        format!(
            "'{}' has medium '{}' on its inner side but does not enclose a volume",
            object.name,
            scene.medium(sides.interior).name
        ),
        "light may leave the medium without crossing a boundary; use a closed shape",
    ))
}

/// Checks that the declared exterior medium exists outside the shape. It must be the ambient
/// medium, or the medium of a closed shape around or beside this shape.
fn check_exterior(scene: &Scene, i: usize, object: &Object) -> Option<SceneProblem> {
    let partition = partition_of(scene, i);
    let exterior = partition.map_or(object.sides?.exterior, |p| p.exterior);
    let bounds = match partition {
        Some(p) => p.objects.start == i,
        None => object.shape.is_closed(),
    };
    if !bounds || exterior == AMBIENT {
        return None;
    }
    let around = |x| scene.containment().medium_around(i, x) == exterior;
    let beside = (0..SURFACE_PROBES).any(|k| {
        let sample = object.shape.sample_area(Sampler::new(1, k, 0).next_2d());
        let outward = if scene.is_inverted(i) {
            -sample.normal
        } else {
            sample.normal
        };
        let medium = scene.medium_beside(i, AMBIENT, sample.position, sample.normal, outward);
        match partition {
            Some(_) => around(sample.position),
            None => scene.geometry.overlapping[i] && medium == exterior,
        }
    });
    (!beside).then(|| {
        error(
            Subject::Object(i),
            format!(
                "medium '{}' is declared outside of '{}', but no closed shape around it holds that \
                 medium",
                scene.medium(exterior).name,
                object.name
            ),
            "put the shape inside a closed shape whose interior is that medium, or leave exterior out",
        )
    })
}

fn check_emitters(scene: &Scene) -> Vec<SceneProblem> {
    if scene.emitters().is_empty() {
        return vec![SceneProblem::warning(
            lint::NO_EMITTER,
            Subject::Scene,
            "the scene has no emitter: the picture will be black",
            "add an emitter",
        )];
    }
    let emitters = scene.emitters().iter().enumerate();
    emitters
        .filter_map(|(i, emitter)| match emitter {
            Emitter::Collimated(_) => check_beam(scene, i, emitter),
            Emitter::Fiber(fiber) => check_fiber(scene, i, fiber),
            Emitter::Directional { direction, .. } => check_direction(i, *direction),
            _ => None,
        })
        .collect()
}

/// Checks for unit length; connections along directions of other lengths miss their vertices.
fn check_direction(i: usize, direction: DVec3) -> Option<SceneProblem> {
    let off = (direction.length() - 1.0).abs();
    (off.is_nan() || off > 1e-12).then(|| {
        error(
            Subject::Emitter(i),
            format!(
                "the direction of parallel light has length {}",
                Shown(direction.length())
            ),
            "make it a unit vector",
        )
    })
}

/// Checks that light leaves a fibre within a hemisphere.
fn check_fiber(scene: &Scene, i: usize, fiber: &Fiber) -> Option<SceneProblem> {
    let medium = scene.medium_at(fiber.origin());
    (fiber.sin() > 1.0).then(|| {
        error(
            Subject::Emitter(i),
            format!(
                "the numerical aperture of the fibre is {} times the index of medium '{}', in which it ends",
                Shown::rounded(fiber.sin()),
                scene.medium(medium).name
            ),
            "give a numerical aperture up to that index, or a cutoff_angle",
        )
    })
}

/// Checks a beam. Connections assume that all of it starts in the medium of its centre, and need
/// its central ray.
fn check_beam(scene: &Scene, i: usize, beam: &Emitter) -> Option<SceneProblem> {
    let Some(guide) = scene.guide(i) else {
        return Some(error(
            Subject::Emitter(i),
            "the central ray of the beam circles in its medium forever, or leaves its field".into(),
            "move the beam, or check the medium that it starts in",
        ));
    };
    let medium = guide.start().region;
    let shape = |object: usize| &scene.objects()[object].shape;
    let starts = (0..BEAM_PROBES).filter_map(|k| {
        let mut sampler = Sampler::new(0, k, 0);
        let ([a, b], [c, d]) = (sampler.next_2d(), sampler.next_2d());
        let emission = beam.emit(scene.around(), shape, [a, b, c, d])?;
        Some(scene.medium_at(emission.x) != medium)
    });
    let (all, elsewhere) = starts.fold((0, 0), |(n, m), other| (n + 1, m + u32::from(other)));
    (elsewhere > 0).then(|| {
        SceneProblem::warning(
            lint::BEAM_ACROSS_MEDIA,
            Subject::Emitter(i),
            format!(
                "about {:.0} % of the beam starts outside of medium '{}', in which its centre starts: connections do not find this part of the light",
                (100.0 * f64::from(elsewhere) / f64::from(all)).max(1.0),
                scene.medium(medium).name
            ),
            "move the beam's origin back, or off the boundary, so that all of it starts in one medium",
        )
    })
}
