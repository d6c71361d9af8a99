//! Meshes shaded by the normals of their vertices (docs/theory.md#shading-normals). Estimators from
//! the sensor and from the emitters agree only if the latter correct for shading normals.

use crate::agreement::case::{Index, facing};
use crate::agreement::surfaces::{check, lit, object};
use crate::common::container;
use glam::{DAffine2, DVec2, DVec3};
use morgana_transport::Spectrum;
use morgana_transport::bsdf::{
    BlendBsdf, Bsdf, Conductor, Diffuse, Distribution, NormalMap, NormalSource, Plastic,
    RoughConductor, RoughDielectric, Roughness, TwoSided,
};
use morgana_transport::scene::Parts;
use morgana_transport::shape::{Mesh, Shape, Sphere};
use morgana_transport::texture::{Bitmap, BitmapFilter, Texture, Wrap};
use std::sync::Arc;

/// A square about `center` that faces `normal`, with shading normals that lean towards `lean`, each
/// corner differently.
fn leaning(center: DVec3, normal: DVec3, half: f64, lean: DVec3) -> Shape {
    let place = facing(center, normal.normalize(), half);
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let at = |c: [f64; 2]| place.transform_point3(DVec2::from(c).extend(0.0));
    let normals = [1.0, 0.7, 0.4, 0.8].map(|share| normal.normalize() + lean * share);
    let mesh = Mesh::new(corners.map(at).into(), vec![[0, 1, 2], [0, 2, 3]], None).unwrap();
    mesh.with_normals(normals.into()).unwrap().into()
}

/// An octahedron with the normals of the ball around it.
fn crude_ball(center: DVec3, radius: f64) -> Shape {
    let corners: Vec<DVec3> = DVec3::AXES.into_iter().flat_map(|a| [a, -a]).collect();
    let mut triangles = Vec::new();
    for signs in 0..8u32 {
        let [x, y, z] = [0, 1, 2].map(|axis| 2 * axis + (signs >> axis & 1));
        let is_mirrored = signs.count_ones() % 2 == 1;
        triangles.push(if is_mirrored { [x, z, y] } else { [x, y, z] });
    }
    let positions = corners.iter().map(|c| center + *c * radius).collect();
    let mesh = Mesh::new(positions, triangles, None).unwrap();
    mesh.with_normals(corners).unwrap().into()
}

fn white(albedo: f64) -> Bsdf {
    Bsdf::Diffuse(Diffuse::new(Spectrum::splat(albedo)).unwrap())
}

fn mirror() -> Bsdf {
    Bsdf::Conductor(Conductor::new(Spectrum::ZERO, Spectrum::ONE, Spectrum::splat(0.9)).unwrap())
}

/// A visible wall and a floor in front of it, each with leaning shading normals, and an emitter to
/// one side; optionally in fog.
fn corner(wall: Bsdf, floor: Bsdf, fog: Option<Index>) -> Parts {
    let mut objects = Vec::new();
    if fog.is_some() {
        let around = Sphere::around(DVec3::ZERO, 2.5).unwrap();
        objects.push(container(around, Bsdf::Null));
    }
    let upright = leaning(DVec3::ZERO, DVec3::Z, 0.9, DVec3::new(0.8, 0.3, 0.0));
    let flat = leaning(
        DVec3::new(0.0, -0.8, 0.8),
        DVec3::Y + DVec3::Z * 0.01,
        0.9,
        DVec3::new(0.3, 0.0, -0.5),
    );
    objects.extend([object(upright, wall), object(flat, floor)]);
    let index = fog.unwrap_or(Index::Constant);
    lit(objects, DVec3::new(-1.2, 0.9, 0.8), 0.4, index)
}

fn facets() -> Roughness {
    Roughness::new(Distribution::Ggx, 0.4).unwrap()
}

fn metal() -> Bsdf {
    let metal = RoughConductor::new(facets(), Spectrum::ZERO, Spectrum::ONE, Spectrum::ONE);
    Bsdf::RoughConductor(metal.unwrap())
}

#[test]
fn diffuse_and_glossy() {
    let sided = Bsdf::TwoSided(TwoSided::new(white(0.9), white(0.4)).unwrap());
    check(
        "leaning diffuse",
        &corner(white(0.9), sided, None),
        7100,
        true,
    );
    check(
        "leaning metal",
        &corner(white(0.9), metal(), None),
        7101,
        true,
    );
}

#[test]
fn mirrors() {
    let plastic = Plastic::new(1.5, Spectrum::splat(0.6), Spectrum::ONE, true).unwrap();
    let blend = BlendBsdf::new(0.5, white(0.8), mirror()).unwrap();
    check(
        "leaning mirror",
        &corner(white(0.9), mirror(), None),
        7112,
        true,
    );
    let coated = corner(Bsdf::Blend(blend), Bsdf::Plastic(plastic), None);
    check("leaning coats", &coated, 7103, false);
}

/// An octahedron of rough glass before the wall, with the normals of the ball around it.
#[test]
fn rough_glass() {
    let glass = RoughDielectric::new(facets(), Spectrum::ONE, Spectrum::ONE).unwrap();
    let mut scene = corner(white(0.9), white(0.5), Some(Index::Constant));
    let ball = crude_ball(DVec3::new(0.0, 0.1, 0.8), 0.6);
    scene.objects[0] = container(ball, Bsdf::RoughDielectric(glass));
    // Leave out particles: their connections to the camera through facets have a few large values,
    // and an error of 10 %.
    check("leaning glass", &scene, 7104, false);
}

/// Tests a bump-mapped wall and a normal-mapped floor. Some normals of the floor face away from the
/// visible side.
#[test]
fn maps() {
    let wave = |i: usize, a: f64| (a * i as f64).sin();
    let normals = (0..16).flat_map(|i| {
        let normal = DVec3::new(0.8 * wave(i, 2.0), 0.8 * wave(i, 3.0), 1.0).normalize();
        (normal * 0.5 + 0.5).to_array().map(|x| x as f32)
    });
    let heights = (0..16).map(|i| wave(i, 5.0) as f32).collect();
    let image = |channels: usize, data: Vec<f32>| {
        let bitmap = Bitmap::new(
            [4, 4],
            channels,
            data,
            BitmapFilter::Bilinear,
            Wrap::Repeat,
            DAffine2::IDENTITY,
        );
        Texture::Bitmap(Arc::new(bitmap.unwrap()))
    };
    let bumps = NormalSource::Heights(image(1, heights), 0.2);
    let normals = NormalSource::Normals(image(3, normals.collect()));
    let mapped = |source: &NormalSource, nested: Bsdf| {
        Bsdf::NormalMap(Box::new(
            NormalMap::new(source.clone(), true, true, nested).unwrap(),
        ))
    };
    let diffuse = corner(mapped(&bumps, white(0.9)), mapped(&normals, metal()), None);
    check("maps", &diffuse, 7106, true);
    let mirror = corner(mapped(&bumps, white(0.9)), mapped(&normals, mirror()), None);
    // Particles cannot be seen in mirrors.
    check("mapped mirror", &mirror, 7107, false);
}

#[test]
fn in_fog_that_bends_light() {
    let scene = corner(white(0.9), metal(), Some(Index::Linear));
    check("leaning in fog", &scene, 7105, false);
}
