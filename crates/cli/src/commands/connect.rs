//! `morgana connect`.

use crate::args::ConnectArgs;
use crate::failure::Failure;
use crate::load::load_with_warnings;
use eikonal::Solver;
use eikonal::connect::{Connection, Piece, Reach};
use io::Loaded;
use serde_json::{Value, json};
use std::io::Write;
use std::process::ExitCode;
use transport::Scene;
use transport::path::transmittance;
use transport::scene::MediumId;

/// Finds the ray between two points, or all of them, and prints them.
pub fn connect(args: &ConnectArgs) -> Result<ExitCode, Failure> {
    let loaded = load_with_warnings(&args.scene)?;
    let scene = loaded.scene();
    let mut solver = Solver::new(scene.tolerance());
    let ends = [args.from, args.to].map(|x| (x, scene.medium_at(x)));
    let from = ends[0];
    let primary = solver.connect(scene, from, args.to);
    let (mut branches, mut occluded) = (vec![], false);
    if let Ok(found) = &primary {
        occluded = scene.visibility(solver.pieces(), None, 0.0).is_none();
        branches.push(branch(&loaded, found, solver.pieces(), true));
    }
    if args.all {
        branches.clear();
        let reach = reach(scene, args.reflections, primary.as_ref().ok());
        for (start, found) in solver.all(scene, from, args.to, &reach) {
            let first = primary.is_ok_and(|p| solver.is_same_branch(&p, &found));
            // Again, for the pieces of its ray.
            let found = match first {
                true => solver.connect(scene, from, args.to),
                false => solver.solve(scene, &start, args.to),
            };
            let found = found.map(|f| branch(&loaded, &f, solver.pieces(), first));
            branches.extend(found);
        }
    }
    let answer = json!({
        "branches": branches,
        "certified_unique": scene.is_unique(ends[0], ends[1]),
        "failure": primary.err().map(|f| f.to_string()),
        "occluded": occluded,
    });
    writeln!(std::io::stdout(), "{answer:#}")?;
    Ok(ExitCode::SUCCESS)
}

/// As far as connections of a render look for branches, but at least farther than the primary one.
fn reach(scene: &Scene, reflections: u32, primary: Option<&Connection>) -> Reach {
    let render = scene.branch_reach();
    let primary = primary.map_or(0.0, |p| p.optical_length);
    Reach {
        optical_length: render.optical_length.max(2.0 * primary),
        reflections,
        bounces: reflections + (render.bounces - render.reflections),
    }
}

fn branch(loaded: &Loaded, found: &Connection, pieces: &[Piece<MediumId>], primary: bool) -> Value {
    // Where wavelengths have rays of their own, this is a ray of the first.
    let rays = if loaded.is_dispersive() {
        1
    } else {
        loaded.groups.len()
    };
    let groups = loaded.groups[..rays].iter().enumerate();
    let lanes = groups.flat_map(|(group, scene)| {
        let lanes = scene.film().lanes_of(group);
        transmittance(scene, pieces).0.into_iter().take(lanes)
    });
    let transmittance: Vec<f64> = lanes.collect();
    json!({
        "direction_out": found.direction_out.to_array(),
        "direction_in": found.direction_in.to_array(),
        "arc_length": found.arc_length,
        "optical_length": found.optical_length,
        "transmittance": transmittance,
        "jacobian": found.jacobian,
        "iterations": found.shots,
        "reflections": found.pattern.reflections(),
        "occluded": loaded.scene().visibility(pieces, None, 0.0).is_none(),
        "primary": primary,
    })
}
