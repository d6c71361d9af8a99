//! Check for light that an estimator does not find. Connections do not follow every edge; light is
//! missing where no other technique finds an edge.

use crate::diagnostic::lints;
use transport::bsdf::Bsdf;
use transport::emitter::{Class, Emitter};
use transport::integrator::{Integrator, RequiredConnection};
use transport::scene::{MAX_TOTAL_REFLECTIONS, Object, Scene, SceneProblem, Subject};
use transport::sensor::Sensor;

/// Surfaces of a scene that reflect light along paths which connections do not follow.
#[derive(Clone, Copy, Debug)]
pub struct SpecularSurfaces<'a> {
    /// Mirror, such as smooth metal: connections are not reflected there.
    pub mirror: Option<&'a Object>,
    /// Smooth dielectric: connections are reflected there a limited number of times.
    pub dielectric: Option<&'a Object>,
    /// Maximum number of reflections, not counting total reflections.
    pub reflections: u32,
}

impl<'a> SpecularSurfaces<'a> {
    /// Returns the surfaces of a scene.
    pub fn of(scene: &'a Scene) -> Self {
        let first = |is: fn(&Bsdf) -> bool| scene.objects().iter().find(|o| is(&o.bsdf));
        SpecularSurfaces {
            mirror: first(Bsdf::is_mirror),
            dielectric: first(|b| matches!(b, Bsdf::Dielectric(_))),
            reflections: scene.branch_reach().reflections,
        }
    }

    /// Returns true if the scene has neither mirrors nor smooth dielectrics.
    pub fn is_empty(&self) -> bool {
        self.mirror.is_none() && self.dielectric.is_none()
    }

    /// Returns a dielectric at which connections are never reflected where refraction is possible.
    fn never_reflecting(&self) -> Option<&'a Object> {
        self.dielectric.filter(|_| self.reflections == 0)
    }
}

/// Returns a warning for each kind of light that is missing. A limit of reflections that the scene
/// sets is taken as intended.
pub(in super::super) fn warnings(scene: &Scene, integrator: &Integrator) -> Vec<SceneProblem> {
    let surfaces = SpecularSurfaces::of(scene);
    let mut problems = Vec::new();
    for (i, emitter) in scene.emitters().iter().enumerate() {
        if integrator.requires(emitter.class()) == RequiredConnection::FromEmitter {
            problems.extend(from_emitter(&surfaces, Subject::Emitter(i), emitter.kind()));
            problems.extend(narrow(scene, Subject::Emitter(i), emitter));
        }
    }
    let any = |required| {
        let mut emitters = scene.emitters().iter();
        emitters.any(|e| integrator.requires(e.class()) == required)
    };
    if any(RequiredConnection::ToSensor) {
        problems.extend(to_sensor(&surfaces));
    }
    if any(RequiredConnection::Any) {
        problems.extend(nowhere(&surfaces));
    }
    problems
}

/// Returns the estimators from which a pilot may choose: the estimators of `known` that find all
/// light of a scene, or else the one that finds the most.
///
/// With `adaptive` samples, only estimators whose samples belong to single pixels qualify.
pub(in super::super) fn complete(
    scene: &Scene,
    known: impl Iterator<Item = Integrator>,
    adaptive: bool,
) -> Vec<Integrator> {
    let mut most = None;
    let mut complete = Vec::new();
    // Exclude estimators that splat for a batch of cameras: nothing connects to these.
    let own_pixels = adaptive || matches!(scene.sensor(), Sensor::Batch(_));
    for integrator in known.filter(|i| !(own_pixels && i.splats())) {
        if warnings(scene, &integrator).is_empty() {
            complete.push(integrator);
        }
        // Prefer an estimator that can connect any edge: its paths include the paths of all others.
        if most.is_none() || integrator.requires(Class::Delta) == RequiredConnection::Any {
            most = Some(integrator);
        }
    }
    if complete.is_empty() {
        complete.extend(most);
    }
    complete
}

fn warning(subject: Subject, message: String, help: String) -> SceneProblem {
    SceneProblem::warning(lints::MISSING_LIGHT, subject, message, help)
}

/// Returns warnings about light that only connections to an emitter find, where reflections precede
/// scattering.
fn from_emitter(surfaces: &SpecularSurfaces, subject: Subject, kind: &str) -> Vec<SceneProblem> {
    let mirror = surfaces.mirror.map(|object| {
        let message = format!(
            "light of this {kind} emitter that a mirror ('{}') reflects before it is scattered is \
             missing: only connections find this light, and mirrors do not reflect connections",
            object.name
        );
        let help = "use the integrator bdpt or particle; path finds this light from area lights";
        warning(subject, message, help.into())
    });
    let dielectric = surfaces.never_reflecting().map(|object| {
        let message = format!(
            "light of this {kind} emitter that smooth dielectrics ('{}') reflect before it is scattered, \
             other than totally, is missing: connections are refracted there",
            object.name
        );
        warning(subject, message, set_reflections("bdpt or particle"))
    });
    mirror.into_iter().chain(dielectric).collect()
}

/// Minimum probability that a connection to a narrow beam contributes. Below it, the mean of the
/// connections cannot be trusted.
const MIN_CONTRIBUTION_PROBABILITY: f64 = 1e-3;

/// Returns a warning about a fibre with cones so narrow that connections rarely contribute.
fn narrow(scene: &Scene, subject: Subject, emitter: &Emitter) -> Option<SceneProblem> {
    let Emitter::Fiber(fiber) = emitter else {
        return None;
    };
    let share = fiber.share_seen(2.0 * scene.around().radius);
    (share < MIN_CONTRIBUTION_PROBABILITY).then(|| {
        let message = format!(
            "the cone of this fiber is so narrow that only about one connection in {:.0e} to its aperture carries light: its light is missing until a sample finds it",
            share.recip()
        );
        let help = "use the integrator bdpt or particle, which trace this light from the fiber";
        warning(subject, message, help.into())
    })
}

/// Returns warnings about reflections of scattered light that the particle tracer does not connect
/// to the sensor.
fn to_sensor(surfaces: &SpecularSurfaces) -> Vec<SceneProblem> {
    let mirror = surfaces.mirror.map(|object| {
        let message = format!(
            "a mirror ('{}') shows emitters only: the particle tracer connects scattered light to the \
             sensor, and connections are not reflected by mirrors",
            object.name
        );
        let help = "use the integrator bdpt or path";
        warning(Subject::Sensor, message, help.into())
    });
    let dielectric = surfaces.never_reflecting().map(|object| {
        let message = format!(
            "smooth dielectrics ('{}') show no reflections of scattered light but total ones: the particle \
             tracer connects it to the sensor, and connections are refracted there",
            object.name
        );
        warning(Subject::Sensor, message, set_reflections("bdpt or path"))
    });
    mirror.into_iter().chain(dielectric).collect()
}

/// Returns a warning about light that is reflected on all parts of its path, so that no connection
/// can join emitter and sensor.
fn nowhere(surfaces: &SpecularSurfaces) -> Option<SceneProblem> {
    let object = surfaces.mirror.or(surfaces.never_reflecting())?;
    let message = format!(
        "light of emitters that no ray can hit is missing where smooth surfaces ('{}') reflect it on every \
         part of its way: connections do not follow such reflections, and one must join emitter and sensor",
        object.name
    );
    let help = match surfaces.mirror {
        Some(_) => "only mirror images of what such light illuminates through mirrors are affected; area lights are not. \
                    The integrator vcm finds this light, blurred a little"
            .into(),
        None => set_reflections("area lights or the integrator vcm"),
    };
    Some(warning(Subject::Scene, message, help))
}

/// Returns the advice to raise the number of reflections of connections.
fn set_reflections(others: &str) -> String {
    format!(
        "set the integrator's 'reflections' to how many of them matter (up to {MAX_TOTAL_REFLECTIONS} total ones \
         are looked for besides), or use {others}"
    )
}
