//! Quantities of the first surface on a sensor ray, compared with closed forms: exact, except for
//! the tolerance of curved rays.

use crate::common::{camera, container, fog, glass, parts, vacuum};
use eikonal::Tolerance;
use eikonal::field::{Constant, LinearIndex};
use glam::{DAffine3, DVec3};
use morgana_transport::aov::{Aov, AovTracer};
use morgana_transport::bsdf::{
    BlendBsdf, Bsdf, Diffuse, Mask, NormalMap, NormalSource, Plastic, Surface, ThinDielectric,
    TwoSided,
};
use morgana_transport::medium::Medium;
use morgana_transport::path::Workspace;
use morgana_transport::scene::{Object, Parts};
use morgana_transport::sensor::SensorRay;
use morgana_transport::shape::{Cube, Rectangle, Shape, Sphere};
use morgana_transport::texture::Texture;
use morgana_transport::{Scene, Spectrum};
use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

const ROUNDING: f64 = 1e-12;
/// Tolerance of lengths: a ray restarts behind each boundary, off it by less than any tolerance.
const OFF: f64 = 1e-9;

fn white() -> Bsdf {
    Bsdf::Diffuse(Diffuse::new(0.5).unwrap())
}

fn plain(shape: impl Into<Shape>, bsdf: Bsdf) -> Object {
    Object {
        sides: None,
        ..container(shape, bsdf)
    }
}

/// A scene with fog of some index in the cube from −1 to 1, within a null boundary, around further
/// objects.
fn in_cube(index: impl Into<eikonal::Field>, objects: Vec<Object>) -> Scene {
    let cube = container(Cube::new(DAffine3::IDENTITY).unwrap(), Bsdf::Null);
    let objects = std::iter::once(cube).chain(objects).collect();
    let media = vec![vacuum(), fog(index, 1.0, 0.5, 0.0)];
    let sensor = camera(DVec3::NEG_Z * 3.0, DVec3::ZERO);
    let scene = Parts {
        tolerance: Tolerance::new(1e-11),
        ..parts(objects, media, vec![], sensor)
    };
    Scene::new(scene).unwrap_or_else(|problems| panic!("{problems:?}"))
}

/// Values of one ray, by channel name.
struct Seen(Vec<(&'static str, f64)>);

impl Seen {
    fn by(tracer: &AovTracer, scene: &Scene, origin: DVec3, direction: DVec3) -> Self {
        let mut ws = Workspace::new(scene.tolerance());
        let mut values = Vec::new();
        let direction = direction.normalize();
        tracer.sample(scene, SensorRay { origin, direction }, &mut ws, &mut values);
        Seen(tracer.channels().zip(values).collect())
    }

    /// Traces a ray to the first surface that it meets.
    fn along(scene: &Scene, origin: DVec3, direction: DVec3) -> Self {
        let of_surfaces = Aov::ALL.into_iter().filter(|aov| aov.is_of_surface());
        let of_surfaces: Vec<Aov> = of_surfaces.collect();
        Seen::by(&AovTracer::new(&of_surfaces), scene, origin, direction)
    }

    fn one(&self, name: &str) -> f64 {
        let found = self.0.iter().find(|(channel, _)| *channel == name);
        found.unwrap_or_else(|| panic!("no channel {name}")).1
    }

    fn vector(&self, name: &str) -> DVec3 {
        DVec3::from_array(["X", "Y", "Z"].map(|axis| self.one(&format!("{name}.{axis}"))))
    }
}

#[track_caller]
fn close(found: DVec3, expected: DVec3, tolerance: f64) {
    assert!(
        found.distance(expected) <= tolerance,
        "{found} instead of {expected}"
    );
}

/// A ball of radius 1/2 in fog whose index matches the surroundings. The ray passes the boundary,
/// and its first surface is the ball.
#[test]
fn a_ball_behind_a_matched_boundary() {
    let ball = Sphere::around(DVec3::ZERO, 0.5).unwrap();
    let scene = in_cube(Constant::new(1.0), vec![plain(ball, white())]);
    let origin = DVec3::new(0.3, 0.0, -3.0);
    let seen = Seen::along(&scene, origin, DVec3::Z);
    let point = DVec3::new(0.3, 0.0, -0.4);
    let depth = seen.one("depth.T");
    assert!((depth - 2.6).abs() < OFF, "{}", depth - 2.6);
    close(seen.vector("position"), point, ROUNDING);
    close(seen.vector("geo_normal"), point * 2.0, ROUNDING);
    close(seen.vector("sh_normal"), point * 2.0, ROUNDING);
    let polar = (-0.8f64).acos() / PI;
    assert!((seen.one("uv.U") - 0.0).abs() < ROUNDING);
    assert!((seen.one("uv.V") - polar).abs() < ROUNDING);
    close(seen.vector("dp_du"), DVec3::Y * (0.3 * TAU), ROUNDING);
    let meridian = DVec3::new(-0.4, 0.0, -0.3) * PI;
    close(seen.vector("dp_dv"), meridian, ROUNDING);
    assert_eq!(seen.one("prim_index.I"), 0.0);
    assert_eq!(seen.one("shape_index.I"), 2.0);
    assert_eq!(seen.one("albedo.R"), 0.5);
    // Past the ball the ray meets nothing.
    let missed = Seen::along(&scene, DVec3::new(0.7, 0.0, -3.0), DVec3::Z);
    assert!(missed.0.iter().all(|(_, value)| *value == 0.0));
}

/// A tilted square, met obliquely from inside the fog.
#[test]
fn a_plane_has_coordinates() {
    let tilt = DAffine3::from_scale_rotation_translation(
        DVec3::splat(0.4),
        glam::DQuat::from_rotation_y(PI * 1.25),
        DVec3::Z * 0.2,
    );
    let square = Rectangle::new(tilt).unwrap();
    let scene = in_cube(Constant::new(1.0), vec![plain(square, white())]);
    let target = tilt.transform_point3(DVec3::new(0.5, -0.25, 0.0));
    let origin = DVec3::new(0.1, 0.05, -0.7);
    let seen = Seen::along(&scene, origin, target - origin);
    assert!((seen.one("depth.T") - origin.distance(target)).abs() < ROUNDING);
    close(seen.vector("position"), target, ROUNDING);
    let normal = DVec3::new(-FRAC_1_SQRT_2, 0.0, -FRAC_1_SQRT_2);
    close(seen.vector("geo_normal"), normal, ROUNDING);
    assert!((seen.one("uv.U") - 0.75).abs() < ROUNDING);
    assert!((seen.one("uv.V") - 0.375).abs() < ROUNDING);
    close(
        seen.vector("dp_du"),
        DVec3::new(-FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2) * 0.8,
        ROUNDING,
    );
    close(seen.vector("dp_dv"), DVec3::Y * 0.8, ROUNDING);
}

/// In n = n₀ + b y, a ray that starts across the gradient where n = n₀ is the catenary y =
/// (n₀/b)(cosh(bz/n₀) − 1) of arc length (n₀/b) sinh(bz/n₀). The depth of a screen at z is the arc
/// length, not the distance.
#[test]
fn depth_is_measured_along_the_curve() {
    let (n0, b) = (1.0, 0.4);
    let index = LinearIndex::new(n0, DVec3::Y * b, DVec3::ZERO).unwrap();
    let at = DAffine3::from_scale_rotation_translation(
        DVec3::splat(0.9),
        glam::DQuat::from_rotation_y(PI),
        DVec3::Z * 0.8,
    );
    let screen = plain(Rectangle::new(at).unwrap(), white());
    let scene = in_cube(index, vec![screen]);
    let seen = Seen::along(&scene, DVec3::NEG_Z * 3.0, DVec3::Z);
    let z = 1.8 * b / n0;
    let (height, length) = (n0 / b * (z.cosh() - 1.0), n0 / b * z.sinh());
    let tolerance = 1e-9;
    let depth = seen.one("depth.T");
    assert!((depth - (2.0 + length)).abs() < tolerance, "{depth}");
    // Check that the length differs clearly from the distance.
    assert!(length - 1.8f64.hypot(height) > 0.01);
    close(
        seen.vector("position"),
        DVec3::new(0.0, height, 0.8),
        tolerance,
    );
    close(seen.vector("geo_normal"), DVec3::NEG_Z, ROUNDING);
}

/// The first surface is glass, and the exit lies beyond. Both kinds of quantities agree with those
/// of rays that are asked for one kind alone.
#[test]
fn surfaces_and_ways_are_told_apart() {
    let ball = plain(Sphere::around(DVec3::ZERO, 0.5).unwrap(), glass());
    let pane = Bsdf::ThinDielectric(ThinDielectric::new(1.5, 1.0, 1.0).unwrap());
    let at = DAffine3::from_translation(DVec3::Z * 2.0);
    let pane = plain(Rectangle::new(at).unwrap(), pane);
    let scene = in_cube(Constant::new(1.0), vec![ball, pane]);
    let (origin, direction) = (DVec3::new(0.1, 0.2, -3.0), DVec3::Z);
    let both = Seen::by(&AovTracer::new(&Aov::ALL), &scene, origin, direction);
    let seen = Seen::along(&scene, origin, direction);
    let ways = Seen::by(&AovTracer::default(), &scene, origin, direction);
    for (name, value) in seen.0.iter().chain(&ways.0) {
        assert_eq!(both.one(name), *value, "{name}");
    }
    assert_eq!(both.0.len(), seen.0.len() + ways.0.len());
    assert_eq!(both.one("shape_index.I"), 2.0);
    let depth = 3.0 - (0.25 - 0.05f64).sqrt();
    assert!((both.one("depth.T") - depth).abs() < OFF);
    assert!(both.one("arc_length") > both.one("depth.T"));
    // A pane stops the view, too, although rays continue.
    let beside = Seen::along(&scene, DVec3::new(0.7, 0.2, -3.0), DVec3::Z);
    assert_eq!(beside.one("shape_index.I"), 3.0);
    assert!((beside.one("depth.T") - 5.0).abs() < OFF);
}

/// A ray that circles within its medium for ever is lost, and has no first surface.
#[test]
fn a_lost_ray_sees_nothing() {
    let media = vec![
        vacuum(),
        Medium::transparent(
            "steep",
            LinearIndex::new(2.0, DVec3::X, DVec3::ZERO).unwrap(),
        ),
    ];
    let ball = container(Sphere::around(DVec3::ZERO, 0.5).unwrap(), glass());
    let scene = parts(
        vec![ball],
        media,
        vec![],
        camera(DVec3::NEG_Z * 3.0, DVec3::ZERO),
    );
    let scene = Scene::new(scene).unwrap();
    let seen = Seen::along(&scene, DVec3::new(0.1, 0.0, -3.0), DVec3::NEG_Z);
    assert!(seen.0.iter().all(|(_, value)| *value == 0.0));
}

fn at(normal: DVec3) -> Surface {
    Surface::plain(normal, 1.0, 1.0)
}

fn diffuse(reflectance: f64) -> Bsdf {
    Bsdf::Diffuse(Diffuse::new(reflectance).unwrap())
}

/// The albedo belongs to diffuse bases, mixtures and the visible side; mirrors have none.
#[test]
fn albedos() {
    let (front, back) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.6, 0.0, -0.8));
    let of = |bsdf: &Bsdf, toward: DVec3| bsdf.albedo(&at(DVec3::Z), toward)[0];
    assert_eq!(of(&diffuse(0.3), front), 0.3);
    let plastic = Bsdf::Plastic(Plastic::new(1.5, 0.4, 1.0, false).unwrap());
    assert_eq!(of(&plastic, front), 0.4);
    let mask = Bsdf::Mask(Mask::new(0.2, diffuse(0.3)).unwrap());
    assert_eq!(of(&mask, front), 0.3);
    let blend = Bsdf::Blend(BlendBsdf::new(0.25, diffuse(0.2), diffuse(0.6)).unwrap());
    assert!((of(&blend, front) - 0.3).abs() < ROUNDING);
    let sides = Bsdf::TwoSided(TwoSided::new(diffuse(0.2), diffuse(0.7)).unwrap());
    assert_eq!([front, back].map(|v| of(&sides, v)), [0.2, 0.7]);
    for none in [Bsdf::Null, glass()] {
        assert_eq!(of(&none, front), 0.0);
    }
}

/// Normals of maps are the shading normals, on the side of the shape's own normal, whichever side
/// is seen.
#[test]
fn mapped_normals_are_shown() {
    let towards = |x: f64, z: f64| {
        let normal = DVec3::new(x, 0.0, z).normalize();
        let colour = (normal + 1.0) * 0.5;
        let colour = Texture::from(Spectrum([colour.x, colour.y, colour.z, 0.0]));
        let map = NormalMap::new(NormalSource::Normals(colour), false, false, diffuse(0.5));
        Bsdf::NormalMap(Box::new(map.unwrap()))
    };
    let mut s = at(DVec3::Z);
    s.tangents = [DVec3::X, DVec3::Y];
    let map = towards(0.3, 1.0);
    let expected = DVec3::new(0.3, 0.0, 1.0).normalize();
    close(map.normal(&s, DVec3::Z), expected, ROUNDING);
    let masked = Bsdf::Mask(Mask::new(0.5, map.clone()).unwrap());
    close(masked.normal(&s, DVec3::Z), expected, ROUNDING);
    let both = Bsdf::TwoSided(TwoSided::new(map.clone(), map).unwrap());
    close(both.normal(&s, DVec3::Z), expected, ROUNDING);
    assert!(both.normal(&s, DVec3::NEG_Z).z > 0.9);
    close(diffuse(0.5).normal(&s, DVec3::Z), DVec3::Z, 0.0);
}
