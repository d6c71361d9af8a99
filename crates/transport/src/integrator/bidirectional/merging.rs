//! Vertex merging (Georgiev et al., "Light Transport Simulation with Vertex Connection and
//! Merging", 2012; in media: Křivánek et al., "Unifying Points, Beams, and Paths in Volumetric
//! Light Transport Simulation", 2014). A vertex of a sensor subpath and a close vertex of any light
//! subpath count as one vertex. This blurs light over the radius; the blur is a bias that shrinks
//! with the radius.
//!
//! Theory: docs/theory.md#vertex-merging.

use crate::film::Decomposition;
use crate::path::{LightPath, PathVertex, Vertex};
use crate::photons::{Followed, Kernel, LightPaths, PhotonMap, Radii, stored};

/// Factor on the density of merging in MIS weights, for each photon. Any value is consistent. The
/// weights assume that each photon is an independent sample, as in a connection. A value below one
/// corrects for two differences: the contribution of a connection varies less than the contribution
/// of a photon, and neighbouring pixels share photons.
const MERGING_WEIGHT: f64 = 0.03;

/// Light subpaths, with their vertices as photons.
#[derive(Debug)]
pub(crate) struct LightMap {
    /// Subpaths by number; `None` if no light left the emitter.
    paths: Vec<Option<LightPath>>,
    /// Vertices of the subpaths.
    pub photons: PhotonMap,
}

impl LightMap {
    /// Traces light subpaths.
    pub(crate) fn trace(paths: &LightPaths) -> Followed<Self> {
        let Followed {
            found,
            mut stats,
            balance,
        } = paths.follow(|path, mut light| {
            light.subpath.vertices.shrink_to_fit();
            (path, light)
        });
        let mut by_number = Vec::new();
        by_number.resize_with(paths.count, || None);
        for (path, light) in found {
            by_number[path] = Some(light);
        }
        let numbered = by_number.iter().enumerate();
        let numbered = numbered.filter_map(|(path, light)| Some((path, light.as_ref()?)));
        let photons =
            numbered.flat_map(|(path, light)| stored(paths.scene, light, path, paths.count));
        let map = LightMap {
            photons: PhotonMap::of(photons),
            paths: by_number,
        };
        stats.photons = map.photons.counts();
        Followed {
            found: map,
            stats,
            balance,
        }
    }

    /// Returns the light subpath with a number.
    pub(crate) fn path(&self, number: usize) -> Option<&LightPath> {
        self.paths.get(number)?.as_ref()
    }
}

/// Light subpaths to merge with, and parameters of merging.
#[derive(Debug)]
pub(crate) struct Merging {
    pub light: LightMap,
    /// Radii around a vertex within which photons are merged.
    pub radii: Radii,
    /// Layers of light that the film separates.
    pub decomposition: Decomposition,
}

impl Merging {
    /// Returns the kernel for photons around a vertex.
    pub(crate) fn kernel(&self, vertex: &Vertex) -> Kernel {
        match vertex {
            Vertex::Volume { .. } => Kernel::ball(self.radii.volume),
            Vertex::Surface { .. } => Kernel::disc(self.radii.surface),
        }
    }

    /// Returns the weights of merging against other techniques.
    pub(crate) fn contents(&self) -> MergeContents {
        let paths = MERGING_WEIGHT * self.light.paths.len() as f64;
        MergeContents {
            surface: paths * Kernel::disc(self.radii.surface).content(),
            volume: paths * Kernel::ball(self.radii.volume).content(),
        }
    }
}

/// Factor on the density of merging in MIS weights. It is the product of the factor for a photon,
/// the number of light subpaths, and the area, or volume, within which their vertices contribute.
/// It is zero without merging.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct MergeContents {
    surface: f64,
    volume: f64,
}

impl MergeContents {
    /// Returns the weight at a vertex that scatters light except along a specular lobe.
    pub(crate) fn at(&self, vertex: &Vertex) -> f64 {
        match vertex {
            Vertex::Volume { .. } => self.volume,
            Vertex::Surface { .. } => self.surface,
        }
    }

    /// Returns the weight at a vertex of a path that continues like its subpath.
    pub(crate) fn going_on(&self, vertex: &PathVertex) -> f64 {
        if vertex.specular {
            0.0
        } else {
            self.at(&vertex.vertex)
        }
    }
}
