//! Rays at interfaces, compared with Snell's law, finite differences of traced rays, and the
//! reciprocity of ray tubes (docs/theory.md#interfaces).

pub mod world;

use glam::{DMat3, DVec3};
use morgana_eikonal::field::{Constant, Gaussian, LinearIndex};
use morgana_eikonal::interface::{Interface, Rule};
use morgana_eikonal::ray::{Tangents, perpendicular_basis};
use morgana_eikonal::{Field, Solver, Tolerance};
use testkit::Rng;
use world::{Surface, TwoRegions, trace};

fn worlds(rule: Rule) -> Vec<TwoRegions> {
    let bump: Field = Gaussian::new(1.5, 0.1, DVec3::new(0.1, 0.0, 0.2), 0.5)
        .unwrap()
        .into();
    let slope = DVec3::new(0.05, -0.1, 0.08);
    let linear: Field = LinearIndex::new(1.2, slope, DVec3::ZERO).unwrap().into();
    let tilted = DVec3::new(0.2, -0.3, -1.0).normalize();
    let surfaces = [
        Surface::Plane(DVec3::ZERO, tilted),
        Surface::Ball(DVec3::Z * 0.7, 0.8),
    ];
    let world = |surface, fields| TwoRegions {
        surface,
        fields,
        rule,
    };
    let pairs = [[bump.clone(), linear.clone()], [linear, bump]];
    surfaces
        .into_iter()
        .flat_map(|s| pairs.iter().map(move |p| world(s, p.clone())))
        .collect()
}

const START: DVec3 = DVec3::new(0.1, -0.05, -0.8);

#[test]
fn tangents_are_the_derivative_of_traced_rays() {
    // Central differences have an error of EPS² times third derivatives of order ten, and an error
    // of 1e-12 over EPS from the rays.
    const EPS: f64 = 3e-5;
    for rule in [Rule::Refract, Rule::Reflect, Rule::Pass] {
        for (w, world) in worlds(rule).iter().enumerate() {
            let direction = DVec3::new(0.1, 0.15, 1.0).normalize();
            // Pass the one wall of the plane, or one wall of the ball: its second wall is beyond σ.
            let (end, events) = trace(world, START, direction, 0.9);
            assert_eq!(events, 1);
            for (k, t) in perpendicular_basis(direction).into_iter().enumerate() {
                let shot = |eps: f64| trace(world, START, (direction + t * eps).normalize(), 0.9).0;
                let (plus, minus) = (shot(EPS), shot(-EPS));
                let dx = (plus.x - minus.x) / (2.0 * EPS);
                let dv = (plus.v - minus.v) / (2.0 * EPS);
                let (dx, dv) = (
                    dx.distance(end.variation.dx[k]),
                    dv.distance(end.variation.dv[k]),
                );
                assert!(
                    dx < 2e-7 && dv < 2e-7,
                    "{rule:?} world {w} column {k}: {dx:e} {dv:e}"
                );
            }
        }
    }
}

/// Draws an interface and an incoming velocity that is not totally reflected.
fn random_interface(rng: &mut Rng) -> (Interface, DVec3) {
    let vector = |rng: &mut Rng| DVec3::from_array(rng.direction());
    let normal = vector(rng);
    let [t1, t2] = perpendicular_basis(normal);
    let (a, b, c) = (
        rng.range(-2.0, 2.0),
        rng.range(-2.0, 2.0),
        rng.range(-2.0, 2.0),
    );
    let outer = |p: DVec3, q: DVec3| DMat3::from_cols(p * q.x, p * q.y, p * q.z);
    let shape = outer(t1, t1) * a + outer(t2, t2) * b + (outer(t1, t2) + outer(t2, t1)) * c;
    let (near, far) = (rng.range(1.0, 2.5), rng.range(1.0, 2.5));
    let interface = Interface {
        normal,
        shape,
        near: (near, vector(rng) * 0.3),
        far: (far, vector(rng) * 0.3),
    };
    loop {
        let v = vector(rng) * near.sqrt();
        let c = v.dot(normal);
        if c * c > 0.05 && far - near + c * c > 0.05 {
            return (interface, v);
        }
    }
}

#[test]
fn snells_law_and_mirror_law_hold() {
    let mut rng = Rng::new(11);
    for _ in 0..1000 {
        let (interface, v) = random_interface(&mut rng);
        let n = interface.normal;
        let flat = |v: DVec3| v - n * n.dot(v);
        let refracted = interface.velocity(Rule::Refract, v).unwrap();
        assert!(flat(refracted).distance(flat(v)) < 1e-14);
        assert!((refracted.length_squared() - interface.far.0).abs() < 1e-13);
        assert!(n.dot(refracted) * n.dot(v) > 0.0);
        // Snell's law: n sin θ = n' sin θ', in the plane of incidence.
        let sine = |v: DVec3| v.normalize().cross(n).length();
        let (here, there) = (interface.near.0.sqrt(), interface.far.0.sqrt());
        assert!((here * sine(v) - there * sine(refracted)).abs() < 1e-13);
        assert!(v.cross(n).dot(refracted).abs() < 1e-14);

        let reflected = interface.velocity(Rule::Reflect, v).unwrap();
        assert!(flat(reflected).distance(flat(v)) < 1e-14);
        assert!((n.dot(reflected) + n.dot(v)).abs() < 1e-14);

        let passed = interface.velocity(Rule::Pass, v).unwrap();
        assert!(passed.normalize().distance(v.normalize()) < 1e-14);
        assert!((passed.length() - there).abs() < 1e-14);
    }
}

#[test]
fn total_reflection_begins_at_the_critical_angle() {
    let interface = Interface {
        normal: DVec3::Z,
        shape: DMat3::ZERO,
        near: (2.25, DVec3::ZERO),
        far: (1.0, DVec3::ZERO),
    };
    let critical = (1.0f64 / 1.5).asin();
    let at = |angle: f64| DVec3::new(angle.sin(), 0.0, angle.cos()) * 1.5;
    for sign in [1.0, -1.0] {
        let turned = |v: DVec3| DVec3::new(v.x, v.y, v.z * sign);
        let below = turned(at(critical - 1e-9));
        let beyond = turned(at(critical + 1e-9));
        assert!(interface.velocity(Rule::Refract, below).is_some());
        assert_eq!(interface.velocity(Rule::Refract, beyond), None);
        assert!(interface.velocity(Rule::Reflect, beyond).is_some());
    }
}

#[test]
fn the_tangent_maps_of_refraction_and_reflection_are_symplectic() {
    let mut rng = Rng::new(12);
    let form = |t: &Tangents| t.dx[0].dot(t.dv[1]) - t.dx[1].dot(t.dv[0]);
    for _ in 0..1000 {
        let (interface, v) = random_interface(&mut rng);
        let mut vector = || DVec3::from_array(rng.direction());
        let tangents = Tangents {
            dx: [vector(), vector()],
            dv: [vector(), vector()],
        };
        for rule in [Rule::Refract, Rule::Reflect] {
            let after = interface.tangents(rule, v, &tangents).unwrap();
            // cos θ ≥ 0.1 keeps the columns below 1e3, and their products below 1e6.
            assert!((form(&after) - form(&tangents)).abs() < 1e-9, "{rule:?}");
        }
    }
}

#[test]
fn the_sign_of_the_normal_is_immaterial() {
    let mut rng = Rng::new(13);
    for _ in 0..100 {
        let (interface, v) = random_interface(&mut rng);
        let turned = Interface {
            normal: -interface.normal,
            shape: -interface.shape,
            ..interface
        };
        let start = Tangents::angular(1.0, perpendicular_basis(v.normalize()));
        for rule in [Rule::Refract, Rule::Reflect, Rule::Pass] {
            assert_eq!(interface.velocity(rule, v), turned.velocity(rule, v));
            assert_eq!(
                interface.tangents(rule, v, &start),
                turned.tangents(rule, v, &start)
            );
        }
    }
}

#[test]
fn connections_through_a_refracting_ball_are_reciprocal() {
    // Reciprocity across walls: J(x→y)/n(x)² = J(y→x)/n(y)², docs/theory.md#densities-of-edges.
    // Both ends are inside, or one, or none.
    let mut rng = Rng::new(14);
    let mut solver = Solver::new(Tolerance::new(1e-11));
    for world in worlds(Rule::Refract).iter().skip(2) {
        let mut found = 0;
        for _ in 0..60 {
            let x = DVec3::new(0.0, 0.0, -0.6) + DVec3::from_array(rng.direction()) * 0.25;
            let y = DVec3::Z * 0.7 + DVec3::from_array(rng.direction()) * rng.range(0.1, 1.1);
            let region = |p: DVec3| usize::from(p.distance(DVec3::Z * 0.7) > 0.8);
            let Ok(there) = solver.connect(world, x, region(x), y) else {
                continue;
            };
            let last = solver.pieces().last().map(|p| p.region);
            // Skip rays that are reflected at grazing incidence and end on the other side of the
            // wall than y.
            if last != Some(region(y)) {
                continue;
            }
            let back = solver.connect(world, y, region(y), x);
            let Ok(back) = back else { continue };
            if back.direction_out.distance(-there.direction_in) > 1e-3 {
                continue; // Behind the lens there are several rays; this is another.
            }
            found += 1;
            let (n2_x, n2_y) = (world.fields[region(x)].n2(x), world.fields[region(y)].n2(y));
            let (forward, backward) = (there.jacobian / n2_x, back.jacobian / n2_y);
            assert!(
                (forward / backward - 1.0).abs() < 1e-7,
                "{there:?} {back:?}"
            );
            assert!(back.direction_out.distance(-there.direction_in) < 1e-8);
            assert!((there.optical_length - back.optical_length).abs() < 1e-9);
        }
        assert!(found >= 30, "only {found}");
    }
}

#[test]
fn a_ball_of_one_index_images_as_its_focal_length_says() {
    // The principal planes of a ball pass through its centre. Close to the axis, a parallel beam
    // has the height 1 − y/f at the distance y behind the centre, with f = R n/(2(n − 1)).
    let n = 1.5;
    let world = TwoRegions {
        surface: Surface::Ball(DVec3::ZERO, 1.0),
        fields: [Constant::new(n).into(), Constant::new(1.0).into()],
        rule: Rule::Refract,
    };
    let focal = n / (2.0 * (n - 1.0));
    let mut solver = Solver::new(Tolerance::new(1e-11));
    let x = DVec3::Z * -3.0;
    for y in [1.1, 1.3, 2.5] {
        let beam = solver
            .connect_plane(&world, x, DVec3::Z, 1, DVec3::Z * y)
            .unwrap();
        let exact = (1.0 - y / focal).powi(2);
        assert!(
            (beam.jacobian - exact).abs() < 1e-9,
            "{} {exact}",
            beam.jacobian
        );
    }
}
