//! Estimators of the quantities that a sensor measures. They never import one another
//! (docs/theory.md#estimators).

mod bdpt;
mod bidirectional;
mod contribution;
mod particle;
mod path;
mod photon;
mod preview;
mod vcm;

pub use bdpt::Bdpt;
pub use bidirectional::{Connections, Heuristic};
pub(crate) use bidirectional::{LightMap, Merging};
pub use contribution::Contribution;
pub use particle::ParticleTracer;
pub(crate) use path::PathFinds;
pub use path::PathTracer;
pub(crate) use photon::Gathering;
pub use photon::{PhotonMapping, PhotonQuery};
pub use vcm::Vcm;
pub(crate) use vcm::VcmSample;

use crate::Spectrum;
use crate::emitter::Class;
use crate::path::{PathLog, Workspace};
use crate::sampling::{Replicates, Sampler};
use crate::scene::Scene;
use crate::sensor::SensorRay;

/// An estimator of light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Integrator {
    /// Sensor subpaths with next-event estimation.
    Path(PathTracer),
    /// Emitter subpaths, connected to the sensor.
    Particle(ParticleTracer),
    /// Bidirectional path tracing: subpaths from the sensor and from an emitter, with connections
    /// between all of their vertices.
    Bdpt(Bdpt),
    /// Bidirectional path tracing, with merging of sensor vertices and light vertices.
    Vcm(Vcm),
    /// Photon maps, viewed along sensor rays.
    Photon(PhotonMapping),
}

/// Edge of a path that only connections can find.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RequiredConnection {
    /// No edge: random walks find the paths that connections miss.
    Nothing,
    /// The edge that starts at the emitter.
    FromEmitter,
    /// The edge that ends at the sensor.
    ToSensor,
    /// Any edge.
    Any,
}

impl Integrator {
    /// Returns the edge that connections must find for the light of an emitter of a class.
    pub fn requires(&self, class: Class) -> RequiredConnection {
        match (self, class) {
            (Integrator::Particle(_), _) => RequiredConnection::ToSensor,
            (Integrator::Path(_), Class::Delta) => RequiredConnection::FromEmitter,
            (Integrator::Bdpt(_), Class::Delta | Class::Volume) => RequiredConnection::Any,
            _ => RequiredConnection::Nothing,
        }
    }

    /// Samples the contributions of one sample of a pixel along its sensor ray. `channels` is the
    /// number of channels in use. The weighted sum of contributions over the image is unbiased if
    /// all pixels have equal numbers of samples, except for the blur of photon maps and of merging.
    pub fn sample(
        &self,
        scene: &Scene,
        ray: SensorRay,
        channels: usize,
        sampler: &mut Sampler,
        ws: &mut Workspace,
        out: &mut Vec<Contribution>,
    ) {
        let channel_pdf = even_channel_pdf(channels);
        match self {
            Integrator::Vcm(vcm) => vcm.sample(scene, ray, channel_pdf, sampler, ws, out),
            Integrator::Photon(photon) => photon.sample(scene, ray, channel_pdf, sampler, ws, out),
            _ => {
                let finds = PathFinds { out, log: &mut () };
                self.log(scene, ray, channels, sampler, ws, finds);
            }
        }
    }

    /// Does the work of [`Integrator::sample`], and logs the paths of all contributions. There are
    /// no contributions if the integrator [blurs](Integrator::blurs).
    pub(crate) fn log(
        &self,
        scene: &Scene,
        ray: SensorRay,
        channels: usize,
        sampler: &mut Sampler,
        ws: &mut Workspace,
        finds: PathFinds<impl PathLog>,
    ) {
        let channel_pdf = even_channel_pdf(channels);
        match self {
            Integrator::Path(path) => path.sample(scene, ray, channels, sampler, ws, finds),
            Integrator::Particle(particle) => {
                particle.sample(scene, ray, channel_pdf, sampler, ws, finds);
            }
            Integrator::Bdpt(bdpt) => bdpt.sample(scene, ray, channel_pdf, sampler, ws, finds),
            Integrator::Vcm(_) | Integrator::Photon(_) => {}
        }
    }

    /// Returns the properties of the integrator.
    fn facts(&self) -> Facts {
        match self {
            Integrator::Path(i) => Facts {
                takes_replicates: true,
                ..Facts::new("path", i.max_depth, i.rr_depth)
            },
            Integrator::Particle(i) => Facts {
                splats: true,
                separates_strategies: true,
                ..Facts::new("particle", i.max_depth, i.rr_depth)
            },
            Integrator::Bdpt(i) => Facts {
                splats: true,
                separates_strategies: true,
                takes_replicates: true,
                ..Facts::new("bdpt", i.max_depth, i.rr_depth)
            },
            Integrator::Vcm(i) => Facts {
                splats: true,
                shares_light_paths: true,
                blurs: true,
                ..Facts::new("vcm", i.max_depth, i.rr_depth)
            },
            Integrator::Photon(i) => Facts {
                blurs: true,
                converges: i.progressive,
                ..Facts::new(i.name(), i.max_depth, i.rr_depth)
            },
        }
    }

    /// Returns true if contributions go to pixels other than the sample's own.
    pub fn splats(&self) -> bool {
        self.facts().splats
    }

    /// Returns true if the integrator can show the light of each strategy.
    pub fn separates_strategies(&self) -> bool {
        self.facts().separates_strategies
    }

    /// Returns true if the integrator separates strategies, and has the strategy with `s` vertices
    /// from the emitter and `t` from the sensor.
    pub(crate) fn has_strategy(&self, s: u32, t: u32) -> bool {
        match self {
            Integrator::Path(_) | Integrator::Photon(_) | Integrator::Vcm(_) => false,
            Integrator::Particle(_) => t == 1 || (s, t) == (0, 2),
            Integrator::Bdpt(_) => true,
        }
    }

    /// Returns true if all pixels of a sample share light subpaths, which are traced first, and
    /// contribute to each other.
    pub(crate) fn shares_light_paths(&self) -> bool {
        self.facts().shares_light_paths
    }

    /// Returns true if light is blurred, so that its mean is biased.
    pub fn blurs(&self) -> bool {
        self.facts().blurs
    }

    /// Returns the grouping of samples of a pixel: `wanted` if each sample has a path from the
    /// sensor. Paths from emitters contribute all over the image and use single samples.
    pub fn replicates(&self, wanted: Replicates) -> Replicates {
        if self.facts().takes_replicates {
            wanted
        } else {
            Replicates::SINGLE
        }
    }

    /// Returns true if the error converges to zero with more samples.
    pub fn converges(&self) -> bool {
        self.facts().converges
    }

    /// Returns the longest path, `None` for no limit, and the depth after which Russian roulette
    /// begins, both in edges and specular events.
    pub fn depths(&self) -> (Option<u32>, u32) {
        self.facts().depths
    }

    /// Returns the name in scene files and on command lines.
    pub fn name(&self) -> &'static str {
        self.facts().name
    }
}

/// Properties of an integrator that renders depend on; the methods of [`Integrator`] explain them.
struct Facts {
    name: &'static str,
    depths: (Option<u32>, u32),
    splats: bool,
    separates_strategies: bool,
    shares_light_paths: bool,
    blurs: bool,
    takes_replicates: bool,
    converges: bool,
}

impl Facts {
    /// Makes the properties of an unbiased integrator with samples that contribute only to their
    /// own pixels.
    fn new(name: &'static str, max_depth: Option<u32>, rr_depth: u32) -> Self {
        Facts {
            name,
            depths: (max_depth, rr_depth),
            splats: false,
            separates_strategies: false,
            shares_light_paths: false,
            blurs: false,
            takes_replicates: false,
            converges: true,
        }
    }
}

/// Returns equal probabilities for the channels in use.
pub(crate) fn even_channel_pdf(channels: usize) -> Spectrum {
    let value = |c| {
        if c < channels {
            1.0 / channels as f64
        } else {
            0.0
        }
    };
    Spectrum(std::array::from_fn(value))
}
