//! Renderers of pictures: an estimator of light, or a tracer of other quantities of sensor rays.

use crate::aov::AovTracer;
use crate::integrator::{Bdpt, Integrator, ParticleTracer, PathTracer, PhotonMapping, Vcm};
use crate::sampling::Replicates;
use crate::spectrum::Spectrum;

/// Renderer of pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Renderer {
    /// Light, computed by an estimator.
    Light(Integrator),
    /// Quantities of sensor rays without scattering.
    Quantities(AovTracer),
}

impl From<Integrator> for Renderer {
    fn from(integrator: Integrator) -> Self {
        Renderer::Light(integrator)
    }
}

/// Converts each estimator to an integrator and to a renderer.
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
    /// Returns true if pixels share paths: light subpaths or photon maps.
    pub(crate) fn shares_paths(&self) -> bool {
        let shares = |integrator: &Integrator| {
            integrator.splats() || matches!(integrator, Integrator::Photon(_))
        };
        self.integrator().is_some_and(shares)
    }

    /// Returns the estimator of light; `None` for other quantities.
    pub fn integrator(&self) -> Option<&Integrator> {
        match self {
            Renderer::Light(integrator) => Some(integrator),
            Renderer::Quantities(_) => None,
        }
    }

    /// Returns true if the picture shows light.
    pub fn is_light(&self) -> bool {
        self.integrator().is_some()
    }

    /// Returns the number of channels of an image of a scene whose film has `spectral` channels.
    pub fn channels(&self, spectral: usize) -> usize {
        match self {
            Renderer::Light(_) => spectral,
            Renderer::Quantities(tracer) => tracer.channels().count(),
        }
    }

    /// Returns the number of channels in each group of the image, if the film has groups of
    /// `spectral` channels.
    pub fn group_size(&self, spectral: usize) -> usize {
        match self {
            Renderer::Light(_) => spectral,
            Renderer::Quantities(_) => Spectrum::CHANNELS,
        }
    }

    /// Returns true if samples contribute to pixels other than their own: see
    /// [`Integrator::splats`].
    pub fn splats(&self) -> bool {
        self.integrator().is_some_and(Integrator::splats)
    }

    /// Returns the kind of replicates into which samples of a pixel are grouped, given the
    /// requested kind: see [`Integrator::replicates`].
    pub fn replicates(&self, wanted: Replicates) -> Replicates {
        self.integrator()
            .map_or(Replicates::SINGLE, |i| i.replicates(wanted))
    }

    /// Returns true if the error approaches zero with the number of samples.
    pub fn converges(&self) -> bool {
        self.integrator().is_none_or(Integrator::converges)
    }

    /// Returns the maximum path length, `None` for no limit, and the depth at which Russian
    /// roulette begins.
    pub fn depths(&self) -> (Option<u32>, u32) {
        self.integrator().map_or((None, 1), Integrator::depths)
    }

    /// Returns the name in scene files and on command lines.
    pub fn name(&self) -> &'static str {
        self.integrator().map_or("aov", Integrator::name)
    }
}
