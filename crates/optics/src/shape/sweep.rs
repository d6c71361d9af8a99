//! Conservative tests of curves against boxes.

use eikonal::Aabb;
use glam::DVec3;

/// Chord of a curve, traversed at constant speed, and the largest deviation of the curve from it
/// along each axis.
///
/// The chord is itself a Bézier curve, with evenly spaced control points. The difference of the two
/// curves lies within the box of the differences of the control points. Hence, where the curve is
/// in a box, the chord at the same parameter is in the box grown by the deviation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sweep {
    /// Start of the chord, plus and minus the deviation.
    starts: [DVec3; 2],
    inverse: DVec3,
    deviation: DVec3,
}

impl Sweep {
    /// Creates the sweep of a Bézier curve.
    #[inline]
    pub(super) fn new<const K: usize>(control: &[DVec3; K]) -> Self {
        let (origin, last) = (control[0], control[K - 1]);
        let chord = last - origin;
        let deviation = (1..K - 1).fold(DVec3::ZERO, |d, i| {
            let even = origin + chord * (i as f64 / (K - 1) as f64);
            d.max((control[i] - even).abs())
        });
        Sweep {
            starts: [origin + deviation, origin - deviation],
            inverse: chord.recip(),
            deviation,
        }
    }

    /// Returns the largest distance from the chord along any axis.
    pub(super) fn deviation(&self) -> f64 {
        self.deviation.max_element()
    }

    /// Returns a part of `range` outside of which the curve is not in the box, or `None` if the
    /// curve misses the box.
    #[inline]
    pub(super) fn clip(&self, bounds: &Aabb, range: [f64; 2]) -> Option<[f64; 2]> {
        let a = (bounds.min - self.starts[0]) * self.inverse;
        let b = (bounds.max - self.starts[1]) * self.inverse;
        let [mut enter, mut leave] = range;
        for axis in 0..3 {
            enter = larger(smaller(a[axis], b[axis]), enter);
            leave = smaller(larger(a[axis], b[axis]), leave);
        }
        (enter <= leave).then_some([enter, leave])
    }
}

/// Four boxes that are tested together.
#[derive(Clone, Debug)]
pub(super) struct Four {
    low: [[f64; 4]; 3],
    high: [[f64; 4]; 3],
}

impl Four {
    /// Creates the group from up to four boxes. Copies of the first box replace missing ones.
    pub(super) fn new(boxes: &[Aabb]) -> Self {
        let side = |of: fn(&Aabb) -> DVec3| {
            [0, 1, 2].map(|axis| [0, 1, 2, 3].map(|k| of(boxes.get(k).unwrap_or(&boxes[0]))[axis]))
        };
        Four {
            low: side(|b| b.min),
            high: side(|b| b.max),
        }
    }

    /// Returns, for each box, the parameter in `range` before which the curve is not in the box;
    /// infinity if the curve misses the box.
    #[inline]
    pub(super) fn enter(&self, sweep: &Sweep, range: [f64; 2]) -> [f64; 4] {
        let [mut enter, mut leave] = range.map(|t| [t; 4]);
        for axis in 0..3 {
            let inverse = sweep.inverse[axis];
            let [low, high] = sweep.starts.map(|start| start[axis]);
            for k in 0..4 {
                let a = (self.low[axis][k] - low) * inverse;
                let b = (self.high[axis][k] - high) * inverse;
                enter[k] = larger(smaller(a, b), enter[k]);
                leave[k] = smaller(larger(a, b), leave[k]);
            }
        }
        std::array::from_fn(|k| {
            if enter[k] <= leave[k] {
                enter[k]
            } else {
                f64::INFINITY
            }
        })
    }
}

/// Returns the smaller number, or the second if one is NaN, as for a chord within a side of the
/// box. This takes one instruction; [`f64::min`] takes several.
#[inline]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Returns the larger number, or the second if one is NaN.
#[inline]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
