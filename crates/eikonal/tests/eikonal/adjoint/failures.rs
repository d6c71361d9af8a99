//! Rays that have no end.

use super::*;
use morgana_eikonal::connect::Unbounded;
use morgana_eikonal::field::{Constant, Selfoc};

/// Reasons why rays do not pass a sequence of surfaces.
#[test]
fn rays_that_do_not_come_through() {
    let ball = Quadric {
        point: DVec3::ZERO,
        axis: DVec3::Z,
        form: [1.0, 0.0, 0.0, -1.0],
        departure: [0.0; DEPARTURES],
    };
    let receiver = Receiver::Plane {
        point: DVec3::Z * 2.0,
        normal: DVec3::Z,
    };
    let glass = [1.0, 1.5, 1.0].map(|n| Field::from(Constant::new(n)));
    let follow = |elements: &[SequenceElement], media: &[Field], begin: [f64; 6]| {
        let layout = Layout::Sequence(Sequence::new(elements, media).unwrap());
        let mut ray = AdjointRay::new(&layout, receiver, Tolerance::default(), 20.0);
        let end = ray.follow_through(start(&begin, 0));
        assert_eq!(ray.pull_back(&LOSS, &mut ()).is_some(), end.is_ok());
        end.map(|_| ())
    };
    let both = [SequenceElement::Refracting(ball); 2];
    let along = |x: f64| [x, 0.0, -3.0, 0.0, 0.0, 1.0];
    assert_eq!(follow(&both, &glass, along(0.5)), Ok(()));
    assert_eq!(
        follow(&both, &glass, along(1.5)),
        Err(RayFailure::MissedSurface)
    );
    // From inside the ball, beyond the critical angle.
    let inside = [0.9, 0.0, 0.0, 0.0, 0.0, 1.0];
    assert_eq!(
        follow(&both[..1], &glass[1..], inside),
        Err(RayFailure::Reflected)
    );
    let stop = SequenceElement::Aperture(Quadric::plane(-2.0 * DVec3::Z, DVec3::Z), 0.3);
    assert_eq!(follow(&[stop], &glass[..1], along(0.2)), Ok(()));
    assert_eq!(
        follow(&[stop], &glass[..1], along(0.4)),
        Err(RayFailure::Stopped)
    );
    // Only the sheet at the vertex belongs to a conic: the far side of this sphere, which bends
    // away from the light, does not.
    let concave = Quadric {
        point: DVec3::ZERO,
        axis: DVec3::Z,
        form: [-1.0, 0.0, -2.0, 0.0],
        departure: [0.0; DEPARTURES],
    };
    let concave = [SequenceElement::Refracting(concave)];
    assert_eq!(follow(&concave, &glass[..2], along(0.5)), Ok(()));
    assert!(Sequence::new(&concave, &glass).is_none());
}

/// Rays without an end report why, and give no derivative.
#[test]
fn rays_without_an_end() {
    let field: Field = Constant::new(1.0).into();
    let away = RayStart {
        x: DVec3::Z * 2.0,
        direction: DVec3::Z,
        region: (),
    };
    let world = Unbounded(&field);
    let mut ray = AdjointRay::new(&world, PLANE, Tolerance::default(), 10.0);
    assert_eq!(ray.follow(away), Err(RayFailure::Missed));
    assert_eq!(ray.pull_back(&LOSS, &mut ()), None);
    let rod: Field = Selfoc::new(1.5, 1.0, DVec3::ZERO, DVec3::Z).unwrap().into();
    let world = Unbounded(&rod);
    let mut ray = AdjointRay::new(&world, PLANE, Tolerance::default(), 10.0);
    let outside = RayStart {
        x: DVec3::X * 1.5,
        direction: DVec3::Z,
        region: (),
    };
    assert_eq!(ray.follow(outside), Err(RayFailure::Lost));
}
