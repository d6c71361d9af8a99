//! Derivatives of rays through surfaces, and with respect to the surfaces.

use super::*;
use crate::interface::world::{Surface, TwoRegions};
use morgana_eikonal::field::{Constant, LinearIndex};
use morgana_eikonal::interface::Rule;

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
            let mut ray = AdjointRay::new(&here, receiver, Tolerance::new(TIGHT_TOLERANCE), 10.0);
            ray.follow(start(&begin, 1)).unwrap();
            let mut sum = ParameterDerivative::new(0, &here.fields[0]);
            let back = ray.pull_back(&LOSS, &mut sum).unwrap();
            for i in 0..p.len() {
                let of = |p: &[f64]| {
                    loss(&follow(
                        &world(p),
                        receiver,
                        TIGHT_TOLERANCE,
                        start(&begin, 1),
                    ))
                };
                let expected = derivative(&p, i, 1e-3, of);
                let error = (sum.values[i] - expected).abs() / (0.1 + expected.abs());
                assert!(error < 1e-6, "{rule:?} {i}: {error:e}, {expected}");
            }
            let length = DVec3::from_slice(&begin[3..]).length();
            let found = [back.x, back.direction / length]
                .map(|d| d.to_array())
                .concat();
            for (i, found) in found.iter().enumerate() {
                let of = |b: &[f64]| loss(&follow(&here, receiver, TIGHT_TOLERANCE, start(b, 1)));
                let expected = derivative(&begin, i, 1e-3, of);
                let error = (found - expected).abs() / (0.1 + expected.abs());
                assert!(error < 1e-6, "{rule:?} start {i}: {error:e}, {expected}");
            }
        }
    }
}

/// Callback that receives a traced ray.
type Seen<'a> = dyn FnMut(&AdjointRay<Layout>, &Layout, Receiver, RayEnd) + 'a;

/// Tests a graded lens between an asphere and a sphere, with a stop in it, followed by a cylinder.
/// Derivatives are with respect to the numbers of all surfaces and media, the exit plane, and the
/// start of the ray.
#[test]
fn rays_through_sequences_of_surfaces() {
    let quadric = |p: &[f64]| Quadric {
        point: vector(p),
        axis: vector(&p[3..]).normalize(),
        form: p[6..10].try_into().unwrap(),
        departure: p[10..].try_into().unwrap_or_default(),
    };
    let conic = [0.02, 0.0, -0.6, 0.05, -0.02, 1.0, 0.6, -0.5, -2.0, 0.0];
    let departure = [0.3, -2.0, 9.0, -40.0, 200.0, -900.0, 4e3, 1e4];
    let sphere = [0.0, 0.05, -1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, -1.96];
    let cylinder = [0.05, 0.0, 1.9, 0.1, 1.0, 0.05, 1.0, -1.0, 0.0, -1.0];
    let exit = [0.1, -0.1, 1.6, 0.1, 0.05, 1.0];
    let media = [
        vec![1.2],
        vec![1.5, 0.08, 0.1, -0.1, 0.05, 0.6],
        vec![1.1],
        vec![1.4],
    ];
    // Make axes unit vectors, because derivatives are with respect to unit axes.
    let unit = |p: &[f64], at: usize| {
        let mut p = p.to_vec();
        let axis = vector(&p[at..]).normalize().to_array();
        p[at..at + 3].copy_from_slice(&axis);
        p
    };
    let surfaces = [
        unit(&conic, 3),
        departure.to_vec(),
        unit(&sphere, 3),
        unit(&cylinder, 3),
    ];
    let surfaces = surfaces.concat();
    let parameters = [surfaces, unit(&exit, 3), media.concat()].concat();
    let begin = [0.15, 0.1, -1.3, 0.05, 0.03, 1.0];
    let run = |p: &[f64], begin: &[f64], then: &mut Seen| {
        let stop = Quadric::plane(DVec3::Z * -0.1, DVec3::Z);
        let elements = [
            SequenceElement::Refracting(quadric(&p[..18])),
            SequenceElement::Aperture(stop, 0.6),
            SequenceElement::Refracting(quadric(&p[18..28])),
            SequenceElement::Refracting(quadric(&p[28..38])),
        ];
        let constant = |n: f64| Field::from(Constant::new(n));
        let media = [
            constant(p[44]),
            gaussian(&p[45..51]),
            constant(p[51]),
            constant(p[52]),
        ];
        let layout = Layout::Sequence(Sequence::new(&elements, &media).unwrap());
        let receiver = Receiver::Plane {
            point: vector(&p[38..]),
            normal: vector(&p[41..]).normalize(),
        };
        let mut ray = AdjointRay::new(&layout, receiver, Tolerance::new(TIGHT_TOLERANCE), 10.0);
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
        // The stop is not a parameter.
        let refracting = [(0, 18), (2, 10), (3, 10)].map(|(i, n)| &sums.surfaces[i][..n]);
        let refracting = refracting.concat();
        by_parameters = [refracting, sums.exit.to_vec(), sums.media.concat()].concat();
        let length = vector(&begin[3..]).length();
        by_start = [back.x, back.direction / length]
            .map(|v| v.to_array())
            .concat();
    });
    for (i, found) in by_parameters.iter().enumerate() {
        // Skip γ, of which any value except zero would choose a sheet, and δ of the asphere.
        if [9, 26, 36].contains(&i) {
            continue;
        }
        let expected = derivative(&parameters, i, 1e-3, |p| value(p, &begin));
        // A change along a unit vector has no effect; remove it from the derivative.
        let along = [3, 21, 31, 41]
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

/// A ball of radius R and index n focuses paraxial light from infinity at the distance nR/2(n − 1)
/// from its centre. The test compares the derivatives of this distance by R, n and the index
/// outside (as n/n₀) with derivatives of one ray close to the axis, to second order in its height.
#[test]
fn focus_of_a_ball_lens() {
    let (radius, n, height) = (1.3, 1.6, 1e-4);
    let ball = Quadric {
        point: DVec3::ZERO,
        axis: DVec3::Z,
        form: [1.0, 0.0, 0.0, -radius * radius],
        departure: [0.0; DEPARTURES],
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
    // The ray meets the axis where x = 0, so the focus moves by −δx/x′.
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
