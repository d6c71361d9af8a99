//! Division of curved edges into nearly straight pieces, around which photons are searched.

use crate::path::Span;
use eikonal::Aabb;
use eikonal::ray::Arc;
use glam::DVec3;

/// Maximum distance of a piece from its chord, as a fraction of the radius.
const MAX_SAG: f64 = 0.25;
/// Maximum number of pieces of a span. Longer pieces may be farther from their chords than
/// [`MAX_SAG`] allows. Results stay exact, but more photons are examined.
const MAX_PIECES: f64 = 256.0;

/// Piece of an arc, with the distance within which photons contribute.
pub(crate) struct GatherPiece<'a> {
    arc: &'a Arc,
    /// θ at the ends of the piece.
    range: [f64; 2],
    /// Position and velocity dx/dσ at the ends of the piece.
    ends: [(DVec3, DVec3); 2],
    /// Distance from the piece within which photons contribute; the chord may be `sag` farther
    /// away.
    radius: f64,
    sag: f64,
}

/// Divides a span into pieces. Photons within a radius around the pieces contribute.
pub(crate) fn pieces<'a>(span: &'a Span, radius: f64) -> impl Iterator<Item = GatherPiece<'a>> {
    let (arc, end) = (&span.arc, span.theta_end);
    // Bound the distance from the chord: a Bézier curve of degree 5 deviates from the chord of a
    // piece of width w by at most ⅛ w² 20 D. D bounds the second differences of its control points.
    let c = arc.control();
    let bend = if arc.is_straight() {
        0.0
    } else {
        (0..4)
            .map(|i| (c[i] - 2.0 * c[i + 1] + c[i + 2]).length())
            .fold(0.0, f64::max)
    };
    let sag = move |width: f64| 2.5 * width * width * bend;
    let count = (sag(end) / (MAX_SAG * radius))
        .sqrt()
        .ceil()
        .clamp(1.0, MAX_PIECES) as usize;
    let width = end / count as f64;
    (0..count).map(move |i| {
        let range = [i, i + 1].map(|k| k as f64 * width);
        GatherPiece {
            arc,
            range,
            ends: range.map(|theta| (arc.position(theta), arc.velocity(theta))),
            radius,
            sag: sag(width),
        }
    })
}

impl GatherPiece<'_> {
    /// Returns true if photons in a box may contribute.
    pub(crate) fn touches(&self, bounds: &Aabb) -> bool {
        let b = bounds.grown(self.radius + self.sag);
        let start = self.ends[0].0;
        // Replace zero components, which would lead to incomparable infinities.
        let d = self.chord().to_array();
        let inverse = DVec3::from(d.map(|d| 1.0 / if d == 0.0 { 1e-300 } else { d }));
        let (low, high) = ((b.min - start) * inverse, (b.max - start) * inverse);
        let enter = low.min(high).max_element().max(0.0);
        let exit = low.max(high).min_element().min(1.0);
        enter <= exit
    }

    /// Returns θ of the foot of the perpendicular from a point to the piece, and the squared length
    /// of the perpendicular. Returns `None` if the length exceeds the radius. Adjacent pieces of a
    /// smooth curve never both have the foot.
    pub(crate) fn foot(&self, y: DVec3) -> Option<(f64, f64)> {
        let [start, end] = self.ends;
        let along = (y - start.0).dot(self.chord()) / self.chord().length_squared();
        let nearest = start.0 + self.chord() * along.clamp(0.0, 1.0);
        let reach = self.radius + self.sag;
        if nearest.distance_squared(y) > reach * reach {
            return None;
        }
        // Compute half the derivative of the squared distance with respect to σ.
        let slope = |(x, v): (DVec3, DVec3)| (x - y).dot(v);
        let (a, b) = (slope(start), slope(end));
        if a >= 0.0 || b < 0.0 {
            return None;
        }
        let [low, high] = self.range;
        let mut theta = low + (high - low) * a / (a - b);
        let at = |theta| (self.arc.position(theta), self.arc.velocity(theta));
        let mut place = at(theta);
        // The slope is nearly linear: each step reduces the error by a factor of radius times
        // curvature or more.
        for _ in 0..if self.arc.is_straight() { 0 } else { 2 } {
            theta -= slope(place) / (place.1.length_squared() * self.arc.h());
            theta = theta.clamp(low, high);
            place = at(theta);
        }
        let squared = place.0.distance_squared(y);
        (squared < self.radius * self.radius).then_some((theta, squared))
    }

    fn chord(&self) -> DVec3 {
        self.ends[1].0 - self.ends[0].0
    }
}
