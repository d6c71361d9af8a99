//! The mean weight of emissions is the emitter's power, and equals the reported power.

use crate::ends::support::*;
use morgana_transport::shape::Shape;
use std::f64::consts::{PI, TAU};
use testkit::{Family, Moments, Rng, z_test};

/// Total power over the colour, in closed form. For light from infinity it is the power through a
/// disc as wide as the surroundings.
fn power(name: &str, shapes: &[Shape]) -> f64 {
    let disc = PI * AROUND.radius * AROUND.radius;
    match name {
        "point" => 4.0 * PI,
        // Integrate 2π ∫ sin θ dθ up to the beam's width, and with a linear ramp from there to the
        // cutoff.
        "spot" => TAU * (1.0 - (CUTOFF.sin() - BEAM_WIDTH.sin()) / (CUTOFF - BEAM_WIDTH)),
        "slide" => slide_power(),
        "parallelogram" => PI * shapes[0].area(),
        "ellipsoid" => PI * shapes[1].area(),
        // Weight pixels by their fractions of the sphere, which are their solid angles.
        "globe" => PI * shapes[2].area() * globe() / (4.0 * PI),
        "directional" => disc,
        "constant" => 4.0 * PI * disc,
        "envmap" => sky() * disc,
        "sun" => TAU * (1.0 - HALF_ANGLE.cos()) * disc,
        // π times the mean pixel times the area of the screen at unit distance. A repeated image
        // has the mean of its pixels for any interpolation.
        "projector" => {
            let (width, height) = IMAGE;
            let mean = (0..width * height).map(pixel).sum::<f64>() / (width * height) as f64;
            let half = (0.5 * FOV).tan();
            PI * mean * 4.0 * half * half * height as f64 / width as f64
        }
        // 2π ∫ (1 − θ/π) sin θ dθ.
        "ies" => TAU,
        "disc beam" | "Gaussian beam" | "rectangle" | "picture" => 1.0,
        "fibre" | "Lambertian fibre" | "Gaussian fibre" | "focused fibre" => 1.0,
        _ => f64::NAN,
    }
}

/// ∫ ramp × image dΩ of a spot with an image, on the plane across its axis on which the cone is the
/// unit disc: dΩ = t² cos³θ dA with t the tangent of the cutoff. The image is bilinear between
/// pixel centres, and constant beyond the outer ones (as if mirrored). A midpoint rule of 2000²
/// points; its errors are below 1e-6 for such smooth pixels.
fn slide_power() -> f64 {
    const POINTS: usize = 2000;
    let (width, height) = IMAGE;
    let along = |uv: f64, n: usize| {
        let at = (uv * n as f64 - 0.5).clamp(0.0, (n - 1) as f64);
        let low = (at as usize).min(n - 2);
        (low, at - low as f64)
    };
    let picture = |u: f64, v: f64| {
        let ((x, s), (y, t)) = (along(u, width), along(v, height));
        let row = |y: usize| (1.0 - s) * pixel(y * width + x) + s * pixel(y * width + x + 1);
        (1.0 - t) * row(y) + t * row(y + 1)
    };
    let middle = |k: usize| (k as f64 + 0.5) / POINTS as f64;
    let tan = CUTOFF.tan();
    let light = |u: f64, v: f64| {
        let r = (2.0 * u - 1.0).hypot(2.0 * v - 1.0) * tan;
        let ramp = ((CUTOFF - r.atan()) / (CUTOFF - BEAM_WIDTH)).clamp(0.0, 1.0);
        ramp * picture(u, v) / (1.0 + r * r).powf(1.5)
    };
    let row = |k: usize| {
        (0..POINTS)
            .map(|i| light(middle(i), middle(k)))
            .sum::<f64>()
    };
    let mean = (0..POINTS).map(row).sum::<f64>() / (POINTS * POINTS) as f64;
    mean * 4.0 * tan * tan
}

/// ∫ radiance over all directions of an environment map. The map is linear in colatitude between
/// rows of pixels, the first and last of which lie at the poles. Simpson's rule on many pieces,
/// with errors below 1e-9.
fn sky() -> f64 {
    let (width, height) = IMAGE;
    let rows: Vec<f64> = (0..height)
        .map(|row| (0..width).map(|x| pixel(row * width + x)).sum())
        .collect();
    let radiance = |theta: f64| {
        let y = theta / PI * (height - 1) as f64;
        let row = (y as usize).min(height - 2);
        let t = y - row as f64;
        ((1.0 - t) * rows[row] + t * rows[row + 1]) * theta.sin()
    };
    let pieces = 200 * (height - 1);
    let step = PI / pieces as f64;
    let simpson = |k: usize| {
        let at = |t: f64| radiance((k as f64 + t) * step);
        // The ends lie just within the piece, because the radiance has a kink at rows of pixels.
        (at(1e-12) + 4.0 * at(0.5) + at(1.0 - 1e-12)) / 6.0
    };
    TAU / width as f64 * step * (0..pieces).map(simpson).sum::<f64>()
}

/// ∫ over all directions of pixels that are constant over their solid angles.
fn globe() -> f64 {
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
            let tolerance = if name == "slide" { 1e-5 } else { 1e-12 };
            let error = (stated[c] - expected).abs();
            assert!(error <= tolerance * expected, "{name}: {error}");
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
