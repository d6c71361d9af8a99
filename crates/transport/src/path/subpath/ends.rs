//! Starts of subpaths: at the sensor, and at a randomly chosen emitter
//! (docs/theory.md#subpaths-from-either-end).

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

/// Sampling parameters of the subpaths of a bidirectional estimator.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Channel probabilities.
    pub channel_pdf: Spectrum,
    /// Largest number of edges and specular events of a subpath.
    pub max_depth: u32,
    /// Depth at which Russian roulette begins.
    pub rr_depth: u32,
    /// Largest number of vertices of the sensor subpath.
    pub max_vertices: usize,
    /// True if the discovery probabilities of edges are needed.
    pub weighs: bool,
}

impl Bounds {
    /// Makes the recorder of a walk that starts with `ray`. `end` is the target of connections to
    /// the end of the subpath.
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
            // Keep the density of each edge independent of the throughput, because other strategies
            // must compute it.
            follows_throughput: false,
            max_depth: self.max_depth,
        };
        let mut roulette = Roulette {
            rr_depth: self.rr_depth,
            initial: ray.throughput.max(),
        };
        walk.run(ray, observer, &mut roulette, sampler, ws);
    }

    /// Returns 1 in every channel in use.
    fn white(&self) -> Spectrum {
        self.channel_pdf.map(|p| f64::from(u8::from(p > 0.0)))
    }
}

/// A subpath from an emitter.
#[derive(Clone, Debug)]
pub(crate) struct LightPath {
    /// Index of the emitter.
    pub emitter: usize,
    /// Emission that starts the subpath.
    pub emission: Emission,
    /// Density of the end times the probability of the emitter.
    pub density: f64,
    /// Vertices of the subpath.
    pub subpath: Subpath,
}

impl LightPath {
    /// Samples a subpath; `None` if the scene has no emitters, or no light leaves along the sampled
    /// ray.
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

/// Samples the first ray of a light subpath from an emitter that was chosen with `probability`. The
/// throughput of the ray is its power, in the channels in which `white` is one. Returns `None` if
/// no light leaves along the sampled ray. `u` is uniform in [0, 1)⁴.
pub fn emit(
    scene: &Scene,
    emitter: usize,
    probability: f64,
    white: Spectrum,
    u: [[f64; 2]; 2],
) -> Option<(Emission, WalkRay)> {
    let shape = |object: usize| &scene.objects()[object].shape;
    // Draw the connection end with density p_a and the ray with p_r; the power is emitted/(P_E p_a
    // p_r).
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

/// Samples a subpath from the sensor along one of its rays. The subpath carries basic radiance,
/// including the factor n² of the sensor.
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
            start_object: None,
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

/// Returns the start of an emitted ray, off the surface on which the end lies.
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
        start_object: None,
    }
}
