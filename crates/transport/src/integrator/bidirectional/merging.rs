//! Merging of vertices (Georgiev et al., "Light Transport Simulation with Vertex Connection and Merging", 2012; in media: Křivánek et
//! al., "Unifying Points, Beams, and Paths in Volumetric Light Transport Simulation", 2014): a vertex of a sensor subpath and one of
//! any light subpath that is close to it count as one. Light is blurred over the radius, which is a bias that
//! goes with it.
//!
//! Theory: docs/theory.md#vertex-merging.

use crate::film::Decomposition;
use crate::path::{LightPath, PathVertex, Vertex};
use crate::photons::{Followed, Kernel, LightPaths, PhotonMap, Radii, landed};

/// What a photon is worth against a connection: any value is consistent. Weights take each for an independent sample that brings
/// nothing or all, but a connection varies less than that, and neighbouring pixels share photons.
const WORTH: f64 = 0.03;

/// Light subpaths, and their vertices as photons.
#[derive(Debug)]
pub(crate) struct LightMap {
    /// The subpaths by number: one on which no light left is none.
    paths: Vec<Option<LightPath>>,
    /// Their vertices.
    pub photons: PhotonMap,
}

impl LightMap {
    /// Follows light subpaths.
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
            numbered.flat_map(|(path, light)| landed(paths.scene, light, path, paths.count));
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

    /// The light subpath of a number.
    pub(crate) fn path(&self, number: usize) -> Option<&LightPath> {
        self.paths.get(number)?.as_ref()
    }
}

/// Light subpaths that sensor subpaths are merged with, and how.
#[derive(Debug)]
pub(crate) struct Merging {
    pub light: LightMap,
    /// How far around a vertex photons count.
    pub radii: Radii,
    /// What light the film tells apart.
    pub decomposition: Decomposition,
}

impl Merging {
    /// How photons around a vertex are weighed.
    pub(crate) fn kernel(&self, vertex: &Vertex) -> Kernel {
        match vertex {
            Vertex::Volume { .. } => Kernel::ball(self.radii.volume),
            Vertex::Surface { .. } => Kernel::disc(self.radii.surface),
        }
    }

    /// What it counts for.
    pub(crate) fn contents(&self) -> MergeContents {
        let paths = WORTH * self.light.paths.len() as f64;
        MergeContents {
            surface: paths * Kernel::disc(self.radii.surface).content(),
            volume: paths * Kernel::ball(self.radii.volume).content(),
        }
    }
}

/// What merging counts for against other techniques: what a photon is worth times the number of light subpaths times the area, or
/// volume, within which their vertices count. Zeros if nothing is merged.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct MergeContents {
    surface: f64,
    volume: f64,
}

impl MergeContents {
    /// At a vertex from which light goes on other than by a specular lobe.
    pub(crate) fn at(&self, vertex: &Vertex) -> f64 {
        match vertex {
            Vertex::Volume { .. } => self.volume,
            Vertex::Surface { .. } => self.surface,
        }
    }

    /// At a vertex of a path that goes on as its subpath does.
    pub(crate) fn going_on(&self, vertex: &PathVertex) -> f64 {
        if vertex.specular {
            0.0
        } else {
            self.at(&vertex.vertex)
        }
    }
}
