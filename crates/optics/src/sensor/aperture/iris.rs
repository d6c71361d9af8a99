//! Opening of an iris with straight blades, behind obstructions.

use super::sharpen::sharpened;
use super::{ApertureError, MAX_EDGES};
use glam::DVec2;
use std::f64::consts::{PI, TAU};

/// Number of cells along a side of the mask of an iris.
pub(super) const CELLS: usize = 256;
/// Width of a cell, in units of the radius.
const CELL: f64 = 2.0 / CELLS as f64;

/// Iris, with a central obscuration and the vanes that hold the obscuration. Lengths are fractions
/// of the radius. Angles are in radians, from the local x axis towards y. The default is fully
/// open.
///
/// ```
/// use morgana_optics::sensor::{ApertureShape, Iris};
/// let telescope = Iris { obscuration: 0.3, vanes: 4, vane_width: 0.02, ..Iris::default() };
/// assert!(ApertureShape::new(telescope).is_ok());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Iris {
    /// Number of straight blades, 3 to 100. They form a regular polygon with its corners on the
    /// rim. 0 for a disc.
    pub blades: u32,
    /// Angle of a corner of the polygon.
    pub blade_angle: f64,
    /// Radius of the disc that covers the centre, in [0, 1).
    pub obscuration: f64,
    /// Number of straight vanes, up to 100, at equal angles. They extend from the centre, where
    /// their ends are round, to the rim.
    pub vanes: u32,
    /// Width of each vane, in (0, 1].
    pub vane_width: f64,
    /// Angle of a vane.
    pub vane_angle: f64,
}

impl Iris {
    pub(super) fn check(&self) -> Result<(), ApertureError> {
        if !(0.0..1.0).contains(&self.obscuration) {
            return Err(ApertureError::Obscuration(self.obscuration));
        }
        if self.blades != 0 && !(3..=MAX_EDGES).contains(&self.blades) {
            return Err(ApertureError::Blades(self.blades));
        }
        if self.vanes > MAX_EDGES {
            return Err(ApertureError::Vanes(self.vanes));
        }
        if self.vanes > 0 && !(self.vane_width > 0.0 && self.vane_width <= 1.0) {
            return Err(ApertureError::VaneWidth(self.vane_width));
        }
        match [self.blade_angle, self.vane_angle]
            .into_iter()
            .find(|a| !a.is_finite())
        {
            Some(angle) => Err(ApertureError::Angle(angle)),
            None => Ok(()),
        }
    }

    pub(super) fn is_ring(&self) -> bool {
        self.blades == 0 && self.vanes == 0
    }

    /// Returns the open fraction of each cell, row by row from the top left as seen from behind: +x
    /// is to the left, +y upwards.
    pub(super) fn open_shares(&self) -> Vec<f64> {
        let middle = |i: usize| 1.0 - (i as f64 + 0.5) * CELL;
        let edges = Edges::new(self);
        (0..CELLS * CELLS)
            .map(|i| edges.open(DVec2::new(middle(i % CELLS), middle(i / CELLS))))
            .collect()
    }
}

/// Returns the amplitudes of cells with the open fractions `open`. A fraction is a mean over its
/// cell, and the field is uniform over the cell. These two box filters blur like linear
/// interpolation, so the result is sharpened.
pub(super) fn amplitudes(open: &[f64]) -> Vec<f64> {
    let rows: Vec<f64> = open.chunks_exact(CELLS).flat_map(sharpened).collect();
    transposed(
        &transposed(&rows)
            .chunks_exact(CELLS)
            .flat_map(sharpened)
            .collect::<Vec<_>>(),
    )
}

fn transposed(cells: &[f64]) -> Vec<f64> {
    let at = |i: usize| cells[i % CELLS * CELLS + i / CELLS];
    (0..CELLS * CELLS).map(at).collect()
}

/// Directions of the edges of an iris.
struct Edges<'a> {
    iris: &'a Iris,
    /// Directions to the centres of the edges of blades.
    blades: Vec<DVec2>,
    /// Directions of the vanes, outwards.
    vanes: Vec<DVec2>,
}

impl<'a> Edges<'a> {
    fn new(iris: &'a Iris) -> Self {
        let around = |count: u32, from: f64| {
            (0..count)
                .map(move |i| DVec2::from_angle(from + TAU * f64::from(i) / f64::from(count)))
                .collect()
        };
        let half = PI / f64::from(iris.blades.max(1));
        Edges {
            iris,
            blades: around(iris.blades, iris.blade_angle + half),
            vanes: around(iris.vanes, iris.vane_angle),
        }
    }

    /// Returns the open fraction of the cell around a point: the product of the fractions that the
    /// edges leave open.
    fn open(&self, p: DVec2) -> f64 {
        let apothem = (PI / f64::from(self.blades.len().max(1) as u32)).cos();
        let polygon = |towards: &DVec2| share(apothem - p.dot(*towards), *towards);
        let iris: f64 = self.blades.iter().map(polygon).product();
        let radius = p.length();
        let outwards = p.normalize_or(DVec2::X);
        let rim = if self.blades.is_empty() {
            share(1.0 - radius, outwards)
        } else {
            1.0
        };
        let middle = if self.iris.obscuration > 0.0 {
            share(radius - self.iris.obscuration, outwards)
        } else {
            1.0
        };
        let vanes: f64 = self
            .vanes
            .iter()
            .map(|v| 1.0 - self.covered(p, *v))
            .product();
        iris * rim * middle * vanes
    }

    /// Returns the fraction of the cell around a point that a vane covers. The vane has a round end
    /// at the centre.
    fn covered(&self, p: DVec2, along: DVec2) -> f64 {
        let half = 0.5 * self.iris.vane_width;
        if p.dot(along) < 0.0 {
            return share(half - p.length(), p.normalize());
        }
        let across = along.perp();
        let off = p.dot(across);
        share(half - off, across) - share(-half - off, across)
    }
}

/// Returns the fraction of a cell on the inner side of a straight edge, at the signed `distance`
/// from its centre: the integral of a trapezoid.
fn share(distance: f64, normal: DVec2) -> f64 {
    let sides = normal.abs();
    let (long, short) = (sides.max_element(), sides.min_element());
    let off = distance.abs() / CELL;
    let beyond = 0.5 * (long + short) - off;
    let corner = if beyond <= 0.0 {
        0.0
    } else if off <= 0.5 * (long - short) {
        0.5 - off / long
    } else {
        beyond * beyond / (2.0 * long * short)
    };
    if distance > 0.0 { 1.0 - corner } else { corner }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with the fractions of 400² points of a cell.
    #[test]
    fn shares_are_areas() {
        for (angle, distance) in [
            (0.0, 0.2),
            (0.3, 0.1),
            (0.785, -0.4),
            (1.2, 0.55),
            (2.0, 0.8),
        ] {
            let normal = DVec2::from_angle(angle);
            let at = |i: i32| (f64::from(i) + 0.5) / 400.0 - 0.5;
            let points = (0..160_000).map(|i| DVec2::new(at(i % 400), at(i / 400)));
            let inside = points.filter(|p| p.dot(normal) < distance).count() as f64 / 160_000.0;
            assert!(
                (share(distance * CELL, normal) - inside).abs() < 3e-3,
                "{angle}"
            );
        }
    }
}
