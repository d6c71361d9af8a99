//! Conservative tests of curves against boxes.

use eikonal::Aabb;
use glam::{DVec3, Vec4};

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
    chord: DVec3,
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
            chord,
            inverse: chord.recip(),
            deviation,
        }
    }

    /// Returns the largest distance from the chord along any axis.
    pub(super) fn deviation(&self) -> f64 {
        self.deviation.max_element()
    }

    /// Returns the part of `range` in which the curve may be in the box, or `None` if the curve
    /// misses the box.
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

/// Rest of a sweep in single precision, for boxes within [−1, 1]³.
///
/// It starts where the curve enters the box around all boxes, and moves at unit speed along the
/// longest component of the chord. Hence all numbers are of the order of one.
#[derive(Clone, Copy, Debug)]
pub(super) struct SingleRay {
    /// For each axis, the coordinate of the start from which the near side of a box is measured,
    /// in all lanes.
    near: [Vec4; 3],
    /// For each axis, the coordinate of the start from which the far side of a box is measured.
    far: [Vec4; 3],
    inverse: [Vec4; 3],
    /// For each axis, 1 if the chord decreases along it, otherwise 0.
    backward: [usize; 3],
    /// Parameter of the sweep at the start.
    start: f64,
    speed: f64,
}

/// Relative growth of the deviation, and of the end of a range, beyond the rounding to single
/// precision.
const SINGLE_SLACK: f64 = 1e-6;

/// Largest component of the reciprocal of a direction. Its product with zero is zero, not NaN. Its
/// product with the rounding of a coordinate is longer than any ray.
const MAX_INVERSE: f32 = 1e30;

impl Sweep {
    /// Returns the direction of the chord, of unit length along its longest component.
    #[inline]
    pub(super) fn direction(&self) -> DVec3 {
        let speed = self.chord.abs().max_element();
        if speed > 0.0 {
            self.chord / speed
        } else {
            self.chord
        }
    }

    /// Returns the point of the chord of a straight line at the parameter `start`.
    #[inline]
    pub(super) fn point(&self, start: f64) -> DVec3 {
        self.starts[0] + self.chord * start
    }

    /// Returns the part of the sweep from the parameter `start` on, in single precision.
    #[inline]
    pub(super) fn single(&self, start: f64) -> SingleRay {
        let slack = self.deviation * SINGLE_SLACK;
        let moved = self.chord * start;
        let starts = [
            (self.starts[0] + moved + slack).as_vec3(),
            (self.starts[1] + moved - slack).as_vec3(),
        ];
        let limit = glam::Vec3::splat(MAX_INVERSE);
        let inverse = self.direction().recip().as_vec3().clamp(-limit, limit);
        let backward = inverse.to_array().map(|i| usize::from(i < 0.0));
        let lanes = |side: fn(usize) -> usize| {
            [0, 1, 2].map(|axis| Vec4::splat(starts[side(backward[axis])][axis]))
        };
        SingleRay {
            near: lanes(|backward| backward),
            far: lanes(|backward| 1 - backward),
            inverse: inverse.to_array().map(Vec4::splat),
            backward,
            start,
            speed: self.chord.abs().max_element(),
        }
    }
}

impl SingleRay {
    /// Returns an upper bound of the parameter of the ray for a parameter of the sweep.
    #[inline]
    pub(super) fn parameter(&self, of_sweep: f64) -> f32 {
        ((of_sweep - self.start) * (self.speed * (1.0 + SINGLE_SLACK))) as f32
    }

    /// Returns, for each of four boxes, a lower bound of the parameter from which on the curve is
    /// in the box. The mask has a bit for each box that the curve may meet before the parameter
    /// `end`. `sides` are, for each axis, the lower and upper bounds of the boxes.
    #[inline]
    pub(super) fn enter(&self, sides: &[[Vec4; 2]; 3], end: f32) -> (Vec4, u32) {
        let (mut enter, mut leave) = (Vec4::ZERO, Vec4::splat(end));
        for (axis, sides) in sides.iter().enumerate() {
            let near = self.backward[axis];
            let inverse = self.inverse[axis];
            enter = ((sides[near] - self.near[axis]) * inverse).max(enter);
            leave = ((sides[1 - near] - self.far[axis]) * inverse).min(leave);
        }
        (enter, enter.cmple(leave).bitmask())
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
