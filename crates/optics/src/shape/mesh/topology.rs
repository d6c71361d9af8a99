//! Topology of meshes: closedness, enclosed volume and convexity.

use super::{corners, cross};
use eikonal::Aabb;
use glam::DVec3;
use std::collections::HashMap;

/// Largest number of vertex–triangle pairs for which convexity is checked.
const MAX_CONVEXITY_PAIRS: usize = 20_000_000;

/// Returns true if every edge is shared by exactly two triangles that traverse it in opposite
/// directions. Vertices at the same position count as one, so that seams of texture coordinates do
/// not matter.
pub(super) fn is_closed(positions: &[DVec3], triangles: &[[u32; 3]]) -> bool {
    let ids = weld(positions);
    let edges = || {
        let welded = triangles.iter().map(|t| t.map(|v| ids[v as usize]));
        let proper = welded.filter(|[a, b, c]| a != b && b != c && c != a);
        proper.flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]])
    };
    // Store the ends of the edges from vertex a, in order, at first[a]..first[a + 1].
    let mut first = vec![0; positions.len() + 1];
    edges().for_each(|[a, _]| first[a as usize + 1] += 1);
    for a in 0..positions.len() {
        first[a + 1] += first[a];
    }
    let mut ends = vec![0; first[positions.len()]];
    let mut next = first.clone();
    for [a, b] in edges() {
        ends[next[a as usize]] = b;
        next[a as usize] += 1;
    }
    for a in first.windows(2) {
        ends[a[0]..a[1]].sort_unstable();
    }
    let from = |a: u32| &ends[first[a as usize]..first[a as usize + 1]];
    let is_paired = |a: u32| {
        let once = from(a).windows(2).all(|pair| pair[0] != pair[1]);
        once && from(a).iter().all(|b| from(*b).binary_search(&a).is_ok())
    };
    !ends.is_empty() && (0..positions.len() as u32).all(is_paired)
}

/// Returns, for each vertex, the first vertex at the same position.
fn weld(positions: &[DVec3]) -> Vec<u32> {
    let mut first = HashMap::with_capacity(positions.len());
    let id = |(i, p): (usize, &DVec3)| {
        // Add zero to turn −0 into 0.
        let key = (*p + DVec3::ZERO).to_array().map(f64::to_bits);
        *first.entry(key).or_insert(i as u32)
    };
    positions.iter().enumerate().map(id).collect()
}

/// Returns the enclosed volume, negative if the triangles are wound inside out.
pub(super) fn signed_volume(positions: &[DVec3], triangles: &[[u32; 3]]) -> f64 {
    // Any origin is correct; one on the mesh avoids cancellation far from the origin of the scene.
    cone_volume(positions, triangles, positions[triangles[0][0] as usize])
}

/// Returns the signed volume between the triangles and `o`.
pub(super) fn cone_volume(positions: &[DVec3], triangles: &[[u32; 3]], o: DVec3) -> f64 {
    let cone = |t: &[u32; 3]| {
        let [a, b, c] = corners(positions, t).map(|p| p - o);
        a.dot(b.cross(c)) / 6.0
    };
    triangles.iter().map(cone).sum()
}

/// Returns true if all vertices lie behind the planes of all triangles of a closed mesh. Returns
/// false for large meshes, because the check would take long.
pub(super) fn is_convex(positions: &[DVec3], triangles: &[[u32; 3]], bounds: &Aabb) -> bool {
    if positions.len().saturating_mul(triangles.len()) > MAX_CONVEXITY_PAIRS {
        return false;
    }
    let slack = 1e-12 * (bounds.diagonal() + bounds.center().length());
    let mut used = vec![false; positions.len()];
    for v in triangles.iter().flatten() {
        used[*v as usize] = true;
    }
    let vertices: Vec<DVec3> = positions
        .iter()
        .zip(&used)
        .filter_map(|(p, used)| used.then_some(*p))
        .collect();
    triangles.iter().all(|t| {
        let t = corners(positions, t);
        let n = cross(t).normalize();
        vertices.iter().all(|p| n.dot(*p - t[0]) <= slack)
    })
}
