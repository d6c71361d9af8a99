//! The n² furnace (docs/theory.md#radiance). If basic radiance is 1 all around, L = n² everywhere,
//! for any scattering and every estimator.
//!
//! Every test of the path tracer compares a mean with its exact value at |z| < 4.4; with 15
//! comparisons in this file, the family-wise false-alarm rate is 1.6e-4. Estimators with correlated
//! pixels are compared by batches, at a false-alarm rate of 1e-3 for all of them together.

use crate::common::{Batches, camera, container, fog, glass, mean, parts, shoot, sky, vacuum};
use eikonal::field::{Gaussian, LinearIndex, Luneburg};
use glam::DVec3;
use morgana_transport::bsdf::Bsdf;
use morgana_transport::shape::Sphere;

const Z: f64 = 4.4;

fn ball() -> Sphere {
    Sphere::around(DVec3::ZERO, 1.0).unwrap()
}

fn check(name: &str, rendering: morgana_transport::render::Rendering, exact: f64) {
    let (mean, error) = mean(&rendering);
    println!(
        "{name}: {mean} ± {error}, exact {exact}, {:?}",
        rendering.stats
    );
    // All paths end on the environment with weight one. Some furnaces have no variance at all, and
    // are exact to the tolerance of rays.
    let allowed = Z * error + 1e-6;
    assert!(
        (mean - exact).abs() < allowed,
        "{name}: {mean} ± {error}, expected {exact}"
    );
}

#[test]
fn luneburg_ball_of_fog() {
    let index = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
    for g in [0.0, 0.9] {
        let scene = |from| {
            let objects = vec![container(ball(), Bsdf::Null)];
            let media = vec![vacuum(), fog(index, 2.0, 1.0, g)];
            parts(objects, media, vec![sky()], camera(from, DVec3::ZERO))
        };
        check("from outside", shoot(scene(DVec3::Z * 3.0), 512, 1), 1.0);
        let inside = DVec3::new(0.2, 0.1, 0.3);
        check(
            "from inside",
            shoot(scene(inside), 512, 2),
            2.0 - inside.length_squared(),
        );
    }
}

#[test]
fn graded_ball_behind_a_dielectric_wall() {
    let index = LinearIndex::new(1.3, DVec3::Y * 0.15, -DVec3::Y).unwrap();
    let objects = vec![container(ball(), glass())];
    let media = vec![vacuum(), fog(index, 2.0, 1.0, 0.5)];
    let inside = DVec3::new(0.1, 0.5, 0.2);
    let n = 1.3 + 0.15 * 1.5;
    let scene = parts(objects, media, vec![sky()], camera(inside, DVec3::ZERO));
    check("from inside", shoot(scene.clone(), 512, 3), n * n);
    let outside = morgana_transport::scene::Parts {
        sensor: camera(DVec3::Z * 3.0, DVec3::ZERO),
        ..scene
    };
    check("from outside", shoot(outside, 512, 4), 1.0);
}

/// Behind a strong lens several rays connect most pairs, and connections find one of them.
/// Scattered paths must keep the others.
#[test]
fn strong_lens_in_fog() {
    let index = Gaussian::new(1.0, 0.6, DVec3::ZERO, 0.2).unwrap();
    let objects = vec![container(ball(), Bsdf::Null)];
    let media = vec![vacuum(), fog(index, 1.0, 1.0, 0.0)];
    let scene = parts(
        objects,
        media,
        vec![sky()],
        camera(DVec3::Z * 3.0, DVec3::ZERO),
    );
    check("from outside", shoot(scene, 2048, 7), 1.0);
}

#[test]
fn transparent_lens_behind_a_matched_boundary() {
    let index = Gaussian::new(1.0, 0.15, DVec3::ZERO, 0.25).unwrap();
    let objects = vec![container(ball(), Bsdf::Null)];
    let media = vec![vacuum(), fog(index, 0.0, 0.0, 0.0)];
    let scene = parts(objects, media, vec![sky()], camera(DVec3::ZERO, DVec3::X));
    // At the boundary the bump has fallen to 5e-5, not to zero. L, not L/n², is conserved across an
    // index jump that is declared absent.
    let wall = 1.0 + 0.15 * (-8.0f64).exp();
    check("from inside", shoot(scene, 64, 5), (1.15 / wall).powi(2));
}

/// Extinction differs between channels by a factor of 16. Distances are sampled for one channel at
/// a time, and the balance heuristic weighs them over all (docs/theory.md#free-flight).
#[test]
fn chromatic_extinction() {
    use morgana_transport::Spectrum;
    use morgana_transport::volume::VolumeTexture;
    let index = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
    let mut medium = fog(index, 1.0, 1.0, 0.3);
    medium.sigma_t = VolumeTexture::Uniform(Spectrum([0.5, 2.0, 8.0, 0.0]));
    let objects = vec![container(ball(), Bsdf::Null)];
    let mut scene = parts(
        objects,
        vec![vacuum(), medium],
        vec![sky()],
        camera(DVec3::Z * 3.0, DVec3::ZERO),
    );
    scene.film.channels = 3;
    let rendering = shoot(scene, 2048, 6);
    let pixels = || rendering.film.pixels(0);
    for channel in 0..3 {
        let n = pixels().len() as f64;
        let mean = pixels().map(|p| p.mean()[channel]).sum::<f64>() / n;
        let variance: f64 = pixels().map(|p| p.variance_of_mean()[channel]).sum();
        let error = variance.sqrt() / n;
        println!("channel {channel}: {mean} ± {error}");
        assert!(
            (mean - 1.0).abs() < Z * error,
            "channel {channel}: {mean} ± {error}"
        );
        assert!(error < 0.02);
    }
}

/// Tests emission and scattering across declared index jumps, with extended edges. A distant black
/// emitter makes equiangular distances be sampled around it, which must not change the mean.
#[test]
fn a_light_without_light_changes_nothing() {
    use morgana_transport::Spectrum;
    use morgana_transport::emitter::Emitter;
    let objects = vec![container(ball(), Bsdf::Null)];
    let index = eikonal::field::Constant::new(1.33);
    let media = vec![vacuum(), fog(index, 2.0, 1.0, 0.0)];
    let light = Emitter::Point {
        position: DVec3::new(5.0, 4.0, 3.0),
        intensity: Spectrum::ZERO,
    };
    let sensor = camera(DVec3::Z * 3.0, DVec3::ZERO);
    let scene = parts(objects, media, vec![sky(), light], sensor);
    check("from outside", shoot(scene, 512, 8), 1.0);
}

/// Loose rays cause no noticeable bias, because edges and connections match with the same
/// tolerance.
#[test]
fn loose_tolerance() {
    let index = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
    let objects = vec![container(ball(), Bsdf::Null)];
    let media = vec![vacuum(), fog(index, 2.0, 1.0, 0.0)];
    let mut scene = parts(
        objects,
        media,
        vec![sky()],
        camera(DVec3::Z * 3.0, DVec3::ZERO),
    );
    scene.tolerance = eikonal::Tolerance::new(1e-4);
    check("from outside", shoot(scene, 1024, 9), 1.0);
}

/// Layers touch: a ray that leaves one enters the next. Normals may point inwards.
#[test]
fn touching_layers_with_flipped_normals() {
    use glam::{DAffine3, DMat3};
    use morgana_transport::scene::{Object, Sides};
    use morgana_transport::shape::{Cube, Shape};
    let layer = |center: f64, interior: usize, flip: bool| {
        let to_world = DAffine3 {
            matrix3: DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.25)),
            translation: DVec3::Z * center,
        };
        Object {
            shape: Shape::from(Cube::new(to_world).unwrap()).with_flipped_normals(flip),
            sides: Some(Sides {
                interior,
                exterior: 0,
            }),
            ..container(ball(), glass())
        }
    };
    let objects = vec![layer(-0.25, 1, false), layer(0.25, 2, true)];
    let water = fog(eikonal::field::Constant::new(1.33), 1.0, 1.0, 0.0);
    let resin = fog(eikonal::field::Constant::new(1.5), 3.0, 1.0, 0.0);
    let inside = DVec3::new(0.1, 0.2, 0.3);
    let sensor = camera(inside, DVec3::ZERO);
    let scene = parts(objects, vec![vacuum(), water, resin], vec![sky()], sensor);
    check("inside", shoot(scene, 512, 10), 1.5 * 1.5);
}

/// Tests particles from the sky, and bidirectional path tracing, from outside and inside, behind a
/// declared matched wall or glass. Inside fog, a particle's connections to a pinhole contribute
/// 1/r² with infinite variance, so only bidirectional path tracing is compared there.
#[test]
fn bidirectional_estimators() {
    use morgana_transport::integrator::{Bdpt, Integrator, ParticleTracer};
    use testkit::Family;
    use testkit::batches::{moments, one_sample};
    let particle = Integrator::Particle(ParticleTracer::default());
    let bdpt = Integrator::Bdpt(Bdpt::default());
    let lens = Gaussian::new(1.0, 0.15, DVec3::ZERO, 0.25).unwrap();
    let ramp = LinearIndex::new(1.3, DVec3::Y * 0.15, DVec3::ZERO).unwrap();
    let outside = DVec3::new(0.2, 0.3, 3.0);
    let inside = DVec3::new(0.1, 0.5, 0.2);
    let n = 1.3 + 0.15 * 0.5;
    let mut family = Family::new(1e-3);
    let mut run = |name: &str,
                   by: Integrator,
                   (wall, index): (Bsdf, eikonal::Field),
                   from: DVec3,
                   exact: f64| {
        let media = vec![vacuum(), fog(index, 1.0, 1.0, 0.3)];
        let sensor = camera(from, DVec3::new(0.1, 0.0, -0.2));
        let mut scene = parts(vec![container(ball(), wall)], media, vec![sky()], sensor);
        scene.reflections = 2;
        let all = Batches::new(by, scene, 40);
        let batches: Vec<f64> = (0..12)
            .map(|batch| mean(&all.render(batch, 160)).0)
            .collect();
        let m = moments(&batches);
        println!(
            "{name}, {}: {} ± {}, exact {exact}",
            by.name(),
            m.mean(),
            m.standard_error()
        );
        assert!(m.standard_error() < 0.08 * exact);
        family.push(
            format!("{name}, {}", by.name()),
            one_sample(&batches, exact, 1e-6),
        );
    };
    for by in [particle, bdpt] {
        run(
            "matched, outside",
            by,
            (Bsdf::Null, lens.into()),
            outside,
            1.0,
        );
        run("glass, outside", by, (glass(), ramp.into()), outside, 1.0);
    }
    run(
        "matched, inside",
        bdpt,
        (Bsdf::Null, lens.into()),
        DVec3::ZERO,
        (1.15f64 / (1.0 + 0.15 * (-8.0f64).exp())).powi(2),
    );
    run("glass, inside", bdpt, (glass(), ramp.into()), inside, n * n);
    family.check().unwrap();
}

/// In a block of glass, much light is totally reflected more often than connections follow, or
/// partly reflected; only random walks find it.
#[test]
fn many_reflections_in_a_block_of_glass() {
    use morgana_transport::shape::Cube;
    let cube = Cube::new(glam::DAffine3::IDENTITY).unwrap();
    let media = vec![
        vacuum(),
        fog(eikonal::field::Constant::new(1.5), 0.3, 1.0, 0.0),
    ];
    let sensor = camera(DVec3::new(0.1, 0.2, 0.3), DVec3::NEG_X);
    let scene = parts(vec![container(cube, glass())], media, vec![sky()], sensor);
    check("inside", shoot(scene, 16384, 11), 1.5 * 1.5);
}
