//! The outer surface of a mesh of tetrahedra: elements beyond it, and holes in it.

use super::{Face, Tetrahedra, TetrahedraError, center};
use glam::DVec3;
use std::collections::HashMap;

/// Distance of probes from their face, relative to the face's longest edge. Gaps between elements
/// that are narrower count as mistakes.
const PROBE_DISTANCE: f64 = 1e-4;
/// Weights of a face's nodes for the probes of the face.
const PROBES: [[f64; 3]; 4] = [
    [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0],
    [0.9, 0.05, 0.05],
    [0.05, 0.9, 0.05],
    [0.05, 0.05, 0.9],
];

/// Space that tetrahedra enclose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hole {
    /// Mean position of the nodes around the hole.
    pub place: DVec3,
    /// Volume in cubes of the unit of length.
    pub volume: f64,
}

/// Point just outside a face.
#[derive(Clone, Copy)]
struct Probe {
    point: DVec3,
    element: usize,
}

impl Tetrahedra {
    /// Checks that no element lies just outside the outer faces of others. `faces` are the outer faces.
    pub(super) fn check_outside(&self, faces: &[Face]) -> Result<(), TetrahedraError> {
        let mut probes = Vec::with_capacity(PROBES.len() * faces.len());
        for face in faces {
            let [a, b, c] = face.nodes.map(|node| self.nodes[node as usize]);
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            let offset = (b - a).cross(c - a).normalize_or_zero() * PROBE_DISTANCE * longest;
            probes.extend(PROBES.map(|[u, v, w]| Probe {
                point: u * a + v * b + w * c + offset,
                element: face.element,
            }));
        }
        let tree = ProbeTree::new(&mut probes);
        for (element, corners) in self.elements.iter().enumerate() {
            let inside = Inside::of(corners.map(|node| self.nodes[node as usize]));
            if let Some(probe) = tree.first_in(&inside) {
                return Err(TetrahedraError::Touch {
                    first: probe.element.min(element),
                    second: probe.element.max(element),
                    place: probe.point,
                });
            }
        }
        Ok(())
    }

    /// Returns the spaces that the tetrahedra enclose, largest first.
    pub fn holes(&self) -> Vec<Hole> {
        // Neighbours were checked when the tetrahedra were made.
        let faces = self.neighbours().unwrap_or_default();
        let outer = faces.into_iter().filter(|(_, beyond)| beyond.is_none());
        let outer: Vec<[u32; 3]> = outer.map(|(face, _)| face.nodes).collect();
        let mut holes: Vec<Hole> = connected(&outer)
            .into_iter()
            .filter_map(|surface| self.hole(&surface))
            .collect();
        holes.sort_by(|a, b| b.volume.total_cmp(&a.volume));
        holes
    }

    /// Returns the space that a closed surface encloses, if its normals point inwards.
    fn hole(&self, surface: &[[u32; 3]]) -> Option<Hole> {
        let nodes: Vec<u32> = surface.iter().flatten().copied().collect();
        let place = center(&self.nodes, &nodes);
        let at = |node: u32| self.nodes[node as usize] - place;
        let volumes = surface.iter();
        let volumes = volumes.map(|[a, b, c]| at(*a).dot(at(*b).cross(at(*c))) / 6.0);
        let volume = -volumes.sum::<f64>();
        // Planted error "outer surfaces taken for holes", found by morgana-formats/lib::mesh::tetrahedra::outer_surface::tests::holes_have_volumes:
        // (volume != 0.0).then_some(Hole { place, volume })
        (volume > 0.0).then_some(Hole { place, volume })
    }
}

/// Groups triangles that are connected by edges.
fn connected(triangles: &[[u32; 3]]) -> Vec<Vec<[u32; 3]>> {
    let mut of_edge: HashMap<[u32; 2], Vec<usize>> = HashMap::new();
    let edges = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)]);
    for (i, triangle) in triangles.iter().enumerate() {
        for edge in edges(*triangle) {
            of_edge.entry(edge).or_default().push(i);
        }
    }
    let mut is_seen = vec![false; triangles.len()];
    let mut groups = Vec::new();
    for first in 0..triangles.len() {
        let (mut group, mut waiting) = (Vec::new(), vec![first]);
        while let Some(i) = waiting.pop() {
            if !std::mem::replace(&mut is_seen[i], true) {
                group.push(triangles[i]);
                waiting.extend(edges(triangles[i]).iter().flat_map(|edge| &of_edge[edge]));
            }
        }
        if !group.is_empty() {
            groups.push(group);
        }
    }
    groups
}

/// Inside of a tetrahedron: points x with `normals`·x > `offsets` for all four faces.
struct Inside {
    normals: [DVec3; 4],
    offsets: [f64; 4],
}

impl Inside {
    /// The last corner must be on the side to which the normal of the others points.
    fn of([a, b, c, d]: [DVec3; 4]) -> Self {
        let faces = [[a, b, c], [a, d, b], [b, d, c], [c, d, a]];
        let normals = faces.map(|[a, b, c]| (b - a).cross(c - a));
        Inside {
            normals,
            offsets: std::array::from_fn(|i| normals[i].dot(faces[i][0])),
        }
    }

    fn contains(&self, point: DVec3) -> bool {
        (0..4).all(|i| self.normals[i].dot(point) > self.offsets[i])
    }

    /// Returns true if all points of a box lie beyond one of the faces.
    fn misses(&self, [low, high]: [DVec3; 2]) -> bool {
        (0..4).any(|i| {
            let normal = self.normals[i];
            let farthest = DVec3::select(normal.cmpgt(DVec3::ZERO), high, low);
            normal.dot(farthest) <= self.offsets[i]
        })
    }
}

/// Probes, sorted into a balanced tree: the middle one divides the others by an axis.
struct ProbeTree<'a> {
    probes: &'a [Probe],
    bounds: [DVec3; 2],
}

impl<'a> ProbeTree<'a> {
    fn new(probes: &'a mut [Probe]) -> Self {
        let bounds = bounds(probes);
        sort(probes, bounds);
        ProbeTree { probes, bounds }
    }

    /// Returns a probe inside a tetrahedron.
    fn first_in(&self, inside: &Inside) -> Option<&Probe> {
        let mut waiting = vec![(self.probes, self.bounds)];
        while let Some((probes, bounds)) = waiting.pop() {
            if probes.is_empty() || inside.misses(bounds) {
                continue;
            }
            let (before, [middle, after @ ..]) = probes.split_at(probes.len() / 2) else {
                continue;
            };
            if inside.contains(middle.point) {
                return Some(middle);
            }
            let [below, above] = divided(bounds, middle.point);
            waiting.extend([(before, below), (after, above)]);
        }
        None
    }
}

/// Sorts probes within bounds into a balanced tree.
fn sort(probes: &mut [Probe], bounds: [DVec3; 2]) {
    if probes.len() < 2 {
        return;
    }
    let axis = longest_axis(bounds);
    let middle = probes.len() / 2;
    probes.select_nth_unstable_by(middle, |a, b| a.point[axis].total_cmp(&b.point[axis]));
    let [below, above] = divided(bounds, probes[middle].point);
    let (before, after) = probes.split_at_mut(middle);
    sort(before, below);
    sort(&mut after[1..], above);
}

/// Divides a box at a point, by its longest axis.
fn divided([low, high]: [DVec3; 2], point: DVec3) -> [[DVec3; 2]; 2] {
    let axis = longest_axis([low, high]);
    let (mut middle_high, mut middle_low) = (high, low);
    middle_high[axis] = point[axis];
    middle_low[axis] = point[axis];
    [[low, middle_high], [middle_low, high]]
}

fn longest_axis([low, high]: [DVec3; 2]) -> usize {
    (high - low).max_position()
}

fn bounds(probes: &[Probe]) -> [DVec3; 2] {
    let first = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let points = probes.iter().map(|probe| probe.point);
    points.fold(first, |[low, high], x| [low.min(x), high.max(x)])
}

#[cfg(test)]
mod tests {
    use super::super::tests::cube;
    use super::*;

    /// Cubes at integer positions, each of six tetrahedra.
    fn cubes(places: &[DVec3]) -> (Vec<DVec3>, Vec<[u32; 4]>) {
        let (corners, of_one) = cube();
        let nodes = places
            .iter()
            .flat_map(|p| corners.iter().map(move |x| x + p));
        let elements = (0..places.len() as u32).flat_map(|i| {
            of_one
                .iter()
                .map(move |nodes| nodes.map(|node| node + 8 * i))
        });
        (nodes.collect(), elements.collect())
    }

    fn made(nodes: Vec<DVec3>, elements: Vec<[u32; 4]>) -> Result<Tetrahedra, TetrahedraError> {
        let regions = vec![1; elements.len()];
        Tetrahedra::new(nodes, elements, regions)
    }

    #[test]
    fn neighbours_must_share_nodes() {
        let side = |x: f64| [DVec3::ZERO, DVec3::new(x, 0.0, 0.0)];
        let (nodes, elements) = cubes(&side(1.0));
        made(nodes, elements).unwrap();
        let (nodes, elements) = cubes(&side(1.01));
        made(nodes, elements).unwrap();
        // Overlapping cubes, a crack that is too narrow to see, and other triangles on the common face.
        for shift in [
            DVec3::new(0.9, 0.03, 0.02),
            DVec3::new(1.0 + 1e-6, 0.0, 0.0),
            DVec3::new(1.0, 0.5, 0.0),
        ] {
            let (nodes, elements) = cubes(&[DVec3::ZERO, shift]);
            let told = made(nodes, elements).unwrap_err().to_string();
            assert!(told.contains("touch or overlap"), "{told}");
        }
        // An element inside another one.
        let (mut nodes, mut elements) = cubes(&[DVec3::ZERO]);
        let (small, other) = cube();
        let corner = DVec3::new(0.6, 0.3, 0.1);
        nodes.extend(small.iter().map(|x| corner + 0.01 * x));
        elements.push(other[0].map(|node| node + 8));
        let told = made(nodes, elements).unwrap_err().to_string();
        assert!(told.contains("touch or overlap"), "{told}");
    }

    #[test]
    fn holes_have_volumes() {
        let (nodes, elements) = cubes(&[DVec3::ZERO]);
        assert_eq!(made(nodes, elements).unwrap().holes(), []);
        let all =
            (0..27).map(|i| DVec3::new(f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9)));
        let shell: Vec<DVec3> = all.filter(|x| *x != DVec3::ONE).collect();
        let (nodes, elements) = cubes(&shell);
        let [hole] = made(nodes, elements).unwrap().holes()[..] else {
            panic!("one hole");
        };
        assert!((hole.volume - 1.0).abs() < 1e-12, "{hole:?}");
        assert!((hole.place - 1.5).length() < 0.2, "{hole:?}");
    }
}
