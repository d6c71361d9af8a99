//! Rays through a graded-index rod: n² = n₀² (1 − α² r²). A ray that enters parallel to the axis crosses it after a quarter of a
//! pitch, 2π/α for rays near the axis.
//!
//! `cargo run --release -p morgana-eikonal --example grin_rod`

use glam::DVec3;
use morgana_eikonal::field::Selfoc;
use morgana_eikonal::ray::{Flow, Node, Work};
use morgana_eikonal::{Field, Tolerance};
use std::error::Error;
use std::f64::consts::PI;

const N0: f64 = 1.5;
const ALPHA: f64 = 0.3;

fn main() -> Result<(), Box<dyn Error>> {
    let rod = Field::from(Selfoc::new(N0, ALPHA, DVec3::ZERO, DVec3::Z)?);
    println!(
        "height  crosses the axis at z  (paraxial {:.6})",
        0.5 * PI / ALPHA
    );
    for height in [0.1, 0.3, 0.5, 0.7, 0.9] {
        let z = crossing(&rod, height);
        println!("{height:6.1}  {z:22.6}");
        // A ray of invariant n(h) along the axis crosses it at n(h)/n₀ · π/(2α).
        let exact = rod.n(DVec3::X * height) / N0 * 0.5 * PI / ALPHA;
        assert!((z - exact).abs() < 1e-6, "{z} is not {exact}");
    }
    Ok(())
}

/// Where a ray that enters the rod parallel to the axis at some height crosses the axis.
fn crossing(rod: &Field, height: f64) -> f64 {
    let x = DVec3::X * height;
    let start = Node::new(rod, x, DVec3::Z * rod.n(x), ());
    let mut flow = Flow::new(rod, start, Tolerance::new(1e-9));
    let mut work = Work::default();
    loop {
        // Steps in σ, of which dσ = ds/n: at most half a unit, and shorter where the tolerance asks for it.
        let step = flow.advance(0.5, &mut work);
        if step.end.x.x <= 0.0 {
            return zero(|theta| step.arc.position(theta));
        }
    }
}

/// z where x(θ) = 0, by bisection: x falls from θ = 0 to 1.
fn zero(position: impl Fn(f64) -> DVec3) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if position(middle).x > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    position(low).z
}
