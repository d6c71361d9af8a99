//! Conservative tests of curves against boxes.

use eikonal::Aabb;
use glam::DVec3;

/// A curve as its chord, run through evenly, and the largest distance from it along each axis.
///
/// The chord is itself a Bézier curve, with evenly spaced control points; the difference of the
/// two lies within the box of the differences of the control points. Hence where the curve is in
/// a box, the chord at the same parameter is in the box grown by that deviation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sweep {
    origin: DVec3,
    inverse: DVec3,
    deviation: DVec3,
}

impl Sweep {
    /// The sweep of a Bézier curve.
    pub fn new<const K: usize>(control: &[DVec3; K]) -> Self {
        let (origin, last) = (control[0], control[K - 1]);
        let chord = last - origin;
        let deviation = (1..K - 1).fold(DVec3::ZERO, |d, i| {
            let even = origin + chord * (i as f64 / (K - 1) as f64);
            d.max((control[i] - even).abs())
        });
        Sweep {
            origin,
            inverse: chord.recip(),
            deviation,
        }
    }

    /// Largest distance from the chord along any axis.
    pub fn deviation(&self) -> f64 {
        self.deviation.max_element()
    }

    /// A part of `range` outside of which the curve is not in the box; `None` if it misses.
    pub fn clip(&self, bounds: &Aabb, range: [f64; 2]) -> Option<[f64; 2]> {
        let a = (bounds.min - self.deviation - self.origin) * self.inverse;
        let b = (bounds.max + self.deviation - self.origin) * self.inverse;
        let [mut enter, mut leave] = range;
        for axis in 0..3 {
            // A NaN (chord within a side of the box) is ignored by min and max.
            enter = enter.max(a[axis].min(b[axis]));
            leave = leave.min(a[axis].max(b[axis]));
        }
        (enter <= leave).then_some([enter, leave])
    }
}
