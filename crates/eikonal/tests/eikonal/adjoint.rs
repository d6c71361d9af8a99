//! Derivatives of rays against differences of rays and closed forms (docs/theory.md#derivatives-of-rays).

use crate::common::{Random, ripples};

use crate::interface::world::{Surface, TwoRegions};
use glam::{DAffine3, DVec3};
use morgana_eikonal::adjoint::*;
use morgana_eikonal::connect::{Unbounded, World};
use morgana_eikonal::field::*;
use morgana_eikonal::interface::Rule;
use morgana_eikonal::{Aabb, Field, Tolerance};

const TIGHT: f64 = 1e-10;

fn gaussian(p: &[f64]) -> Field {
    let center = DVec3::new(p[2], p[3], p[4]);
    Gaussian::new(p[0], p[1], center, p[5]).unwrap().into()
}

fn vector(p: &[f64]) -> DVec3 {
    DVec3::from_slice(&p[..3])
}

fn selfoc(p: &[f64]) -> Field {
    Selfoc::new(p[0], p[1], vector(&p[2..]), vector(&p[5..]))
        .unwrap()
        .into()
}

/// A field under the map to the world of which the rows follow its own `count` parameters.
fn moved(p: &[f64], count: usize, field: fn(&[f64]) -> Field) -> Field {
    let (own, map) = p.split_at(count);
    let column = |i: usize| DVec3::new(map[i], map[4 + i], map[8 + i]);
    let map = DAffine3::from_cols(column(0), column(1), column(2), column(3));
    Affine::new(field(own), map).unwrap().into()
}

fn moved_sum(p: &[f64]) -> Field {
    let (first, second) = (moved(&p[1..19], 6, gaussian), selfoc(&p[19..27]));
    let scaled = Scaled::new(second, p[27]).unwrap();
    Sum::new(p[0], vec![first, scaled.into()]).unwrap().into()
}

fn acoustic(p: &[f64]) -> Field {
    let modes = p[10..].chunks(4).zip([0, 3]).map(|(mode, order)| {
        let [amplitude, k, phase, time_phase] = mode.try_into().unwrap();
        let mode = AcousticMode::new(amplitude, order, k, phase).unwrap();
        mode.with_time_phase(time_phase).unwrap()
    });
    let [origin, direction, reference] = [1, 4, 7].map(|at| vector(&p[at..]));
    Acoustic::new(p[0], origin, direction, reference, modes.collect())
        .unwrap()
        .into()
}

fn formula(text: &str, names: &[&str], p: &[f64]) -> Field {
    let parameters: Vec<(&str, f64)> = names.iter().copied().zip(p.iter().copied()).collect();
    Formula::new(text, Quantity::Index, &parameters)
        .unwrap()
        .into()
}

fn table(coordinate: Coordinate, start: f64, p: &[f64]) -> Field {
    let samples: Vec<[f64; 2]> = (0..)
        .map(|i| start + 0.35 * f64::from(i))
        .zip(p)
        .map(|(u, n)| [u, *n])
        .collect();
    IndexProfile::table(coordinate, 0.0, &samples)
        .unwrap()
        .into()
}

/// Fields by their parameters.
#[allow(clippy::type_complexity)]
fn families() -> Vec<(&'static str, Vec<f64>, fn(&[f64]) -> Field)> {
    let unit = DVec3::new(0.1, 0.05, 1.0).normalize();
    let across = DVec3::X.reject_from_normalized(unit).normalize();
    let [unit, across] = [unit, across].map(|v| v.to_array().to_vec());
    let bump = vec![1.3, 0.08, 0.1, -0.1, 0.05, 0.6];
    let rod = [vec![1.5, 0.4, 0.05, -0.02, 0.1], unit.clone()].concat();
    let map = [
        1.1, 0.2, 0.1, 0.05, -0.15, 0.9, 0.1, -0.04, 0.05, -0.1, 1.2, 0.02,
    ]
    .to_vec();
    let sum = [
        vec![1.35],
        bump.clone(),
        map.clone(),
        rod.clone(),
        vec![1.1],
    ]
    .concat();
    let modes = vec![0.03, 4.0, 0.4, 0.7, 0.02, 5.0, 1.1, -0.4];
    let standing = [vec![1.33, 0.03, 0.02, 0.0], unit, across, modes].concat();
    let profile = vec![1.5, 1.49, 1.46, 1.42, 1.4, 1.35, 1.33, 1.32];
    vec![
        ("constant", vec![1.3], |p| Constant::new(p[0]).into()),
        ("linear", vec![1.3, 0.1, -0.05, 0.08, 0.1, 0.2, -0.1], |p| {
            LinearIndex::new(p[0], vector(&p[1..]), vector(&p[4..]))
                .unwrap()
                .into()
        }),
        (
            "linear square",
            vec![1.3, 0.1, -0.05, 0.08, 0.1, 0.2, -0.1],
            |p| {
                LinearSquare::new(p[0], vector(&p[1..]), vector(&p[4..]))
                    .unwrap()
                    .into()
            },
        ),
        ("luneburg", vec![1.1, 0.1, 0.05, -0.1, 1.6], |p| {
            Luneburg::new(p[0], vector(&p[1..]), p[4]).unwrap().into()
        }),
        ("selfoc", rod, selfoc),
        ("fisheye", vec![1.9, 0.1, 0.05, -0.1, 1.6], |p| {
            Fisheye::new(p[0], vector(&p[1..]), p[4]).unwrap().into()
        }),
        ("gaussian", bump.clone(), gaussian),
        ("acoustic", standing, acoustic),
        ("expression", vec![1.3, 0.1, 0.7, 0.4], |p| {
            let text = "n0 + a*exp(-(x^2 + y^2)/w^2)*cos(k*z)";
            formula(text, &["n0", "a", "w", "k"], p)
        }),
        ("powers", vec![1.4, 0.1, 2.0, 3.0, 0.004], |p| {
            let text = "n0 - a*rho^g + b*pow(2 + x - y, m)";
            formula(text, &["n0", "a", "g", "m", "b"], p)
        }),
        ("formula of a distance", vec![1.5, 0.3, 2.5], |p| {
            formula("n0 - a*r^g", &["n0", "a", "g"], p)
        }),
        ("formula of a height", vec![1.4, 0.1], |p| {
            formula("n0 + a*tanh(z)", &["n0", "a"], p)
        }),
        ("table of a distance", profile.clone(), |p| {
            table(Coordinate::R, 0.0, p)
        }),
        ("table of a height", profile, |p| {
            table(Coordinate::Z, -1.3, p)
        }),
        ("moved", [bump, map].concat(), |p| moved(p, 6, gaussian)),
        ("sum of moved and scaled", sum, moved_sum),
    ]
}

/// d/dp by a central difference, extrapolated once.
fn derivative(p: &[f64], i: usize, h: f64, f: impl Fn(&[f64]) -> f64) -> f64 {
    let at = |step: f64| {
        let mut q = p.to_vec();
        q[i] += step;
        f(&q)
    };
    let central = |h: f64| (at(h) - at(-h)) / (2.0 * h);
    (4.0 * central(h / 2.0) - central(h)) / 3.0
}

#[test]
fn fields_by_their_parameters() {
    let by = IndexDerivative {
        n2: 0.7,
        gradient: DVec3::new(0.3, -0.5, 0.2),
    };
    let mut random = Random(3);
    let region = Aabb::new(DVec3::splat(-0.7), DVec3::splat(0.7));
    for (name, p, field) in families() {
        let known = field(&p).parameters();
        let values: Vec<f64> = known
            .iter()
            .flat_map(|known| known.values.clone())
            .collect();
        assert_eq!(values.len(), field(&p).parameter_count());
        let same =
            values.len() == p.len() && values.iter().zip(&p).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(same, "{name}: {values:?} {p:?}");
        for _ in 0..20 {
            let x = random.point(&region);
            let value = |p: &[f64]| {
                let (n2, gradient) = field(p).gradient(x);
                by.n2 * n2 + by.gradient.dot(gradient)
            };
            let here = field(&p);
            let mut sums = vec![0.0; here.sum_count()];
            here.add_parameter_derivative(x, by, &mut sums);
            // Forward mode is the transpose.
            let change: Vec<f64> = p.iter().map(|_| random.between(-1.0, 1.0)).collect();
            let of = here.index_change(x, &here.parameter_change(&change));
            let found = here.parameter_derivative(sums);
            let terms = found.iter().zip(&change).map(|(by, of)| by * of);
            let (reverse, size): (f64, f64) =
                terms.fold((0.0, 0.0), |(sum, size), v| (sum + v, size + v.abs()));
            let error = (by.n2 * of.n2 + by.gradient.dot(of.gradient) - reverse).abs();
            assert!(error < 1e-12 * size, "{name}: {error:e}");
            for (i, found) in found.iter().enumerate() {
                let expected = derivative(&p, i, 1e-3, value);
                let error = (found - expected).abs();
                assert!(
                    error < 1e-8 * (1.0 + expected.abs()),
                    "{name} {i}: {error:e}"
                );
            }
        }
    }
}

/// Whole powers of negative numbers keep their values when the exponent is a number by which derivatives are.
#[test]
fn powers_of_negative_numbers() {
    let field = formula("1.5 + 0.1*x^m", &["m"], &[3.0]);
    let x = DVec3::new(-0.5, 0.1, 0.2);
    let (n2, _) = field.gradient(x);
    let n: f64 = 1.5 - 0.1 * 0.125;
    assert!((n2 - n * n).abs() < 1e-14);
    let change = field.index_change(x, &[1.0]).n2;
    let expected = 2.0 * n * 0.1 * -0.125 * 0.5_f64.ln();
    assert!((change - expected).abs() < 1e-14, "{change} {expected}");
}

const PLANE: Receiver = Receiver::Plane {
    point: DVec3::new(0.0, 0.0, 1.2),
    normal: DVec3::Z,
};

/// Weights of a loss that is linear in where and how rays end.
const LOSS: EndDerivative = EndDerivative {
    x: DVec3::new(0.3, -0.8, 0.1),
    v: DVec3::new(-0.6, 0.4, 0.2),
    optical_length: 0.5,
};

fn loss(end: &RayEnd) -> f64 {
    LOSS.x.dot(end.x) + LOSS.v.dot(end.v) + LOSS.optical_length * end.optical_length
}

fn start<R>(p: &[f64], region: R) -> RayStart<R> {
    let [x, d] = [&p[..3], &p[3..]].map(DVec3::from_slice);
    RayStart {
        x,
        direction: d.normalize(),
        region,
    }
}

fn follow<W: World>(
    world: &W,
    receiver: Receiver,
    tolerance: f64,
    start: RayStart<W::Region>,
) -> RayEnd {
    let mut ray = AdjointRay::new(world, receiver, Tolerance::new(tolerance), 10.0);
    ray.follow(start).unwrap()
}

#[test]
fn rays_by_parameters_and_starts() {
    let begin = [0.15, 0.1, -1.2, 0.1, 0.05, 1.0];
    for (name, p, field) in families() {
        let index = field(&p);
        let world = Unbounded(&index);
        let mut ray = AdjointRay::new(&world, PLANE, Tolerance::new(TIGHT), 10.0);
        ray.follow(start(&begin, ())).unwrap();
        let mut sum = ParameterDerivative::new((), &index);
        let back = ray.pull_back(&LOSS, &mut sum).unwrap();
        let found = index.parameter_derivative(sum.values);
        // Third derivatives of tables jump at their samples: differences know less there.
        let limit = if name.starts_with("table") {
            1e-5
        } else {
            1e-6
        };
        for (i, found) in found.iter().enumerate() {
            let of = |p: &[f64]| {
                loss(&follow(
                    &Unbounded(&field(p)),
                    PLANE,
                    TIGHT,
                    start(&begin, ()),
                ))
            };
            let expected = derivative(&p, i, 2e-3, of);
            let error = (found - expected).abs() / (0.1 + expected.abs());
            assert!(error < limit, "{name} {i}: {error:e}, {expected}");
        }
        // begin[3..] is not of unit length: derivatives by it are those by the direction over its length.
        let length = DVec3::from_slice(&begin[3..]).length();
        let found = [back.x, back.direction / length]
            .map(|d| d.to_array())
            .concat();
        for (i, found) in found.iter().enumerate() {
            let expected = derivative(&begin, i, 1e-3, |b| {
                loss(&follow(&world, PLANE, TIGHT, start(b, ())))
            });
            let error = (found - expected).abs() / (0.1 + expected.abs());
            assert!(error < limit, "{name}, start {i}: {error:e}, {expected}");
        }
    }
}

#[test]
fn rays_through_balls_and_planes() {
    let begin = [0.1, -0.05, -0.8, 0.1, 0.15, 1.0];
    let tilted = DVec3::new(0.2, -0.3, -1.0).normalize();
    let surfaces = [
        Surface::Plane(DVec3::ZERO, tilted),
        Surface::Ball(DVec3::Z * 0.7, 0.8),
    ];
    let p = [1.5, 0.1, 0.1, 0.0, 0.6, 0.5];
    for surface in surfaces {
        for (rule, z) in [
            (Rule::Refract, 2.0),
            (Rule::Pass, 2.0),
            (Rule::Reflect, -1.5),
        ] {
            let receiver = Receiver::Plane {
                point: DVec3::Z * z,
                normal: DVec3::Z,
            };
            let world = |p: &[f64]| {
                let slope = DVec3::new(0.05, -0.1, 0.08);
                let around = LinearIndex::new(1.2, slope, DVec3::ZERO).unwrap().into();
                TwoRegions {
                    surface,
                    fields: [gaussian(p), around],
                    rule,
                }
            };
            let here = world(&p);
            let mut ray = AdjointRay::new(&here, receiver, Tolerance::new(TIGHT), 10.0);
            ray.follow(start(&begin, 1)).unwrap();
            let mut sum = ParameterDerivative::new(0, &here.fields[0]);
            let back = ray.pull_back(&LOSS, &mut sum).unwrap();
            for i in 0..p.len() {
                let of = |p: &[f64]| loss(&follow(&world(p), receiver, TIGHT, start(&begin, 1)));
                let expected = derivative(&p, i, 1e-3, of);
                let error = (sum.values[i] - expected).abs() / (0.1 + expected.abs());
                assert!(error < 1e-6, "{rule:?} {i}: {error:e}, {expected}");
            }
            let length = DVec3::from_slice(&begin[3..]).length();
            let found = [back.x, back.direction / length]
                .map(|d| d.to_array())
                .concat();
            for (i, found) in found.iter().enumerate() {
                let of = |b: &[f64]| loss(&follow(&here, receiver, TIGHT, start(b, 1)));
                let expected = derivative(&begin, i, 1e-3, of);
                let error = (found - expected).abs() / (0.1 + expected.abs());
                assert!(error < 1e-6, "{rule:?} start {i}: {error:e}, {expected}");
            }
        }
    }
}

/// What is done with a ray that has been followed.
type Seen<'a> = dyn FnMut(&AdjointRay<Layout>, &Layout, Receiver, RayEnd) + 'a;

/// A graded lens between a conic and a sphere, with a stop in it, and a cylinder: by the numbers of all surfaces and media, the exit, and the start.
#[test]
fn rays_through_sequences_of_surfaces() {
    let quadric = |p: &[f64]| Quadric {
        point: vector(p),
        axis: vector(&p[3..]).normalize(),
        form: p[6..10].try_into().unwrap(),
    };
    let conic = [0.02, 0.0, -0.6, 0.05, -0.02, 1.0, 0.6, -0.5, -2.0, 0.0];
    let sphere = [0.0, 0.05, -1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, -1.96];
    let cylinder = [0.05, 0.0, 1.9, 0.1, 1.0, 0.05, 1.0, -1.0, 0.0, -1.0];
    let exit = [0.1, -0.1, 1.6, 0.1, 0.05, 1.0];
    let media = [
        vec![1.2],
        vec![1.5, 0.08, 0.1, -0.1, 0.05, 0.6],
        vec![1.1],
        vec![1.4],
    ];
    // Axes are unit vectors at first: derivatives are by these.
    let unit = |p: &[f64], at: usize| {
        let mut p = p.to_vec();
        let axis = vector(&p[at..]).normalize().to_array();
        p[at..at + 3].copy_from_slice(&axis);
        p
    };
    let surfaces = [unit(&conic, 3), unit(&sphere, 3), unit(&cylinder, 3)].concat();
    let parameters = [surfaces, unit(&exit, 3), media.concat()].concat();
    let begin = [0.15, 0.1, -1.3, 0.05, 0.03, 1.0];
    let run = |p: &[f64], begin: &[f64], then: &mut Seen| {
        let stop = Quadric::plane(DVec3::Z * -0.1, DVec3::Z);
        let elements = [
            SequenceElement::Refracting(quadric(&p[..10])),
            SequenceElement::Aperture(stop, 0.6),
            SequenceElement::Refracting(quadric(&p[10..20])),
            SequenceElement::Refracting(quadric(&p[20..30])),
        ];
        let constant = |n: f64| Field::from(Constant::new(n));
        let media = [
            constant(p[36]),
            gaussian(&p[37..43]),
            constant(p[43]),
            constant(p[44]),
        ];
        let layout = Layout::Sequence(Sequence::new(&elements, &media).unwrap());
        let receiver = Receiver::Plane {
            point: vector(&p[30..]),
            normal: vector(&p[33..]).normalize(),
        };
        let mut ray = AdjointRay::new(&layout, receiver, Tolerance::new(TIGHT), 10.0);
        let end = ray.follow_through(start(begin, 0)).unwrap();
        then(&ray, &layout, receiver, end);
    };
    let value = |p: &[f64], begin: &[f64]| {
        let mut found = 0.0;
        run(p, begin, &mut |_, _, _, end| found = loss(&end));
        found
    };
    let (mut by_parameters, mut by_start) = (Vec::new(), Vec::new());
    run(&parameters, &begin, &mut |ray, layout, receiver, _| {
        let mut sums = LayoutDerivative::new(layout, receiver);
        let back = ray.pull_back(&LOSS, &mut sums).unwrap();
        // The stop is no parameter.
        let refracting = [0, 2, 3].map(|i| sums.surfaces[i]).concat();
        by_parameters = [refracting, sums.exit.to_vec(), sums.media.concat()].concat();
        let length = vector(&begin[3..]).length();
        by_start = [back.x, back.direction / length]
            .map(|v| v.to_array())
            .concat();
    });
    for (i, found) in by_parameters.iter().enumerate() {
        // Any γ but zero would choose a sheet.
        if [18, 28].contains(&i) {
            continue;
        }
        let expected = derivative(&parameters, i, 1e-3, |p| value(p, &begin));
        // Along a unit vector a change is none.
        let along = [3, 13, 23, 33]
            .into_iter()
            .find(|at| (*at..at + 3).contains(&i));
        let found = along.map_or(*found, |at| {
            let axis = vector(&parameters[at..]);
            (vector(&by_parameters[at..]).reject_from_normalized(axis))[i - at]
        });
        let error = (found - expected).abs() / (0.1 + expected.abs());
        assert!(error < 1e-6, "{i}: {error:e}, {expected}");
    }
    for (i, found) in by_start.iter().enumerate() {
        let expected = derivative(&begin, i, 1e-3, |begin| value(&parameters, begin));
        let error = (found - expected).abs() / (0.1 + expected.abs());
        assert!(error < 1e-6, "start {i}: {error:e}, {expected}");
    }
}

/// Through a ball of radius R and index n, paraxial light from infinity comes to a focus nR/2(n − 1) from the centre: with its derivatives by R,
/// n and the index outside (as n/n₀), from one ray close to the axis, to the square of its height.
#[test]
fn focus_of_a_ball_lens() {
    let (radius, n, height) = (1.3, 1.6, 1e-4);
    let ball = Quadric {
        point: DVec3::ZERO,
        axis: DVec3::Z,
        form: [1.0, 0.0, 0.0, -radius * radius],
    };
    let elements = [SequenceElement::Refracting(ball); 2];
    let media = [1.0, n, 1.0].map(|n| Field::from(Constant::new(n)));
    let layout = Layout::Sequence(Sequence::new(&elements, &media).unwrap());
    let focus = 0.5 * n * radius / (n - 1.0);
    let receiver = Receiver::Plane {
        point: DVec3::Z * focus,
        normal: DVec3::Z,
    };
    let mut ray = AdjointRay::new(&layout, receiver, Tolerance::default(), 20.0);
    let end = ray
        .follow_through(start(&[height, 0.0, -3.0, 0.0, 0.0, 1.0], 0))
        .unwrap();
    assert!(end.x.x.abs() < 10.0 * height.powi(3), "{}", end.x);
    // The ray meets the axis where x = 0: the focus moves by −δx/x′.
    let by = EndDerivative {
        x: DVec3::X,
        ..EndDerivative::default()
    };
    let mut sums = LayoutDerivative::new(&layout, receiver);
    ray.pull_back(&by, &mut sums).unwrap();
    let slope = end.v.x / end.v.z;
    let of_radius: f64 = sums.surfaces.iter().map(|by| -2.0 * radius * by[9]).sum();
    let outside = media
        .iter()
        .zip(&sums.media)
        .map(|(_, by)| by[0])
        .collect::<Vec<_>>();
    let of_index = 0.5 * radius * (1.0 / (n - 1.0) - n / (n - 1.0).powi(2));
    for (name, found, expected) in [
        ("radius", of_radius, focus / radius),
        ("index", outside[1], of_index),
        ("index around", outside[0] + outside[2], -n * of_index),
    ] {
        let found = -found / slope;
        assert!(
            (found / expected - 1.0).abs() < 1e-6,
            "{name}: {found} {expected}"
        );
    }
}

/// Steps that end on a face to round-off leave the box: rays at many angles, in a grid whose cells divide its edges.
#[test]
fn rays_leave_boxes_in_which_steps_end_on_faces() {
    let bump = |x: DVec3| {
        let width = 0.16 + 0.1 * (x.z + 1.0);
        let center = DVec3::new(0.12 * (4.0 * x.z + 0.5).sin(), 0.1 * (5.0 * x.z).cos(), x.z);
        let core = (-(x - center).length_squared() / (width * width)).exp();
        1.0 + 0.03 * core * (1.5 * (1.0 - x.z * x.z)).clamp(0.0, 1.0).powi(2)
    };
    let field: Field = Bspline::from_fn([36; 3], cube(), Placement::Nodes, bump)
        .unwrap()
        .into();
    let world = Embedded::new(&field, cube(), 1.0);
    let mut ray = AdjointRay::new(
        &world,
        Receiver::Leaving(cube()),
        Tolerance::new(1e-6),
        30.0,
    );
    for i in 0..16 * 24 * 24 {
        let angle = std::f64::consts::PI * f64::from(i / 576) / 16.0;
        let (along, side) = (
            DVec3::new(angle.cos(), angle.sin(), 0.0),
            DVec3::new(-angle.sin(), angle.cos(), 0.0),
        );
        let across = |k: i32| -0.95 + 1.9 * f64::from(k) / 23.0;
        let x = side * across(i % 24) + DVec3::Z * across(i / 24 % 24) - 2.0 * along;
        let start = RayStart {
            x,
            direction: along,
            region: false,
        };
        let end = ray
            .follow(start)
            .unwrap_or_else(|error| panic!("{x} {along}: {error}"));
        let outermost = end.x.abs().max_element();
        assert!((outermost - 1.0).abs() < 1e-9, "{x} {along}: {}", end.x);
    }
}

/// Why rays do not come through a sequence.
#[test]
fn rays_that_do_not_come_through() {
    let ball = Quadric {
        point: DVec3::ZERO,
        axis: DVec3::Z,
        form: [1.0, 0.0, 0.0, -1.0],
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
    // From within, beyond the critical angle.
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
    // A conic is the sheet at its vertex: the far side of this sphere, which bends away from the light, is none.
    let concave = Quadric {
        point: DVec3::ZERO,
        axis: DVec3::Z,
        form: [-1.0, 0.0, -2.0, 0.0],
    };
    let concave = [SequenceElement::Refracting(concave)];
    assert_eq!(follow(&concave, &glass[..2], along(0.5)), Ok(()));
    assert!(Sequence::new(&concave, &glass).is_none());
}

const DIMS: [usize; 3] = [9, 8, 10];

fn cube() -> Aabb {
    Aabb::new(DVec3::splat(-1.0), DVec3::ONE)
}

/// A function of position at the samples of the grid.
fn sampled(f: impl Fn(DVec3) -> f64) -> Vec<f64> {
    let mut samples = Vec::new();
    Bspline::from_fn(DIMS, cube(), Placement::Nodes, |x| {
        samples.push(f(x));
        1.0
    })
    .unwrap();
    // The first is asked for beforehand, as the reference.
    samples.remove(0);
    samples
}

/// Samples of n.
fn samples() -> Vec<f64> {
    sampled(ripples)
}

fn grid(samples: &[f64]) -> Bspline {
    Bspline::from_samples(DIMS, cube(), Placement::Nodes, samples).unwrap()
}

const BEGIN: [f64; 6] = [0.3, 0.2, -2.0, -0.1, 0.15, 1.0];
const BEHIND: Receiver = Receiver::Plane {
    point: DVec3::new(0.0, 0.0, 3.0),
    normal: DVec3::Z,
};

/// Derivatives by the samples, of a ray through the cube from outside.
fn by_samples(samples: &[f64], tolerance: f64) -> Vec<f64> {
    let bspline = grid(samples);
    let field = bspline.clone().into();
    let world = Embedded::new(&field, cube(), 1.3);
    let mut ray = AdjointRay::new(&world, BEHIND, Tolerance::new(tolerance), 10.0);
    ray.follow(start(&BEGIN, false)).unwrap();
    let mut sum = ParameterDerivative::new(true, &field);
    ray.pull_back(&LOSS, &mut sum).unwrap();
    let by_n2 = bspline.sample_derivative(sum.values);
    by_n2
        .iter()
        .zip(samples)
        .map(|(by, n)| by * 2.0 * n)
        .collect()
}

/// Coefficients are f32, whose rounding, 1e-9 of n², over steps of 2e-3 limits differences to 1e-6.
#[test]
fn rays_by_samples_of_a_grid() {
    let mut random = Random(5);
    let samples = samples();
    let found = by_samples(&samples, 1e-11);
    for _ in 0..5 {
        let direction: Vec<f64> = samples.iter().map(|_| random.between(-1.0, 1.0)).collect();
        let of = |p: &[f64]| {
            let moved: Vec<f64> = samples
                .iter()
                .zip(&direction)
                .map(|(n, d)| n + p[0] * d)
                .collect();
            let field = grid(&moved).into();
            let world = Embedded::new(&field, cube(), 1.3);
            loss(&follow(&world, BEHIND, 1e-11, start(&BEGIN, false)))
        };
        let expected = derivative(&[0.0], 0, 4e-3, of);
        let terms = found.iter().zip(&direction).map(|(by, d)| by * d);
        let error = (terms.sum::<f64>() - expected).abs() / norm(&found);
        assert!(error < 1e-5, "{error:e}");
    }
}

fn norm(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Step sizes depend on the field; their derivatives are left out. For changes of the index over lengths of many steps this
/// costs 3e-5 at most; how much falls to which of neighbouring samples is known to a few per cent, as steps take six looks at three cells.
#[test]
fn fixed_steps_cost_what_the_tolerance_allows() {
    let samples = samples();
    let smooth = sampled(|x| 0.1 * (1.5 * x.x - x.y + 0.7 * x.z).cos());
    let along = |by: &[f64]| by.iter().zip(&smooth).map(|(by, d)| by * d).sum::<f64>();
    let exact = by_samples(&samples, 1e-11);
    let limits = [
        (1e-8, 1e-6, 3e-3),
        (1e-7, 3e-6, 3e-3),
        (1e-6, 3e-5, 0.03),
        (1e-5, 3e-5, 0.1),
        (1e-4, 3e-5, 0.1),
    ];
    for (tolerance, limit, per_sample) in limits {
        let found = by_samples(&samples, tolerance);
        let difference: Vec<f64> = found.iter().zip(&exact).map(|(a, b)| a - b).collect();
        let error = along(&difference).abs() / along(&exact).abs();
        assert!(error < limit, "{tolerance:e}: {error:e}");
        let error = norm(&difference) / norm(&exact);
        assert!(error < per_sample, "{tolerance:e}: {error:e}");
    }
}

/// Derivatives of one component of a ray's end by the parameters of a field.
fn by_parameters(
    field: &Field,
    receiver: Receiver,
    start: RayStart<()>,
    loss: impl Fn(&RayEnd) -> EndDerivative,
) -> Vec<f64> {
    let world = Unbounded(field);
    let mut ray = AdjointRay::new(&world, receiver, Tolerance::new(TIGHT), 100.0);
    let end = ray.follow(start).unwrap();
    let mut sum = ParameterDerivative::new((), field);
    ray.pull_back(&loss(&end), &mut sum).unwrap();
    sum.values
}

/// A weak bump Δ exp(−r²/2w²) turns a ray at the distance b from its centre by −√(2π) Δ (b/w) exp(−b²/2w²), to first order in Δ.
#[test]
fn deflection_by_a_weak_gaussian() {
    let (b, w) = (0.4, 0.5);
    let field = gaussian(&[1.0, 1e-7, 0.0, 0.0, 0.0, w]);
    let start = RayStart {
        x: DVec3::new(b, 0.0, -10.0 * w),
        direction: DVec3::Z,
        region: (),
    };
    let receiver = Receiver::Plane {
        point: DVec3::Z * 10.0 * w,
        normal: DVec3::Z,
    };
    let along_x = |end: &RayEnd| EndDerivative::of_direction(DVec3::ZERO, DVec3::X, 0.0, end.v);
    let found = by_parameters(&field, receiver, start, along_x);
    let expected = -(2.0 * std::f64::consts::PI).sqrt() * b / w * (-0.5 * b * b / (w * w)).exp();
    assert!(
        (found[1] / expected - 1.0).abs() < 1e-6,
        "{} {expected}",
        found[1]
    );
    // By the optical length: ∫exp(−r²/2w²) ds. Steps are chosen for positions, to which a weak bump matters little.
    let length = |_: &RayEnd| EndDerivative {
        optical_length: 1.0,
        ..EndDerivative::default()
    };
    let found = by_parameters(&field, receiver, start, length);
    let expected = (2.0 * std::f64::consts::PI).sqrt() * w * (-0.5 * b * b / (w * w)).exp();
    assert!(
        (found[1] / expected - 1.0).abs() < 1e-5,
        "{} {expected}",
        found[1]
    );
}

/// A meridional ray that starts parallel to the axis of a graded rod, at x₀: x = x₀ cos gz with g = α/√(1 − α²x₀²).
#[test]
fn pitch_of_a_graded_rod() {
    let (alpha, x0, z) = (0.7, 0.3, 3.0);
    let field: Field = Selfoc::new(1.5, alpha, DVec3::ZERO, DVec3::Z)
        .unwrap()
        .into();
    let start = RayStart {
        x: DVec3::X * x0,
        direction: DVec3::Z,
        region: (),
    };
    let receiver = Receiver::Plane {
        point: DVec3::Z * z,
        normal: DVec3::Z,
    };
    let along_x = |_: &RayEnd| EndDerivative {
        x: DVec3::X,
        ..EndDerivative::default()
    };
    let found = by_parameters(&field, receiver, start, along_x);
    let root = (1.0 - alpha * alpha * x0 * x0).sqrt();
    let expected = -x0 * z * (alpha / root * z).sin() / root.powi(3);
    assert!(
        (found[1] / expected - 1.0).abs() < 1e-7,
        "{} {expected}",
        found[1]
    );
    // The index on the axis does not matter.
    assert!(found[0].abs() < 1e-9, "{}", found[0]);
}

/// What rays that have no end are told, and that they give no derivative.
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

/// Through a cube of one index the optical length is n times the length, and the derivatives by the samples add up to the length: they
/// are there although nothing bends the ray.
#[test]
fn uniform_grids_and_surroundings() {
    let n = 1.3;
    let bspline = grid(&sampled(|_| n));
    let field: Field = bspline.clone().into();
    let world = Embedded::new(&field, cube(), 1.0);
    let mut ray = AdjointRay::new(&world, BEHIND, Tolerance::default(), 10.0);
    let direction = DVec3::new(0.3, -0.2, 1.0).normalize();
    let begin = RayStart {
        x: -2.0 * direction,
        direction,
        region: false,
    };
    let end = ray.follow(begin).unwrap();
    let (inside, whole) = (2.0 / direction.z, 2.0 + 3.0 / direction.z);
    let expected = whole + (n - 1.0) * inside;
    assert!((end.optical_length - expected).abs() < 1e-10);
    assert!(end.x.distance(direction * (3.0 / direction.z)) < 1e-10);
    let mut sum = ParameterDerivative::new(true, &field);
    let length = EndDerivative {
        optical_length: 1.0,
        ..EndDerivative::default()
    };
    ray.pull_back(&length, &mut sum).unwrap();
    let by_n2 = bspline.sample_derivative(sum.values);
    let total: f64 = by_n2.iter().map(|by| 2.0 * n * by).sum();
    assert!((total / inside - 1.0).abs() < 1e-10, "{total} {inside}");
}
