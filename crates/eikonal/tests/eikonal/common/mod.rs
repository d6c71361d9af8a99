//! Shared functions of the field tests, and a field of every type with a region to test it in.

pub mod tables;

use glam::{DAffine3, DMat3, DQuat, DVec3};
use morgana_eikonal::field::*;
use morgana_eikonal::{Aabb, Field, Jet};

/// SplitMix64 (Steele, Lea and Flood 2014).
pub struct Random(pub u64);

impl Random {
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.uniform()
    }

    pub fn vector(&mut self) -> DVec3 {
        DVec3::new(self.uniform(), self.uniform(), self.uniform())
    }

    pub fn point(&mut self, region: &Aabb) -> DVec3 {
        region.min + region.size() * self.vector()
    }

    /// Draws a box in `region` of log-uniform size.
    pub fn sub_box(&mut self, region: &Aabb) -> Aabb {
        let scale = 10f64.powf(self.between(-3.0, 0.0));
        let a = self.point(region);
        let b = a + region.size() * (self.vector() * 2.0 - 1.0) * scale;
        Aabb::new(a, region.clamp(b))
    }
}

/// A field to be tested.
pub struct Case {
    pub name: &'static str,
    pub field: Field,
    /// Region of the test; n² is positive there.
    pub region: Aabb,
    /// Points of symmetry of the field.
    pub special: Vec<DVec3>,
    /// True if the field is infinitely differentiable and its bounds tend to its values as a box
    /// shrinks.
    pub analytic: bool,
}

fn case(name: &'static str, field: impl Into<Field>, half: f64, center: DVec3) -> Case {
    Case {
        name,
        field: field.into(),
        region: Aabb::new(center - half, center + half),
        special: vec![center],
        analytic: true,
    }
}

pub const CENTER: DVec3 = DVec3::new(0.3, -0.2, 0.5);

pub fn acoustic() -> Acoustic {
    let modes = vec![
        AcousticMode::new(0.02, 3, 4.0, 0.4).unwrap(),
        AcousticMode::new(-0.01, 0, 7.0, 0.0).unwrap(),
        AcousticMode::new(0.015, 1, 5.0, -1.0).unwrap(),
        AcousticMode::new(0.01, 2, 6.0, 2.0).unwrap(),
        AcousticMode::new(0.01, 9, 11.0, 0.0).unwrap(),
    ];
    Acoustic::new(1.333, CENTER, DVec3::new(1.0, 2.0, -0.5), DVec3::Z, modes).unwrap()
}

/// A mode along x, with the parameters of published ultrasonic light guides.
pub fn one_wave() -> Acoustic {
    let mode = AcousticMode::new(0.02, 3, 8.0, 0.0).unwrap();
    Acoustic::new(1.3333, CENTER, DVec3::X, DVec3::Z, vec![mode]).unwrap()
}

pub fn ripples(x: DVec3) -> f64 {
    1.35 + 0.03 * (2.0 * x.x + x.y).sin() * (1.5 * x.z - 0.5 * x.y).cos()
}

pub fn grid(placement: Placement) -> Bspline {
    let bounds = Aabb::new(DVec3::new(-1.0, -0.8, -1.2), DVec3::new(1.0, 1.2, 0.8));
    Bspline::from_fn([17, 12, 14], bounds, placement, ripples).unwrap()
}

pub fn rigid() -> DAffine3 {
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize(), 1.1);
    DAffine3::from_scale_rotation_translation(DVec3::splat(1.7), turn, DVec3::new(0.2, 0.4, -0.3))
}

pub fn shear() -> DAffine3 {
    let linear = DMat3::from_cols(
        DVec3::new(1.2, 0.3, 0.0),
        DVec3::new(-0.4, 0.7, 0.2),
        DVec3::new(0.1, 0.0, -1.5),
    );
    DAffine3::from_mat3_translation(linear, DVec3::new(0.1, -0.2, 0.3))
}

/// A field whose index is given by a formula.
pub fn formula(text: &str) -> Field {
    Formula::new(text, Quantity::Index, &[]).unwrap().into()
}

/// A table of an index that decreases with a distance, or along a line.
pub fn table(coordinate: Coordinate, start: f64) -> IndexProfile {
    let place = |i: i32| start + 0.21 * f64::from(i);
    let samples: Vec<[f64; 2]> = (0..20)
        .map(|i| [place(i), 1.3 + 0.1 * place(i).cos()])
        .collect();
    IndexProfile::table(coordinate, 0.0, &samples).unwrap()
}

const WAVES: &str = "1.4 + 0.03*sin(2*x + y)*cos(1.5*z - 0.5*y) + 0.01*exp(-rho^2)*atan2(x, 3 + y)";

/// Returns one field of every type.
pub fn all_fields() -> Vec<Case> {
    let slope = DVec3::new(0.05, -0.1, 0.02);
    let axis = DVec3::new(0.3, -1.0, 2.0);
    let bump = Gaussian::new(1.33, 0.08, CENTER, 0.4).unwrap();
    let dip = Gaussian::new(1.4, -0.1, CENTER, 0.5).unwrap();
    let lens = Luneburg::new(1.1, CENTER, 2.0).unwrap();
    let fisheye = Fisheye::new(2.0, CENTER, 0.8).unwrap();
    let rod = Selfoc::new(1.6, 0.5, CENTER, axis).unwrap();
    let sum = Sum::new(1.33, vec![bump.into(), acoustic().into(), rod.into()]).unwrap();
    let wave = Gaussian::new(1.4, -0.1, DVec3::ZERO, 0.5).unwrap();
    vec![
        case("constant", Constant::new(1.5), 1.0, CENTER),
        case(
            "linear n",
            LinearIndex::new(1.3, slope, CENTER).unwrap(),
            2.0,
            CENTER,
        ),
        case(
            "linear n²",
            LinearSquare::new(1.3, slope, CENTER).unwrap(),
            2.0,
            CENTER,
        ),
        case("Luneburg", lens, 1.2, CENTER),
        case("SELFOC", rod, 1.0, CENTER),
        case(
            "SELFOC along z",
            Selfoc::new(1.6, 0.5, CENTER, DVec3::Z).unwrap(),
            1.0,
            CENTER,
        ),
        case("fisheye", fisheye, 2.5, CENTER),
        case("Gaussian bump", bump, 1.5, CENTER),
        case("Gaussian dip", dip, 1.5, CENTER),
        case("waves", acoustic(), 2.0, CENTER),
        case("one wave", one_wave(), 1.5, CENTER),
        Case {
            analytic: false,
            ..case("grid of nodes", grid(Placement::Nodes), 1.5, DVec3::ZERO)
        },
        Case {
            analytic: false,
            ..case(
                "grid of centers",
                grid(Placement::Centers),
                1.5,
                DVec3::ZERO,
            )
        },
        Case {
            analytic: false,
            ..case("sum", sum, 0.8, CENTER)
        },
        case(
            "moved bump",
            Affine::new(wave.into(), rigid()).unwrap(),
            1.5,
            CENTER,
        ),
        Case {
            analytic: false,
            ..case(
                "sheared waves",
                Affine::new(acoustic().into(), shear()).unwrap(),
                1.5,
                shear().transform_point3(CENTER),
            )
        },
        Case {
            analytic: false,
            ..case(
                "sheared fisheye",
                Affine::new(fisheye.into(), shear()).unwrap(),
                2.0,
                shear().transform_point3(CENTER),
            )
        },
        Case {
            analytic: false,
            ..case(
                "sheared grid",
                Affine::new(grid(Placement::Nodes).into(), shear()).unwrap(),
                1.5,
                DVec3::ZERO,
            )
        },
        case("formula", formula(WAVES), 1.5, DVec3::ZERO),
        case(
            "formula in r",
            formula("1.3 + 0.1*cos(2*r)/(1 + r^2)"),
            1.5,
            DVec3::ZERO,
        ),
        case(
            "formula in rho",
            formula("1.6*sqrt(1 - 0.1*rho^2)"),
            1.2,
            DVec3::ZERO,
        ),
        case(
            "formula in z",
            formula("1.33 + 0.02*tanh(3*z)"),
            1.5,
            DVec3::ZERO,
        ),
        Case {
            analytic: false,
            ..case("table in r", table(Coordinate::R, 0.0), 1.5, DVec3::ZERO)
        },
        Case {
            analytic: false,
            ..case("table in x", table(Coordinate::X, -1.9), 1.5, DVec3::ZERO)
        },
        case(
            "scaled bump",
            Scaled::new(bump.into(), 1.02).unwrap(),
            1.5,
            CENTER,
        ),
        Case {
            analytic: false,
            ..case(
                "grid with a larger excess",
                Scaled::excess(grid(Placement::Nodes), 1.2, 1.4).unwrap(),
                1.5,
                DVec3::ZERO,
            )
        },
        Case {
            analytic: false,
            ..case(
                "grid with a smaller excess",
                Scaled::excess(grid(Placement::Centers), 1.2, 0.6).unwrap(),
                1.5,
                DVec3::ZERO,
            )
        },
    ]
}

/// Returns a length over which the field changes little: a sixth of the length scale, or 1 if that
/// is infinite. The length scale is up to six times the inverse wave number.
pub fn scale(field: &Field, x: DVec3) -> f64 {
    match field.length_scale(x) {
        l if l.is_finite() => l / 6.0,
        _ => 1.0,
    }
}

/// Largest entry of a matrix by absolute value.
pub fn max_entry(m: DMat3) -> f64 {
    m.to_cols_array()
        .into_iter()
        .fold(0.0, |a, b| a.max(b.abs()))
}

#[track_caller]
pub fn assert_jets_agree(a: Jet, b: Jet, tolerance: f64) {
    let worst = (a.n2 - b.n2)
        .abs()
        .max((a.grad - b.grad).abs().max_element())
        .max(max_entry(a.hess - b.hess));
    assert!(worst <= tolerance, "{a:?}\n{b:?}\ndiffer by {worst:e}");
}
