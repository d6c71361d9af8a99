//! Quantities of unscattered sensor rays, compared with closed forms.

use crate::common::{container, fog, glass, parts, shoot_by, vacuum};
use eikonal::connect::World;
use eikonal::field::{Constant, Gaussian, LinearSquare, Luneburg};
use eikonal::{Field, Tolerance};
use glam::{DAffine3, DMat3, DVec3};
use morgana_transport::aov::{Aov, AovTracer, ReferenceIndex, deflection};
use morgana_transport::bsdf::{Bsdf, Diffuse, Mask, ThinDielectric};
use morgana_transport::medium::Medium;
use morgana_transport::render::Rendering;
use morgana_transport::scene::{Object, Parts};
use morgana_transport::sensor::{Orthographic, Perspective, Sensor, SensorRay, ThinLens};
use morgana_transport::shape::{Rectangle, Shape, Sphere};
use morgana_transport::{Scene, Spectrum};
use std::f64::consts::{PI, TAU};
use testkit::convergence::fit_order;

/// An orthographic sensor at `position` that sees `half` to either side of the z axis and looks along +z.
fn along_z(position: DVec3, half: f64) -> Sensor {
    let map = DAffine3::from_mat3_translation(DMat3::from_diagonal(DVec3::splat(half)), position);
    Sensor::Orthographic(Orthographic::new(map, 1.0))
}

fn ball(radius: f64) -> Shape {
    Sphere::new(DAffine3::from_scale(DVec3::splat(radius)))
        .unwrap()
        .into()
}

/// A ball around the origin of a clear medium of given index, seen along z from z = −`distance`.
fn seen(index: impl Into<Field>, radius: f64, distance: f64, half: f64) -> Parts {
    let media = vec![vacuum(), Medium::transparent("ball", index)];
    let sensor = along_z(DVec3::NEG_Z * distance, half);
    let mut parts = parts(
        vec![container(ball(radius), Bsdf::Null)],
        media,
        vec![],
        sensor,
    );
    parts.tolerance = Tolerance::new(1e-11);
    parts
}

fn all(parts: Parts) -> Rendering {
    shoot_by(AovTracer::default(), parts, 4, 1)
}

/// Traces one ray. Returns its values by channel name.
pub fn of_ray(scene: &Scene, origin: DVec3, direction: DVec3) -> impl Fn(&str) -> f64 + use<> {
    let tracer = AovTracer::default();
    let mut ws = morgana_transport::path::Workspace::new(scene.tolerance());
    let mut values = Vec::new();
    let ray = morgana_transport::sensor::SensorRay { origin, direction };
    tracer.sample(scene, ray, &mut ws, &mut values);
    move |name| values[tracer.channels().position(|n| n == name).unwrap()]
}

fn scene(parts: Parts) -> Scene {
    Scene::new(parts).unwrap_or_else(|problems| panic!("{problems:?}"))
}

/// A parallel ray at distance b from the centre of a weak Gaussian bump turns by ε = ∫∂n/∂b ds/n₀ =
/// −√(2π) Δ b e^(−b²/2w²)/(n₀ w) along b, up to terms of order Δ².
#[test]
fn a_weak_bump_deflects_by_its_gradient() {
    let (n0, w) = (1.33, 0.4);
    for b in [0.2, 0.5] {
        let amplitudes = [1e-2, 5e-3, 2.5e-3, 1.25e-3];
        let errors = amplitudes.map(|delta| {
            let field = Gaussian::new(n0, delta, DVec3::ZERO, w).unwrap();
            let mut parts = seen(field, 4.0, 5.0, 1.0);
            // Match the index around the ball, so that its surface does not refract.
            parts.media[0] = Medium::transparent("around", Constant::new(n0));
            let value = of_ray(&scene(parts), DVec3::new(b, 0.0, -5.0), DVec3::Z);
            let bump = (-b * b / (2.0 * w * w)).exp();
            let expected = -TAU.sqrt() * delta * b * bump / (n0 * w);
            assert!(value("deflection.Y").abs() < 1e-12);
            let error = (value("deflection.X") - expected).abs();
            assert!(error < 0.05 * expected.abs(), "{error} {expected}");
            error
        });
        let fit = fit_order(&amplitudes, &errors);
        assert!((fit.order - 2.0).abs() < 0.05, "order {}", fit.order);
    }
}

/// All parallel rays meet at the far pole, with equal optical lengths from the plane that touches
/// the near pole: ∫n ds = (1 + π/2)R.
#[test]
fn luneburg_lens_is_equally_long_for_all() {
    let (r, tolerance) = (1.5, 1e-8);
    let field = Luneburg::new(1.0, DVec3::ZERO, r).unwrap();
    // The sensor is a little off the plane from which the optical lengths are equal.
    let gap = 0.5;
    let scene = scene(seen(field, r, r + gap, r));
    for (x, y) in [(0.0, 0.0), (0.3, -0.2), (-0.9, 0.4), (0.1, 1.2)] {
        let value = of_ray(&scene, DVec3::new(x, y, -r - gap), DVec3::Z);
        assert_eq!(value("valid"), 1.0);
        let length = value("optical_length") - gap;
        let error = (length - (1.0 + PI / 2.0) * r).abs();
        assert!(error < tolerance, "{error}");
        let exit = ["X", "Y", "Z"].map(|axis| value(&format!("exit.position.{axis}")));
        assert!(DVec3::from_array(exit).distance(DVec3::Z * r) < tolerance);
        // A ray at distance b from the axis leaves the pole at the angle asin(b/R) with it.
        let b = x.hypot(y);
        let z = value("exit.direction.Z");
        assert!((z - (1.0 - (b / r).powi(2)).sqrt()).abs() < 1e-7);
        assert!((value("deflection.X") - (-(x / r)).atan2(z)).abs() < 1e-7);
        assert!((value("deflection.Y") - (-(y / r)).atan2(z)).abs() < 1e-7);
    }
}

/// In a constant index nothing is deflected, and lengths are chords.
#[test]
fn a_homogeneous_ball_deflects_nothing() {
    let media = vec![vacuum(), fog(Constant::new(1.0), 0.7, 0.9, 0.0)];
    let sensor = along_z(DVec3::NEG_Z * 3.0, 1.0);
    let parts = parts(
        vec![container(ball(1.0), Bsdf::Null)],
        media,
        vec![],
        sensor,
    );
    let scene = scene(parts);
    let value = of_ray(&scene, DVec3::new(0.6, 0.0, -3.0), DVec3::Z);
    assert_eq!((value("deflection.X"), value("deflection.Y")), (0.0, 0.0));
    assert!((value("arc_length") - 3.8).abs() < 1e-9);
    assert!((value("optical_length") - 3.8).abs() < 1e-9);
    assert!((value("optical_depth") - 0.7 * 1.6).abs() < 1e-9);
    assert!((value("exit.position.Z") - 0.8).abs() < 1e-9);
    // Past the ball the ray meets nothing: the exit is its start.
    let past = of_ray(&scene, DVec3::new(2.0, 0.0, -3.0), DVec3::Z);
    assert_eq!((past("valid"), past("arc_length")), (1.0, 0.0));
    assert_eq!(past("exit.position.Z"), -3.0);
}

/// A glass slab shifts a slanted ray without turning it. A screen behind the slab ends the ray.
#[test]
fn refraction_up_to_a_screen() {
    let (n, thick) = (1.5, 0.4);
    let slab = DAffine3::from_scale(DVec3::new(3.0, 3.0, 0.5 * thick));
    let slab: Shape = morgana_transport::shape::Cube::new(slab).unwrap().into();
    let screen = DAffine3::from_scale_rotation_translation(
        DVec3::splat(3.0),
        glam::DQuat::from_rotation_y(PI),
        DVec3::Z * 2.0,
    );
    let screen = Object {
        name: "screen".into(),
        shape: Rectangle::new(screen).unwrap().into(),
        bsdf: Bsdf::Diffuse(Diffuse::new(Spectrum::ONE).unwrap()),
        sides: None,
        emitter: None,
    };
    let media = vec![vacuum(), Medium::transparent("glass", Constant::new(n))];
    let objects = vec![container(slab, glass()), screen];
    let scene = scene(parts(
        objects,
        media,
        vec![],
        along_z(DVec3::NEG_Z * 2.0, 1.0),
    ));
    let (sin, cos) = 0.5_f64.sin_cos();
    let value = of_ray(&scene, DVec3::NEG_Z * 2.0, DVec3::new(sin, 0.0, cos));
    let inside = (1.0 - (sin / n).powi(2)).sqrt();
    let x = (4.0 - thick) * sin / cos + thick * sin / n / inside;
    // A ray restarts one ray epsilon off each surface that it leaves.
    let tolerance = 10.0 * scene.ray_epsilon();
    assert!((value("exit.position.X") - x).abs() < tolerance);
    assert!(value("deflection.X").abs() < 1e-12);
    let length = (4.0 - thick) / cos + n * thick / inside;
    assert!((value("optical_length") - length).abs() < tolerance);
}

/// Rays that leave a field which is not closed are lost: their values are zero and counted, never
/// NaN. A ray passes a pane, and a mask that transmits half of the light or more; it ends on other
/// surfaces.
#[test]
fn masks_and_panes_in_front_of_a_screen() {
    let white = || Bsdf::Diffuse(Diffuse::new(Spectrum::ONE).unwrap());
    let mask = |opacity| Bsdf::Mask(Mask::new(Spectrum::splat(opacity), white()).unwrap());
    let pane = ThinDielectric::new(1.5, Spectrum::ONE, Spectrum::ONE).unwrap();
    let at = |z: f64, bsdf: Bsdf| Object {
        bsdf,
        sides: None,
        ..container(
            Rectangle::new(DAffine3::from_translation(DVec3::Z * z)).unwrap(),
            Bsdf::Null,
        )
    };
    for (bsdf, end) in [
        (mask(0.5), 2.0),
        (mask(0.51), 1.0),
        (mask(0.0), 2.0),
        (Bsdf::ThinDielectric(pane), 2.0),
    ] {
        let objects = vec![at(1.0, bsdf), at(2.0, white())];
        let parts = parts(objects, vec![vacuum()], vec![], along_z(DVec3::ZERO, 1.0));
        let value = of_ray(&scene(parts), DVec3::new(0.1, 0.2, 0.0), DVec3::Z);
        assert!((value("exit.position.Z") - end).abs() < 1e-9);
        assert!((value("optical_length") - end).abs() < 1e-9);
    }
}

#[test]
fn lost_rays_are_counted() {
    let index = Luneburg::new(1.0, DVec3::ZERO, 1.0).unwrap();
    let mut parts = seen(index, 1.0, 2.0, 0.5);
    // Replace the ball by an open disc, behind which the medium has no end.
    parts.objects[0].shape =
        morgana_transport::shape::Disk::new(DAffine3::from_scale_rotation_translation(
            DVec3::ONE,
            glam::DQuat::from_rotation_y(PI),
            DVec3::ZERO,
        ))
        .unwrap()
        .into();
    let rendering = all(parts);
    assert_eq!(rendering.stats.lost, 4 * 16);
    assert_eq!(rendering.stats.not_finite, 0);
    assert!(rendering.film.mean().iter().all(|v| *v == 0.0));
}

/// Deflection angles follow the sensor's axes, whatever their directions, and add up for small
/// turns.
#[test]
fn deflection_has_the_signs_of_the_axes() {
    let turn = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(-0.4);
    for mirror in [1.0, -1.0] {
        let axes = turn * DMat3::from_diagonal(DVec3::new(2.0 * mirror, 3.0, 0.5));
        let map = DAffine3::from_mat3(axes);
        let (x, y, z) = (turn.x_axis * mirror, turn.y_axis, turn.z_axis);
        for [ex, ey] in [[1e-4, 2e-4], [-0.3, 0.0], [0.0, 0.2]] {
            let exit = (z + x * f64::tan(ex) + y * f64::tan(ey)).normalize();
            let [dx, dy] = deflection(&map, z, exit);
            assert!((dx - ex).abs() < 1e-12 && (dy - ey).abs() < 1e-12);
        }
    }
}

#[test]
fn results_do_not_depend_on_threads_and_lists() {
    let render = |threads: usize, aovs: &[Aov]| {
        let field = Gaussian::new(1.0, 0.1, DVec3::ZERO, 0.3).unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let tracer = AovTracer::new(aovs);
        let work = || shoot_by(tracer, seen(field, 2.0, 3.0, 1.0), 8, 5);
        pool.build().unwrap().install(work)
    };
    let one = render(1, &Aov::ALL);
    assert_eq!(one.film, render(3, &Aov::ALL).film);
    assert_eq!(one.film.channels(), 39);
    // Rays do not depend on the requested quantities: deflection is channels 7 and 8 of all.
    let two = render(2, &[Aov::Deflection]);
    let (all, some) = (one.film.mean(), two.film.mean());
    for (all, some) in all.chunks(39).zip(some.chunks(3)) {
        assert_eq!([all[0], all[7], all[8]], *some);
    }
}

/// Tests a Gaussian column on a grid of 96 samples, at the default tolerance. W = Δ√(2π) w
/// e^(−x²/2w²) up to terms of order Δ² and the error of the spline, both below 1e-4 of the peak.
/// The film agrees, and in waves the value is W/λ.
#[test]
fn weak_columns_have_the_phase_of_their_contrast() {
    use eikonal::field::{Bspline, Placement};
    let (w, wavelength) = (0.2, 6e-7);
    for delta in [1e-6, 1e-8] {
        let profile = |x: DVec3| 1.0 + delta * (-0.5 * (x.x * x.x + x.z * x.z) / (w * w)).exp();
        let bounds = eikonal::Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
        let grid = Bspline::from_fn([96, 1, 96], bounds, Placement::Nodes, profile).unwrap();
        let cube: Shape = morgana_transport::shape::Cube::new(DAffine3::IDENTITY)
            .unwrap()
            .into();
        let media = vec![vacuum(), Medium::transparent("column", grid)];
        let objects = vec![container(cube, Bsdf::Null)];
        let scene = || {
            scene(parts(
                objects.clone(),
                media.clone(),
                vec![],
                along_z(DVec3::NEG_Z * 3.0, 0.9),
            ))
        };
        let peak = delta * TAU.sqrt() * w;
        let near = |found: f64, x: f64| {
            let expected = peak * (-0.5 * (x / w).powi(2)).exp();
            assert!(
                (found - expected).abs() < 1e-4 * peak,
                "{delta} {x}: {found}"
            );
        };
        let wanted = [Aov::OpticalPathDifference, Aov::Waves];
        let mut tracer = AovTracer::new(&wanted);
        tracer.wavelength = Some(wavelength);
        for i in 0..10 {
            let x = f64::from(i) * 0.08;
            let mut values = Vec::new();
            let mut ws = morgana_transport::path::Workspace::new(Tolerance::default());
            let (origin, direction) = (DVec3::new(x, 0.1, -3.0), DVec3::Z);
            let ray = morgana_transport::sensor::SensorRay { origin, direction };
            tracer.sample(&scene(), ray, &mut ws, &mut values);
            near(values[1], x);
            assert!((values[2] * wavelength - values[1]).abs() < 1e-14 * peak);
        }
    }
}

/// A glass slab contributes its contrast with the reference index. A mirror behind the slab folds
/// the reference ray.
#[test]
fn surfaces_in_a_path_difference() {
    let (n, thick) = (1.5, 0.4);
    let slab = DAffine3::from_scale(DVec3::new(3.0, 3.0, 0.5 * thick));
    let slab: Shape = morgana_transport::shape::Cube::new(slab).unwrap().into();
    let [eta, k] = [0.2, 3.0].map(Spectrum::splat);
    let metal = morgana_transport::bsdf::Conductor::new(eta, k, Spectrum::ONE).unwrap();
    let mirror = Object {
        sides: None,
        ..container(
            Rectangle::new(DAffine3::from_scale_rotation_translation(
                DVec3::splat(3.0),
                glam::DQuat::from_rotation_y(PI),
                DVec3::Z * 2.0,
            ))
            .unwrap(),
            Bsdf::Conductor(metal),
        )
    };
    let media = vec![vacuum(), Medium::transparent("glass", Constant::new(n))];
    let objects = vec![container(slab, glass()), mirror];
    let scene = scene(parts(
        objects,
        media,
        vec![],
        along_z(DVec3::NEG_Z * 2.0, 1.0),
    ));
    let (start, tolerance) = (DVec3::NEG_Z * 2.0, 10.0 * scene.ray_epsilon());
    let value = of_ray(&scene, start, DVec3::Z);
    // The light passes the glass twice, up to its front, and the reference starts where the ray
    // leaves the scene.
    let expected = 2.0 * (n - 1.0) * thick;
    assert!((value("optical_path_difference") - expected).abs() < tolerance);
}

/// Tests a reference field that bends rays and also fills the surroundings. To first order, a bump
/// of 1e-7 in a lens contributes its integral along the ray. The difference to the lens's own
/// length is below that.
#[test]
fn references_may_vary() {
    use eikonal::field::{Field, Gaussian, Sum};
    let lens: Field = Gaussian::new(1.0, 0.3, DVec3::ZERO, 0.5).unwrap().into();
    let (delta, middle) = (1e-7, DVec3::new(0.2, 0.0, 0.1));
    let bump = Gaussian::new(1.0, delta, middle, 0.2).unwrap();
    let both = Sum::new(1.0, vec![lens.clone(), bump.into()]).unwrap();
    let cube: Shape = morgana_transport::shape::Cube::new(DAffine3::IDENTITY)
        .unwrap()
        .into();
    let none = eikonal::field::LinearIndex::new(1.0, DVec3::Z * -0.9, DVec3::Z * -0.9).unwrap();
    let media = vec![
        vacuum(),
        Medium::transparent("both", both),
        Medium::transparent("lens", lens.clone()),
        Medium::transparent("steep", none),
    ];
    let sensor = along_z(DVec3::NEG_Z * 0.9, 0.9);
    let scene = scene(parts(
        vec![container(cube, Bsdf::Null)],
        media,
        vec![],
        sensor,
    ));
    let mut tracer = AovTracer::new(&[Aov::OpticalPathDifference]);
    tracer.reference = Some(ReferenceIndex::Medium(2));
    let mut values = Vec::new();
    let mut ws = morgana_transport::path::Workspace::new(Tolerance::default());
    let (origin, direction) = (DVec3::new(0.3, 0.1, -0.9), DVec3::Z);
    let ray = morgana_transport::sensor::SensorRay { origin, direction };
    tracer.sample(&scene, ray, &mut ws, &mut values);
    // Integrate up to z = 1 along the ray of the lens: δn = Δ bump/n and ds = n dσ.
    let mut expected = 0.0;
    let start = eikonal::ray::Node::new(&lens, origin, direction * lens.n(origin), ());
    let mut flow = eikonal::ray::Flow::new(&lens, start, Tolerance::new(1e-10));
    while flow.node().x.z < 1.0 {
        let step = flow.advance(1e-3, &mut Default::default());
        let x = step.arc.position(0.5);
        expected += delta * (-x.distance_squared(middle) / 0.08).exp() * step.arc.h();
    }
    let error = values[1] / expected - 1.0;
    assert!(
        values[0] == 1.0 && error.abs() < 1e-3,
        "{values:?} {expected}"
    );
    // If no ray of the reference connects the ends, the sensor ray is not valid, and is counted.
    tracer.reference = Some(ReferenceIndex::Medium(3));
    values.clear();
    tracer.sample(&scene, ray, &mut ws, &mut values);
    assert_eq!((values, ws.stats.lost), (vec![0.0; 2], 1));
}

/// In a slab −1 < z < 1 of n² = 1 + g x, rays are parabolas. Between a sensor and a screen at z =
/// 9, the displacement of the screen's points has a closed form for a pinhole, for a point of a
/// lens, and for parallel rays.
#[test]
fn displacements_are_those_of_parabolas() {
    let (slope, pixels, screen) = (0.02, 100.0, 9.0);
    let place = |scale: DVec3, z: f64| {
        DAffine3::from_scale_rotation_translation(scale, glam::DQuat::IDENTITY, DVec3::Z * z)
    };
    let at = DAffine3::from_translation(DVec3::NEG_Z * 6.0);
    let fov = 30f64.to_radians();
    let pinhole = Perspective::new(at, fov, 1.0);
    // Pixels per unit of x, at unit distance from the pinhole and for parallel rays.
    let to_pixels = [pixels / (2.0 * (0.5 * fov).tan()), pixels / 4.0];
    for (sensor, origin, direction) in [
        (
            Sensor::Perspective(pinhole.clone()),
            DVec3::new(0.0, 0.0, -6.0),
            DVec3::new(0.1, 0.05, 1.0),
        ),
        (
            Sensor::ThinLens(ThinLens::new(pinhole, 0.2, 15.0)),
            DVec3::new(0.1, -0.05, -6.0),
            DVec3::new(-0.02, 0.1, 1.0),
        ),
        (
            along_z(DVec3::NEG_Z * 6.0, 2.0),
            DVec3::new(0.4, 0.3, -6.0),
            DVec3::Z,
        ),
    ] {
        let parallel = sensor.is_parallel();
        let slab =
            morgana_transport::shape::Cube::new(place(DVec3::new(50.0, 50.0, 1.0), 0.0)).unwrap();
        let wall = Rectangle::new(place(DVec3::splat(50.0), screen)).unwrap();
        let field = LinearSquare::new(1.0, DVec3::X * slope, DVec3::ZERO).unwrap();
        let media = vec![vacuum(), Medium::transparent("slab", field)];
        let wall = Object {
            sides: None,
            ..container(
                wall,
                Bsdf::Diffuse(Diffuse::new(Spectrum::splat(0.5)).unwrap()),
            )
        };
        let mut parts = parts(
            vec![container(slab, Bsdf::Null), wall],
            media,
            vec![],
            sensor,
        );
        parts.film.width = pixels as usize;
        parts.film.height = pixels as usize;
        parts.tolerance = Tolerance::new(1e-12);
        let scene = scene(parts);
        let tracer = AovTracer::new(&[Aov::Displacement]);
        let mut ws = morgana_transport::path::Workspace::new(scene.tolerance());
        let mut values = Vec::new();
        let ray = SensorRay {
            origin,
            direction: direction.normalize(),
        };
        tracer.sample(&scene, ray, &mut ws, &mut values);
        // The ray obeys dx/dσ = v, of length n, and dv/dσ = ∇n²/2; z grows by v_z σ.
        let entry = origin + direction * (-1.0 - origin.z);
        let v = direction.normalize() * scene.n(1, entry);
        let sigma = 2.0 / v.z;
        let leave = entry + v * sigma + DVec3::X * (0.25 * slope * sigma * sigma);
        let v = v + DVec3::X * (0.5 * slope * sigma);
        let seen = leave + v * ((screen - leave.z) / v.z);
        let expected = if parallel {
            seen - origin
        } else {
            // Compare the apparent direction, on the plane in focus if there is one, with the
            // direction of the ray.
            (seen - origin) / (seen.z - origin.z) - direction
        };
        // x points left, y up.
        let scale = to_pixels[usize::from(parallel)];
        let expected = [expected.x * scale, expected.y * scale];
        assert_eq!(values[0], 1.0);
        assert!(expected[0].abs() > 1.0, "{expected:?}");
        for (found, expected) in values[1..].iter().zip(expected) {
            assert!(
                (found - expected).abs() < 1e-7 * scale,
                "{values:?} {expected:?}"
            );
        }
    }
}
