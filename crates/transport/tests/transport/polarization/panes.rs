//! Thin panes, compared with slabs between two faces, whose internal reflections are traced one by
//! one, and with a closed form along connections.

use crate::polarization::field::Coherency;
use crate::polarization::filters::{polarizer, square};
use crate::polarization::haze::assert_scattered_once;
use crate::polarization::{polarized, stokes};
use eikonal::field::Constant;
use glam::{DAffine3, DQuat, DVec3};
use morgana_transport::bsdf::{Bsdf, Dielectric, ThinDielectric};
use morgana_transport::emitter::Emitter;
use morgana_transport::medium::Medium;
use morgana_transport::render::Rendering;
use morgana_transport::scene::{Object, ObjectBuilder};
use morgana_transport::sensor::Camera;
use morgana_transport::shape::{Cube, Rectangle};
use morgana_transport::{Scene, Spectrum};
use testkit::z_test::max_abs_z;

const GLASS: f64 = 1.5;
const FAMILY: f64 = 1e-4;

fn pane(center: DVec3, turn: DQuat) -> ObjectBuilder {
    let to_world = DAffine3::from_scale_rotation_translation(DVec3::splat(3.0), turn, center);
    let pane = ThinDielectric::new(GLASS, Spectrum::ONE, Spectrum::ONE).unwrap();
    let rectangle = Rectangle::new(to_world).unwrap();
    Object::builder("pane", rectangle).bsdf(Bsdf::ThinDielectric(pane))
}

/// A slab between two faces.
fn slab(turn: DQuat) -> ObjectBuilder {
    let size = DVec3::new(3.0, 3.0, 0.005);
    let to_world = DAffine3::from_scale_rotation_translation(size, turn, DVec3::ZERO);
    Object::builder("slab", Cube::new(to_world).unwrap())
        .bsdf(Bsdf::Dielectric(Dielectric::default()))
        .interior("glass")
}

/// Renders light that passes a polariser and then a tilted pane or slab, including reflected light.
fn seen(glass: ObjectBuilder, samples: u64, seed: u64) -> Rendering {
    let camera = Camera::orthographic(DVec3::Z * 5.0, DVec3::ZERO, 1e-3).with_up(DVec3::Y);
    let filter = square(
        "polariser",
        DVec3::Z * -5.0,
        DQuat::IDENTITY,
        polarizer(35.0),
    );
    let scene = Scene::builder()
        .film(1, 1)
        .channels(1)
        .camera(camera)
        .medium(Medium::transparent("glass", Constant::new(GLASS)))
        .object(filter)
        .object(glass)
        .emitter(Emitter::constant(1.0));
    polarized(&scene.build().unwrap(), None, samples, seed)
}

#[test]
fn panes_are_slabs_without_thickness() {
    let mut zs = Vec::new();
    for (degrees, seed) in [(20.0f64, 1), (56.0, 3), (75.0, 5)] {
        let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.8, 0.0), degrees.to_radians());
        let found = seen(pane(DVec3::ZERO, turn), 20_000, seed);
        let other = seen(slab(turn), 20_000, seed + 1);
        let error = |r: &Rendering, layer| f64::from(r.film.variance_at(Some(layer), 0, 0)).sqrt();
        for layer in 0..4 {
            let (a, b) = (stokes(&found)[layer], stokes(&other)[layer]);
            let both = error(&found, layer).hypot(error(&other, layer));
            println!("{degrees}, S{layer}: {a} and {b} ± {both}");
            // S3 is zero.
            if layer < 3 {
                assert!(both > 0.0 && both < 0.01);
                zs.push((a - b) / both);
            } else {
                assert!(a.abs() < 1e-9 && b.abs() < 1e-9);
            }
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// The sun and a bulb light a slab of haze through a tilted pane. Light scattered once is the light
/// of dipoles in both polarisations that the pane transmits.
#[test]
fn connections_pass_panes() {
    let travels = DVec3::new(0.6, 0.0, -0.8);
    let turn = DQuat::from_axis_angle(DVec3::X, 50f64.to_radians());
    let normal = turn * DVec3::Z;
    let cos = normal.dot(travels).abs();
    let cos_far = (1.0 - (1.0 - cos * cos) / (GLASS * GLASS)).sqrt();
    let passes = |near: f64, far: f64| {
        let face = ((near - far) / (near + far)).powi(2);
        (1.0 - face) / (1.0 + face)
    };
    let across = normal.cross(travels).normalize();
    let fields = [
        (passes(cos, GLASS * cos_far), across),
        (passes(GLASS * cos, cos_far), travels.cross(across)),
    ];
    assert!(fields[1].0 / fields[0].0 > 1.1);
    assert_scattered_once(
        travels,
        &[pane(travels * -12.0, turn)],
        |view, horizontal| {
            let stokes = fields.map(|(power, field)| {
                let scattered = Coherency::linear(field).scattered(-view);
                scattered.stokes(-view, horizontal).map(|s| power * s)
            });
            std::array::from_fn(|i| stokes[0][i] + stokes[1][i])
        },
    );
}
