//! Tables of `data/connections.json`: for eight fields, pairs of points and every ray between them
//! that stays in a domain.
//!
//! A dense multistart search found these rays, starting from the closest approaches of 400
//! directions and from local minima of the miss over 6000 more. It used scipy's DOP853 at rtol =
//! atol = 1e-12 and the variational equations. The tables of F2, F3 and F4 agree with closed forms,
//! which proves that they are complete.

use glam::DVec3;
use morgana_eikonal::Field;
use morgana_eikonal::field::{
    Acoustic, AcousticMode, Fisheye, Gaussian, LinearIndex, Luneburg, Selfoc,
};
use serde_json::Value;
use std::f64::consts::TAU;

/// Tolerance of directions. The tables are accurate to about 1e-11, and rays keep 1e-10 per unit
/// length over a few units.
pub const DIRECTION: f64 = 1e-8;
/// Relative tolerance of lengths; see [`DIRECTION`].
pub const LENGTH: f64 = 1e-8;
/// Relative tolerance of J and J/n², as the validation table states it.
pub const JACOBIAN: f64 = 1e-6;

/// A field with its pairs.
pub struct Table {
    pub name: &'static str,
    pub field: Field,
    pub pairs: Vec<Pair>,
    domain: Value,
}

/// Two points and the rays between them.
pub struct Pair {
    pub id: String,
    pub ends: [DVec3; 2],
    pub branches: Vec<Branch>,
}

/// A listed ray.
#[derive(Clone, Copy, Debug)]
pub struct Branch {
    pub direction_out: DVec3,
    pub direction_in: DVec3,
    pub arc_length: f64,
    pub optical_length: f64,
    pub sigma: f64,
    pub jacobian: f64,
    /// J/n².
    pub reciprocal: f64,
}

impl Table {
    /// True if a point lies in the domain that the listed rays do not leave.
    pub fn contains(&self, p: DVec3) -> bool {
        let size = |i: usize| self.domain[i].as_f64().unwrap();
        match self.domain[0].as_str().unwrap() {
            "box" => {
                let [min, max] = self.corners();
                p.cmpge(min).all() && p.cmple(max).all()
            }
            "ball" => p.length() <= size(1),
            _ => p.truncate().length() <= size(1) && p.z.abs() <= size(2),
        }
    }

    /// Returns the corners of a box that contains the domain.
    pub fn corners(&self) -> [DVec3; 2] {
        let size = |i: usize| self.domain[i].as_f64().unwrap();
        match self.domain[0].as_str().unwrap() {
            "box" => [vector(&self.domain[1]), vector(&self.domain[2])],
            "ball" => [DVec3::splat(-size(1)), DVec3::splat(size(1))],
            _ => [-1.0, 1.0].map(|s| DVec3::new(size(1), size(1), size(2)) * s),
        }
    }

    /// Returns the longest optical path of a listed ray.
    pub fn longest(&self) -> f64 {
        let branches = self.pairs.iter().flat_map(|p| &p.branches);
        branches.map(|b| b.optical_length).fold(0.0, f64::max)
    }
}

/// Reads all eight tables.
pub fn tables() -> Vec<Table> {
    let data: Value = serde_json::from_str(include_str!("../../data/connections.json")).unwrap();
    fields()
        .into_iter()
        .map(|(name, field)| {
            let table = &data["fields"][name];
            let pairs = table["pairs"].as_array().unwrap().iter();
            Table {
                name,
                pairs: pairs.map(|p| pair(p, &field)).collect(),
                field,
                domain: table["domain"].clone(),
            }
        })
        .collect()
}

fn fields() -> Vec<(&'static str, Field)> {
    let mode = |order| AcousticMode::new(0.02, order, TAU / 0.6, 0.0).unwrap();
    // φ = atan2(y, z) about the x axis: φ = 0 along +z, and +y at φ = 90°.
    let acoustic =
        |order| Acoustic::new(1.3333, DVec3::ZERO, -DVec3::X, DVec3::Z, vec![mode(order)]).unwrap();
    let linear = LinearIndex::new(1.3, DVec3::Y * 0.15, -DVec3::Y).unwrap();
    let rod = Selfoc::new(1.5, 0.4f64.sqrt(), DVec3::ZERO, DVec3::Z).unwrap();
    let bump = Gaussian::new(1.33, 0.15, DVec3::ZERO, 0.25).unwrap();
    vec![
        ("F1", linear.into()),
        ("F2", Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap().into()),
        ("F3", rod.into()),
        ("F4", Fisheye::new(2.0, DVec3::ZERO, 1.0).unwrap().into()),
        ("F5", bump.into()),
        ("F5X", bump.into()),
        ("F6", acoustic(0).into()),
        ("F7", acoustic(3).into()),
    ]
}

fn pair(pair: &Value, field: &Field) -> Pair {
    let (x, n) = (vector(&pair["x"]), pair["n_x"].as_f64().unwrap());
    assert!((field.n(x) - n).abs() < 1e-12, "{}", pair["id"]);
    let branches = pair["branches"].as_array().unwrap();
    let branch = |b: &Value| {
        let number = |key: &str| b[key].as_f64().unwrap();
        Branch {
            direction_out: vector(&b["direction_x"]),
            direction_in: vector(&b["direction_y"]),
            arc_length: number("arc_length"),
            optical_length: number("opl"),
            sigma: number("sigma"),
            jacobian: number("J"),
            reciprocal: number("J_over_nx2"),
        }
    };
    Pair {
        id: pair["id"].as_str().unwrap().to_owned(),
        ends: [x, vector(&pair["y"])],
        branches: branches.iter().map(branch).collect(),
    }
}

fn vector(v: &Value) -> DVec3 {
    let c = |i: usize| v[i].as_f64().unwrap();
    DVec3::new(c(0), c(1), c(2))
}

impl Branch {
    /// True if the found ray leaves in this direction.
    pub fn is(&self, found: &morgana_eikonal::ConnectingRay) -> bool {
        self.direction_out.distance(found.direction_out) < DIRECTION
    }

    /// True if all quantities of the found ray agree with the listed ones.
    pub fn agrees(&self, found: &morgana_eikonal::ConnectingRay, n2_x: f64) -> bool {
        let close = |a: f64, b: f64, tolerance: f64| (a - b).abs() <= tolerance * b.abs();
        self.is(found)
            && self.direction_in.distance(found.direction_in) < DIRECTION
            && close(found.arc_length, self.arc_length, LENGTH)
            && close(found.optical_length, self.optical_length, LENGTH)
            && close(found.sigma, self.sigma, LENGTH)
            && close(found.jacobian, self.jacobian, JACOBIAN)
            && close(found.jacobian / n2_x, self.reciprocal, JACOBIAN)
    }
}
