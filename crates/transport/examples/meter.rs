//! Fluence rate around a point source in a medium that only absorbs, beside its closed form P exp(−μ r)/(4π r²).
//!
//! `cargo run --release -p morgana-transport --example meter`

use eikonal::field::Constant;
use glam::{DAffine3, DVec3};
use morgana_transport::Scene;
use morgana_transport::emitter::Emitter;
use morgana_transport::medium::Medium;
use morgana_transport::meter::{Coordinates, Estimator, FluenceMeter, Meter, MeterGrid};
use morgana_transport::render::{Handle, MeasureOptions, measure};
use morgana_transport::scene::Object;
use morgana_transport::shape::Sphere;
use std::error::Error;
use std::f64::consts::PI;
use std::ops::ControlFlow;

const ABSORPTION: f64 = 2.0;
const POWER: f64 = 1.0;
const SHELLS: usize = 10;

fn main() -> Result<(), Box<dyn Error>> {
    let ball = Sphere::around(DVec3::ZERO, 1.0)?;
    let scene = Scene::builder()
        .film(1, 1)
        .channels(1)
        .medium(Medium::homogeneous(
            "ink",
            Constant::new(1.33),
            ABSORPTION,
            0.0,
        ))
        .object(Object::builder("drop", ball).interior("ink"))
        .emitter(Emitter::point([0.0; 3], POWER / (4.0 * PI)))
        .build()?;
    let shells = MeterGrid::new(Coordinates::Spherical, [SHELLS, 1, 1], DAffine3::IDENTITY);
    let meter = Meter::Fluence(FluenceMeter {
        grid: shells.ok_or("the grid has no cells")?,
        estimator: Estimator::TrackLength,
        optical_length: None,
        weight_windows: false,
        sidebands: None,
        frequency_domain: None,
    });
    let options = MeasureOptions {
        first: 0,
        particles: 20_000,
        seed: 0,
        max_depth: None,
        rr_depth: 5,
    };
    let handle = Handle::default();
    let on_pass = |_| ControlFlow::Continue(());
    let measured = measure(&[scene], &[meter], &options, &handle, on_pass)?;
    let fluence = &measured.readings[0][0];
    println!("     r  fluence rate ± error     closed form");
    for (shell, (value, error)) in fluence.mean.iter().zip(&fluence.error).enumerate() {
        let radius = |i: usize| i as f64 / SHELLS as f64;
        let exact = mean_in_shell(radius(shell), radius(shell + 1));
        println!(
            "{:6.2}  {value:.6} ± {error:.6}  {exact:.6}",
            radius(shell) + 0.05
        );
        assert!((value - exact).abs() <= 5.0 * error + 1e-9 * exact);
    }
    Ok(())
}

/// Mean of P exp(−μ r)/(4π r²) over the volume between two radii.
fn mean_in_shell(a: f64, b: f64) -> f64 {
    let integral = POWER * ((-ABSORPTION * a).exp() - (-ABSORPTION * b).exp()) / ABSORPTION;
    integral / (4.0 / 3.0 * PI * (b.powi(3) - a.powi(3)))
}
