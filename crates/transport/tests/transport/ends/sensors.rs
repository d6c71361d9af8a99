//! Sensors: densities of their rays, and positions of their ends.

use crate::ends::support::{FALSE_ALARM, axis, random_map};
use glam::{DAffine3, DVec2, DVec3};
use morgana_transport::connection_end::ConnectionEnd;
use morgana_transport::sampling::Frame;
use morgana_transport::sensor::{
    ApertureShape, ApertureStop, Iris, Orthographic, Perspective, Sensor, SensorRay, Telecentric,
    ThinLens,
};
use std::f64::consts::PI;
use testkit::quadrature::Effort;
use testkit::{DirectionTable, Family, Mass, Rng, Table, uniform_edges};

fn sensors(map: DAffine3) -> [(&'static str, Sensor); 5] {
    let pinhole = Perspective::new(map, 1.4, 1.6);
    let lens = ThinLens::new(pinhole.clone(), 0.3, 1.7);
    let stop = ApertureStop::with_knife(0.2, DVec2::new(1.0, -2.0), 0.05);
    [
        ("perspective", Sensor::Perspective(pinhole)),
        ("thin lens", Sensor::ThinLens(lens)),
        (
            "orthographic",
            Sensor::Orthographic(Orthographic::new(map, 1.6)),
        ),
        ("round", Sensor::Orthographic(Orthographic::round(map))),
        (
            "telecentric",
            Sensor::Telecentric(Telecentric::new(map, 1.6, 1.7, stop)),
        ),
    ]
}

/// Calls `f` for sensors with many maps, each with positions on and around the image and on the
/// lens.
fn for_many(seed: u64, mut f: impl FnMut(&'static str, &Sensor, [f64; 2], [f64; 2])) {
    let mut rng = Rng::new(seed);
    for _ in 0..200 {
        for (name, sensor) in sensors(random_map(&mut rng)) {
            for _ in 0..10 {
                let image = [rng.range(-0.5, 1.5), rng.range(-0.5, 1.5)];
                f(name, &sensor, image, rng.uniform());
            }
        }
    }
}

#[test]
fn a_ray_is_sensed_where_it_came_from() {
    for_many(1, |name, sensor, image, lens| {
        let ray = sensor.ray(image, lens);
        let sensed = sensor.sense(ray.origin, ray.direction).unwrap().image;
        let error = (sensed[0] - image[0]).hypot(sensed[1] - image[1]);
        assert!(error < 1e-11, "{name}: {image:?} becomes {sensed:?}");
    });
}

#[test]
fn nothing_is_sensed_behind_the_sensor() {
    for_many(2, |name, sensor, image, lens| {
        let ray = sensor.ray(image, lens);
        assert_eq!(sensor.sense(ray.origin, -ray.direction), None, "{name}");
    });
}

/// Small change of a ray, as it enters its solid angle or its area across the rays.
fn difference(parallel: bool, a: SensorRay, b: SensorRay) -> DVec3 {
    if parallel {
        a.origin - b.origin
    } else {
        a.direction - b.direction
    }
}

/// `density` agrees with central differences of |∂(image)/∂(ray)|.
#[test]
fn the_density_is_the_jacobian_of_the_ray() {
    let h = 1e-5;
    for_many(3, |name, sensor, [s, t], lens| {
        let ray = sensor.ray([s, t], lens);
        let density = sensor.sense(ray.origin, ray.direction).unwrap().density;
        let along = |ds: f64, dt: f64| {
            let (a, b) = ([s + ds, t + dt], [s - ds, t - dt]);
            difference(
                sensor.is_parallel(),
                sensor.ray(a, lens),
                sensor.ray(b, lens),
            ) / (2.0 * h)
        };
        let size = along(h, 0.0).cross(along(0.0, h)).dot(ray.direction).abs();
        assert!(
            (density * size - 1.0).abs() < 1e-7,
            "{name}: {}",
            density * size
        );
    });
}

/// Effort sufficient to see a corner of the image in a bin.
const EFFORT: Effort = Effort {
    tolerance: 1e-6,
    min_depth: 3,
    max_depth: 9,
};

/// Density of a ray, or zero beyond the image.
fn density(sensor: &Sensor, start: DVec3, direction: DVec3) -> f64 {
    let inside = |image: [f64; 2]| image.iter().all(|x| (0.0..=1.0).contains(x));
    sensor
        .sense(start, direction)
        .filter(|s| inside(s.image))
        .map_or(0.0, |s| s.density)
}

/// Returns the p-value of the directions that leave a fixed point of the sensor.
fn directions(sensor: &Sensor, lens: [f64; 2]) -> f64 {
    let center = sensor.ray([0.5; 2], lens);
    // The border of the image crosses bins. If the image is sheared, it reaches beyond the horizon.
    let table = DirectionTable::uniform(center.direction.to_array(), 32, 16)
        .with_effort(EFFORT)
        .with_mass_tolerance(1e-3);
    let draw = |rng: &mut Rng| Some(sensor.ray(rng.uniform(), lens).direction.to_array());
    let pdf = |d: [f64; 3]| density(sensor, center.origin, d.into());
    table
        .test(1, 100_000, Mass::Exactly(1.0), draw, pdf)
        .unwrap()
        .p_value
}

/// Returns the p-value of the positions of parallel rays.
fn positions(sensor: &Sensor) -> f64 {
    let SensorRay { origin, direction } = sensor.ray([0.5; 2], [0.5; 2]);
    let frame = Frame::from_normal(direction);
    let reach = [[0.0, 0.0], [0.0, 1.0]].map(|c| sensor.ray(c, [0.5; 2]).origin.distance(origin));
    // Both corners of a round image lie on its rim, in conjugate directions of the ellipse.
    let reach = reach[0].hypot(reach[1]) * 1.01;
    let edges = uniform_edges(-reach, reach, 16);
    let draw = |rng: &mut Rng| {
        let ray = sensor.ray(rng.uniform(), [0.5; 2]);
        let local = frame.to_local(ray.origin - origin);
        Some([local.x, local.y])
    };
    let pdf = |[x, y]: [f64; 2]| {
        let start = origin + frame.to_world(DVec3::new(x, y, 0.0));
        density(sensor, start, direction)
    };
    Table::new(edges.clone(), edges)
        .with_effort(EFFORT)
        .with_mass_tolerance(1e-3)
        .test(1, 100_000, Mass::Exactly(1.0), draw, pdf)
        .unwrap()
        .p_value
}

#[test]
fn rays_follow_the_density() {
    let mut rng = Rng::new(4);
    let mut family = Family::new(FALSE_ALARM);
    for round in 0..3 {
        for (name, sensor) in sensors(random_map(&mut rng)) {
            let p = match sensor {
                Sensor::Orthographic(_) | Sensor::Telecentric(_) => positions(&sensor),
                _ => directions(&sensor, rng.uniform()),
            };
            family.push(format!("{name} {round}"), p);
        }
    }
    family.check().unwrap();
}

/// A connection leads to the start of the sensor's rays; for parallel rays, it arrives along their
/// direction.
#[test]
fn ends_are_where_rays_start() {
    for_many(5, |name, sensor, image, lens| {
        let ray = sensor.ray(image, lens);
        let sampled = sensor.sample_end(lens);
        assert!(sampled.delta, "{name}");
        match sampled.end {
            ConnectionEnd::Point { position, surface } => {
                assert_eq!(surface, None, "{name}");
                assert_eq!(position, ray.origin, "{name}");
            }
            ConnectionEnd::Plane {
                through,
                direction,
                beam,
            } => {
                assert!(!beam && direction.distance(ray.direction) < 1e-14, "{name}");
                let ahead = (ray.origin - through).dot(direction);
                assert!(ahead.abs() < 1e-13, "{name}: {ahead}");
            }
        }
    });
}

/// The density of an end is one over the area of a polygon that approximates the rim of the lens.
#[test]
fn ends_are_uniform_over_the_lens() {
    let mut rng = Rng::new(6);
    for _ in 0..20 {
        for (name, sensor) in sensors(random_map(&mut rng)) {
            let pdf = sensor.sample_end([0.2, 0.9]).pdf;
            if name == "telecentric" {
                continue;
            }
            if name != "thin lens" {
                assert_eq!(pdf, 1.0, "{name}");
                continue;
            }
            let rim = |i: usize| {
                // The map takes the four sides of the unit square to the rim, one after the other.
                let a = (i % 1000) as f64 / 1000.0;
                let sides = [[a, 0.0], [1.0, a], [1.0 - a, 1.0], [0.0, 1.0 - a]];
                sensor.ray([0.5; 2], sides[i / 1000 % 4]).origin - sensor.position()
            };
            let twice: DVec3 = (0..4000).map(|i| rim(i).cross(rim(i + 1))).sum();
            let area = 0.5 * twice.length();
            assert!((pdf * area - 1.0).abs() < 1e-5, "{}", pdf * area);
        }
    }
}

/// A disc with a covered middle.
fn covered(obscuration: f64) -> ApertureShape {
    let iris = Iris {
        obscuration,
        ..Iris::default()
    };
    ApertureShape::new(iris).unwrap()
}

/// Ends on an obscured lens are uniform over a ring.
#[test]
fn an_obscured_lens_is_a_ring() {
    let pinhole = Perspective::new(DAffine3::from_scale(DVec3::splat(2.0)), 1.0, 1.0);
    let lens = Sensor::ThinLens(ThinLens::new(pinhole, 0.3, 1.7).with_aperture(covered(0.5)));
    let pdf = lens.sample_end([0.2, 0.9]).pdf;
    assert!((pdf * PI * 0.36 * 0.75 - 1.0).abs() < 1e-12, "{pdf}");
    let mut mean_square = 0.0;
    let n = 300;
    for i in 0..n * n {
        let u = [i % n, i / n].map(|k| (f64::from(k) + 0.5) / f64::from(n));
        let radius = lens.ray([0.5; 2], u).origin.length();
        assert!((0.3 - 1e-12..=0.6 + 1e-12).contains(&radius), "{radius}");
        mean_square += radius * radius / f64::from(n * n);
    }
    // (R² + r²)/2 of a ring between r and R.
    assert!((mean_square - 0.225).abs() < 1e-5, "{mean_square}");
}

/// Tests an axis with which no map of the tests is aligned: grazing rays overflow to no ray, not to
/// NaN.
#[test]
fn rays_along_the_plane_of_the_lens_are_not_sensed() {
    for (name, sensor) in sensors(DAffine3::IDENTITY) {
        let across = DVec3::new(axis().x, axis().y, 0.0).normalize();
        assert_eq!(sensor.sense(DVec3::ZERO, across), None, "{name}");
        let grazing = (across + DVec3::Z * 1e-200).normalize();
        if let Some(s) = sensor.sense(DVec3::ZERO, grazing) {
            assert!(s.density.is_finite() && sensor.is_parallel(), "{name}");
        }
    }
}

/// Slopes of a telecentric camera. Their moments over the half disc beside a knife edge are ∫t dA =
/// −2R³/3 and ∫t² dA = πR⁴/8, over its area. The whole disc and a ring are tested, too.
#[test]
fn slopes_fill_the_open_part_of_the_stop() {
    const R: f64 = 0.3;
    let edge = DVec2::new(0.6, -0.8);
    let moments = |stop: ApertureStop| {
        let sensor = Telecentric::new(DAffine3::IDENTITY, 1.0, 0.0, stop);
        let sensor = Sensor::Telecentric(sensor);
        let n = 400;
        let at = |i: usize| (i as f64 + 0.5) / n as f64;
        let mut sums = [0.0; 4];
        for (i, k) in (0..n).flat_map(|i| (0..n).map(move |k| (i, k))) {
            let d = sensor.ray([0.5; 2], [at(i), at(k)]).direction;
            let slope = d.truncate() / d.z;
            let (t, c) = (slope.dot(edge), slope.perp_dot(edge));
            assert!(slope.length() <= R * (1.0 + 1e-9));
            let values = [t, t * t, c, c * c];
            sums.iter_mut().zip(values).for_each(|(s, v)| *s += v);
        }
        (
            sums.map(|s| s / (n * n) as f64),
            sensor.sample_end([0.5; 2]).pdf,
        )
    };
    let near = |found: [f64; 4], expected: [f64; 4]| {
        let error = |(a, b): (f64, f64)| (a - b).abs();
        let errors = found.into_iter().zip(expected).map(error);
        assert!(errors.fold(0.0, f64::max) < 1e-5, "{found:?} {expected:?}");
    };
    let quarter = R * R / 4.0;
    let (half, pdf) = moments(ApertureStop::with_knife(R, edge, 0.0));
    near(half, [-4.0 * R / (3.0 * PI), quarter, 0.0, quarter]);
    assert!((pdf * PI * R * R / 2.0 - 1.0).abs() < 1e-12);
    let (whole, pdf) = moments(ApertureStop::disc(R));
    near(whole, [0.0, quarter, 0.0, quarter]);
    assert!((pdf * PI * R * R - 1.0).abs() < 1e-12);
    // A ring: ∫t² dA = πR⁴(1 − ε⁴)/4 over an area of πR²(1 − ε²).
    let (ring, pdf) = moments(ApertureStop::new(R, covered(0.6)));
    let open = quarter * (1.0 + 0.6 * 0.6);
    near(ring, [0.0, open, 0.0, open]);
    assert!((pdf * PI * R * R * (1.0 - 0.6 * 0.6) - 1.0).abs() < 1e-12);
}
