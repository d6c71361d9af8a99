//! Photon maps: the vertices of light subpaths, with the power that arrives there (docs/theory.md#photon-maps).

use super::tree::Tree;
use crate::Spectrum;
use crate::path::{BalanceSums, Bounds, LightPath, PathVertex, Vertex, Workspace};
use crate::sampling::Sampler;
use crate::scene::{MediumId, Scene};
use crate::stats::{Photons, Stats};
use crate::stop::Stop;
use glam::DVec3;
use rayon::prelude::*;

/// Light subpaths per unit of work.
const PER_TASK: usize = 256;
/// An automatic radius reaches this many photons around a typical one.
const NEIGHBOURS: usize = 10;
/// Photons that are asked for their neighbours.
const TYPICAL: usize = 64;

/// What a photon fell on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum PhotonSite {
    /// A medium scatters it.
    Volume(MediumId),
    /// A surface: the object, and its geometric normal there.
    Surface(usize, DVec3),
}

/// Light that arrives at a vertex of a light subpath.
#[derive(Clone, Copy, Debug)]
pub struct Photon {
    /// Where.
    pub x: DVec3,
    /// Unit direction in which it travels.
    pub direction: DVec3,
    /// What it fell on.
    pub(crate) place: PhotonSite,
    /// Power over n², in a medium times the scattering coefficient: summed over photons, weighed by a kernel
    /// and scattered, it becomes basic radiance, in a medium per unit length.
    pub power: Spectrum,
    /// Edges and specular events of its path.
    pub depth: u32,
    /// Optical path length so far.
    pub optical_length: f64,
    /// Its emitter.
    pub emitter: usize,
}

/// The photons of many light subpaths.
#[derive(Clone, Debug)]
pub(crate) struct PhotonMap {
    /// Those that media scatter.
    pub volume: Tree,
    /// Those on surfaces.
    pub surface: Tree,
}

impl PhotonMap {
    /// Follows light subpaths, each with a sampler of its own, on the current thread pool. The map does not
    /// depend on the number of threads.
    pub fn trace(
        scene: &Scene,
        stop: &Stop,
        bounds: &Bounds,
        paths: usize,
        sampler: impl Fn(u64) -> Sampler + Sync,
    ) -> (Self, Stats, BalanceSums) {
        let tasks = paths.div_ceil(PER_TASK);
        let parts: Vec<(Vec<Photon>, Stats, BalanceSums)> = (0..tasks)
            .into_par_iter()
            .with_max_len(1)
            .map(|task| {
                let mut ws = Workspace::new(scene.tolerance());
                ws.stop = stop.clone();
                let (mut photons, mut balance) = (Vec::new(), BalanceSums::default());
                for path in task * PER_TASK..paths.min((task + 1) * PER_TASK) {
                    let mut sampler = sampler(path as u64);
                    if let Some(light) = LightPath::sample(scene, bounds, &mut sampler, &mut ws) {
                        photons.extend(landed(scene, &light, paths));
                    }
                    balance.add(
                        &std::mem::take(&mut ws.particle_balance),
                        &mut ws.stats.not_finite,
                    );
                }
                (photons, ws.stats(), balance)
            })
            .collect();
        let (mut stats, mut balance) = (Stats::default(), BalanceSums::default());
        let (mut volume, mut surface) = (Vec::new(), Vec::new());
        for (photons, counts, part) in parts {
            stats += counts;
            balance += part;
            for photon in photons {
                match photon.place {
                    PhotonSite::Volume(_) => volume.push(photon),
                    PhotonSite::Surface(..) => surface.push(photon),
                }
            }
        }
        stats.photons = Photons {
            in_media: volume.len() as u64,
            on_surfaces: surface.len() as u64,
        };
        let map = PhotonMap {
            volume: Tree::new(volume),
            surface: Tree::new(surface),
        };
        (map, stats, balance)
    }

    /// A radius that reaches `NEIGHBOURS` photons around a typical one: the median over some of them.
    /// `None` if there are fewer than two photons.
    pub(crate) fn typical_radius(&self) -> Option<f64> {
        let trees = [&self.volume, &self.surface];
        let all: Vec<DVec3> = trees
            .iter()
            .flat_map(|tree| tree.photons().iter().map(|p| p.x))
            .collect();
        let last = all.len().checked_sub(1).filter(|&last| last > 0)?;
        let radius = |i: usize| {
            let x = all[i * last / TYPICAL];
            let mut distances: Vec<f64> = all.iter().map(|y| y.distance(x)).collect();
            *distances
                .select_nth_unstable_by(NEIGHBOURS.min(last), f64::total_cmp)
                .1
        };
        let mut radii: Vec<f64> = (0..TYPICAL).map(radius).collect();
        let median = *radii.select_nth_unstable_by(TYPICAL / 2, f64::total_cmp).1;
        (median > 0.0).then_some(median)
    }
}

/// The photons of a light subpath, one of so many.
fn landed(scene: &Scene, light: &LightPath, paths: usize) -> impl Iterator<Item = Photon> {
    let emitter = light.emitter;
    let photon = move |path_vertex: &PathVertex| {
        let vertex = &path_vertex.vertex;
        let n = scene.n(vertex.medium(), vertex.position());
        Photon {
            x: vertex.position(),
            direction: vertex.arrival(),
            place: match vertex {
                Vertex::Volume { medium, .. } => PhotonSite::Volume(*medium),
                Vertex::Surface {
                    object, surface, ..
                } => PhotonSite::Surface(*object, surface.normal),
            },
            // Φ/n_p², with Φ the throughput over M. What passes straight through a surface falls on it, too.
            power: path_vertex.throughput / (n * n * paths as f64 * vertex.stopping(scene)),
            depth: path_vertex.depth,
            optical_length: path_vertex.optical_length,
            emitter,
        }
    };
    let vertices = light.subpath.vertices.iter().map(photon);
    vertices.filter(|p| !p.power.is_zero() && p.power.is_finite())
}

#[cfg(test)]
impl Photon {
    /// One that carries nothing.
    pub fn at(x: DVec3) -> Self {
        Photon {
            x,
            direction: DVec3::Z,
            place: PhotonSite::Volume(crate::scene::AMBIENT),
            power: Spectrum::ZERO,
            depth: 0,
            optical_length: 0.0,
            emitter: 0,
        }
    }
}
