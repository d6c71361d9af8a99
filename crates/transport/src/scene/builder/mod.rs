//! Scenes built from their parts, by name and with defaults. Crate `morgana-io` makes [`Parts`]
//! from scene files without this builder.

mod checks;
mod emitter_checks;
mod error;
mod object;
mod sensor_checks;

pub use error::{BuildError, BuildProblem};
pub use object::ObjectBuilder;

use super::{AMBIENT, FilmSpec, MediumId, Object, Parts, ProblemSeverity, Scene, SceneProblem};
use super::{Sides, Subject};
use crate::Spectrum;
use crate::bsdf::{Bsdf, Diffuse};
use crate::emitter::Emitter;
use crate::film::Filter;
use crate::medium::Medium;
use crate::sensor::{Camera, Sensor};
use checks::Problems;
use eikonal::field::Constant;
use eikonal::{Aabb, Tolerance};
use glam::DAffine3;

/// Default reflectance of surfaces.
const REFLECTANCE: f64 = 0.5;

/// Builds a [`Scene`] from its parts: see [`Scene::builder`].
#[derive(Clone, Debug)]
pub struct SceneBuilder {
    media: Vec<Medium>,
    objects: Vec<ObjectBuilder>,
    emitters: Vec<Emitter>,
    view: Option<View>,
    film: FilmSpec,
    tolerance: Tolerance,
    reflections: u32,
    measured: Aabb,
}

/// Sensor of the scene.
#[derive(Clone, Debug)]
enum View {
    Camera(Camera),
    Sensor(Sensor),
}

impl Scene {
    /// Builds a scene from its parts. Media have names, by which objects refer to them. The ambient
    /// medium is a vacuum unless [`ambient`](SceneBuilder::ambient) sets another. The film has 256
    /// × 256 pixels and three channels unless [`film`](SceneBuilder::film) and
    /// [`channels`](SceneBuilder::channels) set others.
    ///
    /// ```
    /// use morgana_transport::eikonal::field::Luneburg;
    /// use morgana_transport::emitter::Emitter;
    /// use morgana_transport::integrator::PathTracer;
    /// use morgana_transport::medium::Medium;
    /// use morgana_transport::render::RenderOptions;
    /// use morgana_transport::scene::Object;
    /// use morgana_transport::sensor::Camera;
    /// use morgana_transport::shape::Sphere;
    /// use morgana_transport::Scene;
    ///
    /// let lens = Luneburg::new(1.0, [0.0; 3].into(), 1.0)?;
    /// let scene = Scene::builder()
    ///     .film(8, 8)
    ///     .camera(Camera::perspective([0.0, 0.0, -4.0], [0.0; 3], 40.0))
    ///     .medium(Medium::homogeneous("glass", lens, 0.5, 1.0)) // extinction 0.5 per unit length, albedo 1
    ///     .object(Object::builder("ball", Sphere::around([0.0; 3].into(), 1.0)?).interior("glass"))
    ///     .emitter(Emitter::constant(1.0))
    ///     .build()?;
    /// let rendering = scene.render(&RenderOptions::new(PathTracer::default(), 4, 0));
    /// let (mean, error) = rendering.film.summary();
    /// // White light from all around is the same inside and outside of what does not absorb.
    /// assert!((mean - 1.0).abs() < 4.0 * error + 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn builder() -> SceneBuilder {
        SceneBuilder {
            media: vec![Medium::transparent("ambient", Constant::new(1.0))],
            objects: Vec::new(),
            emitters: Vec::new(),
            view: None,
            film: FilmSpec {
                width: 256,
                height: 256,
                channels: 3,
                group_size: Spectrum::CHANNELS,
                filter: Filter::Box,
                window: None,
            },
            tolerance: Tolerance::default(),
            reflections: 0,
            measured: Aabb::EMPTY,
        }
    }
}

impl SceneBuilder {
    /// Sets the medium outside every shape, in place of a vacuum; its index must be constant.
    pub fn ambient(mut self, medium: Medium) -> Self {
        self.media[AMBIENT] = medium;
        self
    }

    /// Adds a medium, to which objects refer by its name.
    pub fn medium(mut self, medium: Medium) -> Self {
        self.media.push(medium);
        self
    }

    /// Adds an object.
    pub fn object(mut self, object: ObjectBuilder) -> Self {
        self.objects.push(object);
        self
    }

    /// Adds an emitter that covers no object. For an emitter on an object see
    /// [`ObjectBuilder::emission`].
    pub fn emitter(mut self, emitter: impl Into<Emitter>) -> Self {
        self.emitters.push(emitter.into());
        self
    }

    /// Adds a box in which to measure, such as the box of a [`MeterGrid`](crate::meter::MeterGrid),
    /// to the extent of the scene. Directional and environment light fills this box, too.
    pub fn measured(mut self, region: Aabb) -> Self {
        self.measured = self.measured.union(region);
        self
    }

    /// Sets the camera. A scene without camera or [`sensor`](SceneBuilder::sensor) is only for
    /// measurements ([`measure`](crate::render::measure)): its images have no meaning, because all
    /// pixels show the view from the origin.
    pub fn camera(mut self, camera: Camera) -> Self {
        self.view = Some(View::Camera(camera));
        self
    }

    /// Sets a sensor of any kind, in place of a [`camera`](SceneBuilder::camera). Its aspect ratio
    /// must equal the aspect ratio of the film.
    pub fn sensor(mut self, sensor: Sensor) -> Self {
        self.view = Some(View::Sensor(sensor));
        self
    }

    /// Sets the size of the image in pixels.
    pub fn film(mut self, width: usize, height: usize) -> Self {
        (self.film.width, self.film.height) = (width, height);
        self
    }

    /// Sets the number of spectral channels, 1 to [`Spectrum::CHANNELS`]; three are red, green and
    /// blue.
    pub fn channels(mut self, channels: usize) -> Self {
        self.film.channels = channels;
        self
    }

    /// Sets the reconstruction filter; the default is a box.
    pub fn filter(mut self, filter: Filter) -> Self {
        self.film.filter = filter;
        self
    }

    /// Sets the tolerance of rays.
    pub fn tolerance(mut self, tolerance: Tolerance) -> Self {
        self.tolerance = tolerance;
        self
    }

    /// Sets the largest number of reflections at smooth dielectrics that connections follow where
    /// refraction is possible; the default is 0.
    pub fn reflections(mut self, reflections: u32) -> Self {
        self.reflections = reflections;
        self
    }

    /// Builds the scene and checks it.
    ///
    /// # Errors
    /// All problems, each with the part and the parameter that it concerns.
    pub fn build(self) -> Result<Scene, BuildError> {
        let mut problems = Problems::default();
        problems.film(&self.film);
        problems.media(&self.media);
        problems.emitters(&self.emitters);
        let sensor = self.sensor_of_film(&mut problems);
        let (objects, lights) = self.placed(&mut problems);
        let objects = problems.checked(objects)?;
        let emitters: Vec<Emitter> = self.emitters.into_iter().chain(lights).collect();
        let parts = Parts {
            objects,
            partitions: Vec::new(),
            media: self.media,
            emitters,
            sensor,
            film: self.film,
            tolerance: self.tolerance,
            reflections: self.reflections,
            measured: self.measured,
        };
        let names = Names::of(&parts);
        Scene::new(parts).map_err(|problems| BuildError {
            problems: problems
                .into_iter()
                .filter_map(|p| names.problem(p))
                .collect(),
        })
    }

    fn sensor_of_film(&self, problems: &mut Problems) -> Sensor {
        let aspect = self.film.width as f64 / self.film.height as f64;
        match &self.view {
            None => Sensor::Absent(DAffine3::IDENTITY),
            Some(View::Sensor(sensor)) => {
                problems.sensor(sensor, aspect);
                sensor.clone()
            }
            Some(View::Camera(camera)) => camera.sensor(aspect).unwrap_or_else(|e| {
                problems.add("camera".into(), None, e.to_string());
                Sensor::Absent(DAffine3::IDENTITY)
            }),
        }
    }

    /// Returns the objects, and the emitters that cover them.
    fn placed(&self, problems: &mut Problems) -> (Vec<Object>, Vec<Emitter>) {
        let mut lights = Vec::new();
        let objects = self.objects.iter().enumerate().map(|(i, object)| {
            let emitter = object.emission.map(|radiance| {
                problems.emission(&object.name, radiance);
                lights.push(Emitter::Area {
                    object: i,
                    radiance,
                });
                self.emitters.len() + lights.len() - 1
            });
            Object {
                name: object.name.clone(),
                shape: object.shape.clone(),
                bsdf: surface(object),
                sides: self.sides(object, problems),
                emitter,
            }
        });
        (objects.collect(), lights)
    }

    fn sides(&self, object: &ObjectBuilder, problems: &mut Problems) -> Option<Sides> {
        if object.interior.is_none() && object.exterior.is_none() {
            return None;
        }
        let mut id = |parameter, name: &Option<String>| -> MediumId {
            let Some(name) = name else { return AMBIENT };
            let found = self.media.iter().position(|m| &m.name == name);
            found.unwrap_or_else(|| {
                problems.unknown_medium(&object.name, parameter, name, &self.media);
                AMBIENT
            })
        };
        Some(Sides {
            interior: id("interior", &object.interior),
            exterior: id("exterior", &object.exterior),
        })
    }
}

/// Returns the surface of an object, or its default.
fn surface(object: &ObjectBuilder) -> Bsdf {
    let diffuse = |reflectance: f64| {
        let diffuse = Diffuse::new(reflectance).expect("a reflectance in [0, 1]");
        Bsdf::Diffuse(diffuse)
    };
    match &object.bsdf {
        Some(bsdf) => bsdf.clone(),
        None if object.emission.is_some() => diffuse(0.0),
        None if object.interior.is_some() => Bsdf::Null,
        None => diffuse(REFLECTANCE),
    }
}

/// Names of the parts of a scene, for its problems.
struct Names {
    media: Vec<String>,
    objects: Vec<String>,
}

impl Names {
    fn of(parts: &Parts) -> Self {
        Names {
            media: parts.media.iter().map(|m| m.name.clone()).collect(),
            objects: parts.objects.iter().map(|o| o.name.clone()).collect(),
        }
    }

    /// Converts a problem of the scene to a problem of the builder; `None` for warnings, which are
    /// in [`Scene::warnings`].
    fn problem(&self, problem: SceneProblem) -> Option<BuildProblem> {
        let subject = match problem.subject {
            Subject::Scene => "scene".into(),
            Subject::Sensor => "sensor".into(),
            Subject::Medium(i) => format!("medium {:?}", self.media[i]),
            Subject::Object(i) => format!("object {:?}", self.objects[i]),
            Subject::Emitter(i) => format!("emitter {i}"),
        };
        (problem.severity == ProblemSeverity::Error).then(|| BuildProblem {
            subject,
            parameter: None,
            message: format!("{}; {}", problem.message, problem.help),
        })
    }
}
