//! Vertex connection and merging (VCM), compared with bidirectional path tracing: where both find
//! the light, and where only merging does.

use crate::common::{container, fog, mean, parts, shoot_by, vacuum};
use crate::photons::FAMILY;
use crate::photons::support::{bdpt, in_glass, matched, white_ball};
use eikonal::field::{Constant, LinearIndex};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::Spectrum;
use morgana_transport::bsdf::{Bsdf, Conductor, Diffuse, Mask};
use morgana_transport::emitter::{Emitter, Spot};
use morgana_transport::film::Decomposition;
use morgana_transport::integrator::{Bdpt, Connections, Heuristic, Integrator, Vcm};
use morgana_transport::path::Workspace;
use morgana_transport::render::{RenderOptions, Rendering, render};
use morgana_transport::sampling::Sampler;
use morgana_transport::scene::{Object, Parts};
use morgana_transport::sensor::{Orthographic, Sensor};
use morgana_transport::shape::{Cube, Rectangle, Shape};
use morgana_transport::{Film, Scene};
use rayon::ThreadPoolBuilder;
use std::ops::ControlFlow;
use testkit::z_test::{max_abs_z, two_sample_z};

fn vcm(radius: f64) -> Vcm {
    Vcm {
        radius: Some(radius),
        ..Vcm::default()
    }
}

/// A scene with a film of 32 × 32 pixels, and thus as many light subpaths.
fn larger(make: fn() -> Parts) -> Parts {
    let mut parts = make();
    (parts.film.width, parts.film.height) = (32, 32);
    parts
}

fn debiased(rendering: &Rendering) -> (f64, f64) {
    assert_eq!(rendering.stats.not_finite, 0);
    rendering.debiased.as_ref().unwrap().film.summary()
}

/// A box of fog between half-open white walls, lit by a panel. Hits, next events, connections and
/// mergings on surfaces and in a medium all find its light.
fn room() -> Parts {
    let white = || Bsdf::Diffuse(Diffuse::new(Spectrum::splat(0.7)).unwrap());
    let wall = |matrix3: DMat3, translation: DVec3, bsdf: Bsdf| Object {
        name: "wall".into(),
        shape: Shape::from(
            Rectangle::new(DAffine3 {
                matrix3,
                translation,
            })
            .unwrap(),
        ),
        bsdf,
        sides: None,
        emitter: None,
    };
    let up = DMat3::IDENTITY * 1.2;
    let aside = DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X) * 1.2;
    let masked = Bsdf::Mask(Mask::new(Spectrum::splat(0.5), white()).unwrap());
    let mut panel = wall(
        DMat3::from_cols(DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z) * 0.4,
        DVec3::Z * 1.3,
        white(),
    );
    panel.emitter = Some(0);
    let objects = vec![
        container(
            Cube::new(DAffine3::from_scale(DVec3::splat(1.0))).unwrap(),
            Bsdf::Null,
        ),
        wall(up, DVec3::Z * -1.1, white()),
        wall(aside, DVec3::X * -1.1, masked),
        panel,
    ];
    let index = LinearIndex::new(1.2, DVec3::X * 0.1, DVec3::ZERO).unwrap();
    parts(
        objects,
        vec![vacuum(), fog(index, 0.7, 0.9, 0.4)],
        vec![Emitter::Area {
            object: 3,
            radiance: Spectrum::splat(2.0),
        }],
        crate::photons::support::view(0.6),
    )
}

/// Means agree. Their errors are 1 to 4 %. Radii are so large that the blur shows; its bias is
/// subtracted.
#[test]
fn merging_shows_what_connections_show() {
    type Make = fn() -> Parts;
    let mut zs = Vec::new();
    let scenes: [(&str, Make, f64); 4] = [
        ("matched", matched, 0.15),
        ("in glass", in_glass, 0.15),
        ("white ball", white_ball, 0.1),
        ("room", room, 0.1),
    ];
    for (i, (name, make, radius)) in scenes.into_iter().enumerate() {
        let (a, se_a) = mean(&shoot_by(bdpt(), larger(make), 24, 1));
        for (heuristic, connections) in [
            (Heuristic::Balance, Connections::Resampled),
            (Heuristic::Power, Connections::All),
        ] {
            let estimator = Vcm {
                heuristic,
                connections,
                ..vcm(radius)
            };
            let (b, se_b) = debiased(&shoot_by(estimator, larger(make), 12, 2 + i as u64));
            println!("{name} {heuristic:?}: bdpt {a} ± {se_a}, vcm {b} ± {se_b}");
            assert!(se_a < 0.02 * a && se_b < 0.04 * a, "no power");
            zs.push(two_sample_z(a, se_a, b, se_b));
        }
    }
    max_abs_z(&zs, FAMILY).unwrap();
}

/// A spot lights a floor, or black ground under fog, and a sensor sees it, each by way of a mirror;
/// or the scene is unfolded, without mirrors. The index grows upwards everywhere, so that rays are
/// curved, and mirrors at x = ±2 map rays to rays.
fn ground(is_foggy: bool, through_mirrors: bool) -> Parts {
    let (light, toward) = (DVec3::new(-3.0, 0.0, 1.5), DVec3::new(3.0, 0.0, -1.4));
    let (eye, ahead) = (DVec3::new(3.0, 0.0, 1.2), DVec3::new(-3.0, 0.0, -1.1));
    let reflectance = if is_foggy { 0.0 } else { 0.8 };
    let white = Bsdf::Diffuse(Diffuse::new(Spectrum::splat(reflectance)).unwrap());
    let metal = || {
        let mirror = Conductor::new(Spectrum::ZERO, Spectrum::ONE, Spectrum::ONE);
        Bsdf::Conductor(mirror.unwrap())
    };
    let rectangle = |matrix3: DMat3, translation: DVec3, bsdf: Bsdf| Object {
        name: "part".into(),
        shape: Rectangle::new(DAffine3 {
            matrix3,
            translation,
        })
        .unwrap()
        .into(),
        bsdf,
        sides: None,
        emitter: None,
    };
    let mut objects = vec![
        container(
            Cube::new(DAffine3::from_scale(DVec3::splat(5.0))).unwrap(),
            Bsdf::Null,
        ),
        rectangle(DMat3::IDENTITY, DVec3::ZERO, white),
    ];
    // Reflect at a mirror at x = c: x → 2c − x.
    let fold = |x: DVec3, c: f64| {
        if through_mirrors {
            DVec3::new(2.0 * c - x.x, x.y, x.z)
        } else {
            x
        }
    };
    let turn = |d: DVec3| {
        if through_mirrors {
            DVec3::new(-d.x, d.y, d.z)
        } else {
            d
        }
    };
    if through_mirrors {
        let facing = |side: f64| DMat3::from_cols(DVec3::Y, DVec3::Z * side, DVec3::X * side) * 2.5;
        objects.push(rectangle(facing(1.0), DVec3::X * -2.0, metal()));
        objects.push(rectangle(facing(-1.0), DVec3::X * 2.0, metal()));
    }
    let spot = Spot::new(
        fold(light, -2.0),
        turn(toward),
        Spectrum::splat(10.0),
        0.2,
        0.1,
    );
    let ahead = turn(ahead).normalize();
    let basis = DMat3::from_cols(DVec3::Y, ahead.cross(DVec3::Y), ahead);
    let sensor = Sensor::Orthographic(Orthographic::new(
        DAffine3 {
            matrix3: DMat3::from_cols(basis.x_axis * 0.3, basis.y_axis * 0.3, basis.z_axis),
            translation: fold(eye, 2.0),
        },
        1.0,
    ));
    let index = LinearIndex::new(1.2, DVec3::Z * 0.03, DVec3::ZERO).unwrap();
    parts(
        objects,
        vec![
            vacuum(),
            fog(index, if is_foggy { 0.6 } else { 0.0 }, 0.9, 0.2),
        ],
        vec![Emitter::Spot(spot)],
        sensor,
    )
}

/// No connection finds light that mirrors reflect on every part of its path; merging does.
#[test]
fn merging_shows_what_no_connection_finds() {
    let folded = || larger(|| ground(false, true));
    let unfolded = || larger(|| ground(false, false));
    let (a, se_a) = mean(&shoot_by(bdpt(), unfolded(), 16, 1));
    let missing = shoot_by(bdpt(), folded(), 4, 2);
    assert_eq!(missing.film.summary().0, 0.0);
    // Two edges, and two mirrors.
    let estimator = Vcm {
        max_depth: Some(4),
        ..vcm(0.05)
    };
    let (b, se_b) = debiased(&shoot_by(estimator, folded(), 32, 3));
    println!("unfolded {a} ± {se_a}, by mirrors {b} ± {se_b}");
    assert!(se_a < 0.01 * a && se_b < 0.02 * a, "no power");
    max_abs_z(&[two_sample_z(a, se_a, b, se_b)], FAMILY).unwrap();
}

/// Merging also finds such light in fog that scatters once. Light that scatters twice, with a
/// mirror in front of the sensor only, has equal length, and connections find it.
#[test]
fn merging_in_fog_shows_what_no_connection_finds() {
    let folded = || larger(|| ground(true, true));
    let unfolded = || larger(|| ground(true, false));
    let connecting = |max_depth| Bdpt {
        max_depth: Some(max_depth),
        ..Bdpt::default()
    };
    let (a, se_a) = mean(&shoot_by(connecting(2), unfolded(), 32, 9));
    let (rest, se_rest) = mean(&shoot_by(connecting(4), folded(), 32, 10));
    let estimator = Vcm {
        max_depth: Some(4),
        ..vcm(0.15)
    };
    let (b, se_b) = debiased(&shoot_by(estimator, folded(), 160, 11));
    let (b, se_b) = (b - rest, se_b.hypot(se_rest));
    println!("unfolded {a} ± {se_a}, by mirrors {b} ± {se_b}, without {rest}");
    assert!(se_a < 0.02 * a && se_b < 0.06 * a, "no power");
    max_abs_z(&[two_sample_z(a, se_a, b, se_b)], FAMILY).unwrap();
}

/// The mean of blurred light approaches the mean without blur as radii shrink.
#[test]
fn bias_goes_with_the_radius() {
    let folded = || larger(|| ground(false, true));
    let bias = |samples| {
        let rendering = shoot_by(vcm(0.2), folded(), samples, 4);
        let debiased = rendering.debiased.as_ref().unwrap();
        debiased.bias(&rendering.film) / rendering.film.summary().0
    };
    let [few, many] = [4, 64].map(bias);
    println!("bias after 4 samples {few}, after 64 {many}");
    // The mean bias falls as N^{−1/3}: by 0.4 from 4 to 64.
    assert!(few.abs() > 0.02, "no blur to be seen");
    assert!(many.abs() < 0.55 * few.abs());
}

/// Depths are counted as in other estimators: layers by bounces agree.
#[test]
fn bounces_are_told_apart() {
    let film = |integrator: Integrator, samples, seed| -> Film {
        let mut options = RenderOptions::new(integrator, samples, seed);
        options.decomposition = Decomposition {
            bounces: Some(2),
            ..Decomposition::default()
        };
        let scene = Scene::new(larger(matched)).unwrap();
        render(&[scene], &options, |_| ControlFlow::Continue(())).film
    };
    let a = film(bdpt(), 16, 5);
    let b = film(Integrator::Vcm(vcm(0.05)), 12, 6);
    let zs: Vec<f64> = (0..4)
        .map(|layer| {
            let ((a, se_a), (b, se_b)) = (a.layer_summary(layer), b.layer_summary(layer));
            println!("{layer}: bdpt {a} ± {se_a}, vcm {b} ± {se_b}");
            two_sample_z(a, se_a, b, se_b)
        })
        .collect();
    max_abs_z(&zs, FAMILY).unwrap();
}

/// A single sensor ray can be sampled on its own, with its own light subpaths.
#[test]
fn one_ray_sees_the_same() {
    let small = |make: fn() -> Parts| {
        let mut parts = make();
        (parts.film.width, parts.film.height) = (12, 12);
        parts
    };
    let (a, se_a) = mean(&shoot_by(bdpt(), small(matched), 200, 12));
    let scene = Scene::new(small(matched)).unwrap();
    let mut ws = Workspace::new(scene.tolerance());
    let (mut sum, mut squares) = (0.0, 0.0);
    let samples = 2000;
    for i in 0..samples {
        let mut sampler = Sampler::new(13, 0, i);
        let image = sampler.next_2d();
        let ray = scene.sensor().ray(image, [0.5; 2]);
        let mut found = Vec::new();
        let estimator = Integrator::Vcm(vcm(0.1));
        estimator.sample(&scene, ray, 1, &mut sampler, &mut ws, &mut found);
        // Leave out contributions beside the image.
        let inside = |x: &f64| (0.0..1.0).contains(x);
        let seen = found
            .iter()
            .filter(|c| c.image.iter().flatten().all(inside));
        let value: f64 = seen.map(|c| (c.value - c.bias)[0] * c.weight).sum();
        sum += value;
        squares += value * value;
    }
    let n = samples as f64;
    let b = sum / n;
    let se_b = ((squares / n - b * b) / (n - 1.0)).sqrt();
    println!("bdpt {a} ± {se_a}, vcm {b} ± {se_b}");
    assert!(se_a < 0.02 * a && se_b < 0.04 * a, "no power");
    max_abs_z(&[two_sample_z(a, se_a, b, se_b)], FAMILY).unwrap();
}

#[test]
fn merged_images_do_not_depend_on_threads() {
    let image = |threads| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build();
        let shot = || shoot_by(Vcm::default(), larger(in_glass), 3, 7);
        pool.unwrap().install(shot)
    };
    let one = image(1);
    assert!(one.stats.photons.in_media > 100 && one.first_radius > 0.0);
    for threads in [2, 5] {
        let several = image(threads);
        assert_eq!(one.film, several.film);
        assert_eq!(one.debiased, several.debiased);
        assert_eq!(one.stats, several.stats);
    }
}

/// In a white furnace everything is as bright as the walls, whichever technique finds it.
#[test]
fn a_furnace_stays_white() {
    let furnace = || {
        let walls = Cube::new(DAffine3::from_scale(DVec3::splat(0.9))).unwrap();
        let white = Object {
            name: "white".into(),
            shape: walls.into(),
            bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::ONE).unwrap()),
            sides: None,
            emitter: None,
        };
        let mut made = parts(
            vec![white],
            vec![fog(Constant::new(1.0), 0.0, 0.0, 0.0)],
            vec![crate::common::sky()],
            crate::photons::support::view(0.6),
        );
        (made.film.width, made.film.height) = (32, 32);
        made
    };
    let (b, se_b) = debiased(&shoot_by(vcm(0.1), furnace(), 16, 8));
    println!("{b} ± {se_b}");
    assert!(se_b < 0.01);
    max_abs_z(&[(b - 1.0) / se_b], FAMILY).unwrap();
}
