//! Rays between two points, found like the connections of a render.

use crate::path::transmittance;
use crate::scene::{MediumId, NO_SCENE, Scene};
use eikonal::Solver;
use eikonal::connect::{ConnectingRay, Failure, Piece, Reach};
use glam::DVec3;

/// Points per arc of a curved ray; arcs are short and turn little.
const POINTS_PER_ARC: usize = 4;

/// Rays between two points.
#[derive(Clone, Debug)]
pub struct Branches {
    /// Primary ray, or all rays that were found.
    pub list: Vec<Branch>,
    /// Reason why there is no primary ray. If all rays were requested, it is the reason why a ray
    /// of the coarser search is missing from the list.
    pub failure: Option<Failure>,
    /// True if it is certain that at most one ray exists with the requested number of reflections
    /// where refraction is possible.
    pub is_unique: bool,
    /// True if a surface blocks the primary ray.
    pub is_occluded: bool,
}

/// Ray between two points.
#[derive(Clone, Debug)]
pub struct Branch {
    /// Geometry of the ray.
    pub connection: ConnectingRay,
    /// Points of the ray, from its start to its end.
    pub points: Vec<DVec3>,
    /// Transmittance of each channel.
    pub transmittance: Vec<f64>,
    /// True if a surface blocks the ray.
    pub is_occluded: bool,
    /// True if the ray was found first, from the default start.
    pub is_primary: bool,
}

/// Finds the ray between two points, or all rays with up to `all` reflections where refraction is
/// possible. Rays are traced in the first scene; the other scenes are alike except for their
/// spectra.
///
/// # Panics
/// If there are no scenes.
pub fn branches(scenes: &[Scene], from: DVec3, to: DVec3, all: Option<u32>) -> Branches {
    let scene = scenes.first().expect(NO_SCENE);
    let mut solver = Solver::new(scene.tolerance());
    let medium = scene.medium_at(from);
    let primary = solver.connect(scene, from, medium, to);
    let (mut list, mut is_occluded, mut lost) = (vec![], false, None);
    if let Ok(found) = &primary {
        let branch = branch(scenes, found, solver.pieces(), true);
        is_occluded = branch.is_occluded;
        list.push(branch);
    }
    if let Some(reflections) = all {
        list.clear();
        let reach = reach(scene, reflections, primary.as_ref().ok());
        let all = solver.all(scene, from, medium, to, &reach);
        lost = all.lost;
        for (guess, found) in all.branches {
            let first = primary.is_ok_and(|p| solver.is_same_branch(&p, &found));
            // Solve again to obtain the pieces of the ray.
            let found = if first {
                solver.connect(scene, from, medium, to)
            } else {
                solver.solve(scene, &guess, to)
            };
            match found {
                Ok(found) => list.push(branch(scenes, &found, solver.pieces(), first)),
                Err(failure) => lost = Some(failure),
            }
        }
    }
    Branches {
        list,
        failure: primary.err().or(lost),
        is_unique: scene.is_unique(from, medium, to, scene.medium_at(to))
            || all.unwrap_or(0) == 0 && scene.is_unique_in_ball([from, to]),
        is_occluded,
    }
}

/// Returns the range of a render's search for branches, extended beyond the primary ray.
fn reach(scene: &Scene, reflections: u32, primary: Option<&ConnectingRay>) -> Reach {
    let render = scene.branch_reach();
    let primary = primary.map_or(0.0, |p| p.optical_length);
    Reach {
        optical_length: render.optical_length.max(2.0 * primary),
        reflections,
        bounces: reflections.saturating_add(render.bounces - render.reflections),
    }
}

fn branch(
    scenes: &[Scene],
    found: &ConnectingRay,
    pieces: &[Piece<MediumId>],
    is_primary: bool,
) -> Branch {
    let groups = scenes.iter().enumerate();
    let channels = groups.flat_map(|(group, scene)| {
        let channels = scene.film().channels_of(group);
        transmittance(scene, pieces).0.into_iter().take(channels)
    });
    Branch {
        connection: *found,
        points: points(pieces),
        transmittance: channels.collect(),
        is_occluded: scenes[0]
            .visibility(pieces.iter().map(Piece::ends), [None; 2], 0.0)
            .is_none(),
        is_primary,
    }
}

/// Returns points along a ray, several on each arc.
fn points(pieces: &[Piece<MediumId>]) -> Vec<DVec3> {
    let start = pieces.first().map(|piece| piece.arc.position(0.0));
    let rest = pieces.iter().flat_map(|piece| {
        let (arc, end) = piece.ends();
        let steps = if arc.is_straight() { 1 } else { POINTS_PER_ARC };
        // Planted error "curves of branches that go on behind their ends", found by morgana-cli/cli::view::rays_of_a_page:
        // (1..=steps).map(move |i| arc.position(i as f64 / steps as f64))
        (1..=steps).map(move |i| arc.position(end * i as f64 / steps as f64))
    });
    start.into_iter().chain(rest).collect()
}
