//! Quantities of the first surface that a ray meets.

use super::Aov;
use crate::Spectrum;
use crate::path::{SeenSurface, surface_at};
use crate::scene::Scene;

/// Returns the values of a first-surface quantity. Only as many are used as the quantity has
/// channels.
pub(super) fn values(aov: Aov, scene: &Scene, seen: &SeenSurface) -> [f64; 3] {
    let object = &scene.objects()[seen.object];
    let site = object.shape.site(&seen.hit);
    let one = |value| [value, 0.0, 0.0];
    match aov {
        Aov::Albedo => {
            let albedo = object.bsdf.albedo(&surface(scene, seen), -seen.direction);
            colour(albedo, scene.film().channels)
        }
        Aov::Depth => one(seen.length),
        Aov::Position => seen.hit.position.to_array(),
        Aov::TextureCoordinates => {
            let [u, v] = site.uv.get();
            [u, v, 0.0]
        }
        Aov::GeometricNormal => seen.hit.normal.to_array(),
        Aov::ShadingNormal => {
            let normal = object.bsdf.normal(&surface(scene, seen), -seen.direction);
            normal.to_array()
        }
        Aov::PositionByU => object.shape.tangents(&site)[0].to_array(),
        Aov::PositionByV => object.shape.tangents(&site)[1].to_array(),
        Aov::PrimitiveIndex => one(f64::from(seen.hit.primitive)),
        Aov::ShapeIndex => one((seen.object + 1) as f64),
        // Quantities of the path are computed along the ray.
        _ => [0.0; 3],
    }
}

fn surface(scene: &Scene, seen: &SeenSurface) -> crate::bsdf::Surface {
    surface_at(scene, seen.object, &seen.hit, seen.medium)
}

/// Returns red, green and blue: the film's channels, or its only channel.
fn colour(value: Spectrum, channels: usize) -> [f64; 3] {
    [0, 1, 2].map(|c| value[if channels == 1 { 0 } else { c }])
}
