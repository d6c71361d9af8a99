//! The sound of a round transducer, which is known everywhere if it is known in a half plane through the axis.

use super::Places;
use glam::{DVec2, DVec3};

/// Nodes to a wavelength.
const FINE: f64 = 16.0;
/// Nodes along each axis from which values are interpolated, by polynomials of the fifth degree: to 2e-5 of a plane wave.
const NODES: usize = 6;
/// Nodes that lie before a place, and beyond the places' box.
const BEFORE: usize = NODES / 2 - 1;

/// A grid of nodes in the half plane of places (r, z).
pub(super) struct Meridian {
    size: [usize; 2],
    /// Of the first node.
    first: DVec2,
    step: f64,
}

impl Meridian {
    /// For places, and a wavelength.
    pub(super) fn of(places: &Places, wavelength: f64) -> Self {
        let corners = places.corners();
        let radii = corners.map(|c| c.truncate().length());
        let heights = corners.map(|c| c.z);
        let step = wavelength / FINE;
        let [low, high] =
            [f64::min, f64::max].map(|f| heights.into_iter().reduce(f).unwrap_or(0.0));
        // A convex function of the place is largest at a corner.
        let widest = radii.into_iter().fold(0.0, f64::max);
        let nodes = |length: f64| (length / step).ceil() as usize + NODES;
        Meridian {
            size: [nodes(widest), nodes(high - low)],
            first: DVec2::new(0.0, low - step * BEFORE as f64),
            step,
        }
    }

    /// Number of nodes.
    pub(super) fn count(&self) -> usize {
        self.size[0].saturating_mul(self.size[1])
    }

    /// The place of a node.
    pub(super) fn at(&self, i: usize) -> DVec3 {
        let index = DVec2::new((i % self.size[0]) as f64, (i / self.size[0]) as f64);
        let at = self.first + self.step * index;
        DVec3::new(at.x, 0.0, at.y)
    }

    /// Values at places from those at nodes.
    pub(super) fn interpolate(&self, values: &[[f64; 2]], places: &Places) -> Vec<[f64; 2]> {
        (0..places.count())
            .map(|i| self.value(values, places.at(i)))
            .collect()
    }

    fn value(&self, values: &[[f64; 2]], place: DVec3) -> [f64; 2] {
        let at = (DVec2::new(place.truncate().length(), place.z) - self.first) / self.step;
        // A place on the box's lower face may be rounded to below it.
        let cell = at.floor().max(DVec2::new(0.0, BEFORE as f64));
        let [across, along] = [at.x - cell.x, at.y - cell.y].map(weights);
        let (i, j) = (cell.x as isize - BEFORE as isize, cell.y as usize - BEFORE);
        let mut sum = [0.0; 2];
        for (dj, along) in along.iter().enumerate() {
            for (di, across) in across.iter().enumerate() {
                // Even in r.
                let node = (j + dj) * self.size[0] + (i + di as isize).unsigned_abs();
                let [re, im] = values[node];
                sum[0] += along * across * re;
                sum[1] += along * across * im;
            }
        }
        sum
    }
}

/// Lagrange's weights of nodes at −2, −1, 0, 1, 2, 3 for a place between 0 and 1.
fn weights(t: f64) -> [f64; NODES] {
    std::array::from_fn(|i| {
        let node = |k: usize| k as f64 - BEFORE as f64;
        let others = (0..NODES).filter(|k| *k != i);
        others
            .map(|k| (t - node(k)) / (node(i) - node(k)))
            .product()
    })
}
