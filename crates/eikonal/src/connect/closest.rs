//! Where along a ray it comes close to a point: starts for connections.

use super::launch::Launch;
use super::pattern::Pattern;
use super::start::Start;
use super::world::Piece;
use glam::DVec3;

/// A piece of a ray with what came before it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leg<R> {
    pub piece: Piece<R>,
    /// Optical path length.
    pub before: f64,
    /// Reflections by choice.
    pub pattern: Pattern,
}

/// Where a piece of a ray comes closest to a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    pub distance: f64,
    /// Along the whole ray.
    pub optical_length: f64,
    /// Reflections by choice until then.
    pub pattern: Pattern,
    /// Unit direction of the ray.
    pub direction: DVec3,
}

impl<R> Leg<R> {
    /// Optical path length of the ray up to the end of this piece.
    pub fn after(&self) -> f64 {
        self.before + self.piece.arc.optical_length(self.piece.theta_end)
    }

    /// Where this piece is closest to `y`.
    pub fn nearest(&self, y: DVec3) -> Nearest {
        let arc = &self.piece.arc;
        let theta = arc.closest_approach(y).min(self.piece.theta_end);
        Nearest {
            distance: arc.position(theta).distance(y),
            optical_length: self.before + arc.optical_length(theta),
            pattern: self.pattern,
            direction: arc.velocity(theta).normalize(),
        }
    }
}

impl Nearest {
    /// The start of a connection here, on the ray of a launch.
    pub fn start<R>(&self, launch: Launch, region: R) -> Start<R> {
        Start {
            launch,
            region,
            optical_length: self.optical_length,
            pattern: self.pattern,
        }
    }
}

/// The local minima of the distance among those of consecutive pieces, except for one at the very
/// start of the ray.
pub(super) fn minima(all: &[Nearest]) -> Vec<Nearest> {
    let distance = |i: Option<usize>| {
        i.and_then(|i| all.get(i))
            .map_or(f64::INFINITY, |n| n.distance)
    };
    (0..all.len())
        .filter(|&i| {
            // Where two pieces share their nearest point the second of them stands for both.
            distance(Some(i)) <= distance(i.checked_sub(1))
                && distance(Some(i)) < distance(Some(i + 1))
        })
        .map(|i| all[i])
        .filter(|n| n.optical_length > 0.0)
        .collect()
}
