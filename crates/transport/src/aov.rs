//! Arbitrary output variables: what becomes of a sensor ray that is not scattered.
//!
//! The ray is followed through index-matched and smooth boundaries to an opaque surface, or out of the
//! scene: then its *exit* is on the last boundary that it passed, or at its start if it met none.
//! Lengths, optical path difference and optical depth are those up to the exit.

use crate::path::{Ending, FollowedRay, Workspace, follow};
use crate::scene::{AMBIENT, MediumId, Scene};
use crate::sensor::SensorRay;
use eikonal::Reference;
use eikonal::connect::World;
use glam::{DAffine3, DVec3};

/// A quantity, or a vector of several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aov {
    /// 1; 0 if the ray is trapped or left its medium's field, or if no ray of the reference joins its ends. All other
    /// channels are 0 then.
    Valid,
    /// Position of the exit in the world, scene units.
    ExitPosition,
    /// Unit direction at the exit, in the world.
    ExitDirection,
    /// Angles in radians between the directions at the exit and at the start, along the sensor's local
    /// x and y axes: see [`deflection`].
    Deflection,
    /// ∫n ds up to the exit, scene units.
    OpticalLength,
    /// ∫ds up to the exit, scene units.
    ArcLength,
    /// ∫σ_t ds up to the exit, in the film's first channel.
    OpticalDepth,
    /// Number of steps of the ray, straight ones included.
    Steps,
    /// ∫n ds up to the exit, less that of rays of the reference, scene units: see
    /// [`PathDifference`](eikonal::PathDifference).
    OpticalPathDifference,
    /// The same in wavelengths.
    Waves,
}

impl Aov {
    /// All, in the order in which they are stored.
    pub const ALL: [Aov; 10] = [
        Aov::Valid,
        Aov::ExitPosition,
        Aov::ExitDirection,
        Aov::Deflection,
        Aov::OpticalLength,
        Aov::ArcLength,
        Aov::OpticalDepth,
        Aov::Steps,
        Aov::OpticalPathDifference,
        Aov::Waves,
    ];

    /// Name, as in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Aov::Valid => "valid",
            Aov::ExitPosition => "exit_position",
            Aov::ExitDirection => "exit_direction",
            Aov::Deflection => "deflection",
            Aov::OpticalLength => "optical_length",
            Aov::ArcLength => "arc_length",
            Aov::OpticalDepth => "optical_depth",
            Aov::Steps => "steps",
            Aov::OpticalPathDifference => "optical_path_difference",
            Aov::Waves => "waves",
        }
    }

    /// Names of its channels, as in images.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Aov::Valid => &["valid"],
            Aov::ExitPosition => &["exit.position.X", "exit.position.Y", "exit.position.Z"],
            Aov::ExitDirection => &["exit.direction.X", "exit.direction.Y", "exit.direction.Z"],
            Aov::Deflection => &["deflection.X", "deflection.Y"],
            Aov::OpticalLength => &["optical_length"],
            Aov::ArcLength => &["arc_length"],
            Aov::OpticalDepth => &["optical_depth"],
            Aov::Steps => &["steps"],
            Aov::OpticalPathDifference => &["optical_path_difference"],
            Aov::Waves => &["waves"],
        }
    }
}

/// The index of which a scene takes optical path differences.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReferenceIndex {
    /// The same everywhere, > 0.
    Constant(f64),
    /// That of a medium, which fills all of space for this.
    Medium(MediumId),
}

impl ReferenceIndex {
    /// What path differences are taken against.
    pub fn of(self, scene: &Scene) -> Reference<'_> {
        match self {
            ReferenceIndex::Constant(n) => Reference::Index(n),
            ReferenceIndex::Medium(medium) => Reference::Field(scene.field(medium)),
        }
    }
}

/// Follows sensor rays without scattering. Validity is always among its channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AovTracer {
    wanted: [bool; Aov::ALL.len()],
    /// The index of which optical path differences are taken; without one that of the surroundings where rays start.
    pub reference: Option<ReferenceIndex>,
    /// Wavelength in vacuum, scene units, by which waves are counted.
    pub wavelength: Option<f64>,
}

impl Default for AovTracer {
    /// All quantities, but for waves, which need a wavelength.
    fn default() -> Self {
        AovTracer::new(&Aov::ALL)
    }
}

impl AovTracer {
    /// The given quantities, in any order, and validity. There are no waves without a wavelength.
    pub fn new(wanted: &[Aov]) -> Self {
        let is_wanted = |aov: Aov| aov == Aov::Valid || wanted.contains(&aov);
        AovTracer {
            wanted: Aov::ALL.map(is_wanted),
            reference: None,
            wavelength: None,
        }
    }

    /// The quantities, in the order of [`Aov::ALL`].
    pub fn aovs(&self) -> impl Iterator<Item = Aov> {
        let all = Aov::ALL.into_iter().zip(self.wanted);
        let is_known = |aov| aov != Aov::Waves || self.wavelength.is_some();
        all.filter_map(move |(aov, wanted)| (wanted && is_known(aov)).then_some(aov))
    }

    /// Names of its channels, in the order of [`Aov::ALL`].
    pub fn channels(&self) -> impl Iterator<Item = &'static str> {
        self.aovs().flat_map(|aov| aov.channels()).copied()
    }

    /// The reference of optical path differences, if they are wanted.
    fn reference<'a>(&self, scene: &'a Scene, x: DVec3) -> Option<Reference<'a>> {
        let compares = |aov| matches!(aov, Aov::OpticalPathDifference | Aov::Waves);
        let surroundings = || ReferenceIndex::Constant(scene.n(AMBIENT, x));
        let reference = || self.reference.unwrap_or_else(surroundings).of(scene);
        self.aovs().any(compares).then(reference)
    }

    /// The values of a sensor ray, one for each channel; all zero if the ray is lost, which is counted.
    pub fn sample(&self, scene: &Scene, ray: SensorRay, ws: &mut Workspace, out: &mut Vec<f64>) {
        let medium = scene.medium_of_sensor_ray(ray.origin);
        let reference = self.reference(scene, ray.origin);
        let followed = follow(scene, ray.origin, ray.direction, medium, reference, ws);
        if followed.ending == Ending::Lost {
            return out.resize(out.len() + self.channels().count(), 0.0);
        }
        for aov in self.aovs() {
            let values = self.values(aov, &followed, scene.sensor().to_world(), ray.direction);
            out.extend(&values[..aov.channels().len()]);
        }
    }

    /// The values of a quantity for a ray that was followed; of these as many count as it has channels.
    fn values(&self, aov: Aov, ray: &FollowedRay, to_world: &DAffine3, entry: DVec3) -> [f64; 3] {
        let one = |value| [value, 0.0, 0.0];
        match aov {
            Aov::Valid => one(1.0),
            Aov::ExitPosition => ray.x.to_array(),
            Aov::ExitDirection => ray.direction.to_array(),
            Aov::Deflection => {
                let [x, y] = deflection(to_world, entry, ray.direction);
                [x, y, 0.0]
            }
            Aov::OpticalLength => one(ray.optical_length),
            Aov::ArcLength => one(ray.length),
            Aov::OpticalDepth => one(ray.depth[0]),
            Aov::Steps => one(ray.steps as f64),
            Aov::OpticalPathDifference => one(ray.path_difference),
            Aov::Waves => one(ray.path_difference / self.wavelength.unwrap_or(1.0)),
        }
    }
}

/// How far a ray that started in the unit direction `entry` and ends in `exit` has turned towards the
/// sensor's local x and y axes.
///
/// With a and b these axes made orthogonal to the entry direction d, x first, and to one another, the
/// angles are atan2(exit·a, exit·d) and atan2(exit·b, exit·d): those of the projections of the exit
/// direction on the planes of d and a, and of d and b.
pub fn deflection(to_world: &DAffine3, entry: DVec3, exit: DVec3) -> [f64; 2] {
    let across = |v: DVec3, u: DVec3| v - u * v.dot(u);
    let a = across(to_world.matrix3.x_axis, entry).normalize_or_zero();
    let b = across(across(to_world.matrix3.y_axis, entry), a).normalize_or_zero();
    [a, b].map(|axis| exit.dot(axis).atan2(exit.dot(entry)))
}
