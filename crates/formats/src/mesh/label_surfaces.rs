//! Smooth surfaces between voxels of different labels.
//!
//! The mesh has a vertex for each corner of voxels where labels meet, and a quadrilateral for each
//! face between two labels. The vertices are relaxed towards their neighbours, each within half a
//! voxel of its corner (S. F. F. Gibson, "Constrained elastic surface nets", MICCAI 1998; several
//! labels: S. F. Frisken, "SurfaceNets for multi-label segmentations with preservation of sharp
//! boundaries", JCGT 2022). Surfaces of different labels therefore meet without gaps.

use super::MeshData;
use glam::DVec3;
use std::collections::BTreeMap;

/// Fractions of the distance to the mean of its neighbours by which a vertex moves in two
/// alternating steps. The step away from the mean prevents shrinkage of volumes (G. Taubin, "A
/// signal processing approach to fair surface design", SIGGRAPH 1995).
const SHARES: [f64; 2] = [0.6, -0.61];
/// Number of repetitions of the two alternating smoothing steps.
const SMOOTHING_ROUNDS: usize = 30;
/// Largest distance of a vertex from its corner, in voxels along each axis: less than half, so that
/// triangles keep an area.
const MAX_DISPLACEMENT: f64 = 0.49;

/// Division of a volume into parts.
#[derive(Clone, Copy, Debug)]
pub struct Division<'a> {
    /// Number of voxels along x, y, z.
    pub size: [usize; 3],
    /// Part of each voxel, x fastest. Part 0 is the outside, as is everything beyond the volume.
    pub parts: &'a [u8],
}

/// The surface between two parts.
#[derive(Clone, Debug, PartialEq)]
pub struct PartSurface {
    /// Part behind the normals, and the smaller part in front of them.
    pub parts: [u8; 2],
    /// Triangles, in coordinates of the unit cube.
    pub mesh: MeshData,
}

impl Division<'_> {
    /// Returns the surfaces between all parts that touch.
    pub fn surfaces(&self) -> Vec<PartSurface> {
        let faces = self.faces();
        let positions = self.relaxed(&faces);
        let place = |corner: u32| self.in_unit_cube(positions[&corner]);
        let surfaces = faces.into_iter().map(|(parts, quads)| PartSurface {
            parts,
            mesh: mesh(&quads, place),
        });
        surfaces.collect()
    }

    /// Returns the faces between each pair of parts, with corners counter-clockwise as seen from
    /// the smaller part.
    fn faces(&self) -> BTreeMap<[u8; 2], Vec<[u32; 4]>> {
        let [nx, ny, nz] = self.size;
        let mut faces: BTreeMap<[u8; 2], Vec<[u32; 4]>> = BTreeMap::new();
        for axis in 0..3 {
            let reach = |a: usize| self.size[a] + usize::from(a == axis);
            for k in 0..reach(2) {
                for j in 0..reach(1) {
                    for i in 0..reach(0) {
                        let place = [i, j, k];
                        let inside = |p: [usize; 3]| self.parts[p[0] + nx * (p[1] + ny * p[2])];
                        let above = if place[axis] < [nx, ny, nz][axis] {
                            inside(place)
                        } else {
                            0
                        };
                        let mut before = place;
                        let below = match place[axis].checked_sub(1) {
                            Some(lower) => {
                                before[axis] = lower;
                                inside(before)
                            }
                            None => 0,
                        };
                        if above != below {
                            let pair = [above.max(below), above.min(below)];
                            let quad = self.face(place, axis, below > above);
                            faces.entry(pair).or_default().push(quad);
                        }
                    }
                }
            }
        }
        faces
    }

    /// Returns the corners of the face below a voxel across an axis. The normal points along the
    /// axis if `up` is true, else against it.
    fn face(&self, place: [usize; 3], axis: usize, up: bool) -> [u32; 4] {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let corner = |du: usize, dv: usize| {
            let mut p = place;
            p[u] += du;
            p[v] += dv;
            let [cx, cy] = [self.size[0] + 1, self.size[1] + 1];
            (p[0] + cx * (p[1] + cy * p[2])) as u32
        };
        let around = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
        if up {
            around
        } else {
            [around[0], around[3], around[2], around[1]]
        }
    }

    /// Returns the position of a corner, in voxels.
    fn corner(&self, corner: u32) -> DVec3 {
        let (cx, cy) = (self.size[0] + 1, self.size[1] + 1);
        let corner = corner as usize;
        DVec3::new(
            (corner % cx) as f64,
            (corner / cx % cy) as f64,
            (corner / cx / cy) as f64,
        )
    }

    fn in_unit_cube(&self, position: DVec3) -> DVec3 {
        position / DVec3::from_array(self.size.map(|n| n as f64))
    }

    /// Returns the positions of all vertices after relaxation, in voxels. Vertices on the sides of
    /// the volume stay there.
    fn relaxed(&self, faces: &BTreeMap<[u8; 2], Vec<[u32; 4]>>) -> BTreeMap<u32, DVec3> {
        let mut neighbours: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for quad in faces.values().flatten() {
            for k in 0..4 {
                let (a, b) = (quad[k], quad[(k + 1) % 4]);
                for (from, to) in [(a, b), (b, a)] {
                    let known = neighbours.entry(from).or_default();
                    if !known.contains(&to) {
                        known.push(to);
                    }
                }
            }
        }
        let corners: Vec<u32> = neighbours.keys().copied().collect();
        let number = |corner: &u32| corners.partition_point(|c| c < corner);
        let links: Vec<Vec<usize>> = neighbours
            .values()
            .map(|all| all.iter().map(number).collect())
            .collect();
        let homes: Vec<DVec3> = corners.iter().map(|c| self.corner(*c)).collect();
        let mut places = homes.clone();
        for share in SHARES.into_iter().cycle().take(2 * SMOOTHING_ROUNDS) {
            let moved = links
                .iter()
                .zip(&homes)
                .zip(&places)
                .map(|((links, home), place)| {
                    let sum: DVec3 = links.iter().map(|k| places[*k]).sum();
                    let mean = sum / links.len() as f64;
                    self.held(*home, *place + (mean - *place) * share)
                });
            places = moved.collect();
        }
        corners.into_iter().zip(places).collect()
    }

    /// Clamps the position of a vertex to its allowed range.
    fn held(&self, home: DVec3, place: DVec3) -> DVec3 {
        let last = DVec3::from_array(self.size.map(|n| n as f64));
        let axis = |home: f64, place: f64, last: f64| {
            if home == 0.0 || home == last {
                home
            } else {
                place.clamp(home - MAX_DISPLACEMENT, home + MAX_DISPLACEMENT)
            }
        };
        DVec3::new(
            axis(home.x, place.x, last.x),
            axis(home.y, place.y, last.y),
            axis(home.z, place.z, last.z),
        )
    }
}

/// Makes triangles from quadrilaterals, which are divided along their shorter diagonals.
fn mesh(quads: &[[u32; 4]], place: impl Fn(u32) -> DVec3) -> MeshData {
    let mut corners: Vec<u32> = quads.iter().flatten().copied().collect();
    corners.sort_unstable();
    corners.dedup();
    let number = |corner: u32| corners.partition_point(|c| *c < corner) as u32;
    let positions: Vec<DVec3> = corners.iter().map(|c| place(*c)).collect();
    let at = |vertex: u32| positions[vertex as usize];
    let triangles = quads.iter().flat_map(|quad| {
        let [a, b, c, d] = quad.map(number);
        if at(a).distance_squared(at(c)) <= at(b).distance_squared(at(d)) {
            [[a, b, c], [a, c, d]]
        } else {
            [[a, b, d], [b, c, d]]
        }
    });
    MeshData {
        triangles: triangles.collect(),
        positions,
        ..MeshData::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(mesh: &MeshData) -> f64 {
        let cone = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            a.dot(b.cross(c)) / 6.0
        };
        mesh.triangles.iter().map(cone).sum()
    }

    /// Makes a ball of part 1 whose lower half has part 2, in `n`³ voxels.
    fn halves(n: usize, radius: f64) -> Vec<u8> {
        let part = |i: usize| {
            let at = |i: usize| i as f64 + 0.5 - 0.5 * n as f64;
            let p = DVec3::new(at(i % n), at(i / n % n), at(i / n / n));
            if p.length() >= radius {
                0
            } else if p.z < 0.0 {
                2
            } else {
                1
            }
        };
        (0..n * n * n).map(part).collect()
    }

    /// Checks that the smooth surface of a ball has the volume of its voxels, and normals with a
    /// root mean square error of 7°. Both halves share the vertices between them.
    #[test]
    fn smooth_surfaces_are_round_and_without_gaps() {
        let (n, radius) = (26, 10.0);
        let parts: Vec<u8> = halves(n, radius);
        let division = Division {
            size: [n; 3],
            parts: &parts,
        };
        let surfaces = division.surfaces();
        let pairs: Vec<_> = surfaces.iter().map(|s| s.parts).collect();
        assert_eq!(pairs, [[1, 0], [2, 0], [2, 1]]);
        // Expect the third normal to point out of part 2, into part 1.
        let [one, two, between] = [0, 1, 2].map(|i| volume(&surfaces[i].mesh));
        let voxels = parts.iter().filter(|p| **p != 0).count() as f64 / n.pow(3) as f64;
        let change = (one + two) / voxels - 1.0;
        assert!(change.abs() < 0.005, "{change}");
        assert!(
            ((one - between) - (two + between)).abs() < 1e-12,
            "{one} {two} {between}"
        );
        let error = error_of_normals(&surfaces[..2]);
        assert!(error < 0.14, "{error}");
    }

    /// Returns the root mean square angle over the area between normals and the normals of a ball
    /// around the centre.
    fn error_of_normals(surfaces: &[PartSurface]) -> f64 {
        let (mut square, mut area) = (0.0, 0.0);
        for surface in surfaces {
            for t in &surface.mesh.triangles {
                let [a, b, c] = t.map(|v| surface.mesh.positions[v as usize] - 0.5);
                let normal = (b - a).cross(c - a);
                let cosine = normal.normalize().dot((a + b + c).normalize());
                square += cosine.clamp(-1.0, 1.0).acos().powi(2) * normal.length();
                area += normal.length();
            }
        }
        (square / area).sqrt()
    }
}
