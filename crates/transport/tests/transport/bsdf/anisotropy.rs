//! Anisotropic microfacets, compared with isotropic ones, with rotated tangents, and with numbers
//! computed by Mitsuba 3.9.1 (`scalar_rgb`, single precision). Samplers and furnaces are in
//! `sampling` and `physics`. Only directions are random here.

use crate::bsdf::common::{
    NORMAL, anisotropic, at_cosine, brushed, coating, diffuse, ggx, glossy, mask, metal, plastic,
    polarized_plastic, principled, rough_conductor, rough_dielectric, surface, two_sided,
};
use glam::DVec3;
use morgana_transport::Spectrum;
use morgana_transport::bsdf::Distribution::{Beckmann, Ggx};
use morgana_transport::bsdf::{
    Bsdf, BsdfError, Coating, CoatingParameters, Distribution, GlossyLobe, Microfacets, Principled,
    PrincipledParameters, PrincipledThin, PrincipledThinParameters, RoughPlastic, Roughness,
    Surface,
};
use morgana_transport::texture::Texture;
use testkit::Rng;

/// All microfacet surfaces with a roughness in two directions.
fn faceted(facets: &Roughness) -> [Bsdf; 4] {
    [
        rough_dielectric(facets.clone()),
        rough_conductor(facets.clone()),
        polarized_plastic(facets.clone()),
        glossy(GlossyLobe::Ward(facets.clone())),
    ]
}

/// Asserts that two surfaces scatter alike to within a relative error, each at its own point.
#[track_caller]
fn alike([a, b]: [&Bsdf; 2], [s, t]: [&Surface; 2], tolerance: f64) {
    let mut rng = Rng::new(3);
    for _ in 0..200 {
        let [o, i] = [(); 2].map(|()| DVec3::from_array(rng.direction()));
        let close = |x: f64, y: f64| (x - y).abs() <= tolerance * x.abs().max(y.abs());
        let pdfs = [a.pdf(s, o, i), b.pdf(t, o, i)];
        assert!(close(pdfs[0], pdfs[1]), "{pdfs:?}");
        let values = [a.eval(s, o, i), b.eval(t, o, i)];
        assert!(
            (0..4).all(|c| close(values[0][c], values[1][c])),
            "{values:?}"
        );
    }
}

#[test]
fn equal_roughness_is_isotropic() {
    let s = surface(1.2, 1.5);
    for distribution in [Beckmann, Ggx] {
        let same = faceted(&anisotropic(distribution, [0.3; 2]));
        let one = faceted(&Roughness::new(distribution, 0.3).unwrap());
        for (a, b) in same.iter().zip(&one) {
            assert!(!a.uses_tangents());
            alike([a, b], [&s, &s], 0.0);
        }
    }
}

/// Two textures of equal roughness scatter isotropically, although the code does not know that they
/// are equal.
#[test]
fn textures_of_equal_roughness_are_isotropic() {
    let s = surface(1.2, 1.5);
    let flat = || {
        let colours = [0.25; 2].map(Texture::from);
        let board =
            morgana_transport::texture::Checkerboard::new(colours, glam::DAffine2::IDENTITY);
        Texture::Checkerboard(std::sync::Arc::new(board))
    };
    let textured = faceted(&Roughness::anisotropic(Ggx, flat(), flat()).unwrap());
    for (a, b) in textured.iter().zip(&faceted(&ggx(0.25))) {
        assert!(a.uses_tangents());
        alike([a, b], [&s, &s], 0.0);
    }
    let mixed = faceted(&Roughness::anisotropic(Ggx, flat(), 0.6).unwrap());
    for (a, b) in mixed.iter().zip(&faceted(&anisotropic(Ggx, [0.25, 0.6]))) {
        alike([a, b], [&s, &s], 0.0);
    }
}

#[test]
fn a_quarter_turn_of_the_tangents_swaps_the_two() {
    let s = surface(1.2, 1.5);
    let turned = Surface {
        tangents: [NORMAL.cross(s.tangents[0]), -s.tangents[0]],
        ..s
    };
    for distribution in [Beckmann, Ggx] {
        let [these, those] =
            [[0.15, 0.5], [0.5, 0.15]].map(|alphas| faceted(&anisotropic(distribution, alphas)));
        for (a, b) in these.iter().zip(&those) {
            alike([a, b], [&s, &turned], 1e-9);
            let [o, i] = [at_cosine(0.8), 1.2 * NORMAL - at_cosine(0.6)].map(DVec3::normalize);
            let [x, y] = [a, b].map(|bsdf| bsdf.eval(&s, o, i)[0]);
            assert!((x / y - 1.0).abs() > 0.05, "no difference: {x}, {y}");
        }
    }
}

/// Slopes of Gaussian facets along a tangent have the variance α²/2. A midpoint rule over the unit
/// interval gives it, except for the ends of the interval.
#[test]
fn the_first_roughness_is_along_the_first_tangent() {
    let alphas = [0.1, 0.4];
    let facets = Microfacets::anisotropic(Beckmann, alphas).unwrap();
    let middles: Vec<f64> = (0..400).map(|k| (f64::from(k) + 0.5) / 400.0).collect();
    let mut sums = [0.0; 2];
    for u in &middles {
        for v in &middles {
            let h = facets.sample_visible(DVec3::Z, [*u, *v]);
            sums[0] += (h.x / h.z).powi(2);
            sums[1] += (h.y / h.z).powi(2);
        }
    }
    for (sum, alpha) in sums.into_iter().zip(alphas) {
        let ratio = sum / 400f64.powi(2) / (0.5 * alpha * alpha);
        assert!((ratio - 1.0).abs() < 5e-3, "{alpha}: {ratio}");
    }
}

/// Facets on the back have the orientation of the front, seen through the surface.
#[test]
fn the_other_side_is_the_mirror_image() {
    let metal = rough_conductor(anisotropic(Ggx, [0.1, 0.5]));
    let (bsdf, s) = (two_sided(metal.clone(), metal), surface(1.0, 1.0));
    let mut rng = Rng::new(4);
    for _ in 0..100 {
        let [o, i] = [(); 2].map(|()| DVec3::from_array(rng.direction()));
        let [p, j] = [o, i].map(|d| d - 2.0 * d.dot(NORMAL) * NORMAL);
        let [a, b] = [bsdf.eval(&s, o, i)[0], bsdf.eval(&s, p, j)[0]];
        assert!((a - b).abs() <= 1e-9 * a, "{a}, {b}");
    }
}

#[test]
fn only_anisotropic_surfaces_ask_for_tangents() {
    for (name, bsdf, _) in brushed() {
        assert!(bsdf.uses_tangents(), "{name}");
    }
    let glossy = glossy(GlossyLobe::Phong(8.0.into()));
    for bsdf in [diffuse(), plastic(true), glossy, principled(0.5, 0.3, 0.5)] {
        assert!(!bsdf.uses_tangents());
        assert!(!mask(0.3, two_sided(bsdf.clone(), bsdf)).uses_tangents());
    }
    let metal = rough_conductor(anisotropic(Ggx, [0.1, 0.2]));
    assert!(mask(0.3, coating(None, metal)).uses_tangents());
}

#[test]
fn coats_take_isotropic_facets_only() {
    let (facets, one) = (anisotropic(Ggx, [0.1, 0.2]), Spectrum::ONE);
    let plastic = RoughPlastic::new(facets.clone(), true, 1.5, one, one, true);
    let outer = "roughplastic";
    assert_eq!(plastic.unwrap_err(), BsdfError::Anisotropic { outer });
    let layer = CoatingParameters {
        eta: 1.5,
        sigma_a: 0.0.into(),
        thickness: 1.0,
        specular_reflectance: 1.0.into(),
        roughness: Some(facets),
    };
    let outer = "roughcoating";
    assert_eq!(
        Coating::new(layer, diffuse()).unwrap_err(),
        BsdfError::Anisotropic { outer }
    );
    let small = Roughness::anisotropic(Ggx, 0.1, 1e-5).unwrap_err();
    assert_eq!(small, BsdfError::Alpha { value: 1e-5 });
}

/// Cosines and azimuths of `toward` and `direction`, the value in the first channels, and the
/// density if it is comparable.
type Row = ([f64; 4], [f64; 3], Option<f64>);

fn at([cos, phi]: [f64; 2]) -> DVec3 {
    let sin = (1.0 - cos * cos).sqrt();
    DVec3::new(sin * phi.cos(), sin * phi.sin(), cos)
}

/// Compares with Mitsuba's values at a point with tangents along x and y. Mitsuba's values are
/// multiplied by nᵢ²/nₒ², by morgana's convention.
#[track_caller]
fn as_in_mitsuba(bsdf: &Bsdf, indices: [f64; 2], table: &[Row], tolerance: f64) {
    let [outer, inner] = indices;
    let s = Surface {
        tangents: [DVec3::X * 2.0, DVec3::Y * 3.0],
        ..Surface::plain(DVec3::Z, outer, inner)
    };
    for ([o, azimuth, i, phi], value, pdf) in table {
        let index = |cos: f64| if cos > 0.0 { outer } else { inner };
        let (toward, direction) = (at([*o, *azimuth]), at([*i, *phi]));
        let ours = bsdf.eval(&s, toward, direction) * (index(*o) / index(*i)).powi(2);
        for (c, value) in value.iter().enumerate() {
            let ratio = ours[c] / value;
            assert!(
                (ratio - 1.0).abs() < tolerance,
                "{o} {i}, {c}: value {ratio}"
            );
        }
        if let Some(pdf) = pdf {
            let ratio = bsdf.pdf(&s, toward, direction) / pdf;
            assert!((ratio - 1.0).abs() < tolerance, "{o} {i}: pdf {ratio}");
        }
    }
}

/// Returns the values of a metal with a white tint, without the tint of [`metal`].
fn conductor(distribution: Distribution) -> Bsdf {
    let [eta, k, _] = metal();
    let facets = anisotropic(distribution, [0.1, 0.4]);
    let metal = morgana_transport::bsdf::RoughConductor::new(facets, eta, k, Spectrum::ONE);
    Bsdf::RoughConductor(metal.unwrap())
}

#[test]
fn rough_conductors_are_those_of_mitsuba() {
    let table = [
        (
            [0.8, 0.4, 0.6, 3.4],
            [0.20121473, 0.20460668, 0.071799345],
            Some(0.21363722),
        ),
        (
            [0.8, 0.4, 0.7, 2.9],
            [0.50250894, 0.51055050, 0.17610869],
            Some(0.53098869),
        ),
        (
            [0.3, 1.2, 0.5, 4.6],
            [0.046929926, 0.048149791, 0.020024542],
            Some(0.055049159),
        ),
        (
            [0.9, 2.0, 0.95, -0.6],
            [1.3579916, 1.3786113, 0.46714106],
            Some(1.4288920),
        ),
    ];
    as_in_mitsuba(&conductor(Ggx), [1.0, 1.0], &table, 2e-5);
    // Mitsuba's fit of G₁ is off by up to 0.35 %.
    let table = [
        (
            [0.8, 0.4, 0.6, 3.4],
            [0.20589611, 0.20936698, 0.073469803],
            Some(0.21671742),
        ),
        (
            [0.8, 0.4, 0.7, 2.9],
            [0.72776961, 0.73941600, 0.25505328],
            Some(0.76533258),
        ),
        (
            [0.3, 1.2, 0.5, 4.6],
            [0.00045825206, 0.00047016356, 0.00019553168],
            Some(0.00048586787),
        ),
    ];
    as_in_mitsuba(&conductor(Beckmann), [1.0, 1.0], &table, 7e-3);
}

#[test]
fn rough_dielectrics_are_those_of_mitsuba() {
    let table = [
        ([0.8, 0.4, 0.6, 3.4], [0.015350562; 3], Some(0.015601325)),
        ([0.9, 1.3, -0.8, 4.2], [0.037334923; 3], Some(0.086250760)),
        ([0.4, 0.7, -0.7, 3.5], [0.079168297; 3], Some(0.18043907)),
        ([-0.8, 0.4, -0.6, 3.4], [0.30650249; 3], Some(0.31150946)),
        ([-0.9, 2.0, 0.7, 5.1], [11.092806; 3], Some(5.1949296)),
    ];
    let bsdf = rough_dielectric(anisotropic(Ggx, [0.15, 0.5]));
    as_in_mitsuba(&bsdf, [1.0, 1.5], &table, 1e-4);
}

/// Compares only the coat; the base is the base of [`polarized_plastic`].
#[test]
fn polarized_plastic_is_that_of_mitsuba() {
    let table = [
        (
            [0.8, 0.4, 0.6, 3.4],
            [0.16434528, 0.096017189, 0.027689101],
            None,
        ),
        (
            [0.3, 1.2, 0.5, 4.6],
            [0.10943978, 0.063502200, 0.017564604],
            None,
        ),
    ];
    let bsdf = polarized_plastic(anisotropic(Ggx, [0.1, 0.4]));
    as_in_mitsuba(&bsdf, [1.0, 1.0], &table, 2e-5);
}

/// Parameters that the cases of [`principled_surfaces_are_those_of_mitsuba`] share.
fn coloured(anisotropic: f64, metallic: f64) -> PrincipledParameters {
    let colour = Spectrum([0.9, 0.5, 0.1, 0.0]);
    PrincipledParameters {
        base_color: colour.into(),
        anisotropic: anisotropic.into(),
        metallic: metallic.into(),
        ..PrincipledParameters::default()
    }
}

#[test]
fn principled_surfaces_are_those_of_mitsuba() {
    let solid = |parameters| Bsdf::Principled(Box::new(Principled::new(parameters).unwrap()));
    let table = [
        (
            [0.8, 0.4, 0.6, 3.4],
            [0.55674636, 0.32526484, 0.093783304],
            None,
        ),
        (
            [0.3, 1.2, 0.5, 4.6],
            [0.96055788, 0.62320179, 0.28584555],
            None,
        ),
        (
            [0.9, 2.0, 0.95, -0.6],
            [0.33212411, 0.18924068, 0.046357170],
            None,
        ),
    ];
    as_in_mitsuba(&solid(coloured(0.8, 0.4)), [1.0, 1.0], &table, 2e-5);
    let table = [
        (
            [0.8, 0.4, 0.6, 3.4],
            [0.28057858, 0.17544128, 0.070303984],
            None,
        ),
        (
            [0.9, 1.3, -0.8, 4.2],
            [0.022949466, 0.017105522, 0.0076498222],
            None,
        ),
        (
            [-0.9, 2.0, 0.7, 5.1],
            [4.3345704, 3.2307982, 1.4448569],
            None,
        ),
    ];
    let glass = PrincipledParameters {
        spec_trans: 0.7.into(),
        eta: 1.5,
        ..coloured(0.6, 0.2)
    };
    as_in_mitsuba(&solid(glass), [1.0, 1.5], &table, 1e-4);
    let table = [
        (
            [0.8, 0.4, 0.6, 3.4],
            [0.076859578, 0.060816351, 0.044773128],
            None,
        ),
        (
            [0.8, 0.4, -0.7, 3.2],
            [0.13524571, 0.075136505, 0.015027301],
            None,
        ),
        (
            [-0.7, 1.2, -0.6, 4.6],
            [0.063185886, 0.047156516, 0.031127147],
            None,
        ),
    ];
    let of = coloured(0.8, 0.0);
    let sheet = PrincipledThin::new(PrincipledThinParameters {
        base_color: of.base_color,
        luminance: of.luminance,
        roughness: of.roughness,
        anisotropic: of.anisotropic,
        spec_trans: 0.7.into(),
        diff_trans: 0.6.into(),
        spec_tint: of.spec_tint,
        sheen: of.sheen,
        sheen_tint: of.sheen_tint,
        flatness: of.flatness,
        eta: 1.5,
    });
    as_in_mitsuba(
        &Bsdf::PrincipledThin(Box::new(sheet.unwrap())),
        [1.0; 2],
        &table,
        2e-5,
    );
}
