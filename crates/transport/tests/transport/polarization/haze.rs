//! A slab of haze behind elements that the light passes first.

use crate::polarization::field::sun;
use crate::polarization::{assert_alike, horizontal, polarized, stokes};
use eikonal::field::Constant;
use glam::{DAffine3, DQuat, DVec3};
use morgana_transport::Scene;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::emitter::Emitter;
use morgana_transport::medium::Medium;
use morgana_transport::phase::Phase;
use morgana_transport::scene::{Object, ObjectBuilder};
use morgana_transport::sensor::Camera;
use morgana_transport::shape::Cube;

/// Directions of views, and the up direction of each.
pub const VIEWS: [(DVec3, DVec3); 3] = [
    (DVec3::new(0.0, 0.0, -1.0), DVec3::X),
    (DVec3::new(0.3, 0.5, -0.4), DVec3::Z),
    (DVec3::new(-0.8, 0.1, -0.6), DVec3::new(0.0, 1.0, 0.2)),
];

/// Asserts the Stokes parameters of light that the slab scatters once, from the sun and from a
/// bulb, along a direction through objects. Connections start from the vertex for the bulb, and
/// from the light for the sun. `expected` takes the unit direction of a view and its horizontal.
pub fn assert_scattered_once(
    travels: DVec3,
    objects: &[ObjectBuilder],
    expected: impl Fn(DVec3, DVec3) -> [f64; 4],
) {
    let place = DAffine3::from_scale_rotation_translation(
        DVec3::new(50.0, 50.0, 0.1),
        DQuat::IDENTITY,
        DVec3::Z * -0.1,
    );
    let haze = Medium::homogeneous("haze", Constant::new(1.0), 1.0, 1.0);
    let slab = Object::builder("slab", Cube::new(place).unwrap());
    for (view, up) in VIEWS {
        let view = view.normalize();
        let expected = expected(view, horizontal(view, up));
        for (emitter, allowed) in [
            (sun(travels), 1e-5),
            (Emitter::point(travels * -1e3, 1e6), 1e-2),
        ] {
            let camera = Camera::orthographic(-1.0 * view, DVec3::ZERO, 1e-4).with_up(up);
            let mut scene = Scene::builder()
                .film(1, 1)
                .channels(1)
                .camera(camera)
                .medium(haze.clone().with_phase(Phase::rayleigh()))
                .object(slab.clone().bsdf(Bsdf::Null).interior("haze"))
                .emitter(emitter);
            for object in objects {
                scene = scene.object(object.clone());
            }
            let found = stokes(&polarized(&scene.build().unwrap(), Some(2), 64, 1));
            assert_alike(found, expected, allowed);
        }
    }
}
