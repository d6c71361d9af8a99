//! Slivers: tetrahedra so thin that the digits of a file decide on which side of a face they lie.

use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// Height of a tetrahedron, relative to its longest edge, below which it is a sliver. Text files
/// often give positions with about ten digits.
const THIN: f64 = 1e-9;

/// Moves nodes so that each sliver lies beyond a wide face of a neighbour: by at most five times
/// [`THIN`] of its longest edge. Slivers that share wide faces only with slivers stay as they are.
pub(super) fn thicken(nodes: &mut [DVec3], elements: &[[u32; 4]]) {
    let is_sliver = |corners: &[u32; 4]| (0..4).any(|k| is_low(nodes, corners, k));
    let (slivers, others): (Vec<[u32; 4]>, Vec<[u32; 4]>) =
        elements.iter().copied().partition(is_sliver);
    if slivers.is_empty() {
        return;
    }
    let faces_of = |corners: &[u32; 4]| [0, 1, 2, 3].map(|k| key(corners, k));
    let faces: HashSet<[u32; 3]> = slivers.iter().flat_map(faces_of).collect();
    // The node of another element beyond each face of the slivers.
    let mut beyond = HashMap::new();
    for corners in &others {
        for k in 0..4 {
            let face = key(corners, k);
            if faces.contains(&face) {
                beyond.insert(face, corners[k]);
            }
        }
    }
    for corners in &slivers {
        // Over a narrow face, a sliver can be high: its corner there would move far.
        // Planted error "corners of slivers moved over narrow faces", found by morgana-formats/lib::mesh::tetrahedra::slivers::tests::corners_do_not_move_far:
        // let low = 0..4;
        let low = (0..4).filter(|k| is_low(nodes, corners, *k));
        let known = low.filter_map(|k| Some((k, *beyond.get(&key(corners, k))?)));
        let area = |k: usize| normal(nodes, corners, k).length();
        let widest = known.max_by(|(a, _), (b, _)| area(*a).total_cmp(&area(*b)));
        if let Some((k, other)) = widest {
            move_beyond(nodes, corners, k, other);
        }
    }
}

/// Returns true if the corner `k` has less than the height of a sliver.
fn is_low(nodes: &[DVec3], corners: &[u32; 4], k: usize) -> bool {
    height(nodes, corners, k).abs() < THIN * longest_edge(nodes, corners)
}

/// Moves the corner `k` to a small distance from the face opposite to it, on the other side than the
/// node `other`.
fn move_beyond(nodes: &mut [DVec3], corners: &[u32; 4], k: usize, other: u32) {
    let normal = normal(nodes, corners, k).normalize_or_zero();
    let on_face = nodes[corners[(k + 1) % 4] as usize];
    // Planted error "slivers moved to the side of their neighbours", found by morgana-formats/lib::mesh::tetrahedra::slivers::tests::slivers_fit_between_their_neighbours:
    // let side = normal.dot(nodes[other as usize] - on_face).signum();
    let side = -normal.dot(nodes[other as usize] - on_face).signum();
    let wanted = side * 4.0 * THIN * longest_edge(nodes, corners);
    nodes[corners[k] as usize] += normal * (wanted - height(nodes, corners, k));
}

/// Returns the sorted nodes of the face opposite to the corner `k`.
fn key(corners: &[u32; 4], k: usize) -> [u32; 3] {
    let mut face = [1, 2, 3].map(|i| corners[(k + i) % 4]);
    face.sort_unstable();
    face
}

/// Returns a normal of the face opposite to the corner `k`, with twice the face's area as length.
fn normal(nodes: &[DVec3], corners: &[u32; 4], k: usize) -> DVec3 {
    let [a, b, c] = [1, 2, 3].map(|i| nodes[corners[(k + i) % 4] as usize]);
    (b - a).cross(c - a)
}

/// Returns the height of the corner `k` above the face opposite to it, along the face's normal.
fn height(nodes: &[DVec3], corners: &[u32; 4], k: usize) -> f64 {
    let on_face = nodes[corners[(k + 1) % 4] as usize];
    let direction = normal(nodes, corners, k).normalize_or_zero();
    direction.dot(nodes[corners[k] as usize] - on_face)
}

/// Returns the length of the longest edge.
pub(super) fn longest_edge(nodes: &[DVec3], corners: &[u32; 4]) -> f64 {
    let at = |i: usize| nodes[corners[i] as usize];
    let edges = (0..4).flat_map(|i| (0..i).map(move |j| (at(i) - at(j)).length()));
    edges.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::super::Tetrahedra;
    use glam::DVec3;

    /// Two tetrahedra above and below a square, and between them a sliver of the square's corners,
    /// which is flat or turned inside out.
    #[test]
    fn slivers_fit_between_their_neighbours() {
        for lift in [0.0, 1e-12, -1e-12, 3e-10, -3e-10] {
            let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
            let mut nodes: Vec<DVec3> = square.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
            nodes[2].z = lift;
            nodes.extend([DVec3::new(0.5, 0.5, 1.0), DVec3::new(0.5, 0.5, -1.0)]);
            // The diagonals of the square cross: one above the sliver, one below.
            let elements = vec![
                [0, 1, 2, 4],
                [0, 2, 3, 4],
                [0, 1, 3, 5],
                [1, 2, 3, 5],
                [0, 1, 2, 3],
            ];
            let made = Tetrahedra::new(nodes.clone(), elements, vec![1; 5]);
            let made = made.unwrap_or_else(|error| panic!("{lift}: {error}"));
            let moved = made.nodes().iter().zip(&nodes);
            assert!(moved.map(|(a, b)| a.distance(*b)).all(|d| d < 2e-8));
            let neighbours = made.adjacent()[4];
            assert!(neighbours.iter().all(Option::is_some), "{lift}");
        }
    }

    /// A sliver that is high over its only common face, which is narrow, stays flat: its corner
    /// there would move by 0.17.
    #[test]
    fn corners_do_not_move_far() {
        let mut nodes = [
            DVec3::ZERO,
            DVec3::X,
            DVec3::new(0.5, 0.0, 3e-9),
            DVec3::new(0.5, 0.17, 0.98),
            DVec3::new(0.5, -1.0, 0.0),
        ];
        let before = nodes;
        super::thicken(&mut nodes, &[[0, 1, 2, 3], [0, 1, 2, 4]]);
        assert_eq!(nodes, before);
    }
}
