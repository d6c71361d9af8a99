//! χ² of every BSDF's sampler, and agreement of sample, eval and pdf.
//!
//! False alarms: 2e-4 for each of the two families. Seeds are fixed.

use crate::bsdf::common::{
    NORMAL, at_cosine, ggx, is_one_sided, rough_dielectric, smooth, spread, surface,
};
use glam::DVec3;
use morgana_transport::Spectrum;
use morgana_transport::bsdf::{Bsdf, fresnel};
use morgana_transport::sampling::sphere::uniform_sphere_sample;
use testkit::quadrature::Effort;
use testkit::{DirectionTable, Family, Mass, Moments, Rng, z_test};

const FALSE_ALARM: f64 = 2e-4;
const COSINES: [f64; 6] = [1.0, 0.6, 0.15, -0.05, -0.7, -0.97];

/// Bins about the normal, with an edge at the horizon. For indices so close that transmission
/// hardly deviates, the bins become finer towards the unrefracted direction.
fn table(outer: f64, inner: f64, toward: DVec3) -> DirectionTable {
    let effort = Effort {
        tolerance: 2e-6,
        min_depth: 1,
        max_depth: 7,
    };
    if outer != inner && (outer - inner).abs() < 0.1 {
        DirectionTable::peaked((-toward).to_array(), 2e-3, 30, 12).with_effort(effort)
    } else {
        DirectionTable::uniform(NORMAL.to_array(), 20, 20).with_effort(effort)
    }
}

/// True if the surface reflects on its front side only. A mask's own surface is the part that it
/// does not transmit.
fn reflects_in_front_only(bsdf: &Bsdf) -> bool {
    is_one_sided(bsdf) || bsdf.is_partial()
}

#[test]
fn samplers_follow_their_densities() {
    let mut family = Family::new(FALSE_ALARM);
    for (name, bsdf, pairs) in spread() {
        for [outer, inner] in pairs {
            for (i, cos) in COSINES.into_iter().enumerate() {
                if reflects_in_front_only(&bsdf) && cos < 0.0 {
                    continue;
                }
                let (s, toward) = (surface(outer, inner), at_cosine(cos));
                let table = table(outer, inner, toward);
                let name = format!("{name}, {outer}/{inner}, cos {cos}");
                let report = table.test(
                    i as u64,
                    crate::common::samples(40_000, 15_000),
                    Mass::AtMostOne,
                    |r| {
                        bsdf.sample(&s, toward, r.uniform())
                            .filter(|b| !b.delta)
                            .map(|b| b.direction.to_array())
                    },
                    |d| bsdf.pdf(&s, toward, d.into()),
                );
                let report = report.unwrap_or_else(|e| panic!("{name}: {e}"));
                family.push(name, report.p_value);
            }
        }
    }
    family.check().unwrap();
}

#[test]
fn weights_are_values_over_densities() {
    let mut rng = Rng::new(5);
    for (name, bsdf, pairs) in spread() {
        for ([outer, inner], cos) in pairs.into_iter().flat_map(|p| COSINES.map(|c| (p, c))) {
            let (s, toward) = (surface(outer, inner), at_cosine(cos));
            for _ in 0..200 {
                let Some(b) = bsdf.sample(&s, toward, rng.uniform()) else {
                    continue;
                };
                assert!((b.direction.length() - 1.0).abs() < 1e-14);
                if b.delta {
                    continue;
                }
                let crosses = (NORMAL.dot(b.direction) > 0.0) != (cos > 0.0);
                assert_eq!(b.transmitted, crosses, "{name}");
                let pdf = bsdf.pdf(&s, toward, b.direction);
                let tolerance = 1e-7;
                assert!(
                    (pdf / b.pdf - 1.0).abs() < tolerance,
                    "{name}: {pdf} against {}",
                    b.pdf
                );
                let ratio = bsdf.eval(&s, toward, b.direction) / pdf;
                let error = (ratio - b.weight).map(f64::abs).max();
                assert!(
                    error < tolerance,
                    "{name}: {ratio:?} against {:?}",
                    b.weight
                );
            }
        }
    }
}

#[test]
fn opaque_surfaces_are_black_behind() {
    for (name, bsdf, _) in spread().into_iter().filter(|c| is_one_sided(&c.1)) {
        let s = surface(1.0, 1.0);
        for (o, i) in [(-0.5, 0.5), (-0.5, -0.4), (0.5, -0.4)] {
            assert!(
                bsdf.eval(&s, at_cosine(o), at_cosine(i)).is_zero(),
                "{name}"
            );
            assert_eq!(bsdf.pdf(&s, at_cosine(o), at_cosine(i)), 0.0, "{name}");
        }
        assert!(
            bsdf.sample(&s, at_cosine(-0.5), [0.3; 3]).is_none(),
            "{name}"
        );
    }
}

#[test]
fn smooth_dielectric_chooses_by_fresnel() {
    let mut zs = Vec::new();
    let mut rng = Rng::new(8);
    let bsdf = &smooth()[1].1;
    for ([outer, inner], cos) in [[1.0, 1.5], [1.4, 1.2]]
        .map(|p| COSINES.map(|c| (p, c)))
        .concat()
    {
        let (near, far) = if cos > 0.0 {
            (outer, inner)
        } else {
            (inner, outer)
        };
        let f = fresnel::dielectric(f64::abs(cos), near, far).reflectance;
        let mut reflected = Moments::default();
        for _ in 0..20_000 {
            let b = bsdf
                .sample(&surface(outer, inner), at_cosine(cos), rng.uniform())
                .unwrap();
            reflected.push(if b.transmitted { 0.0 } else { 1.0 });
            assert!(b.delta && b.weight == Spectrum::ONE);
            assert!((b.pdf - if b.transmitted { 1.0 - f } else { f }).abs() < 1e-9);
        }
        let se = (f * (1.0 - f) / 20_000.0).sqrt();
        // Allow for rounding in the cosine of a world vector: F = 1 holds exactly only beyond the
        // critical angle.
        zs.push(if f == 1.0 {
            1e9 * (1.0 - reflected.mean())
        } else {
            z_test::z_score(reflected.mean(), se, f)
        });
    }
    z_test::max_abs_z(&zs, FALSE_ALARM).unwrap();
}

/// Grazing, normal and tangential directions with extreme random numbers give finite results
/// everywhere.
#[test]
fn nothing_returns_nan() {
    let last = 1.0 - f64::EPSILON / 2.0;
    let cosines = [
        1.0, 1e-3, 1e-8, 1e-17, 1e-300, 0.0, -1e-17, -1e-9, -0.5, -1.0,
    ];
    let pairs = [
        [1.0, 1.0],
        [1.0, 1.5],
        [1.5, 1.0],
        [1.33, 1.33 + 1e-12],
        [1.33, 1.33 + 1e-7],
    ];
    let extra = [1e-4, 3.0].map(|a| (String::from("extreme"), rough_dielectric(ggx(a))));
    let smooth = smooth().into_iter().map(|(name, b)| (name.to_string(), b));
    let all = spread()
        .into_iter()
        .map(|(name, b, _)| (name, b))
        .chain(smooth)
        .chain(extra);
    for (name, bsdf) in all {
        for ([outer, inner], o) in pairs.into_iter().flat_map(|p| cosines.map(|c| (p, c))) {
            let (s, toward) = (surface(outer, inner), at_cosine(o));
            for i in cosines {
                for direction in [at_cosine(i), 2.0 * i * NORMAL - at_cosine(i), -toward] {
                    let value = bsdf.eval(&s, toward, direction);
                    let pdf = bsdf.pdf(&s, toward, direction);
                    assert!(
                        value.is_finite() && pdf.is_finite() && pdf >= 0.0,
                        "{name} {o} {i}: {value:?} {pdf}"
                    );
                }
            }
            for u in [
                [0.0; 3],
                [last; 3],
                [0.5, 0.0, last],
                [last, last, 0.0],
                [0.04, 0.2, 0.7],
            ] {
                check_sample(&name, &bsdf, &s, toward, u);
            }
        }
    }
}

fn check_sample(
    name: &str,
    bsdf: &Bsdf,
    s: &morgana_transport::bsdf::Surface,
    toward: DVec3,
    u: [f64; 3],
) {
    let Some(b) = bsdf.sample(s, toward, u) else {
        return;
    };
    let fine = b.weight.is_finite() && b.pdf.is_finite() && b.pdf > 0.0;
    assert!(
        fine && (b.direction.length() - 1.0).abs() < 1e-12,
        "{name} {toward} {u:?}: {b:?}"
    );
}

/// No light is scattered where the density is zero: the density alone chooses ends of connections
/// (docs/theory.md#resampled-ends).
#[test]
fn densities_are_positive_wherever_light_is_scattered() {
    let mut rng = Rng::new(7);
    for (name, bsdf, pairs) in spread() {
        for [outer, inner] in pairs {
            let s = surface(outer, inner);
            for _ in 0..2000 {
                let [u, v, w, t]: [f64; 4] = rng.uniform();
                let [toward, direction] = [[u, v], [w, t]].map(uniform_sphere_sample);
                let value = bsdf.eval(&s, toward, direction);
                let pdf = bsdf.pdf(&s, toward, direction);
                assert!(
                    value.is_zero() || pdf > 0.0,
                    "{name}: {value:?} from {direction} to {toward}"
                );
            }
        }
    }
}
