//! Connections that have no well-defined result. The solver must return a typed failure or a finite
//! result, never a panic or a NaN.

use crate::branches::world::Glass;
use glam::DVec3;
use morgana_eikonal::connect::{InitialGuess, Pattern, RayFamily, Reach, Unbounded};
use morgana_eikonal::field::{Constant, Fisheye, Gaussian, Luneburg};
use morgana_eikonal::{ConnectingRay, Failure, Field, Solver, Tolerance, World};

const REACH: Reach = Reach {
    optical_length: 7.0,
    reflections: 1,
    bounces: u32::MAX,
};

fn sound(c: &ConnectingRay) {
    let unit = |d: DVec3| (d.length() - 1.0).abs() < 1e-12;
    let lengths = [c.arc_length, c.optical_length, c.sigma, c.jacobian];
    let ok = c.start.is_finite()
        && unit(c.direction_out)
        && unit(c.direction_in)
        && lengths.iter().all(|l| l.is_finite() && *l > 0.0)
        && c.miss.is_finite();
    assert!(ok, "{c:?}");
}

struct Answers {
    primary: Result<ConnectingRay, Failure>,
    /// Number of branches found.
    all: usize,
}

/// Calls every search between two points, and asserts that each result is sound.
fn ask<W: World>(world: &W, x: DVec3, region: W::Region, y: DVec3) -> Answers {
    let mut solver = Solver::new(Tolerance::new(1e-6));
    let primary = solver.connect(world, x, region, y);
    primary.iter().for_each(sound);
    for direction in [DVec3::Z, DVec3::new(0.6, 0.0, 0.8), -DVec3::Y] {
        let plane = solver.connect_plane(world, x, direction, region, y);
        plane.iter().for_each(sound);
        for family in [
            RayFamily::Point { x, direction },
            RayFamily::Plane { x, direction },
        ] {
            let start = solver.approach(world, family, region, y, &REACH, &mut || 0.0);
            if let Some((start, arrival)) = start {
                assert!(start.optical_length > 0.0 && start.optical_length.is_finite());
                assert!((arrival.length() - 1.0).abs() < 1e-12);
                solver.solve(world, &start, y).iter().for_each(sound);
            }
        }
    }
    let all = solver.all(world, x, region, y, &REACH).branches;
    all.iter().for_each(|(_, branch)| sound(branch));
    Answers {
        primary,
        all: all.len(),
    }
}

#[test]
fn coincident_points_are_refused() {
    let field: Field = Constant::new(1.5).into();
    let x = DVec3::new(0.3, 0.2, -0.1);
    for answers in [
        ask(&Unbounded(&field), x, (), x),
        ask(&Glass::ball(1.5), x, 0, x),
    ] {
        assert_eq!(answers.primary, Err(Failure::Coincident));
        assert_eq!(answers.all, 0);
    }
    let mut solver = Solver::new(Tolerance::default());
    // In front of the plane, on it, behind it.
    for (depth, found) in [(0.5, true), (0.0, false), (-0.5, false)] {
        let y = x + DVec3::Z * depth;
        let plane = solver.connect_plane(&Unbounded(&field), x, DVec3::Z, (), y);
        assert_eq!(plane.is_ok(), found);
        assert!(found || plane == Err(Failure::Coincident));
    }
}

#[test]
fn what_is_not_finite_is_refused() {
    let field: Field = Constant::new(1.5).into();
    let world = Unbounded(&field);
    let x = DVec3::new(0.3, 0.2, -0.1);
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        let y = DVec3::new(0.0, bad, 0.0);
        assert!(ask(&world, x, (), y).primary.is_err(), "{bad}");
        assert!(ask(&world, y, (), x).primary.is_err(), "{bad}");
    }
    let mut solver = Solver::new(Tolerance::default());
    for optical_length in [f64::NAN, f64::INFINITY, 0.0, -1.0] {
        let start = InitialGuess {
            family: RayFamily::Point {
                x,
                direction: DVec3::Z,
            },
            region: (),
            optical_length,
            pattern: Pattern::REFRACT,
        };
        assert!(solver.solve(&world, &start, DVec3::Z).is_err());
        let reach = Reach {
            optical_length,
            ..REACH
        };
        let start = solver.approach(&world, start.family, (), DVec3::Z, &reach, &mut || 0.0);
        assert_eq!(start, None);
        assert!(solver.all(&world, x, (), DVec3::Z, &reach).branches.len() <= 1);
    }
}

/// The search finds all branches for any sufficiently long reach. However far apart the points are,
/// it returns at worst a failure.
#[test]
fn reach_and_distance_may_have_any_size() {
    let field: Field = Gaussian::new(1.0, 0.8, DVec3::ZERO, 0.5).unwrap().into();
    let world = Unbounded(&field);
    let (x, y) = (DVec3::new(0.02, 0.0, -3.0), DVec3::new(0.1, 0.0, 3.0));
    let mut solver = Solver::new(Tolerance::default());
    let mut count = |optical_length: f64| {
        let reach = Reach {
            optical_length,
            ..REACH
        };
        solver.all(&world, x, (), y, &reach).branches.len()
    };
    let expected = count(20.0);
    assert!(expected >= 3, "{expected}");
    assert_eq!(count(1e300), expected);
    assert_eq!(count(f64::INFINITY), expected);
    // Points whose distance underflows count as coincident.
    let mut solver = Solver::new(Tolerance::default());
    let found = solver.connect(&world, DVec3::ZERO, (), DVec3::X * 1e-200);
    assert_eq!(found, Err(Failure::Coincident));
    for far in [DVec3::X * 1e300, DVec3::Z * f64::INFINITY, DVec3::NAN] {
        let mut solver = Solver::new(Tolerance::default());
        assert_eq!(solver.connect(&world, x, (), far), Err(Failure::TooFar));
    }
}

#[test]
fn ends_on_interfaces_are_answered_soundly() {
    let (slab, ball) = (Glass::slab(1.5, 1.0), Glass::ball(1.5));
    let far = DVec3::new(0.4, -0.3, -2.0);
    for z in [0.0, 1.0] {
        let on = DVec3::new(0.1, 0.2, z);
        ask(&slab, far, 0, on);
        ask(&slab, on, 1, far);
        ask(&slab, on, 0, far);
    }
    for on in [DVec3::X, DVec3::Z, DVec3::new(0.6, 0.0, -0.8)] {
        ask(&ball, far, 1, on);
        ask(&ball, on, 1, far);
        // Inside the ball, rays run close to its surface.
        let creeping = Solver::new(Tolerance::default()).connect(&ball, on, 0, DVec3::Y);
        creeping.iter().for_each(sound);
    }
}

#[test]
fn grazing_incidence_and_total_reflection_are_answered_soundly() {
    let (slab, ball) = (Glass::slab(1.5, 1.0), Glass::ball(1.5));
    // Connect points along the tangent of the ball, then within the surface of the slab, then along
    // it.
    ask(
        &ball,
        DVec3::new(1.0, 0.0, -2.0),
        1,
        DVec3::new(1.0, 0.0, 2.0),
    );
    ask(
        &ball,
        DVec3::new(0.9, 0.0, 0.0),
        0,
        DVec3::new(0.9, 0.0, 3.0),
    );
    ask(
        &slab,
        DVec3::new(0.0, 0.0, 0.5),
        1,
        DVec3::new(0.0, 9.0, 1.0),
    );
    ask(
        &slab,
        DVec3::new(0.0, 0.0, 1.0),
        1,
        DVec3::new(0.0, 4.0, 1.0),
    );
    // From just below the surface to just above it, far along it: the ray is beyond the critical
    // angle except for the last bit of its path.
    ask(
        &slab,
        DVec3::new(0.0, 0.0, 0.999),
        1,
        DVec3::new(0.0, 6.0, 1.001),
    );
}

#[test]
fn foci_are_answered_soundly() {
    // The conjugate point of the fisheye, where all rays intersect.
    let fisheye: Field = Fisheye::new(2.0, DVec3::ZERO, 1.0).unwrap().into();
    let x = DVec3::new(0.3, -0.2, 0.4);
    for x in [x, DVec3::X] {
        let conjugate = -x / x.length_squared();
        let answers = ask(&Unbounded(&fisheye), x, (), conjugate);
        assert_eq!(answers.primary, Err(Failure::Caustic));
    }
    // The far pole of a Luneburg lens, where all rays of a parallel beam intersect.
    let lens: Field = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap().into();
    let world = Unbounded(&lens);
    let pole = DVec3::Z;
    for tolerance in [1e-4, 1e-6, 1e-10] {
        let mut solver = Solver::new(Tolerance::new(tolerance));
        for offset in [0.0, 1e-3, 0.5] {
            let x = DVec3::new(offset, 0.0, -1.0);
            let direction = DVec3::Z;
            let found = solver.connect_plane(&world, x, direction, (), pole);
            assert_eq!(found, Err(Failure::Caustic));
            let family = RayFamily::Plane { x, direction };
            let start = solver.approach(&world, family, (), pole, &REACH, &mut || 0.0);
            let (start, _) = start.unwrap();
            solver.solve(&world, &start, pole).iter().for_each(sound);
        }
    }
    ask(&world, -pole, (), pole);
}

/// Directions of planes may have any length except zero. A reach that is zero, negative or not a
/// number contains no branches.
#[test]
fn directions_of_any_length_and_reaches_that_are_no_lengths() {
    let field: Field = Constant::new(1.5).into();
    let (x, y) = (DVec3::NEG_Z * 3.0, DVec3::new(0.2, 0.1, 2.0));
    let mut solver = Solver::new(Tolerance::new(1e-6));
    let mut plane = |direction| solver.connect_plane(&Unbounded(&field), x, direction, (), y);
    let expected = plane(DVec3::Z);
    for length in [2.0, 0.5, 1e-100] {
        assert_eq!(plane(DVec3::Z * length), expected, "{length}");
    }
    assert_eq!(plane(DVec3::ZERO), Err(Failure::Coincident));
    for optical_length in [f64::NAN, -1.0, 0.0] {
        let reach = Reach {
            optical_length,
            ..REACH
        };
        let found = solver.all(&Unbounded(&field), x, (), y, &reach);
        assert!(found.branches.is_empty(), "{optical_length}");
    }
}
