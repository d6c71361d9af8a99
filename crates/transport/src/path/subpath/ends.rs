//! Where subpaths start: at the sensor, and at an emitter chosen at random (docs/theory.md#subpaths-from-either-end).

use super::builder::SubpathBuilder;
use super::vertices::Subpath;
use crate::Spectrum;
use crate::connection_end::{ConnectionEnd, OnSurface};
use crate::emitter::{Emission, EmittedRay};
use crate::path::connection::ConnectionTarget;
use crate::path::log::{Logged, PathLog};
use crate::path::random_walk::{Observer, RandomWalk, Roulette, WalkRay};
use crate::path::segment::{Front, Start, TransportMode, lead_in, leave};
use crate::path::workspace::Workspace;
use crate::sampling::Sampler;
use crate::scene::{MediumId, Scene};
use crate::sensor;
use glam::DVec3;

/// How a bidirectional estimator samples its subpaths.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Channel probabilities.
    pub channel_pdf: Spectrum,
    /// Most edges and specular events of a subpath.
    pub max_depth: u32,
    /// Depth at which Russian roulette begins.
    pub rr_depth: u32,
    /// Most vertices of the sensor's subpath.
    pub max_vertices: usize,
    /// Whether the discovery probabilities of edges are wanted.
    pub weighs: bool,
}

impl Bounds {
    /// Records a walk that starts with a ray. `end` is the target of connections to the subpath's end.
    fn builder<'t>(
        &self,
        mode: TransportMode,
        ray: &WalkRay,
        end: &'t ConnectionTarget,
    ) -> SubpathBuilder<'t> {
        SubpathBuilder {
            subpath: Subpath::new(ray.start),
            mode,
            end,
            max_vertices: match mode {
                TransportMode::Radiance => self.max_vertices,
                TransportMode::Importance => usize::MAX,
            },
            weighs: self.weighs,
        }
    }

    /// Follows a ray, with Russian roulette.
    fn walk(
        &self,
        scene: &Scene,
        mode: TransportMode,
        ray: WalkRay,
        observer: &mut impl Observer,
        sampler: &mut Sampler,
        ws: &mut Workspace,
    ) {
        let walk = RandomWalk {
            scene,
            mode,
            channel_pdf: self.channel_pdf,
            // Other strategies must know the density of each edge.
            follows_throughput: false,
            max_depth: self.max_depth,
        };
        let mut roulette = Roulette {
            rr_depth: self.rr_depth,
            initial: ray.throughput.max(),
        };
        walk.run(ray, observer, &mut roulette, sampler, ws);
    }

    /// One in every channel in use.
    fn white(&self) -> Spectrum {
        self.channel_pdf.map(|p| f64::from(u8::from(p > 0.0)))
    }
}

/// A subpath from an emitter.
#[derive(Clone, Debug)]
pub(crate) struct LightPath {
    /// The emitter.
    pub emitter: usize,
    /// How it started.
    pub emission: Emission,
    /// Density of its end: that of the end times the probability of the emitter.
    pub density: f64,
    /// Its vertices.
    pub subpath: Subpath,
}

impl LightPath {
    /// Samples one; `None` if the scene has no emitters, or no light leaves.
    pub(crate) fn sample(
        scene: &Scene,
        bounds: &Bounds,
        sampler: &mut Sampler,
        ws: &mut Workspace,
        log: &mut impl PathLog,
    ) -> Option<Self> {
        let choice = scene.choose_source(sampler.next_1d());
        let u = [sampler.next_2d(), sampler.next_2d()];
        let (index, probability) = choice?;
        let (emission, ray) = emit(scene, index, probability, bounds.white(), u)?;
        let density = probability * emission.end_pdf;
        let target = ConnectionTarget::emitter(scene, index, emission.end);
        let mode = TransportMode::Importance;
        let mut builder = bounds.builder(mode, &ray, &target);
        log.emit(&EmittedRay {
            emitter: index,
            end: emission.end,
            x: emission.x,
            direction: emission.direction,
        });
        let mut balance = std::mem::take(&mut ws.particle_balance);
        let logged = Logged { log, mode };
        let mut observers = ((&mut builder, &mut balance), logged);
        bounds.walk(scene, mode, ray, &mut observers, sampler, ws);
        ws.particle_balance = balance;
        Some(LightPath {
            emitter: index,
            emission,
            density,
            subpath: builder.subpath,
        })
    }
}

/// The first ray of a light subpath from an emitter that was chosen with the given probability; its
/// throughput is the power that it carries, in the channels in which `white` is one. `None` if no light
/// leaves along the ray that was drawn; `u` is uniform in [0, 1)⁴.
pub fn emit(
    scene: &Scene,
    emitter: usize,
    probability: f64,
    white: Spectrum,
    u: [[f64; 2]; 2],
) -> Option<(Emission, WalkRay)> {
    let shape = |object: usize| &scene.objects()[object].shape;
    // Draw the connection end with density p_a and the ray with p_r; the power is emitted/(P_E p_a p_r).
    let emission = scene.emitters()[emitter].emit(
        scene.around(),
        shape,
        [u[0][0], u[0][1], u[1][0], u[1][1]],
    )?;
    let (x, direction) = (emission.x, emission.direction);
    let emitted = scene.leaving(emitter, &emission.end, x, direction);
    if emitted.is_zero() {
        return None;
    }
    let emission = Emission {
        emitted,
        ..emission
    };
    let density = probability * emission.end_pdf * emission.pdf;
    let ray = WalkRay {
        start: start(scene, &emission.end, x, direction),
        pdf: emission.pdf,
        specular: false,
        throughput: emitted * white / density,
        depth: 0,
        optical_length: -lead_in(scene, emitter),
    };
    Some((emission, ray))
}

/// A subpath from the sensor along one of its rays. It carries basic radiance, n² of the sensor
/// included.
pub(crate) fn sensor_path(
    scene: &Scene,
    ray: sensor::SensorRay,
    bounds: &Bounds,
    sampler: &mut Sampler,
    ws: &mut Workspace,
    log: &mut impl PathLog,
) -> Subpath {
    let (x, direction) = (ray.origin, ray.direction);
    let end = scene.sensor().end_of_ray(x, direction);
    let medium = scene.medium_of_sensor_ray(x);
    let n = scene.n(medium, x);
    let density = scene
        .sensor()
        .sense(x, direction)
        .map_or(0.0, |s| s.density);
    let ray = WalkRay {
        start: Start {
            x,
            direction,
            medium,
            front: front(&end),
            left: None,
        },
        pdf: density,
        specular: false,
        throughput: bounds.white() * (n * n),
        depth: 0,
        optical_length: 0.0,
    };
    let target = ConnectionTarget::sensor(scene, end);
    let mode = TransportMode::Radiance;
    let mut builder = bounds.builder(mode, &ray, &target);
    let mut observers = (&mut builder, Logged { log, mode });
    bounds.walk(scene, mode, ray, &mut observers, sampler, ws);
    builder.subpath
}

fn front(end: &ConnectionEnd) -> Front {
    match end {
        ConnectionEnd::Point { .. } => Front::Point,
        ConnectionEnd::Plane { .. } => Front::Plane,
    }
}

/// Where the ray of an emission starts: off the surface on which its end lies.
fn start(scene: &Scene, end: &ConnectionEnd, x: DVec3, direction: DVec3) -> Start {
    let x = match end {
        ConnectionEnd::Point {
            surface: Some(OnSurface { normal, .. }),
            ..
        } => leave(scene, x, *normal, direction),
        _ => x,
    };
    let medium: MediumId = scene.medium_at(x);
    Start {
        x,
        direction,
        medium,
        front: front(end),
        left: None,
    }
}
