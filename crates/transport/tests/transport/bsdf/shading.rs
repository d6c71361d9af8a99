//! Scattering with shading normals.
//!
//! False alarms: 2e-4 for the family of χ² tests. Seeds are fixed.

use crate::bsdf::common::{NORMAL, diffuse, ggx, rough_conductor, rough_dielectric};
use glam::{DAffine2, DVec3};
use morgana_transport::Spectrum;
use morgana_transport::bsdf::{Bsdf, NormalMap, NormalSource, Surface};
use morgana_transport::texture::{Bitmap, BitmapFilter, Texture, Wrap};
use std::sync::Arc;
use testkit::quadrature::Effort;
use testkit::{DirectionTable, Family, Mass, Rng};

const FALSE_ALARM: f64 = 2e-4;

/// A surface whose shading normal leans by 35°.
fn leaning() -> Surface {
    let across = NORMAL.any_orthonormal_vector();
    let (sin, cos) = 35f64.to_radians().sin_cos();
    Surface {
        shading_normal: (NORMAL * cos + across * sin).normalize(),
        ..Surface::plain(NORMAL, 1.0, 1.5)
    }
}

/// A BSDF under a normal map whose normal leans by 0.4, −0.5 to 1.
fn mapped(flips: bool, shadows: bool, nested: Bsdf) -> Bsdf {
    let lean = DVec3::new(0.4, -0.5, 1.0).normalize() * 0.5 + 0.5;
    let map = Texture::Uniform(Spectrum([lean.x, lean.y, lean.z, 0.0]));
    let map = NormalMap::new(NormalSource::Normals(map), flips, shadows, nested);
    Bsdf::NormalMap(Box::new(map.unwrap()))
}

fn cases() -> Vec<(&'static str, Surface, Bsdf)> {
    let plain = Surface::plain(NORMAL, 1.0, 1.5);
    let metal = || rough_conductor(ggx(0.4));
    vec![
        ("diffuse", leaning(), diffuse()),
        ("metal", leaning(), metal()),
        ("glass", leaning(), rough_dielectric(ggx(0.4))),
        ("map, diffuse", plain, mapped(true, true, diffuse())),
        ("map, metal", plain, mapped(true, true, metal())),
        (
            "map that leaves normals, metal",
            plain,
            mapped(false, false, metal()),
        ),
        (
            "map over leaning",
            leaning(),
            mapped(true, false, diffuse()),
        ),
        (
            "map, glass",
            plain,
            mapped(false, true, rough_dielectric(ggx(0.4))),
        ),
    ]
}

/// Views towards the leaning side and away from it, from above to grazing.
fn views() -> [DVec3; 4] {
    let across = NORMAL.any_orthonormal_vector();
    [[1.0, 0.0], [0.5, 0.8], [0.5, -0.8], [0.1, -1.0]]
        .map(|[up, along]| (NORMAL * up + across * along).normalize())
}

#[test]
fn samplers_follow_their_densities() {
    let mut family = Family::new(FALSE_ALARM);
    let effort = Effort {
        tolerance: 1e-5,
        min_depth: 2,
        max_depth: 9,
    };
    for (name, s, bsdf) in cases() {
        // Keep views from which the surface is visible at all.
        let views = views().into_iter().enumerate();
        for (i, toward) in views.filter(|(_, v)| v.dot(s.shading_normal) > 0.0) {
            let table = DirectionTable::uniform(NORMAL.to_array(), 16, 16).with_effort(effort);
            let report = table.test(
                i as u64,
                30_000,
                Mass::AtMostOne,
                |r| {
                    let sample = bsdf.sample(&s, toward, r.uniform())?;
                    Some(sample.direction.to_array())
                },
                |d| bsdf.pdf(&s, toward, d.into()),
            );
            let report = report.unwrap_or_else(|e| panic!("{name}, {i}: {e}"));
            family.push(format!("{name}, {i}"), report.p_value);
        }
    }
    family.check().unwrap();
}

/// Tests samples for views and for light.
#[test]
fn weights_are_values_over_densities() {
    let mut rng = Rng::new(3);
    for (name, s, bsdf) in cases() {
        for toward in views() {
            for _ in 0..200 {
                let u = rng.uniform();
                let Some(b) = bsdf.sample(&s, toward, u) else {
                    continue;
                };
                let close = |a: Spectrum, b: Spectrum| {
                    let scale = a.max().max(b.max()).max(1e-300);
                    (0..4).all(|c| (a[c] - b[c]).abs() <= 1e-9 * scale)
                };
                let value = bsdf.eval(&s, toward, b.direction);
                assert!(
                    (b.pdf / bsdf.pdf(&s, toward, b.direction) - 1.0).abs() < 1e-9,
                    "{name}"
                );
                assert!(close(b.weight * b.pdf, value), "{name}: {b:?} {value:?}");
                let light = bsdf.sample_importance(&s, toward, u).unwrap();
                let value = bsdf.eval_importance(&s, toward, b.direction);
                assert!(
                    close(light.weight * light.pdf, value),
                    "{name}: {light:?} {value:?}"
                );
            }
        }
    }
}

/// Lambert's law holds with the shading normal. For light that arrives from i and leaves to o the
/// value is ρ/π |N_s·i| |N·o|/|N·i|.
#[test]
fn leaning_lambertian_surfaces() {
    let (s, bsdf) = (leaning(), diffuse());
    let [o, i, ..] = views();
    let cos = |n: DVec3, v: DVec3| n.dot(v);
    let expected = 0.9 * cos(s.shading_normal, i) / std::f64::consts::PI;
    assert!((bsdf.eval(&s, o, i)[0] - expected).abs() < 1e-14);
    let ratio = cos(s.normal, o) / cos(s.normal, i);
    assert!((bsdf.eval_importance(&s, i, o)[0] - expected * ratio).abs() < 1e-14);
}

/// Nothing is scattered between directions that are above the surface by one normal and below it by
/// the other.
#[test]
fn no_light_comes_from_below() {
    let (s, mut rng) = (leaning(), Rng::new(4));
    let above = NORMAL;
    let mut met = 0;
    for _ in 0..2000 {
        let [z, turn] = rng.uniform();
        let (sin, cos) = (std::f64::consts::TAU * turn).sin_cos();
        let z = 2.0 * z - 1.0;
        let r = (1.0f64 - z * z).sqrt();
        let v = DVec3::new(r * cos, r * sin, z);
        if (v.dot(s.normal) > 0.0) != (v.dot(s.shading_normal) > 0.0) {
            met += 1;
            for bsdf in [
                diffuse(),
                rough_conductor(ggx(0.4)),
                rough_dielectric(ggx(0.4)),
            ] {
                assert!(bsdf.eval(&s, above, v).is_zero() && bsdf.eval(&s, v, above).is_zero());
                assert_eq!(bsdf.pdf(&s, above, v), 0.0);
                assert!(bsdf.sample(&s, v, [0.3; 3]).is_none());
            }
        }
    }
    assert!(met > 300);
}

/// A plane with a bump map of constant slope is shaded like a tilted plane: h = 0.5 v, scaled by
/// 1.5, on tangents of length 2.
#[test]
fn slopes_of_heights() {
    let heights = vec![0.0, 0.0, 0.25, 0.25];
    let image = Bitmap::new(
        [2, 2],
        1,
        heights,
        BitmapFilter::Bilinear,
        Wrap::Clamp,
        DAffine2::IDENTITY,
    );
    let source = NormalSource::Heights(Texture::Bitmap(Arc::new(image.unwrap())), 1.5);
    let bump = NormalMap::new(source, false, false, diffuse()).unwrap();
    let bump = Bsdf::NormalMap(Box::new(bump));
    let mut s = Surface::plain(DVec3::Z, 1.0, 1.0);
    s.tangents = [DVec3::X * 2.0, DVec3::Y * 2.0];
    s.site.uv = morgana_transport::shape::Uv::Plain([0.5, 0.5]);
    // Pixel centres are half a unit of v apart.
    let normal = DVec3::new(0.0, -0.5 * 1.5 / 2.0, 1.0).normalize();
    let light = DVec3::new(0.3, -0.2, 0.8).normalize();
    let expected = 0.9 * normal.dot(light) / std::f64::consts::PI;
    assert!((bump.eval(&s, DVec3::Z, light)[0] - expected).abs() < 1e-12);
}
