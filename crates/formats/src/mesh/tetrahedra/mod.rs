//! Tetrahedra that belong to regions, and the surfaces between the regions.

mod outer_surface;
mod slivers;

pub use outer_surface::Hole;

use super::MeshData;
use super::label_surfaces::PartSurface;
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};

/// Volume of a tetrahedron, relative to the cube of its longest edge, below which it counts as
/// flat: far above the rounding errors of positions in double precision.
const FLAT: f64 = 1e-12;

/// Tetrahedra with their regions. Neighbours share the nodes of their common face.
#[derive(Clone, Debug, PartialEq)]
pub struct Tetrahedra {
    nodes: Vec<DVec3>,
    /// Four nodes of each tetrahedron. The last one is on the side to which the counter-clockwise
    /// normal of the first three points.
    elements: Vec<[u32; 4]>,
    /// Region of each tetrahedron.
    regions: Vec<u32>,
}

/// Problem of tetrahedra. Elements are numbered from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TetrahedraError {
    /// There are no tetrahedra.
    #[error("there are no tetrahedra")]
    Empty,
    /// The numbers of regions and of elements differ.
    #[error("there are {regions} regions for {elements} elements")]
    Count {
        /// Number of regions.
        regions: usize,
        /// Number of elements.
        elements: usize,
    },
    /// A node's position is not finite.
    #[error("the position of node {0} is not finite")]
    NotFinite(usize),
    /// An element has a node that does not exist.
    #[error("element {element} has the node {node}, but there are {nodes} nodes, numbered from 0")]
    Node {
        /// Number of the element.
        element: usize,
        /// Number of the node.
        node: u32,
        /// Number of nodes.
        nodes: usize,
    },
    /// A tetrahedron has no volume.
    #[error("element {element} at {place} has no volume: its nodes lie in a plane")]
    Flat {
        /// Number of the element.
        element: usize,
        /// Position of its centre.
        place: DVec3,
    },
    /// Three or more tetrahedra share a face, or two on the same side of a face.
    #[error(
        "elements {first} and {second} at {place} overlap: they lie on the same side of a common face"
    )]
    Overlap {
        /// Number of the first element.
        first: usize,
        /// Number of the second element.
        second: usize,
        /// Centre of the common face.
        place: DVec3,
    },
    /// An element lies just outside an outer face of another one.
    #[error(
        "elements {first} and {second} touch or overlap at {place} without a common face: neighbours must \
         share three nodes"
    )]
    Touch {
        /// Number of the first element.
        first: usize,
        /// Number of the second element.
        second: usize,
        /// Position outside one element and inside the other.
        place: DVec3,
    },
}

/// Face of a tetrahedron.
#[derive(Clone, Copy)]
struct Face {
    /// Nodes, counter-clockwise as seen from outside the tetrahedron.
    nodes: [u32; 3],
    element: usize,
}

impl Tetrahedra {
    /// Creates tetrahedra from nodes, four nodes for each element in any order, and a region for
    /// each element. Nodes at equal positions become one node. Elements whose height is below 1e-9
    /// of their longest edge are made thicker, so that they lie beyond their neighbours.
    ///
    /// # Errors
    /// If there are no elements, numbers do not fit together, an element is flat, or elements overlap
    /// or touch without a common face.
    pub fn new(
        mut nodes: Vec<DVec3>,
        mut elements: Vec<[u32; 4]>,
        regions: Vec<u32>,
    ) -> Result<Self, TetrahedraError> {
        if elements.is_empty() {
            return Err(TetrahedraError::Empty);
        }
        if regions.len() != elements.len() {
            return Err(TetrahedraError::Count {
                regions: regions.len(),
                elements: elements.len(),
            });
        }
        if let Some(i) = nodes.iter().position(|node| !node.is_finite()) {
            return Err(TetrahedraError::NotFinite(i));
        }
        let first = first_of_equal(&nodes);
        for (element, corners) in elements.iter_mut().enumerate() {
            for node in corners.iter_mut() {
                let known = first.get(*node as usize).ok_or(TetrahedraError::Node {
                    element,
                    node: *node,
                    nodes: nodes.len(),
                });
                *node = *known?;
            }
        }
        slivers::thicken(&mut nodes, &elements);
        for (element, corners) in elements.iter_mut().enumerate() {
            orient(corners, &nodes).ok_or_else(|| TetrahedraError::Flat {
                element,
                place: center(&nodes, corners),
            })?;
        }
        let made = Tetrahedra {
            nodes,
            elements,
            regions,
        };
        let faces = made.neighbours()?.into_iter();
        let outer = faces.filter(|(_, beyond)| beyond.is_none());
        let outer: Vec<Face> = outer.map(|(face, _)| face).collect();
        made.check_outside(&outer)?;
        Ok(made)
    }

    /// Returns the number of tetrahedra of each region.
    pub fn counts(&self) -> BTreeMap<u32, usize> {
        let mut counts = BTreeMap::new();
        for region in &self.regions {
            *counts.entry(*region).or_default() += 1;
        }
        counts
    }

    /// Returns the positions of the nodes.
    pub fn nodes(&self) -> &[DVec3] {
        &self.nodes
    }

    /// Returns the four nodes of each tetrahedron.
    pub fn elements(&self) -> &[[u32; 4]] {
        &self.elements
    }

    /// Returns the region of each tetrahedron.
    pub fn regions(&self) -> &[u32] {
        &self.regions
    }

    /// Returns the tetrahedra beyond the faces opposite to the nodes of each tetrahedron.
    pub fn adjacent(&self) -> Vec<[Option<u32>; 4]> {
        let mut adjacent = vec![[None; 4]; self.elements.len()];
        let mut set = |element: usize, face: [u32; 3], beyond: usize| {
            let opposite = |node: &u32| !face.contains(node);
            if let Some(k) = self.elements[element].iter().position(opposite) {
                adjacent[element][k] = Some(beyond as u32);
            }
        };
        // Neighbours were checked when the tetrahedra were made.
        for (face, beyond) in self.neighbours().unwrap_or_default() {
            if let Some(beyond) = beyond {
                set(face.element, face.nodes, beyond);
                set(beyond, face.nodes, face.element);
            }
        }
        adjacent
    }

    /// Returns the surfaces between all parts that touch. `part_of` gives the part of a region.
    /// Part 0 is everything outside the tetrahedra, and regions that `part_of` counts to it.
    pub fn surfaces(&self, part_of: impl Fn(u32) -> u8) -> Vec<PartSurface> {
        let parts: Vec<u8> = self.regions.iter().map(|region| part_of(*region)).collect();
        let mut between: BTreeMap<[u8; 2], Vec<[u32; 3]>> = BTreeMap::new();
        // Neighbours were checked when the tetrahedra were made.
        for (face, other) in self.neighbours().unwrap_or_default() {
            let [own, beyond] = [parts[face.element], other.map_or(0, |i| parts[i])];
            if own != beyond {
                let [a, b, c] = face.nodes;
                // Planted error "surfaces of regions inside out", found by morgana-formats/lib::mesh::tetrahedra::tests::surfaces_enclose_their_regions_whatever_the_order_of_nodes:
                // let outwards = own < beyond;
                let outwards = own > beyond;
                let triangle = if outwards { [a, b, c] } else { [a, c, b] };
                let key = [own.max(beyond), own.min(beyond)];
                between.entry(key).or_default().push(triangle);
            }
        }
        let surfaces = between.into_iter();
        surfaces
            .map(|(parts, triangles)| self.surface(parts, &triangles))
            .collect()
    }

    /// Returns a surface with only the nodes that it needs.
    fn surface(&self, parts: [u8; 2], triangles: &[[u32; 3]]) -> PartSurface {
        let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        let number = |node: u32| used.partition_point(|known| *known < node) as u32;
        PartSurface {
            parts,
            mesh: MeshData {
                triangles: triangles.iter().map(|nodes| nodes.map(number)).collect(),
                positions: used.iter().map(|node| self.nodes[*node as usize]).collect(),
                ..MeshData::default()
            },
        }
    }

    /// Lists each face once, with the element beyond it. Sorted by nodes.
    fn neighbours(&self) -> Result<Vec<(Face, Option<usize>)>, TetrahedraError> {
        let mut faces: Vec<([u32; 3], Face)> = Vec::with_capacity(4 * self.elements.len());
        for (element, [a, b, c, d]) in self.elements.iter().copied().enumerate() {
            for nodes in [[a, c, b], [a, b, d], [b, c, d], [c, a, d]] {
                let mut key = nodes;
                key.sort_unstable();
                faces.push((key, Face { nodes, element }));
            }
        }
        faces.sort_unstable_by_key(|(key, face)| (*key, face.element));
        let groups = faces.chunk_by(|(a, _), (b, _)| a == b);
        let pair = |group: &[([u32; 3], Face)]| match group {
            [(_, face)] => Ok((*face, None)),
            [(_, face), (_, other)] if is_opposite(face.nodes, other.nodes) => {
                Ok((*face, Some(other.element)))
            }
            [(_, face), (_, other), ..] => Err(TetrahedraError::Overlap {
                first: face.element,
                second: other.element,
                place: center(&self.nodes, &face.nodes),
            }),
            [] => Err(TetrahedraError::Empty),
        };
        groups.map(pair).collect()
    }
}

/// Returns for each node the first node at an equal position.
fn first_of_equal(nodes: &[DVec3]) -> Vec<u32> {
    let mut known = HashMap::with_capacity(nodes.len());
    let number = |(i, node): (usize, &DVec3)| {
        // Adding 0 makes −0 and 0 equal.
        let bits = (*node + 0.0).to_array().map(f64::to_bits);
        *known.entry(bits).or_insert(i as u32)
    };
    nodes.iter().enumerate().map(number).collect()
}

/// Swaps two nodes of a tetrahedron if its last node is not on the side to which the normal of the
/// others points. Returns `None` if the tetrahedron is flat.
fn orient(corners: &mut [u32; 4], nodes: &[DVec3]) -> Option<()> {
    let [a, b, c, d] = corners.map(|node| nodes[node as usize]);
    let longest = slivers::longest_edge(nodes, corners);
    let volume = (b - a).cross(c - a).dot(d - a) / 6.0;
    if volume < 0.0 {
        corners.swap(0, 1);
    }
    (volume.abs() > FLAT * longest.powi(3)).then_some(())
}

/// Returns true if two triangles with the same nodes face in opposite directions.
fn is_opposite([a, b, c]: [u32; 3], other: [u32; 3]) -> bool {
    [[a, c, b], [c, b, a], [b, a, c]].contains(&other)
}

/// Returns the mean of the positions of nodes.
fn center(nodes: &[DVec3], corners: &[u32]) -> DVec3 {
    let sum: DVec3 = corners.iter().map(|node| nodes[*node as usize]).sum();
    sum / corners.len() as f64
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A cube of six tetrahedra around a diagonal; the first three are in region 1.
    pub(super) fn cube() -> (Vec<DVec3>, Vec<[u32; 4]>) {
        let corner =
            |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2));
        let elements = [
            [0, 1, 3, 7],
            [0, 3, 2, 7],
            [0, 2, 6, 7],
            [0, 6, 4, 7],
            [0, 4, 5, 7],
            [0, 5, 1, 7],
        ];
        ((0..8).map(corner).collect(), elements.to_vec())
    }

    /// Six times the volume that a closed surface encloses.
    fn volume(surfaces: &[PartSurface], part: u8) -> f64 {
        let of = |surface: &PartSurface| {
            let sign = match surface.parts {
                [behind, _] if behind == part => 1.0,
                [_, before] if before == part => -1.0,
                _ => return 0.0,
            };
            let at = |node: u32| surface.mesh.positions[node as usize];
            let triangles = surface.mesh.triangles.iter();
            sign * triangles
                .map(|t| at(t[0]).dot(at(t[1]).cross(at(t[2]))))
                .sum::<f64>()
        };
        surfaces.iter().map(of).sum()
    }

    #[test]
    fn surfaces_enclose_their_regions_whatever_the_order_of_nodes() {
        let (nodes, mut elements) = cube();
        elements[1].swap(1, 2);
        elements[4].swap(0, 3);
        let made = Tetrahedra::new(nodes, elements, vec![1, 1, 1, 2, 2, 2]).unwrap();
        let surfaces = made.surfaces(|region| region as u8);
        let parts: Vec<[u8; 2]> = surfaces.iter().map(|s| s.parts).collect();
        assert_eq!(parts, [[1, 0], [2, 0], [2, 1]]);
        assert_eq!([1, 2].map(|part| volume(&surfaces, part)), [3.0, 3.0]);
        let one = made.surfaces(|_| 1);
        assert_eq!((one.len(), one[0].mesh.triangles.len()), (1, 12));
        assert_eq!(volume(&one, 1), 6.0);
        assert_eq!(made.counts(), BTreeMap::from([(1, 3), (2, 3)]));
    }

    #[test]
    fn neighbours_share_the_nodes_of_their_face() {
        let (nodes, elements) = cube();
        let made = Tetrahedra::new(nodes, elements, vec![1; 6]).unwrap();
        let mut shared = 0;
        for (i, beyond) in made.adjacent().iter().enumerate() {
            for (k, other) in beyond.iter().enumerate() {
                let Some(other) = other else { continue };
                let (own, other) = (made.elements()[i], made.elements()[*other as usize]);
                assert!(!other.contains(&own[k]));
                shared += own.iter().filter(|node| other.contains(node)).count();
            }
        }
        // Six inner faces, seen from both sides.
        assert_eq!(shared, 2 * 6 * 3);
    }

    #[test]
    fn equal_nodes_are_one() {
        let (mut nodes, mut elements) = cube();
        nodes.push(nodes[7]);
        elements[2][3] = 8;
        let made = Tetrahedra::new(nodes, elements, vec![1; 6]).unwrap();
        assert_eq!(made.surfaces(|_| 1)[0].mesh.triangles.len(), 12);
    }

    #[test]
    fn mistakes_say_where() {
        let (nodes, elements) = cube();
        let mistake = |nodes: &[DVec3], elements: &[[u32; 4]], regions: usize| {
            Tetrahedra::new(nodes.to_vec(), elements.to_vec(), vec![1; regions]).unwrap_err()
        };
        assert_eq!(mistake(&nodes, &[], 0), TetrahedraError::Empty);
        let count = mistake(&nodes, &elements, 5).to_string();
        assert_eq!(count, "there are 5 regions for 6 elements");
        let unknown = mistake(&nodes, &[[0, 1, 2, 9]], 1).to_string();
        assert!(unknown.contains("element 0 has the node 9"), "{unknown}");
        let flat = mistake(&nodes, &[elements[0], [0, 2, 4, 6]], 2).to_string();
        assert!(flat.contains("element 1 at [0, 0.5, 0.5]"), "{flat}");
        let twice = mistake(&nodes, &[elements[0], [0, 1, 3, 6]], 2).to_string();
        assert!(twice.contains("elements 0 and 1"), "{twice}");
        let mut far = nodes.clone();
        far[2].x = f64::NAN;
        assert_eq!(mistake(&far, &elements, 6), TetrahedraError::NotFinite(2));
    }
}
