//! Connections to resampled ends of emitters (docs/theory.md#resampled-ends), compared with
//! quadratures and furnaces.
//!
//! False alarms: 1e-4 for all means of the path tracer, which are compared with exact ones, and
//! 1e-4 for bidirectional path tracing.

use crate::common::{camera, container, estimate, estimate_by, parts, vacuum};
use eikonal::field::{Constant, Field, Luneburg};
use glam::{DAffine2, DAffine3, DMat3, DQuat, DVec3};
use morgana_transport::bsdf::{
    Bsdf, Diffuse, Distribution, RoughConductor, RoughPlastic, Roughness, Surface,
};
use morgana_transport::emitter::{Emitter, Environment, TexturedArea};
use morgana_transport::integrator::{Bdpt, Heuristic, Integrator};
use morgana_transport::medium::Medium;
use morgana_transport::scene::{Object, Parts};
use morgana_transport::sensor::SensorRay;
use morgana_transport::shape::{Rectangle, Shape, Sphere};
use morgana_transport::texture::{Bitmap, BitmapFilter, Checkerboard, Texture, Wrap};
use morgana_transport::{Orientation, Scene, Spectrum};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;
use testkit::z_test::max_abs_z;

const FAMILY: f64 = 1e-4;
const SAMPLES: u64 = 60_000;
/// Direction from the surface towards the sensor.
const TOWARD: DVec3 = DVec3::new(0.48, 0.6, 0.64);

/// A surface that bounds no medium.
fn wall(shape: impl Into<Shape>, bsdf: Bsdf, emitter: Option<usize>) -> Object {
    Object {
        sides: None,
        emitter,
        ..container(shape, bsdf)
    }
}

/// The plane y = 0 around the origin, seen from above.
fn floor(bsdf: Bsdf) -> Object {
    let turn = DMat3::from_rotation_x(-0.5 * PI) * 20.0;
    wall(
        Rectangle::new(DAffine3::from_mat3(turn)).unwrap(),
        bsdf,
        None,
    )
}

fn grey(value: f64) -> Spectrum {
    Spectrum([value, 0.0, 0.0, 0.0])
}

/// Surfaces with all kinds of lobes: broad, narrow, and both.
fn surfaces() -> [(&'static str, Bsdf); 4] {
    let roughness = |alpha: f64| Roughness::new(Distribution::Ggx, alpha).unwrap();
    let metal = |alpha: f64| {
        let (eta, k) = (Spectrum::splat(0.2), Spectrum::splat(3.0));
        Bsdf::RoughConductor(RoughConductor::new(roughness(alpha), eta, k, Spectrum::ONE).unwrap())
    };
    let base = Spectrum::splat(0.5);
    let plastic = RoughPlastic::new(roughness(0.2), true, 1.5, base, Spectrum::ONE, false);
    [
        ("diffuse", Bsdf::Diffuse(Diffuse::new(base).unwrap())),
        ("metal 0.1", metal(0.1)),
        ("metal 0.4", metal(0.4)),
        ("plastic", Bsdf::RoughPlastic(plastic.unwrap())),
    ]
}

/// Radiance that a surface at the origin reflects towards the sensor, and its error.
fn reflected(objects: Vec<Object>, emitter: Emitter, seed: u64) -> (f64, f64) {
    let sensor = camera(TOWARD, DVec3::ZERO);
    let parts = parts(objects, vec![vacuum()], vec![emitter], sensor);
    let scene = Scene::new(parts).unwrap_or_else(|problems| panic!("{problems:?}"));
    let ray = SensorRay {
        origin: TOWARD,
        direction: -TOWARD,
    };
    estimate(&scene, (SAMPLES, seed), |_| (ray, 1.0))
}

fn z(name: &str, (mean, error): (f64, f64), exact: f64) -> f64 {
    let z = (mean - exact) / error;
    println!("{name}: {mean} ± {error}, exact {exact}, z {z:+.2}");
    z
}

/// A map with a bright spot on grey, above and below the horizon.
fn map() -> Environment {
    let (width, height) = (24, 13);
    let bright = |i: usize| i % width == 4 && i / width == 4;
    let value = |i: usize| {
        if bright(i) {
            40.0
        } else {
            0.2 + ((i * 7) % 5) as f64
        }
    };
    let pixels = (0..width * height).map(|i| grey(value(i))).collect();
    Environment::image(width, height, pixels, Orientation::IDENTITY).unwrap()
}

/// ∫ L f cos dω by midpoints, with an error below 1e-3.
fn by_directions(environment: &Environment, bsdf: &Bsdf) -> f64 {
    let (rings, sectors) = (720, 2880);
    let surface = Surface::plain(DVec3::Y, 1.0, 1.0);
    let mut sum = 0.0;
    for j in 0..rings {
        let cos = (j as f64 + 0.5) / rings as f64;
        let sin = (1.0 - cos * cos).sqrt();
        for i in 0..sectors {
            let (y, x) = ((i as f64 + 0.5) * TAU / sectors as f64).sin_cos();
            let direction = DVec3::new(x * sin, cos, y * sin);
            let value = bsdf.eval(&surface, TOWARD, direction)[0];
            sum += value * environment.radiance(direction)[0];
        }
    }
    sum * TAU / (rings * sectors) as f64
}

#[test]
fn what_surfaces_reflect_of_a_map() {
    let environment = map();
    let zs: Vec<f64> = surfaces()
        .into_iter()
        .zip(1..)
        .map(|((name, bsdf), seed)| {
            let exact = by_directions(&environment, &bsdf);
            let emitter = Emitter::Environment(environment.clone());
            z(name, reflected(vec![floor(bsdf)], emitter, seed), exact)
        })
        .collect();
    max_abs_z(&zs, FAMILY / 4.0).unwrap();
}

/// A panel that faces down, 1.5 above the floor.
fn panel() -> Shape {
    let turn = DMat3::from_rotation_x(0.5 * PI) * DMat3::from_diagonal(DVec3::new(1.2, 0.8, 1.0));
    let place = DAffine3::from_mat3_translation(turn, DVec3::new(-0.4, 1.5, -0.3));
    Rectangle::new(place).unwrap().into()
}

fn picture() -> Texture {
    let pixels = vec![1.0, 0.0, 9.0, 2.0, 0.5, 4.0, 1.5, 0.0, 2.0, 0.25, 5.0, 1.0];
    let (filter, wrap) = (BitmapFilter::Bilinear, Wrap::Clamp);
    let bitmap = Bitmap::new([4, 3], 1, pixels, filter, wrap, DAffine2::IDENTITY);
    Texture::Bitmap(Arc::new(bitmap.unwrap()))
}

/// ∫ L f cos cos′/r² dA by midpoints.
fn by_points(shape: &Shape, texture: &Texture, bsdf: &Bsdf) -> f64 {
    let many = 1500;
    let surface = Surface::plain(DVec3::Y, 1.0, 1.0);
    let mut sum = 0.0;
    for j in 0..many {
        for i in 0..many {
            let u = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(many));
            let sample = shape.sample_area(u);
            let squared = sample.position.length_squared();
            let direction = sample.position / squared.sqrt();
            let cos = (-sample.normal.dot(direction)).max(0.0);
            let radiance = texture.at(&shape.site_of(&sample))[0];
            let value = bsdf.eval(&surface, TOWARD, direction)[0];
            sum += radiance * value * cos / (squared * sample.pdf);
        }
    }
    sum / f64::from(many * many)
}

#[test]
fn what_surfaces_reflect_of_panels() {
    let black = || Bsdf::Diffuse(Diffuse::new(Spectrum::ZERO).unwrap());
    let mut zs = Vec::new();
    for (name, bsdf) in surfaces() {
        let emitters = [
            Emitter::Textured(Arc::new(TexturedArea::new(1, &panel(), picture()).unwrap())),
            Emitter::Area {
                object: 1,
                radiance: grey(2.0),
            },
        ];
        for (emitter, texture) in emitters
            .into_iter()
            .zip([picture(), Texture::Uniform(grey(2.0))])
        {
            let exact = by_points(&panel(), &texture, &bsdf);
            let objects = vec![floor(bsdf.clone()), wall(panel(), black(), Some(0))];
            let seed = 11 + zs.len() as u64;
            zs.push(z(name, reflected(objects, emitter, seed), exact));
        }
    }
    max_abs_z(&zs, FAMILY / 2.0).unwrap();
}

/// A ball that bends light, where straight lines are poor guesses.
fn lens() -> Field {
    Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap().into()
}

/// Contents of a furnace.
struct Inside {
    /// Index of a ball of radius 1 around the origin.
    index: Field,
    /// A white ball inside it.
    ball: Sphere,
    /// Position of the camera, which looks at the origin.
    eye: DVec3,
}

/// Furnaces around a white surface in a ball of some index: one of an image, and one of a box of
/// textured panels at a distance from the origin, all of radiance 1.
fn furnaces(inside: &Inside, distance: f64) -> [Parts; 2] {
    let white = || Bsdf::Diffuse(Diffuse::new(Spectrum::ONE).unwrap());
    let objects = || {
        vec![
            container(Sphere::around(DVec3::ZERO, 1.0).unwrap(), Bsdf::Null),
            wall(inside.ball.clone(), white(), None),
        ]
    };
    let media = || vec![vacuum(), Medium::transparent("lens", inside.index.clone())];
    let sensor = || camera(inside.eye, DVec3::ZERO);
    let image = Environment::image(8, 4, vec![grey(1.0); 32], Orientation::IDENTITY).unwrap();
    let sky = parts(
        objects(),
        media(),
        vec![Emitter::Environment(image)],
        sensor(),
    );
    let one = || Texture::Uniform(grey(1.0));
    let board = Checkerboard::new([one(), one()], DAffine2::IDENTITY);
    let texture = Texture::Checkerboard(Arc::new(board));
    let black = || Bsdf::Diffuse(Diffuse::new(Spectrum::ZERO).unwrap());
    let (mut all, mut lights) = (objects(), Vec::new());
    for inward in [DVec3::X, DVec3::Y, DVec3::Z]
        .into_iter()
        .flat_map(|d| [d, -d])
    {
        let turn = DMat3::from_quat(DQuat::from_rotation_arc(DVec3::Z, inward)) * distance;
        let place = DAffine3::from_mat3_translation(turn, inward * -distance);
        let side: Shape = Rectangle::new(place).unwrap().into();
        let light = TexturedArea::new(all.len(), &side, texture.clone()).unwrap();
        all.push(wall(side, black(), Some(lights.len())));
        lights.push(Emitter::Textured(Arc::new(light)));
    }
    let room = parts(all, media(), lights, sensor());
    [sky, room]
}

#[test]
fn furnaces_where_rays_bend() {
    // Every vertex is connected, because no pilot reduces the rate.
    let ray = SensorRay {
        origin: DVec3::new(3.0, 0.05, 0.1),
        direction: -DVec3::X,
    };
    let inside = Inside {
        index: lens(),
        ball: Sphere::around(DVec3::X * 0.5, 0.3).unwrap(),
        eye: DVec3::X * 3.0,
    };
    let zs: Vec<f64> = furnaces(&inside, 4.0)
        .into_iter()
        .zip(["image", "texture"])
        .map(|(parts, name)| {
            let scene = Scene::new(parts).unwrap_or_else(|problems| panic!("{problems:?}"));
            z(name, estimate(&scene, (SAMPLES, 31), |_| (ray, 1.0)), 1.0)
        })
        .collect();
    max_abs_z(&zs, FAMILY / 4.0).unwrap();
}

/// Tests random positions of the image, where all strategies share each path: weights must add up
/// to one. Panels are close, so that much of their light meets the ball, and strategies from either
/// end have large weights.
#[test]
fn bidirectional_furnaces() {
    let mut zs = Vec::new();
    for index in [lens(), Constant::new(1.0).into()] {
        let inside = Inside {
            index,
            ball: Sphere::around(DVec3::ZERO, 0.8).unwrap(),
            eye: DVec3::X * 1.15,
        };
        for parts in furnaces(&inside, 1.2) {
            for heuristic in [Heuristic::Balance, Heuristic::Power] {
                let scene = Scene::new(parts.clone()).unwrap();
                let bdpt = Integrator::Bdpt(Bdpt {
                    heuristic,
                    ..Bdpt::default()
                });
                let seed = 41 + zs.len() as u64;
                let found = estimate_by(bdpt, &scene, (SAMPLES / 4, seed), |sampler| {
                    let (image, lens) = (sampler.next_2d(), sampler.next_2d());
                    (scene.sensor().ray(image, lens), 1.0)
                });
                zs.push(z("furnace", found, 1.0));
            }
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}
