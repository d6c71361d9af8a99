//! `morgana connect`.

use crate::args::ConnectArgs;
use crate::failure::Failure;
use crate::load::load_with_warnings;
use eikonal::connect::{Connection, Piece};
use eikonal::{Solver, World};
use glam::DVec3;
use io::Loaded;
use serde_json::{Value, json};
use std::io::Write;
use std::process::ExitCode;
use transport::Scene;
use transport::bsdf::Bsdf;
use transport::path::transmittance;
use transport::scene::MediumId;

/// Finds the ray between two points and prints it.
pub fn connect(args: &ConnectArgs) -> Result<ExitCode, Failure> {
    let loaded = load_with_warnings(&args.scene)?;
    let scene = loaded.scene();
    let mut solver = Solver::new(scene.tolerance());
    let start = (args.from, scene.medium_at(args.from));
    let outcome = solver.connect(scene, start, args.to);
    let pieces = solver.pieces();
    let (branches, occluded) = match &outcome {
        Ok(found) => (
            vec![branch(&loaded, found, pieces)],
            scene.is_occluded(pieces, None, 0.0),
        ),
        Err(_) => (vec![], false),
    };
    let answer = json!({
        "branches": branches,
        "certified_unique": certified(scene, args.from, args.to),
        "failure": outcome.err().map(|f| f.to_string()),
        "occluded": occluded,
    });
    writeln!(std::io::stdout(), "{answer:#}")?;
    Ok(ExitCode::SUCCESS)
}

fn branch(loaded: &Loaded, found: &Connection, pieces: &[Piece<MediumId>]) -> Value {
    let lanes = loaded
        .groups
        .iter()
        .flat_map(|scene| transmittance(scene, pieces).0);
    let transmittance: Vec<f64> = lanes.take(loaded.channel_names.len()).collect();
    json!({
        "direction_out": found.direction_out.to_array(),
        "direction_in": found.direction_in.to_array(),
        "arc_length": found.arc_length,
        "optical_length": found.optical_length,
        "transmittance": transmittance,
        "jacobian": found.jacobian,
        "iterations": found.shots,
    })
}

/// Whether no second ray between the points can exist that stays in their medium, or in the scene at
/// all if all its rays are straight.
fn certified(scene: &Scene, x: DVec3, y: DVec3) -> bool {
    let bends = |o: &transport::scene::Object| matches!(o.bsdf, Bsdf::Dielectric(_));
    let straight = scene.media().iter().all(|m| m.index.is_constant());
    if straight && !scene.objects().iter().any(bends) {
        return true;
    }
    let medium = scene.medium_at(x);
    let uniqueness = &scene.regions()[medium].uniqueness;
    medium == scene.medium_at(y) && uniqueness.is_some_and(|u| u.pair(scene.field(medium), x, y))
}
