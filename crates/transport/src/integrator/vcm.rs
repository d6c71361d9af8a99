//! Vertex connection and merging (Georgiev et al. 2012) over curved edges: bidirectional path
//! tracing, with vertices of sensor subpaths merged with vertices of many light subpaths.
//!
//! Merging finds caustics seen in a mirror or through glass, which no connection finds. The
//! estimator is consistent, not unbiased: it blurs light over a radius that shrinks from sample to
//! sample. Its bias is known to second order in the radius.
//!
//! Theory: docs/theory.md#vertex-merging.

use super::Contribution;
use super::bidirectional::{Connections, Heuristic, Joining, LightMap, Merging, StrategyContext};
use crate::Spectrum;
use crate::film::Decomposition;
use crate::path::{Bounds, Workspace, sensor_path};
use crate::photons::{Followed, LightPaths, PhotonMap, Radii};
use crate::sampling::Sampler;
use crate::scene::Scene;
use crate::sensor::SensorRay;

/// Vertex connection and merging.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vcm {
    /// Longest path, in edges and specular events; `None` for no limit.
    pub max_depth: Option<u32>,
    /// Number of edges and specular events of a subpath after which Russian roulette begins.
    pub rr_depth: u32,
    /// Heuristic that weights techniques.
    pub heuristic: Heuristic,
    /// Selection of vertices to connect.
    pub connections: Connections,
    /// Radius within which vertices are merged in the first sample, > 0, in scene units; `None` for
    /// a radius that includes a few photons.
    pub radius: Option<f64>,
}

/// Number of photons within the automatic radius around a typical photon.
const NEIGHBOURS: usize = 10;
/// Dimension of the balls within which vertices in media are merged.
const BALL_DIMENSION: f64 = 3.0;

impl Default for Vcm {
    fn default() -> Self {
        Vcm {
            max_depth: None,
            rr_depth: 5,
            heuristic: Heuristic::default(),
            connections: Connections::default(),
            radius: None,
        }
    }
}

impl Vcm {
    /// Returns the sampling parameters of subpaths, for given channel probabilities.
    pub(crate) fn bounds(&self, channel_pdf: Spectrum) -> Bounds {
        Bounds {
            channel_pdf,
            max_depth: self.max_depth.unwrap_or(u32::MAX),
            rr_depth: self.rr_depth,
            max_vertices: usize::MAX,
            weighs: true,
        }
    }

    /// Returns the radii of a sample, given the radius of the first.
    pub(crate) fn radii(first: f64, sample: u64) -> Radii {
        Radii::shrunk(first, sample, BALL_DIMENSION)
    }

    /// Returns the radius of the first sample, given light subpaths of the scene.
    pub(crate) fn first_radius(&self, paths: &LightPaths) -> f64 {
        self.radius.unwrap_or_else(|| {
            // Only the positions of photons are needed.
            let bounds = Bounds {
                weighs: false,
                ..paths.bounds
            };
            let photons = PhotonMap::trace(&LightPaths { bounds, ..*paths }).found;
            photons.first_radius(paths.scene, NEIGHBOURS)
        })
    }

    /// Samples the contributions of a sensor ray with separate light subpaths. Renders share light
    /// subpaths among all pixels.
    pub(super) fn sample(
        &self,
        scene: &Scene,
        ray: SensorRay,
        channel_pdf: Spectrum,
        sampler: &mut Sampler,
        ws: &mut Workspace,
        out: &mut Vec<Contribution>,
    ) {
        let seed = sampler.next_1d().to_bits();
        let paths = LightPaths {
            scene,
            stop: &ws.stop,
            bounds: self.bounds(channel_pdf),
            count: scene.film().width * scene.film().height,
            search: ws.search,
            sampler: &|path| Sampler::new(seed, path, 0),
        };
        let radii = Self::radii(self.first_radius(&paths), 0);
        let Followed { found, stats, .. } = LightMap::trace(&paths);
        ws.stats += stats;
        let sample = VcmSample {
            vcm: self,
            scene,
            merging: &Merging {
                light: found,
                radii,
                decomposition: Decomposition::default(),
            },
            number: 0,
            channel_pdf,
        };
        sample.take(ray, sampler, ws, out);
    }
}

/// A sensor subpath that is connected to and merged with light subpaths.
pub(crate) struct VcmSample<'a> {
    /// Parameters of the estimator.
    pub vcm: &'a Vcm,
    /// Scene at the instant of the sample.
    pub scene: &'a Scene,
    /// Light subpaths to merge with.
    pub merging: &'a Merging,
    /// Number of the light subpath to connect to.
    pub number: usize,
    /// Probabilities of the channels.
    pub channel_pdf: Spectrum,
}

impl VcmSample<'_> {
    /// Samples the contributions of the sensor subpath, and of the light subpath to the sensor.
    pub(crate) fn take(
        &self,
        ray: SensorRay,
        sampler: &mut Sampler,
        ws: &mut Workspace,
        out: &mut Vec<Contribution>,
    ) {
        let (scene, bounds) = (self.scene, self.vcm.bounds(self.channel_pdf));
        let sensor = sensor_path(scene, ray, &bounds, sampler, ws, &mut ());
        let mut joining = Joining {
            context: StrategyContext {
                scene,
                channel_pdf: self.channel_pdf,
                heuristic: self.vcm.heuristic,
                rates: ws.strategies,
                merging: self.merging.contents(),
                max_depth: bounds.max_depth,
            },
            sampler,
            ws,
            out,
            log: &mut (),
        };
        let light = self.merging.light.path(self.number);
        joining.all(&sensor, light, self.vcm.connections);
        for i in 0..sensor.vertices.len() {
            joining.merged(&sensor.vertices[..=i], self.merging);
        }
        // Leave the particle balance empty, because the light subpath was traced before.
        ws.particle_balance.is_void = true;
    }
}
