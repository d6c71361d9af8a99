//! Roughness that varies over a surface, compared with surfaces of constant roughness.

use crate::bsdf::common::{NORMAL, at_cosine, metal, surface};
use glam::{DAffine2, DVec3};
use morgana_transport::Spectrum;
use morgana_transport::bsdf::{
    Bsdf, BsdfError, Distribution, RoughConductor, RoughDielectric, RoughPlastic, Roughness,
    Surface,
};
use morgana_transport::shape::Uv;
use morgana_transport::texture::{Bitmap, BitmapFilter, Checkerboard, Texture, Wrap};
use std::sync::Arc;
use testkit::Rng;

/// All surfaces with a roughness.
fn rough(alpha: impl Into<Texture>) -> [Bsdf; 3] {
    let ([eta, k, tint], one) = (metal(), Spectrum::ONE);
    let facets = Roughness::new(Distribution::Ggx, alpha).unwrap();
    let conductor = RoughConductor::new(facets.clone(), eta, k, tint);
    let dielectric = RoughDielectric::new(facets.clone(), one, one);
    let plastic = RoughPlastic::new(facets, true, 1.5, Spectrum::splat(0.8), one, true);
    [
        Bsdf::RoughConductor(conductor.unwrap()),
        Bsdf::RoughDielectric(dielectric.unwrap()),
        Bsdf::RoughPlastic(plastic.unwrap()),
    ]
}

/// A texture of adjacent pixels in a row.
fn row(pixels: &[f32], filter: BitmapFilter) -> Texture {
    let size = [pixels.len(), 1];
    let how = (filter, Wrap::Clamp);
    let bitmap = Bitmap::new(size, 1, pixels.to_vec(), how.0, how.1, DAffine2::IDENTITY);
    Texture::Bitmap(Arc::new(bitmap.unwrap()))
}

fn at(u: f64) -> Surface {
    let mut s = surface(1.2, 1.5);
    s.site.uv = Uv::Plain([u, 0.2]);
    s
}

/// Asserts that two surfaces scatter alike at a point, to within a relative error.
#[track_caller]
fn alike(a: &Bsdf, b: &Bsdf, s: &Surface, tolerance: f64) {
    let mut rng = Rng::new(1);
    for _ in 0..200 {
        let toward = at_cosine(rng.range(0.01, 1.0));
        let u = rng.uniform();
        let direction = DVec3::from_array(rng.direction());
        let close = |x: f64, y: f64| (x - y).abs() <= tolerance * x.abs().max(y.abs());
        let (pdfs, values) = (
            [a, b].map(|bsdf| bsdf.pdf(s, toward, direction)),
            [a, b].map(|bsdf| bsdf.eval(s, toward, direction)),
        );
        assert!(close(pdfs[0], pdfs[1]), "{pdfs:?}");
        assert!(
            (0..4).all(|c| close(values[0][c], values[1][c])),
            "{values:?}"
        );
        if tolerance == 0.0 {
            assert_eq!(a.sample(s, toward, u), b.sample(s, toward, u));
        }
    }
}

#[test]
fn a_texture_of_one_value_is_that_value() {
    let flat = row(&[0.25, 0.25], BitmapFilter::Bilinear);
    for (a, b) in rough(flat).iter().zip(&rough(0.25)) {
        alike(a, b, &at(0.3), 0.0);
    }
}

#[test]
fn two_halves_are_each_of_their_own_roughness() {
    let colours = [0.125, 0.5].map(Texture::from);
    let board = Checkerboard::new(colours, DAffine2::IDENTITY);
    let halves = Texture::Checkerboard(Arc::new(board));
    for (u, alpha) in [(0.3, 0.125), (0.7, 0.5)] {
        for (a, b) in rough(halves.clone()).iter().zip(&rough(alpha)) {
            alike(a, b, &at(u), 1e-12);
        }
    }
    // Check that the halves differ.
    let [a, b] = [0.3, 0.7].map(|u| rough(halves.clone())[0].eval(&at(u), NORMAL, NORMAL)[0]);
    assert!(a > 2.0 * b, "{a}, {b}");
}

/// Pixels below the smallest roughness count as the smallest roughness.
#[test]
fn black_pixels_are_as_smooth_as_can_be() {
    let dark = row(&[0.0, 1.0], BitmapFilter::Nearest);
    for (a, b) in rough(dark).iter().zip(&rough(1e-4)) {
        alike(a, b, &at(0.3), 1e-12);
    }
}

/// Rough plastic interpolates between the coats of its table. The error of the base's light is
/// small compared with its maximum.
#[test]
fn coats_between_others() {
    let slope = row(&[0.0, 1.0], BitmapFilter::Bilinear);
    let [_, _, varied] = rough(slope);
    // Look away from the lobe, where almost only the base is seen.
    let aside = (NORMAL + NORMAL.cross(NORMAL.any_orthonormal_vector())).normalize();
    for alpha in [0.002, 0.01, 0.03, 0.07, 0.13, 0.31, 0.62, 0.97] {
        let (s, [_, _, even]) = (at(0.25 + 0.5 * alpha), rough(alpha));
        let most = even.eval(&s, NORMAL, aside)[0];
        for cos in [0.01, 0.05, 0.1, 0.2, 0.5, 1.0] {
            let [a, b] = [&varied, &even].map(|bsdf| bsdf.eval(&s, at_cosine(cos), aside)[0]);
            let error = (a - b).abs() / most;
            assert!(error < 1e-3, "roughness {alpha}, cosine {cos}: {error}");
        }
    }
}

#[test]
fn roughness_that_is_refused() {
    let refused = row(&[0.5, 1.5], BitmapFilter::Nearest);
    let error = Roughness::new(Distribution::Ggx, refused).unwrap_err();
    let (name, value) = ("alpha", 1.5);
    assert_eq!(error, BsdfError::Factor { name, value });
    let error = Roughness::new(Distribution::Ggx, 1e-5).unwrap_err();
    assert_eq!(error, BsdfError::Alpha { value: 1e-5 });
}
