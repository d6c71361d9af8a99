//! A sweep in parallel: the light on a screen behind a graded ball, over the strength of the ball's
//! index.
//!
//! `cargo run --release -p morgana-render --example sweep`

use morgana::emitter::Emitter;
use morgana::field::Gaussian;
use morgana::shape::Sphere;
use morgana::{Bdpt, Camera, Medium, Object, RenderOptions, Scene};
use rayon::prelude::*;
use std::error::Error;

const STRENGTHS: [f64; 5] = [0.0, 0.05, 0.1, 0.15, 0.2];

fn main() -> Result<(), Box<dyn Error>> {
    // Build all scenes first, so that mistakes are reported before rendering. Each render uses the
    // same pool of threads; its result depends on its seed alone.
    let scenes = STRENGTHS
        .map(scene)
        .into_iter()
        .collect::<Result<Vec<_>, _>>()?;
    let options = RenderOptions::new(Bdpt::default(), 64, 0);
    let means: Vec<(f64, f64)> = scenes
        .par_iter()
        .map(|scene| scene.render(&options).film.summary())
        .collect();
    println!("strength  mean radiance ± error");
    for (strength, (mean, error)) in STRENGTHS.iter().zip(&means) {
        println!("{strength:8.2}  {mean:.5} ± {error:.5}");
    }
    Ok(())
}

/// Builds a scene of a hazy ball whose index rises by `strength` towards its middle, lit by a
/// point.
fn scene(strength: f64) -> Result<Scene, Box<dyn Error>> {
    let bump = Gaussian::new(1.0, strength, [0.0; 3].into(), 0.4)?;
    let ball = Sphere::around([0.0; 3].into(), 1.0)?;
    let scene = Scene::builder()
        .film(8, 8)
        .channels(1)
        .camera(Camera::orthographic([0.0, 0.0, -5.0], [0.0; 3], 0.5))
        .medium(Medium::homogeneous("haze", bump, 0.3, 1.0))
        .object(Object::builder("ball", ball).interior("haze"))
        .emitter(Emitter::point([0.0, 3.0, 0.0], 100.0))
        .build()?;
    Ok(scene)
}
