//! Random numbers, random shapes, and brute-force intersections.

use eikonal::ray::Arc;
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::shape::{Cube, Cylinder, Disk, Mesh, Rectangle, Shape, Sphere};
use std::collections::HashMap;

/// SplitMix64.
pub struct Rng(pub u64);

impl Rng {
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn pair(&mut self) -> [f64; 2] {
        [self.uniform(), self.uniform()]
    }

    pub fn index(&mut self, n: usize) -> usize {
        (self.uniform() * n as f64) as usize
    }

    /// Draws a uniform point in the cube [−r, r]³.
    pub fn vector(&mut self, r: f64) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| r * (2.0 * self.uniform() - 1.0)))
    }

    pub fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.vector(1.0);
            if v.length_squared() > 0.01 && v.length_squared() < 1.0 {
                return v.normalize();
            }
        }
    }

    /// Draws a general affine map, which may mirror.
    pub fn affine(&mut self) -> DAffine3 {
        loop {
            let m = DMat3::from_cols(self.vector(1.0), self.vector(1.0), self.vector(1.0));
            if m.determinant().abs() > 0.15 {
                return DAffine3::from_mat3_translation(m, self.vector(0.7));
            }
        }
    }

    /// Draws a rotation with a uniform scale and a translation.
    pub fn similarity(&mut self) -> DAffine3 {
        let (x, y) = self.direction().any_orthonormal_pair();
        let m = DMat3::from_cols(x, y, x.cross(y)) * (0.5 + self.uniform());
        DAffine3::from_mat3_translation(m, self.vector(0.7))
    }

    /// Draws a strongly bent arc around the origin.
    pub fn arc(&mut self) -> Arc {
        let mut end = || [self.vector(1.8), self.vector(5.0), self.vector(25.0)];
        Arc::hermite(end(), end(), 1.0)
    }

    /// Draws a line towards the middle, which may pass it.
    pub fn line(&mut self) -> Arc {
        let (x, target) = (self.vector(2.0), self.vector(0.8));
        Arc::line(x, target - x, 0.5 + 2.0 * self.uniform())
    }
}

/// The analytic shapes in local coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    Sphere,
    Cube,
    Rectangle,
    Disk,
    EdgeGeometry,
    Can,
}

pub const KINDS: [Kind; 6] = [
    Kind::Sphere,
    Kind::Cube,
    Kind::Rectangle,
    Kind::Disk,
    Kind::EdgeGeometry,
    Kind::Can,
];

impl Kind {
    pub fn shape(self, m: DAffine3) -> Shape {
        match self {
            Kind::Sphere => Sphere::new(m).unwrap().into(),
            Kind::Cube => Cube::new(m).unwrap().into(),
            Kind::Rectangle => Rectangle::new(m).unwrap().into(),
            Kind::Disk => Disk::new(m).unwrap().into(),
            Kind::EdgeGeometry => Cylinder::new(m, false).unwrap().into(),
            Kind::Can => Cylinder::new(m, true).unwrap().into(),
        }
    }

    /// A function that vanishes on the surface (and, for open shapes, on its continuation).
    pub fn implicit(self, p: DVec3) -> f64 {
        let r = p.truncate().length();
        match self {
            Kind::Sphere => p.length() - 1.0,
            Kind::Cube => p.abs().max_element() - 1.0,
            Kind::Rectangle | Kind::Disk => p.z,
            Kind::EdgeGeometry => r - 1.0,
            Kind::Can => (r - 1.0).max(p.z - 1.0).max(-p.z),
        }
    }

    /// Distance of a point of the continuation from the edge of the surface, positive inside.
    pub fn margin(self, p: DVec3) -> f64 {
        match self {
            Kind::Sphere | Kind::Cube | Kind::Can => f64::INFINITY,
            Kind::Rectangle => 1.0 - p.truncate().abs().max_element(),
            Kind::Disk => 1.0 - p.truncate().length(),
            Kind::EdgeGeometry => p.z.min(1.0 - p.z),
        }
    }

    pub fn contains(self, p: DVec3) -> bool {
        self.margin(p) == f64::INFINITY && self.implicit(p) < 0.0
    }
}

/// Returns the first crossing, found by dense sampling of the arc and refined by bisection.
pub fn brute_force(kind: Kind, to_local: &DAffine3, arc: &Arc) -> Option<f64> {
    const STEPS: usize = 10_000;
    let f = |t: f64| kind.implicit(to_local.transform_point3(arc.position(t)));
    let mut before = f(0.0);
    for i in 1..=STEPS {
        let (mut a, mut b) = ((i - 1) as f64 / STEPS as f64, i as f64 / STEPS as f64);
        let after = f(b);
        if (before < 0.0) != (after < 0.0) {
            for _ in 0..50 {
                let m = 0.5 * (a + b);
                if (f(m) < 0.0) == (before < 0.0) {
                    a = m
                } else {
                    b = m
                }
            }
            if kind.margin(to_local.transform_point3(arc.position(b))) > 0.0 {
                return Some(b);
            }
        }
        before = after;
    }
    None
}

/// Returns θ of all hits; each search continues from the last hit.
pub fn all_hits(shape: &Shape, arc: &Arc) -> Vec<f64> {
    let mut hits = vec![];
    let mut from = 0.0;
    while let Some(hit) = shape.first_hit(arc, from, 1.0) {
        assert!(hit.theta > from && hit.theta <= 1.0);
        hits.push(hit.theta);
        from = hit.theta;
    }
    hits
}

/// An icosahedron on the unit sphere whose faces are divided into four, `n` times.
pub fn icosphere(n: usize) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let g = 0.5 * (1.0 + 5f64.sqrt());
    let mut vertices = vec![];
    for (a, b) in [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)] {
        vertices.push(DVec3::new(a, b, 0.0).normalize());
        vertices.push(DVec3::new(0.0, a, b).normalize());
        vertices.push(DVec3::new(b, 0.0, a).normalize());
    }
    // The faces are the triples of mutually adjacent vertices.
    let edge = 2.0 / (1.0 + g * g).sqrt();
    let near = |i: usize, j: usize| vertices[i].distance(vertices[j]) < 1.01 * edge;
    let mut faces = vec![];
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if near(i, j) && near(j, k) && near(k, i) {
                    let [a, b, c] = [i, j, k].map(|v| vertices[v]);
                    let out = (b - a).cross(c - a).dot(a) > 0.0;
                    let face = if out { [i, j, k] } else { [i, k, j] };
                    faces.push(face.map(|v| v as u32));
                }
            }
        }
    }
    for _ in 0..n {
        faces = refine(&mut vertices, &faces);
    }
    (vertices, faces)
}

fn refine(vertices: &mut Vec<DVec3>, faces: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut middle = HashMap::new();
    let mut fine = vec![];
    for &[a, b, c] in faces {
        let mut mid = |i: u32, j: u32| {
            *middle.entry((i.min(j), i.max(j))).or_insert_with(|| {
                vertices.push((vertices[i as usize] + vertices[j as usize]).normalize());
                vertices.len() as u32 - 1
            })
        };
        let (ab, bc, ca) = (mid(a, b), mid(b, c), mid(c, a));
        fine.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
    }
    fine
}

/// A star-shaped mesh with bumps, closed and not convex.
pub fn bumpy(n: usize) -> Mesh {
    let (vertices, faces) = icosphere(n);
    let bump = |p: &DVec3| *p * (1.0 + 0.3 * (7.0 * p.x).sin() * (5.0 * p.y + 2.0 * p.z).cos());
    Mesh::new(vertices.iter().map(bump).collect(), faces, None).unwrap()
}
