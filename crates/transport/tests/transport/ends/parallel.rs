//! Starts of rays of parallel light.

use crate::ends::support::*;
use glam::DVec3;
use morgana_transport::connection_end::ConnectionEnd;
use morgana_transport::emitter::Emitter;
use std::f64::consts::PI;
use testkit::{Family, Mass, Rng, Table, uniform_edges};

/// Returns the p-value of the starts of parallel rays, within `reach` of the axis through `center`.
/// The density of a start does not depend on the direction, which environments choose per ray.
fn starts(emitter: &Emitter, center: DVec3, reach: f64) -> f64 {
    let table = Table::new(uniform_edges(0.0, reach, 12), uniform_edges(-PI, PI, 16));
    let draw = |rng: &mut Rng| {
        let e = emit(emitter, &[], rng.uniform())?;
        Some(polar(e.x, center, e.direction))
    };
    let end = ConnectionEnd::Plane {
        through: center,
        direction: axis(),
        beam: false,
    };
    let pdf = |p: [f64; 2]| {
        // The factor r is the area element.
        p[0] * pdf_emit(emitter, &end, from_polar(p, center, axis()), axis())
    };
    table
        .test(5, 100_000, Mass::Exactly(1.0), draw, pdf)
        .unwrap()
        .p_value
}

#[test]
fn starts_of_parallel_light_follow_their_density() {
    let mut family = Family::new(FALSE_ALARM);
    for (name, emitter) in emitters(color()) {
        let (center, reach) = match &emitter {
            Emitter::Directional { .. } | Emitter::Environment(_) => (AROUND.center, AROUND.radius),
            // Rectangles have their own test.
            Emitter::Collimated(_) if matches!(name, "rectangle" | "picture") => continue,
            // Gaussian deviates reach up to 8.6 standard deviations of half a waist.
            Emitter::Collimated(beam) if name == "Gaussian beam" => {
                (beam.origin(), 4.4 * beam.radius())
            }
            Emitter::Collimated(beam) => (beam.origin(), beam.radius()),
            _ => continue,
        };
        family.push(name, starts(&emitter, center, reach));
    }
    assert_eq!(family.len(), 6);
    family.check().unwrap();
}

/// Parallel light starts outside the ball, and every ray that meets the ball can be drawn.
#[test]
fn light_from_infinity_fills_the_surroundings() {
    let mut rng = Rng::new(6);
    for _ in 0..1000 {
        let direction = DVec3::from_array(rng.direction());
        let start = AROUND.disc(direction, rng.uniform());
        assert!(start.distance(AROUND.center) > AROUND.radius);
        assert!((start - AROUND.center).dot(direction) < -AROUND.radius);
        let inside = AROUND.center + DVec3::from_array(rng.direction()) * AROUND.radius * 0.999;
        assert!(AROUND.disc_pdf(direction, inside) > 0.0);
    }
}
