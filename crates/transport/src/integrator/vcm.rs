//! Vertex connection and merging (Georgiev et al. 2012) over curved edges: what bidirectional path tracing does, and vertices of sensor
//! subpaths merged with those of many light subpaths. So it finds caustics that are seen by way of a mirror or through glass, which
//! no connection does. It is consistent, not unbiased: light is blurred over a radius that shrinks from sample to sample. To second order
//! in the radius its bias is known.
//!
//! Theory: docs/theory.md#vertex-merging.

use super::Contribution;
use super::bidirectional::{Connections, Heuristic, Joining, LightMap, Merging, Setting};
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
    /// Number of edges and events of a subpath after which Russian roulette begins.
    pub rr_depth: u32,
    /// How techniques share a path.
    pub heuristic: Heuristic,
    /// Which vertices of the two subpaths are connected.
    pub connections: Connections,
    /// Radius within which vertices are merged in the first sample, > 0, in scene units; `None` for one that reaches a few.
    pub radius: Option<f64>,
}

/// Dimensions of the balls within which vertices in media are merged.
const IN_MEDIA: f64 = 3.0;

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
    /// How subpaths are sampled in the channels with a probability.
    pub(crate) fn bounds(&self, channel_pdf: Spectrum) -> Bounds {
        Bounds {
            channel_pdf,
            max_depth: self.max_depth.unwrap_or(u32::MAX),
            rr_depth: self.rr_depth,
            max_vertices: usize::MAX,
            weighs: true,
        }
    }

    /// Light subpaths of each sample of an image: as many as there are sensor subpaths.
    pub(crate) fn paths(scene: &Scene) -> usize {
        scene.film().width * scene.film().height
    }

    /// The radii of a sample, given that of the first.
    pub(crate) fn radii(first: f64, sample: u64) -> Radii {
        Radii::shrunk(first, sample, IN_MEDIA)
    }

    /// Radius of the first sample, given light subpaths like its own.
    pub(crate) fn first_radius(&self, paths: &LightPaths) -> f64 {
        self.radius.unwrap_or_else(|| {
            // Where photons fall is all that is asked for.
            let bounds = Bounds {
                weighs: false,
                ..paths.bounds
            };
            let photons = PhotonMap::trace(&LightPaths { bounds, ..*paths }).found;
            photons.first_radius(paths.scene)
        })
    }

    /// The contributions of a sensor ray with light subpaths of its own. Renders share them among all pixels.
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
            count: Self::paths(scene),
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

/// One sensor subpath that is joined with light subpaths.
pub(crate) struct VcmSample<'a> {
    /// How.
    pub vcm: &'a Vcm,
    /// The scene, at the sample's instant.
    pub scene: &'a Scene,
    /// The light subpaths that it is merged with.
    pub merging: &'a Merging,
    /// Number of the one that it is connected to.
    pub number: usize,
    /// Probabilities of the channels.
    pub channel_pdf: Spectrum,
}

impl VcmSample<'_> {
    /// Its contributions, and those of the light subpath to the sensor.
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
            setting: Setting {
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
        // The light subpath is another's.
        ws.particle_balance.is_void = true;
    }
}
