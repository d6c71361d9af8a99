//! All rays between two points on either side of a strong lens: a Gaussian bump of the index. Each ray has an optical path length
//! and a Jacobian, by which its light is weighted in place of 1/distance².
//!
//! `cargo run --release -p morgana-eikonal --example branches`

use glam::DVec3;
use morgana_eikonal::connect::{Reach, Unbounded};
use morgana_eikonal::field::Gaussian;
use morgana_eikonal::{Field, Solver, Tolerance};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let lens = Field::from(Gaussian::new(1.0, 0.6, DVec3::ZERO, 0.6)?);
    let (x, y) = (DVec3::new(0.0, 0.0, -3.0), DVec3::new(0.2, 0.0, 3.0));
    let reach = Reach {
        optical_length: 20.0,
        reflections: 0,
        bounces: 0,
    };
    let mut solver = Solver::new(Tolerance::new(1e-8));
    let all = solver.all(&Unbounded(&lens), x, (), y, &reach);
    println!("optical length  arc length    Jacobian  leaves in direction");
    for (_, ray) in &all.branches {
        let [dx, dy, dz] = ray.direction_out.to_array();
        println!(
            "{:14.8}  {:10.6}  {:10.4}  ({dx:.4}, {dy:.4}, {dz:.4})",
            ray.optical_length, ray.arc_length, ray.jacobian
        );
    }
    assert_eq!(all.branches.len(), 3);
    assert!(all.lost.is_none());
    Ok(())
}
