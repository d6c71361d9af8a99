//! What makes a picture: an estimator of light, or what finds other quantities of sensor rays.

use crate::aov::AovTracer;
use crate::integrator::{Bdpt, Integrator, ParticleTracer, PathTracer, PhotonMapping, Vcm};
use crate::sampling::Replicates;
use crate::spectrum::Spectrum;

/// What makes a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Renderer {
    /// Light, by an estimator.
    Light(Integrator),
    /// What becomes of sensor rays that are not scattered.
    Quantities(AovTracer),
}

impl From<Integrator> for Renderer {
    fn from(integrator: Integrator) -> Self {
        Renderer::Light(integrator)
    }
}

/// Each estimator as an integrator and as a renderer.
macro_rules! light_by {
    ($($estimator:ident => $variant:ident),*) => {
        $(impl From<$estimator> for Integrator {
            fn from(estimator: $estimator) -> Self {
                Integrator::$variant(estimator)
            }
        }

        impl From<$estimator> for Renderer {
            fn from(estimator: $estimator) -> Self {
                Renderer::Light(estimator.into())
            }
        })*
    };
}

light_by!(PathTracer => Path, ParticleTracer => Particle, Bdpt => Bdpt, Vcm => Vcm, PhotonMapping => Photon);

impl From<AovTracer> for Renderer {
    fn from(tracer: AovTracer) -> Self {
        Renderer::Quantities(tracer)
    }
}

impl Renderer {
    /// The estimator of light; `None` for other quantities.
    pub fn integrator(&self) -> Option<&Integrator> {
        match self {
            Renderer::Light(integrator) => Some(integrator),
            Renderer::Quantities(_) => None,
        }
    }

    /// Whether the picture shows light.
    pub fn is_light(&self) -> bool {
        self.integrator().is_some()
    }

    /// Number of channels of an image of a scene whose film has `spectral` ones.
    pub fn channels(&self, spectral: usize) -> usize {
        match self {
            Renderer::Light(_) => spectral,
            Renderer::Quantities(tracer) => tracer.channels().count(),
        }
    }

    /// Number of channels in each group of such an image, if those of the film are in groups of `spectral`.
    pub fn group_size(&self, spectral: usize) -> usize {
        match self {
            Renderer::Light(_) => spectral,
            Renderer::Quantities(_) => Spectrum::CHANNELS,
        }
    }

    /// Whether contributions go to other pixels than that of the sample: see [`Integrator::splats`].
    pub fn splats(&self) -> bool {
        self.integrator().is_some_and(Integrator::splats)
    }

    /// How samples of a pixel belong together: see [`Integrator::replicates`].
    pub fn replicates(&self, wanted: Replicates) -> Replicates {
        self.integrator()
            .map_or(Replicates::Single, |i| i.replicates(wanted))
    }

    /// Whether its error becomes as small as one likes with enough samples.
    pub fn converges(&self) -> bool {
        self.integrator().is_none_or(Integrator::converges)
    }

    /// Longest path, `None` for no limit, and where Russian roulette begins.
    pub fn depths(&self) -> (Option<u32>, u32) {
        self.integrator().map_or((None, 1), Integrator::depths)
    }

    /// Name, as scene files and command lines use it.
    pub fn name(&self) -> &'static str {
        self.integrator().map_or("aov", Integrator::name)
    }
}
