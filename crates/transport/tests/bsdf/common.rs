//! Surfaces, directions and BSDFs shared by the BSDF tests.

use glam::DVec3;
use transport::Spectrum;
use transport::bsdf::{
    Bsdf, Conductor, Dielectric, Diffuse, RoughConductor, RoughDielectric, Surface,
};

/// A tilted unit normal: no axis of the world is special to the code.
pub const NORMAL: DVec3 = DVec3::new(0.48, -0.6, 0.64);

/// A surface between two indices.
pub fn surface(n_outer: f64, n_inner: f64) -> Surface {
    Surface {
        normal: NORMAL,
        n_outer,
        n_inner,
    }
}

/// The unit vector at `cos` to the normal, in a fixed plane through it.
pub fn at_cosine(cos: f64) -> DVec3 {
    let tangent = NORMAL.any_orthonormal_vector();
    cos * NORMAL + (1.0 - cos * cos).sqrt() * tangent
}

/// Gold-like, silver-like and perfectly reflecting channels.
pub fn metal() -> [Spectrum; 3] {
    [
        Spectrum([0.2, 0.05, 1.4, 0.0]),
        Spectrum([3.9, 2.2, 1.6, 9.0]),
        Spectrum([1.0, 0.9, 1.0, 1.0]),
    ]
}

/// A rough dielectric without tints.
pub fn rough_dielectric(alpha: f64) -> Bsdf {
    Bsdf::RoughDielectric(RoughDielectric::new(alpha, Spectrum::ONE, Spectrum::ONE).unwrap())
}

/// A rough metal of [`metal`].
pub fn rough_conductor(alpha: f64) -> Bsdf {
    let [eta, k, tint] = metal();
    Bsdf::RoughConductor(RoughConductor::new(alpha, eta, k, tint).unwrap())
}

/// A Lambertian reflector.
pub fn diffuse() -> Bsdf {
    Bsdf::Diffuse(Diffuse::new(Spectrum([0.9, 0.5, 0.0, 1.0])).unwrap())
}

/// The delta BSDFs.
pub fn smooth() -> Vec<(&'static str, Bsdf)> {
    let [eta, k, tint] = metal();
    vec![
        ("null", Bsdf::Null),
        ("dielectric", Bsdf::Dielectric(Dielectric::default())),
        (
            "conductor",
            Bsdf::Conductor(Conductor::new(eta, k, tint).unwrap()),
        ),
    ]
}

/// The other BSDFs, with the index pairs (outer, inner) to try them at.
pub fn spread() -> Vec<(String, Bsdf, Vec<[f64; 2]>)> {
    let mut cases = vec![(
        "diffuse".to_string(),
        diffuse(),
        vec![[1.0, 1.0], [1.33, 1.5]],
    )];
    for alpha in [0.08, 0.3, 1.0] {
        let pairs = vec![[1.0, 1.5], [1.7, 1.33], [1.33, 1.36]];
        cases.push((
            format!("rough dielectric {alpha}"),
            rough_dielectric(alpha),
            pairs,
        ));
        let conductor = rough_conductor(alpha);
        cases.push((
            format!("rough conductor {alpha}"),
            conductor,
            vec![[1.0, 1.0], [1.5, 1.0]],
        ));
    }
    cases
}
