//! Flat charts of the parts of a shape, on which integrals over the area are exact.

use super::{Shape, Site, Uv, cube, each};
use glam::{DAffine2, DMat2, DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Area per unit area of a chart, as a function of the chart coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum AreaDensity {
    /// Constant.
    Even,
    /// Proportional to the first coordinate, a distance from a centre.
    Radial,
    /// Proportional to the sine of π times the second coordinate, an angle from a pole.
    Polar,
}

/// Domain of the coordinates of a chart.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Domain {
    /// Unit square.
    Square,
    /// Triangle (0, 0), (1, 0), (0, 1).
    Triangle,
}

/// Part of a shape, with coordinates in which textures are polynomials between the lines of their
/// grids.
#[derive(Clone, Debug)]
pub(crate) struct Chart {
    domain: Domain,
    density: AreaDensity,
    area: f64,
    /// Map from chart coordinates to texture coordinates.
    uv: DAffine2,
    /// First corner of the triangle of a mesh. Only textures with colours of vertices use
    /// positions.
    origin: DVec3,
    sides: [DVec3; 2],
    primitive: u32,
}

/// Number of bands of a polar chart, large enough for [`Chart::quadrature`] to be exact to
/// rounding.
const BANDS: u32 = 64;

impl Shape {
    /// Returns true if area grows uniformly over each curved part, up to the rounding of a
    /// transform. Returns false for ellipsoids and elliptic cylinders.
    pub fn is_even(&self) -> bool {
        match self {
            Shape::Sphere(s) => s.is_even(),
            Shape::Cylinder(s) => s.is_even(),
            _ => true,
        }
    }

    /// Returns a chart of part `primitive`. Returns `None` where the density of the area has no
    /// simple form: on ellipsoids, elliptic cylinders and faces of voxels.
    pub(crate) fn chart(&self, primitive: u32) -> Option<Chart> {
        let density = each!(self, s => s.area_density(primitive)?, {
            Shape::Mesh(_) => AreaDensity::Even,
            Shape::VoxelFaces(_) => return None,
        });
        let mut chart = Chart {
            domain: Domain::Square,
            density,
            area: self.part_area(primitive),
            uv: DAffine2::IDENTITY,
            origin: DVec3::ZERO,
            sides: [DVec3::ZERO; 2],
            primitive,
        };
        match self {
            Shape::Cube(_) => chart.uv = affine(|q| cube::texture_uv(primitive, q)),
            Shape::Mesh(mesh) => {
                let [a, b, c] = mesh.triangle(primitive as usize);
                let uv = |[x, y]: [f64; 2]| mesh.uv(primitive as usize, [1.0 - x - y, x, y]);
                (chart.domain, chart.uv) = (Domain::Triangle, affine(uv));
                (chart.origin, chart.sides) = (a, [b - a, c - a]);
            }
            _ => {}
        }
        Some(chart)
    }

    fn part_area(&self, primitive: u32) -> f64 {
        match self {
            Shape::Mesh(mesh) => {
                let [a, b, c] = mesh.triangle(primitive as usize);
                0.5 * (b - a).cross(c - a).length()
            }
            _ => self.part_areas()[primitive as usize],
        }
    }

    /// Returns the number of parts that [`super::Hit::primitive`] distinguishes.
    pub(crate) fn part_count(&self) -> u32 {
        match self {
            Shape::Mesh(mesh) => mesh.triangles().len() as u32,
            _ => self.part_areas().len() as u32,
        }
    }
}

/// Returns the affine map that agrees with `f` at three corners.
fn affine(f: impl Fn([f64; 2]) -> [f64; 2]) -> DAffine2 {
    let at = |q| DVec2::from(f(q));
    let origin = at([0.0, 0.0]);
    let sides = [at([1.0, 0.0]) - origin, at([0.0, 1.0]) - origin];
    DAffine2::from_mat2_translation(DMat2::from_cols(sides[0], sides[1]), origin)
}

impl Chart {
    /// Returns the chart as convex polygons.
    pub(crate) fn polygons(&self) -> Vec<Vec<DVec2>> {
        let band = |low: f64, high: f64| [[0.0, low], [1.0, low], [1.0, high], [0.0, high]];
        let at = |k: u32| f64::from(k) / f64::from(BANDS);
        let all = match (self.domain, self.density) {
            (Domain::Triangle, _) => vec![vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]],
            (Domain::Square, AreaDensity::Polar) => {
                (0..BANDS).map(|k| band(at(k), at(k + 1)).into()).collect()
            }
            (Domain::Square, _) => vec![band(0.0, 1.0).into()],
        };
        let polygon = |corners: Vec<[f64; 2]>| corners.into_iter().map(DVec2::from).collect();
        all.into_iter().map(polygon).collect()
    }

    /// Returns the map from chart coordinates to texture coordinates.
    pub(crate) fn uv(&self) -> DAffine2 {
        self.uv
    }

    /// Returns the data that textures need at chart coordinates `q`.
    pub(crate) fn site(&self, q: DVec2) -> Site {
        Site {
            position: self.origin + self.sides[0] * q.x + self.sides[1] * q.y,
            uv: Uv::Plain(self.uv.transform_point2(q).into()),
            primitive: self.primitive,
        }
    }

    /// Calls `point` with points of a convex polygon of the chart and their weights in integrals
    /// over the area. The rule is exact for quadratic polynomials. With polar area density it is
    /// exact to rounding if the polygon fits into a band.
    pub(crate) fn quadrature(&self, polygon: &[DVec2], mut point: impl FnMut(DVec2, f64)) {
        let nodes = self.nodes();
        for k in 2..polygon.len() {
            let [a, b, c] = [polygon[0], polygon[k - 1], polygon[k]];
            let double = (b - a).perp_dot(c - a).abs();
            // Map a square onto the triangle by collapsing one side of the square.
            for (s, ws) in nodes {
                for (t, wt) in nodes {
                    let q = a + (b - a) * (s * (1.0 - t)) + (c - a) * (s * t);
                    point(q, self.density(q) * double * s * ws * wt);
                }
            }
        }
    }

    /// Returns the area per unit area of the chart.
    fn density(&self, q: DVec2) -> f64 {
        self.area
            * match (self.density, self.domain) {
                (AreaDensity::Even, Domain::Square) => 1.0,
                (AreaDensity::Even, Domain::Triangle) => 2.0,
                (AreaDensity::Radial, _) => 2.0 * q.x,
                // Planted error "a picture on a sphere shines with the mean of its pixels", found by morgana-transport/transport::ends::textured::powers_in_closed_form:
                // (AreaDensity::Polar, _) => 1.0,
                (AreaDensity::Polar, _) => FRAC_PI_2 * (PI * q.y).sin(),
            }
    }

    /// Returns nodes and weights of Gauss's rule on [0, 1] (Abramowitz and Stegun, table 25.4). The
    /// square adds one to the degree of a polynomial. Two nodes are exact for degree 2, three for
    /// degree 4. With four nodes, the error for half a turn over [`BANDS`] is below rounding.
    fn nodes(&self) -> &'static [(f64, f64)] {
        match self.density {
            AreaDensity::Even => &GAUSS_2,
            AreaDensity::Radial => &GAUSS_3,
            AreaDensity::Polar => &GAUSS_4,
        }
    }
}

const GAUSS_2: [(f64, f64); 2] = [
    (0.211_324_865_405_187_1, 0.5),
    (0.788_675_134_594_812_9, 0.5),
];
const GAUSS_3: [(f64, f64); 3] = [
    (0.112_701_665_379_258_3, 5.0 / 18.0),
    (0.5, 8.0 / 18.0),
    (0.887_298_334_620_741_7, 5.0 / 18.0),
];
const GAUSS_4: [(f64, f64); 4] = [
    (0.069_431_844_202_973_7, 0.173_927_422_568_727),
    (0.330_009_478_207_571_9, 0.326_072_577_431_273),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273),
    (0.930_568_155_797_026_3, 0.173_927_422_568_727),
];
