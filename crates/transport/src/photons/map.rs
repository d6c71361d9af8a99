//! Photon maps: the vertices of light subpaths, with the power that arrives at them
//! (docs/theory.md#photon-maps).

use super::follow::{Followed, LightPaths};
use super::photon::{Photon, PhotonSite, stored};
use super::tree::PhotonTree;
use crate::path::LightPath;
use crate::scene::Scene;
use crate::stats::Photons;
use glam::DVec3;

/// Radius within which photons contribute, as a fraction of the scene's radius, if there are too
/// few photons to choose the radius.
const FALLBACK_RADIUS: f64 = 0.05;
/// Number of photons whose neighbours are examined.
const EXAMINED_PHOTONS: usize = 64;

/// Photons of many light subpaths.
#[derive(Clone, Debug)]
pub(crate) struct PhotonMap {
    /// Photons at collisions in media.
    pub volume: PhotonTree,
    /// Photons on surfaces.
    pub surface: PhotonTree,
}

impl PhotonMap {
    /// Traces light subpaths and stores their photons.
    pub(crate) fn trace(paths: &LightPaths<'_>) -> Followed<Self> {
        Self::trace_if(paths, |_, _| true)
    }

    /// Traces light subpaths and stores the photons of those vertices, given by their index, for
    /// which `is_stored` returns true.
    pub(crate) fn trace_if(
        paths: &LightPaths<'_>,
        is_stored: impl Fn(&LightPath, usize) -> bool + Sync,
    ) -> Followed<Self> {
        let followed = paths.follow(|path, light| {
            let photons = stored(paths.scene, &light, path, paths.count);
            let photons = photons.filter(|photon| is_stored(&light, photon.vertex));
            photons.collect::<Vec<_>>()
        });
        let Followed {
            found,
            mut stats,
            balance,
        } = followed;
        let map = PhotonMap::of(found.into_iter().flatten());
        stats.photons = map.counts();
        Followed {
            found: map,
            stats,
            balance,
        }
    }

    /// Creates a map of photons.
    pub(crate) fn of(photons: impl IntoIterator<Item = Photon>) -> Self {
        let (mut volume, mut surface) = (Vec::new(), Vec::new());
        for photon in photons {
            match photon.place {
                PhotonSite::Volume(_) => volume.push(photon),
                PhotonSite::Surface(..) => surface.push(photon),
            }
        }
        PhotonMap {
            volume: PhotonTree::new(volume),
            surface: PhotonTree::new(surface),
        }
    }

    /// Returns the numbers of photons.
    pub(crate) fn counts(&self) -> Photons {
        Photons {
            in_media: self.volume.photons().len() as u64,
            on_surfaces: self.surface.photons().len() as u64,
        }
    }

    /// Returns a radius for the first of many similar maps, which contains `neighbours` photons
    /// around a typical photon.
    pub(crate) fn first_radius(&self, scene: &Scene, neighbours: usize) -> f64 {
        let lonely = FALLBACK_RADIUS * scene.around().radius;
        self.typical_radius(neighbours).unwrap_or(lonely)
    }

    /// Returns a radius around a typical photon that contains `neighbours` photons: the median over
    /// some photons. Returns `None` if there are fewer than two photons.
    fn typical_radius(&self, neighbours: usize) -> Option<f64> {
        let trees = [&self.volume, &self.surface];
        let all: Vec<DVec3> = trees
            .iter()
            .flat_map(|tree| tree.photons().iter().map(|p| p.x))
            .collect();
        let last = all.len().checked_sub(1).filter(|&last| last > 0)?;
        let radius = |i: usize| {
            let x = all[i * last / EXAMINED_PHOTONS];
            let mut distances: Vec<f64> = all.iter().map(|y| y.distance(x)).collect();
            *distances
                .select_nth_unstable_by(neighbours.min(last), f64::total_cmp)
                .1
        };
        let mut radii: Vec<f64> = (0..EXAMINED_PHOTONS).map(radius).collect();
        let median = *radii
            .select_nth_unstable_by(EXAMINED_PHOTONS / 2, f64::total_cmp)
            .1;
        (median > 0.0).then_some(median)
    }
}
