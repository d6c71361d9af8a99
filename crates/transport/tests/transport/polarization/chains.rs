//! Polarisation along paths with known events: interfaces, mirrors, bent rays.

use crate::polarization::field::{Coherency, reflection, refraction, sun};
use crate::polarization::{assert_alike, horizontal, polarized, stokes};
use eikonal::field::{Constant, Selfoc};
use glam::{DAffine3, DQuat, DVec3};
use morgana_transport::bsdf::{
    Bsdf, Conductor, Dielectric, Diffuse, Distribution, RoughConductor, RoughDielectric, Roughness,
};
use morgana_transport::emitter::Emitter;
use morgana_transport::medium::Medium;
use morgana_transport::phase::Phase;
use morgana_transport::scene::{Object, ObjectBuilder, SceneBuilder};
use morgana_transport::sensor::{Perspective, Sensor, look_at};
use morgana_transport::shape::{Cube, Cylinder, Rectangle};
use morgana_transport::{Scene, Spectrum};
use num_complex::Complex64;

const GLASS: f64 = 1.5;
const METAL: Complex64 = Complex64::new(0.9, 1.7);

fn glass() -> Bsdf {
    Bsdf::Dielectric(Dielectric::default())
}

fn metal() -> Bsdf {
    let conductor = Conductor::new(METAL.re.into(), METAL.im.into(), Spectrum::ONE);
    Bsdf::Conductor(conductor.unwrap())
}

/// A square of a half width around a point, with a normal.
fn square(name: &str, center: DVec3, normal: DVec3, half: f64) -> ObjectBuilder {
    let turn = DQuat::from_rotation_arc(DVec3::Z, normal.normalize());
    let to_world = DAffine3::from_scale_rotation_translation(DVec3::splat(half), turn, center);
    Object::builder(name, Rectangle::new(to_world).unwrap())
}

fn block(half: DVec3) -> ObjectBuilder {
    Object::builder("block", Cube::new(DAffine3::from_scale(half)).unwrap()).bsdf(glass())
}

fn pinhole(origin: DVec3, direction: DVec3, up: DVec3) -> SceneBuilder {
    let to_world = look_at(origin, origin + direction, up).unwrap();
    let pinhole = Sensor::Perspective(Perspective::new(to_world, 1e-6, 1.0));
    Scene::builder().film(1, 1).channels(1).sensor(pinhole)
}

fn mirrored(d: DVec3, normal: DVec3) -> DVec3 {
    d - 2.0 * d.dot(normal) * normal
}

/// A pond polarises light of the sky horizontally at Brewster's angle.
#[test]
fn reflections_at_brewsters_angle_are_horizontal() {
    let theta = GLASS.atan();
    let direction = DVec3::new(theta.sin(), 0.0, -theta.cos());
    let black = Bsdf::Diffuse(Diffuse::new(Spectrum::ZERO).unwrap());
    let scene = pinhole(DVec3::Z * 2.0, direction, DVec3::Z)
        .medium(Medium::transparent("glass", Constant::new(GLASS)))
        .object(block(DVec3::new(9.0, 9.0, 1.0)).interior("glass"))
        .object(square("black", DVec3::Z * -0.5, DVec3::Z, 8.0).bsdf(black))
        .emitter(Emitter::constant(1.0))
        .build()
        .unwrap();
    let found = stokes(&polarized(&scene, Some(2), 4096, 1));
    assert_alike(found, [1.0, 1.0, 0.0, 0.0], 1e-6);
    // Of unpolarised light, half of the perpendicular reflectance is reflected.
    let [s, _] = reflection(theta.cos(), GLASS.into());
    assert!(
        (found[0] / (0.5 * s.norm_sqr()) - 1.0).abs() < 0.3,
        "{found:?}"
    );
}

/// A metal in glass polarises light at an angle to the plane of a total reflection, which makes the
/// light elliptical.
#[test]
fn total_reflection_makes_linear_light_elliptical() {
    let angle = 55f64.to_radians();
    let d0 = DVec3::new(angle.cos(), angle.sin(), 0.0);
    let wall = d0 / d0.x;
    let d1 = mirrored(d0, DVec3::X);
    let mirror = wall + 0.8 * d1;
    let normal = (-d1 + DVec3::new(0.1, 0.2, 0.9)).normalize();
    let d2 = mirrored(d1, normal);
    let light = mirror + 0.6 * d2;
    for up in [DVec3::Z, DVec3::new(-0.3, 0.4, 1.0)] {
        let scene = pinhole(DVec3::ZERO, d0, up)
            .medium(Medium::transparent("glass", Constant::new(GLASS)))
            .object(block(DVec3::new(1.0, 9.0, 9.0)).interior("glass"))
            .object(square("mirror", mirror, normal, 0.2).bsdf(metal()))
            .object(square("light", light, -d2, 0.2).emission(1.0))
            .build()
            .unwrap();
        let found = stokes(&polarized(&scene, None, 4, 1));
        let total = reflection(angle.cos(), (1.0 / GLASS).into());
        let metallic = reflection(-d1.dot(normal), METAL / GLASS);
        let field = Coherency::unpolarized(-d2)
            .met([-d2, -d1], normal, metallic)
            .met([-d1, -d0], DVec3::X, total);
        let expected = field.stokes(-d0, horizontal(d0, up));
        assert!(expected[3].abs() > 0.05 * expected[0], "{expected:?}");
        assert_alike(found, expected, 1e-5);
        assert!((found[0] / expected[0] - 1.0).abs() < 1e-5);
    }
}

/// A metal plate at the end of a graded rod is seen along a helix. Parallel transport carries the
/// light along the helix without rotation about it.
#[test]
fn a_helix_turns_what_is_seen_along_it() {
    let [n0, alpha, radius, length]: [f64; 4] = [1.5, 1.0, 0.5, 2.3];
    let (across, squared) = (alpha * radius, (alpha * radius).powi(2));
    let along = (1.0 - 2.0 * squared).sqrt();
    let speed = f64::hypot(across, along);
    let (sin, cos) = (across / speed, along / speed);
    let direction = DVec3::new(0.0, sin, cos);
    let rod = Cylinder::between(DVec3::Z * -1.0, DVec3::Z * 3.0, 0.9, true).unwrap();
    for up in [DVec3::X, DVec3::new(0.5, 1.0, -0.2)] {
        let scene = pinhole(DVec3::X * radius, direction, up)
            .medium(Medium::transparent(
                "rod",
                Selfoc::new(n0, alpha, DVec3::ZERO, DVec3::Z).unwrap(),
            ))
            .object(Object::builder("rod", rod.clone()).interior("rod"))
            .object(square("plate", DVec3::Z * length, -DVec3::Z, 0.62).bsdf(metal()))
            .emitter(Emitter::constant(1.0))
            .build()
            .unwrap();
        let found = stokes(&polarized(&scene, None, 4, 1));
        // At the plate, the plane of incidence is perpendicular to the radius; transported back, it
        // rotates in the frame of normal and binormal.
        let s = length / cos;
        let (turn_sin, turn_cos) = (sin * cos * s / radius).sin_cos();
        let normal = -DVec3::X;
        let axis = normal * turn_cos + direction.cross(normal) * turn_sin;
        let index = METAL / (n0 * (1.0 - squared).sqrt());
        let [a, b] = reflection(cos, index).map(|r| r.norm_sqr());
        let x = horizontal(direction, up);
        let y = (-direction).cross(x);
        let double = 2.0 * f64::atan2(axis.dot(y), axis.dot(x));
        let q = a - b;
        let expected = [a + b, q * double.cos(), q * double.sin(), 0.0];
        assert!(q > 0.1 * (a + b));
        assert_alike(found, expected, 1e-4);
    }
}

/// A hazy block refracts light before scattering it; the camera is inside. Connections start from
/// infinitely far and from far away.
#[test]
fn connections_carry_polarisation_through_interfaces() {
    let travels = DVec3::new(0.8, 0.3, -0.5).normalize();
    let view = DVec3::new(0.2, 1.0, -0.1).normalize();
    let up = DVec3::new(0.3, 0.0, 1.0);
    let haze = Medium::homogeneous("haze", Constant::new(GLASS), 0.01, 1.0);
    let haze = haze.with_phase(Phase::rayleigh());
    let cos = -travels.z;
    let far = (1.0 - (1.0 - cos * cos) / GLASS.powi(2)).sqrt();
    let refracted = travels / GLASS + DVec3::Z * (cos / GLASS - far);
    let field = Coherency::unpolarized(travels)
        .met([travels, refracted], DVec3::Z, refraction(cos, GLASS))
        .scattered(-view);
    let expected = field.stokes(-view, horizontal(view, up));
    let wide = DVec3::new(50.0, 50.0, 1.0);
    let bulb = Emitter::point(travels * -1e4, 1e8);
    for (emitter, allowed) in [(sun(travels), 1e-6), (bulb, 1e-3)] {
        let scene = pinhole(DVec3::ZERO, view, up)
            .medium(haze.clone())
            .object(block(wide).interior("haze"))
            .emitter(emitter)
            .build()
            .unwrap();
        // Keep paths of two edges, one of them through the top.
        let found = stokes(&polarized(&scene, Some(3), 2048, 3));
        assert_alike(found, expected, allowed);
    }
}

fn roughness() -> Roughness {
    Roughness::new(Distribution::Ggx, 0.4).unwrap()
}

/// Rough metal and rough glass under the sun, from outside and from inside: each facet is a smooth
/// interface.
#[test]
fn facets_polarise_as_smooth_interfaces_do() {
    let travels = DVec3::new(0.5, 0.3, -0.6).normalize();
    let up = DVec3::new(0.3, 1.0, 0.2);
    let metal = RoughConductor::new(roughness(), METAL.re.into(), METAL.im.into(), Spectrum::ONE);
    let metal = Bsdf::RoughConductor(metal.unwrap());
    let glass = RoughDielectric::new(roughness(), Spectrum::ONE, Spectrum::ONE).unwrap();
    let glass = Bsdf::RoughDielectric(glass);
    let half = DVec3::new(50.0, 50.0, 1.0);
    let [above, inside] = [DVec3::Z * 3.0, DVec3::Z * 0.2];
    let [down, rising] = [DVec3::new(0.4, -0.2, -1.0), DVec3::new(-0.3, -0.1, 0.9)];
    for (bsdf, origin, view) in [
        (&metal, above, down),
        (&glass, above, down),
        (&glass, inside, rising),
    ] {
        let view = view.normalize();
        let reflects = view.z < 0.0;
        let n_near = if reflects { 1.0 } else { GLASS };
        let normal = (view * n_near + travels).normalize();
        let cos = travels.dot(normal).abs();
        let amplitudes = match (bsdf, reflects) {
            (Bsdf::RoughConductor(_), _) => reflection(cos, METAL),
            (_, true) => reflection(cos, GLASS.into()),
            (_, false) => refraction(cos, GLASS),
        };
        let field = Coherency::unpolarized(travels).met([travels, -view], normal, amplitudes);
        let cube = Cube::new(DAffine3::from_scale(half)).unwrap();
        let block = Object::builder("block", cube).bsdf(bsdf.clone());
        let scene =
            pinhole(origin, view, up).medium(Medium::transparent("glass", Constant::new(GLASS)));
        let block = match bsdf {
            Bsdf::RoughDielectric(_) => block.interior("glass"),
            _ => block,
        };
        let scene = scene.object(block).emitter(sun(travels)).build().unwrap();
        let found = stokes(&polarized(&scene, Some(2), 256, 2));
        let expected = field.stokes(-view, horizontal(view, up));
        assert!(expected[1].hypot(expected[2]) > 0.002 * expected[0]);
        assert_alike(found, expected, 1e-5);
    }
}
