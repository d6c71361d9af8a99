//! A reference ray of a beam: where connections to the beam start.

use super::launch::Launch;
use super::shoot::{Piece, World, shoot};
use super::solver::Failure;
use crate::ray::{Tolerance, Work};
use glam::DVec3;

/// More starts than a point near a beam that bounces about can need.
const MOST_STARTS: usize = 8;

/// The ray from the centre of a beam's aperture.
///
/// A beam that bends, or bounces inside a tank, passes a point several times. Each local minimum of
/// the distance between the point and this ray is one start for a connection.
#[derive(Clone, Debug)]
pub struct Guide<R> {
    launch: Launch,
    region: R,
    /// Pieces with the optical path length before each.
    pieces: Vec<(f64, Piece<R>)>,
}

impl<R: Copy + PartialEq + std::fmt::Debug> Guide<R> {
    /// Follows the ray from `x` in `direction` over an optical path length.
    pub fn new<W: World<Region = R>>(
        world: &W,
        (x, direction, region): (DVec3, DVec3, R),
        optical_length: f64,
        tolerance: Tolerance,
    ) -> Result<Self, Failure> {
        let launch = Launch::Plane { x, direction };
        let node = launch.node(world.field(region));
        let mut found = Vec::new();
        let mut work = Work::default();
        shoot(
            world,
            (node, region),
            optical_length,
            tolerance,
            &mut found,
            &mut work,
        )?;
        let mut before = 0.0;
        let pieces = found.into_iter().map(|piece| {
            let start = before;
            before += piece.arc.optical_length(piece.theta_end);
            (start, piece)
        });
        Ok(Guide {
            launch,
            region,
            pieces: pieces.collect(),
        })
    }

    /// The launch of the ray, and its region.
    pub fn launch(&self) -> (Launch, R) {
        (self.launch, self.region)
    }

    /// The pieces of the ray, in order.
    pub fn pieces(&self) -> impl Iterator<Item = &Piece<R>> {
        self.pieces.iter().map(|(_, piece)| piece)
    }

    /// The optical path lengths of the ray's closest approaches to `y`, nearest first.
    pub fn starts(&self, y: DVec3) -> Vec<f64> {
        let nearest = |(before, piece): &(f64, Piece<R>)| {
            let theta = piece.arc.closest_approach(y).min(piece.theta_end);
            let distance = piece.arc.position(theta).distance(y);
            (distance, before + piece.arc.optical_length(theta))
        };
        let all: Vec<(f64, f64)> = self.pieces.iter().map(nearest).collect();
        let distance = |i: Option<usize>| i.and_then(|i| all.get(i)).map_or(f64::INFINITY, |n| n.0);
        let mut minima: Vec<(f64, f64)> = (0..all.len())
            .filter(|&i| {
                // Where two pieces share their nearest point the second of them stands for both.
                distance(Some(i)) <= distance(i.checked_sub(1))
                    && distance(Some(i)) < distance(Some(i + 1))
            })
            .map(|i| all[i])
            .collect();
        minima.sort_by(|a, b| a.0.total_cmp(&b.0));
        minima.truncate(MOST_STARTS);
        minima
            .into_iter()
            .map(|(_, length)| length)
            .filter(|s| *s > 0.0)
            .collect()
    }
}
