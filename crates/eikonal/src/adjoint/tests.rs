//! Reverse mode is the transpose of forward mode, to round-off: ⟨λ, F′δ⟩ = ⟨F′ᵀλ, δ⟩ for the
//! discrete map of a ray, with random perturbations of starts and parameters. The tests implement
//! forward mode separately, from the tangents of steps and interfaces, and compare it with the
//! forward mode of the crate.

use super::{
    AdjointRay, DEPARTURES, EndDerivative, IndexSink, Layout, LayoutChange, LayoutDerivative,
    ParameterDerivative, Quadric, RayStart, Receiver, Sequence, SequenceElement, StartChange,
    WorldChange,
};
use crate::bounds::Aabb;
use crate::connect::{Crossing, World};
use crate::field::{
    Bspline, Constant, Field, Gaussian, IndexChange, IndexDerivative, LinearSquare, Placement,
};
use crate::interface::{Interface, Rule};
use crate::ray::bernstein::{first_root, height, product};
use crate::ray::{Arc, DRIFT, KICK, STAGES, Tangents, Tolerance};
use glam::{DMat3, DVec3};
use testkit::Rng;

/// A ball of index-graded glass in graded surroundings.
struct BallLens {
    /// Fields outside and inside.
    fields: [Field; 2],
    rule: Rule,
}

const RADIUS: f64 = 0.8;

impl World for BallLens {
    type Region = usize;

    fn field(&self, region: usize) -> &Field {
        &self.fields[region]
    }

    fn crossing(&self, region: usize, arc: &Arc) -> Option<Crossing<usize>> {
        let squares = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| {
            let c = height(&arc.control(), DVec3::ZERO, axis);
            product::<6, 6, 11>(&c, &c)
        });
        let f = std::array::from_fn::<f64, 11, _>(|i| {
            squares[0][i] + squares[1][i] + squares[2][i] - RADIUS * RADIUS
        });
        let theta = first_root(&f, 0.0, 1.0, [0.0; 2])?;
        let normal = arc.position(theta).normalize();
        let along = DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
        Some(Crossing {
            theta,
            position: normal * RADIUS,
            normal,
            shape: (DMat3::IDENTITY - along) * (1.0 / RADIUS),
            rule: self.rule,
            beyond: 1 - region,
            surface: 0,
        })
    }

    fn ray_epsilon(&self) -> f64 {
        1e-11
    }
}

/// Sinks for the derivatives with respect to the fields of both regions.
struct Both<'a>([ParameterDerivative<'a, usize>; 2]);

impl IndexSink<usize> for Both<'_> {
    fn add(&mut self, region: usize, x: DVec3, by: IndexDerivative) {
        self.0[region].add(region, x, by);
    }
}

/// A perturbation of the start and of all parameters.
struct Perturbation {
    x: DVec3,
    direction: DVec3,
    parameters: [Vec<f64>; 2],
}

impl Perturbation {
    /// Returns the changes of n² and ∇n² at a point.
    fn of_index(&self, world: &BallLens, region: usize, x: DVec3) -> (f64, DVec3) {
        let by = |by| {
            let field = world.field(region);
            let mut values = vec![0.0; field.sum_count()];
            field.add_parameter_derivative(x, by, &mut values);
            dot(&values, &self.parameters[region])
        };
        let slope = |axis| {
            by(IndexDerivative {
                n2: 0.0,
                gradient: axis,
            })
        };
        let value = by(IndexDerivative {
            n2: 1.0,
            gradient: DVec3::ZERO,
        });
        (value, DVec3::from_array(DVec3::AXES.map(slope)))
    }
}

/// A world and its perturbation.
struct Perturbed<'a>(&'a BallLens, &'a Perturbation);

impl WorldChange<usize> for Perturbed<'_> {
    fn index(&self, region: usize, x: DVec3) -> IndexChange {
        self.0.fields[region].index_change(x, &self.1.parameters[region])
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Computes (δx, δv, δS) at the end, by forward mode over the recorded steps.
fn forward(ray: &AdjointRay<BallLens>, by: &Perturbation) -> (DVec3, DVec3, f64) {
    let (world, start) = (ray.world, ray.start.unwrap());
    let (n2, grad) = world.field(start.region).gradient(start.x);
    let n = n2.sqrt();
    let of_n = (by.of_index(world, start.region, start.x).0 + grad.dot(by.x)) / (2.0 * n);
    let (mut x, mut v) = (start.x, start.direction * n);
    let (mut dx, mut dv) = (by.x, by.direction * n + start.direction * of_n);
    let mut ds = -v.dot(dx);
    for (i, segment) in ray.segments.iter().enumerate() {
        if let Some(passed) = &segment.passed {
            let (interface, rule, before) = (&passed.interface, passed.rule, passed.before);
            let columns = Tangents {
                dx: [dx, DVec3::ZERO],
                dv: [dv, DVec3::ZERO],
            };
            let mapped = interface.tangents(rule, before, &columns).unwrap();
            let hit = dx - before * (interface.normal.dot(dx) / interface.normal.dot(before));
            ds += (before - passed.after).dot(hit);
            let [near, far] = [passed.near, passed.far].map(|r| by.of_index(world, r, passed.x).0);
            (dx, dv) = (
                mapped.dx[0],
                mapped.dv[0] + of_indices(interface, rule, before, [near, far]),
            );
            let off = world
                .ray_epsilon()
                .copysign(interface.normal.dot(passed.after));
            (x, v) = (passed.x + interface.normal * off, passed.after);
        }
        let beyond = ray
            .segments
            .get(i + 1)
            .map_or(ray.spans.len(), |next| next.first);
        let mut kick = |x: DVec3, v: &mut DVec3, dx: DVec3, dv: &mut DVec3, h: f64| {
            let jet = world.field(segment.region).jet(x);
            let (value, slope) = by.of_index(world, segment.region, x);
            *v += jet.grad * (0.5 * h);
            *dv += (jet.hess * dx + slope) * (0.5 * h);
            ds += 0.5 * h * value;
        };
        for h in &ray.spans[segment.first..beyond] {
            kick(x, &mut v, dx, &mut dv, KICK[0] * h);
            for (drift, after) in STAGES {
                x += v * (DRIFT[drift] * h);
                dx += dv * (DRIFT[drift] * h);
                kick(x, &mut v, dx, &mut dv, KICK[after] * h);
            }
        }
    }
    let region = ray.segments.last().unwrap().region;
    let a = 0.5 * world.field(region).gradient(x).1;
    let span = -ray.normal.dot(dx) / ray.normal.dot(v);
    let dx = dx + v * span;
    (dx, dv + a * span, ds + v.dot(dx))
}

/// Returns the change of the velocity after an interface with n² on either side, by a difference of
/// [`Interface::velocity`].
fn of_indices(interface: &Interface, rule: Rule, before: DVec3, change: [f64; 2]) -> DVec3 {
    let after = |step: f64| {
        let mut changed = *interface;
        changed.near.0 += step * change[0];
        changed.far.0 += step * change[1];
        changed.velocity(rule, before).unwrap()
    };
    // Extrapolate central differences by Richardson's method, to 1e-12; complex steps are not
    // available.
    let central = |h: f64| (after(h) - after(-h)) / (2.0 * h);
    let h = 1e-3;
    let [a, b, c] = [h, h / 2.0, h / 4.0].map(central);
    let [ab, bc] = [(4.0 * b - a) / 3.0, (4.0 * c - b) / 3.0];
    (16.0 * bc - ab) / 15.0
}

fn worlds() -> Vec<BallLens> {
    let cube = Aabb::new(DVec3::splat(-1.5), DVec3::splat(1.5));
    let waves = |x: DVec3| 1.35 + 0.03 * (2.0 * x.x + x.y).sin() * (1.5 * x.z - 0.5 * x.y).cos();
    let grid: Field = Bspline::from_fn([12, 9, 11], cube, Placement::Nodes, waves)
        .unwrap()
        .into();
    let bump: Field = Gaussian::new(1.5, 0.1, DVec3::new(0.1, 0.05, -0.1), 0.5)
        .unwrap()
        .into();
    let air: Field = Constant::new(1.0).into();
    let pairs = [
        [grid.clone(), bump.clone()],
        [air, grid.clone()],
        [bump, grid],
    ];
    let rules = [Rule::Refract, Rule::Reflect, Rule::Pass];
    let world = |rule| pairs.clone().map(|fields| BallLens { fields, rule });
    rules.into_iter().flat_map(world).collect()
}

#[test]
fn reverse_mode_is_the_transpose_of_forward_mode() {
    let mut rng = Rng::new(11);
    let vector = |rng: &mut Rng| DVec3::from_array(rng.direction());
    let receiver = Receiver::Plane {
        point: DVec3::new(0.0, 0.0, 1.2),
        normal: DVec3::new(0.2, -0.1, 1.0).normalize(),
    };
    let mut passed = 0;
    for (number, world) in worlds().iter().enumerate() {
        for _ in 0..8 {
            let mut ray = AdjointRay::new(world, receiver, Tolerance::default(), 20.0);
            let direction = (DVec3::Z + 0.2 * vector(&mut rng)).normalize();
            // Mirrors are met from inside.
            let inside = world.rule == Rule::Reflect;
            let x = if inside {
                DVec3::Z * 0.3
            } else {
                DVec3::Z * -1.2
            } + 0.2 * vector(&mut rng);
            let start = RayStart {
                x,
                direction,
                region: usize::from(inside),
            };
            let receiver_within = Receiver::Plane {
                point: DVec3::Z * -0.2,
                normal: DVec3::Z,
            };
            if inside {
                ray.receiver = receiver_within;
            }
            ray.follow(start).unwrap();
            passed += ray.segments.len() - 1;
            let tilt = vector(&mut rng);
            let mut parameters = |region: usize| {
                let count = world.fields[region].sum_count();
                (0..count).map(|_| 0.1 * rng.range(-1.0, 1.0)).collect()
            };
            let by = Perturbation {
                parameters: [parameters(0), parameters(1)],
                x: vector(&mut rng),
                direction: tilt - direction * direction.dot(tilt),
            };
            let loss = EndDerivative {
                x: vector(&mut rng),
                v: vector(&mut rng),
                optical_length: rng.range(-1.0, 1.0),
            };
            let sink = |region| ParameterDerivative::new(region, &world.fields[region]);
            let mut sinks = Both([sink(0), sink(1)]);
            let back = ray.pull_back(&loss, &mut sinks).unwrap();
            let (dx, dv, ds) = forward(&ray, &by);
            let start = StartChange {
                x: by.x,
                direction: by.direction,
            };
            let pushed = ray.push_forward(&start, &Perturbed(world, &by)).unwrap();
            let apart = (pushed.x - dx).length() + (pushed.v - dv).length();
            let apart = apart + (pushed.optical_length - ds).abs();
            let whole = dx.length() + dv.length() + ds.abs();
            assert!(apart < 1e-11 * whole, "world {number}: {apart:e}");
            let terms = [loss.x.dot(dx), loss.v.dot(dv), loss.optical_length * ds];
            let [outside, within] = [0, 1].map(|r| dot(&sinks.0[r].values, &by.parameters[r]));
            let reverse = back.x.dot(by.x) + back.direction.dot(by.direction) + outside + within;
            let size: f64 = terms.iter().map(|term| term.abs()).sum();
            let error = (terms.iter().sum::<f64>() - reverse).abs() / size;
            assert!(error < 1e-12, "world {number}: {error:e}");
        }
    }
    assert!(passed > 100, "{passed} surfaces");
}

/// Returns a lens of graded glass between a conic and a sphere, with a stop inside, followed by a
/// cylinder and a plane.
fn train() -> ([SequenceElement; 5], [Field; 5]) {
    let cube = Aabb::new(DVec3::splat(-1.5), DVec3::splat(1.5));
    let waves = |x: DVec3| 1.5 + 0.03 * (2.0 * x.x + x.y).sin() * (1.5 * x.z - 0.5 * x.y).cos();
    let grid = Bspline::from_fn([9, 8, 10], cube, Placement::Nodes, waves).unwrap();
    let bump = Gaussian::new(1.1, 0.1, DVec3::new(0.1, 0.05, 0.9), 0.4).unwrap();
    let slope = LinearSquare::new(1.3, DVec3::new(0.05, -0.1, 0.08), DVec3::ZERO).unwrap();
    let tilted = |x: f64, y: f64| DVec3::new(x, y, 1.0).normalize();
    let curvature = 0.6;
    let elements = [
        SequenceElement::Refracting(Quadric {
            point: DVec3::new(0.02, 0.0, -0.6),
            axis: tilted(0.05, -0.02),
            form: [curvature, -0.8 * curvature, -2.0, 0.0],
            departure: [0.1, -0.2, 0.3, 0.0, 0.0, 0.0, 0.0, 0.1],
        }),
        SequenceElement::Aperture(Quadric::plane(DVec3::Z * -0.1, tilted(0.0, 0.1)), 0.6),
        SequenceElement::Refracting(Quadric {
            point: DVec3::new(0.0, 0.05, -1.0),
            axis: DVec3::Z,
            form: [1.0, 0.0, 0.0, -1.4 * 1.4],
            departure: [0.0; DEPARTURES],
        }),
        SequenceElement::Refracting(Quadric {
            point: DVec3::new(0.05, 0.0, 1.9),
            axis: DVec3::new(0.1, 1.0, 0.05).normalize(),
            form: [1.0, -1.0, 0.0, -1.0],
            departure: [0.0; DEPARTURES],
        }),
        SequenceElement::Refracting(Quadric::plane(DVec3::Z * 1.3, tilted(0.1, 0.05))),
    ];
    let media = [
        slope.into(),
        grid.into(),
        bump.into(),
        Constant::new(1.4).into(),
        Constant::new(1.0).into(),
    ];
    (elements, media)
}

#[test]
fn sequences_are_transposed_too() {
    let (elements, media) = train();
    let layout = Layout::Sequence(Sequence::new(&elements, &media).unwrap());
    let receiver = Receiver::Plane {
        point: DVec3::Z * 2.0,
        normal: DVec3::new(0.1, 0.05, 1.0).normalize(),
    };
    let mut rng = Rng::new(12);
    let mut ray = AdjointRay::new(&layout, receiver, Tolerance::default(), 20.0);
    for _ in 0..20 {
        let vector = |rng: &mut Rng| DVec3::from_array(rng.direction());
        let direction = (DVec3::Z + 0.1 * vector(&mut rng)).normalize();
        let start = RayStart {
            x: DVec3::Z * -1.3 + 0.2 * vector(&mut rng),
            direction,
            region: 0,
        };
        ray.follow_through(start).unwrap();
        let tilt = vector(&mut rng);
        let begin = StartChange {
            x: vector(&mut rng),
            direction: tilt - direction * direction.dot(tilt),
        };
        let mut change = LayoutChange::new(&layout, receiver);
        let media = change.media.iter_mut().flatten();
        let rest = change.surfaces.iter_mut().flatten().chain(&mut change.exit);
        media.chain(rest).for_each(|v| *v = rng.range(-0.1, 0.1));
        let loss = EndDerivative {
            x: vector(&mut rng),
            v: vector(&mut rng),
            optical_length: rng.range(-1.0, 1.0),
        };
        let mut sums = LayoutDerivative::new(&layout, receiver);
        let back = ray.pull_back(&loss, &mut sums).unwrap();
        let end = ray.push_forward(&begin, &change).unwrap();
        let terms = [
            loss.x.dot(end.x),
            loss.v.dot(end.v),
            loss.optical_length * end.optical_length,
        ];
        let pairs = [
            (sums.media.concat(), change.media.concat()),
            (
                sums.surfaces.as_flattened().to_vec(),
                change.surfaces.as_flattened().to_vec(),
            ),
            (sums.exit.to_vec(), change.exit.to_vec()),
        ];
        let others: f64 = pairs.iter().map(|(a, b)| dot(a, b)).sum();
        let reverse = back.x.dot(begin.x) + back.direction.dot(begin.direction) + others;
        let size: f64 = terms.iter().map(|term| term.abs()).sum();
        let error = (terms.iter().sum::<f64>() - reverse).abs() / size;
        assert!(error < 1e-12, "{error:e}");
    }
}
