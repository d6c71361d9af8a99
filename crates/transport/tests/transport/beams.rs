//! Power of a beam through cross sections along its path, summed over all branches.

use crate::common::{camera, container, fog, glass, parts, vacuum};
use eikonal::field::LinearIndex;
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::bsdf::fresnel;
use morgana_transport::emitter::{BeamProfile, Collimated, Emitter};
use morgana_transport::path::{Connection, ConnectionTarget, Vertex, Workspace};
use morgana_transport::sampling::Sampler;
use morgana_transport::shape::Cube;
use morgana_transport::{Scene, Spectrum};

/// A tank of 60 × 8 × 6, denser at the bottom, and a beam that enters it upwards through the left
/// wall. The plane of its aperture intersects the tank, so that random starts lie on both sides of
/// the wall.
fn tank() -> (Scene, DVec3) {
    let to_world = DAffine3 {
        matrix3: DMat3::from_diagonal(DVec3::new(30.0, 4.0, 3.0)),
        translation: DVec3::new(30.0, 4.0, 0.0),
    };
    let index = LinearIndex::new(1.5, DVec3::Y * -0.02, DVec3::ZERO).unwrap();
    let direction = DVec3::new(1.0, 0.38, 0.0).normalize();
    let profile = BeamProfile::Gaussian { waist: 0.5 };
    let origin = DVec3::new(-0.5, 3.3, 0.0);
    let beam = Collimated::new(origin, direction, profile, Spectrum::ONE);
    let scene = Scene::new(parts(
        vec![container(Cube::new(to_world).unwrap(), glass())],
        vec![vacuum(), fog(index, 0.0, 0.0, 0.0)],
        vec![Emitter::Collimated(beam)],
        camera(DVec3::new(30.0, 4.0, 60.0), DVec3::new(30.0, 4.0, 0.0)),
    ));
    (scene.unwrap(), direction)
}

/// Power through the plane at `x`, by stratified points on the plane.
fn power(scene: &Scene, x: f64, ws: &mut Workspace) -> f64 {
    let emitter = &scene.emitters()[0];
    let shape = |object: usize| &scene.objects()[object].shape;
    let end = emitter.sample_end(scene.around(), shape, [0.5, 0.5]).end;
    let target = ConnectionTarget::emitter(scene, 0, end);
    let (rows, columns) = (240, 20);
    let (height, width) = (8.0, 3.0);
    let mut sum = 0.0;
    for i in 0..rows * columns {
        let mut sampler = Sampler::new(1, i, 0);
        let [u, v] = sampler.next_2d();
        let y = (i / columns) as f64 + u;
        let z = (i % columns) as f64 + v;
        let position = DVec3::new(
            x,
            y / rows as f64 * height,
            (z / columns as f64 - 0.5) * width,
        );
        let medium = scene.medium_at(position);
        let n = scene.n(medium, position);
        let vertex = Vertex::Volume {
            x: position,
            direction: DVec3::Z,
            medium,
        };
        let found = Connection::each(scene, &vertex, &target, &mut sampler, ws, |connection| {
            let irradiance = emitter.emitted(&end, connection.origin, connection.emission)
                * connection.transmittance()
                * (connection.geometry.geometry_term * n * n);
            (!irradiance.is_zero()).then_some(irradiance[0] * -connection.direction.x)
        });
        sum += found
            .iter()
            .map(|(value, weight)| value * weight)
            .sum::<f64>();
    }
    sum * height * width / (rows * columns) as f64
}

/// Until the beam reaches the bottom, the power that the wall transmits passes every cross section.
/// A missing or duplicate branch would change it. The quadrature is accurate to 2 %.
#[test]
fn all_of_a_beam_goes_through_a_graded_tank() {
    let (scene, direction) = tank();
    let let_in = 1.0 - fresnel::dielectric(direction.x, 1.0, 1.43).reflectance;
    let mut ws = Workspace::new(scene.tolerance());
    ws.search = 1.0;
    for x in [2.0, 12.0, 20.0, 40.0] {
        let power = power(&scene, x, &mut ws);
        println!("{x}: {power}");
        assert!((power / let_in - 1.0).abs() < 0.02, "at {x}: {power}");
    }
    assert!(ws.stats.connections.searches > 1000);
}
