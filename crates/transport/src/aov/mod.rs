//! Arbitrary output variables: quantities of a sensor ray without scattering, and of the first
//! surface that it meets.
//!
//! The ray is followed through index-matched and smooth boundaries to an opaque surface, or out of
//! the scene. If the ray leaves the scene, its *exit* is on the last boundary that it passed, or at
//! its start if it passed none. Lengths, optical path difference and optical depth are measured up
//! to the exit.
//!
//! The first surface is the first boundary that is not null. Smooth dielectrics count as surfaces.

mod quantity;
mod surface;

pub use quantity::Aov;

use crate::path::{FollowedRay, TraceEnding, Workspace, follow, see};
use crate::scene::{AMBIENT, MediumId, Scene};
use crate::sensor::SensorRay;
use eikonal::Reference;
use eikonal::connect::World;
use glam::{DAffine3, DVec3};

/// Reference index of a scene's optical path differences.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReferenceIndex {
    /// Constant index, > 0.
    Constant(f64),
    /// Index of a medium, which is taken to fill all of space.
    Medium(MediumId),
}

impl ReferenceIndex {
    /// Returns the reference of path differences in a scene.
    pub fn of(self, scene: &Scene) -> Reference<'_> {
        match self {
            ReferenceIndex::Constant(n) => Reference::Index(n),
            ReferenceIndex::Medium(medium) => Reference::Field(scene.field(medium)),
        }
    }
}

/// Traces sensor rays without scattering. Its channels include validity, unless all requested
/// quantities describe first surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AovTracer {
    wanted: [bool; Aov::ALL.len()],
    /// Reference of optical path differences; `None` for the index of the surroundings where rays
    /// start.
    pub reference: Option<ReferenceIndex>,
    /// Wavelength in vacuum, in scene units, by which path differences are divided to count waves.
    pub wavelength: Option<f64>,
}

impl Default for AovTracer {
    /// Requests all quantities of rays' paths, except waves, which need a wavelength.
    fn default() -> Self {
        let of_ways: Vec<Aov> = Aov::ALL
            .into_iter()
            .filter(|a| !a.is_of_surface())
            .collect();
        AovTracer::new(&of_ways)
    }
}

impl AovTracer {
    /// Requests the given quantities, in any order, and validity unless all of them describe first
    /// surfaces. Waves are left out as long as there is no wavelength.
    pub fn new(wanted: &[Aov]) -> Self {
        let of_ways = wanted.is_empty() || wanted.iter().any(|aov| !aov.is_of_surface());
        let is_wanted = |aov: Aov| (of_ways && aov == Aov::Valid) || wanted.contains(&aov);
        AovTracer {
            wanted: Aov::ALL.map(is_wanted),
            reference: None,
            wavelength: None,
        }
    }

    /// Returns the quantities, in the order of [`Aov::ALL`].
    pub fn aovs(&self) -> impl Iterator<Item = Aov> {
        let all = Aov::ALL.into_iter().zip(self.wanted);
        let is_known = |aov| aov != Aov::Waves || self.wavelength.is_some();
        all.filter_map(move |(aov, wanted)| (wanted && is_known(aov)).then_some(aov))
    }

    /// Returns the names of all channels, in the order of [`Aov::ALL`].
    pub fn channels(&self) -> impl Iterator<Item = &'static str> {
        self.aovs().flat_map(|aov| aov.channels()).copied()
    }

    /// Returns the reference of optical path differences, if they are requested.
    fn reference<'a>(&self, scene: &'a Scene, x: DVec3) -> Option<Reference<'a>> {
        let compares = |aov| matches!(aov, Aov::OpticalPathDifference | Aov::Waves);
        let surroundings = || ReferenceIndex::Constant(scene.n(AMBIENT, x));
        let reference = || self.reference.unwrap_or_else(surroundings).of(scene);
        self.aovs().any(compares).then(reference)
    }

    /// Returns true if any quantity depends on the path of rays beyond their first surface.
    fn goes_on(&self) -> bool {
        self.aovs().any(|aov| !aov.is_of_surface())
    }

    /// Appends the values of a sensor ray to `out`, one for each channel. Values of the path are
    /// zero if the ray is lost, which is counted. Values of the first surface are zero if the ray
    /// meets none.
    pub fn sample(&self, scene: &Scene, ray: SensorRay, ws: &mut Workspace, out: &mut Vec<f64>) {
        let medium = scene.medium_of_sensor_ray(ray.origin);
        let followed = if self.goes_on() {
            let reference = self.reference(scene, ray.origin);
            follow(scene, ray.origin, ray.direction, medium, reference, ws)
        } else {
            see(scene, ray.origin, ray.direction, medium, ws)
        };
        for aov in self.aovs() {
            let values = if aov.is_of_surface() {
                let seen = followed.seen.as_ref();
                seen.map_or([0.0; 3], |seen| surface::values(aov, scene, seen))
            } else if followed.ending == TraceEnding::Lost {
                [0.0; 3]
            } else {
                self.values(aov, &followed, scene, &ray)
            };
            out.extend(&values[..aov.channels().len()]);
        }
    }

    /// Returns the values of a quantity of a traced ray. Only as many are used as the quantity has
    /// channels.
    fn values(&self, aov: Aov, ray: &FollowedRay, scene: &Scene, start: &SensorRay) -> [f64; 3] {
        let one = |value| [value, 0.0, 0.0];
        match aov {
            Aov::Valid => one(1.0),
            Aov::ExitPosition => ray.x.to_array(),
            Aov::ExitDirection => ray.direction.to_array(),
            Aov::Deflection => {
                let to_world = scene.sensor().to_world();
                let [x, y] = deflection(to_world, start.direction, ray.direction);
                [x, y, 0.0]
            }
            Aov::Displacement => {
                let [x, y] = displacement(scene, start, ray).unwrap_or_default();
                [x, y, 0.0]
            }
            Aov::OpticalLength => one(ray.optical_length),
            Aov::ArcLength => one(ray.length),
            Aov::OpticalDepth => one(ray.depth[0]),
            Aov::Steps => one(ray.steps as f64),
            Aov::OpticalPathDifference => one(ray.path_difference),
            Aov::Waves => one(ray.path_difference / self.wavelength.unwrap_or(1.0)),
            // Quantities of the first surface are computed in `surface`.
            _ => [0.0; 3],
        }
    }
}

/// Returns the angles by which a ray has turned towards the sensor's local x and y axes. It started
/// in the unit direction `entry` and ends in `exit`.
///
/// Let a and b be these axes, made orthogonal to the entry direction d, x first, and to one
/// another. The angles are atan2(exit·a, exit·d) and atan2(exit·b, exit·d). They are the angles of
/// the projections of the exit direction onto the planes of d and a, and of d and b.
pub fn deflection(to_world: &DAffine3, entry: DVec3, exit: DVec3) -> [f64; 2] {
    let across = |v: DVec3, u: DVec3| v - u * v.dot(u);
    let a = across(to_world.matrix3.x_axis, entry).normalize_or_zero();
    let b = across(across(to_world.matrix3.y_axis, entry), a).normalize_or_zero();
    [a, b].map(|axis| exit.dot(axis).atan2(exit.dot(entry)))
}

/// Returns the apparent displacement of the point where a ray ends, relative to straight rays, in
/// pixels to the right and downwards. Background-oriented schlieren measures this displacement
/// (docs/theory.md#displacement). A ray that leaves the scene sees a background at infinity.
/// Returns `None` for a batch of sensors, for parallel rays that leave the scene, and if the sensor
/// would not see a straight ray. sensors, for parallel rays that leave the scene, and where a
/// straight ray would not be in view of the sensor.
fn displacement(scene: &Scene, start: &SensorRay, ray: &FollowedRay) -> Option<[f64; 2]> {
    let sensor = scene.sensor();
    let straight = match (ray.ending, sensor.is_parallel()) {
        (TraceEnding::Surface(_), false) => {
            let seen = ray.x - start.origin;
            sensor.sense(start.origin, seen.try_normalize()?)
        }
        (TraceEnding::Surface(_), true) => sensor.sense(ray.x, start.direction),
        (TraceEnding::Left, false) => sensor.sense(start.origin, ray.direction),
        (TraceEnding::Left, true) | (TraceEnding::Length | TraceEnding::Lost, _) => None,
    };
    let (curved, straight) = (sensor.sense(start.origin, start.direction)?, straight?);
    let film = scene.film();
    let size = film
        .window
        .map_or([film.width, film.height], |window| window.image);
    Some(std::array::from_fn(|axis| {
        (curved.image[axis] - straight.image[axis]) * size[axis] as f64
    }))
}
