//! Bsdfs by name, and refused ones.

use super::support::*;
use glam::DVec3;
use transport::Spectrum;
use transport::bsdf::{Bsdf, Distribution, RoughConductor, Roughness, Surface};
use transport::shape::Site;

#[test]
fn nested_surfaces() {
    let kind = |text: &str| {
        let loaded = load(&shape(text)).unwrap_or_else(|e| panic!("{e}"));
        loaded.scene().objects()[0].bsdf.clone()
    };
    let diffuse = r#"<bsdf type="diffuse"/>"#;
    let two = kind(&format!(r#"<bsdf type="twosided">{diffuse}</bsdf>"#));
    assert!(matches!(two, Bsdf::TwoSided(_)));
    let behind = Surface::plain(DVec3::Z, 1.0, 1.0);
    assert!(!two.eval(&behind, -DVec3::Z, -DVec3::Z).is_zero());
    let mask = kind(&format!(
        r#"<bsdf type="mask"><float name="opacity" value="0.25"/><bsdf type="twosided">{diffuse}{diffuse}</bsdf></bsdf>"#
    ));
    let through = mask.through(&Site::default(), 1.0).unwrap();
    assert_eq!(through.probability, 0.75);
    let blend = kind(&format!(
        r#"<bsdf type="blendbsdf"><float name="weight" value="0.25"/>{diffuse}
<bsdf type="diffuse"><float name="reflectance" value="0.9"/></bsdf></bsdf>"#
    ));
    close(reflectance(&blend, [0.0; 2]), [0.75 * 0.5 + 0.25 * 0.9; 3]);
    assert!(matches!(
        kind(r#"<bsdf type="thindielectric"/>"#),
        Bsdf::ThinDielectric(_)
    ));
    assert!(matches!(
        kind(r#"<bsdf type="plastic"/>"#),
        Bsdf::Plastic(_)
    ));
    let text = r#"<bsdf type="principled"><rgb name="base_color" value="0.1, 0.5, 0.2"/>
<float name="metallic" value="1"/><float name="sheen" value="0"/></bsdf>"#;
    assert!(matches!(kind(text), Bsdf::Principled(_)));
}

/// Roughness along the first tangent and across it, of numbers and of textures, equals
/// [`Roughness::anisotropic`].
#[test]
fn roughness_in_two_directions() {
    let s = Surface {
        tangents: [DVec3::X, DVec3::Y],
        ..Surface::plain(DVec3::Z, 1.0, 1.5)
    };
    let [o, i] = [DVec3::new(0.3, 0.1, 1.0), DVec3::new(-0.5, 0.2, 1.0)].map(DVec3::normalize);
    let value = |kind: &str, parameters: &str| {
        let text = shape(&format!(r#"<bsdf type="{kind}">{parameters}</bsdf>"#));
        let loaded = load(&text).unwrap_or_else(|e| panic!("{e}"));
        bsdf(&loaded).eval(&s, o, i)[0]
    };
    let numbers = |u: f64, v: f64| {
        format!(r#"<float name="alpha_u" value="{u}"/><float name="alpha_v" value="{v}"/>"#)
    };
    let board = r#"<texture type="checkerboard" name="alpha_u"><float name="color0" value="0.1"/><float name="color1" value="0.1"/></texture><float name="alpha_v" value="0.4"/>"#;
    for kind in ["roughconductor", "roughdielectric", "pplastic", "ward"] {
        let found =
            [numbers(0.1, 0.4), numbers(0.4, 0.1), board.to_owned()].map(|p| value(kind, &p));
        assert!(
            (found[0] / found[1] - 1.0).abs() > 0.05,
            "{kind}: {found:?}"
        );
        assert!(
            (found[0] / found[2] - 1.0).abs() < 1e-6,
            "{kind}: {found:?}"
        );
        let alike = [
            value(kind, &numbers(0.2, 0.2)),
            value(kind, r#"<float name="alpha" value="0.2"/>"#),
        ];
        assert_eq!(alike[0], alike[1], "{kind}");
    }
    let roughness = Roughness::anisotropic(Distribution::Beckmann, 0.1, 0.4).unwrap();
    let metal = RoughConductor::new(roughness, Spectrum::ZERO, Spectrum::ONE, 1.0).unwrap();
    let expected = Bsdf::RoughConductor(metal).eval(&s, o, i)[0];
    assert!((value("roughconductor", &numbers(0.1, 0.4)) / expected - 1.0).abs() < 1e-12);
    let brushed = |a: f64| {
        value(
            "principled",
            &format!(r#"<float name="anisotropic" value="{a}"/>"#),
        )
    };
    assert!((brushed(0.9) / brushed(0.0) - 1.0).abs() > 0.01);
    let one = r#"<bsdf type="roughconductor"><float name="alpha_u" value="0.1"/></bsdf>"#;
    refused(&shape(one), &["give both 'alpha_u' and 'alpha_v'"]);
    let both = format!(
        r#"<bsdf type="ward"><float name="alpha" value="0.1"/>{}</bsdf>"#,
        numbers(0.1, 0.2)
    );
    refused(&shape(&both), &["not both"]);
    let coat = format!(r#"<bsdf type="roughplastic">{}</bsdf>"#, numbers(0.1, 0.2));
    refused(
        &shape(&coat),
        &["facets of a roughplastic must be equally rough in all directions"],
    );
}

/// Reflectance of copper for light along the normal: ((η − 1)² + k²)/((η + 1)² + k²).
#[test]
fn metals_have_names() {
    let loaded = load(&shape(
        r#"<bsdf type="conductor"><string name="material" value="Cu"/></bsdf>"#,
    ));
    let loaded = loaded.unwrap();
    let s = Surface::plain(DVec3::Z, 1.0, 1.0);
    let weight = bsdf(&loaded).sample(&s, DVec3::Z, [0.5; 3]).unwrap().weight;
    for (channel, (eta, k)) in [(0.201005, 3.91326), (0.92375, 2.45305), (1.10222, 2.14209)]
        .into_iter()
        .enumerate()
    {
        let (eta, k): (f64, f64) = (eta, k);
        let expected = ((eta - 1.0).powi(2) + k * k) / ((eta + 1.0).powi(2) + k * k);
        assert!((weight[channel] - expected).abs() < 1e-12);
    }
}

#[test]
fn what_is_refused() {
    let nested =
        |outer: &str, inner: &str| shape(&format!("<bsdf type=\"{outer}\">{inner}</bsdf>"));
    refused(
        &nested("mask", "<bsdf type=\"dielectric\"/>"),
        &["a mask takes surfaces that let no light through"],
    );
    refused(&nested("mask", ""), &["takes one nested bsdf, not 0"]);
    refused(
        &nested("blendbsdf", "<bsdf type=\"diffuse\"/>"),
        &["takes 2 nested bsdfs, not 1"],
    );
    refused(
        &nested("twosided", &"<bsdf type=\"diffuse\"/>".repeat(3)),
        &["takes 1 or 2 nested bsdfs, not 3"],
    );
    refused(
        &nested(
            "principled",
            "<float name=\"eta\" value=\"1.5\"/><float name=\"specular\" value=\"0.5\"/>",
        ),
        &["give 'eta' or 'specular', not both"],
    );
    refused(
        &nested("hk", ""),
        &["a thin scattering layer is a medium here"],
    );
    refused(
        &nested("conductor", "<string name=\"material\" value=\"Cuu\"/>"),
        &["'material' cannot be 'Cuu'", "Cu"],
    );
    refused(
        &nested("diffuse", "<texture name=\"reflectance\" type=\"bitmpa\"/>"),
        &["unknown texture type 'bitmpa'", "bitmap"],
    );
    refused(
        &nested(
            "diffuse",
            "<texture name=\"reflectance\" type=\"bitmap\"><string name=\"filename\" value=\"no.png\"/></texture>",
        ),
        &["no.png"],
    );
    refused(
        &nested(
            "diffuse",
            "<texture name=\"reflectance\" type=\"checkerboard\"><float name=\"color0\" value=\"1.5\"/></texture>",
        ),
        &["reflectance must lie in [0, 1] in every channel, got 1.5"],
    );
    refused(
        "<shape type=\"sphere\"><bsdf type=\"mask\"><bsdf type=\"diffuse\"/></bsdf>\
         <emitter type=\"area\"><float name=\"radiance\" value=\"1\"/></emitter></shape>",
        &["emits light from a specular, null, masked or thin surface"],
    );
}

/// Values along the normal follow the models' formulae.
#[test]
fn older_bsdfs_take_their_parameters() {
    let along = |bsdf_text: &str| {
        let shape = format!(r#"<shape type="rectangle"><bsdf {bsdf_text}</bsdf></shape>"#);
        reflectance(bsdf(&load(&shape).unwrap()), [0.5; 2])[0]
    };
    let passes = 1.0 - (0.5f64 / 2.5).powi(2);
    let cases = [
        (
            r#"type="phong"><float name="exponent" value="6"/>"#,
            0.5 + 0.2 * 4.0,
        ),
        (
            r#"type="phong"><float name="exponent" value="6"/><rgb name="diffuse_reflectance" value="0.8"/><rgb name="specular_reflectance" value="0.8"/>"#,
            0.5 + 0.5 * 4.0,
        ),
        (
            r#"type="ward"><float name="alpha" value="0.5"/>"#,
            0.5 + 0.2,
        ),
        (
            r#"type="ward"><float name="alpha_u" value="0.5"/><float name="alpha_v" value="0.125"/>"#,
            0.5 + 0.2 * 4.0,
        ),
        (
            r#"type="roughdiffuse"><float name="alpha" value="0.4"/>"#,
            0.5 * (1.0 - 0.04 / 0.41) + 0.25 * 0.17 * 0.08 / 0.21,
        ),
        (
            r#"type="roughdiffuse"><float name="alpha" value="0.4"/><boolean name="use_fast_approx" value="true"/>"#,
            0.5 * (1.0 - 0.04 / 0.41),
        ),
        (
            r#"type="coating"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/><bsdf type="diffuse"/>"#,
            0.5 * passes * passes / 2.25,
        ),
        (
            r#"type="coating"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/><float name="sigma_a" value="0.3"/><float name="thickness" value="2"/><bsdf type="diffuse"/>"#,
            0.5 * passes * passes / 2.25 * (-1.2f64).exp(),
        ),
        (
            r#"type="mixturebsdf"><string name="weights" value="0.5, 0.25"/><bsdf type="diffuse"/><bsdf type="diffuse"><float name="reflectance" value="0.2"/></bsdf>"#,
            0.3,
        ),
        (
            r#"type="mixturebsdf"><string name="weights" value="3 1"/><bsdf type="diffuse"/><bsdf type="diffuse"><float name="reflectance" value="0.1"/></bsdf>"#,
            0.4,
        ),
    ];
    for (text, expected) in cases {
        let found = along(text);
        assert!(
            (found - expected).abs() < 1e-6,
            "{text}: {found} for {expected}"
        );
    }
}

#[test]
fn older_bsdfs_that_are_refused() {
    let shape = |bsdf: &str| format!(r#"<shape type="rectangle"><bsdf {bsdf}</bsdf></shape>"#);
    for (text, expected) in [
        (
            r#"type="mixturebsdf"><string name="weights" value="1, x"/><bsdf type="diffuse"/>"#,
            "numbers ≥ 0",
        ),
        (
            r#"type="mixturebsdf"><string name="weights" value="0.5, 0.5"/><bsdf type="diffuse"/>"#,
            "2 nested bsdfs",
        ),
        (
            r#"type="mixturebsdf"><string name="weights" value="0.5, 0.5"/><bsdf type="diffuse"/><bsdf type="dielectric"/>"#,
            "let no light through",
        ),
        (
            r#"type="coating"><bsdf type="dielectric"/>"#,
            "let no light through",
        ),
        (r#"type="coating">"#, "one nested bsdf"),
        (
            r#"type="phong"><float name="exponent" value="-1"/>"#,
            "exponent must be finite and ≥ 0",
        ),
        (
            r#"type="roughdiffuse"><float name="alpha" value="-1"/>"#,
            "alpha must be finite and ≥ 0",
        ),
        (r#"type="hk">"#, "thin scattering layer"),
        (r#"type="measured">"#, "measured reflectances"),
        (r#"type="hair">"#, "hairs are not modelled"),
    ] {
        refused(&shape(text), &[expected]);
    }
}

/// Metal against a dielectric, by Fresnel's formula at normal incidence, ((η − 1)² + k²)/((η + 1)² + k²), with η and k over
/// the index around.
#[test]
fn metals_in_a_dielectric() {
    let reflected = |ext: &str| {
        let text = format!(
            "<bsdf type='conductor'><float name='eta' value='0.5'/><float name='k' value='3'/>{ext}</bsdf>"
        );
        let loaded = load(&shape(&text)).unwrap_or_else(|e| panic!("{e}"));
        let s = Surface::plain(DVec3::Z, 1.0, 1.0);
        let sample = bsdf(&loaded).sample(&s, DVec3::Z, [0.5; 3]).unwrap();
        sample.weight[0]
    };
    for (ext, n) in [
        ("", 1.0),
        ("<float name='ext_eta' value='1.5'/>", 1.5),
        ("<string name='ext_eta' value='water'/>", 1.333),
    ] {
        let (eta, k) = (0.5 / n, 3.0 / n);
        let expected = ((eta - 1.0_f64).powi(2) + k * k) / ((eta + 1.0).powi(2) + k * k);
        assert!((reflected(ext) - expected).abs() < 1e-12, "{ext}");
    }
}
