//! The mean weight of emissions is the emitter's power, and so is what it states.

use crate::support::*;
use morgana_transport::shape::Shape;
use std::f64::consts::{PI, TAU};
use testkit::{Family, Moments, Rng, z_test};

/// Total power over the colour, in closed form; for light from infinity, the power that enters the
/// disc as wide as the surroundings.
fn power(name: &str, shapes: &[Shape]) -> f64 {
    let disc = PI * AROUND.radius * AROUND.radius;
    match name {
        "point" => 4.0 * PI,
        // 2π ∫ sin θ dθ up to the beam's width, and beyond it times a ramp down to the cutoff.
        "spot" => TAU * (1.0 - (CUTOFF.sin() - BEAM_WIDTH.sin()) / (CUTOFF - BEAM_WIDTH)),
        "parallelogram" => PI * shapes[0].area(),
        "ellipsoid" => PI * shapes[1].area(),
        // Pixels times their shares of the sphere, which are those of their solid angles.
        "globe" => PI * shapes[2].area() * image() / (4.0 * PI),
        "directional" => disc,
        "constant" => 4.0 * PI * disc,
        "envmap" => image() * disc,
        // π times the mean pixel times the area of the screen at unit distance.
        "projector" => {
            let (width, height) = IMAGE;
            let mean = (0..width * height).map(pixel).sum::<f64>() / (width * height) as f64;
            let half = (0.5 * FOV).tan();
            PI * mean * 4.0 * half * half * height as f64 / width as f64
        }
        // 2π ∫ (1 − θ/π) sin θ dθ.
        "ies" => TAU,
        "disc beam" | "Gaussian beam" => 1.0,
        _ => f64::NAN,
    }
}

/// ∫ radiance over all directions: pixels times their solid angles.
fn image() -> f64 {
    let (width, height) = IMAGE;
    let solid_angle = |row: usize| {
        let cos = |edge: usize| (PI * edge as f64 / height as f64).cos();
        TAU / width as f64 * (cos(row) - cos(row + 1))
    };
    (0..width * height)
        .map(|i| pixel(i) * solid_angle(i / width))
        .sum()
}

#[test]
fn mean_weight_is_power() {
    let (shapes, mut rng) = (shapes(), Rng::new(7));
    let mut family = Family::new(FALSE_ALARM);
    for (name, emitter) in emitters(color()) {
        let mut weight = [Moments::default(); 4];
        for _ in 0..100_000 {
            let emission = emit(&emitter, &shapes, rng.uniform());
            for (c, moments) in weight.iter_mut().enumerate() {
                moments.push(emission.map_or(0.0, |e| e.emitted[c] / (e.end_pdf * e.pdf)));
            }
        }
        let stated = emitter.power(&AROUND, |object| &shapes[object]);
        for (c, moments) in weight.iter().enumerate() {
            let expected = power(name, &shapes) * color()[c];
            assert!((stated[c] - expected).abs() <= 1e-12 * expected, "{name}");
            if moments.standard_error() > 1e-9 * expected {
                let z = moments.z(expected);
                family.push(format!("{name}, channel {c}"), z_test::p_value(z));
            } else {
                // Every ray has the same weight.
                let error = (moments.mean() - expected).abs();
                assert!(error <= 1e-9 * expected, "{name}: {error}");
            }
        }
    }
    family.check().unwrap();
}
