//! Phase functions: χ² of the samplers, normalisation, mean cosines, closed forms at the limits.
//!
//! False alarms: 3e-4 for each of the three families, so 1e-3 for the file. Seeds are fixed.

use glam::DVec3;
use morgana_transport::phase::{Phase, PhaseError, Spheres};
use std::f64::consts::PI;
use testkit::{DirectionTable, Family, Mass, Moments, Rng, z_test};

const FALSE_ALARM: f64 = 3e-4;
const DIR: DVec3 = DVec3::new(0.48, -0.6, 0.64);

/// Returns the density at a cosine, of a phase function of the angle.
fn at_cosine(phase: &Phase, cos: f64) -> f64 {
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    phase.pdf(DVec3::ZERO, [DVec3::Z, DVec3::new(sin, 0.0, cos)])
}

fn mean_cosine(phase: &Phase) -> f64 {
    phase.mean_cosine(DVec3::ZERO).unwrap()
}

/// Phase functions with their names, and the width of the lobe around ±`DIR`, in radians.
fn cases() -> Vec<(String, Phase, f64)> {
    let mut cases = vec![("isotropic".into(), Phase::isotropic(), 3.0)];
    for g in [-0.99, -0.6, -1e-9, 0.0, 1e-5, 0.3, 0.9, 0.99, 0.9999] {
        let width = (1.0 - f64::abs(g)).max(1e-4);
        cases.push((
            format!("HG {g}"),
            Phase::henyey_greenstein(g).unwrap(),
            width,
        ));
    }
    for kappa in [0.0, 1e-12, 1e-3, 0.7, 20.0, 1e3, 1e6] {
        let width = 1.0 / f64::sqrt(kappa).max(1.0);
        cases.push((
            format!("vMF {kappa}"),
            Phase::von_mises_fisher(kappa).unwrap(),
            width,
        ));
    }
    let cosines = vec![-1.0, -0.7, 0.0, 0.1, 0.9, 1.0];
    let table = Phase::tabulated(cosines, &[0.5, 0.0, 0.0, 1.0, 2.0, 30.0]).unwrap();
    cases.push(("tabulated".into(), table, 0.5));
    cases.push(("Rayleigh".into(), Phase::rayleigh(), 3.0));
    for (radius, deviation, width) in [(0.02, 1.0, 3.0), (0.5, 1.0, 0.3), (0.3, 1.5, 0.3)] {
        let spheres = Spheres {
            radius,
            geometric_deviation: deviation,
            n: 1.587,
            k: 0.01,
            exterior: 1.332,
            wavelength: 0.6328,
        };
        let name = format!("Mie {radius}, {deviation}");
        cases.push((name, Phase::mie(&spheres).unwrap(), width));
    }
    let haze = [Phase::rayleigh(), Phase::henyey_greenstein(0.95).unwrap()];
    for weight in [0.0, 0.3, 1.0] {
        let blend = Phase::blend(haze.clone(), weight).unwrap();
        cases.push((format!("blend {weight}"), blend, 0.05));
    }
    cases
}

#[test]
fn samplers_follow_their_densities() {
    let mut family = Family::new(FALSE_ALARM);
    for (i, (name, phase, width)) in cases().into_iter().enumerate() {
        let forward = if mean_cosine(&phase) >= 0.0 {
            1.0
        } else {
            -1.0
        };
        let table = DirectionTable::peaked((forward * DIR).to_array(), width, 24, 8);
        let report = table.test(
            i as u64,
            50_000,
            Mass::Exactly(1.0),
            |r| Some(phase.sample(DVec3::ZERO, DIR, r.uniform()).0.to_array()),
            |d| phase.pdf(DVec3::ZERO, [DIR, d.into()]),
        );
        family.push(
            name.clone(),
            report.unwrap_or_else(|e| panic!("{name}: {e}")).p_value,
        );
    }
    family.check().unwrap();
}

#[test]
fn mean_cosines() {
    let mut names = Vec::new();
    let mut zs = Vec::new();
    for (i, (name, phase, _)) in cases().into_iter().enumerate() {
        let mut rng = Rng::new(1000 + i as u64);
        // Measure 1 − cosθ as |d − d'|²/2, which is exact for narrow lobes.
        let mut below = Moments::default();
        for _ in 0..40_000 {
            let d = phase.sample(DVec3::ZERO, DIR, rng.uniform()).0;
            below.push(0.5 * (d - DIR).length_squared());
        }
        names.push(name);
        zs.push(below.z(1.0 - mean_cosine(&phase)));
    }
    z_test::max_abs_z(&zs, FALSE_ALARM).unwrap_or_else(|e| panic!("{e} in {names:?}"));
}

#[test]
fn the_sample_carries_its_density_and_a_unit_direction() {
    let mut rng = Rng::new(3);
    let last = 1.0 - f64::EPSILON / 2.0;
    let corners = [[0.0, 0.0], [last, last], [0.0, last], [0.5, 0.0]];
    for (name, phase, _) in cases() {
        for k in 0..500 {
            let u = corners.get(k).copied().unwrap_or_else(|| rng.uniform());
            let (d, pdf) = phase.sample(DVec3::ZERO, DIR, u);
            assert!((d.length() - 1.0).abs() < 1e-14, "{name}: {d} for {u:?}");
            assert!(pdf.is_finite() && pdf >= 0.0, "{name}: {pdf} for {u:?}");
            let again = phase.pdf(DVec3::ZERO, [DIR, d]);
            // Allow for rounding in the cosine of world vectors, which a lobe of κ = 1e6 magnifies.
            assert!(
                (again - pdf).abs() <= 1e-6 * pdf + 1e-9,
                "{name}: {again} against {pdf} for {u:?}"
            );
        }
    }
}

/// The sampled cosine is the linear interpolation of quantiles at equal steps of the random number,
/// as in MCX, and its density is the inverse of the slope.
#[test]
fn quantiles_are_interpolated() {
    let quantiles = [-1.0, -0.5, 0.2, 0.6, 0.8, 0.9, 1.0];
    let phase = Phase::quantiles(quantiles.to_vec()).unwrap();
    let mut rng = Rng::new(11);
    for _ in 0..1000 {
        let u: [f64; 2] = rng.uniform();
        let (direction, pdf) = phase.sample(DVec3::ZERO, DIR, u);
        let (i, t) = ((6.0 * u[0]).floor() as usize, 6.0 * u[0] % 1.0);
        let width = quantiles[i + 1] - quantiles[i];
        let expected = quantiles[i] + t * width;
        assert!((direction.dot(DIR) - expected).abs() < 1e-12, "{u:?}");
        assert!((pdf * 12.0 * PI * width - 1.0).abs() < 1e-12, "{u:?}");
    }
    // The mean of the middles of the intervals.
    let middles = [-0.75, -0.15, 0.4, 0.7, 0.85, 0.95];
    assert!((mean_cosine(&phase) - middles.iter().sum::<f64>() / 6.0).abs() < 1e-15);
    let span = Phase::quantiles(vec![-1.0, 0.5]).unwrap_err();
    assert_eq!(
        span,
        PhaseError::Span {
            first: -1.0,
            last: 0.5
        }
    );
    for wrong in [
        vec![],
        vec![1.0],
        vec![-1.0, 0.5, 0.5, 1.0],
        vec![-1.0, f64::NAN, 1.0],
    ] {
        assert!(Phase::quantiles(wrong.clone()).is_err(), "{wrong:?}");
    }
}

/// Matrices of flakes: a sphere, a disc, fibres, and a general matrix.
const MATRICES: [[f64; 6]; 4] = [
    [1.0, 1.0, 1.0, 0.0, 0.0, 0.0],
    [0.01, 0.01, 1.0, 0.0, 0.0, 0.0],
    [0.15, 1.0, 0.8, 0.0, 0.0, 0.0],
    [1.0, 0.35, 0.32, 0.52, 0.44, 0.2],
];

/// The table integrates the density, which therefore integrates to 1.
#[test]
fn samplers_of_flakes_follow_their_densities() {
    let mut family = Family::new(FALSE_ALARM);
    for (i, matrix) in MATRICES.into_iter().enumerate() {
        let phase = Phase::sggx(matrix).unwrap();
        for (j, from) in [DIR, DVec3::X, DVec3::NEG_Z].into_iter().enumerate() {
            let table = DirectionTable::uniform(DIR.to_array(), 16, 16);
            let report = table.test(
                2000 + (3 * i + j) as u64,
                50_000,
                Mass::Exactly(1.0),
                |r| Some(phase.sample(DVec3::ZERO, from, r.uniform()).0.to_array()),
                |d| phase.pdf(DVec3::ZERO, [from, d.into()]),
            );
            let name = format!("{matrix:?} from {from}");
            let report = report.unwrap_or_else(|e| panic!("{name}: {e}"));
            family.push(name, report.p_value);
        }
    }
    family.check().unwrap();
}

/// Spheres of flakes scatter evenly, and extinction times density is reciprocal.
#[test]
fn flakes_in_closed_form() {
    let mut rng = Rng::new(7);
    let mut direction = || DVec3::from(rng.direction());
    for matrix in MATRICES {
        let phase = Phase::sggx(matrix).unwrap();
        let flakes = phase.flakes().unwrap();
        let [xx, yy, zz, xy, xz, yz] = matrix;
        for _ in 0..100 {
            let (from, to) = (direction(), direction());
            let weighed = |[from, to]: [DVec3; 2]| {
                flakes.projected_area(DVec3::ZERO, from) * phase.pdf(DVec3::ZERO, [from, to])
            };
            let (forth, back) = (weighed([from, to]), weighed([-to, -from]));
            assert!((forth / back - 1.0).abs() < 1e-10, "{forth} against {back}");
            let DVec3 { x, y, z } = from;
            let square = xx * x * x + yy * y * y + zz * z * z;
            let square = square + 2.0 * (xy * x * y + xz * x * z + yz * y * z);
            let area = flakes.projected_area(DVec3::ZERO, from);
            assert!(
                (area * area - square).abs() < 1e-14,
                "{area}² against {square}"
            );
            if matrix == MATRICES[0] {
                assert!((4.0 * PI * phase.pdf(DVec3::ZERO, [from, to]) - 1.0).abs() < 1e-12);
            }
        }
    }
    // A flat stack of flakes reflects light that arrives along its normals straight back, with the
    // density D/4 = 1/(4π √|S| (S⁻¹)zz²) times 1/σ = 1.
    let stack = Phase::sggx(MATRICES[1]).unwrap();
    let back = stack.pdf(DVec3::ZERO, [DVec3::Z, DVec3::NEG_Z]);
    assert!((back * 4.0 * PI * 0.01 - 1.0).abs() < 1e-12, "{back}");
}

#[test]
fn flakes_without_an_ellipsoid_are_refused() {
    let wrong = [
        [1.0, 1.0, 0.0, 0.0, 0.0, 0.0],
        [1.0, 1.0, 1.0, 1.0, 0.0, 0.0],
        [1.0, 1.0, 1e-8, 0.0, 0.0, 0.0],
        [1.0, -1.0, 1.0, 0.0, 0.0, 0.0],
        [f64::NAN, 1.0, 1.0, 0.0, 0.0, 0.0],
        [1e40, 1e40, 1e40, 0.0, 0.0, 0.0],
    ];
    for matrix in wrong {
        let error = Phase::sggx(matrix).unwrap_err();
        assert!(matches!(error, PhaseError::NotDefinite(_)), "{matrix:?}");
    }
    let flakes = Phase::sggx(MATRICES[0]).unwrap();
    let mixed = Phase::blend([flakes, Phase::isotropic()], 0.5);
    assert_eq!(mixed.unwrap_err(), PhaseError::MixedFlakes);
}

#[test]
fn closed_forms() {
    let hg = |g: f64, c: f64| at_cosine(&Phase::henyey_greenstein(g).unwrap(), c);
    let definition =
        |g: f64, c: f64| (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * c).powf(1.5));
    for g in [-0.7, -0.1, 0.0, 0.4, 0.85] {
        for c in [-1.0, -0.3, 0.0, 0.8, 1.0] {
            assert!(
                (hg(g, c) / definition(g, c) - 1.0).abs() < 1e-13,
                "g = {g}, cos = {c}"
            );
        }
    }
    // At the forward peak (1 + g)/(4π (1 − g)²), where the defining formula cancels.
    assert!((hg(0.999999, 1.0) * 4.0 * PI * 1e-12 / 1.999999 - 1.0).abs() < 1e-9);
    let vmf = |k: f64| Phase::von_mises_fisher(k).unwrap();
    assert!(
        (at_cosine(&vmf(2.0), 0.5) - 2.0 * 1f64.exp() / (4.0 * PI * 2f64.sinh())).abs() < 1e-15
    );
    assert!((at_cosine(&vmf(1e-14), -1.0) * 4.0 * PI - 1.0).abs() < 1e-12);
    assert!((at_cosine(&vmf(1e6), 1.0) - 1e6 / (2.0 * PI)).abs() < 1e-6);
    for k in [0.09999, 0.1001] {
        let k: f64 = k;
        assert!((mean_cosine(&vmf(k)) - (1.0 / k.tanh() - 1.0 / k)).abs() < 1e-13);
    }
    let blend = Phase::blend([Phase::rayleigh(), vmf(20.0)], 0.25).unwrap();
    for c in [-1.0f64, -0.3, 0.0, 0.8, 1.0] {
        let rayleigh = 3.0 / (16.0 * PI) * (1.0 + c * c);
        assert!((at_cosine(&Phase::rayleigh(), c) / rayleigh - 1.0).abs() < 1e-15);
        assert!(
            (at_cosine(&blend, c) / (0.75 * rayleigh + 0.25 * at_cosine(&vmf(20.0), c)) - 1.0)
                .abs()
                < 1e-15
        );
    }
    // A table of two nodes: p ∝ 1 + c, mean cosine 1/3.
    let ramp = Phase::tabulated(vec![-1.0, 1.0], &[0.0, 7.0]).unwrap();
    assert!((mean_cosine(&ramp) - 1.0 / 3.0).abs() < 1e-15);
    assert!((at_cosine(&ramp, 0.5) - 1.5 / (4.0 * PI)).abs() < 1e-15);
}

#[test]
fn bad_parameters_are_refused() {
    assert_eq!(
        Phase::henyey_greenstein(1.0).unwrap_err(),
        PhaseError::Asymmetry(1.0)
    );
    assert!(Phase::henyey_greenstein(f64::NAN).is_err());
    assert_eq!(
        Phase::von_mises_fisher(-1.0).unwrap_err(),
        PhaseError::Concentration(-1.0)
    );
    assert!(Phase::von_mises_fisher(f64::INFINITY).is_err());
    for weight in [-1e-9, 1.0 + 1e-9, f64::NAN] {
        let blend = Phase::blend([Phase::isotropic(), Phase::rayleigh()], weight);
        assert!(matches!(blend, Err(PhaseError::Weight(_))));
    }
    let span = Phase::tabulated(vec![-1.0, 0.5], &[1.0, 1.0]).unwrap_err();
    assert_eq!(
        span,
        PhaseError::Span {
            first: -1.0,
            last: 0.5
        }
    );
    assert!(span.to_string().contains("from -1 to 1"));
    assert!(Phase::tabulated(vec![], &[]).is_err());
    assert!(Phase::tabulated(vec![-1.0, 1.0], &[1.0, -2.0]).is_err());
}
