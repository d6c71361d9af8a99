//! Selection of vector instructions, and sums that use them.
//!
//! Processors with fused multiply-add do not round the products in sums separately. Processors of
//! the x86-64 family have fused multiply-add since 2013, unless a virtual machine hides it; ARM
//! processors have it too. All processors with fused multiply-add give identical bits, whatever
//! other instructions they have.

use fearless_simd::{Level, Simd, SimdFloat, f32x4, f32x8, f64x4};
use glam::DVec3;
use std::ops::{Add, Mul, Sub};

/// Returns the vector instructions to use: the widest of this processor, up to four lanes. With
/// eight lanes, additions take less time but moves between lanes take more.
pub(crate) fn level() -> Level {
    let widest = Level::new();
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    let widest = widest.as_avx2().map_or(widest, |avx2| avx2.level());
    widest
}

/// A value that sums with weights of type `W` can add up.
pub(crate) trait Summand<W = f64>:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<W, Output = Self>
{
    /// Returns `self` + `weight`·`of`.
    #[inline(always)]
    fn plus(self, weight: W, of: Self) -> Self {
        self + of * weight
    }
}

/// Vectors outside the functions that are compiled for given instructions: the product is rounded.
impl Summand for DVec3 {}
impl Summand for f64 {}

impl<S: Simd> Summand for f64x4<S> {
    #[inline(always)]
    fn plus(self, weight: f64, of: Self) -> Self {
        of.mul_add(weight, self)
    }
}

impl<S: Simd> Summand<f32> for f32x4<S> {
    #[inline(always)]
    fn plus(self, weight: f32, of: Self) -> Self {
        of.mul_add(weight, self)
    }
}

impl<S: Simd> Summand<f32> for f32x8<S> {
    #[inline(always)]
    fn plus(self, weight: f32, of: Self) -> Self {
        of.mul_add(weight, self)
    }
}

/// Asserts that all vector instructions of this processor give equal values: identical bits if they
/// fuse products and sums, otherwise equal within `rounding`.
#[cfg(all(test, any(target_arch = "x86", target_arch = "x86_64")))]
pub(crate) fn assert_agree(rounding: f64, values: impl Fn(Level) -> Vec<f64>) {
    let widest = Level::new();
    let fused = widest.as_avx2().map(|avx2| avx2.level());
    let others = [
        Some(Level::baseline()),
        widest.as_sse2().map(|sse2| sse2.level()),
        widest.as_sse4_2().map(|sse4_2| sse4_2.level()),
    ];
    let expected = values(widest);
    let bits = |values: Vec<f64>| values.into_iter().map(f64::to_bits).collect::<Vec<_>>();
    if let Some(level) = fused {
        assert!(bits(values(level)) == bits(values(widest)), "{level:?}");
    }
    for level in others.into_iter().flatten() {
        for (found, expected) in values(level).into_iter().zip(&expected) {
            let apart = (found - expected).abs();
            assert!(apart <= rounding, "{level:?}: {found} {expected}");
        }
    }
}
