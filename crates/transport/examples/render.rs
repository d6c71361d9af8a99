//! A picture of a ball of haze whose index falls from √2 to 1, by two estimators that must agree.
//!
//! `cargo run --release -p morgana-transport --example render`

use eikonal::field::Luneburg;
use glam::DVec3;
use morgana_transport::Scene;
use morgana_transport::emitter::Emitter;
use morgana_transport::integrator::{Bdpt, PathTracer};
use morgana_transport::medium::Medium;
use morgana_transport::render::{RenderOptions, Rendering};
use morgana_transport::scene::Object;
use morgana_transport::sensor::Camera;
use morgana_transport::shape::Sphere;
use std::error::Error;

const SIZE: usize = 24;

fn main() -> Result<(), Box<dyn Error>> {
    let lens = Luneburg::new(1.0, DVec3::ZERO, 1.0)?;
    let ball = Sphere::around(DVec3::ZERO, 1.0)?;
    let scene = Scene::builder()
        .film(SIZE, SIZE / 2)
        .channels(1)
        .camera(Camera::perspective([0.0, 0.0, -5.0], [0.0; 3], 40.0))
        .medium(Medium::homogeneous("haze", lens, 1.0, 0.9))
        .object(Object::builder("ball", ball).interior("haze"))
        .emitter(Emitter::point([0.0, 3.0, 0.0], 100.0))
        .build()?;
    let by_path = scene.render(&RenderOptions::new(PathTracer::default(), 32, 0));
    let by_bdpt = scene.render(&RenderOptions::new(Bdpt::default(), 8, 1));
    show(&by_path);
    let ((mean, error), (other, its_error)) = (by_path.film.summary(), by_bdpt.film.summary());
    println!("path {mean:.5} ± {error:.5}, bdpt {other:.5} ± {its_error:.5}");
    assert!((mean - other).abs() < 4.0 * error.hypot(its_error));
    Ok(())
}

/// The picture in characters.
fn show(rendering: &Rendering) {
    const SHADES: &[u8] = b" .:-=+*#%@";
    let values = rendering.film.mean();
    let most = values.iter().fold(0f32, |a, b| a.max(*b));
    for row in values.chunks(SIZE) {
        let shade = |v: &f32| SHADES[(v / most * 9.0).round() as usize] as char;
        println!("{}", row.iter().map(shade).collect::<String>());
    }
}
