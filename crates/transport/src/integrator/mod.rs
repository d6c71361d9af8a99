//! Estimators of what a sensor measures. They never import one another (docs/theory.md#estimators).

mod bdpt;
mod bidirectional;
mod contribution;
mod particle;
mod path;
mod photon;
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

/// An estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Integrator {
    /// Sensor subpaths with next-event estimation.
    Path(PathTracer),
    /// Emitter subpaths, connected to the sensor.
    Particle(ParticleTracer),
    /// Subpaths from both ends, joined in every way.
    Bdpt(Bdpt),
    /// The same, and vertices of sensor subpaths merged with those of light subpaths.
    Vcm(Vcm),
    /// Maps of photons, seen by sensor rays.
    Photon(PhotonMapping),
}

/// Edge of a path that connections must find, because nothing else can.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RequiredConnection {
    /// None: whatever connections miss is found by chance.
    Nothing,
    /// The one that starts at the emitter.
    FromEmitter,
    /// The one that ends at the sensor.
    ToSensor,
    /// Any one.
    Any,
}

impl Integrator {
    /// What it requires of connections for the light of an emitter of a class.
    pub fn requires(&self, class: Class) -> RequiredConnection {
        match (self, class) {
            (Integrator::Particle(_), _) => RequiredConnection::ToSensor,
            (Integrator::Path(_), Class::Delta) => RequiredConnection::FromEmitter,
            (Integrator::Bdpt(_), Class::Delta | Class::Volume) => RequiredConnection::Any,
            _ => RequiredConnection::Nothing,
        }
    }

    /// The contributions of one sample of a pixel, whose sensor ray is given. `channels` is the number
    /// of channels in use. Their weighted sum over the whole image is unbiased if every pixel is
    /// sampled equally often, but for the blur of photon maps and of merging.
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

    /// Does the same as [`Integrator::sample`], and logs the paths of all contributions. Finds nothing if it
    /// [blurs](Integrator::blurs).
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

    /// Whether contributions go to other pixels than that of the sample.
    pub fn splats(&self) -> bool {
        matches!(
            self,
            Integrator::Particle(_) | Integrator::Bdpt(_) | Integrator::Vcm(_)
        )
    }

    /// Whether it tells apart what its strategies find.
    pub fn tells_strategies_apart(&self) -> bool {
        matches!(self, Integrator::Particle(_) | Integrator::Bdpt(_))
    }

    /// Whether it tells strategies apart, and has that which samples `s` vertices from the emitter and `t` from the sensor.
    pub(crate) fn has_strategy(&self, s: u32, t: u32) -> bool {
        match self {
            Integrator::Path(_) | Integrator::Photon(_) | Integrator::Vcm(_) => false,
            Integrator::Particle(_) => t == 1 || (s, t) == (0, 2),
            Integrator::Bdpt(_) => true,
        }
    }

    /// Whether all pixels of a sample share light subpaths, which are followed first, and contribute to one another.
    pub(crate) fn shares_light_paths(&self) -> bool {
        matches!(self, Integrator::Vcm(_))
    }

    /// Whether light is blurred, so that its mean is biased.
    pub fn blurs(&self) -> bool {
        matches!(self, Integrator::Photon(_) | Integrator::Vcm(_))
    }

    /// How its samples of a pixel belong together: as is wanted if each has a path from the
    /// sensor. Paths from emitters contribute all over the image.
    pub fn replicates(&self, wanted: Replicates) -> Replicates {
        match self {
            Integrator::Path(_) | Integrator::Bdpt(_) => wanted,
            _ => Replicates::Single,
        }
    }

    /// Whether its error becomes as small as one likes with enough samples.
    pub fn converges(&self) -> bool {
        match self {
            Integrator::Photon(photon) => photon.progressive,
            _ => true,
        }
    }

    /// Longest path, `None` for no limit, and where Russian roulette begins.
    pub fn depths(&self) -> (Option<u32>, u32) {
        match self {
            Integrator::Path(i) => (i.max_depth, i.rr_depth),
            Integrator::Particle(i) => (i.max_depth, i.rr_depth),
            Integrator::Bdpt(i) => (i.max_depth, i.rr_depth),
            Integrator::Vcm(i) => (i.max_depth, i.rr_depth),
            Integrator::Photon(i) => (i.max_depth, i.rr_depth),
        }
    }

    /// Name, as scene files and command lines use it.
    pub fn name(&self) -> &'static str {
        match self {
            Integrator::Path(_) => "path",
            Integrator::Particle(_) => "particle",
            Integrator::Bdpt(_) => "bdpt",
            Integrator::Vcm(_) => "vcm",
            Integrator::Photon(photon) if photon.progressive => "sppm",
            Integrator::Photon(_) => "photon",
        }
    }
}

/// Probabilities of the channels, alike for those in use.
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
