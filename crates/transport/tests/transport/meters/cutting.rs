//! Arcs are cut where they pass from cell to cell, without losing length.

use crate::meters::support::scaled;
use eikonal::ray::Arc;
use glam::{DAffine3, DVec3};
use morgana_transport::meter::{Coordinates, MeterGrid};
use testkit::Rng;

fn random(rng: &mut Rng, scale: f64) -> DVec3 {
    let [a, b, c]: [f64; 3] = rng.uniform();
    (2.0 * DVec3::new(a, b, c) - 1.0) * scale
}

/// Straight and curved arcs through and around the unit ball.
fn arcs() -> Vec<Arc> {
    let mut rng = Rng::new(15);
    let rng = &mut rng;
    let mut arcs = Vec::new();
    for _ in 0..200 {
        arcs.push(Arc::line(random(rng, 1.5), random(rng, 1.0), 2.0));
        let mut end = || [random(rng, 1.5), random(rng, 2.0), random(rng, 4.0)];
        arcs.push(Arc::hermite(end(), end(), 1.0));
    }
    arcs
}

#[test]
fn every_piece_lies_in_one_cell() {
    let cube = scaled(DVec3::splat(2.0), DVec3::NEG_ONE) * DAffine3::from_rotation_z(0.3);
    let rod = DAffine3::from_rotation_x(0.5) * scaled(DVec3::new(1.0, 0.8, 2.0), DVec3::NEG_Z);
    let grids = [
        MeterGrid::new(Coordinates::Cartesian, [5, 7, 6], cube),
        MeterGrid::new(Coordinates::Cylindrical, [5, 1, 6], rod),
        MeterGrid::new(Coordinates::Spherical, [8, 1, 1], DAffine3::IDENTITY),
    ];
    let mut inside = 0;
    for grid in grids.map(Option::unwrap) {
        for arc in arcs() {
            let theta_end = 0.83;
            let mut cuts = Vec::new();
            grid.cut(&arc, theta_end, &mut cuts);
            cuts.extend([0.0, theta_end]);
            cuts.sort_by(f64::total_cmp);
            for piece in cuts.windows(2) {
                let (from, to) = (piece[0], piece[1]);
                let at = |t: f64| grid.cell(arc.position(from + (to - from) * t));
                let cell = at(0.5);
                inside += usize::from(cell.is_some());
                // Both ends of a piece lie on boundaries.
                for i in 1..100 {
                    let t = f64::from(i) / 100.0;
                    let short = (to - from) * arc.velocity(0.5 * (from + to)).length() < 1e-6;
                    assert!(short || at(t) == cell, "{from} to {to} at {t}");
                }
            }
        }
    }
    assert!(inside > 3000, "{inside}");
}

#[test]
fn volumes_of_cells_add_up() {
    let map = DAffine3::from_rotation_y(1.0) * scaled(DVec3::new(2.0, 3.0, 0.5), DVec3::ONE);
    let cases = [
        (Coordinates::Cartesian, [3, 4, 5], 1.0),
        (Coordinates::Cylindrical, [3, 1, 5], std::f64::consts::PI),
        (
            Coordinates::Spherical,
            [6, 1, 1],
            4.0 / 3.0 * std::f64::consts::PI,
        ),
    ];
    for (coordinates, size, local) in cases {
        let grid = MeterGrid::new(coordinates, size, map).unwrap();
        let sum: f64 = (0..grid.cells()).map(|cell| grid.volume(cell)).sum();
        assert!((sum / (3.0 * local) - 1.0).abs() < 1e-12);
        for cell in 0..grid.cells() {
            assert_eq!(grid.cell(grid.middle(cell)), Some(cell));
        }
    }
    assert!(MeterGrid::new(Coordinates::Cylindrical, [3, 2, 5], map).is_none());
    assert!(MeterGrid::new(Coordinates::Cartesian, [3, 0, 5], map).is_none());
    let flat = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0));
    assert!(MeterGrid::new(Coordinates::Cartesian, [1, 1, 1], flat).is_none());
}
