//! Photon mapping (Jensen 1996; Jensen and Christensen 1998) along curved rays, and its progressive
//! form (Hachisuka et al. 2008) as independent passes with decreasing radii (Knaus and Zwicker
//! 2011).
//!
//! Every sample of the image has a separate photon map, so that samples are independent and the
//! noise of their mean is known. Every sensor ray views the map directly, without final gathering.
//! Light is blurred over the radius, which is a bias. The photons also give this bias, to second
//! order in the radius (docs/theory.md#photon-maps, docs/theory.md#bias-of-photon-maps).

mod gather;

pub(crate) use gather::{Gathered, Gathering};

use super::Contribution;
use crate::Spectrum;
use crate::path::{Bounds, Workspace};
use crate::photons::{Followed, LightPaths, PhotonMap, Radii, is_indirect};
use crate::sampling::Sampler;
use crate::scene::Scene;
use crate::sensor::SensorRay;

/// Photon mapping.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhotonMapping {
    /// Number of light subpaths of each map, > 0; `None` for the number of pixels, or a quarter of it
    /// for a preview.
    pub photons: Option<usize>,
    /// Radius of the first map, > 0, in scene units; `None` for a radius that includes a few
    /// photons.
    pub radius: Option<f64>,
    /// True if radii shrink from sample to sample, so that the mean converges to the image.
    pub progressive: bool,
    /// Selection of the photons in media.
    pub query: PhotonQuery,
    /// Longest path, in edges and specular events; `None` for no limit.
    pub max_depth: Option<u32>,
    /// Number of edges and specular events of a light subpath after which Russian roulette begins.
    pub rr_depth: u32,
}

/// Selection of the photons in media that contribute to a sensor ray.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PhotonQuery {
    /// All photons within the radius of the ray, anywhere along it (Jarosz et al. 2008).
    #[default]
    Beam,
    /// Photons within the radius of a point at which the ray is scattered.
    Point,
    /// Photons within the radius of the first vertex of a path at which light is scattered. Path
    /// tracing finds the light that is scattered once, and photons bring the rest (the integrator
    /// `preview`).
    Indirect,
}

/// Number of samples of a preview that smooth light over directions. Their part of the mean
/// vanishes with the number of samples.
const SMOOTH_SAMPLES: u64 = 64;

impl Default for PhotonMapping {
    fn default() -> Self {
        PhotonMapping {
            photons: None,
            radius: None,
            progressive: false,
            query: PhotonQuery::default(),
            max_depth: None,
            rr_depth: 5,
        }
    }
}

impl PhotonMapping {
    /// Makes a preview: paths find the light that is scattered once, photons the rest.
    pub fn preview() -> Self {
        PhotonMapping {
            progressive: true,
            query: PhotonQuery::Indirect,
            ..PhotonMapping::default()
        }
    }

    /// Returns the name in scene files and on command lines.
    pub(super) fn name(&self) -> &'static str {
        match (self.query, self.progressive) {
            (PhotonQuery::Indirect, _) => "preview",
            (_, true) => "sppm",
            (_, false) => "photon",
        }
    }

    /// Returns the radii of the map of a sample, given the radius of the first.
    pub fn radii(&self, first: f64, sample: u64) -> Radii {
        if !self.progressive {
            return Radii {
                volume: first,
                surface: first,
            };
        }
        let in_media = match self.query {
            PhotonQuery::Beam => 2.0,
            PhotonQuery::Point | PhotonQuery::Indirect => 3.0,
        };
        Radii::shrunk(first, sample, in_media)
    }

    /// Returns the sampling parameters of light subpaths, for given channel probabilities.
    pub fn bounds(&self, channel_pdf: Spectrum) -> Bounds {
        Bounds {
            channel_pdf,
            // At least one edge connects a photon to the sensor.
            max_depth: self
                .max_depth
                .map_or(u32::MAX, |depth| depth.saturating_sub(1)),
            rr_depth: self.rr_depth,
            max_vertices: usize::MAX,
            weighs: false,
        }
    }

    /// Returns the number of photons within the automatic radius around a typical photon. Previews
    /// blur more, because photons bring only light that has been scattered before.
    pub(crate) fn neighbours(&self) -> usize {
        match self.query {
            PhotonQuery::Indirect => 50,
            PhotonQuery::Beam | PhotonQuery::Point => 10,
        }
    }

    /// Returns true if a sample smooths the light in media over directions. Early samples of
    /// previews do; the mean thus still converges.
    pub(crate) fn smooths_directions(&self, sample: u64) -> bool {
        self.query == PhotonQuery::Indirect && sample < SMOOTH_SAMPLES
    }

    /// Returns the number of light subpaths of each map.
    pub fn paths(&self, scene: &Scene) -> usize {
        let film = scene.film();
        let pixels = film.width * film.height;
        let automatic = match self.query {
            PhotonQuery::Indirect => pixels.div_ceil(4),
            PhotonQuery::Beam | PhotonQuery::Point => pixels,
        };
        self.photons.unwrap_or(automatic)
    }

    /// Traces light subpaths, and stores the photons that the query needs.
    pub(crate) fn trace(&self, paths: &LightPaths) -> Followed<PhotonMap> {
        match self.query {
            PhotonQuery::Beam | PhotonQuery::Point => PhotonMap::trace(paths),
            PhotonQuery::Indirect => PhotonMap::trace_if(paths, |light, vertex| {
                is_indirect(paths.scene, light, vertex)
            }),
        }
    }

    /// Samples the contributions of a sensor ray with a separate map. Renders share one map among
    /// all pixels.
    pub(super) fn sample(
        &self,
        scene: &Scene,
        ray: SensorRay,
        channel_pdf: Spectrum,
        sampler: &mut Sampler,
        ws: &mut Workspace,
        out: &mut Vec<Contribution>,
    ) {
        // Trace light subpaths and store their vertices.
        let seed = sampler.next_1d().to_bits();
        let sampler_of = |path| Sampler::new(seed, path, 0);
        let paths = LightPaths {
            scene,
            stop: &ws.stop,
            bounds: self.bounds(channel_pdf),
            count: self.paths(scene),
            search: 1.0,
            sampler: &sampler_of,
        };
        let Followed {
            found: map, stats, ..
        } = self.trace(&paths);
        ws.stats += stats;
        // Sum over the photons around the sensor ray γ: eq. (photon sum).
        let gathering = Gathering {
            scene,
            mapping: self,
            radii: self.radii(
                self.radius
                    .unwrap_or_else(|| map.first_radius(scene, self.neighbours())),
                0,
            ),
            map: &map,
            smooths_directions: self.smooths_directions(0),
            channel_pdf,
        };
        gathering.along(ray, sampler, ws, |light| {
            out.push(Contribution {
                image: None,
                strategy: (0, 0),
                value: light.value,
                bias: light.bias,
                weight: 1.0,
                shares: Default::default(),
                path: light.path,
            });
        });
    }
}
